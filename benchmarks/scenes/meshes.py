"""Triangle meshes for the benchmark scenes: made by code from a few numbers, written as PLY files."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Triangles",
    "block",
    "box_quads",
    "capsule",
    "ellipsoid",
    "join",
    "loft",
    "moved",
    "panel",
    "quads",
    "revolve",
    "scaled",
    "shaded",
    "tube",
    "turned",
    "write_ply",
]


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """`vertices_m` (n, 3), `faces` (m, 3) counter-clockwise seen from outside, `normals` (n, 3) unit vectors."""

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int64]
    normals: NDArray[np.float64]


def shaded(vertices_m: ArrayLike, faces: ArrayLike, *, crease_deg: float = 40.0) -> Triangles:
    """Return a mesh whose normals are smooth across edges flatter than `crease_deg`; triangles without area are dropped."""
    points = np.asarray(vertices_m, dtype=np.float64)
    _, first, merged = np.unique(np.round(points, 7), axis=0, return_index=True, return_inverse=True)
    points, indices = points[first], merged.reshape(-1)[np.asarray(faces, dtype=np.int64)]
    corners = points[indices]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(area, axis=1)
    keep = size > 1e-10
    indices, area, size = indices[keep], area[keep], size[keep]
    unit = area / size[:, None]
    vertex, face = indices.reshape(-1), np.repeat(np.arange(len(indices)), 3)
    left, right = _corner_pairs(vertex)
    near = np.einsum("ij,ij->i", unit[face[left]], unit[face[right]]) > math.cos(math.radians(crease_deg))
    sums = np.zeros((len(vertex), 3))
    np.add.at(sums, left[near], area[face[right[near]]])
    sums /= np.linalg.norm(sums, axis=1, keepdims=True)
    keys = np.column_stack([vertex, np.round(sums * 2000).astype(np.int64)])
    _, kept, corner = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return Triangles(points[vertex[kept]], corner.reshape(-1, 3), sums[kept])


def _corner_pairs(vertex: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return all ordered pairs (also of one with itself) of corners that lie on the same vertex."""
    order = np.argsort(vertex, kind="stable")
    counts = np.bincount(vertex)
    counts = counts[counts > 0]
    starts = np.cumsum(counts) - counts
    repeats = np.repeat(counts, counts)
    left = np.repeat(np.arange(len(vertex)), repeats)
    within = np.arange(len(left)) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    right = np.repeat(np.repeat(starts, counts), repeats) + within
    return order[left], order[right]


# Putting together ----------------------------------------------------------------------------------------------------


