"""Bicycles and motorcycles, without riders.

A bicycle's saddle, grips and pedals are attributes, so that a rider can be put on it. Frame angles and lengths are those of
common frames of medium size: seat tube 73 degrees, wheelbase 1.00 to 1.11 m, bottom bracket 0.28 m above the road.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fullwell.assets.starter.building import BuiltAsset, BuiltPart
from fullwell.assets.starter.shapes import Shape, box, cylinder, joined, loft, revolution, sphere, tube
from fullwell.assets.starter.vehicle_coach import mudguard
from fullwell.assets.starter.vehicle_fittings import lamp_lens, number_plate, plate_text, round_lens, rounded_box
from fullwell.assets.starter.vehicle_parts import PartList
from fullwell.assets.starter.wheels import car_wheel, spoked_wheel

__all__ = ["BICYCLE_KINDS", "Bicycle", "BicycleKind", "bicycle", "bicycle_shape", "motorcycle"]

BicycleKind = Literal["city", "sport", "mountain"]
BICYCLE_KINDS: tuple[BicycleKind, ...] = ("city", "sport", "mountain")

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Bicycle:
    """A bicycle standing upright on z = 0, facing +x, x = 0 midway between the axles.

    Attributes
    ----------
    parts
        With unique names beginning with `bicycle_`.
    saddle_m
        Top of the saddle, where a rider sits.
    grips_m, pedals_m
        Left and right: middle of the handlebar's grip; middle of the pedal's top, the left crank forward and level.
    bottom_bracket_m, crank_m
        Where the cranks turn, and how long they are.
    """

    parts: tuple[BuiltPart, ...]
    saddle_m: Point
    grips_m: tuple[Point, Point]
    pedals_m: tuple[Point, Point]
    bottom_bracket_m: Point
    crank_m: float

    def attributes(self) -> dict[str, float | str]:
        """Return the places as flat numbers: saddle_x_m, grip_left_x_m, pedal_right_z_m, ..."""
        places = {"saddle": self.saddle_m, "bottom_bracket": self.bottom_bracket_m}
        places |= {f"grip_{side}": place for side, place in zip(("left", "right"), self.grips_m, strict=True)}
        places |= {f"pedal_{side}": place for side, place in zip(("left", "right"), self.pedals_m, strict=True)}
        flat: dict[str, float | str] = {
            f"{name}_{axis}_m": place[index] for name, place in places.items() for index, axis in enumerate("xyz")
        }
        return flat | {"crank_m": self.crank_m}


@dataclass(frozen=True, slots=True)
class _Frame:
    """Half wheelbase, tyre (radius, section), saddle height, bar (x, half width, z), how far grips lie back, tube radius."""

    half_base_m: float
    tyre_m: tuple[float, float]
    saddle_z_m: float
    bar: tuple[float, float, float]
    grip_back_m: float
    tube_m: float
    step_through: bool


_FRAMES: dict[BicycleKind, _Frame] = {
    "city": _Frame(0.535, (0.345, 0.020), 0.95, (0.255, 0.28, 1.08), 0.17, 0.017, True),
    "sport": _Frame(0.495, (0.336, 0.013), 0.97, (0.40, 0.20, 0.94), -0.06, 0.016, False),
    "mountain": _Frame(0.555, (0.345, 0.028), 0.93, (0.335, 0.35, 1.02), 0.03, 0.020, False),
}


def bicycle(rng: np.random.Generator, *, kind: BicycleKind = "city", paint: str = "paint/blue") -> BuiltAsset:
    """Return a parked bicycle as an asset. Nothing of it is random."""
    made = bicycle_shape(kind, paint=paint)
    frame = _FRAMES[kind]
    attributes = made.attributes() | {"wheelbase_m": 2 * frame.half_base_m, "wheel_radius_m": frame.tyre_m[0]}
    _ = rng
    return BuiltAsset("bicycle", (kind, "bicycle"), made.parts, {name: _rounded(value) for name, value in attributes.items()})


def _rounded(value: float | str) -> float | str:
    return value if isinstance(value, str) else round(float(value), 4)


def bicycle_shape(kind: BicycleKind, *, paint: str = "paint/blue") -> Bicycle:
    """Return a bicycle: "city" (low step, mudguards, carrier, lamps), "sport" (drop bar) or "mountain" (broad tyres, fork)."""
    frame = _FRAMES[kind]
    radius, section = frame.tyre_m
    parts = PartList()
    rear, front = (-frame.half_base_m, 0.0, radius), (frame.half_base_m, 0.0, radius)
    bracket = (rear[0] + 0.43, 0.0, 0.28)
    for place, axle in (("rear", rear), ("front", front)):
        wheel = spoked_wheel(radius, section).placed(*axle)
        parts.add(f"bicycle_tyre_{place}", "rubber/tyre", wheel.tyre)
        parts.add(f"bicycle_rim_{place}", "metal/aluminium", wheel.rim)
        parts.add("bicycle_spokes", "metal/steel_brushed", wheel.brake)
    head = _add_frame(parts, frame, (rear, front, bracket), paint)
    saddle = _add_saddle(parts, frame, bracket)
    grips = _add_bar(parts, kind, frame, head)
    pedals = _add_cranks(parts, rear, bracket)
    if kind == "city":
        _add_city_outfit(parts, frame, rear, front)
    built = parts.built("bicycle", (kind,), {})
    return Bicycle(built.parts, saddle, grips, pedals, bracket, _CRANK_M)


_CRANK_M = 0.17


def _add_frame(parts: PartList, frame: _Frame, joints: tuple[Point, Point, Point], paint: str) -> Point:
    """Add frame and fork; return the head tube's upper end."""
    rear, front, bracket = joints
    radius = frame.tube_m
    seat_top = _along(bracket, 107.0, 0.52 if not frame.step_through else 0.50)
    steer = _along(front, 109.0, frame.tyre_m[0] + frame.tyre_m[1] + 0.03)
    low = (steer[0] - 0.045, 0.0, steer[2])
    top = _along(low, 109.0, 0.16 if not frame.step_through else 0.22)
    shapes = [
        tube([bracket, seat_top], radius, sides=12),
        tube([low, top], 1.15 * radius, sides=12),
        cylinder(0.024, 0.07, axis="y", sides=16).moved(*bracket),
    ]
    if frame.step_through:
        bend = [top, (0.12, 0.0, 0.52), (0.0, 0.0, 0.36), bracket]
        shapes.append(tube(_rounded_path(bend), 1.25 * radius, sides=12))
        shapes.append(tube(_rounded_path([low, (0.16, 0.0, 0.42), (0.04, 0.0, 0.30), bracket]), radius, sides=12))
    else:
        shapes.append(tube([_between(low, top, 0.85), _between(bracket, seat_top, 0.94)], radius, sides=12))
        shapes.append(tube([_between(low, top, 0.1), bracket], 1.2 * radius, sides=12))
    for side in (-1, 1):
        off = frame.tyre_m[1] + 0.014
        dropout = (rear[0], side * 0.062, rear[2])
        shapes.append(
            tube(
                _rounded_path([(bracket[0], side * 0.03, bracket[2]), (rear[0] + 0.36, side * off, 0.285), dropout]),
                0.0095,
                sides=8,
            )
        )
        shapes.append(
            tube(
                _rounded_path(
                    [
                        (seat_top[0], side * 0.02, seat_top[2] - 0.03),
                        (seat_top[0] - 0.07, side * off, seat_top[2] - 0.12),
                        dropout,
                    ]
                ),
                0.008,
                sides=8,
            )
        )
    parts.add("bicycle_frame", paint, *shapes, paintable=True)
    fork = [tube([low, (low[0] - 0.002, 0.0, low[2] - 0.012)], 0.03, sides=12)]
    for side in (-1, 1):
        off = frame.tyre_m[1] + 0.02
        blade = [
            (low[0], side * off, low[2] + 0.01),
            (steer[0] - 0.02, side * off, steer[2] - 0.12),
            (front[0], side * 0.052, front[2]),
        ]
        thick = [0.017, 0.016, 0.011] if frame.tyre_m[1] > 0.025 else [0.013, 0.012, 0.008]
        fork.append(tube(_rounded_path(blade), np.interp(np.linspace(0, 2, 13), [0, 1, 2], thick), sides=10))
    fork.append(tube([(low[0], -0.055, low[2]), (low[0], 0.055, low[2])], 0.016, sides=10))
    parts.add("bicycle_fork", paint, *fork, paintable=True)
    return top


