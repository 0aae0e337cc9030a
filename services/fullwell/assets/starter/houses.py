"""Detached suburban houses with porch, garage, chimney and dormers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from fullwell.assets.starter.assembly import quads, span
from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.building_body import SIDES, Body, Side, bay_centres, opening_at, oriel, plain_look
from fullwell.assets.starter.facades import Facade, PaneLots, WindowLook
from fullwell.assets.starter.roofs import TILES_DARK, TILES_RED, Covering, Dormer, chimney, dormer, gable_roof, hip_roof

__all__ = ["HOUSE_STYLES", "HouseStyle", "detached_house"]

_LOOK = WindowLook(recess_m=0.12, columns=2, sill_m=0.05, head="soldier", trim_material="concrete/light", transom=0.72)
_SHUTTERED = WindowLook(recess_m=0.18, columns=2, bars=2, sill_m=0.06, surround_m=0.025, shutters="hinged")
_PLASTERED = WindowLook(
    recess_m=0.14,
    columns=2,
    sill_m=0.05,
    trim_material="concrete/grey",
    shutters="roller",
    shutter_material="plastic/grey",
    frame_material="coating/black",
)


@dataclass(frozen=True, slots=True)
class HouseStyle:
    """Choices of a detached house."""

    wall: str = "brick/red"
    trim: str = "stone/limestone"
    look: WindowLook = _LOOK
    roof: Literal["gable", "hip", "gable_to_street"] = "gable"
    covering: Covering = TILES_RED
    pitch_deg: float = 40.0
    door: str = "wood/oak"
    garage: str = "coating/white"
    dormers: int = 0


def detached_house(
    rng: np.random.Generator,
    *,
    width_m: float = 9.6,
    depth_m: float = 8.4,
    floors: int = 2,
    style: str,
    storey_m: float = 2.75,
    garage: bool = True,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a suburban house; the last storey is under the roof where there are dormers; a garage stands at its side."""
    chosen = HOUSE_STYLES[style]
    house = Body(width_m, depth_m, chosen.look, rng, chosen.wall, PaneLots(rng, warm=0.25, cool=0.03))
    base = 0.3
    full = floors - (1 if chosen.dormers else 0)
    top = base + full * storey_m + 0.25
    for side in SIDES:
        facade = house.side(side)
        _house_side(facade, chosen, side, full=full, base=base, storey_m=storey_m)
        facade.close(0.0, top)
        house.put(side, facade)
    house.band("plinth", "concrete/grey", [(0, 0.0), (0.025, 0.0), (0.025, base - 0.06), (0, base - 0.04)])
    ridge = _house_roof(house, chosen, top)
    _porch(house, chosen, base)
    if garage:
        _garage(house, chosen, rng)
    return house.finish(
        ("suburb", "house", "detached", *tags),
        style="detached house",
        floors=float(floors),
        ground_floor_m=storey_m + base,
        storey_m=storey_m,
        roof_m=round(ridge, 3),
    )


def _house_side(facade: Facade, style: HouseStyle, side: Side, *, full: int, base: float, storey_m: float) -> None:
    width = facade.width_m
    thirds = (-width * 0.31, 0.0, width * 0.31)
    for floor in range(full):
        low = base + floor * storey_m
        if side == "front":
            facade.window(opening_at(thirds[0], 2.0, low + 0.85, 1.4), replace(style.look, columns=3))
            facade.window(opening_at(thirds[2], 1.5, low + 0.85, 1.4))
            if floor == 0:
                facade.door(opening_at(0.0, 1.15, base, 2.45), material=style.door, fanlight_m=0.3)
            else:
                facade.window(opening_at(0.0, 1.0, low + 0.95, 1.3), replace(style.look, columns=1))
        elif side == "back":
            facade.window(opening_at(thirds[2], 1.5, low + 0.85, 1.4))
            if floor == 0:
                facade.window(
                    opening_at(thirds[0], 2.4, low + 0.03, 2.15),
                    replace(style.look, columns=3, transom=0, curtains=0.6),
                    sill=False,
                )
                facade.door(opening_at(width * 0.06, 1.0, base, 2.2), material="wood/painted_white", fanlight_m=0.0)
            else:
                facade.window(opening_at(thirds[0], 2.0, low + 0.85, 1.4))
        else:
            facade.window(opening_at(width * 0.2, 1.0, low + 0.95, 1.25))
            if floor == 0 or side == "right":
                facade.window(opening_at(-width * 0.22, 0.7, low + 1.2, 0.9), replace(style.look, columns=1, transom=0))


