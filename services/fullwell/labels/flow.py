"""Optical flow: where each pixel's surface will be seen a moment later."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.labels.model import Labels
from fullwell.scene import Camera
from fullwell.scene.extents import NEAR_M
from fullwell.scene.motion import AT_REST, Motion

__all__ = ["optical_flow"]

Array = NDArray[np.float64]

_ROWS: Final = 256
"""Rows that are worked on at a time: the arrays in double precision are many times as large as the flow."""


def optical_flow(
    labels: Labels,
    camera: Camera,
    motions: Mapping[str, Motion],
    *,
    interval_s: float,
    camera_motion: Motion = AT_REST,
    has_sky: bool = True,
) -> NDArray[np.float32]:
    """Return (rows, cols, 2) flow [px], to the right and down, of what each pixel's centre shows, over `interval_s` [s].

    Surfaces move rigidly with their object by `motions` {object id: motion}, at rest where there is none; the camera moves by
    `camera_motion`. `camera` is the one of the labels, with one film sample per pixel: a pinhole, so that the distortion of a
    lens is not in the flow. Where nothing is hit the flow is that of a sky at infinity, which only turns, or NaN without
    `has_sky`. It is NaN too where the surface will be behind the camera. What will be hidden by then has its flow all the same.

    Raises
    ------
    FieldError
        The interval is not > 0.
    """
    if not interval_s > 0:
        raise FieldError(f"interval_s is {interval_s:g}; must be > 0.", path="interval_s", value=interval_s)
    steps = _Steps(camera, motions, camera_motion, interval_s, labels.instance_table, has_sky)
    parts = [slice(first, first + _ROWS) for first in range(0, camera.film.rows, _ROWS)]
    return np.concatenate([_flow_of(rows, labels, steps) for rows in parts])


@dataclass(frozen=True, slots=True, eq=False)
class _Steps:
    """What moves how in which time."""

    camera: Camera
    motions: Mapping[str, Motion]
    camera_motion: Motion
    interval_s: float
    instance_table: tuple[tuple[str, int], ...]
    has_sky: bool


def _flow_of(rows: slice, labels: Labels, steps: _Steps) -> NDArray[np.float32]:
    """Return the flow of some rows."""
    camera, interval_s = steps.camera, steps.interval_s
    depth_z = labels.depth_z_m[rows].astype(np.float64)
    rays, hit = _rays(camera, rows), np.isfinite(depth_z)
    after, turned = camera.camera_to_world[:3, :3], np.eye(3)
    if steps.camera_motion.yaw_rate_rad_s != 0:
        after = steps.camera_motion.turn(interval_s) @ after
        turned = after.T @ camera.camera_to_world[:3, :3]
    shift = _shifts(labels.instances[rows], rays * np.where(hit, depth_z, 0.0)[..., None], steps)
    shift -= steps.camera_motion.shift_m(camera.camera_to_world[:3, 3], interval_s)
    # Points and shifts are divided by the depth, so that what does not move has a flow of exactly 0, however near or far.
    inverse = np.divide(1.0, depth_z, out=np.zeros_like(depth_z), where=hit)
    moved = rays @ turned.T + (shift @ after) * inverse[..., None]
    seen = (moved[..., 2] > NEAR_M * inverse) & (hit | steps.has_sky)
    flow = np.full((*depth_z.shape, 2), np.nan, dtype=np.float32)
    flow[seen] = (moved[seen][:, :2] / moved[seen][:, 2:] - rays[seen][:, :2]) / camera.tangent_pitch
    return flow


def _rays(camera: Camera, rows: slice) -> Array:
    """Return (rows, cols, 3) directions of the pixel centres in camera axes, 1 along the optical axis."""
    x = (np.arange(camera.film.cols) + 0.5 - camera.film.cols / 2) * camera.tangent_pitch
    y = (np.arange(camera.film.rows)[rows] + 0.5 - camera.film.rows / 2) * camera.tangent_pitch
    across, down = np.meshgrid(x, y)
    return np.stack([across, down, np.ones_like(across)], axis=-1)


def _shifts(instances: NDArray[np.uint32], points_m: Array, steps: _Steps) -> Array:
    """Return (rows, cols, 3) by how much the surface at each of `points_m` in camera axes moves in the world [m]."""
    shifts = np.zeros(points_m.shape)
    present = set(np.unique(instances).tolist())
    to_world = steps.camera.camera_to_world
    for name, instance in steps.instance_table:
        motion = steps.motions.get(name) if instance in present else None
        if motion is not None:
            where = instances == instance
            world = points_m[where] @ to_world[:3, :3].T + to_world[:3, 3]
            shifts[where] = motion.shift_m(world, steps.interval_s)
    return shifts
