"""Halls clad in ribbed sheet, with loading docks."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fullwell.assets.starter.assembly import boxes, quads, span
from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.building_body import SIDES, Body, bay_centres, opening_at
from fullwell.assets.starter.facades import SHEET_M, Facade, Opening, PaneLots, WindowLook, courses, solid_spans, wall
from fullwell.assets.starter.shapes import Shape, cylinder

__all__ = ["warehouse"]


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
    house = Body(width_m, depth_m, look, rng, cladding, PaneLots(rng, warm=0.03, cool=0.25))
    for side in SIDES:
        facade = house.side(side)
        if side == "front":
            _dock_front(facade, docks, height_m, accent)
        else:
            for y in bay_centres(facade.width_m - 2, 6.0):
                facade.window(opening_at(y, 3.0, height_m - 2.2, 1.2))
            if side == "back":
                facade.door(opening_at(-facade.width_m * 0.3, 1.0, 0.05, 2.1), material=accent, fanlight_m=0.0)
        _cladding(facade, cladding, 0.6, height_m)
        facade.assembly.add("base_walls", "concrete/grey", wall(facade.width_m, 0.0, height_m, facade.openings).moved(-0.02))
        facade.assembly.add(
            "base",
            "concrete/light",
            courses(facade.width_m, 0.0, 0.6, _beside_seals(facade.openings), course_m=0.6, out_m=0.05, groove_m=0.0),
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


def _beside_seals(openings: Sequence[Opening]) -> list[Opening]:
    """Openings, those of docks with the width of their seals."""
    return [
        replace(o, left_m=o.left_m - 0.36, right_m=o.right_m + 0.36) if o.width_m > 3 and o.bottom_m < 0.1 else o
        for o in openings
    ]


def _dock_front(facade: Facade, docks: int, height_m: float, accent: str) -> None:
    width = facade.width_m
    office = 6.0
    spots = np.linspace(-width / 2 + 2.6, width / 2 - office - 2.0, docks)
    for y in spots:
        centre = float(y)
        facade.garage_door(opening_at(centre, 3.2, 0.02, 4.0), material="coating/white")
        seal = boxes(
            [(0.0, centre - 1.95, 0.3), (0.0, centre + 1.6, 0.3), (0.0, centre - 1.95, 4.03)],
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
    facade.door(opening_at(right - office + 1.1, 1.6, 0.05, 2.45), material="metal/aluminium", leaves=2, fanlight_m=0.0)
    facade.window(opening_at(right - 2.4, 2.6, 0.95, 1.5))
    facade.window(opening_at(right - office / 2 - 0.2, 4.6, height_m / 2 + 0.7, 1.4), replace(facade.look, columns=5))
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
    for a, b in itertools.pairwise(levels):
        for left, right in solid_spans(facade.width_m, a, b, facade.openings):
            count = int(np.ceil((right - left) / 0.25))
            y = np.concatenate([rib[:-1, 0] + 0.25 * k for k in range(count)] + [[0.25 * count]])
            x = np.concatenate([rib[:-1, 1]] * count + [[0.0]])
            keep = y < right - left - 1e-9
            y, x = np.append(y[keep], right - left) + left, np.append(x[keep], np.interp(right - left, y, x))
            lower = np.column_stack([x, y, np.full(len(y), a)])
            upper = np.column_stack([x, y, np.full(len(y), b)])
            facade.assembly.add("walls", material, quads(np.stack([lower[:-1], lower[1:], upper[1:], upper[:-1]], axis=1)))


def _seamed_roof(house: Body, eaves: float) -> float:
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
