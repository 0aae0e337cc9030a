"""Cloth: fibres that scatter, and dyes that mostly stop absorbing before 800 nm."""

from __future__ import annotations

from fullwell.assets.materials.curves import reflectance_spectrum
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.materials.pigments import PIGMENT_SOURCE, mixture_reflectance

__all__ = ["textile_materials"]

_CLOTH: dict[str, dict[str, float]] = {
    "white": {"bleached_fibre": 1.0, "rutile": 0.05},
    "black": {"fibre": 1.0, "black_dye": 1.0},
    "grey": {"fibre": 1.0, "black_dye": 0.09},
    "navy": {"fibre": 1.0, "navy_dye": 1.2, "black_dye": 0.1},
    "denim": {"fibre": 1.0, "indigo": 0.55, "black_dye": 0.015},
    "red": {"fibre": 1.0, "red_dye": 1.2, "black_dye": 0.004},
    "green": {"fibre": 1.0, "green_dye": 0.6, "black_dye": 0.02},
    "yellow": {"fibre": 1.0, "yellow_dye": 0.8},
    "beige": {"fibre": 1.0, "yellow_dye": 0.03, "red_dye": 0.015, "black_dye": 0.006},
    "brown": {"fibre": 1.0, "yellow_dye": 0.4, "red_dye": 0.35, "black_dye": 0.12},
    "hi_vis_yellow": {"bleached_fibre": 1.0, "yellow_dye": 1.2},
    "hi_vis_orange": {"bleached_fibre": 1.0, "orange_dye": 1.2},
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
