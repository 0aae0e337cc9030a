"""The e-SFR returns the MTF that made the edge: Gaussian blur, pixel aperture, diffraction, colour filter mosaics."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import erf

from fullwell.metrics import edge_sfr, mosaic_edge_sfr

MTF_TOLERANCE = 0.01
"""The promise: the analytic MTF within 0.01 up to 0.5 cycles per pixel."""

BAYER = (("R", "G"), ("G", "B"))
SAMPLING_LIMIT = 0.5


def _gaussian_edge(
    rows: int, cols: int, *, normal_deg: float, sigma_px: float, dark: float = 100.0, bright: float = 900.0
) -> NDArray[np.float64]:
    """Point samples of a Gaussian-blurred edge through the middle; the normal points to the bright side."""
    angle = np.radians(normal_deg)
    row, col = np.mgrid[:rows, :cols]
    distance = (col - (cols - 1) / 2 - 0.13) * np.cos(angle) + (row - (rows - 1) / 2 + 0.21) * np.sin(angle)
    return np.asarray(dark + (bright - dark) * 0.5 * (1 + erf(distance / (sigma_px * np.sqrt(2)))))


def _integrated_edge(
    rows: int, cols: int, *, normal_deg: float, frequency: NDArray[np.float64], transfer: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Point samples of the edge whose profile has the transfer function given at `frequency` [cycles/px], by its integral."""
    angle = np.radians(normal_deg)
    row, col = np.mgrid[:rows, :cols]
    distance = (col - (cols - 1) / 2) * np.cos(angle) + (row - (rows - 1) / 2) * np.sin(angle)
    places = np.linspace(distance.min() - 1, distance.max() + 1, 8001)
    # Edge = 1/2 + integral of MTF(f) sin(2 pi f x) / (pi f) df: midpoints, so that f = 0 needs no limit.
    middle = 0.5 * (frequency[1:] + frequency[:-1])
    height = np.interp(middle, frequency, transfer)
    profile = 0.5 + np.sin(2 * np.pi * np.outer(places, middle)) @ (height / (np.pi * middle) * np.diff(frequency))
    return np.asarray(100 + 800 * np.interp(distance, places, profile))


def _diffraction(frequency: NDArray[np.float64], cutoff: float) -> NDArray[np.float64]:
    share = np.minimum(frequency / cutoff, 1.0)
    return np.asarray(2 / np.pi * (np.arccos(share) - share * np.sqrt(1 - share**2)))


@pytest.mark.parametrize("window", ["tukey", "hamming", "none"])
@pytest.mark.parametrize("sigma_px", [0.4, 0.7, 1.0, 1.6])
@pytest.mark.parametrize("normal_deg", [4.0, 10.0, 21.0, 94.0, 176.0, 265.0, -7.0])
def test_a_gaussian_edge_has_its_gaussian_mtf_in_every_direction(window: str, sigma_px: float, normal_deg: float) -> None:
    response = edge_sfr(_gaussian_edge(100, 96, normal_deg=normal_deg, sigma_px=sigma_px), window=window)  # type: ignore[arg-type]
    frequency = response.frequency_cycles_per_px
    below = frequency <= SAMPLING_LIMIT
    analytic = np.exp(-2 * (np.pi * sigma_px * frequency) ** 2)
    assert np.max(np.abs(response.mtf - analytic)[below]) < MTF_TOLERANCE
    assert response.orientation == ("horizontal" if abs(np.sin(np.radians(normal_deg))) > 0.7 else "vertical")


@pytest.mark.parametrize("normal_deg", [5.0, 185.0, 95.0, 275.0])
def test_mtf50_is_found_between_the_steps_and_above_the_sampling_limit(normal_deg: float) -> None:
    sigma_px = 0.3
    response = edge_sfr(_gaussian_edge(120, 120, normal_deg=normal_deg, sigma_px=sigma_px))
    analytic = np.sqrt(np.log(2) / 2) / (np.pi * sigma_px)
    assert analytic > SAMPLING_LIMIT
    one_tenth_percent = 1e-3 * analytic
    assert response.mtf50_cycles_per_px == pytest.approx(analytic, abs=2 * one_tenth_percent)


@pytest.mark.slow
@pytest.mark.parametrize("normal_deg", [3.0, 8.0, 20.0])
def test_a_box_pixel_has_the_sinc_of_its_aperture(normal_deg: float) -> None:
    frequency = np.linspace(0, 6, 6001)
    along, across = np.cos(np.radians(normal_deg)), np.sin(np.radians(normal_deg))
    # A little blur, because the edge of a bare box has no end of frequencies.
    transfer = np.sinc(frequency * along) * np.sinc(frequency * across) * np.exp(-2 * (np.pi * 0.2 * frequency) ** 2)
    region = _integrated_edge(96, 90, normal_deg=normal_deg, frequency=frequency, transfer=transfer)
    response = edge_sfr(region)
    below = response.frequency_cycles_per_px <= SAMPLING_LIMIT
    analytic = np.interp(response.frequency_cycles_per_px, frequency, np.abs(transfer))
    assert np.max(np.abs(response.mtf - analytic)[below]) < MTF_TOLERANCE


@pytest.mark.parametrize(("f_number", "pitch_um"), [(2.0, 1.4), (4.0, 1.4), (4.0, 2.8), (2.8, 3.0)])
def test_a_diffraction_limited_lens_before_a_box_pixel_has_the_product_of_both(f_number: float, pitch_um: float) -> None:
    """At 550 nm. The region is wide: what the airy disc sends beyond it is missing from the plateaus of any edge method."""
    frequency = np.linspace(0, 4, 4001)
    cutoff = pitch_um / (0.55 * f_number)
    along, across = np.cos(np.radians(5)), np.sin(np.radians(5))
    transfer = _diffraction(frequency, cutoff) * np.sinc(frequency * along) * np.sinc(frequency * across)
    response = edge_sfr(_integrated_edge(200, 200, normal_deg=5, frequency=frequency, transfer=transfer), window="none")
    below = response.frequency_cycles_per_px <= SAMPLING_LIMIT
    analytic = np.interp(response.frequency_cycles_per_px, frequency, np.abs(transfer))
    assert np.max(np.abs(response.mtf - analytic)[below]) < MTF_TOLERANCE


@pytest.mark.parametrize("channel", ["R", "G", "B"])
@pytest.mark.parametrize("normal_deg", [5.0, 96.0])
def test_each_channel_of_a_mosaic_has_its_own_mtf_without_demosaicing(channel: str, normal_deg: float) -> None:
    """Red is sharp, green and blue are softer, and their levels differ: a demosaiced edge could not tell them apart."""
    sigma = {"R": 0.6, "G": 1.0, "B": 1.4}
    level = {"R": 300.0, "G": 900.0, "B": 500.0}
    rows, cols = 140, 130
    planes = {
        name: _gaussian_edge(rows, cols, normal_deg=normal_deg, sigma_px=sigma[name], bright=level[name]) for name in sigma
    }
    names = np.tile(np.array(BAYER), (rows // 2, cols // 2))
    mosaic = np.select([names == name for name in sigma], [planes[name] for name in sigma])
    response = mosaic_edge_sfr(mosaic, pattern=BAYER, channel=channel)
    frequency = response.frequency_cycles_per_px
    analytic = np.exp(-2 * (np.pi * sigma[channel] * frequency) ** 2)
    below = frequency <= SAMPLING_LIMIT
    assert np.max(np.abs(response.mtf - analytic)[below]) < MTF_TOLERANCE
    assert response.edge_step == pytest.approx(level[channel] - 100, rel=1e-3)
