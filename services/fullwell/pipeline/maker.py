"""What decides how a stage rounds beside its inputs: code, versions, compiler and processor."""

from __future__ import annotations

import functools
import importlib.metadata
import platform
from pathlib import Path
from typing import Any, Final

import fullwell
from fullwell.core.hashing import digest_of, sha256_file
from fullwell.render import choose_variant

__all__ = ["maker"]

_INSTRUCTION_SETS: Final = ("fma", "avx", "avx2", "avx512f", "neon", "asimd", "sve")


@functools.cache
def maker(packages: tuple[str, ...]) -> dict[str, Any]:
    """Return who would compute a stage here, as plain data; `packages` hold the code that decides its output."""
    root = Path(fullwell.__file__).parent
    files = sorted(file for package in packages for file in (root / package).rglob("*.py"))
    return {
        "code": digest_of([[file.relative_to(root).as_posix(), sha256_file(file)] for file in files]),
        "versions": {name: importlib.metadata.version(name) for name in ("mitsuba", "drjit", "numpy")},
        "llvm": choose_variant().llvm_version,
        "machine": platform.machine(),
        "instruction_sets": _instruction_sets(),
    }


def _instruction_sets() -> list[str]:
    """Return those of the instruction sets that change rounding or the order of sums which this processor has."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return [platform.processor()]
    flags = next((line.partition(":")[2].split() for line in lines if line.startswith(("flags", "Features"))), [])
    return [name for name in _INSTRUCTION_SETS if name in flags]
