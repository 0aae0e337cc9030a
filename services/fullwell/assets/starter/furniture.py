"""Street furniture: bins, benches, bicycle racks, bus stops, call boxes and billboards.

Sizes are of common makes: two-wheeled bins of 240 l by EN 840-1 (0.58 x 0.74 x 1.07 m), four-wheeled of 1100 l by EN 840-3
(1.37 x 1.07 x 1.37 m); bicycle stands 0.75 m high and 0.8 m apart at least (CROW, Design Manual for Bicycle Traffic, 2017);
posters of 1185 x 1750 mm and boards of 3.0 x 6.1 m (48 sheets); the kiosk has the outline of the British K6 of 1936
(0.92 x 0.92 x 2.4 m).
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.assembly import Assembly, boxes, quads, round_box, span
from fullwell.assets.starter.building import BuiltAsset, StarterEntry
from fullwell.assets.starter.glyphs import circle, filled, polygon, rectangle, ribbon, text
from fullwell.assets.starter.shapes import Shape, cylinder, loft, revolution, tube
from fullwell.assets.starter.signs import post, stop_plate

__all__ = [
    "FURNITURE",
    "bench",
    "bicycle_stands",
    "billboard",
    "bus_pole",
    "bus_shelter",
    "container",
    "emergency_pillar",
    "litter_bin",
    "phone_box",
    "poster_case",
    "slot_rack",
    "wheelie_bin",
]

Array = NDArray[np.float64]

FILM_M = 0.002
"""Posters and labels lie this far before what carries them."""


# -- bins -----------------------------------------------------------------------------------------------------------------


def litter_bin(rng: np.random.Generator, *, colour: str = "green") -> BuiltAsset:
    """Return a round litter bin with a domed hood on four straps, and a stubbing plate."""
    assembly = Assembly()
    body = [(0.0, 0.04), (0.19, 0.04), (0.22, 0.08), (0.225, 0.78), (0.235, 0.79), (0.235, 0.82), (0.2, 0.82), (0.2, 0.2)]
    assembly.add("body", f"coating/{colour}", revolution(body, sides=32))
    assembly.add(
        "foot", "metal/cast_iron", revolution([(0.0, 0.0), (0.2, 0.0), (0.2, 0.03), (0.16, 0.05), (0.0, 0.05)], sides=24)
    )
    for angle in np.deg2rad([45, 135, 225, 315]):
        x, y = 0.205 * np.cos(angle), 0.205 * np.sin(angle)
        assembly.add("body", f"coating/{colour}", tube([(x, y, 0.7), (x, y, 1.02)], 0.014, sides=8))
    hood = [(0.0, 1.0), (0.24, 1.0), (0.245, 1.015), (0.22, 1.06), (0.15, 1.1), (0.06, 1.12), (0.0, 1.125)]
    assembly.add("hood", f"coating/{colour}", revolution(hood, sides=32, crease_deg=60.0))
    assembly.add("band", "sign/yellow", revolution([(0.2265, 0.6), (0.2275, 0.6), (0.2275, 0.64), (0.2265, 0.64)], sides=32))
    label = text("LITTER", 0.06, 0.0)
    assembly.add("label", "sign/white", _wrapped(label, 0.2272, 0.46))
    return BuiltAsset("bin", ("litter",), assembly.parts(paintable=("body", "hood")), {"volume_l": 100.0})


def _wrapped(flat: Shape, radius_m: float, z_m: float) -> Shape:
    """A drawing on the plane x = 0 bent around a cylinder about z."""
    angle = flat.vertices_m[:, 1] / radius_m
    x, y = radius_m * np.cos(angle), radius_m * np.sin(angle)
    return Shape(np.column_stack([x, y, flat.vertices_m[:, 2] + z_m]), flat.faces)


def _wheel(assembly: Assembly, x_m: float, y_m: float, radius_m: float, wide_m: float) -> None:
    profile = [
        (radius_m * 0.55, -wide_m / 2),
        (radius_m * 0.92, -wide_m / 2),
        (radius_m, -wide_m * 0.3),
        (radius_m, wide_m * 0.3),
    ]
    profile += [(radius_m * 0.92, wide_m / 2), (radius_m * 0.55, wide_m / 2)]
    tyre = revolution(profile, sides=24).turned("x", 90).moved(x_m, y_m, radius_m)
    assembly.add("wheels", "rubber/tyre", tyre)
    assembly.add("hubs", "plastic/grey", cylinder(radius_m * 0.56, wide_m * 0.8, sides=16, axis="y").moved(x_m, y_m, radius_m))


def wheelie_bin(rng: np.random.Generator, *, colour: str = "black", lid: str = "black", open_deg: float = 0.0) -> BuiltAsset:
    """Return a two-wheeled bin of 240 l, its front towards +x and its handle behind."""
    assembly = Assembly()
    body, top = f"plastic/{colour}", f"plastic/{lid}"
    levels = [
        (0.06, 0.48, 0.43, -0.06),
        (0.12, 0.5, 0.45, -0.05),
        (0.89, 0.6, 0.54, 0.0),
        (0.93, 0.64, 0.575, 0.0),
        (0.99, 0.64, 0.575, 0.0),
    ]
    rings = [_rounded(length, width, 0.05, shift, z) for z, length, width, shift in levels]
    assembly.add("body", body, loft(np.array(rings)).smooth(35.0))
    for z in (0.3, 0.5):
        assembly.add("body", body, span((0.0, -0.18, z), (0.262 + 0.05 * (z - 0.12), 0.18, z + 0.02)))
    cover = [
        _rounded(0.66 - inset, 0.58 - inset, 0.05, 0.005, z)
        for z, inset in ((0.0, 0.0), (0.03, 0.0), (0.06, 0.04), (0.075, 0.16))
    ]
    hood = loft(np.array(cover)).smooth(50.0).moved(0.325)
    hood = hood.turned("y", -open_deg).moved(-0.325, 0.0, 0.997)
    assembly.add("lid", top, hood)
    assembly.add("handle", body, tube([(-0.385, -0.24, 0.98), (-0.385, 0.24, 0.98)], 0.014, sides=10))
    assembly.add(
        "handle", body, boxes([(-0.39, y - 0.02, 0.93) for y in (-0.22, 0.22)], [(-0.3, y + 0.02, 0.99) for y in (-0.22, 0.22)])
    )
    assembly.add("axle", "metal/steel_galvanised", cylinder(0.012, 0.5, sides=8, axis="y").moved(-0.25, 0.0, 0.1))
    for y in (-0.255, 0.255):
        _wheel(assembly, -0.25, y, 0.1, 0.05)
    assembly.add(
        "feet", body, boxes([(0.06, y - 0.03, 0.0) for y in (-0.15, 0.15)], [(0.14, y + 0.03, 0.08) for y in (-0.15, 0.15)])
    )
    number = str(int(rng.integers(2, 99)))
    assembly.add("label", "sign/white", text(number, 0.11, 0.0).turned("y", 4.0).moved(0.3105, 0.0, 0.68))
    return BuiltAsset("bin", ("wheelie", "refuse"), assembly.parts(paintable=("body", "lid")), {"volume_l": 240.0})


def _rounded(length: float, width: float, radius: float, shift: float, z: float) -> Array:
    corner = np.deg2rad(np.linspace(0, 90, 4))
    points = []
    for k, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        angle = corner + k * np.pi / 2
        centre = (sx * (length / 2 - radius) + shift, sy * (width / 2 - radius))
        points.append(np.column_stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle), np.full(4, z)]))
    return np.concatenate(points)


def container(rng: np.random.Generator, *, colour: str = "blue", lid: str = "blue") -> BuiltAsset:
    """Return a four-wheeled recycling container of 1100 l with a lid with slots; its long side towards +x."""
    assembly = Assembly()
    body = f"plastic/{colour}"
    levels = [(0.2, 0.86, 1.08), (0.3, 0.9, 1.14), (1.0, 1.0, 1.28), (1.04, 1.06, 1.36), (1.12, 1.06, 1.36)]
    assembly.add("body", body, loft(np.array([_rounded(x, y, 0.07, 0.0, z) for z, x, y in levels])).smooth(35.0))
    for y in (-0.5, -0.36, 0.36, 0.5):
        assembly.add("body", body, _rib(float(y), 0.44, 0.5))
    turn = np.linspace(0.0, np.pi, 11)
    arch = np.column_stack([0.53 * np.cos(turn), 0.22 * np.sin(turn) + 1.125])
    rings = np.array([np.column_stack([arch[:, 0], np.full(11, y), arch[:, 1]]) for y in (0.68, -0.68)])
    assembly.add("lid", f"plastic/{lid}", loft(rings).smooth(50.0))
    for y in (-0.34, 0.34):
        slot = [(0.49, y - 0.16), (0.49, y + 0.16)]
        assembly.add("slots", "plastic/black", span((0.36, slot[0][1], 1.235), (0.45, slot[1][1], 1.285)))
    for y in (-0.685, 0.685):
        bar = tube([(-0.25, y, 0.98), (0.25, y, 0.98)], 0.02, sides=10)
        assembly.add("handles", "metal/steel_galvanised", bar)
        assembly.add(
            "handles",
            "metal/steel_galvanised",
            boxes(
                [(x - 0.02, min(y, 0.94 * y), 0.95) for x in (-0.25, 0.25)],
                [(x + 0.02, max(y, 0.94 * y), 1.01) for x in (-0.25, 0.25)],
            ),
        )
    for x in (-0.34, 0.34):
        for y in (-0.45, 0.45):
            _wheel(assembly, x, y, 0.1, 0.045)
            assembly.add("castors", "metal/steel_galvanised", span((x - 0.05, y - 0.035, 0.17), (x + 0.05, y + 0.035, 0.21)))
    sign = [text("PAPER", 0.13, 0.0).turned("y", 4.0).moved(0.4885, 0.0, 0.75)]
    assembly.add("label", "sign/white", *sign)
    return BuiltAsset("bin", ("container", "recycling"), assembly.parts(paintable=("body", "lid")), {"volume_l": 1100.0})


def _rib(y: float, low_x: float, high_x: float) -> Shape:
    low = np.array(
        [
            (low_x - 0.02, y - 0.03, 0.32),
            (low_x + 0.02, y - 0.03, 0.32),
            (low_x + 0.02, y + 0.03, 0.32),
            (low_x - 0.02, y + 0.03, 0.32),
        ]
    )
    return loft(np.array([low, low + [high_x - low_x, 0.0, 0.66]]))


# -- benches --------------------------------------------------------------------------------------------------------------


def bench(rng: np.random.Generator, *, style: str = "park") -> BuiltAsset:
    """Return a bench of 1.8 m: "park" of oak slats on cast legs, or "modern", a concrete block with a slatted seat."""
    assembly = Assembly()
    if style == "park":
        seat = [(0.02 + 0.075 * k, 0.43 + 0.004 * (k - 2) ** 2) for k in range(5)]
        for x, z in seat:
            assembly.add("slats", "wood/oak", span((x - 0.16, -0.9, z), (x - 0.16 + 0.06, 0.9, z + 0.03)))
        for k in range(4):
            slat = span((-0.012, -0.9, 0.0), (0.018, 0.9, 0.07)).turned("y", -14.0)
            assembly.add("slats", "wood/oak", slat.moved(-0.235 - 0.026 * k, 0.0, 0.53 + 0.098 * k))
        for y in (-0.72, 0.72):
            frame = [(0.2, 0.01), (0.17, 0.2), (0.19, 0.41), (-0.17, 0.4), (-0.24, 0.5), (-0.345, 0.9)]
            assembly.add("frames", "metal/cast_iron", tube([(x, y, z) for x, z in frame], 0.022, sides=8))
            back = [(-0.17, 0.4), (-0.2, 0.2), (-0.27, 0.01)]
            assembly.add("frames", "metal/cast_iron", tube([(x, y, z) for x, z in back], 0.022, sides=8))
            arm = [(0.18, 0.43), (0.2, 0.62), (0.12, 0.66), (-0.28, 0.64)]
            assembly.add("frames", "metal/cast_iron", tube([(x, y, z) for x, z in arm], 0.018, sides=8))
            feet = boxes([(0.15, y - 0.035, 0.0), (-0.32, y - 0.035, 0.0)], [(0.25, y + 0.035, 0.02), (-0.22, y + 0.035, 0.02)])
            assembly.add("frames", "metal/cast_iron", feet)
    else:
        block = round_box((0.5, 2.2, 0.4), 0.03).moved(z_m=0.0)
        assembly.add("block", "concrete/light", block)
        for k in range(6):
            x = -0.23 + 0.08 * k
            assembly.add("slats", "wood/pine", span((x, -0.9, 0.4), (x + 0.06, 0.9, 0.445)))
        assembly.add(
            "rail",
            "metal/steel_brushed",
            tube([(-0.22, 0.5, 0.42), (-0.25, 0.5, 0.72), (-0.25, 1.0, 0.72), (-0.22, 1.0, 0.38)], 0.02, sides=10),
        )
    return BuiltAsset("bench", ("seat", style), assembly.parts(paintable=("slats",)), {"seat_height_m": 0.45})


# -- bicycle racks --------------------------------------------------------------------------------------------------------


def _hoop(length_m: float, height_m: float, radius_m: float, *, bend_m: float = 0.14) -> Shape:
    half = length_m / 2 - bend_m
    turn = np.linspace(0, np.pi / 2, 6)
    left = np.column_stack([-half - bend_m * np.cos(turn), height_m - bend_m + bend_m * np.sin(turn)])
    right = left[::-1] * [-1, 1]
    path = np.vstack([[(-half - bend_m, 0.0)], left, right, [(half + bend_m, 0.0)]])
    return tube(np.column_stack([path[:, 0], np.zeros(len(path)), path[:, 1]]), radius_m, sides=14)


def bicycle_stands(rng: np.random.Generator, *, count: int = 4) -> BuiltAsset:
    """Return hoops in a row along y, 0.9 m apart, for two bicycles each."""
    assembly = Assembly()
    for number in range(count):
        y = (number - (count - 1) / 2) * 0.9
        turn = float(rng.uniform(-1.5, 1.5))
        assembly.add("hoops", "metal/steel_galvanised", _hoop(0.75, 0.77, 0.024).turned("z", turn).moved(0.0, y))
        for x in (-0.375, 0.375):
            assembly.add("flanges", "metal/steel_galvanised", cylinder(0.06, 0.008, sides=16).moved(x, y, 0.004))
    return BuiltAsset("bike_rack", ("hoops",), assembly.parts(paintable=("hoops",)), {"places": float(2 * count)})


def slot_rack(rng: np.random.Generator, *, count: int = 6) -> BuiltAsset:
    """Return a rack of wheel slots between two rails, high and low by turns."""
    assembly = Assembly()
    wide = 0.38 * count
    for x in (-0.22, 0.22):
        assembly.add("rails", "metal/steel_galvanised", span((x - 0.02, -wide / 2, 0.0), (x + 0.02, wide / 2, 0.03)))
    for number in range(count):
        y = (number - (count - 1) / 2) * 0.38
        lift = 0.0 if number % 2 else 0.16
        for side in (-0.03, 0.03):
            path = [
                (0.22, 0.02),
                (0.2, 0.3 + lift),
                (0.1, 0.42 + lift),
                (-0.05, 0.42 + lift),
                (-0.18, 0.3 + lift / 2),
                (-0.22, 0.02),
            ]
            assembly.add("slots", "metal/steel_galvanised", tube([(x, y + side, z) for x, z in path], 0.009, sides=8))
    return BuiltAsset("bike_rack", ("slots",), assembly.parts(), {"places": float(count)})


# -- bus stops ------------------------------------------------------------------------------------------------------------


def _poster(
    assembly: Assembly, rng: np.random.Generator, low: tuple[float, float], high: tuple[float, float], x_m: float
) -> None:
    """Paper on the plane x with shapes in four colours, as advertisements have."""
    wide, tall = high[0] - low[0], high[1] - low[1]
    centre = ((low[0] + high[0]) / 2, (low[1] + high[1]) / 2)
    colours = [str(colour) for colour in rng.permutation(["blue", "red", "green", "yellow"])]
    assembly.add("poster", f"paper/poster_{colours[0]}", filled(rectangle(wide, tall, centre), x_m))
    split = low[1] + tall * float(rng.uniform(0.25, 0.4))
    band = rectangle(wide, split - low[1], (centre[0], (split + low[1]) / 2))
    assembly.add("poster", f"paper/poster_{colours[1]}", filled(band, x_m + FILM_M))
    size = 0.32 * min(wide, tall)
    at = (centre[0] + float(rng.uniform(-0.2, 0.2)) * wide, split + 0.52 * (high[1] - split))
    outline = (
        circle(size * 0.8, at) if rng.random() < 0.5 else polygon(6, size, turn_deg=float(rng.uniform(0, 60))) + np.array(at)
    )
    assembly.add("poster", f"paper/poster_{colours[2]}", filled(outline, x_m + FILM_M))
    assembly.add("poster", "paper/white", filled(circle(size * 0.42, at), x_m + 2 * FILM_M))
    words = ("SUMMER", "NEW", "MUSIC", "FRESH", "TRAVEL", "OPEN")
    word = words[int(rng.integers(len(words)))]
    letter = min(0.55 * (split - low[1]), 0.9 * wide / (0.82 * len(word)))
    assembly.add("poster", "paper/white", text(word, letter, x_m + 2 * FILM_M, centre_m=(centre[0], (split + low[1]) / 2)))


def bus_shelter(rng: np.random.Generator) -> BuiltAsset:
    """Return a shelter of 4.2 by 1.5 m, open to the street (+x): glass walls, seat, a lit poster case, a flag sign."""
    assembly = Assembly()
    wide, deep, high = 4.2, 1.4, 2.45
    frame = "coating/grey"
    back = -deep / 2
    for y in np.linspace(-wide / 2, wide / 2, 4):
        assembly.add("frame", frame, span((back, y - 0.04, 0.0), (back + 0.08, y + 0.04, high)))
    assembly.add(
        "frame",
        frame,
        *(span((deep / 2 - 0.3, y - 0.04, 0.0), (deep / 2 - 0.22, y + 0.04, high)) for y in (-wide / 2, wide / 2)),
    )
    assembly.add("frame", frame, span((back, -wide / 2 - 0.04, high), (deep / 2, wide / 2 + 0.04, high + 0.08)))
    assembly.add(
        "roof",
        "coating/white",
        span((back - 0.05, -wide / 2 - 0.1, high + 0.08), (deep / 2 + 0.15, wide / 2 + 0.1, high + 0.14)),
    )
    assembly.add(
        "fascia",
        "coating/blue",
        span((deep / 2 + 0.15, -wide / 2 - 0.1, high + 0.02), (deep / 2 + 0.18, wide / 2 + 0.1, high + 0.18)),
    )
    assembly.add(
        "fascia_letters", "sign/white", text("CENTRAL STATION", 0.1, deep / 2 + 0.18 + FILM_M, centre_m=(0.0, high + 0.1))
    )
    edges = np.linspace(-wide / 2, wide / 2, 4)
    for a, b in itertools.pairwise(edges):
        assembly.add("glass", "glass/clear", span((back + 0.035, a + 0.06, 0.25), (back + 0.045, b - 0.06, high - 0.1)))
        assembly.add("frame", frame, span((back + 0.02, a + 0.04, 0.2), (back + 0.06, b - 0.04, 0.24)))
    assembly.add(
        "glass", "glass/clear", span((back + 0.12, wide / 2 - 0.005, 0.25), (deep / 2 - 0.34, wide / 2 + 0.005, high - 0.1))
    )
    _case(assembly, rng, y_m=-wide / 2 + 0.1, x_m=0.0)
    seat = [
        span((back + 0.32, -0.9, 0.46 + 0.0), (back + 0.42, 1.6, 0.49)),
        span((back + 0.44, -0.9, 0.46), (back + 0.54, 1.6, 0.49)),
    ]
    assembly.add("seat", "wood/oak", *seat)
    for y in (-0.6, 1.3):
        assembly.add(
            "seat_legs",
            frame,
            span((back + 0.08, y - 0.03, 0.4), (back + 0.54, y + 0.03, 0.46)),
            span((back + 0.4, y - 0.03, 0.0), (back + 0.46, y + 0.03, 0.4)),
        )
    table = (back + 0.05 + 2 * FILM_M, 0.4)
    assembly.add("timetable", "paper/white", span((back + 0.047, 0.1, 1.2), (table[0], 0.75, 1.75)))
    lines = [
        ribbon([(0.16, 1.7 - 0.045 * k), (0.16 + float(rng.uniform(0.2, 0.52)), 1.7 - 0.045 * k)], 0.014, table[0] + FILM_M)
        for k in range(10)
    ]
    assembly.add("timetable_lines", "sign/black", *lines)
    assembly.add("base", "concrete/grey", span((back - 0.05, -wide / 2 - 0.1, 0.0), (deep / 2 + 0.1, wide / 2 + 0.1, 0.02)))
    return BuiltAsset("bus_stop", ("shelter", "glass"), assembly.parts(paintable=("frame", "fascia")), {"opening": "+x"})


def _case(assembly: Assembly, rng: np.random.Generator, *, y_m: float, x_m: float) -> None:
    """A poster case across the shelter's end, its posters facing along the street both ways."""
    wide, low, high = 1.25, 0.3, 2.2
    assembly.add("case", "coating/grey", span((x_m - wide / 2, y_m - 0.09, low), (x_m + wide / 2, y_m + 0.09, high)))
    for turn, sign in ((90.0, 1.0), (-90.0, -1.0)):
        paper = Assembly()
        _poster(paper, rng, (-wide / 2 + 0.05, low + 0.08), (wide / 2 - 0.05, high - 0.08), FILM_M)
        assembly.place(paper, turn_deg=turn, x_m=x_m, y_m=y_m + sign * 0.09)


