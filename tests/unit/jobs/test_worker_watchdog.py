"""A worker that is wedged ends; one that works, waits or has no broker does not."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from fullwell.core import ServiceError
from fullwell_worker.watchdog import EXIT_CODE, Watchdog


class Queue:
    """A queue with a given number of waiting messages; None means that the broker is away."""

    def __init__(self, count: int | None) -> None:
        self.count = count

    def waiting(self) -> int:
        if self.count is None:
            raise ServiceError("away")
        return self.count

    def enqueue(self, job_id: str, numbers: Sequence[int], *, priority: int = 3) -> None:
        raise AssertionError

    def check(self) -> None:
        raise AssertionError


@pytest.mark.parametrize(
    ("waiting", "activity", "gives_up"),
    [
        (3, [7, 7, 7], True),
        (0, [7, 7, 7], False),
        (None, [7, 7, 7], False),
        (3, [7, 8, 9], False),
        (3, [None, None, None], False),
    ],
)
def test_only_an_idle_worker_with_waiting_messages_gives_up(
    waiting: int | None, activity: list[int | None], gives_up: bool
) -> None:
    codes: list[int] = []
    answers = iter(activity)
    dog = Watchdog(Queue(waiting), lambda: next(answers), patience_s=-1.0, give_up=codes.append)
    for _ in activity:
        dog.look()
    assert (codes[:1] == [EXIT_CODE]) == gives_up
