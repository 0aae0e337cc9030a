"""Nineteenth-century blocks of dwellings over shops, whose storeys grow plainer towards the roof; town houses and mills."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from fullwell.assets.starter.assembly import Assembly, boxes
from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.building_body import SIDES, STEP_M, TURN_DEG, Body, Side, bay_centres, opening_at, plain_look, rear
from fullwell.assets.starter.facades import Balcony, Facade, Opening, PaneLots, WindowLook, courses
from fullwell.assets.starter.roofs import (
    SLATES,
    TILES_RED,
    Covering,
    Dormer,
    chimney,
    dormer,
    flat_roof,
    gable_roof,
    mansard_roof,
)

__all__ = ["CITY_STYLES", "CityStyle", "city_block"]

_PLAIN_LOOK = WindowLook()


@dataclass(frozen=True, slots=True)
class CityStyle:
    """Choices of a nineteenth-century block, whose storeys grow lower towards the roof."""

    wall: str = "plaster/cream"
    ground: str = "stone/sandstone"
    trim: str = "stone/limestone"
    look: WindowLook = _PLAIN_LOOK
    pitch_m: float = 2.6
    window_m: tuple[float, float] = (1.15, 1.95)
    shop_materials: tuple[str, ...] = ("coating/green", "coating/black", "coating/red", "coating/blue", "wood/oak")
    awnings: tuple[str, ...] = ("", "plastic/red", "", "plastic/green")
    balcony: Balcony | None = None
    balcony_bays: Literal["middle", "alternate", "first_floor"] = "middle"
    rustication_m: float = 0.42
    quoins: bool = True
    brackets: bool = True
    roof: Literal["mansard", "flat", "gable"] = "mansard"
    covering: Covering = SLATES
    pitch_deg: float = 42.0
    parapet_m: float = 1.0


def city_block(
    rng: np.random.Generator,
    *,
    width_m: float,
    depth_m: float,
    floors: int,
    style: str,
    ground_m: float = 4.2,
    storey_m: float = 3.4,
    corner: bool = False,
    shops: bool = True,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a block of dwellings over shops. `corner`: the side towards +y is a street facade too."""
    chosen = CITY_STYLES[style]
    house = Body(width_m, depth_m, chosen.look, rng, chosen.wall, PaneLots(rng))
    top = ground_m + (floors - 1) * storey_m
    streets: tuple[Side, ...] = ("front", "left") if corner else ("front",)
    for side in SIDES:
        facade = house.side(side, chosen.look if side in streets else plain_look(chosen.look))
        if side in streets:
            _city_ground(facade, chosen, ground_m, shops=shops)
            _city_storeys(facade, chosen, floors, ground_m, storey_m)
        else:
            rear(facade, floors, ground_m, storey_m, pitch_m=3.0 if side == "back" else 5.2, door=side == "back")
        house.put(side, facade)
    _city_bands(house, chosen, ground_m=ground_m, storey_m=storey_m, floors=floors, top=top)
    height = _city_roof(house, chosen, top, streets)
    house.downpipes(top)
    return house.finish(
        ("city", "block", *tags, *(("corner",) if corner else ()), *(("shops",) if shops else ())),
        style="city block",
        floors=float(floors),
        ground_floor_m=ground_m,
        storey_m=storey_m,
        roof_m=round(height, 3),
    )


def _city_ground(facade: Facade, style: CityStyle, ground_m: float, *, shops: bool) -> None:
    facade.wall_part, facade.wall_material = "ground_walls", style.ground
    width, rng = facade.width_m, facade.rng
    top = ground_m - 0.45
    if shops:
        count = max(round((width - 2.2) / 5.2), 1)
        pier = 0.6
        door = 1.5 if width > 7 else 1.25
        slot = (width - door - pier * (count + 2)) / count
        gate = int(rng.integers(0, count + 1))
        at = -width / 2 + pier
        for number in range(count + 1):
            if number == gate:
                facade.door(opening_at(at + door / 2, door, STEP_M, top - STEP_M - 0.35), leaves=2, fanlight_m=0.55)
                at += door + pier
            if number < count:
                material = style.shop_materials[int(rng.integers(len(style.shop_materials)))]
                awning = style.awnings[int(rng.integers(len(style.awnings)))]
                door_at = float(rng.choice([0.0, 0.5, 1.0])) * 0.94 + 0.03
                facade.shop(Opening(at, at + slot, 0.0, top), material=material, door_at=door_at, awning=awning)
                at += slot + pier
    else:
        bays = bay_centres(width - 0.8, style.pitch_m)
        gate = len(bays) // 2
        for number, y in enumerate(bays):
            if number == gate:
                facade.door(opening_at(y, 1.5, STEP_M, top - STEP_M - 0.2), leaves=2, fanlight_m=0.6)
            else:
                facade.window(
                    opening_at(y, style.window_m[0], 1.3, ground_m - 2.1),
                    replace(style.look, head="none", shutters="none", surround_m=0.0),
                )
    band = courses(width, 0.55, ground_m - 0.2, facade.openings, course_m=style.rustication_m, out_m=0.035, groove_m=0.025)
    plinth = courses(width, 0.0, 0.55, facade.openings, course_m=0.55, out_m=0.06, groove_m=0.0)
    facade.assembly.add("rustication", style.ground, band)
    facade.assembly.add("plinth", "stone/granite", plinth)
    facade.close(0.0, ground_m)
    facade.wall_part, facade.wall_material = "walls", style.wall


