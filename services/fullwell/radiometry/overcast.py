"""Skies that are no clear day: the CIE's overcast sky, and how much light is left after sunset."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["DARKEST_TWILIGHT_DEG", "overcast_illuminance_lux", "overcast_shares", "twilight_illuminance_lux"]

DARKEST_TWILIGHT_DEG = -18.0
"""Elevation of the sun at the end of astronomical twilight."""

_TWILIGHT_DEG = (-18.0, -12.0, -6.0)
_TWILIGHT_LUX = (6e-4, 8e-3, 2.7)
"""At the ends of astronomical, nautical and civil twilight under a clear sky; the last is the middle of 2 to 3.5 lx."""


def overcast_shares(rows: int) -> NDArray[np.float64]:
    """Return (rows,) luminances of the CIE overcast sky over that of its zenith, row 0 at the zenith, 0 below the horizon.

    (1 + 2 sin elevation) / 3 [Moon and Spencer 1942; ISO 15469, sky 16]. Level ground gets 7 pi / 9 times the zenith.
    """
    elevation = np.pi / 2 - (np.arange(rows) + 0.5) * np.pi / rows
    return np.where(elevation > 0, (1.0 + 2.0 * np.sin(elevation)) / 3.0, 0.0)


def overcast_illuminance_lux(sun_elevation_deg: float) -> float:
    """Return the illuminance [lx] of level ground under an overcast sky, by the sun's elevation above it, 0 to 90 degrees.

    300 + 21 000 sin elevation: the mean of overcast skies [Krochmann and Seidl 1974].
    """
    return 300.0 + 21_000.0 * math.sin(math.radians(sun_elevation_deg))


def twilight_illuminance_lux(sun_elevation_deg: float, *, at_sunset_lux: float) -> float:
    """Return the illuminance [lx] of level ground under a clear sky with the sun 0 to 18 degrees below the horizon.

    Smooth and falling in its logarithm, from `at_sunset_lux` with the sun on the horizon through the values that the Glossary
    of Meteorology gives for the ends of the three twilights. Without moon, stars and lights of towns.
    """
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - slow to load

    lux = (*_TWILIGHT_LUX, at_sunset_lux)
    curve = PchipInterpolator((*_TWILIGHT_DEG, 0.0), np.log(lux))
    return float(np.exp(curve(np.clip(sun_elevation_deg, DARKEST_TWILIGHT_DEG, 0.0))))
