"""Where objects lie on the film, hidden or not: each triangle fills the sample points whose chief rays meet it.

No ray is traced. A triangle with corners v0, v1, v2 about the pupil is met by the ray along d where the three products
d . (vj x vk) have the sign of v0 . (v1 x v2); along a row of samples these are linear in the column, so that the samples
that meet the triangle are one span. Spans set bits in a table for each object, and the bits are counted: what stands before
what plays no part, nor do surfaces that lie in the same place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.render.transport.geometry import Geometry
from fullwell.render.transport.surfaces import CurvedShape, SceneSurfaces
from fullwell.render.transport.upload import upload
from fullwell.scene import Camera, Cylinder, Disk, Sphere
from fullwell.scene.extents import NEAR_M
from fullwell.scene.tessellate import mesh_of, transform_points

__all__ = ["Extents", "film_extents"]

_WORD_BITS = 32
_WORDS_AT_ONCE = 1 << 24
"""Size of the tables of bits: 64 MB, or those of one object."""

_ROWS_AT_ONCE = 32
"""Rows of samples that one lane goes through: large triangles are shared among several lanes."""

_SLACK = 3e-7
"""Times the film's size: how much longer spans are at both ends than single precision says (2e-4 of a pixel at 640 columns).
Five roundings, so that neighbouring triangles leave no cracks."""

_CIRCLE_SEGMENTS = 128
_RECORD = 5
_NOWHERE = 2**31 - 1

_FAR_PX = 1e8
"""Positions off the film are cut here: they fit into whole numbers."""


@dataclass(frozen=True, slots=True, eq=False)
class Extents:
    """`amodal_px` (objects,) int64 pixel centres whose ray meets the object at all; `area_px` (objects,) float64, the area of
    all samples that do, or None where only centres were looked at; `missed_pixels`, in which an object lies that no pixel
    centre meets."""

    amodal_px: NDArray[np.int64]
    area_px: NDArray[np.float64] | None
    missed_pixels: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class _Triangles:
    """On the device: corners about the pupil, world axes [m]; corner numbers; object of each triangle, `owners` on the host."""

    vertices: Any
    faces: Any
    objects: Any
    owners: NDArray[np.uint32]


@dataclass(frozen=True, slots=True, eq=False)
class _Tables:
    """A table of bits (sample of the pixel, rows, words) for each object, around its box on the film, one after the other."""

    start: NDArray[np.int64]
    low_row: NDArray[np.int64]
    rows: NDArray[np.int64]
    low_word: NDArray[np.int64]
    words: NDArray[np.int64]
    samples: int

    @property
    def sizes(self) -> NDArray[np.int64]:
        return self.samples * self.rows * self.words


def film_extents(mi: Any, geometry: Geometry, camera: Camera, objects: int, offsets: NDArray[np.float64]) -> Extents:
    """Return on how much of the film each object lies.

    Samples are the pixel's centre and `offsets` (n, 2) from it, whose places along y are k / (n + 1), each once. Spheres,
    disks and cylinders are taken as triangles with 128 segments around, spheres by the circle where rays touch them.
    """
    samples = np.append(offsets, [[0.0, 0.0]], axis=0)
    across = samples[np.argsort(samples[:, 1]), 0]
    raster = _Raster(mi, camera, across)
    sets = [(triangles, *raster.reach(triangles, objects)) for triangles in _triangle_sets(mi, geometry)]
    boxes = np.array([box for *_, box in sets], dtype=np.int64).reshape(len(sets), 4, objects)
    low, high = boxes[:, :2].min(axis=0, initial=_NOWHERE), boxes[:, 2:].max(axis=0, initial=-1)
    counts = np.zeros((objects, len(across)), dtype=np.int64)
    missed = [np.empty(0, dtype=np.int64)]
    present = np.flatnonzero((high >= low).all(axis=0))
    for group in _groups(present, low, high, len(across)):
        tables = _layout(group, low, high, objects, len(across))
        bits = raster.fill(sets, tables, group)
        starts = tables.start[group][:, None] + np.arange(len(across)) * (tables.rows * tables.words)[group][:, None]
        counts[group] = np.add.reduceat(raster.ones(bits), starts.ravel()).reshape(starts.shape)
        thin = group[(counts[group, len(across) // 2] == 0) & (counts[group].sum(axis=1) > 0)]
        missed.extend(_pixels(np.asarray(bits.numpy()), tables, item, camera.film.cols) for item in thin)
    return Extents(counts[:, len(across) // 2], counts.sum(axis=1) / len(across), np.unique(np.concatenate(missed)))


# Tables on the host --------------------------------------------------------------------------------------------------


def _groups(present: Any, low: Any, high: Any, samples: int) -> list[NDArray[np.int64]]:
    """Return the objects in groups whose tables fit into memory together."""
    sizes = samples * (high[0] - low[0] + 1) * (high[1] // _WORD_BITS - low[1] // _WORD_BITS + 1)
    group = np.cumsum(sizes[present]) // _WORDS_AT_ONCE
    return [present[group == number] for number in np.unique(group)]


def _layout(group: NDArray[np.int64], low: Any, high: Any, objects: int, samples: int) -> _Tables:
    inside = np.zeros(objects, dtype=bool)
    inside[group] = True
    rows = np.where(inside, high[0] - low[0] + 1, 0)
    words = np.where(inside, high[1] // _WORD_BITS - low[1] // _WORD_BITS + 1, 0)
    sizes = samples * rows * words
    start = np.cumsum(sizes) - sizes
    return _Tables(start, np.where(inside, low[0], 0), rows, np.where(inside, low[1] // _WORD_BITS, 0), words, samples)


def _pixels(bits: NDArray[np.uint32], tables: _Tables, item: int, cols: int) -> NDArray[np.int64]:
    """Return the pixels in which an object has a sample."""
    start, shape = tables.start[item], (tables.samples, int(tables.rows[item]), int(tables.words[item]))
    words = np.bitwise_or.reduce(bits[start : start + tables.sizes[item]].reshape(shape), axis=0)
    row, word = np.nonzero(words)
    shift = np.arange(_WORD_BITS, dtype=np.uint32)
    which, bit = np.nonzero((words[row, word][:, None] >> shift) & 1)
    col = (word[which] + tables.low_word[item]) * _WORD_BITS + bit
    return np.asarray((row[which] + tables.low_row[item]) * cols + col)


def _work(
    faces: NDArray[np.int64], first: NDArray[np.int32], count: NDArray[np.int32]
) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.int32]]:
    """Return faces, first rows of samples and their numbers, large triangles in several pieces."""
    large = np.flatnonzero(count > _ROWS_AT_ONCE)
    more = (count[large] - 1) // _ROWS_AT_ONCE
    again = np.repeat(large, more)
    done = (np.arange(len(again)) - np.repeat(np.cumsum(more) - more, more) + 1) * _ROWS_AT_ONCE
    rest = np.minimum(count[again] - done, _ROWS_AT_ONCE)
    pieces = (faces, faces[again]), (first, first[again] + done), (np.minimum(count, _ROWS_AT_ONCE), rest)
    return tuple(np.concatenate(both) for both in pieces)  # type: ignore[return-value]


# Triangles -----------------------------------------------------------------------------------------------------------


def _triangle_sets(mi: Any, geometry: Geometry) -> list[_Triangles]:
    """Return the mesh, and the curved shapes as a second one."""
    surfaces, found = geometry.surfaces, []
    if len(surfaces.faces):
        of_part = np.array([part.object_index for part in surfaces.parts], dtype=np.uint32)
        owners = of_part[surfaces.face_part]
        found.append(_Triangles(geometry.tables["vertices"], geometry.tables["faces"], upload(mi.UInt32, owners), owners))
    if surfaces.curved:
        vertices, faces, owners = _curved_triangles(surfaces)
        placed = upload(mi.Float, vertices), upload(mi.UInt32, faces), upload(mi.UInt32, owners)
        found.append(_Triangles(*placed, owners))
    return found


def _curved_triangles(surfaces: SceneSurfaces) -> tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.uint32]]:
    vertices, faces, owners, start = [], [], [], 0
    for shape in surfaces.curved:
        points, corners = _silhouette(shape)
        vertices.append(points.astype(np.float32))
        faces.append(corners.astype(np.uint32) + np.uint32(start))
        owners.append(np.full(len(corners), surfaces.parts[shape.part].object_index, dtype=np.uint32))
        start += len(points)
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(owners)


def _silhouette(shape: CurvedShape) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Return (n, 3) points and (m, 3) corners of triangles that the same rays from the origin meet."""
    centre, radius = shape.to_world[:3, 3], float(np.linalg.norm(shape.to_world[:3, 0]))
    distance = float(np.linalg.norm(centre))
    place = shape.to_world
    match shape.kind:
        case "sphere" if distance > radius * (1 + 1e-6):
            # The circle in which the cone of rays touches the sphere.
            share = 1.0 - (radius / distance) ** 2
            mesh = mesh_of(Disk(radius * np.sqrt(share)))
            place = np.eye(4)
            place[:3, :3] = _frame(centre / distance)
            place[:3, 3] = centre * share
        case "sphere":
            mesh = mesh_of(Sphere(1.0))
        case "disk":
            mesh = mesh_of(Disk(1.0))
        case "cylinder":
            mesh = mesh_of(Cylinder(1.0, 2 * shape.half_height))
    if shape.kind == "cylinder" or mesh.normals is not None:
        return transform_points(place, mesh.vertices_m), mesh.faces
    # A polygon of the circle's area.
    angle = 2 * np.pi / _CIRCLE_SEGMENTS
    return transform_points(place, mesh.vertices_m * np.sqrt(angle / np.sin(angle))), mesh.faces


