"""The transition tables and the state of a job."""

from __future__ import annotations

import pytest

from fullwell.core import ConflictError
from fullwell.jobs.states import FrameState, JobState, check_frame_move, check_job_move, job_state_of

F = FrameState


@pytest.mark.parametrize(
    ("old", "new"), [(F.DONE, F.QUEUED), (F.CANCELLED, F.RUNNING), (F.FAILED, F.DONE), (F.QUEUED, F.FAILED)]
)
def test_an_illegal_move_of_a_frame_is_refused(old: FrameState, new: FrameState) -> None:
    with pytest.raises(ConflictError, match=f"is {old} cannot become {new}"):
        check_frame_move(old, new)


def test_a_done_job_stays_done() -> None:
    for state in JobState:
        with pytest.raises(ConflictError):
            check_job_move(JobState.DONE, state)


@pytest.mark.parametrize(
    ("counts", "state"),
    [
        ({F.QUEUED: 3}, JobState.QUEUED),
        ({F.QUEUED: 2, F.RUNNING: 1}, JobState.RUNNING),
        ({F.QUEUED: 2, F.DONE: 1}, JobState.RUNNING),
        ({F.RUNNING: 1, F.CANCELLED: 2}, JobState.RUNNING),
        ({F.DONE: 3}, JobState.DONE),
        ({F.DONE: 2, F.FAILED: 1}, JobState.FAILED),
        ({F.DONE: 2, F.CANCELLED: 1}, JobState.CANCELLED),
        ({F.DONE: 1, F.FAILED: 1, F.CANCELLED: 1}, JobState.FAILED),
    ],
)
def test_the_state_of_a_job_follows_from_its_frames(counts: dict[FrameState, int], state: JobState) -> None:
    assert job_state_of(counts) == state
