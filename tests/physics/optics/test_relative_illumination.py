"""Falloff towards the corner against closed forms and direct integration over the pupil."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.optics import cos_fourth, disc_falloff, relative_illumination
from fullwell.radiometry import Spectrum
from fullwell.scene import Lens

ROUNDING = 1e-12
"""Relative; a few operations in double precision."""

QUADRATURE_TOLERANCE = 1e-6
"""Relative; error of the polar midpoint sum over the pupil with 2000 rings and 720 spokes."""


def falloff_by_integration(tan_field: float, tan_pupil: float) -> float:
    """Return the irradiance from a Lambertian disc at unit distance, over that on the axis, summed over the disc."""
    rings, spokes = 2000, 720
    r = (np.arange(rings) + 0.5) * tan_pupil / rings
    angle = (np.arange(spokes) + 0.5) * 2 * np.pi / spokes
    squared_distance = 1 + tan_field**2 + r[:, None] ** 2 - 2 * tan_field * r[:, None] * np.cos(angle)
    axis = np.sum(r * spokes / (1 + r**2) ** 2)
    return float(np.sum(r[:, None] / squared_distance**2) / axis)


@pytest.mark.parametrize("field_deg", [0.0, 5.0, 15.0, 30.0, 45.0, 60.0])
@pytest.mark.parametrize("f_number", [0.9, 1.8, 4.0, 22.0])
def test_a_thin_lens_falls_off_as_the_integral_over_its_pupil(field_deg: float, f_number: float) -> None:
    tan_field, tan_pupil = math.tan(math.radians(field_deg)), 0.5 / f_number
    found = float(disc_falloff(tan_field, tan_pupil=tan_pupil))
    assert found == pytest.approx(falloff_by_integration(tan_field, tan_pupil), rel=QUADRATURE_TOLERANCE)


@pytest.mark.parametrize(("field_deg", "expected"), [(0.0, 1.0), (30.0, 9 / 16), (45.0, 0.25), (60.0, 1 / 16)])
def test_a_pinhole_falls_off_as_cos4(field_deg: float, expected: float) -> None:
    assert float(cos_fourth(math.tan(math.radians(field_deg)))) == pytest.approx(expected, rel=ROUNDING)


def test_a_vanishing_pupil_tends_to_cos4_without_cancellation() -> None:
    tan_field = np.linspace(0, 3, 50)
    np.testing.assert_allclose(disc_falloff(tan_field, tan_pupil=1e-9), cos_fourth(tan_field), rtol=ROUNDING)


def test_a_fast_lens_falls_off_less_than_cos4() -> None:
    """At 30 degrees and f/1.8 the exact law gives 0.596; cos^4 gives 0.5625."""
    found = float(disc_falloff(math.tan(math.radians(30.0)), tan_pupil=0.5 / 1.8))
    assert found == pytest.approx(0.596, abs=5e-4)


@pytest.mark.parametrize("kind", ["pinhole", "thin_lens"])
def test_the_map_is_centred_and_symmetric(kind: str) -> None:
    lens = Lens(kind, 4e-3, 2.0, 0.5, Spectrum.constant(1.0))
    fall = relative_illumination(rows=7, cols=10, tangent_pitch=0.05, lens=lens)
    assert fall.shape == (7, 10)
    np.testing.assert_allclose(fall, fall[::-1, ::-1], rtol=ROUNDING)
    assert np.argmax(fall) in (3 * 10 + 4, 3 * 10 + 5)
    assert np.all((fall > 0) & (fall <= 1))


def test_the_map_is_taken_at_sample_centres() -> None:
    lens = Lens("pinhole", 4e-3, 2.0, math.inf, Spectrum.constant(1.0))
    fall = relative_illumination(rows=1, cols=2, tangent_pitch=1.0, lens=lens)
    np.testing.assert_allclose(fall, np.full((1, 2), 1.25**-2), rtol=ROUNDING)


def test_close_focus_narrows_the_cone_and_brings_the_law_nearer_to_cos4() -> None:
    far = Lens("thin_lens", 4e-3, 1.4, math.inf, Spectrum.constant(1.0))
    near = Lens("thin_lens", 4e-3, 1.4, 8e-3, Spectrum.constant(1.0))
    far_fall, near_fall = (relative_illumination(rows=1, cols=3, tangent_pitch=0.6, lens=lens)[0, 0] for lens in (far, near))
    assert float(cos_fourth(0.6)) < near_fall < far_fall
