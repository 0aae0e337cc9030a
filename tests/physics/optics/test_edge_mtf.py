"""The MTF of lens times pixel aperture, measured on slanted edges, and what highlights leave beside them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.optics import diffract_band, diffraction_otf
from fullwell.optics.diffraction import ringing_slack

MTF_TOLERANCE = 0.01
"""What the product promises for lens times pixel aperture up to the Nyquist frequency."""

ENERGY_TOLERANCE = 1e-6
"""Relative; what the product promises for the light of an image."""

ROUNDING = 1e-12
"""Relative; double precision, and neighbouring sums of it."""

TAIL_FACTOR = 1.6
"""Of the far form of the tail: the bound of 1.05, and a smooth tail that at the second sample is 1.45 times its far form."""

DOT_TOLERANCE = 1.05**2
"""From one sample to the next: both bounds for spilled light."""

WAVELENGTH_NM = 550.0
OVERSAMPLING = 8
PITCHES_UM = (0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 6.0, 10.0)
F_NUMBERS = (2.0, 2.8, 4.0, 5.6, 8.0)


def slanted_edge(size: int, slant_deg: float, dark: float, bright: float) -> np.ndarray:
    """Return (size, size) means over square cells of an edge through the centre: exact along rows, 16 lines per cell."""
    lines = 16
    y = (np.arange(size * lines) + 0.5) / lines - size / 2
    left = np.arange(size) - size / 2
    lit = np.clip(left + 1 - math.tan(math.radians(slant_deg)) * y[:, None], 0, 1)
    return dark + (bright - dark) * lit.reshape(size, lines, size).mean(axis=1)


def edge_mtf(image: np.ndarray, slant_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Return (frequency in cycles per sample, MTF) by ISO 12233's projection onto the edge's known normal.

    The averaging over bins and the difference of neighbours are both divided out.
    """
    size, slant = len(image), math.radians(slant_deg)
    centres = np.arange(size) + 0.5 - size / 2
    distance = centres * math.cos(slant) - centres[:, None] * math.sin(slant)
    reach = int((size / 2 - 8 - size / 2 * math.tan(slant)) * math.cos(slant))
    near = np.abs(distance) < reach
    bins = np.floor(distance[near] * OVERSAMPLING).astype(int) + reach * OVERSAMPLING
    spread = np.bincount(bins, image[near]) / np.bincount(bins)
    line = np.diff(spread)
    frequency = np.fft.rfftfreq(len(line), 1 / OVERSAMPLING)
    contrast = np.abs(np.fft.rfft(line))
    kept = frequency <= 0.5
    own = np.sinc(frequency[kept] / OVERSAMPLING) ** 2
    return frequency[kept], contrast[kept] / contrast[0] / own


@pytest.mark.parametrize("f_number", F_NUMBERS)
@pytest.mark.parametrize("pitch_um", PITCHES_UM)
@pytest.mark.parametrize("dark", [0.2, 1e-6])
def test_a_slanted_edge_returns_lens_times_pixel_aperture_up_to_nyquist(pitch_um: float, f_number: float, dark: float) -> None:
    """An edge of ordinary and one of extreme contrast, where the bounds against ringing take part."""
    slant_deg, pitch_m = 5.0, pitch_um * 1e-6
    # The edge is so wide that the tail of its line image outside costs less than 0.4 % of the contrast.
    size = 256 if WAVELENGTH_NM * 1e-3 * f_number / pitch_um < 3 else 768
    edge = slanted_edge(size, slant_deg, dark, 1.0)
    image = diffract_band(edge, wavelength_nm=WAVELENGTH_NM, f_number=f_number, pitch_m=pitch_m)
    frequency, found = edge_mtf(image, slant_deg)
    lens = diffraction_otf(frequency / pitch_m, wavelength_nm=WAVELENGTH_NM, f_number=f_number)
    slant = math.radians(slant_deg)
    pixel = np.sinc(frequency * math.cos(slant)) * np.sinc(frequency * math.sin(slant))
    assert np.max(np.abs(found - lens * pixel)) < MTF_TOLERANCE


