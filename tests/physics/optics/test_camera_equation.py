"""The camera equation against closed forms and direct integration over the pupil."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.optics import on_axis_factor_sr, projected_solid_angle_sr, working_f_number
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.scene import Lens

ROUNDING = 1e-12
"""Relative; a few operations in double precision."""

QUADRATURE_TOLERANCE = 1e-7
"""Relative; error of the 20000-ring midpoint sum over the pupil, which shrinks as the square of the ring's width."""


def lens(f_number: float, focus_m: float = math.inf, transmittance: float = 1.0) -> Lens:
    return Lens("thin_lens", 5e-3, f_number, focus_m, Spectrum.constant(transmittance))


@pytest.mark.parametrize("f_number", [0.7, 1.0, 1.8, 4.0, 16.0])
@pytest.mark.parametrize("focus_m", [0.02, 1.2, math.inf])
def test_on_axis_irradiance_is_the_integral_over_the_pupil_of_a_lambertian_disc(f_number: float, focus_m: float) -> None:
    camera_lens = lens(f_number, focus_m)
    distance_m, radius_m = camera_lens.image_distance_m, camera_lens.pupil_diameter_m / 2
    rings = 20000
    r = (np.arange(rings) + 0.5) * radius_m / rings
    integral = np.sum(distance_m**2 / (distance_m**2 + r**2) ** 2 * 2 * np.pi * r) * radius_m / rings
    found = projected_solid_angle_sr(f_number, camera_lens.magnification)
    assert found == pytest.approx(integral, rel=QUADRATURE_TOLERANCE)


def test_a_slow_lens_at_infinity_has_the_textbook_value() -> None:
    slow = 1000.0
    assert projected_solid_angle_sr(slow, 0.0) == pytest.approx(math.pi / (4 * slow**2), rel=1 / slow**2)


def test_no_lens_collects_more_than_the_hemisphere() -> None:
    assert projected_solid_angle_sr(1e-6, 0.0) < math.pi


def test_the_sign_of_the_magnification_does_not_matter() -> None:
    assert working_f_number(2.0, -0.5) == working_f_number(2.0, 0.5) == 3.0


def test_transmittance_scales_each_band_by_its_mean() -> None:
    grid = WavelengthGrid(500.0, 600.0, 100.0)
    ramp = Spectrum(np.array([450.0, 650.0]), np.array([0.2, 1.0]))
    camera_lens = Lens("pinhole", 5e-3, 2.0, math.inf, ramp)
    clear = projected_solid_angle_sr(2.0, 0.0)
    np.testing.assert_allclose(on_axis_factor_sr(camera_lens, grid), clear * np.array([0.4, 0.8]), rtol=ROUNDING)


@pytest.mark.parametrize("transmittance", [-0.1, 1.2])
def test_a_transmittance_outside_0_to_1_is_refused(transmittance: float) -> None:
    with pytest.raises(FieldError, match=r"in \[0, 1\]"):
        on_axis_factor_sr(lens(2.0, transmittance=transmittance), WavelengthGrid())


@pytest.mark.parametrize("f_number", [0.0, -1.0, math.nan, math.inf])
def test_an_impossible_f_number_is_refused(f_number: float) -> None:
    with pytest.raises(FieldError, match="f_number"):
        on_axis_factor_sr(lens(f_number), WavelengthGrid())


def test_focusing_within_the_focal_length_is_refused() -> None:
    with pytest.raises(FieldError, match="focus_distance_m"):
        on_axis_factor_sr(lens(2.0, focus_m=4e-3), WavelengthGrid())
