"""ISETCam's constants, tables and spectral sums, for the compatibility mode (`model: isetcam`) and nothing else.

Everything is sampled at wavelengths, not averaged over bands; every integral is a rectangle sum. The source of each statement
is the description of ISETCam (Stanford University, MIT licence, 2021-06-05) in docs/validation/isetcam.md.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.constants import NM_PER_M
from fullwell.core.errors import FieldError, ShapeError, unknown_name_message
from fullwell.radiometry.illuminants import daylight
from fullwell.radiometry.photometry import colour_matching_functions, luminous_efficiency
from fullwell.radiometry.tables import table_spectrum

__all__ = [
    "DEFAULT_WAVELENGTH_NM",
    "ELEMENTARY_CHARGE_1986_C",
    "ILLUMINANTS",
    "LUMINOUS_EFFICACY_LM_PER_W",
    "PLANCK_1973_J_S",
    "SECOND_RADIATION_CONSTANT_M_K",
    "SPEED_OF_LIGHT_M_PER_S",
    "bin_width_nm",
    "blackbody_photons",
    "check_bands",
    "check_wavelengths",
    "display_primaries",
    "energy_to_photons",
    "illuminant_photons",
    "macbeth_reflectances",
    "observer_xyz",
    "photometric_sum",
    "photons_to_energy",
    "round_half_away",
    "sensor_curves",
]

PLANCK_1973_J_S: Final = 6.626176e-34
"""CODATA 1973, as ISETCam has it; 1.6e-5 above today's exact value."""

SECOND_RADIATION_CONSTANT_M_K: Final = 1.438786e-2
"""c2 of ISETCam's Planck's law, CODATA 1973 in seven digits: found from its blackbody to the last digit (scene_uniform.json).
It is not h c / k of the constants beside it, which is 2e-7 larger."""

ELEMENTARY_CHARGE_1986_C: Final = 1.602177e-19
"""Rounded CODATA 1986. It cancels: currents are made with it and divided by it."""

SPEED_OF_LIGHT_M_PER_S: Final = 2.99792458e8
LUMINOUS_EFFICACY_LM_PER_W: Final = 683.0

DEFAULT_WAVELENGTH_NM: Final = tuple(range(400, 701, 10))

ILLUMINANTS: Final = ("D50", "D65", "D75", "Tungsten", "Fluorescent", "A", "equal energy", "equal photons")

_DAYLIGHT_K: Final = {"D50": 5000.0, "D65": 6500.0, "D75": 7500.0}
"""ISETCam's daylights are the CIE's components at the nominal temperature, not at the one D65 is defined for (6504 K)."""

_SENSOR_TABLES: Final = {"default": "filter", "imx363": "imx363", "mt9v024": "mt9v024"}


