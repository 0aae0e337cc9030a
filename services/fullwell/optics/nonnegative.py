"""Removal of the small negative values that a band-limited filter leaves beside highlights, without losing light."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

__all__ = ["without_negative_light"]

_WINDOW = 7
"""Samples over which a deficit is settled: the negative lobes beside a single bright sample lie 2 samples from it."""

_PASSES = 4
"""Each pass settles nearly all of the deficit; what the last leaves is far below the rounding of float32."""


def without_negative_light(irradiance: NDArray[np.float64], *, total: float) -> NDArray[np.float64]:
    """Return the image with no value below 0 and the sum `total`, (rows, cols).

    Where samples are too coarse for the point image, a filter that is exact below the Nyquist frequency rings: beside a
    highlight on a dark ground it goes below zero by up to 0.8 % of the highlight. Raising those samples to 0 would add light;
    that light is taken from the lit samples within a few cells, in proportion to theirs. An image without negative values
    comes back unchanged but for the rounding of its sum.
    """
    settled = irradiance
    for _ in range(_PASSES):
        deficit = np.maximum(-settled, 0.0)
        if not np.any(deficit):
            break
        lit = np.maximum(settled, 0.0)
        # The window operator is symmetric (mirrored borders), so what is taken in total is what the deficit holds in total.
        nearby = np.maximum(uniform_filter(lit, _WINDOW, mode="reflect"), np.finfo(np.float64).tiny)
        share = uniform_filter(deficit / nearby, _WINDOW, mode="reflect")
        settled = lit * (1.0 - share)
    settled = np.maximum(settled, 0.0)
    found = math.fsum(np.sum(settled, axis=1))
    return settled * (total / found) if found > 0 else settled
