"""Town houses: a front with recessed windows over a floor of shops; it faces -y, its left foot is the origin."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from benchmarks.scenes.meshes import Triangles, box_quads, quads

__all__ = ["HousePlan", "Opening", "house_parts"]

Corner = tuple[float, float, float]
Quad = list[Corner]


@dataclass(frozen=True, slots=True)
class HousePlan:
    """Measures of a house [m]."""

    width_m: float
    floors: int
    bays: int
    depth_m: float = 12.0
    shop_height_m: float = 3.9
    floor_height_m: float = 3.1
    pitched: bool = False

    @property
    def eaves_m(self) -> float:
        """Height of the walls."""
        return self.shop_height_m + self.floors * self.floor_height_m


@dataclass(frozen=True, slots=True)
class Opening:
    """A pane: the rectangle [left, right] x [low, high] at depth `back_m` behind the front; `shop` on the ground floor."""

    left_m: float
    right_m: float
    low_m: float
    high_m: float
    back_m: float
    shop: bool

    def corners_m(self, inset_m: float = 0.0) -> Quad:
        """Return the pane's corners, front towards -y, moved `inset_m` towards the street."""
        y = self.back_m - inset_m
        return [
            (self.left_m, y, self.low_m),
            (self.right_m, y, self.low_m),
            (self.right_m, y, self.high_m),
            (self.left_m, y, self.high_m),
        ]


@dataclass(slots=True)
class _Quads:
    wall: list[Quad] = field(default_factory=list)
    frame: list[Quad] = field(default_factory=list)
    trim: list[Quad] = field(default_factory=list)
    base: list[Quad] = field(default_factory=list)
    roof: list[Quad] = field(default_factory=list)


def house_parts(plan: HousePlan, rng: np.random.Generator) -> tuple[dict[str, Triangles], list[Opening]]:
    """Return the meshes by part (wall, frame, trim, base, roof) and all panes, which are left to the caller."""
    made = _Quads()
    openings: list[Opening] = []
    bay = plan.width_m / plan.bays
    wide = bay * float(rng.uniform(0.42, 0.55))
    for floor in range(plan.floors):
        foot = plan.shop_height_m + floor * plan.floor_height_m
        for number in range(plan.bays):
            left = number * bay
            middle = left + bay / 2
            cell = (left, left + bay, foot, foot + plan.floor_height_m)
            pane = Opening(middle - wide / 2, middle + wide / 2, foot + 0.75, foot + 2.5, 0.22, shop=False)
            _cell(made.wall, cell, pane)
            _window(made, pane)
            openings.append(pane)
    _ground_floor(made, openings, plan)
    _shell(made, plan)
    names = ("wall", "frame", "trim", "base", "roof")
    return {name: quads(getattr(made, name)) for name in names}, openings


def _front(left: float, right: float, low: float, high: float, y: float = 0.0) -> Quad:
    return [(left, y, low), (right, y, low), (right, y, high), (left, y, high)]


def _cell(into: list[Quad], cell: tuple[float, float, float, float], pane: Opening) -> None:
    """Add the wall around an opening and its reveals."""
    left, right, low, high = cell
    a, b, c, d, y = pane.left_m, pane.right_m, pane.low_m, pane.high_m, pane.back_m
    into += [_front(left, a, low, high), _front(b, right, low, high), _front(a, b, low, c), _front(a, b, d, high)]
    into += [
        [(a, 0, c), (a, 0, d), (a, y, d), (a, y, c)][::-1],
        [(b, 0, c), (b, y, c), (b, y, d), (b, 0, d)][::-1],
        [(a, 0, c), (b, 0, c), (b, y, c), (a, y, c)],
        [(a, 0, d), (a, y, d), (b, y, d), (b, 0, d)],
    ]


def _bar(into: list[Quad], left: float, right: float, low: float, high: float, *, y: tuple[float, float]) -> None:
    # The fourth side is the back, which is in the wall or behind the pane.
    sides = box_quads((left, y[0], low), (right, y[1], high))
    into += sides[:3] + sides[4:]


