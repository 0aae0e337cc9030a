"""What the service says, as frozen records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

__all__ = [
    "ENDED_STATES",
    "Attempt",
    "Event",
    "Fetched",
    "Frame",
    "FrameCounts",
    "FrameDetail",
    "Job",
    "Product",
    "Verdict",
    "frame_detail_from",
    "frame_from",
    "job_from",
    "product_from",
]

ENDED_STATES = frozenset({"done", "failed", "cancelled"})


@dataclass(frozen=True, slots=True)
class FrameCounts:
    """Numbers of frames by state."""

    total: int
    queued: int
    running: int
    done: int
    failed: int
    cancelled: int


@dataclass(frozen=True, slots=True)
class Job:
    """A job. `state` is queued, running, done, failed or cancelled."""

    id: str
    name: str
    state: str
    priority: int
    frames: FrameCounts
    cancel_requested: bool
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None

    @property
    def ended(self) -> bool:
        """Whether nothing of the job runs or waits any more."""
        return self.state in ENDED_STATES


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame. `error` says why it, or its latest attempt, failed; `seconds` how long its last attempt took."""

    number: int
    state: str
    attempt: int
    worker: str | None
    stage: str
    fraction: float
    seconds: float | None
    error: str | None
    error_code: str | None


@dataclass(frozen=True, slots=True)
class Attempt:
    """One attempt at a frame: done, failed, lost, released, cancelled or superseded; None while it runs."""

    attempt: int
    worker: str
    outcome: str | None
    cause: str | None


@dataclass(frozen=True, slots=True)
class FrameDetail:
    """A frame and every attempt at it."""

    frame: Frame
    attempts: tuple[Attempt, ...]


@dataclass(frozen=True, slots=True)
class Product:
    """A product of a frame. `sha256` is None for the manifest, which holds the digests of the others."""

    name: str
    size_bytes: int
    sha256: str | None


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether the service would take a recipe; `errors` are complete sentences."""

    valid: bool
    name: str | None
    frames: int | None
    errors: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Event:
    """Something happened to a job: `kind` is job, frame or end; the one that applies is set."""

    kind: str
    job: Job | None
    frame: Frame | None


@dataclass(frozen=True, slots=True)
class Fetched:
    """What a fetch did. `missing` are frames that are not done; files that were here and whole count as `kept`."""

    folder: Path
    frames: tuple[int, ...]
    missing: tuple[int, ...]
    loaded: int
    kept: int


def _time(text: str | None) -> datetime | None:
    return None if text is None else datetime.fromisoformat(text)


def job_from(document: Mapping[str, Any]) -> Job:
    """Return the job of an answer."""
    counts = document["frames"]
    return Job(
        id=document["id"],
        name=document["name"],
        state=document["state"],
        priority=document["priority"],
        frames=FrameCounts(**{field: counts[field] for field in FrameCounts.__dataclass_fields__}),
        cancel_requested=document["cancel_requested"],
        created_at=datetime.fromisoformat(document["created_at"]),
        started_at=_time(document["started_at"]),
        finished_at=_time(document["finished_at"]),
    )


def frame_from(document: Mapping[str, Any]) -> Frame:
    """Return the frame of an answer."""
    error = document["error"] or {}
    return Frame(
        number=document["number"],
        state=document["state"],
        attempt=document["attempt"],
        worker=document["worker"],
        stage=document["stage"],
        fraction=document["fraction"],
        seconds=document["seconds"],
        error=error.get("message"),
        error_code=error.get("code"),
    )


def frame_detail_from(document: Mapping[str, Any]) -> FrameDetail:
    """Return the frame of an answer with its attempts."""
    attempts = tuple(Attempt(item["attempt"], item["worker"], item["outcome"], item["cause"]) for item in document["attempts"])
    return FrameDetail(frame_from(document), attempts)


def product_from(document: Mapping[str, Any]) -> Product:
    """Return the product of an answer."""
    return Product(document["name"], document["bytes"], document["sha256"])
