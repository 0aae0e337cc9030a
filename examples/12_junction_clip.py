"""Eight frames of a junction, half a second apart, written in Python: the same bytes as 12_junction_clip.yaml.

Draws from this machine's asset store; take the starter library in first: fullwell assets starter --approve
Run: python examples/12_junction_clip.py, then fullwell show out/12-junction-clip
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
    "name": "12-junction-clip",
    "seed": 12,
    "scene": {
        "traffic": {
            "network": {"layout": "cross", "length_m": 200, "lanes": 2, "sidewalk_width_m": 3},
            "demand": {
                "car": {"rate_per_s": 0.7, "density_per_km": 12},
                "van": {"rate_per_s": 0.1},
                "lorry": {"rate_per_s": 0.05},
                "pedestrian": {"rate_per_s": 0.4},
            },
            "style": "suburb",
            "time_s": 40,
        },
        "lights": [{"kind": "sun_sky", "name": "sky", "group": "sky", "sun_elevation_deg": 35, "sun_azimuth_deg": 140}],
    },
    "cameras": [
        {
            "name": "mast",
            "pose": {"origin_m": [91, 91, 8], "target_m": [108, 105, 0]},
            "lens": {"hfov_deg": 70, "f_number": 2.0},
            "sensors": [{"name": "main", "model": "ar0132at-rgb", "rows": 180, "cols": 320, "exposure": {"auto": {}}}],
        }
    ],
    "vary": {"clip": {"frames": 8, "frame_rate_hz": 2}},
    "outputs": ["image.png", "instances.png", "labels.json"],
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
