"""Figures for Prometheus: requests, jobs, frames and ingestions by state, workers. An autoscaler reads frames here."""

from __future__ import annotations

import time
from collections.abc import Iterator

from prometheus_client import CollectorRegistry, Counter, Histogram
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fullwell.core import FullwellError
from fullwell.jobs.ingestions import IngestionState
from fullwell.jobs.states import FrameState, JobState
from fullwell_api.services import Services

__all__ = ["Metrics", "RequestMeter", "make_metrics"]

API_PREFIX = "/v1"


class _JobCollector(Collector):
    """Asks the database at each scrape: no figure lives in this process, so restarts and replicas do not matter."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def collect(self) -> Iterator[Metric]:
        """Yield the figures; none of them while the database is away."""
        repository = self._services.repository
        try:
            job_totals, frame_totals = repository.job_totals(), repository.frame_totals()
            ingestion_totals = self._services.ingestions.totals()
            workers = self._services.live_workers()
        except FullwellError:
            yield GaugeMetricFamily("fullwell_database_up", "Whether the database answers", value=0)
            return
        yield GaugeMetricFamily("fullwell_database_up", "Whether the database answers", value=1)
        jobs = GaugeMetricFamily("fullwell_jobs", "Jobs by state", labels=["state"])
        for job_state in JobState:
            jobs.add_metric([job_state.value], job_totals.get(job_state, 0))
        yield jobs
        frames = GaugeMetricFamily("fullwell_frames", "Frames by state", labels=["state"])
        for frame_state in FrameState:
            frames.add_metric([frame_state.value], frame_totals.get(frame_state, 0))
        yield frames
        ingestions = GaugeMetricFamily("fullwell_ingestions", "Work on assets by state", labels=["state"])
        for ingestion_state in IngestionState:
            ingestions.add_metric([ingestion_state.value], ingestion_totals.get(ingestion_state, 0))
        yield ingestions
        yield GaugeMetricFamily("fullwell_workers", "Workers with a recent sign of life", value=workers)
        yield GaugeMetricFamily(
            "fullwell_dispatcher_silence_seconds",
            "Time since the dispatcher's last complete round",
            value=self._services.dispatcher.silent_for_s,
        )


class Metrics:
    """The registry of one application and its request meters."""

    def __init__(self, services: Services) -> None:
        self.registry = CollectorRegistry()
        self.registry.register(_JobCollector(services))
        self.requests = Counter("fullwell_http_requests", "Requests", ["method", "route", "status"], registry=self.registry)
        self.seconds = Histogram("fullwell_http_request_seconds", "Time to serve", ["method", "route"], registry=self.registry)


def make_metrics(services: Services) -> Metrics:
    """Return the metrics of one application."""
    return Metrics(services)


class RequestMeter:
    """Counts requests by route, not by path: the number of label values stays small."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        started, status = time.perf_counter(), 500

        async def noted(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, receive, noted)
        finally:
            route = _route_of(scope)
            method = scope["method"] if scope["method"] in ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE") else "other"
            self._metrics.requests.labels(method, route, str(status)).inc()
            self._metrics.seconds.labels(method, route).observe(time.perf_counter() - started)


def _route_of(scope: Scope) -> str:
    route: str | None = getattr(scope.get("route"), "path", None)
    if route is None:
        return "(none)"
    # A route of an included router knows its own part of the path only.
    return f"{API_PREFIX}{route}" if scope["path"].startswith(f"{API_PREFIX}/") and not route.startswith(API_PREFIX) else route
