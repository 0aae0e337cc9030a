"""Buildings: city blocks, slabs and towers, offices, houses, terraces, warehouses and shops, free-standing on four sides.

The street facade faces +x. Storey heights, window sizes, railings (1.05 m), door leaves (0.9 to 1.1 m by 2.0 to 2.1 m) and
tiles follow common European practice (Neufert, Architects' Data, 4th ed., chapters on windows, doors, roofs, stairs).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from fullwell.assets.starter.assembly import Assembly, boxes, quads, span
from fullwell.assets.starter.building import BuiltAsset, StarterEntry
from fullwell.assets.starter.facades import (
    SHEET_M,
    Balcony,
    Facade,
    Opening,
    PaneLots,
    WindowLook,
    courses,
    moulding,
    solid_spans,
    wall,
)
from fullwell.assets.starter.roofs import (
    SLATES,
    TILES_DARK,
    TILES_RED,
    Covering,
    Dormer,
    chimney,
    dormer,
    flat_roof,
    gable_roof,
    hip_roof,
    mansard_roof,
)
from fullwell.assets.starter.shapes import Shape, cylinder, extrusion

__all__ = ["BUILDINGS", "city_block", "detached_house", "office", "slab", "terraced_house", "warehouse"]

Side = Literal["front", "left", "back", "right"]
_TURN_DEG: dict[Side, float] = {"front": 0.0, "left": 90.0, "back": 180.0, "right": -90.0}

STEP_M = 0.15
"""Ground floors of dwellings lie one step above the pavement."""


@dataclass(eq=False)
class _House:
    """A rectangular body under construction: four facades around the origin."""

    width_m: float
    depth_m: float
    look: WindowLook
    rng: np.random.Generator
    wall_material: str
    panes: PaneLots
    assembly: Assembly = field(default_factory=Assembly)

    def side(self, side: Side, look: WindowLook | None = None) -> Facade:
        """Return an empty facade of the length of a side."""
        width = self.width_m if side in ("front", "back") else self.depth_m
        return Facade(width, look or self.look, self.panes, self.rng, "walls", self.wall_material)

    def put(self, side: Side, facade: Facade) -> None:
        """Place a finished facade."""
        x = {"front": self.depth_m / 2, "back": -self.depth_m / 2}.get(side, 0.0)
        y = {"left": self.width_m / 2, "right": -self.width_m / 2}.get(side, 0.0)
        self.assembly.place(facade.assembly, turn_deg=_TURN_DEG[side], x_m=x, y_m=y)

    def band(self, part: str, material: str, profile_m: Sequence[tuple[float, float]]) -> None:
        """Draw a moulding around the body."""
        self.assembly.add(part, material, moulding(self.width_m, self.depth_m, profile_m))

    def downpipes(self, top_m: float) -> None:
        """Draw a rain pipe near the end of both long sides."""
        for x, y in ((self.depth_m / 2 + 0.06, self.width_m / 2 - 0.25), (-self.depth_m / 2 - 0.06, -self.width_m / 2 + 0.25)):
            self.assembly.add("gutters", "metal/steel_galvanised", cylinder(0.045, top_m, sides=10).moved(x, y, top_m / 2))

    def finish(self, tags: tuple[str, ...], **attributes: float | str) -> BuiltAsset:
        """Return the building with what stands out of its street facade in its attributes."""
        parts = self.assembly.parts(paintable=("walls", "doors", "shutters", "garage_doors", "balcony_panels"))
        reach = max(float(part.shape.vertices_m[:, 0].max()) for part in parts)
        behind = max(float(-part.shape.vertices_m[:, 0].min()) for part in parts)
        facts: dict[str, float | str] = {
            "body_width_m": self.width_m,
            "body_depth_m": self.depth_m,
            "front_projection_m": round(reach - self.depth_m / 2, 3),
            "back_projection_m": round(behind - self.depth_m / 2, 3),
            **attributes,
        }
        return BuiltAsset("building", tags, parts, facts)


def _bays(width_m: float, pitch_m: float) -> list[float]:
    """Centres of equal bays of about the pitch, symmetric about the middle."""
    count = max(int(width_m / pitch_m), 1)
    return [float(y) for y in (np.arange(count) - (count - 1) / 2) * (width_m / count)]


def _at(centre_m: float, width_m: float, bottom_m: float, height_m: float) -> Opening:
    return Opening(centre_m - width_m / 2, centre_m + width_m / 2, bottom_m, bottom_m + height_m)


# -- city blocks ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class CityStyle:
    """Choices of a nineteenth-century block, whose storeys grow lower towards the roof."""

    wall: str = "plaster/cream"
    ground: str = "stone/sandstone"
    trim: str = "stone/limestone"
    look: WindowLook = WindowLook()
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
    house = _House(width_m, depth_m, chosen.look, rng, chosen.wall, PaneLots(rng))
    top = ground_m + (floors - 1) * storey_m
    streets: tuple[Side, ...] = ("front", "left") if corner else ("front",)
    sides: tuple[Side, ...] = ("front", "left", "back", "right")
    for side in sides:
        facade = house.side(side, chosen.look if side in streets else _plain(chosen.look))
        if side in streets:
            _city_ground(facade, chosen, ground_m, shops=shops)
            _city_storeys(facade, chosen, floors, ground_m, storey_m)
        else:
            _rear(facade, floors, ground_m, storey_m, pitch_m=3.0 if side == "back" else 5.2, door=side == "back")
        house.put(side, facade)
    _city_bands(house, chosen, ground_m, storey_m, floors, top)
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


def _plain(look: WindowLook) -> WindowLook:
    return replace(look, head="none", surround_m=0.0, shutters="none")


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
                facade.door(_at(at + door / 2, door, STEP_M, top - STEP_M - 0.35), leaves=2, fanlight_m=0.55)
                at += door + pier
            if number < count:
                material = style.shop_materials[int(rng.integers(len(style.shop_materials)))]
                awning = style.awnings[int(rng.integers(len(style.awnings)))]
                door_at = float(rng.choice([0.0, 0.5, 1.0])) * 0.94 + 0.03
                facade.shop(Opening(at, at + slot, 0.0, top), material=material, door_at=door_at, awning=awning)
                at += slot + pier
    else:
        bays = _bays(width - 0.8, style.pitch_m)
        gate = len(bays) // 2
        for number, y in enumerate(bays):
            if number == gate:
                facade.door(_at(y, 1.5, STEP_M, top - STEP_M - 0.2), leaves=2, fanlight_m=0.6)
            else:
                facade.window(
                    _at(y, style.window_m[0], 1.3, ground_m - 2.1),
                    replace(style.look, head="none", shutters="none", surround_m=0.0),
                )
    band = courses(width, 0.55, ground_m - 0.2, facade.openings, course_m=style.rustication_m, out_m=0.035, groove_m=0.025)
    plinth = courses(width, 0.0, 0.55, facade.openings, course_m=0.55, out_m=0.06, groove_m=0.0)
    facade.assembly.add("rustication", style.ground, band)
    facade.assembly.add("plinth", "stone/granite", plinth)
    facade.close(0.0, ground_m)
    facade.wall_part, facade.wall_material = "walls", style.wall


def _city_storeys(facade: Facade, style: CityStyle, floors: int, ground_m: float, storey_m: float) -> None:
    bays = _bays(facade.width_m - 0.8, style.pitch_m)
    wide, tall = style.window_m
    for floor in range(1, floors):
        low = ground_m + (floor - 1) * storey_m
        high_floor = floor in (1, 2)
        look = style.look
        if look.head == "pediment" and not (floor in (1, 2) and floor < floors - 1):
            look = replace(look, head="lintel" if high_floor else "none")
        for number, y in enumerate(bays):
            if style.balcony is not None and _has_balcony(style, number, len(bays), floor):
                facade.window(_at(y, wide, low + 0.06, tall + 0.72), look, sill=False)
                if style.balcony_bays != "first_floor":
                    facade.balcony(y - wide / 2 - 0.5, y + wide / 2 + 0.5, low + 0.03, style.balcony)
            else:
                facade.window(_at(y, wide, low + 0.78, tall), look)
        if style.balcony is not None and style.balcony_bays == "first_floor" and floor == 1:
            facade.balcony(bays[0] - wide / 2 - 0.6, bays[-1] + wide / 2 + 0.6, low + 0.03, style.balcony)
    facade.close(ground_m, ground_m + (floors - 1) * storey_m)


def _has_balcony(style: CityStyle, number: int, count: int, floor: int) -> bool:
    if style.balcony_bays == "first_floor":
        return floor == 1
    if style.balcony_bays == "alternate":
        return number % 2 == 1 and (number + floor) % 4 in (0, 1)
    return floor in (1, 2, 3) and abs(number - (count - 1) / 2) < 1


def _rear(facade: Facade, floors: int, ground_m: float, storey_m: float, *, pitch_m: float, door: bool) -> None:
    """A side or back as landlords leave it: fewer, plainer windows, a service door."""
    bays = _bays(facade.width_m - 1.6, pitch_m) if facade.width_m > 4.5 else []
    gate = len(bays) // 2
    for floor in range(floors):
        low = 0.0 if floor == 0 else ground_m + (floor - 1) * storey_m
        tall = min(1.45, (ground_m if floor == 0 else storey_m) - 1.5)
        for number, y in enumerate(bays):
            if floor == 0 and door and number == gate:
                facade.door(_at(y, 1.1, STEP_M, 2.25), material="coating/grey", fanlight_m=0.0)
            elif floor > 0 or facade.rng.random() < 0.6:
                narrow = facade.rng.random() < 0.2 and not door
                facade.window(_at(y, 0.65 if narrow else 1.1, low + 1.0, tall))
    facade.close(0.0, ground_m + (floors - 1) * storey_m)


def _city_bands(house: _House, style: CityStyle, ground_m: float, storey_m: float, floors: int, top: float) -> None:
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
            spots = np.array(_bays(length, 0.62))
            count = len(spots)
            low = np.column_stack([np.full(count, 0.05), spots - 0.09, np.full(count, top - 0.36)])
            high = np.column_stack([np.full(count, 0.36), spots + 0.09, np.full(count, top - 0.13)])
            house.assembly.add("cornices", style.trim, boxes(low, high).moved(reach).turned("z", turn))
    if style.quoins:
        _quoins(house, style.trim, ground_m + 0.08, top - 0.56)


def _quoins(house: _House, material: str, low_m: float, high_m: float) -> None:
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


def _city_roof(house: _House, style: CityStyle, top: float, streets: Sequence[Side]) -> float:
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
        for y in _bays(width - 2.0, style.pitch_m * 1.6):
            dormer(
                house.assembly,
                depth / 2 - 0.9,
                y,
                top + 0.9 * tangent - 0.1,
                replace(kind, depth_m=2.1 / tangent + 0.3),
                _plain(style.look),
                house.panes,
                rng,
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
        for y in _bays(length - 0.8, style.pitch_m):
            dormer(row, reach - 0.42, y, top + 0.75, kind, _plain(style.look), house.panes, rng)
        house.assembly.place(row, turn_deg=_TURN_DEG[side])
    for x, y in ((-0.2 * depth, width / 2 - 1.6), (0.1 * depth, -width / 2 + 1.6)):
        chimney(house.assembly, x, y, top + height - 0.3, top + height + 1.7, pots=4)
    return max(ridge, top + height + 2.3)


# -- slabs and towers -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SlabStyle:
    """Choices of post-war housing."""

    wall: str = "plaster/white"
    ground: str = "concrete/grey"
    look: WindowLook = WindowLook(
        recess_m=0.13,
        columns=2,
        sill_m=0.03,
        trim_material="concrete/light",
        shutters="roller",
        shutter_material="plastic/grey",
    )
    pitch_m: float = 3.4
    window_m: tuple[float, float] = (2.1, 1.45)
    balcony: Balcony | None = Balcony(1.3, "panels", "coating/blue")
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
    """Return a post-war block of flats: entrances with canopies and stair windows, stacks of balconies, prefabricated joints."""
    chosen = SLAB_STYLES[style]
    house = _House(width_m, depth_m, chosen.look, rng, chosen.wall, PaneLots(rng, warm=0.17, cool=0.05))
    ground = max(storey_m, 3.2)
    top = ground + (floors - 1) * storey_m
    sides: tuple[Side, ...] = ("front", "left", "back", "right")
    for side in sides:
        facade = house.side(side)
        if side in ("front", "back"):
            _slab_long(facade, chosen, floors, ground, storey_m, entrance=side == "front")
        else:
            _slab_end(facade, floors, ground, storey_m)
        if chosen.joints:
            _joints(facade, floors, ground, storey_m, chosen.pitch_m)
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
        for y in _bays(width_m - 3, 9.0):
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
    bays = _bays(facade.width_m - 0.4, style.pitch_m)
    stairs = {number for number in range(len(bays)) if number % 5 == 2} if entrance else set()
    wide, tall = style.window_m
    for floor in range(floors):
        low = 0.0 if floor == 0 else ground + (floor - 1) * storey_m
        for number, y in enumerate(bays):
            if number in stairs:
                _stair_bay(facade, y, floor, low, storey_m)
            elif style.balcony is not None and floor > 0 and number % 5 in (0, 4):
                facade.window(_at(y, wide + 0.2, low + 0.08, tall + 0.75), sill=False)
                facade.balcony(y - style.pitch_m * 0.46, y + style.pitch_m * 0.46, low + 0.04, style.balcony)
            else:
                facade.window(_at(y, wide, low + (1.15 if floor == 0 else 0.85), tall))
    facade.close(0.0, ground + (floors - 1) * storey_m)
    facade.assembly.add(
        "plinth",
        style.ground,
        courses(facade.width_m, 0.0, 0.6, _touching(facade, bays, stairs), course_m=0.6, out_m=0.03, groove_m=0.0),
    )


def _touching(facade: Facade, bays: Sequence[float], stairs: set[int]) -> list[Opening]:
    return [_at(bays[number], 1.9, 0.0, 2.5) for number in sorted(stairs)]


def _stair_bay(facade: Facade, y: float, floor: int, low: float, storey_m: float) -> None:
    if floor == 0:
        facade.door(_at(y, 1.9, 0.02, 2.35), material="metal/aluminium", leaves=2, fanlight_m=0.0)
        canopy = span((-0.05, y - 1.5, 2.55), (1.5, y + 1.5, 2.72))
        posts = boxes([(1.3, y - 1.35, 0.0), (1.3, y + 1.25, 0.0)], [(1.4, y - 1.25, 2.55), (1.4, y + 1.35, 2.55)])
        facade.assembly.add("canopies", "concrete/light", canopy)
        facade.assembly.add("canopy_posts", "coating/grey", posts)
    else:
        facade.window(
            _at(y, 1.2, low - 0.4, min(1.5, storey_m - 0.7)), replace(facade.look, shutters="none", curtains=0.0, bars=1)
        )


def _slab_end(facade: Facade, floors: int, ground: float, storey_m: float) -> None:
    bays = [0.0] if facade.width_m < 14 else [-facade.width_m / 4, facade.width_m / 4]
    for floor in range(1, floors):
        for y in bays:
            facade.window(_at(y, 0.8, ground + (floor - 1) * storey_m + 1.0, 1.1), replace(facade.look, columns=1))
    facade.close(0.0, ground + (floors - 1) * storey_m)


def _joints(facade: Facade, floors: int, ground: float, storey_m: float, pitch_m: float) -> None:
    """Sealed joints between wall panels: dark lines at each floor and between bays, laid over the wall."""
    half, thick = facade.width_m / 2, 2 * SHEET_M
    count = max(int((facade.width_m - 0.4) / pitch_m), 1)
    lines = [(-half, half, ground + k * storey_m - 0.018, ground + k * storey_m + 0.018) for k in range(floors - 1)]
    top = ground + (floors - 1) * storey_m
    for edge in (np.arange(1, count) - count / 2) * ((facade.width_m - 0.4) / count):
        lines.append((float(edge) - 0.015, float(edge) + 0.015, 0.61, top))
    low = [(-0.01, a, c) for a, _, c, _ in lines]
    high = [(thick if b - a > 0.1 else thick + SHEET_M, b, d) for a, b, _, d in lines]
    facade.assembly.add("joints", "asphalt/worn", boxes(low, high))


# -- offices --------------------------------------------------------------------------------------------------------------


def office(
    rng: np.random.Generator,
    *,
    width_m: float,
    depth_m: float,
    floors: int,
    curtain_wall: bool = True,
    storey_m: float = 3.6,
    ground_m: float = 4.2,
    module_m: float = 1.5,
    frame_material: str = "metal/aluminium",
    spandrel_material: str = "coating/grey",
    wall: str = "concrete/light",
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return an office house: a curtain wall of glass modules, or ribbons of windows between precast bands."""
    look = WindowLook(recess_m=0.2, columns=1, frame_m=0.05, frame_material=frame_material, sill_m=0.0, curtains=0.0)
    house = _House(width_m, depth_m, look, rng, wall, PaneLots(rng, warm=0.04, cool=0.24))
    top = ground_m + (floors - 1) * storey_m
    sides: tuple[Side, ...] = ("front", "left", "back", "right")
    for side in sides:
        facade = house.side(side)
        _lobby(facade, ground_m, module_m, entrance=side == "front", frame=frame_material)
        for floor in range(1, floors):
            low = ground_m + (floor - 1) * storey_m
            if curtain_wall:
                _glass_storey(facade, low, storey_m, module_m, frame_material, spandrel_material)
            else:
                _ribbon_storey(facade, low, storey_m, module_m, frame_material)
        if not curtain_wall:
            facade.close(ground_m, top)
        house.put(side, facade)
    metal = frame_material if curtain_wall else wall
    house.band("fascia", metal, [(0, ground_m - 0.35), (0.16, ground_m - 0.35), (0.16, ground_m), (0, ground_m)])
    if curtain_wall:
        _corner_posts(house, ground_m, top, frame_material)
    house.band("fascia", metal, [(0, top - 0.02), (0.16, top - 0.02), (0.16, top + 0.25), (-0.3, top + 0.25)])
    height = flat_roof(
        house.assembly,
        width_m,
        depth_m,
        top,
        rng=rng,
        parapet_m=1.1,
        wall_part="parapet",
        wall_material=metal,
        coping_material="roof/metal",
        plant=4,
    )
    height = max(height, _screen(house, top))
    return house.finish(
        ("city", "office", "modern", *tags),
        style="curtain wall" if curtain_wall else "ribbon windows",
        floors=float(floors),
        ground_floor_m=ground_m,
        storey_m=storey_m,
        roof_m=round(height, 3),
    )


