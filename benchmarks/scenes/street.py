"""A town street of 250 m, by day under sun and sky and by night under its own lamps. x to the right, y along the street."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scenes.buildings import HousePlan, house_parts
from benchmarks.scenes.meshes import Triangles, block, join, quads, revolve, tube
from benchmarks.scenes.plants import tree_parts
from benchmarks.scenes.props import CAR_MATERIALS, Props, Size, at, diffuse, metal, plastic, recipe
from fullwell.core.rng import stream

__all__ = ["street_day", "street_night"]

Entry = dict[str, Any]

ROAD_HALF_M, LANE_M, PAVEMENT_M, KERB_M = 5.5, 3.5, 4.0, 0.14
FRONT_M = ROAD_HALF_M + PAVEMENT_M
START_M, END_M = -32.0, 235.0
LAMP_STEP_M, LAMPS_PER_SIDE, POLE_M = 12.0, 20, 8.0
FIRST_LAMP_M = -10.0

MATERIALS: dict[str, Entry] = CAR_MATERIALS | {
    "ground": diffuse("#5d6a45"),
    "asphalt": diffuse(0.085),
    "marking": diffuse(0.62),
    "paving": diffuse(0.30),
    "kerb": diffuse(0.42),
    "iron": plastic(0.05, 0.35),
    "pole": plastic(0.16, 0.25),
    "bark": diffuse("#4f4034"),
    "leaf_a": diffuse("#47662c"),
    "leaf_b": diffuse("#5d7a35"),
    "roof_tile": diffuse("#6e3f33"),
    "roof_felt": diffuse(0.14),
    "window": plastic(0.02, 0.015),
    "frame_white": diffuse(0.72),
    "frame_dark": plastic(0.06, 0.25),
    "sign": plastic("#b3201f", 0.15),
    "steel": metal("chromium", 0.25),
}
_WALLS = ("#b86f52", "#cfc1a2", "#a9a39a", "#c9b28a", "#8f5a48", "#d6d2c8", "#9c8f7f", "#b9a07e")
_BASES = ("#6f6a64", "#8a8275", "#4c4f55", "#a39a8b")


@dataclass(frozen=True, slots=True)
class _Night:
    """Luminances [cd m^-2] of what shines after dark."""

    sodium: float = 22_000.0
    led: float = 40_000.0
    headlamp: tuple[float, float] = (25_000.0, 90_000.0)
    tail_share: float = 0.01
    brake_share: float = 0.15
    window: tuple[float, float] = (10.0, 120.0)
    shop: tuple[float, float] = (40.0, 300.0)
    sky: float = 0.02


def street_day(size: Size, folder: Path, *, seed: int = 4) -> Entry:
    """Return the street under a clear sky with the sun 38 degrees up; meshes go to `folder`."""
    objects, _ = _street(Props(folder), seed, None)
    sun = {"name": "sky", "kind": "sun_sky", "group": "sky", "sun_elevation_deg": 38, "sun_azimuth_deg": 205, "turbidity": 3}
    return _recipe("street-day", objects, [sun], size, seed=seed, f_number=4.0, exposure={"percentile": 98, "level": 0.8})


def street_night(size: Size, folder: Path, *, seed: int = 4) -> Entry:
    """Return the street by night: 40 lamps, lit windows and shops, headlamps and tail lamps, hardly any sky."""
    night = _Night()
    objects, lights = _street(Props(folder), seed, night)
    sky = {"name": "sky", "kind": "constant_environment", "group": "sky", "luminance_cd_m2": night.sky, "spd": "D65"}
    exposure = {"percentile": 96, "level": 0.7, "max_time_s": 0.033}
    return _recipe("street-night", objects, [*lights, sky], size, seed=seed, f_number=1.8, exposure=exposure)


def _recipe(
    name: str, objects: list[Entry], lights: list[Entry], size: Size, *, seed: int, f_number: float, exposure: Entry
) -> Entry:
    classes = ["ground", "road", "marking", "pavement", "building", "tree", "lamp_post", "sign", "car", "person"]
    scene = {"materials": MATERIALS, "classes": classes, "objects": objects, "lights": lights}
    pose = {"origin_m": [1.9, 0.0, 1.55], "target_m": [1.0, 30.0, 2.3]}
    lens = {"kind": "pinhole", "hfov_deg": 55, "f_number": f_number}
    return recipe(
        name,
        scene,
        pose,
        lens,
        size=size,
        model="mt9v024-rgb",
        exposure={"auto": {"method": "percentile"} | exposure},
        depth=8,
        seed=seed,
    )


def _street(props: Props, seed: int, night: _Night | None) -> tuple[list[Entry], list[Entry]]:
    """Return objects and street lights. Streams are named, so day and night have the same street."""
    objects = [*_surfaces(props), *_houses(props, seed, night), *_trees(props, seed), *_traffic(props, seed, night)]
    objects += [*_people(props, seed), *_furniture(props)]
    posts, lights = _lamps(props, night)
    return objects + posts, lights


# Surfaces ------------------------------------------------------------------------------------------------------------


def _flat(low: tuple[float, float], high: tuple[float, float], z: float) -> list[tuple[float, float, float]]:
    return [(low[0], low[1], z), (high[0], low[1], z), (high[0], high[1], z), (low[0], high[1], z)]


def _surfaces(props: Props) -> list[Entry]:
    """Return ground, road with markings, manholes, pavements and kerbs."""
    crossing_m = 40.0
    far_from_crossing = [y for y in np.arange(START_M, END_M, 9.0) if not crossing_m - 5 < y < crossing_m + 4]
    dashes = [_flat((-0.07, y), (0.07, y + 3), 0.004) for y in far_from_crossing]
    edges = [
        _flat((s * LANE_M - 0.05, y), (s * LANE_M + 0.05, y + 1), 0.004)
        for s in (-1, 1)
        for y in np.arange(START_M, END_M, 2.0)
    ]
    zebra = [_flat((x, crossing_m), (x + 0.5, crossing_m + 3.2), 0.004) for x in np.arange(-5.2, 5.0, 1.0)]
    stop = [_flat((0.2, crossing_m - 2.0), (LANE_M - 0.1, crossing_m - 1.6), 0.004)]
    pavements = [
        block(
            (PAVEMENT_M - 0.16, END_M - START_M, KERB_M),
            (s * (FRONT_M + ROAD_HALF_M + 0.16) / 2, (START_M + END_M) / 2, KERB_M / 2),
        )
        for s in (-1, 1)
    ]
    kerbs = [
        block((0.15, 0.97, KERB_M + 0.01), (s * (ROAD_HALF_M + 0.075), y, KERB_M / 2))
        for s in (-1, 1)
        for y in np.arange(START_M, END_M, 1.0)
    ]
    ground = {
        "id": "ground",
        "class": "ground",
        "geometry": {"kind": "rectangle", "size_m": [1600, 1600]},
        "material": "ground",
        "transform": {"translate_m": [0, 0, -0.03]},
    }
    road = {
        "id": "road",
        "class": "road",
        "geometry": {"kind": "rectangle", "size_m": [2 * ROAD_HALF_M, END_M - START_M]},
        "material": "asphalt",
        "transform": {"translate_m": [0, (START_M + END_M) / 2, 0]},
    }
    covers = [
        {
            "name": f"cover_{n}",
            "geometry": {"kind": "disk", "radius_m": 0.32},
            "material": "iron",
            "transform": {"translate_m": [x, y, 0.003]},
        }
        for n, (x, y) in enumerate(((0.6, 6.5), (-2.4, 15.0), (2.6, 27.0), (-0.9, 55.0)))
    ]
    paint = props.part("paint", "markings", quads(dashes + edges + zebra + stop), "marking")
    slabs = [
        props.part("slabs", "pavements", join(pavements), "paving"),
        props.part("kerbs", "kerbs", join(kerbs), "kerb"),
    ]
    return [
        ground,
        road,
        {"id": "covers", "class": "road", "parts": covers},
        {"id": "markings", "class": "marking", "parts": [paint]},
        {"id": "pavements", "class": "pavement", "parts": slabs},
    ]


# Houses --------------------------------------------------------------------------------------------------------------


def _houses(props: Props, seed: int, night: _Night | None) -> list[Entry]:
    """Return two rows of houses and three across the far end."""
    rng = stream(seed, "houses")
    houses = []
    for side in (-1, 1):
        y, number = START_M, 0
        while y < END_M - 12:
            width = float(rng.uniform(17, 27))
            plan = HousePlan(width, int(rng.integers(2, 5)), max(3, round(width / 3.3)), pitched=bool(rng.random() < 0.5))
            place = at((FRONT_M, y + width, 0), -90) if side > 0 else at((-FRONT_M, y, 0), 90)
            houses.append(
                _house(props, f"house_{'right' if side > 0 else 'left'}_{number}", plan, place, seed=seed, night=night)
            )
            y, number = y + width + 0.2, number + 1
    for number, x in enumerate((-36.0, -12.0, 12.2)):
        plan = HousePlan(24.0, 4, 7, pitched=number != 1)
        houses.append(_house(props, f"house_end_{number}", plan, at((x, END_M + 14, 0)), seed=seed, night=night))
    return houses


def _house(props: Props, name: str, plan: HousePlan, place: Entry, *, seed: int, night: _Night | None) -> Entry:
    rng = stream(seed, "house", name)
    meshes, openings = house_parts(plan, rng)
    materials: dict[str, str | Entry] = {
        "wall": diffuse(str(rng.choice(_WALLS))),
        "frame": str(rng.choice(["frame_white", "frame_dark"], p=[0.65, 0.35])),
        "trim": diffuse(str(rng.choice(["#d9d3c4", "#b5ab99", "#8d8578"]))),
        "base": diffuse(str(rng.choice(_BASES))),
        "roof": "roof_tile" if plan.pitched else "roof_felt",
    }
    parts = [props.part(part, f"{name}_{part}", mesh, materials[part]) for part, mesh in meshes.items()]
    lit = _lit_panes(openings, rng, night)
    dark = [pane.corners_m() for number, pane in enumerate(openings) if number not in lit]
    parts.append(props.part("glass", f"{name}_glass_{'night' if night else 'day'}", quads(dark), "window"))
    for number, emission in lit.items():
        corners = [[round(float(v), 4) for v in corner] for corner in openings[number].corners_m(0.01)]
        parts.append({"name": f"lit_{number}", "geometry": {"kind": "quad", "corners_m": corners}, "material": emission})
    return {"id": name, "class": "building", "parts": parts, "transform": place}


def _lit_panes(openings: list[Any], rng: np.random.Generator, night: _Night | None) -> dict[int, Entry]:
    """Return the emission of the panes that are lit, about one in eight and every third shop."""
    lit: dict[int, Entry] = {}
    for number, pane in enumerate(openings):
        chance, level, lamp = rng.random(3)
        if night is None or chance > (0.40 if pane.shop else 0.12):
            continue
        low, high = night.shop if pane.shop else night.window
        spd = "LED-B3" if pane.shop else ("blackbody:2700K", "LED-B1", "FL2")[int(lamp * 3)]
        luminance = round(float(low * (high / low) ** level), 1)
        lit[number] = {"kind": "emissive", "group": "windows", "luminance_cd_m2": luminance, "spd": spd}
    return lit


# Trees, traffic, people ----------------------------------------------------------------------------------------------


def _trees(props: Props, seed: int) -> list[Entry]:
    """Return 30 trees of five shapes, half-way between lamps."""
    shapes = [tree_parts(stream(seed, "tree", k), leaves=2200, height_m=5.6 + 0.5 * k, slender=0.85) for k in range(5)]
    rng = stream(seed, "trees")
    trees = []
    for number in range(30):
        side, row = (-1, 1)[number % 2], number // 2
        kind = int(rng.integers(0, 5))
        place = (side * 6.5 + rng.normal(0, 0.1), FIRST_LAMP_M + LAMP_STEP_M * (row + 0.5) + rng.normal(0, 0.5), KERB_M)
        size = float(rng.uniform(0.85, 1.1))
        parts = [props.part("wood", f"tree_{kind}_wood", shapes[kind]["wood"], "bark")]
        parts.append(props.part("leaves", f"tree_{kind}_leaves", shapes[kind]["leaves"], f"leaf_{'ab'[kind % 2]}"))
        transform = at(place, rng.uniform(0, 360), scale=[size] * 3)
        trees.append({"id": f"tree_{number}", "class": "tree", "parts": parts, "transform": transform})
    return trees


_MOVING = (
    (1.75, 15.5, True), (-1.75, 13.0, False), (-1.8, 27.0, False), (1.7, 31.0, True), (-1.7, 52.0, False), (1.75, 66.0, False),
    (-1.75, 78.0, False), (1.8, 92.0, False), (-1.75, 118.0, False), (1.75, 130.0, False), (-1.7, 155.0, False),
)  # fmt: skip
"""Cars in the lanes: x, y [m] and whether they brake; those on the left come towards the camera."""


def _traffic(props: Props, seed: int, night: _Night | None) -> list[Entry]:
    """Return 11 moving and 16 parked cars."""
    cars = []
    for number, (x, y, brakes) in enumerate(_MOVING):
        rng = stream(seed, "moving", number)
        lamps = None
        level, kind = rng.random(2)
        if night is not None:
            low, high = night.headlamp
            head = round(float(low * (high / low) ** level), -2)
            lamps = {
                "head": head,
                "tail": head * (night.brake_share if brakes else night.tail_share),
                "spd": "A" if kind < 0.4 else "LED-B4",
            }
        cars.append(props.random_car(f"car_moving_{number}", rng, at((x, y, 0), 90 if x > 0 else -90), lamps=lamps))
    rng = stream(seed, "parked")
    for side in (-1, 1):
        y, number = (15.0 if side > 0 else 6.0), 0
        while number < 8:
            turn = 90 * side + rng.normal(0, 0.7)
            cars.append(
                props.random_car(f"car_parked_{'right' if side > 0 else 'left'}_{number}", rng, at((side * 4.5, y, 0), turn))
            )
            y += float(rng.uniform(5.6, 6.4)) + (11.0 if 28 < y < 37 else 0.0) + (8.0 if rng.random() < 0.25 else 0.0)
            number += 1
    return cars


def _people(props: Props, seed: int) -> list[Entry]:
    """Return 12 pedestrians along the pavements, two on the crossing and two near by."""
    rng = stream(seed, "people")
    places = [(-0.9, 41.2, 0.0, 0.0), (-3.6, 42.0, 0.0, 180.0), (7.0, 10.8, KERB_M, 97.0), (8.1, 13.0, KERB_M, -88.0)]
    for number in range(12):
        side = (-1, 1)[number % 2]
        walk = (90.0 if rng.random() < 0.5 else -90.0) + rng.normal(0, 8)
        places.append((side * rng.uniform(7.3, 9.0), 9.0 + 5.2 * number + rng.normal(0, 1.0), KERB_M, walk))
    return [
        props.person(f"person_{n}", stream(seed, "person", n), at((x, y, z), turn)) for n, (x, y, z, turn) in enumerate(places)
    ]


# Lamps and furniture -------------------------------------------------------------------------------------------------


def _post() -> Triangles:
    """Return a lamp post with an arm of 1.6 m towards +x and a flat head."""
    pole = tube([(0, 0, 0), (0, 0, 1.2), (0, 0, 1.25), (0, 0, POLE_M - 0.5)], (0.095, 0.095, 0.065, 0.05), segments=10)
    arm = tube(
        [(0, 0, POLE_M - 0.5), (0.12, 0, POLE_M - 0.12), (0.5, 0, POLE_M + 0.04), (1.4, 0, POLE_M + 0.06)],
        (0.05, 0.045, 0.04, 0.04),
        segments=8,
    )
    return join([pole, arm, block((0.72, 0.32, 0.11), (1.6, 0, POLE_M + 0.06))])


def _lamps(props: Props, night: _Night | None) -> tuple[list[Entry], list[Entry]]:
    """Return the posts and, by night, the rectangles that shine down from their heads: sodium near, LED far."""
    posts, lights = [], []
    for side in (-1, 1):
        for number in range(LAMPS_PER_SIDE):
            x, y = side * (ROAD_HALF_M + 1.0), FIRST_LAMP_M + LAMP_STEP_M * number
            name = f"lamp_{'right' if side > 0 else 'left'}_{number}"
            parts = [props.part("post", "lamp_post", _post(), "pole")]
            posts.append(
                {"id": name, "class": "lamp_post", "parts": parts, "transform": at((x, y, KERB_M), 180 if side > 0 else 0)}
            )
            if night is None:
                continue
            sodium = number < 9
            head = [x - side * 1.6, y, KERB_M + POLE_M - 0.002]
            lights.append(
                {
                    "name": f"{name}_light",
                    "kind": "area",
                    "group": "streetlights",
                    "class": "lamp_post",
                    "geometry": {"kind": "rectangle", "size_m": [0.42, 0.24] if sodium else [0.56, 0.12]},
                    "transform": {"rotate_deg": {"axis": "x", "angle_deg": 180}, "translate_m": head},
                    "luminance_cd_m2": night.sodium if sodium else night.led,
                    "spd": "HP1" if sodium else "LED-B3",
                }
            )
    return posts, lights


def _furniture(props: Props) -> list[Entry]:
    """Return signs, bollards and bins."""
    post = tube([(0, 0, 0), (0, 0, 2.75)], (0.03, 0.03))
    disc = revolve([(0.001, -0.012), (0.30, -0.012), (0.30, 0.012), (0.001, 0.012)], segments=28)
    face = Triangles(
        disc.vertices_m[:, [0, 2, 1]] * [1, -1, 1] + [0, -0.04, 2.5], disc.faces, disc.normals[:, [0, 2, 1]] * [1, -1, 1]
    )
    bin_mesh = revolve([(0.001, 0.0), (0.20, 0.0), (0.24, 0.85), (0.25, 0.86), (0.25, 0.92), (0.001, 0.96)], segments=20)
    bollard = revolve([(0.055, 0.0), (0.055, 0.86), (0.075, 0.9), (0.07, 0.96), (0.001, 1.0)], segments=14)
    objects: list[Entry] = []
    for number, (x, y) in enumerate(((5.95, 12.5), (-5.95, 44.5), (5.95, 36.5), (5.95, 72.0))):
        parts = [props.part("post", "sign_post", post, "steel"), props.part("face", "sign_face", face, "sign")]
        objects.append({"id": f"sign_{number}", "class": "sign", "parts": parts, "transform": at((x, y, KERB_M))})
    for number, (x, y) in enumerate(((6.6, 11.0), (-6.6, 9.0), (6.6, 24.0), (-6.6, 33.0))):
        objects.append(
            {
                "id": f"bin_{number}",
                "class": "",
                "parts": [props.part("bin", "bin", bin_mesh, "iron")],
                "transform": at((x, y, KERB_M)),
            }
        )
    for number, y in enumerate((37.2, 38.4, 44.2, 45.4)):
        for side in (-1, 1):
            place = at((side * 5.95, y, KERB_M))
            objects.append(
                {
                    "id": f"bollard_{number}_{side + 1}",
                    "class": "",
                    "parts": [props.part("bollard", "bollard", bollard, "iron")],
                    "transform": place,
                }
            )
    return objects
