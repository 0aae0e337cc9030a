"""The radiance image refuses shapes that do not fit together."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError, ShapeError
from fullwell.radiometry import RadianceImage, WavelengthGrid

GRID = WavelengthGrid(500.0, 520.0, 10.0)


def test_rows_and_columns_are_those_of_the_array() -> None:
    image = RadianceImage(np.zeros((4, 5, 3), np.float32), GRID, 0.01, np.zeros((4, 5), np.float32))
    assert (image.rows, image.cols) == (4, 5)


def test_bands_must_be_those_of_the_grid() -> None:
    with pytest.raises(ShapeError, match=r"must be \(rows, cols, 3\)"):
        RadianceImage(np.zeros((4, 5, 4), np.float32), GRID, 0.01)


def test_the_standard_error_must_be_one_value_per_pixel() -> None:
    with pytest.raises(ShapeError, match="standard_error"):
        RadianceImage(np.zeros((4, 5, 3), np.float32), GRID, 0.01, np.zeros((5, 4), np.float32))


@pytest.mark.parametrize("pitch", [0.0, -1.0, float("nan"), float("inf")])
def test_the_pitch_must_be_positive(pitch: float) -> None:
    with pytest.raises(FieldError, match="tangent_pitch"):
        RadianceImage(np.zeros((4, 5, 3), np.float32), GRID, pitch)
