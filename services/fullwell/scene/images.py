"""The images after the lens and after the sensor: what optics, sensor and ISP hand to one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.radiometry.grid import WavelengthGrid
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["OpticalImage", "RawImage"]


@dataclass(frozen=True, slots=True, eq=False)
class OpticalImage:
    """Spectral photon irradiance on the sensor plane, centred on the optical axis, upright (row 0 is the scene's top).

    Attributes
    ----------
    photons
        (rows, cols, bands) float32 [photons s^-1 m^-2 nm^-1], band means of `grid`; each sample is the mean over its square
        cell.
    grid
        The wavelength bands.
    sample_pitch_m
        Spacing of the samples on the sensor plane [m], > 0.
    notes
        What the optics did and what it left out, with the reason and the bound on the error; for the manifest.
    """

    photons: NDArray[np.float32]
    grid: WavelengthGrid
    sample_pitch_m: float
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.photons.ndim != 3 or self.photons.shape[2] != self.grid.count or 0 in self.photons.shape:
            raise ShapeError(
                f"photons has shape {self.photons.shape}; must be (rows, cols, {self.grid.count}), rows, cols >= 1."
            )
        if not 0 < self.sample_pitch_m < float("inf"):
            raise FieldError(
                f"sample_pitch_m is {self.sample_pitch_m}; must be > 0 and finite.",
                path="sample_pitch_m",
                value=self.sample_pitch_m,
            )

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.photons.shape[0])

    @property
    def cols(self) -> int:
        """Number of columns."""
        return int(self.photons.shape[1])

    @property
    def height_m(self) -> float:
        """Height of the image on the sensor plane [m]."""
        return self.rows * self.sample_pitch_m

    @property
    def width_m(self) -> float:
        """Width of the image on the sensor plane [m]."""
        return self.cols * self.sample_pitch_m


@dataclass(frozen=True, slots=True, eq=False)
class RawImage:
    """Digital numbers as the sensor delivers them, with what an image processor must know about the sensor.

    Attributes
    ----------
    dn
        (rows, cols) uint16 [DN].
    pattern
        Rows of channel names, repeated over the image; ``pattern[0][0]`` is the top-left pixel.
    channels
        (name, quantum efficiency) of each channel, in the order of the sensor's colour filter array.
    grid
        The wavelength bands the exposure was integrated over.
    black_level_dn, white_level_dn
        DN of a pixel without light and without noise (not rounded), and of a saturated pixel.
    exposure_time_s
        Integration time [s].
    sensor_name, adc_bits
        Of the sensor.
    saturated_fraction
        Fraction of the pixels that filled their well or reached the ADC's full scale, in [0, 1].
    mean_electrons
        (rows, cols) float32 [e-], noise-free photo and dark electrons before the well limits them; None where not asked for.
    """

    dn: NDArray[np.uint16]
    pattern: tuple[tuple[str, ...], ...]
    channels: tuple[tuple[str, Spectrum], ...]
    grid: WavelengthGrid
    black_level_dn: float
    white_level_dn: float
    exposure_time_s: float
    sensor_name: str
    adc_bits: int
    saturated_fraction: float
    mean_electrons: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        if self.dn.ndim != 2:
            raise ShapeError(f"dn has shape {self.dn.shape}; must be (rows, cols).")
        if not self.pattern or len({len(row) for row in self.pattern}) != 1 or not self.pattern[0]:
            raise ShapeError(f"pattern is {self.pattern}; must be a rectangle of channel names, at least 1 x 1.")
        if not self.white_level_dn > self.black_level_dn:
            raise FieldError(
                f"white_level_dn is {self.white_level_dn}; must be above black_level_dn = {self.black_level_dn}. "
                "Lower analog_offset_v.",
                path="white_level_dn",
                value=self.white_level_dn,
            )

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.dn.shape[0])

    @property
    def cols(self) -> int:
        """Number of columns."""
        return int(self.dn.shape[1])
