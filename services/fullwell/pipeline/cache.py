"""Rendered light kept between frames: in this process's memory, and behind that in the object store that workers share."""

from __future__ import annotations

import math
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from fullwell.core.hashing import digest_of
from fullwell.pipeline.keys import light_key
from fullwell.pipeline.maker import maker
from fullwell.pipeline.packing import packed, unpacked
from fullwell.pipeline.plan import FramePlan, PlanStep
from fullwell.pipeline.stage_store import StageStore
from fullwell.radiometry import WavelengthGrid
from fullwell.render import RenderedLight, RenderStatistics, choose_variant
from fullwell.schema.frame import FrameDescription

__all__ = [
    "LightCache",
    "ObtainedLight",
    "decode_light",
    "encode_light",
    "obtain_light",
    "stored_light_key",
    "with_cache_steps",
]

KIND = "light"
_ENTRY_VERSION = 3
_MAX_BYTES = 1 << 30
_FLOAT_BYTES = 4
_MAKERS = ("core", "radiometry", "scene", "render")
"""The packages whose code decides rendered light, beside those whose versions are named."""

Shapes = tuple[tuple[int, ...], tuple[int, ...] | None]


class LightCache:
    """The most recently used light by content key, up to `max_bytes`. Not for use by several threads at once."""

    def __init__(self, max_bytes: int = _MAX_BYTES) -> None:
        self._max_bytes = max_bytes
        self._entries: OrderedDict[str, RenderedLight] = OrderedDict()

    def get(self, key: str) -> RenderedLight | None:
        """Return the light of a key, or None."""
        entry = self._entries.get(key)
        if entry is not None:
            self._entries.move_to_end(key)
        return entry

    def put(self, key: str, light: RenderedLight) -> None:
        """Keep light; the least recently used makes room. What is larger than the cache is not kept."""
        if _bytes(light) > self._max_bytes:
            return
        self._entries[key] = light
        self._entries.move_to_end(key)
        while sum(_bytes(kept) for kept in self._entries.values()) > self._max_bytes:
            self._entries.popitem(last=False)


@dataclass(frozen=True, slots=True, eq=False)
class ObtainedLight:
    """Rendered light, and where it came from.

    Attributes
    ----------
    light
        As rendered, by this process or by the one that kept it: the same bytes.
    source
        "memory" and "store" are hits; "render" is a miss.
    stored_as
        Address of the entry in the object store, or None where no stage store takes part.
    waited_s
        Time spent on waiting for another worker that was rendering the same.
    seconds
        Time that all of it took, rendering and waiting included.
    """

    light: RenderedLight
    source: Literal["memory", "store", "render"]
    stored_as: str | None
    waited_s: float
    seconds: float

    def document(self) -> dict[str, Any]:
        """Return what a manifest says about it; `saved` is what the rendering had cost where and when it was done."""
        hit = self.source != "render"
        return {
            "stage": KIND,
            "result": "hit" if hit else "miss",
            "source": self.source,
            "object": self.stored_as,
            "bytes": _bytes(self.light),
            "seconds": round(self.seconds, 4),
            "waited_s": round(self.waited_s, 4),
            "saved_wall_s": round(self.light.statistics.wall_s, 4) if hit else 0.0,
            "saved_cpu_s": round(self.light.statistics.cpu_s, 4) if hit else 0.0,
        }


