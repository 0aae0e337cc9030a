"""Relative spectral power of standard illuminants, blackbodies and daylight of any temperature."""

from __future__ import annotations

import math
import re
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.constants import BOLTZMANN_J_PER_K, NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.grid import WavelengthGrid
from fullwell.radiometry.spectrum import Spectrum
from fullwell.radiometry.tables import table_names, table_spectrum

__all__ = [
    "blackbody",
    "coverage_note",
    "daylight",
    "illuminant",
    "illuminant_names",
    "planck_radiance",
]

BLACKBODY_RANGE_K = (500.0, 25000.0)
DAYLIGHT_RANGE_K = (4000.0, 25000.0)
_RELATIVE = "relative"
_NORMALISED_AT_NM = 560.0
_PATTERN = re.compile(r"(blackbody|daylight):\s*([0-9.eE+-]+)\s*k?", re.IGNORECASE)

# Closed forms are tabulated this finely: linear interpolation of a 3000 K blackbody is then right to 1e-5 at 400 nm.
_CLOSED_FORM_NM = np.arange(300.0, 1100.25, 0.5)


def planck_radiance(wavelength_nm: ArrayLike, temperature_k: float) -> NDArray[np.float64]:
    """Return a blackbody's spectral radiance in vacuum [W sr^-1 m^-2 nm^-1], same shape as `wavelength_nm`.

    Raises FieldError where the temperature or a wavelength is not finite and > 0. Uses 2 h c^2 / lambda^5 /
    (exp(h c / lambda k T) - 1) with the exact constants of the SI (CODATA 2019).
    """
    if not 0 < temperature_k < math.inf:
        raise FieldError(
            f"temperature_k is {temperature_k}; must be finite and > 0.", path="temperature_k", value=temperature_k
        )
    wavelength_m = np.asarray(wavelength_nm, dtype=np.float64) / NM_PER_M
    if not np.all(np.isfinite(wavelength_m)) or np.any(wavelength_m <= 0):
        raise FieldError("wavelength_nm must be finite and > 0 everywhere.", path="wavelength_nm")
    exponent = PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S / (wavelength_m * BOLTZMANN_J_PER_K * temperature_k)
    per_metre = 2.0 * PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S**2 / wavelength_m**5
    # exp(-x) / (1 - exp(-x)) instead of 1 / (exp(x) - 1): no overflow for cold or short-wave corners.
    return np.asarray(per_metre * np.exp(-exponent) / -np.expm1(-exponent) / NM_PER_M)


def blackbody(temperature_k: float, *, path: str = "") -> Spectrum:
    """Return a blackbody's relative power, 300-1100 nm, 100 at 560 nm, for 500 to 25000 K."""
    _check_temperature("blackbody", temperature_k, BLACKBODY_RANGE_K, path)
    values = planck_radiance(_CLOSED_FORM_NM, temperature_k) / planck_radiance(_NORMALISED_AT_NM, temperature_k)
    source = f"Planck's law at {temperature_k:g} K (CODATA 2019)"
    return Spectrum(_CLOSED_FORM_NM, 100.0 * values, outside="zero", unit=_RELATIVE, source=source)


def daylight(temperature_k: float, *, path: str = "") -> Spectrum:
    """Return daylight of a correlated colour temperature, 300-830 nm by 5 nm, 100 at 560 nm, for 4000 to 25000 K.

    The named D65 is daylight(6504), because c2 in Planck's law was revised after D65 was defined.

    References
    ----------
    CIE 15:2004, section 3.1, eqs. 3.1 to 3.5.
    """
    _check_temperature("daylight", temperature_k, DAYLIGHT_RANGE_K, path)
    inverse = 1e3 / temperature_k
    if temperature_k <= 7000.0:
        x = ((-4.6070 * inverse + 2.9678) * inverse + 0.09911) * inverse + 0.244063
    else:
        x = ((-2.0064 * inverse + 1.9018) * inverse + 0.24748) * inverse + 0.237040
    y = (-3.000 * x + 2.870) * x - 0.275
    divisor = 0.0241 + 0.2562 * x - 0.7341 * y
    first = (-1.3515 - 1.7703 * x + 5.9114 * y) / divisor
    second = (0.0300 - 31.4424 * x + 30.0717 * y) / divisor
    mean, red_blue, green = (table_spectrum("daylight_basis", name, "zero", _RELATIVE) for name in ("S0", "S1", "S2"))
    values = mean.values + first * red_blue.values + second * green.values
    source = f"CIE daylight at {temperature_k:g} K (CIE 15:2004, 3.1)"
    return Spectrum(mean.wavelength_nm, np.maximum(values, 0.0), outside="zero", unit=_RELATIVE, source=source)


