"""The Celery worker: one prefork child, late acknowledgement, and a record of every child that dies."""

from __future__ import annotations

import mmap
import os
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import structlog
from billiard.exceptions import WorkerLostError
from celery import Celery, Task, signals
from celery.apps.worker import Worker
from celery.exceptions import Reject
from celery.worker.request import Request
from kombu.asynchronous import get_event_loop

from fullwell.core import FullwellError, ServiceError
from fullwell.core.settings import Settings
from fullwell.jobs.children import die_with_parent
from fullwell.jobs.database import Database
from fullwell.jobs.ingestions import IngestionRepository
from fullwell.jobs.queue import INGEST_TASK, RENDER_TASK, CeleryTaskQueue, TaskQueue, celery_application
from fullwell.jobs.repository import JobRepository
from fullwell.storage import store_from_url
from fullwell_worker import health
from fullwell_worker.execution import CurrentJob, WorkerContext, run_frames, runner_of
from fullwell_worker.ingesting import AssetContext, asset_context, run_ingestion
from fullwell_worker.loss import Loss, record_loss_in_a_process
from fullwell_worker.watchdog import Watchdog

__all__ = ["QueueWorker", "wait_for_schema"]

BEAT_S = 5.0
LEAVING_POLL_S = 0.1
SHUT_DOWN = "the worker was shut down"
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
        # Three bytes that the main process and its children share: whether the worker was asked to end, whether a child
        # runs a frame, and a count of messages that runs over.
        self._flags = mmap.mmap(-1, 3)
        self._pid = 0
        self._context: WorkerContext | None = None
        self._assets: AssetContext | None = None

    @property
    def leaving(self) -> bool:
        """Whether the worker was asked to end."""
        return self._flags[0] != 0

    def leave(self) -> None:
        self._flags[0] = 1

    @property
    def busy(self) -> bool:
        """Whether a child runs a frame."""
        return self._flags[1] != 0

    def idle_since_message(self) -> int | None:
        """Return the count of messages while the worker should be taking the next one, None otherwise."""
        return None if self.busy or self.leaving else self._flags[2]

    def rest(self) -> None:
        self._flags[1] = 0

    @contextmanager
    def working(self) -> Iterator[None]:
        self._flags[1] = 1
        self._flags[2] = (self._flags[2] + 1) % 256
        try:
            yield
        finally:
            self._flags[1] = 0

    def context(self) -> WorkerContext:
        if self._context is None or self._pid != os.getpid():
            repository = JobRepository(Database(self.settings.database))
            store = store_from_url(self.settings.store)
            self._context = WorkerContext(self.name, self.settings, repository, store, CurrentJob(), runner_of(self.settings))
            self._assets = None
            self._pid = os.getpid()
        return self._context

    def assets(self) -> AssetContext:
        """The context of work on assets; previews are rendered by the same render process as frames."""
        context = self.context()
        if self._assets is None:
            database = Database(self.settings.database)
            self._assets = asset_context(self.name, self.settings, database, context.store, context.runner)
        return self._assets


class QueueWorker:
    """One worker: its main process, its one child, which takes frames, and that one's render process, which makes them."""

    def __init__(self, settings: Settings, *, broker_url: str, name: str = "") -> None:
        self._label = name or "worker"
        # A worker's name is unique: frames are given back by it.
        self._processes = _Processes(settings, f"{self._label}@{socket.gethostname()}:{os.getpid()}")
        self.application = celery_application(settings, broker_url)
        self.application.Worker = self.application.subclass_with_self(_worker_class(self._processes))
        _add_task(self.application, self._processes)
        _add_handlers(self._processes, CeleryTaskQueue(settings, broker_url))

    def run(self) -> None:
        """Take frames until the process is asked to end."""
        options = ["--pool=prefork", "--concurrency=1", "--loglevel=INFO", "--without-gossip", "--without-mingle"]
        try:
            self.application.worker_main(["worker", *options, f"--hostname={self._label}-{os.getpid()}@%h"])
        finally:
            self._sign_off()

    def _sign_off(self) -> None:
        """Give back what the last child had; it has ended by now, so the database may be opened here."""
        self._processes.leave()
        health.remove(self._processes.settings.health_file)
        try:
            repository = self._processes.context().repository
            repository.release_worker(self._processes.name, cause=SHUT_DOWN)
            IngestionRepository(Database(self._processes.settings.database)).release_worker(self._processes.name)
            repository.remove_worker(self._processes.name)
        except FullwellError as error:
            log.warning("not signed off", cause=str(error))