def check_wavelengths(wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return wavelengths (bands,) [nm]. Raises FieldError unless they are finite, > 0 and strictly increasing."""
    wave = np.atleast_1d(np.asarray(wavelength_nm, dtype=np.float64))
    if wave.ndim != 1 or wave.size == 0 or not np.all(np.isfinite(wave)) or wave[0] <= 0 or np.any(np.diff(wave) <= 0):
        raise FieldError(
            "wavelength_nm must be (bands,), finite, > 0 and strictly increasing. Sort the wavelengths.", path="wavelength_nm"
        )
    return wave


def bin_width_nm(wavelength_nm: ArrayLike) -> float:
    """Return the width of every bin [nm]: the first spacing; 1 nm where there is one wavelength only."""
    wave = check_wavelengths(wavelength_nm)
    return float(wave[1] - wave[0]) if wave.size > 1 else 1.0


def photons_to_energy(photons: ArrayLike, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return joules for photons (..., bands), with the constants of 1973."""
    wave = check_wavelengths(wavelength_nm)
    return np.asarray(np.asarray(photons) * (PLANCK_1973_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M / wave))


def energy_to_photons(energy: ArrayLike, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return photons for joules (..., bands), with the constants of 1973."""
    wave = check_wavelengths(wavelength_nm)
    return np.asarray(np.asarray(energy) * (wave / (PLANCK_1973_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M)))


def observer_xyz(wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return the CIE 1931 colour matching functions sampled at the wavelengths, (bands, 3), 0 outside 360 to 830 nm."""
    wave = check_wavelengths(wavelength_nm)
    return np.stack([curve.at(wave) for curve in colour_matching_functions()], axis=1)


def photometric_sum(photons: ArrayLike, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return luminance [cd m^-2] or illuminance [lx] of photon radiance or irradiance (..., bands): 683 sum(E V) bin width."""
    wave = check_wavelengths(wavelength_nm)
    weights = luminous_efficiency().at(wave)
    total = photons_to_energy(photons, wave) @ weights
    return np.asarray(LUMINOUS_EFFICACY_LM_PER_W * total * bin_width_nm(wave))


def blackbody_photons(temperature_k: float, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return a blackbody's relative photon radiance (bands,), by Planck's law with ISETCam's c2."""
    if not 0 < temperature_k < np.inf:
        raise FieldError(
            f"temperature_k is {temperature_k}; must be > 0 and finite. Set the blackbody's temperature.",
            path="temperature_k",
            value=temperature_k,
        )
    wave = check_wavelengths(wavelength_nm)
    wave_m = wave / NM_PER_M
    exponent = SECOND_RADIATION_CONSTANT_M_K / (wave_m * temperature_k)
    if np.any(exponent > _LARGEST_EXPONENT):
        raise FieldError(
            f"temperature_k is {temperature_k}; a blackbody this cold has no light at {wave[0]:g} nm in double precision. "
            "Raise it.",
            path="temperature_k",
            value=temperature_k,
        )
    shortest = wave_m[0]
    return energy_to_photons((shortest / wave_m) ** 5 / np.expm1(exponent), wave)


_LARGEST_EXPONENT: Final = 700.0
"""exp() of more overflows; ISETCam gives 0 / Inf there."""


def illuminant_photons(name: str, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return the relative photons of one of ISETCam's illuminants at the wavelengths, (bands,).

    Parameters
    ----------
    name
        One of `ILLUMINANTS` or "blackbody:3200"; case does not matter.
    wavelength_nm
        (bands,) [nm]. "Tungsten", "Fluorescent" and "A" are carried from 400 to 700 nm, daylights from 300 to 830 nm.

    Raises
    ------
    FieldError
        The name is not known, or a wavelength lies outside the table.
    """
    wave = check_wavelengths(wavelength_nm)
    folded = name.strip().casefold()
    if folded.startswith("blackbody:"):
        return blackbody_photons(_temperature(folded), wave)
    known = {known_name.casefold(): known_name for known_name in ILLUMINANTS}
    if folded not in known:
        message = unknown_name_message("ISETCam illuminant", name, (*ILLUMINANTS, "blackbody:3200"))
        raise FieldError(message, path="illuminant", value=name)
    canonical = known[folded]
    if canonical == "equal photons":
        return np.ones(wave.size)
    if canonical == "equal energy":
        return energy_to_photons(np.ones(wave.size), wave)
    if canonical in _DAYLIGHT_K:
        knots = np.arange(300.0, 831.0, 10.0)  # ISETCam's table has 10 nm, linear between
        _check_covered(canonical, wave, knots[0], knots[-1])
        return energy_to_photons(np.interp(wave, knots, daylight(_DAYLIGHT_K[canonical]).at(knots)), wave)
    return energy_to_photons(_covered("illuminant_a" if canonical == "A" else folded, wave), wave)


def macbeth_reflectances(wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return the reflectances of the 24 patches, row by row from the top left, (24, bands).

    Carried from 400 to 700 nm by 10 nm; linear between. Raises FieldError outside.
    """
    wave = check_wavelengths(wavelength_nm)
    # The table runs down the columns of the chart, 4 patches each.
    return np.stack([_covered(f"macbeth_{4 * column + row + 1}", wave) for row in range(4) for column in range(6)])


def sensor_curves(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return ISETCam's quantum efficiencies r, g, b of a sensor: wavelengths (n,) [nm] and (n, 3) [e- per photon].

    `name` is "default" (the filters of the default Bayer sensor), "imx363" or "mt9v024". Raises FieldError otherwise.
    """
    folded = name.casefold()
    if folded not in _SENSOR_TABLES:
        raise FieldError(unknown_name_message("ISETCam sensor", name, _SENSOR_TABLES), path="name", value=name)
    curves = [table_spectrum("isetcam", f"{_SENSOR_TABLES[folded]}_{c}", "zero", "e- photon^-1") for c in "rgb"]
    return curves[0].wavelength_nm, np.stack([curve.values for curve in curves], axis=1)


def display_primaries(wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Return the spectral radiance of the example LCD's primaries r, g, b, (bands, 3) [W sr^-1 m^-2 nm^-1]."""
    wave = check_wavelengths(wavelength_nm)
    return np.stack([_covered(f"lcd_{c}", wave) for c in "rgb"], axis=1)


def round_half_away(value: ArrayLike) -> NDArray[np.float64]:
    """Return whole numbers, halves away from zero, as the language ISETCam is written in rounds."""
    number = np.asarray(value, dtype=np.float64)
    whole = np.trunc(number)
    return np.asarray(whole + np.where(np.abs(number - whole) >= 0.5, np.sign(number), 0.0))


def _temperature(name: str) -> float:
    try:
        return float(name.removeprefix("blackbody:").removesuffix("k"))
    except ValueError:
        message = f"{name!r} holds no temperature; write it like blackbody:3200."
        raise FieldError(message, path="illuminant", value=name) from None


def _covered(table: str, wave: NDArray[np.float64]) -> NDArray[np.float64]:
    curve = table_spectrum("isetcam", table, "hold", "relative")
    _check_covered(table, wave, float(curve.wavelength_nm[0]), float(curve.wavelength_nm[-1]))
    return curve.at(wave)


def _check_covered(table: str, wave: NDArray[np.float64], first_nm: float, last_nm: float) -> None:
    if wave[0] < first_nm or wave[-1] > last_nm:
        raise FieldError(
            f"wavelength_nm runs from {wave[0]:g} to {wave[-1]:g} nm; ISETCam's table {table!r} runs from {first_nm:g} to "
            f"{last_nm:g} nm. Choose wavelengths within it or give photons of your own.",
            path="wavelength_nm",
            value=float(wave[0]),
        )


def check_bands(values: NDArray[np.float64], wavelength_nm: NDArray[np.float64], name: str) -> None:
    """Raise ShapeError unless the last axis of `values` runs over the wavelengths."""
    if values.ndim == 0 or values.shape[-1] != wavelength_nm.size:
        raise ShapeError(f"{name} has shape {values.shape}; its last axis must be ({wavelength_nm.size},).")
