"""Scenes in compatibility mode beyond the reference's cases: other grids and sizes, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError, ShapeError
from fullwell.radiometry import RadianceImage, WavelengthGrid
from fullwell.radiometry.isetcam import illuminant_photons, photometric_sum
from fullwell.scene.isetcam import IsetcamScene, scene_from_radiance, with_illuminant, with_mean_luminance
from fullwell.scene.isetcam_charts import (
    bar_scene,
    grid_lines_scene,
    line_scene,
    macbeth_scene,
    pattern_scene,
    point_array_scene,
    slanted_bar_scene,
    uniform_scene,
    zone_plate_scene,
)

ROUNDING = 1e-12
"""Relative; a sum of some thousand products."""


@pytest.mark.parametrize("wavelength_nm", [[550.0], [450.0, 550.0, 650.0], np.arange(400.0, 701.0, 7.0)])
@pytest.mark.parametrize("make", [uniform_scene, slanted_bar_scene, macbeth_scene, zone_plate_scene])
def test_every_scene_has_a_mean_of_100_cd_m2_on_every_grid(make: object, wavelength_nm: list[float]) -> None:
    scene = make(8, wavelength_nm=wavelength_nm)  # type: ignore[operator]
    assert scene.mean_luminance_cd_m2 == pytest.approx(100.0, rel=ROUNDING)


def test_one_wavelength_has_a_bin_of_1_nm() -> None:
    one = photometric_sum(np.ones((1, 1, 1)), [550.0])
    three = photometric_sum(np.array([[[0.0, 1.0, 0.0]]]), [540.0, 550.0, 560.0])
    assert three == pytest.approx(10.0 * one, rel=ROUNDING)


@pytest.mark.parametrize("size", [1, 2, 7, 32])
def test_a_slanted_bar_has_an_odd_number_of_rows(size: int) -> None:
    scene = slanted_bar_scene(size)
    assert scene.rows == scene.cols == 2 * ((size + 1) // 2) + 1


def test_points_lines_and_bars_lie_on_their_grounds() -> None:
    points, lines = point_array_scene(16, 8).luminance_cd_m2, grid_lines_scene(16, 8).luminance_cd_m2
    assert np.argwhere(points > 0).tolist() == [[3, 3], [3, 11], [11, 3], [11, 11]]
    assert lines.min() / lines.max() == pytest.approx(1e-4)
    for scene, ground, width in ((line_scene(16), 1e-4, 1), (bar_scene(16, 3), 1e-8, 3)):
        row = scene.luminance_cd_m2[0]
        assert row.min() / row.max() == pytest.approx(ground)
        assert np.count_nonzero(row == row.max()) == width


def test_changing_the_light_keeps_the_mean_and_the_reflectances() -> None:
    scene = macbeth_scene(2)
    changed = with_illuminant(scene, illuminant_photons("A", scene.wavelength_nm))
    assert changed.mean_luminance_cd_m2 == pytest.approx(100.0, rel=ROUNDING)
    before, after = scene.photons / scene.illuminant_photons, changed.photons / changed.illuminant_photons
    np.testing.assert_allclose(after, before, rtol=ROUNDING)


def test_a_rendered_radiance_keeps_its_field_of_view() -> None:
    photons = np.full((4, 6, 3), 1e15, dtype=np.float32)
    scene = scene_from_radiance(RadianceImage(photons, WavelengthGrid(450, 650, 100), tangent_pitch=0.01), distance_m=2.0)
    assert scene.width_m == pytest.approx(2.0 * 6 * 0.01, rel=ROUNDING)
    assert scene.height_m == pytest.approx(2.0 * 4 * 0.01, rel=ROUNDING)


def test_a_scene_without_luminance_cannot_be_scaled() -> None:
    with pytest.raises(FieldError, match="NaN"):
        pattern_scene(np.zeros((4, 4)))
    dark = IsetcamScene(np.zeros((2, 2, 1)), np.array([550.0]), 10.0, 1.2, np.ones(1))
    assert dark.mean_luminance_cd_m2 == 0
    with pytest.raises(FieldError, match="no luminance"):
        with_mean_luminance(dark, 100.0)


@pytest.mark.parametrize(
    "fault",
    [
        {"wavelength_nm": [600.0, 500.0]},
        {"wavelength_nm": [300.0, 400.0]},
        {"hfov_deg": 180.0},
        {"distance_m": 0.0},
        {"luminance_cd_m2": -1.0},
        {"luminance_cd_m2": np.nan},
        {"illuminant": "D66"},
        {"illuminant": "blackbody:warm"},
        {"illuminant": "blackbody:1"},
    ],
)
def test_a_macbeth_chart_out_of_range_is_refused(fault: dict[str, object]) -> None:
    with pytest.raises(FieldError):
        macbeth_scene(2, **fault)  # type: ignore[arg-type]


def test_arrays_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ShapeError):
        IsetcamScene(np.ones((2, 2, 3)), np.array([500.0, 600.0]), 10.0, 1.2, np.ones(2))
    with pytest.raises(FieldError):
        IsetcamScene(np.full((2, 2, 1), np.nan), np.array([550.0]), 10.0, 1.2, np.ones(1))
