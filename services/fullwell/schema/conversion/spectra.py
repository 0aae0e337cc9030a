"""Spectra of a recipe to `Spectrum`, checked in their ranges."""

from __future__ import annotations

from typing import Any

import numpy as np

from fullwell.radiometry import (
    Spectrum,
    coverage_note,
    illuminant,
    reflectance,
    reflectance_from_srgb,
    scale_to_flux,
    scale_to_illuminance,
    scale_to_luminance,
)
from fullwell.schema.conversion.context import Context, fail, located
from fullwell.schema.v1.spectra import NamedSpectrum, SpectrumTable, SrgbColour

__all__ = ["absolute", "colour_of", "luminous", "reflectance_of", "spd_of"]

_RELATIVE = "relative"
_ROUNDING = 1e-9
"""Reflectances may exceed their range by the rounding of a scale factor; they are clipped then."""


def reflectance_of(given: Any, path: str, context: Context) -> Spectrum:
    """Return a reflectance or transmittance, in [0, 1] everywhere."""
    match given:
        case float() | int():
            spectrum = Spectrum.constant(float(given))
        case str() if given.startswith("#"):
            channels = [int(given[start : start + 2], 16) / 255 for start in (1, 3, 5)]
            spectrum = colour_of((channels[0], channels[1], channels[2]), path, context)
        case SrgbColour():
            spectrum = colour_of(given.srgb, path, context)
        case NamedSpectrum():
            with located(path):
                spectrum = reflectance(given.name, path=f"{path}.name").scaled(given.scale)
        case SpectrumTable():
            spectrum = _table(given, outside="hold", unit="1")
        case _:
            with located(path):
                spectrum = reflectance(given, path=path)
    return _within_one(spectrum, path)


def colour_of(rgb: tuple[float, float, float], path: str, context: Context) -> Spectrum:
    """Return the upsampled reflectance of an sRGB colour, and warn that it is one."""
    note = "is an sRGB colour: its spectrum is made up, right for the eye under daylight only."
    if context.grid.edges_nm[-1] > 780.0:
        note += " Beyond 780 nm it means nothing."
    context.warn_of(path, note)
    if rgb not in context.upsampled:
        with located(path):
            context.upsampled[rgb] = reflectance_from_srgb(rgb, path)
    return context.upsampled[rgb]


def _table(table: SpectrumTable, *, outside: Any, unit: str) -> Spectrum:
    source = table.source or "recipe"
    return Spectrum(np.array(table.wavelength_nm), np.array(table.values), outside=outside, unit=unit, source=source)


def _within_one(spectrum: Spectrum, path: str) -> Spectrum:
    values = spectrum.values
    wrong = np.flatnonzero((values < -_ROUNDING) | (values > 1 + _ROUNDING))
    if wrong.size:
        first = int(wrong[0])
        value, where = float(values[first]), f" at {spectrum.wavelength_nm[first]:g} nm" if values.size > 1 else ""
        fail(path, f"is {value:g}{where}; must be >= 0 and <= 1 at every wavelength.", value)
    if np.all((values >= 0) & (values <= 1)):
        return spectrum
    clipped = np.clip(values, 0.0, 1.0)
    return Spectrum(spectrum.wavelength_nm, clipped, spectrum.outside, spectrum.unit, spectrum.source, spectrum.upsampled)


def _not_negative(spectrum: Spectrum, path: str) -> Spectrum:
    wrong = np.flatnonzero(spectrum.values < 0)
    if wrong.size:
        value, wavelength_nm = float(spectrum.values[wrong[0]]), float(spectrum.wavelength_nm[wrong[0]])
        fail(path, f"is {value:g} at {wavelength_nm:g} nm; must be >= 0 at every wavelength.", value)
    return spectrum


def spd_of(given: Any, path: str, context: Context) -> Spectrum:
    """Return a relative spectral power, >= 0."""
    match given:
        case float() | int():
            if not given > 0:
                fail(path, f"is {given:g}; a relative spectrum must be > 0.", given)
            spectrum = illuminant("E").scaled(float(given) / 100.0)
        case SpectrumTable():
            spectrum = _table(given, outside="zero", unit=_RELATIVE)
        case _:
            with located(path):
                spectrum = illuminant(given, path=path)
    if note := coverage_note(spectrum, context.grid):
        context.warn(f"{path}: {note}")
    return _not_negative(spectrum, path)


def absolute(given: Any, path: str, unit: str, context: Context) -> Spectrum:
    """Return an absolute spectral quantity in `unit`, >= 0: a constant, or a table that is 0 outside."""
    if isinstance(given, SpectrumTable):
        spectrum = _table(given, outside="zero", unit=unit)
        if note := coverage_note(spectrum, context.grid):
            context.warn(f"{path}: {note}")
        return _not_negative(spectrum, path)
    return Spectrum.constant(float(given), unit=unit, source="recipe")


def luminous(document: Any, quantity: str, path: str, unit: str, context: Context, *, per: float = 1.0) -> Spectrum:
    """Return the spectrum of `document.spd` whose photometric integral is `document.<quantity>` / `per`, in `unit`."""
    spd = spd_of(document.spd, f"{path}.spd", context)
    wanted = float(getattr(document, quantity)) / per
    scale = {"luminous_flux_lm": scale_to_flux, "illuminance_lux": scale_to_illuminance}.get(quantity, scale_to_luminance)
    with located(f"{path}.spd"):
        return scale(spd, wanted).scaled(1.0, unit=unit)
