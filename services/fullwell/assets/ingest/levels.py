"""Coarser levels of detail: quadric decimation part by part, and the distance that it moved the surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.ingest.normals import corner_normals, face_normals, join_corners, places, same_rows
from fullwell.assets.model import LoadedPart

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

__all__ = ["CoarserLevel", "Simplifier", "crowd_distance_m", "surface_distance_m"]

Array = NDArray[np.float64]

_AGGRESSION: Final = 5.0
_WORKING_SIZE: Final = 30.0
"""Exponent of the library's error threshold, and the diagonal that parts are scaled to. Of the pairs tried (5 at 1 and 30, 6 at
300, 3 at 10, 7 at 1000) this one comes nearest to a quarter of a car's triangles for the distance it costs."""

_LEAST_AREA: Final = 0.6
"""Of a part's area: decimation that loses more has eaten leaves or bars."""

_SMALLEST_PART: Final = 8
"""Triangles that a part keeps at least, or all where it has no more: a plate is two."""

_MOST_SAMPLES: Final = 20_000
_SAMPLES_PER_TRIANGLE: Final = 12
_MOST_LOOKED_AT: Final = 12_000
_CANDIDATES: Final = 4
_CANDIDATES_CLOSELY: Final = 48
_CLOSELY_AT_ONCE: Final = 256
_NEGLIGIBLE: Final = 1e-4
"""Of the diagonal: distances that need not be known more closely."""

_TURNED_PENALTY: Final = 0.05
"""Of the diagonal: how much farther a triangle facing away counts, so that thin sheets take values from their own side."""


@dataclass(frozen=True, slots=True, eq=False)
class CoarserLevel:
    """Simplified parts, and the largest distance [m] between the two surfaces, either way."""

    parts: tuple[LoadedPart, ...]
    error_m: float

    @property
    def triangles(self) -> int:
        """Number of triangles of all parts."""
        return sum(len(part.faces) for part in self.parts)


class Simplifier:
    """Makes coarser levels of one asset.

    Each part is simplified alone (Garland & Heckbert 1997, by the library fast-simplification), so that names and materials
    stay. Open borders are kept where possible, so that no gaps open between body and windows.

    Parameters
    ----------
    parts
        Of the finest level.
    max_error_m
        A part that would be moved farther stays finer.
    crease_deg
        New normals are smooth over edges that bend less.
    """

    def __init__(self, parts: Sequence[LoadedPart], *, max_error_m: float, crease_deg: float) -> None:
        self._parts = tuple(parts)
        self._max_error_m = max_error_m
        self._crease_deg = crease_deg
        self._surfaces: dict[int, _Surface] = {}

    def level(self, ratio: float) -> CoarserLevel:
        """Return the parts with about `ratio` of their triangles each, or with more where that would cost too much shape."""
        made = [self._simplified(number, ratio) for number in range(len(self._parts))]
        return CoarserLevel(tuple(part for part, _ in made), max(error for _, error in made))

    def _simplified(self, number: int, ratio: float) -> tuple[LoadedPart, float]:
        part = self._parts[number]
        goal = max(round(len(part.faces) * ratio), _SMALLEST_PART)
        if goal >= len(part.faces):
            return part, 0.0
        fine = self._surface(number)
        at = places(part.vertices_m)
        points = np.zeros((int(at.max()) + 1, 3))
        points[at] = part.vertices_m
        triangles = at[part.faces.astype(np.int64)]
        best: tuple[Array, NDArray[np.int64]] | None = None
        error_m = 0.0
        for keep_border in (True, False):
            vertices, faces = _decimated(points, triangles, goal, keep_border=keep_border)
            if not 0 < len(faces) < len(part.faces if best is None else best[1]):
                continue
            distance_m, area_ratio = _two_way(fine, _surface_of(vertices, faces))
            if distance_m <= self._max_error_m and area_ratio >= _LEAST_AREA:
                best, error_m = (vertices, faces), distance_m
            if best is not None and len(best[1]) <= 1.5 * goal:
                break
        return (part, 0.0) if best is None else (self._part_of(part, fine, *best), error_m)

    def _surface(self, number: int) -> _Surface:
        if number not in self._surfaces:
            part = self._parts[number]
            self._surfaces[number] = _surface_of(part.vertices_m, part.faces.astype(np.int64))
        return self._surfaces[number]

    def _part_of(self, part: LoadedPart, fine: _Surface, vertices: Array, faces: NDArray[np.int64]) -> LoadedPart:
        normals = None if part.normals is None else corner_normals(vertices, faces, crease_deg=self._crease_deg)
        uv = None if part.uv is None else _uv_of(part, fine, vertices, faces)
        new_vertices, new_faces, new_normals, new_uv = join_corners(vertices, faces, normals, uv)
        return replace(part, vertices_m=new_vertices, faces=new_faces.astype(np.uint32), normals=new_normals, uv=new_uv)