def bus_pole(rng: np.random.Generator) -> BuiltAsset:
    """Return a stop of one pole: a round sign, a plate with lines, a timetable case."""
    assembly = Assembly()
    plate = stop_plate()
    assembly.place(plate, z_m=2.45)
    post(assembly, 2.62)
    assembly.add("plate", "metal/aluminium", span((-0.0042, -0.2, 1.95), (-0.0012, 0.2, 2.18)))
    assembly.add("lines", "sign/white", filled(rectangle(0.4, 0.23, (0.0, 2.065)), 0.0))
    assembly.add(
        "lines_text",
        "sign/black",
        text("12 N4", 0.09, 0.0012, centre_m=(0.0, 2.11)),
        text("CENTRE", 0.05, 0.0012, centre_m=(0.0, 2.0)),
    )
    assembly.add("case", "coating/grey", span((-0.05, -0.17, 1.1), (0.0, 0.17, 1.6)))
    assembly.add("timetable", "paper/white", filled(rectangle(0.3, 0.46, (0.0, 1.35)), FILM_M))
    lines = [
        ribbon([(-0.12, 1.53 - 0.035 * k), (-0.12 + float(rng.uniform(0.1, 0.24)), 1.53 - 0.035 * k)], 0.01, 2 * FILM_M)
        for k in range(11)
    ]
    assembly.add("timetable_lines", "sign/black", *lines)
    return BuiltAsset("bus_stop", ("pole",), assembly.parts(), {"opening": "+x"})


