"""An underground car park: 60 fluorescent lamps, concrete, and cars whose shaded sides see only indirect light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scenes.meshes import block, box_quads, join, quads, tube
from benchmarks.scenes.props import CAR_MATERIALS, Props, Size, at, diffuse, metal, plastic, recipe
from fullwell.core.rng import stream

__all__ = ["car_park"]

Entry = dict[str, Any]

HALF_WIDTH_M, HALF_LENGTH_M, HEIGHT_M = 20.0, 30.0, 2.9
BAY_M, BAY_DEPTH_M = 2.55, 5.0
_ROWS = ((-17.5, 180.0), (-6.5, 0.0), (-1.5, 180.0), (9.5, 0.0))
"""Rows of bays: x of their middle and the turn of a car that was driven in forwards, its rear to the lane."""
_LANES = (-12.0, 4.0, 16.0)
_LAMP_STEPS_M = (3.0, 3.0, 2.4)
"""Distance of the lamps along each lane; the third ends at the stairwell."""
_COLUMNS_X = (-14.8, -4.0, 6.8, 12.2)

MATERIALS: dict[str, Entry] = CAR_MATERIALS | {
    "floor": plastic(0.38, 0.35),
    "concrete": diffuse(0.42),
    "ceiling": diffuse(0.55),
    "wall": diffuse(0.60),
    "stripe": diffuse("#c8b13a"),
    "band": diffuse("#2f5f8a"),
    "white": diffuse(0.72),
    "housing": diffuse(0.80),
    "duct": metal("aluminium", 0.35),
    "pipe": plastic("#9c2a22", 0.2),
    "door": plastic("#3f6b4a", 0.3),
}

EXIT_SIGN: Entry = {
    "name": "exit_sign",
    "kind": "area",
    "group": "signs",
    "geometry": {"kind": "rectangle", "size_m": [0.5, 0.2]},
    "transform": {"look_at": {"origin_m": [-9.0, HALF_LENGTH_M - 0.06, 2.35], "target_m": [-9.0, 0, 2.35], "up": [0, 0, 1]}},
    "luminance_cd_m2": 150,
    "spd": {"wavelength_nm": [480, 500, 520, 540, 570], "values": [0, 0.6, 1, 0.5, 0]},
}


def car_park(size: Size, folder: Path, *, seed: int = 6) -> Entry:
    """Return the hall of 40 x 60 m with 40 cars; meshes go to `folder`."""
    props = Props(folder)
    objects = [*_hall(props), *_cars(props, seed), *_people(props, seed)]
    fittings, lights = _lamps(props)
    classes = ["hall", "marking", "column", "fitting", "car", "person"]
    scene = {"materials": MATERIALS, "classes": classes, "objects": [*objects, *fittings], "lights": [*lights, EXIT_SIGN]}
    pose = {"origin_m": [-13.1, -27.5, 1.6], "target_m": [-10.3, 0.0, 1.15]}
    lens = {"kind": "pinhole", "hfov_deg": 58, "f_number": 2.0}
    exposure = {"auto": {"method": "percentile", "percentile": 96, "level": 0.7, "max_time_s": 0.066}}
    return recipe("car-park", scene, pose, lens, size=size, model="mt9v024-rgb", exposure=exposure, depth=10, seed=seed)


def _slab(name: str, material: str, low: tuple[float, ...], high: tuple[float, ...], props: Props) -> Entry:
    return props.part(name, f"hall_{name}", quads(box_quads(low, high)), material)


def _hall(props: Props) -> list[Entry]:
    """Return floor, ceiling with beams, walls, columns, markings, ducts and pipes."""
    w, l, h = HALF_WIDTH_M, HALF_LENGTH_M, HEIGHT_M  # noqa: E741 - width, length, height
    beams = [block((2 * w, 0.4, 0.35), (0, y, h - 0.175)) for y in np.arange(-22.95, l, 7.65)]
    runs = ((-15.6, h - 0.45, 0.05), (-15.4, h - 0.45, 0.04), (-4.5, h - 0.42, 0.07))
    pipes = [tube([(x, -l, z), (x, 0, z), (x, l, z)], (r, r, r), segments=12) for x, z, r in runs]
    parts = [
        _slab("floor", "floor", (-w, -l, -0.2), (w, l, 0.0), props),
        _slab("ceiling", "ceiling", (-w, -l, h), (w, l, h + 0.2), props),
        props.part("beams", "hall_beams", join(beams), "ceiling"),
        _slab("wall_left", "wall", (-w - 0.2, -l, 0), (-w, l, h), props),
        _slab("wall_right", "wall", (w, -l, 0), (w + 0.2, l, h), props),
        _slab("wall_back", "wall", (-w, -l - 0.2, 0), (w, -l, h), props),
        _slab("wall_far", "wall", (-w, l, 0), (w, l + 0.2, h), props),
        _slab("stairwell", "concrete", (13.5, 18, 0), (w, l, h), props),
        _slab("band_left", "band", (-w, -l, 0.9), (-w + 0.005, l, 1.2), props),
        _slab("band_far", "band", (-w, l - 0.005, 0.9), (w, l, 1.2), props),
        _slab("door", "door", (-9.5, l - 0.05, 0), (-8.5, l, 2.1), props),
        props.part("ducts", "hall_ducts", join([block((0.5, 2 * l, 0.3), (x, 0, h - 0.52)) for x in (-17.6, 1.0)]), "duct"),
        props.part("pipes", "hall_pipes", join(pipes), "pipe"),
    ]  # fmt: skip
    return [{"id": "hall", "class": "hall", "parts": parts, "inside_ok": True}, _markings(props), _columns(props)]


def _bays_y() -> list[float]:
    return [round(-HALF_LENGTH_M + 2.1 + BAY_M * (k + 0.5), 3) for k in range(21)]


def _markings(props: Props) -> Entry:
    """Return the lines between bays and an arrow in each lane."""
    flat = []
    for x, _ in _ROWS:
        for y in [*(y - BAY_M / 2 for y in _bays_y()), _bays_y()[-1] + BAY_M / 2]:
            flat.append(
                [(x - 2.5, y - 0.05, 0.003), (x + 2.5, y - 0.05, 0.003), (x + 2.5, y + 0.05, 0.003), (x - 2.5, y + 0.05, 0.003)]
            )
    for x in _LANES:
        for y in np.arange(-22, 26, 12.0):
            flat.append([(x - 0.09, y, 0.003), (x + 0.09, y, 0.003), (x + 0.09, y + 1.6, 0.003), (x - 0.09, y + 1.6, 0.003)])
            flat.append(
                [(x - 0.35, y + 1.6, 0.003), (x + 0.35, y + 1.6, 0.003), (x + 0.01, y + 2.4, 0.003), (x - 0.01, y + 2.4, 0.003)]
            )
    return {"id": "markings", "class": "marking", "parts": [props.part("paint", "hall_markings", quads(flat), "white")]}


def _columns(props: Props) -> Entry:
    """Return the columns between every third pair of bays, with a striped foot."""
    shafts, stripes = [], []
    for x in _COLUMNS_X:
        for y in [y - BAY_M / 2 for y in _bays_y()[1::3]]:
            shafts.append(block((0.36, 0.36, HEIGHT_M), (x, y, HEIGHT_M / 2)))
            stripes.append(block((0.368, 0.368, 0.9), (x, y, 0.55)))
    parts = [
        props.part("shafts", "hall_columns", join(shafts), "concrete"),
        props.part("feet", "hall_feet", join(stripes), "stripe"),
    ]
    return {"id": "columns", "class": "column", "parts": parts}


def _lamps(props: Props) -> tuple[list[Entry], list[Entry]]:
    """Return 60 twin-tube fittings under the ceiling, along the lanes: 4400 lm each, and their light."""
    housings, lights = [], []
    for row, (x, step_m) in enumerate(zip(_LANES, _LAMP_STEPS_M, strict=True)):
        for number in range(20):
            y = round(-HALF_LENGTH_M + 1.5 + step_m * number, 3)
            housings.append(block((0.20, 1.32, 0.06), (x, y, HEIGHT_M - 0.42)))
            place = [x, y, HEIGHT_M - 0.452]
            lights.append(
                {
                    "name": f"lamp_{row}_{number}",
                    "kind": "area",
                    "group": "lamps",
                    "class": "fitting",
                    "geometry": {"kind": "rectangle", "size_m": [0.16, 1.2]},
                    "transform": {"rotate_deg": {"axis": "x", "angle_deg": 180}, "translate_m": place},
                    "luminous_flux_lm": 4400,
                    "spd": "FL11" if number % 7 else "FL2",
                }
            )
    fittings = {
        "id": "fittings",
        "class": "fitting",
        "parts": [props.part("housings", "hall_fittings", join(housings), "housing")],
    }
    return [fittings], lights


def _cars(props: Props, seed: int) -> list[Entry]:
    """Return 40 parked cars, one in six reversed in, and one that drives."""
    rng = stream(seed, "car park")
    bays = [(x, y, turn) for x, turn in _ROWS for y in _bays_y()]
    taken = sorted(rng.choice(len(bays), size=39, replace=False).tolist())
    cars = []
    for number, bay in enumerate(taken):
        x, y, turn = bays[bay]
        turn += (180.0 if rng.random() < 0.4 else 0.0) + rng.normal(0, 1.2)
        place = at((x + rng.normal(0, 0.12), y + rng.normal(0, 0.06), 0), turn)
        cars.append(props.random_car(f"car_{number}", rng, place))
    cars.append(
        props.car(
            "car_driving", "hatch", "#8d1c1f", at((-11.0, -12.5, 0), -90), lamps={"head": 20_000.0, "tail": 300.0, "spd": "A"}
        )
    )
    return cars


def _people(props: Props, seed: int) -> list[Entry]:
    places = ((-13.8, -18.5, 80.0), (-10.0, -4.0, -95.0), (-9.6, 8.0, 85.0))
    return [
        props.person(f"person_{n}", stream(seed, "person", n), at((x, y, 0), turn)) for n, (x, y, turn) in enumerate(places)
    ]
