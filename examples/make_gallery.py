"""Make the gallery of streets: thirteen frames of different roads, styles, light and cameras, docs/images/gallery/*.jpg.

Run: python examples/make_gallery.py [--only NAME] [FOLDER]. Draws from this machine's asset store:
fullwell assets starter --approve --no-previews
"""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image

from fullwell.core import atomic_write
from fullwell.core.settings import load_settings
from fullwell.pipeline import run_frame
from fullwell.pipeline.assets import assets_of_settings
from fullwell.schema import RecipeBuilder, load_recipe
from fullwell.schema.assets import pin_assets
from fullwell.storage import LocalStore

FOLDER = Path(__file__).parents[1] / "docs/images/gallery"
CITY = {"layout": "blocks", "length_m": 270, "parking_width_m": 2.2, "sidewalk_width_m": 3.5}
TOWN = {
    "car": {"rate_per_s": 0.4, "density_per_km": 6},
    "van": {"rate_per_s": 0.06},
    "bus": {"rate_per_s": 0.05},
    "cyclist": {"rate_per_s": 0.1},
    "motorcycle": {"rate_per_s": 0.04},
    "pedestrian": {"rate_per_s": 1.5, "density_per_km": 25},
}
VILLAGE = {"car": {"rate_per_s": 0.2, "density_per_km": 5}, "cyclist": {"rate_per_s": 0.08}, "pedestrian": {"rate_per_s": 0.6}}
EGO = {"kind": "car", "min_speed_m_s": 3, "min_road_ahead_m": 30}


def sun(elevation_deg: float, azimuth_deg: float, turbidity: float = 3.0) -> dict[str, Any]:
    light = {"kind": "sun_sky", "name": "sky", "group": "sky", "turbidity": turbidity}
    return light | {"sun_elevation_deg": elevation_deg, "sun_azimuth_deg": azimuth_deg}


def overcast(illuminance_lux: float) -> dict[str, Any]:
    return {"kind": "overcast_sky", "name": "sky", "group": "sky", "illuminance_lux": illuminance_lux}


SCENES: dict[str, dict[str, Any]] = {
    "city-noon": {"traffic": {"network": CITY, "demand": TOWN, "ego": EGO}, "light": sun(58, 190), "seed": 21},
    "city-evening": {"traffic": {"network": CITY, "demand": TOWN, "ego": EGO}, "light": sun(9, 265, 4), "seed": 22},
    "city-overcast-wet": {
        "traffic": {"network": CITY, "demand": TOWN, "ego": EGO, "wet": True, "season": "autumn", "dirt": {"vehicles": 0.8}},
        "light": overcast(9000),
        "seed": 23,
    },
    "city-night": {
        "traffic": {"network": CITY, "demand": TOWN, "ego": EGO, "lamps": "night"},
        "light": overcast(0.05),
        "seed": 10,
        "f_number": 1.4,
        "exposure_ev": 1.0,
        "quality": {"max_samples_per_pixel": 512, "max_sample_saturation": 1.5},
    },
    "junction-mast": {
        "traffic": {
            "network": {"layout": "cross", "length_m": 200, "lanes": 2, "sidewalk_width_m": 3},
            "demand": {
                "car": {"rate_per_s": 0.7, "density_per_km": 12},
                "lorry": {"rate_per_s": 0.08},
                "motorcycle": {"rate_per_s": 0.05},
                "pedestrian": {"rate_per_s": 1.2, "density_per_km": 20},
            },
            "time_s": 41,
        },
        "pose": {"origin_m": [91, 91, 8], "target_m": [108, 105, 0]},
        "light": sun(35, 140),
        "seed": 12,
    },
    "suburb-morning": {
        "traffic": {
            "network": {"layout": "tee", "length_m": 260, "parking_width_m": 2.2},
            "demand": VILLAGE,
            "style": "suburb",
            "ego": EGO | {"min_road_ahead_m": 0},
            "time_s": 25,
        },
        "light": sun(22, 200),
        "seed": 25,
    },
    "roundabout": {
        "traffic": {"network": {"layout": "roundabout", "length_m": 220}, "demand": VILLAGE, "style": "suburb", "time_s": 40},
        "pose": {"origin_m": [127, 127, 7], "target_m": [148, 120, 0]},
        "light": sun(45, 200),
        "seed": 26,
    },
    "country-curve": {
        "traffic": {
            "network": {"layout": "curve", "length_m": 320, "sidewalk_width_m": 0},
            "demand": {"car": {"density_per_km": 10}, "cyclist": {"density_per_km": 3}},
            "style": "rural",
            "ego": EGO | {"min_speed_m_s": 2},
            "time_s": 8,
        },
        "light": sun(30, 150),
        "seed": 27,
    },
    "country-fog": {
        "traffic": {
            "network": {"layout": "curve", "length_m": 320, "sidewalk_width_m": 0},
            "demand": {"car": {"density_per_km": 10}},
            "style": "rural",
            "ego": EGO | {"min_speed_m_s": 2},
            "time_s": 8,
            "lamps": "night",
        },
        "light": overcast(12000),
        "atmosphere": {"kind": "fog", "visibility_m": 120},
        "seed": 28,
        "quality": {"max_samples_per_pixel": 320},
    },
    "motorway": {
        "traffic": {
            "network": {"layout": "motorway", "length_m": 900, "lanes": 3, "sidewalk_width_m": 0, "speed_limit_m_s": 33},
            "demand": {"car": {"rate_per_s": 1.0}, "lorry": {"rate_per_s": 0.25}, "van": {"rate_per_s": 0.15}},
            "style": "motorway",
            "ego": EGO | {"min_road_ahead_m": 200},
        },
        "light": sun(40, 230),
        "seed": 29,
    },
    "left-mirror": {
        "traffic": {"network": CITY, "demand": TOWN, "ego": EGO | {"show": True}},
        "pose": {"mount": {"at": "mirror_left", "yaw_deg": 165, "pitch_deg": -8}},
        "light": sun(50, 160),
        "seed": 30,
    },
    "tram-dusk": {
        "traffic": {
            "network": CITY | {"tram_lane_width_m": 3.2},
            "demand": TOWN | {"tram": {"rate_per_s": 0.1, "density_per_km": 8}},
            "ego": EGO | {"min_speed_m_s": 0},
            "lamps": "night",
            "time_s": 60,
        },
        "light": sun(-2, 280),
        "seed": 31,
        "f_number": 1.4,
        "exposure_ev": 1.0,
        "quality": {"max_samples_per_pixel": 192, "max_sample_saturation": 1.5},
    },
    "own-sumo-run": {
        "traffic": {
            "network": {"file": "own_run/tee.net.xml"},
            "run": {"file": "own_run/fcd.xml"},
            "style": "suburb",
            "time_s": 25,
            "ego": {"kind": "car", "min_speed_m_s": 3},
        },
        "light": sun(32, 120),
        "seed": 14,
    },
}


