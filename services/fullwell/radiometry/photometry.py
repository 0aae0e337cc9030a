"""Luminance, illuminance, flux and colour of a spectrum for the CIE 1931 standard observer."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import LUMINOUS_EFFICACY_LM_PER_W
from fullwell.core.errors import FieldError
from fullwell.radiometry.illuminants import planck_radiance
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

_FARTHEST_UV = 0.05
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
    """Return the correlated colour temperature [K] of light between 1000 and 100000 K, to 1e-4.

    The temperature whose blackbody is nearest in the CIE 1960 (u, v) diagram. Raises FieldError where that is beyond those
    limits, or farther than 0.05 away, where the CIE no longer speaks of a colour temperature.

    References
    ----------
    CIE 15:2004, section 9.5.
    """
    xyz = tristimulus(spectrum)
    if not xyz.sum() > 0:
        raise FieldError("the spectrum has no light within 360 to 830 nm, so it has no colour temperature.")
    u, v = _uv_1960(xyz)
    mired, locus_u, locus_v = _planckian_locus()
    squared = (locus_u - u) ** 2 + (locus_v - v) ** 2
    nearest = int(np.argmin(squared))
    if nearest in (0, mired.size - 1) or squared[nearest] > _FARTHEST_UV**2:
        raise FieldError("the light is too far from any blackbody of 1000 to 100000 K to have a colour temperature.")
    before, here, after = squared[nearest - 1 : nearest + 2]
    # The squared distance is a parabola in mired to far better than the grid's step.
    offset = 0.5 * (before - after) / (before - 2.0 * here + after)
    return float(1e6 / (mired[nearest] + offset * (mired[1] - mired[0])))


def _uv_1960(xyz: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, y, z = xyz
    divisor = x + 15.0 * y + 3.0 * z
    return 4.0 * x / divisor, 6.0 * y / divisor


@cache
def _planckian_locus() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return mired (n,) from 10 to 1000 and the locus' u and v (n,)."""
    mired = np.arange(9.0, 1001.5, 1.0)
    curves = colour_matching_functions()
    wavelength_nm = curves[0].wavelength_nm
    radiance = np.stack([planck_radiance(wavelength_nm, 1e6 / step) for step in mired])
    u, v = _uv_1960(np.stack([radiance @ curve.values for curve in curves]))
    return mired, u, v
