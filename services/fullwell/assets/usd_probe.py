"""Reads a USD stage in a process of its own first: a damaged binary layer can take all memory or end the process.

USD maps binary layers ("crates") into memory and trusts the counts inside. What kills this child is refused by the parent with
a message; what the child survives, the parent reads again with the same result.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fullwell.assets.model import ModelSource

__all__ = ["first_line", "layer_references", "needs_probe", "probe", "remember_survivor"]

_BASE_MEMORY_BYTES = 4 << 30
_MEMORY_PER_FILE_BYTE = 16
_BASE_SECONDS = 20.0
_SECONDS_PER_MEGABYTE = 0.2
_REFUSED = 3
_KEPT_SURVIVORS = 1000
_REFERS_TO_LAYER = re.compile(rb"@([^@\n]*\.usd[acz]?)@", re.IGNORECASE)

_survivors: dict[Path, dict[Path, tuple[int, int]]] = {}
"""Size and time of the files of stages that were read well in this process; they need no second probe."""


def first_line(error: Any) -> str:
    """Return what USD says in an error, without the source location of its own code."""
    try:
        said = [str(item.commentary) for item in getattr(error, "args", ()) if hasattr(item, "commentary")]
        lines = "\n".join(said or [str(error)]).strip().splitlines()
    except UnicodeDecodeError:
        # USD quotes the damaged text in its message.
        return "it holds text that is not UTF-8"
    return lines[0].strip()[:200] if lines else type(error).__name__


def layer_references(file: Path) -> list[str]:
    """Return the layers that a text layer names, as written; empty for a binary one."""
    content = file.read_bytes()
    if not content.startswith(b"#usda"):
        return []
    return [path.decode("utf-8", "replace") for path in _REFERS_TO_LAYER.findall(content)]


def needs_probe(file: Path) -> bool:
    """Whether the layer is binary or a package, or text that refers to others, and was not read well before."""
    with file.open("rb") as stream:
        text = stream.read(5) == b"#usda"
    if text and not layer_references(file):
        return False
    known = _survivors.get(file.resolve())
    return known is None or any(_state_of(path) != state for path, state in known.items())


def remember_survivor(file: Path, references: Iterable[Path]) -> None:
    """Note that a stage was read well as its files are now."""
    if len(_survivors) >= _KEPT_SURVIVORS:
        _survivors.pop(next(iter(_survivors)))
    _survivors[file.resolve()] = {path: _state_of(path) for path in (file.resolve(), *references)}


def _state_of(path: Path) -> tuple[int, int]:
    try:
        status = path.stat()
    except OSError:
        return (-1, -1)
    return (status.st_size, status.st_mtime_ns)


def probe(source: ModelSource) -> None:
    """Read the stage in a child process with bounded memory and time; raises ModelError where it does not survive."""
    size = source.file.stat().st_size
    memory_bytes = _BASE_MEMORY_BYTES + _MEMORY_PER_FILE_BYTE * size
    seconds = _BASE_SECONDS + _SECONDS_PER_MEGABYTE * size / 1e6
    command = [sys.executable, "-m", __name__, str(source.file.resolve()), str(memory_bytes)]
    try:
        ended = subprocess.run(command, timeout=seconds, capture_output=True, check=False)
    except subprocess.TimeoutExpired as error:
        raise source.error(f"cannot be read within {seconds:.0f} s; it is damaged or too large", "Export it again") from error
    if ended.returncode != 0:
        # Out of memory is met in the child only: the parent, without its limit, would take what there is.
        said = ended.stdout.decode("utf-8", "replace").strip().splitlines() if ended.returncode == _REFUSED else []
        reason = said[-1][:200] if said else "its reader fails"
        raise source.error(f"is damaged ({reason})", "Check it with usdchecker, or export it again")


def _read_everything(file: str, memory_bytes: int) -> None:
    try:
        import resource  # noqa: PLC0415  (not on Windows)

        resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except ImportError:
        pass
    from pxr import Usd, UsdUtils  # noqa: PLC0415

    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        UsdUtils.ComputeAllDependencies(file)
        stage = Usd.Stage.Open(file, Usd.Stage.LoadAll)
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
            for attribute in prim.GetAttributes():
                attribute.Get()
    except Exception as error:
        print(first_line(error))
        sys.exit(_REFUSED)
    finally:
        del delegate


if __name__ == "__main__":
    _read_everything(sys.argv[1], int(sys.argv[2]))
