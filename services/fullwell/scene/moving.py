"""A scene and a camera a moment before or after their own time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.scene.camera import Camera
from fullwell.scene.description import Light, SceneDescription
from fullwell.scene.motion import Motion

__all__ = ["camera_at", "scene_at"]


def scene_at(scene: SceneDescription, motions: Mapping[str, Motion], interval_s: float) -> SceneDescription:
    """Return the scene `interval_s` [s] later (negative: earlier).

    Objects move rigidly by `motions` {object id: motion}, with the lamps that they carry; the rest stays. Geometry, materials
    and spectra are those of `scene`, and so is the very object where nothing moves.
    """
    transforms = {name: motion.transform(interval_s) for name, motion in motions.items() if motion.moves}
    if interval_s == 0 or not transforms:
        return scene
    objects = tuple(
        replace(item, to_world=transforms[item.id] @ item.to_world) if item.id in transforms else item for item in scene.objects
    )
    lights = tuple(_carried(light, transforms) for light in scene.lights)
    return replace(scene, objects=objects, lights=lights)


_DIRECTIONS = ("direction", "forward", "up")


def _carried(light: Light, transforms: Mapping[str, NDArray[np.float64]]) -> Light:
    """Return a lamp where the object that carries it takes it."""
    matrix = transforms.get(getattr(light, "carrier", ""))
    if matrix is None:
        return light
    place = matrix @ np.array([*getattr(light, "position_m"), 1.0])  # noqa: B009 - only lamps with a place have a carrier
    changes: dict[str, Any] = {"position_m": tuple(place[:3].tolist())}
    for name in _DIRECTIONS:
        if hasattr(light, name):
            changes[name] = tuple((matrix[:3, :3] @ np.asarray(getattr(light, name), dtype=np.float64)).tolist())
    return replace(light, **changes)


def camera_at(camera: Camera, motion: Motion, interval_s: float) -> Camera:
    """Return the camera `interval_s` [s] later (negative: earlier)."""
    if interval_s == 0 or not motion.moves:
        return camera
    return replace(camera, camera_to_world=motion.transform(interval_s) @ camera.camera_to_world)