# -- call boxes -----------------------------------------------------------------------------------------------------------


def phone_box(rng: np.random.Generator, *, colour: str = "red") -> BuiltAsset:
    """Return a cast kiosk with glazed sides, a domed roof, and lit signs above them; its door is towards +x."""
    assembly = Assembly()
    paint = f"coating/{colour}"
    half, post_w = 0.455, 0.1
    assembly.add("plinth", "metal/cast_iron", span((-half, -half, 0.0), (half, half, 0.1)))
    corners = [(x, y) for x in (-half, half - post_w) for y in (-half, half - post_w)]
    assembly.add("body", paint, boxes([(x, y, 0.1) for x, y in corners], [(x + post_w, y + post_w, 2.1) for x, y in corners]))
    for turn in (0.0, 90.0, 180.0, -90.0):
        side = Assembly()
        inner = half - post_w
        side.add(
            "body", paint, span((-0.07, -inner, 0.1), (-0.02, inner, 0.42)), span((-0.08, -inner, 1.86), (-0.01, inner, 2.1))
        )
        if turn != 180.0:
            bars = [(0.0, y - 0.012, y + 0.012, 0.42, 1.86) for y in (-inner + 0.08, inner - 0.08)]
            bars += [(0.0, -inner, inner, z - 0.012, z + 0.012) for z in np.linspace(0.42, 1.86, 9)]
            side.add(
                "body",
                paint,
                boxes(
                    [(-0.06, a, c) for _, a, _, c, _ in bars],
                    [(-0.025 - 0.004 * (b - a > 0.1), b, d) for _, a, b, c, d in bars],
                ),
            )
            side.add("glass", "glass/clear", span((-0.053, -inner + 0.002, 0.422), (-0.047, inner - 0.002, 1.858)))
        else:
            side.add("body", paint, span((-0.07, -inner, 0.42), (-0.02, inner, 1.86)))
        x = -0.01 + FILM_M
        side.add("sign_panel", "lamp/sign_panel", filled(rectangle(0.6, 0.13, (0.0, 1.99)), x))
        side.add("sign_letters", "sign/black", text("TELEPHONE", 0.065, x + FILM_M, centre_m=(0.0, 1.99)))
        assembly.place(side, turn_deg=turn, x_m=half * np.cos(np.deg2rad(turn)), y_m=half * np.sin(np.deg2rad(turn)))
    cornice = [(half + 0.02, 2.1), (half + 0.02, 2.16), (half - 0.02, 2.18), (half - 0.02, 2.22)]
    rings = [[(r, -r, z), (r, r, z), (-r, r, z), (-r, -r, z)] for r, z in cornice]
    assembly.add("body", paint, loft(np.array(rings)))
    dome = np.linspace(0.0, np.pi / 2, 6)
    rings = [
        _rounded(2 * (0.43 * np.cos(0.8 * a)), 2 * (0.43 * np.cos(0.8 * a)), 0.06, 0.0, 2.22 + 0.2 * np.sin(a)).tolist()
        for a in dome
    ]
    assembly.add("roof", paint, loft(np.array(rings)).smooth(40.0))
    assembly.add("telephone", "plastic/black", span((-half + 0.08, -0.16, 1.0), (-half + 0.2, 0.16, 1.55)))
    assembly.add("shelf", "metal/steel_brushed", span((-half + 0.08, -0.3, 0.9), (-half + 0.3, 0.3, 0.93)))
    assembly.add("door_fittings", "metal/brass", span((half - 0.02, -0.33, 1.05), (half + 0.01, -0.31, 1.25)))
    return BuiltAsset("call_box", ("telephone", "historic", "uk"), assembly.parts(paintable=("body", "roof")), {})


