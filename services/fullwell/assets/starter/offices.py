"""Office houses: curtain walls of glass modules, and ribbons of windows between precast bands."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from fullwell.assets.starter.assembly import boxes, quads, span
from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.building_body import SIDES, Body
from fullwell.assets.starter.facades import SHEET_M, Facade, Opening, PaneLots, WindowLook, moulding
from fullwell.assets.starter.roofs import flat_roof

__all__ = ["office"]


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
    house = Body(width_m, depth_m, look, rng, wall, PaneLots(rng, warm=0.04, cool=0.24))
    top = ground_m + (floors - 1) * storey_m
    for side in SIDES:
        facade = house.side(side)
        _lobby(facade, ground_m, module_m, entrance=side == "front", frame=frame_material)
        for floor in range(1, floors):
            low = ground_m + (floor - 1) * storey_m
            if curtain_wall:
                _glass_storey(facade, low, storey_m, module_m, frame=frame_material, spandrel=spandrel_material)
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


def _glass_storey(facade: Facade, low: float, storey_m: float, module_m: float, *, frame: str, spandrel: str) -> None:
    edges = _modules(facade.width_m, module_m)
    band = low + 0.95
    spandrels = np.array([(a, b, low, band) for a, b in itertools.pairwise(edges)])
    facade.assembly.add("spandrels", spandrel, facade.glass(spandrels, 0.0))
    for (a, b), (part, material) in zip(itertools.pairwise(edges), _runs(facade, len(edges) - 1), strict=True):
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
        [(-0.05, -half + 0.03, low - 0.03), (-0.05, -half + 0.03, band - 0.03)],
        [(0.07, half - 0.03, low + 0.03), (0.07, half - 0.03, band + 0.03)],
    )
    facade.assembly.add("window_frames", frame, mullions, rails)


def _ribbon_storey(facade: Facade, low: float, storey_m: float, module_m: float, frame: str) -> None:
    width = facade.width_m
    opening = Opening(-width / 2 + 0.6, width / 2 - 0.6, low + 1.0, low + storey_m - 0.75)
    facade.cut(opening, 0.22)
    edges = _modules(opening.width_m, module_m)
    for (a, b), (part, material) in zip(itertools.pairwise(edges), _runs(facade, len(edges) - 1), strict=True):
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
    ledge = [(0.0, -half - 0.05, opening.bottom_m - 0.12), (0.0, -half - 0.05, opening.top_m)]
    brim = [(0.06, half + 0.05, opening.bottom_m - 0.02), (0.06, half + 0.05, opening.top_m + 0.14)]
    facade.assembly.add("ledges", "concrete/grey", boxes(ledge, brim))
    seams = _modules(width, 4 * module_m)[1:-1]
    for bottom, high in ((low + 0.01, opening.bottom_m - 0.13), (opening.top_m + 0.15, low + storey_m - 0.01)):
        facade.assembly.add(
            "joints",
            "asphalt/worn",
            boxes([(0.0, y - 0.012, bottom) for y in seams], [(2 * SHEET_M, y + 0.012, high) for y in seams]),
        )


def _lobby(facade: Facade, ground_m: float, module_m: float, *, entrance: bool, frame: str) -> None:
    """A glazed ground floor set back behind columns' faces, with revolving-door width in the middle of the front."""
    width, deep = facade.width_m, 0.35
    facade.wall_part, facade.wall_material = "ground_walls", "stone/granite"
    columns = _modules(width - 0.8, 4 * module_m)
    tops = ground_m - 0.4
    for a, b in itertools.pairwise(columns):
        opening = Opening(float(a) + 0.3, float(b) - 0.3, 0.12, tops)
        facade.cut(opening, deep)
        edges = _modules(opening.width_m, module_m) + (opening.left_m + opening.right_m) / 2
        panes = np.array([(p, q, c, d) for p, q in itertools.pairwise(edges) for c, d in ((0.12, 2.5), (2.5, tops))])
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


def _corner_posts(house: Body, low: float, top: float, material: str) -> None:
    x, y = house.depth_m / 2, house.width_m / 2
    corners = [(sx * x, sy * y) for sx in (1, -1) for sy in (1, -1)]
    house.assembly.add(
        "window_frames",
        material,
        boxes([(a - 0.12, b - 0.12, low) for a, b in corners], [(a + 0.12, b + 0.12, top - 0.01) for a, b in corners]),
    )


def _screen(house: Body, top: float) -> float:
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
