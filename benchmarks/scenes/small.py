"""Scenes without files: the Cornell box, a colour chart, and a table with glass and metal."""

from __future__ import annotations

import math
import runpy
from pathlib import Path
from typing import Any

from benchmarks.scenes.meshes import revolve
from benchmarks.scenes.props import Props, Size, at, diffuse, metal, plastic, recipe

__all__ = ["colorchecker", "cornell_box", "tabletop_glass"]

Entry = dict[str, Any]

_EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _example(file: str) -> Entry:
    """Return the recipe of one of the examples."""
    return dict(runpy.run_path(str(_EXAMPLES / file))["RECIPE"])


def cornell_box(size: Size, folder: Path) -> Entry:
    """Return the Cornell box of the first example, seen by a wider film."""
    example = _example("01_cornell_box.py")
    pose = {"origin_m": [0, -3.9, 0], "target_m": [0, 0, 0]}
    lens = {"kind": "pinhole", "hfov_deg": 50, "f_number": 2}
    exposure = {"auto": {"method": "percentile", "percentile": 97, "level": 0.7}}
    return recipe("cornell-box", example["scene"], pose, lens, size=size, model="imx363", exposure=exposure)


def colorchecker(size: Size, folder: Path) -> Entry:
    """Return the chart of the second example under D65: only edges and wavelengths make noise here."""
    example = _example("02_colorchecker.py")
    pose = {"origin_m": [0, 0, 0.6], "target_m": [0, 0, 0], "up": [0, 1, 0]}
    lens = {"kind": "pinhole", "hfov_deg": 28, "f_number": 2.8}
    return recipe("colorchecker", example["scene"], pose, lens, size=size, model="imx363", depth=2)


# A table -------------------------------------------------------------------------------------------------------------

_OAK: Entry = {
    "wavelength_nm": [400, 450, 500, 550, 600, 650, 700],
    "values": [0.18, 0.24, 0.32, 0.43, 0.54, 0.61, 0.65],
    "source": "made up: oak under varnish, whose inner reflections darken it to about half",
}

_MATERIALS: dict[str, Entry] = {
    "wood": plastic(_OAK, 0.18),
    "plaster": diffuse(0.68),
    "back_wall": diffuse("#8fa3a8"),
    "floor": diffuse(0.25),
    "glass": {"kind": "dielectric", "interior_index": 1.52},
    "chrome": metal("chromium", 0.0),
    "brass": metal("gold", 0.12),
    "steel": metal("nickel", 0.2),
    "ceramic": plastic(0.72, 0.06),
    "red": plastic("colorchecker:red", 0.15),
    "blue": plastic("colorchecker:blue", 0.08),
    "yellow": plastic("colorchecker:yellow", 0.25),
    "green": plastic("colorchecker:green", 0.10),
    "orange": plastic("colorchecker:orange", 0.30),
    "black": plastic(0.03, 0.2),
}


def tabletop_glass(size: Size, folder: Path) -> Entry:
    """Return a laid table in a room: glasses, polished and brushed metal, glossy things, a lamp above and a window."""
    props = Props(folder)
    objects = [*_room(), *_table(), *_glassware(props), *_metalware(props), *_things(props)]
    sky = {"geometry": _rectangle(1.3, 1.2), "luminance_cd_m2": 2500, "spd": "daylight:6500K"}
    bulb = {"geometry": _rectangle(0.22, 0.22), "luminance_cd_m2": 18_000, "spd": "blackbody:3000K"}
    lights = [
        _light("window", (-1.75, 0.35, 1.55), (1.0, 0.35, 0.9), **sky),
        _light("lamp", (0.35, 0.15, 1.75), (0.35, 0.15, 0.0), **bulb),
    ]
    scene = {
        "materials": _MATERIALS,
        "classes": ["room", "table", "glass", "metal", "thing"],
        "objects": objects,
        "lights": lights,
    }
    pose = {"origin_m": [0.05, -1.02, 1.22], "target_m": [0.0, 0.06, 0.80]}
    lens = {"kind": "thin_lens", "hfov_deg": 50, "f_number": 2.8, "focus_distance_m": 1.05}
    exposure = {"auto": {"method": "percentile", "percentile": 98, "level": 0.7}}
    return recipe("tabletop-glass", scene, pose, lens, size=size, model="imx363", exposure=exposure, depth=12)


