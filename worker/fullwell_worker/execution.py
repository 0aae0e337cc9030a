"""One frame on a worker: lease, run with a heartbeat, record the outcome."""

from __future__ import annotations

import contextlib
import json
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import structlog

from fullwell.core import (
    AssetError,
    CancelledError,
    ConflictError,
    FieldError,
    FullwellError,
    ServiceError,
    ShapeError,
)
from fullwell.core.settings import Settings
from fullwell.jobs.processes import current_process
from fullwell.jobs.records import Lease, RetryRule
from fullwell.jobs.repository import JobRepository
from fullwell.schema import RecipeDocument, load_recipe
from fullwell.storage import ObjectStore
from fullwell_worker.isolation import IsolatedRunner
from fullwell_worker.limits import limits_of
from fullwell_worker.materials import JobFolder
from fullwell_worker.runners import FrameRunner, PipelineRunner, Progress

__all__ = [
    "CurrentJob",
    "FrameRunner",
    "Heart",
    "PipelineRunner",
    "WorkerContext",
    "frame_prefix",
    "patiently",
    "run_frames",
    "runner_of",
]

T = TypeVar("T")
MAX_BEAT_S = 2.0
PERMANENT = (FieldError, ShapeError, AssetError)
"""Errors that the same recipe would meet again: such a frame is not tried twice."""

log = structlog.get_logger("fullwell.worker")


def runner_of(settings: Settings) -> FrameRunner:
    """Return what runs frames: in a process of its own, or in this one where the settings say so."""
    return IsolatedRunner(settings.store, limits_of(settings)) if settings.isolate else PipelineRunner()


def frame_prefix(job_id: str, number: int) -> str:
    """Return the prefix of a frame's products in the object store."""
    return f"jobs/{job_id}/frames/{number}"


class CurrentJob:
    """The job at hand: its document and its files, kept for its next frame."""

    def __init__(self) -> None:
        self._folder = JobFolder()
        self._job_id = ""
        self._document: RecipeDocument | None = None

    def load(self, job_id: str, repository: JobRepository, store: ObjectStore) -> tuple[RecipeDocument, Path]:
        """Return a job's document and the folder with its files."""
        if self._document is None or self._job_id != job_id:
            given = repository.input_of(job_id)
            self._document = load_recipe(given.recipe_json, overrides=json.loads(given.overrides_json))
            self._base_dir = self._folder.prepare(job_id, json.loads(given.files_json), store)
            self._job_id = job_id
        return self._document, self._base_dir


@dataclass(frozen=True, slots=True)
class WorkerContext:
    """What one worker process works with. Made after the fork."""

    name: str
    settings: Settings
    repository: JobRepository
    store: ObjectStore
    job: CurrentJob
    runner: FrameRunner

    @property
    def rule(self) -> RetryRule:
        """How often a frame may end badly."""
        return RetryRule(self.settings.max_attempts, self.settings.retry_delay_s)


class Heart:
    """A thread that prolongs a lease while its work runs, reports its progress, and learns that it should stop.

    Parameters
    ----------
    prolong
        Takes stage and fraction to the database; returns whether the work is still wanted of this worker.
    fields
        What the log says of a beat that failed.
    """

    def __init__(self, prolong: Callable[[str, float], bool], *, lease_s: float, fields: Mapping[str, object]) -> None:
        self._prolong = prolong
        self._lease_s = lease_s
        self._fields = dict(fields)
        self._progress = ("", 0.0)
        self._stop_asked = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="lease", daemon=True)

    def report(self, progress: Progress) -> None:
        """Take a FrameProgress; it goes to the database with the next beat."""
        self.report_stage(progress.stage, progress.fraction)

    def report_stage(self, stage: str, fraction: float) -> None:
        """Take the stage that runs and the finished share of the whole in [0, 1]."""
        self._progress = (stage, min(1.0, max(0.0, fraction)))

    def should_cancel(self) -> bool:
        """Return whether the job was cancelled or the lease was lost; cheap, to be asked between passes."""
        return self._stop_asked.is_set()

    def __enter__(self) -> Heart:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join(timeout=30)

    def _beat(self) -> None:
        interval_s = min(MAX_BEAT_S, self._lease_s / 4)
        while not self._ended.wait(interval_s):
            try:
                wanted = self._prolong(*self._progress)
            except ServiceError as error:
                # Not a reason to stop: should the lease end meanwhile, whoever is first to publish wins.
                log.warning("heartbeat failed", cause=str(error), **self._fields)
                continue
            if not wanted:
                self._stop_asked.set()


