"""The Cornell box, written in Python: the same bytes as 01_cornell_box.yaml.

Run: python examples/01_cornell_box.py, then fullwell show out/01-cornell-box
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fullwell.pipeline import run_frame
from fullwell.schema import load_recipe
from fullwell.storage import LocalStore

WHITE = [
    0.189, 0.255, 0.423, 0.660, 0.811, 0.862, 0.877, 0.884, 0.891, 0.896, 0.899, 0.904,
    0.907, 0.909, 0.911, 0.910, 0.911, 0.914, 0.913, 0.916, 0.915, 0.916, 0.914, 0.915,
    0.918, 0.919, 0.921, 0.923, 0.924, 0.922, 0.922, 0.925, 0.927, 0.930, 0.930, 0.933,
]  # fmt: skip
RED = [
    0.050, 0.049, 0.048, 0.047, 0.047, 0.047, 0.047, 0.047, 0.046, 0.045, 0.044, 0.044,
    0.045, 0.046, 0.047, 0.048, 0.049, 0.050, 0.054, 0.060, 0.072, 0.104, 0.178, 0.312,
    0.467, 0.581, 0.644, 0.675, 0.690, 0.698, 0.706, 0.715, 0.724, 0.730, 0.734, 0.738,
]  # fmt: skip
GREEN = [
    0.052, 0.053, 0.054, 0.055, 0.057, 0.059, 0.061, 0.066, 0.075, 0.093, 0.125, 0.178,
    0.246, 0.307, 0.337, 0.334, 0.317, 0.293, 0.262, 0.230, 0.198, 0.165, 0.135, 0.115,
    0.104, 0.098, 0.094, 0.092, 0.093, 0.097, 0.102, 0.108, 0.113, 0.115, 0.114, 0.114,
]  # fmt: skip


def paint(patch: str, values: list[float]) -> dict[str, Any]:
    source = f"measured ColorChecker patch {patch}, as tabulated with pbrt-v4"
    return {
        "kind": "diffuse",
        "reflectance": {"source": source, "wavelength_nm": list(range(380, 731, 10)), "values": values},
    }


def wall(name: str, material: str, corners_m: list[list[float]]) -> dict[str, Any]:
    return {"id": name, "class": "room", "geometry": {"kind": "quad", "corners_m": corners_m}, "material": material}


def block(name: str, size_m: list[float], angle_deg: float, centre_m: list[float]) -> dict[str, Any]:
    return {
        "id": name,
        "class": "block",
        "geometry": {"kind": "cube", "size_m": size_m},
        "material": "white",
        "transform": {"rotate_deg": {"axis": "z", "angle_deg": angle_deg}, "translate_m": centre_m},
    }


LAMP = {
    "kind": "area",
    "name": "lamp",
    "class": "lamp",
    "geometry": {"kind": "rectangle", "size_m": [0.5, 0.5]},
    "transform": {"rotate_deg": {"axis": "x", "angle_deg": 180}, "translate_m": [0, -0.01, 0.99]},
    "luminance_cd_m2": 1464.17,
    "spd": "blackbody:3000K",
}

RECIPE: dict[str, Any] = {
    "schema": "fullwell/recipe/v1",
    "name": "01-cornell-box",
    "seed": 1,
    "scene": {
        "materials": {"white": paint("white (.05)", WHITE), "red": paint("red", RED), "green": paint("green", GREEN)},
        "classes": ["room", "block", "lamp"],
        "objects": [
            wall("floor", "white", [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]]),
            wall("ceiling", "white", [[-1, 1, 1], [1, 1, 1], [1, -1, 1], [-1, -1, 1]]),
            wall("back", "white", [[-1, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]]),
            wall("left", "red", [[-1, -1, -1], [-1, 1, -1], [-1, 1, 1], [-1, -1, 1]]),
            wall("right", "green", [[1, 1, -1], [1, -1, -1], [1, -1, 1], [1, 1, 1]]),
            block("short_block", [0.6, 0.6, 0.6], -17, [0.335, -0.38, -0.7]),
            block("tall_block", [0.6, 0.6, 1.2], 18.25, [-0.33, 0.28, -0.4]),
        ],
        "lights": [LAMP],
    },
    "cameras": [
        {
            "name": "main",
            "pose": {"origin_m": [0, -3.9, 0], "target_m": [0, 0, 0], "up": [0, 0, 1]},
            "lens": {"hfov_deg": 39.3, "f_number": 2},
            "sensors": [
                {
                    "name": "main",
                    "model": "imx363",
                    "rows": 288,
                    "cols": 288,
                    "exposure": {"auto": {"method": "percentile", "percentile": 97, "level": 0.7}},
                    "isp": {"illuminant": "blackbody:3000K"},
                }
            ],
        }
    ],
    "outputs": [
        "image.png", "raw.npz", "radiance.exr", "depth.exr", "normals.exr", "instances.png", "semantic.png", "labels.json",
    ],
    "quality": {"noise_ratio": 1.0, "max_depth": 8},
}  # fmt: skip


def main(folder: Path = Path("out")) -> None:
    document = load_recipe(RECIPE)
    store = LocalStore(folder / document.name)
    for index in range(document.frame_count()):
        run_frame(document, index, store, f"frames/{index}")


if __name__ == "__main__":
    main()
