"""Triangles for generators: boxes, tubes, lofts, surfaces of revolution; joined, moved, smoothed or faceted.

Metres, z up, counter-clockwise faces seen from outside. A shape without `normals` is shaded flat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Shape",
    "box",
    "cylinder",
    "extrusion",
    "grid_surface",
    "joined",
    "loft",
    "quad",
    "revolution",
    "sphere",
    "tube",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Triangles: (n, 3) vertices [m], (m, 3) faces, (n, 3) unit normals or None, (n, 2) texture coordinates or None."""

    vertices_m: Array
    faces: NDArray[np.int64]
    normals: Array | None = None
    uv: Array | None = None

    def moved(self, x_m: float = 0.0, y_m: float = 0.0, z_m: float = 0.0) -> Shape:
        """Return it shifted."""
        return replace(self, vertices_m=self.vertices_m + np.array([x_m, y_m, z_m]))

    def scaled(self, x: float, y: float | None = None, z: float | None = None) -> Shape:
        """Return it scaled about the origin, by one factor or one for each axis; all positive."""
        factors = np.array([x, x if y is None else y, x if z is None else z], dtype=np.float64)
        normals = None if self.normals is None else _unit(self.normals / factors)
        return replace(self, vertices_m=self.vertices_m * factors, normals=normals)

    def turned(self, axis: str, angle_deg: float) -> Shape:
        """Return it turned about the x, y or z axis through the origin, counter-clockwise seen against the axis."""
        first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
        cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
        matrix = np.eye(3)
        matrix[first, first] = matrix[second, second] = cosine
        matrix[first, second], matrix[second, first] = -sine, sine
        return self.transformed(matrix)

    def transformed(self, matrix: ArrayLike) -> Shape:
        """Return it under a (3, 3) rotation."""
        rotation = np.asarray(matrix, dtype=np.float64)
        normals = None if self.normals is None else self.normals @ rotation.T
        return replace(self, vertices_m=self.vertices_m @ rotation.T, normals=normals)

    def mirrored(self) -> Shape:
        """Return its mirror image in the xz plane: left becomes right, and faces stay outward."""
        flip = np.array([1.0, -1.0, 1.0])
        normals = None if self.normals is None else self.normals * flip
        return replace(self, vertices_m=self.vertices_m * flip, faces=self.faces[:, ::-1], normals=normals)

    def flat(self) -> Shape:
        """Return it without normals: shaded flat."""
        return replace(self, normals=None)

    def smooth(self, crease_deg: float = 40.0) -> Shape:
        """Return it with vertex normals averaged, by angle, over faces that meet at less than `crease_deg`.

        Coincident vertices count as one, so seams do not show; vertices are split where edges are sharper.
        """
        corners = self.vertices_m[self.faces]
        edges = corners[:, [1, 2, 0]] - corners
        normal = np.cross(edges[:, 0], -edges[:, 2])
        face_normal = _unit(normal)
        directions = _unit(edges)
        angle = np.arccos(np.clip(-(directions * np.roll(directions, 1, axis=1)).sum(axis=2), -1.0, 1.0))
        keys = np.round(self.vertices_m / 1e-6).astype(np.int64)
        _, place = np.unique(keys, axis=0, return_inverse=True)
        at = place.reshape(-1)[self.faces].ravel()  # place of each corner, three for each face
        face_of = np.repeat(np.arange(len(self.faces)), 3)
        order = np.argsort(at, kind="stable")
        starts = np.flatnonzero(np.diff(at[order], prepend=-1))
        sums = np.zeros((len(at), 3))
        limit = np.cos(np.deg2rad(crease_deg))
        for group in np.split(order, starts[1:]):
            around = face_normal[face_of[group]]
            near = around @ around.T >= limit
            sums[group] = (near * angle.ravel()[group]) @ around
        length = np.linalg.norm(sums, axis=1)
        bad = length < 1e-9
        sums[bad] = face_normal[face_of[bad]]
        corner_normals = _unit(sums)
        rows = np.concatenate([self.vertices_m[self.faces].reshape(-1, 3), corner_normals], axis=1)
        if self.uv is not None:
            rows = np.concatenate([rows, self.uv[self.faces].reshape(-1, 2)], axis=1)
        _, first, back = np.unique(np.round(rows, 7), axis=0, return_index=True, return_inverse=True)
        uv = None if self.uv is None else rows[first, 6:8]
        return Shape(rows[first, :3], back.reshape(-1, 3).astype(np.int64), rows[first, 3:6], uv)

    def bounds_m(self) -> Array:
        """(2, 3) lower and upper corner."""
        return np.array([self.vertices_m.min(axis=0), self.vertices_m.max(axis=0)])


