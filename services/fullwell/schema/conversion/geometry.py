"""Shapes and transforms of a recipe, checked before a renderer sees them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.scene import Cube, Cylinder, Disk, Geometry, Mesh, Rectangle, Sphere
from fullwell.scene.camera import look_at
from fullwell.scene.tessellate import is_similarity, mesh_of, transform_points
from fullwell.schema.conversion.context import fail
from fullwell.schema.errors import RecipeError
from fullwell.schema.v1 import geometry as documents
from fullwell.schema.v1.common import MAX_COORDINATE_M

__all__ = ["affine", "geometry_of", "surface_area_m2", "transform_of"]

_SMALLEST_STRETCH = 1e-9
_MOST_UNEQUAL_STRETCH = 1e-6
"""Ratio of the smallest to the largest stretch below which float32 triangles have no usable normals."""
_DEGENERATE_RELATIVE_AREA = 1e-12
_FLATNESS = 0.02
"""Height of a quad's fourth corner over the plane of the others, relative to its longest edge (measured boxes are not
perfect; the quad is two triangles either way)."""


def geometry_of(document: Any, path: str) -> Geometry:
    """Return the shape of any geometry document but a model file."""
    match document:
        case documents.SphereGeometry():
            return Sphere(document.radius_m)
        case documents.RectangleGeometry():
            return Rectangle(document.size_m)
        case documents.DiskGeometry():
            return Disk(document.radius_m)
        case documents.CubeGeometry():
            return Cube(document.size_m)
        case documents.CylinderGeometry():
            return Cylinder(document.radius_m, document.height_m)
        case documents.QuadGeometry():
            return _quad(np.array(document.corners_m, dtype=np.float64), f"{path}.corners_m")
        case documents.MeshGeometry():
            return _mesh(document, path)
        case _:
            raise TypeError(f"{type(document).__name__} is not a shape")


def _quad(corners: NDArray[np.float64], path: str) -> Mesh:
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.cross(np.roll(edges, 1, axis=0), edges)
    longest = float(np.linalg.norm(edges, axis=1).max())
    if np.linalg.norm(normals, axis=1).min() <= 1e-9 * longest**2:
        fail(path, "has corners that coincide or lie on one line; give four corners of a quadrilateral.")
    if np.any(normals @ normals[0] <= 0):
        fail(path, "is not convex, or its corners are not in order around it; list them counter-clockwise.")
    unit = normals[1] / np.linalg.norm(normals[1])
    if abs(float((corners[3] - corners[0]) @ unit)) > _FLATNESS * longest:
        fail(path, "is not flat; move the fourth corner into the plane of the others, or use a mesh.")
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32), uv=uv)


def _mesh(document: documents.MeshGeometry, path: str) -> Mesh:
    vertices = np.array(document.vertices_m, dtype=np.float64)
    faces = np.array(document.faces, dtype=np.uint32)
    corners = vertices[faces]
    edges = corners[:, [1, 2, 0]] - corners
    doubled_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    flat = np.flatnonzero(doubled_area <= _DEGENERATE_RELATIVE_AREA * (edges**2).sum(axis=2).max(axis=1))
    if flat.size:
        face = int(flat[0])
        fail(f"{path}.faces[{face}]", f"is {document.faces[face]}, a triangle without area; remove it or move its vertices.")
    return Mesh(vertices, faces)


def surface_area_m2(geometry: Geometry, matrix: NDArray[np.float64]) -> float:
    """Return the area [m2] of a shape after the (4, 4) affine `matrix`: exact for planes and for curved similarities."""
    if is_similarity(matrix):
        scale_squared = math.pow(abs(float(np.linalg.det(matrix[:3, :3]))), 2 / 3)
        match geometry:
            case Sphere(radius_m=radius):
                return 4 * math.pi * radius**2 * scale_squared
            case Disk(radius_m=radius):
                return math.pi * radius**2 * scale_squared
            case Cylinder(radius_m=radius, height_m=height):
                return 2 * math.pi * radius * height * scale_squared
            case _:
                pass
    mesh = mesh_of(geometry)
    corners = transform_points(matrix, mesh.vertices_m)[mesh.faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(doubled, axis=1).sum() / 2)


# Transforms ----------------------------------------------------------------------------------------------------------


def transform_of(document: Any, path: str) -> NDArray[np.float64]:
    """Return the (4, 4) affine matrix of a transform (None, one step or a list of steps, the first applied first)."""
    if document is None:
        return np.eye(4)
    if isinstance(document, list):
        matrix = np.eye(4)
        for index, step in enumerate(document):
            matrix = _step(step, f"{path}[{index}]") @ matrix
        return affine(matrix, path)
    return affine(_step(document, path), path)


def affine(matrix: NDArray[np.float64], path: str) -> NDArray[np.float64]:
    """Return `matrix`, refused where it flattens space, is not affine or reaches too far."""
    if not np.allclose(matrix[3], [0, 0, 0, 1], atol=1e-12):
        fail(path, f"has the last row {matrix[3].tolist()}; must be [0, 0, 0, 1].")
    stretches = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if stretches[-1] < _SMALLEST_STRETCH or stretches[-1] < _MOST_UNEQUAL_STRETCH * stretches[0]:
        fail(
            path,
            f"is singular or nearly so: it stretches by {stretches[0]:.3g} one way and {stretches[-1]:.3g} another; their "
            f"ratio must be >= {_MOST_UNEQUAL_STRETCH:g}. Make the shape itself thin instead.",
        )
    if np.abs(matrix[:3, 3]).max() > MAX_COORDINATE_M:
        fail(path, f"moves by {np.abs(matrix[:3, 3]).max():g} m; must be <= {MAX_COORDINATE_M:g} m.")
    return matrix


def _step(step: documents.TransformStep, path: str) -> NDArray[np.float64]:
    if step.matrix is not None:
        return affine(np.array(step.matrix, dtype=np.float64), f"{path}.matrix")
    if step.look_at is not None:
        return _look_at(step.look_at, f"{path}.look_at")
    matrix = np.eye(4)
    if step.scale is not None:
        matrix[:3, :3] = np.diag(np.broadcast_to(step.scale, 3))
    if step.rotate_deg is not None:
        matrix = _rotation(step.rotate_deg) @ matrix
    if step.translate_m is not None:
        matrix[:3, 3] += step.translate_m
    return matrix


def _rotation(rotation: Any) -> NDArray[np.float64]:
    matrix = np.eye(4)
    if isinstance(rotation, documents.Rotation):
        axes = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
        axis = axes[rotation.axis] if isinstance(rotation.axis, str) else rotation.axis
        matrix[:3, :3] = _about(np.array(axis, dtype=np.float64), rotation.angle_deg)
        return matrix
    for direction, angle_deg in zip(np.eye(3), rotation, strict=True):
        matrix[:3, :3] = _about(direction, angle_deg) @ matrix[:3, :3]
    return matrix


def _about(axis: NDArray[np.float64], angle_deg: float) -> NDArray[np.float64]:
    """Rodrigues' formula; quarter turns are exact, so that boxes stay boxes."""
    x, y, z = axis / np.abs(axis).max() / np.linalg.norm(axis / np.abs(axis).max())
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    quarter, rest = divmod(float(angle_deg), 90.0)
    if rest == 0:
        cosine, sine = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][int(quarter % 4)]
    else:
        cosine, sine = float(np.cos(np.radians(angle_deg))), float(np.sin(np.radians(angle_deg)))
    return np.asarray(np.eye(3) + sine * cross + (1 - cosine) * (cross @ cross))


def _look_at(document: documents.LookAt, path: str) -> NDArray[np.float64]:
    """+z towards the target and +y upwards: the camera's axes (y down) turned by half a turn about z."""
    try:
        pose = look_at(np.array(document.origin_m), np.array(document.target_m), np.array(document.up))
    except FieldError as error:
        raise RecipeError(f"{path}: {error.message}", f"{path}.{error.path}".rstrip("."), error.value) from error
    return np.asarray(pose @ np.diag([-1.0, -1.0, 1.0, 1.0]))
