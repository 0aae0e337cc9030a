"""The colour filter array: which channel each pixel has, and the mosaic that results."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.sensor.parameters import ColorFilterArray
from fullwell.sensor.sampling import PixelSampling

__all__ = ["PATTERN_NAMES", "cfa_pattern", "channel_index_map", "mosaic"]

_PATTERNS: Final = {
    "rggb": "R G/G B",
    "grbg": "G R/B G",
    "gbrg": "G B/R G",
    "bggr": "B G/G R",
    "mono": "W",
    "rccc": "R C/C C",
    "rccb": "R C/C B",
    "ryycy": "R Y/Y Cy",
    "rgbw": "R G/B W",
    "rgb-nir": "R G/NIR B",
    "quad-rggb": "R R G G/R R G G/G G B B/G G B B",
    "quad-ryycy": "R R Y Y/R R Y Y/Y Y Cy Cy/Y Y Cy Cy",
}
"""Rows divided by /; C and W are clear pixels, Y yellow, Cy cyan."""

PATTERN_NAMES: Final = tuple(sorted(_PATTERNS))
"""Patterns that have names."""


def cfa_pattern(name: str, *, path: str = "pattern") -> tuple[tuple[str, ...], ...]:
    """Return the rows of channel names of a named pattern; case does not matter.

    Raises FieldError, naming the nearest known pattern, where `name` is not known; `path` is the field that asked.
    """
    text = _PATTERNS.get(name.casefold())
    if text is None:
        raise FieldError(unknown_name_message("filter pattern", name, _PATTERNS), path=path, value=name)
    return tuple(tuple(row.split(" ")) for row in text.split("/"))


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
