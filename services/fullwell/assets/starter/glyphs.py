"""Flat drawings for signs: filled outlines, rings, ribbons, arrows, and a plain stroke alphabet of our own.

Drawn in the plane x = const facing +x; coordinates are (y, z) [m], y to the right for who reads the sign.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.assets.starter.assembly import quads
from fullwell.assets.starter.shapes import Shape, joined

__all__ = ["arrow", "circle", "filled", "polygon", "rectangle", "ribbon", "ring", "rounded", "text", "walker"]

Array = NDArray[np.float64]
Points = Sequence[tuple[float, float]]


def circle(radius_m: float, centre_m: tuple[float, float] = (0.0, 0.0), *, sides: int = 40) -> Array:
    """(n, 2) points of a circle, counter-clockwise."""
    angle = np.arange(sides) * (2 * np.pi / sides)
    return np.asarray(np.column_stack([np.cos(angle), np.sin(angle)]) * radius_m + np.array(centre_m))


def polygon(corners: int, radius_m: float, *, turn_deg: float = 0.0) -> Array:
    """(n, 2) corners of a regular polygon; the first at `turn_deg` from +y."""
    angle = np.arange(corners) * (2 * np.pi / corners) + np.deg2rad(turn_deg)
    return np.asarray(np.column_stack([np.cos(angle), np.sin(angle)]) * radius_m)


def rectangle(width_m: float, height_m: float, centre_m: tuple[float, float] = (0.0, 0.0)) -> Array:
    """(4, 2) corners, counter-clockwise."""
    half = np.array([width_m, height_m]) / 2
    return np.asarray(np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * half + np.array(centre_m))


def rounded(corners_m: ArrayLike, radius_m: float, *, steps: int = 4) -> Array:
    """Return a convex outline, counter-clockwise, with its corners rounded."""
    corner = np.asarray(corners_m, dtype=np.float64)
    points = []
    for before, here, after in zip(np.roll(corner, 1, axis=0), corner, np.roll(corner, -1, axis=0), strict=True):
        arrive, leave = _unit(here - before), _unit(after - here)
        turn = float(np.arctan2(arrive[0] * leave[1] - arrive[1] * leave[0], arrive @ leave))
        start = here - arrive * radius_m * np.tan(turn / 2)
        centre = start + radius_m * np.array([-arrive[1], arrive[0]])
        first = np.arctan2(*(start - centre)[::-1])
        angle = first + np.linspace(0.0, turn, steps + 1)
        points.append(centre + radius_m * np.column_stack([np.cos(angle), np.sin(angle)]))
    return np.concatenate(points)


def filled(outline_m: ArrayLike, x_m: float) -> Shape:
    """Return a star-shaped outline, counter-clockwise, filled; it faces +x."""
    outline = np.asarray(outline_m, dtype=np.float64)
    count = len(outline)
    flat = np.vstack([outline, outline.mean(axis=0)])
    here = np.arange(count)
    faces = np.stack([here, (here + 1) % count, np.full(count, count)], axis=1).astype(np.int64)
    return Shape(np.column_stack([np.full(count + 1, x_m), flat]), faces)


def ring(outer_m: ArrayLike, inner_m: ArrayLike, x_m: float) -> Shape:
    """Return the band between two outlines of equally many points; it faces +x."""
    outer, inner = np.asarray(outer_m, dtype=np.float64), np.asarray(inner_m, dtype=np.float64)
    loops = [outer, np.roll(outer, -1, axis=0), np.roll(inner, -1, axis=0), inner]
    corners = np.stack([np.column_stack([np.full(len(loop), x_m), loop]) for loop in loops], axis=1)
    return quads(corners)


def ribbon(path_m: ArrayLike, width_m: float, x_m: float) -> Shape:
    """Return a line of a width along (n, 2) points, mitred at its corners; a path that ends where it began is closed."""
    path = np.asarray(path_m, dtype=np.float64)
    closed = bool(np.allclose(path[0], path[-1]))
    steps = np.diff(path, axis=0)
    normal = _unit(np.column_stack([-steps[:, 1], steps[:, 0]]))
    before = np.vstack([normal[-1] if closed else normal[0], normal])
    after = np.vstack([normal, normal[0] if closed else normal[-1]])
    mitre = before + after
    # A mitre grows without bound at a hairpin; four times the half width is as pointed as letters need.
    scale = 2.0 / np.maximum((mitre**2).sum(axis=1, keepdims=True), 0.5)
    offset = mitre * scale * width_m / 2
    left, right = path + offset, path - offset
    loops = [right[:-1], right[1:], left[1:], left[:-1]]
    return quads(np.stack([np.column_stack([np.full(len(loop), x_m), loop]) for loop in loops], axis=1))


def arrow(
    length_m: float, width_m: float, x_m: float, *, turn_deg: float = 0.0, centre_m: tuple[float, float] = (0.0, 0.0)
) -> Shape:
    """Return an arrow that points up, or `turn_deg` counter-clockwise from it to the reader; `width_m` is the shaft's."""
    half, head = length_m / 2, 1.5 * width_m
    shaft = np.array([(-width_m / 2, -half), (width_m / 2, -half), (width_m / 2, half - head), (-width_m / 2, half - head)])
    tip = np.array([(-1.5 * width_m, half - head), (1.5 * width_m, half - head), (0.0, half)])
    cosine, sine = np.cos(np.deg2rad(turn_deg)), np.sin(np.deg2rad(turn_deg))
    matrix = np.array([[cosine, sine], [-sine, cosine]])
    return joined([filled(part @ matrix + np.array(centre_m), x_m) for part in (shaft, tip)])


