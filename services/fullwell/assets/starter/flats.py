"""Post-war housing: slabs and towers of prefabricated panels, flats of the fifties."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from fullwell.assets.starter.assembly import boxes, span
from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.building_body import SIDES, Body, bay_centres, opening_at
from fullwell.assets.starter.facades import SHEET_M, Balcony, Facade, Opening, PaneLots, WindowLook, courses, solid_spans
from fullwell.assets.starter.roofs import TILES_RED, chimney, flat_roof, gable_roof

__all__ = ["SLAB_STYLES", "SlabStyle", "slab"]

_LOOK = WindowLook(
    recess_m=0.13,
    columns=2,
    sill_m=0.03,
    trim_material="concrete/light",
    shutters="roller",
    shutter_material="plastic/grey",
)
_BALCONY = Balcony(1.3, "panels", "coating/blue")


@dataclass(frozen=True, slots=True)
class SlabStyle:
    """Choices of post-war housing."""

    wall: str = "plaster/white"
    ground: str = "concrete/grey"
    look: WindowLook = _LOOK
    pitch_m: float = 3.4
    window_m: tuple[float, float] = (2.1, 1.45)
    balcony: Balcony | None = _BALCONY
    joints: bool = True
    roof: Literal["flat", "gable"] = "flat"


def slab(
    rng: np.random.Generator,
    *,
    width_m: float,
    depth_m: float,
    floors: int,
    style: str,
    storey_m: float = 2.75,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a post-war block of flats: entrances with canopies, stair windows, stacks of balconies, panel joints."""
    chosen = SLAB_STYLES[style]
    house = Body(width_m, depth_m, chosen.look, rng, chosen.wall, PaneLots(rng, warm=0.17, cool=0.05))
    ground = max(storey_m, 3.2)
    top = ground + (floors - 1) * storey_m
    for side in SIDES:
        facade = house.side(side)
        if side in ("front", "back"):
            _slab_long(facade, chosen, floors, ground, storey_m, entrance=side == "front")
        else:
            _slab_end(facade, chosen, floors, ground, storey_m)
        house.put(side, facade)
    if chosen.roof == "gable":
        height = gable_roof(
            house.assembly,
            width_m,
            depth_m,
            top,
            pitch_deg=32,
            covering=TILES_RED,
            wall_part="walls",
            wall_material=chosen.wall,
            rng=rng,
            overhang_m=0.5,
        )
        for y in bay_centres(width_m - 3, 9.0):
            chimney(house.assembly, -0.8, y, height - 1.3, height + 0.8, pots=3)
        height += 1.3
        house.downpipes(top - 0.4)
    else:
        height = flat_roof(
            house.assembly,
            width_m,
            depth_m,
            top,
            rng=rng,
            parapet_m=0.6,
            wall_material=chosen.wall,
            coping_material="roof/metal",
            plant=2,
        )
    return house.finish(
        ("city", "flats", "post-war", *tags),
        style="post-war slab" if floors < 11 else "tower",
        floors=float(floors),
        ground_floor_m=ground,
        storey_m=storey_m,
        roof_m=round(height, 3),
    )


def _slab_long(facade: Facade, style: SlabStyle, floors: int, ground: float, storey_m: float, *, entrance: bool) -> None:
    bays = bay_centres(facade.width_m - 0.4, style.pitch_m)
    stairs = {number for number in range(len(bays)) if number % 5 == 2} if entrance else set()
    wide, tall = style.window_m
    for floor in range(floors):
        low = 0.0 if floor == 0 else ground + (floor - 1) * storey_m
        for number, y in enumerate(bays):
            if number in stairs:
                _stair_bay(facade, y, floor, low, storey_m)
            elif style.balcony is not None and floor > 0 and number % 5 in (0, 4):
                facade.window(opening_at(y, wide + 0.2, low + 0.08, tall + 0.75), sill=False)
                facade.balcony(y - style.pitch_m * 0.46, y + style.pitch_m * 0.46, low + 0.04, style.balcony)
            else:
                facade.window(opening_at(y, wide, low + (1.15 if floor == 0 else 0.85), tall))
    if style.joints:
        _joints(facade, floors, ground, storey_m, bays)
    facade.close(0.0, ground + (floors - 1) * storey_m)
    facade.assembly.add(
        "plinth",
        style.ground,
        courses(facade.width_m, 0.0, 0.6, _touching(facade, bays, stairs), course_m=0.6, out_m=0.03, groove_m=0.0),
    )


def _touching(facade: Facade, bays: Sequence[float], stairs: set[int]) -> list[Opening]:
    return [opening_at(bays[number], 1.9, 0.0, 2.5) for number in sorted(stairs)]


def _stair_bay(facade: Facade, y: float, floor: int, low: float, storey_m: float) -> None:
    if floor == 0:
        facade.door(opening_at(y, 1.9, 0.02, 2.35), material="metal/aluminium", leaves=2, fanlight_m=0.0)
        canopy = span((-0.05, y - 1.5, 2.55), (1.5, y + 1.5, 2.72))
        posts = boxes([(1.3, y - 1.35, 0.0), (1.3, y + 1.25, 0.0)], [(1.4, y - 1.25, 2.55), (1.4, y + 1.35, 2.55)])
        facade.assembly.add("canopies", "concrete/light", canopy)
        facade.assembly.add("canopy_posts", "coating/grey", posts)
    else:
        facade.window(
            opening_at(y, 1.2, low - 0.4, min(1.5, storey_m - 0.7)), replace(facade.look, shutters="none", curtains=0.0, bars=1)
        )


def _slab_end(facade: Facade, style: SlabStyle, floors: int, ground: float, storey_m: float) -> None:
    bays = [0.0] if facade.width_m < 14 else [-facade.width_m / 4, facade.width_m / 4]
    for floor in range(1, floors):
        for y in bays:
            facade.window(opening_at(y, 0.8, ground + (floor - 1) * storey_m + 1.0, 1.1), replace(facade.look, columns=1))
    if style.joints:
        _joints(facade, floors, ground, storey_m, bays)
    facade.close(0.0, ground + (floors - 1) * storey_m)


def _joints(facade: Facade, floors: int, ground: float, storey_m: float, bays: Sequence[float]) -> None:
    """Sealed joints between wall panels: dark strips at each floor and between bays, laid over the wall beside its openings."""
    low, high = [], []
    for floor in range(floors):
        bottom = 0.61 if floor == 0 else ground + (floor - 1) * storey_m + 0.018
        top = ground + floor * storey_m - 0.018
        middles = [(a + b) / 2 for a, b in itertools.pairwise(bays)]
        for y in middles:
            around = [o for o in facade.openings if o.left_m < y + 0.1 and o.right_m > y - 0.1]
            if not any(o.bottom_m < top and o.top_m > bottom for o in around):
                low.append((0.0, y - 0.015, bottom))
                high.append((2 * SHEET_M, y + 0.015, top))
        if floor < floors - 1:
            for left, right in solid_spans(facade.width_m, top, top + 0.036, facade.openings):
                low.append((0.0, left, top))
                high.append((2 * SHEET_M, right, top + 0.036))
    facade.assembly.add("joints", "asphalt/worn", boxes(low, high))


SLAB_STYLES: Mapping[str, SlabStyle] = MappingProxyType(
    {
        "white_blue": SlabStyle(),
        "concrete_orange": SlabStyle(wall="concrete/light", balcony=Balcony(1.2, "panels", "coating/orange")),
        "fifties": SlabStyle(wall="plaster/ochre", balcony=Balcony(1.1, "bars"), joints=False, roof="gable"),
    }
)
"""Slabs and towers by name."""
