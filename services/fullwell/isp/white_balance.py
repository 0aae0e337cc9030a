"""White balance: one gain per channel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "apply_gains",
    "balance_mosaic",
    "gains_for_gray_world",
    "gains_for_white",
    "gains_for_white_patch",
    "unsaturated_cells",
]


def gains_for_white(white_response: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the gains that make a white neutral, (channels,), the smallest 1.

    `white_response` is (channels,), in any unit. With no gain below 1, a pixel that is saturated in every channel stays
    at or above 1 in every channel, so that clipped highlights come out white. A channel whose response is not above 0 says
    nothing about the light and keeps a gain of 1.
    """
    seen = white_response > 0
    highest = np.max(white_response, where=seen, initial=0.0)
    return np.divide(highest, white_response, out=np.ones(white_response.shape), where=seen)


def unsaturated_cells(
    mosaic: NDArray[np.float64], pattern: tuple[tuple[str, ...], ...], channel_names: tuple[str, ...]
) -> NDArray[np.float64]:
    """Return the mean of each channel in each repeat of the pattern that holds no saturated pixel, (cells, channels).

    `mosaic` is (rows, cols), 1 at saturation: a saturated pixel hides how much more light there was. All cells where every
    one is saturated; one cell, the whole picture, where it is smaller than the pattern. Channels that the pattern lacks are 0.
    """
    tall, wide = len(pattern), len(pattern[0])
    rows, cols = mosaic.shape[0] // tall, mosaic.shape[1] // wide
    if rows == 0 or cols == 0:
        return np.zeros((1, len(channel_names)))
    cells = mosaic[: rows * tall, : cols * wide].reshape(rows, tall, cols, wide).transpose(0, 2, 1, 3)
    pixels = cells.reshape(rows * cols, tall * wide)
    whole = np.all(pixels < 1.0, axis=1)
    pixels = pixels[whole] if np.any(whole) else pixels
    names = np.array([name for row in pattern for name in row])
    means = [pixels[:, names == name].mean(axis=1) if name in names else np.zeros(len(pixels)) for name in channel_names]
    return np.stack(means, axis=1)


def gains_for_gray_world(channel_values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the gains that make the mean of a picture (..., channels) neutral, (channels,), the smallest 1.

    All ones where a channel's mean is not above 0: a black picture says nothing about the light.

    References
    ----------
    buchsbaum1980.
    """
    return _gains_if_lit(np.mean(channel_values.reshape(-1, channel_values.shape[-1]), axis=0))


def gains_for_white_patch(channel_values: NDArray[np.float64], *, percentile: float) -> NDArray[np.float64]:
    """Return the gains that make the brightest values of a picture (..., channels) neutral, (channels,), the smallest 1.

    Of each channel the given percentile counts: 100 is the brightest value, which is mostly noise. All ones where one is not
    above 0.

    References
    ----------
    land1971; percentiles instead of the maximum: ebner2007.
    """
    return _gains_if_lit(np.percentile(channel_values.reshape(-1, channel_values.shape[-1]), percentile, axis=0))


def _gains_if_lit(white_response: NDArray[np.float64]) -> NDArray[np.float64]:
    return gains_for_white(white_response) if np.all(white_response > 0) else np.ones(white_response.shape)


def apply_gains(channel_values: NDArray[np.float64], channel_gain_ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the channels times their gains, clipped at 1, (rows, cols, channels).

    Clipping all channels at the same height keeps partly saturated highlights from turning pink.
    """
    return np.minimum(channel_values * channel_gain_ratio, 1.0)


def balance_mosaic(
    mosaic: NDArray[np.float64],
    pattern: tuple[tuple[str, ...], ...],
    channel_names: tuple[str, ...],
    channel_gain_ratio: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the mosaic times the gains of its pixels' channels, clipped at 1, (rows, cols)."""
    gain_ratio = dict(zip(channel_names, channel_gain_ratio, strict=True))
    balanced = np.empty_like(mosaic)
    for top, row in enumerate(pattern):
        for left, name in enumerate(row):
            here = (slice(top, None, len(pattern)), slice(left, None, len(row)))
            balanced[here] = apply_gains(mosaic[here], gain_ratio[name])
    return balanced
