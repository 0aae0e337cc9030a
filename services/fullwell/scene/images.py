"""The images after the lens and after the sensor: what optics, sensor and ISP hand to one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.radiometry.grid import WavelengthGrid
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["CaptureRecord", "ChannelImage", "OpticalImage", "RawImage"]


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
class ChannelImage:
    """What the channels of a sensor would count on the sensor plane, on the samples of an `OpticalImage`.

    Attributes
    ----------
    electrons
        (channels, rows, cols) float64 [e- s^-1 m^-2], as if the sensor had the channel everywhere.
    sample_pitch_m, notes
        As in `OpticalImage`.
    """

    electrons: NDArray[np.float64]
    sample_pitch_m: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class CaptureRecord:
    """One of the captures that a raw image was combined from; for the manifest.

    Attributes
    ----------
    photodiode, readout
        Names of the photodiode and of its readout (conversion gain).
    start_s, exposure_time_s
        Start of the first row's integration after that of the first capture, and integration time [s].
    sensitivity_ratio
        Electrons of this capture per electron of the image's reference capture.
    electrons_per_dn
        Of this capture's own converter [e-/DN].
    saturated_fraction, used_fraction
        Fractions of the pixels that were saturated in this capture, and to whose value it contributed.
    """

    photodiode: str
    readout: str
    start_s: float
    exposure_time_s: float
    sensitivity_ratio: float
    electrons_per_dn: float
    saturated_fraction: float
    used_fraction: float


@dataclass(frozen=True, slots=True, eq=False)
class RawImage:
    """Digital numbers as the sensor delivers them, with what an image processor must know about the sensor.

    Attributes
    ----------
    dn
        (rows, cols) [DN]: uint16, or uint32 where captures were combined to more than 16 bits. Linear in the light.
    pattern
        Rows of channel names, repeated over the image; ``pattern[0][0]`` is the top-left pixel.
    channels
        (name, quantum efficiency) of each channel, in the order of the sensor's colour filter array.
    grid
        The wavelength bands the exposure was integrated over.
    black_level_dn, white_level_dn
        DN of a pixel without light and without noise (not rounded), and of a saturated pixel.
    exposure_time_s
        Integration time [s]; of a combined image that of its reference capture.
    sensor_name, adc_bits
        Of the sensor; of a combined image the bits of `dn`.
    saturated_fraction
        Fraction of the pixels that filled their well or reached the ADC's full scale, in [0, 1].
    mean_electrons
        (rows, cols) float32 [e-], noise-free photo and dark electrons before the well limits them, of the reference capture;
        None where not asked for.
    line_time_s
        Delay of each row's start after the row above it [s]; 0 is a global shutter.
    electrons_per_dn
        Electrons at the pixel for one digital number [e-/DN]; 0 where not known.
    channel_exposure_time_s
        (name, integration time [s]) where the channels were exposed differently; empty otherwise. `dn` is what each pixel
        would have had at `exposure_time_s`.
    captures
        What a combined image was made of; empty for a single capture.
    """

    dn: NDArray[np.uint16] | NDArray[np.uint32]
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
    line_time_s: float = 0.0
    electrons_per_dn: float = 0.0
    channel_exposure_time_s: tuple[tuple[str, float], ...] = ()
    captures: tuple[CaptureRecord, ...] = ()

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

    @property
    def row_start_s(self) -> NDArray[np.float64]:
        """(rows,) start of each row's integration after that of the first row [s]."""
        return np.asarray(np.arange(self.rows) * self.line_time_s, dtype=np.float64)

    @property
    def row_middle_s(self) -> NDArray[np.float64]:
        """(rows,) middle of each row's integration after the start of the first row's [s]."""
        return np.asarray(self.row_start_s + 0.5 * self.exposure_time_s)