def _house_roof(house: Body, style: HouseStyle, top: float) -> float:
    rng, width, depth = house.rng, house.width_m, house.depth_m
    if style.roof == "hip":
        ridge = hip_roof(house.assembly, width, depth, top, pitch_deg=style.pitch_deg, covering=style.covering, rng=rng)
        chimney(
            house.assembly,
            -0.6,
            -width * 0.22,
            ridge - 1.6,
            ridge + 0.7,
            material=style.wall if style.wall.startswith("brick") else "brick/red",
        )
        house.downpipes(top - 0.4)
        return ridge + 1.2
    across = style.roof == "gable_to_street"
    ridge = gable_roof(
        house.assembly,
        width,
        depth,
        top,
        pitch_deg=style.pitch_deg,
        covering=style.covering,
        wall_part="walls",
        wall_material=style.wall,
        rng=rng,
        to_street=across,
    )
    if across:
        face = Facade(2.0, style.look, house.panes, rng, "walls", style.wall)
        # A window laid on the gable: frame, pane and sill stand in front of the wall, as in an oriel of a hand's depth.
        oriel(face, 1.3, 1.3)
        house.assembly.place(face.assembly, x_m=depth / 2, z_m=top + 0.35)
    tangent = float(np.tan(np.deg2rad(style.pitch_deg)))
    kind = Dormer(1.3, 1.25, 2.0, "gable", "wood/painted_white", style.covering.material, style.covering)
    for y in bay_centres(width - 1.2, (width - 1.2) / style.dormers) if style.dormers else []:
        back = 0.7
        dormer(
            house.assembly,
            replace(kind, depth_m=2.0 / tangent + 0.2),
            at_m=(depth / 2 - back, y, top + back * tangent + 0.12),
            look=plain_look(style.look),
            panes=house.panes,
            rng=rng,
        )
    y, x = (0.0, -depth * 0.2) if across else (-width * 0.3, -0.5)
    chimney(
        house.assembly, x, y, ridge - 1.3, ridge + 0.75, material=style.wall if style.wall.startswith("brick") else "brick/red"
    )
    house.downpipes(top - 0.35)
    return ridge + 1.3


def _porch(house: Body, style: HouseStyle, base: float) -> None:
    x = house.depth_m / 2
    house.assembly.add(
        "porch",
        "stone/granite",
        span((x, -1.1, 0.0), (x + 1.2, 1.1, base / 2)),
        span((x, -0.9, base / 2), (x + 0.8, 0.9, base)),
    )
    for y in (-0.95, 0.95):
        house.assembly.add("porch_posts", "wood/painted_white", span((x + 0.98, y - 0.06, base / 2), (x + 1.1, y + 0.06, 2.75)))
    lid = [(x - 0.02, -1.2, 3.15), (x + 1.3, -1.2, 2.8), (x + 1.3, 1.2, 2.8), (x - 0.02, 1.2, 3.15)]
    thick = np.array(lid) - [0, 0, 0.08]
    faces = [lid, thick[::-1]]
    for here in range(4):
        there = (here + 1) % 4
        faces.append([thick[here], thick[there], lid[there], lid[here]])
    house.assembly.add("porch_roof", style.covering.material, quads(np.array(faces)))
    house.assembly.add("porch_posts", "wood/painted_white", span((x + 0.96, -1.1, 2.68), (x + 1.12, 1.1, 2.8)))


def _garage(house: Body, style: HouseStyle, rng: np.random.Generator) -> None:
    wide, deep, high = 3.4, 6.0, 2.7
    side = Body(wide, deep, style.look, rng, style.wall, house.panes)
    for name in SIDES:
        facade = side.side(name)
        if name == "front":
            facade.garage_door(opening_at(0.0, 2.5, 0.02, 2.15), material=style.garage)
        elif name == "left":
            facade.window(opening_at(0.5, 1.0, 1.1, 0.8), replace(style.look, columns=1, transom=0))
        elif name == "back":
            facade.door(opening_at(0.0, 0.95, 0.02, 2.1), material="coating/grey", fanlight_m=0.0)
        facade.close(0.0, high)
        side.put(name, facade)
    side.band("fascia", "wood/painted_white", [(0, high - 0.12), (0.12, high - 0.12), (0.12, high + 0.08), (-0.3, high + 0.1)])
    side.assembly.add("garage_roof", "roof/metal", span((-deep / 2, -wide / 2, high), (deep / 2, wide / 2, high + 0.07)))
    house.assembly.place(side.assembly, x_m=house.depth_m / 2 - deep / 2 - 0.8, y_m=house.width_m / 2 + wide / 2 + 0.001)


HOUSE_STYLES: Mapping[str, HouseStyle] = MappingProxyType(
    {
        "brick": HouseStyle(),
        "white_hip": HouseStyle(
            "plaster/white",
            roof="hip",
            covering=TILES_DARK,
            pitch_deg=32,
            look=_PLASTERED,
            door="coating/black",
            garage="coating/grey",
        ),
        "dormers": HouseStyle(
            "plaster/cream",
            covering=TILES_DARK,
            pitch_deg=47,
            dormers=2,
            door="coating/red",
            look=replace(_SHUTTERED, surround_m=0.0, shutter_material="coating/red"),
        ),
        "gable": HouseStyle("brick/yellow", roof="gable_to_street", pitch_deg=45, door="coating/green"),
    }
)
"""Detached houses by name."""
