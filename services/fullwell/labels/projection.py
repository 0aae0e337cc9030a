"""Lines and rings of the world as a camera's pinhole sees them, cut to its picture."""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.scene import Camera
from fullwell.scene.extents import NEAR_M

__all__ = ["line_px", "ring_px"]

Array = NDArray[np.float64]

_NO_AREA_PX2: Final = 1e-6
"""Below this a ring is a line at the edge of the picture: what cutting leaves of a region that is outside."""


def line_px(points_m: Array, camera: Camera) -> list[Array]:
    """Return the parts (k, 2) [px] of a line (n, 3) [m] that lie within the picture and before the camera, in its order.

    Pixel centres are at +0.5. Cut in space, so that a line that passes the camera keeps the part before it. What stands before
    the line does not count, nor does the distortion of a lens.
    """
    points, planes = _in_camera(points_m, camera), _planes(camera)
    pieces: list[list[Array]] = []
    for start, end in itertools.pairwise(points):
        span = _span_inside(start, end, planes)
        if span is None:
            continue
        first, last = start + span[0] * (end - start), start + span[1] * (end - start)
        if not (pieces and span[0] == 0.0 and np.array_equal(pieces[-1][-1], start)):
            pieces.append([first])
        pieces[-1].append(end if span[1] == 1.0 else last)
    return [_pixels(np.array(piece), camera) for piece in pieces]


def ring_px(ring_m: Array, camera: Camera) -> Array | None:
    """Return the part (k, 2) [px] of a ring (n, 3) [m] that lies within the picture, None where there is none.

    A region that the picture's edge cuts in several becomes one ring, whose parts are joined by lines along that edge:
    filling it covers the right pixels (Sutherland and Hodgman 1974, Reentrant Polygon Clipping, CACM 17(1)).
    """
    points = _in_camera(ring_m, camera)
    for plane in _planes(camera):
        points = _cut(points, plane)
        if len(points) < 3:
            return None
    pixels = _pixels(points, camera)
    x, y = pixels[:, 0], pixels[:, 1]
    area = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2
    return pixels if area > _NO_AREA_PX2 else None


def _in_camera(points_m: Array, camera: Camera) -> Array:
    matrix = camera.world_to_camera
    return np.asarray(points_m @ matrix[:3, :3].T + matrix[:3, 3])


def _planes(camera: Camera) -> Array:
    """Return (5, 4) planes (normal, offset) in camera axes: a point is in view where normal . point + offset >= 0 for all."""
    half_x, half_y = (side / 2 * camera.tangent_pitch for side in (camera.film.cols, camera.film.rows))
    sides = [[1, 0, half_x, 0], [-1, 0, half_x, 0], [0, 1, half_y, 0], [0, -1, half_y, 0]]
    return np.array([[0, 0, 1, -NEAR_M], *sides], dtype=np.float64)


def _span_inside(start: Array, end: Array, planes: Array) -> tuple[float, float] | None:
    """Return the shares of a segment between which it is in view (Liang and Barsky 1984), None where it is not."""
    at_start, at_end = planes[:, :3] @ start + planes[:, 3], planes[:, :3] @ end + planes[:, 3]
    first, last = 0.0, 1.0
    for a, b in zip(at_start.tolist(), at_end.tolist(), strict=True):
        if a < 0 and b < 0:
            return None
        if a < 0:
            first = max(first, a / (a - b))
        elif b < 0:
            last = min(last, a / (a - b))
    return (first, last) if first < last else None


def _cut(ring: Array, plane: Array) -> Array:
    """Return the ring on the inner side of a plane."""
    inside = ring @ plane[:3] + plane[3]
    if np.all(inside >= 0):
        return ring
    kept: list[Array] = []
    for here, there, a, b in zip(ring, np.roll(ring, -1, axis=0), inside, np.roll(inside, -1), strict=True):
        if a >= 0:
            kept.append(here)
        if (a < 0) != (b < 0):
            kept.append(here + a / (a - b) * (there - here))
    return np.array(kept).reshape(-1, 3)


def _pixels(points: Array, camera: Camera) -> Array:
    depth = points[:, 2:] * camera.tangent_pitch
    return np.asarray(points[:, :2] / depth + np.array([camera.film.cols / 2, camera.film.rows / 2]))
