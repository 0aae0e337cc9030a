"""What describes a sensor and how it is exposed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from fullwell.radiometry.spectrum import Spectrum

__all__ = ["AutoExposure", "ColorFilterArray", "Exposure", "FixedExposure", "SensorModel"]


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


@dataclass(frozen=True, slots=True, eq=False)
class SensorModel:
    """Parameters of one sensor; every noise term may be 0.

    `analog_gain_ratio` is the amplification between pixel and ADC (> 1 brightens), `analog_offset_v` is added after it,
    `voltage_swing_v` is the ADC's full scale, `serial` seeds the fixed pattern (same serial, same pattern).
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


@dataclass(frozen=True, slots=True)
class FixedExposure:
    """One exposure of `time_s` [s], > 0."""

    time_s: float


@dataclass(frozen=True, slots=True)
class AutoExposure:
    """Exposure time found from the noise-free image.

    "full": the brightest pixel reaches `level` of the well; "mean": the mean pixel does; "percentile": the `percentile`-th
    one does. The result is clipped to [min_time_s, max_time_s]; a black scene gets max_time_s.
    """

    method: Literal["full", "mean", "percentile"] = "percentile"
    level: float = 0.7
    percentile: float = 99.0
    min_time_s: float = 1e-6
    max_time_s: float = 1.0


Exposure: TypeAlias = FixedExposure | AutoExposure