def _along(start: Point, angle_deg: float, length: float) -> Point:
    turn = np.deg2rad(angle_deg)
    return (start[0] + length * float(np.cos(turn)), start[1], start[2] + length * float(np.sin(turn)))


def _between(start: Point, stop: Point, share: float) -> Point:
    x, y, z = (a + share * (b - a) for a, b in zip(start, stop, strict=True))
    return x, y, z


def _rounded_path(corners: Sequence[Point], *, count: int = 13) -> NDArray[np.float64]:
    """Return points of a smooth curve near corners: a quadratic or cubic Bezier curve through the ends."""
    points = np.array(corners, dtype=np.float64)
    share = np.linspace(0.0, 1.0, count)[:, None, None]
    while len(points.shape) == 2 or points.shape[1] > 1:
        points = np.broadcast_to(points, (count, *points.shape)) if len(points.shape) == 2 else points
        points = points[:, :-1] * (1 - share) + points[:, 1:] * share
    return np.asarray(points[:, 0])


def _add_saddle(parts: PartList, frame: _Frame, bracket: Point) -> Point:
    length = (frame.saddle_z_m - 0.05 - bracket[2]) / np.sin(np.deg2rad(73.0))
    post = _along(bracket, 107.0, float(length))
    parts.add("bicycle_post", "metal/aluminium", tube([_along(bracket, 107.0, 0.4), post], 0.0135, sides=12))
    broad = 0.10 if frame.step_through else 0.07
    rings = []
    for x, half, rise in (
        (-0.13, 0.5, -0.012),
        (-0.12, 0.85, 0.004),
        (-0.08, 1.0, 0.008),
        (-0.02, 0.62, 0.0),
        (0.06, 0.3, -0.004),
        (0.12, 0.24, -0.006),
        (0.14, 0.12, -0.012),
    ):
        angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
        thick = 0.024 * (0.6 + 0.4 * half)
        y, z = half * broad * np.cos(angle), rise + thick * np.sin(angle) * np.where(np.sin(angle) < 0, 1.0, 0.7)
        rings.append(np.stack([np.full(16, x), y, z], axis=-1))
    saddle = loft(rings).smooth(60).moved(post[0] + 0.01, 0.0, frame.saddle_z_m - 0.022)
    parts.add("bicycle_saddle", "leather/black", saddle)
    return post[0] - 0.03, 0.0, frame.saddle_z_m


