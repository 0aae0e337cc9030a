"""Roads, stone, brick, plaster, roofs, wood, plants, skin and hair."""

from __future__ import annotations

import json
from importlib import resources

from fullwell.assets.materials.curves import reflectance_spectrum, through_knots
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.materials.pigments import PIGMENT_SOURCE, mixture_reflectance

__all__ = ["natural_materials"]

_SOURCE = "shaped after published measurements of the kind"
_COATED = {"asphalt/wet": (0.08, 1.33), "skin": (0.5, 1.4), "hair": (0.4, 1.55), "leather": (0.3, 1.5)}


def natural_materials() -> tuple[SpectralMaterial, ...]:
    """Return the materials of roads, buildings, plants and bodies."""
    text = resources.files("fullwell.assets.materials").joinpath("data", "typical.json").read_text(encoding="utf-8")
    painted = SpectralMaterial(
        name="wood/painted_white",
        title="wood, painted white",
        kind="coated",
        basis="model",
        source=PIGMENT_SOURCE,
        reflectance=reflectance_spectrum(mixture_reflectance({"rutile": 1.0, "iron_oxide_yellow": 0.01}), PIGMENT_SOURCE),
        roughness=0.3,
        tags=("wood", "painted", "white"),
    )
    return (*(_typical(name, points) for name, points in json.loads(text).items()), painted)


def _typical(name: str, points: list[tuple[float, float]]) -> SpectralMaterial:
    family, _, member = name.partition("/")
    coat = _COATED.get(name) or _COATED.get(family)
    return SpectralMaterial(
        name=name,
        title=f"{family}, {member.replace('_', ' ')}",
        kind="coated" if coat else "diffuse",
        basis="typical",
        source=_SOURCE,
        reflectance=reflectance_spectrum(through_knots(points), _SOURCE),
        roughness=coat[0] if coat else 0.0,
        interior_index=coat[1] if coat else 1.5,
        tags=(family, *member.split("_")),
    )
