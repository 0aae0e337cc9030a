"""Content keys of stages: equal keys, equal bytes. Threads, hosts and paths stay out; the renderer's version is in."""

from __future__ import annotations

import importlib.metadata

from fullwell.core.hashing import digest_of
from fullwell.pipeline.lighting import LightPlan
from fullwell.schema.frame import CameraRig, FrameDescription

__all__ = ["KEY_SCHEMA", "frame_digest", "light_key"]

KEY_SCHEMA = 1
_RADIANCE_VERSION = 3
"""Raise it when the same recipe gives other radiances."""


def light_key(frame: FrameDescription, rig: CameraRig, plan: LightPlan, *, variant: str) -> str:
    """Return the key of a camera's rendered light: all that decides its bytes, and nothing else.

    The index of the frame plays no part, and what frames of a recipe vary of sensors and weights of light groups is in the
    plan of all of them alike, so frames that vary only that render once.
    """
    camera, lens = rig.camera, rig.camera.lens
    thin = lens.kind == "thin_lens"
    return digest_of(
        {
            "key_schema": KEY_SCHEMA,
            "stage": "light",
            "version": _RADIANCE_VERSION,
            "renderer": importlib.metadata.version("mitsuba"),
            "variant": variant,
            "scene": {"objects": plan.scene.objects, "lights": plan.scene.lights, "fog": plan.scene.fog},
            "pose": camera.camera_to_world,
            "film": [camera.film.rows, camera.film.cols, camera.tangent_pitch],
            "pupil_m": lens.pupil_diameter_m if thin else 0.0,
            "focus_m": lens.focus_distance_m if thin else 0.0,
            "grid": frame.grid,
            "plan": plan.identity,
            "seed": frame.seed,
        }
    )


def frame_digest(frame: FrameDescription, *, skip: bool = True) -> str:
    """Return the digest of what a frame was asked to be: recipe, index and the versions that decide its bytes.

    A frame of which nothing was left out (`skip` false) is another one.
    """
    versions = {name: importlib.metadata.version(name) for name in ("fullwell", "mitsuba", "numpy")}
    return digest_of(
        {"key_schema": KEY_SCHEMA, "recipe": frame.recipe_json, "index": frame.index, "versions": versions}
        | ({} if skip else {"skip": False})
    )
