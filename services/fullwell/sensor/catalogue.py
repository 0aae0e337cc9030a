"""Sensors by name."""

from __future__ import annotations

import math
from functools import cache, partial
from typing import Final

from fullwell.core.registry import Registry
from fullwell.radiometry import Spectrum
from fullwell.sensor.cfa import cfa_pattern
from fullwell.sensor.channel_sets import cfa_of, channel_set
from fullwell.sensor.parameters import ColorFilterArray, SensorModel
from fullwell.sensor.photodiodes import Photodiode, Readout
from fullwell.sensor.tables import read_table

__all__ = ["sensor", "sensor_names"]


def sensor(name: str, path: str = "") -> SensorModel:
    """Return a sensor of the catalogue; case does not matter.

    "imx363": Sony IMX363, main camera of the Google Pixel 4a, at its full 4032 x 3024 pixels, figures of lyu2022.
    "imx363-isetcam": the same as ISETCam models it: 5 e- read noise, ISO 270, no channel correction.
    "imx490": after Sony's IMX490: split pixel, each photodiode read at two conversion gains, combined to 24 bits.
    "mt9v024-rgb", "mt9v024-mono", "mt9v024-rccc": onsemi MT9V024, automotive, 6 um, global shutter.
    "ar0132at-rgb", "ar0132at-rgbw", "ar0132at-rccc": onsemi AR0132AT, automotive, 3.75 um, rolling shutter.
    "iset-a", "iset-b": the automotive sensors of liu2019, 6 um and 3 um on the same area.
    "ideal-mono": every photon an electron, no noise but shot noise, 16 bits.
    "ideal-rgb": the same with colour channels that see as the CIE 1931 standard observer does.

    Every figure and its source: docs/physics/sensors.md. Change parameters with `dataclasses.replace`. Raises FieldError,
    naming the nearest known sensor, where `name` is not known; `path` is the field that asked.
    """
    return _registry().get(name, path=path)


def sensor_names() -> tuple[str, ...]:
    """Return the names `sensor` knows."""
    return tuple(_registry())


@cache
def _registry() -> Registry[SensorModel]:
    registry: Registry[SensorModel] = Registry("sensor")
    registry.register("imx363", _imx363)
    registry.register("imx363-isetcam", _imx363_isetcam)
    registry.register("imx490", _imx490)
    for pattern in ("rgb", "mono", "rccc"):
        registry.register(f"mt9v024-{pattern}", partial(_mt9v024, f"mt9v024-{pattern}", pattern))
    for pattern in ("rgb", "rgbw", "rccc"):
        registry.register(f"ar0132at-{pattern}", partial(_ar0132at, f"ar0132at-{pattern}", pattern))
    registry.register("iset-a", partial(_iset, "iset-a", rows=480, cols=752, pixel_pitch_m=6e-6))
    registry.register("iset-b", partial(_iset, "iset-b", rows=960, cols=1504, pixel_pitch_m=3e-6))
    registry.register("ideal-mono", partial(_ideal, "ideal-mono", "mono"))
    registry.register("ideal-rgb", partial(_ideal, "ideal-rgb", "rggb"))
    return registry


def _named_cfa(pattern: str, channels: str) -> ColorFilterArray:
    return cfa_of(cfa_pattern("rggb" if pattern == "rgb" else pattern), channel_set(channels))


def _imx363() -> SensorModel:
    """Return the sensor with the figures of lyu2022; the read noise there is 5 mV at an analog gain of 1."""
    conversion_gain_v_per_e = 7.65e-5
    return SensorModel(
        name="imx363",
        rows=3024,
        cols=4032,
        pixel_pitch_m=1.4e-6,
        fill_factor=1.0,
        cfa=_named_cfa("rgb", "imx363"),
        well_capacity_e=6000.0,
        conversion_gain_v_per_e=conversion_gain_v_per_e,
        voltage_swing_v=0.4591,
        dark_current_e_per_s=0.0,
        read_noise_e=5e-3 / conversion_gain_v_per_e,
        dsnu_v=0.64e-3,
        prnu_fraction=0.019,
        analog_gain_ratio=1.0,
        analog_offset_v=0.0287,
        adc_bits=10,
        array_rows=3024,
        array_cols=4032,
    )


