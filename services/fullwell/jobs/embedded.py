"""What the embedded service keeps below FULLWELL_HOME: who serves it, and at which address."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from fullwell.core import ServiceError, atomic_write

__all__ = ["ServiceInfo", "hold_home", "publish_service", "running_service"]

LOCK_TRIES = 10


@dataclass(frozen=True, slots=True)
class ServiceInfo:
    """A running `fullwell serve`: its process, its address, and the broker that its workers use."""

    pid: int
    url: str
    broker_url: str


def _lock_file(home: Path) -> Path:
    return home / "run" / "serve.lock"


def _info_file(home: Path) -> Path:
    return home / "run" / "service.json"


@contextlib.contextmanager
def hold_home(home: Path) -> Iterator[None]:
    """Hold the home folder for this process. The kernel gives the lock back however the process ends: no stale locks.

    Raises
    ------
    ServiceError
        Another process holds it, or the folder cannot be written.
    """
    try:
        home.mkdir(parents=True, exist_ok=True, mode=0o700)
        _lock_file(home).parent.mkdir(exist_ok=True, mode=0o700)
        descriptor = os.open(_lock_file(home), os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise ServiceError(
            f"the folder {home} cannot be used: {error.strerror}. Set FULLWELL_HOME to one you may write."
        ) from None
    try:
        if not _locked(descriptor):
            other = _read_info(home)
            who = f"process {other.pid} at {other.url}" if other else "another process"
            raise ServiceError(f"{home} is in use by {who}. Stop it, or set FULLWELL_HOME to another folder.") from None
        _info_file(home).unlink(missing_ok=True)  # of a service that was killed
        yield
        _info_file(home).unlink(missing_ok=True)
    finally:
        os.close(descriptor)


def _locked(descriptor: int) -> bool:
    """Take the lock; a few tries, because a command that looks for the service holds it for a moment too."""
    for _ in range(LOCK_TRIES):
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(0.05)
        else:
            return True
    return False


def publish_service(home: Path, info: ServiceInfo) -> None:
    """Let commands of the same user find the service; nobody else may read it, for the broker's address opens the broker."""
    atomic_write(_info_file(home), json.dumps(asdict(info)).encode())
    _info_file(home).chmod(0o600)


def running_service(home: Path) -> ServiceInfo | None:
    """Return the service that holds the home folder now, None when none does."""
    info = _read_info(home)
    if info is None:
        return None
    try:
        descriptor = os.open(_lock_file(home), os.O_RDONLY)
    except OSError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return info
    else:
        return None  # nobody holds the lock: the file is what a killed service left behind
    finally:
        os.close(descriptor)


def _read_info(home: Path) -> ServiceInfo | None:
    try:
        return ServiceInfo(**json.loads(_info_file(home).read_text()))
    except (OSError, ValueError, TypeError):
        return None
