"""Cones, barriers, and what stands about in streets: pallets, boxes, skips, planters, hydrants, bollards.

Cones of 0.5 and 0.75 m with two retroreflective sleeves (EN 13422:2019); a concrete barrier of New Jersey profile, 0.81 m
high and 0.61 m wide at its foot, whose slopes break 75 and 330 mm above the road (after AASHTO,
Roadside Design Guide); the pallet is the EUR 1 of EN 13698-1 (1200 x 800 x 144 mm); the skip has
the outline of a 6 cubic yard builder's skip (DIN 30720-1).
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.assembly import Assembly, boxes, quads, round_box, span
from fullwell.assets.starter.building import BuiltAsset, StarterEntry
from fullwell.assets.starter.glyphs import filled, polygon, rectangle, text
from fullwell.assets.starter.shapes import Shape, box, cylinder, loft, revolution, sphere, tube

__all__ = ["CLUTTER"]

Array = NDArray[np.float64]


def cone(rng: np.random.Generator, *, height_m: float = 0.75) -> BuiltAsset:
    """Return a traffic cone with two white sleeves on a square foot of rubber."""
    assembly = Assembly()
    wide = {0.5: 0.3}.get(height_m, 0.4)
    foot = round_box((wide, wide, 0.035), 0.012)
    assembly.add("foot", "rubber/tyre", foot)
    low, high = 0.034, height_m
    r_low, r_high = 0.40 * wide * 0.9, 0.028

    def radius(z: float) -> float:
        return r_low + (r_high - r_low) * (z - low) / (high - low)

    profile = [
        (0.0, low),
        (r_low + 0.012, low),
        (radius(low + 0.02), low + 0.02),
        (radius(high), high),
        (radius(high) - 0.01, high + 0.0),
    ]
    profile += [(0.012, high - 0.06), (0.0, high - 0.06)]
    assembly.add("body", "plastic/orange", revolution(profile, sides=28))
    for start, stop in ((0.38, 0.56), (0.72, 0.86)):
        a, b = low + start * (high - low), low + stop * (high - low)
        band = [(radius(a), a), (radius(a) + 0.002, a + 0.001), (radius(b) + 0.002, b - 0.001), (radius(b), b)]
        assembly.add("sleeves", "sign/white", revolution(band, sides=28))
    return BuiltAsset("cone", ("roadworks", "retroreflective"), assembly.parts(), {})


# -- barriers -------------------------------------------------------------------------------------------------------------


def plastic_barrier(rng: np.random.Generator, *, colour: str = "red") -> BuiltAsset:
    """Return a water-filled barrier of 1.5 m, 0.8 m high, with fork slots and coupling lugs."""
    assembly = Assembly()
    profile = np.array(
        [
            (0.225, 0.0),
            (0.225, 0.12),
            (0.14, 0.34),
            (0.11, 0.72),
            (0.08, 0.8),
            (-0.08, 0.8),
            (-0.11, 0.72),
            (-0.14, 0.34),
            (-0.225, 0.12),
            (-0.225, 0.0),
        ]
    )
    material = f"plastic/{colour}"
    cuts = (-0.75, -0.42, -0.18, 0.18, 0.42, 0.75)
    for a, b, hollow in zip(cuts[:-1], cuts[1:], (False, True, False, True, False), strict=True):
        shape = profile.copy()
        if hollow:
            shape[[0, -1], 1] = 0.11
        assembly.add("body", material, _along_y(shape, a, b))
    for y in (-0.5, 0.0, 0.5):
        assembly.add("body", material, span((-0.15, y - 0.02, 0.36), (0.15, y + 0.02, 0.66)))
    assembly.add("filler_cap", "plastic/black", cylinder(0.05, 0.025, sides=20).moved(0.0, 0.4, 0.81))
    for side in (1.0, -1.0):
        for z in (0.25, 0.55):
            assembly.add(
                "lugs", material, cylinder(0.06, 0.06, sides=16).moved(0.0, side * 0.78, z + (0.08 if side > 0 else 0.0))
            )
    for x, turn in ((0.13, 0.0), (-0.13, 180.0)):
        strip = filled(rectangle(0.9, 0.1), 0.0).turned("y", -4.5).moved(0.0085, 0.0, 0.5)
        assembly.add("reflector", "sign/white", strip.turned("z", turn).moved(x))
    return BuiltAsset("barrier", ("plastic", "roadworks"), assembly.parts(paintable=("body",)), {})


def _along_y(profile_m: Array, start_m: float, stop_m: float) -> Shape:
    """An outline in the xz plane, counter-clockwise seen from -y, drawn out along y."""
    rings = [np.column_stack([profile_m[:, 0], np.full(len(profile_m), y), profile_m[:, 1]]) for y in (stop_m, start_m)]
    return loft(np.array(rings))


def concrete_barrier(rng: np.random.Generator, *, length_m: float = 3.0) -> BuiltAsset:
    """Return a unit of New Jersey profile along y, with scuppers and a lifting slot."""
    assembly = Assembly()
    half = np.array([(0.305, 0.0), (0.305, 0.075), (0.18, 0.33), (0.085, 0.79), (0.075, 0.81)])
    low = half.copy()
    profile = np.vstack([half, half[::-1] * [-1, 1]])
    raised = np.vstack([low, low[::-1] * [-1, 1]])
    raised[[0, -1], 1] = 0.07
    ends = length_m / 2
    cuts = (-ends, -0.3 * length_m - 0.2, -0.3 * length_m + 0.2, 0.3 * length_m - 0.2, 0.3 * length_m + 0.2, ends)
    for a, b, hollow in zip(cuts[:-1], cuts[1:], (False, True, False, True, False), strict=True):
        assembly.add("body", "concrete/light", _along_y(raised if hollow else profile, a, b))
    loops = [
        tube([(0.0, y - 0.08, 0.79), (0.0, y - 0.06, 0.86), (0.0, y + 0.06, 0.86), (0.0, y + 0.08, 0.79)], 0.01, sides=8)
        for y in (-0.8, 0.8)
    ]
    assembly.add("lifting_loops", "metal/rust", *loops)
    for y in (-ends - 0.01, ends - 0.03):
        assembly.add("coupling", "metal/steel_galvanised", span((-0.02, y, 0.2), (0.02, y + 0.04, 0.7)))
    for side in (1.0, -1.0):
        for y in (-0.33 * length_m, 0.33 * length_m):
            # The upper slope leans by 11.7 degrees.
            disc = box((0.012, 0.09, 0.05)).turned("y", -11.7 * side).moved(side * 0.147, y, 0.52)
            assembly.add("reflectors", "sign/yellow", disc)
    return BuiltAsset("barrier", ("concrete", "jersey"), assembly.parts(), {"unit_length_m": length_m})


def crowd_barrier(rng: np.random.Generator, *, length_m: float = 2.3) -> BuiltAsset:
    """Return a crowd-control barrier of steel tube: a frame, upright bars, and two flat feet."""
    assembly = Assembly()
    half, low, high = length_m / 2 - 0.06, 0.22, 1.08
    frame = [
        (0, -half, low),
        (0, -half, high - 0.12),
        (0, -half + 0.12, high),
        (0, half - 0.12, high),
        (0, half, high - 0.12),
        (0, half, low),
    ]
    assembly.add(
        "frame",
        "metal/steel_galvanised",
        tube(frame, 0.019, sides=12),
        tube([(0, -half, low + 0.05), (0, half, low + 0.05)], 0.017, sides=12),
    )
    for y in np.linspace(-half, half, 20)[1:-1]:
        assembly.add("bars", "metal/steel_galvanised", tube([(0, y, low + 0.05), (0, y, high - 0.005)], 0.007, sides=8))
    for y in (-half + 0.25, half - 0.25):
        assembly.add("feet", "metal/steel_galvanised", span((-0.34, y - 0.025, 0.0), (0.34, y + 0.025, 0.012)))
        for x in (-0.2, 0.2):
            assembly.add("feet", "metal/steel_galvanised", tube([(x, y, 0.013), (0.0, y, low + 0.05)], 0.014, sides=10))
    assembly.add(
        "hooks",
        "metal/steel_galvanised",
        *(tube([(0, half, z), (0, half + 0.05, z), (0, half + 0.05, z - 0.08)], 0.008, sides=8) for z in (0.4, 0.85)),
    )
    plate = span((-0.003, -0.25, 0.7), (0.003, 0.25, 0.85))
    assembly.add("plate", "sign/white", plate.moved(0.012))
    return BuiltAsset("barrier", ("crowd", "steel"), assembly.parts(), {})


def roadworks_board(rng: np.random.Generator) -> BuiltAsset:
    """Return a barrier board of red and white stripes with two warning lamps, on two rubber feet; 2 m wide, 1.1 m high."""
    assembly = Assembly()
    wide, low, high = 2.0, 0.75, 1.0
    assembly.add("board", "plastic/white", span((-0.02, -wide / 2, low), (0.02, wide / 2, high)))
    for turn in (0.0, 180.0):
        face = Assembly()
        face.add("face_white", "sign/white", filled(rectangle(wide - 0.02, high - low - 0.02, (0.0, (low + high) / 2)), 0.0215))
        count = 7
        step = (wide - 0.02) / count
        slant = 0.1
        for k in range(count):
            y = -wide / 2 + 0.01 + k * step
            stripe = np.array(
                [(y, low + 0.01), (y + step / 2, low + 0.01), (y + step / 2 + slant, high - 0.01), (y + slant, high - 0.01)]
            )
            stripe[:, 0] = np.minimum(stripe[:, 0], wide / 2 - 0.01)
            face.add("face_red", "sign/red", filled(stripe, 0.0228))
        assembly.place(face, turn_deg=turn)
    assembly.add("tapping_rail", "plastic/white", span((-0.015, -wide / 2, 0.15), (0.015, wide / 2, 0.3)))
    for y in (-0.8, 0.8):
        assembly.add("legs", "metal/steel_galvanised", span((-0.06, y - 0.02, 0.08), (-0.022, y + 0.02, 1.0)))
        assembly.add("feet", "rubber/tyre", round_box((0.8, 0.36, 0.1), 0.02).moved(-0.02, y))
        assembly.add("lamp_bodies", "plastic/yellow", span((-0.05, y - 0.06, 1.0), (0.05, y + 0.06, 1.12)))
        lens = revolution([(0.09, 0.0), (0.08, 0.02), (0.05, 0.033), (0.0, 0.04)], sides=24).turned("y", 90)
        assembly.add("lamp_rings", "plastic/black", cylinder(0.1, 0.06, sides=24, axis="x").moved(0.0, y, 1.22))
        assembly.add(
            "light_amber", "lamp/traffic_amber", lens.moved(0.032, y, 1.22), lens.turned("z", 180).moved(-0.032, y, 1.22)
        )
    tags = ("roadworks", "board", "retroreflective")
    return BuiltAsset("barrier", tags, assembly.parts(), {"phases": "on off", "lit_in_on": "light_amber"})


# -- clutter --------------------------------------------------------------------------------------------------------------


def pallet(rng: np.random.Generator) -> BuiltAsset:
    """Return a EUR pallet: five deck boards, nine blocks, three skids."""
    assembly = Assembly()
    widths = (0.145, 0.1, 0.145, 0.1, 0.145)
    places = (-0.3275, -0.17, 0.0, 0.17, 0.3275)
    for y, wide in zip(places, widths, strict=True):
        assembly.add("boards", "wood/weathered", span((-0.6, y - wide / 2, 0.122), (0.6, y + wide / 2, 0.144)))
    for x in (-0.5275, 0.0, 0.5275):
        assembly.add("boards", "wood/weathered", span((x - 0.0725, -0.4, 0.1), (x + 0.0725, 0.4, 0.122)))
    for y, wide in ((-0.35, 0.1), (0.0, 0.145), (0.35, 0.1)):
        assembly.add("skids", "wood/weathered", span((-0.6, y - wide / 2, 0.0), (0.6, y + wide / 2, 0.022)))
        for x in (-0.5275, 0.0, 0.5275):
            assembly.add("blocks", "wood/pine", span((x - 0.0725, y - wide / 2, 0.022), (x + 0.0725, y + wide / 2, 0.1)))
    return BuiltAsset("clutter", ("pallet", "wood"), assembly.parts(), {})


def cardboard(rng: np.random.Generator, *, count: int = 6) -> BuiltAsset:
    """Return a heap of cartons, some with open flaps, bound with tape."""
    assembly = Assembly()
    placed: list[tuple[float, float, float, float]] = []
    base = 0.0
    for number in range(count):
        size = rng.uniform([0.32, 0.38, 0.24], [0.5, 0.6, 0.42])
        if number < 3:
            x, y, z = (float(rng.uniform(-0.08, 0.08)), (number - 1) * 0.66 + float(rng.uniform(-0.02, 0.02)), 0.0)
            placed.append((x, y, float(size[2]), 0.0))
        else:
            under = placed[number % 3]
            x, y, z = under[0], under[1], under[2] + 0.002
            placed[number % 3] = (x, y, z + float(size[2]), 0.0)
        turn = float(rng.uniform(-9, 9))
        carton = Assembly()
        _carton(carton, size, open_top=number >= count - 2, rng=rng)
        assembly.place(carton, turn_deg=turn, x_m=x, y_m=y, z_m=z + base)
    return BuiltAsset("clutter", ("boxes", "cardboard"), assembly.parts(), {})


def _carton(assembly: Assembly, size: Array, *, open_top: bool, rng: np.random.Generator) -> None:
    x, y, z = (float(value) for value in size)
    card = "wood/pine"
    if not open_top:
        assembly.add("cartons", card, span((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z)))
        tape = boxes(
            [(-0.03, -y / 2 - 0.001, z - 0.08), (-0.03, -y / 2 - 0.001, z)],
            [(0.03, y / 2 + 0.001, z + 0.001), (0.03, y / 2 + 0.001, z + 0.001)],
        )
        assembly.add("tape", "paper/white", tape)
        return
    wall = 0.006
    assembly.add(
        "cartons",
        card,
        span((-x / 2, -y / 2, 0.0), (x / 2, y / 2, 0.01)),
        boxes(
            [
                (-x / 2, -y / 2, 0.01),
                (x / 2 - wall, -y / 2, 0.01),
                (-x / 2 + wall, -y / 2, 0.01),
                (-x / 2 + wall, y / 2 - wall, 0.01),
            ],
            [(-x / 2 + wall, y / 2, z), (x / 2, y / 2, z), (x / 2 - wall, -y / 2 + wall, z), (x / 2 - wall, y / 2, z)],
        ),
    )
    for turn, reach, half in ((0.0, x / 2, y), (180.0, x / 2, y), (90.0, y / 2, x), (-90.0, y / 2, x)):
        flap = span((0.0, -half / 2 + 0.004, -0.002), (0.46 * min(x, y), half / 2 - 0.004, 0.002))
        lifted = flap.turned("y", float(rng.uniform(-40, 50))).moved(reach, 0.0, z).turned("z", turn)
        assembly.add("cartons", card, lifted)


def skip_container(rng: np.random.Generator, *, colour: str = "yellow") -> BuiltAsset:
    """Return a builder's skip with sloped ends, half full of rubble."""
    assembly = Assembly()
    paint = f"coating/{colour}"
    side = np.array([(-1.05, 0.0), (1.05, 0.0), (1.8, 0.9), (1.8, 1.2), (-1.8, 1.2), (-1.8, 0.9)])
    half, wall = 0.83, 0.03
    for sign in (1.0, -1.0):
        outer = [
            np.column_stack([side[:, 0], np.full(6, sign * half - offset), side[:, 1]]) for offset in (-wall / 2, wall / 2)
        ]
        assembly.add("body", paint, loft(np.array(outer)))
    sheet = [(-1.8, 1.2), (-1.8, 0.9), (-1.05, 0.02), (1.05, 0.02), (1.8, 0.9), (1.8, 1.2)]
    inside, out = [], []
    for (ax, az), (bx, bz) in itertools.pairwise(sheet):
        inside.append([(ax, -half, az), (bx, -half, bz), (bx, half, bz), (ax, half, az)])
        out.append(
            [
                (ax * 1.01, half, az - 0.015),
                (bx * 1.01, half, bz - 0.015),
                (bx * 1.01, -half, bz - 0.015),
                (ax * 1.01, -half, az - 0.015),
            ]
        )
    plates = np.array(out)
    plates[..., 2] = np.maximum(plates[..., 2], 0.005)
    assembly.add("body", paint, quads(np.array(inside)), quads(plates))
    rim = [(-1.82, -half - 0.05, 1.16), (-1.82, half - 0.02, 1.16), (-1.82, -half + 0.02, 1.16), (1.76, -half + 0.02, 1.16)]
    rim_high = [(1.82, -half + 0.02, 1.23), (1.82, half + 0.05, 1.23), (-1.76, half - 0.02, 1.23), (1.82, half - 0.02, 1.23)]
    assembly.add("rim", paint, boxes(rim, rim_high))
    for x in (-0.75, 0.75):
        for sign in (1.0, -1.0):
            assembly.add(
                "lugs", "metal/steel_galvanised", cylinder(0.045, 0.12, sides=16, axis="y").moved(x, sign * (half + 0.06), 0.8)
            )
            ys = sorted((sign * (half + 0.01), sign * (half + 0.05)))
            assembly.add("ribs", paint, span((x - 0.05, ys[0], 0.03), (x + 0.05, ys[1], 1.16)))
    _rubble(assembly, rng)
    return BuiltAsset("clutter", ("skip", "builders"), assembly.parts(paintable=("body", "rim", "ribs")), {"volume_m3": 4.6})


