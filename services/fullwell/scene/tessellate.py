"""Every geometry as triangles: for renderers that want meshes and for the extents that labels report."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.scene.description import Cube, Cylinder, Disk, Geometry, Mesh, Rectangle, Sphere

__all__ = ["is_similarity", "mesh_of", "transform_mesh", "transform_points"]

_SEGMENTS = 128
"""Segments of a full circle; the sagitta of a chord is 3e-4 of the radius."""

_SIMILARITY_TOLERANCE = 1e-6
"""Relative departure from equal, perpendicular axes that float32 rendering cannot tell from none."""


def mesh_of(geometry: Geometry) -> Mesh:
    """Return the geometry as triangles in its own coordinates [m], normals outwards."""
    match geometry:
        case Mesh():
            return geometry
        case Rectangle(size_m=(width, height)):
            return _rectangle(width, height)
        case Cube(size_m=size):
            return _cube(size)
        case Disk(radius_m=radius):
            return _disk(radius)
        case Cylinder(radius_m=radius, height_m=height):
            return _cylinder(radius, height)
        case Sphere(radius_m=radius):
            return _sphere(radius)


def _rectangle(width: float, height: float) -> Mesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [width / 2, height / 2, 1.0]
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64)
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32), uv=uv)


def _cube(size: tuple[float, float, float]) -> Mesh:
    face = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=np.float64)
    turns = [face, face * [-1, 1, -1]]  # +z and, turned about y, -z
    turns += [np.roll(t, shift, axis=1) for shift in (1, 2) for t in turns[:2]]
    vertices = np.concatenate(turns) * (np.asarray(size) / 2)
    faces = np.concatenate([[[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]] for i in range(6)])
    uv = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64), (6, 1))
    return Mesh(vertices, faces.astype(np.uint32), uv=uv)


def _circle(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    angle = 2 * np.pi * np.arange(count) / count
    return np.cos(angle), np.sin(angle)


def _disk(radius: float) -> Mesh:
    x, y = _circle(_SEGMENTS)
    rim = np.stack([radius * x, radius * y, np.zeros_like(x)], axis=1)
    around = np.arange(_SEGMENTS)
    faces = np.stack([np.full_like(around, _SEGMENTS), around, (around + 1) % _SEGMENTS], axis=1)
    return Mesh(np.concatenate([rim, [[0.0, 0.0, 0.0]]]), faces.astype(np.uint32))


def _cylinder(radius: float, height: float) -> Mesh:
    x, y = _circle(_SEGMENTS)
    rim = np.stack([radius * x, radius * y, np.full_like(x, -height / 2)], axis=1)
    vertices = np.concatenate([rim, rim + [0, 0, height]])
    normals = np.tile(np.stack([x, y, np.zeros_like(x)], axis=1), (2, 1))
    low, high = np.arange(_SEGMENTS), np.arange(_SEGMENTS) + _SEGMENTS
    low_next, high_next = np.roll(low, -1), np.roll(high, -1)
    faces = np.concatenate([np.stack([low, low_next, high_next], 1), np.stack([low, high_next, high], 1)])
    return Mesh(vertices, faces.astype(np.uint32), normals=normals)


def _sphere(radius: float) -> Mesh:
    rings = _SEGMENTS // 2
    polar = np.pi * np.arange(1, rings) / rings
    x, y = _circle(_SEGMENTS)
    body = np.stack(
        [np.outer(np.sin(polar), x), np.outer(np.sin(polar), y), np.tile(np.cos(polar)[:, None], (1, _SEGMENTS))], axis=-1
    ).reshape(-1, 3)
    unit = np.concatenate([body, [[0, 0, 1.0], [0, 0, -1.0]]])
    around = np.arange(_SEGMENTS)
    following = (around + 1) % _SEGMENTS
    top, bottom, last = len(body), len(body) + 1, (rings - 2) * _SEGMENTS
    faces = [np.stack([np.full_like(around, top), around, following], 1)]
    for ring in range(rings - 2):
        upper, lower = ring * _SEGMENTS, (ring + 1) * _SEGMENTS
        faces.append(np.stack([upper + around, lower + around, lower + following], 1))
        faces.append(np.stack([upper + around, lower + following, upper + following], 1))
    faces.append(np.stack([last + around, np.full_like(around, bottom), last + following], 1))
    return Mesh(unit * radius, np.concatenate(faces).astype(np.uint32), normals=unit)


def transform_points(matrix: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) points after the (4, 4) affine `matrix`."""
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3])


def _determinant(linear: NDArray[np.float64]) -> float:
    """Return that of a (3, 3) matrix; a street has twenty thousand parts, and NumPy's takes ten times as long."""
    (a, b, c), (d, e, f), (g, h, i) = linear.tolist()
    return float(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))


def transform_mesh(matrix: NDArray[np.float64], mesh: Mesh) -> Mesh:
    """Return the mesh after the (4, 4) affine `matrix`; a mirroring one keeps its normals outwards."""
    linear = matrix[:3, :3]
    faces = mesh.faces[:, ::-1] if _determinant(linear) < 0 else mesh.faces
    normals = None
    if mesh.normals is not None:
        turned = mesh.normals @ np.linalg.inv(linear)
        length = np.linalg.norm(turned, axis=1, keepdims=True)
        normals = np.divide(turned, length, out=np.zeros_like(turned), where=length > 0)
    return Mesh(transform_points(matrix, mesh.vertices_m), faces, normals=normals, uv=mesh.uv)


def is_similarity(matrix: NDArray[np.float64]) -> bool:
    """Return whether the (4, 4) affine `matrix` is a rotation, translation and equal positive scale only."""
    linear = matrix[:3, :3]
    gram = linear.T @ linear
    scale_squared = float(np.trace(gram)) / 3
    if np.linalg.det(linear) <= 0 or scale_squared <= 0:
        return False
    return bool(np.all(np.abs(gram / scale_squared - np.eye(3)) < _SIMILARITY_TOLERANCE))