def _light(name: str, place: tuple[float, ...], target: tuple[float, ...], **others: Any) -> Entry:
    """Return a rectangle that shines from `place` towards `target`; its name is its group."""
    facing = {"origin_m": list(place), "target_m": list(target), "up": [0, 1, 0] if place[2] > 1.7 else [0, 0, 1]}
    return {"name": name, "kind": "area", "group": name, "transform": {"look_at": facing}, **others}


def _rectangle(width_m: float, height_m: float) -> Entry:
    return {"kind": "rectangle", "size_m": [width_m, height_m]}


def _wall(name: str, material: str, corners_m: list[list[float]]) -> Entry:
    return {"id": name, "class": "room", "geometry": {"kind": "quad", "corners_m": corners_m}, "material": material}


def _room() -> list[Entry]:
    x, near, far, top = 1.8, -1.8, 1.3, 2.5
    return [
        _wall("floor", "floor", [[-x, near, 0], [x, near, 0], [x, far, 0], [-x, far, 0]]),
        _wall("ceiling", "plaster", [[-x, far, top], [x, far, top], [x, near, top], [-x, near, top]]),
        _wall("back", "back_wall", [[-x, far, 0], [x, far, 0], [x, far, top], [-x, far, top]]),
        _wall("left", "plaster", [[-x, near, 0], [-x, far, 0], [-x, far, top], [-x, near, top]]),
        _wall("right", "plaster", [[x, far, 0], [x, near, 0], [x, near, top], [x, far, top]]),
        _wall("front", "plaster", [[x, near, 0], [-x, near, 0], [-x, near, top], [x, near, top]]),
    ]


_TOP_M = 0.75


def _table() -> list[Entry]:
    legs = [(sx * 0.72, sy * 0.36) for sx in (-1, 1) for sy in (-1, 1)]
    parts: list[Entry] = [
        {
            "name": "top",
            "geometry": {"kind": "cube", "size_m": [1.6, 0.9, 0.035]},
            "material": "wood",
            "transform": {"translate_m": [0, 0.08, _TOP_M - 0.0175]},
        }
    ]
    for number, (x, y) in enumerate(legs):
        place = {"translate_m": [x, y + 0.08, (_TOP_M - 0.035) / 2]}
        parts.append(
            {
                "name": f"leg_{number}",
                "geometry": {"kind": "cube", "size_m": [0.06, 0.06, _TOP_M - 0.035]},
                "material": "wood",
                "transform": place,
            }
        )
    return [{"id": "table", "class": "table", "parts": parts}]


def _turned(
    props: Props, name: str, profile: list[tuple[float, float]], kind: str, material: str, *, place: tuple[float, float]
) -> Entry:
    """Return a body of revolution standing on the table."""
    parts = [props.part(name, name, revolve(profile, segments=96), material)]
    return {"id": name, "class": kind, "parts": parts, "transform": at((*place, _TOP_M + 0.0005))}


def _arc(
    centre: tuple[float, float], radius: float, start_deg: float, end_deg: float, count: int = 9
) -> list[tuple[float, float]]:
    angles = [math.radians(start_deg + (end_deg - start_deg) * k / (count - 1)) for k in range(count)]
    return [(max(1e-4, centre[0] + radius * math.cos(a)), centre[1] + radius * math.sin(a)) for a in angles]


def _glassware(props: Props) -> list[Entry]:
    """Return a ball, a tumbler with a thick foot and a wine glass; each wall has two sides."""
    tumbler = [
        (1e-4, 0.0),
        (0.033, 0.0),
        (0.036, 0.004),
        (0.040, 0.105),
        (0.0388, 0.1065),
        (0.0374, 0.105),
        (0.0335, 0.016),
        (0.030, 0.0125),
        (1e-4, 0.012),
    ]
    bowl_outside = _arc((0.0, 0.135), 0.042, -80, 25, 15)
    bowl_inside = _arc((0.0, 0.135), 0.0402, 24, -78, 15)
    wine = [
        (1e-4, 0.0),
        (0.034, 0.0),
        (0.0345, 0.0015),
        (0.03, 0.004),
        (0.008, 0.008),
        (0.004, 0.016),
        (0.0038, 0.075),
        (0.006, 0.0895),
        *bowl_outside,
        (0.0365, 0.178),
        (0.0355, 0.1785),
        (0.0348, 0.178),
        *bowl_inside,
        (1e-4, 0.0955),
    ]
    ball = {
        "id": "glass_ball",
        "class": "glass",
        "geometry": {"kind": "sphere", "radius_m": 0.055},
        "material": "glass",
        "transform": {"translate_m": [-0.07, -0.13, _TOP_M + 0.0552]},
    }
    return [
        ball,
        _turned(props, "tumbler", tumbler, "glass", "glass", place=(0.13, -0.10)),
        _turned(props, "wine_glass", wine, "glass", "glass", place=(-0.24, 0.05)),
        _turned(props, "wine_glass_far", wine, "glass", "glass", place=(0.36, 0.26)),
    ]  # fmt: skip