def joined(shapes: Sequence[Shape]) -> Shape:
    """Return several shapes as one. Where only some have normals, the others get flat ones; texture coordinates likewise 0."""
    smooth = any(shape.normals is not None for shape in shapes)
    textured = any(shape.uv is not None for shape in shapes)
    parts = [_with_flat_normals(shape) if smooth and shape.normals is None else shape for shape in shapes]
    starts = np.cumsum([0, *(len(part.vertices_m) for part in parts)])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts[:-1], strict=True)])
    uv = [np.zeros((len(part.vertices_m), 2)) if part.uv is None else part.uv for part in parts]
    return Shape(
        np.concatenate([part.vertices_m for part in parts]),
        faces,
        np.concatenate([part.normals for part in parts if part.normals is not None]) if smooth else None,
        np.concatenate(uv) if textured else None,
    )


def box(size_m: Sequence[float], *, centre_m: Sequence[float] = (0.0, 0.0, 0.0)) -> Shape:
    """Return a box of edge lengths (x, y, z), with sharp edges."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    corners = signs * np.asarray(size_m, dtype=np.float64) / 2 + np.asarray(centre_m, dtype=np.float64)
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return Shape(corners, _fans(sides))


def quad(corners_m: ArrayLike) -> Shape:
    """Return four corners, counter-clockwise from the front, as two triangles with texture coordinates 0..1."""
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return Shape(np.asarray(corners_m, dtype=np.float64), _fans(np.array([[0, 1, 2, 3]])), None, uv)


def extrusion(outline_m: ArrayLike, height_m: float) -> Shape:
    """Return a convex or star-shaped outline (n, 2), counter-clockwise in the xy plane, raised along z, closed.

    Star-shaped as seen from its mean point, about which the ends are fanned.
    """
    outline = np.asarray(outline_m, dtype=np.float64)
    count = len(outline)
    low = np.column_stack([outline, np.zeros(count)])
    middle = np.append(outline.mean(axis=0), 0.0)
    vertices = np.concatenate([low, low + [0, 0, height_m], [middle, middle + [0, 0, height_m]]])
    here, there = np.arange(count), (np.arange(count) + 1) % count
    sides = _fans(np.stack([here, there, there + count, here + count], axis=1))
    bottom = np.stack([there, here, np.full(count, 2 * count)], axis=1)
    top = np.stack([here + count, there + count, np.full(count, 2 * count + 1)], axis=1)
    return Shape(vertices, np.concatenate([sides, bottom, top]))


def loft(rings_m: ArrayLike, *, closed_ring: bool = True, caps: bool = True) -> Shape:
    """Return a skin over (rings, points, 3) cross-sections of equal count.

    Seen from the last ring towards the first, each ring runs counter-clockwise (as circles about +z do when rings rise along
    +z): then faces point outwards. Caps are fans about each end ring's mean point.
    """
    rings = np.asarray(rings_m, dtype=np.float64)
    count, points = rings.shape[:2]
    index = np.arange(count * points).reshape(count, points)
    nxt = np.roll(index, -1, axis=1) if closed_ring else index[:, 1:]
    here = index if closed_ring else index[:, :-1]
    faces = _fans(np.stack([here[:-1], nxt[:-1], nxt[1:], here[1:]], axis=-1).reshape(-1, 4))
    vertices = rings.reshape(-1, 3)
    if caps and closed_ring:
        ends = np.stack([rings[0].mean(axis=0), rings[-1].mean(axis=0)])
        first, last = len(vertices), len(vertices) + 1
        vertices = np.concatenate([vertices, ends])
        start = np.stack([nxt[0], here[0], np.full(points, first)], axis=1)
        stop = np.stack([here[-1], nxt[-1], np.full(points, last)], axis=1)
        faces = np.concatenate([faces, start, stop])
    return Shape(vertices, faces)


def tube(path_m: ArrayLike, radius_m: ArrayLike, *, sides: int = 8, caps: bool = True) -> Shape:
    """Return a round tube along (n, 3) points, with one radius or one for each point; smooth."""
    path = np.asarray(path_m, dtype=np.float64)
    radius = np.broadcast_to(np.asarray(radius_m, dtype=np.float64), (len(path),))
    tangent = _unit(np.gradient(path, axis=0))
    helper = np.array([0.0, 0.0, 1.0]) if abs(tangent[0, 2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = np.empty_like(path)
    for row, direction in enumerate(tangent):  # carried along, so that the tube does not twist
        helper = helper - (helper @ direction) * direction
        helper = helper / max(float(np.linalg.norm(helper)), 1e-12)
        across[row] = helper
    up = np.cross(tangent, across)
    angle = np.arange(sides) * (2 * np.pi / sides)
    ring = np.cos(angle)[None, :, None] * across[:, None] + np.sin(angle)[None, :, None] * up[:, None]
    return loft(path[:, None] + radius[:, None, None] * ring, caps=caps).smooth(50.0)


def cylinder(radius_m: float, height_m: float, *, sides: int = 24, axis: str = "z") -> Shape:
    """Return a closed cylinder centred on the origin along an axis; round sides smooth, edges sharp."""
    half = height_m / 2
    shape = revolution([(0.0, -half), (radius_m, -half), (radius_m, half), (0.0, half)], sides=sides)
    return {"z": shape, "x": shape.turned("y", 90), "y": shape.turned("x", -90)}[axis]


def revolution(profile_m: ArrayLike, *, sides: int = 24, crease_deg: float = 40.0) -> Shape:
    """Return (n, 2) points (radius, z), from the bottom up along the outside, turned about z."""
    profile = np.asarray(profile_m, dtype=np.float64)
    angle = np.arange(sides) * (2 * np.pi / sides)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    rings = np.concatenate(
        [profile[:, None, :1] * circle[None], np.broadcast_to(profile[:, None, 1:], (len(profile), sides, 1))], axis=2
    )
    shape = loft(rings, caps=False)
    corners = shape.vertices_m[shape.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return replace(shape, faces=shape.faces[area > 1e-12]).smooth(crease_deg)


def sphere(radius_m: float, *, sides: int = 16) -> Shape:
    """Return a smooth sphere about the origin."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, sides // 2 + 1)
    return revolution(np.column_stack([np.cos(angle), np.sin(angle)]) * radius_m, sides=sides, crease_deg=80.0)


def grid_surface(points_m: ArrayLike) -> Shape:
    """Return a (rows, cols, 3) grid as triangles, uv 0..1; its front is where rows x cols points (columns along, rows up)."""
    points = np.asarray(points_m, dtype=np.float64)
    rows, cols = points.shape[:2]
    index = np.arange(rows * cols).reshape(rows, cols)
    faces = _fans(np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4))
    across, up = np.meshgrid(np.linspace(0, 1, cols), np.linspace(0, 1, rows))
    return Shape(points.reshape(-1, 3), faces, None, np.column_stack([across.ravel(), up.ravel()]))


def _with_flat_normals(shape: Shape) -> Shape:
    corners = shape.vertices_m[shape.faces]
    normal = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    uv = None if shape.uv is None else shape.uv[shape.faces].reshape(-1, 2)
    count = 3 * len(shape.faces)
    return Shape(corners.reshape(-1, 3), np.arange(count).reshape(-1, 3), np.repeat(normal, 3, axis=0), uv)


def _fans(polygons: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return four-cornered polygons as two triangles each."""
    return np.concatenate([polygons[:, [0, 1, 2]], polygons[:, [0, 2, 3]]]).astype(np.int64)


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 1e-12))
