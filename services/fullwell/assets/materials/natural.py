"""Roads, stone, brick, plaster, roofs, wood, plants, skin and hair."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final, Literal

from fullwell.assets.materials.curves import Array, reflectance_spectrum
from fullwell.assets.materials.leaves import LEAF_SOURCE, Leaf, leaf_reflectance, leaf_transmittance
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.materials.pigments import PIGMENT_SOURCE, mixture_reflectance
from fullwell.assets.materials.skin import SKIN_INDEX, SKIN_SOURCE, skin_body_reflectance
from fullwell.assets.materials.tables import measured_names, measured_reflectance, typical_reflectance

__all__ = ["natural_materials"]

Basis = Literal["measured", "model", "typical"]

_TYPICAL: Final = (
    "stone/sandstone", "stone/granite", "stone/limestone", "roof/slate", "roof/metal", "wood/oak", "wood/pine", "bark/birch",
)  # fmt: skip

_MIXTURES: Final[dict[str, dict[str, float]]] = {
    "brick/red": {"chalk": 1.0, "iron_oxide_red": 0.2, "iron_oxide_yellow": 0.6, "carbon_black": 0.012},
    "brick/yellow": {"chalk": 1.0, "iron_oxide_yellow": 0.09, "iron_oxide_red": 0.006, "carbon_black": 0.003},
    "brick/dark": {"chalk": 1.0, "iron_oxide_red": 0.2, "iron_oxide_yellow": 0.4, "carbon_black": 0.045},
    "plaster/white": {"chalk": 1.0, "rutile": 0.2, "carbon_black": 0.0005, "iron_oxide_yellow": 0.001},
    "plaster/cream": {"chalk": 1.0, "rutile": 0.1, "iron_oxide_yellow": 0.015, "carbon_black": 0.001},
    "plaster/ochre": {"chalk": 1.0, "rutile": 0.05, "iron_oxide_yellow": 0.12, "iron_oxide_red": 0.006, "carbon_black": 0.0015},
    "plaster/grey": {"chalk": 1.0, "rutile": 0.1, "carbon_black": 0.0035, "iron_oxide_yellow": 0.004},
    "plaster/rose": {"chalk": 1.0, "rutile": 0.1, "iron_oxide_red": 0.014, "iron_oxide_yellow": 0.012, "carbon_black": 0.001},
    "wood/painted_white": {"rutile": 1.0, "carbon_black": 0.0004, "iron_oxide_yellow": 0.002},
    "hair/black": {"keratin": 1.0, "eumelanin": 22.0},
    "hair/brown": {"keratin": 1.0, "eumelanin": 4.5, "pheomelanin": 1.5},
    "hair/blond": {"keratin": 1.0, "eumelanin": 0.25, "pheomelanin": 0.3},
    "hair/grey": {"keratin": 1.0, "eumelanin": 0.3, "carbon_black": 0.004},
    "fur/deer": {"keratin": 1.0, "eumelanin": 1.3, "pheomelanin": 1.3},
    "fur/dog_brown": {"keratin": 1.0, "eumelanin": 2.0, "pheomelanin": 2.2},
    "fur/dog_black": {"keratin": 1.0, "eumelanin": 18.0},
    "fur/white": {"keratin": 1.0, "pheomelanin": 0.02},
    "leather/black": {"fibre": 1.0, "black_dye": 1.5, "carbon_black": 0.12},
    "leather/brown": {"fibre": 1.0, "black_dye": 0.35, "orange_dye": 0.9, "yellow_dye": 0.5},
}
"""Pigments in what scatters: lime and clay, wood's paint, keratin of hair, fibres of leather."""

_LEAVES: Final[dict[str, Leaf]] = {
    "foliage/broadleaf": Leaf(1.6, 55.0, 12.0, 1.2, water_cm=0.012, dry_matter_g_per_cm2=0.006),
    "foliage/birch": Leaf(1.45, 40.0, 9.0, 0.5, water_cm=0.010, dry_matter_g_per_cm2=0.005),
    "foliage/conifer": Leaf(1.9, 70.0, 14.0, 1.5, water_cm=0.020, dry_matter_g_per_cm2=0.018),
    "foliage/hedge": Leaf(1.7, 62.0, 13.0, 1.0, water_cm=0.014, dry_matter_g_per_cm2=0.009),
    "foliage/autumn": Leaf(1.6, 4.0, 9.0, 3.0, water_cm=0.008, dry_matter_g_per_cm2=0.005, brown=0.1),
    "grass/green": Leaf(1.5, 46.0, 10.0, 0.5, water_cm=0.012, dry_matter_g_per_cm2=0.005),
}

