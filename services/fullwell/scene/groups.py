"""Light groups of a scene: the names that its lamps go by."""

from __future__ import annotations

from dataclasses import replace

from fullwell.scene.description import SceneDescription, SceneObject

__all__ = ["group_names", "only_groups"]


def group_names(scene: SceneDescription) -> tuple[str, ...]:
    """Return the names of a scene's light groups, in alphabetical order; "default" where it has no lights."""
    of_surfaces = {part.emission.group for item in scene.objects for part in item.parts if part.emission is not None}
    return tuple(sorted(of_surfaces | {light.group for light in scene.lights})) or ("default",)


def only_groups(scene: SceneDescription, names: frozenset[str]) -> SceneDescription:
    """Return the scene with the lamps of some groups; the others stay as dark bodies."""
    objects = tuple(_with_lamps_of(item, names) for item in scene.objects)
    return replace(scene, objects=objects, lights=tuple(light for light in scene.lights if light.group in names))


def _with_lamps_of(item: SceneObject, names: frozenset[str]) -> SceneObject:
    if all(part.emission is None or part.emission.group in names for part in item.parts):
        return item
    parts = (
        part if part.emission is None or part.emission.group in names else replace(part, emission=None) for part in item.parts
    )
    return replace(item, parts=tuple(parts))