_IMX363_DN_V: Final = 0.44875e-3
_IMX363_ISO: Final = 270.0
_IMX363_UNITY_ISO: Final = 55.0


def _imx363_isetcam() -> SensorModel:
    """Return the IMX363 with the defaults of ISETCam's own model of it (isetcam, sensorIMX363)."""
    voltage_swing_v = 1023 * _IMX363_DN_V
    wavelength_nm, columns = read_table("imx363.csv")
    efficiencies = columns[:, :3] * columns[:, 3:]
    source = "ISETCam (MIT, 2021-06-05), filters x infrared filter"
    channels = {
        name: Spectrum(wavelength_nm, efficiencies[:, k], outside="zero", unit="e- photon^-1", source=source)
        for k, name in enumerate("RGB")
    }
    return SensorModel(
        name="imx363-isetcam",
        rows=3024,
        cols=4032,
        pixel_pitch_m=1.4e-6,
        fill_factor=1.0,
        cfa=cfa_of(cfa_pattern("rggb"), channels),
        well_capacity_e=6000.0,
        conversion_gain_v_per_e=voltage_swing_v / 6000.0,
        voltage_swing_v=voltage_swing_v,
        dark_current_e_per_s=0.0,
        read_noise_e=5.0,
        dsnu_v=0.0,
        prnu_fraction=0.007,
        analog_gain_ratio=_IMX363_ISO / _IMX363_UNITY_ISO,
        analog_offset_v=64 * _IMX363_DN_V,
        adc_bits=10,
        array_rows=3024,
        array_cols=4032,
    )


def _imx490() -> SensorModel:
    """Return the split pixel with wells, fill factors, ratio of the gains and bits as ISETAuto models it.

    The rest is representative. The low gain of each photodiode fills the converter's range above its offset with a full well.
    """
    swing_v, offset_v = 1.04, 0.016
    large_v_per_e, small_v_per_e = (swing_v - offset_v) / 120e3, (swing_v - offset_v) / 60e3
    gain_ratio = 4.0
    return SensorModel(
        name="imx490",
        rows=1860,
        cols=2880,
        pixel_pitch_m=3e-6,
        fill_factor=0.9,
        cfa=_named_cfa("rgb", "imx363"),
        well_capacity_e=120e3,
        conversion_gain_v_per_e=large_v_per_e,
        voltage_swing_v=swing_v,
        dark_current_e_per_s=0.0,
        read_noise_e=4.0,
        dsnu_v=0.0,
        prnu_fraction=0.0,
        analog_gain_ratio=1.0,
        analog_offset_v=offset_v,
        adc_bits=12,
        array_rows=1860,
        array_cols=2880,
        photodiodes=(
            Photodiode(
                "large",
                fill_factor=0.9,
                well_capacity_e=120e3,
                readouts=(
                    Readout("high", gain_ratio * large_v_per_e, read_noise_e=1.0),
                    Readout("low", large_v_per_e, read_noise_e=4.0),
                ),
            ),
            Photodiode(
                "small",
                fill_factor=0.1,
                well_capacity_e=60e3,
                readouts=(
                    Readout("high", gain_ratio * small_v_per_e, read_noise_e=1.0),
                    Readout("low", small_v_per_e, read_noise_e=4.0),
                ),
            ),
        ),
    )


_ONSEMI_V_PER_E: Final = 110e-6
_ONSEMI_SWING_V: Final = 2.8
"""As ISETCam models both sensors (isetcam, MT9V024Create and ar0132atCreate): estimates, not the maker's figures."""


