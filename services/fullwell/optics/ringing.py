"""Removal of the ringing that a filter leaves beside highlights where samples are too coarse for the point image."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

__all__ = ["texture", "without_negative_light", "without_ringing"]

_WINDOW = 7
"""Samples across the square in which texture is measured and corrections are settled."""

_TEXTURED = 2.0
"""Texture per relative mean deviation: noise of 20 % counts 0.3, an edge of 1 : 2 in the middle of the square 0.67."""

_FEW = 0.01
"""Share of the samples up to which corrections are settled one by one."""

_MOST_TAKEN, _MOST_GIVEN = 0.5, 1.0
"""Bounds on the share of a sample's light that settling takes or gives, where all about it is dark."""


def texture(planes: NDArray[Any]) -> NDArray[np.float64]:
    """Return how strongly an image varies about each sample, (rows, cols), from 0 (uniform) to 1 (from half its mean on).

    The mean deviation from the mean within 7 x 7, over twice that mean; the largest of the planes (rows, cols, planes),
    which stand for parts of the spectrum.
    """
    strongest = np.zeros(planes.shape[:2])
    for k in range(planes.shape[2]):
        plane = planes[:, :, k].astype(np.float64)
        mean = uniform_filter(plane, _WINDOW, mode="reflect")
        deviation = uniform_filter(np.abs(plane - mean), _WINDOW, mode="reflect")
        share = np.divide(deviation, mean, out=np.zeros_like(mean), where=mean > 0)
        np.maximum(strongest, _TEXTURED * share, out=strongest)
    return np.minimum(strongest, 1.0)


def without_ringing(
    exact: NDArray[np.float64], smooth: NDArray[Any], *, bound: NDArray[np.float64] | float, total: float
) -> NDArray[np.float64]:
    """Return `exact`, which may be overwritten, held within a factor 1 + `bound` of `smooth`, with the sum `total`, >= 0.

    `smooth` is the same image through a filter without negative weights, `bound` one number or one for each sample. Where
    `exact` lies within the bounds everywhere, it comes back as it is. The light that the bounds add is taken from the samples
    within a few cells, in proportion to theirs, and what they take is given back likewise.
    """
    widest = 1.0 + bound
    outside = np.flatnonzero((exact > smooth * widest) | (exact * widest < smooth))
    if not outside.size:
        return exact
    factor = np.broadcast_to(widest, exact.shape).ravel()[outside]
    middle = np.maximum(smooth.ravel()[outside], 0.0, dtype=np.float64)
    return _moved(exact, outside, np.clip(exact.ravel()[outside], middle / factor, middle * factor), total)


def without_negative_light(exact: NDArray[np.float64], *, total: float) -> NDArray[np.float64]:
    """Return `exact`, which may be overwritten, with no value below 0 and the sum `total`, (rows, cols).

    For filters whose weights are not negative themselves, so that only rounding goes below 0, and little of it.
    """
    outside = np.flatnonzero(exact < 0)
    if not outside.size:
        return exact
    return _moved(exact, outside, np.zeros(outside.size), total)


def _moved(
    image: NDArray[np.float64], places: NDArray[np.intp], values: NDArray[np.float64], total: float
) -> NDArray[np.float64]:
    """Return `image`, which is overwritten, with new values at flat indices; what that adds is taken from around each place."""
    flat = image.reshape(-1)
    added = values - flat[places]
    flat[places] = values
    few = places.size <= _FEW * image.size
    share = _share_of_few(image, places, added) if few else _share_of_many(image, places, added)
    np.clip(share, -_MOST_GIVEN, _MOST_TAKEN, out=share)
    np.subtract(1.0, share, out=share)
    image *= share
    found = math.fsum(np.sum(image, axis=1))
    if found > 0:
        image *= total / found
    return image


def _share_of_many(image: NDArray[np.float64], places: NDArray[np.intp], added: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of its light that each sample gives, (rows, cols): about each place the same share for all 49."""
    # The window operator is symmetric (mirrored borders), so what is taken in total is what was added in total.
    nearby = np.maximum(uniform_filter(image, _WINDOW, mode="reflect"), np.finfo(np.float64).tiny)
    wanted = np.zeros_like(image)
    wanted.reshape(-1)[places] = added / nearby.reshape(-1)[places]
    return np.asarray(uniform_filter(wanted, _WINDOW, mode="reflect"))


def _share_of_few(image: NDArray[np.float64], places: NDArray[np.intp], added: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what `_share_of_many` returns, window by window: far cheaper for a few places."""
    windows = _windows(places, image.shape)
    nearby = np.maximum(np.mean(image.reshape(-1)[windows], axis=1), np.finfo(np.float64).tiny)
    wanted = np.repeat(added / nearby / _WINDOW**2, _WINDOW**2)
    share = np.bincount(windows.ravel(), weights=wanted, minlength=image.size)
    return np.asarray(share, dtype=np.float64).reshape(image.shape)


def _windows(places: NDArray[np.intp], shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Return the flat indices of the windows about flat indices, (places, 49); mirrored at the borders."""
    rows, cols = shape
    offsets = np.arange(_WINDOW) - _WINDOW // 2
    down, across = np.divmod(places, cols)
    row, col = _mirrored(down[:, None] + offsets, rows), _mirrored(across[:, None] + offsets, cols)
    return np.asarray(row[:, :, None] * cols + col[:, None, :]).reshape(places.size, _WINDOW**2)


def _mirrored(index: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    folded = np.mod(index, 2 * count)
    return np.asarray(np.minimum(folded, 2 * count - 1 - folded))
