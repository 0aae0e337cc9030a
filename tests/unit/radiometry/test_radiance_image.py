"""Images of radiance, by bands and by channels, refuse shapes that do not fit together."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError, ShapeError
from fullwell.radiometry import ChannelRadiance, RadianceImage, WavelengthGrid

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


NM = np.array([450.0, 550.0])
CHANNEL = np.array([0, 1])


@pytest.mark.parametrize(
    ("shape", "wavelength_nm", "channel"),
    [
        ((3, 4, 5), NM, CHANNEL),
        ((2, 4, 5), NM[:1], CHANNEL),
        ((2, 4, 5), NM, CHANNEL[:1]),
        ((2, 20), NM, CHANNEL),
        ((2, 4, 5), NM[:, None], CHANNEL),
    ],
)
def test_every_part_of_a_channel_needs_its_wavelength_and_its_channel(
    shape: tuple[int, ...], wavelength_nm: np.ndarray, channel: np.ndarray
) -> None:
    with pytest.raises(ShapeError, match=r"must be \(parts, rows, cols\) and \(parts,\)"):
        ChannelRadiance(np.zeros(shape), wavelength_nm, channel, 0.01)


@pytest.mark.parametrize("pitch", [0.0, -1.0, float("nan"), float("inf")])
def test_the_pitch_of_channels_must_be_positive(pitch: float) -> None:
    with pytest.raises(FieldError, match="tangent_pitch"):
        ChannelRadiance(np.zeros((2, 4, 5)), NM, CHANNEL, pitch)


def test_parts_may_share_a_channel() -> None:
    image = ChannelRadiance(np.zeros((2, 4, 5)), NM, np.array([0, 0]), 0.01)
    assert image.electrons.shape == (2, 4, 5)
