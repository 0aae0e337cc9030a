"""Two pixel sizes times four exposure times, written in Python: the same bytes as 04_exposure_pixel_sweep.yaml.

Run: python examples/04_exposure_pixel_sweep.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fullwell.pipeline import run_frame
from fullwell.schema import load_recipe
from fullwell.storage import LocalStore


def thing(name: str, kind: str, geometry: dict[str, Any], material: dict[str, Any], **step: Any) -> dict[str, Any]:
    return {"id": name, "class": kind, "geometry": geometry, "material": material, "transform": step}


def box(x_m: float, y_m: float, z_m: float) -> dict[str, Any]:
    return {"kind": "cube", "size_m": [x_m, y_m, z_m]}


def ball(radius_m: float) -> dict[str, Any]:
    return {"kind": "sphere", "radius_m": radius_m}


def matte(patch: str) -> dict[str, Any]:
    return {"kind": "diffuse", "reflectance": f"colorchecker:{patch}"}


def plastic(patch: str) -> dict[str, Any]:
    return {"kind": "rough_plastic", "reflectance": f"colorchecker:{patch}", "roughness": 0.15}


TABLE = {
    "id": "table",
    "class": "table",
    "geometry": {"kind": "rectangle", "size_m": [4, 4]},
    "material": {"kind": "diffuse", "reflectance": 0.4},
}
SLANT = {"axis": "y", "angle_deg": 5}
GREYS = ["neutral_8", "neutral_6_5", "neutral_5", "neutral_3_5"]

OBJECTS = [
    TABLE,
    thing("light_board", "edge", box(0.3, 0.02, 0.3), matte("white_9_5"), translate_m=[-0.14, 0.35, 0.15]),
    thing("dark_board", "edge", box(0.16, 0.02, 0.26), matte("black_2"), rotate_deg=SLANT, translate_m=[-0.2, 0.32, 0.15]),
    thing("red_ball", "ball", ball(0.07), plastic("red"), translate_m=[0.1, 0.12, 0.07]),
    thing("blue_ball", "ball", ball(0.045), plastic("blue"), translate_m=[-0.06, 0.02, 0.045]),
    thing(
        "metal_ball", "ball", ball(0.05), {"kind": "conductor", "metal": "Al", "roughness": 0.2}, translate_m=[0.22, 0.02, 0.05]
    ),
    *(
        thing(
            f"step_{step + 1}", "step", box(0.06, 0.02, 0.2), matte(grey), translate_m=[round(0.09 + 0.06 * step, 2), 0.35, 0.1]
        )
        for step, grey in enumerate(GREYS)
    ),
]

LIGHTS = [
    {"kind": "constant_environment", "name": "room", "group": "room", "illuminance_lux": 150, "spd": "d50"},
    {
        "kind": "area",
        "name": "window",
        "group": "window",
        "geometry": {"kind": "rectangle", "size_m": [0.8, 0.8]},
        "transform": {"look_at": {"origin_m": [-1.2, -0.8, 1.2], "target_m": [0, 0.2, 0]}},
        "luminance_cd_m2": 3000,
        "spd": "d65",
    },
]

RECIPE: dict[str, Any] = {
    "schema": "fullwell/recipe/v1",
    "name": "04-exposure-pixel-sweep",
    "seed": 4,
    "scene": {"classes": ["table", "edge", "ball", "step"], "objects": OBJECTS, "lights": LIGHTS},
    "cameras": [
        {
            "name": "main",
            "pose": {"origin_m": [0.02, -0.75, 0.32], "target_m": [0.04, 0.25, 0.1], "up": [0, 0, 1]},
            "lens": {"hfov_deg": 38, "f_number": 2},
            "sensors": [{"name": "main", "model": "imx363", "rows": 144, "cols": 192, "exposure": {"time_s": 0.01}}],
        }
    ],
    "vary": {
        "grid": {
            "cameras[0].sensors[0].pixel_pitch_m": [1.4e-6, 2.8e-6],
            "cameras[0].sensors[0].exposure.time_s": [0.004, 0.016, 0.064, 0.256],
        }
    },
    "outputs": ["image.png", "raw.npz", "raw.tiff", "labels.json", "instances.png"],
    "quality": {"noise_ratio": 1.0, "max_depth": 5},
}


def main(folder: Path = Path("out")) -> None:
    document = load_recipe(RECIPE)
    store = LocalStore(folder / document.name)
    for index in range(document.frame_count()):
        manifest = run_frame(document, index, store, f"frames/{index}")
        sensor = manifest["cameras"][0]["sensors"][0]
        print(f"{manifest['varied']}: {sensor['mean_electrons']:.0f} e-, {100 * sensor['saturated_fraction']:.1f} % saturated")


if __name__ == "__main__":
    main()
