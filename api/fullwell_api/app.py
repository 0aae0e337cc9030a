"""The application: routes, guards, problem details, and the dispatcher's life."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import Depends, FastAPI
from starlette.concurrency import run_in_threadpool

import fullwell
from fullwell.core.settings import Settings, load_settings
from fullwell.jobs.queue import TaskQueue
from fullwell.storage import ObjectStore
from fullwell_api.guards import HostGuard, SizeLimit, require_key
from fullwell_api.metrics import RequestMeter, make_metrics
from fullwell_api.problems import PROBLEM_RESPONSES, add_problem_handlers
from fullwell_api.routes import assets, blobs, catalog, health, jobs, products, recipes
from fullwell_api.services import Services, make_services
from fullwell_api.web import pages
from fullwell_api.web.curation import mount_curation

__all__ = ["create_app"]

DESCRIPTION = """
Submit recipes, watch their frames, fetch the products.

Errors are problem details (RFC 9457) with a stable `code` and, for illegal fields, a list `errors` of path, message and value.
"""


def create_app(
    settings: Settings | None = None, *, queue: TaskQueue | None = None, store: ObjectStore | None = None
) -> FastAPI:
    """Return the application. Without arguments the environment decides; tests hand in a queue or a store of their own."""
    services = make_services(settings or load_settings(), queue=queue, store=store)
    app = FastAPI(title="Fullwell", version=fullwell.__version__, description=DESCRIPTION.strip(), lifespan=_lifespan)
    app.state.services = services
    app.state.metrics = make_metrics(services)
    add_problem_handlers(app)
    for router in (jobs.router, products.router, recipes.router, blobs.router, catalog.router, assets.router):
        app.include_router(router, prefix="/v1", dependencies=[Depends(require_key)], responses=PROBLEM_RESPONSES)
    app.include_router(health.router)
    app.include_router(pages.router)
    mount_curation(app, services)
    app.add_middleware(SizeLimit, settings=services.settings)
    app.add_middleware(HostGuard, settings=services.settings)
    app.add_middleware(RequestMeter, metrics=app.state.metrics)
    return app


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    services: Services = app.state.services
    await run_in_threadpool(services.database.upgrade)
    services.dispatcher.start()
    try:
        yield
    finally:
        await run_in_threadpool(services.dispatcher.stop)
        services.threads.shutdown(wait=False, cancel_futures=True)
        services.database.close()
