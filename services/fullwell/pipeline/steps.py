"""One decision of a plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["PlanStep"]


@dataclass(frozen=True, slots=True)
class PlanStep:
    """One decision.

    Attributes
    ----------
    what, decision, why
        What it is about, run or skip, and the reason.
    error_bound
        On the error that a skip may cause.
    cost
        What it is expected to take, roughly; empty where that is little or not known.
    """

    what: str
    decision: Literal["run", "skip"]
    why: str
    error_bound: str = "none"
    cost: str = ""