def _add_bar(parts: PartList, kind: BicycleKind, frame: _Frame, head: Point) -> tuple[Point, Point]:
    x, half, z = frame.bar
    clamp = (x, 0.0, z - (0.05 if kind == "city" else 0.0))
    parts.add(
        "bicycle_stem", "metal/aluminium", tube([head, _between(head, (head[0] - 0.02, 0.0, clamp[2]), 0.9)], 0.014, sides=12)
    )
    parts.add("bicycle_stem", "metal/aluminium", tube([(head[0] - 0.02, 0.0, clamp[2] - 0.015), clamp], 0.014, sides=12))
    back = frame.grip_back_m
    if kind == "sport":
        path = np.concatenate(
            [
                [(x, 0.0, z)],
                _rounded_path([(x, half - 0.05, z), (x, half, z), (x + 0.05, half, z)], count=6)[:-1],
                _rounded_path(
                    [(x + 0.05, half, z), (x + 0.15, half, z), (x + 0.12, half, z - 0.13), (x - 0.02, half + 0.01, z - 0.13)]
                ),
            ]
        )
        grip = (x + 0.06, half, z + 0.022)
        parts.add_both(
            "bicycle_grips",
            "rubber/tyre",
            tube([(x + 0.05, half, z + 0.005), (x + 0.105, half, z + 0.03)], [0.018, 0.014], sides=10),
        )
    else:
        path = (
            _rounded_path([clamp, (x + 0.02, 0.55 * half, z + 0.01), (x, half, z), (x - back, half, z)])
            if kind == "city"
            else np.array([clamp, (x - 0.2 * back, 0.5 * half, z), (x - back, half, z)])
        )
        end = path[-1]
        inner = path[-1] - (path[-1] - path[-2]) / np.linalg.norm(path[-1] - path[-2]) * 0.12 if kind != "city" else path[-4]
        grip = (float(end[0] + inner[0]) / 2, float(end[1] + inner[1]) / 2, float(end[2] + inner[2]) / 2 + 0.016)
        parts.add_both("bicycle_grips", "rubber/tyre", tube([inner, end + (end - inner) * 0.03], 0.0165, sides=10))
    parts.add_both("bicycle_bar", "metal/aluminium", tube(path, 0.011, sides=10))
    return grip, (grip[0], -grip[1], grip[2])


def _add_cranks(parts: PartList, rear: Point, bracket: Point) -> tuple[Point, Point]:
    ring = revolution([(0.075, -0.0015), (0.09, -0.0015), (0.09, 0.0015), (0.075, 0.0015), (0.075, -0.0015)], sides=32).turned(
        "x", -90
    )
    spider = joined([box((0.15, 0.003, 0.014)).turned("y", angle) for angle in (0.0, 60.0, 120.0)])
    parts.add(
        "bicycle_cranks",
        "metal/steel_brushed",
        ring.moved(bracket[0], -0.045, bracket[2]),
        spider.moved(bracket[0], -0.045, bracket[2]),
    )
    sprocket = cylinder(0.035, 0.012, axis="y", sides=20).moved(rear[0], -0.045, rear[2])
    parts.add("bicycle_cranks", "metal/steel_brushed", sprocket)
    for sign in (-1, 1):
        run = [(bracket[0], -0.045, bracket[2] + sign * 0.087), (rear[0], -0.045, rear[2] + sign * 0.034)]
        parts.add("bicycle_chain", "metal/steel_brushed", tube(run, 0.0045, sides=5))
    pedals = []
    for side, forward in ((1, 1), (-1, -1)):
        start = (bracket[0], side * 0.055, bracket[2])
        stop = (bracket[0] + forward * _CRANK_M, side * 0.075, bracket[2])
        parts.add("bicycle_cranks", "metal/steel_brushed", tube([start, stop], [0.013, 0.010], sides=8))
        middle = (stop[0], side * 0.125, stop[2])
        parts.add("bicycle_pedals", "plastic/black", rounded_box((0.09, 0.085, 0.026), 0.008, centre_m=middle, steps=2))
        pedals.append((middle[0], middle[1], middle[2] + 0.013))
    return pedals[0], pedals[1]


