"""Objects and lights of a recipe to a SceneDescription."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import unknown_name_message
from fullwell.scene import (
    ConstantEnvironment,
    Emission,
    Fog,
    ImageEnvironment,
    Light,
    Material,
    Mesh,
    Part,
    SceneDescription,
    SceneObject,
    SunSky,
)
from fullwell.schema.conversion.assets import DrawnAsset, asset_part_material, check_lit, draw_asset
from fullwell.schema.conversion.context import Context, fail
from fullwell.schema.conversion.geometry import geometry_of, transform_of
from fullwell.schema.conversion.lights import area_light_object, light_of
from fullwell.schema.conversion.materials import material_of, model_material
from fullwell.schema.conversion.traffic import Viewpoint, street_objects
from fullwell.schema.v1.geometry import AssetGeometry, ModelGeometry
from fullwell.schema.v1.lights import AreaLight
from fullwell.schema.v1.recipe import FogDocument, ObjectDocument, PartDocument, SceneDocument

if TYPE_CHECKING:
    from fullwell.assets.model import LoadedModel, LoadedPart

__all__ = ["PlacedScene", "scene_of"]

_ENVIRONMENTS = (ConstantEnvironment, ImageEnvironment, SunSky)


@dataclass(frozen=True, slots=True)
class PlacedScene:
    """A scene and, for messages, the path of each object and whether a camera may be inside it."""

    description: SceneDescription
    paths: tuple[str, ...]
    inside_ok: tuple[bool, ...]


def scene_of(document: SceneDocument, context: Context, viewpoints: Sequence[Viewpoint] = ()) -> PlacedScene:
    """Return the scene; raises RecipeError for the first thing in it that cannot be rendered."""
    _check_not_empty(document)
    objects, paths, inside_ok = [], [], []
    for index, item in enumerate(document.objects):
        path = f"scene.objects[{index}]"
        objects.append(_object(item, document.materials, path, context))
        paths.append(path)
        inside_ok.append(item.inside_ok)
    lights: list[Light] = []
    if document.traffic is not None and context.street is not None:
        of_street, beams = street_objects(document.traffic, context.street, viewpoints, context)
        objects += of_street
        lights += beams
        paths += ["scene.traffic"] * len(of_street)
        inside_ok += [True] * len(of_street)
    environment = ""
    for index, light in enumerate(document.lights):
        path = f"scene.lights[{index}]"
        if isinstance(light, AreaLight):
            objects.append(area_light_object(light, path, context))
            paths.append(path)
            inside_ok.append(True)
            continue
        lights.append(light_of(light, path, context))
        if isinstance(lights[-1], _ENVIRONMENTS):
            if environment:
                fail(path, f"is an environment, as is {environment}; a scene can have one. Remove one of them.")
            environment = path
    if not lights and not any(part.emission for item in objects for part in item.parts):
        fail("scene.lights", "is empty and no object emits: nothing would be lit. Add a light.")
    classes = document.classes or sorted({item.semantic_class for item in objects} - {""})
    scene = SceneDescription(tuple(objects), tuple(lights), tuple(classes), _fog(document.atmosphere))
    return PlacedScene(scene, tuple(paths), tuple(inside_ok))


_REMAINING = 0.05
"""Share of light that is left over the meteorological optical range, by the definition of the WMO (No. 8, chapter 9)."""


def _fog(document: FogDocument | None) -> Fog | None:
    if document is None:
        return None
    return Fog(
        extinction_per_m=-math.log(_REMAINING) / document.visibility_m,
        albedo=document.albedo,
        asymmetry=document.asymmetry,
        bottom_m=document.bottom_m,
        top_m=document.top_m,
    )


def _check_not_empty(document: SceneDocument) -> None:
    environments = ("constant_environment", "image_environment", "overcast_sky", "sun_sky", "area")
    if not document.objects and document.traffic is None and not any(light.kind in environments for light in document.lights):
        fail("scene.objects", "is empty and there is no environment light: nothing can be seen. Add an object or a sky.")


@dataclass(frozen=True, slots=True)
class _Surface:
    """A geometry of the recipe with what it says about materials, and where it stands."""

    geometry: Any
    material: Any
    materials: Mapping[str, Any]
    to_object: NDArray[np.float64]
    name: str
    path: str
    asset: DrawnAsset | None = None


def _object(document: ObjectDocument, named: Mapping[str, Any], path: str, context: Context) -> SceneObject:
    if document.parts is None:
        surfaces = [_Surface(document.geometry, document.material, document.materials, np.eye(4), "", path)]
    else:
        surfaces = [_surface_of(item, f"{path}.parts[{number}]") for number, item in enumerate(document.parts)]
    surfaces = [_with_asset(surface, document.id, context) for surface in surfaces]
    parts = tuple(part for surface in surfaces for part in _parts(surface, named, context))
    to_world = transform_of(document.transform, f"{path}.transform")
    licences = (*document.licences, *_model_licences(surfaces, context))
    kinds = [surface.asset.manifest.asset_class for surface in surfaces if surface.asset is not None]
    semantic_class = document.semantic_class or (kinds[0] if kinds else "")
    return SceneObject(document.id, semantic_class, parts, to_world, tuple(dict.fromkeys(licences)))


def _with_asset(surface: _Surface, object_id: str, context: Context) -> _Surface:
    if not isinstance(surface.geometry, AssetGeometry):
        return surface
    path = f"{surface.path}.geometry"
    drawn = draw_asset(surface.geometry, object_id, path, context)
    check_lit(drawn, tuple(surface.geometry.lit), path)
    return replace(surface, asset=drawn)


def _model_licences(surfaces: Iterable[_Surface], context: Context) -> Iterator[str]:
    for surface in surfaces:
        if isinstance(surface.geometry, ModelGeometry) and (licence := context.files.licence(surface.geometry.file)):
            yield licence
        if surface.asset is not None:
            yield surface.asset.licence


def _surface_of(document: PartDocument, path: str) -> _Surface:
    to_object = transform_of(document.transform, f"{path}.transform")
    return _Surface(document.geometry, document.material, document.materials, to_object, document.name or "", path)


def _parts(surface: _Surface, named: Mapping[str, Any], context: Context) -> list[Part]:
    if surface.asset is not None:
        return _placed(surface, surface.asset.model, named, context)
    if isinstance(surface.geometry, ModelGeometry):
        return _model_parts(surface, surface.geometry, named, context)
    if surface.materials:
        fail(f"{surface.path}.materials", "is for model files only; give material.")
    geometry = geometry_of(surface.geometry, f"{surface.path}.geometry")
    if surface.material is None:
        fail(f"{surface.path}.material", "is missing; name an entry of scene.materials or write one in place.")
    material, emission = material_of(surface.material, named, f"{surface.path}.material", context)
    return [Part(geometry, material, surface.to_object, emission, surface.name)]


def _model_parts(surface: _Surface, geometry: ModelGeometry, named: Mapping[str, Any], context: Context) -> list[Part]:
    file_path = f"{surface.path}.geometry.file"
    file, digest = context.files.find(geometry.file, file_path)
    context.used_files[geometry.file] = digest
    model = context.files.model(file, digest, unit_m=geometry.unit_m, up_axis=geometry.up_axis, path=file_path)
    context.used_files |= context.files.companions(geometry.file, file, model)
    for warning in model.warnings:
        context.warn(f"{file_path}: {warning}")
    return _placed(surface, model, named, context)


def _placed(surface: _Surface, model: LoadedModel, named: Mapping[str, Any], context: Context) -> list[Part]:
    _check_patterns(surface, [part.name for part in model.parts])
    prefix = f"{surface.name}/" if surface.name else ""
    parts = []
    for loaded in model.parts:
        mesh = Mesh(loaded.vertices_m, loaded.faces, loaded.normals, loaded.uv)
        material, emission = _loaded_material(surface, loaded, named, context)
        parts.append(Part(mesh, material, surface.to_object, emission, prefix + loaded.name))
    return parts


def _check_patterns(surface: _Surface, names: list[str]) -> None:
    for pattern in surface.materials:
        if not any(fnmatchcase(name, pattern) for name in names):
            message = unknown_name_message("part", pattern, names)
            fail(f'{surface.path}.materials."{pattern}"', f"matches no part of the model: {message}", pattern)


def _loaded_material(
    surface: _Surface, loaded: LoadedPart, named: Mapping[str, Any], context: Context
) -> tuple[Material, Emission | None]:
    for pattern, reference in surface.materials.items():
        if fnmatchcase(loaded.name, pattern):
            return material_of(reference, named, f'{surface.path}.materials."{pattern}"', context)
    if surface.material is not None:
        return material_of(surface.material, named, f"{surface.path}.material", context)
    if surface.asset is not None:
        lit = tuple(surface.geometry.lit)
        return asset_part_material(surface.asset, loaded, lit, f"{surface.path}.geometry", context)
    return model_material(loaded, f"{surface.path}.geometry.file", context), None
