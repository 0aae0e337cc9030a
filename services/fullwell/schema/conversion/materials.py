"""Materials of a recipe and of model files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fullwell.core.errors import unknown_name_message
from fullwell.radiometry import Spectrum, metal
from fullwell.radiometry.glasses import glass, glass_from_abbe
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
from fullwell.schema.conversion.assets import catalogue_material, is_catalogue_name
from fullwell.schema.conversion.context import Context, fail, located
from fullwell.schema.conversion.spectra import absolute, colour_of, luminous, reflectance_of
from fullwell.schema.v1 import materials as documents

if TYPE_CHECKING:
    from fullwell.assets.model import LoadedPart

__all__ = ["RADIANCE_UNIT", "emission_of", "material_of", "model_material"]

RADIANCE_UNIT = "W sr^-1 m^-2 nm^-1"
_SMALLEST_ROUGHNESS = 0.01
"""Model files may state 0; below this the principled model is a mirror that no light sample finds."""


def material_of(reference: Any, named: Mapping[str, Any], path: str, context: Context) -> tuple[Material, Emission | None]:
    """Return the material of a name in ``scene.materials`` or of one written in place, with its emission."""
    if isinstance(reference, str):
        if reference not in named and is_catalogue_name(reference):
            return catalogue_material(reference, path, context)
        if reference not in named:
            fail(path, f"names no entry of scene.materials: {_unknown(reference, named)}", reference)
        path, reference = f"scene.materials.{reference}", named[reference]
    key = reference.model_dump_json()
    if key not in context.materials:
        context.materials[key] = _converted(reference, path, context)
    return context.materials[key]


def _unknown(name: str, named: Mapping[str, Any]) -> str:
    return unknown_name_message("material", name, named) if named else "there are none. Write the material in place."


def _converted(document: Any, path: str, context: Context) -> tuple[Material, Emission | None]:
    match document:
        case documents.DiffuseMaterial():
            return Diffuse(reflectance_of(document.reflectance, f"{path}.reflectance", context)), None
        case documents.TranslucentMaterial():
            reflectance, transmittance = (
                reflectance_of(getattr(document, key), f"{path}.{key}", context) for key in ("reflectance", "transmittance")
            )
            return Translucent(reflectance, transmittance), None
        case documents.RoughPlasticMaterial():
            spectrum = reflectance_of(document.reflectance, f"{path}.reflectance", context)
            return RoughPlastic(spectrum, document.roughness, document.interior_index), None
        case documents.PrincipledMaterial():
            spectrum = reflectance_of(document.base_color, f"{path}.base_color", context)
            return Principled(spectrum, document.roughness, document.metallic, document.specular), None
        case documents.ConductorMaterial():
            return _conductor(document, path, context), None
        case documents.DielectricMaterial():
            index = _index(document.interior_index, f"{path}.interior_index")
            return Dielectric(index, document.exterior_index, document.roughness), None
        case documents.MirrorMaterial():
            return Mirror(reflectance_of(document.reflectance, f"{path}.reflectance", context)), None
        case documents.EmissiveMaterial():
            base = Diffuse(reflectance_of(document.reflectance, f"{path}.reflectance", context))
            return base, emission_of(document, path, context)
        case _:
            raise TypeError(f"{type(document).__name__} is not a material")


def _index(given: Any, path: str) -> float | Spectrum:
    match given:
        case documents.AbbeIndex():
            return glass_from_abbe(given.n_d, given.abbe)
        case str():
            with located(path):
                return glass(given.removeprefix("glass:"), path=path)
        case _:
            return float(given)


def _conductor(document: documents.ConductorMaterial, path: str, context: Context) -> Conductor:
    if document.metal is not None:
        with located(f"{path}.metal"):
            eta, k = metal(document.metal, path=f"{path}.metal")
        return Conductor(eta, k, document.roughness)
    eta, k = (absolute(getattr(document, key), f"{path}.{key}", "1", context) for key in ("eta", "k"))
    held = [type(s)(s.wavelength_nm, s.values, "hold", "1", s.source) for s in (eta, k)]
    return Conductor(held[0], held[1], document.roughness)


def emission_of(document: Any, path: str, context: Context, *, area_m2: float = 0.0) -> Emission:
    """Return the emission of a document with a radiance, a luminance, or the luminous flux of a surface of `area_m2`.

    A surface of radiance L on one side emits pi L per area: flux = pi L area.
    """
    if document.radiance_w_sr_m2_nm is not None:
        radiance = absolute(document.radiance_w_sr_m2_nm, f"{path}.radiance_w_sr_m2_nm", RADIANCE_UNIT, context)
    elif document.luminance_cd_m2 is not None:
        radiance = luminous(document, "luminance_cd_m2", path, RADIANCE_UNIT, context)
    else:
        radiance = luminous(document, "luminous_flux_lm", path, RADIANCE_UNIT, context, per=3.141592653589793 * area_m2)
    return Emission(radiance, document.group)


def model_material(part: LoadedPart, path: str, context: Context) -> Material:
    """Return the material that a model file gives a part: metallic-roughness, colours upsampled from sRGB."""
    roughness = max(part.roughness, _SMALLEST_ROUGHNESS)
    if part.emissive_srgb is not None and any(part.emissive_srgb):
        context.warn(f"{path}: the glow of part {part.name!r} has no unit and is left out; give it an emissive material.")
    if part.base_color_texture is not None:
        context.warn(f"{path}: textures are sRGB; their spectra are made up.")
        return Principled(Texture(part.base_color_texture), roughness, part.metallic)
    key = f"model {part.base_color_srgb} {roughness} {part.metallic}"
    if key not in context.materials:
        colour = colour_of(part.base_color_srgb, f"{path} (colours of the model)", context)
        context.materials[key] = (Principled(colour, roughness, part.metallic), None)
    return context.materials[key][0]