def _add_city_outfit(parts: PartList, frame: _Frame, rear: Point, front: Point) -> None:
    """Add mudguards, carrier, lamps, and a stand."""
    reach = frame.tyre_m[0] + 0.014
    parts.add(
        "bicycle_mudguards", "plastic/black", mudguard(reach, 0.055, start_deg=35, stop_deg=175, thick_m=0.003).moved(*rear)
    )
    parts.add(
        "bicycle_mudguards", "plastic/black", mudguard(reach, 0.055, start_deg=55, stop_deg=190, thick_m=0.003).moved(*front)
    )
    z = rear[2] + reach + 0.035
    for y in (-0.06, 0.0, 0.06):
        parts.add(
            "bicycle_carrier", "metal/steel_brushed", tube([(rear[0] + 0.17, y, z), (rear[0] - 0.20, y, z)], 0.0055, sides=6)
        )
    for x in (0.17, 0.0, -0.20):
        parts.add(
            "bicycle_carrier", "metal/steel_brushed", tube([(rear[0] + x, -0.06, z), (rear[0] + x, 0.06, z)], 0.0055, sides=6)
        )
    parts.add_both(
        "bicycle_carrier", "metal/steel_brushed", tube([(rear[0], 0.066, rear[2]), (rear[0] - 0.05, 0.06, z)], 0.005, sides=6)
    )
    parts.add("bicycle_lamp_body", "plastic/black", sphere(0.032, sides=14).scaled(1.3, 1.0, 1.0).moved(0.40, 0.0, 0.82))
    parts.add("headlight", "lamp/headlight_led", round_lens(0.027).moved(0.432, 0.0, 0.82))
    parts.add(
        "bicycle_lamp_body", "plastic/black", rounded_box((0.03, 0.10, 0.05), 0.012, centre_m=(rear[0] - 0.215, 0.0, z - 0.01))
    )
    parts.add("taillight", "lamp/tail", lamp_lens(0.09, 0.04).turned("z", 180).moved(rear[0] - 0.231, 0.0, z - 0.01))
    parts.add(
        "bicycle_stand",
        "metal/steel_brushed",
        tube([(rear[0] + 0.12, 0.05, 0.30), (rear[0] + 0.06, 0.16, 0.008)], 0.008, sides=8),
    )


# --- motorcycles --------------------------------------------------------------------------------------------


def motorcycle(rng: np.random.Generator, *, kind: str = "naked", paint: str = "paint/red") -> BuiltAsset:
    """Return a motorcycle: "naked", "tourer" (fairing, screen and cases) or "scooter". The seed makes up its plate."""
    parts = PartList()
    maker = {"naked": _naked, "tourer": _tourer, "scooter": _scooter}[kind]
    attributes = maker(parts, paint, rng)
    return parts.built("motorcycle", (kind, "motorcycle"), attributes)


def _blob(stations: Sequence[tuple[float, float, float, float]], *, power: float = 2.6, sides: int = 24) -> Shape:
    """Return a smooth body along x through (x, z, half width, half height)."""
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    c, s = np.cos(angle), np.sin(angle)
    radius = (np.abs(c) ** power + np.abs(s) ** power) ** (-1 / power)
    knots = np.array(sorted(stations))
    way = np.linspace(0, len(knots) - 1, 4 * (len(knots) - 1) + 1)
    values = PchipInterpolator(np.arange(len(knots)), knots)(way)
    rings = [np.stack([np.full(sides, x), half * radius * c, z + tall * radius * s], axis=-1) for x, z, half, tall in values]
    return loft(rings).smooth(55)


def _add_road_wheel(parts: PartList, place: str, x: float, size_m: tuple[float, float, float], *, discs: bool = True) -> None:
    """Add a wheel of (radius, width, rim radius) in the middle plane, with brake discs on both sides."""
    radius, width, rim = size_m
    wheel = car_wheel(radius, width, rim, "five", sides=40)
    # Both sides show: the spokes stand in the middle, and there is no barrel behind them.
    spokes = wheel.rim.moved(0.0, -0.25 * width, 0.0)
    parts.add(f"tyre_{place}", "rubber/tyre", _round_tyre(radius, width, rim).moved(x, 0.0, radius))
    parts.add(f"rim_{place}", "metal/rim_alloy", spokes.moved(x, 0.0, radius), spokes.mirrored().moved(x, 0.0, radius))
    parts.add(
        f"rim_{place}",
        "metal/rim_alloy",
        cylinder(rim + 0.004, 0.006, axis="y", sides=40).scaled(0.3, 1.0, 0.3).moved(x, 0.0, radius),
    )
    if discs:
        ring = [(0.085, -0.0025), (0.145, -0.0025), (0.145, 0.0025), (0.085, 0.0025), (0.085, -0.0025)]
        disc = revolution(ring, sides=36).turned("x", -90).moved(x, 0.075, radius)
        parts.add_both("brake_discs", "metal/steel_brushed", disc)


def _round_tyre(radius: float, width: float, rim: float) -> Shape:
    angle = np.linspace(-0.62 * np.pi, 0.62 * np.pi, 15)
    tall = (radius - rim) / 1.25
    outside = [(radius - tall + tall * np.cos(a), width / 2 * np.sin(a) / 1.0) for a in angle]
    inside = [(rim - 0.012, 0.30 * width), (rim - 0.012, -0.30 * width)]
    profile = [*inside[1:], *outside, *inside[:1], inside[1]]
    return revolution(profile, sides=44, crease_deg=45).turned("x", -90)


