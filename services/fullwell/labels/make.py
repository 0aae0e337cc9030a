"""Labels from the surfaces behind the pixels and the extents of the objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from fullwell.core.errors import ShapeError
from fullwell.labels.model import Box3D, Labels, ObjectLabel
from fullwell.scene import Camera, Geometry, Mesh, SceneDescription, SceneObject, SurfaceHits
from fullwell.scene.extents import NEAR_M, axis_cosines, objects_in_view
from fullwell.scene.tessellate import mesh_of, transform_points

__all__ = ["make_labels"]


def make_labels(scene: SceneDescription, camera: Camera, hits: SurfaceHits) -> Labels:
    """Return the labels of the picture that `camera` takes of `scene`, given its `hits`.

    Raises ShapeError where `hits` belongs to another film or scene.
    """
    shape = (camera.film.rows, camera.film.cols)
    if hits.object_index.shape != shape or len(hits.amodal_px) != len(scene.objects):
        raise ShapeError(
            f"the hits have shape {hits.object_index.shape} and {len(hits.amodal_px)} objects; the film has {shape} and the "
            f"scene {len(scene.objects)}."
        )
    class_ids = {name: number + 1 for number, name in enumerate(scene.semantic_classes)}
    class_of = np.array([0, *(class_ids.get(o.semantic_class, 0) for o in scene.objects)], dtype=np.uint16)
    instances = (hits.object_index + 1).astype(np.uint32)
    return Labels(
        instances=instances,
        semantic=class_of[instances],
        depth_z_m=(hits.range_m * axis_cosines(camera)).astype(np.float32),
        depth_range_m=hits.range_m,
        normals_camera=hits.normal_camera,
        coverage=hits.coverage,
        objects=_object_labels(scene, camera, hits, class_of),
        instance_table=tuple((o.id, index + 1) for index, o in enumerate(scene.objects)),
        semantic_classes=scene.semantic_classes,
    )


def _object_labels(
    scene: SceneDescription, camera: Camera, hits: SurfaceHits, class_of: NDArray[np.uint16]
) -> tuple[ObjectLabel, ...]:
    """Return the labels of the objects that have a part on the film, hidden or not."""
    boxes = _visible_boxes(hits.object_index, len(scene.objects))
    counts = np.bincount(hits.object_index.ravel() + 1, minlength=len(scene.objects) + 1)[1:]
    shapes = _Shapes()
    labels = []
    for index in np.flatnonzero(objects_in_view(scene, camera) | (hits.amodal_area_px > 0)):
        scene_object = scene.objects[index]
        extent = _extent(scene_object, camera, shapes)
        truncated = 1.0 if extent.bbox_px is None else _outside_fraction(extent.bbox_px, camera)
        amodal_area_px, visible_area_px = float(hits.amodal_area_px[index]), float(hits.visible_area_px[index])
        if amodal_area_px == 0 and truncated >= 1.0:
            continue
        labels.append(
            ObjectLabel(
                id=scene_object.id,
                instance=int(index) + 1,
                semantic_class=scene_object.semantic_class,
                class_id=int(class_of[index + 1]),
                bbox_visible_px=boxes[index],
                bbox_amodal_px=extent.bbox_px,
                visible_px=int(counts[index]),
                amodal_px=int(hits.amodal_px[index]),
                visible_area_px=visible_area_px,
                amodal_area_px=amodal_area_px,
                visible_fraction=visible_area_px / amodal_area_px if amodal_area_px else 0.0,
                truncated_fraction=truncated,
                box3d=extent.box3d,
            )
        )
    return tuple(labels)


def _visible_boxes(object_index: NDArray[np.int32], count: int) -> list[tuple[int, int, int, int] | None]:
    """Return for each object the box around the pixels whose centres show it."""
    found = ndimage.find_objects(object_index + 1, max_label=max(1, count))[:count]
    return [None if box is None else (box[1].start, box[0].start, box[1].stop, box[0].stop) for box in found]


# Extents of the geometry ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Extent:
    """Box around the whole object on the film's plane [px], None where it lies behind the camera, and around it in space."""

    bbox_px: tuple[float, float, float, float] | None
    box3d: Box3D


