"""Small parts of vehicles: rounded boxes, number plates with characters, mirrors, handles, wipers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fullwell.assets.starter.shapes import Shape, box, joined, loft, quad, tube

__all__ = [
    "door_handle",
    "lamp_lens",
    "mirror",
    "number_plate",
    "plate_text",
    "round_lens",
    "rounded_box",
    "segment_text",
    "wiper",
]


def rounded_box(
    size_m: Sequence[float], radius_m: float, *, centre_m: Sequence[float] = (0.0, 0.0, 0.0), steps: int = 3
) -> Shape:
    """Return a box of edge lengths (x, y, z) with rounded edges; smooth."""
    size = np.asarray(size_m, dtype=np.float64)
    radius = min(radius_m, 0.499 * float(size.min()))
    turn = np.linspace(0.0, np.pi / 2, steps + 1)
    signs = ((1, 1, 0.0), (-1, 1, 0.5), (-1, -1, 1.0), (1, -1, 1.5))
    rings = []
    heights = [(-size[2] / 2 + radius * (1 - np.cos(t)), np.sin(t)) for t in turn]
    heights += [(size[2] / 2 - radius * (1 - np.cos(t)), np.sin(t)) for t in turn[::-1]]
    for z, out in heights:
        ring = []
        for sx, sy, start in signs:
            for t in turn:
                angle = start * np.pi + t
                ring.append(
                    [
                        sx * (size[0] / 2 - radius) + radius * out * np.cos(angle),
                        sy * (size[1] / 2 - radius) + radius * out * np.sin(angle),
                        z,
                    ]
                )
        rings.append(ring)
    shape = loft(rings)
    corners = shape.vertices_m[shape.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return replace(shape, faces=shape.faces[area > _NO_AREA_M2]).smooth(50).moved(*(float(value) for value in centre_m))


_NO_AREA_M2 = 1e-11
"""Where an edge's radius leaves nothing of a side, faces of no area are left out."""


_SEGMENTS = {
    # Strokes (x0, y0, x1, y1) in a cell 1 wide and 2 high.
    "a": (0, 2, 1, 2),
    "b": (1, 1, 1, 2),
    "c": (1, 0, 1, 1),
    "d": (0, 0, 1, 0),
    "e": (0, 0, 0, 1),
    "f": (0, 1, 0, 2),
    "g": (0, 1, 1, 1),
}
_CHARACTERS = {
    "0": "abcdef",
    "1": "bc",
    "2": "abged",
    "3": "abgcd",
    "4": "fgbc",
    "5": "afgcd",
    "6": "afgedc",
    "7": "abc",
    "8": "abcdefg",
    "9": "abcdfg",
    "A": "abcefg",
    "C": "afed",
    "E": "afged",
    "F": "afge",
    "H": "befcg",
    "J": "bcde",
    "L": "fed",
    "P": "abfge",
    "U": "bcdef",
}


def number_plate(width_m: float = 0.52, height_m: float = 0.11) -> Shape:
    """Return a plate facing +x, its back at x = 0; 520 x 110 mm is the common European size."""
    return rounded_box((0.004, width_m, height_m), 0.0019, centre_m=(0.002, 0.0, 0.0), steps=1)


def plate_text(rng: np.random.Generator, *, height_m: float = 0.075) -> Shape:
    """Return dark characters for a plate facing +x, a hair before x = 0.004; made up anew from `rng`."""
    letters = "ACEFHJLPU"
    text = "".join(rng.choice(list(letters), 2)) + " " + "".join(rng.choice(list(letters), 2)) + " "
    text += "".join(str(digit) for digit in rng.integers(0, 10, 3))
    return segment_text(text, height_m).moved(0.0045)


def segment_text(text: str, height_m: float) -> Shape:
    """Return characters made of straight strokes (digits and ACEFHJLPU) facing +x in the plane x = 0, centred."""
    cell, stroke = height_m / 2 * 0.86, height_m * 0.13
    pitch = cell + 0.3 * height_m
    bars = []
    for place, character in enumerate(text):
        left = (place - len(text) / 2) * pitch + 0.15 * height_m  # seen from the front, +y is on the right
        for segment in _CHARACTERS.get(character, ""):
            x0, y0, x1, y1 = _SEGMENTS[segment]
            wide = abs(x1 - x0) * cell + stroke
            tall = abs(y1 - y0) * (height_m - stroke) / 2 + stroke
            y = left + (x0 + x1) / 2 * cell
            z = (y0 + y1 - 2) / 2 * (height_m - stroke) / 2
            bars.append(_upright(0.0, y, z, wide, tall))
    return joined(bars)


