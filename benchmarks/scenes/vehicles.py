"""Cars of several parts, lofted from a side view and a plan; x forward, y left, z up, the origin on the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes.meshes import Triangles, block, ellipsoid, join, loft, moved, panel, revolve, turned

__all__ = ["BODIES", "CAR_COLOURS", "CarBody", "car_parts", "lamp_places"]

CAR_COLOURS: tuple[tuple[str, float], ...] = (
    ("#e9e9e6", 21), ("#15161a", 19), ("#6b6e72", 15), ("#b9bcc0", 15), ("#8d1c1f", 10),
    ("#1f3f73", 8), ("#5a4330", 6), ("#2d4f3a", 4), ("#c9852b", 2),
)  # fmt: skip
"""Paint and its share of all cars in per cent."""


@dataclass(frozen=True, slots=True)
class CarBody:
    """Lengths [m] and side view of a type of car.

    `shoulder` are heights over x of bonnet, waist line and boot; `belt` and `roof` the x of the cabin's rear and front at its
    foot and at the roof.
    """

    name: str
    length_m: float
    width_m: float
    height_m: float
    shoulder: tuple[tuple[float, float], ...]
    belt: tuple[float, float]
    roof: tuple[float, float]
    wheel_radius_m: float = 0.32
    sill_m: float = 0.22

    @property
    def axles_m(self) -> tuple[float, float]:
        """x of the rear and the front axle."""
        return -0.31 * self.length_m, 0.31 * self.length_m

    def nose_x_m(self, y_m: float) -> float:
        """Return x of the front at `y_m` from the middle; the rear is the same backwards."""
        return self.length_m / 2 * math.pow(1 - (2 * abs(y_m) / self.width_m) ** _PLAN, 1 / _PLAN)


_PLAN = 6.0
"""Exponent of the plan: a rectangle with rounded corners."""

BODIES: dict[str, CarBody] = {
    body.name: body
    for body in (
        CarBody(
            "saloon", 4.76, 1.84, 1.43,
            shoulder=((-2.38, 0.90), (-2.2, 1.02), (-1.3, 1.04), (0.9, 0.97), (1.9, 0.84), (2.38, 0.66)),
            belt=(-1.75, 1.12), roof=(-0.85, 0.18),
        ),
        CarBody(
            "hatch", 4.10, 1.76, 1.48,
            shoulder=((-2.05, 0.86), (-1.9, 1.00), (-1.2, 1.02), (0.9, 0.96), (1.6, 0.86), (2.05, 0.66)),
            belt=(-1.98, 1.08), roof=(-1.50, 0.20),
        ),
        CarBody(
            "suv", 4.62, 1.90, 1.68,
            shoulder=((-2.31, 0.95), (-2.2, 1.12), (-1.2, 1.14), (0.9, 1.10), (1.9, 1.00), (2.31, 0.80)),
            belt=(-2.24, 1.20), roof=(-1.85, 0.30), wheel_radius_m=0.36, sill_m=0.28,
        ),
        CarBody(
            "van", 5.10, 1.95, 1.98,
            shoulder=((-2.55, 1.00), (-2.45, 1.12), (-1.0, 1.14), (1.5, 1.12), (2.1, 1.02), (2.55, 0.74)),
            belt=(-2.50, 1.85), roof=(-2.38, 0.95), wheel_radius_m=0.34, sill_m=0.24,
        ),
    )
}  # fmt: skip


def car_parts(body: CarBody) -> dict[str, Triangles]:
    """Return the car's meshes by part: paint, glass, trim, tyre, rim, lens (headlamps), tail, plate."""
    cabin = _Cabin(body)
    return {
        "paint": join([_lower_body(body), cabin.roof(), *cabin.pillars(), *_mirrors(body)]),
        "glass": cabin.glass(),
        "trim": join(_trim(body)),
        "tyre": join(_at_wheels(body, _tyre(body.wheel_radius_m))),
        "rim": join(_at_wheels(body, _rim(body.wheel_radius_m))),
        "lens": join(_lamp_lenses(body, front=True)),
        "tail": join(_lamp_lenses(body, front=False)),
        "plate": join(_plates(body)),
    }