def join(meshes: Iterable[Triangles]) -> Triangles:
    """Return the meshes as one."""
    parts = list(meshes)
    starts = np.cumsum([0, *(len(part.vertices_m) for part in parts)])
    return Triangles(
        np.concatenate([part.vertices_m for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
        np.concatenate([part.normals for part in parts]),
    )


def moved(mesh: Triangles, offset_m: ArrayLike) -> Triangles:
    """Return the mesh moved by `offset_m`."""
    return Triangles(mesh.vertices_m + np.asarray(offset_m, dtype=np.float64), mesh.faces, mesh.normals)


def turned(mesh: Triangles, axis: str, angle_deg: float) -> Triangles:
    """Return the mesh turned about a coordinate axis, counter-clockwise seen from its tip."""
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    matrix = {
        "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }
    turn = np.array(matrix[axis], dtype=np.float64)
    return Triangles(mesh.vertices_m @ turn.T, mesh.faces, mesh.normals @ turn.T)


def scaled(mesh: Triangles, factors: ArrayLike) -> Triangles:
    """Return the mesh stretched by three positive factors."""
    stretch = np.asarray(factors, dtype=np.float64)
    normals = mesh.normals / stretch
    return Triangles(mesh.vertices_m * stretch, mesh.faces, normals / np.linalg.norm(normals, axis=1, keepdims=True))


# Shapes --------------------------------------------------------------------------------------------------------------


def block(size_m: Sequence[float], centre_m: Sequence[float] = (0.0, 0.0, 0.0)) -> Triangles:
    """Return a box."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [triangle for a, b, c, d in sides for triangle in ((a, b, c), (a, c, d))]
    return shaded(corners * np.asarray(size_m) + np.asarray(centre_m), faces)


def panel(corners_m: ArrayLike) -> Triangles:
    """Return one flat quadrilateral, front where its corners run counter-clockwise."""
    return shaded(corners_m, [[0, 1, 2], [0, 2, 3]])


def quads(corners_m: ArrayLike) -> Triangles:
    """Return flat quadrilaterals (n, 4, 3), fronts where their corners run counter-clockwise; no vertex is shared.

    Those without area are left out.
    """
    corners = np.asarray(corners_m, dtype=np.float64).reshape(-1, 4, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    corners, normals = corners[size[:, 0] > 0], normals[size[:, 0] > 0] / size[size[:, 0] > 0]
    starts = 4 * np.arange(len(corners))[:, None, None]
    faces = (starts + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    return Triangles(corners.reshape(-1, 3), faces, np.repeat(normals, 4, axis=0))


def box_quads(low_m: Sequence[float], high_m: Sequence[float]) -> list[list[tuple[float, float, float]]]:
    """Return the six sides of a box between two corners, for `quads`."""
    (a, b, c), (d, e, f) = low_m, high_m
    return [
        [(a, b, c), (a, e, c), (d, e, c), (d, b, c)],
        [(a, b, f), (d, b, f), (d, e, f), (a, e, f)],
        [(a, b, c), (d, b, c), (d, b, f), (a, b, f)],
        [(a, e, c), (a, e, f), (d, e, f), (d, e, c)],
        [(a, b, c), (a, b, f), (a, e, f), (a, e, c)],
        [(d, b, c), (d, e, c), (d, e, f), (d, b, f)],
    ]


def loft(rings_m: ArrayLike, *, closed: bool = True, capped: bool = False, crease_deg: float = 40.0) -> Triangles:
    """Return the surface through rings (k, n, 3) of as many points each; outside is where rings turn right-handed upwards.

    `closed` joins the last point of each ring with the first, `capped` closes both ends with fans.
    """
    rings = np.asarray(rings_m, dtype=np.float64)
    count, around = rings.shape[:2]
    index = np.arange(count * around).reshape(count, around)
    following = np.roll(index, -1, axis=1) if closed else index[:, 1:]
    here = index if closed else index[:, :-1]
    a, b, c, d = here[:-1], following[:-1], following[1:], here[1:]
    faces = [np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)]
    points = rings.reshape(-1, 3)
    if capped:
        middles = np.array([rings[0].mean(axis=0), rings[-1].mean(axis=0)])
        base, top = len(points), len(points) + 1
        points = np.concatenate([points, middles])
        faces.append(np.stack([following[0], here[0], np.full(here.shape[1], base)], axis=-1))
        faces.append(np.stack([here[-1], following[-1], np.full(here.shape[1], top)], axis=-1))
    return shaded(points, np.concatenate(faces), crease_deg=crease_deg)


def revolve(profile_m: ArrayLike, *, segments: int = 32, crease_deg: float = 40.0) -> Triangles:
    """Return the body of revolution about z of a profile of (radius, height); up the outside, down the inside."""
    profile = np.asarray(profile_m, dtype=np.float64)
    angle = np.arange(segments) * (2 * math.pi / segments)
    radius, height = profile[:, 0, None], np.broadcast_to(profile[:, 1, None], (len(profile), segments))
    return loft(np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1), crease_deg=crease_deg)


def ellipsoid(half_axes_m: ArrayLike, centre_m: ArrayLike = (0.0, 0.0, 0.0), *, segments: int = 12) -> Triangles:
    """Return an ellipsoid."""
    tilt = np.linspace(-math.pi / 2, math.pi / 2, segments // 2 + 1)
    ball = revolve(np.column_stack([np.cos(tilt), np.sin(tilt)]), segments=segments, crease_deg=80)
    return moved(scaled(ball, half_axes_m), centre_m)


def tube(points_m: ArrayLike, radii_m: Sequence[float], *, segments: int = 8, capped: bool = True) -> Triangles:
    """Return a tube along a line of points with a radius at each."""
    points = np.asarray(points_m, dtype=np.float64)
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    helper = np.array([1.0, 0, 0]) if abs(along[0, 0]) < 0.9 else np.array([0, 1.0, 0])
    angle = np.arange(segments) * (2 * math.pi / segments)
    rings = []
    for point, axis, radius in zip(points, along, radii_m, strict=True):
        side = np.cross(axis, helper)
        side /= np.linalg.norm(side)
        other = np.cross(axis, side)
        rings.append(point + radius * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * other))
    return loft(rings, capped=capped, crease_deg=65)


def capsule(start_m: ArrayLike, end_m: ArrayLike, radius_m: float, end_radius_m: float | None = None) -> Triangles:
    """Return a limb: a tube with round ends."""
    start, end = np.asarray(start_m, dtype=np.float64), np.asarray(end_m, dtype=np.float64)
    last = radius_m if end_radius_m is None else end_radius_m
    axis = (end - start) / np.linalg.norm(end - start)
    tilt = np.linspace(math.pi / 2 * 0.95, 0, 4)
    places = [*(start - axis * radius_m * math.sin(t) for t in tilt), *(end + axis * last * math.sin(t) for t in tilt[::-1])]
    radii = [*(radius_m * math.cos(t) for t in tilt), *(last * math.cos(t) for t in tilt[::-1])]
    return tube(places, radii, segments=8)


def write_ply(mesh: Triangles, path: Path) -> None:
    """Write a binary PLY file in single precision; the same mesh gives the same bytes."""
    vertices = np.hstack([mesh.vertices_m, mesh.normals]).astype("<f4")
    faces = np.empty(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    fields = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{fields}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())