def lamp_lens(width_m: float, height_m: float, *, depth_m: float = 0.015) -> Shape:
    """Return a lamp's cover facing +x, rounded, its foot at x = 0; open behind, so that a lit one shines forward only."""
    return _dome(width_m, height_m, depth_m, 6.0)


def round_lens(radius_m: float, *, depth_m: float = 0.015) -> Shape:
    """Return a round lamp's cover facing +x, its foot at x = 0; open behind."""
    return _dome(2 * radius_m, 2 * radius_m, depth_m, 2.0)


def _dome(width_m: float, height_m: float, depth_m: float, power: float) -> Shape:
    angle = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    c, s = np.cos(angle), np.sin(angle)
    radius = (np.abs(c) ** power + np.abs(s) ** power) ** (-1 / power)
    rings = [
        np.stack([np.full(24, out * depth_m), share * width_m / 2 * radius * c, share * height_m / 2 * radius * s], axis=-1)
        for out, share in ((0.0, 1.0), (0.5, 0.99), (0.8, 0.92), (0.95, 0.7), (1.0, 0.35), (1.0, 0.001))
    ]
    return loft(rings, caps=False).smooth(50)


def _upright(x: float, y: float, z: float, wide: float, tall: float) -> Shape:
    w, t = wide / 2, tall / 2
    return quad([(x, y - w, z - t), (x, y + w, z - t), (x, y + w, z + t), (x, y - w, z + t)])


def mirror(width_m: float = 0.22, height_m: float = 0.14, *, reach_m: float = 0.26) -> tuple[Shape, Shape, Shape]:
    """Return housing, arm and glass of a left door mirror; its foot at the origin, the housing up to `reach_m` outwards."""
    out = reach_m - width_m / 2
    rings = []
    for share, grow in ((-0.045, 1.0), (-0.03, 1.03), (0.01, 0.98), (0.04, 0.84), (0.06, 0.6), (0.068, 0.3)):
        angle = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
        c, s = np.cos(angle), np.sin(angle)
        round_ = (np.abs(c) ** 3.5 + np.abs(s) ** 3.5) ** (-1 / 3.5)
        y = out + 0.5 * width_m * grow * round_ * c
        z = 0.55 * height_m + 0.5 * height_m * grow * round_ * s * (1 - 0.12 * c)
        rings.append(np.stack([np.full(24, share), y, z], axis=-1))
    housing = loft(rings).smooth(50)
    glass_ring = np.array(rings[0])
    glass_ring = glass_ring.mean(axis=0) + (glass_ring - glass_ring.mean(axis=0)) * 0.9
    # Facing backwards, a little before the housing's rim.
    glass = loft(np.stack([glass_ring - [0.004, 0, 0], glass_ring - [0.001, 0, 0]])).smooth(30)
    arm = tube([(0.0, -0.03, 0.0), (0.005, 0.03, 0.015), (0.005, out - 0.3 * width_m, 0.25 * height_m)], [0.028, 0.024, 0.02])
    return housing, arm, glass


def door_handle(length_m: float = 0.17) -> Shape:
    """Return a bar handle along x for a left door; the door's skin at y = 0."""
    bar = rounded_box((length_m, 0.016, 0.026), 0.007, centre_m=(0.0, 0.032, 0.0), steps=2)
    feet = [box((0.03, 0.04, 0.018), centre_m=(side * (length_m / 2 - 0.022), 0.012, 0.0)) for side in (-1, 1)]
    return joined([bar, *feet])


def wiper(start_m: ArrayLike, stop_m: ArrayLike, *, radius_m: float = 0.008) -> Shape:
    """Return a wiper's blade between two points."""
    return tube(np.array([start_m, stop_m], dtype=np.float64), radius_m, sides=5)
