"""Whether a camera is inside an opaque body, where it would see nothing but the dark."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.scene import Cube, Dielectric, Mesh, Part, Sphere

__all__ = ["is_inside_opaque"]

_DIRECTION = np.array([0.5773502691896258, 0.3137085, 0.7538911])
"""A direction that no edge of a man-made mesh has."""
_WELD_RELATIVE = 1e-7
"""Vertices nearer than this, relative to the extent, are one (files split them at seams)."""


def is_inside_opaque(part: Part, to_world: NDArray[np.float64], point_m: NDArray[np.float64]) -> bool:
    """Return whether a world point is inside a closed, opaque, dark part: a sphere, a cube or a watertight mesh.

    Glass bodies, emitting ones (a lit dome) and open ones never count.
    """
    if part.emission is not None or isinstance(part.material, Dielectric):
        return False
    local = np.linalg.solve(to_world @ part.to_object, np.append(point_m, 1.0))[:3]
    match part.geometry:
        case Sphere(radius_m=radius):
            return bool(local @ local < radius**2 * (1 - 1e-9))
        case Cube(size_m=size):
            return bool(np.all(np.abs(local) < np.array(size) / 2 * (1 - 1e-9)))
        case Mesh():
            return _inside_mesh(part.geometry, local)
        case _:
            return False


def _inside_mesh(mesh: Mesh, point: NDArray[np.float64]) -> bool:
    low, high = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
    if np.any(point <= low) or np.any(point >= high) or not _is_watertight(mesh, float((high - low).max())):
        return False
    return _crossings(mesh, point) % 2 == 1


def _is_watertight(mesh: Mesh, extent: float) -> bool:
    """Every edge of the welded mesh is used once in each direction."""
    _, welded = np.unique(np.round(mesh.vertices_m / (extent * _WELD_RELATIVE)), axis=0, return_inverse=True)
    faces = welded.reshape(-1)[mesh.faces].astype(np.int64)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    base = int(edges.max()) + 1
    forward = np.sort(edges[:, 0] * base + edges[:, 1])
    backward = np.sort(edges[:, 1] * base + edges[:, 0])
    return bool(np.array_equal(forward, backward))


def _crossings(mesh: Mesh, point: NDArray[np.float64]) -> int:
    """Triangles that a ray meets (Moeller and Trumbore 1997, Journal of Graphics Tools 2, 21)."""
    corners = mesh.vertices_m[mesh.faces]
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(_DIRECTION, edge_2)
    determinant = np.einsum("ij,ij->i", edge_1, across)
    usable = determinant != 0
    inverse = np.divide(1.0, determinant, out=np.zeros_like(determinant), where=usable)
    offset = point - corners[:, 0]
    u = np.einsum("ij,ij->i", offset, across) * inverse
    q = np.cross(offset, edge_1)
    v = (q @ _DIRECTION) * inverse
    distance = np.einsum("ij,ij->i", edge_2, q) * inverse
    return int(np.count_nonzero(usable & (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)))
