"""The optics stage as a whole: units, order, notes and what it refuses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import FieldError, ShapeError
from fullwell.optics import OpticalImage, compute_irradiance, on_axis_factor_sr, relative_illumination
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene import Lens

GRID = WavelengthGrid(450.0, 650.0, 100.0)
LENS = Lens("thin_lens", 4e-3, 2.0, 0.5, Spectrum.constant(0.9))

FLOAT32_ROUNDING = 3e-7
"""Relative; irradiance is stored in single precision."""


def radiance(rows: int = 12, cols: int = 16, value: float = 1e17, tangent_pitch: float = 1e-3) -> RadianceImage:
    return RadianceImage(np.full((rows, cols, 3), value, np.float32), GRID, tangent_pitch)


def test_a_uniform_scene_gives_camera_equation_times_falloff() -> None:
    scene = radiance()
    optical = compute_irradiance(scene, LENS, terms=("relative_illumination",))
    fall = relative_illumination(rows=12, cols=16, tangent_pitch=1e-3, lens=LENS)
    expected = 1e17 * on_axis_factor_sr(LENS, GRID) * fall[:, :, None]
    np.testing.assert_allclose(optical.photons, expected, rtol=FLOAT32_ROUNDING)
    assert optical.photons.dtype == np.float32


def test_samples_are_spread_by_the_image_distance_not_the_focal_length() -> None:
    assert compute_irradiance(radiance(), LENS).sample_pitch_m == pytest.approx(1e-3 / (1 / 4e-3 - 1 / 0.5), rel=1e-12)


def test_diffraction_uses_the_f_number_of_the_cone_that_reaches_the_film() -> None:
    """At unit magnification the cone is twice as slow, so the picture equals that of twice the f-number at infinity."""
    pattern = np.random.default_rng(0).random((24, 24, 3)).astype(np.float32)
    scene = RadianceImage(pattern, GRID, 1e-3)
    close = Lens("pinhole", 4e-3, 2.0, 8e-3, Spectrum.constant(1.0))
    slow = Lens("pinhole", 8e-3, 4.0, math.inf, Spectrum.constant(1.0))
    np.testing.assert_allclose(
        compute_irradiance(scene, close).photons, compute_irradiance(scene, slow).photons, rtol=FLOAT32_ROUNDING
    )


def test_terms_that_are_left_out_are_noted() -> None:
    assert compute_irradiance(radiance(), LENS, terms=()).notes == (
        "relative_illumination: left out on request.",
        "diffraction: left out on request.",
    )
    assert compute_irradiance(radiance(), replace(LENS, diffraction=False)).notes == ("diffraction: switched off in the lens.",)
    assert compute_irradiance(radiance(tangent_pitch=5e-4), LENS).notes == ()


def test_diffraction_far_below_a_sample_is_left_out_with_its_bound() -> None:
    coarse = compute_irradiance(radiance(tangent_pitch=0.1), LENS)
    (note,) = coarse.notes
    assert note.startswith("diffraction: left out in 3 of 3 bands")
    assert "contrast at Nyquist" in note


def test_the_scene_is_not_modified() -> None:
    scene = radiance()
    before = scene.photons.copy()
    compute_irradiance(scene, LENS)
    np.testing.assert_array_equal(scene.photons, before)


def test_a_dark_scene_stays_exactly_dark() -> None:
    assert not np.any(compute_irradiance(radiance(value=0.0), LENS).photons)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_radiance_that_is_not_light_is_refused(bad: float) -> None:
    scene = radiance()
    scene.photons[3, 4, 1] = bad
    with pytest.raises(FieldError, match="finite and >= 0"):
        compute_irradiance(scene, LENS)


def test_an_unknown_term_is_answered_with_the_nearest() -> None:
    with pytest.raises(FieldError, match="did you mean 'diffraction'"):
        compute_irradiance(radiance(), LENS, terms=("difraction",))  # type: ignore[arg-type]


def test_no_term_makes_a_picture_with_holes_from_a_headlight_at_night() -> None:
    scene = radiance(rows=50, cols=60, value=1e10, tangent_pitch=4e-4)
    scene.photons[20, 30] = 1e20
    optical = compute_irradiance(scene, LENS)
    assert np.all(np.isfinite(optical.photons))
    assert np.min(optical.photons) >= 0


def test_an_optical_image_checks_its_shape() -> None:
    with pytest.raises(ShapeError, match="must be"):
        OpticalImage(np.zeros((2, 2, 4), np.float32), GRID, 1e-6)
    with pytest.raises(FieldError, match="sample_pitch_m"):
        OpticalImage(np.zeros((2, 2, 3), np.float32), GRID, 0.0)
