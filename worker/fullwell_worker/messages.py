"""What a worker and its render process say to each other, pickled, over one socket."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from fullwell.schema import RecipeDocument

__all__ = ["Answer", "CancelOrder", "FrameFailed", "FrameFinished", "FrameOrder", "Order", "OrderTaken", "StageReport"]


@dataclass(frozen=True, slots=True)
class FrameOrder:
    """Render a frame.

    Attributes
    ----------
    serial
        Counts the orders of a worker.
    document
        None for the document of the order before: successive frames of a job send and build it once.
    store_url
        Address of the object store, with its keys: never on a command line, where other users could read it.
    log_fields
        What each event in the log names: job, frame, attempt.
    """

    serial: int
    document: RecipeDocument | None
    index: int
    store_url: str
    prefix: str
    base_dir: Path | None
    log_fields: dict[str, Any]


@dataclass(frozen=True, slots=True)
class CancelOrder:
    """Stop the frame of this order after the present pass; without effect when it has ended meanwhile."""

    serial: int


@dataclass(frozen=True, slots=True)
class OrderTaken:
    """The process has the order: if it ends from now on, the frame may be the reason."""

    serial: int


@dataclass(frozen=True, slots=True)
class StageReport:
    """Where the frame is: stage, and the finished share of the frame in [0, 1]."""

    stage: str
    fraction: float


@dataclass(frozen=True, slots=True)
class FrameFinished:
    """The frame is published; `manifest` is what the runner returned."""

    manifest: Any


@dataclass(frozen=True, slots=True)
class FrameFailed:
    """The runner raised `error`; `trace` is where, for the log."""

    error: Exception
    trace: str


Order: TypeAlias = FrameOrder | CancelOrder
Answer: TypeAlias = OrderTaken | StageReport | FrameFinished | FrameFailed
