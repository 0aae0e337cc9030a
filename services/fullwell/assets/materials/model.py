"""A material of the catalogue: spectra from 380 to 1000 nm, and the surface model that they go into."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fullwell.radiometry.spectrum import Spectrum

__all__ = ["Lamp", "MaterialKind", "SpectralMaterial"]

MaterialKind = Literal["diffuse", "translucent", "coated", "metal", "glass", "mirror"]
"""Lambertian; thin sheet that is so on both sides; diffuse base under a clear GGX coat; conductor with complex index;
clear dielectric body; ideal mirror."""


@dataclass(frozen=True, slots=True, eq=False)
class Lamp:
    """Emission of a lit part: typical luminance [cd m^-2], its range, relative spectrum, and the light group it belongs to."""

    luminance_cd_m2: float
    range_cd_m2: tuple[float, float]
    spd: Spectrum
    group: str


@dataclass(frozen=True, slots=True, eq=False)
class SpectralMaterial:
    """One entry of the catalogue.

    Attributes
    ----------
    name, title
        Like "paint/red"; for people.
    kind
        Surface model; decides which of the following are used.
    reflectance
        Of the base (diffuse, translucent, coated) or the mirror; valid 380 to 1000 nm, in [0, 1].
    transmittance
        Of a translucent sheet; with the reflectance at most 1.
    roughness
        GGX alpha of coat, metal or glass; 0 is polished.
    interior_index
        Of coat or glass.
    eta, k
        Complex index, metals.
    lamp
        Where the part can be lit. Unlit, it looks as the rest says.
    basis
        "measured": published measurement; "model": computed from measured constituents; "typical": shaped after published
        measurements of the kind.
    source
        Where the figures are from, with enough to find it.
    tags
        Words to search by.
    retroreflective
        Returns headlight to its source in truth; rendered as the diffuse base until the renderer has a lobe for it.
    """

    name: str
    title: str
    kind: MaterialKind
    basis: Literal["measured", "model", "typical"]
    source: str
    reflectance: Spectrum | None = None
    roughness: float = 0.0
    interior_index: float = 1.5
    eta: Spectrum | None = None
    k: Spectrum | None = None
    lamp: Lamp | None = None
    tags: tuple[str, ...] = ()
    retroreflective: bool = False
    transmittance: Spectrum | None = None