def obtain_light(
    key: str,
    render: Callable[[], RenderedLight],
    *,
    shapes: Shapes,
    memory: LightCache,
    stages: StageStore | None = None,
    tick: Callable[[], None] = lambda: None,
) -> ObtainedLight:
    """Return the light of a key from memory, from the object store, or from `render`, and keep it in both.

    Parameters
    ----------
    key
        What decides its bytes: `light_key`.
    render
        Makes the light; its errors are passed on.
    shapes
        Of the replicas and, where they are kept, of the bands: light that the store would not take is not waited for.
    stages
        The cache shared with other workers; None leaves it out.
    tick
        Called while another worker is waited for; may raise, to cancel.
    """
    started = time.perf_counter()
    waited_s = 0.0
    if stages is not None and _bytes_of_shapes(shapes) > stages.max_bytes:
        stages = None
    stored_key = stored_light_key(key) if stages is not None else ""

    def obtained(light: RenderedLight, source: Literal["memory", "store", "render"]) -> ObtainedLight:
        if source != "memory":
            memory.put(key, light)
        address = None if stages is None else stages.address(KIND, stored_key)
        return ObtainedLight(light, source, address, waited_s, time.perf_counter() - started)

    if (kept := memory.get(key)) is not None:
        if stages is not None:
            stages.touch(KIND, stored_key)  # used, though not read: it must not be the next one to be evicted
        return obtained(kept, "memory")
    if stages is None:
        return obtained(render(), "render")
    if (found := _read(stages, stored_key, shapes)) is not None:
        return obtained(found, "store")
    with stages.turn(KIND, stored_key, tick=tick) as turn:
        waited_s = turn.waited_s
        # Another worker may have finished between the look above and the lease, or while it was waited for.
        if (found := _read(stages, stored_key, shapes)) is not None:
            return obtained(found, "store")
        rendered = render()
        stages.put(KIND, stored_key, *encode_light(rendered))
        return obtained(rendered, "render")


def with_cache_steps(plan: FramePlan, frame: FrameDescription, stages: StageStore) -> FramePlan:
    """Return the plan with what the stage cache holds of it now. Manifests keep the plan without: it is the same everywhere."""
    if not plan.radiance:
        return plan
    steps = []
    for lit in plan.lights:
        key = stored_light_key(light_key(frame, lit.rig, lit.plan, variant=choose_variant().variant))
        kept, address = stages.has(KIND, key), stages.address(KIND, key)
        why = f"kept as {address}: not rendered again" if kept else f"not kept yet; will be kept as {address}"
        steps.append(PlanStep(f"{lit.rig.camera.name}: stage cache", "skip" if kept else "run", why))
    return replace(plan, steps=(*plan.steps, *steps))


def _read(stages: StageStore, stored_key: str, shapes: Shapes) -> RenderedLight | None:
    def decode(content: memoryview) -> RenderedLight:
        light = decode_light(content)
        if _shapes(light) != shapes:
            raise ValueError(f"its shapes are {_shapes(light)}, not {shapes}")
        return light

    return stages.read(KIND, stored_key, decode)


def stored_light_key(key: str) -> str:
    """Return the key of an entry that outlives this process: beside the light's own key, who would compute it.

    Another version of the rendering code, of the compiler or of the instruction set rounds otherwise, so it has entries of
    its own: a hit gives the bytes that rendering here would give.
    """
    return digest_of({"light": key, "entry_version": _ENTRY_VERSION, "maker": maker(_MAKERS)})


def encode_light(light: RenderedLight) -> tuple[bytes | memoryview, ...]:
    """Return an exact encoding, in parts to be joined."""
    document = {
        "groups": list(light.groups),
        "grid": [light.grid.first_nm, light.grid.last_nm, light.grid.step_nm],
        "tangent_pitch": light.tangent_pitch,
        "statistics": asdict(light.statistics),
    }
    return packed(document, {"replicas": light.replicas} | ({} if light.bands is None else {"bands": light.bands}))


def decode_light(content: bytes | memoryview) -> RenderedLight:
    """Return what was encoded, bit for bit, in arrays of its own. Raises an error of any kind for other content."""
    document, arrays = unpacked(content)
    first_nm, last_nm, step_nm = document["grid"]
    return RenderedLight(
        replicas=arrays["replicas"],
        bands=arrays.get("bands"),
        groups=tuple(document["groups"]),
        grid=WavelengthGrid(first_nm, last_nm, step_nm),
        tangent_pitch=document["tangent_pitch"],
        statistics=RenderStatistics(**document["statistics"]),
    )


def _shapes(light: RenderedLight) -> Shapes:
    return light.replicas.shape, None if light.bands is None else light.bands.shape


def _bytes(light: RenderedLight) -> int:
    return _bytes_of_shapes(_shapes(light))


def _bytes_of_shapes(shapes: Shapes) -> int:
    """Return the size of an entry's arrays."""
    return _FLOAT_BYTES * sum(math.prod(shape) for shape in shapes if shape is not None)
