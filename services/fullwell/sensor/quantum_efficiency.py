"""Quantum efficiency: from spectral irradiance to the electrons each colour channel would collect."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.radiometry.grid import WavelengthGrid
from fullwell.scene.images import OpticalImage
from fullwell.sensor.parameters import ColorFilterArray

__all__ = ["ChannelCurrents", "band_quantum_efficiency", "channel_currents", "integrate_bands"]

_SAMPLES_AT_A_TIME = 1 << 15


@dataclass(frozen=True, slots=True, eq=False)
class ChannelCurrents:
    """An optical image seen by each channel of a colour filter array: what all exposures and pixel sizes behind it share.

    Attributes
    ----------
    electrons
        (channels, rows, cols) [e- s^-1 m^-2], for a photodetector that had this channel everywhere.
    cfa
        The colour filter array whose channels they are.
    grid, sample_pitch_m
        Of the optical image.
    """

    electrons: NDArray[np.float64]
    cfa: ColorFilterArray
    grid: WavelengthGrid
    sample_pitch_m: float

    @property
    def rows(self) -> int:
        """Number of sample rows."""
        return int(self.electrons.shape[1])

    @property
    def cols(self) -> int:
        """Number of sample columns."""
        return int(self.electrons.shape[2])


def channel_currents(optical: OpticalImage, cfa: ColorFilterArray) -> ChannelCurrents:
    """Return the optical image integrated over wavelength for each channel of `cfa`.

    Raises
    ------
    FieldError
        NaN, Inf or negative irradiance.
    """
    # A NaN anywhere makes both extremes NaN, and every comparison with NaN is false.
    low, high = float(np.min(optical.photons)), float(np.max(optical.photons))
    if not (low >= 0 and high < math.inf):
        raise FieldError(
            f"irradiance ranges from {low} to {high}; must be finite and >= 0. Look for the fault in the optics stage.",
            path="irradiance",
            value=low,
        )
    efficiency = band_quantum_efficiency(cfa, optical.grid)
    electrons = integrate_bands(optical.photons, efficiency, bandwidth_nm=optical.grid.step_nm)
    return ChannelCurrents(electrons, cfa, optical.grid, optical.sample_pitch_m)


def band_quantum_efficiency(cfa: ColorFilterArray, grid: WavelengthGrid) -> NDArray[np.float64]:
    """Return the channels' quantum efficiencies as exact means over the bands, (bands, channels) [e- per photon]."""
    averages = np.stack([efficiency.band_average(grid) for _, efficiency in cfa.channels], axis=1)
    # Rounding of an average may leave [0, 1] by 1e-16; the tables themselves were checked.
    return np.asarray(np.clip(averages, 0.0, 1.0))


def integrate_bands(
    photons: NDArray[np.float32], quantum_efficiency: NDArray[np.float64], *, bandwidth_nm: float
) -> NDArray[np.float64]:
    """Integrate photon irradiance times quantum efficiency over wavelength.

    Parameters
    ----------
    photons
        (rows, cols, bands) [photons s^-1 m^-2 nm^-1].
    quantum_efficiency
        (bands, channels) [e- per photon].
    bandwidth_nm
        Width of each band [nm].

    Returns
    -------
    (channels, rows, cols) [e- s^-1 m^-2], for a sensor that had this channel everywhere.

    Raises
    ------
    ShapeError
        Band counts differ.
    """
    rows, cols, bands = photons.shape
    if quantum_efficiency.ndim != 2 or quantum_efficiency.shape[0] != bands:
        raise ShapeError(f"quantum_efficiency has shape {quantum_efficiency.shape}; must be ({bands}, channels).")
    channels = np.empty((quantum_efficiency.shape[1], rows * cols))
    samples = photons.reshape(rows * cols, bands)
    weights = quantum_efficiency * bandwidth_nm
    for first in range(0, rows * cols, _SAMPLES_AT_A_TIME):
        some = samples[first : first + _SAMPLES_AT_A_TIME].astype(np.float64)
        channels[:, first : first + _SAMPLES_AT_A_TIME] = (some @ weights).T
    return channels.reshape(-1, rows, cols)
