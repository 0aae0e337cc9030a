"""Houses in a row: one unit each, with blank party walls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from fullwell.assets.starter.assembly import quads, span
from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.building_body import PARTY_SIDES, STEP_M, Body, opening_at, oriel, plain_look, rear
from fullwell.assets.starter.facades import Facade, PaneLots, WindowLook
from fullwell.assets.starter.roofs import SLATES, TILES_RED, Covering, chimney, gable_roof
from fullwell.assets.starter.shapes import Shape, extrusion

__all__ = ["TERRACE_STYLES", "TerraceStyle", "terraced_house"]

_LOOK = WindowLook(recess_m=0.14, columns=1, transom=0.52, sill_m=0.07, head="lintel")


@dataclass(frozen=True, slots=True)
class TerraceStyle:
    """Choices of a house in a row."""

    wall: str = "brick/yellow"
    trim: str = "stone/limestone"
    look: WindowLook = _LOOK
    covering: Covering = SLATES
    door: str = "coating/blue"
    bay_window: bool = True
    stepped_gable: bool = False


def terraced_house(
    rng: np.random.Generator,
    *,
    width_m: float = 6.0,
    depth_m: float = 9.0,
    floors: int = 2,
    style: str,
    storey_m: float = 3.0,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return one unit of a terrace: door and bay window, blank party walls, chimney stacks on them, a yard door behind."""
    chosen = TERRACE_STYLES[style]
    house = Body(width_m, depth_m, chosen.look, rng, chosen.wall, PaneLots(rng, warm=0.25, cool=0.03))
    ground = 3.3
    top = ground + (floors - 1) * storey_m
    _terrace_front(house, chosen, floors, ground, storey_m)
    for side in PARTY_SIDES:
        facade = house.side(side)
        facade.close(0.0, top)
        house.put(side, facade)
    back = house.side("back", plain_look(chosen.look))
    rear(back, floors, ground, storey_m, pitch_m=2.4, door=True)
    house.put("back", back)
    house.band("plinth", "concrete/grey", [(0, 0.0), (0.02, 0.0), (0.02, 0.12), (0, 0.14)])
    trim = [(0, top - 0.3), (0.05, top - 0.28), (0.05, top - 0.14), (0.14, top - 0.08), (0.14, top - 0.02), (-0.1, top + 0.02)]
    house.band("cornices", chosen.trim, trim)
    ridge = gable_roof(
        house.assembly,
        width_m,
        depth_m,
        top,
        pitch_deg=48 if chosen.stepped_gable else 36,
        covering=chosen.covering,
        wall_part="walls",
        wall_material=chosen.wall,
        rng=rng,
        overhang_m=0.05 if chosen.stepped_gable else 0.25,
        verge_m=0.0,
        to_street=chosen.stepped_gable,
    )
    if chosen.stepped_gable:
        height = _stepped_gable(house, chosen, top, ridge)
    else:
        for y in (-width_m / 2 + 0.47, width_m / 2 - 0.47):
            chimney(house.assembly, -0.3, y, ridge - 1.5, ridge + 1.0, material=chosen.wall, pots=1)
        height = ridge + 1.6
    house.downpipes(top - 0.2)
    return house.finish(
        ("city", "suburb", "house", "terraced", *tags),
        style="terraced house",
        floors=float(floors),
        ground_floor_m=ground,
        storey_m=storey_m,
        roof_m=round(height, 3),
    )


def _terrace_front(house: Body, style: TerraceStyle, floors: int, ground: float, storey_m: float) -> None:
    facade = house.side("front")
    width = facade.width_m
    door_y, room_y = -width / 2 + 1.25, width * 0.17
    facade.door(opening_at(door_y, 1.15, STEP_M, 2.75), material=style.door, fanlight_m=0.5)
    facade.assembly.add("lintels", style.trim, span((0.0, door_y - 0.8, 2.93), (0.05, door_y + 0.8, 3.12)))
    if style.bay_window:
        facade.openings.append(opening_at(room_y, 2.3, 0.0, 2.95))
    else:
        facade.window(opening_at(room_y - 0.75, 1.1, 0.85, 1.9))
        facade.window(opening_at(room_y + 0.85, 1.1, 0.85, 1.9))
    for floor in range(1, floors):
        low = ground + (floor - 1) * storey_m
        tall = 1.75 if floor == 1 else 1.45
        for y in (door_y + 0.1, room_y - 0.7, room_y + 0.9) if width > 5.5 else (door_y + 0.2, room_y + 0.2):
            facade.window(opening_at(y, 1.0, low + 0.75, tall))
        facade.assembly.add("cornices", style.trim, span((0.0, -width / 2, low - 0.09), (0.035, width / 2, low + 0.04)))
    facade.close(0.0, ground + (floors - 1) * storey_m)
    if style.bay_window:
        _canted_bay(facade, style, room_y)
    house.put("front", facade)


