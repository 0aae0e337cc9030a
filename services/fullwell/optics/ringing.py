"""Removal of the ringing that a filter leaves beside highlights where samples are too coarse for the point image."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

__all__ = ["without_negative_light", "without_ringing"]

_WINDOW = 7
"""Samples over which a correction is settled: the first lobes beside a single bright sample lie 2 samples from it."""

_MOST_TAKEN, _MOST_GIVEN = 0.5, 1.0
"""Bounds on the share of a sample's light that settling takes or gives, where all about it is dark."""


def without_ringing(exact: NDArray[np.float64], smooth: NDArray[Any], *, factor: float, total: float) -> NDArray[np.float64]:
    """Return `exact` held between `smooth` / `factor` and `smooth` * `factor`, with the sum `total`, (rows, cols).

    `smooth` is the same image through a filter without negative weights. Where `exact` lies within the bounds everywhere, it
    comes back as it is: ordinary pictures and straight edges of any contrast do. Beside small highlights on a dark ground it
    does not; the light that the bounds add there is taken from the samples within a few cells, in proportion to theirs, and
    what they take is given back likewise.
    """
    if _within(exact, smooth, factor):
        return exact
    floor = np.maximum(smooth, 0.0, dtype=np.float64)
    bounded = np.maximum(np.minimum(exact, floor * factor), floor / factor)
    return _settled(bounded, bounded - exact, total)


def without_negative_light(exact: NDArray[np.float64], *, total: float) -> NDArray[np.float64]:
    """Return `exact` with no value below 0 and the sum `total`, (rows, cols); unchanged where it has none.

    For filters whose weights are not negative themselves, so that only rounding goes below 0, and little of it.
    """
    if float(np.min(exact)) >= 0:
        return exact
    bounded = np.maximum(exact, 0.0)
    return _settled(bounded, bounded - exact, total)


def _within(exact: NDArray[np.float64], smooth: NDArray[Any], factor: float) -> bool:
    if not float(np.min(smooth)) > 0:
        return bool(np.all((exact <= smooth * factor) & (exact * factor >= smooth) & (smooth >= 0)))
    ratio = exact / smooth
    return float(np.min(ratio)) * factor >= 1 and float(np.max(ratio)) <= factor


def _settled(bounded: NDArray[np.float64], added: NDArray[np.float64], total: float) -> NDArray[np.float64]:
    # The window operator is symmetric (mirrored borders), so what is taken in total is what was added in total.
    nearby = np.maximum(uniform_filter(bounded, _WINDOW, mode="reflect"), np.finfo(np.float64).tiny)
    share = uniform_filter(added / nearby, _WINDOW, mode="reflect")
    bounded *= 1.0 - np.clip(share, -_MOST_GIVEN, _MOST_TAKEN)
    found = math.fsum(np.sum(bounded, axis=1))
    if found > 0:
        bounded *= total / found
    return bounded