class _Shapes:
    """Meshes of geometries with the vertices that their faces use, each found once, however many parts share it."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[Mesh, NDArray[np.float64]]] = {}

    def of(self, geometry: Geometry) -> tuple[Mesh, NDArray[np.float64]]:
        """Return the mesh and (n, 3) its used vertices, in the geometry's own coordinates [m]."""
        known = self._known.get(id(geometry))
        if known is None:
            mesh = mesh_of(geometry)
            used = np.zeros(len(mesh.vertices_m), dtype=bool)
            used[mesh.faces] = True
            known = self._known[id(geometry)] = (mesh, mesh.vertices_m if used.all() else mesh.vertices_m[used])
        return known


def _extent(scene_object: SceneObject, camera: Camera, shapes: _Shapes) -> _Extent:
    to_camera = camera.world_to_camera @ scene_object.to_world
    rotation = _own_axes(to_camera)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    flat = []
    for part in scene_object.parts:
        mesh, vertices = shapes.of(part.geometry)
        placed = to_camera @ part.to_object
        # One column per coordinate: the smallest and largest of a long row are found many times faster.
        points = placed[:3, :3] @ vertices.T + placed[:3, 3:]
        along = rotation.T @ points
        low, high = np.minimum(low, along.min(axis=1)), np.maximum(high, along.max(axis=1))
        flat.extend(_projected(points, mesh, placed, camera))
    bbox_px = None
    if flat:
        x0, y0 = np.array(flat)[:, :2].min(axis=0)
        x1, y1 = np.array(flat)[:, 2:].max(axis=0)
        bbox_px = (float(x0), float(y0), float(x1), float(y1))
    return _Extent(bbox_px, Box3D(center_m=rotation @ ((low + high) / 2), size_m=high - low, rotation=rotation))


def _projected(
    points: NDArray[np.float64], mesh: Mesh, placed: NDArray[np.float64], camera: Camera
) -> list[tuple[float, float, float, float]]:
    """Return boxes (x0, y0, x1, y1) [px] around the projection of a part, cut at the near plane; none where all lie behind.

    `points` (3, n) are its used vertices in camera coordinates, `placed` takes those of `mesh` there.
    """
    ahead = points[2] >= NEAR_M
    if ahead.all():
        return [_box(points, camera)]
    boxes = [_box(points[:, ahead], camera)] if ahead.any() else []
    triangles = transform_points(placed, mesh.vertices_m)[mesh.faces]
    for first, second in ((0, 1), (1, 2), (2, 0)):
        a, b = triangles[:, first], triangles[:, second]
        crosses = (a[:, 2] < NEAR_M) != (b[:, 2] < NEAR_M)
        a, b = a[crosses], b[crosses]
        if len(a):
            share = (NEAR_M - a[:, 2]) / (b[:, 2] - a[:, 2])
            boxes.append(_box((a + share[:, None] * (b - a)).T, camera))
    return boxes


def _box(points: NDArray[np.float64], camera: Camera) -> tuple[float, float, float, float]:
    depth = np.maximum(points[2], NEAR_M) * camera.tangent_pitch
    x, y = points[0] / depth, points[1] / depth
    half_x, half_y = camera.film.cols / 2, camera.film.rows / 2
    return float(x.min()) + half_x, float(y.min()) + half_y, float(x.max()) + half_x, float(y.max()) + half_y


def _outside_fraction(box: tuple[float, float, float, float], camera: Camera) -> float:
    x0, y0, x1, y1 = box
    area = (x1 - x0) * (y1 - y0)
    width = max(0.0, min(x1, camera.film.cols) - max(x0, 0.0))
    height = max(0.0, min(y1, camera.film.rows) - max(y0, 0.0))
    if area <= 0:  # a line or a point, inside or outside as a whole
        return 0.0 if 0 <= x0 <= camera.film.cols and 0 <= y0 <= camera.film.rows else 1.0
    return float(min(1.0, max(0.0, 1.0 - width * height / area)))


def _own_axes(to_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (3, 3) the object's own axes as columns; the nearest rotation stands in where these are sheared."""
    u, _, vt = np.linalg.svd(to_camera[:3, :3])
    rotation = u @ vt
    if np.linalg.det(rotation) < 0:  # mirrored object: a proper rotation is what consumers expect
        rotation = rotation @ np.diag([-1.0, 1.0, 1.0])
    return np.asarray(rotation)
