"""One walker at exact distances before two sensors, written in Python: the same bytes as 13_range_study.yaml.

Draws from this machine's asset store; take the starter library in first: fullwell assets starter --approve
Run: python examples/13_range_study.py, then fullwell show out/13-range-study
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fullwell.core.settings import load_settings
from fullwell.pipeline import run_frame
from fullwell.pipeline.assets import assets_of_settings
from fullwell.schema import RecipeBuilder, load_recipe
from fullwell.schema.assets import pin_assets
from fullwell.storage import LocalStore

RECIPE: dict[str, Any] = {
    "schema": "fullwell/recipe/v1",
    "name": "13-range-study",
    "seed": 13,
    "scene": {
        "traffic": {
            "network": {"layout": "straight", "length_m": 480, "lanes": 1, "sidewalk_width_m": 3},
            "demand": {"car": {"density_per_km": 12}},
            "style": "suburb",
            "time_s": 6,
            "ego": {"kind": "car", "min_road_ahead_m": 170},
            "targets": [{"id": "walker", "class": "pedestrian", "tags": ["adult"], "distance_m": 10, "facing_deg": 90}],
        },
        "lights": [{"kind": "sun_sky", "name": "sky", "group": "sky", "sun_elevation_deg": 40, "sun_azimuth_deg": 230}],
    },
    "cameras": [
        {
            "name": "front",
            "pose": {"mount": {"at": "windscreen", "pitch_deg": -1.5}},
            "lens": {"focal_length_m": 0.006, "f_number": 2.8},
            "sensors": [
                {"name": "fine", "model": "iset-b", "rows": 240, "cols": 376, "exposure": {"auto": {}}},
                {"name": "coarse", "model": "iset-a", "rows": 120, "cols": 188, "exposure": {"auto": {}}},
            ],
        }
    ],
    "vary": {"grid": {"scene.traffic.targets[0].distance_m": [10, 25, 50, 100, 150]}},
    "outputs": ["image.png", "raw.npz", "depth.exr", "labels.json"],
    "quality": {"noise_ratio": 1.5, "max_samples_per_pixel": 64, "max_depth": 4},
}


def main() -> None:
    assets = assets_of_settings(load_settings())
    document = pin_assets(load_recipe(RECIPE), assets)
    builder = RecipeBuilder(document, base_dir=Path(__file__).parent, assets=assets)
    store = LocalStore(Path("out") / document.name)
    for index in range(document.frame_count()):
        run_frame(document, index, store, f"frames/{index}", builder=builder)


if __name__ == "__main__":
    main()
