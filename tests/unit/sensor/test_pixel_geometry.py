"""Where a pixel's photodetector lies and what its micro-lens and its neighbours take."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import (
    ChiefRayFalloff,
    OpticalImage,
    RadialFalloff,
    SensorModel,
    channel_currents,
    mix_channels,
    photo_electron_rate,
    sensor,
)
from fullwell.sensor.crosstalk import spread_electrons
from fullwell.sensor.microlens import pixel_illumination
from fullwell.sensor.quantum_efficiency import band_quantum_efficiency

ROUNDING = 1e-12
"""Relative; a few operations in double precision."""

PRODUCT_TOLERANCE = 1e-9
"""Relative; a step at the end of a table becomes a ramp of a picometre."""

GRID = WavelengthGrid(500.0, 600.0, 10.0)
KERNEL = ((0.0, 0.02, 0.0), (0.03, 0.9, 0.01), (0.0, 0.04, 0.0))


def mono(**changes: object) -> SensorModel:
    return replace(sensor("ideal-mono"), rows=8, cols=10, **changes)  # type: ignore[arg-type]


def picture(rows: int, cols: int, pitch_m: float) -> OpticalImage:
    photons = np.random.default_rng(3).random((rows, cols, GRID.count)).astype(np.float32) * 1e15
    return OpticalImage(photons, GRID, pitch_m)


def test_a_photodetector_out_of_the_middle_sees_the_light_beside_the_middle() -> None:
    """Four samples per pixel, photodetector a quarter of the area in the lower right corner: the last sample."""
    optical = picture(16, 20, 2e-6)
    found = photo_electron_rate(optical, mono(fill_factor=0.25, photodetector_offset_m=(1e-6, 1e-6)))
    corner = OpticalImage(optical.photons[1::2, 1::2], GRID, 4e-6)
    np.testing.assert_allclose(found, photo_electron_rate(corner, mono()) * 0.25, rtol=ROUNDING)


def test_a_photodetector_beyond_its_pixel_is_refused() -> None:
    with pytest.raises(FieldError, match="stays within the pixel"):
        mono(fill_factor=0.5, photodetector_offset_m=(0.0, 1e-6))


def test_currents_integrated_once_give_the_same_electrons() -> None:
    optical = picture(16, 20, 2e-6)
    camera = mono(pixel_pitch_m=3.1e-6)
    currents = channel_currents(optical, camera.cfa)
    np.testing.assert_array_equal(photo_electron_rate(currents, camera), photo_electron_rate(optical, camera))
    other = replace(camera, rows=5, pixel_pitch_m=4e-6, cfa=replace(camera.cfa))
    np.testing.assert_array_equal(photo_electron_rate(currents, other), photo_electron_rate(optical, other))


def test_currents_of_other_channels_are_refused() -> None:
    optical = picture(16, 20, 2e-6)
    with pytest.raises(FieldError, match="channel_currents"):
        photo_electron_rate(channel_currents(optical, mono().cfa), replace(sensor("ideal-rgb"), rows=8, cols=10))


def test_a_chief_ray_falloff_is_a_power_of_the_cosine() -> None:
    found = pixel_illumination(ChiefRayFalloff(3.0, 2e-3), rows=5, cols=7, pixel_pitch_m=1e-4)
    assert found[2, 3] == 1.0
    assert found[0, 0] == pytest.approx(np.cos(np.arctan(np.hypot(2, 3) * 1e-4 / 2e-3)) ** 3, rel=ROUNDING)


def test_micro_lenses_shifted_for_the_lens_lose_nothing() -> None:
    found = pixel_illumination(ChiefRayFalloff(8.0, 2e-3, 2e-3), rows=5, cols=7, pixel_pitch_m=1e-4)
    np.testing.assert_array_equal(found, 1.0)


def test_a_table_is_read_by_radius_and_held_at_its_end() -> None:
    found = pixel_illumination(RadialFalloff((0.0, 2e-4), (1.0, 0.5)), rows=1, cols=7, pixel_pitch_m=1e-4)
    np.testing.assert_allclose(found[0, 3:], [1.0, 0.75, 0.5, 0.5], rtol=ROUNDING)


@pytest.mark.parametrize(
    "make",
    [
        lambda: RadialFalloff((0.0, 1.0), (1.0,)),
        lambda: RadialFalloff((0.0, 0.0), (1.0, 0.5)),
        lambda: RadialFalloff((0.0, 1.0), (1.0, 1.5)),
        lambda: ChiefRayFalloff(-1.0, 1e-3),
        lambda: ChiefRayFalloff(2.0, 0.0),
    ],
)
def test_an_impossible_falloff_is_refused(make: object) -> None:
    with pytest.raises(FieldError, match="microlens"):
        make()  # type: ignore[operator]


def test_the_falloff_multiplies_the_electrons() -> None:
    optical, falloff = picture(8, 10, 4e-6), RadialFalloff((0.0, 2e-5), (1.0, 0.2))
    plain = photo_electron_rate(optical, mono())
    map_ = pixel_illumination(falloff, rows=8, cols=10, pixel_pitch_m=4e-6)
    np.testing.assert_allclose(photo_electron_rate(optical, mono(microlens=falloff)), plain * map_, rtol=ROUNDING)


def test_crosstalk_sends_electrons_where_the_kernel_says() -> None:
    point = np.zeros((5, 5))
    point[2, 2] = 100.0
    np.testing.assert_allclose(spread_electrons(point, KERNEL)[1:4, 1:4], np.array(KERNEL) * 100, rtol=ROUNDING)


def test_crosstalk_keeps_uniform_light_uniform_and_loses_only_what_the_kernel_loses() -> None:
    lossy = ((0.0, 0.02, 0.0), (0.02, 0.85, 0.02), (0.0, 0.02, 0.0))
    np.testing.assert_allclose(spread_electrons(np.full((4, 6), 7.0), lossy), 7.0 * 0.93, rtol=ROUNDING)
    image = np.random.default_rng(1).random((6, 7))
    symmetric = ((0.01, 0.02, 0.01), (0.03, 0.86, 0.03), (0.01, 0.02, 0.01))
    assert np.sum(spread_electrons(image, symmetric)) == pytest.approx(np.sum(image), rel=ROUNDING)


def test_crosstalk_works_on_one_pixel() -> None:
    assert spread_electrons(np.array([[5.0]]), KERNEL)[0, 0] == pytest.approx(5.0)


@pytest.mark.parametrize(
    "kernel", [((0.5, 0.5, 0.5),) * 3, ((0.0, 1.0, 0.0),), ((0, -0.1, 0), (0, 1, 0), (0, 0, 0)), ((0, 0, 0),) * 3]
)
def test_a_kernel_that_makes_electrons_is_refused(kernel: tuple[tuple[float, ...], ...]) -> None:
    with pytest.raises(FieldError, match="crosstalk_kernel"):
        mono(crosstalk_kernel=kernel)


def test_the_channel_matrix_mixes_quantum_efficiencies() -> None:
    array = sensor("imx363").cfa
    matrix = np.array([[0.9, 0.05, 0.0], [0.1, 0.8, 0.1], [0.0, 0.05, 0.7]])
    mixed = band_quantum_efficiency(mix_channels(array, matrix), GRID)
    np.testing.assert_allclose(mixed, band_quantum_efficiency(array, GRID) @ matrix, rtol=PRODUCT_TOLERANCE)


def test_a_channel_matrix_that_makes_electrons_is_refused() -> None:
    array = sensor("ideal-rgb").cfa
    for matrix in (np.eye(2), -np.eye(3), 2 * np.eye(3), np.full((3, 3), np.nan)):
        with pytest.raises(FieldError):
            mix_channels(array, matrix)
