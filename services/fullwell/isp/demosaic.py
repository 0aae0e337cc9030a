"""Demosaicing: every channel at every pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

__all__ = ["demosaic_bilinear"]


def demosaic_bilinear(
    mosaic: NDArray[np.float64], pattern: tuple[tuple[str, ...], ...], channel_names: tuple[str, ...]
) -> NDArray[np.float64]:
    """Return every channel at every pixel, (rows, cols, channels), in the mosaic's unit.

    Measured values stay as they are; the others are means of the channel's pixels nearby, weighted by a tent one period of
    the pattern wide on each side. For a 2 x 2 Bayer pattern in any order this is bilinear interpolation. Beyond its border
    the mosaic is continued as a mirror image without repeating the border itself, which keeps a Bayer pattern's order.

    Parameters
    ----------
    mosaic
        (rows, cols).
    pattern
        Rows of channel names, any N x M; the top left one belongs to the top left pixel.
    channel_names
        The channels wanted, in order. One that no pixel has comes out as 0.

    References
    ----------
    Normalised convolution: knutsson1993.
    """
    rows, cols = mosaic.shape
    if len(pattern) == 1 and len(pattern[0]) == 1:
        return np.stack([mosaic if name == pattern[0][0] else np.zeros_like(mosaic) for name in channel_names], axis=2)
    names = np.array(pattern)
    at_pixel = names[np.arange(rows)[:, None] % names.shape[0], np.arange(cols)[None, :] % names.shape[1]]
    result = np.empty((rows, cols, len(channel_names)))
    for k, name in enumerate(channel_names):
        measured = at_pixel == name
        gathered = _tent(np.where(measured, mosaic, 0.0), names.shape)
        weight = _tent(measured.astype(np.float64), names.shape)
        interpolated = np.divide(gathered, weight, out=np.zeros_like(gathered), where=weight > 0)
        result[:, :, k] = np.where(measured, mosaic, interpolated)
    return result


def _tent(values: NDArray[np.float64], periods: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the values convolved with the tent of each axis' period: 1 2 1 for a period of 2."""
    for axis, period in enumerate(periods):
        if period > 1:
            kernel = period - np.abs(np.arange(-(period - 1), period), dtype=np.float64)
            values = convolve1d(values, kernel, axis=axis, mode="mirror")
    return values