def _decimated(points: Array, triangles: NDArray[np.int64], goal: int, *, keep_border: bool) -> tuple[Array, NDArray[np.int64]]:
    import fast_simplification  # noqa: PLC0415  (an extra)

    # The library's thresholds are absolute: at this size they rise slowly enough to take the flattest places first.
    centre = points.mean(axis=0)
    scale = _WORKING_SIZE / float(np.linalg.norm(np.ptp(points, axis=0)))
    moved, left = fast_simplification.simplify(
        (points - centre) * scale, triangles.astype(np.int32), target_count=goal, agg=_AGGRESSION, preserve_border=keep_border
    )
    vertices = (np.asarray(moved, dtype=np.float64) / scale + centre).astype(np.float32).astype(np.float64) + 0.0
    faces = np.asarray(left, dtype=np.int64).reshape(-1, 3)
    return vertices, faces[face_normals(vertices, faces)[1] > 0]


@dataclass(frozen=True, slots=True, eq=False)
class _Surface:
    """Triangles with points spread over them, to find the nearest by."""

    corners: Array
    normals: Array
    area_m2: float
    sampled: NDArray[np.int64]
    tree: cKDTree


def _surface_of(vertices: Array, faces: NDArray[np.int64]) -> _Surface:
    from scipy.spatial import cKDTree  # noqa: PLC0415  (slow to import)

    corners = vertices[faces]
    normals, area = face_normals(vertices, faces)
    points, owners = [corners.mean(axis=1)], [np.arange(len(faces))]
    samples = min(_MOST_SAMPLES, 500 + _SAMPLES_PER_TRIANGLE * len(faces))
    extra = np.floor(area / area.sum() * samples).astype(np.int64)
    owner = np.repeat(np.arange(len(faces)), extra)
    # An even sequence in the unit square (Roberts' R2), folded into the triangle: the same points each time.
    number = np.arange(len(owner)) + 1
    u, v = (0.7548776662466927 * number) % 1.0, (0.5698402909980532 * number) % 1.0
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    base = corners[owner]
    points.append(base[:, 0] + u[:, None] * (base[:, 1] - base[:, 0]) + v[:, None] * (base[:, 2] - base[:, 0]))
    owners.append(owner)
    tree = cKDTree(np.concatenate(points), balanced_tree=False, compact_nodes=False)
    return _Surface(corners, normals, float(area.sum()), np.concatenate(owners), tree)


def _nearest(surface: _Surface, points: Array, *, candidates: int = _CANDIDATES) -> tuple[NDArray[np.int64], Array]:
    """(n, k) triangles that are candidates for the nearest of each point, and their true distances."""
    count = min(candidates, len(surface.sampled))
    _, found = surface.tree.query(points, k=count)
    triangles = surface.sampled[np.asarray(found).reshape(len(points), count)]
    return triangles, _distances(surface, triangles, points)


def _distances(surface: _Surface, candidates: NDArray[np.int64], points: Array) -> Array:
    import trimesh  # noqa: PLC0415  (an extra)

    repeated = np.repeat(points, candidates.shape[1], axis=0)
    closest = trimesh.triangles.closest_point(surface.corners[candidates.reshape(-1)], repeated)
    return np.asarray(np.linalg.norm(closest - repeated, axis=1).reshape(candidates.shape))


def surface_distance_m(part: LoadedPart, points_m: Array) -> float:
    """Return the largest distance [m] from any of (n, 3) points to a part's triangles: an upper bound, and a close one."""
    return _farthest(_surface_of(part.vertices_m, part.faces.astype(np.int64)), points_m)


def crowd_distance_m(fine: Sequence[LoadedPart], rough: Sequence[LoadedPart]) -> float:
    """Return the distance [m] within which 95 % of one thing's surface lies from the other's, either way, all parts together.

    For crowds of leaves: of many fewer ones each stands in the midst of those that it replaces, and the farthest is no measure.
    """
    first, second = _whole(fine), _whole(rough)
    ways = ((first, second), (second, first))
    return max(float(np.quantile(_nearest(a, _looked_at(b))[1].min(axis=1), _CROWD_QUANTILE)) for a, b in ways)


