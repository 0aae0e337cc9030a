"""From a part of a model file to a material of the catalogue: by the words of its name, the class, and the file's colour."""

from __future__ import annotations

from functools import cache
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.classes import asset_class as known_class
from fullwell.assets.materials.catalogue import asset_material
from fullwell.assets.materials.colours import display_srgb, emission_srgb, lab_of_srgb
from fullwell.assets.materials.curves import Array
from fullwell.assets.materials.names import has_words, words_of
from fullwell.assets.materials.rule_table import BODY_WORDS, MATERIAL_RULES, MaterialRule
from fullwell.assets.records import MaterialChoice

__all__ = ["SurfaceColours", "choose_material", "choose_with_reason", "colour_distance", "is_paintable"]

METALLIC_FROM: Final = 0.7
"""A file's `metallic` from which its part is metal through and through; exporters leave 0.5 on paint."""

_REPAINTED_CHROMA: Final = 12.0
"""A part that is not named as body is paint to change where it has a colour: grey ones are bumpers and trim."""


_COLOURED_CHROMA: Final = 12.0
_GREY_CHROMA: Final = 5.0
"""Twice the first is surely a colour, less than the second is surely grey."""


class SurfaceColours(Protocol):
    """What rules look at, as `assets.model.LoadedPart` has it: sRGB-encoded colours, and the metallic-roughness model."""

    @property
    def base_color_srgb(self) -> tuple[float, float, float]: ...
    @property
    def base_color_texture(self) -> NDArray[np.uint8] | None: ...
    @property
    def roughness(self) -> float: ...
    @property
    def metallic(self) -> float: ...
    @property
    def emissive_srgb(self) -> tuple[float, float, float] | None: ...


def choose_material(part_name: str, asset_class: str, surface: SurfaceColours) -> MaterialChoice:
    """Return what a part is made of; see `choose_with_reason`."""
    return choose_with_reason(part_name, asset_class, surface)[0]


def choose_with_reason(part_name: str, asset_class: str, surface: SurfaceColours) -> tuple[MaterialChoice, str]:
    """Return what a part is made of, and a sentence that says why.

    Rules about words are tried on the last word group of the name ("/car/wheel1/greyMax": greyMax), then on the name of the
    file's material where the surface has `material_name`, then on the whole name; then those about the class alone. The first
    that fits decides; of several materials the one of the nearest colour is taken. Where none fits, the file's texture or
    colour stays: origin "texture" or "upsampled", whose spectra are made up.

    Raises FieldError for an unknown class.
    """
    groups = {known_class(asset_class).group, asset_class}
    leaf = part_name.rstrip("/").rpartition("/")[2]
    looked_at = (leaf, str(getattr(surface, "material_name", "") or ""), part_name)
    for named in looked_at:
        for rule in MATERIAL_RULES:
            found = _by_rule(rule, words_of(named), groups, surface) if rule.words else None
            if found is not None:
                return found
    for rule in MATERIAL_RULES:
        found = None if rule.words else _by_rule(rule, (), groups, surface)
        if found is not None:
            return found
    if surface.base_color_texture is not None:
        reason = f"{part_name!r} keeps its texture, which may show several materials; its spectra are made up."
        return _choice("texture", "", surface), reason
    reason = f"No rule knows {part_name!r} of class {asset_class}; its colour is used, whose spectrum is made up."
    return _choice("upsampled", "", surface), reason


def is_paintable(part_name: str, asset_class: str, choice: MaterialChoice) -> bool:
    """Return whether a recipe may give the part another paint: the painted body of a vehicle, not its grey trim."""
    kind = known_class(asset_class)
    if kind.group != "vehicle" or not choice.name.startswith("paint/"):
        return False
    if any(has_words(words_of(part_name), wanted) for wanted in BODY_WORDS):
        return True
    # Emergency vehicles keep the colours they are known by.
    chroma = float(np.hypot(*lab_of_srgb(choice.base_color_srgb)[1:]))
    return asset_class != "emergency_vehicle" and chroma >= _REPAINTED_CHROMA


def colour_distance(first_lab: Array, second_lab: Array) -> float:
    """Return how far two colours are: CIE 1976, with a third of lightness and chroma against hue.

    Colours of model files are purer and lighter than pigments can be, so that pure green would be nearer to yellow paint than
    to green. Hue is what their authors meant.
    """
    lightness, chroma = first_lab[0] - second_lab[0], np.hypot(*first_lab[1:]) - np.hypot(*second_lab[1:])
    hue_squared = max(float(np.sum((first_lab[1:] - second_lab[1:]) ** 2) - chroma**2), 0.0)
    return float(np.sqrt((lightness**2 + chroma**2) / 9.0 + hue_squared))


def _by_rule(
    rule: MaterialRule, words: tuple[str, ...], groups: set[str], surface: SurfaceColours
) -> tuple[MaterialChoice, str] | None:
    if not _fits(rule, words, groups, surface):
        return None
    shining = surface.emissive_srgb if any(surface.emissive_srgb or ()) else None
    colour = shining or surface.base_color_srgb
    name, distance = _nearest(rule.materials, lab_of_srgb(colour))
    if rule.largest_distance is not None and distance > rule.largest_distance:
        return None
    among = "" if len(rule.materials) == 1 else " Of what it may be, this is nearest in colour."
    return _choice("rule", name, surface), rule.reason + among


def _fits(rule: MaterialRule, words: tuple[str, ...], groups: set[str], surface: SurfaceColours) -> bool:
    if rule.classes and groups.isdisjoint(rule.classes):
        return False
    if surface.base_color_texture is not None and not rule.over_texture:
        return False
    if (rule.metallic and surface.metallic < METALLIC_FROM) or (rule.lit and not any(surface.emissive_srgb or ())):
        return False
    if any(has_words(words, unwanted) for unwanted in rule.without):
        return False
    return not rule.words or any(has_words(words, wanted) for wanted in rule.words)


def _nearest(materials: tuple[str, ...], lab: Array) -> tuple[str, float]:
    """Return the nearest material and its distance; what has a colour stays coloured, and grey stays grey, where it can."""
    chroma = float(np.hypot(*lab[1:]))
    alike = [name for name in materials if _alike(chroma, float(np.hypot(*_look(name)[1:])))] or materials
    distances = [colour_distance(lab, _look(name)) for name in alike]
    best = int(np.argmin(distances))
    return alike[best], distances[best]


def _alike(chroma: float, other: float) -> bool:
    return other >= _COLOURED_CHROMA if chroma >= 2 * _COLOURED_CHROMA else chroma > _GREY_CHROMA or other <= _COLOURED_CHROMA


@cache
def _look(name: str) -> Array:
    """Return CIE L*, a*, b* of a material as a display shows it; of a lamp, its light."""
    material = asset_material(name)
    return lab_of_srgb(emission_srgb(material) or display_srgb(material))


def _choice(origin: str, name: str, surface: SurfaceColours) -> MaterialChoice:
    red, green, blue = (float(value) for value in surface.base_color_srgb)
    return MaterialChoice(
        origin="rule" if origin == "rule" else "texture" if origin == "texture" else "upsampled",
        name=name,
        base_color_srgb=(red, green, blue),
        roughness=float(surface.roughness),
        metallic=float(surface.metallic),
    )
