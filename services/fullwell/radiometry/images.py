"""The spectral radiance image: what the renderer hands to the optics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.radiometry.grid import WavelengthGrid

__all__ = ["ChannelRadiance", "RadianceImage"]


@dataclass(frozen=True, slots=True, eq=False)
class RadianceImage:
    """Spectral photon radiance seen through the entrance pupil, on a regular grid of ray directions.

    Attributes
    ----------
    photons
        (rows, cols, bands) float32 [photons s^-1 m^-2 sr^-1 nm^-1], band means of `grid`; row 0 is the top.
    grid
        The wavelength bands.
    tangent_pitch
        Spacing of the samples in the tangent of the field angle: the sample (row, col) looks along
        x = (col + 0.5 - cols/2) * tangent_pitch (right), y = (row + 0.5 - rows/2) * tangent_pitch (down), z = 1.
        Each sample is the mean over its square cell.
    standard_error
        (rows, cols) float32, relative Monte-Carlo standard error of the band sum, or None where it is not known.
    """

    photons: NDArray[np.float32]
    grid: WavelengthGrid
    tangent_pitch: float
    standard_error: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        if self.photons.ndim != 3 or self.photons.shape[2] != self.grid.count:
            raise ShapeError(f"photons has shape {self.photons.shape}; must be (rows, cols, {self.grid.count}).")
        if not 0 < self.tangent_pitch < math.inf:
            raise FieldError(
                f"tangent_pitch is {self.tangent_pitch}; must be finite and > 0.",
                path="tangent_pitch",
                value=self.tangent_pitch,
            )
        if self.standard_error is not None and self.standard_error.shape != self.photons.shape[:2]:
            raise ShapeError(
                f"standard_error has shape {self.standard_error.shape}; must be (rows, cols) = {self.photons.shape[:2]}."
            )

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.photons.shape[0])

    @property
    def cols(self) -> int:
        """Number of columns."""
        return int(self.photons.shape[1])


@dataclass(frozen=True, slots=True, eq=False)
class ChannelRadiance:
    """Light seen through the entrance pupil as a sensor's channels count it, on the samples of a `RadianceImage`.

    Attributes
    ----------
    electrons
        (parts, rows, cols) float64 [e- s^-1 m^-2 sr^-1]: radiance times quantum efficiency, filters and the lens's
        transmittance, integrated over the wavelengths of each part of each channel.
    wavelength_nm
        (parts,) mean wavelength of what each part counts [nm], for what depends on it.
    channel
        (parts,) number of the channel that each part belongs to; a channel is the sum of its parts.
    tangent_pitch
        As in `RadianceImage`.
    """

    electrons: NDArray[np.float64]
    wavelength_nm: NDArray[np.float64]
    channel: NDArray[np.intp]
    tangent_pitch: float

    def __post_init__(self) -> None:
        parts = self.electrons.shape[:1]
        if self.electrons.ndim != 3 or self.wavelength_nm.shape != parts or self.channel.shape != parts:
            raise ShapeError(
                f"electrons has shape {self.electrons.shape}, wavelength_nm {self.wavelength_nm.shape} and channel "
                f"{self.channel.shape}; must be (parts, rows, cols) and (parts,)."
            )
        if not 0 < self.tangent_pitch < math.inf:
            raise FieldError(
                f"tangent_pitch is {self.tangent_pitch}; must be finite and > 0.",
                path="tangent_pitch",
                value=self.tangent_pitch,
            )
