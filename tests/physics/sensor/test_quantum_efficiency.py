"""Electrons from spectral irradiance, against sums written out."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import ShapeError
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.sensor import ColorFilterArray
from fullwell.sensor.quantum_efficiency import band_quantum_efficiency, integrate_bands

ROUNDING = 1e-12
"""Relative; sums of a few dozen products in double precision."""


def test_band_values_are_means_over_the_band_not_samples() -> None:
    triangle = Spectrum(np.array([500.0, 550.0, 600.0]), np.array([0.0, 1.0, 0.0]), outside="zero")
    cfa = ColorFilterArray((("W",),), (("W", triangle),))
    one_band = band_quantum_efficiency(cfa, WavelengthGrid(550.0, 550.0, 100.0))
    np.testing.assert_allclose(one_band, [[0.5]], rtol=ROUNDING)


def test_light_is_summed_over_bands_times_their_width() -> None:
    photons = np.arange(2 * 3 * 4, dtype=np.float32).reshape(2, 3, 4)
    efficiency = np.array([[0.1, 0.0], [0.2, 1.0], [0.3, 0.5], [0.4, 0.0]])
    expected = np.einsum("rcb,bk->krc", photons.astype(float), efficiency) * 10.0
    np.testing.assert_allclose(integrate_bands(photons, efficiency, bandwidth_nm=10.0), expected, rtol=ROUNDING)


def test_images_larger_than_one_piece_are_integrated_whole() -> None:
    photons = np.random.default_rng(0).random((211, 307, 3)).astype(np.float32)
    efficiency = np.array([[0.2], [0.5], [0.9]])
    found = integrate_bands(photons, efficiency, bandwidth_nm=5.0)
    np.testing.assert_allclose(found[0], photons.astype(float) @ efficiency[:, 0] * 5.0, rtol=ROUNDING)


def test_differing_band_counts_are_refused() -> None:
    with pytest.raises(ShapeError, match=r"\(4, channels\)"):
        integrate_bands(np.zeros((1, 1, 4), np.float32), np.zeros((3, 1)), bandwidth_nm=10.0)
