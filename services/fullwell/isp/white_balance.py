"""White balance: one gain per channel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["apply_gains", "gains_for_gray_world", "gains_for_white"]


def gains_for_white(white_response: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the gains that make a white neutral, (channels,), the smallest 1.

    `white_response` is (channels,), > 0, in any unit. With no gain below 1, a pixel that is saturated in every channel stays
    at or above 1 in every channel, so that clipped highlights come out white.
    """
    return np.asarray(np.max(white_response) / white_response)


def gains_for_gray_world(channel_values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the gains that make the mean of a picture (rows, cols, channels) neutral, (channels,), the smallest 1.

    All ones where a channel's mean is not above 0: a black picture says nothing about the light.
    """
    means = np.mean(channel_values, axis=(0, 1))
    if not np.all(means > 0):
        return np.ones(means.shape)
    return gains_for_white(means)


def apply_gains(channel_values: NDArray[np.float64], channel_gain_ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the channels times their gains, clipped at 1, (rows, cols, channels).

    Clipping all channels at the same height keeps partly saturated highlights from turning pink.
    """
    return np.minimum(channel_values * channel_gain_ratio, 1.0)
