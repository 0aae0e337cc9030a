"""Cloth: fibres that scatter, and dyes that mostly stop absorbing before 800 nm."""

from __future__ import annotations

from fullwell.assets.materials.curves import reflectance_spectrum
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.materials.pigments import PIGMENT_SOURCE, mixture_reflectance

__all__ = ["textile_materials"]

_CLOTH: dict[str, dict[str, float]] = {
    "white": {"bleached_fibre": 1.0, "rutile": 0.05},
    "black": {"fibre": 1.0, "black_dye": 1.6},
    "grey": {"fibre": 1.0, "black_dye": 0.09},
    "navy": {"fibre": 1.0, "navy_dye": 1.2, "black_dye": 0.25},
    "denim": {"fibre": 1.0, "indigo": 0.9, "black_dye": 0.06},
    "red": {"fibre": 1.0, "red_dye": 2.0, "orange_dye": 0.5, "black_dye": 0.004},
    "green": {"fibre": 1.0, "green_dye": 0.9, "black_dye": 0.04},
    "yellow": {"fibre": 1.0, "yellow_dye": 1.2},
    "beige": {"fibre": 1.0, "yellow_dye": 0.05, "orange_dye": 0.02, "black_dye": 0.012},
    "brown": {"fibre": 1.0, "yellow_dye": 0.6, "orange_dye": 0.45, "black_dye": 0.2},
    "hi_vis_yellow": {"bleached_fibre": 1.0, "yellow_dye": 2.0, "phthalo_green": 0.008},
    "hi_vis_orange": {"bleached_fibre": 1.0, "orange_dye": 1.6},
}


def textile_materials() -> tuple[SpectralMaterial, ...]:
    """Return the cloths. Fluorescence of the high-visibility ones is not modelled: they are less bright than in truth."""
    return tuple(
        SpectralMaterial(
            name=f"cloth/{name}",
            title=f"cloth, {name.replace('_', ' ')}",
            kind="diffuse",
            basis="model",
            source=PIGMENT_SOURCE,
            reflectance=reflectance_spectrum(mixture_reflectance(mixture), PIGMENT_SOURCE),
            tags=("cloth", "textile", "clothing", *name.split("_")),
        )
        for name, mixture in _CLOTH.items()
    )
