"""Day, a dull day, dusk and night from one rendering, written in Python: the same bytes as 11_street_at_night.yaml.

Draws from this machine's asset store; take the starter library in first: fullwell assets starter --approve
Run: python examples/11_street_at_night.py, then fullwell show out/11-street-at-night
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
    "name": "11-street-at-night",
    "seed": 10,
    "scene": {
        "traffic": {
            "network": {"layout": "blocks", "length_m": 270, "parking_width_m": 2.2, "sidewalk_width_m": 3.5},
            "demand": {
                "car": {"rate_per_s": 0.4, "density_per_km": 6},
                "van": {"rate_per_s": 0.06},
                "bus": {"rate_per_s": 0.04},
                "cyclist": {"rate_per_s": 0.08},
                "pedestrian": {"rate_per_s": 0.5},
            },
            "style": "city",
            "time_s": 60,
            "lamps": "night",
            "ego": {"kind": "car", "min_speed_m_s": 5, "min_road_ahead_m": 35},
        },
        "lights": [
            {
                "kind": "sun_sky",
                "name": "daylight",
                "group": "sky",
                "sun_group": "sun",
                "time_utc": "2026-06-21T13:30:00Z",
                "latitude_deg": 48.1,
                "longitude_deg": 11.6,
            }
        ],
    },
    "cameras": [
        {
            "name": "front",
            "pose": {"mount": {"at": "windscreen", "pitch_deg": -1}},
            "lens": {"hfov_deg": 60, "f_number": 2.0},
            "sensors": [
                {
                    "name": "main",
                    "model": "ar0132at-rgb",
                    "rows": 180,
                    "cols": 320,
                    "exposure": {"auto": {"method": "percentile", "level": 0.5, "percentile": 95}},
                }
            ],
        }
    ],
    "vary": {
        "grid": {
            "scene.light_groups": [
                {"sun": 1, "sky": 1, "headlights": 1, "streetlights": 1, "other": 1},
                {"sun": 0, "sky": 0.3, "headlights": 1, "streetlights": 1, "other": 1},
                {"sun": 0, "sky": 0.002, "headlights": 1, "streetlights": 1, "other": 1},
                {"sun": 0, "sky": 1e-05, "headlights": 1, "streetlights": 1, "other": 1},
            ]
        }
    },
    "outputs": ["image.png", "raw.npz", "labels.json"],
    # Nothing is rendered moving: exposed for a second at night and half a millisecond by day, the frames could not share one
    # rendering.
    "quality": {
        "noise_ratio": 1.5,
        "max_samples_per_pixel": 512,
        "max_depth": 5,
        "max_sample_saturation": 2,
        "motion_blur_px": 1000,
    },
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
