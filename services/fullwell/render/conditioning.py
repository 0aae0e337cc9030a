"""Geometry made ready for single precision and for rays: what is bent, mended or refused on the way to any renderer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.radiometry.spectrum import Spectrum
from fullwell.scene import Cube, Cylinder, Disk, Mesh, Part, Rectangle, SceneDescription, Sphere
from fullwell.scene.extents import box_of

__all__ = [
    "RAY_START",
    "check_glass_thickness",
    "check_reach",
    "naming",
    "power_kept",
    "with_whole_normals",
    "without_repeated_faces",
]

_FARTHEST_CENTRE_M = 1e8
_SMALLEST_REACH_M = 5e-3
"""Fifty times the distance off a surface at which Mitsuba's own integrators start rays."""

RAY_START = 9e-5
"""Times 1 m + the largest coordinate: how far off a surface Mitsuba's own integrators start rays."""

_ONE_SURFACE = 0.1
"""Share of their area that the triangles' area vectors add up to: none in a body, all in the surface of still water."""

_PARALLEL = 0.9
"""Cosine between the normals of triangles of a pane's two sides, at least."""

_THINNEST = 1.25
"""Thickness of the thinnest pane, in the distances that rays skip; the vertices of its sides are themselves rounded."""

_EMITTER_AREA_TOLERANCE = 0.05
"""Relative change of a lamp's area by the rounding of its vertices to single precision that its radiance may make up for."""

_AREA_ROUNDING = 1e-4
"""Relative change of a lamp's area that does not matter: a tenth of what the product promises."""


def check_reach(scene: SceneDescription, centre_m: NDArray[np.float64], *, smallest_m: float = _SMALLEST_REACH_M) -> None:
    """Refuse a camera that is nowhere, and a scene that reaches less than `smallest_m`: rays skip over its shapes."""
    if not np.all(np.abs(centre_m) <= _FARTHEST_CENTRE_M):
        raise FieldError(
            f"the camera stands at {np.asarray(centre_m).tolist()}; must be finite and within {_FARTHEST_CENTRE_M:g} m of the "
            "origin.",
            path="camera_to_world",
        )
    if not scene.objects:
        return
    bounds: dict[int, NDArray[np.float64]] = {}
    reach_m = 0.0
    for item in scene.objects:
        for part in item.parts:
            if id(part.geometry) not in bounds:
                bounds[id(part.geometry)] = _corners(part)
            corners = bounds[id(part.geometry)]
            reach_m = max(reach_m, _reach_m(corners, item.to_world @ part.to_object, centre_m))
            if reach_m >= smallest_m:
                return
    raise FieldError(
        f"the scene lies within {reach_m:.2g} m of the camera; must reach >= {smallest_m:g} m. Scale the scene, "
        "the camera's pupil and the distances of lights up together: radiance does not change.",
        path="scene.objects",
    )


def _corners(part: Part) -> NDArray[np.float64]:
    """Return (2, 3) lowest and highest coordinates of the part in its own axes [m]."""
    match part.geometry:
        case Mesh():
            middle, half = box_of(part.geometry)
            return np.array([middle - half, middle + half])
        case Sphere(radius_m=radius) | Disk(radius_m=radius):
            return np.array([[-radius] * 3, [radius] * 3])
        case Cylinder(radius_m=radius, height_m=height):
            return np.array([[-radius, -radius, -height / 2], [radius, radius, height / 2]])
        case Rectangle(size_m=size) | Cube(size_m=size):
            half = np.resize(np.append(size, 0.0), 3) / 2
            return np.array([-half, half])


def _reach_m(corners: NDArray[np.float64], to_world: NDArray[np.float64], centre_m: NDArray[np.float64]) -> float:
    """Return a coordinate [m] from the camera that no point within the corners exceeds, at most three times too large."""
    middle = to_world[:3, :3] @ corners.mean(axis=0) + to_world[:3, 3] - centre_m
    return float((np.abs(middle) + np.abs(to_world[:3, :3]) @ (corners[1] - corners[0]) / 2).max())


