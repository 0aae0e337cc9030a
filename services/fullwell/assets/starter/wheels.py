"""Wheels of vehicles: tyres with grooved treads, rims, brakes. Axle along y, outer side towards +y, centre at the origin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fullwell.assets.starter.shapes import Shape, box, cylinder, joined, loft, revolution, tube

__all__ = ["RimStyle", "WheelParts", "car_wheel", "heavy_wheel", "spoked_wheel"]

RimStyle = Literal["five", "double", "ten", "turbine", "steel"]


@dataclass(frozen=True, slots=True, eq=False)
class WheelParts:
    """A wheel: tyre, rim with hub, and what is dark behind the spokes (brake disc, barrel)."""

    tyre: Shape
    rim: Shape
    brake: Shape

    def placed(self, x_m: float, y_m: float, z_m: float) -> WheelParts:
        """Return it at a place."""
        return WheelParts(*(part.moved(x_m, y_m, z_m) for part in (self.tyre, self.rim, self.brake)))

    def mirrored(self) -> WheelParts:
        """Return it on the other side."""
        return WheelParts(*(part.mirrored() for part in (self.tyre, self.rim, self.brake)))


def car_wheel(radius_m: float, width_m: float, rim_radius_m: float, style: RimStyle, *, sides: int = 36) -> WheelParts:
    """Return a car's wheel; sizes as on its tyre: 205/55 R16 is 0.316, 0.205 and 0.203 + 0.012 (with the rim's flange)."""
    half = width_m / 2
    rim = [_lip(rim_radius_m, half, sides)]
    if style == "steel":
        rim.append(_cover(rim_radius_m, half, sides))
    else:
        rim.append(_spokes(rim_radius_m, half, style))
    hub = revolution([(0.062, 0.05 * half), (0.062, 0.56 * half), (0.05, 0.64 * half), (0.0, 0.66 * half)], sides=20)
    rim.append(_across(hub))
    disc = 0.74 * rim_radius_m
    brake = [
        # The barrel behind the spokes, open to the outside, and the wheel's inner side.
        revolution([(rim_radius_m - 0.008, 0.62 * half), (rim_radius_m - 0.02, -0.2 * half), (0.0, -0.2 * half)], sides=sides),
        revolution([(0.0, -0.84 * half), (rim_radius_m + 0.004, -0.84 * half)], sides=sides),
        revolution([(disc, -0.1 * half), (disc, 0.0), (0.0, 0.0)], sides=sides),
        box((0.06, 0.11, 0.2 * half), centre_m=(0.8 * disc, 0.0, 0.06 * half)),
    ]
    return WheelParts(_across(_tyre(radius_m, half, rim_radius_m, sides)), joined(rim), _across(joined(brake)))


def heavy_wheel(radius_m: float = 0.5, width_m: float = 0.3, *, outward: bool = True, sides: int = 40) -> WheelParts:
    """Return a wheel of a lorry or bus: a ten-stud steel disc, bulging out (steered) or in (driven)."""
    half, rim = width_m / 2, 0.6 * radius_m
    face = 0.75 * half if outward else -0.1 * half
    dish = [(rim + 0.012, 0.86 * half), (rim - 0.012, 0.8 * half), (rim - 0.03, face - 0.05), (0.8 * rim, face - 0.02)]
    dish += [
        (0.62 * rim, face),
        (0.5 * rim, face),
        (0.47 * rim, face + 0.03),
        (0.36 * rim, face + 0.05),
        (0.34 * rim, face + 0.07),
    ]
    dish += [(0.28 * rim, face + 0.09), (0.0, face + 0.095)]
    parts = [_across(revolution(dish, sides=sides, crease_deg=30))]
    for angle in np.arange(10) * 36.0:
        nut = cylinder(0.016, 0.03, sides=6, axis="y").moved(0.55 * rim, face + 0.012, 0.0)
        parts.append(nut.turned("y", float(angle)))
    holes = [
        cylinder(0.03, 0.006, sides=12, axis="y")
        .turned("z", -8)
        .moved(0.73 * rim, face - 0.011, 0.0)
        .turned("y", 18 + float(angle))
        for angle in np.arange(10) * 36.0
    ]
    inner = _across(revolution([(0.0, -0.84 * half), (rim + 0.01, -0.84 * half)], sides=sides))
    return WheelParts(_across(_tyre(radius_m, half, rim, sides, grooves=4)), joined(parts), joined([*holes, inner]))


def spoked_wheel(
    radius_m: float, tyre_radius_m: float, *, spokes: int = 28, hub_half_width_m: float = 0.03, rim_depth_m: float = 0.018
) -> WheelParts:
    """Return a bicycle's wheel: round tyre, rim, crossed steel spokes and hub. `brake` holds the spokes."""
    angle = np.linspace(0.0, 2 * np.pi, 13)
    middle = radius_m - tyre_radius_m
    section = np.column_stack([middle + tyre_radius_m * np.cos(angle - np.pi), tyre_radius_m * np.sin(angle - np.pi)])
    tyre = revolution(section, sides=56, crease_deg=80)
    rim_out, width = middle - 0.75 * tyre_radius_m, 0.62 * tyre_radius_m
    ring = [(rim_out - rim_depth_m, 0.0), (rim_out - 0.8 * rim_depth_m, -width), (rim_out + 0.006, -width)]
    ring += [(rim_out + 0.006, width), (rim_out - 0.8 * rim_depth_m, width), (rim_out - rim_depth_m, 0.0)]
    rim = [_across(revolution(ring, sides=56)), cylinder(0.019, 2 * hub_half_width_m, sides=12, axis="y")]
    rim += [cylinder(0.028, 0.004, sides=14, axis="y").moved(0.0, side * hub_half_width_m * 0.8, 0.0) for side in (-1.0, 1.0)]
    wires = []
    for number in range(spokes):
        at = 2 * np.pi * number / spokes
        side = 1.0 if number % 2 else -1.0
        lean = at + (0.9 if number % 4 < 2 else -0.9)
        start = np.array([0.026 * np.cos(lean), side * hub_half_width_m * 0.8, 0.026 * np.sin(lean)])
        stop = np.array([(rim_out - rim_depth_m) * np.cos(at), 0.0, (rim_out - rim_depth_m) * np.sin(at)])
        wires.append(tube([start, stop], 0.0012, sides=3, caps=False))
    return WheelParts(_across(tyre), joined(rim), joined(wires))


