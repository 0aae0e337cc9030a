"""Row and column noise: what all pixels of a row or a column have in common."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.sensor.fixed_pattern import FixedPattern, line_normals

__all__ = ["column_gain_pattern", "line_offsets_v", "row_noise_v"]


def line_offsets_v(pattern: FixedPattern, *, column_offset_v: float, row_offset_v: float) -> NDArray[np.float64] | None:
    """Return the fixed offsets of columns and rows, broadcastable to (rows, cols) [V]; None where there are none.

    Part of the sensor's fixed pattern, before the analog gain.

    References
    ----------
    emva1288 (release 4), non-uniformities of columns and rows.
    """
    if column_offset_v == 0 and row_offset_v == 0:
        return None
    columns = column_offset_v * line_normals(pattern, "columns")[None, :]
    return columns + row_offset_v * line_normals(pattern, "rows")[:, None] if row_offset_v > 0 else columns


def column_gain_pattern(pattern: FixedPattern, *, column_gain_fraction: float) -> NDArray[np.float64] | None:
    """Return the fixed relative gain of each column's amplifier, (1, cols), mean 1; None where all are 1."""
    if column_gain_fraction == 0:
        return None
    return np.maximum(1.0 + column_gain_fraction * line_normals(pattern, "column_gain"), 0.0)[None, :]


def row_noise_v(*, rows: int, row_noise_v: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return zero-mean Gaussian noise, the same along each row, (rows, 1) [V], new at each readout.

    References
    ----------
    emva1288 (release 4), temporal row noise.
    """
    return rng.standard_normal((rows, 1)) * row_noise_v
