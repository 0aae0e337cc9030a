"""Files appear whole or not at all: written to a temporary name beside the target, then renamed."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["PARTIAL_SUFFIX", "atomic_write", "write_atomically"]

PARTIAL_SUFFIX = ".partial"
"""A crash can leave ``.<name>.<random>.partial`` files behind; nothing ever reads them, and they are safe to delete."""


@contextmanager
def write_atomically(target: Path) -> Iterator[Path]:
    """Yield a temporary path in the target's folder; on success it is flushed and renamed to `target`."""
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}{PARTIAL_SUFFIX}")
    try:
        yield partial
        with partial.open("rb") as stream:
            os.fsync(stream.fileno())
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)


def atomic_write(target: Path, content: bytes) -> None:
    """Write `content` to `target` so that a reader sees the old file or the whole new one."""
    with write_atomically(target) as partial:
        partial.write_bytes(content)
