"""Documents of the HTTP interface."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from fullwell.jobs.records import AttemptRecord, FrameRecord, JobRecord
from fullwell.jobs.states import FrameState, JobState

__all__ = [
    "AttemptOut",
    "ErrorOut",
    "FrameCounts",
    "FrameDetail",
    "FrameOut",
    "FramePage",
    "JobLinks",
    "JobOut",
    "JobPage",
    "ProductList",
    "ProductOut",
    "RetryOut",
    "Submission",
    "attempt_out",
    "frame_out",
    "job_out",
]


class Submission(BaseModel):
    """A recipe to be run."""

    model_config = ConfigDict(extra="forbid")

    recipe: dict[str, Any] = Field(description="The recipe document (schema fullwell/recipe/v1).")
    overrides: dict[str, Any] = Field(default_factory=dict, description="Path in the recipe: value, applied before validation.")
    files: dict[str, str] = Field(default_factory=dict, description="Relative path: SHA-256 of an uploaded blob.")
    priority: int = Field(default=3, ge=0, le=9, description="0 is served first, 9 last.")


class FrameCounts(BaseModel):
    """Numbers of frames by state."""

    total: int
    queued: int
    running: int
    done: int
    failed: int
    cancelled: int


class JobLinks(BaseModel):
    """Addresses of a job's parts, below the service's root."""

    self: str
    frames: str
    events: str


class JobOut(BaseModel):
    """A job as it is now."""

    id: str
    name: str
    state: JobState
    priority: int
    frames: FrameCounts
    cancel_requested: bool
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    links: JobLinks


class JobPage(BaseModel):
    """Jobs, newest first; `next_cursor` is empty on the last page."""

    items: list[JobOut]
    next_cursor: str | None = None


class ErrorOut(BaseModel):
    """Why a frame failed, or why its latest attempt did."""

    code: str
    message: str


class FrameOut(BaseModel):
    """A frame as it is now. `fraction` in [0, 1] is the progress of the running attempt."""

    number: int
    state: FrameState
    attempt: int
    worker: str | None
    stage: str
    fraction: float
    started_at: datetime | None
    finished_at: datetime | None
    seconds: float | None
    error: ErrorOut | None


class FramePage(BaseModel):
    """Frames in order of their numbers; `next_cursor` is empty on the last page."""

    items: list[FrameOut]
    next_cursor: int | None = None


class AttemptOut(BaseModel):
    """One attempt at a frame: done, failed, lost (its worker died), released (shutdown), cancelled, superseded."""

    attempt: int
    worker: str
    started_at: datetime
    ended_at: datetime | None
    outcome: str | None
    cause: str | None


class FrameDetail(FrameOut):
    """A frame with all its attempts."""

    attempts: list[AttemptOut]


class ProductOut(BaseModel):
    """A product of a frame that is done."""

    name: str
    bytes: int
    sha256: str | None
    content_type: str
    url: str


class ProductList(BaseModel):
    """The products of a frame; empty until it is done."""

    items: list[ProductOut]


class RetryOut(BaseModel):
    """How many failed frames were queued again."""

    retried: int
    job: JobOut


def _time(seconds: float | None) -> datetime | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)


def job_out(job: JobRecord) -> JobOut:
    """Return the document of a job."""
    here = f"/v1/jobs/{job.id}"
    counts = {state.value: job.counts.get(state, 0) for state in FrameState}
    return JobOut(
        id=job.id,
        name=job.name,
        state=job.state,
        priority=job.priority,
        frames=FrameCounts(total=job.frame_count, **counts),
        cancel_requested=job.cancel_requested,
        created_at=datetime.fromtimestamp(job.created_at, UTC),
        started_at=_time(job.started_at),
        finished_at=_time(job.finished_at),
        links=JobLinks(self=here, frames=f"{here}/frames", events=f"{here}/events"),
    )


def frame_out(frame: FrameRecord) -> FrameOut:
    """Return the document of a frame."""
    ended = frame.started_at is not None and frame.finished_at is not None
    return FrameOut(
        number=frame.number,
        state=frame.state,
        attempt=frame.attempt,
        worker=frame.worker,
        stage=frame.stage,
        fraction=frame.fraction,
        started_at=_time(frame.started_at),
        finished_at=_time(frame.finished_at),
        seconds=round(frame.finished_at - frame.started_at, 3) if ended else None,  # type: ignore[operator]
        error=None if frame.error is None else ErrorOut(code=frame.error_code or "error", message=frame.error),
    )


def attempt_out(attempt: AttemptRecord) -> AttemptOut:
    """Return the document of an attempt."""
    return AttemptOut(
        attempt=attempt.attempt,
        worker=attempt.worker,
        started_at=datetime.fromtimestamp(attempt.started_at, UTC),
        ended_at=_time(attempt.ended_at),
        outcome=attempt.outcome,
        cause=attempt.cause,
    )
