"""Organic bodies as implicit surfaces: limbs with profiled sections, blended smoothly, and meshed by surface nets.

A body is the zero set of a signed function, negative inside. Distances are first-order, good near the surface, where alone
they are used. References: Hart 1996 (sphere tracing; distance bounds), Gibson 1998 (constrained elastic surface nets).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from fullwell.assets.starter.shapes import Shape

__all__ = ["Blob", "Clipped", "Cut", "Limb", "Solid", "ball", "blob", "mesh", "ruffled", "vertex_normals"]

Array = NDArray[np.float64]

_FAR_M = 0.2
_SAMPLES = 33


class Solid(Protocol):
    """Something with an inside."""

    def bounds_m(self) -> Array:
        """(2, 3) corners of a box that holds it."""

    def distance_m(self, x: Array, y: Array, z: Array) -> Array:
        """Return the signed distance at points given by broadcasting coordinates, negative inside."""


@dataclass(frozen=True, slots=True, eq=False)
class Limb:
    """A bone with elliptic sections that vary along it.

    Attributes
    ----------
    start_m, end_m
        (3,) ends of the bone.
    front
        (3,) direction of the depth axis; made perpendicular to the bone.
    at
        Stations from 0 (start) to 1 (end), rising.
    half_width_m, half_depth_m
        Half axes at the stations, across and along `front`.
    offset_m
        Shift of the section's centre along `front` at the stations, or empty.
    flat_start, flat_end
        Cut square instead of rounded.
    cap_m
        How far the rounded ends reach; by default as far as the section is thick.
    """

    start_m: Array
    end_m: Array
    front: Array
    at: tuple[float, ...]
    half_width_m: tuple[float, ...]
    half_depth_m: tuple[float, ...]
    offset_m: tuple[float, ...] = ()
    flat_start: bool = False
    flat_end: bool = False
    cap_m: float | None = None

    def grown(self, by_m: float | Sequence[float] | Array) -> Limb:
        """Return it with thicker sections: by one length, or one for each station."""
        grow = np.broadcast_to(np.asarray(by_m, dtype=np.float64), (len(self.at),))
        return replace(
            self,
            half_width_m=tuple(float(v) for v in np.add(self.half_width_m, grow)),
            half_depth_m=tuple(float(v) for v in np.add(self.half_depth_m, grow)),
        )

    def upto(self, end: float, *, start: float = 0.0, flat_start: bool = False, flat_end: bool = True) -> Limb:
        """Return the stretch from `start` to `end` (fractions of the bone), by default cut square at its end."""
        bone = self.end_m - self.start_m
        at = np.linspace(start, end, 9)
        width, depth, offset = (self._profile(values)(at) for values in (self.half_width_m, self.half_depth_m, self._offsets()))
        return replace(
            self,
            start_m=self.start_m + start * bone,
            end_m=self.start_m + end * bone,
            at=tuple(np.linspace(0.0, 1.0, 9)),
            half_width_m=tuple(width),
            half_depth_m=tuple(depth),
            offset_m=tuple(offset),
            flat_start=flat_start,
            flat_end=flat_end,
        )

    def bounds_m(self) -> Array:
        """(2, 3) corners of a box that holds it."""
        reach = max(*self.half_width_m, *self.half_depth_m)
        reach = max(reach, self.cap_m or 0.0) + max((abs(value) for value in self.offset_m), default=0.0)
        ends = np.stack([self.start_m, self.end_m])
        return np.stack([ends.min(axis=0) - reach, ends.max(axis=0) + reach])

    def distance_m(self, x: Array, y: Array, z: Array) -> Array:
        """Return the signed distance, first order in the distance."""
        axis, side, front, length = self._frame()
        along = _dot(x, y, z, self.start_m, axis)
        across = _dot(x, y, z, self.start_m, side)
        ahead = _dot(x, y, z, self.start_m, front)
        inside = np.clip(along, 0.0, length)
        steps = np.linspace(0.0, length, _SAMPLES)
        fine = steps / max(length, 1e-9)
        width = np.interp(inside, steps, self._profile(self.half_width_m)(fine))
        depth = np.interp(inside, steps, self._profile(self.half_depth_m)(fine))
        if self.offset_m:
            ahead = ahead - np.interp(inside, steps, self._profile(self.offset_m)(fine))
        beyond = along - inside
        if self.flat_start:
            beyond = np.maximum(beyond, 0.0)
        if self.flat_end:
            beyond = np.minimum(beyond, 0.0)
        cap = np.minimum(width, depth) if self.cap_m is None else self.cap_m
        distance = _ellipsoid(across, ahead, beyond, (width, depth, cap))
        if self.flat_start:
            distance = np.maximum(distance, -along)
        if self.flat_end:
            distance = np.maximum(distance, along - length)
        return distance

    def _offsets(self) -> tuple[float, ...]:
        return self.offset_m or (0.0,) * len(self.at)

    def _profile(self, values: tuple[float, ...]) -> PchipInterpolator:
        return PchipInterpolator(self.at, values)

    def _frame(self) -> tuple[Array, Array, Array, float]:
        bone = self.end_m - self.start_m
        length = float(np.linalg.norm(bone))
        axis = bone / max(length, 1e-9)
        side = np.cross(axis, self.front)
        side = side / max(float(np.linalg.norm(side)), 1e-9)
        return axis, side, np.cross(side, axis), length


@dataclass(frozen=True, slots=True, eq=False)
class Blob:
    """An ellipsoid: (3,) centre, (3, 3) rotation whose columns are its axes, (3,) half axes [m]."""

    centre_m: Array
    axes: Array
    half_axes_m: Array

    def grown(self, by_m: float) -> Blob:
        """Return it with longer half axes."""
        return replace(self, half_axes_m=self.half_axes_m + by_m)

    def bounds_m(self) -> Array:
        """(2, 3) corners of a box that holds it."""
        reach = np.sqrt(((self.axes * self.half_axes_m) ** 2).sum(axis=1))
        return np.stack([self.centre_m - reach, self.centre_m + reach])

    def distance_m(self, x: Array, y: Array, z: Array) -> Array:
        """Return the signed distance, first order in the distance."""
        u, v, w = (_dot(x, y, z, self.centre_m, self.axes[:, k]) for k in range(3))
        return _ellipsoid(u, v, w, self.half_axes_m)


def blob(centre_m: ArrayLike, half_axes_m: ArrayLike, axes: ArrayLike | None = None) -> Blob:
    """Return an ellipsoid; `axes` are the columns of a (3, 3) rotation."""
    turn = np.eye(3) if axes is None else np.asarray(axes, dtype=np.float64)
    return Blob(np.asarray(centre_m, dtype=np.float64), turn, np.asarray(half_axes_m, dtype=np.float64))


def ball(centre_m: ArrayLike, radius_m: float) -> Blob:
    """Return a ball."""
    return blob(centre_m, np.full(3, radius_m))


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """Takes away what lies ahead of a plane (point, outward normal)."""

    point_m: Array
    normal: Array


@dataclass(frozen=True, slots=True, eq=False)
class Clipped:
    """A solid without what lies ahead of some planes."""

    solid: Solid
    cuts: tuple[Cut, ...]

    def bounds_m(self) -> Array:
        """(2, 3) corners of a box that holds it."""
        return self.solid.bounds_m()

    def distance_m(self, x: Array, y: Array, z: Array) -> Array:
        """Return the signed distance, first order in the distance."""
        values = self.solid.distance_m(x, y, z)
        for cut in self.cuts:
            values = np.maximum(values, _dot(x, y, z, cut.point_m, cut.normal / np.linalg.norm(cut.normal)))
        return values


def mesh(
    groups: Sequence[Sequence[Solid]],
    *,
    cell_m: float,
    blend_m: float,
    between_m: float = 0.0,
    cuts: Sequence[Cut] = (),
    carved: Sequence[Solid] = (),
    carve_blend_m: float = 0.0,
    within_m: Array | None = None,
) -> Shape:
    """Return the surface of a union of groups, closed and smooth.

    Solids of a group melt together over `blend_m` [m], groups over `between_m`: the arm melts into the chest, not into the
    thigh that it hangs beside. Planes in `cuts` and solids in `carved` take away from the whole. `within_m`, (2, 3) corners,
    spares the search elsewhere: all that the cuts leave must lie inside.
    """
    boxes = np.array([solid.bounds_m() for group in groups for solid in group])
    margin = blend_m / 2 + 2.5 * cell_m
    low, high = boxes[:, 0].min(axis=0) - margin, boxes[:, 1].max(axis=0) + margin
    if within_m is not None:
        low, high = np.maximum(low, within_m[0] - 3 * cell_m), np.minimum(high, within_m[1] + 3 * cell_m)
    count = np.ceil((high - low) / cell_m).astype(int) + 1
    coordinates = tuple(low[k] + cell_m * np.arange(count[k]) for k in range(3))
    values = np.full(tuple(count), _FAR_M)
    for group in groups:
        target = values if len(groups) == 1 else np.full(values.shape, _FAR_M)
        for solid in group:
            block, local = _block(solid, coordinates, blend_m + 2.5 * cell_m)
            if min(axis.size for axis in local):
                target[block] = _smooth_min(target[block], solid.distance_m(*local), blend_m)
        if target is not values:
            values = _smooth_min(values, target, between_m)
    x, y, z = np.ix_(*coordinates)
    for solid in carved:
        block, local = _block(solid, coordinates, carve_blend_m + 2.5 * cell_m)
        if min(axis.size for axis in local):
            values[block] = -_smooth_min(-values[block], solid.distance_m(*local), carve_blend_m)
    for cut in cuts:
        values = np.maximum(values, _dot(x, y, z, cut.point_m, cut.normal / np.linalg.norm(cut.normal)))
    return _surface_nets(values, low, cell_m)


def ruffled(shape: Shape, height_m: Array) -> Shape:
    """Return it with each vertex pushed along its normal by (n,) heights [m], and shaded anew."""
    if shape.normals is None:
        raise ValueError("ruffled needs a shape with normals")
    moved = shape.vertices_m + height_m[:, None] * shape.normals
    return Shape(moved, shape.faces, vertex_normals(moved, shape.faces))


def vertex_normals(vertices_m: Array, faces: NDArray[np.int64]) -> Array:
    """Return (n, 3) normals, averaged by area over all faces of a vertex."""
    corners = vertices_m[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.stack(
        [np.bincount(faces.ravel(), np.repeat(normal[:, k], 3), minlength=len(vertices_m)) for k in range(3)], axis=1
    )
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.asarray(np.where(length > 1e-15, sums / np.maximum(length, 1e-15), [0.0, 0.0, 1.0]))


def _block(solid: Solid, coordinates: tuple[Array, Array, Array], margin_m: float) -> tuple[tuple[slice, ...], list[Array]]:
    low, high = solid.bounds_m()
    slices = tuple(
        slice(int(np.searchsorted(axis, low[k] - margin_m)), int(np.searchsorted(axis, high[k] + margin_m)))
        for k, axis in enumerate(coordinates)
    )
    return slices, list(np.ix_(*(axis[part] for axis, part in zip(coordinates, slices, strict=True))))


def _dot(x: Array, y: Array, z: Array, origin: Array, direction: Array) -> Array:
    return np.asarray((x - origin[0]) * direction[0] + (y - origin[1]) * direction[1] + (z - origin[2]) * direction[2])


def _ellipsoid(u: Array, v: Array, w: Array, half_axes: Sequence[ArrayLike] | Array) -> Array:
    """First-order distance to an ellipsoid: f |f'|^-1 for f = |p / r| - 1."""
    a, b, c = (np.asarray(value) for value in half_axes)
    u, v, w = u / a, v / b, w / c
    radius = np.sqrt(u * u + v * v + w * w)
    slope = np.sqrt((u / a) ** 2 + (v / b) ** 2 + (w / c) ** 2)
    thin = np.minimum(np.minimum(a, b), c)
    near = slope > 1e-6
    return np.asarray(np.where(near, radius * (radius - 1.0) / np.where(near, slope, 1.0), -thin))


