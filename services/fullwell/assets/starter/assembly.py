"""Collecting many small shapes into the named parts of a built or made thing."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.assets.starter.building import BuiltPart
from fullwell.assets.starter.shapes import Shape, joined, loft

__all__ = ["Assembly", "boxes", "quads", "round_box", "span"]

Array = NDArray[np.float64]


class Assembly:
    """Shapes by part, in the order in which parts are first named; each part has one material of the catalogue.

    A part named again with another material is a part of its own: the material's last word is set behind the name, so that
    doors of oak and doors of grey paint are `doors` and `doors_grey`.
    """

    def __init__(self) -> None:
        self._shapes: dict[tuple[str, str], list[Shape]] = {}

    def add(self, part: str, material: str, *shapes: Shape) -> None:
        """Add shapes to a part."""
        self._shapes.setdefault((part, material), []).extend(shape for shape in shapes if len(shape.faces))

    def place(self, other: Assembly, *, turn_deg: float = 0.0, x_m: float = 0.0, y_m: float = 0.0, z_m: float = 0.0) -> None:
        """Add everything of another assembly, turned about z and then shifted."""
        for (part, material), shapes in other._shapes.items():
            if shapes:
                whole = joined(shapes)
                turned = whole.turned("z", turn_deg) if turn_deg else whole
                self.add(part, material, turned.moved(x_m, y_m, z_m))

    def parts(self, paintable: Collection[str] = ()) -> tuple[BuiltPart, ...]:
        """Return the parts that hold triangles; `paintable` names those that a recipe may give another paint."""
        first: dict[str, str] = {}
        parts = []
        for (part, material), shapes in self._shapes.items():
            if shapes:
                plain = first.setdefault(part, material) == material
                name = part if plain else f"{part}_{material.rpartition('/')[2]}"
                parts.append(BuiltPart(name, joined(shapes), material, part in paintable))
        return tuple(parts)


def span(low_m: Sequence[float], high_m: Sequence[float]) -> Shape:
    """Return the box between two corners."""
    return boxes([low_m], [high_m])


def boxes(low_m: ArrayLike, high_m: ArrayLike) -> Shape:
    """Return many boxes between (n, 3) lower and upper corners, with sharp edges."""
    low, high = np.atleast_2d(np.asarray(low_m, dtype=np.float64)), np.atleast_2d(np.asarray(high_m, dtype=np.float64))
    pick = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=bool)
    corners = np.where(pick[None], high[:, None], low[:, None])
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    polygons = (np.arange(len(low))[:, None, None] * 8 + sides[None]).reshape(-1, 4)
    faces = np.concatenate([polygons[:, [0, 1, 2]], polygons[:, [0, 2, 3]]]).astype(np.int64)
    return Shape(corners.reshape(-1, 3), faces)


def quads(corners_m: ArrayLike) -> Shape:
    """Return (n, 4, 3) four-cornered faces, counter-clockwise from their front; those without an area are left out."""
    corners = np.asarray(corners_m, dtype=np.float64).reshape(-1, 4, 3)
    start = np.arange(len(corners), dtype=np.int64)[:, None] * 4
    faces = np.concatenate([start + np.array([[0, 1, 2]]), start + np.array([[0, 2, 3]])])
    vertices = corners.reshape(-1, 3)
    at = vertices[faces]
    area = np.linalg.norm(np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]), axis=1)
    return Shape(vertices, faces[area > 1e-8])


def round_box(size_m: Sequence[float], radius_m: float, *, steps: int = 3) -> Shape:
    """Return a box (x, y, z) standing on z = 0, its upright and upper edges rounded; smooth."""
    turn = np.linspace(0.0, np.pi / 2, steps + 1)
    rings = [_rounded_ring(size_m, radius_m, 0.0, 0.0, turn)]
    for angle in turn:
        inset, drop = radius_m * (1 - np.cos(angle)), radius_m * (1 - np.sin(angle))
        rings.append(_rounded_ring(size_m, radius_m, inset, size_m[2] - drop, turn))
    return loft(np.array(rings)).smooth(50.0)


def _rounded_ring(size_m: Sequence[float], radius_m: float, inset_m: float, z_m: float, turn: Array) -> Array:
    radius = max(radius_m - inset_m, 1e-4)
    corner = np.column_stack([np.cos(turn), np.sin(turn)]) * radius
    half = np.array(size_m[:2]) / 2 - inset_m - radius
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    flat = [
        corner @ np.linalg.matrix_power(quarter, number).T + half * np.array(signs)
        for number, signs in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1)))
    ]
    outline = np.concatenate(flat)
    return np.column_stack([outline, np.full(len(outline), z_m)])