def _worker_class(processes: _Processes) -> type[Worker]:
    class FrameWorker(Worker):  # type: ignore[misc]
        """Celery's worker, whose soft shutdown ends as soon as the running frame has, not when its time is up."""

        def wait_for_soft_shutdown(self) -> None:
            processes.leave()
            deadline = time.monotonic() + processes.settings.soft_shutdown_s
            while processes.busy and time.monotonic() < deadline:
                time.sleep(LEAVING_POLL_S)

    return FrameWorker


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

        acknowledged: bool

        def acknowledge(self) -> None:
            if not self.acknowledged:
                self.acknowledged = True
                _answer(self.message.ack)

        def reject(self, requeue: bool = False) -> None:
            if not self.acknowledged:
                self.acknowledged = True
                _answer(self.message.reject, requeue)

    class FrameTask(Task):  # type: ignore[misc]
        Request = FrameRequest
        max_retries = 2
        default_retry_delay = 0

    @application.task(name=RENDER_TASK, base=FrameTask, bind=True)  # type: ignore[untyped-decorator]
    def render_frames(self: Any, job_id: str, numbers: list[int]) -> None:
        """Run frames of a job; the database says which of them still need it."""
        with _message(processes, job=job_id):
            frames = [int(number) for number in numbers]
            run_frames(processes.context(), str(job_id), frames, should_stop=lambda: processes.leaving)

    @application.task(name=INGEST_TASK, base=FrameTask, bind=True)  # type: ignore[untyped-decorator]
    def ingest_asset(self: Any, ingestion_id: str) -> None:
        """Read uploaded files into the asset store and render previews; the database says whether that is still needed."""
        with _message(processes, ingestion=ingestion_id):
            run_ingestion(processes.assets(), str(ingestion_id))


@contextmanager
def _message(processes: _Processes, **fields: object) -> Iterator[None]:
    """Answer the message by how its work ended."""
    try:
        with processes.working():
            yield
    except ServiceError as error:
        # The database is away: the message goes back to the broker, after a pause, and comes again.
        log.warning("message handed back", cause=str(error), **fields)
        time.sleep(BEAT_S)
        raise Reject(str(error), requeue=True) from error
    except FullwellError as error:
        log.warning("message dropped", cause=str(error), **fields)


def _answer(answer: Callable[..., object], *arguments: object) -> None:
    """Answer a message in the event loop's next round, and let a broken connection's error come through to the loop.

    Celery's own way logs that error and goes on with connections that the broker has closed: now and then such a worker
    never took another message. An error that reaches the loop makes it connect anew.
    """
    loop = get_event_loop()
    if loop is None:
        answer(*arguments)
    else:
        loop.call_soon(answer, *arguments)


def _record_loss(processes: _Processes, request: Any, cause: str) -> None:
    if processes.leaving or getattr(request, "_already_cancelled", False):
        return  # an orderly end: the frames are given back when the last child has ended
    try:
        record_loss_in_a_process(_loss_of(request.args, processes.name, cause))
    except (OSError, subprocess.SubprocessError, ValueError, TypeError) as error:
        # The dispatcher finds the dead holder itself, a few seconds later, if without this cause.
        log.warning("loss not recorded", cause=str(error))


def _loss_of(arguments: Sequence[Any], worker: str, cause: str) -> Loss:
    if len(arguments) == 1:
        return Loss(worker, cause, ingestion_id=str(arguments[0]))
    job_id, numbers = arguments
    return Loss(worker, cause, job_id=str(job_id), numbers=tuple(numbers))


def _add_handlers(processes: _Processes, queue: TaskQueue) -> None:
    file = processes.settings.health_file
    parent = os.getpid()

    @signals.worker_process_init.connect(weak=False)  # type: ignore[untyped-decorator]
    def _child_started(**_: Any) -> None:
        die_with_parent(parent)
        processes.rest()  # the child before this one may have died at work
        threading.Thread(target=_beat_forever, args=(processes,), name="worker-beat", daemon=True).start()

    @signals.heartbeat_sent.connect(weak=False)  # type: ignore[untyped-decorator]
    def _alive(**_: Any) -> None:
        health.beat(file)

    @signals.worker_ready.connect(weak=False)  # type: ignore[untyped-decorator]
    def _ready(**_: Any) -> None:
        health.beat(file)
        Watchdog(queue, processes.idle_since_message).start()


def _beat_forever(processes: _Processes) -> None:
    """Give signs of life, and pass on that the worker is leaving; runs in the child."""
    repository = JobRepository(Database(processes.settings.database))
    next_beat = 0.0
    told = False
    while True:
        try:
            if time.monotonic() >= next_beat:
                repository.beat_worker(processes.name)
                next_beat = time.monotonic() + BEAT_S
            if processes.leaving and not told:
                repository.worker_leaves(processes.name)
                told = True
        except FullwellError as error:
            log.warning("no sign of life sent", cause=str(error))
        time.sleep(LEAVING_POLL_S)


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
