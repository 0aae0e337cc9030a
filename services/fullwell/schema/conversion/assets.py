"""Assets of a recipe: drawn, pinned, and turned into parts with spectral materials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

import numpy as np

from fullwell.core.errors import unknown_name_message
from fullwell.core.rng import stream
from fullwell.radiometry import Spectrum, scale_to_luminance
from fullwell.scene import (
    Conductor,
    Dielectric,
    Diffuse,
    Emission,
    Material,
    Mirror,
    Principled,
    RoughPlastic,
    Texture,
    Translucent,
)
from fullwell.schema.assets import candidates_of, no_candidate, query_of, split_pin
from fullwell.schema.conversion.context import Context, fail, located
from fullwell.schema.conversion.spectra import colour_of

if TYPE_CHECKING:
    from fullwell.assets.materials.model import SpectralMaterial
    from fullwell.assets.model import LoadedModel, LoadedPart
    from fullwell.assets.records import AssetManifest, PartRecord
    from fullwell.schema.v1.geometry import AssetGeometry

__all__ = ["DrawnAsset", "asset_part_material", "catalogue_material", "check_lit", "draw_asset", "is_catalogue_name", "lamp_of"]

_SMALLEST_ROUGHNESS = 0.01


class DrawnAsset:
    """One asset of a frame: its manifest and the triangles of one level of detail."""

    def __init__(self, manifest: AssetManifest, model: LoadedModel) -> None:
        self.manifest = manifest
        self._records = {part.name: part for part in manifest.parts}
        lamps = frozenset(name for name, part in self._records.items() if part.material.name.startswith(_LAMPS))
        self.model = replace(model, parts=tuple(_one_sided(part) if part.name in lamps else part for part in model.parts))

    @property
    def pin(self) -> str:
        """What names exactly this version."""
        return f"{self.manifest.id}@{self.manifest.digest}"

    @property
    def licence(self) -> str:
        """What a frame's manifest says about the use of the asset."""
        licence = self.manifest.licence
        return f"{licence.spdx} ({', '.join(text for text in (self.manifest.title, licence.attribution) if text)})"

    def record(self, part: LoadedPart, path: str) -> PartRecord:
        """Return the manifest's record of a part."""
        if part.name not in self._records:
            fail(path, f"is damaged: {self.pin} has no record of its part {part.name!r}. Import the asset again.", self.pin)
        return self._records[part.name]


def _one_sided(lamp: LoadedPart) -> LoadedPart:
    """Return a lamp without triangles that lie on another that faces the other way: of each pair the outer one stays.

    Simplifying flattens thin lenses until their sides meet, and a surface can be seen to emit on one side only.
    """
    corners = lamp.vertices_m[lamp.faces.astype(np.int64)]
    rows = np.sort(np.unique(np.round(lamp.vertices_m, 6), axis=0, return_inverse=True)[1].reshape(-1)[lamp.faces], axis=1)
    _, group, count = np.unique(rows, axis=0, return_inverse=True, return_counts=True)
    if count.max(initial=1) == 1:
        return lamp
    outwards = np.einsum(
        "ij,ij->i", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners.mean(axis=1) * [1, 1, 0]
    )
    order = np.lexsort((-outwards, group.reshape(-1)))
    first = np.concatenate([[True], np.diff(group.reshape(-1)[order]) != 0])
    return replace(lamp, faces=lamp.faces[np.sort(order[first])])


_LAMPS: Final = "lamp/"


def draw_asset(geometry: AssetGeometry, object_id: str, path: str, context: Context) -> DrawnAsset:
    """Return the asset that a geometry names or draws. The same recipe, seed and pins draw the same."""
    if context.assets is None:
        fail(path, "is an asset, but no asset store is at hand here. Run it where one is, or give a model file.")
    if geometry.id is not None and "@" in geometry.id:
        name, digest = split_pin(geometry.id, f"{path}.id")
    else:
        name, digest = _drawn(geometry, object_id, path, context)
    with located(path):
        manifest = context.assets.manifest(digest)
        if manifest.id != name:
            fail(f"{path}.id", f"names {name!r}, but the digest is that of {manifest.id!r}.", geometry.id)
        level = min(geometry.level, len(manifest.levels) - 1)
        file = context.assets.level_file(manifest, level)
        model = context.files.level(file, manifest.levels[level].sha256, path=path)
    drawn = DrawnAsset(manifest, model)
    context.drawn_assets[path] = drawn.pin
    return drawn


