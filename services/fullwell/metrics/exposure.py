"""Exposure value and photometric exposure."""

from __future__ import annotations

import math

from fullwell.core.errors import FieldError

__all__ = ["exposure_value", "exposure_value_at_iso_100", "photometric_exposure_lux_s"]


def exposure_value(*, f_number: float, exposure_time_s: float) -> float:
    """Return the exposure value of a camera setting, log2(N^2 / t); 0 at f/1 and 1 s. The sensitivity is left out.

    Raises FieldError for an f-number or a time that is not > 0 and finite.

    References
    ----------
    iso2720, section 3.
    """
    _check_positive("f_number", f_number)
    _check_positive("exposure_time_s", exposure_time_s)
    return 2.0 * math.log2(f_number) - math.log2(exposure_time_s)


def exposure_value_at_iso_100(*, f_number: float, exposure_time_s: float, iso_speed: float) -> float:
    """Return the exposure value that exposes alike at ISO 100: `exposure_value` less the stops of the sensitivity.

    Raises FieldError for a value that is not > 0 and finite.
    """
    _check_positive("iso_speed", iso_speed)
    return exposure_value(f_number=f_number, exposure_time_s=exposure_time_s) - math.log2(iso_speed / 100.0)


def photometric_exposure_lux_s(illuminance_lux: float, *, exposure_time_s: float) -> float:
    """Return the photometric exposure [lx s] of an image-plane illuminance [lx] over a time [s].

    Raises FieldError for a negative or infinite illuminance, or a time that is not > 0 and finite.
    """
    _check_positive("exposure_time_s", exposure_time_s)
    if not 0 <= illuminance_lux < math.inf:
        message = f"illuminance_lux is {illuminance_lux}; must be >= 0 and finite."
        raise FieldError(message, path="illuminance_lux", value=illuminance_lux)
    return illuminance_lux * exposure_time_s


def _check_positive(name: str, value: float) -> None:
    if not 0 < value < math.inf:
        raise FieldError(f"{name} is {value}; must be > 0 and finite.", path=name, value=value)
