"""Sensors by name."""

from __future__ import annotations

from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from fullwell.core.registry import Registry
from fullwell.radiometry import Spectrum, colour_matching_functions
from fullwell.sensor.parameters import ColorFilterArray, SensorModel

__all__ = ["sensor", "sensor_names"]

_RGGB = (("R", "G"), ("G", "B"))

_IMX363_CHANNEL_CORRECTION = np.array([[0.56, 0.08, 0.01], [0.0, 0.59, 0.0], [0.0, 0.25, 0.71]])
"""Channel gains and crosstalk of the Pixel 4a's camera: the row (r, g, b) of a wavelength is multiplied by it (lyu2022)."""

_IDEAL_RANGE_NM = np.array([300.0, 1100.0])


def sensor(name: str, path: str = "") -> SensorModel:
    """Return a sensor of the catalogue; case does not matter.

    "imx363": Sony IMX363, main camera of the Google Pixel 4a, at its full 4032 x 3024 pixels.
    "ideal-mono": every photon an electron, no noise but shot noise, 16 bits.
    "ideal-rgb": the same with colour channels that see as the CIE 1931 standard observer does.

    Change parameters with `dataclasses.replace`. Raises FieldError, naming the nearest known sensor, where `name` is not
    known; `path` is the field that asked.
    """
    return _registry().get(name, path=path)


def sensor_names() -> tuple[str, ...]:
    """Return the names `sensor` knows."""
    return tuple(_registry())


@cache
def _registry() -> Registry[SensorModel]:
    registry: Registry[SensorModel] = Registry("sensor")
    registry.register("imx363", _imx363)
    registry.register("ideal-mono", _ideal_mono)
    registry.register("ideal-rgb", _ideal_rgb)
    return registry


def _imx363() -> SensorModel:
    """Return the sensor with the figures of lyu2022; the read noise there is 5 mV at an analog gain of 1."""
    conversion_gain_v_per_e = 7.65e-5
    return SensorModel(
        name="imx363",
        rows=3024,
        cols=4032,
        pixel_pitch_m=1.4e-6,
        fill_factor=1.0,
        cfa=ColorFilterArray(pattern=_RGGB, channels=_imx363_channels()),
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
    )


def _imx363_channels() -> tuple[tuple[str, Spectrum], ...]:
    wavelength_nm, columns = _table("imx363.csv")
    corrected = (columns[:, :3] * columns[:, 3:]) @ _IMX363_CHANNEL_CORRECTION
    source = "ISETCam (MIT, 2021-06-05), filters x infrared filter x channel correction of lyu2022"
    return tuple(
        (name, Spectrum(wavelength_nm, corrected[:, k], outside="zero", unit="e- photon^-1", source=source))
        for k, name in enumerate("RGB")
    )


def _table(file: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return wavelengths (n,) [nm] and the other columns (n, k) of a table beside this module."""
    text = resources.files("fullwell.sensor").joinpath("data", file).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    numbers = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    return numbers[:, 0], numbers[:, 1:]


def _ideal(name: str, cfa: ColorFilterArray) -> SensorModel:
    """Return a sensor whose only imperfections are photons coming one by one and 16 bits: 1.5 e- per digital number."""
    return SensorModel(
        name=name,
        rows=480,
        cols=640,
        pixel_pitch_m=4e-6,
        fill_factor=1.0,
        cfa=cfa,
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


def _ideal_mono() -> SensorModel:
    everything = Spectrum(_IDEAL_RANGE_NM, np.ones(2), outside="zero", unit="e- photon^-1", source="ideal")
    return _ideal("ideal-mono", ColorFilterArray(pattern=(("W",),), channels=(("W", everything),)))


def _ideal_rgb() -> SensorModel:
    """Return the colour sensor that meets the Luther condition.

    The observer's functions weigh energy, electrons count photons: dividing by the wavelength turns one into the other. Each
    channel is scaled to a peak of 1.
    """
    channels = []
    for name, curve in zip("RGB", colour_matching_functions(), strict=True):
        per_photon = curve.values / curve.wavelength_nm
        efficiency = per_photon / np.max(per_photon)
        source = "CIE 1931 standard observer over wavelength, peak 1"
        channels.append((name, Spectrum(curve.wavelength_nm, efficiency, outside="zero", unit="e- photon^-1", source=source)))
    return _ideal("ideal-rgb", ColorFilterArray(pattern=_RGGB, channels=tuple(channels)))