def _canted_bay(facade: Facade, style: TerraceStyle, y_m: float) -> None:
    """Three-sided bay: its front 0.75 m before the wall, its cheeks at 45 degrees; slate lid."""
    out, front, high = 0.75, 1.5, 2.95
    cheek = out * np.sqrt(2)
    look = replace(style.look, head="none", curtains=0.5)
    for turn, wide, x, y in (
        (0.0, front, out, 0.0),
        (45.0, cheek, out / 2, front / 2 + out / 2),
        (-45.0, cheek, out / 2, -front / 2 - out / 2),
    ):
        face = Facade(wide, look, facade.panes, facade.rng, facade.wall_part, facade.wall_material)
        pane = wide - 0.3
        face.window(opening_at(0.0, pane, 0.85, 1.75), look)
        face.close(0.0, high)
        face.assembly.add("bay_trim", style.trim, span((-0.03, -wide / 2, 2.66), (0.03, wide / 2, high)))
        facade.assembly.place(face.assembly, turn_deg=turn, x_m=x, y_m=y_m + y)
    edge = np.array(
        [
            (0.0, front / 2 + out + 0.1),
            (0.0, -front / 2 - out - 0.1),
            (out + 0.08, -front / 2 - 0.06),
            (out + 0.08, front / 2 + 0.06),
        ]
    )
    outline = edge[::-1] + np.array([0.0, y_m])
    outline = outline if _counter_clockwise(outline) else outline[::-1]
    facade.assembly.add("bay_roof", style.covering.material, extrusion(outline, 0.12).moved(z_m=high))
    slope = [
        (0.01, y_m - 1.2, high + 0.5),
        (out, y_m - front / 2, high + 0.12),
        (out, y_m + front / 2, high + 0.12),
        (0.01, y_m + 1.2, high + 0.5),
    ]
    ends = [
        [(0.01, y_m + s * 1.2, high + 0.5), (out, y_m + s * front / 2, high + 0.12), (0.01, y_m + s * 1.45, high + 0.12)]
        for s in (1.0, -1.0)
    ]
    triangles = Shape(np.array(ends[0] + ends[1]), np.array([[0, 1, 2], [3, 5, 4]]))
    facade.assembly.add("bay_roof", style.covering.material, quads([slope]), triangles)


def _counter_clockwise(outline: np.ndarray[Any, np.dtype[np.float64]]) -> bool:
    x, y = outline.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) > 0


def _stepped_gable(house: Body, style: TerraceStyle, top: float, ridge: float) -> float:
    """A crow-stepped gable wall before the roof, with a small window and stone copings."""
    width, x = house.width_m, house.depth_m / 2
    steps = 6
    rise = (ridge - top + 0.5) / steps
    for number in range(steps):
        half = width / 2 * (1 - number / steps) + 0.02
        z = top + number * rise
        house.assembly.add("gable_steps", style.wall, span((x - 0.32, -half, z), (x + 0.06, half, z + rise)))
        inner = width / 2 * (1 - (number + 1) / steps) + 0.02
        for side in (1.0, -1.0):
            ys = sorted((side * (half + 0.05), side * (inner if number < steps - 1 else 0.0)))
            house.assembly.add("coping", style.trim, span((x - 0.37, ys[0], z + rise), (x + 0.11, ys[1], z + rise + 0.09)))
    face = Facade(1.2, style.look, house.panes, house.rng)
    oriel(face, 0.8, 1.1)
    house.assembly.place(face.assembly, x_m=x + 0.06, z_m=top + 0.9)
    beam = span((x, -0.08, ridge - 0.55), (x + 1.0, 0.08, ridge - 0.38))
    house.assembly.add("hoist_beam", "wood/weathered", beam)
    return top + steps * rise + 0.09


TERRACE_STYLES: Mapping[str, TerraceStyle] = MappingProxyType(
    {
        "yellow_bay": TerraceStyle(),
        "red": TerraceStyle("brick/red", door="coating/red", bay_window=False),
        "stepped": TerraceStyle("brick/dark", covering=TILES_RED, bay_window=False, stepped_gable=True, door="coating/green"),
    }
)
"""Houses in a row by name."""