def illuminant(name: str, path: str = "") -> Spectrum:
    """Return the relative spectral power of a named illuminant; 0 outside its table.

    Parameters
    ----------
    name
        One of `illuminant_names()`, "blackbody:3000K" (500 to 25000 K) or "daylight:5600K" (4000 to 25000 K); case does
        not matter and F1 is FL1.
    path
        The field that asked, for the error.

    Returns
    -------
    100 at 560 nm for A, C, D, E, blackbodies and daylight; lamps keep the scale of their publication. Closed forms (A, E,
    blackbodies) reach 300-1100 nm; C ends at 780 nm, D at 830 nm and lamps at 380 and 780 nm: `coverage_note` tells
    whether a grid goes beyond.

    Raises
    ------
    FieldError
        The name is not known (answered with the nearest) or the temperature is out of range.
    """
    text = str(name).strip()
    if match := _PATTERN.fullmatch(text):
        make = blackbody if match[1].casefold() == "blackbody" else daylight
        return make(_temperature(match[2], text, path), path=path)
    known = _by_folded_name()
    canonical = known.get(text.casefold())
    if canonical is None:
        choices = (*illuminant_names(), "blackbody:3000K", "daylight:6504K")
        raise FieldError(unknown_name_message("illuminant", text, choices), path=path, value=name)
    return _named(canonical)


def illuminant_names() -> tuple[str, ...]:
    """Return the names `illuminant` knows, beside the temperatures of "blackbody:" and "daylight:"."""
    return ("A", "E", "cornell:light", *table_names("illuminants"))


def coverage_note(spectrum: Spectrum, grid: WavelengthGrid) -> str:
    """Return a sentence on bands of `grid` that a source's table does not cover and that are taken as dark, or ""."""
    first, last = float(spectrum.wavelength_nm[0]), float(spectrum.wavelength_nm[-1])
    low, high = float(grid.edges_nm[0]), float(grid.edges_nm[-1])
    if spectrum.outside == "hold" or (first <= low and last >= high):
        return ""
    return (
        f"{spectrum.source or 'the spectrum'} covers {first:g} to {last:g} nm, the grid {low:g} to {high:g} nm; beyond its "
        f"table the source is taken as dark."
    )


@cache
def _by_folded_name() -> dict[str, str]:
    known = {name.casefold(): name for name in illuminant_names()}
    known |= {f"f{number}": f"FL{number}" for number in range(1, 13)}
    return known


@cache
def _named(canonical: str) -> Spectrum:
    if canonical == "A":
        # CIE 15:2004, eq. 1: the constants are those of the definition, not today's c2.
        numerator = math.expm1(1.435e7 / (2848.0 * 560.0))
        values = 100.0 * (560.0 / _CLOSED_FORM_NM) ** 5 * numerator / np.expm1(1.435e7 / (2848.0 * _CLOSED_FORM_NM))
        return Spectrum(_CLOSED_FORM_NM, values, outside="zero", unit=_RELATIVE, source="CIE illuminant A (CIE 15:2004, eq. 1)")
    if canonical == "E":
        ends = _CLOSED_FORM_NM[[0, -1]]
        return Spectrum(ends, np.full(2, 100.0), outside="zero", unit=_RELATIVE, source="equal energy")
    if canonical == "cornell:light":
        # Four published points, 400 to 700 nm; relative.
        points = np.array([400.0, 500.0, 600.0, 700.0])
        source = "Cornell Box data, Cornell University Program of Computer Graphics, light source"
        return Spectrum(points, np.array([0.0, 8.0, 15.6, 18.4]), outside="zero", unit=_RELATIVE, source=source)
    return table_spectrum("illuminants", canonical, "zero", _RELATIVE)


def _temperature(text: str, name: str, path: str) -> float:
    try:
        return float(text)
    except ValueError:
        message = f"{name!r} holds no temperature; write it like blackbody:3000K or daylight:6504K."
        raise FieldError(message, path=path, value=name) from None


def _check_temperature(kind: str, temperature_k: float, legal: tuple[float, float], path: str) -> None:
    low, high = legal
    if not low <= temperature_k <= high:
        raise FieldError(
            f"{kind} temperature is {temperature_k:g} K; must be within {low:g} to {high:g} K. Write it like {kind}:5000K.",
            path=path,
            value=temperature_k,
        )
