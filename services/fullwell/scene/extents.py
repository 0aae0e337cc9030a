"""Where objects lie in the view of a camera: what labels and surface queries know before any ray is traced."""

from __future__ import annotations

import weakref

import numpy as np
from numpy.typing import NDArray

from fullwell.scene.camera import Camera
from fullwell.scene.description import Cube, Cylinder, Disk, Geometry, Mesh, Rectangle, SceneDescription, Sphere

__all__ = ["NEAR_M", "axis_cosines", "box_of", "objects_in_view"]

NEAR_M = 1e-4
"""Things are cut this far before the pupil, where the projection would go to infinity."""

_CORNERS = np.stack(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], indexing="ij"), axis=-1).reshape(8, 3)

_MARGIN_PX = 1.0
"""The film is taken this much larger, so that rounding never drops what touches its edge."""


def axis_cosines(camera: Camera) -> NDArray[np.float64]:
    """Return (rows, cols) cosines between the chief rays through the pixel centres and the optical axis."""
    x = (np.arange(camera.film.cols) + 0.5 - camera.film.cols / 2) * camera.tangent_pitch
    y = (np.arange(camera.film.rows) + 0.5 - camera.film.rows / 2) * camera.tangent_pitch
    return np.asarray(1.0 / np.sqrt((x * x)[None, :] + (y * y)[:, None] + 1.0))


def objects_in_view(scene: SceneDescription, camera: Camera) -> NDArray[np.bool_]:
    """Return (objects,) whether an object may have a part on the film, hidden or not.

    False is certain: all boxes of the object's parts lie beyond one and the same side of the pyramid of view.
    """
    if not scene.objects:
        return np.zeros(0, dtype=bool)
    corners: list[NDArray[np.float64]] = []
    matrices: list[NDArray[np.float64]] = []
    starts: list[int] = []
    for item in scene.objects:
        starts.append(len(corners))
        for part in item.parts:
            middle, half = box_of(part.geometry)
            corners.append(middle + _CORNERS * half)
            matrices.append(item.to_world @ part.to_object)
    placed = np.einsum("ij,njk->nik", camera.world_to_camera, np.array(matrices))
    points = np.einsum("nij,ncj->nci", placed[:, :3, :3], np.array(corners)) + placed[:, None, :3, 3]
    half_x = (camera.film.cols / 2 + _MARGIN_PX) * camera.tangent_pitch
    half_y = (camera.film.rows / 2 + _MARGIN_PX) * camera.tangent_pitch
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    beyond = np.stack([z < NEAR_M, x > half_x * z, x < -half_x * z, y > half_y * z, y < -half_y * z])
    outside = np.logical_and.reduceat(beyond.all(axis=2), starts, axis=1)
    return np.asarray(~outside.any(axis=0))


_boxes: weakref.WeakKeyDictionary[Mesh, tuple[NDArray[np.float64], NDArray[np.float64]]] = weakref.WeakKeyDictionary()
"""Each mesh is looked at once, however often it stands in scenes."""


def box_of(geometry: Geometry) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the (3,) middle and the (3,) half edges of the box around a geometry, in its own coordinates [m]."""
    match geometry:
        case Mesh(vertices_m=vertices) if len(vertices):
            found = _boxes.get(geometry)
            if found is None:
                # Column by column: along the first axis of an (n, 3) array NumPy is an order of magnitude slower.
                low, high = np.array([[column.min(), column.max()] for column in vertices.T], dtype=np.float64).T
                found = _boxes[geometry] = (low + high) / 2, (high - low) / 2
            return found
        case Rectangle(size_m=(width, height)):
            half = [width / 2, height / 2, 0.0]
        case Cube(size_m=(width, height, depth)):
            half = [width / 2, height / 2, depth / 2]
        case Sphere(radius_m=radius):
            half = [radius, radius, radius]
        case Disk(radius_m=radius):
            half = [radius, radius, 0.0]
        case Cylinder(radius_m=radius, height_m=height):
            half = [radius, radius, height / 2]
        case _:  # a mesh of nothing, which the renderer will refuse
            half = [0.0, 0.0, 0.0]
    return np.zeros(3), np.array(half)