@pytest.mark.parametrize("slant_deg", [0.0, 3.0, 20.0, 45.0])
@pytest.mark.parametrize("pitch_um", [0.7, 1.4, 4.0, 10.0])
def test_the_bounds_against_ringing_leave_straight_edges_of_10_to_1_alone(slant_deg: float, pitch_um: float) -> None:
    """So the filter is linear there: the edge on a bright ground, less that ground, is the edge."""
    edge = slanted_edge(128, slant_deg, 0.1, 1.0)
    options = {"wavelength_nm": WAVELENGTH_NM, "f_number": 2.8, "pitch_m": pitch_um * 1e-6}
    np.testing.assert_allclose(
        diffract_band(edge, **options), diffract_band(edge + 9, **options) - 9, rtol=0, atol=9 * ROUNDING
    )


@pytest.mark.parametrize("f_number", F_NUMBERS)
@pytest.mark.parametrize("pitch_um", PITCHES_UM)
def test_a_highlight_fades_without_alternating_samples(pitch_um: float, f_number: float) -> None:
    """Where samples are coarser than the point image, its light falls from sample to sample, as that of the tail does."""
    pitch_m = pitch_um * 1e-6
    image = np.zeros((64, 64))
    image[31, 31] = 1.0
    blurred = diffract_band(image, wavelength_nm=WAVELENGTH_NM, f_number=f_number, pitch_m=pitch_m)
    assert np.min(blurred) >= 0
    assert np.sum(blurred) == pytest.approx(1.0, rel=ENERGY_TOLERANCE)
    fineness = WAVELENGTH_NM * 1e-9 * f_number / pitch_m
    if fineness <= 1.25:
        distance = np.arange(1, 12)
        tail = fineness / (math.pi * distance**3 * math.pi**2)
        along = blurred[31, 32:43]
        # The sample itself lights the window of 7 x 7 about it, where the wider bounds hold.
        np.testing.assert_array_less(along[3:], TAIL_FACTOR * tail[3:])
        np.testing.assert_array_less(tail[3:] / TAIL_FACTOR, along[3:])


@pytest.mark.parametrize("pitch_um", [1.4, 2.8, 6.0])
def test_a_lamp_in_the_dark_leaves_no_dots(pitch_um: float) -> None:
    """At 1e4 times the brightness of its ground, the light about it only falls (the OTF alone alternates by 3 times there)."""
    image = np.full((60, 80), 1e-4)
    image[28:32, 30:50] = 1.0
    blurred = diffract_band(image, wavelength_nm=WAVELENGTH_NM, f_number=2.0, pitch_m=pitch_um * 1e-6)
    for line in (blurred[30, 53:66], blurred[35:48, 40]):
        assert np.all(line[1:] < DOT_TOLERANCE * line[:-1])


def test_the_bounds_against_ringing_open_continuously_to_none() -> None:
    def slack(fineness: float) -> float:
        return ringing_slack(wavelength_nm=500.0, f_number=2.0, pitch_m=1e-6 / fineness)

    assert slack(0.01) == slack(1.25) == 1.0
    assert math.isinf(slack(2.0))
    assert math.isinf(slack(6.0))
    openness = 1 / np.array([slack(f) for f in np.linspace(1.2, 1.99, 200)])
    assert np.max(np.abs(np.diff(openness))) < 0.01


@pytest.mark.parametrize("pitch_um", [0.7, 1.4, 6.0])
def test_brightness_only_scales_the_blur(pitch_um: float) -> None:
    """Over 24 orders of magnitude: nothing in the filter has a scale of its own."""
    image = np.full((40, 40), 1e-5)
    image[20, 17] = 1.0
    options = {"wavelength_nm": WAVELENGTH_NM, "f_number": 2.8, "pitch_m": pitch_um * 1e-6}
    expected = diffract_band(image, **options)
    for scale in (1e-12, 1.0, 1e12, 1e20):
        np.testing.assert_allclose(diffract_band(image * scale, **options) / scale, expected, rtol=1e-6, atol=ROUNDING)
