"""Measured and uniform reflectances by name."""

from __future__ import annotations

from functools import cache

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.spectrum import Spectrum
from fullwell.radiometry.tables import table_names, table_spectrum

__all__ = ["COLORCHECKER_PATCHES", "reflectance", "reflectance_names"]

COLORCHECKER_PATCHES = (
    "dark_skin", "light_skin", "blue_sky", "foliage", "blue_flower", "bluish_green",
    "orange", "purplish_blue", "moderate_red", "purple", "yellow_green", "orange_yellow",
    "blue", "green", "red", "yellow", "magenta", "cyan",
    "white_9_5", "neutral_8", "neutral_6_5", "neutral_5", "neutral_3_5", "black_2",
)  # fmt: skip
"""The patches of the ColorChecker Classic, row by row from the top left; "colorchecker:1" is the first."""


def reflectance(name: str, path: str = "") -> Spectrum:
    """Return a reflectance in [0, 1]; beyond its table the end values hold.

    Parameters
    ----------
    name
        One of `reflectance_names()`, "colorchecker:1" to "colorchecker:24", or "grey:0.18" (also "gray:") with any value
        from 0 to 1. Case does not matter. ColorChecker: N. Ohta's measurement of 1997, 380-780 nm; "cornell:white", "red"
        and "green": the Cornell Box walls, 400-700 nm; "white" is 1 and "black" 0 at every wavelength.
    path
        The field that asked, for the error.

    Raises
    ------
    FieldError
        The name is not known (answered with the nearest) or the grey is outside 0 to 1.
    """
    text = str(name).strip()
    family, _, member = text.casefold().partition(":")
    if family in ("grey", "gray") and member:
        return _grey(member, text, path)
    canonical = _by_folded_name().get(text.casefold())
    if canonical is None:
        raise FieldError(unknown_name_message("reflectance", text, [*reflectance_names(), "grey:0.18"]), path=path, value=name)
    return _named(canonical)


def reflectance_names() -> tuple[str, ...]:
    """Return the names `reflectance` knows, beside the values of "grey:"."""
    patches = tuple(f"colorchecker:{patch}" for patch in COLORCHECKER_PATCHES)
    walls = tuple(f"cornell:{wall}" for wall in table_names("cornell"))
    return ("black", "white", *patches, *walls)


@cache
def _by_folded_name() -> dict[str, str]:
    known = {name.casefold(): name for name in reflectance_names()}
    known |= {f"colorchecker:{number}": f"colorchecker:{patch}" for number, patch in enumerate(COLORCHECKER_PATCHES, 1)}
    return known


@cache
def _named(canonical: str) -> Spectrum:
    if canonical in ("black", "white"):
        return Spectrum.constant(float(canonical == "white"), source=f"{canonical}, the same at every wavelength")
    file, _, member = canonical.partition(":")
    return table_spectrum(file, member, "hold", "1")


def _grey(member: str, name: str, path: str) -> Spectrum:
    try:
        value = float(member)
    except ValueError:
        value = float("nan")
    if not 0.0 <= value <= 1.0:
        raise FieldError(f"{name!r} must hold a reflectance from 0 to 1, for example grey:0.18.", path=path, value=name)
    return Spectrum.constant(value, source=f"grey, {value:g} at every wavelength")
