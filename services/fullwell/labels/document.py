"""Labels as the document that is published."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fullwell.labels.model import Labels, ObjectLabel
from fullwell.scene.motion import AT_REST, Motion

__all__ = ["labels_document"]

_DECIMALS = 6
"""Micrometres and millionths of a pixel; what lies beyond is float noise that would only make files differ."""


def labels_document(
    labels: Labels, intrinsics_px: Any, camera_to_world: Any, motions: Mapping[str, Motion] | None = None
) -> dict[str, Any]:
    """Return `labels.json` as plain data: boxes in pixels, lengths in metres, camera axes as OpenCV.

    With `motions` {object id: motion} each object has its velocity over ground, along the axes of world and camera; objects
    that are not named are at rest.
    """
    rows, cols = labels.instances.shape
    objects = [_object_document(item) for item in labels.objects]
    if motions is not None:
        to_camera = np.asarray(camera_to_world, dtype=np.float64)[:3, :3].T
        for entry in objects:
            velocity = motions.get(entry["id"], AT_REST).velocity_m_s
            entry["velocity"] = {"world_m_s": _numbers(velocity), "camera_m_s": _numbers(to_camera @ velocity)}
    return {
        "schema": "fullwell/labels/v1",
        "image_size_px": [cols, rows],
        "intrinsics_px": _numbers(intrinsics_px),
        "camera_to_world": _numbers(camera_to_world),
        "classes": [{"id": number + 1, "name": name} for number, name in enumerate(labels.semantic_classes)],
        "objects": objects,
    }


def _object_document(item: ObjectLabel) -> dict[str, Any]:
    return {
        "id": item.id,
        "instance": item.instance,
        "class": item.semantic_class,
        "class_id": item.class_id,
        "bbox_visible_px": None if item.bbox_visible_px is None else list(item.bbox_visible_px),
        "bbox_amodal_px": None if item.bbox_amodal_px is None else _numbers(item.bbox_amodal_px),
        "visible_px": item.visible_px,
        "amodal_px": item.amodal_px,
        "visible_area_px": round(item.visible_area_px, _DECIMALS),
        "amodal_area_px": round(item.amodal_area_px, _DECIMALS),
        "visible_fraction": round(item.visible_fraction, _DECIMALS),
        "truncated_fraction": round(item.truncated_fraction, _DECIMALS),
        "box3d_camera": {
            "center_m": _numbers(item.box3d.center_m),
            "size_m": _numbers(item.box3d.size_m),
            "rotation": _numbers(item.box3d.rotation),
        },
        "distance_m": round(float(np.linalg.norm(item.box3d.center_m)), _DECIMALS),
    }


def _numbers(values: Any) -> Any:
    return (np.round(np.asarray(values, dtype=np.float64), _DECIMALS) + 0.0).tolist()