def _window(made: _Quads, pane: Opening) -> None:
    """Add frame, glazing bars, sill and lintel."""
    a, b, c, d, y = pane.left_m, pane.right_m, pane.low_m, pane.high_m, pane.back_m
    near = (y - 0.05, y + 0.02)
    t = 0.06
    middle, transom = (a + b) / 2, c + 0.68 * (d - c)
    for left, right, low, high in (
        (a, a + t, c, d),
        (b - t, b, c, d),
        (a, b, c, c + t),
        (a, b, d - t, d),
        (middle - t / 2, middle + t / 2, c, d),
        (a, b, transom, transom + 0.04),
    ):
        _bar(made.frame, left, right, low, high, y=near)
    _bar(made.trim, a - 0.10, b + 0.10, c - 0.09, c, y=(-0.09, 0.02))
    _bar(made.trim, a - 0.08, b + 0.08, d, d + 0.18, y=(-0.04, 0.02))


def _ground_floor(made: _Quads, openings: list[Opening], plan: HousePlan) -> None:
    """Add shop windows between piers, a door in every third bay, and the sign band above."""
    shops = max(2, round(plan.width_m / 4.5))
    bay = plan.width_m / shops
    for number in range(shops):
        left, right = number * bay, (number + 1) * bay
        door = number % 3 == 1
        pane = Opening(left + 0.45, right - (1.7 if door else 0.45), 0.55, 2.95, 0.30, shop=True)
        _cell(made.base, (left, right - (1.25 if door else 0.0), 0.0, plan.shop_height_m), pane)
        openings.append(pane)
        a, b = pane.left_m, pane.right_m
        for bar in np.linspace(a, b, 3 if door else 4):
            _bar(made.frame, bar - 0.04, bar + 0.04, pane.low_m, pane.high_m, y=(0.24, 0.33))
        for low in (pane.low_m, pane.high_m - 0.08):
            _bar(made.frame, a, b, low, low + 0.08, y=(0.24, 0.33))
        if door:
            entrance = Opening(right - 1.25, right - 0.25, 0.02, 2.5, 0.45, shop=False)
            _cell(made.base, (right - 1.25, right, 0.0, plan.shop_height_m), entrance)
            made.frame.append(_front(right - 1.25, right - 0.25, 0.02, 2.5, 0.44))
    _bar(made.trim, 0.15, plan.width_m - 0.15, 3.05, 3.6, y=(-0.10, 0.02))
    _bar(made.trim, 0.0, plan.width_m, plan.shop_height_m - 0.14, plan.shop_height_m + 0.08, y=(-0.16, 0.02))


def _shell(made: _Quads, plan: HousePlan) -> None:
    """Add side and rear walls, cornice and roof."""
    w, d, h = plan.width_m, plan.depth_m, plan.eaves_m
    made.wall += [
        [(0, d, 0), (0, 0, 0), (0, 0, h), (0, d, h)],
        [(w, 0, 0), (w, d, 0), (w, d, h), (w, 0, h)],
        [(w, d, 0), (0, d, 0), (0, d, h), (w, d, h)],
    ]
    _bar(made.trim, -0.05, w + 0.05, h - 0.22, h + 0.06, y=(-0.30, 0.05))
    if plan.pitched:
        ridge = h + 0.33 * d
        made.roof += [
            [(-0.1, -0.25, h), (w + 0.1, -0.25, h), (w + 0.1, d / 2, ridge), (-0.1, d / 2, ridge)],
            [(w + 0.1, d, h), (-0.1, d, h), (-0.1, d / 2, ridge), (w + 0.1, d / 2, ridge)],
        ]
        for x, turn in ((0.0, 1), (w, -1)):
            gable = [(x, 0.0, h), (x, d / 2, ridge), (x, d / 2, ridge - 0.01), (x, d, h)]
            made.wall.append(gable[::turn])
        for x in (0.2 * w, 0.75 * w):
            made.wall += box_quads((x, d / 2 - 0.3, ridge - 1.0), (x + 0.9, d / 2 + 0.3, ridge + 1.0))
    else:
        made.roof.append([(0, 0, h), (w, 0, h), (w, d, h), (0, d, h)])
        for low, high in (((0, 0), (w, 0.25)), ((0, d - 0.25), (w, d)), ((0, 0), (0.25, d)), ((w - 0.25, 0), (w, d))):
            made.wall += box_quads((*low, h), (*high, h + 0.8))
        made.trim += box_quads((-0.03, -0.04, h + 0.8), (w + 0.03, 0.29, h + 0.87))
        made.roof += box_quads((0.3 * w, 0.4 * d, h), (0.3 * w + 3.0, 0.4 * d + 2.4, h + 2.2))