def _add_lights(
    parts: PartList, front: Point, rear: Point, *, lens_m: float = 0.085, spread_m: tuple[float, float] = (0.17, 0.12)
) -> None:
    parts.add("headlight", "lamp/headlight_led", round_lens(lens_m, depth_m=0.02).moved(*front))
    parts.add("taillight", "lamp/tail", lamp_lens(0.16, 0.028).turned("z", 180).moved(rear[0], rear[1], rear[2] + 0.02))
    parts.add("brakelight", "lamp/brake", lamp_lens(0.16, 0.028).turned("z", 180).moved(rear[0], rear[1], rear[2] - 0.014))
    parts.add("lamp_body", "plastic/black", rounded_box((0.07, 0.18, 0.085), 0.02, centre_m=(rear[0] + 0.034, 0.0, rear[2])))
    for name, place, turn, out in (("indicator_front", front, 0.0, spread_m[0]), ("indicator_rear", rear, 180.0, spread_m[1])):
        back = -0.05 if turn == 0.0 else 0.03
        at = (place[0] + back, out, place[2] - 0.02)
        body = rounded_box((0.035, 0.06, 0.035), 0.012, centre_m=at)
        stalk = tube([(at[0], 0.05, at[2]), (at[0], out, at[2])], 0.008, sides=6)
        parts.add_both("lamp_body", "plastic/black", body, stalk)
        shift = 0.018 if turn == 0.0 else -0.018
        parts.add_pair(
            name, "lamp/indicator", lamp_lens(0.05, 0.028, depth_m=0.008).turned("z", turn).moved(at[0] + shift, at[1], at[2])
        )


def _add_plate(parts: PartList, rng: np.random.Generator, place: Point) -> None:
    plate = number_plate(0.20, 0.16).turned("z", 180).turned("y", -18)
    parts.add("plate_rear", "sign/white", plate.moved(*place))
    text = joined([plate_text(rng, height_m=0.038)])
    parts.add("plate_text", "plastic/black", text.scaled(1.0, 0.55, 1.3).turned("z", 180).turned("y", -18).moved(*place))
    parts.add(
        "plate_holder", "plastic/black", box((0.012, 0.205, 0.165), centre_m=(0.0061, 0.0, 0.0)).turned("y", -18).moved(*place)
    )


def _add_handlebar(parts: PartList, x: float, z: float, half: float, back: float) -> None:
    path = _rounded_path(
        [(x, 0.0, z - 0.03), (x + 0.01, 0.45 * half, z - 0.02), (x - 0.2 * back, 0.7 * half, z + 0.02), (x - back, half, z)]
    )
    parts.add_both("handlebar", "metal/aluminium", tube(path, 0.0125, sides=10))
    parts.add_both("grips", "rubber/tyre", tube([path[-4], path[-1] + (path[-1] - path[-2]) * 0.4], 0.018, sides=10))
    stem = tube([(x - 0.02, half * 0.72, z + 0.02), (x + 0.02, half * 0.90, z + 0.10)], 0.006, sides=6)
    mirror = rounded_box((0.03, 0.12, 0.08), 0.014, centre_m=(x + 0.02, half * 0.97, z + 0.13))
    glass = box((0.003, 0.10, 0.062), centre_m=(x + 0.0035, half * 0.97, z + 0.13))
    parts.add_both("mirrors", "plastic/black", stem, mirror)
    parts.add_pair("mirror_glass", "mirror/silver", glass)
    lever = tube([(x - back + 0.06, half - 0.14, z + 0.004), (x - back + 0.075, half - 0.02, z - 0.004)], 0.006, sides=6)
    parts.add_both("handlebar", "metal/aluminium", lever)


def _add_fork(parts: PartList, wheel: Point, top: Point, *, spread: float = 0.095, radius: float = 0.022) -> None:
    start, stop = np.array(wheel), np.array(top)
    middle = start + 0.45 * (stop - start)
    out = np.array([0.0, spread, 0.0])
    parts.add_both("fork_lower", "metal/aluminium", tube([start + out, middle + out], 1.25 * radius, sides=14))
    parts.add_both("fork_upper", "metal/chrome", tube([middle + out, stop + out], radius, sides=14))
    parts.add(
        "fork_bridge",
        "metal/aluminium",
        box((0.07, 2 * spread + 0.06, 0.03), centre_m=[float(v) for v in stop - 0.12 * (stop - start)]),
    )
    parts.add("fork_bridge", "metal/aluminium", box((0.07, 2 * spread + 0.06, 0.03), centre_m=[float(v) for v in stop]))
    parts.add("axles", "metal/steel_brushed", cylinder(0.012, 2 * spread + 0.02, axis="y", sides=10).moved(*wheel))