def _smooth_min(first: Array, second: Array, blend_m: float) -> Array:
    low = np.minimum(first, second)
    if blend_m <= 0:
        return low
    overlap = np.maximum(blend_m - np.abs(first - second), 0.0)
    return np.asarray(low - overlap * overlap / (4 * blend_m))


_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])


def _surface_nets(values: Array, low: Array, cell_m: float) -> Shape:
    """One vertex in each cell that the surface crosses, at the mean of its crossings; one quad for each crossed edge."""
    inside = values < 0
    shape = np.array(values.shape)
    views = [inside[tuple(slice(c, shape[k] - 1 + c) for k, c in enumerate(corner))] for corner in _CORNERS]
    total = np.sum(views, axis=0)
    cells = np.argwhere((total > 0) & (total < 8))
    at_corners = np.stack([values[tuple((cells + corner).T)] for corner in _CORNERS], axis=1)
    sums, hits = np.zeros((len(cells), 3)), np.zeros(len(cells))
    for first in range(8):
        for second in range(first + 1, 8):
            step = _CORNERS[second] - _CORNERS[first]
            if np.abs(step).sum() != 1:
                continue
            a, b = at_corners[:, first], at_corners[:, second]
            crossed = (a < 0) != (b < 0)
            fraction = np.where(crossed, a / np.where(crossed, a - b, 1.0), 0.0)
            sums += crossed[:, None] * (_CORNERS[first] + fraction[:, None] * step)
            hits += crossed
    vertices = low + cell_m * (cells + sums / hits[:, None])
    index = np.full(tuple(shape - 1), -1, dtype=np.int64)
    index[tuple(cells.T)] = np.arange(len(cells))
    faces = np.concatenate([_quads(inside, index, axis) for axis in range(3)])
    return Shape(vertices, faces, vertex_normals(vertices, faces))


def _quads(inside: NDArray[np.bool_], index: NDArray[np.int64], axis: int) -> NDArray[np.int64]:
    """Return the faces across edges along one axis, outward."""
    moved, cells = np.moveaxis(inside, axis, 0), np.moveaxis(index, axis, 0)
    here, there = moved[:-1, 1:-1, 1:-1], moved[1:, 1:-1, 1:-1]
    # The other two axes keep their order, which is a cyclic one for x and z only.
    forward = axis != 1
    faces = []
    for outward in (True, False):
        k, i, j = np.nonzero((here & ~there) if outward else (~here & there))
        ring = [cells[k, i, j], cells[k, i + 1, j], cells[k, i + 1, j + 1], cells[k, i, j + 1]]
        quad = np.stack(ring if outward == forward else ring[::-1], axis=1)
        faces += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
    return np.concatenate(faces)
