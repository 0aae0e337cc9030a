"""Correlated double sampling: the level after the reset is read too, and subtracted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["correlated_difference"]


def correlated_difference(signal_sample_v: NDArray[np.float64], reset_sample_v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the signal sample less the reset sample, same shape [V].

    What both hold cancels: the reset noise of the one reset before them, the pixel's and the column's offsets. What each
    reading adds does not: independent noise of both remains, sqrt(2) times that of one. Taken before the analog gain.

    References
    ----------
    white1974; janesick2007, correlated double sampling.
    """
    return signal_sample_v - reset_sample_v