def _whole(parts: Sequence[LoadedPart]) -> _Surface:
    starts = np.cumsum([0, *(len(part.vertices_m) for part in parts)])
    faces = [part.faces.astype(np.int64) + start for part, start in zip(parts, starts[:-1], strict=True)]
    return _surface_of(np.concatenate([part.vertices_m for part in parts]), np.concatenate(faces))


_CROWD_QUANTILE: Final = 0.95


def _farthest(surface: _Surface, points: Array) -> float:
    """Largest distance of any point. A few candidates give bounds; only the largest of these are then looked at closely."""
    bound = _nearest(surface, points)[1].min(axis=1)
    order = np.argsort(-bound, kind="stable")
    negligible = _NEGLIGIBLE * float(np.linalg.norm(np.ptp(surface.corners.reshape(-1, 3), axis=0)))
    worst = 0.0
    for start in range(0, len(order), _CLOSELY_AT_ONCE):
        some = order[start : start + _CLOSELY_AT_ONCE]
        if bound[some[0]] <= max(worst, negligible):
            return max(worst, float(bound[some[0]]))
        worst = max(worst, float(_nearest(surface, points[some], candidates=_CANDIDATES_CLOSELY)[1].min(axis=1).max()))
    return worst


def _two_way(fine: _Surface, rough: _Surface) -> tuple[float, float]:
    """Largest distance either way, and area over the fine surface's."""
    distance = max(_farthest(rough, _looked_at(fine)), _farthest(fine, _looked_at(rough)))
    return distance, rough.area_m2 / fine.area_m2


def _looked_at(surface: _Surface) -> Array:
    """Corners, middles of edges and of triangles, each once; of large meshes an even share of them."""
    corners = surface.corners
    middles = (corners + np.roll(corners, -1, axis=1)) / 2
    every = np.concatenate([corners.reshape(-1, 3), middles.reshape(-1, 3), corners.mean(axis=1)])
    at = places(every.astype(np.float32).astype(np.float64))
    first = np.unique(at, return_index=True)[1]
    return every[first[:: -(-len(first) // _MOST_LOOKED_AT)]]


def _uv_of(part: LoadedPart, surface: _Surface, vertices: Array, faces: NDArray[np.int64]) -> Array:
    """(m, 3, 2) texture coordinates of new triangles, each taken from one chart of the part's unwrapping."""
    import trimesh  # noqa: PLC0415  (an extra)

    assert part.uv is not None
    old_faces = part.faces.astype(np.int64)
    chart = _charts(part)
    corners = vertices[faces]
    normal, _ = face_normals(vertices, faces)
    diagonal = float(np.linalg.norm(np.ptp(part.vertices_m, axis=0)))
    candidates, distances = _nearest(surface, corners.mean(axis=1))
    away = np.einsum("ijk,ik->ij", surface.normals[candidates], normal) < 0
    own = candidates[np.arange(len(faces)), (distances + _TURNED_PENALTY * diagonal * away).argmin(axis=1)]
    points = corners.reshape(-1, 3)
    candidates, distances = _nearest(surface, points)
    own3 = np.repeat(own, 3)
    candidates = np.concatenate([candidates, own3[:, None]], axis=1)
    distances = np.concatenate([distances, _distances(surface, own3[:, None], points)], axis=1)
    distances = np.where(chart[candidates] == chart[own3][:, None], distances, np.inf)
    taken = candidates[np.arange(len(points)), distances.argmin(axis=1)]
    triangles = surface.corners[taken]
    closest = trimesh.triangles.closest_point(triangles, points)
    weights = np.nan_to_num(trimesh.triangles.points_to_barycentric(triangles, closest), nan=1 / 3)
    return np.asarray(np.einsum("ij,ijk->ik", weights, part.uv[old_faces[taken]]).reshape(-1, 3, 2))


def _charts(part: LoadedPart) -> NDArray[np.int32]:
    """(m,) number of the piece of the unwrapping that each triangle lies in: pieces share no texture coordinates."""
    from scipy.sparse import coo_array  # noqa: PLC0415  (slow to import)
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    assert part.uv is not None
    faces = part.faces.astype(np.int64)
    rows = np.concatenate([part.vertices_m, part.uv], axis=1)
    point = same_rows(rows)[1][faces]
    total = int(point.max()) + 1
    start, end = point.reshape(-1), np.roll(point, -1, axis=1).reshape(-1)
    graph = coo_array((np.ones(len(start), dtype=np.int8), (start, end)), shape=(total, total))
    return np.asarray(connected_components(graph, directed=False)[1][point[:, 0]])