def _frame(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a rotation whose third column is `axis`."""
    other = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(other, axis)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis], axis=1)


# Kernels -------------------------------------------------------------------------------------------------------------


class _Raster:
    """The film's sample points: pixel (row, col), sample number m, at ((m + 1/2) / n below the row's top, 1/2 + across[m])."""

    def __init__(self, mi: Any, camera: Camera, across: NDArray[np.float64]) -> None:
        import drjit as dr  # noqa: PLC0415

        self._mi, self._dr, self._count = mi, dr, len(across)
        film = camera.film
        # Camera axes, x and y in pixels at unit depth.
        scale = np.array([1 / camera.tangent_pitch, 1 / camera.tangent_pitch, 1.0])
        axes = camera.camera_to_world[:3, :3].T * scale[:, None]
        self._axes = [[dr.opaque(mi.Float, float(v)) for v in row] for row in axes]
        self._half_cols, self._half_rows = (dr.opaque(mi.Float, size / 2) for size in (film.cols, film.rows))
        self._cols, self._rows = dr.opaque(mi.Int32, film.cols), dr.opaque(mi.Int32, film.rows * self._count)
        self.samples, self._step = dr.opaque(mi.Int32, self._count), dr.opaque(mi.Float, 1.0 / self._count)
        self._slack_px = dr.opaque(mi.Float, _SLACK * max(film.rows, film.cols))
        self._across = upload(mi.Float, across.astype(np.float32))

    def corners(self, triangles: _Triangles, face: Any) -> list[Any]:
        """Return the three corners of faces in camera axes, x and y in pixels at unit depth."""
        mi, dr = self._mi, self._dr
        number = dr.gather(mi.Vector3u, triangles.faces, face)
        world = [dr.gather(mi.Vector3f, triangles.vertices, number[i]) for i in range(3)]
        return [mi.Vector3f(*(row[0] * v.x + row[1] * v.y + row[2] * v.z for row in self._axes)) for v in world]

    def reach(self, triangles: _Triangles, objects: int) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int64]]:
        """Return each triangle's first row of samples and number of rows, and (4, objects) the boxes on the film [px]:
        lowest row and column, highest row and column, inclusive."""
        mi, dr = self._mi, self._dr
        v = self.corners(triangles, dr.arange(mi.UInt32, len(triangles.owners)))
        ahead = [corner.z > NEAR_M for corner in v]
        low_x, low_y, high_x, high_y = mi.Float(_FAR_PX), mi.Float(_FAR_PX), mi.Float(-_FAR_PX), mi.Float(-_FAR_PX)
        for i, j in ((0, 1), (1, 2), (2, 0)):
            a, b = v[i], v[j]
            share = (NEAR_M - a.z) / dr.select(a.z == b.z, 1.0, b.z - a.z)
            cut = a + share * (b - a)
            for point, depth, counts in ((a, a.z, ahead[i]), (cut, mi.Float(NEAR_M), ahead[i] != ahead[j])):
                x, y = (dr.clip(c / dr.select(counts, depth, 1.0), -_FAR_PX, _FAR_PX) for c in (point.x, point.y))
                low_x, high_x = dr.select(counts, dr.minimum(low_x, x), low_x), dr.select(counts, dr.maximum(high_x, x), high_x)
                low_y, high_y = dr.select(counts, dr.minimum(low_y, y), low_y), dr.select(counts, dr.maximum(high_y, y), high_y)
        n = mi.Float(self.samples)
        first = mi.Int32(dr.ceil(dr.clip((low_y - self._slack_px + self._half_rows) * n - 0.5, 0.0, _FAR_PX)))
        last = mi.Int32(dr.floor(dr.clip((high_y + self._slack_px + self._half_rows) * n - 0.5, -1.0, _FAR_PX)))
        last = dr.minimum(last, self._rows - 1)
        left = dr.maximum(0, mi.Int32(dr.floor(dr.clip(low_x + self._half_cols - 1.0, -_FAR_PX, _FAR_PX))))
        right = dr.minimum(self._cols - 1, mi.Int32(dr.ceil(dr.clip(high_x + self._half_cols, -_FAR_PX, _FAR_PX))))
        count = dr.select((left <= right) & (first <= last), last - first + 1, 0)
        some = count > 0
        box = [dr.full(mi.Int32, _NOWHERE, objects + 1) for _ in range(2)] + [
            dr.full(mi.Int32, -1, objects + 1) for _ in range(2)
        ]
        # Local: small targets would otherwise be reduced in a way that has their size in the code.
        for target, value, kind in (
            (box[0], first // self.samples, dr.ReduceOp.Min),
            (box[1], left, dr.ReduceOp.Min),
            (box[2], last // self.samples, dr.ReduceOp.Max),
            (box[3], right, dr.ReduceOp.Max),
        ):
            dr.scatter_reduce(kind, target, value, triangles.objects, some, mode=dr.ReduceMode.Local)
        dr.eval(first, count, box)
        return first.numpy(), count.numpy(), np.array([b.numpy()[:objects] for b in box], dtype=np.int64)

    def fill(self, sets: list[Any], tables: _Tables, group: NDArray[np.int64]) -> Any:
        """Return the objects' tables with a bit for each sample that meets them."""
        mi, dr = self._mi, self._dr
        bits = dr.zeros(mi.UInt32, max(2, int(tables.sizes.sum())))
        inside = np.zeros(len(tables.start) + 1, dtype=bool)
        inside[group] = True
        record = np.stack([tables.start, tables.low_row, tables.rows, tables.low_word, tables.words], axis=1)
        records = upload(mi.Int32, np.concatenate([record, np.zeros((1, _RECORD))]).astype(np.int32))
        for triangles, first, count, _ in sets:
            faces = np.flatnonzero((count > 0) & inside[triangles.owners])
            if not len(faces):
                continue
            face, start, left = _work(faces, first[faces], count[faces])
            room = (0, max(0, 2 - len(face)))
            work = [upload(mi.Int32, np.pad(values, room).astype(np.int32)) for values in (face, start, left)]
            edges = self.edges(self.corners(triangles, mi.UInt32(work[0])))
            base = dr.gather(mi.UInt32, triangles.objects, mi.UInt32(work[0])) * _RECORD
            table = [dr.gather(mi.Int32, records, base + i) for i in range(_RECORD)]
            _decorated(dr)(mi, _Target(self, bits, edges, table), work[1], work[2])
            dr.eval(bits)
        return bits

    def ones(self, bits: Any) -> NDArray[np.int64]:
        """Return the number of bits that are set in each word."""
        return np.asarray(self._dr.popcnt(bits).numpy(), dtype=np.int64)

    def edges(self, v: list[Any]) -> list[Any]:
        """Return the three edges as (a, b, c): within the triangle, a x + b y + c >= 0 for all of them."""
        mi, dr = self._mi, self._dr
        crossed = [dr.cross(v[j], v[k] - v[j]) for j, k in ((1, 2), (2, 0), (0, 1))]
        side = dr.dot(v[0], crossed[0])
        sign = dr.select(side > 0, mi.Float(1.0), dr.select(side < 0, mi.Float(-1.0), dr.nan))
        return [edge * sign for edge in crossed]

    def span(self, edges: list[Any], row: Any, sample: Any) -> tuple[Any, Any]:
        """Return the first and last column that sample number `sample` of pixels in `row` shares with the triangle."""
        mi, dr = self._mi, self._dr
        y = mi.Float(row) + (mi.Float(sample) + 0.5) * self._step - self._half_rows
        low, high = mi.Float(-_FAR_PX), mi.Float(_FAR_PX)
        for edge in edges:
            rest = edge.y * y + edge.z
            bound = -rest / edge.x
            low = dr.select(edge.x > 0, dr.maximum(low, bound), low)
            high = dr.select(edge.x < 0, dr.minimum(high, bound), high)
            # Level edges bound no column; a triangle seen from its side has edges that are no numbers.
            high = dr.select((edge.x == 0) & (rest >= 0) | (edge.x > 0) | (edge.x < 0), high, -_FAR_PX)
        shift = self._half_cols - 0.5 - dr.gather(mi.Float, self._across, sample)
        first = mi.Int32(dr.ceil(dr.clip(low + shift - self._slack_px, -_FAR_PX, _FAR_PX)))
        last = mi.Int32(dr.floor(dr.clip(high + shift + self._slack_px, -_FAR_PX, _FAR_PX)))
        return dr.maximum(0, first), dr.minimum(self._cols - 1, last)


