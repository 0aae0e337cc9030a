"""What a driver's assistant is to find in a picture: road users, lanes, drivable ground, signals, and the ego's own motion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fullwell.labels.model import Box3D, Labels, ObjectLabel
from fullwell.labels.projection import line_px, ring_px
from fullwell.scene import Camera
from fullwell.scene.motion import DrivingFacts, GroundRegion, LaneFacts, RoadUser

__all__ = ["DRIVING_SCHEMA", "driving_document"]

Array = NDArray[np.float64]

DRIVING_SCHEMA: Final = "fullwell/driving/v1"

_DECIMALS: Final = 6
_LINE_DECIMALS: Final = 4
"""A tenth of a millimetre and of a thousandth of a pixel: lines are many numbers."""


def driving_document(labels: Labels, camera: Camera, facts: DrivingFacts) -> dict[str, Any]:
    """Return `driving.json` of one camera as plain data: metres, seconds, radians, pixels with centres at +0.5.

    Camera axes are OpenCV's (x right, y down, z forward). `camera` is the one of the labels, with one film sample per pixel.
    The keys are described in docs/labels-driving.md.
    """
    seen = {item.id: item for item in labels.objects}
    motion = facts.motion_of_camera(camera.name)
    rows, cols = labels.instances.shape
    return {
        "schema": DRIVING_SCHEMA,
        "time_s": facts.time_s,
        "camera": camera.name,
        "image_size_px": [cols, rows],
        "intrinsics_px": _numbers(camera.intrinsics_px),
        "camera_to_world": _numbers(camera.camera_to_world),
        "map": {"offset_m": _numbers(facts.map.offset_m), "projection": facts.map.projection or None},
        "camera_velocity": _velocity(motion.velocity_at(camera.camera_to_world[:3, 3]), camera),
        "ego": _ego(facts, camera),
        "objects": [_road_user(user, seen[user.object_id], camera) for user in facts.users if user.object_id in seen],
        "lanes": list(_lanes(facts, camera)),
        "drivable": list(_regions(facts.drivable, camera)),
        "crossings": list(_regions(facts.crossings, camera)),
        "signals": list(_signals(facts, seen)),
    }


def _velocity(velocity_m_s: Array, camera: Camera) -> dict[str, Any]:
    """Return a velocity over ground along the axes of world and camera."""
    return {"world_m_s": _numbers(velocity_m_s), "camera_m_s": _numbers(camera.world_to_camera[:3, :3] @ velocity_m_s)}


def _ego(facts: DrivingFacts, camera: Camera) -> dict[str, Any] | None:
    if facts.ego is None:
        return None
    user = facts.ego.user
    return {
        **_motion(user, camera),
        "id": user.object_id,
        "sumo_id": user.sumo_id,
        "kind": user.kind,
        "lane": user.lane or None,
        "position_m": _numbers(user.position_m),
        "yaw_world_rad": round(user.yaw_rad, _DECIMALS),
        "size_m": _numbers(user.size_m),
        "carries_camera": camera.name in facts.ego.cameras,
    }


def _motion(user: RoadUser, camera: Camera) -> dict[str, Any]:
    return {
        "velocity": _velocity(user.velocity_m_s, camera),
        "speed_m_s": round(user.speed_m_s, _DECIMALS),
        "acceleration_m_s2": round(user.acceleration_m_s2, _DECIMALS),
        "yaw_rate_rad_s": None if user.yaw_rate_rad_s is None else round(user.yaw_rate_rad_s, _DECIMALS),
        "lights": {"brake": user.brake, "left": user.left, "right": user.right, "reverse": user.reverse},
    }


# Road users ----------------------------------------------------------------------------------------------------------


def _road_user(user: RoadUser, label: ObjectLabel, camera: Camera) -> dict[str, Any]:
    box = label.box3d
    return {
        **_motion(user, camera),
        "id": user.object_id,
        "instance": label.instance,
        "track": user.sumo_id or user.object_id,
        "sumo_id": user.sumo_id or None,
        "role": user.role,
        "kind": user.kind,
        "class": label.semantic_class,
        "lane": user.lane or None,
        "box3d": _box_document(box, camera),
        "distance_m": round(float(np.linalg.norm(box.center_m)), _DECIMALS),
        "nearest_distance_m": round(_nearest_m(box), _DECIMALS),
        **_visibility(label),
    }


def _visibility(label: ObjectLabel) -> dict[str, Any]:
    return {
        "bbox_visible_px": None if label.bbox_visible_px is None else list(label.bbox_visible_px),
        "bbox_amodal_px": None if label.bbox_amodal_px is None else _numbers(label.bbox_amodal_px),
        "visible_px": label.visible_px,
        "visible_fraction": round(label.visible_fraction, _DECIMALS),
        "truncated_fraction": round(label.truncated_fraction, _DECIMALS),
    }


def _box_document(box: Box3D, camera: Camera) -> dict[str, Any]:
    """Return a box; its yaws are those of its first axis, which points forward."""
    to_world = camera.camera_to_world
    ahead = box.rotation[:, 0]
    ahead_world = to_world[:3, :3] @ ahead
    return {
        "size_m": _numbers(box.size_m),
        "center_world_m": _numbers(to_world[:3, :3] @ box.center_m + to_world[:3, 3]),
        "center_camera_m": _numbers(box.center_m),
        "yaw_world_rad": round(math.atan2(ahead_world[1], ahead_world[0]), _DECIMALS),
        # KITTI's rotation_y: about the camera's y axis, 0 where the object points to the right.
        "yaw_camera_rad": round(math.atan2(-ahead[2], ahead[0]), _DECIMALS),
        "rotation_camera": _numbers(box.rotation),
    }


def _nearest_m(box: Box3D) -> float:
    """Return the distance from the camera to the nearest point of a box, 0 within it."""
    along = np.abs(box.rotation.T @ box.center_m) - box.size_m / 2
    return float(np.linalg.norm(np.maximum(along, 0.0)))


# Roads ---------------------------------------------------------------------------------------------------------------


def _lanes(facts: DrivingFacts, camera: Camera) -> Iterator[dict[str, Any]]:
    """Yield the lanes of which the centre or a border lies within the picture."""
    ego_lane = "" if facts.ego is None else facts.ego.user.lane
    for lane in facts.lanes:
        drawn = {f"{name}_px": line_px(points, camera) for name, points in _lines(lane).items()}
        if any(drawn.values()):
            yield {
                "id": lane.id,
                "kind": lane.kind,
                "street": lane.street,
                "width_m": round(lane.width_m, _DECIMALS),
                "speed_limit_m_s": round(lane.speed_limit_m_s, _DECIMALS),
                "is_ego_lane": lane.id == ego_lane,
                **{f"{name}_m": _numbers(points, _LINE_DECIMALS) for name, points in _lines(lane).items()},
                **{name: [_numbers(piece, _LINE_DECIMALS) for piece in pieces] for name, pieces in drawn.items()},
            }


def _lines(lane: LaneFacts) -> dict[str, Array]:
    return {"centre": lane.centre_m, "left": lane.left_m, "right": lane.right_m}


def _regions(regions: tuple[GroundRegion, ...], camera: Camera) -> Iterator[dict[str, Any]]:
    """Yield the regions of which a part lies within the picture, as rings and the rings of their holes."""
    for region in regions:
        outer = ring_px(region.outer_m, camera)
        if outer is not None:
            holes = (ring_px(hole, camera) for hole in region.holes_m)
            yield {
                "outer_px": _numbers(outer, _LINE_DECIMALS),
                "holes_px": [_numbers(hole, _LINE_DECIMALS) for hole in holes if hole is not None],
            }


def _signals(facts: DrivingFacts, seen: Mapping[str, ObjectLabel]) -> Iterator[dict[str, Any]]:
    """Yield the traffic lights that have a part within the picture, hidden or not; their first axis points to their drivers."""
    ego_lane = None if facts.ego is None else facts.ego.user.lane
    for signal in facts.signals:
        label = seen.get(signal.object_id)
        if label is not None:
            yield {
                "id": signal.object_id,
                "instance": label.instance,
                "controller": signal.controller,
                "state": signal.state or None,
                "shown": list(signal.shown),
                "faces_camera": bool(label.box3d.rotation[:, 0] @ label.box3d.center_m < 0),
                "controls_ego_lane": any(link.from_lane == ego_lane for link in signal.links),
                "links": [
                    {"from_lane": link.from_lane, "to_lane": link.to_lane, "state": link.state or None} for link in signal.links
                ],
                "distance_m": round(float(np.linalg.norm(label.box3d.center_m)), _DECIMALS),
                **_visibility(label),
            }


def _numbers(values: Any, decimals: int = _DECIMALS) -> Any:
    return (np.round(np.asarray(values, dtype=np.float64), decimals) + 0.0).tolist()
