"""The colour filter array: which channel each pixel has, and the mosaic that results."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.sensor.parameters import ColorFilterArray
from fullwell.sensor.sampling import PixelSampling

__all__ = ["channel_index_map", "mosaic"]


def channel_index_map(cfa: ColorFilterArray, *, rows: int, cols: int) -> NDArray[np.intp]:
    """Return the index into `cfa.channels` of each pixel, (rows, cols); the pattern starts at the top left."""
    names = cfa.channel_names
    unit = np.array([[names.index(name) for name in row] for row in cfa.pattern], dtype=np.intp)
    return np.asarray(unit[np.arange(rows)[:, None] % unit.shape[0], np.arange(cols)[None, :] % unit.shape[1]])


def mosaic(channel_images: NDArray[np.float64], cfa: ColorFilterArray, sampling: PixelSampling) -> NDArray[np.float64]:
    """Return each pixel's mean over its photodetector in its own channel only, (rows, cols), in the images' unit.

    `channel_images` is (channels, sample rows, sample cols). Any N x M pattern.
    """
    rows, cols = sampling.row_weights.shape[0], sampling.col_weights.shape[0]
    names = cfa.channel_names
    period_rows, period_cols = len(cfa.pattern), len(cfa.pattern[0])
    pixels = np.empty((rows, cols))
    for r in range(min(period_rows, rows)):
        for c in range(min(period_cols, cols)):
            pixels[r::period_rows, c::period_cols] = sampling.mean_over_photodetectors(
                channel_images[names.index(cfa.pattern[r][c])],
                first_row=r,
                row_step=period_rows,
                first_col=c,
                col_step=period_cols,
            )
    return pixels
