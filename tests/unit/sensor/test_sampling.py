"""Pixels integrate the image's cells exactly."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import OpticalImage
from fullwell.sensor.sampling import PixelSampling, pixel_sampling

ROUNDING = 1e-12
"""Relative; sums of a few hundred products in double precision."""

GRID = WavelengthGrid(550.0, 550.0, 10.0)


def optical(rows: int, cols: int, pitch_m: float) -> OpticalImage:
    return OpticalImage(np.zeros((rows, cols, 1), np.float32), GRID, pitch_m)


def sampling(image: OpticalImage, rows: int, cols: int, pitch_m: float, fill_factor: float = 1.0) -> PixelSampling:
    return pixel_sampling(image, rows=rows, cols=cols, pixel_pitch_m=pitch_m, fill_factor=fill_factor)


def cells(rows: int, cols: int) -> np.ndarray:
    return np.random.default_rng(5).random((rows, cols))


@pytest.mark.parametrize("fill_factor", [1.0, 0.3])
def test_coinciding_grids_are_the_identity(fill_factor: float) -> None:
    image = cells(9, 12)
    found = sampling(optical(9, 12, 1.4e-6), 9, 12, 1.4e-6, fill_factor).mean_over_photodetectors(image)
    np.testing.assert_array_equal(found, image)


def test_pitches_that_differ_by_rounding_are_the_identity_too() -> None:
    image = cells(480, 640)
    found = sampling(optical(480, 640, 1.4e-6 * (1 - 1e-12)), 480, 640, 1.4e-6).mean_over_photodetectors(image)
    np.testing.assert_array_equal(found, image)


def test_a_smaller_sensor_sees_the_middle() -> None:
    image = cells(9, 12)
    found = sampling(optical(9, 12, 1e-6), 5, 8, 1e-6).mean_over_photodetectors(image)
    np.testing.assert_array_equal(found, image[2:7, 2:10])


def test_a_pixel_of_two_by_two_cells_has_their_mean() -> None:
    image = cells(8, 12)
    found = sampling(optical(8, 12, 1e-6), 4, 6, 2e-6).mean_over_photodetectors(image)
    np.testing.assert_allclose(found, image.reshape(4, 2, 6, 2).mean(axis=(1, 3)), rtol=ROUNDING)


def test_a_pixel_within_one_cell_has_its_value() -> None:
    image = cells(4, 4)
    found = sampling(optical(4, 4, 3e-6), 12, 12, 1e-6).mean_over_photodetectors(image)
    np.testing.assert_allclose(found, np.kron(image, np.ones((3, 3))), rtol=ROUNDING)


def test_a_small_photodetector_sees_only_its_own_square() -> None:
    """Two pixels of 4 cells, photodetector a quarter of the area: the middle 2 x 2 cells of each."""
    image = cells(4, 8)
    found = sampling(optical(4, 8, 1e-6), 1, 2, 4e-6, 0.25).mean_over_photodetectors(image)
    np.testing.assert_allclose(found, [[image[1:3, 1:3].mean(), image[1:3, 5:7].mean()]], rtol=ROUNDING)


def test_an_odd_ratio_shares_cells_by_length() -> None:
    image = np.array([[1.0, 2.0, 4.0]])
    found = sampling(optical(1, 3, 1e-6), 1, 2, 1e-6).mean_over_photodetectors(image)
    np.testing.assert_allclose(found, [[1.5, 3.0]], rtol=ROUNDING)


@pytest.mark.parametrize(("samples", "pixels"), [(30, 7), (7, 30), (100, 99), (64, 64), (31, 3)])
def test_flux_is_conserved_for_any_ratio_that_covers_the_image(samples: int, pixels: int) -> None:
    image = cells(samples, samples + 5)
    width_m = samples * 1e-6
    pixel_pitch_m = width_m / pixels
    strip = sampling(optical(samples, samples + 5, 1e-6), pixels, 1, pixel_pitch_m)
    columns = strip.col_weights @ np.ones(samples + 5)
    np.testing.assert_allclose(columns, 1.0, rtol=ROUNDING)
    found = strip.row_weights @ image
    np.testing.assert_allclose(found.sum(axis=0) * pixel_pitch_m, image.sum(axis=0) * 1e-6, rtol=ROUNDING)


def test_every_other_pixel_can_be_asked_for_alone() -> None:
    image = cells(20, 26)
    some = sampling(optical(20, 26, 1e-6), 8, 10, 2.2e-6)
    whole = some.mean_over_photodetectors(image)
    part = some.mean_over_photodetectors(image, first_row=1, row_step=2, first_col=0, col_step=3)
    np.testing.assert_allclose(part, whole[1::2, ::3], rtol=ROUNDING)


def test_a_sensor_larger_than_the_image_is_refused_with_what_would_fit() -> None:
    with pytest.raises(FieldError, match="at most 10") as caught:
        sampling(optical(20, 20, 1e-6), 10, 12, 2e-6)
    assert caught.value.path == "cols"
    sampling(optical(20, 20, 1e-6), 10, 10, 2e-6)
