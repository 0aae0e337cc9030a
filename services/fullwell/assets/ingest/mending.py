"""Triangles put in order: no slivers, no doubles, one winding, normals where there are none; and what stays open is counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.ingest.normals import corner_normals, face_normals, join_corners, places, same_rows
from fullwell.assets.model import LoadedPart

__all__ = ["Edges", "Mended", "edges_of", "mend_part", "part_area_m2"]

_SLIVER: Final = 1e-12
"""Twice the area over the squared longest edge, below which a triangle has no usable normal in float32."""


@dataclass(frozen=True, slots=True, eq=False)
class Mended:
    """A part in order, and what was done: triangles removed, triangles turned over, whether normals were made."""

    part: LoadedPart
    slivers: int = 0
    doubles: int = 0
    turned: int = 0
    bodies_turned: int = 0
    one_sided: int = 0
    normals_made: bool = False


@dataclass(frozen=True, slots=True)
class Edges:
    """Edges by the number of triangles that meet there: one (open) or more than two (branched)."""

    open: int
    branched: int

    @property
    def closed(self) -> bool:
        """Whether the triangles enclose a volume."""
        return self.open == 0 and self.branched == 0


def mend_part(part: LoadedPart, *, crease_deg: float, make_normals: bool) -> Mended | None:
    """Return a part with its triangles in order, or None where none is left.

    Vertices are rounded to float32 first, as level files hold them. Triangles without an area and repeated ones are removed;
    neighbours wound against each other are turned to what most of their surface is; closed bodies that are inside out are
    turned too. Normals are made where there are none and `make_normals` says so, and made anew where triangles were turned.
    """
    vertices = part.vertices_m.astype(np.float32).astype(np.float64) + 0.0
    faces = part.faces.astype(np.int64)
    keep = _with_area(vertices, faces)
    slivers = int(np.count_nonzero(~keep))
    faces = faces[keep]
    if not len(faces):
        return None
    at = places(vertices)
    first, back_to_back = _first_of_each(at[faces])
    doubles = len(faces) - len(first)
    faces = faces[first]
    turn, bodies = _turns(vertices, at[faces])
    turned = int(np.count_nonzero(turn))
    faces[turn] = faces[turn][:, ::-1]
    made = (part.normals is None and make_normals) or (part.normals is not None and turned > 0)
    normals = None if part.normals is None else _unit(part.normals[faces])
    if made:
        normals = corner_normals(vertices, faces, crease_deg=crease_deg)
    uv = None if part.uv is None else part.uv[faces]
    new_vertices, new_faces, new_normals, new_uv = join_corners(vertices, faces, normals, uv)
    mended = replace(
        part,
        vertices_m=new_vertices,
        faces=new_faces.astype(np.uint32),
        normals=new_normals,
        uv=new_uv,
        double_sided=part.double_sided or back_to_back > 0,
    )
    return Mended(mended, slivers, doubles, turned, bodies, back_to_back, made)


def _unit(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.asarray(np.divide(normals, length, out=np.zeros_like(normals), where=length > 0))


def part_area_m2(part: LoadedPart) -> float:
    """Return the area of all triangles of a part [m^2]."""
    # Its last bits differ between machines, and it goes into digests.
    return round(float(face_normals(part.vertices_m, part.faces.astype(np.int64))[1].sum()), 9)


def _with_area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    corners = vertices[faces]
    edges = np.roll(corners, -1, axis=1) - corners
    longest = (edges**2).sum(axis=2).max(axis=1)
    doubled = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return np.asarray((doubled > _SLIVER * longest) & (longest > 0))


def _first_of_each(faces_at: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """Rows of the first triangle of each set with the same three places, and how many sets hold both windings."""
    first, which = same_rows(np.sort(faces_at, axis=1))
    if len(first) == len(faces_at):
        return np.arange(len(faces_at)), 0
    # The parity of the permutation that sorts a triangle tells its winding.
    order = np.argsort(faces_at, axis=1, kind="stable")
    odd = ((order[:, 0] > order[:, 1]) ^ (order[:, 1] > order[:, 2]) ^ (order[:, 0] > order[:, 2])).astype(np.int64)
    count = np.bincount(which)
    odds = np.bincount(which, weights=odd)
    return np.sort(first), int(np.count_nonzero((odds > 0) & (odds < count)))


@dataclass(frozen=True, slots=True, eq=False)
class _EdgeTable:
    """Of each face's three edges: its number among different ones, and whether it runs from the lower to the higher place."""

    number: NDArray[np.int64]
    upward: NDArray[np.bool_]
    count: NDArray[np.int64]