def walker(height_m: float, x_m: float, *, standing: bool = False, centre_m: tuple[float, float] = (0.0, 0.0)) -> Shape:
    """Return a person, walking to the left or standing, of a height."""
    head = filled(circle(0.075, (0.0, 0.42), sides=20), x_m)
    if standing:
        strokes: list[tuple[Points, float]] = [
            (((0.0, 0.33), (0.0, 0.0)), 0.18),
            (((-0.05, 0.0), (-0.05, -0.5)), 0.08),
            (((0.05, 0.0), (0.05, -0.5)), 0.08),
            (((-0.13, 0.32), (-0.13, 0.0)), 0.06),
            (((0.13, 0.32), (0.13, 0.0)), 0.06),
        ]
    else:
        strokes = [
            (((0.0, 0.33), (0.02, -0.02)), 0.15),
            (((0.0, 0.0), (-0.12, -0.22), (-0.14, -0.5)), 0.085),
            (((0.03, 0.0), (0.1, -0.24), (0.24, -0.47)), 0.085),
            (((-0.03, 0.3), (-0.15, 0.14), (-0.24, 0.06)), 0.055),
            (((0.03, 0.3), (0.13, 0.12), (0.1, -0.02)), 0.055),
        ]
    whole = joined([head, *(ribbon(path, width, x_m) for path, width in strokes)])
    vertices = whole.vertices_m * np.array([1.0, height_m, height_m]) + np.array([0.0, *centre_m])
    return Shape(vertices, whole.faces)


def text(words: str, height_m: float, x_m: float, *, centre_m: tuple[float, float] = (0.0, 0.0), weight: float = 0.16) -> Shape:
    """Return capital letters and digits of a height, centred; `weight` is the stroke's width over the height."""
    step = 0.82
    width = step * len(words) - (step - 0.6)
    shapes = []
    for number, letter in enumerate(words.upper()):
        for path in _LETTERS[letter]:
            points = np.asarray(path, dtype=np.float64) * np.array([0.6 - weight, 1.0 - weight]) + weight / 2
            points[:, 0] += number * step - width / 2
            points[:, 1] -= 0.5
            shapes.append(ribbon(points * height_m + np.array(centre_m), weight * height_m, x_m))
    return joined(shapes)


def _arc(
    centre: tuple[float, float], radius: tuple[float, float], start_deg: float, stop_deg: float
) -> list[tuple[float, float]]:
    angle = np.deg2rad(np.linspace(start_deg, stop_deg, max(int(abs(stop_deg - start_deg) / 22.5) + 1, 3)))
    return [(centre[0] + radius[0] * float(np.cos(a)), centre[1] + radius[1] * float(np.sin(a))) for a in angle]


