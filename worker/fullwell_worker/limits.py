"""What a render process may use, and what it uses."""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fullwell.core.settings import Settings

__all__ = ["GIB", "RenderLimits", "limits_of", "resident_bytes"]

CANCEL_PATIENCE_S: Final = 10.0
SHARE_OF_MACHINE: Final = 0.9
"""The rest of the memory is the worker's own and the kernel's, so that this limit is met before the kernel's."""
GIB: Final = 1 << 30
THREAD_BYTES: Final = 16 << 20
"""Stack and scratch of one thread of the renderer, allocated but hardly touched."""


@dataclass(frozen=True, slots=True)
class RenderLimits:
    """What one render process may use.

    Attributes
    ----------
    memory_bytes
        Resident size above which the process is ended.
    recycle_bytes
        Resident size after a frame above which a new process makes the next one.
    time_s
        Time for one frame.
    max_frames
        Frames after which a new process makes the next one.
    cancel_patience_s
        Time in which a cancelled frame must stop before its process is ended.
    """

    memory_bytes: int
    recycle_bytes: int
    time_s: float
    max_frames: int
    cancel_patience_s: float = CANCEL_PATIENCE_S

    @property
    def ceiling_bytes(self) -> int:
        """Allocated memory, touched or not, beyond which the process gets none [bytes]."""
        return self.memory_bytes + self.memory_bytes // 4 + GIB + THREAD_BYTES * (os.cpu_count() or 1)


def limits_of(settings: Settings) -> RenderLimits:
    """Return the limits that the settings ask for; without a memory limit, nine tenths of what machine or container has."""
    memory_bytes = settings.render_memory_bytes or int(SHARE_OF_MACHINE * _machine_bytes())
    recycle_bytes = min(settings.max_memory_per_child_mib << 20, memory_bytes // 2)
    return RenderLimits(memory_bytes, recycle_bytes, settings.frame_time_limit_s, settings.render_max_frames)


def resident_bytes(pid: int) -> int:
    """Return a process's resident size [bytes], 0 where it has ended or the system does not tell."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError, ValueError):
        return 0


def _machine_bytes() -> int:
    """Return the memory of the machine, or of the container where it has less [bytes]."""
    sizes = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    for file in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        with contextlib.suppress(OSError, ValueError):  # absent, or "max"
            sizes.append(int(Path(file).read_text()))
    return min(sizes)
