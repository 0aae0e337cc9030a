"""The Celery worker: one prefork child, late acknowledgement, and a record of every child that dies."""

from __future__ import annotations

import os
import socket
import subprocess
import threading
import time
from typing import Any

import structlog
from billiard.exceptions import WorkerLostError
from celery import Celery, Task, signals
from celery.exceptions import Reject
from celery.worker.request import Request

from fullwell.core import FullwellError, ServiceError
from fullwell.core.settings import Settings
from fullwell.jobs.children import die_with_parent
from fullwell.jobs.database import Database
from fullwell.jobs.queue import RENDER_TASK, celery_application
from fullwell.jobs.repository import JobRepository
from fullwell.storage import store_from_url
from fullwell_worker import health
from fullwell_worker.execution import CurrentJob, WorkerContext, run_frames
from fullwell_worker.loss import Loss, record_loss_in_a_process

__all__ = ["make_worker", "wait_for_schema"]

BEAT_S = 5.0
SCHEMA_PATIENCE_S = 60.0
log = structlog.get_logger("fullwell.worker")


class _Processes:
    """The context of the running process, made at first use after the fork.

    The worker's main process forks children all its life, so it must never hold a database connection while it does: a
    child would inherit SQLite's record of the locks that the parent's threads held at that moment, and wait for them for
    ever. The main process therefore speaks to the database from a process of its own (`fullwell_worker.loss`), or when its
    last child has ended.
    """

    def __init__(self, settings: Settings, name: str) -> None:
        self.settings = settings
        self.name = name
        self.shutting_down = threading.Event()
        self._pid = 0
        self._context: WorkerContext | None = None

    def context(self) -> WorkerContext:
        if self._context is None or self._pid != os.getpid():
            repository = JobRepository(Database(self.settings.database))
            store = store_from_url(self.settings.store)
            self._context = WorkerContext(self.name, self.settings, repository, store, CurrentJob())
            self._pid = os.getpid()
        return self._context


def make_worker(settings: Settings, *, broker_url: str, name: str = "") -> Celery:
    """Return the Celery application with its task and its handlers; run it with ``worker_main``."""
    # A worker's name is unique: frames are given back by it.
    processes = _Processes(settings, f"{name or 'worker'}@{socket.gethostname()}:{os.getpid()}")
    application = celery_application(settings, broker_url)
    _add_task(application, processes)
    _add_handlers(processes)
    return application


def _add_task(application: Celery, processes: _Processes) -> None:
    class FrameRequest(Request):  # type: ignore[misc]
        """A message in the worker's main process, which learns here that its child has died."""

        def on_failure(self, exc_info: Any, send_failed_event: bool = True, return_ok: bool = False) -> Any:
            error = getattr(exc_info.exception, "exc", exc_info.exception)
            if isinstance(error, WorkerLostError | SystemExit):
                _record_loss(processes, self, f"the worker's child process died: {error}")
            return super().on_failure(exc_info, send_failed_event=send_failed_event, return_ok=return_ok)

        def on_timeout(self, soft: bool, timeout: float) -> Any:
            if not soft:
                _record_loss(processes, self, f"the time limit of {timeout:g} s was exceeded")
            return super().on_timeout(soft, timeout)

    class FrameTask(Task):  # type: ignore[misc]
        Request = FrameRequest
        max_retries = 2
        default_retry_delay = 0

    @application.task(name=RENDER_TASK, base=FrameTask, bind=True)  # type: ignore[untyped-decorator]
    def render_frames(self: Any, job_id: str, numbers: list[int]) -> None:
        """Run frames of a job; the database says which of them still need it."""
        try:
            run_frames(processes.context(), str(job_id), [int(number) for number in numbers])
        except ServiceError as error:
            # The database is away: the message goes back to the broker, after a pause, and comes again.
            log.warning("message handed back", job=job_id, cause=str(error))
            time.sleep(BEAT_S)
            raise Reject(str(error), requeue=True) from error
        except FullwellError as error:
            log.warning("message dropped", job=job_id, cause=str(error))


def _record_loss(processes: _Processes, request: Any, cause: str) -> None:
    if processes.shutting_down.is_set() or getattr(request, "_already_cancelled", False):
        return  # an orderly end: the frames are given back when the last child has ended
    try:
        job_id, numbers = request.args
        record_loss_in_a_process(Loss(str(job_id), tuple(numbers), processes.name, cause))
    except (OSError, subprocess.SubprocessError, ValueError, TypeError) as error:
        # The dispatcher finds the dead holder itself, a few seconds later, if without this cause.
        log.warning("loss not recorded", cause=str(error))


def _add_handlers(processes: _Processes) -> None:
    file = processes.settings.health_file
    parent = os.getpid()

    @signals.worker_process_init.connect(weak=False)  # type: ignore[untyped-decorator]
    def _child_started(**_: Any) -> None:
        die_with_parent(parent)
        threading.Thread(target=_beat_forever, args=(processes,), name="worker-beat", daemon=True).start()

    @signals.heartbeat_sent.connect(weak=False)  # type: ignore[untyped-decorator]
    def _alive(**_: Any) -> None:
        health.beat(file)

    @signals.worker_ready.connect(weak=False)  # type: ignore[untyped-decorator]
    def _ready(**_: Any) -> None:
        health.beat(file)

    @signals.worker_shutting_down.connect(weak=False)  # type: ignore[untyped-decorator]
    def _leaving(**_: Any) -> None:
        processes.shutting_down.set()

    @signals.worker_shutdown.connect(weak=False)  # type: ignore[untyped-decorator]
    def _left(**_: Any) -> None:
        processes.shutting_down.set()
        health.remove(file)
        try:
            repository = processes.context().repository
            repository.release_worker(processes.name, cause="the worker was shut down")
            repository.remove_worker(processes.name)
        except FullwellError as error:
            log.warning("not signed off", cause=str(error))


def _beat_forever(processes: _Processes) -> None:
    repository = JobRepository(Database(processes.settings.database))
    while True:
        try:
            repository.beat_worker(processes.name)
        except FullwellError as error:
            log.warning("no sign of life sent", cause=str(error))
        time.sleep(BEAT_S)


def wait_for_schema(database: Database) -> None:
    """Return when the database has this version's tables; ServiceError when nobody makes them."""
    deadline = time.monotonic() + SCHEMA_PATIENCE_S
    while True:
        try:
            if database.is_current():
                return
            problem = "it has not the tables of this version"
        except ServiceError as error:
            problem = str(error)
        if time.monotonic() > deadline:
            raise ServiceError(
                f"the database {database.shown_url} is not usable: {problem}. Start the API first; it makes them."
            )
        time.sleep(1.0)
