"""Lights of a recipe to absolute spectra."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from fullwell.radiometry import Spectrum, clear_sky, illuminance_lux
from fullwell.radiometry.overcast import (
    DARKEST_TWILIGHT_DEG,
    overcast_illuminance_lux,
    overcast_shares,
    twilight_illuminance_lux,
)
from fullwell.scene import (
    ConstantEnvironment,
    Diffuse,
    DirectionalLight,
    ImageEnvironment,
    Light,
    Part,
    PointLight,
    SceneObject,
    SpotLight,
    SunSky,
)
from fullwell.schema.conversion.context import Context, fail, located
from fullwell.schema.conversion.geometry import geometry_of, surface_area_m2, transform_of
from fullwell.schema.conversion.materials import RADIANCE_UNIT, emission_of
from fullwell.schema.conversion.pictures import read_linear_rgb
from fullwell.schema.conversion.solar import sun_angles_deg
from fullwell.schema.conversion.spectra import absolute, luminous
from fullwell.schema.v1 import lights as documents

__all__ = ["area_light_object", "light_of", "spot_solid_angle_sr"]

_INTENSITY_UNIT = "W sr^-1 nm^-1"
_IRRADIANCE_UNIT = "W m^-2 nm^-1"
_SKY_MODEL_NM = (350.0, 1040.0)
"""The range of `radiometry.clear_sky`."""

_BLACK = Diffuse(Spectrum.constant(0.0))


def area_light_object(document: documents.AreaLight, path: str, context: Context) -> SceneObject:
    """Return the black emitting object that an area light is; its id is the light's name."""
    geometry = geometry_of(document.geometry, f"{path}.geometry")
    to_world = transform_of(document.transform, f"{path}.transform")
    emission = emission_of(document, path, context, area_m2=surface_area_m2(geometry, to_world))
    part = Part(geometry, _BLACK, emission=emission)
    return SceneObject(document.name, document.semantic_class, (part,), to_world)


def light_of(document: Any, path: str, context: Context) -> Light:
    """Return any light but an area light."""
    match document:
        case documents.PointLightDocument():
            intensity = _intensity(document, path, context, solid_angle_sr=4 * math.pi)
            return PointLight(document.position_m, intensity, document.group)
        case documents.SpotLightDocument():
            return _spot(document, path, context)
        case documents.DirectionalLightDocument():
            if document.irradiance_w_m2_nm is not None:
                irradiance = absolute(document.irradiance_w_m2_nm, f"{path}.irradiance_w_m2_nm", _IRRADIANCE_UNIT, context)
            else:
                irradiance = luminous(document, "illuminance_lux", path, _IRRADIANCE_UNIT, context)
            return DirectionalLight(_unit(document.direction), irradiance, document.group)
        case documents.ConstantEnvironmentLight():
            return ConstantEnvironment(_sky_radiance(document, path, context), document.group)
        case documents.ImageEnvironmentLight():
            return _image(document, path, context)
        case documents.OvercastSkyLight():
            return _overcast(document, path, context)
        case documents.SunSkyLight():
            return _sun_sky(document, path, context)
        case _:
            raise TypeError(f"{type(document).__name__} is not a light")


def _unit(direction: tuple[float, float, float]) -> tuple[float, float, float]:
    vector = np.array(direction, dtype=np.float64)
    vector /= np.abs(vector).max()
    x, y, z = (vector / np.linalg.norm(vector)).tolist()
    return x, y, z


def _intensity(document: Any, path: str, context: Context, *, solid_angle_sr: float) -> Spectrum:
    if document.intensity_w_sr_nm is not None:
        return absolute(document.intensity_w_sr_nm, f"{path}.intensity_w_sr_nm", _INTENSITY_UNIT, context)
    if document.luminous_intensity_cd is not None:
        return luminous(document, "luminous_intensity_cd", path, _INTENSITY_UNIT, context)
    return luminous(document, "luminous_flux_lm", path, _INTENSITY_UNIT, context, per=solid_angle_sr)


def spot_solid_angle_sr(beam_deg: float, cutoff_deg: float) -> float:
    """Return flux / axial intensity [sr] of a spot: full within `beam_deg`, linear in angle to 0 at `cutoff_deg`.

    2 pi times the integral of falloff(t) sin t dt from 0 to the cutoff c: 1 - (sin c - sin b) / (c - b).
    """
    beam, cutoff = math.radians(beam_deg), math.radians(cutoff_deg)
    return 2 * math.pi * (1 - (math.sin(cutoff) - math.sin(beam)) / (cutoff - beam))


def _spot(document: documents.SpotLightDocument, path: str, context: Context) -> SpotLight:
    if document.direction is not None:
        direction = _unit(document.direction)
    else:
        target = document.target_m or document.position_m
        x, y, z = (b - a for a, b in zip(document.position_m, target, strict=True))
        direction = _unit((x, y, z))
    solid_angle_sr = spot_solid_angle_sr(document.beam_deg, document.cutoff_deg)
    intensity = _intensity(document, path, context, solid_angle_sr=solid_angle_sr)
    return SpotLight(document.position_m, direction, intensity, document.beam_deg, document.cutoff_deg, document.group)


