"""Scenes of any size for scaling: fields of trees, grids of things, rooms with many lamps. All are recipes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from benchmarks.scenes.meshes import ellipsoid
from benchmarks.scenes.plants import tree_parts
from benchmarks.scenes.props import Props, Size, at, diffuse, plastic, recipe
from fullwell.core.rng import stream

__all__ = ["lamp_hall", "thing_grid", "tree_field"]

Entry = dict[str, Any]

_GROUND_M = 400.0
_POSE = {"origin_m": [0, -14.0, 9.0], "target_m": [0, 30.0, 0.0]}
_LENS = {"kind": "pinhole", "hfov_deg": 60, "f_number": 4}


def tree_field(size: Size, folder: Path, *, triangles: int) -> Entry:
    """Return about so many triangles: one tree of 10 000 placed again and again, each copy turned and scaled."""
    props = Props(folder)
    meshes = tree_parts(stream(0, "field"), leaves=4400)
    in_tree = sum(len(mesh.faces) for mesh in meshes.values())
    count = max(1, round(triangles / in_tree))
    rng = stream(0, "field places")
    trees = []
    for number, (x, y) in enumerate(_grid(count, 5.5)):
        parts = [
            props.part("wood", "wood", meshes["wood"], diffuse("#4f4034")),
            props.part("leaves", "leaves", meshes["leaves"], diffuse("#47662c")),
        ]
        place = at((x + rng.normal(0, 0.8), y + rng.normal(0, 0.8), 0), rng.uniform(0, 360), float(rng.uniform(0.8, 1.2)))
        trees.append({"id": f"tree_{number}", "class": "tree", "parts": parts, "transform": place})
    return _outdoors("tree-field", trees, size)


def thing_grid(size: Size, folder: Path, *, count: int, triangles: int = 400_000) -> Entry:
    """Return `count` placed balls of one mesh that have `triangles` together."""
    segments = max(3, round(math.sqrt(triangles / count / 0.96)))
    mesh = ellipsoid((0.5, 0.5, 0.5), (0, 0, 0.5), segments=segments)
    props = Props(folder)
    materials = [plastic("colorchecker:red", 0.2), diffuse(0.5), plastic("colorchecker:blue", 0.1), diffuse("#c9b28a")]
    things = []
    for number, (x, y) in enumerate(_grid(count, 1.6)):
        part = props.part("ball", "ball", mesh, f"m{number % len(materials)}")
        things.append({"id": f"thing_{number}", "class": "thing", "parts": [part], "transform": at((x, y, 0), 37 * number)})
    document = _outdoors("thing-grid", things, size)
    document["scene"]["materials"] |= {f"m{number}": material for number, material in enumerate(materials)}
    return document


def lamp_hall(size: Size, folder: Path, *, count: int) -> Entry:
    """Return balls on a floor under `count` small lamps, all together equally bright."""
    side = math.ceil(math.sqrt(count))
    lights = []
    for number in range(count):
        row, column = divmod(number, side)
        x, y = (40.0 * ((k + 0.5) / side - 0.5) for k in (column, row))
        entry: Entry = {"name": f"lamp_{number}", "kind": "area", "group": "lamps", "spd": ("A", "D65", "LED-B3")[number % 3]}
        entry |= {"geometry": {"kind": "rectangle", "size_m": [0.3, 0.3]}, "luminance_cd_m2": round(4e7 / count, 3)}
        entry["transform"] = {
            "rotate_deg": {"axis": "x", "angle_deg": 180},
            "translate_m": [round(x, 4), round(y + 12.0, 4), 4.0 + 0.1 * (number % 7)],
        }
        lights.append(entry)
    mesh = ellipsoid((0.5, 0.5, 0.5), (0, 0, 0.5), segments=24)
    props = Props(folder)
    balls = [
        {"id": f"ball_{k}", "class": "thing", "parts": [props.part("ball", "ball", mesh, "grey")], "transform": at((x, y, 0))}
        for k, (x, y) in enumerate(_grid(64, 3.0))
    ]
    scene = {"materials": {"grey": diffuse(0.5), "ground": diffuse(0.3)}, "objects": [_ground(), *balls], "lights": lights}
    return recipe("lamp-hall", scene, _POSE, _LENS, size=size, model="imx363", exposure={"auto": {"method": "percentile"}})


def _outdoors(name: str, objects: list[Entry], size: Size) -> Entry:
    sun = {"name": "sky", "kind": "sun_sky", "sun_elevation_deg": 40, "sun_azimuth_deg": 205, "turbidity": 3}
    scene = {"materials": {"ground": diffuse("#5d6a45")}, "objects": [_ground(), *objects], "lights": [sun]}
    return recipe(name, scene, _POSE, _LENS, size=size, model="imx363", exposure={"auto": {"method": "percentile"}})


def _ground() -> Entry:
    half = _GROUND_M / 2
    corners = [[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]]
    return {"id": "ground", "class": "ground", "geometry": {"kind": "quad", "corners_m": corners}, "material": "ground"}


def _grid(count: int, step_m: float) -> list[tuple[float, float]]:
    """Return places in rows that begin in front of the camera."""
    columns = max(1, math.ceil(math.sqrt(count)))
    return [(((n % columns) - (columns - 1) / 2) * step_m, (n // columns) * step_m) for n in range(count)]
