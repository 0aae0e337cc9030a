"""Materials."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from fullwell.schema.v1.common import _EXPONENT_NUMBER, Document, Fraction, Group, NonNegative, Range, Text, exactly_one, refuse
from fullwell.schema.v1.spectra import Quantity, Reflectance, Spd, SpectrumTable

__all__ = ["AbbeIndex", "MaterialDocument", "MaterialReference"]

_Index = Annotated[float, Range(ge=1, le=5)]
_Alpha = Annotated[float, Range(gt=0, le=1)]


class DiffuseMaterial(Document):
    """Lambertian, two-sided."""

    kind: Literal["diffuse"]
    reflectance: Reflectance


class TranslucentMaterial(Document):
    """A thin sheet such as a leaf, Lambertian on both sides; reflectance + transmittance <= 1 at every wavelength."""

    kind: Literal["translucent"]
    reflectance: Reflectance
    transmittance: Reflectance


class RoughPlasticMaterial(Document):
    """Diffuse base under a rough clear coat; `roughness` is the GGX alpha."""

    kind: Literal["rough_plastic"]
    reflectance: Reflectance
    roughness: _Alpha = 0.1
    interior_index: _Index = 1.5


class PrincipledMaterial(Document):
    """The metallic-roughness model of asset formats."""

    kind: Literal["principled"]
    base_color: Reflectance
    roughness: _Alpha = 0.5
    metallic: Fraction = 0.0
    specular: Fraction = 0.5


class ConductorMaterial(Document):
    """Metal: `metal` by catalogue name, or the complex index eta + i k as constants or tables."""

    kind: Literal["conductor"]
    metal: Text | None = None
    eta: Quantity | None = None
    k: Quantity | None = None
    roughness: Fraction = 0.0

    @model_validator(mode="after")
    def _one_source(self) -> ConductorMaterial:
        if self.metal is None and (self.eta is None or self.k is None):
            refuse("needs metal (a catalogue name), or both eta and k.")
        if self.metal is not None and (self.eta is not None or self.k is not None):
            refuse("is given together with eta or k; give metal, or both eta and k.", "metal", value=self.metal)
        return self


class AbbeIndex(Document):
    """An index over wavelength by Cauchy's formula: `n_d` at 587.56 nm, and the Abbe number."""

    n_d: _Index
    abbe: Annotated[float, Range(ge=10, le=200)]


def _index_form(value: Any) -> str | None:
    if isinstance(value, str):
        return "number" if _EXPONENT_NUMBER.fullmatch(value) else "name"
    if isinstance(value, dict | AbbeIndex):
        return "cauchy"
    return "number"


_RefractiveIndex = Annotated[
    Annotated[_Index, Tag("number")] | Annotated[Text, Tag("name")] | Annotated[AbbeIndex, Tag("cauchy")],
    Discriminator(_index_form),
]
"""One number, the name of a glass ("glass:N-BK7"), or {n_d, abbe}: the last two disperse."""


class DielectricMaterial(Document):
    """Clear refracting body such as glass or water."""

    kind: Literal["dielectric"]
    interior_index: _RefractiveIndex = 1.5046
    exterior_index: _Index = 1.000277
    roughness: Fraction = 0.0


class MirrorMaterial(Document):
    """Ideal mirror."""

    kind: Literal["mirror"]
    reflectance: Reflectance = 1.0


class EmissiveMaterial(Document):
    """A surface that emits on the side of its normal: exactly one of the two quantities; `luminance_cd_m2` needs `spd`."""

    kind: Literal["emissive"]
    radiance_w_sr_m2_nm: Quantity | None = None
    luminance_cd_m2: NonNegative | None = None
    spd: Spd | None = None
    group: Group = "default"
    reflectance: Reflectance = 0.0

    @model_validator(mode="after")
    def _one_quantity(self) -> EmissiveMaterial:
        check_spd(self, exactly_one(self, "radiance_w_sr_m2_nm", "luminance_cd_m2"))
        return self


def check_spd(document: Any, quantity: str) -> None:
    """Refuse a photometric quantity without `spd`, and a radiometric one with it."""
    radiometric = quantity.endswith("_nm")
    if radiometric and document.spd is not None:
        refuse(f"is given together with {quantity}, which holds the spectrum already; remove one of them.", "spd")
    if radiometric:
        spectrum = getattr(document, quantity)
        for position, value in enumerate(spectrum.values if isinstance(spectrum, SpectrumTable) else []):
            if value < 0:
                refuse(f"is {value:g}; must be >= 0.", quantity, "values", position, value=value)
    elif document.spd is None:
        refuse(f"is missing; {quantity} needs the light's relative spectrum, for example spd: d65.", "spd")


MaterialDocument = Annotated[
    DiffuseMaterial
    | TranslucentMaterial
    | RoughPlasticMaterial
    | PrincipledMaterial
    | ConductorMaterial
    | DielectricMaterial
    | MirrorMaterial
    | EmissiveMaterial,
    Field(discriminator="kind"),
]


def _reference_form(value: Any) -> str:
    return "name" if isinstance(value, str) else "inline"


MaterialReference = Annotated[
    Annotated[Text, Tag("name")] | Annotated[MaterialDocument, Tag("inline")], Discriminator(_reference_form)
]
"""The name of an entry of ``scene.materials``, or a material written in place."""
