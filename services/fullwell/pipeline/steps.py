"""One decision of a plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["PlanStep"]


@dataclass(frozen=True, slots=True)
class PlanStep:
    """One decision: what it is about, run or skip, the reason, and the bound on the error that a skip may cause."""

    what: str
    decision: Literal["run", "skip"]
    why: str
    error_bound: str = "none"
