"""Launches of the path loop replayed from a recording: tracing the loop's Python takes longer than small launches run."""

from __future__ import annotations

import gc
from collections.abc import Callable, Hashable
from typing import Any

__all__ = ["device_arrays", "replayed"]

_MANY_RECORDINGS = 32
"""One for each number of lanes; more would mean that something else differs, and Dr.Jit says so."""


class _Recorded:
    """What a frozen function calls when it has to record.

    Not a list: Dr.Jit looks into lists that a function refers to, and would record anew for each other content.
    """

    def __init__(self) -> None:
        self.function: Callable[..., Any] | None = None


_recordings: dict[Hashable, tuple[Any, _Recorded]] = {}
"""By kind of kernel: the frozen function, and what it calls when it has to record."""


def replayed(kind: Hashable, function: Callable[..., Any], scene: Any, arrays: list[Any], *arguments: Any) -> Any:
    """Return ``function(scene, *arguments)`` from the recording of its kind, made now where there is none that fits.

    `kind` names everything about `function` that is not in its arguments or in `arrays`, the device arrays that it reads from
    elsewhere. All scenes of a kind share one recording: their numbers are in these arrays, never in the code.
    """
    import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

    known = _recordings.get(kind)
    if known is None:
        recorded = _Recorded()

        def record(scene: Any, arrays: list[Any], *arguments: Any) -> Any:
            del arrays  # what `function` reads by itself; named here so that the recording takes them as inputs
            assert recorded.function is not None
            return recorded.function(scene, *arguments)

        known = _recordings[kind] = (dr.freeze(record, warn_after=_MANY_RECORDINGS), recorded)
    frozen, of_kind = known
    of_kind.function = function
    # A collection in the middle of a recording would free arrays of earlier scenes, which Dr.Jit cannot record: it aborts.
    collecting = gc.isenabled()
    gc.disable()
    try:
        return frozen(scene, arrays, *arguments)
    finally:
        of_kind.function = None
        if collecting:
            gc.enable()


def device_arrays(*objects: Any) -> list[Any]:
    """Return the Dr.Jit arrays that the package's own objects hold, each once, in an order that their structure decides.

    Objects of a class that says it is `host_only` are not looked into: a street has ten thousand parts.
    """
    import drjit as dr  # noqa: PLC0415

    seen: set[int] = set()
    found: list[Any] = []

    def visit(value: Any) -> None:
        if id(value) in seen:
            return
        if dr.is_array_v(value):
            seen.add(id(value))
            found.append(value)
        elif isinstance(value, list | tuple):
            for item in value:
                visit(item)
        elif isinstance(value, dict):
            for name in sorted(value):
                visit(value[name])
        elif type(value).__module__.startswith("fullwell.render") and not getattr(type(value), "host_only", False):
            seen.add(id(value))
            names = getattr(value, "__dict__", None) or dict.fromkeys(getattr(value, "__slots__", ()))
            for name in sorted(names):
                visit(getattr(value, name, None))

    for item in objects:
        visit(item)
    return found