def _rubble(assembly: Assembly, rng: np.random.Generator) -> None:
    grid_x, grid_y = np.meshgrid(np.linspace(-1.5, 1.5, 13), np.linspace(-0.8, 0.8, 8), indexing="ij")
    heap = 0.75 + 0.35 * np.exp(-(grid_x**2) / 1.1 - grid_y**2 / 0.4) + rng.uniform(-0.05, 0.05, grid_x.shape)
    points = np.stack([grid_x, grid_y, heap], axis=-1)
    corners = np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    assembly.add("rubble", "soil/earth", quads(corners))
    for number in range(34):
        size = rng.uniform([0.09, 0.1, 0.06], [0.26, 0.3, 0.13])
        x, y = float(rng.uniform(-1.3, 1.3)), float(rng.uniform(-0.62, 0.62))
        z = 0.76 + 0.35 * float(np.exp(-(x**2) / 1.1 - y**2 / 0.4))
        lump = (
            box(size.tolist()).turned("x", float(rng.uniform(-40, 40))).turned("z", float(rng.uniform(0, 180))).moved(x, y, z)
        )
        assembly.add("rubble", ("brick/red", "concrete/grey", "plaster/white")[number % 3], lump)
    assembly.add("planks", "wood/weathered", box((2.4, 0.14, 0.03)).turned("y", -16.0).turned("z", 12.0).moved(0.5, 0.2, 1.3))


