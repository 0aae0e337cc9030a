"""Stand-ins for parts that a test leaves out."""

from __future__ import annotations

from collections.abc import Sequence

from fullwell.core import ServiceError

__all__ = ["RememberingQueue"]


class RememberingQueue:
    """A queue that no worker serves."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, tuple[int, ...], int]] = []
        self.ingestions: list[str] = []
        self.away = False

    def enqueue(self, job_id: str, numbers: Sequence[int], *, priority: int = 3) -> None:
        self.check()
        self.sent.append((job_id, tuple(numbers), priority))

    def enqueue_ingestion(self, ingestion_id: str, *, priority: int = 3) -> None:
        self.check()
        self.ingestions.append(ingestion_id)

    def waiting(self) -> int:
        self.check()
        return len(self.sent) + len(self.ingestions)

    def check(self) -> None:
        if self.away:
            raise ServiceError("the broker cannot be reached: test")
