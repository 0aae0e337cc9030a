"""Where the sun stands."""

from __future__ import annotations

import math
from datetime import UTC, datetime

__all__ = ["sun_angles_deg"]

_J2000 = datetime(2000, 1, 1, 12, tzinfo=UTC)


def sun_angles_deg(time: datetime, *, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
    """Return elevation and azimuth (clockwise from north) of the sun [deg], without refraction.

    Good to 0.01 deg from 1950 to 2050. `time` must know its time zone; longitude is positive eastwards.

    References
    ----------
    Michalsky 1988, Solar Energy 40, 227 (the Astronomical Almanac's low-precision formulas).
    """
    days = (time - _J2000).total_seconds() / 86400.0
    mean_longitude = 280.460 + 0.9856474 * days
    anomaly = math.radians(357.528 + 0.9856003 * days)
    ecliptic = math.radians(mean_longitude + 1.915 * math.sin(anomaly) + 0.020 * math.sin(2 * anomaly))
    obliquity = math.radians(23.439 - 4e-7 * days)
    right_ascension = math.atan2(math.cos(obliquity) * math.sin(ecliptic), math.cos(ecliptic))
    declination = math.asin(math.sin(obliquity) * math.sin(ecliptic))
    utc = time.astimezone(UTC)
    hour = utc.hour + utc.minute / 60 + (utc.second + utc.microsecond * 1e-6) / 3600
    sidereal_h = 6.697375 + 0.0657098242 * days + hour
    hour_angle = math.radians(15.0 * sidereal_h + longitude_deg) - right_ascension
    latitude = math.radians(latitude_deg)
    up = math.sin(declination) * math.sin(latitude) + math.cos(declination) * math.cos(latitude) * math.cos(hour_angle)
    east = -math.cos(declination) * math.sin(hour_angle)
    north = math.sin(declination) * math.cos(latitude) - math.cos(declination) * math.sin(latitude) * math.cos(hour_angle)
    elevation_deg = math.degrees(math.asin(max(-1.0, min(1.0, up))))
    return elevation_deg, math.degrees(math.atan2(east, north)) % 360.0