def planter(rng: np.random.Generator) -> BuiltAsset:
    """Return a square concrete planter with a clipped box ball."""
    assembly = Assembly()
    outer = [(0.4, 0.0), (0.45, 0.05), (0.5, 0.62), (0.5, 0.68), (0.43, 0.68), (0.42, 0.58)]
    rings = [[(r, -r, z), (r, r, z), (-r, r, z), (-r, -r, z)] for r, z in outer]
    assembly.add("pot", "concrete/light", loft(np.array(rings)))
    assembly.add(
        "soil", "soil/earth", quads([[(0.43, -0.43, 0.6), (0.43, 0.43, 0.6), (-0.43, 0.43, 0.6), (-0.43, -0.43, 0.6)]])
    )
    assembly.add("foliage_core", "foliage/hedge", sphere(0.33, sides=16).moved(z_m=0.93))
    count = 900
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    centre = direction * rng.uniform(0.32, 0.4, (count, 1)) + [0.0, 0.0, 0.93]
    across = np.cross(direction, rng.normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(direction, across) + 0.7 * direction * rng.uniform(-1, 1, (count, 1))
    half = rng.uniform(0.018, 0.03, (count, 1))
    leaves = np.stack([centre - half * across, centre - half * up, centre + half * across, centre + half * up], axis=1)
    assembly.add("leaves", "foliage/hedge", quads(leaves))
    return BuiltAsset("clutter", ("planter", "plants"), assembly.parts(), {})


def hydrant(rng: np.random.Generator, *, colour: str = "red") -> BuiltAsset:
    """Return a pillar hydrant, 0.76 m high: a ribbed barrel, a bonnet with its nut, one large and two small outlets."""
    assembly = Assembly()
    paint = f"coating/{colour}"
    barrel = [
        (0.0, 0.0),
        (0.17, 0.0),
        (0.17, 0.03),
        (0.11, 0.04),
        (0.1, 0.1),
        (0.1, 0.36),
        (0.115, 0.4),
        (0.115, 0.5),
        (0.15, 0.515),
        (0.15, 0.55),
    ]
    bonnet = [(0.13, 0.56), (0.12, 0.62), (0.08, 0.68), (0.04, 0.7), (0.04, 0.71), (0.0, 0.715)]
    assembly.add("barrel", paint, revolution([*barrel, *bonnet], sides=28, crease_deg=35.0))
    assembly.add("nuts", "metal/cast_iron", cylinder(0.025, 0.05, sides=5).moved(z_m=0.735))
    bolts = [cylinder(0.012, 0.03, sides=6).moved(0.137 * np.cos(a), 0.137 * np.sin(a), 0.56) for a in np.arange(8) * np.pi / 4]
    assembly.add("nuts", "metal/cast_iron", *bolts)
    for turn, radius, reach in ((0.0, 0.07, 0.19), (90.0, 0.05, 0.18), (-90.0, 0.05, 0.18)):
        outlet = cylinder(radius * 0.8, reach, sides=20, axis="x").moved(reach / 2, 0.0, 0.45)
        cap = cylinder(radius, 0.05, sides=20, axis="x").moved(reach, 0.0, 0.45)
        nut = cylinder(0.02, 0.03, sides=5, axis="x").moved(reach + 0.04, 0.0, 0.45)
        assembly.add("outlets", paint, outlet.turned("z", turn))
        assembly.add("caps", "metal/aluminium", cap.turned("z", turn))
        assembly.add("nuts", "metal/cast_iron", nut.turned("z", turn))
    return BuiltAsset("clutter", ("hydrant", "usa"), assembly.parts(paintable=("barrel", "outlets")), {})


def bollard(rng: np.random.Generator) -> BuiltAsset:
    """Return a cast bollard, 1.0 m high, with a retroreflective band."""
    assembly = Assembly()
    profile = [
        (0.0, 0.0), (0.11, 0.0), (0.11, 0.06), (0.085, 0.09), (0.075, 0.12), (0.06, 0.78), (0.075, 0.8), (0.075, 0.84),
        (0.055, 0.86), (0.075, 0.91), (0.07, 0.96), (0.04, 0.99), (0.0, 1.0),
    ]  # fmt: skip
    assembly.add("body", "coating/black", revolution(profile, sides=24, crease_deg=35.0))
    assembly.add("band", "sign/white", revolution([(0.0655, 0.66), (0.0685, 0.66), (0.0665, 0.74), (0.0625, 0.74)], sides=24))
    return BuiltAsset("clutter", ("bollard",), assembly.parts(paintable=("body",)), {})


def post_box(rng: np.random.Generator, *, colour: str = "red") -> BuiltAsset:
    """Return a pillar box, 1.6 m high, with a domed cap, a slot, a collection plate, and a door with its lock."""
    assembly = Assembly()
    paint = f"coating/{colour}"
    assembly.add(
        "foot", "coating/black", revolution([(0.0, 0.0), (0.255, 0.0), (0.255, 0.16), (0.24, 0.18), (0.0, 0.18)], sides=36)
    )
    body = [
        (0.0, 0.18),
        (0.225, 0.18),
        (0.225, 1.34),
        (0.24, 1.35),
        (0.24, 1.38),
        (0.275, 1.4),
        (0.28, 1.44),
        (0.26, 1.47),
        (0.16, 1.56),
        (0.0, 1.6),
    ]
    assembly.add("body", paint, revolution(body, sides=36, crease_deg=35.0))
    assembly.add("slot_frame", paint, box((0.04, 0.3, 0.1), centre_m=(0.215, 0.0, 1.22)))
    assembly.add("slot", "plastic/black", box((0.01, 0.24, 0.035), centre_m=(0.2325, 0.0, 1.225)))
    assembly.add("plate", "coating/white", box((0.02, 0.18, 0.24), centre_m=(0.218, 0.0, 0.98)))
    lines = [filled(rectangle(0.13, 0.012, (0.0, 1.07 - 0.026 * k)), 0.2295) for k in range(7)]
    assembly.add("plate_lines", "sign/black", *lines)
    door = [_arc_sheet(0.2275, -48, 48, 0.32, 1.12)]
    assembly.add("door", paint, *door)
    assembly.add(
        "lock",
        "metal/brass",
        cylinder(0.014, 0.02, sides=12, axis="x").turned("z", 38).moved(0.228 * np.cos(0.663), 0.228 * np.sin(0.663), 0.75),
    )
    return BuiltAsset("clutter", ("post_box", "uk"), assembly.parts(paintable=("body", "door")), {})


def _arc_sheet(radius_m: float, start_deg: float, stop_deg: float, low_m: float, high_m: float) -> Shape:
    """A curved sheet about z, and its edges back to the body."""
    angle = np.deg2rad(np.linspace(start_deg, stop_deg, 15))
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    outer, inner = circle * radius_m, circle * (radius_m - 0.008)

    def at(points: Array, z: float) -> Array:
        return np.column_stack([points, np.full(len(points), z)])

    strips = [
        (at(outer, low_m), at(outer, high_m)),
        (at(outer, high_m), at(inner, high_m)),
        (at(inner, low_m), at(outer, low_m)),
    ]
    return quads(np.concatenate([np.stack([a[:-1], a[1:], b[1:], b[:-1]], axis=1) for a, b in strips])).smooth(30.0)


def cabinet(rng: np.random.Generator) -> BuiltAsset:
    """Return a telecoms cabinet: two doors with vents, a plinth, a sloped lid."""
    assembly = Assembly()
    wide, deep, high = 1.1, 0.36, 1.25
    assembly.add(
        "plinth", "concrete/grey", span((-deep / 2 - 0.02, -wide / 2 - 0.02, 0.0), (deep / 2 + 0.02, wide / 2 + 0.02, 0.12))
    )
    assembly.add("body", "coating/grey", span((-deep / 2, -wide / 2, 0.12), (deep / 2, wide / 2, high)))
    low = np.array(
        [
            (deep / 2 + 0.03, -wide / 2 - 0.03),
            (deep / 2 + 0.03, wide / 2 + 0.03),
            (-deep / 2 - 0.02, wide / 2 + 0.03),
            (-deep / 2 - 0.02, -wide / 2 - 0.03),
        ]
    )
    rings = [
        np.column_stack([low, np.full(4, high)]),
        np.column_stack([low, [high + 0.04, high + 0.04, high + 0.1, high + 0.1]]),
    ]
    assembly.add("lid", "coating/grey", loft(np.array(rings)))
    for a, b in ((-wide / 2 + 0.02, -0.006), (0.006, wide / 2 - 0.02)):
        assembly.add("doors", "coating/grey", span((deep / 2, a, 0.15), (deep / 2 + 0.012, b, high - 0.03)))
        levels = np.linspace(0.24, 0.44, 8)
        vents_low = np.column_stack([np.full(8, deep / 2 + 0.012), np.full(8, a + 0.12), levels])
        vents_high = np.column_stack([np.full(8, deep / 2 + 0.02), np.full(8, b - 0.12), levels + 0.012])
        assembly.add("vents", "plastic/black", boxes(vents_low, vents_high))
    assembly.add(
        "locks", "metal/steel_brushed", *(box((0.03, 0.03, 0.1), centre_m=(deep / 2 + 0.02, y, 0.75)) for y in (-0.08,))
    )
    assembly.add("label", "sign/yellow", filled(polygon(3, 0.07, turn_deg=90) + [0.28, 1.02], deep / 2 + 0.012 + 0.0015))
    assembly.add("label_mark", "sign/black", text("!", 0.06, deep / 2 + 0.012 + 0.003, centre_m=(0.28, 1.02)))
    return BuiltAsset("clutter", ("cabinet", "utility"), assembly.parts(paintable=("body", "doors", "lid")), {})


CLUTTER: tuple[StarterEntry, ...] = (
    StarterEntry("cone-50", "Traffic cone, 0.5 m", cone, {"height_m": 0.5}, 301),
    StarterEntry("cone-75", "Traffic cone, 0.75 m", cone, {"height_m": 0.75}, 302),
    StarterEntry("barrier-plastic-red", "Water-filled barrier, red", plastic_barrier, {"colour": "red"}, 311),
    StarterEntry("barrier-plastic-white", "Water-filled barrier, white", plastic_barrier, {"colour": "white"}, 312),
    StarterEntry("barrier-jersey", "Concrete barrier, New Jersey profile, 3 m", concrete_barrier, {}, 313),
    StarterEntry("barrier-crowd", "Crowd-control barrier, 2.3 m", crowd_barrier, {}, 314),
    StarterEntry("barrier-roadworks", "Roadworks board with warning lamps", roadworks_board, {}, 315),
    StarterEntry("clutter-pallet", "EUR pallet", pallet, {}, 321),
    StarterEntry("clutter-boxes", "Cardboard boxes", cardboard, {}, 322),
    StarterEntry("clutter-skip", "Builder's skip with rubble", skip_container, {}, 323),
    StarterEntry("clutter-planter", "Planter with box ball", planter, {}, 324),
    StarterEntry("clutter-hydrant", "Hydrant, red", hydrant, {}, 325),
    StarterEntry("clutter-bollard", "Bollard", bollard, {}, 326),
    StarterEntry("clutter-post-box", "Pillar post box, red", post_box, {}, 327),
    StarterEntry("clutter-cabinet", "Telecoms cabinet", cabinet, {}, 328),
)
"""All cones, barriers and clutter of the starter library."""
