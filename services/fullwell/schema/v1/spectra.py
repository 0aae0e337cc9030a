"""Spectra in a recipe: catalogue names, constants, wavelength tables and sRGB colours."""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from fullwell.schema.v1.common import _EXPONENT_NUMBER, Document, Number, Range, SrgbTriple, Text, refuse

__all__ = ["Colour", "NamedSpectrum", "Quantity", "Reflectance", "Spd", "SpectrumTable", "SrgbColour"]

_HEX_COLOUR = re.compile(r"#[0-9a-fA-F]{6}")
_WAVELENGTH = Range(ge=100, le=10000)


class SpectrumTable(Document):
    """Values at wavelengths [nm], linear between them; reflectances hold their end values, sources are 0 outside."""

    wavelength_nm: list[Annotated[float, _WAVELENGTH]] = Field(min_length=1, max_length=10000)
    values: list[Number] = Field(min_length=1, max_length=10000)
    source: Text | None = None

    @model_validator(mode="after")
    def _matching(self) -> SpectrumTable:
        if len(self.values) != len(self.wavelength_nm):
            refuse(f"has {len(self.values)} entries; must be as many as wavelength_nm: {len(self.wavelength_nm)}.", "values")
        for position, (low, high) in enumerate(zip(self.wavelength_nm, self.wavelength_nm[1:], strict=False), start=1):
            if not high > low:
                refuse(f"is {high:g}; must be > the wavelength before it, {low:g}.", "wavelength_nm", position, value=high)
        return self


class NamedSpectrum(Document):
    """A catalogue spectrum times a factor."""

    name: Text
    scale: Annotated[float, Range(ge=0)] = 1.0


class SrgbColour(Document):
    """An sRGB colour, each value from 0 to 1 (encoded, as in pictures); upsampled to a plausible spectrum and flagged."""

    srgb: SrgbTriple


def _form(value: Any) -> str | None:
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return "number"
    if isinstance(value, str):
        return "number" if _EXPONENT_NUMBER.fullmatch(value) else "name"
    if isinstance(value, SpectrumTable):
        return "table"
    if isinstance(value, NamedSpectrum):
        return "named"
    if isinstance(value, SrgbColour):
        return "srgb"
    if isinstance(value, dict):
        if "srgb" in value:
            return "srgb"
        return "named" if "name" in value else "table"
    return None


def _check_colour_text(value: Any) -> Any:
    if isinstance(value, str) and value.startswith("#") and not _HEX_COLOUR.fullmatch(value):
        refuse(f"is {value!r}; a colour is written '#rrggbb' with six hexadecimal digits.", value=value)
    return value


def _forms(words: str) -> Discriminator:
    return Discriminator(_form, custom_error_type="wrong_form", custom_error_message=f"must be {words}")


_Number = Annotated[Annotated[float, Range(ge=0)], Tag("number")]
_Name = Annotated[Annotated[Text, BeforeValidator(_check_colour_text)], Tag("name")]
_Table = Annotated[SpectrumTable, Tag("table")]
_Named = Annotated[NamedSpectrum, Tag("named")]
_Srgb = Annotated[SrgbColour, Tag("srgb")]

Reflectance = Annotated[
    _Number | _Name | _Table | _Named | _Srgb,
    _forms("a number from 0 to 1, a catalogue name, '#rrggbb', {wavelength_nm, values}, {name, scale} or {srgb}"),
]
"""Reflectance or transmittance in [0, 1]: constant, catalogue name, "#rrggbb", table, {name, scale} or {srgb}."""

Colour = Reflectance

Spd = Annotated[
    _Number | _Name | _Table,
    _forms("the name of an illuminant, 'blackbody:3000K', a number (equal energy) or {wavelength_nm, values}"),
]
"""Relative spectral power: catalogue name (also "blackbody:3000K"), table, or a number (equal energy)."""

Quantity = Annotated[_Number | _Table, _forms("a number or {wavelength_nm, values}")]
"""An absolute spectral quantity: the same at every wavelength, or a table."""
