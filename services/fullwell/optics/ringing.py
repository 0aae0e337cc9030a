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

_FEW = 0.01
"""Share of the samples up to which corrections are settled one by one."""

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
    """Return `bounded`, which is overwritten, with the light that was `added` taken from around each place."""
    touched = np.flatnonzero(added)
    few = touched.size <= _FEW * added.size
    share = _share_of_few(bounded, added, touched) if few else _share_of_many(bounded, added)
    bounded *= 1.0 - np.clip(share, -_MOST_GIVEN, _MOST_TAKEN, out=share)
    found = math.fsum(np.sum(bounded, axis=1))
    if found > 0:
        bounded *= total / found
    return bounded


def _share_of_many(bounded: NDArray[np.float64], added: NDArray[np.float64]) -> NDArray[np.float64]:
    # The window operator is symmetric (mirrored borders), so what is taken in total is what was added in total.
    nearby = np.maximum(uniform_filter(bounded, _WINDOW, mode="reflect"), np.finfo(np.float64).tiny)
    return np.asarray(uniform_filter(added / nearby, _WINDOW, mode="reflect"))


def _share_of_few(bounded: NDArray[np.float64], added: NDArray[np.float64], touched: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return what `_share_of_many` returns, window by window: far cheaper for a few touched samples."""
    rows, cols = bounded.shape
    offsets = np.arange(_WINDOW) - _WINDOW // 2
    down, across = np.divmod(touched, cols)
    place = (
        _mirrored(down[:, None] + offsets, rows)[:, :, None] * cols + _mirrored(across[:, None] + offsets, cols)[:, None, :]
    ).reshape(touched.size, _WINDOW**2)
    nearby = np.maximum(np.mean(bounded.ravel()[place], axis=1), np.finfo(np.float64).tiny)
    given = np.repeat(added.ravel()[touched] / nearby / _WINDOW**2, _WINDOW**2)
    share = np.bincount(place.ravel(), weights=given, minlength=bounded.size)
    return np.asarray(share, dtype=np.float64).reshape(rows, cols)


def _mirrored(index: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    folded = np.mod(index, 2 * count)
    return np.asarray(np.minimum(folded, 2 * count - 1 - folded))