@contextmanager
def naming(object_id: str, index: int, number: int) -> Iterator[None]:
    """Put the object's id and the part before a refusal of one shape."""
    try:
        yield
    except FieldError as error:
        path = f"scene.objects[{index}].parts[{number}].{error.path}".rstrip(".")
        raise FieldError(f"object {object_id!r}, part {number}: {error.message}", path, error.value) from error


def with_whole_normals(mesh: Mesh) -> Mesh:
    """Return the mesh with the mean normal of its triangles where a vertex has a zero normal, which would be black."""
    if mesh.normals is None:
        return mesh
    zero = ~np.any(mesh.normals, axis=1)
    if not zero.any():
        return mesh
    corners = mesh.vertices_m[mesh.faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros(mesh.normals.shape)
    np.add.at(sums, mesh.faces, crossed[:, None, :])
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    mean = np.divide(sums, length, out=np.zeros_like(sums), where=length > 0)
    return replace(mesh, normals=np.where(zero[:, None], mean, mesh.normals))


def without_repeated_faces(mesh: Mesh) -> Mesh:
    """Return the mesh with each triangle once: a lamp would shine from each copy."""
    _, corner = np.unique(mesh.vertices_m, axis=0, return_inverse=True)
    named = np.sort(corner.reshape(-1)[mesh.faces], axis=1)
    _, first = np.unique(named, axis=0, return_index=True)
    return mesh if len(first) == len(mesh.faces) else replace(mesh, faces=mesh.faces[np.sort(first)])


def power_kept(mesh: Mesh, radiance: Spectrum) -> Spectrum:
    """Return the radiance that gives the lamp its power after its vertices are rounded to single precision.

    Only lamps of less than about 1e-4 of their distance change. Refused are those whose area changes much.
    """
    exact, rounded = (_area_m2(mesh, kind) for kind in (np.float64, np.float32))
    if not abs(rounded - exact) <= _EMITTER_AREA_TOLERANCE * exact:
        raise FieldError(
            f"its area of {exact:.3g} m2 becomes {rounded:.3g} m2 in single precision at its distance from the camera; "
            f"must keep to {_EMITTER_AREA_TOLERANCE:.0%}. Make it a point light, or a sphere or disk, which stay exact.",
            path="geometry",
        )
    return radiance if abs(rounded - exact) <= _AREA_ROUNDING * exact else radiance.scaled(exact / rounded)


def check_glass_thickness(
    mesh: Mesh, skipped: Callable[[NDArray[np.float64], NDArray[np.float64]], float] | None = None
) -> None:
    """Refuse a pane of glass whose second side rays would skip.

    Parameters
    ----------
    skipped
        Distance [m] off the pane's sides at which rays start, of their (n, 3, 3) corners [m] and (n, 3) unit normals. By
        default that of Mitsuba's own integrators.
    """
    corners = mesh.vertices_m[mesh.faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(crossed, axis=1)
    if np.linalg.norm(crossed.sum(axis=0)) > _ONE_SURFACE * doubled.sum():
        return
    # The extent along the normal of the largest triangle is a pane's thickness, whatever its pose.
    largest = int(doubled.argmax())
    normal = crossed[largest] / doubled[largest]
    thickness_m = float(np.ptp((mesh.vertices_m - corners[largest, 0]) @ normal))
    sides = np.abs(crossed @ normal) > _PARALLEL * doubled
    skipped_m = (skipped or _skipped_m)(corners[sides], crossed[sides] / doubled[sides, None])
    if thickness_m < _THINNEST * skipped_m:
        raise FieldError(
            f"its glass of {thickness_m:.2g} m is up to {np.abs(corners[sides]).max():.3g} m away from the camera, where rays "
            f"skip {skipped_m:.2g} m; must be >= {_THINNEST * skipped_m:.2g} m. Leave the pane out, or move the camera nearer.",
            path="geometry",
        )


def _skipped_m(corners: NDArray[np.float64], normals: NDArray[np.float64]) -> float:
    del normals
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    return RAY_START * (1.0 + float(np.maximum(np.maximum(low, -high), 0.0).max()))


def _area_m2(mesh: Mesh, rounded_to: type[np.float32 | np.float64]) -> float:
    corners = mesh.vertices_m.astype(rounded_to).astype(np.float64)[mesh.faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(crossed, axis=1).sum() / 2)