class _Target:
    """What the loop reads and writes, kept out of its state. Not a dataclass: Dr.Jit would take it for loop state."""

    def __init__(self, raster: _Raster, bits: Any, edges: list[Any], table: list[Any]) -> None:
        self.raster, self.bits, self.edges, self.table = raster, bits, edges, table


_compiled: list[Any] = []


def _decorated(dr: Any) -> Any:
    """Return the loop with its control flow rewritten; made once, when the renderer is there."""
    if not _compiled:
        _compiled.append(dr.syntax(_fill))
    return _compiled[0]


def _fill(mi: Any, target: Any, row_of_samples: Any, left: Any) -> None:
    """Set the bits of `left` rows of samples. Each turn sets those of one word, and goes on to the next row after the last."""
    import drjit as dr  # noqa: PLC0415

    samples, lanes = target.raster.samples, dr.width(row_of_samples)
    row, left = row_of_samples // samples, mi.Int32(left)
    sample = row_of_samples - row * samples
    word, last_word = dr.full(mi.Int32, 1, lanes), dr.zeros(mi.Int32, lanes)
    active = left > 0
    while active:
        start, low_row, rows, low_word, words = target.table
        first, last = target.raster.span(target.edges, row, sample)
        # Rays that meet a triangle nearer than it is cut may lie beside the box.
        first, last = dr.maximum(first, low_word << 5), dr.minimum(last, ((low_word + words) << 5) - 1)
        some = first <= last
        word = dr.select(word > last_word, first >> 5, word)
        last_word = dr.select(some, last >> 5, word)
        from_bit, to_bit = dr.maximum(first - (word << 5), 0), dr.minimum(last - (word << 5), _WORD_BITS - 1)
        whole = mi.UInt32(0xFFFFFFFF)
        mask = (whole << mi.UInt32(from_bit)) & (whole >> mi.UInt32(_WORD_BITS - 1 - to_bit))
        line = start + (sample * rows + row - low_row) * words - low_word
        dr.scatter_reduce(dr.ReduceOp.Or, target.bits, mask, mi.UInt32(line + word), some, mode=dr.ReduceMode.Local)
        word += 1
        done = word > last_word
        left = dr.select(done, left - 1, left)
        sample = dr.select(done, sample + 1, sample)
        row = dr.select(sample == samples, row + 1, row)
        sample = dr.select(sample == samples, 0, sample)
        active = left > 0
