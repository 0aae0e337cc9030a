"""Diffraction against the closed forms of the Airy pattern, and its conservation laws."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.optics import airy_radius_m, cutoff_cycles_per_m, diffract_band, diffraction_otf

ROUNDING = 1e-12
"""Relative; a few operations in double precision."""

TRANSFORM_ROUNDING = 1e-10
"""Relative to the largest value; rounding of a double-precision transform forth and back."""

ENERGY_TOLERANCE = 1e-6
"""Relative; what the product promises for the light of an image."""

RING_TOLERANCE = 0.01
"""Relative; the dark ring is located between samples of an eightieth of its radius, 0.6 of a spacing."""

COUNTING_TOLERANCE = 1e-3
"""Of the pupil's area; counting error of the 1501-point grid laid over it."""

SETTLING_TOLERANCE = 0.02
"""Of the light within four samples of a highlight: what settling the negative lobes may carry out of that square."""

TAIL_TOLERANCE = 0.004
"""Of the light; the disc is cut out of square samples of a fortieth of its radius, and the mirrored tails of the image add."""

WAVELENGTH_NM = 550.0
F_NUMBER = 4.0


def blur(image: np.ndarray, pitch_m: float) -> np.ndarray:
    return diffract_band(image, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER, pitch_m=pitch_m)


@pytest.mark.parametrize(
    ("share_of_cutoff", "expected"),
    [
        (0.0, 1.0),
        (0.5, (2 / math.pi) * (math.pi / 3 - math.sqrt(3) / 4)),
        (1.0, 0.0),
        (2.0, 0.0),
    ],
)
def test_the_otf_has_its_closed_form_values(share_of_cutoff: float, expected: float) -> None:
    frequency = share_of_cutoff * float(cutoff_cycles_per_m(WAVELENGTH_NM, F_NUMBER))
    found = float(diffraction_otf(frequency, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER))
    assert found == pytest.approx(expected, abs=ROUNDING)


def test_the_cutoff_is_one_over_wavelength_and_f_number() -> None:
    assert float(cutoff_cycles_per_m(500.0, 2.0)) == pytest.approx(1e6, rel=ROUNDING)


def test_the_otf_is_the_overlap_of_two_pupils() -> None:
    """The area common to two unit discs whose centres are 2 v apart, over that of one, counted on a fine grid."""
    side = np.linspace(-1, 2, 1501)
    x, y = np.meshgrid(side, side[(side >= -1) & (side <= 1)])
    for v in (0.1, 0.35, 0.6, 0.9):
        common = np.mean((x**2 + y**2 < 1) & ((x - 2 * v) ** 2 + y**2 < 1)) / np.mean(x**2 + y**2 < 1)
        frequency = v * float(cutoff_cycles_per_m(WAVELENGTH_NM, F_NUMBER))
        found = float(diffraction_otf(frequency, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER))
        assert found == pytest.approx(common, abs=COUNTING_TOLERANCE)


@pytest.mark.parametrize(("k_rows", "k_cols"), [(0, 9), (6, 0), (5, 12), (31, 47)])
def test_a_cosine_keeps_its_form_and_loses_contrast_by_the_otf(k_rows: int, k_cols: int) -> None:
    rows, cols, pitch_m = 32, 48, 1.0e-6
    y = np.cos(np.pi * k_rows * (np.arange(rows) + 0.5) / rows)
    x = np.cos(np.pi * k_cols * (np.arange(cols) + 0.5) / cols)
    wave = y[:, None] * x[None, :]
    frequency = math.hypot(k_rows / (2 * rows * pitch_m), k_cols / (2 * cols * pitch_m))
    otf = float(diffraction_otf(frequency, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER))
    np.testing.assert_allclose(blur(2 + wave, pitch_m), 2 + otf * wave, rtol=0, atol=2 * TRANSFORM_ROUNDING)


