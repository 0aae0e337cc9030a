"""Exposure time: given, or found from the noise-free image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.sensor.parameters import AutoExposure, Exposure, FixedExposure, SensorModel

__all__ = ["exposure_time_for_rate", "saturation_electrons"]


def saturation_electrons(sensor: SensorModel) -> float:
    """Return the electrons at which a pixel saturates [e-]: the well, or what the ADC's full scale leaves of it."""
    headroom_v = (sensor.voltage_swing_v - sensor.analog_offset_v) / sensor.analog_gain_ratio
    return min(sensor.well_capacity_e, headroom_v / sensor.conversion_gain_v_per_e)


def exposure_time_for_rate(electron_rate: NDArray[np.float64], sensor: SensorModel, exposure: Exposure) -> float:
    """Return the exposure time [s] for noise-free photo-electron rates (rows, cols) [e- s^-1].

    Dark current counts towards the saturation signal. A scene without light and dark current gets `max_time_s`.
    """
    if isinstance(exposure, FixedExposure):
        return exposure.time_s
    rate = _representative(electron_rate, exposure) + sensor.dark_current_e_per_s
    target_e = exposure.level * saturation_electrons(sensor)
    if rate * exposure.max_time_s <= target_e:
        return exposure.max_time_s
    return max(target_e / rate, exposure.min_time_s)


def _representative(electron_rate: NDArray[np.float64], exposure: AutoExposure) -> float:
    if exposure.method == "full":
        return float(np.max(electron_rate))
    if exposure.method == "mean":
        return float(np.mean(electron_rate))
    return float(np.percentile(electron_rate, exposure.percentile))
