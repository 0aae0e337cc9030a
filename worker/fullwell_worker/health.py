"""The worker's sign of life: a file that it touches while its event loop runs and the broker answers."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

from fullwell.core import ServiceError

__all__ = ["MAX_AGE_S", "beat", "check_health", "remove"]

MAX_AGE_S = 30.0


def beat(file: Path) -> None:
    """Touch the file."""
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()


def remove(file: Path) -> None:
    """Remove the file: the worker has ended in good order."""
    with contextlib.suppress(OSError):
        file.unlink(missing_ok=True)


def check_health(file: Path) -> float:
    """Return the age of the last sign of life [s]; ServiceError when there is none or it is too old."""
    try:
        age_s = time.time() - file.stat().st_mtime
    except OSError:
        raise ServiceError(f"the worker gave no sign of life: {file} does not exist. Is it started?") from None
    if age_s > MAX_AGE_S:
        raise ServiceError(f"the worker's last sign of life is {age_s:.0f} s old (at most {MAX_AGE_S:.0f} s). Restart it.")
    return age_s
