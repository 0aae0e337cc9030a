"""Ends a worker that takes no messages though some wait: whoever supervises it starts a new one."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from typing import Final

import structlog

from fullwell.core import ServiceError
from fullwell.jobs.queue import TaskQueue

__all__ = ["Watchdog"]

ROUND_S: Final = 5.0
PATIENCE_S: Final = 60.0
"""Longer than the pauses between attempts to connect to a broker that was away."""
EXIT_CODE: Final = 75

log = structlog.get_logger("fullwell.worker")


class Watchdog:
    """Watches from a thread of the worker's main process.

    `activity` returns something that changes whenever a message is taken, or None while there is nothing to watch.
    """

    def __init__(
        self,
        queue: TaskQueue,
        activity: Callable[[], object | None],
        *,
        patience_s: float = PATIENCE_S,
        give_up: Callable[[int], object] = os._exit,
    ) -> None:
        self._queue = queue
        self._activity = activity
        self._patience_s = patience_s
        self._give_up = give_up
        self._seen: object | None = None
        self._since = time.monotonic()

    def start(self) -> None:
        """Start the thread."""
        threading.Thread(target=self._loop, name="watchdog", daemon=True).start()

    def look(self) -> None:
        """Look once; end the process when it has been idle for too long while messages wait."""
        activity = self._activity()
        if activity is None or activity != self._seen or self._nothing_waits():
            self._seen, self._since = activity, time.monotonic()
        elif time.monotonic() - self._since > self._patience_s:
            log.critical("messages wait and none is taken; the worker gives up", seconds=round(self._patience_s))
            # No frame runs, so nothing is lost; and an orderly end may be just what this process cannot do any more.
            self._give_up(EXIT_CODE)

    def _nothing_waits(self) -> bool:
        try:
            return self._queue.waiting() == 0
        except ServiceError:
            return True  # without a broker there is nothing to take

    def _loop(self) -> None:
        while True:
            time.sleep(ROUND_S)
            self.look()