def emergency_pillar(rng: np.random.Generator) -> BuiltAsset:
    """Return a roadside emergency call pillar: orange, with a sloped top, a speaking grille and SOS on its flanks."""
    assembly = Assembly()
    rings = [_rounded(0.34, 0.3, 0.05, 0.0, z) for z in (0.05, 1.35)]
    assembly.add("body", "plastic/orange", loft(np.array(rings)).smooth(40.0))
    low, high = _rounded(0.38, 0.34, 0.05, 0.0, 1.35), _rounded(0.38, 0.34, 0.05, 0.0, 1.5)
    high[:, 2] -= 0.18 * (high[:, 0] + 0.19) - 0.05
    assembly.add("hood", "plastic/black", loft(np.array([low, high])).smooth(30.0))
    assembly.add("foot", "concrete/grey", span((-0.24, -0.22, 0.0), (0.24, 0.22, 0.05)))
    front = 0.17
    assembly.add("panel", "metal/steel_brushed", span((front - 0.01, -0.1, 0.85), (front + 0.008, 0.1, 1.25)))
    holes = [
        filled(circle(0.006, (0.02 * a - 0.05, 1.2 - 0.02 * b), sides=8), front + 0.008 + FILM_M)
        for a in range(6)
        for b in range(4)
    ]
    assembly.add("grille", "plastic/black", *holes)
    assembly.add("button", "plastic/red", cylinder(0.03, 0.02, sides=20, axis="x").moved(front + 0.018, 0.0, 1.0))
    assembly.add("letters", "sign/white", text("SOS", 0.13, front + FILM_M, centre_m=(0.0, 0.6)))
    for turn, y in ((90.0, 0.15), (-90.0, -0.15)):
        assembly.add("letters", "sign/white", text("SOS", 0.15, FILM_M).turned("z", turn).moved(0.0, y, 1.1))
    assembly.add("band", "sign/white", *(span((-0.172, -0.152, z), (0.172, 0.152, z + 0.06)) for z in (0.3,)))
    return BuiltAsset("call_box", ("emergency", "motorway"), assembly.parts(paintable=("body",)), {})


