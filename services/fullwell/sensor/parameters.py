"""What describes a sensor and how it is exposed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.spectrum import Spectrum

__all__ = [
    "MAX_ADC_BITS",
    "MAX_WELL_CAPACITY_E",
    "AutoExposure",
    "ColorFilterArray",
    "Exposure",
    "FixedExposure",
    "SensorModel",
]

MAX_ADC_BITS: Final = 16
"""Raw images are stored in 16 bits."""

MAX_WELL_CAPACITY_E: Final = 1e9
"""Poisson numbers are drawn exactly up to here and beyond; no photodiode comes near it."""


def _refuse(path: str, value: object, legal: str) -> FieldError:
    return FieldError(f"{path} is {value}; must be {legal}. Set {path} of the sensor.", path=path, value=value)


@dataclass(frozen=True, slots=True, eq=False)
class ColorFilterArray:
    """The repeating pattern of channels.

    Attributes
    ----------
    pattern
        Rows of channel names; ``pattern[0][0]`` is the top-left pixel.
    channels
        (name, quantum efficiency) pairs; QE is electrons per photon in [0, 1], all filters included, 0 outside its table.
    """

    pattern: tuple[tuple[str, ...], ...]
    channels: tuple[tuple[str, Spectrum], ...]

    def __post_init__(self) -> None:
        if not self.pattern or not self.pattern[0] or len({len(row) for row in self.pattern}) != 1:
            raise _refuse("pattern", self.pattern, "a rectangle of channel names, at least 1 x 1")
        names = [name for name, _ in self.channels]
        if len(set(names)) != len(names):
            raise _refuse("channels", names, "named differently from one another")
        for name in (name for row in self.pattern for name in row):
            if name not in names:
                raise FieldError(unknown_name_message("channel", name, names), path="pattern", value=name)
        for name, efficiency in self.channels:
            low, high = float(np.min(efficiency.values)), float(np.max(efficiency.values))
            if low < 0 or high > 1:
                raise _refuse(f"channels.{name}", f"{low} to {high}", "a quantum efficiency within 0 to 1")

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the channels, in their order."""
        return tuple(name for name, _ in self.channels)


@dataclass(frozen=True, slots=True, eq=False)
class SensorModel:
    """Parameters of one sensor; every noise term may be 0.

    Attributes
    ----------
    name
        For people and manifests; part of the fixed pattern's seed.
    rows, cols
        Pixels, centred on the optical axis.
    pixel_pitch_m, fill_factor
        Pitch [m] of square pixels; the photodetector is a square in the pixel's middle with this share (0, 1] of its area.
    cfa
        Colour filter array with the quantum efficiencies.
    well_capacity_e, conversion_gain_v_per_e
        Full well [e-] and volts per electron [V/e-].
    voltage_swing_v, adc_bits
        The ADC's full scale [V] and its bits, 1 to 16.
    dark_current_e_per_s, read_noise_e
        Mean dark electrons per second [e-/s]; standard deviation of the read noise referred to the pixel [e-].
    dsnu_v, prnu_fraction
        Standard deviations over the pixels of the offset [V], before the analog gain, and of the relative responsivity.
    analog_gain_ratio, analog_offset_v
        Amplification between pixel and ADC (> 1 brightens); `analog_offset_v` is added after it [V].
    serial
        Seeds the fixed pattern: same serial, same pattern.

    Raises
    ------
    FieldError
        On making it with a value that is NaN or outside its range.
    """

    name: str
    rows: int
    cols: int
    pixel_pitch_m: float
    fill_factor: float
    cfa: ColorFilterArray
    well_capacity_e: float
    conversion_gain_v_per_e: float
    voltage_swing_v: float
    dark_current_e_per_s: float
    read_noise_e: float
    dsnu_v: float
    prnu_fraction: float
    analog_gain_ratio: float
    analog_offset_v: float
    adc_bits: int
    serial: int = 0

    def __post_init__(self) -> None:
        for path in ("rows", "cols"):
            if not getattr(self, path) >= 1:
                raise _refuse(path, getattr(self, path), "at least 1")
        for path in ("pixel_pitch_m", "well_capacity_e", "conversion_gain_v_per_e", "voltage_swing_v", "analog_gain_ratio"):
            if not 0 < getattr(self, path) < math.inf:
                raise _refuse(path, getattr(self, path), "> 0 and finite")
        for path in ("dark_current_e_per_s", "read_noise_e", "dsnu_v", "prnu_fraction", "analog_offset_v"):
            if not 0 <= getattr(self, path) < math.inf:
                raise _refuse(path, getattr(self, path), ">= 0 and finite")
        if not 0 < self.fill_factor <= 1:
            raise _refuse("fill_factor", self.fill_factor, "> 0 and at most 1")
        if not self.well_capacity_e <= MAX_WELL_CAPACITY_E:
            raise _refuse("well_capacity_e", self.well_capacity_e, f"at most {MAX_WELL_CAPACITY_E:g}")
        if not 1 <= self.adc_bits <= MAX_ADC_BITS:
            raise _refuse("adc_bits", self.adc_bits, f"1 to {MAX_ADC_BITS}")
        if not self.analog_offset_v < self.voltage_swing_v:
            raise _refuse("analog_offset_v", self.analog_offset_v, f"below voltage_swing_v = {self.voltage_swing_v}")


@dataclass(frozen=True, slots=True)
class FixedExposure:
    """One exposure of `time_s` [s], > 0."""

    time_s: float

    def __post_init__(self) -> None:
        if not 0 < self.time_s < math.inf:
            raise FieldError(
                f"time_s is {self.time_s}; must be > 0 and finite. Set exposure.time_s.", path="time_s", value=self.time_s
            )


@dataclass(frozen=True, slots=True)
class AutoExposure:
    """Exposure time found from the noise-free image.

    "full": the brightest pixel reaches `level` of the saturation signal; "mean": the mean pixel does; "percentile": the
    `percentile`-th one does. The saturation signal is the well, or what the ADC's full scale leaves of it after analog gain
    and offset. The result is clipped to [min_time_s, max_time_s]; a black scene gets max_time_s.
    """

    method: Literal["full", "mean", "percentile"] = "percentile"
    level: float = 0.7
    percentile: float = 99.0
    min_time_s: float = 1e-6
    max_time_s: float = 1.0

    def __post_init__(self) -> None:
        if self.method not in ("full", "mean", "percentile"):
            message = unknown_name_message("exposure method", self.method, ("full", "mean", "percentile"))
            raise FieldError(message, path="method", value=self.method)
        if not 0 < self.level <= 1:
            raise FieldError(
                f"level is {self.level}; must be > 0 and at most 1. Set exposure.level.", path="level", value=self.level
            )
        if not 0 <= self.percentile <= 100:
            raise FieldError(
                f"percentile is {self.percentile}; must be 0 to 100. Set exposure.percentile.",
                path="percentile",
                value=self.percentile,
            )
        if not 0 < self.min_time_s <= self.max_time_s < math.inf:
            raise FieldError(
                f"min_time_s is {self.min_time_s} and max_time_s {self.max_time_s}; must be 0 < min_time_s <= max_time_s.",
                path="min_time_s",
                value=self.min_time_s,
            )


Exposure: TypeAlias = FixedExposure | AutoExposure