def _add_engine(parts: PartList, x: float, z: float) -> None:
    """Add crankcase, two leaning cylinders with fins, and exhaust pipes to a silencer."""
    parts.add("engine", "metal/cast_iron", rounded_box((0.42, 0.34, 0.24), 0.06, centre_m=(x, 0.0, z)))
    parts.add_both(
        "engine",
        "metal/cast_iron",
        cylinder(0.10, 0.05, axis="y", sides=24).moved(x + 0.08, 0.185, z),
        cylinder(0.085, 0.05, axis="y", sides=24).moved(x - 0.1, 0.18, z + 0.01),
    )
    block = [rounded_box((0.20, 0.38, 0.010), 0.004, centre_m=(0.0, 0.0, 0.02 + 0.021 * row), steps=1) for row in range(8)]
    block.append(rounded_box((0.16, 0.33, 0.25), 0.02, centre_m=(0.0, 0.0, 0.12), steps=2))
    parts.add("engine", "metal/cast_iron", joined(block).turned("y", 22).moved(x + 0.08, 0.0, z + 0.10))
    for y in (-0.12, -0.04, 0.04, 0.12):
        path = _rounded_path(
            [
                (x + 0.24, y, z + 0.17),
                (x + 0.40, y, z + 0.10),
                (x + 0.34, 0.6 * y - 0.03, z - 0.17),
                (x - 0.1, 0.3 * y - 0.08, z - 0.18),
            ]
        )
        parts.add("exhaust", "metal/chrome", tube(path, 0.02, sides=10))
    pipe = _rounded_path([(x - 0.05, -0.10, z - 0.17), (x - 0.3, -0.16, z - 0.16), (x - 0.42, -0.2, z - 0.04)])
    parts.add("exhaust", "metal/chrome", tube(pipe, 0.028, sides=12))
    can = revolution(
        [(0.0, 0.0), (0.035, 0.0), (0.055, 0.06), (0.055, 0.40), (0.045, 0.44), (0.028, 0.44), (0.028, 0.36), (0.0, 0.36)],
        sides=24,
    )
    parts.add("exhaust", "metal/chrome", can.turned("y", -78).moved(x - 0.40, -0.21, z - 0.05))


def _common(parts: PartList, base: float, radius: float) -> tuple[Point, Point]:
    """Add wheels, swing arm and frame; return the axles."""
    rear, front = (-base / 2, 0.0, radius), (base / 2, 0.0, radius - 0.005)
    _add_road_wheel(parts, "rear", rear[0], (radius, 0.175, 0.222))
    _add_road_wheel(parts, "front", front[0], (radius - 0.005, 0.12, 0.222))
    arm = tube([(rear[0], 0.115, rear[2]), (-0.18, 0.10, 0.42)], [0.026, 0.036], sides=10)
    parts.add_both("swing_arm", "metal/aluminium", arm)
    parts.add("axles", "metal/steel_brushed", cylinder(0.014, 0.25, axis="y", sides=10).moved(*rear))
    frame = _rounded_path([(0.40, 0.03, 0.86), (0.1, 0.15, 0.72), (-0.15, 0.14, 0.62), (-0.2, 0.11, 0.38)])
    parts.add_both(
        "frame", "coating/black", tube(frame, 0.025, sides=10), tube([(-0.12, 0.12, 0.66), (-0.55, 0.10, 0.78)], 0.015, sides=8)
    )
    parts.add("engine", "metal/cast_iron", box((0.16, 0.18, 0.3), centre_m=(-0.2, 0.0, 0.55)))
    return rear, front


def _naked(parts: PartList, paint: str, rng: np.random.Generator) -> dict[str, float | str]:
    rear, front = _common(parts, 1.44, 0.318)
    _add_engine(parts, 0.04, 0.42)
    parts.add(
        "tank",
        paint,
        _blob(
            [
                (-0.14, 0.80, 0.07, 0.05),
                (-0.10, 0.81, 0.12, 0.09),
                (0.08, 0.86, 0.165, 0.125),
                (0.26, 0.88, 0.165, 0.12),
                (0.36, 0.85, 0.10, 0.07),
                (0.385, 0.84, 0.03, 0.02),
            ]
        ),
        paintable=True,
    )
    parts.add(
        "seat",
        "leather/black",
        _blob(
            [
                (-0.66, 0.86, 0.06, 0.03),
                (-0.6, 0.865, 0.11, 0.045),
                (-0.36, 0.83, 0.14, 0.05),
                (-0.14, 0.79, 0.12, 0.06),
                (-0.06, 0.80, 0.07, 0.05),
            ],
            power=3.2,
        ),
    )
    parts.add(
        "tail",
        paint,
        _blob(
            [
                (-0.80, 0.87, 0.04, 0.02),
                (-0.76, 0.865, 0.075, 0.035),
                (-0.5, 0.80, 0.12, 0.045),
                (-0.2, 0.74, 0.12, 0.05),
                (-0.12, 0.72, 0.08, 0.04),
            ]
        ),
        paintable=True,
    )
    _add_fork(parts, front, (front[0] - 0.30, 0.0, 0.93))
    parts.add("fender", paint, mudguard(0.333, 0.13, start_deg=30, stop_deg=150, thick_m=0.008).moved(*front), paintable=True)
    bowl = revolution([(0.0, -0.12), (0.05, -0.11), (0.085, -0.06), (0.095, 0.0), (0.083, 0.002)], sides=24).turned("y", 90)
    parts.add("lamp_body", "plastic/black", bowl.moved(0.551, 0.0, 0.86))
    parts.add("lamp_body", "plastic/black", rounded_box((0.06, 0.14, 0.10), 0.03, centre_m=(0.44, 0.0, 0.99)))
    _add_lights(parts, (0.552, 0.0, 0.86), (-0.82, 0.0, 0.855))
    _add_handlebar(parts, 0.37, 1.03, 0.37, 0.14)
    parts.add("mudguards", "plastic/black", mudguard(0.34, 0.19, start_deg=100, stop_deg=165, thick_m=0.01).moved(*rear))
    parts.add("plate_bracket", "plastic/black", tube([(-0.72, 0.0, 0.82), (-0.90, 0.0, 0.68)], 0.02, sides=8))
    _add_plate(parts, rng, (-0.935, 0.0, 0.66))
    _add_stand(parts)
    return _rider_places(saddle=(-0.30, 0.88), bar=(0.25, 0.33, 1.045), pegs=(-0.16, 0.17, 0.34), base=1.44, radius=0.318)


