"""Content keys of stages: equal keys, equal bytes. Threads, hosts and paths stay out; the renderer's version is in."""

from __future__ import annotations

import importlib.metadata

from fullwell.core.hashing import digest_of
from fullwell.schema.frame import CameraRig, FrameDescription

__all__ = ["KEY_SCHEMA", "frame_digest", "radiance_key"]

KEY_SCHEMA = 1
_RADIANCE_VERSION = 1
"""Raise it when the same recipe gives other radiances."""


def radiance_key(frame: FrameDescription, rig: CameraRig, *, variant: str) -> str:
    """Return the key of a camera's radiance image: all that decides its bytes, and nothing else.

    Two lenses that differ only in transmittance, or two pinholes that differ only in f-number, share their radiance; the
    index of the frame plays no part, so frames that vary only the sensor render once.
    """
    camera, lens = rig.camera, rig.camera.lens
    thin = lens.kind == "thin_lens"
    return digest_of(
        {
            "key_schema": KEY_SCHEMA,
            "stage": "radiance",
            "version": _RADIANCE_VERSION,
            "renderer": importlib.metadata.version("mitsuba"),
            "variant": variant,
            "scene": {"objects": frame.scene.objects, "lights": frame.scene.lights},
            "pose": camera.camera_to_world,
            "film": [camera.film.rows, camera.film.cols, camera.tangent_pitch],
            "pupil_m": lens.pupil_diameter_m if thin else 0.0,
            "focus_m": lens.focus_distance_m if thin else 0.0,
            "grid": frame.grid,
            "quality": frame.quality,
            "seed": frame.seed,
        }
    )


def frame_digest(frame: FrameDescription) -> str:
    """Return the digest of what a frame was asked to be: recipe, index and the versions that decide its bytes."""
    versions = {name: importlib.metadata.version(name) for name in ("fullwell", "mitsuba", "numpy")}
    return digest_of({"key_schema": KEY_SCHEMA, "recipe": frame.recipe_json, "index": frame.index, "versions": versions})
