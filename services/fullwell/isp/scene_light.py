"""The light of a scene, for white balance and colour matrix: estimated from its description, not from a picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache, lru_cache
from types import MappingProxyType
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from fullwell.radiometry import (
    MAX_WAVELENGTH_NM,
    MIN_WAVELENGTH_NM,
    SkyRadiance,
    Spectrum,
    WavelengthGrid,
    clear_sky,
    reflectance_from_linear_srgb,
)
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
    Cube,
    Cylinder,
    DirectionalLight,
    Disk,
    Geometry,
    GoniometricLight,
    ImageEnvironment,
    Light,
    Mesh,
    PointLight,
    Rectangle,
    SceneDescription,
    Sphere,
    SpotLight,
    SunSky,
)
from fullwell.scene.groups import sun_group

__all__ = ["point_of_interest_m", "scene_illuminant"]

_SKY_ROWS, _SKY_COLS = 32, 64
"""Enough for the sky's irradiance: within 0.03 % of that of the map that is rendered."""

_LOWEST_SUN_SINE = 1e-5
"""A sun exactly on the horizon is taken to be 2 arc seconds above, as in the picture."""

_NEAREST_M = 1e-3
"""A point nearer to a point light than this is taken to be this far away."""

_NO_OBJECTS_AHEAD_M = 1.0


def scene_illuminant(
    scene: SceneDescription, camera: Camera, group_weights: Mapping[str, float] = MappingProxyType({})
) -> Spectrum | None:
    """Return the light that a white card at the point the camera looks at gets, relative power, or None in the dark.

    The sum over all lights of the irradiance on a card that faces each of them, without shadows and without light that other
    surfaces reflect. Area lights count with the area that the point sees; where none is turned towards it, with a quarter of
    their area, as for rooms that are lit by way of the ceiling. Sun and sky are those of the picture: the sun on a card that
    faces it, and the sky on horizontal ground, each times its weight. `group_weights` are those of light groups in the picture,
    1 where they are not named.
    """
    point_m = point_of_interest_m(scene, camera)
    weighted = (_of_groups(light, group_weights) for light in scene.lights)
    total = sum((weight * _irradiance(light, point_m) for light, weight in weighted), np.zeros(_grid().count))
    direct, turned_away = np.zeros(_grid().count), np.zeros(_grid().count)
    for item in scene.objects:
        for part in item.parts:
            if part.emission is not None:
                radiance = _band_values(part.emission.radiance) * group_weights.get(part.emission.group, 1.0)
                facing, whole = _solid_angles_sr(part.geometry, item.to_world @ part.to_object, point_m)
                direct += radiance * facing
                turned_away += radiance * whole
    total = total + direct
    if not np.any(total > 0):
        total = turned_away
    if not np.any(total > 0):
        return None
    return Spectrum(
        _grid().centres_nm, total / np.max(total), outside="zero", unit="relative", source="the lights of the scene"
    )


def _of_groups(light: Light, weights: Mapping[str, float]) -> tuple[Light, float]:
    """Return a light with sun and sky weighted by their groups, and the weight of any other."""
    if not isinstance(light, SunSky):
        return light, weights.get(light.group, 1.0)
    sun = light.sun_weight * weights.get(sun_group(light), 1.0)
    return replace(light, sun_weight=sun, sky_weight=light.sky_weight * weights.get(light.group, 1.0)), 1.0


def point_of_interest_m(scene: SceneDescription, camera: Camera) -> NDArray[np.float64]:
    """Return the point that the camera looks at, (3,) [m]: on its axis, where it is focused.

    A camera that is focused at infinity looks as far as the median distance of the objects before it, 1 m where there are none.
    """
    origin, forward = camera.camera_to_world[:3, 3], camera.camera_to_world[:3, 2]
    distance_m = camera.lens.focus_distance_m
    if not math.isfinite(distance_m):
        places = np.array([item.to_world[:3, 3] for item in scene.objects]).reshape(-1, 3)
        ahead = (places - origin) @ forward
        ahead = ahead[ahead > 0]
        distance_m = float(np.median(ahead)) if ahead.size else _NO_OBJECTS_AHEAD_M
    return np.asarray(origin + distance_m * forward)


@cache
def _grid() -> WavelengthGrid:
    return WavelengthGrid(MIN_WAVELENGTH_NM, MAX_WAVELENGTH_NM, 1.0)


def _band_values(spectrum: Spectrum) -> NDArray[np.float64]:
    return spectrum.band_average(_grid())


