"""Vertex normals that are smooth over gentle edges and sharp over creases."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["corner_normals", "face_normals", "join_corners", "places", "same_rows"]

Array = NDArray[np.float64]

_MAX_VALENCE: Final = 256
"""Corners that meet in one place; beyond it they are shaded flat, since every pair of them would have to be looked at."""

_MIX: Final = np.uint64(0x9E3779B97F4A7C15)

_PAIRS_AT_ONCE: Final = 4_000_000


def places(vertices: Array) -> NDArray[np.int64]:
    """Return (n,) numbers of the places that vertices lie at: equal for vertices at the very same coordinates."""
    return same_rows(vertices)[1]


def same_rows(values: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return (k,) the first row of each set of equal ones, and (n,) the set of each row. Sets are in no particular order."""
    kind = {4: np.uint32, 8: np.uint64}[values.dtype.itemsize]
    rows = np.ascontiguousarray(values + values.dtype.type(0)).view(kind).astype(np.uint64)  # adding 0 turns -0 into 0
    mixed = np.zeros(len(rows), dtype=np.uint64)
    for column in range(rows.shape[1]):  # a multiplicative hash: sorting whole rows takes many times longer
        mixed = (mixed ^ rows[:, column]) * _MIX
        mixed ^= mixed >> np.uint64(29)
    _, first, which = np.unique(mixed, return_index=True, return_inverse=True)
    which = which.reshape(-1)
    if not np.array_equal(rows[first][which], rows):  # two different rows with one hash
        _, first, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first.astype(np.int64), which.reshape(-1).astype(np.int64)


def face_normals(vertices: Array, faces: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return (m, 3) unit normals (zero where there is no area) and (m,) areas of triangles."""
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(cross, axis=1)
    unit = np.divide(cross, doubled[:, None], out=np.zeros_like(cross), where=doubled[:, None] > 0)
    return unit, doubled / 2


def corner_normals(vertices: Array, faces: NDArray[np.int64], *, crease_deg: float) -> Array:
    """Return (m, 3, 3) unit normals for each corner of each triangle.

    The mean, weighted by angle (Thuermer & Wuethrich 1998, J. Graphics Tools 3(1):43), of the faces around the corner's place
    whose normals differ from the corner's own face by less than `crease_deg`.
    """
    unit, _ = face_normals(vertices, faces)
    corners = vertices[faces]
    edges = np.roll(corners, -1, axis=1) - corners
    length = np.linalg.norm(edges, axis=2, keepdims=True)
    edges = np.divide(edges, length, out=np.zeros_like(edges), where=length > 0)
    cosine = -(edges * np.roll(edges, 1, axis=1)).sum(axis=2)
    weight = np.arccos(np.clip(cosine, -1.0, 1.0)).reshape(-1)
    own = np.repeat(unit, 3, axis=0)
    at = places(vertices)[faces].reshape(-1)
    sums = _sums_around(at, own, own * weight[:, None], limit=float(np.cos(np.deg2rad(crease_deg))))
    size = np.linalg.norm(sums, axis=1, keepdims=True)
    usable = size > 1e-9
    smooth = np.divide(sums, size, out=np.zeros_like(sums), where=usable)
    return np.asarray(np.where(usable, smooth, own).reshape(-1, 3, 3))


def _sums_around(at: NDArray[np.int64], own: Array, weighted: Array, *, limit: float) -> Array:
    """For each corner the sum of `weighted` over the corners at its place whose own normals are near its own."""
    order = np.argsort(at, kind="stable")
    counts = np.bincount(at)
    starts = np.cumsum(counts) - counts
    valence = counts[at]
    sums = weighted.copy()
    several = np.flatnonzero((valence > 1) & (valence <= _MAX_VALENCE))
    ends = np.cumsum(valence[several])
    first = 0
    while first < len(several):
        done = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, done + _PAIRS_AT_ONCE, side="right")), first + 1)
        here = several[first:last]
        lengths = valence[here]
        step = np.arange(int(lengths.sum())) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        row = np.repeat(np.arange(len(here)), lengths)
        other = order[starts[at[here]][row] + step]
        near = (own[here][row] * own[other]).sum(axis=1) >= limit - 1e-12
        summands = weighted[other] * near[:, None]
        sums[here] = np.add.reduceat(summands, np.cumsum(lengths) - lengths, axis=0)
        first = last
    return sums


def join_corners(
    vertices: Array, faces: NDArray[np.int64], normals: Array | None, uv: Array | None
) -> tuple[Array, NDArray[np.int64], Array | None, Array | None]:
    """Return vertices, faces, normals and texture coordinates by vertex of ones by corner, (m, 3, 3) and (m, 3, 2) or None.

    Corners that agree in everything (float32) become one vertex; order follows the first use.
    """
    columns = [vertices[faces].reshape(-1, 3)]
    columns += [extra.reshape(len(faces) * 3, -1) for extra in (normals, uv) if extra is not None]
    rows = np.concatenate(columns, axis=1).astype(np.float32) + np.float32(0)
    first, inverse = same_rows(rows)
    rank = np.argsort(np.argsort(first))
    joined = rows[np.sort(first)].astype(np.float64)
    new_faces = rank[inverse].reshape(-1, 3).astype(np.int64)
    end = 6 if normals is not None else 3
    return (
        joined[:, :3],
        new_faces,
        joined[:, 3:6] if normals is not None else None,
        joined[:, end : end + 2] if uv is not None else None,
    )
