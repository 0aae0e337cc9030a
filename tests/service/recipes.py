"""Recipes that render in a fraction of a second."""

from __future__ import annotations

from typing import Any

__all__ = ["tiny_recipe"]


def tiny_recipe(frames: int = 1, **changes: Any) -> dict[str, Any]:
    """Return two balls in a lit room, 32 x 24 pixels at 4 samples, repeated with other noise for several frames."""
    recipe: dict[str, Any] = {
        "schema": "fullwell/recipe/v1",
        "name": "two balls",
        "seed": 5,
        "scene": {
            "objects": [
                {
                    "id": "floor",
                    "class": "room",
                    "geometry": {"kind": "rectangle", "size_m": [4, 4]},
                    "material": {"kind": "diffuse", "reflectance": 0.5},
                },
                {
                    "id": "red",
                    "class": "ball",
                    "geometry": {"kind": "sphere", "radius_m": 0.4},
                    "transform": {"translate_m": [0.5, 0, 0.4]},
                    "material": {"kind": "diffuse", "reflectance": "colorchecker:red"},
                },
                {
                    "id": "green",
                    "class": "ball",
                    "geometry": {"kind": "sphere", "radius_m": 0.4},
                    "transform": {"translate_m": [-0.5, 0, 0.4]},
                    "material": {"kind": "diffuse", "reflectance": "colorchecker:green"},
                },
            ],
            "lights": [{"name": "sky", "kind": "constant_environment", "luminance_cd_m2": 1000, "spd": "D65"}],
        },
        "cameras": [
            {
                "name": "main",
                "pose": {"origin_m": [0, -4, 2], "target_m": [0, 0, 0.4]},
                "lens": {"kind": "thin_lens", "hfov_deg": 40, "f_number": 2},
                "sensors": [{"name": "phone", "model": "imx363", "rows": 24, "cols": 32, "exposure": {"time_s": 0.005}}],
            }
        ],
        "outputs": ["image.png", "labels.json"],
        "quality": {"samples_per_pixel": 4, "max_depth": 3},
        "vary": {"repeat": frames},
    }
    return recipe | changes
