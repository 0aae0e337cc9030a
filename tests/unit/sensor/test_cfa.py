"""Each pixel gets its own channel."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.sensor import ColorFilterArray, OpticalImage
from fullwell.sensor.cfa import channel_index_map, mosaic
from fullwell.sensor.sampling import pixel_sampling

HALF = Spectrum.constant(0.5)


def cfa(*rows: str) -> ColorFilterArray:
    names = sorted({name for row in rows for name in row})
    return ColorFilterArray(tuple(tuple(row) for row in rows), tuple((name, HALF) for name in names))


@pytest.mark.parametrize("rows", [("RG", "GB"), ("BG", "GR"), ("RGB",), ("W",), ("RRGG", "RRGG", "GGBB", "GGBB"), ("RC", "CC")])
def test_the_mosaic_takes_each_pixel_from_its_channel(rows: tuple[str, ...]) -> None:
    array = cfa(*rows)
    height, width = 7, 9
    images = np.random.default_rng(1).random((len(array.channels), height, width))
    optical = OpticalImage(np.zeros((height, width, 1), np.float32), WavelengthGrid(550, 550, 10), 1e-6)
    sampling = pixel_sampling(optical, rows=height, cols=width, pixel_pitch_m=1e-6, fill_factor=1.0)
    index = channel_index_map(array, rows=height, cols=width)
    expected = np.take_along_axis(images, index[None], axis=0)[0]
    np.testing.assert_array_equal(mosaic(images, array, sampling), expected)


def test_the_pattern_starts_at_the_top_left() -> None:
    index = channel_index_map(cfa("RG", "GB"), rows=2, cols=2)
    names = cfa("RG", "GB").channel_names
    assert [[names[k] for k in row] for row in index] == [["R", "G"], ["G", "B"]]


def test_a_sensor_smaller_than_the_pattern_works() -> None:
    assert channel_index_map(cfa("RRGG", "RRGG"), rows=1, cols=2).shape == (1, 2)


def test_a_channel_that_does_not_exist_is_answered_with_the_nearest() -> None:
    with pytest.raises(FieldError, match="did you mean 'Red'"):
        ColorFilterArray((("red1",),), (("Red", HALF), ("Blue", HALF)))


def test_a_ragged_pattern_is_refused() -> None:
    with pytest.raises(FieldError, match="rectangle"):
        ColorFilterArray((("R", "R"), ("R",)), (("R", HALF),))


def test_a_quantum_efficiency_above_one_is_refused() -> None:
    with pytest.raises(FieldError, match="within 0 to 1"):
        ColorFilterArray((("R",),), (("R", Spectrum.constant(1.01)),))


def test_a_channel_named_twice_is_refused() -> None:
    with pytest.raises(FieldError, match="differently"):
        ColorFilterArray((("R",),), (("R", HALF), ("R", HALF)))