def _modules(width_m: float, module_m: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.linspace(-width_m / 2, width_m / 2, max(round(width_m / module_m), 1) + 1)


def _runs(facade: Facade, count: int) -> list[tuple[str, str]]:
    """Pane lots for one storey: offices are lit by the room, which is two to five modules wide."""
    lots: list[tuple[str, str]] = []
    while len(lots) < count:
        lots += [facade.panes.draw()] * int(facade.rng.integers(2, 6))
    return lots[:count]


def _glass_storey(facade: Facade, low: float, storey_m: float, module_m: float, frame: str, spandrel: str) -> None:
    edges = _modules(facade.width_m, module_m)
    band = low + 0.95
    spandrels = np.array([(a, b, low, band) for a, b in zip(edges[:-1], edges[1:], strict=True)])
    facade.assembly.add("spandrels", spandrel, facade.glass(spandrels, 0.0))
    for (a, b), (part, material) in zip(zip(edges[:-1], edges[1:], strict=True), _runs(facade, len(edges) - 1), strict=True):
        facade.assembly.add(part, material, facade.glass(np.array([[a, b, band, low + storey_m]]), 0.0))
        if facade.rng.random() < 0.12:
            drop = float(facade.rng.uniform(0.3, 0.9)) * (storey_m - 0.95)
            z = low + storey_m - 0.03
            x = 0.02
            sheet = [(x, a + 0.04, z - drop), (x, b - 0.04, z - drop), (x, b - 0.04, z), (x, a + 0.04, z)]
            facade.assembly.add("curtains", "coating/grey", quads([sheet]))
    inner = edges[1:-1]
    count = len(inner)
    mullions = boxes(
        np.column_stack([np.full(count, -0.05), inner - 0.03, np.full(count, low)]),
        np.column_stack([np.full(count, 0.1), inner + 0.03, np.full(count, low + storey_m)]),
    )
    half = facade.width_m / 2
    rails = boxes(
        [(-0.05, -half, low - 0.03), (-0.05, -half, band - 0.03)], [(0.07, half, low + 0.03), (0.07, half, band + 0.03)]
    )
    facade.assembly.add("window_frames", frame, mullions, rails)


def _ribbon_storey(facade: Facade, low: float, storey_m: float, module_m: float, frame: str) -> None:
    width = facade.width_m
    opening = Opening(-width / 2 + 0.6, width / 2 - 0.6, low + 1.0, low + storey_m - 0.75)
    facade.cut(opening, 0.22)
    edges = _modules(opening.width_m, module_m)
    for (a, b), (part, material) in zip(zip(edges[:-1], edges[1:], strict=True), _runs(facade, len(edges) - 1), strict=True):
        facade.assembly.add(part, material, facade.glass(np.array([[a, b, opening.bottom_m, opening.top_m]]), -0.22))
    count = len(edges)
    wide = np.where(np.arange(count) % 4 == 0, 0.09, 0.03)
    facade.assembly.add(
        "window_frames",
        frame,
        boxes(
            np.column_stack(
                [np.full(count, -0.24), np.maximum(edges - wide, opening.left_m), np.full(count, opening.bottom_m)]
            ),
            np.column_stack([-0.2 + wide, np.minimum(edges + wide, opening.right_m), np.full(count, opening.top_m)]),
        ),
        boxes(
            [(-0.24, opening.left_m, opening.bottom_m), (-0.24, opening.left_m, opening.top_m - 0.05)],
            [(-0.18, opening.right_m, opening.bottom_m + 0.05), (-0.18, opening.right_m, opening.top_m)],
        ),
    )
    half = width / 2
    ledge = [(-0.22, -half - 0.05, opening.bottom_m - 0.12), (-0.22, -half - 0.05, opening.top_m)]
    brim = [(0.06, half + 0.05, opening.bottom_m - 0.02), (0.06, half + 0.05, opening.top_m + 0.14)]
    facade.assembly.add("ledges", "concrete/grey", boxes(ledge, brim))
    seams = _modules(width, 4 * module_m)[1:-1]
    for bottom, high in ((low + 0.01, opening.bottom_m - 0.13), (opening.top_m + 0.15, low + storey_m - 0.01)):
        facade.assembly.add(
            "joints",
            "asphalt/worn",
            boxes([(-0.01, y - 0.012, bottom) for y in seams], [(2 * SHEET_M, y + 0.012, high) for y in seams]),
        )


def _lobby(facade: Facade, ground_m: float, module_m: float, *, entrance: bool, frame: str) -> None:
    """A glazed ground floor set back behind columns' faces, with revolving-door width in the middle of the front."""
    width, deep = facade.width_m, 0.35
    facade.wall_part, facade.wall_material = "ground_walls", "stone/granite"
    columns = _modules(width - 0.8, 4 * module_m)
    tops = ground_m - 0.4
    for a, b in zip(columns[:-1], columns[1:], strict=True):
        opening = Opening(float(a) + 0.3, float(b) - 0.3, 0.12, tops)
        facade.cut(opening, deep)
        edges = _modules(opening.width_m, module_m) + (opening.left_m + opening.right_m) / 2
        panes = np.array(
            [(p, q, c, d) for p, q in zip(edges[:-1], edges[1:], strict=True) for c, d in ((0.12, 2.5), (2.5, tops))]
        )
        facade.assembly.add("lobby_windows", "lamp/window_cool", facade.glass(panes, -deep))
        count = len(edges)
        facade.assembly.add(
            "window_frames",
            frame,
            boxes(
                np.column_stack([np.full(count, -deep - 0.02), np.maximum(edges - 0.03, opening.left_m), np.full(count, 0.12)]),
                np.column_stack(
                    [np.full(count, -deep + 0.06), np.minimum(edges + 0.03, opening.right_m), np.full(count, tops)]
                ),
            ),
            boxes(
                [(-deep - 0.02, opening.left_m, z) for z in (0.12, 2.46, tops - 0.06)],
                [(-deep + 0.05, opening.right_m, z) for z in (0.2, 2.54, tops)],
            ),
        )
    facade.close(0.0, ground_m)
    facade.wall_part, facade.wall_material = "walls", facade.wall_material
    if entrance:
        canopy = span((-0.1, -3.0, 2.95), (2.2, 3.0, 3.1))
        rods = boxes([(1.9, -2.6, 3.1), (1.9, 2.54, 3.1)], [(1.96, -2.54, 3.16), (1.96, 2.6, 3.16)])
        facade.assembly.add("canopies", frame, canopy, rods)
        sign = [
            (0.16 + 3 * SHEET_M, -2.2, ground_m - 0.3),
            (0.16 + 3 * SHEET_M, 2.2, ground_m - 0.3),
            (0.16 + 3 * SHEET_M, 2.2, ground_m - 0.05),
            (0.16 + 3 * SHEET_M, -2.2, ground_m - 0.05),
        ]
        facade.assembly.add("sign_panel", "lamp/sign_panel", quads([sign]))
        facade.assembly.add("steps", "stone/granite", span((-deep, -3.2, 0.0), (1.6, 3.2, 0.12)))


def _corner_posts(house: _House, low: float, top: float, material: str) -> None:
    x, y = house.depth_m / 2, house.width_m / 2
    corners = [(sx * x, sy * y) for sx in (1, -1) for sy in (1, -1)]
    house.assembly.add(
        "window_frames",
        material,
        boxes([(a - 0.12, b - 0.12, low) for a, b in corners], [(a + 0.12, b + 0.12, top) for a, b in corners]),
    )


def _screen(house: _House, top: float) -> float:
    """Louvres that hide the plant on the roof."""
    x, y = house.depth_m / 2 - 2.2, house.width_m / 2 - 2.6
    if x < 1.5 or y < 1.5:
        return top
    levels = top + 0.6 + 0.16 * np.arange(12)
    for z in levels:
        house.assembly.add(
            "plant_screen",
            "metal/aluminium",
            moulding(2 * y, 2 * x, [(0.0, z), (0.06, z), (0.06, z + 0.02), (-0.02, z + 0.1), (0.0, z)]),
        )
    return float(levels[-1] + 0.1)


# -- houses ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class HouseStyle:
    """Choices of a detached house."""

    wall: str = "brick/red"
    trim: str = "stone/limestone"
    look: WindowLook = WindowLook(
        recess_m=0.12, columns=2, sill_m=0.05, head="soldier", trim_material="concrete/light", transom=0.72
    )
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
    """Return a suburban house of so many storeys, the last under the roof where there are dormers; a garage stands at its side."""
    chosen = HOUSE_STYLES[style]
    house = _House(width_m, depth_m, chosen.look, rng, chosen.wall, PaneLots(rng, warm=0.25, cool=0.03))
    base = 0.3
    full = floors - (1 if chosen.dormers else 0)
    top = base + full * storey_m + 0.25
    for side in ("front", "left", "back", "right"):
        facade = house.side(side)  # type: ignore[arg-type]
        _house_side(facade, chosen, side, full, base, storey_m)
        facade.close(0.0, top)
        house.put(side, facade)  # type: ignore[arg-type]
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


def _house_side(facade: Facade, style: HouseStyle, side: str, full: int, base: float, storey_m: float) -> None:
    width = facade.width_m
    thirds = (-width * 0.31, 0.0, width * 0.31)
    for floor in range(full):
        low = base + floor * storey_m
        if side == "front":
            facade.window(_at(thirds[0], 2.0, low + 0.85, 1.4), replace(style.look, columns=3))
            facade.window(_at(thirds[2], 1.5, low + 0.85, 1.4))
            if floor == 0:
                facade.door(_at(0.0, 1.15, base, 2.45), material=style.door, fanlight_m=0.3)
            else:
                facade.window(_at(0.0, 1.0, low + 0.95, 1.3), replace(style.look, columns=1))
        elif side == "back":
            facade.window(_at(thirds[2], 1.5, low + 0.85, 1.4))
            if floor == 0:
                facade.window(
                    _at(thirds[0], 2.4, low + 0.03, 2.15), replace(style.look, columns=3, transom=0, curtains=0.6), sill=False
                )
                facade.door(_at(width * 0.06, 1.0, base, 2.2), material="wood/painted_white", fanlight_m=0.0)
            else:
                facade.window(_at(thirds[0], 2.0, low + 0.85, 1.4))
        else:
            facade.window(_at(width * 0.2, 1.0, low + 0.95, 1.25))
            if floor == 0 or side == "right":
                facade.window(_at(-width * 0.22, 0.7, low + 1.2, 0.9), replace(style.look, columns=1, transom=0))


def _house_roof(house: _House, style: HouseStyle, top: float) -> float:
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
        _oriel(face, 1.3, 1.3)
        house.assembly.place(face.assembly, x_m=depth / 2, z_m=top + 0.35)
    tangent = float(np.tan(np.deg2rad(style.pitch_deg)))
    kind = Dormer(1.3, 1.25, 2.0, "gable", "wood/painted_white", style.covering.material, style.covering)
    for y in _bays(width - 1.2, (width - 1.2) / style.dormers) if style.dormers else []:
        back = 0.7
        dormer(
            house.assembly,
            depth / 2 - back,
            y,
            top + back * tangent + 0.12,
            replace(kind, depth_m=2.0 / tangent + 0.2),
            _plain(style.look),
            house.panes,
            rng,
        )
    y, x = (0.0, -depth * 0.2) if across else (-width * 0.3, -0.5)
    chimney(
        house.assembly, x, y, ridge - 1.3, ridge + 0.75, material=style.wall if style.wall.startswith("brick") else "brick/red"
    )
    house.downpipes(top - 0.35)
    return ridge + 1.3


def _oriel(face: Facade, wide: float, tall: float) -> None:
    half = wide / 2 + 0.09
    sides = boxes(
        [(-0.1, -half, -0.09), (-0.1, wide / 2, -0.09), (-0.1, -half - 0.06, tall), (-0.1, -half - 0.06, -0.16)],
        [(0.16, -wide / 2, tall), (0.16, half, tall), (0.24, half + 0.06, tall + 0.08), (0.2, half + 0.06, -0.09)],
    )
    face.assembly.add("oriels", "wood/painted_white", sides)
    part, material = face.panes.draw()
    bars = boxes([(0.0, -0.04, -0.09), (0.0, -wide / 2, tall - 0.06)], [(0.1, 0.04, tall), (0.095, wide / 2, tall)])
    face.assembly.add("window_frames", face.look.frame_material, bars)
    face.assembly.add(part, material, face.glass(np.array([[-wide / 2, 0, -0.09, tall], [0, wide / 2, -0.09, tall]]), 0.05))


def _porch(house: _House, style: HouseStyle, base: float) -> None:
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


def _garage(house: _House, style: HouseStyle, rng: np.random.Generator) -> None:
    wide, deep, high = 3.4, 6.0, 2.7
    side = _House(wide, deep, style.look, rng, style.wall, house.panes)
    for name in ("front", "left", "back", "right"):
        facade = side.side(name)  # type: ignore[arg-type]
        if name == "front":
            facade.garage_door(_at(0.0, 2.5, 0.02, 2.15), material=style.garage)
        elif name == "left":
            facade.window(_at(0.5, 1.0, 1.1, 0.8), replace(style.look, columns=1, transom=0))
        elif name == "back":
            facade.door(_at(0.0, 0.95, 0.02, 2.1), material="coating/grey", fanlight_m=0.0)
        facade.close(0.0, high)
        side.put(name, facade)  # type: ignore[arg-type]
    side.band("fascia", "wood/painted_white", [(0, high - 0.12), (0.12, high - 0.12), (0.12, high + 0.08), (-0.3, high + 0.1)])
    side.assembly.add("garage_roof", "roof/metal", span((-deep / 2, -wide / 2, high), (deep / 2, wide / 2, high + 0.07)))
    house.assembly.place(side.assembly, x_m=house.depth_m / 2 - deep / 2 - 0.8, y_m=house.width_m / 2 + wide / 2 + 0.001)


@dataclass(frozen=True, slots=True)
class TerraceStyle:
    """Choices of a house in a row."""

    wall: str = "brick/yellow"
    trim: str = "stone/limestone"
    look: WindowLook = WindowLook(recess_m=0.14, columns=1, transom=0.52, sill_m=0.07, head="lintel")
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
    house = _House(width_m, depth_m, chosen.look, rng, chosen.wall, PaneLots(rng, warm=0.25, cool=0.03))
    ground = 3.3
    top = ground + (floors - 1) * storey_m
    _terrace_front(house, chosen, floors, ground, storey_m)
    for side in ("left", "right"):
        facade = house.side(side)  # type: ignore[arg-type]
        facade.close(0.0, top)
        house.put(side, facade)  # type: ignore[arg-type]
    back = house.side("back", _plain(chosen.look))
    _rear(back, floors, ground, storey_m, pitch_m=2.4, door=True)
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


def _terrace_front(house: _House, style: TerraceStyle, floors: int, ground: float, storey_m: float) -> None:
    facade = house.side("front")
    width = facade.width_m
    door_y, room_y = -width / 2 + 1.25, width * 0.17
    facade.door(_at(door_y, 1.15, STEP_M, 2.75), material=style.door, fanlight_m=0.5)
    facade.assembly.add("lintels", style.trim, span((-0.02, door_y - 0.8, 2.93), (0.05, door_y + 0.8, 3.12)))
    if style.bay_window:
        facade.openings.append(_at(room_y, 2.3, 0.0, 2.95))
    else:
        facade.window(_at(room_y - 0.75, 1.1, 0.85, 1.9))
        facade.window(_at(room_y + 0.85, 1.1, 0.85, 1.9))
    for floor in range(1, floors):
        low = ground + (floor - 1) * storey_m
        tall = 1.75 if floor == 1 else 1.45
        for y in (door_y + 0.1, room_y - 0.7, room_y + 0.9) if width > 5.5 else (door_y + 0.2, room_y + 0.2):
            facade.window(_at(y, 1.0, low + 0.75, tall))
        facade.assembly.add("cornices", style.trim, span((-0.02, -width / 2, low - 0.09), (0.035, width / 2, low + 0.04)))
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
        face.window(_at(0.0, pane, 0.85, 1.75), look)
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


def _stepped_gable(house: _House, style: TerraceStyle, top: float, ridge: float) -> float:
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
    _oriel(face, 0.8, 1.1)
    house.assembly.place(face.assembly, x_m=x + 0.06, z_m=top + 0.9)
    beam = span((x, -0.08, ridge - 0.55), (x + 1.0, 0.08, ridge - 0.38))
    house.assembly.add("hoist_beam", "wood/weathered", beam)
    return top + steps * rise + 0.09


# -- warehouses -----------------------------------------------------------------------------------------------------------


def warehouse(
    rng: np.random.Generator,
    *,
    width_m: float = 24.0,
    depth_m: float = 30.0,
    height_m: float = 7.2,
    cladding: str = "coating/grey",
    accent: str = "coating/blue",
    docks: int = 3,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a clad hall: ribbed sheet over a concrete base, loading docks, an office corner, roof of seamed metal."""
    look = WindowLook(recess_m=0.12, columns=3, frame_m=0.05, frame_material="coating/black", sill_m=0.0, curtains=0.0)
    house = _House(width_m, depth_m, look, rng, cladding, PaneLots(rng, warm=0.03, cool=0.25))
    for side in ("front", "left", "back", "right"):
        facade = house.side(side)  # type: ignore[arg-type]
        if side == "front":
            _dock_front(facade, docks, height_m, accent)
        else:
            for y in _bays(facade.width_m - 2, 6.0):
                facade.window(_at(y, 3.0, height_m - 2.2, 1.2))
            if side == "back":
                facade.door(_at(-facade.width_m * 0.3, 1.0, 0.05, 2.1), material=accent, fanlight_m=0.0)
        _cladding(facade, cladding, 0.6, height_m)
        facade.assembly.add("base_walls", "concrete/grey", wall(facade.width_m, 0.0, height_m, facade.openings).moved(-0.02))
        facade.assembly.add(
            "base", "concrete/light", courses(facade.width_m, 0.0, 0.6, facade.openings, course_m=0.6, out_m=0.05, groove_m=0.0)
        )
        house.put(side, facade)
    house.band(
        "corner_trim", accent, [(0.0, height_m - 0.1), (0.12, height_m - 0.1), (0.12, height_m + 0.35), (-0.2, height_m + 0.37)]
    )
    x, y = depth_m / 2, width_m / 2
    for sx in (1, -1):
        for sy in (1, -1):
            xs, ys = sorted((sx * (x - 0.2), sx * (x + 0.06))), sorted((sy * (y - 0.2), sy * (y + 0.06)))
            house.assembly.add("corner_trim", accent, span((xs[0], ys[0], 0.6), (xs[1], ys[1], height_m - 0.1)))
    ridge = _seamed_roof(house, height_m + 0.2)
    return house.finish(
        ("industrial", "warehouse", *tags),
        style="warehouse",
        floors=2.0,
        ground_floor_m=height_m / 2,
        storey_m=height_m / 2,
        roof_m=round(ridge, 3),
    )


def _dock_front(facade: Facade, docks: int, height_m: float, accent: str) -> None:
    width = facade.width_m
    office = 6.0
    spots = np.linspace(-width / 2 + 2.6, width / 2 - office - 2.0, docks)
    for y in spots:
        centre = float(y)
        facade.garage_door(_at(centre, 3.2, 0.02, 4.0), material="coating/white")
        seal = boxes(
            [(-0.02, centre - 1.95, 0.3), (-0.02, centre + 1.6, 0.3), (-0.02, centre - 1.95, 4.03)],
            [(0.45, centre - 1.6, 4.03), (0.45, centre + 1.95, 4.03), (0.45, centre + 1.95, 4.5)],
        )
        facade.assembly.add("dock_seals", "plastic/black", seal)
        bumpers = boxes(
            [(0.0, centre + s * 1.2 - 0.12, 0.75) for s in (-1, 1)], [(0.5, centre + s * 1.2 + 0.12, 1.15) for s in (-1, 1)]
        )
        facade.assembly.add("dock_bumpers", "rubber/tyre", bumpers)
        number = [
            (0.14, centre - 0.35, 5.0),
            (0.14, centre + 0.35, 5.0),
            (0.14, centre + 0.35, 5.7),
            (0.14, centre - 0.35, 5.7),
        ]
        facade.assembly.add("dock_signs", "sign/yellow", quads([number]))
    right = width / 2
    facade.door(_at(right - office + 1.1, 1.6, 0.05, 2.45), material="metal/aluminium", leaves=2, fanlight_m=0.0)
    facade.window(_at(right - 2.4, 2.6, 0.95, 1.5))
    facade.window(_at(right - office / 2 - 0.2, 4.6, height_m / 2 + 0.7, 1.4), replace(facade.look, columns=5))
    facade.assembly.add("canopies", accent, span((-0.05, right - office + 0.1, 2.7), (1.4, right - office + 2.1, 2.82)))
    z, half = height_m - 1.35, 2.4
    centre = float(spots.mean()) if docks else 0.0
    facade.assembly.add(
        "sign_board", "sign/white", span((0.02, centre - half - 0.1, z - 0.1), (0.12, centre + half + 0.1, z + 0.9))
    )
    x = 0.12 + 2 * SHEET_M
    facade.assembly.add(
        "sign_panel",
        "lamp/sign_panel",
        quads([[(x, centre - half, z), (x, centre + half, z), (x, centre + half, z + 0.8), (x, centre - half, z + 0.8)]]),
    )
    facade.lettering(centre, half, z + 0.4, 0.5, x + SHEET_M)


def _cladding(facade: Facade, material: str, low: float, high: float) -> None:
    """Trapezoidal sheet, 0.25 m from rib to rib and 35 mm deep, around the openings."""
    levels = sorted({low, high, *(z for o in facade.openings for z in (o.bottom_m, o.top_m) if low < z < high)})
    rib = np.array([(0.0, 0.0), (0.1, 0.0), (0.125, 0.035), (0.225, 0.035), (0.25, 0.0)])
    for a, b in zip(levels[:-1], levels[1:], strict=True):
        for left, right in solid_spans(facade.width_m, a, b, facade.openings):
            count = int(np.ceil((right - left) / 0.25))
            y = np.concatenate([rib[:-1, 0] + 0.25 * k for k in range(count)] + [[0.25 * count]])
            x = np.concatenate([rib[:-1, 1]] * count + [[0.0]])
            keep = y < right - left - 1e-9
            y, x = np.append(y[keep], right - left) + left, np.append(x[keep], np.interp(right - left, y, x))
            lower = np.column_stack([x, y, np.full(len(y), a)])
            upper = np.column_stack([x, y, np.full(len(y), b)])
            facade.assembly.add("walls", material, quads(np.stack([lower[:-1], lower[1:], upper[1:], upper[:-1]], axis=1)))


def _seamed_roof(house: _House, eaves: float) -> float:
    """Low gable with standing seams 0.6 m apart; its ridge runs back from the street, hidden behind the fascia."""
    half, end = house.width_m / 2, house.depth_m / 2
    ridge = eaves + half * 0.1
    for side in (1.0, -1.0):
        face = [(end, side * half, eaves), (-end, side * half, eaves), (-end, 0, ridge), (end, 0, ridge)]
        house.assembly.add("roof", "roof/metal", quads([face if side > 0 else face[::-1]]))
        count = round(2 * end / 0.6)
        for x in np.linspace(-end + 0.3, end - 0.3, count):
            low, high = (float(x) - 0.02, side * half, eaves), (float(x) - 0.02, 0.0, ridge)
            a, b = np.array(low), np.array(high)
            up, wide = np.array([0, 0, 0.05]), np.array([0.04, 0, 0])
            corners = [
                [a + wide, b + wide, b + wide + up, a + wide + up],
                [a, a + up, b + up, b],
                [a + up, a + wide + up, b + wide + up, b + up],
            ]
            corners = corners if side < 0 else [face_[::-1] for face_ in corners]
            house.assembly.add("roof", "roof/metal", quads(np.array(corners)))
        triangle = [(side * end, -side * half, eaves), (side * end, side * half, eaves), (side * end, 0, ridge)]
        house.assembly.add("roof", "roof/metal", Shape(np.array(triangle, dtype=np.float64), np.array([[0, 1, 2]])))
    for x in np.linspace(-end + 4, end - 4, 4):
        house.assembly.add("vents", "metal/steel_galvanised", cylinder(0.35, 0.7, sides=16).moved(float(x), 0.0, ridge + 0.3))
    return ridge + 0.65


# -- the collection -------------------------------------------------------------------------------------------------------

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
_PLASTERED = WindowLook(
    recess_m=0.14,
    columns=2,
    sill_m=0.05,
    trim_material="concrete/grey",
    shutters="roller",
    shutter_material="plastic/grey",
    frame_material="coating/black",
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

SLAB_STYLES: Mapping[str, SlabStyle] = MappingProxyType(
    {
        "white_blue": SlabStyle(),
        "concrete_orange": SlabStyle(wall="concrete/light", balcony=Balcony(1.2, "panels", "coating/orange")),
        "fifties": SlabStyle(wall="plaster/ochre", balcony=Balcony(1.1, "bars"), joints=False, roof="gable"),
    }
)
"""Slabs and towers by name."""

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

TERRACE_STYLES: Mapping[str, TerraceStyle] = MappingProxyType(
    {
        "yellow_bay": TerraceStyle(),
        "red": TerraceStyle("brick/red", door="coating/red", bay_window=False),
        "stepped": TerraceStyle("brick/dark", covering=TILES_RED, bay_window=False, stepped_gable=True, door="coating/green"),
    }
)
"""Houses in a row by name."""


def _entry(name: str, title: str, make: Callable[..., BuiltAsset], seed: int, **parameters: Any) -> StarterEntry:
    return StarterEntry(f"building-{name}", title, make, parameters, seed)


BUILDINGS: tuple[StarterEntry, ...] = (
    _entry(
        "city-limestone",
        "City block, cream plaster, mansard roof",
        city_block,
        11,
        style="limestone",
        width_m=19.0,
        depth_m=13.0,
        floors=5,
    ),
    _entry(
        "city-brick",
        "City block, red brick, flat roof",
        city_block,
        12,
        style="red_brick",
        width_m=14.0,
        depth_m=12.0,
        floors=4,
        ground_m=4.0,
        storey_m=3.3,
    ),
    _entry(
        "city-ochre",
        "City block, ochre plaster, tiled roof, balconies",
        city_block,
        13,
        style="ochre",
        width_m=22.0,
        depth_m=13.0,
        floors=5,
        storey_m=3.5,
    ),
    _entry(
        "city-rose",
        "Town house, rose plaster, shutters",
        city_block,
        14,
        style="rose",
        width_m=11.0,
        depth_m=10.0,
        floors=3,
        ground_m=3.7,
        storey_m=3.1,
    ),
    _entry(
        "city-corner",
        "Corner block, sandstone, mansard roof, shops on two streets",
        city_block,
        15,
        style="sandstone",
        width_m=17.0,
        depth_m=15.0,
        floors=6,
        corner=True,
    ),
    _entry(
        "corner-shop",
        "Corner shop, yellow brick",
        city_block,
        16,
        style="corner_shop",
        width_m=9.0,
        depth_m=8.0,
        floors=2,
        corner=True,
        ground_m=3.6,
        storey_m=3.0,
        tags=("suburb",),
    ),
    _entry(
        "slab",
        "Slab of flats, eight floors, blue balconies",
        slab,
        21,
        style="white_blue",
        width_m=30.0,
        depth_m=11.5,
        floors=8,
    ),
    _entry(
        "tower",
        "Tower of flats, twelve floors",
        slab,
        22,
        style="concrete_orange",
        width_m=20.0,
        depth_m=17.0,
        floors=12,
        storey_m=2.8,
    ),
    _entry("flats", "Flats of the fifties, tiled roof", slab, 23, style="fifties", width_m=24.0, depth_m=10.0, floors=4),
    _entry("office-curtain", "Office, curtain wall, ten floors", office, 31, width_m=27.0, depth_m=18.0, floors=10),
    _entry(
        "office-ribbon",
        "Office, ribbon windows, six floors",
        office,
        32,
        width_m=30.0,
        depth_m=15.0,
        floors=6,
        curtain_wall=False,
        frame_material="coating/black",
    ),
    _entry("house-brick", "Detached house, red brick, garage", detached_house, 41, style="brick"),
    _entry(
        "house-hip",
        "Detached house, white plaster, hipped roof",
        detached_house,
        42,
        style="white_hip",
        width_m=10.4,
        depth_m=9.0,
    ),
    _entry("house-dormers", "House with dormers, cream plaster", detached_house, 43, style="dormers", garage=False),
    _entry(
        "house-gable",
        "House, gable to the street, yellow brick",
        detached_house,
        44,
        style="gable",
        width_m=8.6,
        depth_m=10.0,
        garage=False,
    ),
    _entry("terrace-yellow", "Terraced house, yellow brick, bay window", terraced_house, 51, style="yellow_bay", tags=("uk",)),
    _entry("terrace-red", "Terraced house, red brick, three floors", terraced_house, 52, style="red", floors=3, width_m=6.4),
    _entry(
        "terrace-gable",
        "Gabled house, dark brick, stepped gable",
        terraced_house,
        53,
        style="stepped",
        floors=3,
        width_m=6.6,
        depth_m=10.0,
    ),
    _entry("warehouse", "Warehouse, metal cladding, three docks", warehouse, 61, tags=("modern",)),
    _entry(
        "mill",
        "Mill, dark brick, four floors",
        city_block,
        62,
        style="mill",
        width_m=24.0,
        depth_m=14.0,
        floors=4,
        shops=False,
        storey_m=3.6,
        ground_m=4.0,
        tags=("industrial", "warehouse"),
    ),
)
"""All buildings of the starter library."""
