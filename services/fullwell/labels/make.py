"""Labels from the surfaces behind the pixel centres and the extents of the objects."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import ShapeError
from fullwell.labels.model import Box3D, Labels, ObjectLabel
from fullwell.scene import Camera, SceneDescription, SceneObject, SurfaceHits
from fullwell.scene.tessellate import mesh_of, transform_points

__all__ = ["make_labels"]

_NEAR_M = 1e-4
"""Triangles are cut this far before the pupil, where the projection would go to infinity."""


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
    objects = []
    boxes = _visible_boxes(instances, len(scene.objects))
    counts = np.bincount(instances.ravel(), minlength=len(scene.objects) + 1)
    for index, scene_object in enumerate(scene.objects):
        label = _object_label(
            scene_object,
            camera,
            instance=index + 1,
            class_id=int(class_of[index + 1]),
            visible_px=int(counts[index + 1]),
            amodal_px=int(hits.amodal_px[index]),
            bbox_visible_px=boxes[index],
        )
        if label is not None:
            objects.append(label)
    return Labels(
        instances=instances,
        semantic=class_of[instances],
        depth_z_m=(hits.range_m * _axis_cosine(camera)).astype(np.float32),
        depth_range_m=hits.range_m,
        normals_camera=hits.normal_camera,
        objects=tuple(objects),
        instance_table=tuple((o.id, index + 1) for index, o in enumerate(scene.objects)),
        semantic_classes=scene.semantic_classes,
    )


def _axis_cosine(camera: Camera) -> NDArray[np.float64]:
    """Return (rows, cols) cosines between the chief rays and the optical axis."""
    y, x = np.mgrid[0 : camera.film.rows, 0 : camera.film.cols] + 0.5
    x = (x - camera.film.cols / 2) * camera.tangent_pitch
    y = (y - camera.film.rows / 2) * camera.tangent_pitch
    return np.asarray(1.0 / np.sqrt(x * x + y * y + 1.0))


def _visible_boxes(instances: NDArray[np.uint32], count: int) -> list[tuple[int, int, int, int] | None]:
    """Return for each object the box around its visible pixels, found in one pass over the map."""
    rows, cols = np.nonzero(instances)
    of = instances[rows, cols].astype(np.int64) - 1
    low = np.full((count, 2), np.iinfo(np.int64).max)
    high = np.full((count, 2), -1)
    np.minimum.at(low, of, np.stack([cols, rows], axis=1))
    np.maximum.at(high, of, np.stack([cols, rows], axis=1))
    return [
        (int(low[i, 0]), int(low[i, 1]), int(high[i, 0]) + 1, int(high[i, 1]) + 1) if high[i, 0] >= 0 else None
        for i in range(count)
    ]


def _object_label(
    scene_object: SceneObject,
    camera: Camera,
    *,
    instance: int,
    class_id: int,
    visible_px: int,
    amodal_px: int,
    bbox_visible_px: tuple[int, int, int, int] | None,
) -> ObjectLabel | None:
    """Return the label, or None for an object that has no part in the picture, hidden or not."""
    to_camera = camera.world_to_camera @ scene_object.to_world
    triangles = _triangles(scene_object, to_camera)
    amodal = _project(triangles, camera)
    truncated = 1.0 if amodal is None else _outside_fraction(amodal, camera)
    if visible_px == 0 and amodal_px == 0 and truncated >= 1.0:
        return None
    return ObjectLabel(
        id=scene_object.id,
        instance=instance,
        semantic_class=scene_object.semantic_class,
        class_id=class_id,
        bbox_visible_px=bbox_visible_px,
        bbox_amodal_px=amodal,
        visible_px=visible_px,
        amodal_px=amodal_px,
        visible_fraction=visible_px / amodal_px if amodal_px else 0.0,
        truncated_fraction=truncated,
        box3d=_box3d(triangles.reshape(-1, 3), to_camera),
    )


def _triangles(scene_object: SceneObject, to_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3 corners, 3) triangles of all parts in camera coordinates [m]."""
    pieces = []
    for part in scene_object.parts:
        mesh = mesh_of(part.geometry)
        pieces.append(transform_points(to_camera @ part.to_object, mesh.vertices_m)[mesh.faces])
    return np.concatenate(pieces)


def _project(triangles: NDArray[np.float64], camera: Camera) -> tuple[float, float, float, float] | None:
    """Return the box around the projection of the triangles [px], cut at the near plane; None when all lie behind it."""
    points = triangles.reshape(-1, 3)
    ahead = points[points[:, 2] >= _NEAR_M]
    pieces = [ahead]
    if len(ahead) < len(points):
        for first, second in ((0, 1), (1, 2), (2, 0)):
            a, b = triangles[:, first], triangles[:, second]
            crosses = (a[:, 2] < _NEAR_M) != (b[:, 2] < _NEAR_M)
            a, b = a[crosses], b[crosses]
            share = (_NEAR_M - a[:, 2]) / (b[:, 2] - a[:, 2])
            pieces.append(a + share[:, None] * (b - a))
    points = np.concatenate(pieces)
    if len(points) == 0:
        return None
    depth = np.maximum(points[:, 2], _NEAR_M)
    x = points[:, 0] / depth / camera.tangent_pitch + camera.film.cols / 2
    y = points[:, 1] / depth / camera.tangent_pitch + camera.film.rows / 2
    return float(x.min()), float(y.min()), float(x.max()), float(y.max())


def _outside_fraction(box: tuple[float, float, float, float], camera: Camera) -> float:
    x0, y0, x1, y1 = box
    area = (x1 - x0) * (y1 - y0)
    width = max(0.0, min(x1, camera.film.cols) - max(x0, 0.0))
    height = max(0.0, min(y1, camera.film.rows) - max(y0, 0.0))
    if area <= 0:  # a line or a point, inside or outside as a whole
        return 0.0 if 0 <= x0 <= camera.film.cols and 0 <= y0 <= camera.film.rows else 1.0
    return float(min(1.0, max(0.0, 1.0 - width * height / area)))


def _box3d(points: NDArray[np.float64], to_camera: NDArray[np.float64]) -> Box3D:
    """Return the box along the object's own axes; the nearest rotation stands in where these are sheared."""
    u, _, vt = np.linalg.svd(to_camera[:3, :3])
    rotation = u @ vt
    if np.linalg.det(rotation) < 0:  # mirrored object: a proper rotation is what consumers expect
        rotation = rotation @ np.diag([-1.0, 1.0, 1.0])
    along = points @ rotation
    low, high = along.min(axis=0), along.max(axis=0)
    return Box3D(center_m=rotation @ ((low + high) / 2), size_m=high - low, rotation=rotation)
