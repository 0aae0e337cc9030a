"""Dark current of each pixel: its spread over the pixels, and hot pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.sensor.dark_current import temperature_ratio
from fullwell.sensor.fixed_pattern import FixedPattern, hot_pixels, pixel_normals
from fullwell.sensor.parameters import SensorModel

__all__ = ["dark_current_map", "mean_dark_current"]


def mean_dark_current(sensor: SensorModel) -> float:
    """Return the mean dark current at the sensor's temperature, without hot pixels [e-/s]."""
    return sensor.dark_current_e_per_s * _warmth(sensor)


def dark_current_map(sensor: SensorModel, pattern: FixedPattern) -> float | NDArray[np.float64]:
    """Return the dark current of each pixel, (rows, cols), or the one of all [e-/s]; part of the fixed pattern.

    Spread as a Gaussian of standard deviation `dcnu_fraction` of the mean, not below 0; hot pixels add an exponentially
    distributed part. All of it follows the temperature.

    References
    ----------
    emva1288, dark signal non-uniformity; the tail of hot pixels is representative (widenhorn2002).
    """
    mean = mean_dark_current(sensor)
    hot = sensor.hot_pixel_fraction > 0 and sensor.hot_pixel_dark_current_e_per_s > 0
    if sensor.dcnu_fraction == 0 and not hot:
        return mean
    current = np.full((pattern.window.rows, pattern.window.cols), mean)
    if sensor.dcnu_fraction > 0:
        current *= np.maximum(1.0 + sensor.dcnu_fraction * pixel_normals(pattern, "dcnu"), 0.0)
    if hot:
        rows, cols, strength = hot_pixels(pattern, fraction=sensor.hot_pixel_fraction)
        np.add.at(current, (rows, cols), strength * sensor.hot_pixel_dark_current_e_per_s * _warmth(sensor))
    return current


def _warmth(sensor: SensorModel) -> float:
    return temperature_ratio(
        sensor.dark_current_law,
        temperature_k=sensor.temperature_k,
        reference_temperature_k=sensor.dark_reference_temperature_k,
    )
