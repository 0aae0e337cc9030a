"""Metals by complex index, the mirror, and glass."""

from __future__ import annotations

from typing import Final

import numpy as np

from fullwell.assets.materials.curves import WAVELENGTH_NM, reflectance_spectrum
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.materials.pigments import PIGMENT_SOURCE, mixture_reflectance
from fullwell.assets.materials.tables import material_table, typical_reflectance
from fullwell.radiometry.metals import metal, metal_names, normal_reflectance
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["metal_materials"]

SODA_LIME_INDEX: Final = 1.52

_METALS: Final = {
    "chrome": ("chromium", 0.02, "chrome plating, polished"),
    "aluminium": ("aluminium", 0.2, "aluminium, satin"),
    "rim_alloy": ("aluminium", 0.12, "wheel rim of aluminium alloy"),
    "steel": ("iron", 0.3, "steel, bare"),
    "steel_brushed": ("stainless_steel", 0.25, "stainless steel, brushed"),
    "copper": ("copper", 0.15, "copper, clean"),
    "brass": ("brass", 0.15, "brass"),
}
"""Name: whose index, GGX alpha, title."""

_COATED: Final = {
    "steel_galvanised": (0.35, "steel, galvanised, weathered"),
    "cast_iron": (0.4, "cast iron with its oxide scale"),
}
"""Metals that show their patina: a grey body that scatters, under some gloss."""


def metal_materials() -> tuple[SpectralMaterial, ...]:
    """Return metals, the mirror and glass."""
    return (
        *(_metal(name) for name in _METALS),
        *(_patinated(name) for name in _COATED),
        _rust(),
        _mirror(),
        _pane("glass/tinted", "tinted car pane seen from outside, a dark stand-in", 0.012, "grey glass before a dark cabin"),
        _pane("glass/window", "window pane seen from outside, a dark stand-in", 0.03, "glass before a dark room"),
        _clear_glass(),
    )


def _metal(name: str) -> SpectralMaterial:
    element, roughness, title = _METALS[name]
    eta, k = metal(element) if element in metal_names() else _own_metal(element)
    return SpectralMaterial(
        name=f"metal/{name}",
        title=title,
        kind="metal",
        basis="measured",
        source=eta.source,
        roughness=roughness,
        eta=eta,
        k=k,
        tags=("metal", *name.split("_")),
    )


def _own_metal(element: str) -> tuple[Spectrum, Spectrum]:
    table = material_table("metals")["metals"][element]
    wavelength_nm = np.array(table["wavelength_nm"], dtype=np.float64)
    eta, k = (
        Spectrum(wavelength_nm, np.array(table[column]), outside="hold", source=f"{column} of {element}: {table['source']}")
        for column in ("eta", "k")
    )
    return eta, k


def _patinated(name: str) -> SpectralMaterial:
    roughness, title = _COATED[name]
    values, source = typical_reflectance(f"metal/{name}")
    return SpectralMaterial(
        name=f"metal/{name}",
        title=title,
        kind="coated",
        basis="typical",
        source=source,
        reflectance=reflectance_spectrum(values, source),
        roughness=roughness,
        tags=("metal", *name.split("_")),
    )


def _rust() -> SpectralMaterial:
    values = mixture_reflectance({"iron_oxide_red": 0.6, "iron_oxide_yellow": 1.4, "carbon_black": 0.035})
    return SpectralMaterial(
        name="metal/rust",
        title="rust",
        kind="diffuse",
        basis="model",
        source=PIGMENT_SOURCE,
        reflectance=reflectance_spectrum(values, PIGMENT_SOURCE),
        tags=("metal", "rust", "rusty"),
    )


def _mirror() -> SpectralMaterial:
    eta, k = metal("silver")
    values = normal_reflectance(eta.at(WAVELENGTH_NM), k.at(WAVELENGTH_NM))
    return SpectralMaterial(
        name="mirror/silver",
        title="mirror, silver",
        kind="mirror",
        basis="measured",
        source=eta.source,
        reflectance=reflectance_spectrum(values, eta.source),
        tags=("mirror", "silver"),
    )


def _pane(name: str, title: str, value: float, what: str) -> SpectralMaterial:
    """An opaque body as dark as what is behind, under polished glass: reflects like one face of a pane."""
    source = f"{what}; Fresnel reflection of soda-lime glass of index {SODA_LIME_INDEX}"
    return SpectralMaterial(
        name=name,
        title=title,
        kind="coated",
        basis="typical",
        source=source,
        reflectance=reflectance_spectrum(np.full_like(WAVELENGTH_NM, value), source),
        roughness=0.002,
        interior_index=SODA_LIME_INDEX,
        tags=("glass", "pane", "window", "opaque"),
    )


def _clear_glass() -> SpectralMaterial:
    return SpectralMaterial(
        name="glass/clear",
        title="clear glass",
        kind="glass",
        basis="measured",
        source="index of soda-lime glass at 589 nm (Rubin 1985, Solar Energy Materials 12, 275)",
        interior_index=SODA_LIME_INDEX,
        tags=("glass", "clear", "transparent"),
    )
