"""Lorries, trailers, buses and trams."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.lofts import Field, Panels, Patch, below, beyond, inset, intersection, opposite, surface_at
from fullwell.assets.starter.shapes import Shape, box, cylinder, joined, tube
from fullwell.assets.starter.vehicle_coach import (
    add_rear_lamps,
    box_skin,
    circle,
    corrugated_box,
    cut_well,
    drum,
    front_view,
    heavy_mirror,
    mudguard,
    side_view,
    under_run_bar,
)
from fullwell.assets.starter.vehicle_fittings import (
    number_plate,
    plate_text,
    rounded_box,
    segment_text,
    wiper,
)
from fullwell.assets.starter.vehicle_parts import LAMP_MATERIALS, PartList
from fullwell.assets.starter.wheels import car_wheel, heavy_wheel

__all__ = ["BusSpec", "LorrySpec", "bus", "caravan", "cargo_trailer", "lorry", "semi_trailer", "tram"]

_BODY_MATERIALS = {
    "underside": "plastic/black",
    "wheel_well": "plastic/black",
    "trim": "plastic/black",
    "seams": "plastic/black",
    "window_seal": "plastic/black",
    "window_windscreen": "glass/tinted",
    "window_side": "glass/tinted",
    "window_rear": "glass/tinted",
    "window_door": "glass/tinted",
    "door_frame": "plastic/black",
    "display": "plastic/black",
    "grille": "plastic/black",
    "grille_bars": "plastic/black",
    "lamp_housing": "plastic/black",
    "pillars": "paint/black",
}


# --- buses --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class BusSpec:
    """A bus. Distances from the front d and heights z [m].

    Attributes
    ----------
    axles_d_m
        d of the axles.
    rows_m
        (low, high) of each row of side windows.
    windscreens_m
        (low, high) of each pane in front.
    doors_d_m
        (from, to) of the doors, on the right.
    skirt
        Paint of the lower part; empty: as the body.
    """

    tags: tuple[str, ...]
    length_m: float
    height_m: float
    axles_d_m: tuple[float, ...]
    rows_m: tuple[tuple[float, float], ...]
    windscreens_m: tuple[tuple[float, float], ...]
    doors_d_m: tuple[tuple[float, float], ...]
    paint: str = "paint/red"
    skirt: str = ""
    skirt_z_m: float = 0.9
    display_m: tuple[float, float] = (2.6, 2.86)
    route: str = "18"
    pane_m: float = 1.45
    roof_units: bool = True
    width_m: float = 2.55
    wheel_radius_m: float = 0.48


def bus(rng: np.random.Generator, *, spec: BusSpec) -> BuiltAsset:
    """Return a bus with its doors on the right. The seed makes up the characters on its plates."""
    parts = PartList()
    materials = _BODY_MATERIALS | {"body": spec.paint, "skirt": spec.skirt or spec.paint, "tail_housing": "plastic/black"}
    left, right = _bus_half(spec, doors=False), _bus_half(spec, doors=True)
    _add_halves(parts, left, right, materials)
    wheel = heavy_wheel(spec.wheel_radius_m, 0.29)
    for place, d in zip(("front", "rear", "tag"), spec.axles_d_m, strict=False):
        parts.add_wheel(
            place, wheel.placed(-d, spec.width_m / 2 - 0.05 - 0.145, spec.wheel_radius_m), rim_material="metal/aluminium"
        )
    skin = box_skin((-spec.length_m, 0.0), spec.width_m, (0.28, spec.height_m)).patches["body"]
    _bus_front(spec, parts, rng, skin)
    if spec.roof_units:
        for d, long in ((0.30 * spec.length_m, 2.2), (0.66 * spec.length_m, 1.8)):
            unit = rounded_box((long, 1.5, 0.22), 0.08, centre_m=(-d, 0.0, spec.height_m + 0.03))
            parts.add("roof_units", "coating/white", unit)
    attributes: dict[str, float | str] = {
        "front_overhang_m": spec.axles_d_m[0],
        "wheelbase_m": spec.axles_d_m[1] - spec.axles_d_m[0],
        "wheel_radius_m": spec.wheel_radius_m,
        "track_m": spec.width_m - 0.39,
        "body_width_m": spec.width_m,
        "driver_eye_x_m": spec.length_m / 2 - 0.75,
        "driver_eye_y_m": 0.6,
        "driver_eye_z_m": spec.windscreens_m[0][0] + 0.85,
    }
    return parts.built("bus", spec.tags, attributes, shift_x_m=spec.length_m / 2)


def _add_halves(parts: PartList, left: Panels, right: Panels, materials: dict[str, str]) -> None:
    """Add two different halves, the right one made as a left one."""
    for panels, word in ((left, "left"), (right, "right")):
        for name in panels.names():
            half = panels.left(name)
            if half is None:
                continue
            shape = half if word == "left" else half.mirrored()
            if name in LAMP_MATERIALS:
                parts.add(f"{name}_{word}", LAMP_MATERIALS[name], shape)
            elif name == "window_side":
                parts.add(f"{name}_{word}", materials[name], shape)
            else:
                parts.add(name, materials[name], shape, paintable=name == "body")


def _bus_half(spec: BusSpec, *, doors: bool) -> Panels:
    length, half = spec.length_m, spec.width_m / 2
    panels = box_skin((-length, 0.0), spec.width_m, (0.28, spec.height_m))
    for d in spec.axles_d_m:
        cut_well(panels, -d, spec.wheel_radius_m, spec.wheel_radius_m + 0.07, inner_y_m=half - 0.5, floor_m=0.28)
    panels.cut("body", "trim", below("z", 0.36), edge_m=0.1)
    limit = half - 0.2
    for number, (low, high) in enumerate(spec.windscreens_m):
        pane = front_view(half - 0.10, (low, high), before_x_m=-0.55, radius_m=0.12)
        panels.cut("body", "window_seal", pane, edge_m=0.05)
        panels.cut("window_seal", "window_windscreen", inset(pane, 0.03), edge_m=0.08)
        rear = front_view(half - 0.28, (max(low, 1.5) + 0.1, high - 0.15), before_x_m=0.4 - length, front=False, radius_m=0.1)
        if number == 0 or number == len(spec.windscreens_m) - 1:
            panels.cut("body", "window_rear", rear, edge_m=0.05)
    if doors:
        _cut_bus_doors(spec, panels)
    for low, high in spec.rows_m:
        row = side_view((-length + 0.55, -0.75), (low, high), y_m=limit, radius_m=0.09)
        panels.cut("body", "window_side", row, edge_m=0.05, depth_m=0.006, wall="window_seal")
        count = round((length - 1.3) / spec.pane_m)
        for number in range(1, count):
            at = -0.75 - number * (length - 1.3) / count
            panels.strip("window_side", "pillars", below("x", at), half_width_m=0.035)
    if spec.skirt:
        panels.cut("body", "skirt", below("z", spec.skirt_z_m), edge_m=0.1)
    panels.cut("body", "display", front_view(0.85, spec.display_m, before_x_m=-0.7, radius_m=0.04), edge_m=0.06)
    _cut_bus_lamps(spec, panels)
    return panels


def _cut_bus_doors(spec: BusSpec, panels: Panels) -> None:
    low, high = 0.33, min(spec.rows_m[0][1] + 0.05, 2.45)
    for start, stop in spec.doors_d_m:
        frame = side_view((-stop, -start), (low, high), y_m=spec.width_m / 2 - 0.25, radius_m=0.06)
        for name in ("body", "trim"):
            panels.cut(name, "door_frame", frame, edge_m=0.05, depth_m=0.02, wall="window_seal")
        middle = (start + stop) / 2
        for first, second in ((start, middle), (middle, stop)):
            pane = side_view(
                (-second + 0.05, -first - 0.05), (low + 0.12, high - 0.08), y_m=spec.width_m / 2 - 0.3, radius_m=0.06
            )
            panels.cut("door_frame", "window_door", pane, edge_m=0.05)


def _cut_bus_lamps(spec: BusSpec, panels: Panels) -> None:
    half = spec.width_m / 2

    def region(field_: Field, start: float, stop: float, low: float, high: float) -> Field:
        return intersection(
            (lambda patch: start - field_(patch), lambda patch: field_(patch) - stop, beyond("z", low), below("z", high)),
            radius_m=0.03,
        )

    front: Field = lambda patch: patch.front_arc_m  # noqa: E731
    rear: Field = lambda patch: patch.rear_arc_m  # noqa: E731
    for name in ("body", "skirt"):
        panels.cut(
            name, "lamp_housing", region(front, half - 0.52, half + 0.02, 0.58, 0.82), edge_m=0.03, depth_m=0.006, wall="trim"
        )
    for name, start, stop, low, high in (
        ("headlight", half - 0.48, half - 0.32, 0.62, 0.77),
        ("headlight", half - 0.29, half - 0.13, 0.62, 0.77),
        ("indicator_front", half - 0.10, half - 0.02, 0.62, 0.77),
        ("drl", half - 0.48, half - 0.13, 0.785, 0.805),
    ):
        panels.cut("lamp_housing", name, region(front, start, stop, low, high), edge_m=0.02, depth_m=-0.004)
    for name in ("body", "skirt"):
        panels.cut(
            name, "tail_housing", region(rear, half - 0.24, half - 0.04, 0.62, 1.42), edge_m=0.03, depth_m=-0.003, wall="trim"
        )
    for number, name in enumerate(("reverselight", "indicator_rear", "taillight", "brakelight")):
        low = 0.64 + 0.195 * number
        panels.cut("tail_housing", name, region(rear, half - 0.22, half - 0.06, low, low + 0.17), edge_m=0.02, depth_m=-0.004)


def _bus_front(spec: BusSpec, parts: PartList, rng: np.random.Generator, skin: Sequence[Patch]) -> None:
    text = plate_text(rng)
    for name, z, last, turn in (("front", 0.46, True, 0.0), ("rear", 0.56, False, 180.0)):
        x = surface_at(skin, "x", 0.0, z, last=last) + (0.012 if last else -0.012)
        parts.add(f"plate_{name}", "sign/white", number_plate().turned("z", turn).moved(x, 0.0, z))
        parts.add("plate_text", "plastic/black", text.turned("z", turn).moved(x, 0.0, z))
        holder = box((0.04, 0.54, 0.13), centre_m=(-0.0205, 0.0, 0.0)).turned("z", turn).moved(x, 0.0, z)
        parts.add("plate_holders", "plastic/black", holder)
    low, high = spec.display_m
    z = (low + high) / 2
    slope = (surface_at(skin, "x", 0.0, high) - surface_at(skin, "x", 0.0, low)) / (high - low)
    route = segment_text(spec.route, 0.7 * (high - low)).turned("y", float(np.rad2deg(np.arctan(slope))))
    parts.add("display_text", "plastic/orange", route.moved(surface_at(skin, "x", 0.05, z) + 0.012, 0.0, z))
    z = spec.windscreens_m[0][1] - 0.35
    housing, arm, glass = (shape.moved(-0.10, spec.width_m / 2 - 0.23, z) for shape in heavy_mirror(0.4))
    parts.add_both("mirrors", "plastic/black", housing, arm)
    parts.add_pair("mirror_glass", "mirror/silver", glass)
    base = spec.windscreens_m[0][0]
    points = [
        (surface_at(skin, "x", y, base + lift) + 0.02, y, base + lift) for y, lift in ((0.15, 0.03), (0.55, 0.1), (0.95, 0.3))
    ]
    parts.add_both("wipers", "plastic/black", wiper(points[0], points[1]), wiper(points[1], points[2]))


# --- trams --------------------------------------------------------------------------------------------------


def tram(
    rng: np.random.Generator, *, paint: str = "paint/red", band: str = "paint/white", length_m: float = 30.0, route: str = "4"
) -> BuiltAsset:
    """Return a low-floor tram of five articulated modules, 2.4 m wide, its pantograph up."""
    parts = PartList()
    width, low, high, gap = 2.40, 0.22, 3.30, 0.55
    ends, middles = 0.235 * length_m, (length_m - 2 * 0.235 * length_m - 4 * gap) / 3
    spans = []
    x = 0.0
    for long in (ends, middles, middles, middles, ends):
        spans.append((x - long, x))
        x -= long + gap
    materials = _BODY_MATERIALS | {"body": paint, "skirt": band, "tail_housing": "plastic/black"}
    for number, span in enumerate(spans):
        half = _tram_half(span, width, (low, high), cab=number in (0, 4))
        for name in half.names():
            shape = half.left(name)
            if shape is None:
                continue
            last = number == len(spans) - 1
            if last:  # the last module is the first one turned round
                shape = _turned_about(shape, sum(span) / 2)
            unlit = _TRAM_UNLIT[last].get(name)
            if unlit:
                parts.add_both(f"unlit_{unlit.removeprefix('plastic/')}", unlit, shape)
            else:
                lamp = "indicator_rear" if last and name == "indicator_front" else name
                _add_tram_part(parts, lamp, shape, materials)
    for first, second in pairwise(spans):
        _add_bellows(parts, (second[1], first[0]), width, (low + 0.1, high - 0.12))
    _add_tram_bogies(parts, spans, width)
    _add_tram_roof(parts, spans, high)
    skin = box_skin(spans[0], width, (low, high), **_TRAM_NOSE).patches["body"]  # type: ignore[arg-type]
    text = segment_text(route, 0.2)
    at = surface_at(skin, "x", 0.0, 2.78) + 0.03
    parts.add(
        "display_text", "plastic/orange", text.moved(at, 0.0, 2.78), text.turned("z", 180).moved(-length_m - at, 0.0, 2.78)
    )
    _ = rng
    attributes: dict[str, float | str] = {
        "front_overhang_m": ends / 2,
        "wheelbase_m": 1.8,
        "wheel_radius_m": 0.3,
        "track_m": 1.435,
        "body_width_m": width,
        "driver_eye_x_m": length_m / 2 - 1.3,
        "driver_eye_y_m": 0.0,
        "driver_eye_z_m": 2.1,
    }
    return parts.built("tram", ("tram", "low-floor", "articulated", "modern"), attributes, shift_x_m=length_m / 2)


_TRAM_NOSE = {
    "powers": (4.5, 30.0),
    "nose": (0.35, 0.12, 0.0, 0.28, 0.72, 0.98, 1.14, 1.32),
    "stern": (0.01, 0.0, 0.0, 0.0, 0.0, 0.01, 0.02, 0.05),
    "columns": 84,
}


_TRAM_UNLIT: dict[bool, dict[str, str]] = {
    False: {"taillight": "plastic/red", "brakelight": "plastic/red"},
    True: {"headlight": "plastic/white", "drl": "plastic/white"},
}
"""Lamps that are dark at the front, and at the rear (True): a tram drives either way and has all of them at both ends."""


def _turned_about(shape: Shape, middle_x_m: float) -> Shape:
    """Return a left half turned by half a turn about the vertical and mirrored back to the left."""
    return shape.moved(-middle_x_m).turned("z", 180).mirrored().moved(middle_x_m)


def _add_tram_part(parts: PartList, name: str, half: Shape, materials: dict[str, str]) -> None:
    if name in LAMP_MATERIALS:
        parts.add_pair(name, LAMP_MATERIALS[name], half)
    elif name == "window_side":
        parts.add_pair(name, materials[name], half)
    else:
        parts.add_both(name, materials[name], half, paintable=name == "body")


def _tram_half(span: tuple[float, float], width: float, heights: tuple[float, float], *, cab: bool) -> Panels:
    rear, front = span
    long = front - rear
    if cab:
        panels = box_skin(span, width, heights, **_TRAM_NOSE)  # type: ignore[arg-type]
        screen = front_view(width / 2 - 0.13, (1.25, 2.60), before_x_m=front - 1.6, radius_m=0.15)
        panels.cut("body", "window_seal", screen, edge_m=0.05)
        panels.cut("window_seal", "window_windscreen", inset(screen, 0.03), edge_m=0.08)
        panels.cut("body", "display", front_view(0.6, (2.63, 2.93), before_x_m=front - 1.6, radius_m=0.05), edge_m=0.06)
        windows = (rear + 0.25, front - 1.75)
    else:
        flat = (0.01, 0.0, 0.0, 0.0, 0.0, 0.01, 0.02, 0.05)
        panels = box_skin(span, width, heights, powers=(30.0, 30.0), nose=flat, stern=flat, columns=64)
        windows = (rear + 0.25, front - 0.25)
    limit = width / 2 - 0.2
    doors = (rear + 0.62 * long, rear + 0.36 * long) if cab else (rear + 0.5 * long,)
    for centre in doors:
        frame = side_view((centre - 0.66, centre + 0.66), (0.30, 2.42), y_m=limit, radius_m=0.05)
        panels.cut("body", "door_frame", frame, edge_m=0.06, depth_m=0.012, wall="window_seal")
        for side in (-1, 1):
            pane = side_view((centre + side * 0.05, centre + side * 0.6), (0.5, 2.32), y_m=limit, radius_m=0.08)
            panels.cut("door_frame", "window_door", pane, edge_m=0.06)
    row = side_view(windows, (1.05, 2.42), y_m=limit, radius_m=0.12)
    panels.cut("body", "window_side", row, edge_m=0.06, depth_m=0.005, wall="window_seal")
    panels.cut("body", "skirt", below("z", 0.95), edge_m=0.15)
    if cab:
        _cut_tram_lamps(panels, width)
    return panels


def _cut_tram_lamps(panels: Panels, width: float) -> None:
    def region(start: float, stop: float, low: float, high: float) -> Field:
        return intersection(
            (
                lambda patch: start - patch.front_arc_m,
                lambda patch: patch.front_arc_m - stop,
                beyond("z", low),
                below("z", high),
            ),
            radius_m=0.03,
        )

    for name in ("body", "skirt"):
        panels.cut(name, "lamp_housing", region(0.5, 1.1, 0.76, 0.92), edge_m=0.03, depth_m=0.006, wall="trim")
    lamps = (("headlight", 0.54, 0.68), ("drl", 0.70, 0.76), ("indicator_front", 0.95, 1.06), ("taillight", 0.78, 0.85))
    for name, start, stop in (*lamps, ("brakelight", 0.86, 0.93)):
        panels.cut("lamp_housing", name, region(start, stop, 0.785, 0.895), edge_m=0.02, depth_m=-0.004)
    _ = width


def _add_bellows(parts: PartList, span: tuple[float, float], width: float, heights: tuple[float, float]) -> None:
    """Add folds between two modules: rings in turn wide and narrow."""
    folds = np.linspace(span[0] - 0.05, span[1] + 0.05, 13)
    for number in range(0, 12, 1):
        inset = 0.06 if number % 2 else 0.11
        size = (folds[number + 1] - folds[number], width - 2 * inset, heights[1] - heights[0] - 2 * inset)
        centre = ((folds[number] + folds[number + 1]) / 2, 0.0, sum(heights) / 2)
        parts.add("bellows", "rubber/tyre", box([float(v) for v in size], centre_m=[float(v) for v in centre]))


def _add_tram_bogies(parts: PartList, spans: list[tuple[float, float]], width: float) -> None:
    for number in (0, 2, 4):
        middle = sum(spans[number]) / 2
        if number == 2:
            middle = sum(spans[2]) / 2
        for off in (-0.9, 0.9):
            wheel = cylinder(0.3, 0.12, sides=32, axis="y").moved(middle + off, 0.72, 0.3)
            parts.add_both("wheels", "metal/cast_iron", wheel)
        parts.add("bogies", "plastic/black", box((2.8, width - 0.7, 0.2), centre_m=(middle, 0.0, 0.24)))


def _add_tram_roof(parts: PartList, spans: list[tuple[float, float]], high: float) -> None:
    for number, (rear, front) in enumerate(spans):
        long = front - rear
        shift = -0.5 if number == 0 else (0.5 if number == 4 else 0.0)
        unit = rounded_box((0.6 * long, 1.5, 0.30), 0.05, centre_m=((rear + front) / 2 + shift, 0.0, high + 0.06))
        parts.add("roof_units", "coating/grey", unit)
    at = sum(spans[2]) / 2
    base = high + 0.21
    parts.add_both("pantograph", "metal/steel_galvanised", tube([(at - 0.7, 0.3, base), (at + 0.6, 0.25, base + 0.45)], 0.02))
    parts.add_both(
        "pantograph", "metal/steel_galvanised", tube([(at + 0.6, 0.25, base + 0.45), (at - 0.2, 0.4, base + 0.85)], 0.016)
    )
    parts.add(
        "pantograph", "metal/steel_galvanised", tube([(at + 0.6, -0.3, base + 0.45), (at + 0.6, 0.3, base + 0.45)], 0.018)
    )
    bow = [(at - 0.2, y, base + 0.85 - 0.25 * max(0.0, abs(y) - 0.6)) for y in np.linspace(-0.8, 0.8, 13)]
    parts.add("pantograph", "metal/steel_galvanised", tube(bow, 0.02))


# --- lorries ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class LorrySpec:
    """A lorry. Distances from the front d and heights z [m].

    Attributes
    ----------
    cab
        (length, height of its roof, lower edge).
    axles
        (d, "single" or "double") of each axle of the lorry itself.
    load
        "box", "flat", "tipper" or "semi" (a tractor with its trailer of `trailer_m` length).
    load_m
        (front d, rear d, floor, top) of what it carries.
    """

    tags: tuple[str, ...]
    length_m: float
    cab: tuple[float, float, float]
    axles: tuple[tuple[float, str], ...]
    load: str
    load_m: tuple[float, float, float, float]
    paint: str = "paint/white"
    load_paint: str = "coating/white"
    width_m: float = 2.5
    wheel: tuple[float, float] = (0.5, 0.3)


def lorry(rng: np.random.Generator, *, spec: LorrySpec) -> BuiltAsset:
    """Return a cab-over lorry. The seed makes up the characters on its plates."""
    parts = PartList()
    _add_cab(parts, spec, rng)
    radius, tyre = spec.wheel
    rear_of_frame = spec.load_m[1] if spec.load != "semi" else spec.axles[-1][0] + 0.85
    _add_chassis(parts, spec, rear_of_frame)
    for number, (d, kind) in enumerate(spec.axles):
        _add_axle(parts, ("front", "rear", "tag")[number], -d, spec.wheel, width=spec.width_m, double=kind == "double")
        if number:
            y = spec.width_m / 2 - (tyre if kind == "double" else tyre / 2) - 0.03
            guard = mudguard(radius + 0.08, 2.1 * tyre if kind == "double" else 1.1 * tyre).moved(-d, y, radius)
            parts.add_both("mudguards", "plastic/black", guard)
    start, stop, floor, top = spec.load_m
    if spec.load == "semi":
        _add_semi(parts, (-stop, -start), (floor, top), rng, kind="curtain", paint=spec.load_paint)
    else:
        _LOADS[spec.load](parts, (-stop, -start), spec.width_m + 0.05, (floor, top), spec.load_paint)
        _add_rear_end(parts, -stop, spec.width_m, rng)
    axle = spec.axles[0][0]
    attributes: dict[str, float | str] = {
        "front_overhang_m": axle,
        "wheelbase_m": spec.axles[1][0] - axle,
        "wheel_radius_m": radius,
        "track_m": spec.width_m - tyre - 0.06,
        "body_width_m": spec.width_m + 0.05,
        "driver_eye_x_m": spec.length_m / 2 - 0.75,
        "driver_eye_y_m": 0.55,
        "driver_eye_z_m": spec.cab[2] + 0.72 * (spec.cab[1] - spec.cab[2]),
    }
    return parts.built("lorry", spec.tags, attributes, shift_x_m=spec.length_m / 2)


def _add_axle(parts: PartList, place: str, x: float, wheel_m: tuple[float, float], *, width: float, double: bool) -> None:
    radius, tyre = wheel_m
    outer = width / 2 - tyre / 2 - 0.03
    wheel = heavy_wheel(radius, tyre, outward=not double)
    parts.add_wheel(place, wheel.placed(x, outer, radius), rim_material="metal/aluminium")
    if double:
        parts.add_both("tyres_inner", "rubber/tyre", wheel.tyre.moved(x, outer - tyre - 0.03, radius))
        inner = cylinder(0.58 * radius, 0.8 * tyre, axis="y").moved(x, outer - tyre - 0.03, radius)
        parts.add_both("brakes", "metal/cast_iron", inner)
    axle = cylinder(0.07, 2 * outer - 0.2, axis="y", sides=16).moved(x, 0.0, radius)
    parts.add("axles", "metal/cast_iron", axle)


def _add_cab(parts: PartList, spec: LorrySpec, rng: np.random.Generator) -> None:
    long, top, low = spec.cab
    half = spec.width_m / 2
    radius, tyre = spec.wheel
    axle = spec.axles[0][0]
    tall = top - low
    nose = (0.06, 0.02, 0.0, 0.03, 0.16, 0.26, 0.36, 0.52)
    stern = (0.02, 0.0, 0.0, 0.0, 0.01, 0.03, 0.06, 0.12)
    panels = box_skin(
        (-long, 0.0), spec.width_m, (low, top), powers=(6.5, 16.0), nose=nose, stern=stern, columns=80, crown_m=0.06
    )
    skin = list(panels.patches["body"])
    cut_well(panels, -axle, radius, radius + 0.09, inner_y_m=half - tyre - 0.14, floor_m=low)
    belt, roof = low + 0.56 * tall, low + 0.83 * tall
    screen = front_view(half - 0.13, (belt - 0.08, roof), before_x_m=-0.6, radius_m=0.1)
    panels.cut("body", "window_seal", screen, edge_m=0.04)
    panels.cut("window_seal", "window_windscreen", inset(screen, 0.025), edge_m=0.06)
    door_end = -min(long - 0.15, 1.62)
    side = intersection(
        (
            beyond("y", half - 0.3),
            beyond("x", door_end + 0.12),
            lambda patch: patch.x + 0.44 + 0.12 * (patch.z - belt),
            lambda patch: belt - 0.16 * np.clip((patch.x - door_end) / 1.2, 0.0, 1.0) - patch.z,
            below("z", roof - 0.02),
        ),
        radius_m=0.06,
    )
    panels.cut("body", "window_seal", side, edge_m=0.04)
    panels.cut("window_seal", "window_side", inset(side, 0.02), edge_m=0.06, depth_m=0.004)
    door = intersection(
        (
            beyond("x", door_end),
            below("x", -0.34),
            beyond("z", low + 0.16),
            below("z", roof + 0.06),
            beyond("y", half - 0.35),
            opposite(circle(-axle, radius, radius + 0.17)),
        ),
        radius_m=0.07,
    )
    panels.strip("body", "seams", door, half_width_m=0.005, edge_m=0.05)
    grille = front_view(half - 0.42, (low + 0.24 * tall, belt - 0.17), before_x_m=-0.4, radius_m=0.06)
    panels.cut("body", "grille", grille, edge_m=0.04, depth_m=0.03)
    for z in np.linspace(low + 0.24 * tall, belt - 0.17, 7)[1:-1]:
        panels.strip("grille", "grille_bars", below("z", float(z)), half_width_m=0.022, depth_m=-0.02)
    panels.cut("body", "trim", below("z", low + 0.10), edge_m=0.06)
    _cut_cab_lamps(panels, half, low)
    materials = _BODY_MATERIALS | {"body": spec.paint, "grille_bars": spec.paint}
    parts.add_panels(panels, materials, ("window_side",), ("body", "grille_bars"))
    _add_cab_fittings(parts, spec, skin, rng, (belt, roof, door_end))


def _cut_cab_lamps(panels: Panels, half: float, low: float) -> None:
    def region(start: float, stop: float, bottom: float, top: float) -> Field:
        return intersection(
            (
                lambda patch: start - patch.front_arc_m,
                lambda patch: patch.front_arc_m - stop,
                beyond("z", low + bottom),
                below("z", low + top),
            ),
            radius_m=0.03,
        )

    for name in ("body", "trim"):
        panels.cut(name, "lamp_housing", region(half - 0.58, half - 0.08, 0.13, 0.35), edge_m=0.03, depth_m=0.006, wall="trim")
    panels.cut("lamp_housing", "headlight", region(half - 0.54, half - 0.40, 0.165, 0.29), edge_m=0.02, depth_m=-0.004)
    panels.cut("lamp_housing", "headlight", region(half - 0.37, half - 0.23, 0.165, 0.29), edge_m=0.02, depth_m=-0.004)
    panels.cut("lamp_housing", "indicator_front", region(half - 0.20, half - 0.11, 0.165, 0.29), edge_m=0.02, depth_m=-0.004)
    panels.cut("lamp_housing", "drl", region(half - 0.54, half - 0.11, 0.305, 0.33), edge_m=0.02, depth_m=-0.004)


def _add_cab_fittings(
    parts: PartList,
    spec: LorrySpec,
    skin: Sequence[Patch],
    rng: np.random.Generator,
    marks: tuple[float, float, float],
) -> None:
    belt, roof, door_end = marks
    long, top, low = spec.cab
    half = spec.width_m / 2
    housing, arm, glass = (shape.moved(-0.24, half - 0.21, roof - 0.30) for shape in heavy_mirror(0.55))
    parts.add_both("mirrors", "plastic/black", housing, arm)
    parts.add_pair("mirror_glass", "mirror/silver", glass)
    visor_x = surface_at(skin, "x", 0.3, roof + 0.02)
    visor = (
        rounded_box((0.30, spec.width_m - 0.5, 0.03), 0.014, steps=2).turned("y", 14).moved(visor_x + 0.08, 0.0, roof + 0.03)
    )
    parts.add("visor", "plastic/black", visor)
    for y, lift in ((0.15, 0.0), (0.75, 0.0)):
        z = belt - 0.05
        ends = [(surface_at(skin, "x", at, z + up) + 0.015, at, z + up) for at, up in ((y, 0.0), (y + 0.42, 0.1 + lift))]
        parts.add_both("wipers", "plastic/black", wiper(ends[0], ends[1], radius_m=0.01))
    z = low + 0.05
    x = surface_at(skin, "x", 0.0, z + 0.03) + 0.006
    parts.add("plate_front", "sign/white", number_plate().moved(x, 0.0, z))
    parts.add("plate_text", "plastic/black", plate_text(rng).moved(x, 0.0, z))
    parts.add("plate_holders", "plastic/black", box((0.06, 0.54, 0.13), centre_m=(x - 0.0305, 0.0, z)))
    handle = rounded_box((0.05, 0.02, 0.2), 0.008, centre_m=(door_end + 0.12, half - 0.002, belt - 0.15), steps=2)
    parts.add_both("handles", "plastic/black", handle)
    step = rounded_box((0.4, 0.05, 0.035), 0.012, centre_m=(-0.5, half - 0.012, low + 0.10), steps=2)
    parts.add_both("steps", "metal/aluminium", step)
    if top > 3.3:
        dome = rounded_box((0.9, 1.7, 0.12), 0.05, centre_m=(-long + 0.75, 0.0, top - 0.02))
        parts.add("roof_units", spec.paint, dome, paintable=True)


def _add_chassis(parts: PartList, spec: LorrySpec, rear_d: float) -> None:
    radius = spec.wheel[0]
    front = -0.7
    rail = box((rear_d - 0.7, 0.09, 0.26), centre_m=((front - rear_d) / 2, 0.40, 2 * radius - 0.06))
    parts.add_both("chassis", "coating/grey", rail)
    for d in np.arange(1.2, rear_d - 0.2, 1.3):
        parts.add("chassis", "coating/grey", box((0.08, 0.8, 0.16), centre_m=(-float(d), 0.0, 2 * radius - 0.06)))
    front_axle, rear_axle = spec.axles[0][0], spec.axles[1][0]
    start, stop = front_axle + radius + 0.35, rear_axle - radius - 0.22
    if stop - start > 0.7:
        tank = drum(min(stop - start, 1.25), 0.29).scaled(1.0, 1.0, 1.0)
        tank = tank.moved(-(start + min(stop - start, 1.25) / 2), spec.width_m / 2 - 0.36, 0.68)
        parts.add_both("tanks", "metal/aluminium", tank)
    if spec.load != "semi":
        for z in (0.55, 0.85):
            guard = rounded_box(
                (max(stop - start - 0.1, 0.3), 0.03, 0.12),
                0.01,
                centre_m=(-(start + stop) / 2, spec.width_m / 2 - 0.04, z),
                steps=2,
            )
            parts.add_both("side_guards", "metal/aluminium", guard)


def _add_rear_end(parts: PartList, rear_x: float, width: float, rng: np.random.Generator) -> None:
    bar = under_run_bar(width - 0.1).moved(rear_x + 0.12, 0.0, 0.48)
    parts.add("under_run", "coating/grey", bar)
    for y in (0.42,):
        parts.add_both("under_run", "coating/grey", box((0.07, 0.07, 0.45), centre_m=(rear_x + 0.2, y, 0.72)))
    parts.add("under_run", "coating/grey", box((0.06, width - 0.16, 0.16), centre_m=(rear_x + 0.12, 0.0, 0.74)))
    add_rear_lamps(parts, rear_x + 0.085, width / 2 - 0.36, 0.74, rng=rng)


def _box_load(parts: PartList, x: tuple[float, float], width: float, z: tuple[float, float], paint: str) -> None:
    """Add a closed van body with edge rails, rear doors and their locking bars."""
    long, tall = x[1] - x[0], z[1] - z[0]
    middle = (sum(x) / 2, 0.0, sum(z) / 2)
    parts.add("load", paint, rounded_box((long, width, tall), 0.035, centre_m=middle, steps=2), paintable=True)
    for height in (z[0] + 0.06, z[1] - 0.03):
        _add_frame(parts, x, width + 0.02, height, 0.10)
    for end in x:
        parts.add_both(
            "rails",
            "metal/aluminium",
            rounded_box(
                (0.10, 0.10, tall - 0.02),
                0.012,
                centre_m=(end + np.sign(middle[0] - end) * 0.042, width / 2 - 0.042, middle[2]),
                steps=2,
            ),
        )
    _add_doors(parts, x[0], width, z)


def _add_frame(parts: PartList, x: tuple[float, float], width: float, z: float, deep: float) -> None:
    """Add rails around a body at one height, a centimetre proud of its ends."""
    long, middle = x[1] - x[0] + 0.02, sum(x) / 2
    parts.add_both(
        "rails", "metal/aluminium", rounded_box((long, 0.07, deep), 0.012, centre_m=(middle, width / 2 - 0.035, z), steps=2)
    )
    for end in (x[0] + 0.025, x[1] - 0.025):
        parts.add("rails", "metal/aluminium", rounded_box((0.07, width - 0.1, deep), 0.012, centre_m=(end, 0.0, z), steps=2))


def _add_doors(parts: PartList, rear_x: float, width: float, z: tuple[float, float]) -> None:
    tall = z[1] - z[0]
    parts.add("seams", "plastic/black", box((0.008, 0.02, tall - 0.3), centre_m=(rear_x - 0.002, 0.0, sum(z) / 2)))
    for y in (0.14, 0.42):
        bar = tube([(rear_x - 0.03, y * width, z[0] + 0.12), (rear_x - 0.03, y * width, z[1] - 0.1)], 0.016, sides=8)
        parts.add_both("door_bars", "metal/steel_galvanised", bar)
        lever = box((0.02, 0.34, 0.03), centre_m=(rear_x - 0.045, (y - 0.05) * width, z[0] + 0.9))
        parts.add_both("door_bars", "metal/steel_galvanised", lever)
    for share in (0.15, 0.5, 0.85):
        hinge = box((0.03, 0.24, 0.05), centre_m=(rear_x - 0.008, width / 2 - 0.13, z[0] + share * tall))
        parts.add_both("door_bars", "metal/steel_galvanised", hinge)


def _flat_load(parts: PartList, x: tuple[float, float], width: float, z: tuple[float, float], paint: str) -> None:
    """Add a platform with drop sides, a headboard, and stacked timber."""
    long, floor = x[1] - x[0], z[0]
    parts.add(
        "load", paint, rounded_box((long, width, 0.16), 0.02, centre_m=(sum(x) / 2, 0.0, floor + 0.08), steps=2), paintable=True
    )
    panel = long / 3
    for number in range(3):
        centre = x[0] + (number + 0.5) * panel
        side = rounded_box((panel - 0.03, 0.03, 0.42), 0.012, centre_m=(centre, width / 2 - 0.016, floor + 0.38), steps=2)
        parts.add_both("sides", "metal/aluminium", side)
        for z_rib in (0.26, 0.38, 0.50):
            rib = box((panel - 0.06, 0.012, 0.02), centre_m=(centre, width / 2 + 0.003, floor + z_rib))
            parts.add_both("sides", "metal/aluminium", rib)
    tail = rounded_box((0.03, width - 0.06, 0.42), 0.012, centre_m=(x[0] + 0.016, 0.0, floor + 0.38), steps=2)
    parts.add("sides", "metal/aluminium", tail)
    parts.add(
        "headboard",
        paint,
        rounded_box((0.06, width - 0.04, z[1] - floor), 0.02, centre_m=(x[1] - 0.03, 0.0, (z[1] + floor) / 2), steps=2),
    )
    for layer in range(3):
        for row in range(7 - layer):
            y = (row - (6 - layer) / 2) * 0.30
            beam = rounded_box(
                (0.8 * long, 0.26, 0.2), 0.012, centre_m=(sum(x) / 2 - 0.1, y, floor + 0.27 + 0.22 * layer), steps=1
            )
            parts.add("timber", "paint/beige", beam)
    for share in (0.3, 0.7):
        at = x[0] + share * long
        strap = tube(
            [(at, -1.18, floor + 0.2), (at, -0.78, floor + 0.84), (at, 0.78, floor + 0.84), (at, 1.18, floor + 0.2)],
            0.018,
            sides=5,
        )
        parts.add("straps", "plastic/orange", strap)


def _tipper_load(parts: PartList, x: tuple[float, float], width: float, z: tuple[float, float], paint: str) -> None:
    """Add a tipping body: a ribbed trough with a heap in it."""
    long, floor, top = x[1] - x[0], z[0], z[1]
    middle = sum(x) / 2
    wall = 0.06
    parts.add("load", paint, box((long, width, 0.12), centre_m=(middle, 0.0, floor + 0.06)), paintable=True)
    for side in (-1, 1):
        parts.add(
            "load", paint, box((long, wall, top - floor), centre_m=(middle, side * (width / 2 - wall / 2), (floor + top) / 2))
        )
        for share in np.linspace(0.04, 0.96, 8):
            rib = box(
                (0.1, 0.05, top - floor - 0.06),
                centre_m=(x[0] + float(share) * long, side * (width / 2 + 0.015), (floor + top) / 2),
            )
            parts.add("load", paint, rib)
        parts.add("load", paint, box((long, 0.1, 0.1), centre_m=(middle, side * (width / 2 - 0.0), top - 0.04)))
    for end in (x[0] + wall / 2, x[1] - wall / 2):
        parts.add("load", paint, box((wall, width - 2 * wall, top - floor), centre_m=(end, 0.0, (floor + top) / 2)))
    shade = rounded_box((0.9, width - 0.2, 0.05), 0.02, centre_m=(x[1] + 0.35, 0.0, top + 0.02), steps=2)
    parts.add("load", paint, shade)
    grid_x, grid_y = np.meshgrid(
        np.linspace(x[0] + 0.06, x[1] - 0.06, 30), np.linspace(-width / 2 + 0.06, width / 2 - 0.06, 16), indexing="ij"
    )
    swell = np.cos((grid_y / width) * 2.6) * (0.75 + 0.25 * np.cos((grid_x - middle) / long * 5.2))
    rough = 0.035 * np.sin(9.1 * grid_x + 1.3 * np.sin(7 * grid_y)) * np.sin(8.3 * grid_y + np.cos(5 * grid_x))
    heap = np.stack([grid_x, grid_y, top - 0.32 + 0.42 * swell + rough], axis=-1)
    rows, cols = heap.shape[:2]
    index = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    parts.add("heap", "plastic/grey", Shape(heap.reshape(-1, 3), faces).smooth(60))


_LOADS = {"box": _box_load, "flat": _flat_load, "tipper": _tipper_load}


# --- trailers -----------------------------------------------------------------------------------------------


def _add_semi(
    parts: PartList, x: tuple[float, float], z: tuple[float, float], rng: np.random.Generator, *, kind: str, paint: str
) -> None:
    """Add a semi-trailer of 13.6 m or so between two x: frame, three axles, body."""
    rear, front = x
    width, radius, tyre = 2.55, 0.5, 0.37
    rail = box((front - rear - 0.1, 0.1, 0.2), centre_m=(sum(x) / 2, 0.45, z[0] - 0.10))
    parts.add_both("trailer_frame", "coating/grey", rail)
    for number in range(3):
        at = rear + 2.3 + 1.31 * number
        _add_axle(parts, f"trailer_{number + 1}", at, (radius, tyre), width=width, double=False)
    for y, at in ((0.75, front - 2.75),):
        leg = box((0.12, 0.12, 0.75), centre_m=(at, y, z[0] - 0.45))
        parts.add_both("landing_legs", "coating/grey", leg, box((0.28, 0.28, 0.03), centre_m=(at, y, z[0] - 0.82)))
    start, stop = rear + 2.3 + 2.62 + radius + 0.2, front - 3.2
    for height in (0.6, 0.85):
        guard = rounded_box((stop - start, 0.03, 0.12), 0.01, centre_m=((start + stop) / 2, width / 2 - 0.05, height), steps=2)
        parts.add_both("side_guards", "metal/aluminium", guard)
    parts.add(
        "side_guards",
        "metal/aluminium",
        *[box((0.05, width - 0.14, 0.05), centre_m=(at, 0.0, 0.95)) for at in (start + 0.3, stop - 0.3)],
    )
    guard = joined(
        [mudguard(radius + 0.07, 0.4).moved(rear + 2.3 + 1.31 * number, width / 2 - 0.23, radius) for number in range(3)]
    )
    parts.add_both("mudguards", "plastic/black", guard)
    if kind == "curtain":
        _curtain_body(parts, x, width, z, paint)
    else:
        _container_body(parts, x, z, paint)
    _add_rear_end(parts, rear, width, rng)


def _curtain_body(parts: PartList, x: tuple[float, float], width: float, z: tuple[float, float], paint: str) -> None:
    long, tall = x[1] - x[0], z[1] - z[0]
    middle = (sum(x) / 2, 0.0, sum(z) / 2)
    # The curtain hangs in soft folds between its buckles.
    at = np.linspace(x[0] + 0.12, x[1] - 0.12, 210)
    heights = np.linspace(z[0] + 0.02, z[1] - 0.1, 9)
    fold = 0.008 * np.cos(2 * np.pi * at[None, :] / 0.62) * (0.35 + 0.65 * np.abs(np.linspace(-1, 1, 9))[:, None])
    points = np.stack(
        [np.broadcast_to(at, (9, 210)), width / 2 - 0.012 + fold, np.broadcast_to(heights[:, None], (9, 210))], axis=-1
    )
    index = np.arange(9 * 210).reshape(9, 210)
    a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    parts.add_both("curtain", paint, Shape(points.reshape(-1, 3), faces).smooth(60), paintable=True)
    inner = rounded_box((long, width - 0.06, tall), 0.03, centre_m=middle, steps=2)
    parts.add("load", "coating/white", inner)
    for height in (z[0] - 0.02, z[1] - 0.06):
        _add_frame(parts, x, width, height, 0.14)
    for end in x:
        post = rounded_box(
            (0.14, 0.10, tall), 0.015, centre_m=(end + np.sign(middle[0] - end) * 0.062, width / 2 - 0.05, middle[2]), steps=2
        )
        parts.add_both("rails", "metal/aluminium", post)
    buckles = [
        box((0.05, 0.012, 0.30), centre_m=(float(px), width / 2 + 0.004, z[0] + 0.12))
        for px in np.arange(x[0] + 0.43, x[1] - 0.3, 0.62)
    ]
    parts.add_both("buckles", "plastic/black", joined(buckles))
    _add_doors(parts, x[0] - 0.01, width, z)


def _container_body(parts: PartList, x: tuple[float, float], z: tuple[float, float], paint: str) -> None:
    width, tall = 2.438, z[1] - z[0]
    parts.add(
        "load", paint, corrugated_box((x[0] + 0.05, x[1] - 0.05), width - 0.03, (z[0] + 0.08, z[1] - 0.04)), paintable=True
    )
    for height in (z[0] + 0.09, z[1] - 0.06):
        rail = rounded_box((x[1] - x[0], 0.06, 0.12), 0.01, centre_m=(sum(x) / 2, width / 2 - 0.03, height), steps=1)
        parts.add_both("frame", paint, rail, paintable=True)
        for end in (x[0] + 0.05, x[1] - 0.05):
            parts.add("frame", paint, box((0.1, width - 0.1, 0.12), centre_m=(end, 0.0, height)))
    for end in (x[0] + 0.08, x[1] - 0.08):
        post = rounded_box((0.16, 0.16, tall), 0.015, centre_m=(end, width / 2 - 0.08, sum(z) / 2), steps=1)
        parts.add_both("frame", paint, post, paintable=True)
    _add_doors(parts, x[0] + 0.03, width - 0.1, (z[0] + 0.1, z[1] - 0.1))


def semi_trailer(rng: np.random.Generator, *, kind: str = "curtain", paint: str = "coating/blue") -> BuiltAsset:
    """Return a parked semi-trailer on its landing legs: "curtain" (13.6 m) or "container" (a 40-foot box on its frame)."""
    parts = PartList()
    long, top = (13.6, 4.0) if kind == "curtain" else (12.192, 3.85)
    x, z = (-long, 0.0), (1.26, top)
    _add_semi(parts, x, z, rng, kind=kind, paint=paint)
    for part in ("landing_legs",):
        foot = box((0.12, 0.1, 0.46), centre_m=(-2.75, 0.75, 0.23))
        parts.add_both(part, "coating/grey", foot, box((0.3, 0.3, 0.03), centre_m=(-2.75, 0.75, 0.015)))
    tags = ("semi-trailer", kind, "parked")
    return parts.built(
        "trailer", tags, {"wheel_radius_m": 0.5, "track_m": 2.12, "kingpin_x_m": long / 2 - 1.6}, shift_x_m=long / 2
    )


def caravan(
    rng: np.random.Generator, *, length_m: float = 5.3, paint: str = "paint/white", band: str = "paint/blue"
) -> BuiltAsset:
    """Return a touring caravan; `length_m` is its body, the drawbar comes to it."""
    parts = PartList()
    width, low, high, bar = 2.3, 0.38, 2.58, 1.2
    nose = (0.12, 0.02, 0.0, 0.04, 0.20, 0.36, 0.52, 0.80)
    stern = (0.06, 0.0, 0.0, 0.02, 0.08, 0.16, 0.26, 0.44)
    panels = box_skin((-length_m, 0.0), width, (low, high), powers=(12.0, 12.0), nose=nose, stern=stern, columns=72)
    axle, radius = -0.54 * length_m, 0.32
    cut_well(panels, axle, radius, 0.39, inner_y_m=width / 2 - 0.4, floor_m=low)
    for start, stop in ((-0.36, -0.14), (-0.86, -0.64)):
        pane = side_view((start * length_m, stop * length_m), (1.35, 2.05), y_m=width / 2 - 0.3, radius_m=0.12)
        panels.cut("body", "window_seal", pane, edge_m=0.04)
        panels.cut("window_seal", "window_side", inset(pane, 0.03), edge_m=0.06, depth_m=-0.012)
    for name, at, front in (("window_windscreen", -0.9, True), ("window_rear", 0.9 - length_m, False)):
        pane = front_view(0.85, (1.35, 2.0), before_x_m=at, front=front, radius_m=0.12)
        panels.cut("body", name, pane, edge_m=0.04, depth_m=-0.012, wall="window_seal")
    door = side_view((-0.60 * length_m + 0.6, -0.60 * length_m + 1.25), (0.46, 2.2), y_m=width / 2 - 0.3, radius_m=0.12)
    panels.strip("body", "seams", door, half_width_m=0.006, edge_m=0.05)
    panels.strip("body", "band", lambda patch: patch.z - 1.12 - 0.03 * patch.x, half_width_m=0.05)
    panels.strip("body", "band", lambda patch: patch.z - 0.98 - 0.03 * patch.x, half_width_m=0.02)
    panels.cut("body", "trim", below("z", 0.47), edge_m=0.1)
    parts.add_panels(panels, _BODY_MATERIALS | {"body": paint, "band": band}, ("window_side",), ("body",))
    wheel = car_wheel(radius, 0.185, 0.195, "steel")
    parts.add_wheel("middle", wheel.placed(axle, width / 2 - 0.14, radius), rim_material="plastic/grey")
    _add_drawbar(parts, bar, 0.36)
    parts.add("gas_box", paint, rounded_box((0.45, 1.5, 0.5), 0.1, centre_m=(0.12, 0.0, 0.68)))
    add_rear_lamps(parts, -length_m - 0.045, width / 2 - 0.36, 0.72, rng=rng)
    attributes = {"wheel_radius_m": radius, "track_m": width - 0.28, "hitch_x_m": (length_m + bar) / 2}
    return parts.built("trailer", ("caravan", "touring", "parked"), attributes, shift_x_m=(length_m - bar) / 2)


def _add_drawbar(parts: PartList, long: float, z: float) -> None:
    for side in (0.55,):
        beam = tube([(-0.4, side, z + 0.02), (long - 0.28, 0.04, z + 0.05)], 0.035, sides=8)
        parts.add_both("drawbar", "metal/steel_galvanised", beam)
    parts.add("drawbar", "metal/steel_galvanised", tube([(long - 0.35, 0.0, z + 0.06), (long, 0.0, z + 0.07)], 0.04, sides=10))
    parts.add("jockey_wheel", "metal/steel_galvanised", cylinder(0.025, 0.6, sides=12).moved(long - 0.4, 0.0, z + 0.12))
    parts.add("jockey_wheel", "metal/steel_galvanised", box((0.05, 0.03, 0.2), centre_m=(long - 0.4, 0.035, 0.15)))
    parts.add("jockey_tyre", "rubber/tyre", cylinder(0.1, 0.05, sides=20, axis="y").moved(long - 0.4, 0.0, 0.1))


def cargo_trailer(rng: np.random.Generator, *, length_m: float = 2.1, cover: str = "coating/grey") -> BuiltAsset:
    """Return a small single-axle trailer for a car; with `cover` a tarpaulin over hoops, or none where empty."""
    parts = PartList()
    width, floor, side, bar = 1.2, 0.52, 0.38, 0.95
    middle = -length_m / 2
    parts.add("bed", "metal/steel_galvanised", box((length_m, width, 0.05), centre_m=(middle, 0.0, floor)))
    for y in (-1, 1):
        wall = rounded_box((length_m, 0.03, side), 0.008, centre_m=(middle, y * (width / 2 - 0.015), floor + side / 2), steps=1)
        parts.add("bed", "metal/steel_galvanised", wall)
        ribs = [
            box((length_m - 0.1, 0.012, 0.03), centre_m=(middle, y * (width / 2 + 0.004), floor + share * side))
            for share in (0.25, 0.5, 0.75)
        ]
        parts.add("bed", "metal/steel_galvanised", *ribs)
    for x in (-length_m + 0.015, -0.015):
        parts.add(
            "bed",
            "metal/steel_galvanised",
            rounded_box((0.03, width - 0.06, side), 0.008, centre_m=(x, 0.0, floor + side / 2), steps=1),
        )
    if cover:
        tarp = rounded_box((length_m + 0.02, width + 0.02, 0.62), 0.09, centre_m=(middle, 0.0, floor + side + 0.26))
        parts.add("cover", cover, tarp, paintable=True)
    else:
        parts.add(
            "bed", "metal/steel_galvanised", box((length_m - 0.08, width - 0.08, 0.02), centre_m=(middle, 0.0, floor + 0.035))
        )
    radius = 0.28
    wheel = car_wheel(radius, 0.155, 0.178, "steel")
    parts.add_wheel("middle", wheel.placed(middle - 0.12, width / 2 + 0.11, radius), rim_material="plastic/grey")
    parts.add_both("mudguards", "plastic/black", mudguard(radius + 0.05, 0.2).moved(middle - 0.12, width / 2 + 0.11, radius))
    parts.add("axles", "metal/cast_iron", cylinder(0.035, width + 0.1, sides=12, axis="y").moved(middle - 0.12, 0.0, radius))
    _add_drawbar(parts, bar, floor - 0.1)
    beam = box((0.05, 1.5, 0.12), centre_m=(-length_m - 0.03, 0.0, floor - 0.04))
    parts.add("lamp_beam", "plastic/black", beam)
    add_rear_lamps(parts, -length_m - 0.10, 0.62, floor - 0.04, rng=rng, size_m=(0.24, 0.10))
    attributes = {"wheel_radius_m": radius, "track_m": width + 0.22, "hitch_x_m": (length_m + bar) / 2}
    return parts.built("trailer", ("cargo", "single-axle", "parked"), attributes, shift_x_m=(length_m - bar) / 2)