_OVAL = _arc((0.5, 0.5), (0.5, 0.5), 90, 450)
_BOWL = [(0.0, 1.0), (0.5, 1.0), *_arc((0.5, 0.74), (0.5, 0.26), 90, -90)[1:], (0.0, 0.48)]
_ESS = [
    *_arc((0.5, 0.74), (0.5, 0.26), 40, 270),
    *_arc((0.5, 0.25), (0.5, 0.25), 90, -140)[1:],
]
_LETTERS: Mapping[str, list[list[tuple[float, float]]]] = MappingProxyType(
    {
        " ": [],
        "A": [[(0, 0), (0.5, 1), (1, 0)], [(0.2, 0.36), (0.8, 0.36)]],
        "B": [[(0, 0), (0, 1)], _BOWL, [(0, 0.48), (0.5, 0.48), *_arc((0.5, 0.24), (0.5, 0.24), 90, -90)[1:], (0, 0)]],
        "C": [_arc((0.5, 0.5), (0.5, 0.5), 45, 315)],
        "D": [[(0, 0), (0, 1)], [(0, 1), (0.4, 1), *_arc((0.4, 0.5), (0.6, 0.5), 90, -90)[1:], (0, 0)]],
        "E": [[(1, 1), (0, 1), (0, 0), (1, 0)], [(0, 0.5), (0.8, 0.5)]],
        "F": [[(1, 1), (0, 1), (0, 0)], [(0, 0.5), (0.8, 0.5)]],
        "G": [[*_arc((0.5, 0.5), (0.5, 0.5), 45, 335), (1, 0.45), (0.55, 0.45)]],
        "H": [[(0, 0), (0, 1)], [(1, 0), (1, 1)], [(0, 0.5), (1, 0.5)]],
        "I": [[(0.5, 0), (0.5, 1)]],
        "J": [[(1, 1), (1, 0.3), *_arc((0.5, 0.3), (0.5, 0.3), 0, -160)[1:]]],
        "K": [[(0, 0), (0, 1)], [(1, 1), (0.1, 0.5), (1, 0)]],
        "L": [[(0, 1), (0, 0), (1, 0)]],
        "M": [[(0, 0), (0, 1), (0.5, 0.4), (1, 1), (1, 0)]],
        "N": [[(0, 0), (0, 1), (1, 0), (1, 1)]],
        "O": [_OVAL],
        "P": [[(0, 0), (0, 1)], _BOWL],
        "Q": [_OVAL, [(0.6, 0.3), (1, -0.05)]],
        "R": [[(0, 0), (0, 1)], _BOWL, [(0.4, 0.48), (1, 0)]],
        "S": [_ESS],
        "T": [[(0.5, 0), (0.5, 1)], [(0, 1), (1, 1)]],
        "U": [[(0, 1), (0, 0.35), *_arc((0.5, 0.35), (0.5, 0.35), 180, 360)[1:], (1, 1)]],
        "V": [[(0, 1), (0.5, 0), (1, 1)]],
        "W": [[(0, 1), (0.25, 0), (0.5, 0.7), (0.75, 0), (1, 1)]],
        "X": [[(0, 0), (1, 1)], [(0, 1), (1, 0)]],
        "Y": [[(0, 1), (0.5, 0.5), (1, 1)], [(0.5, 0.5), (0.5, 0)]],
        "Z": [[(0, 1), (1, 1), (0, 0), (1, 0)]],
        "0": [_OVAL],
        "1": [[(0.2, 0.75), (0.6, 1), (0.6, 0)]],
        "2": [[*_arc((0.5, 0.7), (0.5, 0.3), 160, -30), (0, 0), (1, 0)]],
        "3": [_arc((0.45, 0.75), (0.5, 0.25), 140, -90), _arc((0.45, 0.25), (0.55, 0.25), 90, -140)],
        "4": [[(0.75, 0), (0.75, 1), (0, 0.3), (1, 0.3)]],
        "5": [[(0.95, 1), (0.1, 1), (0.05, 0.52), *_arc((0.45, 0.32), (0.55, 0.32), 110, -140)]],
        "6": [[(0.85, 1), (0.25, 0.65), *_arc((0.5, 0.3), (0.5, 0.3), 150, 510)]],
        "7": [[(0, 1), (1, 1), (0.35, 0)]],
        "8": [_arc((0.5, 0.75), (0.42, 0.25), 90, 450), _arc((0.5, 0.25), (0.5, 0.25), 90, 450)],
        "9": [[(0.15, 0), (0.75, 0.35), *_arc((0.5, 0.7), (0.5, 0.3), -30, 330)]],
        "!": [[(0.5, 0.3), (0.5, 1)], [(0.5, 0), (0.5, 0.12)]],
        "-": [[(0.1, 0.45), (0.9, 0.45)]],
    }
)


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12))