def _edge_table(faces_at: NDArray[np.int64]) -> _EdgeTable:
    start = faces_at.reshape(-1)
    end = np.roll(faces_at, -1, axis=1).reshape(-1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    key = low * (int(high.max()) + 1) + high
    _, number, count = np.unique(key, return_inverse=True, return_counts=True)
    return _EdgeTable(number.reshape(-1), start < end, count)


def edges_of(parts: Sequence[LoadedPart]) -> Edges:
    """Return how the triangles of all parts together meet, places counted by their coordinates alone."""
    vertices = np.concatenate([part.vertices_m for part in parts])
    starts = np.cumsum([0, *(len(part.vertices_m) for part in parts)])
    faces = np.concatenate([part.faces.astype(np.int64) + start for part, start in zip(parts, starts, strict=False)])
    count = _edge_table(places(vertices)[faces]).count
    return Edges(int(np.count_nonzero(count == 1)), int(np.count_nonzero(count > 2)))


def _turns(vertices: NDArray[np.float64], faces_at: NDArray[np.int64]) -> tuple[NDArray[np.bool_], int]:
    """Which triangles to turn over, and how many closed bodies were inside out.

    Every face stands twice in a graph, as it is and turned; neighbours across an edge that exactly two share are joined as they
    fit. A surface that can be wound one way falls into two halves there, and each half names a winding of all its faces.
    """
    from scipy.sparse import coo_array  # noqa: PLC0415  (slow to import)
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    table = _edge_table(faces_at)
    total = len(faces_at)
    edge_halves = np.flatnonzero(table.count[table.number] == 2)
    paired = edge_halves[np.argsort(table.number[edge_halves], kind="stable")].reshape(-1, 2)
    left, right = paired[:, 0] // 3, paired[:, 1] // 3
    # Rightly wound neighbours run along their edge in opposite directions.
    against = (table.upward[paired[:, 0]] == table.upward[paired[:, 1]]).astype(np.int64)
    rows = np.concatenate([left, left + total])
    cols = np.concatenate([right + total * against, right + total * (1 - against)])
    joined = coo_array((np.ones(len(rows), dtype=np.int8), (rows, cols)), shape=(2 * total, 2 * total))
    _, half = connected_components(joined, directed=False)
    _, surface = connected_components(
        coo_array((np.ones(len(left), dtype=np.int8), (left, right)), shape=(total, total)), directed=False
    )
    orientable = half[:total] != half[total:]
    # Of the two halves of a surface the one of the smaller number holds, face by face, the windings to keep or to turn.
    turned = half[:total] > half[total:]
    surfaces = int(surface.max()) + 1
    size = np.bincount(surface, minlength=surfaces)
    minority = np.bincount(surface, weights=turned, minlength=surfaces) * 2 > size
    turn = np.where(minority[surface], ~turned, turned) & orientable
    inverted = _inside_out(vertices, faces_at, table, surface, turn)
    return turn ^ inverted[surface], int(np.count_nonzero(inverted))


def _inside_out(
    vertices: NDArray[np.float64],
    faces_at: NDArray[np.int64],
    table: _EdgeTable,
    surface: NDArray[np.int32],
    turn: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """(surfaces,) whether a closed body would have a negative volume and lies in no other closed body, as a cavity does."""
    surfaces = int(surface.max()) + 1
    unclosed = np.bincount(surface, weights=(table.count[table.number].reshape(-1, 3) != 2).any(axis=1), minlength=surfaces)
    corner = np.zeros((int(faces_at.max()) + 1, 3))
    at = places(vertices)
    corner[at[at <= faces_at.max()]] = vertices[at <= faces_at.max()]
    points = corner[faces_at]
    low, high = np.full((surfaces, 3), np.inf), np.full((surfaces, 3), -np.inf)
    np.minimum.at(low, surface, points.min(axis=1))
    np.maximum.at(high, surface, points.max(axis=1))
    local = points - ((low + high) / 2)[surface][:, None]
    sixfold = np.einsum("ij,ij->i", local[:, 0], np.cross(local[:, 1], local[:, 2])) * np.where(turn, -1.0, 1.0)
    volume = np.bincount(surface, weights=sixfold, minlength=surfaces)
    extent = np.prod(high - low, axis=1)
    closed = unclosed == 0
    wrong = closed & (volume < -1e-9 * np.maximum(extent, 1e-300))
    outer = np.flatnonzero(closed & ~wrong)
    for number in np.flatnonzero(wrong) if len(outer) <= 1000 else ():
        inside = (low[outer] <= low[number]).all(axis=1) & (high[outer] >= high[number]).all(axis=1)
        wrong[number] = not inside.any()
    return np.asarray(wrong)
