"""Luminance, illuminance, flux and colour of a spectrum for the CIE 1931 standard observer."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import LUMINOUS_EFFICACY_LM_PER_W
from fullwell.core.errors import FieldError
from fullwell.radiometry.spectrum import Spectrum
from fullwell.radiometry.tables import table_spectrum

__all__ = [
    "chromaticity",
    "colour_matching_functions",
    "correlated_colour_temperature_k",
    "illuminance_lux",
    "luminance_cd_m2",
    "luminous_efficiency",
    "luminous_flux_lm",
    "scale_to_flux",
    "scale_to_illuminance",
    "scale_to_luminance",
    "tristimulus",
]

_OBSERVER_RANGE_NM = np.array([360.0, 830.0])


def luminous_efficiency() -> Spectrum:
    """Return the CIE 1924 photopic luminous efficiency V(lambda), 360-830 nm by 1 nm, 0 outside.

    Source: CIE 018:2019; the values of the CIE 1931 y colour matching function.
    """
    return table_spectrum("observer", "v_lambda", "zero", "1")


def colour_matching_functions() -> tuple[Spectrum, Spectrum, Spectrum]:
    """Return the CIE 1931 2-degree colour matching functions x, y, z, 360-830 nm by 1 nm, 0 outside."""
    x, y, z = (table_spectrum("observer", f"{axis}_bar", "zero", "1") for axis in "xyz")
    return x, y, z


def _photometric(spectrum: Spectrum) -> float:
    weighted = spectrum.integral_of_product(luminous_efficiency(), _OBSERVER_RANGE_NM)
    return LUMINOUS_EFFICACY_LM_PER_W * float(weighted[0])


def luminance_cd_m2(radiance: Spectrum) -> float:
    """Return the luminance [cd m^-2] of a spectral radiance [W sr^-1 m^-2 nm^-1].

    K_m times the integral of radiance and V(lambda), exact for piecewise linear curves (CIE 018:2019, eq. 2).
    """
    return _photometric(radiance)


def illuminance_lux(irradiance: Spectrum) -> float:
    """Return the illuminance [lx] of a spectral irradiance [W m^-2 nm^-1]."""
    return _photometric(irradiance)


def luminous_flux_lm(power: Spectrum) -> float:
    """Return the luminous flux [lm] of a spectral power [W nm^-1]."""
    return _photometric(power)


def _scaled_to(spectrum: Spectrum, wanted: float, *, field: str, unit: str) -> Spectrum:
    if not 0 <= wanted < math.inf:
        raise FieldError(f"{field} is {wanted}; must be finite and >= 0.", path=field, value=wanted)
    present = _photometric(spectrum)
    if not present > 0:
        raise FieldError(
            f"the spectrum from {spectrum.source or 'the recipe'!r} has no luminance ({present:g}), so it cannot be scaled to "
            f"{field} = {wanted}; it must have power within 360 to 830 nm. Give its radiance in watts instead.",
            path=field,
            value=wanted,
        )
    return spectrum.scaled(wanted / present, unit=unit)


def scale_to_luminance(spd: Spectrum, cd_m2: float) -> Spectrum:
    """Return the spectral radiance [W sr^-1 m^-2 nm^-1] with the shape of `spd` and the luminance `cd_m2`.

    Raises FieldError where `cd_m2` is negative or not finite, or `spd` has no power that an eye sees.
    """
    return _scaled_to(spd, cd_m2, field="luminance_cd_m2", unit="W sr^-1 m^-2 nm^-1")


def scale_to_illuminance(spd: Spectrum, lux: float) -> Spectrum:
    """Return the spectral irradiance [W m^-2 nm^-1] with the shape of `spd` and the illuminance `lux`.

    Raises FieldError as `scale_to_luminance` does.
    """
    return _scaled_to(spd, lux, field="illuminance_lux", unit="W m^-2 nm^-1")


def scale_to_flux(spd: Spectrum, lumen: float) -> Spectrum:
    """Return the spectral power [W nm^-1] with the shape of `spd` and the luminous flux `lumen`.

    Raises FieldError as `scale_to_luminance` does.
    """
    return _scaled_to(spd, lumen, field="luminous_flux_lm", unit="W nm^-1")


def tristimulus(spectrum: Spectrum) -> NDArray[np.float64]:
    """Return CIE 1931 X, Y, Z, (3,), in photometric units: Y of a radiance is its luminance [cd m^-2]."""
    weights = [spectrum.integral_of_product(curve, _OBSERVER_RANGE_NM)[0] for curve in colour_matching_functions()]
    return LUMINOUS_EFFICACY_LM_PER_W * np.array(weights)


def chromaticity(spectrum: Spectrum) -> tuple[float, float]:
    """Return CIE 1931 chromaticity (x, y). Raises FieldError for a spectrum without light."""
    xyz = tristimulus(spectrum)
    total = float(xyz.sum())
    if not total > 0:
        raise FieldError("the spectrum has no light within 360 to 830 nm, so it has no chromaticity.")
    return float(xyz[0]) / total, float(xyz[1]) / total


def correlated_colour_temperature_k(spectrum: Spectrum) -> float:
    """Return the correlated colour temperature [K], within about 2 K for daylight and lamps from 3000 to 50000 K.

    References
    ----------
    McCamy 1992, Color Research and Application 17, 142: the cubic in (x - 0.3320) / (0.1858 - y). Coarse below 2500 K.
    """
    x, y = chromaticity(spectrum)
    slope = (x - 0.3320) / (0.1858 - y)
    return ((449.0 * slope + 3525.0) * slope + 6823.3) * slope + 5520.33