def _city_storeys(facade: Facade, style: CityStyle, floors: int, ground_m: float, storey_m: float) -> None:
    bays = bay_centres(facade.width_m - 0.8, style.pitch_m)
    wide, tall = style.window_m
    for floor in range(1, floors):
        low = ground_m + (floor - 1) * storey_m
        high_floor = floor in (1, 2)
        look = style.look
        if look.head == "pediment" and not (floor in (1, 2) and floor < floors - 1):
            look = replace(look, head="lintel" if high_floor else "none")
        for number, y in enumerate(bays):
            if style.balcony is not None and _has_balcony(style, number, len(bays), floor):
                # A pediment would reach into the balcony above.
                plainer = replace(look, head="none") if style.balcony_bays != "first_floor" else look
                facade.window(opening_at(y, wide, low + 0.06, tall + 0.72), plainer, sill=False)
                if style.balcony_bays != "first_floor":
                    facade.balcony(y - wide / 2 - 0.5, y + wide / 2 + 0.5, low + 0.03, style.balcony)
            else:
                facade.window(opening_at(y, wide, low + 0.78, tall), look)
        if style.balcony is not None and style.balcony_bays == "first_floor" and floor == 1:
            facade.balcony(bays[0] - wide / 2 - 0.6, bays[-1] + wide / 2 + 0.6, low + 0.03, style.balcony)
    facade.close(ground_m, ground_m + (floors - 1) * storey_m)


def _has_balcony(style: CityStyle, number: int, count: int, floor: int) -> bool:
    if style.balcony_bays == "first_floor":
        return floor == 1
    if style.balcony_bays == "alternate":
        return number % 2 == 1 and (number + floor) % 4 in (0, 1)
    return floor in (1, 2, 3) and abs(number - (count - 1) / 2) < 1


def _city_bands(house: Body, style: CityStyle, *, ground_m: float, storey_m: float, floors: int, top: float) -> None:
    g = ground_m
    house.band(
        "cornices",
        style.trim,
        [(0, g - 0.2), (0.07, g - 0.17), (0.07, g - 0.06), (0.16, g - 0.03), (0.16, g + 0.03), (0, g + 0.07)],
    )
    for floor in range(2, floors):
        z = g + (floor - 1) * storey_m
        house.band("cornices", style.trim, [(0, z - 0.1), (0.05, z - 0.1), (0.05, z + 0.02), (0.03, z + 0.06), (0, z + 0.07)])
    profile = [
        (0, -0.55),
        (0.04, -0.55),
        (0.04, -0.42),
        (0.07, -0.38),
        (0.07, -0.16),
        (0.45, -0.12),
        (0.45, -0.03),
        (0.52, 0.05),
        (0.52, 0.1),
        (-0.12, 0.16),
    ]
    house.band("cornices", style.trim, [(out, top + z) for out, z in profile])
    if style.brackets:
        for length, turn, reach in (
            (house.width_m, 0.0, house.depth_m / 2),
            (house.depth_m, 90.0, house.width_m / 2),
            (house.width_m, 180.0, house.depth_m / 2),
            (house.depth_m, -90.0, house.width_m / 2),
        ):
            spots = np.array(bay_centres(length, 0.62))
            count = len(spots)
            low = np.column_stack([np.full(count, 0.05), spots - 0.09, np.full(count, top - 0.36)])
            high = np.column_stack([np.full(count, 0.36), spots + 0.09, np.full(count, top - 0.13)])
            house.assembly.add("cornices", style.trim, boxes(low, high).moved(reach).turned("z", turn))
    if style.quoins:
        _quoins(house, style.trim, ground_m + 0.08, top - 0.56)


def _quoins(house: Body, material: str, low_m: float, high_m: float) -> None:
    count = max(int((high_m - low_m) / 0.38), 1)
    step = (high_m - low_m) / count
    low, high = [], []
    for sx in (1.0, -1.0):
        for sy in (1.0, -1.0):
            for number in range(count):
                lx, ly = (0.62, 0.34) if number % 2 else (0.34, 0.62)
                x, y, z, out = sx * house.depth_m / 2, sy * house.width_m / 2, low_m + number * step, 0.03
                xs, ys = sorted((x + sx * out, x - sx * lx)), sorted((y + sy * out, y - sy * ly))
                low.append((xs[0], ys[0], z + 0.01))
                high.append((xs[1], ys[1], z + step - 0.01))
    house.assembly.add("quoins", material, boxes(low, high))