def _irradiance(light: Light, point_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the irradiance on a card that faces the light, (bands,)."""
    match light:
        case PointLight():
            return _band_values(light.intensity) / _squared_distance_m2(light.position_m, point_m)
        case SpotLight():
            return (
                _band_values(light.intensity) * _spot_falloff(light, point_m) / _squared_distance_m2(light.position_m, point_m)
            )
        case GoniometricLight():
            return (
                _band_values(light.intensity) * _pattern_share(light, point_m) / _squared_distance_m2(light.position_m, point_m)
            )
        case DirectionalLight():
            return _band_values(light.irradiance)
        case ConstantEnvironment():
            return math.pi * _band_values(light.radiance)
        case ImageEnvironment():
            return math.pi * _band_values(light.radiance) * _picture_values(light)
        case SunSky():
            return _sun_and_sky(light)
        case _:
            assert_never(light)


def _squared_distance_m2(position_m: tuple[float, float, float], point_m: NDArray[np.float64]) -> float:
    return max(float(np.sum((point_m - np.array(position_m)) ** 2)), _NEAREST_M**2)


def _spot_falloff(light: SpotLight, point_m: NDArray[np.float64]) -> float:
    towards = point_m - np.array(light.position_m)
    axis = np.array(light.direction)
    cosine = float(towards @ axis / max(float(np.linalg.norm(towards) * np.linalg.norm(axis)), np.finfo(float).tiny))
    angle_deg = math.degrees(math.acos(min(1.0, max(-1.0, cosine))))
    return min(1.0, max(0.0, (light.cutoff_deg - angle_deg) / (light.cutoff_deg - light.beam_deg)))


def _pattern_share(light: GoniometricLight, point_m: NDArray[np.float64]) -> float:
    x, y, z = ((point_m - np.array(light.position_m)) @ light.frame()).tolist()
    azimuth, elevation = math.degrees(math.atan2(y, x)), math.degrees(math.atan2(z, math.hypot(x, y)))
    return float(light.pattern.share(azimuth, elevation))


def _picture_values(light: ImageEnvironment) -> NDArray[np.float64]:
    """Return the picture's mean over all directions as a factor, (bands,)."""
    rows = light.pixels.shape[0]
    solid_angle = np.sin((np.arange(rows) + 0.5) * np.pi / rows)
    mean = np.average(light.pixels.astype(np.float64).mean(axis=1), axis=0, weights=solid_angle)
    highest = float(np.max(mean))
    if not highest > 0:
        return np.zeros(_grid().count)
    return highest * _band_values(reflectance_from_linear_srgb((np.maximum(mean, 0.0) / highest).tolist()))


def _sun_and_sky(light: SunSky) -> NDArray[np.float64]:
    x, y, z = (value / math.hypot(*light.sun_direction) for value in light.sun_direction)
    sky = _clear_sky((x, y, max(_LOWEST_SUN_SINE, z)), float(light.turbidity), float(light.ground_albedo))
    irradiance = light.sun_weight * sky.sun_irradiance() + light.sky_weight * sky.sky_irradiance()
    return _band_values(Spectrum(sky.wavelength_nm, irradiance, outside="zero"))


@lru_cache(maxsize=4)
def _clear_sky(towards: tuple[float, float, float], turbidity: float, ground_albedo: float) -> SkyRadiance:
    """Return the sky, remembered: the frames of one recipe share it."""
    return clear_sky(towards, turbidity=turbidity, ground_albedo=ground_albedo, rows=_SKY_ROWS, cols=_SKY_COLS)


def _solid_angles_sr(geometry: Geometry, to_world: NDArray[np.float64], point_m: NDArray[np.float64]) -> tuple[float, float]:
    """Return the solid angle of a shape's front sides from a point, and that of a quarter of its area, each at most pi.

    A quarter of the area is the mean projection of a convex body over all directions (Cauchy). Far-field approximations: a
    card so close that a lamp fills its sky gets pi times the radiance.
    """
    centres_m, areas_m2 = _facets(geometry)
    centres_m = centres_m @ to_world[:3, :3].T + to_world[:3, 3]
    # Area vectors transform with the cofactor matrix.
    linear = to_world[:3, :3]
    cofactor = np.stack([np.cross(linear[1], linear[2]), np.cross(linear[2], linear[0]), np.cross(linear[0], linear[1])])
    areas_m2 = areas_m2 @ cofactor.T
    towards = point_m - centres_m
    squared = np.maximum(np.sum(towards**2, axis=1), _NEAREST_M**2)
    facing = np.maximum(np.sum(areas_m2 * towards, axis=1), 0.0) / squared**1.5
    quarter = 0.25 * np.linalg.norm(areas_m2, axis=1) / squared
    return min(float(np.sum(facing)), math.pi), min(float(np.sum(quarter)), math.pi)


def _facets(geometry: Geometry) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return centres (n, 3) [m] and area vectors along the normals (n, 3) [m^2] of flat pieces of a shape."""
    match geometry:
        case Rectangle():
            return np.zeros((1, 3)), np.array([[0.0, 0.0, geometry.size_m[0] * geometry.size_m[1]]])
        case Disk():
            return np.zeros((1, 3)), np.array([[0.0, 0.0, math.pi * geometry.radius_m**2]])
        case Cube():
            size = np.array(geometry.size_m)
            faces = np.concatenate([np.eye(3), -np.eye(3)])
            return faces * size / 2, faces * np.tile(np.prod(size) / size, 2)[:, None]
        case Sphere():
            # Six sides like a cube's whose sum along any direction is near the sphere's projection, pi r^2.
            faces = np.concatenate([np.eye(3), -np.eye(3)])
            return np.zeros((6, 3)), faces * (4.0 * math.pi * geometry.radius_m**2 / 6.0)
        case Cylinder():
            turn = 2.0 * math.pi * (np.arange(8) + 0.5) / 8
            around = np.stack([np.cos(turn), np.sin(turn), np.zeros(8)], axis=1)
            return around * geometry.radius_m, around * (2.0 * math.pi * geometry.radius_m * geometry.height_m / 8)
        case Mesh():
            corners = geometry.vertices_m[geometry.faces]
            areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0
            return corners.mean(axis=1), areas
        case _:
            assert_never(geometry)