# -- billboards -----------------------------------------------------------------------------------------------------------


def billboard(rng: np.random.Generator, *, width_m: float = 6.1, height_m: float = 3.0, clearance_m: float = 2.6) -> BuiltAsset:
    """Return a poster board on two steel columns, lit from above by four arms."""
    assembly = Assembly()
    low, high = clearance_m, clearance_m + height_m
    half = width_m / 2
    assembly.add("board", "metal/steel_galvanised", span((-0.12, -half, low), (0.0, half, high)))
    edge = 0.1
    strips = boxes(
        [(-0.14, -half - edge, low - edge), (-0.14, -half - edge, high), (-0.14, -half - edge, low), (-0.14, half, low)],
        [(0.05, half + edge, low), (0.05, half + edge, high + edge), (0.05, -half, high), (0.05, half + edge, high)],
    )
    assembly.add("frame", "coating/green", strips)
    _poster(assembly, rng, (-half, low), (half, high), 2 * FILM_M)
    for y in (-0.3 * width_m, 0.3 * width_m):
        assembly.add("columns", "coating/grey", span((-0.36, y - 0.09, 0.0), (-0.14, y + 0.09, high - 0.2)))
        brace = tube([(-1.2, y, 0.05), (-0.3, y, low + 0.4)], 0.05, sides=10)
        assembly.add("columns", "coating/grey", brace, span((-1.35, y - 0.15, 0.0), (-1.05, y + 0.15, 0.08)))
        assembly.add("footings", "concrete/grey", span((-0.55, y - 0.3, 0.0), (0.05, y + 0.3, 0.12)))
    for y in np.linspace(-half * 0.75, half * 0.75, 4).tolist():
        assembly.add(
            "lamp_arms",
            "coating/grey",
            tube([(-0.02, y, high + 0.08), (0.5, y, high + 0.4), (0.95, y, high + 0.36)], 0.018, sides=8),
        )
        assembly.add("lamp_houses", "coating/grey", span((0.85, y - 0.2, high + 0.33), (1.1, y + 0.2, high + 0.39)))
        face = [
            (0.87, y - 0.18, high + 0.326),
            (0.87, y + 0.18, high + 0.326),
            (1.08, y + 0.18, high + 0.326),
            (1.08, y - 0.18, high + 0.326),
        ]
        assembly.add("lamp", "lamp/street_led", quads([face]))
    return BuiltAsset(
        "billboard",
        ("board", "lit"),
        assembly.parts(paintable=("frame",)),
        {"poster_width_m": width_m, "poster_height_m": height_m},
    )