def _city_roof(house: Body, style: CityStyle, top: float, streets: Sequence[Side]) -> float:
    rng, width, depth = house.rng, house.width_m, house.depth_m
    if style.roof == "flat":
        return flat_roof(
            house.assembly,
            width,
            depth,
            top + 0.12,
            rng=rng,
            parapet_m=style.parapet_m,
            wall_material=style.wall,
            coping_material=style.trim,
            plant=2,
        )
    if style.roof == "gable":
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
            overhang_m=0.55,
            verge_m=0.05,
        )
        tangent = float(np.tan(np.deg2rad(style.pitch_deg)))
        kind = Dormer(1.1, 1.35, 2.2, "gable", style.wall, style.covering.material, style.covering)
        for y in bay_centres(width - 2.0, style.pitch_m * 1.6):
            dormer(
                house.assembly,
                replace(kind, depth_m=2.1 / tangent + 0.3),
                at_m=(depth / 2 - 0.9, y, top + 0.9 * tangent - 0.1),
                look=plain_look(style.look),
                panes=house.panes,
                rng=rng,
            )
        for y in (-width * 0.3, width * 0.32):
            chimney(house.assembly, -0.5, y, ridge - 1.2, ridge + 1.0, pots=4)
        return ridge + 1.6
    height = 2.9
    ridge = mansard_roof(house.assembly, width, depth, top + 0.14, height_m=height, covering=style.covering, rng=rng)
    kind = Dormer(1.05, 1.55, 1.3, "gable" if style.look.head == "pediment" else "lid", "wood/painted_white")
    for side in streets:
        length, reach = (width, depth / 2) if side == "front" else (depth, width / 2)
        row = Assembly()
        for y in bay_centres(length - 0.8, style.pitch_m):
            dormer(row, kind, at_m=(reach - 0.42, y, top + 0.75), look=plain_look(style.look), panes=house.panes, rng=rng)
        house.assembly.place(row, turn_deg=TURN_DEG[side])
    for x, y in ((-0.2 * depth, width / 2 - 1.6), (0.1 * depth, -width / 2 + 1.6)):
        chimney(house.assembly, x, y, top + height - 0.3, top + height + 1.7, pots=4)
    return max(ridge, top + height + 2.3)


_GRAND = WindowLook(recess_m=0.2, columns=2, transom=0.72, sill_m=0.09, surround_m=0.05, head="pediment")
_BRICK = WindowLook(recess_m=0.16, columns=1, transom=0.5, sill_m=0.08, head="lintel", trim_material="stone/sandstone")
_SHUTTERED = WindowLook(recess_m=0.18, columns=2, bars=2, sill_m=0.06, surround_m=0.025, shutters="hinged")
_MILL = WindowLook(
    recess_m=0.22,
    columns=4,
    transom=0.7,
    bars=2,
    frame_m=0.04,
    frame_material="coating/white",
    sill_m=0.06,
    head="soldier",
    curtains=0.08,
)
_LONDON = CityStyle("brick/red", "stone/limestone", "stone/limestone", _BRICK, roof="flat", quoins=False)

CITY_STYLES: Mapping[str, CityStyle] = MappingProxyType(
    {
        "limestone": CityStyle(
            look=_GRAND, balcony=Balcony(0.7, "bars", slab_material="stone/limestone"), balcony_bays="first_floor"
        ),
        "red_brick": _LONDON,
        "ochre": CityStyle(
            "plaster/ochre",
            "stone/sandstone",
            "stone/sandstone",
            replace(_GRAND, trim_material="stone/sandstone"),
            balcony=Balcony(1.0, "stone", slab_material="stone/sandstone"),
            roof="gable",
            covering=TILES_RED,
        ),
        "rose": CityStyle(
            "plaster/rose",
            "plaster/cream",
            "stone/limestone",
            _SHUTTERED,
            roof="gable",
            covering=TILES_RED,
            pitch_deg=28,
            balcony=Balcony(0.8, "bars"),
            balcony_bays="alternate",
            brackets=False,
        ),
        "sandstone": CityStyle(
            "stone/sandstone",
            "stone/granite",
            "stone/limestone",
            _GRAND,
            balcony=Balcony(0.8, "stone", slab_material="stone/sandstone"),
        ),
        "corner_shop": replace(
            _LONDON,
            wall="brick/yellow",
            ground="plaster/cream",
            awnings=("plastic/red", "plastic/green"),
            roof="gable",
            covering=SLATES,
            pitch_deg=38,
            brackets=False,
        ),
        "mill": CityStyle(
            "brick/dark",
            "brick/dark",
            "brick/red",
            _MILL,
            pitch_m=3.8,
            window_m=(2.5, 2.2),
            quoins=False,
            brackets=False,
            roof="flat",
            rustication_m=4.0,
            parapet_m=0.7,
        ),
    }
)
"""City blocks by name."""
