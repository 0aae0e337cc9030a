"""Who holds a lease: a process that others on the same machine can prove dead, instead of waiting for the lease to end."""

from __future__ import annotations

import contextlib
import json
import os
import socket
from dataclasses import asdict, dataclass
from pathlib import Path

__all__ = ["ProcessIdentity", "current_process", "is_gone", "process_from_text"]

UNKNOWN = ""


@dataclass(frozen=True, slots=True)
class ProcessIdentity:
    """One process, told apart from a later one with the same number.

    Attributes
    ----------
    machine
        Boot id and process namespace; empty where the system does not tell. Two containers differ here.
    started
        Start time in clock ticks since boot; empty where the system does not tell.
    """

    host: str
    machine: str
    pid: int
    started: str

    def to_text(self) -> str:
        """Return the identity as one line of JSON."""
        return json.dumps(asdict(self), sort_keys=True)


def _machine() -> str:
    with contextlib.suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return f"{boot}/{Path('/proc/self/ns/pid').readlink()}"
    return UNKNOWN


def _state_and_start(pid: int) -> tuple[str, str] | None:
    """Return state letter and start time of a process, None when there is no such process (or no /proc)."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return None
    # The command's name is in brackets and may hold spaces and brackets itself; fields count from behind it.
    fields = text.rpartition(")")[2].split()
    return fields[0], fields[19]


def current_process() -> ProcessIdentity:
    """Return the identity of the calling process."""
    seen = _state_and_start(os.getpid())
    return ProcessIdentity(socket.gethostname(), _machine(), os.getpid(), seen[1] if seen else UNKNOWN)


def process_from_text(text: str) -> ProcessIdentity | None:
    """Return the identity that `to_text` wrote, None when it is not one."""
    try:
        return ProcessIdentity(**json.loads(text))
    except (ValueError, TypeError):
        return None


def is_gone(process: ProcessIdentity) -> bool:
    """Return True only when it is certain that the process has ended: same machine, and no such process there."""
    if not process.machine or process.machine != _machine():
        return False
    seen = _state_and_start(process.pid)
    if seen is None:
        return True
    state, started = seen
    return state in "ZX" or started != process.started
