"""What a running frame tells and asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

__all__ = ["CancelCheck", "FrameProgress", "ProgressCallback"]


@dataclass(frozen=True, slots=True)
class FrameProgress:
    """Where a frame is: the stage that runs (for people) and the finished share of the whole frame in [0, 1]."""

    stage: str
    fraction: float


ProgressCallback: TypeAlias = Callable[[FrameProgress], None]
CancelCheck: TypeAlias = Callable[[], bool]