def _tourer(parts: PartList, paint: str, rng: np.random.Generator) -> dict[str, float | str]:
    rear, front = _common(parts, 1.52, 0.32)
    _add_engine(parts, 0.04, 0.43)
    parts.add(
        "tank",
        paint,
        _blob(
            [
                (-0.14, 0.82, 0.07, 0.05),
                (-0.08, 0.84, 0.13, 0.10),
                (0.10, 0.90, 0.175, 0.14),
                (0.28, 0.92, 0.17, 0.12),
                (0.40, 0.90, 0.10, 0.07),
            ]
        ),
        paintable=True,
    )
    parts.add(
        "seat",
        "leather/black",
        _blob(
            [
                (-0.78, 0.92, 0.07, 0.03),
                (-0.7, 0.925, 0.14, 0.05),
                (-0.44, 0.90, 0.155, 0.055),
                (-0.34, 0.845, 0.155, 0.05),
                (-0.12, 0.82, 0.13, 0.06),
                (-0.04, 0.83, 0.08, 0.05),
            ],
            power=3.2,
        ),
    )
    parts.add(
        "fairing",
        paint,
        _blob(
            [
                (0.24, 0.86, 0.20, 0.20),
                (0.34, 0.86, 0.255, 0.25),
                (0.50, 0.88, 0.25, 0.21),
                (0.66, 0.89, 0.17, 0.13),
                (0.74, 0.88, 0.08, 0.05),
                (0.755, 0.875, 0.02, 0.015),
            ],
            power=2.8,
        ),
        paintable=True,
    )
    panel = [
        (-0.02, 0.50, 0.02, 0.05),
        (0.08, 0.54, 0.03, 0.13),
        (0.28, 0.64, 0.035, 0.20),
        (0.46, 0.76, 0.03, 0.13),
        (0.54, 0.82, 0.01, 0.04),
    ]
    parts.add_both("fairing", paint, _blob(panel, power=3.2).moved(0.0, 0.205, 0.0))
    screen_y = np.linspace(-0.20, 0.20, 11)
    rows = np.linspace(0.0, 1.0, 7)
    grid = np.array(
        [
            [
                (0.56 - 0.22 * t - 1.6 * y * y * (1 - 0.2 * t), y * (1 - 0.25 * t * t), 1.02 + 0.34 * t - 0.6 * y * y)
                for y in screen_y
            ]
            for t in rows
        ]
    )
    parts.add("screen", "glass/tinted", _sheet(grid, 0.005))
    _add_fork(parts, front, (front[0] - 0.30, 0.0, 0.95))
    parts.add("fender", paint, mudguard(0.336, 0.14, start_deg=25, stop_deg=160, thick_m=0.008).moved(*front), paintable=True)
    _add_lights(parts, (0.752, 0.0, 0.875), (-0.90, 0.0, 0.86), lens_m=0.075, spread_m=(0.20, 0.15))
    _add_handlebar(parts, 0.30, 1.08, 0.38, 0.16)
    parts.add_both("cases", paint, rounded_box((0.50, 0.22, 0.36), 0.07, centre_m=(-0.68, 0.30, 0.66)))
    parts.add("cases", paint, rounded_box((0.38, 0.44, 0.30), 0.08, centre_m=(-0.92, 0.0, 1.10)), paintable=True)
    parts.add(
        "carrier",
        "coating/black",
        box((0.34, 0.22, 0.03), centre_m=(-0.85, 0.0, 0.945)),
        box((0.2, 0.18, 0.1), centre_m=(-0.78, 0.0, 0.86)),
    )
    parts.add("plate_bracket", "plastic/black", tube([(-0.78, 0.0, 0.78), (-0.92, 0.0, 0.66)], 0.02, sides=8))
    parts.add("mudguards", "plastic/black", mudguard(0.34, 0.20, start_deg=70, stop_deg=165, thick_m=0.01).moved(*rear))
    _add_plate(parts, rng, (-0.965, 0.0, 0.63))
    _add_stand(parts)
    return _rider_places(saddle=(-0.22, 0.90), bar=(0.17, 0.34, 1.095), pegs=(-0.10, 0.19, 0.34), base=1.52, radius=0.32)