def recipe(name: str) -> dict[str, Any]:
    """Return the recipe of a scene of the gallery."""
    scene = SCENES[name]
    pose = scene.get("pose", {"mount": {"at": "windscreen", "pitch_deg": -1}})
    exposure = {"auto": {"method": "percentile", "level": 0.6, "percentile": 97, "max_time_s": 1 / 30}}
    sensor = {
        "name": "main",
        "model": "ar0132at-rgb",
        "rows": 270,
        "cols": 480,
        "exposure": exposure,
        "isp": {"demosaic": "menon2007", "tone": {"exposure_ev": scene.get("exposure_ev", 0.0)}},
    }
    what: dict[str, Any] = {"traffic": scene["traffic"], "lights": [scene["light"]]}
    if "atmosphere" in scene:
        what["atmosphere"] = scene["atmosphere"]
    return {
        "schema": "fullwell/recipe/v1",
        "name": name,
        "seed": scene["seed"],
        "scene": what,
        "cameras": [
            {
                "name": "main",
                "pose": pose,
                "lens": {"hfov_deg": 62, "f_number": scene.get("f_number", 4.0)},
                "sensors": [sensor],
            }
        ],
        "outputs": ["image.png"],
        "quality": {"noise_ratio": 1.5, "max_samples_per_pixel": 96, "max_depth": 5, "max_sample_saturation": 3}
        | scene.get("quality", {}),
    }


def main(arguments: list[str]) -> None:
    only = arguments[arguments.index("--only") + 1] if "--only" in arguments else ""
    folders = [Path(word) for word in arguments if not word.startswith("--") and word != only]
    target = folders[0] if folders else FOLDER
    target.mkdir(parents=True, exist_ok=True)
    assets = assets_of_settings(load_settings())
    for name in SCENES:
        if only and name != only:
            continue
        document = pin_assets(load_recipe(recipe(name)), assets)
        builder = RecipeBuilder(document, base_dir=Path(__file__).parent, assets=assets)
        with tempfile.TemporaryDirectory() as folder:
            store = LocalStore(Path(folder))
            manifest = run_frame(document, 0, store, name, builder=builder)
            image = Image.open(io.BytesIO(store.get(f"{name}/image.png"))).convert("RGB")
        buffer = io.BytesIO()
        image.save(buffer, "JPEG", quality=90)
        atomic_write(target / f"{name}.jpg", buffer.getvalue())
        print(f"{target / name}.jpg: {manifest['run']['cpu_s']:.0f} CPU-s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
