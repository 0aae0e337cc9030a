"""Materials of mesh files (glTF metallic-roughness, MTL) into one plain model."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.model import ModelSource, SurfaceDraft, linear_to_srgb, srgb_to_linear

__all__ = ["MAX_TEXTURE_PIXELS", "TextureMemo", "mean_srgb", "pixels_of", "surface_of", "tinted"]

MAX_TEXTURE_PIXELS = 16384 * 16384
"""Larger textures are refused: they are most often a decompression bomb, and take a gigabyte."""


TextureMemo = dict[tuple[int, tuple[float, ...]], tuple[Any, NDArray[np.uint8]]]
"""{(identity of an image, colour factor): the image, which keeps the identity its own, and its pixels}."""


def surface_of(
    source: ModelSource, name: str, mesh: Any, warnings: list[str], textures: TextureMemo
) -> tuple[SurfaceDraft, NDArray[np.float64] | None]:
    """Return the material and the per-vertex texture coordinates (v up) of a trimesh mesh.

    `textures` holds what was decoded before, so that parts which share an image share its pixels.
    """
    visual = mesh.visual
    material = getattr(visual, "material", None)
    uv = getattr(visual, "uv", None)
    coordinates = None if uv is None else np.asarray(uv, dtype=np.float64)[:, :2]
    if material is None or visual.kind != "texture":
        return SurfaceDraft(), coordinates
    read = _metallic_roughness if type(material).__name__ == "PBRMaterial" else _wavefront
    surface = read(source, name, material, warnings, textures)
    surface.name = str(getattr(material, "name", None) or "")
    return surface, coordinates


def _texture(source: ModelSource, image: Any, factor: NDArray[np.float64], textures: TextureMemo) -> NDArray[np.uint8]:
    key = (id(image), tuple(factor.tolist()))
    if key not in textures:
        textures[key] = (image, tinted(pixels_of(source, image), factor))
    return textures[key][1]


def _set_texture(surface: SurfaceDraft, pixels: NDArray[np.uint8]) -> None:
    surface.base_color_srgb = mean_srgb(pixels)
    # A swatch, one colour in every pixel, needs no coordinates; readers make one up for materials without an image.
    surface.base_color_texture = None if np.all(pixels == pixels[:1, :1]) else pixels


def _metallic_roughness(
    source: ModelSource, name: str, material: Any, warnings: list[str], textures: TextureMemo
) -> SurfaceDraft:
    """glTF 2.0, section 3.9.2: factors are linear, the base colour texture is sRGB and is multiplied by its factor."""
    factor = _linear_factor(material.baseColorFactor)
    surface = SurfaceDraft(
        base_color_srgb=_triple(linear_to_srgb(factor)),
        roughness=1.0 if material.roughnessFactor is None else float(material.roughnessFactor),
        metallic=1.0 if material.metallicFactor is None else float(material.metallicFactor),
        double_sided=bool(material.doubleSided),
    )
    if material.baseColorTexture is not None:
        _set_texture(surface, _texture(source, material.baseColorTexture, factor, textures))
    if material.metallicRoughnessTexture is not None:
        # Green holds roughness and blue metallic (glTF 2.0, 3.9.2); the renderer takes one number of each.
        channels = pixels_of(source, material.metallicRoughnessTexture).reshape(-1, 3).mean(axis=0) / 255.0
        surface.roughness *= float(channels[1])
        surface.metallic *= float(channels[2])
        warnings.append(f"{source.file.name}: part {name!r}: the mean of the metallic-roughness texture is used.")
    emission = np.zeros(3) if material.emissiveFactor is None else np.asarray(material.emissiveFactor, dtype=np.float64)[:3]
    if emission.any():
        surface.emissive_srgb = _triple(linear_to_srgb(emission))
        if material.emissiveTexture is not None:
            warnings.append(f"{source.file.name}: part {name!r}: the emissive texture is not used, only its factor.")
    if material.alphaMode not in (None, "OPAQUE"):
        warnings.append(f"{source.file.name}: part {name!r} is transparent ({material.alphaMode}); it is drawn opaque.")
    return surface


def _linear_factor(stated: Any) -> NDArray[np.float64]:
    if stated is None:
        return np.ones(3)
    factor = np.asarray(stated)
    # trimesh turns the factor into 8 bits where it can; 255 stands for 1.
    scale = 255.0 if factor.dtype == np.uint8 else 1.0
    return factor[:3].astype(np.float64) / scale


def _wavefront(source: ModelSource, name: str, material: Any, warnings: list[str], textures: TextureMemo) -> SurfaceDraft:
    """MTL: Kd is a (linear) reflectance, as the format says and Blender writes; Ns, a Blinn exponent, becomes a roughness.

    alpha^2 = 2 / (Ns + 2) for a microfacet distribution of the same width (Walter et al. 2007, sec. 5.2), and
    roughness = sqrt(alpha).
    """
    stated: dict[str, Any] = dict(material.kwargs)
    reflectance = _numbers(stated.get("kd"), 3) or [0.5, 0.5, 0.5]
    surface = SurfaceDraft(base_color_srgb=_triple(linear_to_srgb(np.array(reflectance))))
    specular, exponent = _numbers(stated.get("ks"), 3), _numbers(stated.get("ns"), 1)
    physical_roughness, metallic = _numbers(stated.get("pr"), 1), _numbers(stated.get("pm"), 1)
    if physical_roughness:
        surface.roughness = physical_roughness[0]
    elif specular is not None and not any(specular):
        surface.roughness = 1.0
    elif exponent:
        surface.roughness = (2.0 / (max(exponent[0], 0.0) + 2.0)) ** 0.25
    if metallic:
        surface.metallic = metallic[0]
    image = getattr(material, "image", None)
    if image is not None:
        # Writers leave Kd at 0 or 1 beside a texture as they please; the texture is taken as it is, like most readers do.
        _set_texture(surface, _texture(source, image, np.ones(3), textures))
    emission = _numbers(stated.get("ke"), 3)
    if emission and any(emission):
        surface.emissive_srgb = _triple(linear_to_srgb(np.array(emission)))
    opacity = _numbers(stated.get("d"), 1)
    if opacity and opacity[0] < 1:
        warnings.append(f"{source.file.name}: material {name!r} is transparent (d {opacity[0]:g}); it is drawn opaque.")
    return surface


def _numbers(stated: Any, count: int) -> list[float] | None:
    if stated is None:
        return None
    try:
        values = [float(value) for value in (stated if isinstance(stated, list | tuple) else [stated])]
    except (TypeError, ValueError):
        return None
    if len(values) == 1 and count == 3:
        values = values * 3
    return values[:count] if len(values) >= count and all(math.isfinite(value) for value in values) else None


def pixels_of(source: ModelSource, image: Any) -> NDArray[np.uint8]:
    """Return a PIL image as (rows, cols, 3) uint8; raises ModelError where it cannot be decoded."""
    cols, rows = image.size
    if rows * cols > MAX_TEXTURE_PIXELS:
        raise source.error(f"has a texture of {cols} x {rows} pixels", f"Scale it to at most {MAX_TEXTURE_PIXELS} pixels")
    try:
        return np.asarray(image.convert("RGB"), dtype=np.uint8).copy()
    except (OSError, ValueError, SyntaxError) as error:
        raise source.error(f"has a damaged texture ({error})", "Export the texture again") from error


def tinted(pixels: NDArray[np.uint8], linear_factor: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return an sRGB image times a linear colour factor."""
    if np.all(linear_factor == 1.0):
        return pixels
    levels = srgb_to_linear(np.arange(256) / 255.0)
    tables = np.round(linear_to_srgb(levels[:, None] * linear_factor[None, :]) * 255.0).astype(np.uint8)
    return np.stack([tables[pixels[..., channel], channel] for channel in range(3)], axis=-1)


def mean_srgb(pixels: NDArray[np.uint8]) -> tuple[float, float, float]:
    """Return the colour of the mean linear light of an sRGB image."""
    levels = srgb_to_linear(np.arange(256) / 255.0)
    means = [np.bincount(pixels[..., channel].ravel(), minlength=256) @ levels for channel in range(3)]
    return _triple(linear_to_srgb(np.array(means) / max(pixels[..., 0].size, 1)))


def _triple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    red, green, blue = values.tolist()
    return red, green, blue