def _metalware(props: Props) -> list[Entry]:
    bowl = [
        (1e-4, 0.0),
        (0.04, 0.0),
        (0.045, 0.006),
        *_arc((0.0, 0.10), 0.105, -60, -8, 12),
        (0.103, 0.087),
        *_arc((0.0, 0.10), 0.1015, -8, -65, 12),
        (1e-4, 0.0095),
    ]
    pot = [
        (1e-4, 0.0),
        (0.05, 0.0),
        (0.055, 0.006),
        (0.058, 0.06),
        (0.05, 0.12),
        (0.034, 0.15),
        (0.036, 0.158),
        (0.02, 0.166),
        (0.006, 0.172),
        (0.012, 0.18),
        (0.010, 0.19),
        (1e-4, 0.194),
    ]
    ball = {
        "id": "chrome_ball",
        "class": "metal",
        "geometry": {"kind": "sphere", "radius_m": 0.05},
        "material": "chrome",
        "transform": {"translate_m": [0.02, 0.06, _TOP_M + 0.0502]},
    }
    return [
        ball,
        _turned(props, "brass_pot", pot, "metal", "brass", place=(-0.42, 0.20)),
        _turned(props, "steel_bowl", bowl, "metal", "steel", place=(0.20, 0.16)),
    ]  # fmt: skip


def _things(props: Props) -> list[Entry]:
    """Return a mug, fruit in the bowl, books, a die and a plate."""
    mug = [
        (1e-4, 0.0),
        (0.036, 0.0),
        (0.04, 0.004),
        (0.041, 0.09),
        (0.0385, 0.092),
        (0.036, 0.09),
        (0.035, 0.008),
        (1e-4, 0.007),
    ]
    plate = [
        (1e-4, 0.0),
        (0.06, 0.0),
        (0.075, 0.008),
        (0.115, 0.018),
        (0.116, 0.0205),
        (0.113, 0.0205),
        (0.075, 0.0115),
        (0.06, 0.005),
        (1e-4, 0.005),
    ]
    vase = [
        (1e-4, 0.0),
        (0.04, 0.0),
        (0.06, 0.05),
        (0.064, 0.10),
        (0.045, 0.17),
        (0.022, 0.22),
        (0.025, 0.26),
        (0.03, 0.275),
        (0.026, 0.275),
        (0.018, 0.22),
        (1e-4, 0.15),
    ]
    things = [
        _turned(props, "mug", mug, "thing", "blue", place=(0.33, -0.02)),
        _turned(props, "plate", plate, "thing", "ceramic", place=(-0.30, -0.15)),
        _turned(props, "vase", vase, "thing", "ceramic", place=(-0.08, 0.36)),
    ]
    fruit = (
        ("orange", 0.038, 0.17, 0.15, 0.055),
        ("red", 0.035, 0.235, 0.14, 0.058),
        ("green", 0.034, 0.205, 0.205, 0.06),
        ("yellow", 0.036, -0.30, -0.15, 0.041),
    )
    for material, radius, x, y, z in fruit:
        things.append(
            {
                "id": f"fruit_{material}",
                "class": "thing",
                "geometry": {"kind": "sphere", "radius_m": radius},
                "material": material,
                "transform": {"translate_m": [x, y, _TOP_M + z]},
            }
        )
    books = (
        ("black", [0.22, 0.16, 0.028], 0.50, 0.02, 0.014, 12),
        ("red", [0.19, 0.14, 0.022], 0.505, 0.02, 0.039, 20),
        ("ceramic", [0.17, 0.12, 0.018], 0.50, 0.015, 0.059, 4),
    )
    for number, (material, edges, x, y, z, turn) in enumerate(books):
        things.append(
            {
                "id": f"book_{number}",
                "class": "thing",
                "geometry": {"kind": "cube", "size_m": edges},
                "material": material,
                "transform": at((x, y, _TOP_M + z + 0.0005 * number), turn),
            }
        )
    things.append(
        {
            "id": "die",
            "class": "thing",
            "geometry": {"kind": "cube", "size_m": [0.05, 0.05, 0.05]},
            "material": "yellow",
            "transform": at((0.02, -0.22, _TOP_M + 0.0252), 32),
        }
    )
    return things