def _scooter(parts: PartList, paint: str, rng: np.random.Generator) -> dict[str, float | str]:
    base, radius = 1.30, 0.24
    rear, front = (-base / 2, 0.0, radius), (base / 2, 0.0, radius)
    _add_road_wheel(parts, "rear", rear[0], (radius, 0.13, 0.16), discs=False)
    _add_road_wheel(parts, "front", front[0], (radius, 0.11, 0.16), discs=False)
    parts.add(
        "body",
        paint,
        _blob(
            [
                (-0.96, 0.76, 0.03, 0.02),
                (-0.93, 0.74, 0.09, 0.06),
                (-0.72, 0.66, 0.175, 0.125),
                (-0.45, 0.60, 0.19, 0.15),
                (-0.22, 0.50, 0.17, 0.20),
                (-0.10, 0.42, 0.12, 0.14),
                (-0.06, 0.40, 0.05, 0.06),
            ],
            power=2.8,
        ),
        paintable=True,
    )
    parts.add("floor", "plastic/black", rounded_box((0.62, 0.36, 0.10), 0.04, centre_m=(0.08, 0.0, 0.29)))
    shield_rows = []
    for share in np.linspace(0.0, 1.0, 9):
        x, z = 0.34 + 0.16 * np.sin(share * 1.5) - 0.10 * share, 0.28 + 0.62 * share
        half = 0.20 + 0.03 * np.sin(np.pi * share) - 0.07 * share**2
        shield_rows.append([(x + 0.10 - 1.9 * y * y - 0.02, y, z) for y in np.linspace(-half, half, 15)])
    parts.add("shield", paint, _sheet(np.array(shield_rows), 0.05), paintable=True)
    parts.add(
        "fender",
        paint,
        _blob(
            [
                (0.40, 0.42, 0.05, 0.05),
                (0.48, 0.45, 0.085, 0.07),
                (0.65, 0.49, 0.09, 0.05),
                (0.82, 0.44, 0.075, 0.05),
                (0.92, 0.36, 0.03, 0.03),
            ],
            power=2.4,
        ),
        paintable=True,
    )
    parts.add(
        "seat",
        "leather/black",
        _blob(
            [
                (-0.84, 0.83, 0.05, 0.02),
                (-0.78, 0.835, 0.12, 0.05),
                (-0.5, 0.80, 0.155, 0.07),
                (-0.3, 0.765, 0.145, 0.07),
                (-0.17, 0.75, 0.09, 0.05),
                (-0.14, 0.745, 0.04, 0.02),
            ],
            power=3.2,
        ),
    )
    parts.add(
        "column",
        paint,
        _blob(
            [
                (0.27, 0.98, 0.05, 0.03),
                (0.32, 0.99, 0.13, 0.06),
                (0.40, 1.0, 0.14, 0.08),
                (0.46, 0.99, 0.10, 0.07),
                (0.475, 0.99, 0.05, 0.04),
            ],
            power=2.6,
        ),
        paintable=True,
    )
    parts.add("column", paint, tube([(0.42, 0.0, 0.7), (0.37, 0.0, 1.0)], 0.05, sides=16))
    _add_fork(parts, front, (0.47, 0.0, 0.66), spread=0.075, radius=0.018)
    _add_lights(parts, (0.475, 0.0, 0.99), (-0.965, 0.0, 0.73), lens_m=0.06, spread_m=(0.18, 0.14))
    _add_handlebar(parts, 0.36, 1.04, 0.34, 0.10)
    parts.add("engine", "metal/cast_iron", rounded_box((0.5, 0.16, 0.22), 0.06, centre_m=(-0.48, 0.14, 0.27)))
    parts.add("engine", "metal/cast_iron", box((0.4, 0.3, 0.2), centre_m=(-0.36, 0.0, 0.38)))
    can = rounded_box((0.46, 0.12, 0.13), 0.055, centre_m=(-0.68, -0.19, 0.30))
    parts.add("exhaust", "metal/steel_brushed", can)
    parts.add("plate_bracket", "plastic/black", box((0.14, 0.12, 0.2), centre_m=(-0.90, 0.0, 0.62)))
    _add_plate(parts, rng, (-0.995, 0.0, 0.55))
    _add_stand(parts)
    return _rider_places(saddle=(-0.36, 0.84), bar=(0.27, 0.30, 1.055), pegs=(0.12, 0.12, 0.345), base=base, radius=radius)


def _sheet(grid: NDArray[np.float64], thick_m: float) -> Shape:
    """Return a (rows, cols, 3) grid (rows up, columns to +y) as a closed sheet of some thickness along x."""
    rows, cols = grid.shape[:2]
    front, back = grid.reshape(-1, 3), grid.reshape(-1, 3) - np.array([thick_m, 0.0, 0.0])
    index = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
    ahead = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    edge = np.concatenate([index[0], index[1:, -1], index[-1, -2::-1], index[-2:0:-1, 0]])
    nxt = np.roll(edge, -1)
    count = rows * cols
    rim = np.concatenate([np.stack([edge, edge + count, nxt + count], axis=1), np.stack([edge, nxt + count, nxt], axis=1)])
    return Shape(np.concatenate([front, back]), np.concatenate([ahead, ahead[:, ::-1] + count, rim])).smooth(50)


def _add_stand(parts: PartList) -> None:
    parts.add("stand", "coating/black", tube([(-0.08, 0.10, 0.30), (-0.16, 0.24, 0.010)], 0.011, sides=8))


def _rider_places(
    *, saddle: tuple[float, float], bar: Point, pegs: Point, base: float, radius: float
) -> dict[str, float | str]:
    """Return where a rider sits, holds and stands, as attributes."""
    places = {"saddle": (saddle[0], 0.0, saddle[1])}
    for side, sign in (("left", 1), ("right", -1)):
        places[f"grip_{side}"] = (bar[0], sign * bar[1], bar[2])
        places[f"peg_{side}"] = (pegs[0], sign * pegs[1], pegs[2])
    flat: dict[str, float | str] = {
        f"{name}_{axis}_m": place[i] for name, place in places.items() for i, axis in enumerate("xyz")
    }
    return flat | {"wheelbase_m": base, "wheel_radius_m": radius}
