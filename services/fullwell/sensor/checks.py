"""Refusals that name the field, the value and the legal range."""

from __future__ import annotations

import math

from fullwell.core.errors import FieldError

__all__ = ["check_fraction", "check_kernel", "check_not_negative", "check_positive", "refusal"]

_ROUNDING = 1e-9
"""By how much shares written with a few digits may add up to more than 1."""


def refusal(path: str, value: object, legal: str, *, of: str = "the sensor") -> FieldError:
    """Return the error that says which values of a field are legal and where to set it."""
    return FieldError(f"{path} is {value}; must be {legal}. Set {path} of {of}.", path=path, value=value)


def check_positive(path: str, value: float, *, of: str = "the sensor") -> None:
    """Refuse what is not > 0 and finite."""
    if not 0 < value < math.inf:
        raise refusal(path, value, "> 0 and finite", of=of)


def check_not_negative(path: str, value: float, *, of: str = "the sensor") -> None:
    """Refuse what is not >= 0 and finite."""
    if not 0 <= value < math.inf:
        raise refusal(path, value, ">= 0 and finite", of=of)


def check_fraction(path: str, value: float, *, of: str = "the sensor") -> None:
    """Refuse what is not within 0 to 1."""
    if not 0 <= value <= 1:
        raise refusal(path, value, "within 0 to 1", of=of)


def check_kernel(path: str, kernel: tuple[tuple[float, ...], ...]) -> None:
    """Refuse a crosstalk kernel that is not 3 x 3, has negative entries or makes electrons."""
    if len(kernel) != 3 or any(len(row) != 3 for row in kernel):
        raise refusal(path, kernel, "3 rows of 3 numbers")
    shares = [share for row in kernel for share in row]
    if not all(0 <= share < math.inf for share in shares) or not 0 < sum(shares) <= 1 + _ROUNDING:
        raise refusal(path, kernel, ">= 0 with a sum > 0 and at most 1: it may lose electrons, not make them")