def poster_case(rng: np.random.Generator) -> BuiltAsset:
    """Return a free-standing poster case of the size of city lights (1.185 by 1.75 m of paper), posters front and back."""
    assembly = Assembly()
    wide, low, high = 1.35, 0.55, 2.55
    assembly.add("case", "coating/grey", round_box((0.2, wide, high - low), 0.03).moved(z_m=low))
    assembly.add("leg", "coating/grey", span((-0.07, -0.25, 0.03), (0.07, 0.25, low)))
    assembly.add("foot", "metal/steel_brushed", span((-0.16, -0.4, 0.0), (0.16, 0.4, 0.03)))
    for turn, sign in ((0.0, 1.0), (180.0, -1.0)):
        paper = Assembly()
        _poster(paper, rng, (-0.5925, low + 0.12), (0.5925, low + 0.12 + 1.75), FILM_M)
        assembly.place(paper, turn_deg=turn, x_m=sign * 0.1)
    return BuiltAsset(
        "billboard",
        ("poster", "city_light"),
        assembly.parts(paintable=("case",)),
        {"poster_width_m": 1.185, "poster_height_m": 1.75},
    )


FURNITURE: tuple[StarterEntry, ...] = (
    StarterEntry("bin-litter", "Litter bin with hood", litter_bin, {}, 201),
    StarterEntry("bin-wheelie-240", "Wheeled bin, 240 l", wheelie_bin, {}, 202),
    StarterEntry(
        "bin-wheelie-240-yellow",
        "Wheeled bin, 240 l, yellow lid ajar",
        wheelie_bin,
        {"colour": "grey", "lid": "yellow", "open_deg": 9.0},
        203,
    ),
    StarterEntry("bin-container-1100", "Recycling container, 1100 l", container, {}, 204),
    StarterEntry("bench-park", "Park bench, oak and cast iron", bench, {"style": "park"}, 211),
    StarterEntry("bench-modern", "Bench, concrete with slats", bench, {"style": "modern"}, 212),
    StarterEntry("bike-rack-hoops", "Bicycle hoops, four", bicycle_stands, {}, 221),
    StarterEntry("bike-rack-slots", "Bicycle rack, six slots", slot_rack, {}, 222),
    StarterEntry("bus-stop-shelter", "Bus shelter with poster case", bus_shelter, {}, 231),
    StarterEntry("bus-stop-pole", "Bus stop pole", bus_pole, {}, 232),
    StarterEntry("call-box-telephone", "Telephone kiosk, red", phone_box, {}, 241),
    StarterEntry("call-box-emergency", "Emergency call pillar", emergency_pillar, {}, 242),
    StarterEntry("billboard-48-sheet", "Billboard, 6.1 by 3.0 m", billboard, {}, 251),
    StarterEntry("billboard-city-light", "Poster case on a leg", poster_case, {}, 252),
)
"""All street furniture of the starter library."""
