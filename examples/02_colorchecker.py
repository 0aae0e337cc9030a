"""A colour chart under three lights, written in Python: the same bytes as 02_colorchecker.yaml.

Run: python examples/02_colorchecker.py, then fullwell show out/02-colorchecker/frames/0
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fullwell.pipeline import run_frame
from fullwell.schema import load_recipe
from fullwell.storage import LocalStore

PATCHES = [
    ["dark_skin", "light_skin", "blue_sky", "foliage", "blue_flower", "bluish_green"],
    ["orange", "purplish_blue", "moderate_red", "purple", "yellow_green", "orange_yellow"],
    ["blue", "green", "red", "yellow", "magenta", "cyan"],
    ["white_9_5", "neutral_8", "neutral_6_5", "neutral_5", "neutral_3_5", "black_2"],
]
PITCH_M = 0.045


def patch(name: str, row: int, column: int) -> dict[str, Any]:
    x_m, y_m = (column - 2.5) * PITCH_M, (1.5 - row) * PITCH_M
    return {
        "id": name,
        "class": "patch",
        "geometry": {"kind": "rectangle", "size_m": [0.04, 0.04]},
        "material": {"kind": "diffuse", "reflectance": f"colorchecker:{name}"},
        "transform": {"translate_m": [round(x_m, 4), round(y_m, 4), 0.001]},
    }


BOARD = {
    "id": "board",
    "class": "board",
    "geometry": {"kind": "cube", "size_m": [0.29, 0.20, 0.004]},
    "material": {"kind": "diffuse", "reflectance": "colorchecker:black_2"},
    "transform": {"translate_m": [0, 0, -0.002]},
}

RECIPE: dict[str, Any] = {
    "schema": "fullwell/recipe/v1",
    "name": "02-colorchecker",
    "seed": 2,
    "scene": {
        "classes": ["patch", "board"],
        "objects": [BOARD, *(patch(name, row, column) for row, line in enumerate(PATCHES) for column, name in enumerate(line))],
        "lights": [
            {"kind": "directional", "name": "lamp", "direction": [1, 0, -1], "illuminance_lux": 1000, "spd": "d65"},
        ],
    },
    "cameras": [
        {
            "name": "main",
            "pose": {"origin_m": [0, 0, 0.6], "target_m": [0, 0, 0], "up": [0, 1, 0]},
            "lens": {"hfov_deg": 28, "f_number": 2.8},
            "sensors": [
                {
                    "name": "main",
                    "model": "imx363",
                    "rows": 240,
                    "cols": 320,
                    "exposure": {"time_s": 0.06},
                    "isp": {"illuminant": "d65"},
                }
            ],
        }
    ],
    "vary": {"grid": {"scene.lights[0].spd": ["d65", "a", "fl11"]}},
    "outputs": ["image.png", "raw.npz", "radiance.exr", "instances.png", "semantic.png", "labels.json"],
    "quality": {"noise_ratio": 0.5, "max_depth": 2},
}


def main(folder: Path = Path("out")) -> None:
    document = load_recipe(RECIPE)
    store = LocalStore(folder / document.name)
    for index in range(document.frame_count()):
        run_frame(document, index, store, f"frames/{index}")


if __name__ == "__main__":
    main()
