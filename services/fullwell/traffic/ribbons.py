"""Lines along roads: offset to the side, cut into dashes, widened into ribbons of triangles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

__all__ = ["along", "cut", "dashes", "length_m", "offset", "ribbon"]

Array = NDArray[np.float64]

_SHARPEST_COSINE = 0.25
"""Mitres of sharper bends are cut short: their tips would run away."""


def length_m(line_m: Array) -> float:
    """Return the length of a line (n, 3) as seen from above [m]."""
    return float(np.linalg.norm(np.diff(line_m[:, :2], axis=0), axis=1).sum())


def offset(line_m: Array, left_m: float) -> Array:
    """Return the line (n, 3) moved to its left, in the plane, by `left_m` [m]; to its right where negative."""
    steps = np.diff(line_m[:, :2], axis=0)
    steps /= np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), 1e-12)
    normals = np.stack([-steps[:, 1], steps[:, 0]], axis=1)
    before, after = np.concatenate([normals[:1], normals]), np.concatenate([normals, normals[-1:]])
    mitre = before + after
    # |before + after| = 2 cos(half the bend); the mitre is 1 / cos(half the bend) long.
    cosine = np.maximum(np.linalg.norm(mitre, axis=1, keepdims=True) / 2, _SHARPEST_COSINE)
    mitre /= np.maximum(np.linalg.norm(mitre, axis=1, keepdims=True), 1e-12) * cosine
    moved = line_m.copy()
    moved[:, :2] += left_m * mitre
    return moved


def along(line_m: Array, places_m: Array) -> Array:
    """Return the points (k, 3) at distances from the line's start, as seen from above; beyond the ends, the ends."""
    lengths = np.linalg.norm(np.diff(line_m[:, :2], axis=0), axis=1)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.stack([np.interp(places_m, at, line_m[:, axis]) for axis in range(3)], axis=1)


def cut(line_m: Array, start_m: float, end_m: float) -> Array:
    """Return the part of a line between two distances from its start, with the corners between them."""
    lengths = np.linalg.norm(np.diff(line_m[:, :2], axis=0), axis=1)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    inner = at[(at > start_m + 1e-6) & (at < end_m - 1e-6)]
    return along(line_m, np.concatenate([[start_m], inner, [end_m]]))


def dashes(line_m: Array, mark_m: float, gap_m: float) -> Iterator[Array]:
    """Yield the marks of a dashed line: whole ones only, with half a gap before the first."""
    whole = length_m(line_m)
    start = gap_m / 2
    while start + mark_m <= whole:
        yield cut(line_m, start, start + mark_m)
        start += mark_m + gap_m


def ribbon(line_m: Array, width_m: float, *, raised_m: float = 0.0) -> tuple[Array, NDArray[np.int64]]:
    """Return (2 n, 3) vertices and (2 n - 2, 3) faces, front upwards, of a line widened to both sides."""
    left, right = offset(line_m, width_m / 2), offset(line_m, -width_m / 2)
    count = len(line_m)
    vertices = np.concatenate([right, left])
    vertices[:, 2] += raised_m
    here = np.arange(count - 1)
    faces = np.concatenate(
        [
            np.stack([here, here + 1, here + 1 + count], axis=1),
            np.stack([here, here + 1 + count, here + count], axis=1),
        ]
    )
    return vertices, faces.astype(np.int64)
