"""Subdivision surfaces: polygon meshes refined by the rules of Catmull and Clark, with creases and corners.

Catmull & Clark 1978 (Computer-Aided Design 10(6):350) for the smooth rules; DeRose, Kass & Truong 1998 (SIGGRAPH, section 3)
for sharp and half-sharp creases; borders are creases and lone corners stay, USD's "edgeAndCorner".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Creases", "PolygonMesh", "refined"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Creases:
    """(k, 2) points at the ends of sharp edges with (k,) sharpness, and (c,) sharp points; sharpness 1 lasts one level."""

    edges: Indices
    sharpness: Array
    corners: Indices

    @classmethod
    def none(cls) -> Creases:
        """Return no creases at all."""
        return cls(np.zeros((0, 2), dtype=np.int64), np.zeros(0), np.zeros(0, dtype=np.int64))


@dataclass(frozen=True, slots=True, eq=False)
class PolygonMesh:
    """Polygons: (n, 3) points, (f,) corners of each face, (c,) point of each corner, (c, 2) texture coordinates or None.

    `parent` names, for each face, the face of the control mesh that it came from.
    """

    points: Array
    counts: Indices
    indices: Indices
    uv: Array | None
    parent: Indices


def refined(mesh: PolygonMesh, levels: int, *, creases: Creases | None = None, smooth: bool = True) -> PolygonMesh:
    """Return a mesh after so many levels of subdivision: four-cornered faces, four times as many at each level.

    Texture coordinates are interpolated linearly within each face. Not `smooth`: points are interpolated linearly too, USD's
    "bilinear" scheme.
    """
    sharp = creases or Creases.none()
    for _ in range(levels):
        mesh, sharp = _once(mesh, sharp, smooth=smooth)
    return mesh


@dataclass(frozen=True, slots=True, eq=False)
class _Edges:
    """(e, 2) ends; (c,) edge from each corner to the next of its face; (c,) next corner; (e,) faces at each."""

    ends: Indices
    at: Indices
    following: Indices
    faces: Indices


def _edges_of(mesh: PolygonMesh) -> _Edges:
    starts = np.cumsum(mesh.counts) - mesh.counts
    following = np.arange(len(mesh.indices)) + 1
    following[starts + mesh.counts - 1] = starts
    ends = np.sort(np.stack([mesh.indices, mesh.indices[following]], axis=1), axis=1)
    unique, at, faces = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    return _Edges(unique.astype(np.int64), at.reshape(-1).astype(np.int64), following, faces.astype(np.int64))


def _once(mesh: PolygonMesh, creases: Creases, *, smooth: bool) -> tuple[PolygonMesh, Creases]:
    edges = _edges_of(mesh)
    face_of = np.repeat(np.arange(len(mesh.counts)), mesh.counts)
    middle = _means(mesh.points[mesh.indices], face_of, len(mesh.counts))
    sharpness = _sharpness(edges, creases)
    halves = mesh.points[edges.ends].mean(axis=1)
    if smooth:
        edge_points = _edge_points(edges, halves, middle[face_of], sharpness)
        points = _vertex_points(
            mesh, edges, halves, middle_at_corner=middle[face_of], sharpness=sharpness, corners=creases.corners
        )
    else:
        edge_points, points = halves, mesh.points
    first_edge, first_face = len(points), len(points) + len(halves)
    before = np.empty_like(edges.following)
    before[edges.following] = np.arange(len(before))
    quads = np.stack([mesh.indices, first_edge + edges.at, first_face + face_of, first_edge + edges.at[before]], axis=1)
    finer = PolygonMesh(
        np.concatenate([points, edge_points, middle]),
        np.full(len(quads), 4, dtype=np.int64),
        quads.reshape(-1),
        None if mesh.uv is None else _finer_uv(mesh.uv, edges, before, face_of, len(mesh.counts)),
        mesh.parent[face_of],
    )
    return finer, _finer_creases(edges, sharpness, creases.corners, first_edge)


def _means(values: Array, group: Indices, groups: int) -> Array:
    count = np.bincount(group, minlength=groups)
    sums = np.stack(
        [np.bincount(group, weights=values[:, column], minlength=groups) for column in range(values.shape[1])], axis=1
    )
    return np.asarray(sums / np.maximum(count, 1)[:, None])


def _sharpness(edges: _Edges, creases: Creases) -> Array:
    """(e,) of each edge; borders, and edges where more than two faces meet, are sharp for ever."""
    sharpness = np.where(edges.faces == 2, 0.0, np.inf)
    if len(creases.edges):
        number = {(a, b): edge for edge, (a, b) in enumerate(edges.ends.tolist())}
        for (a, b), value in zip(np.sort(creases.edges, axis=1).tolist(), creases.sharpness.tolist(), strict=True):
            edge = number.get((a, b))
            if edge is not None:
                sharpness[edge] = max(sharpness[edge], value)
    return sharpness


def _edge_points(edges: _Edges, halves: Array, middle_at_corner: Array, sharpness: Array) -> Array:
    around = _means(middle_at_corner, edges.at, len(halves))
    weight = np.clip(sharpness, 0.0, 1.0)[:, None]
    return np.asarray(weight * halves + (1.0 - weight) * (halves + around) / 2.0)


def _vertex_points(
    mesh: PolygonMesh, edges: _Edges, halves: Array, *, middle_at_corner: Array, sharpness: Array, corners: Indices
) -> Array:
    total = len(mesh.points)
    both = edges.ends.reshape(-1)
    valence = np.bincount(both, minlength=total).astype(np.float64)
    faces_mean = _means(middle_at_corner, mesh.indices, total)
    halves_mean = _means(np.repeat(halves, 2, axis=0), both, total)
    n = np.maximum(valence, 1.0)[:, None]
    smooth = (faces_mean + 2.0 * halves_mean + (n - 3.0) * mesh.points) / n
    is_sharp = np.repeat(sharpness > 0, 2)
    ends = both[is_sharp]
    sharp_edges = np.bincount(ends, minlength=total)
    other = edges.ends[:, ::-1].reshape(-1)[is_sharp]
    crease = 0.75 * mesh.points + 0.25 * _means(mesh.points[other], ends, total)
    fade = _means(np.minimum(np.repeat(sharpness, 2)[is_sharp], 1.0)[:, None], ends, total)
    lone = np.bincount(mesh.indices, minlength=total) == 1
    fixed = (sharp_edges > 2) | (lone & (sharp_edges == 2)) | (valence == 0)
    fixed[corners[(corners >= 0) & (corners < total)]] = True
    sharp = np.where(fixed[:, None], mesh.points, crease)
    weight = np.where(fixed & (sharp_edges <= 2), 1.0, np.where(sharp_edges >= 2, fade[:, 0], 0.0))[:, None]
    return np.asarray(weight * sharp + (1.0 - weight) * smooth)


def _finer_uv(uv: Array, edges: _Edges, before: Indices, face_of: Indices, faces: int) -> Array:
    ahead = (uv + uv[edges.following]) / 2.0
    return np.asarray(np.stack([uv, ahead, _means(uv, face_of, faces)[face_of], ahead[before]], axis=1).reshape(-1, 2))


def _finer_creases(edges: _Edges, sharpness: Array, corners: Indices, first_edge: int) -> Creases:
    left = np.flatnonzero((sharpness > 1.0) & np.isfinite(sharpness))
    middle = np.repeat(first_edge + left, 2)
    ends = np.stack([edges.ends[left].reshape(-1), middle], axis=1)
    return Creases(ends, np.repeat(sharpness[left] - 1.0, 2), corners)
