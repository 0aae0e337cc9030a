"""What describes a sensor in ISETCam's terms, its stock sensors, and how our own description maps to it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, ShapeError, unknown_name_message
from fullwell.radiometry.isetcam import check_wavelengths, sensor_curves
from fullwell.sensor.hot_pixels import mean_dark_current
from fullwell.sensor.microlens import pixel_illumination
from fullwell.sensor.parameters import SensorModel

__all__ = [
    "BAYER_ORDERS",
    "IsetcamSensor",
    "bayer_sensor",
    "from_sensor_model",
    "imx363_sensor",
    "monochrome_sensor",
    "mt9v024_sensor",
    "sensor_a",
    "sensor_b",
]

BAYER_ORDERS: Final = {
    "rggb": ((0, 1), (1, 2)),
    "grbg": ((1, 0), (2, 1)),
    "bggr": ((2, 1), (1, 0)),
    "gbrg": ((1, 2), (0, 1)),
}

_IMX363_MV_PER_DN: Final = 0.44875e-3
_IMX363_ISO_AT_GAIN_1: Final = 55.0
_IMX363_BLACK_LEVEL_DN: Final = 64


@dataclass(frozen=True, slots=True, eq=False)
class IsetcamSensor:
    """A sensor as ISETCam describes it; the defaults are ISETCam's.

    Attributes
    ----------
    name, rows, cols
        Pixels are centred on the optical axis.
    pattern
        Index of the filter of each pixel of the repeated block; `pattern[0][0]` is the top-left pixel.
    wavelength_nm, quantum_efficiency
        (n,) [nm] and (n, filters) [e- per photon], filters and infrared filter included; linear between, 0 outside.
    pixel_height_m, pixel_width_m, fill_factor
        Pitch [m] and share of the photodetector.
    conversion_gain_v_per_e, voltage_swing_v
        The well holds `voltage_swing_v / conversion_gain_v_per_e` electrons.
    dark_voltage_v_per_s, read_noise_v, dsnu_v, prnu_fraction, column_offset_sd_v, column_gain_sd
        Noise; `column_gain_sd` is a fraction. Patterns are drawn anew for each capture.
    gain_divisor, analog_offset_v
        Output = (volts + offset) / gain: below 1 brightens.
    adc_bits
        None for an analog sensor.
    correlated_double_sampling
        As ISETCam does it: subtracts another draw of the DSNU from the volts.
    vignetting
        (rows, cols) factors, or None for 1.
    log_response
        log10(v + read noise) - log10(read noise) in place of v.

    Raises
    ------
    FieldError, ShapeError
        On making it with a value that is NaN or outside its range.
    """

    name: str
    rows: int
    cols: int
    pattern: tuple[tuple[int, ...], ...]
    wavelength_nm: NDArray[np.float64]
    quantum_efficiency: NDArray[np.float64]
    filter_names: tuple[str, ...]
    pixel_height_m: float = 2.8e-6
    pixel_width_m: float = 2.8e-6
    fill_factor: float = 0.75
    conversion_gain_v_per_e: float = 1e-4
    voltage_swing_v: float = 1.0
    dark_voltage_v_per_s: float = 1e-3
    read_noise_v: float = 1e-3
    dsnu_v: float = 0.0
    prnu_fraction: float = 0.0
    column_offset_sd_v: float = 0.0
    column_gain_sd: float = 0.0
    gain_divisor: float = 1.0
    analog_offset_v: float = 0.0
    adc_bits: int | None = None
    correlated_double_sampling: bool = False
    vignetting: NDArray[np.float64] | None = None
    log_response: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "wavelength_nm", check_wavelengths(self.wavelength_nm))
        filters = len(self.filter_names)
        if self.quantum_efficiency.shape != (self.wavelength_nm.size, filters):
            raise ShapeError(
                f"quantum_efficiency has shape {self.quantum_efficiency.shape}; must be ({self.wavelength_nm.size}, {filters})."
            )
        if not self.pattern or len({len(row) for row in self.pattern}) != 1 or not self.pattern[0]:
            raise ShapeError(f"pattern is {self.pattern}; must be a rectangle of filter indices, at least 1 x 1.")
        if not all(0 <= index < filters for row in self.pattern for index in row):
            raise FieldError(f"pattern is {self.pattern}; must hold indices 0 to {filters - 1}.", path="pattern")
        if not (np.min(self.quantum_efficiency) >= 0 and np.max(self.quantum_efficiency) < math.inf):
            raise FieldError("quantum_efficiency must be finite and >= 0.", path="quantum_efficiency")
        self._check_numbers()

    def _check_numbers(self) -> None:
        positive = ("rows", "cols", "pixel_height_m", "pixel_width_m", "fill_factor", "conversion_gain_v_per_e")
        for path in (*positive, "voltage_swing_v", "gain_divisor"):
            if not 0 < getattr(self, path) < math.inf:
                raise _refused(path, getattr(self, path), "> 0 and finite")
        noise = ("dark_voltage_v_per_s", "read_noise_v", "dsnu_v", "prnu_fraction", "column_offset_sd_v", "column_gain_sd")
        for path in noise:
            if not 0 <= getattr(self, path) < math.inf:
                raise _refused(path, getattr(self, path), ">= 0 and finite")
        if not self.fill_factor <= 1:
            raise _refused("fill_factor", self.fill_factor, "at most 1")
        if not math.isfinite(self.analog_offset_v):
            raise _refused("analog_offset_v", self.analog_offset_v, "finite")
        if self.adc_bits is not None and not 1 <= self.adc_bits <= 32:
            raise _refused("adc_bits", self.adc_bits, "1 to 32, or None")
        if self.vignetting is not None and self.vignetting.shape != (self.rows, self.cols):
            raise ShapeError(f"vignetting has shape {self.vignetting.shape}; must be ({self.rows}, {self.cols}).")
        if self.log_response and not self.read_noise_v > 0:
            raise _refused("read_noise_v", self.read_noise_v, "> 0 where the response is logarithmic")


def monochrome_sensor(*, rows: int = 72, cols: int = 88, wavelength_nm: tuple[float, float] = (300.0, 1100.0)) -> IsetcamSensor:
    """Return ISETCam's monochrome sensor: quantum efficiency 1."""
    wave = np.array(wavelength_nm)
    return IsetcamSensor("monochrome", rows, cols, ((0,),), wave, np.ones((2, 1)), ("w",))


