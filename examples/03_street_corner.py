"""A street corner with SUMO's 3D models, written in Python: the same bytes as 03_street_corner.yaml.

x is east, y is north, metres. Needs the extra [traffic], which brings the models.
Run: python examples/03_street_corner.py, then fullwell show out/03-street-corner
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fullwell.pipeline import run_frame
from fullwell.schema import load_recipe
from fullwell.storage import LocalStore

NORTH, EAST, WEST = 180, 90, -90
"""Turns about +z: SUMO's models face south as they are."""


def paint(colour: str) -> dict[str, Any]:
    return {"kind": "diffuse", "reflectance": colour}


MATERIALS: dict[str, Any] = {
    "asphalt": {"kind": "diffuse", "reflectance": 0.10},
    "paving": {"kind": "diffuse", "reflectance": 0.35},
    "marking": {"kind": "diffuse", "reflectance": 0.75},
    "grass": paint("#5d7040"),
    "bark": paint("#5a4636"),
    "leaves": paint("#4c6b2f"),
    "brick": paint("#9c6b55"),
    "plaster": paint("#cdbfa5"),
    "concrete": {"kind": "diffuse", "reflectance": 0.45},
    "glass": {"kind": "principled", "base_color": "#26333d", "roughness": 0.4},
    "red_lamp": {
        "kind": "emissive",
        "luminance_cd_m2": 20000,
        "spd": {"wavelength_nm": [600, 615, 630, 645, 660], "values": [0, 0.3, 1, 0.3, 0]},
        "group": "signals",
    },
}


def slab(name: str, kind: str, material: str, size_m: list[float], centre_m: list[float]) -> dict[str, Any]:
    return {
        "id": name,
        "class": kind,
        "geometry": {"kind": "cube", "size_m": size_m},
        "material": material,
        "transform": {"translate_m": centre_m},
    }


def flat(material: str, size_m: list[float], centre_m: list[float]) -> dict[str, Any]:
    return {
        "geometry": {"kind": "rectangle", "size_m": size_m},
        "material": material,
        "transform": {"translate_m": centre_m},
    }


def building(
    name: str, material: str, size_m: list[float], centre_m: list[float], window_rows_m: list[float]
) -> dict[str, Any]:
    """A box with bands of windows all round, standing on the ground; `centre_m` is [x, y]."""
    x, y = centre_m
    body = {
        "name": "body",
        "geometry": {"kind": "cube", "size_m": size_m},
        "material": material,
        "transform": {"translate_m": [x, y, size_m[2] / 2]},
    }
    bands = [
        {
            "name": f"windows_{row}",
            "geometry": {"kind": "cube", "size_m": [round(size_m[0] + 0.1, 3), round(size_m[1] + 0.1, 3), 1.5]},
            "material": "glass",
            "transform": {"translate_m": [x, y, height_m]},
        }
        for row, height_m in enumerate(window_rows_m)
    ]
    return {"id": name, "class": "building", "parts": [body, *bands]}


def tree(name: str, x: float, y: float) -> dict[str, Any]:
    trunk = {
        "name": "trunk",
        "geometry": {"kind": "cylinder", "radius_m": 0.15, "height_m": 2.6},
        "material": "bark",
        "transform": {"translate_m": [x, y, 1.3]},
    }
    crown = {
        "name": "crown",
        "geometry": {"kind": "sphere", "radius_m": 1.0},
        "material": "leaves",
        "transform": {"scale": [1.5, 1.5, 1.8], "translate_m": [x, y, 4.0]},
    }
    return {"id": name, "class": "tree", "parts": [trunk, crown]}


