"""The loop that keeps frames and ingestions moving: it sends what is due and takes back what a dead worker held."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

import structlog

from fullwell.core import FullwellError
from fullwell.jobs.ingestions import IngestionRepository
from fullwell.jobs.queue import TaskQueue
from fullwell.jobs.records import RetryRule
from fullwell.jobs.repository import JobRepository

__all__ = ["Dispatcher", "DispatcherTiming"]

BATCH = 1000
log = structlog.get_logger("fullwell.dispatcher")


@dataclass(frozen=True, slots=True)
class DispatcherTiming:
    """`interval_s` between two rounds; `lost_after_s` is how long a message may be out with nothing waiting."""

    interval_s: float = 2.0
    lost_after_s: float = 30.0
    worker_silence_s: float = 3600.0


class Dispatcher:
    """Runs `round` in a thread of its own. Several processes may each have one: work is claimed in the database."""

    def __init__(
        self,
        repository: JobRepository,
        queue: TaskQueue,
        *,
        ingestions: IngestionRepository,
        rule: RetryRule,
        timing: DispatcherTiming,
    ) -> None:
        self._repository = repository
        self._ingestions = ingestions
        self._queue = queue
        self._rule = rule
        self._timing = timing
        self._wake = threading.Event()
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._loop, name="dispatcher", daemon=True)
        self._last_round = time.monotonic()
        self._last_trouble = ""

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread and wait for it."""
        self._stopped.set()
        self._wake.set()
        if self._thread.is_alive():
            self._thread.join(timeout=15)

    def wake(self) -> None:
        """Do the next round at once: frames were queued."""
        self._wake.set()

    @property
    def silent_for_s(self) -> float:
        """Time since the last complete round [s]."""
        return time.monotonic() - self._last_round

    def round(self) -> None:
        """Take back lost frames, find lost messages, send what is due."""
        for loss in self._repository.reap(self._rule):
            log.warning("frame taken back", job=loss.job_id, frame=loss.number, attempt=loss.attempt, cause=loss.cause)
        for work in self._ingestions.reap(self._rule):
            log.warning("ingestion taken back", ingestion=work.id, attempt=work.attempt, cause=work.cause)
        # Counted before sending: a message of this round must not hide that older ones are lost.
        if self._queue.waiting() == 0:
            forgotten = self._repository.forget_messages(older_than_s=self._timing.lost_after_s)
            ingestions = self._ingestions.forget_messages(older_than_s=self._timing.lost_after_s)
            if forgotten or ingestions:
                log.warning("messages lost by the broker", frames=forgotten, ingestions=ingestions)
        self._send_ingestions()  # before the frames: a curator waits for them, and they are few
        while self._send_due():
            pass
        self._repository.remove_silent_workers(silent_for_s=self._timing.worker_silence_s)

    def _send_ingestions(self) -> None:
        batch = self._ingestions.claim_due(limit=BATCH)
        for position, (ingestion_id, priority) in enumerate(batch):
            try:
                self._queue.enqueue_ingestion(ingestion_id, priority=priority)
            except FullwellError:
                for unsent, _ in batch[position:]:
                    self._ingestions.unclaim(unsent)
                raise
            log.info("ingestion enqueued", ingestion=ingestion_id)

    def _send_due(self) -> bool:
        batch = self._repository.claim_due(limit=BATCH)
        for position, due in enumerate(batch):
            try:
                self._queue.enqueue(due.job_id, due.numbers, priority=due.priority)
            except FullwellError:
                for unsent in batch[position:]:
                    self._repository.unclaim(unsent.job_id, unsent.numbers)
                raise
            log.info("frames enqueued", job=due.job_id, frames=len(due.numbers))
        return sum(len(due.numbers) for due in batch) == BATCH and not self._stopped.is_set()

    def _loop(self) -> None:
        while not self._stopped.is_set():
            try:
                self.round()
            except FullwellError as error:
                self._report(str(error))
            except Exception:  # the loop must outlive whatever a driver raises
                log.exception("dispatcher round failed")
            else:
                self._report("")
                self._last_round = time.monotonic()
            self._wake.wait(self._timing.interval_s)
            self._wake.clear()

    def _report(self, trouble: str) -> None:
        if trouble and trouble != self._last_trouble:
            log.warning("dispatcher cannot work", cause=trouble)
        elif self._last_trouble and not trouble:
            log.info("dispatcher works again")
        self._last_trouble = trouble