def test_the_first_dark_ring_lies_at_1_22_wavelength_f_number() -> None:
    pitch_m = airy_radius_m(WAVELENGTH_NM, F_NUMBER) / 80
    point = np.zeros((1025, 1025))
    point[512, 512] = 1.0
    profile = blur(point, pitch_m)[512, 512:]
    k = int(np.argmin(profile[40:120])) + 40
    left, middle, right = np.sqrt(np.maximum(profile[k - 1 : k + 2], 0))  # amplitude is linear through the zero, |.| has a kink
    zero = k + (0.5 if right < left else -0.5) * min(left, right) / max(left, right, middle)
    assert zero * pitch_m == pytest.approx(1.22 * WAVELENGTH_NM * 1e-9 * F_NUMBER, rel=RING_TOLERANCE)
    assert airy_radius_m(WAVELENGTH_NM, F_NUMBER) == pytest.approx(1.22 * WAVELENGTH_NM * 1e-9 * F_NUMBER, rel=1e-3)


def test_the_airy_disc_holds_83_8_percent_of_the_light() -> None:
    radius_m = airy_radius_m(WAVELENGTH_NM, F_NUMBER)
    pitch_m = radius_m / 20
    point = np.zeros((1401, 1401))
    point[700, 700] = 1.0
    image = blur(point, pitch_m)
    distance_m = np.hypot(*np.meshgrid(np.arange(1401) - 700, np.arange(1401) - 700)) * pitch_m
    assert np.sum(image[distance_m < radius_m]) == pytest.approx(0.8378, abs=TAIL_TOLERANCE)


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (17, 31), (64, 48)])
@pytest.mark.parametrize("pitch_m", [0.2e-6, 1.4e-6, 30e-6])
def test_light_is_conserved(shape: tuple[int, int], pitch_m: float) -> None:
    image = np.random.default_rng(1).random(shape) ** 8
    assert np.sum(blur(image, pitch_m)) == pytest.approx(np.sum(image), rel=ENERGY_TOLERANCE)


def test_a_uniform_image_stays_uniform_to_its_border() -> None:
    image = np.full((40, 56), 3.0e17)
    np.testing.assert_allclose(blur(image, 0.3e-6), image, rtol=TRANSFORM_ROUNDING)


def test_light_at_one_border_does_not_appear_at_the_opposite_one() -> None:
    image = np.zeros((64, 64))
    image[:, 0] = 1.0
    blurred = blur(image, 0.5e-6)
    assert np.all(blurred[:, -1] < 0.1 * blurred[:, 8])


@pytest.mark.parametrize("pitch_m", [0.5e-6, 1.4e-6, 2.2e-6, 6e-6])
def test_a_highlight_on_a_dark_ground_leaves_no_negative_light_and_loses_none(pitch_m: float) -> None:
    image = np.full((60, 80), 1e-7)
    image[30, 41] = 1.0
    image[2:4, 70:79] = 0.5
    blurred = blur(image, pitch_m)
    assert np.all(np.isfinite(blurred))
    assert np.min(blurred) >= 0
    assert np.sum(blurred) == pytest.approx(np.sum(image), rel=ENERGY_TOLERANCE)
    near = np.s_[26:35, 37:46]
    assert np.sum(blurred[near]) == pytest.approx(np.sum(_unclipped(image, pitch_m)[near]), rel=SETTLING_TOLERANCE)


def _unclipped(image: np.ndarray, pitch_m: float) -> np.ndarray:
    """Return the same blur on a bright ground, which needs no repair, with the ground taken off again."""
    return blur(image + 10.0, pitch_m) - 10.0


def test_the_image_given_is_not_changed() -> None:
    image = np.random.default_rng(2).random((9, 11))
    before = image.copy()
    blur(image, 1e-6)
    np.testing.assert_array_equal(image, before)


def test_threads_do_not_change_a_bit() -> None:
    image = np.random.default_rng(3).random((65, 70))
    one, two = (diffract_band(image, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER, pitch_m=1e-6, workers=n) for n in (1, 2))
    np.testing.assert_array_equal(one, two)
