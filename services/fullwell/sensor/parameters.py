"""What describes a sensor and how it is exposed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.spectrum import Spectrum
from fullwell.sensor.checks import check_fraction, check_kernel, check_not_negative, check_positive, refusal
from fullwell.sensor.dark_current import DEFAULT_LAW, DarkCurrentLaw
from fullwell.sensor.exposures import (
    AutoExposure,
    BracketExposure,
    BurstExposure,
    ChannelExposure,
    Combination,
    Exposure,
    FixedExposure,
)
from fullwell.sensor.microlens import PixelFalloff
from fullwell.sensor.photodiodes import Photodiode

__all__ = [
    "MAX_ADC_BITS",
    "MAX_WELL_CAPACITY_E",
    "AutoExposure",
    "BracketExposure",
    "BurstExposure",
    "ChannelExposure",
    "ColorFilterArray",
    "Exposure",
    "FixedExposure",
    "ReadoutSampling",
    "SensorModel",
]

MAX_ADC_BITS: Final = 16
"""Raw images are stored in 16 bits."""

MAX_WELL_CAPACITY_E: Final = 1e9
"""Poisson numbers are drawn exactly up to here and beyond; no photodiode comes near it."""


ReadoutSampling = Literal["single", "correlated_double"]


_ROUNDING = 1e-9
"""Share of the pitch by which rounding may push a photodetector that fills its pixel over the edge."""


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
            raise refusal("pattern", self.pattern, "a rectangle of channel names, at least 1 x 1")
        names = [name for name, _ in self.channels]
        if len(set(names)) != len(names):
            raise refusal("channels", names, "named differently from one another")
        for name in (name for row in self.pattern for name in row):
            if name not in names:
                raise FieldError(unknown_name_message("channel", name, names), path="pattern", value=name)
        for name, efficiency in self.channels:
            low, high = float(np.min(efficiency.values)), float(np.max(efficiency.values))
            if low < 0 or high > 1:
                raise refusal(f"channels.{name}", f"{low} to {high}", "a quantum efficiency within 0 to 1")

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the channels, in their order."""
        return tuple(name for name, _ in self.channels)