def bayer_sensor(order: str = "grbg", *, rows: int = 72, cols: int = 88) -> IsetcamSensor:
    """Return ISETCam's default colour sensor. `order` is one of `BAYER_ORDERS`; raises FieldError otherwise."""
    wave, curves = sensor_curves("default")
    return IsetcamSensor("bayer", rows, cols, _order(order), wave, curves, ("r", "g", "b"))


def imx363_sensor(*, iso: float = 270.0, rows: int = 600, cols: int = 800) -> IsetcamSensor:
    """Return ISETCam's Sony IMX363: 10 bits of 0.44875 mV, 6000 electrons, read noise 5 e-, gain 55 / ISO."""
    if not 0 < iso < math.inf:
        raise _refused("iso", iso, "> 0 and finite")
    wave, curves = sensor_curves("imx363")
    swing_v = 1023 * _IMX363_MV_PER_DN
    gain_v_per_e = swing_v / 6000.0
    divisor = _IMX363_ISO_AT_GAIN_1 / iso
    return IsetcamSensor(
        "imx363",
        rows,
        cols,
        BAYER_ORDERS["rggb"],
        wave,
        curves,
        ("r", "g", "b"),
        pixel_height_m=1.4e-6,
        pixel_width_m=1.4e-6,
        fill_factor=1.0,
        conversion_gain_v_per_e=gain_v_per_e,
        voltage_swing_v=swing_v,
        dark_voltage_v_per_s=0.0,
        read_noise_v=5.0 * gain_v_per_e,
        prnu_fraction=0.007,
        gain_divisor=divisor,
        analog_offset_v=_IMX363_BLACK_LEVEL_DN * _IMX363_MV_PER_DN * divisor,
        adc_bits=10,
    )


def mt9v024_sensor(*, rows: int = 480, cols: int = 752) -> IsetcamSensor:
    """Return ISETCam's ON Semiconductor MT9V024 with RGB filters in GRBG order: 6 um, 110 uV/e-, swing 2.8 V, analog."""
    wave, curves = sensor_curves("mt9v024")
    return IsetcamSensor(
        "mt9v024",
        rows,
        cols,
        BAYER_ORDERS["grbg"],
        wave,
        curves,
        ("r", "g", "b"),
        pixel_height_m=6e-6,
        pixel_width_m=6e-6,
        fill_factor=0.8,
        conversion_gain_v_per_e=1.1e-4,
        voltage_swing_v=2.8,
    )


