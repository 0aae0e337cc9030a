"""States of jobs and frames, and the moves between them that are legal."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from fullwell.core import ConflictError

__all__ = [
    "FINAL_FRAME_STATES",
    "FRAME_TRANSITIONS",
    "JOB_TRANSITIONS",
    "FrameState",
    "JobState",
    "check_frame_move",
    "check_job_move",
    "job_state_of",
]


class FrameState(StrEnum):
    """Where one frame is."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


class JobState(StrEnum):
    """Where a job is; it follows from its frames."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


FRAME_TRANSITIONS: Mapping[FrameState, frozenset[FrameState]] = {
    # A queued frame may be done at once: a late duplicate whose lease was lost has published it.
    FrameState.QUEUED: frozenset({FrameState.RUNNING, FrameState.DONE, FrameState.CANCELLED}),
    FrameState.RUNNING: frozenset({FrameState.QUEUED, FrameState.DONE, FrameState.FAILED, FrameState.CANCELLED}),
    FrameState.DONE: frozenset(),
    FrameState.FAILED: frozenset({FrameState.QUEUED}),
    FrameState.CANCELLED: frozenset(),
}

JOB_TRANSITIONS: Mapping[JobState, frozenset[JobState]] = {
    JobState.QUEUED: frozenset({JobState.RUNNING, JobState.DONE, JobState.FAILED, JobState.CANCELLED}),
    JobState.RUNNING: frozenset({JobState.QUEUED, JobState.DONE, JobState.FAILED, JobState.CANCELLED}),
    JobState.DONE: frozenset(),
    JobState.FAILED: frozenset({JobState.QUEUED, JobState.RUNNING}),
    JobState.CANCELLED: frozenset(),
}

FINAL_FRAME_STATES = frozenset({FrameState.DONE, FrameState.FAILED, FrameState.CANCELLED})


def check_frame_move(old: FrameState, new: FrameState) -> None:
    """Raise ConflictError when a frame may not go from `old` to `new`."""
    if new not in FRAME_TRANSITIONS[old]:
        raise ConflictError(f"a frame that is {old} cannot become {new}")


def check_job_move(old: JobState, new: JobState) -> None:
    """Raise ConflictError when a job may not go from `old` to `new`."""
    if new not in JOB_TRANSITIONS[old]:
        raise ConflictError(f"a job that is {old} cannot become {new}")


def job_state_of(counts: Mapping[FrameState, int]) -> JobState:
    """Return the state of a job from the number of its frames in each state.

    Running as soon as one frame has started and until the last one has ended; then failed when any frame failed,
    cancelled when any was cancelled, done otherwise.
    """
    queued, running = counts.get(FrameState.QUEUED, 0), counts.get(FrameState.RUNNING, 0)
    ended = sum(counts.get(state, 0) for state in FINAL_FRAME_STATES)
    if queued or running:
        return JobState.RUNNING if running or ended else JobState.QUEUED
    if counts.get(FrameState.FAILED, 0):
        return JobState.FAILED
    return JobState.CANCELLED if counts.get(FrameState.CANCELLED, 0) else JobState.DONE
