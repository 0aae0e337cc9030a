"""What the repository takes and gives: frozen records, no rows and no dicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fullwell.jobs.states import FrameState, JobState

__all__ = [
    "AttemptRecord",
    "Dispatch",
    "FrameRecord",
    "Heartbeat",
    "JobInput",
    "JobRecord",
    "Lease",
    "Loss",
    "NewJob",
    "RetryRule",
    "WorkerRecord",
]


@dataclass(frozen=True, slots=True)
class JobInput:
    """What a worker needs to run a job: canonical JSON texts of recipe, overrides and {relative path: sha256}."""

    recipe_json: str
    overrides_json: str = "{}"
    files_json: str = "{}"


@dataclass(frozen=True, slots=True)
class NewJob:
    """A job to be made. `priority` 0 is served first, 9 last."""

    name: str
    frame_count: int
    given: JobInput
    request_sha256: str
    priority: int = 3
    idempotency_key: str | None = None


@dataclass(frozen=True, slots=True)
class JobRecord:
    """A job as it is now; `counts` come from the frames table, times are Unix times [s]."""

    id: str
    name: str
    state: JobState
    priority: int
    frame_count: int
    created_at: float
    started_at: float | None
    finished_at: float | None
    cancel_requested: bool
    request_sha256: str
    counts: Mapping[FrameState, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FrameRecord:
    """A frame as it is now. `fraction` in [0, 1] is the progress of the running attempt."""

    job_id: str
    number: int
    state: FrameState
    attempt: int
    worker: str | None
    stage: str
    fraction: float
    changed_at: float
    started_at: float | None
    finished_at: float | None
    error: str | None
    error_code: str | None


@dataclass(frozen=True, slots=True)
class AttemptRecord:
    """One attempt at a frame; `outcome` is None while it runs."""

    number: int
    attempt: int
    worker: str
    started_at: float
    ended_at: float | None
    outcome: str | None
    cause: str | None


@dataclass(frozen=True, slots=True)
class Lease:
    """The right to run one frame, good until it expires or is prolonged."""

    job_id: str
    number: int
    attempt: int
    token: str
    worker: str


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """What a worker learns when it prolongs its lease."""

    still_held: bool
    cancel_requested: bool


@dataclass(frozen=True, slots=True)
class RetryRule:
    """How often a frame may end badly (`max_attempts`), and the delay before the next try [s], doubled each time."""

    max_attempts: int = 3
    delay_s: float = 2.0


@dataclass(frozen=True, slots=True)
class Loss:
    """A frame that was taken back from a worker, and why."""

    job_id: str
    number: int
    attempt: int
    cause: str


@dataclass(frozen=True, slots=True)
class Dispatch:
    """Frames of one job whose messages are due."""

    job_id: str
    priority: int
    numbers: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class WorkerRecord:
    """A worker and when it last gave a sign of life (Unix times [s])."""

    name: str
    started_at: float
    seen_at: float
