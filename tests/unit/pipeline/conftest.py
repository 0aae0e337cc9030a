"""A small scene that every pipeline test starts from."""

from __future__ import annotations

from typing import Any

import pytest


@pytest.fixture
def recipe() -> dict[str, Any]:
    """A ball on a floor under a uniform sky, 24 x 16 pixels: a second to render, all products."""
    return {
        "schema": "fullwell/recipe/v1",
        "name": "ball",
        "seed": 3,
        "scene": {
            "objects": [
                {
                    "id": "floor",
                    "class": "ground",
                    "geometry": {"kind": "rectangle", "size_m": [20, 20]},
                    "material": {"kind": "diffuse", "reflectance": 0.3},
                },
                {
                    "id": "ball",
                    "class": "ball",
                    "geometry": {"kind": "sphere", "radius_m": 0.5},
                    "transform": {"translate_m": [0, 0, 0.5]},
                    "material": {"kind": "diffuse", "reflectance": "colorchecker:red"},
                },
            ],
            "lights": [{"name": "sky", "kind": "constant_environment", "luminance_cd_m2": 1000, "spd": "D65"}],
        },
        "cameras": [
            {
                "name": "main",
                "pose": {"origin_m": [4, -4, 2], "target_m": [0, 0, 0.5]},
                "lens": {"kind": "thin_lens", "hfov_deg": 30, "f_number": 2},
                "sensors": [
                    {"name": "phone", "model": "imx363", "rows": 16, "cols": 24, "exposure": {"time_s": 0.005}},
                ],
            }
        ],
        "outputs": [
            "image.png",
            "raw.npz",
            "raw.tiff",
            "radiance.exr",
            "irradiance.exr",
            "depth.exr",
            "normals.exr",
            "instances.png",
            "semantic.png",
            "labels.json",
        ],
        "quality": {"samples_per_pixel": 8, "max_depth": 4},
    }