def run_frames(
    context: WorkerContext, job_id: str, numbers: list[int], *, should_stop: Callable[[], bool] = lambda: False
) -> None:
    """Run those of the frames that still need it; start no further one when `should_stop` says so.

    Frames that are left out come again: their message is handed back, and the database knows them as queued.
    """
    for number in numbers:
        if should_stop():
            return
        lease = context.repository.acquire(
            job_id,
            number,
            worker=context.name,
            holder=current_process(),
            lease_s=context.settings.lease_s,
            rule=context.rule,
        )
        if lease is None:
            log.info("nothing to do", job=job_id, frame=number)
            continue
        with structlog.contextvars.bound_contextvars(job=job_id, frame=number, attempt=lease.attempt):
            _run_leased(context, lease)


def _run_leased(context: WorkerContext, lease: Lease) -> None:
    started = time.monotonic()
    log.info("frame started")
    repository, lease_s = context.repository, context.settings.lease_s

    def prolong(stage: str, fraction: float) -> bool:
        beat = repository.heartbeat(lease, lease_s=lease_s, stage=stage, fraction=fraction)
        return beat.still_held and not beat.cancel_requested

    fields = {"job": lease.job_id, "frame": lease.number}
    with Heart(prolong, lease_s=lease_s, fields=fields) as heart, _outcome(context, lease, heart):
        document, base_dir = context.job.load(lease.job_id, repository, context.store)
        prefix = frame_prefix(lease.job_id, lease.number)
        try:
            context.runner(
                document,
                lease.number,
                context.store,
                prefix,
                base_dir=base_dir,
                progress=heart.report,
                should_cancel=heart.should_cancel,
            )
        except ConflictError:
            # Another attempt has published the manifest first: the frame is done, by the other one's products.
            if not context.store.exists(f"{prefix}/manifest.json"):
                raise
        changed = patiently(lambda: repository.complete(lease), context.settings.lease_s)
        log.info("frame done" if changed else "frame was done already", seconds=round(time.monotonic() - started, 3))


@contextlib.contextmanager
def _outcome(context: WorkerContext, lease: Lease, heart: Heart) -> Iterator[None]:
    """Turn what the block raises into the frame's recorded outcome."""
    try:
        yield
    except CancelledError as error:
        if heart.should_cancel():
            log.info("frame stopped")
            patiently(lambda: context.repository.stop(lease), context.settings.lease_s)
        else:
            _record_failure(context, lease, str(error), error.code, retryable=True)
    except FullwellError as error:
        _record_failure(context, lease, str(error), error.code, retryable=not isinstance(error, PERMANENT))
    except MemoryError:
        _record_failure(context, lease, "the frame needs more memory than the worker has", "out_of_memory", retryable=True)
    except Exception as error:  # a programming error in a stage must fail its frame, not the worker
        log.exception("frame failed")
        _record_failure(context, lease, f"{type(error).__name__}: {error}", "internal_error", retryable=True)


def _record_failure(context: WorkerContext, lease: Lease, cause: str, code: str, *, retryable: bool) -> None:
    log.warning("frame attempt failed", cause=cause, code=code, retryable=retryable)
    patiently(
        lambda: context.repository.fail(lease, cause=cause, code=code, retryable=retryable, rule=context.rule),
        context.settings.lease_s,
    )


def patiently(action: Callable[[], T], patience_s: float) -> T:
    """Return what `action` returns, trying again while the database is away, for `patience_s` at most."""
    deadline = time.monotonic() + patience_s
    while True:
        try:
            return action()
        except ServiceError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.5)