# Body ----------------------------------------------------------------------------------------------------------------


def _shoulder_m(body: CarBody, x_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of bonnet, waist and boot over x, its corners rounded over 0.3 m."""
    xs, heights = zip(*body.shoulder, strict=True)
    window = np.linspace(-0.15, 0.15, 9)
    return np.asarray(np.interp(x_m[:, None] + window, xs, heights).mean(axis=1))


def _bottom_m(body: CarBody, x_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the lower edge, with arches over the wheels and raised ends."""
    bottom = body.sill_m + 0.16 * np.clip((np.abs(x_m) - 0.42 * body.length_m) / (0.08 * body.length_m), 0, 1) ** 2
    arch = body.wheel_radius_m + 0.06
    for axle in body.axles_m:
        inside = np.maximum(arch**2 - (x_m - axle) ** 2, 0.0)
        bottom = np.where(inside > 0, np.maximum(bottom, body.wheel_radius_m + np.sqrt(inside)), bottom)
    return np.asarray(bottom)


def _stations_m(body: CarBody) -> NDArray[np.float64]:
    half, arch = body.length_m / 2, body.wheel_radius_m + 0.06
    ends = half * (1 - np.array([0.0, 0.001, 0.004, 0.012, 0.03, 0.06, 0.1]))
    # One station just outside each foot of an arch makes its edge stand upright.
    across = np.concatenate([[-arch - 0.004, arch + 0.004], arch * np.cos(np.linspace(0, math.pi, 13))])
    arches = [axle + across for axle in body.axles_m]
    return np.unique(np.round(np.concatenate([ends, -ends, *arches, np.linspace(-0.9 * half, 0.9 * half, 21)]), 4))


_SECTION = (
    (0.0, 0.0), (0.88, 0.0), (0.96, 0.05), (0.985, 0.25), (1.0, 0.52), (0.985, 0.72),
    (0.955, 0.88), (0.90, 0.965), (0.80, 0.995), (0.45, 1.02), (0.0, 1.03),
)  # fmt: skip
"""Half a cross-section from the middle of the floor to the middle of the top: share of the half width, share of the height."""


def _lower_body(body: CarBody) -> Triangles:
    """Return the painted body below the windows."""
    x = _stations_m(body)
    half_width = body.width_m / 2 * np.maximum(1 - np.abs(2 * x / body.length_m) ** _PLAN, 0.02) ** (1 / _PLAN)
    low, high = _bottom_m(body, x), _shoulder_m(body, x)
    right = np.array(_SECTION)
    left = right[-2:0:-1] * [-1, 1]
    section = np.concatenate([right, left])
    rings = np.empty((len(x), len(section), 3))
    rings[..., 0] = x[:, None]
    rings[..., 1] = section[:, 0] * half_width[:, None]
    rings[..., 2] = low[:, None] + section[:, 1] * (high - low)[:, None]
    return loft(rings, capped=True, crease_deg=42)


class _Cabin:
    """The greenhouse: rounded rectangles from the waist line to the roof; windows, pillars and roof are parts of it."""

    _SIDE, _END, _CORNER = 14, 6, 4

    def __init__(self, body: CarBody) -> None:
        self._body = body
        self._foot_m = float(_shoulder_m(body, np.array([(body.belt[0] + body.belt[1]) / 2]))[0]) - 0.05

    def _ring(self, level: float, grow_m: float) -> NDArray[np.float64]:
        """Return the (n, 3) outline at `level` in [0, 1] from waist to roof, grown outwards."""
        body = self._body
        rear, front = ((1 - level) * foot + level * roof for foot, roof in zip(body.belt, body.roof, strict=True))
        half = body.width_m / 2 * (0.90 - 0.20 * level**1.3)
        centre, long = (rear + front) / 2, (front - rear) / 2 + grow_m
        half += grow_m
        radius = 0.10
        outline = []
        for (sx, sy), start in zip(((1, -1), (1, 1), (-1, 1), (-1, -1)), (-90, 0, 90, 180), strict=True):
            angle = np.radians(start + np.linspace(0, 90, self._CORNER + 1))
            arc = np.column_stack(
                [sx * (long - radius) + radius * np.cos(angle), sy * (half - radius) + radius * np.sin(angle)]
            )
            outline.append(arc)
        corners = []
        for number, arc in enumerate(outline):
            steps = self._END if number % 2 == 0 else self._SIDE
            between = np.linspace(arc[-1], outline[(number + 1) % 4][0], steps + 1)[1:-1]
            corners += [arc, between]
        flat = np.concatenate(corners)
        bow = 0.10 * (1 - np.clip(np.abs(flat[:, 1]) / half, 0, 1) ** 2) * np.sign(flat[:, 0])
        flat[:, 0] = np.where(np.abs(flat[:, 0]) > long - radius, flat[:, 0] + bow, flat[:, 0]) + centre
        height = self._foot_m + level * (body.height_m - 0.06 - self._foot_m)
        return np.column_stack([flat, np.full(len(flat), height)])

    def glass(self) -> Triangles:
        """Return the closed dark body behind all windows."""
        return loft([self._ring(level, 0.0) for level in (0, 0.3, 0.6, 0.9)], capped=True)

    def roof(self) -> Triangles:
        """Return the painted roof with its rounded edge."""
        rings = [self._ring(level, 0.008) for level in (0.86, 0.93, 1.0)]
        top = rings[-1]
        middle = top.mean(axis=0)
        for shrink, rise_m in ((0.97, 0.022), (0.90, 0.038), (0.6, 0.054), (0.2, 0.06)):
            rings.append(middle + (top - middle) * [shrink, shrink, 1] + [0, 0, rise_m])
        return loft(rings, capped=True, crease_deg=50)

    def pillars(self) -> list[Triangles]:
        """Return the painted strips between the windows: at the four corners and one or two on each side."""
        corner, end, side = self._CORNER + 1, self._END - 1, self._SIDE - 1
        arcs = [0, corner + end, 2 * corner + end + side, 3 * corner + 2 * end + side]
        spans = [(start, start + corner - 1) for start in arcs]
        left, right = arcs[1] + corner, arcs[3] + corner
        van = self._body.name == "van"
        share = (0.34, 0.66) if self._body.name in ("suv", "van") else (0.45,)
        for part in share:
            spans += [(left + round(part * side), left + round(part * side) + 1)]
            spans += [(right + round((1 - part) * side) - 1, right + round((1 - part) * side))]
        if van:  # a panel van: no windows behind the doors
            spans += [(left + round(0.34 * side), left + side), (right, right + round(0.66 * side))]
        rings = np.array([self._ring(level, 0.006) for level in np.linspace(0, 0.9, 6)])
        total = rings.shape[1]
        return [loft(rings[:, [k % total for k in range(first, last + 1)]], closed=False) for first, last in spans]


# Small parts ---------------------------------------------------------------------------------------------------------


def _mirrors(body: CarBody) -> list[Triangles]:
    x, y = body.belt[1] - 0.42, body.width_m / 2 + 0.06
    height = body.shoulder[3][1] + 0.07
    return [ellipsoid((0.055, 0.11, 0.07), (x, side * y, height), segments=8) for side in (-1, 1)]


def _tyre(radius_m: float) -> Triangles:
    half, inner = 0.105, 0.66 * radius_m
    profile = [(inner, -half), (radius_m - 0.03, -half), (radius_m - 0.008, -half + 0.02), (radius_m, -half + 0.05)]
    profile += [(r, -h) for r, h in profile[::-1]]
    return turned(revolve([*profile, profile[0]], segments=20), "x", 90)


def _rim(radius_m: float) -> Triangles:
    """Return a rim with five double spokes, its outside towards -y."""
    rim = 0.68 * radius_m
    barrel = revolve([(rim, 0.03), (rim - 0.02, 0.10), (rim - 0.035, 0.095), (rim - 0.03, -0.09)], segments=20)
    hub = revolve([(0.055, 0.05), (0.05, 0.075), (0.001, 0.08)], segments=16)
    disc = revolve([(rim - 0.03, -0.02), (0.001, -0.02)], segments=20)
    spokes = []
    for number in range(5):
        for tilt in (-7, 7):
            spoke = block((rim - 0.05, 0.028, 0.022), ((rim - 0.05) / 2 + 0.03, 0, 0.066))
            spokes.append(turned(spoke, "z", 72 * number + tilt))
    return turned(join([barrel, hub, disc, *spokes]), "x", 90)


def _at_wheels(body: CarBody, wheel: Triangles) -> list[Triangles]:
    """Return the wheel four times; it comes with its outside towards -y."""
    y = body.width_m / 2 - 0.125
    right = [moved(wheel, (x, -y, body.wheel_radius_m)) for x in body.axles_m]
    left = [moved(turned(wheel, "z", 180), (x, y, body.wheel_radius_m)) for x in body.axles_m]
    return right + left


def _trim(body: CarBody) -> list[Triangles]:
    """Return grille, lower air intakes, rear skirt, floor and door seams."""
    half = body.length_m / 2
    height = body.shoulder[-1][1]
    parts = [
        block((0.06, 0.86, 0.13), (half - 0.022, 0, height - 0.16)),
        block((0.06, 1.10, 0.11), (half - 0.016, 0, 0.40)),
        block((0.06, 1.20, 0.13), (-half + 0.020, 0, 0.42)),
        block((0.72 * body.length_m, 0.78 * body.width_m, 0.30), (0, 0, body.sill_m + 0.16)),
    ]
    waist = body.shoulder[3][1]
    low = body.sill_m + 0.10
    for side in (-1, 1):
        y = side * (body.width_m / 2 * 0.993)
        for x in (body.belt[1] - 0.30, (body.belt[0] + body.belt[1]) / 2 + 0.02):
            parts.append(block((0.012, 0.02, waist - low - 0.2), (x, y, (waist + low) / 2 - 0.06)))
        for x in ((body.belt[0] + body.belt[1]) / 2 + 0.18, body.belt[0] + 0.75):
            parts.append(block((0.16, 0.03, 0.025), (x, side * (body.width_m / 2 * 0.985), waist - 0.16)))
    return parts


def lamp_places(body: CarBody, *, front: bool) -> list[tuple[float, float, float]]:
    """Return the middles (x, y, z) of the two lamps' faces, left and right."""
    y = 0.36 * body.width_m
    x = body.nose_x_m(y) - 0.005
    low = body.shoulder[-1][1] - 0.08 if front else body.shoulder[0][1] - 0.10
    return [((x if front else -x), side * y, low) for side in (1, -1)]


def _lamp_lenses(body: CarBody, *, front: bool) -> list[Triangles]:
    size = (0.09, 0.19, 0.075) if front else (0.05, 0.17, 0.085)
    lenses = []
    for x, y, z in lamp_places(body, front=front):
        inward = x - math.copysign(size[0] * 0.9, x)
        lenses.append(ellipsoid(size, (inward, y, z), segments=10))
    return lenses


def _plates(body: CarBody) -> list[Triangles]:
    front, low = body.length_m / 2 + 0.018, 0.52
    plate = [(0, -0.26, low - 0.055), (0, 0.26, low - 0.055), (0, 0.26, low + 0.055), (0, -0.26, low + 0.055)]
    forwards = moved(panel(plate), (front, 0, 0))
    rear = turned(moved(panel(plate), (front, 0, 0.12)), "z", 180)
    return [forwards, rear]
