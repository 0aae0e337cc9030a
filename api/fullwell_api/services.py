"""What the routes work with: one object per application, made at start-up."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from fullwell.core import FullwellError, ServiceError
from fullwell.core.settings import Settings
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.database import Database
from fullwell.jobs.dispatcher import Dispatcher, DispatcherTiming
from fullwell.jobs.ingestions import IngestionRepository
from fullwell.jobs.queue import CeleryTaskQueue, TaskQueue
from fullwell.jobs.records import RetryRule
from fullwell.jobs.repository import JobRepository
from fullwell.storage import ObjectStore, store_from_url

__all__ = ["ServiceParts", "Services", "make_services"]

CHECK_PATIENCE_S = 5.0
WORKER_SILENCE_S = 20.0


@dataclass(frozen=True, slots=True)
class Services:
    """The parts of a running service."""

    settings: Settings
    database: Database
    repository: JobRepository
    ingestions: IngestionRepository
    queue: TaskQueue
    store: ObjectStore
    library: AssetLibrary
    dispatcher: Dispatcher
    threads: ThreadPoolExecutor

    def checks(self) -> dict[str, str]:
        """Return what each part says of itself: "ok", or why it cannot be used. No part is waited for longer than 5 s."""
        parts = {
            "database": self.threads.submit(self.repository.check),
            "broker": self.threads.submit(self.queue.check),
            "store": self.threads.submit(self.store.check),
        }
        answers = {}
        for name, answer in parts.items():
            try:
                answer.result(timeout=CHECK_PATIENCE_S)
                answers[name] = "ok"
            except TimeoutError:
                answers[name] = f"no answer within {CHECK_PATIENCE_S:g} s"
            except FullwellError as error:
                answers[name] = str(error)
        return answers

    def live_workers(self) -> int:
        """Return the number of workers that gave a sign of life of late."""
        return len(self.repository.workers(seen_within_s=WORKER_SILENCE_S))


def make_services(settings: Settings, *, queue: TaskQueue | None = None, store: ObjectStore | None = None) -> Services:
    """Return the parts that the settings ask for; `queue` and `store` can be given instead.

    Raises
    ------
    ServiceError
        No broker is set, or the service would be open to other machines without a key.
    """
    if not (settings.has_keys or settings.is_loopback or settings.allow_open):
        raise ServiceError(
            f"the service would be open to everyone who can reach {settings.host}. Set FULLWELL_API_KEYS, "
            "or FULLWELL_ALLOW_OPEN=1 if that is meant."
        )
    if queue is None:
        if not settings.broker_url:
            raise ServiceError("no broker is set. Set FULLWELL_BROKER_URL, or start `fullwell serve`, which brings one.")
        queue = CeleryTaskQueue(settings, settings.broker_url)
    database = Database(settings.database)
    objects = store or store_from_url(settings.store)
    repository = JobRepository(database)
    ingestions = IngestionRepository(database)
    timing = DispatcherTiming(interval_s=settings.reap_interval_s, lost_after_s=settings.lease_s)
    rule = RetryRule(settings.max_attempts, settings.retry_delay_s)
    dispatcher = Dispatcher(repository, queue, ingestions=ingestions, rule=rule, timing=timing)
    threads = ThreadPoolExecutor(max_workers=16, thread_name_prefix="service")
    return Services(
        settings=settings,
        database=database,
        repository=repository,
        ingestions=ingestions,
        queue=queue,
        store=objects,
        library=AssetLibrary(objects, database),
        dispatcher=dispatcher,
        threads=threads,
    )


def _services(request: Request) -> Services:
    services: Services = request.app.state.services
    return services


ServiceParts = Annotated[Services, Depends(_services)]
"""Parameter type of routes that need the parts."""