def _across(about_z: Shape) -> Shape:
    """Turn a shape made about z so that its top faces +y."""
    return about_z.turned("x", -90)


def _tyre(radius_m: float, half: float, rim_radius_m: float, sides: int, *, grooves: int = 2) -> Shape:
    wall = radius_m - rim_radius_m
    side = [
        (rim_radius_m - 0.004, 0.84),
        (rim_radius_m + 0.10 * wall, 0.93),
        (rim_radius_m + 0.38 * wall, 1.0),
        (rim_radius_m + 0.62 * wall, 0.985),
        (radius_m - 0.16 * wall, 0.93),
        (radius_m - 0.06 * wall, 0.86),
        (radius_m - 0.012 * wall, 0.76),
    ]
    profile = [(r, -w * half) for r, w in side]
    for groove in np.linspace(-0.48, 0.48, grooves):
        depth, broad = 0.007, 0.05
        low, high = (groove - broad) * half, (groove + broad) * half
        profile += [(radius_m, low), (radius_m - depth, low + 0.001), (radius_m - depth, high - 0.001), (radius_m, high)]
    profile += [(r, w * half) for r, w in reversed(side)]
    return revolution(profile, sides=sides, crease_deg=38)


def _lip(rim_radius_m: float, half: float, sides: int) -> Shape:
    profile = [(rim_radius_m + 0.001, 0.83 * half), (rim_radius_m + 0.004, 0.88 * half), (rim_radius_m - 0.004, 0.885 * half)]
    profile += [(rim_radius_m - 0.016, 0.8 * half), (rim_radius_m - 0.018, 0.6 * half), (rim_radius_m - 0.008, 0.6 * half)]
    return _across(revolution(profile, sides=sides, crease_deg=50))


def _spokes(rim_radius_m: float, half: float, style: RimStyle) -> Shape:
    count, inner, outer, twist, pair = {
        "five": (5, 0.052, 0.040, 0.0, 0.0),
        "double": (5, 0.020, 0.017, 0.0, 0.20),
        "ten": (10, 0.022, 0.017, 0.0, 0.0),
        "turbine": (9, 0.026, 0.022, 0.42, 0.0),
    }[style]
    parts = []
    for number in range(count):
        at = 2 * np.pi * number / count + np.pi / 2
        for off in (-pair, pair) if pair else (0.0,):
            parts.append(_spoke(rim_radius_m, half, at, off=off, broad_m=(inner, outer), twist=twist))
    return joined(parts)


def _spoke(rim_radius_m: float, half: float, at: float, *, off: float, broad_m: tuple[float, float], twist: float) -> Shape:
    """Return one spoke: a bevelled bar from hub to rim, bowed inwards between."""
    rings = []
    for share in np.linspace(0.0, 1.0, 5):
        radius = 0.05 + share * (rim_radius_m - 0.012 - 0.05)
        angle = at + off * (0.35 + 0.65 * share) + twist * share**1.5
        broad = broad_m[0] + (broad_m[1] - broad_m[0]) * share
        front = (0.56 - 0.14 * np.sin(np.pi * share) + 0.20 * share) * half
        back = front - 0.022
        radial = np.array([np.cos(angle), 0.0, np.sin(angle)])
        along = np.array([-np.sin(angle), 0.0, np.cos(angle)])
        up = np.array([0.0, 1.0, 0.0])
        corners = [(-broad, back), (-broad, front - 0.007), (-0.7 * broad, front), (0.7 * broad, front), (broad, front - 0.007)]
        corners.append((broad, back))
        rings.append([radius * radial + a * along + u * up for a, u in corners])
    return loft(rings).smooth(30)


def _cover(rim_radius_m: float, half: float, sides: int) -> Shape:
    """Return a domed wheel cover with slots."""
    profile = [(rim_radius_m - 0.014, 0.6 * half), (rim_radius_m - 0.014, 0.78 * half), (0.8 * rim_radius_m, 0.86 * half)]
    profile += [(0.5 * rim_radius_m, 0.74 * half), (0.25 * rim_radius_m, 0.72 * half), (0.0, 0.72 * half)]
    slots = 12
    dome = revolution(profile, sides=slots * 4, crease_deg=45)
    corners = dome.vertices_m[dome.faces]
    middle = corners.mean(axis=1)
    radius = np.hypot(middle[:, 0], middle[:, 1])
    turn = (np.arctan2(middle[:, 1], middle[:, 0]) / (2 * np.pi / slots)) % 1.0
    # One of four sectors is left open between two radii: one looks through to the dark barrel.
    band = (radius > 0.5 * rim_radius_m) & (radius < 0.8 * rim_radius_m) & (middle[:, 2] > 0.7 * half)
    hole = band & (turn < 0.25)
    return _across(Shape(dome.vertices_m, dome.faces[~hole], dome.normals))