def _mt9v024(name: str, pattern: str) -> SensorModel:
    """Return the sensor: size, pitch, shutter and bits of its data sheet; read noise and dark current 1 mV and 1 mV/s."""
    return SensorModel(
        name=name,
        rows=480,
        cols=752,
        pixel_pitch_m=6e-6,
        fill_factor=0.8,
        cfa=_named_cfa(pattern, "mt9v024"),
        well_capacity_e=_ONSEMI_SWING_V / _ONSEMI_V_PER_E,
        conversion_gain_v_per_e=_ONSEMI_V_PER_E,
        voltage_swing_v=_ONSEMI_SWING_V,
        dark_current_e_per_s=1e-3 / _ONSEMI_V_PER_E,
        read_noise_e=1e-3 / _ONSEMI_V_PER_E,
        dsnu_v=0.0,
        prnu_fraction=0.0,
        analog_gain_ratio=1.0,
        analog_offset_v=0.0,
        adc_bits=10,
        array_rows=480,
        array_cols=752,
    )


_AR0132AT_BEST_SNR_DB: Final = 43.9
_AR0132AT_LINES_PER_S: Final = 45.0 * 1000.0


def _ar0132at(name: str, pattern: str) -> SensorModel:
    """Return the sensor: its full well is what shot noise alone needs for the data sheet's 43.9 dB."""
    return SensorModel(
        name=name,
        rows=960,
        cols=1280,
        pixel_pitch_m=3.75e-6,
        fill_factor=0.75,
        cfa=_named_cfa(pattern, "mt9v024"),
        well_capacity_e=math.pow(10.0, _AR0132AT_BEST_SNR_DB / 10.0),
        conversion_gain_v_per_e=_ONSEMI_V_PER_E,
        voltage_swing_v=_ONSEMI_SWING_V,
        dark_current_e_per_s=1e-3 / _ONSEMI_V_PER_E,
        read_noise_e=1e-3 / _ONSEMI_V_PER_E,
        dsnu_v=0.0,
        prnu_fraction=0.0,
        analog_gain_ratio=1.0,
        analog_offset_v=0.0,
        adc_bits=12,
        array_rows=960,
        array_cols=1280,
        line_time_s=1.0 / _AR0132AT_LINES_PER_S,
    )


def _iset(name: str, *, rows: int, cols: int, pixel_pitch_m: float) -> SensorModel:
    """Return an automotive sensor of liu2019: size, pitch, 1 mV read noise, 1 mV/s dark; the rest as the MT9V024."""
    return SensorModel(
        name=name,
        rows=rows,
        cols=cols,
        pixel_pitch_m=pixel_pitch_m,
        fill_factor=0.8,
        cfa=_named_cfa("rgb", "mt9v024"),
        well_capacity_e=_ONSEMI_SWING_V / _ONSEMI_V_PER_E,
        conversion_gain_v_per_e=_ONSEMI_V_PER_E,
        voltage_swing_v=_ONSEMI_SWING_V,
        dark_current_e_per_s=1e-3 / _ONSEMI_V_PER_E,
        read_noise_e=1e-3 / _ONSEMI_V_PER_E,
        dsnu_v=0.0,
        prnu_fraction=0.0,
        analog_gain_ratio=1.0,
        analog_offset_v=0.0,
        adc_bits=10,
        array_rows=rows,
        array_cols=cols,
    )


def _ideal(name: str, pattern: str) -> SensorModel:
    """Return a sensor whose only imperfections are photons coming one by one and 16 bits: 1.5 e- per digital number."""
    return SensorModel(
        name=name,
        rows=480,
        cols=640,
        pixel_pitch_m=4e-6,
        fill_factor=1.0,
        cfa=_named_cfa(pattern, "ideal"),
        well_capacity_e=100_000.0,
        conversion_gain_v_per_e=1e-5,
        voltage_swing_v=1.0,
        dark_current_e_per_s=0.0,
        read_noise_e=0.0,
        dsnu_v=0.0,
        prnu_fraction=0.0,
        analog_gain_ratio=1.0,
        analog_offset_v=0.0,
        adc_bits=16,
    )