_COUNTS = ("rows", "cols")
_POSITIVE = (
    "pixel_pitch_m",
    "well_capacity_e",
    "conversion_gain_v_per_e",
    "voltage_swing_v",
    "analog_gain_ratio",
    "temperature_k",
    "dark_reference_temperature_k",
)
_NOT_NEGATIVE = (
    "dark_current_e_per_s",
    "read_noise_e",
    "dsnu_v",
    "prnu_fraction",
    "analog_offset_v",
    "dcnu_fraction",
    "hot_pixel_dark_current_e_per_s",
    "reset_noise_e",
    "column_offset_v",
    "row_offset_v",
    "column_gain_fraction",
    "row_noise_v",
    "line_time_s",
)


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
    array_rows, array_cols
        Pixels of the whole chip where only its middle is read: the fixed pattern is a cut-out of the chip's. 0: as many as are
        read.
    photodetector_offset_m
        (down, right) of the photodetector's centre from the pixel's [m]; it must stay within the pixel.
    microlens
        Relative illumination of the pixels over the field; None is 1.
    crosstalk_kernel
        3 x 3 shares of a pixel's electrons that it and its neighbours collect (`fullwell.sensor.crosstalk`); None is no
        crosstalk.
    temperature_k, dark_reference_temperature_k, dark_current_law
        `dark_current_e_per_s` holds at the reference temperature and follows the law to `temperature_k` [K].
    dcnu_fraction
        Standard deviation over the pixels of the dark current over its mean.
    hot_pixel_fraction, hot_pixel_dark_current_e_per_s
        Share of the pixels that are hot, and the mean of their extra dark current at the reference temperature [e-/s], which
        is exponentially distributed.
    reset_noise_e
        Standard deviation of the reset (kTC) noise [e-].
    readout_sampling
        "single": a pixel is read once. "correlated_double": twice, after the reset and after the exposure, and the difference
        is taken: reset noise and fixed offsets cancel, `read_noise_e` and `row_noise_v` count twice.
    column_offset_v, row_offset_v
        Standard deviations of the fixed offsets of columns and rows, before the analog gain [V].
    column_gain_fraction
        Standard deviation of the fixed relative gain of the columns.
    row_noise_v
        Standard deviation of the noise that all pixels of a row share, new at each readout, before the analog gain [V].
    line_time_s
        Delay from row to row of a rolling shutter [s]; 0 is a global shutter.
    photodiodes
        Photodiodes and their readouts where there are several, the most sensitive first; they replace `fill_factor`,
        `well_capacity_e`, `conversion_gain_v_per_e` and `read_noise_e`, which then only describe the reference. Empty: one.
    combination
        How the captures of several photodiodes or readouts become one image; "weighted" or "select" (`BracketExposure`).

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
    array_rows: int = 0
    array_cols: int = 0
    photodetector_offset_m: tuple[float, float] = (0.0, 0.0)
    microlens: PixelFalloff | None = None
    crosstalk_kernel: tuple[tuple[float, ...], ...] | None = None
    temperature_k: float = 298.15
    dark_reference_temperature_k: float = 298.15
    dark_current_law: DarkCurrentLaw = DEFAULT_LAW
    dcnu_fraction: float = 0.0
    hot_pixel_fraction: float = 0.0
    hot_pixel_dark_current_e_per_s: float = 0.0
    reset_noise_e: float = 0.0
    readout_sampling: ReadoutSampling = "single"
    column_offset_v: float = 0.0
    row_offset_v: float = 0.0
    column_gain_fraction: float = 0.0
    row_noise_v: float = 0.0
    line_time_s: float = 0.0
    photodiodes: tuple[Photodiode, ...] = ()
    combination: Combination = "weighted"

    def __post_init__(self) -> None:
        for path in _COUNTS:
            if not getattr(self, path) >= 1:
                raise refusal(path, getattr(self, path), "at least 1")
        for path in _POSITIVE:
            check_positive(path, getattr(self, path))
        for path in _NOT_NEGATIVE:
            check_not_negative(path, getattr(self, path))
        for path in ("array_rows", "array_cols"):
            if not getattr(self, path) >= 0:
                raise refusal(path, getattr(self, path), "at least 0")
        check_positive("fill_factor", self.fill_factor)
        for path in ("fill_factor", "hot_pixel_fraction"):
            check_fraction(path, getattr(self, path))
        if not self.well_capacity_e <= MAX_WELL_CAPACITY_E:
            raise refusal("well_capacity_e", self.well_capacity_e, f"at most {MAX_WELL_CAPACITY_E:g}")
        if not 1 <= self.adc_bits <= MAX_ADC_BITS:
            raise refusal("adc_bits", self.adc_bits, f"1 to {MAX_ADC_BITS}")
        if not self.analog_offset_v < self.voltage_swing_v:
            raise refusal("analog_offset_v", self.analog_offset_v, f"below voltage_swing_v = {self.voltage_swing_v}")
        if self.crosstalk_kernel is not None:
            check_kernel("crosstalk_kernel", self.crosstalk_kernel)
        self._check_choices()
        self._check_photodiodes()

    def _check_choices(self) -> None:
        for path, legal in (("readout_sampling", get_args(ReadoutSampling)), ("combination", get_args(Combination))):
            if getattr(self, path) not in legal:
                message = unknown_name_message(path.replace("_", " "), getattr(self, path), legal)
                raise FieldError(message, path=path, value=getattr(self, path))

    def _check_photodiodes(self) -> None:
        names = [photodiode.name for photodiode in self.photodiodes]
        if len(set(names)) != len(names):
            raise refusal("photodiodes", names, "named differently from one another")
        places = [(photodiode.offset_m, photodiode.fill_factor) for photodiode in self.photodiodes]
        for offset_m, fill_factor in places or [(None, self.fill_factor)]:
            reach = max(abs(d) for d in offset_m or self.photodetector_offset_m) + 0.5 * self.pixel_pitch_m * fill_factor**0.5
            if not reach <= 0.5 * self.pixel_pitch_m * (1 + _ROUNDING):
                raise refusal(
                    "photodetector_offset_m",
                    offset_m or self.photodetector_offset_m,
                    f"so small that a photodetector of fill factor {fill_factor:g} stays within the pixel",
                )
