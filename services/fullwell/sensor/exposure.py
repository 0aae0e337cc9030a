"""Exposure time: given, or found from the noise-free image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.sensor.cfa import channel_index_map
from fullwell.sensor.exposures import (
    AutoExposure,
    BracketExposure,
    BurstExposure,
    ChannelExposure,
    Exposure,
    FixedExposure,
    SingleExposure,
)
from fullwell.sensor.hot_pixels import mean_dark_current
from fullwell.sensor.parameters import SensorModel

__all__ = ["base_exposure", "check_exposure_time", "exposure_time_for_rate", "metered_rate", "saturation_electrons"]

CENTRE_WEIGHT_SIGMA = 0.25
"""Of the Gaussian of centre-weighted metering, as a fraction of each side of the image."""


def saturation_electrons(sensor: SensorModel) -> float:
    """Return the electrons at which a pixel saturates [e-]: the well, or what the ADC's full scale leaves of it."""
    headroom_v = (sensor.voltage_swing_v - sensor.analog_offset_v) / sensor.analog_gain_ratio
    return min(sensor.well_capacity_e, headroom_v / sensor.conversion_gain_v_per_e)


def base_exposure(exposure: Exposure) -> SingleExposure:
    """Return the single exposure that brackets, bursts and channel ratios multiply."""
    if isinstance(exposure, BracketExposure | BurstExposure | ChannelExposure):
        return exposure.base
    return exposure


def check_exposure_time(exposure_time_s: float) -> float:
    """Return the time [s]; raise FieldError where it is not > 0 and finite."""
    if not 0 < exposure_time_s < np.inf:
        raise FieldError(
            f"exposure_time_s is {exposure_time_s}; must be > 0 and finite. Set exposure.time_s.",
            path="exposure_time_s",
            value=exposure_time_s,
        )
    return exposure_time_s


def exposure_time_for_rate(electron_rate: NDArray[np.float64], sensor: SensorModel, exposure: Exposure) -> float:
    """Return the base exposure time [s] for noise-free photo-electron rates (rows, cols) [e- s^-1].

    Dark current counts towards the saturation signal. A scene without light and dark current gets `max_time_s`.
    """
    base = base_exposure(exposure)
    if isinstance(base, FixedExposure):
        return base.time_s
    rate = metered_rate(electron_rate, sensor, base) + mean_dark_current(sensor)
    target_e = base.level * saturation_electrons(sensor)
    if rate * base.max_time_s <= target_e:
        return base.max_time_s
    return max(target_e / rate, base.min_time_s)


def metered_rate(electron_rate: NDArray[np.float64], sensor: SensorModel, exposure: AutoExposure) -> float:
    """Return the photo-electron rate that automatic exposure brings to its level [e- s^-1]; see `AutoExposure`."""
    match exposure.method:
        case "full":
            return float(np.max(electron_rate))
        case "mean":
            return float(np.mean(electron_rate))
        case "percentile":
            return float(np.percentile(electron_rate, exposure.percentile))
        case "luminance":
            return _brightest_period(electron_rate, sensor)
        case "centre_weighted":
            return _centre_weighted_mean(electron_rate)
        case "highlight":
            return _brightest_channel_percentile(electron_rate, sensor, exposure.percentile)
        case "area":
            return float(np.mean(_part(electron_rate, exposure.area)))


def _brightest_period(electron_rate: NDArray[np.float64], sensor: SensorModel) -> float:
    """Return the largest channel mean of the period of the pattern with the largest sum."""
    down, across = len(sensor.cfa.pattern), len(sensor.cfa.pattern[0])
    rows, cols = electron_rate.shape[0] // down, electron_rate.shape[1] // across
    if rows == 0 or cols == 0:
        return float(np.max(electron_rate))
    periods = electron_rate[: rows * down, : cols * across].reshape(rows, down, cols, across)
    row, col = np.unravel_index(int(np.argmax(np.sum(periods, axis=(1, 3)))), (rows, cols))
    period, index = periods[row, :, col, :], channel_index_map(sensor.cfa, rows=down, cols=across)
    return max(float(np.mean(period[index == k])) for k in np.unique(index))


def _centre_weighted_mean(electron_rate: NDArray[np.float64]) -> float:
    weights = [
        np.exp(-0.5 * (((np.arange(side) + 0.5) / side - 0.5) / CENTRE_WEIGHT_SIGMA) ** 2) for side in electron_rate.shape
    ]
    return float(weights[0] @ electron_rate @ weights[1] / (np.sum(weights[0]) * np.sum(weights[1])))


def _brightest_channel_percentile(electron_rate: NDArray[np.float64], sensor: SensorModel, percentile: float) -> float:
    index = channel_index_map(sensor.cfa, rows=electron_rate.shape[0], cols=electron_rate.shape[1])
    return max(float(np.percentile(electron_rate[index == k], percentile)) for k in np.unique(index))


def _part(electron_rate: NDArray[np.float64], area: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """Return the pixels of an area, at least one."""
    rows, cols = electron_rate.shape
    top, left = int(area[0] * rows), int(area[1] * cols)
    bottom, right = round((area[0] + area[2]) * rows), round((area[1] + area[3]) * cols)
    return electron_rate[top : max(bottom, top + 1), left : max(right, left + 1)]
