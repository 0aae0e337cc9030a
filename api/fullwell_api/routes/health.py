"""Health and figures; open without a key, and saying nothing of any job."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from pydantic import BaseModel

from fullwell_api.metrics import Metrics
from fullwell_api.problems import Problem, problem_response
from fullwell_api.services import ServiceParts

__all__ = ["router"]

router = APIRouter(tags=["health"])

DISPATCHER_PATIENCE_S = 120.0


class Alive(BaseModel):
    """The process runs."""

    status: str = "ok"


class Ready(BaseModel):
    """Every part can be used. `workers` may be 0: jobs are taken, and wait."""

    status: str
    checks: dict[str, str]
    workers: int


@router.get("/healthz", summary="Whether the process runs")
def healthz() -> Alive:
    """Answer 200 while the process serves; a failing database or broker does not change that."""
    return Alive()


@router.get("/readyz", summary="Whether every part can be used", responses={503: {"model": Problem}})
def readyz(request: Request, parts: ServiceParts) -> Ready:
    """Check database, broker and store, and that frames are being dispatched; 503 says which cannot be used."""
    checks = parts.checks()
    silence_s = parts.dispatcher.silent_for_s
    checks["dispatcher"] = "ok" if silence_s < DISPATCHER_PATIENCE_S else f"no complete round for {silence_s:.0f} s"
    if any(answer != "ok" for answer in checks.values()):
        broken = "; ".join(f"{name}: {answer}" for name, answer in checks.items() if answer != "ok")
        return problem_response(503, broken, instance=request.url.path, members={"checks": checks})  # type: ignore[return-value]
    return Ready(status="ok", checks=checks, workers=parts.live_workers())


@router.get("/metrics", summary="Figures for Prometheus", response_class=Response)
def metrics(request: Request) -> Response:
    """Return the figures in Prometheus' text format."""
    registered: Metrics = request.app.state.metrics
    return Response(generate_latest(registered.registry), media_type=CONTENT_TYPE_LATEST)
