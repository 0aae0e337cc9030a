"""Draw the figure of the page on motion beside this file (python docs/physics/figures/draw_motion.py). Needs matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from fullwell.dataset import encode
from fullwell.pipeline import render_frame
from fullwell.schema import build_frame, load_recipe
from fullwell.storage import LocalStore

mpl.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
ROWS, COLS = 144, 240
SPEED_M_S = 12.0


def post(number: int) -> dict[str, Any]:
    """A striped post at the side of the road."""
    parts = [
        {
            "geometry": {"kind": "cube", "size_m": [0.12, 0.12, 0.2]},
            "transform": {"translate_m": [0, 0, 0.1 + 0.2 * k]},
            "material": "red" if k % 2 else "white",
        }
        for k in range(6)
    ]
    place = [-7.0 + 2.0 * number, 5.5 + 0.4 * (number % 2), 0]
    return {"id": f"post{number}", "class": "post", "parts": parts, "transform": {"translate_m": place}}


def car(name: str, x_m: float, y_m: float, colour: str, velocity_m_s: float) -> dict[str, Any]:
    """A car of boxes and wheels, along x."""
    boxes = (([4.0, 1.7, 0.6], [0, 0, 0.6], colour), ([2.0, 1.5, 0.6], [-0.3, 0, 1.2], "white"))
    body = [
        {"geometry": {"kind": "cube", "size_m": size}, "transform": {"translate_m": place}, "material": paint}
        for size, place, paint in boxes
    ]
    wheels = [
        {
            "geometry": {"kind": "cylinder", "radius_m": 0.33, "height_m": 0.2},
            "transform": [{"rotate_deg": {"axis": "x", "angle_deg": 90}}, {"translate_m": [x, -0.8, 0.33]}],
            "material": "black",
        }
        for x in (-1.25, 1.25)
    ]
    motion = {"velocity_m_s": [velocity_m_s, 0, 0]}
    return {"id": name, "class": "car", "parts": body + wheels, "transform": {"translate_m": [x_m, y_m, 0]}, "motion": motion}


def recipe(*, camera_m_s: float, time_s: float, line_time_s: float = 0.0) -> dict[str, Any]:
    """A camera beside a road: one car drives to the right, one to the left, posts stand before a wall."""
    return {
        "schema": "fullwell/recipe/v1",
        "name": "motion",
        "seed": 5,
        "scene": {
            "materials": {
                "red": {"kind": "diffuse", "reflectance": "colorchecker:red"},
                "blue": {"kind": "diffuse", "reflectance": "colorchecker:blue"},
                "white": {"kind": "diffuse", "reflectance": 0.8},
                "black": {"kind": "diffuse", "reflectance": 0.05},
            },
            "objects": [
                {
                    "id": "ground",
                    "geometry": {"kind": "rectangle", "size_m": [200, 200]},
                    "material": {"kind": "diffuse", "reflectance": 0.25},
                },
                car("right", -1.6, 2.0, "red", SPEED_M_S),
                car("left", 2.6, 4.2, "blue", -SPEED_M_S),
                *(post(number) for number in range(8)),
            ],
            "lights": [{"name": "sky", "kind": "sun_sky", "sun_elevation_deg": 40, "sun_azimuth_deg": 150}],
        },
        "cameras": [
            {
                "name": "main",
                "pose": {
                    "origin_m": [0, -5, 1.6],
                    "target_m": [0, 3, 0.9],
                    "motion": {"velocity_m_s": [camera_m_s, 0, 0]},
                },
                # A grey filter lets daylight through for as long as that.
                "lens": {"hfov_deg": 58, "f_number": 4, "transmittance": min(1.0, 3e-4 / time_s)},
                "sensors": [
                    {
                        "name": "main",
                        "model": "imx363",
                        "rows": ROWS,
                        "cols": COLS,
                        "pixel_pitch_m": 4e-6,
                        "line_time_s": line_time_s,
                        "exposure": {"time_s": time_s},
                    }
                ],
            }
        ],
        "outputs": ["image.png"],
        "quality": {"samples_per_pixel": 96, "max_depth": 4},
    }


CASES = (
    ("camera at rest, 20 ms", {"camera_m_s": 0.0, "time_s": 0.02}),
    ("camera at the red car's speed, 20 ms", {"camera_m_s": SPEED_M_S, "time_s": 0.02}),
    ("camera at rest, 1 ms, rows read out within 57 ms", {"camera_m_s": 0.0, "time_s": 1e-3, "line_time_s": 4e-4}),
)


def picture(case: dict[str, float], store: LocalStore, name: str) -> tuple[NDArray[np.uint8], str]:
    """Return a frame's picture and how it was made."""
    manifest = render_frame(build_frame(load_recipe(recipe(**case))), store, name)
    motion = manifest["cameras"][0]["radiance"]["motion"]
    pixels = encode.decode_rgb_png(store.get(f"{name}/image.png"))
    return pixels, f"{motion['moments']} moments of up to {motion['step_px']:.2g} px"


def draw(folder: Path) -> None:
    figure, axes = plt.subplots(1, len(CASES), figsize=(12, 2.9), layout="constrained")
    for number, (axis, (title, case)) in enumerate(zip(axes, CASES, strict=True)):
        pixels, how = picture(case, LocalStore(folder), f"case{number}")
        axis.imshow(pixels, interpolation="nearest")
        axis.set_title(title, fontsize=9)
        axis.set_xlabel(how, fontsize=8)
        axis.set_xticks([])
        axis.set_yticks([])
    figure.savefig(HERE / "motion.png", dpi=90, metadata={"Software": None})
    plt.close(figure)


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        draw(Path(folder))
