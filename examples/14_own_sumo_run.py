"""Your own SUMO run, written in Python: the same bytes as 14_own_sumo_run.yaml.

Draws from this machine's asset store; take the starter library in first: fullwell assets starter --approve
Run: python examples/14_own_sumo_run.py, then fullwell show out/14-own-sumo-run
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
    "name": "14-own-sumo-run",
    "seed": 14,
    "scene": {
        "traffic": {
            "network": {"file": "own_run/tee.net.xml"},
            "run": {"file": "own_run/fcd.xml"},
            "style": "suburb",
            "time_s": 25,
            "ego": {"kind": "car", "min_speed_m_s": 3},
        },
        "lights": [{"kind": "sun_sky", "name": "sky", "group": "sky", "sun_elevation_deg": 25, "sun_azimuth_deg": 250}],
    },
    "cameras": [
        {
            "name": "front",
            "pose": {"mount": {"at": "windscreen", "pitch_deg": -1}},
            "lens": {"hfov_deg": 60, "f_number": 2.0},
            "sensors": [{"name": "main", "model": "ar0132at-rgb", "rows": 180, "cols": 320, "exposure": {"auto": {}}}],
        }
    ],
    "outputs": ["image.png", "depth.exr", "instances.png", "labels.json"],
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
