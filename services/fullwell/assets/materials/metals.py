"""Metals by complex index, the mirror, and glass."""

from __future__ import annotations

from fullwell.assets.materials.curves import WAVELENGTH_NM, reflectance_spectrum
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.materials.pigments import PIGMENT_SOURCE, mixture_reflectance
from fullwell.radiometry.metals import metal, normal_reflectance

__all__ = ["metal_materials"]

_METALS = {
    "chrome": ("chromium", 0.02),
    "aluminium": ("aluminium", 0.2),
    "rim_alloy": ("aluminium", 0.15),
    "steel_galvanised": ("chromium", 0.45),
    "steel_brushed": ("chromium", 0.25),
    "copper": ("copper", 0.15),
    "brass": ("gold", 0.15),
    "cast_iron": ("chromium", 0.5),
}


def metal_materials() -> tuple[SpectralMaterial, ...]:
    """Return metals, the mirror and glass."""
    return (*(_metal(name, *figures) for name, figures in _METALS.items()), _rust(), _mirror(), *_glasses())


def _metal(name: str, element: str, roughness: float) -> SpectralMaterial:
    eta, k = metal(element)
    return SpectralMaterial(
        f"metal/{name}", name.replace("_", " "), "metal", "measured", eta.source, roughness=roughness, eta=eta, k=k,
        tags=("metal", *name.split("_")),
    )  # fmt: skip


def _rust() -> SpectralMaterial:
    values = mixture_reflectance({"iron_oxide_red": 0.5, "iron_oxide_yellow": 1.0, "carbon_black": 0.03})
    return SpectralMaterial(
        "metal/rust", "rust", "diffuse", "model", PIGMENT_SOURCE, reflectance=reflectance_spectrum(values, PIGMENT_SOURCE),
        tags=("metal", "rust", "rusty"),
    )  # fmt: skip


def _mirror() -> SpectralMaterial:
    eta, k = metal("silver")
    values = normal_reflectance(eta.at(WAVELENGTH_NM), k.at(WAVELENGTH_NM))
    return SpectralMaterial(
        "mirror/silver", "mirror, silver", "mirror", "measured", eta.source,
        reflectance=reflectance_spectrum(values, eta.source), tags=("mirror", "silver"),
    )  # fmt: skip


def _glasses() -> tuple[SpectralMaterial, ...]:
    return (
        _pane("glass/tinted", "tinted car pane, seen from outside", 0.02),
        _pane("glass/window", "window pane before a dark room", 0.04),
        SpectralMaterial(
            "glass/clear", "clear glass", "glass", "measured", "n_d = 1.52 of soda-lime glass", interior_index=1.52,
            tags=("glass", "clear"),
        ),
    )  # fmt: skip


def _pane(name: str, title: str, value: float) -> SpectralMaterial:
    source = "Fresnel reflection of soda-lime glass; what is behind is taken as dark"
    return SpectralMaterial(
        name, title, "coated", "typical", source, reflectance=reflectance_spectrum(0.0 * WAVELENGTH_NM + value, source),
        roughness=0.002, interior_index=1.52, tags=("glass", "pane", "window"),
    )  # fmt: skip