def _drawn(geometry: AssetGeometry, object_id: str, path: str, context: Context) -> tuple[str, str]:
    query = query_of(geometry, path)
    assert context.assets is not None
    with located(path):
        pins = candidates_of(context.document, context.assets, query, path)
    if not pins:
        fail(path, no_candidate(path, query).removeprefix(f"{path} "))
    given = geometry.weights
    weights = [_weight(given, name, digest, context) if given else 1.0 for name, digest in pins]
    total = sum(weights)
    if not total > 0:
        fail(f"{path}.weights", f"leave none of the {len(pins)} assets that match any chance; give one of them more than 0.")
    place = stream(context.seed, "asset", object_id, path.partition(".parts")[2]).random() * total
    for pin, weight in zip(pins, weights, strict=True):
        place -= weight
        if place < 0:
            return pin
    return next(pin for pin, weight in zip(reversed(pins), reversed(weights), strict=True) if weight > 0)


def _weight(weights: Mapping[str, float], name: str, digest: str, context: Context) -> float:
    assert context.assets is not None
    weight = weights.get(name, 1.0)
    if any(key != name for key in weights):
        for tag in context.assets.manifest(digest).tags:
            weight *= weights.get(tag, 1.0)
    return weight


def asset_part_material(
    drawn: DrawnAsset, part: LoadedPart, lit: tuple[str, ...], path: str, context: Context
) -> tuple[Material, Emission | None]:
    """Return what a part is made of, and its light where a pattern of `lit` matches its name."""
    record = drawn.record(part, path)
    choice = record.material
    is_lit = any(fnmatchcase(part.name, pattern) for pattern in lit)
    if choice.name:
        return catalogue_material(choice.name, path, context, lit=is_lit)
    roughness = max(choice.roughness, _SMALLEST_ROUGHNESS)
    if part.base_color_texture is not None:
        context.warn(f"{path}: textures are sRGB; their spectra are made up.")
        return Principled(Texture(part.base_color_texture), roughness, choice.metallic), None
    key = f"asset {choice.base_color_srgb} {roughness} {choice.metallic}"
    if key not in context.materials:
        colour = colour_of(choice.base_color_srgb, f"{path} (colours without a catalogued material)", context)
        context.materials[key] = (Principled(colour, roughness, choice.metallic), None)
    return context.materials[key]


def is_catalogue_name(name: str) -> bool:
    """Return whether a material's name may be one of the catalogue: "paint/red"."""
    return "/" in name


def catalogue_material(name: str, path: str, context: Context, *, lit: bool = False) -> tuple[Material, Emission | None]:
    """Return an entry of the catalogue of asset materials as the renderer knows it; emitting where it is `lit` and a lamp."""
    from fullwell.assets.materials.catalogue import asset_material  # noqa: PLC0415 - its tables are read when they are needed

    key = f"catalogue {name} {lit}"
    if key not in context.materials:
        with located(path):
            entry = asset_material(name, path)
        emission = None
        if lit and entry.lamp is not None:
            radiance = scale_to_luminance(entry.lamp.spd, entry.lamp.luminance_cd_m2)
            emission = Emission(radiance, entry.lamp.group)
        context.materials[key] = (_surface(entry), emission)
    return context.materials[key]


def lamp_of(name: str) -> Spectrum:
    """Return the relative spectrum of a lamp of the catalogue."""
    from fullwell.assets.materials.catalogue import asset_material  # noqa: PLC0415

    lamp = asset_material(name).lamp
    if lamp is None:
        raise TypeError(f"the catalogue's material {name!r} is no lamp")
    return lamp.spd


def _surface(entry: SpectralMaterial) -> Material:
    match entry.kind:
        case "diffuse":
            return Diffuse(_given(entry.reflectance, entry.name))
        case "translucent":
            return Translucent(_given(entry.reflectance, entry.name), _given(entry.transmittance, entry.name))
        case "coated":
            roughness = max(entry.roughness, _SMALLEST_ROUGHNESS)
            return RoughPlastic(_given(entry.reflectance, entry.name), roughness, entry.interior_index)
        case "metal":
            return Conductor(_given(entry.eta, entry.name), _given(entry.k, entry.name), entry.roughness)
        case "glass":
            return Dielectric(entry.interior_index, roughness=entry.roughness)
        case "mirror":
            return Mirror(_given(entry.reflectance, entry.name))


def _given(spectrum: Spectrum | None, name: str) -> Spectrum:
    if spectrum is None:
        raise TypeError(f"the catalogue's material {name!r} lacks a spectrum that its kind needs")
    return spectrum


def check_lit(drawn: DrawnAsset, lit: tuple[str, ...], path: str) -> None:
    """Refuse a pattern of `lit` that no lamp of the asset matches."""
    from fullwell.assets.materials.catalogue import asset_material  # noqa: PLC0415

    lamps = [
        part.name for part in drawn.manifest.parts if part.material.name and asset_material(part.material.name).lamp is not None
    ]
    for number, pattern in enumerate(lit):
        if not any(fnmatchcase(name, pattern) for name in lamps):
            known = unknown_name_message("lamp", pattern, lamps) if lamps else "it has no lamps."
            fail(f"{path}.lit[{number}]", f"matches no lamp of {drawn.manifest.id}: {known}", pattern)