def model(
    name: str,
    kind: str,
    file: str,
    turn_deg: float,
    place_m: list[float],
    *,
    scale: list[float] | None = None,
    paint_of: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """A packaged model. SUMO's cars are models of 1.8 units length, to be scaled to the vehicle's size."""
    step: dict[str, Any] = {} if scale is None else {"scale": scale}
    step |= {"rotate_deg": {"axis": "z", "angle_deg": turn_deg}, "translate_m": place_m}
    thing: dict[str, Any] = {
        "id": name,
        "class": kind,
        "geometry": {"kind": "model", "file": f"sumo:{file}", "unit_m": 1, "up_axis": "y"},
        "transform": step,
    }
    return thing if paint_of is None else {**thing, "materials": paint_of}


def car_paint(colour: str) -> dict[str, Any]:
    return {"carmaterial*": {"kind": "rough_plastic", "reflectance": colour, "roughness": 0.1}}


def clothes(colour: str) -> dict[str, Any]:
    return {"*": paint(colour)}


def traffic_light(name: str, x: float, y: float, turn_deg: float) -> dict[str, Any]:
    """A pole of 2.3 m with a lamp head; the head faces west as it is."""
    pole = {
        "name": "pole",
        "geometry": {"kind": "model", "file": "sumo:poleBase.obj", "unit_m": 1, "up_axis": "y"},
        "transform": {"scale": [1.5, 1.5, 2.3], "translate_m": [x, y, 0.15]},
    }
    head = {
        "name": "head",
        "geometry": {"kind": "model", "file": "sumo:tlr.obj", "unit_m": 1, "up_axis": "y"},
        "materials": {"Red": "red_lamp"},
        "transform": {"rotate_deg": {"axis": "z", "angle_deg": turn_deg}, "translate_m": [x, y, 2.45]},
    }
    return {"id": name, "class": "traffic_light", "parts": [pole, head]}


GROUND = [
    {
        "id": "ground",
        "class": "ground",
        "geometry": {"kind": "rectangle", "size_m": [600, 600]},
        "material": "grass",
        "transform": {"translate_m": [0, 0, -0.05]},
    },
    {
        "id": "road",
        "class": "road",
        "parts": [flat("asphalt", [8, 160], [0, 40, 0]), flat("asphalt", [160, 8], [0, 22, 0.002])],
    },
    {
        "id": "markings",
        "class": "marking",
        "parts": [
            *(flat("marking", [0.15, 3], [0, y, 0.006]) for y in (-13.5, -7.5, -1.5, 4.5, 10.5, 34.5, 40.5, 46.5)),
            *(flat("marking", [0.5, 3], [x, 15, 0.006]) for x in (-3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5)),
        ],
    },
    slab("sidewalk_south_east", "sidewalk", "paving", [3, 58, 0.15], [5.5, -11, 0.075]),
    slab("sidewalk_south_west", "sidewalk", "paving", [3, 58, 0.15], [-5.5, -11, 0.075]),
    slab("sidewalk_north_east", "sidewalk", "paving", [3, 58, 0.15], [5.5, 55, 0.075]),
    slab("sidewalk_north_west", "sidewalk", "paving", [3, 58, 0.15], [-5.5, 55, 0.075]),
]

BUILDINGS = [
    building("house_south_east", "brick", [10, 26, 10], [12.2, 1], [2.2, 5.2, 8.2]),
    building("house_south_west", "plaster", [10, 24, 13], [-12.4, -1], [2.2, 5.2, 8.2, 11.2]),
    building("house_north_east", "concrete", [16, 18, 18], [15.4, 38.5], [2.2, 5.7, 9.2, 12.7, 16.2]),
    building("house_north_west", "brick", [14, 20, 12], [-14.2, 39.5], [2.2, 5.2, 8.2]),
    building("house_far", "plaster", [30, 12, 15], [0, 95], [2.2, 5.2, 8.2, 11.2]),
]

RED, SILVER, BLUE = car_paint("#a8201a"), car_paint("#dcdcd8"), car_paint("#33536b")
SALOON_SCALE = [2.1, 2.35, 1.75]

TRAFFIC = [
    model("car_ahead", "car", "car-normal-citrus.obj", NORTH, [2.0, 3.5, 0], scale=SALOON_SCALE, paint_of=RED),
    model("car_oncoming", "car", "car-minibus-citrus.obj", 0, [-2.0, 9.0, 0], scale=[2.0, 2.3, 2.1], paint_of=SILVER),
    model("car_crossing", "car", "car-microcargo-citrus.obj", EAST, [-6.5, 20.0, 0], scale=[2.05, 2.35, 1.9]),
    model("car_far", "car", "car-normal-citrus.obj", NORTH, [2.0, 38.0, 0], scale=SALOON_SCALE, paint_of=BLUE),
    model("tram", "tram", "tram.obj", WEST, [-1.5, 24.2, 1.88], scale=[2.0, 2.0, 2.0]),
]

PEOPLE = [
    model("person_walking", "person", "humanResting.obj", 0, [5.3, 2.0, 0.14], paint_of=clothes("#40506a")),
    model("person_waiting", "person", "humanResting.obj", WEST, [4.6, 15.0, 0.14], paint_of=clothes("#7a3b2e")),
    model("person_crossing", "person", "humanResting.obj", EAST, [-0.6, 15.2, 0], paint_of=clothes("#b0902f")),
    model("person_west", "person", "humanResting.obj", NORTH, [-5.6, 7.0, 0.14], paint_of=clothes("#55604a")),
]

RECIPE: dict[str, Any] = {
    "schema": "fullwell/recipe/v1",
    "name": "03-street-corner",
    "seed": 3,
    "scene": {
        "materials": MATERIALS,
        "classes": ["ground", "road", "marking", "sidewalk", "building", "tree", "traffic_light", "car", "tram", "person"],
        "objects": [
            *GROUND,
            *BUILDINGS,
            tree("tree_1", -6.4, 1.0),
            tree("tree_2", -6.4, 12.0),
            tree("tree_3", 6.4, 31.0),
            tree("tree_4", -6.4, 33.0),
            traffic_light("signal_east", 4.4, 12.8, 90),
            traffic_light("signal_west", -4.4, 12.8, 90),
            *TRAFFIC,
            *PEOPLE,
        ],
        "lights": [
            {
                "kind": "sun_sky",
                "name": "sky",
                "group": "sky",
                "sun_elevation_deg": 42,
                "sun_azimuth_deg": 200,
                "turbidity": 3,
                "ground_albedo": 0.2,
            }
        ],
    },
    "cameras": [
        {
            "name": "main",
            "pose": {"origin_m": [1.8, -9.0, 1.6], "target_m": [0.6, 16.0, 1.5], "up": [0, 0, 1]},
            "lens": {"hfov_deg": 62, "f_number": 2},
            "sensors": [
                {
                    "name": "main",
                    "model": "imx363",
                    "rows": 240,
                    "cols": 400,
                    "exposure": {"auto": {"method": "percentile", "percentile": 98, "level": 0.8}},
                }
            ],
        }
    ],
    "outputs": [
        "image.png", "raw.npz", "radiance.exr", "depth.exr", "normals.exr", "instances.png", "semantic.png", "labels.json",
    ],
    "quality": {"noise_ratio": 1.0, "max_depth": 6},
}  # fmt: skip


def main(folder: Path = Path("out")) -> None:
    document = load_recipe(RECIPE)
    store = LocalStore(folder / document.name)
    for index in range(document.frame_count()):
        run_frame(document, index, store, f"frames/{index}")


if __name__ == "__main__":
    main()