def sensor_a() -> IsetcamSensor:
    """Return sensor A of the reference: 752 x 480 pixels of 6 um, RGGB, 10 bits."""
    return _published("sensor a", rows=480, cols=752, pitch_m=6e-6)


def sensor_b() -> IsetcamSensor:
    """Return sensor B of the reference: 1504 x 960 pixels of 3 um, RGGB, 10 bits."""
    return _published("sensor b", rows=960, cols=1504, pitch_m=3e-6)


def from_sensor_model(sensor: SensorModel) -> IsetcamSensor:
    """Return our description of a sensor in ISETCam's terms.

    Volts = electrons x conversion gain throughout: dark current (at the sensor's temperature) and `read_noise_e` become
    volts. Our gain multiplies and comes before the offset, ISETCam's divides and comes after it: divisor = 1 /
    `analog_gain_ratio`, offset = `analog_offset_v` / `analog_gain_ratio`. `prnu_fraction`, `dsnu_v` and the column's figures
    keep their values but lose their permanence, and `serial` its meaning. Micro-lenses become the vignetting map.

    Not used, because ISETCam has nothing like it: `well_capacity_e` (its well is the voltage swing), reset noise, row noise
    and offsets, hot pixels, dark current's spread, crosstalk, the photodetector's offset, line times.

    Raises
    ------
    FieldError
        Several photodiodes or readouts.
    """
    if sensor.photodiodes:
        raise FieldError(
            f"sensor {sensor.name!r} has {len(sensor.photodiodes)} photodiodes; model isetcam knows one. Use model physical.",
            path="photodiodes",
            value=len(sensor.photodiodes),
        )
    names = sensor.cfa.channel_names
    wave = np.unique(np.concatenate([curve.wavelength_nm for _, curve in sensor.cfa.channels]))
    pitch_m, gain = sensor.pixel_pitch_m, sensor.conversion_gain_v_per_e
    vignetting = None
    if sensor.microlens is not None:
        vignetting = pixel_illumination(sensor.microlens, rows=sensor.rows, cols=sensor.cols, pixel_pitch_m=pitch_m)
    return IsetcamSensor(
        sensor.name,
        sensor.rows,
        sensor.cols,
        tuple(tuple(names.index(name) for name in row) for row in sensor.cfa.pattern),
        wave,
        np.stack([curve.at(wave) for _, curve in sensor.cfa.channels], axis=1),
        names,
        pixel_height_m=pitch_m,
        pixel_width_m=pitch_m,
        fill_factor=sensor.fill_factor,
        conversion_gain_v_per_e=gain,
        voltage_swing_v=sensor.voltage_swing_v,
        dark_voltage_v_per_s=mean_dark_current(sensor) * gain,
        read_noise_v=sensor.read_noise_e * gain,
        dsnu_v=sensor.dsnu_v,
        prnu_fraction=sensor.prnu_fraction,
        column_offset_sd_v=sensor.column_offset_v,
        column_gain_sd=sensor.column_gain_fraction,
        gain_divisor=1.0 / sensor.analog_gain_ratio,
        analog_offset_v=sensor.analog_offset_v / sensor.analog_gain_ratio,
        adc_bits=sensor.adc_bits,
        correlated_double_sampling=sensor.readout_sampling == "correlated_double",
        vignetting=vignetting,
    )


def _published(name: str, *, rows: int, cols: int, pitch_m: float) -> IsetcamSensor:
    wave, curves = sensor_curves("default")
    return IsetcamSensor(
        name,
        rows,
        cols,
        BAYER_ORDERS["rggb"],
        wave,
        curves,
        ("r", "g", "b"),
        pixel_height_m=pitch_m,
        pixel_width_m=pitch_m,
        adc_bits=10,
    )


def _order(order: str) -> tuple[tuple[int, ...], ...]:
    if order not in BAYER_ORDERS:
        raise FieldError(unknown_name_message("Bayer order", order, BAYER_ORDERS), path="order", value=order)
    return BAYER_ORDERS[order]


def _refused(path: str, value: object, legal: str) -> FieldError:
    return FieldError(f"{path} is {value}; must be {legal}. Set {path} of the sensor.", path=path, value=value)
