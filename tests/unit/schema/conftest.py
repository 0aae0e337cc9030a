"""A small legal recipe, made afresh for each test."""

from __future__ import annotations

from typing import Any

import pytest


@pytest.fixture
def recipe() -> dict[str, Any]:
    """A ball under a sky, seen by one sensor."""
    return {
        "schema": "fullwell/recipe/v1",
        "name": "ball",
        "seed": 3,
        "scene": {
            "materials": {"paint": {"kind": "diffuse", "reflectance": 0.5}},
            "objects": [
                {
                    "id": "ball",
                    "class": "ball",
                    "geometry": {"kind": "sphere", "radius_m": 0.1},
                    "transform": {"translate_m": [0.0, 0.0, 0.1]},
                    "material": "paint",
                }
            ],
            "lights": [{"name": "sky", "kind": "constant_environment", "luminance_cd_m2": 100.0, "spd": "d65"}],
        },
        "cameras": [
            {
                "name": "front",
                "pose": {"origin_m": [0.0, -1.0, 0.1], "target_m": [0.0, 0.0, 0.1]},
                "lens": {"kind": "pinhole", "f_number": 2.0, "hfov_deg": 40.0},
                "sensors": [
                    {"name": "wide", "model": "ideal-mono", "rows": 48, "cols": 64, "exposure": {"time_s": 0.01}},
                ],
            }
        ],
        "outputs": ["raw.npz", "image.png"],
        "quality": {"samples_per_pixel": 16},
    }