def _sky_radiance(document: Any, path: str, context: Context) -> Spectrum:
    """A uniform sky of radiance L gives an unshaded plane the irradiance pi L."""
    if document.radiance_w_sr_m2_nm is not None:
        return absolute(document.radiance_w_sr_m2_nm, f"{path}.radiance_w_sr_m2_nm", RADIANCE_UNIT, context)
    if document.luminance_cd_m2 is not None:
        return luminous(document, "luminance_cd_m2", path, RADIANCE_UNIT, context)
    return luminous(document, "illuminance_lux", path, RADIANCE_UNIT, context, per=math.pi)


def _image(document: documents.ImageEnvironmentLight, path: str, context: Context) -> ImageEnvironment:
    file, digest = context.files.find(document.file, f"{path}.file")
    context.used_files[document.file] = digest
    with located(f"{path}.file"):
        pixels = read_linear_rgb(file)
    context.warn(f"{path}.file: the colours of a picture are RGB; their spectra are made up.")
    return ImageEnvironment(pixels, _sky_radiance(document, path, context), document.azimuth_deg, document.group)


_OVERCAST_ROWS = 512


def _overcast(document: documents.OvercastSkyLight, path: str, context: Context) -> ImageEnvironment:
    if document.luminance_cd_m2 is not None:
        zenith = luminous(document, "luminance_cd_m2", path, RADIANCE_UNIT, context)
    else:
        lux = document.illuminance_lux
        if lux is None:
            lux = overcast_illuminance_lux(_overcast_elevation_deg(document, path))
        stated = document.model_copy(update={"illuminance_lux": lux})
        zenith = luminous(stated, "illuminance_lux", path, RADIANCE_UNIT, context, per=7.0 * math.pi / 9.0)
    shares = overcast_shares(_OVERCAST_ROWS).astype(np.float32)
    pixels = np.broadcast_to(shares[:, None, None], (_OVERCAST_ROWS, 2, 3)).copy()
    return ImageEnvironment(pixels, zenith, group=document.group)


def _overcast_elevation_deg(document: documents.OvercastSkyLight, path: str) -> float:
    if document.sun_elevation_deg is not None:
        return document.sun_elevation_deg
    elevation_deg, _ = _sun_at(document, path)
    if elevation_deg < 0:
        fail(
            f"{path}.time_utc",
            f"is {document.time_utc!r}, when the sun is {-elevation_deg:.1f} deg below the horizon; give illuminance_lux, or "
            "take another.",
            document.time_utc,
        )
    return elevation_deg


def _sun_sky(document: documents.SunSkyLight, path: str, context: Context) -> SunSky:
    low_nm, high_nm = (float(context.grid.edges_nm[end]) for end in (0, -1))
    if low_nm < _SKY_MODEL_NM[0] or high_nm > _SKY_MODEL_NM[1]:
        fail(
            "spectral.step_nm",
            f"is {context.grid.step_nm:g}, so the bands cover {low_nm:g} to {high_nm:g} nm, but {path} is a sun_sky, which is "
            f"known from {_SKY_MODEL_NM[0]:g} to {_SKY_MODEL_NM[1]:g} nm. Make the bands narrower, or use another light.",
            context.grid.step_nm,
        )
    elevation_deg, azimuth_deg = _sun_angles(document, path)
    elevation, azimuth = math.radians(max(elevation_deg, 0.0)), math.radians(azimuth_deg)
    sun = _unit((math.cos(elevation) * math.sin(azimuth), math.cos(elevation) * math.cos(azimuth), math.sin(elevation)))
    light = SunSky(
        sun,
        document.turbidity,
        document.ground_albedo,
        document.sun_weight,
        document.sky_weight,
        group=document.group,
        sun_group=document.sun_group or "",
    )
    return light if elevation_deg > 0 else _twilight(light, elevation_deg)


def _twilight(light: SunSky, elevation_deg: float) -> SunSky:
    """Return the sky of a sun on the horizon, as bright as it is with the sun below it, and no sun."""
    sky = clear_sky(light.sun_direction, turbidity=light.turbidity, ground_albedo=light.ground_albedo)
    sunset_lux = illuminance_lux(Spectrum(sky.wavelength_nm, sky.sky_irradiance(), outside="zero"))
    left = twilight_illuminance_lux(elevation_deg, at_sunset_lux=sunset_lux) / sunset_lux
    return replace(light, sun_weight=0.0, sky_weight=light.sky_weight * left)


def _sun_angles(document: documents.SunSkyLight, path: str) -> tuple[float, float]:
    if document.sun_elevation_deg is not None and document.sun_azimuth_deg is not None:
        return document.sun_elevation_deg, document.sun_azimuth_deg
    elevation_deg, azimuth_deg = _sun_at(document, path)
    if elevation_deg < DARKEST_TWILIGHT_DEG:
        fail(
            f"{path}.time_utc",
            f"is {document.time_utc!r}, when the sun is {-elevation_deg:.1f} deg below the horizon: night, from "
            f"{-DARKEST_TWILIGHT_DEG:g} deg on. Take another, or leave the light out.",
            document.time_utc,
        )
    return elevation_deg, azimuth_deg


def _sun_at(document: documents.SunSkyLight | documents.OvercastSkyLight, path: str) -> tuple[float, float]:
    """Return elevation and azimuth [deg] of the sun at a document's time and place."""
    text = str(document.time_utc)
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        fail(f"{path}.time_utc", f"is {text!r}; must be a time such as 2024-06-21T10:30:00Z.", text)
    time = time.replace(tzinfo=UTC) if time.tzinfo is None else time
    return sun_angles_deg(time, latitude_deg=document.latitude_deg or 0.0, longitude_deg=document.longitude_deg or 0.0)