_SKIN: Final = {"light": (0.015, 0.008), "medium": (0.055, 0.009), "dark": (0.13, 0.008), "deep": (0.28, 0.007)}
"""Share of melanin in the epidermis, and of blood in the dermis."""

_COATS: Final = {
    "wood/painted_white": (0.3, 1.5),
    "skin": (0.35, SKIN_INDEX),
    "hair": (0.35, 1.55),
    "leather": (0.25, 1.5),
}
"""Roughness and index of what shines; by name or family. Others are diffuse."""

_WORDS: Final = {
    "asphalt": ("road", "tarmac"),
    "concrete": ("cement", "pavement"),
    "plaster": ("wall", "render", "facade"),
    "brick": ("wall", "facade"),
    "foliage": ("leaf", "leaves", "plant", "vegetation"),
    "grass": ("plant", "vegetation", "lawn"),
    "bark": ("trunk", "tree", "wood"),
    "skin": ("human", "person"),
    "hair": ("human", "person"),
    "fur": ("animal", "coat"),
    "soil": ("ground", "dirt"),
    "roof": ("tiles",),
}


def natural_materials() -> tuple[SpectralMaterial, ...]:
    """Return the materials of roads, buildings, plants and bodies."""
    return (*_measured(), _wet_asphalt(), _meadow(), *_modelled(), *_typical())


def _measured() -> Iterator[SpectralMaterial]:
    for name in measured_names():
        values, source = measured_reflectance(name)
        yield _material(name, values, "measured", source)


def _typical() -> Iterator[SpectralMaterial]:
    for name in _TYPICAL:
        values, source = typical_reflectance(name)
        yield _material(name, values, "typical", source)


def _modelled() -> Iterator[SpectralMaterial]:
    for name, leaf in _LEAVES.items():
        opaque = _material(name, leaf_reflectance(leaf), "model", LEAF_SOURCE)
        if not name.startswith("foliage/"):  # grass is laid on the ground as a whole: nothing shines through
            yield opaque
            continue
        through = reflectance_spectrum(leaf_transmittance(leaf), LEAF_SOURCE)
        yield replace(opaque, kind="translucent", transmittance=through)
    for name, (melanin, blood) in _SKIN.items():
        values = skin_body_reflectance(melanin_share=melanin, blood_share=blood)
        yield _material(f"skin/{name}", values, "model", SKIN_SOURCE)
    for name, mixture in _MIXTURES.items():
        yield _material(name, mixture_reflectance(mixture), "model", PIGMENT_SOURCE)


_DRY_SHARE = 0.3


def _meadow() -> SpectralMaterial:
    """Green grass with dry blades between."""
    dry, source = measured_reflectance("grass/dry")
    mixed = (1.0 - _DRY_SHARE) * leaf_reflectance(_LEAVES["grass/green"]) + _DRY_SHARE * dry
    return _material("grass/meadow", mixed, "model", f"{_DRY_SHARE:.0%} of {source}, the rest {LEAF_SOURCE}")


def _wet_asphalt() -> SpectralMaterial:
    """Aged asphalt under a film of water: what it scatters is thrown back from the film's surface and absorbed."""
    values, source = measured_reflectance("asphalt/worn")
    note = f"film of water (Angstrom 1925) over {source}"
    return SpectralMaterial(
        name="asphalt/wet",
        title="asphalt, wet",
        kind="coated",
        basis="model",
        source=note,
        reflectance=reflectance_spectrum(values, note),
        roughness=0.08,
        interior_index=1.333,
        tags=("asphalt", "wet", "rain", *_WORDS["asphalt"]),
    )


def _material(name: str, values: Array, basis: Basis, source: str) -> SpectralMaterial:
    family, _, member = name.partition("/")
    coat = _COATS.get(name, _COATS.get(family))
    return SpectralMaterial(
        name=name,
        title=f"{family}, {member.replace('_', ' ')}",
        kind="coated" if coat else "diffuse",
        basis=basis,
        source=source,
        reflectance=reflectance_spectrum(values, source),
        roughness=coat[0] if coat else 0.0,
        interior_index=coat[1] if coat else 1.5,
        tags=(family, *member.split("_"), *_WORDS.get(family, ())),
    )
