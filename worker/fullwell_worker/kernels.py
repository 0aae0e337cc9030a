"""Compiled kernels that the image brings along: put where the renderer looks for them, which may be an empty volume."""

from __future__ import annotations

import contextlib
from pathlib import Path

from fullwell.core import atomic_write

__all__ = ["bring_kernels"]

FOLDER = ".drjit"
"""Below the user's home. All processes of a user share it: an entry's name is the digest of its code, the processor's name
included, so a file of another kind of machine is just not found."""


def bring_kernels(source: Path | None, home: Path | None = None) -> int:
    """Copy the kernels that are not there yet from `source` to the user's cache; return how many. Never fails."""
    if source is None:
        return 0
    count = 0
    with contextlib.suppress(OSError, RuntimeError):  # a cache: without it, the first frames compile
        target = (home or Path.home()) / FOLDER
        for file in sorted(source.glob("*.bin")):
            if not (target / file.name).exists():
                atomic_write(target / file.name, file.read_bytes())
                count += 1
    return count
