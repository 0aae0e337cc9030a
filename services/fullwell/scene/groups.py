"""Light groups of a scene: the names that its lamps go by."""

from __future__ import annotations

from dataclasses import replace

from fullwell.scene.description import Light, SceneDescription, SceneObject, SunSky

__all__ = ["group_names", "only_groups", "sun_group"]


def group_names(scene: SceneDescription) -> tuple[str, ...]:
    """Return the names of a scene's light groups, in alphabetical order; "default" where it has no lights."""
    of_surfaces = {part.emission.group for item in scene.objects for part in item.parts if part.emission is not None}
    of_suns = {sun_group(light) for light in scene.lights if isinstance(light, SunSky)}
    return tuple(sorted(of_surfaces | of_suns | {light.group for light in scene.lights})) or ("default",)


def sun_group(light: SunSky) -> str:
    """Return the group of the sun's disk: that of the sky, unless it has its own."""
    return light.sun_group or light.group


def only_groups(scene: SceneDescription, names: frozenset[str]) -> SceneDescription:
    """Return the scene with the lamps of some groups; the others stay as dark bodies."""
    objects = tuple(_with_lamps_of(item, names) for item in scene.objects)
    lights = (_light_of(light, names) for light in scene.lights)
    return replace(scene, objects=objects, lights=tuple(light for light in lights if light is not None))


def _light_of(light: Light, names: frozenset[str]) -> Light | None:
    """Return what of a light is in the groups; None where nothing is."""
    if not isinstance(light, SunSky) or sun_group(light) == light.group:
        return light if light.group in names else None
    if light.group in names:
        return light if sun_group(light) in names else replace(light, sun_weight=0.0)
    return replace(light, sky_weight=0.0) if sun_group(light) in names else None


def _with_lamps_of(item: SceneObject, names: frozenset[str]) -> SceneObject:
    if all(part.emission is None or part.emission.group in names for part in item.parts):
        return item
    parts = (
        part if part.emission is None or part.emission.group in names else replace(part, emission=None) for part in item.parts
    )
    return replace(item, parts=tuple(parts))
