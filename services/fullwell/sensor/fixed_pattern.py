"""Fixed pattern: differences between pixels that stay the same in every picture of one sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.core.rng import stream
from fullwell.sensor.parameters import SensorModel

__all__ = ["dsnu_pattern_v", "fixed_pattern_stream", "prnu_pattern"]


def fixed_pattern_stream(sensor: SensorModel) -> np.random.Generator:
    """Return the random stream of a sensor's fixed pattern: a fresh one at its start, the same for the same serial."""
    return stream(sensor.serial, "sensor", "fixed_pattern", sensor.name)


def prnu_pattern(*, rows: int, cols: int, prnu_fraction: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the relative responsivity of each pixel, (rows, cols), mean 1, standard deviation `prnu_fraction`, >= 0.

    It multiplies the photo-electrons only: dark current and offsets do not pass the filters and lenses it comes from.

    References
    ----------
    emva1288, photo response non-uniformity.
    """
    if prnu_fraction == 0:
        return np.ones((rows, cols))
    return np.maximum(1.0 + prnu_fraction * rng.standard_normal((rows, cols)), 0.0)


def dsnu_pattern_v(*, rows: int, cols: int, dsnu_v: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the dark offset of each pixel before the analog gain, (rows, cols) [V], mean 0, standard deviation `dsnu_v`.

    Independent of the exposure time.

    References
    ----------
    emva1288, dark signal non-uniformity.
    """
    return dsnu_v * rng.standard_normal((rows, cols))
