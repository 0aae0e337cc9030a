"""Half shells of vehicles, and panels cut out of them along fields.

A vehicle's skin is lofted from plan rings (superellipses, as long and wide as its profiles say) and closed by a crowned top.
Only the left half (y >= 0) is made; the right is its mirror image. Windows, lamps, seams and wheel arches are then cut out
along the zero lines of fields on its vertices: cuts are exact between vertices, and normals come from the uncut skin, so that
no cut shows in the shading.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import Akima1DInterpolator

from fullwell.assets.starter.shapes import Shape, joined

__all__ = [
    "Field",
    "Line",
    "Panels",
    "Patch",
    "ShellSpec",
    "below",
    "beyond",
    "both_sides",
    "boundary_edges",
    "half_shell",
    "inset",
    "intersection",
    "opposite",
    "outline_walls",
    "recessed",
    "refined",
    "split",
    "surface_at",
    "vertex_normals",
]

Array = NDArray[np.float64]

_SNAP_M = 2e-4
"""Vertices nearer to a cut than this lie on it, so that no slivers appear. A fifth of a millimetre is not seen."""

_BEND_M = 1e-3
"""A cut may depart from its curve by this much between points."""

_ON_LINE_M = 2e-3
"""Outlines cut along a curve are this near to it: between points 3 cm apart, a circle of 0.3 m departs by 0.4 mm."""


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """A piece of skin.

    Attributes
    ----------
    vertices_m, normals, faces
        (n, 3) [m]; (n, 3) unit normals of the uncut skin; (m, 3), counter-clockwise seen from outside.
    coords
        (n, 4): place on the shell's plan ring along x (1 at the front, -1 at the rear) and y (0 to 1), level (0 at the lower
        edge, 1 at the upper and over the top), and length along the widest ring from the middle of the front [m].
    perimeter_m
        Half perimeter of the widest ring: the middle of the rear is there.
    """

    vertices_m: Array
    normals: Array
    coords: Array
    faces: NDArray[np.int64]
    perimeter_m: float = 0.0

    @property
    def x(self) -> Array:
        """Forward [m]."""
        return self.vertices_m[:, 0]

    @property
    def y(self) -> Array:
        """Left [m]."""
        return self.vertices_m[:, 1]

    @property
    def z(self) -> Array:
        """Up [m]."""
        return self.vertices_m[:, 2]

    @property
    def ring_x(self) -> Array:
        """Place along the ring's length, -1 to 1."""
        return self.coords[:, 0]

    @property
    def ring_y(self) -> Array:
        """Place along the ring's half width, 0 to 1."""
        return self.coords[:, 1]

    @property
    def level(self) -> Array:
        """Height within the shell, 0 to 1."""
        return self.coords[:, 2]

    @property
    def front_arc_m(self) -> Array:
        """Way along the widest ring from the middle of the front [m]."""
        return self.coords[:, 3]

    @property
    def rear_arc_m(self) -> Array:
        """Way along the widest ring from the middle of the rear [m]."""
        return self.perimeter_m - self.coords[:, 3]

    def with_faces(self, faces: NDArray[np.int64]) -> Patch:
        """Return the part of it that some faces make."""
        used, back = np.unique(faces, return_inverse=True)
        return Patch(
            self.vertices_m[used], self.normals[used], self.coords[used], back.reshape(-1, 3).astype(np.int64), self.perimeter_m
        )

    def shape(self) -> Shape:
        """Return it as triangles with normals."""
        return Shape(self.vertices_m, self.faces, self.normals)


Field = Callable[[Patch], Array]
"""Signed value [m, roughly a distance] at each vertex, negative inside."""


@dataclass(frozen=True, slots=True)
class Line:
    """A smooth curve z(x) through points, constant beyond them."""

    points: tuple[tuple[float, float], ...]

    def __call__(self, at: ArrayLike) -> Array:
        """Return its values."""
        where = np.asarray(at, dtype=np.float64)
        points = np.array(sorted(self.points))
        if len(points) == 1:
            return np.full(where.shape, points[0, 1])
        if len(points) == 2:
            return np.asarray(np.interp(where, points[:, 0], points[:, 1]))
        curve = Akima1DInterpolator(points[:, 0], points[:, 1], method="makima")
        return np.asarray(curve(np.clip(where, points[0, 0], points[-1, 0])))


@dataclass(frozen=True, slots=True)
class ShellSpec:
    """The left half of a skin: plan rings from a lower to an upper line, and a crowned top.

    Attributes
    ----------
    centre_x_m, front_m, rear_m, half_width_m
        Where the rings are widest, and how far the largest reaches forward, back and sideways.
    front_power, rear_power
        Of the superellipse: 2 is round, 10 nearly a rectangle.
    low, high
        Height along x of the lower edge, and of the top's middle line [m].
    crown_m
        How much lower the top is at the side than in the middle.
    profile
        Rings from below: (level, inset of the side, of the front, of the rear [m]); a smooth curve goes through them.
    columns, levels, across
        Points along the half ring, rings, points across half the top.
    bulges
        (x_m, z_m, radius_m, out_m, breadth_m): the side swells by `out_m` along circles: wheel arches.
    """

    centre_x_m: float
    front_m: float
    rear_m: float
    half_width_m: float
    low: Line
    high: Line
    profile: tuple[tuple[float, float, float, float], ...]
    front_power: float = 5.0
    rear_power: float = 5.0
    crown_m: float = 0.05
    columns: int = 90
    levels: int = 20
    across: int = 6
    bulges: tuple[tuple[float, float, float, float, float], ...] = ()


def half_shell(spec: ShellSpec) -> tuple[Patch, Patch]:
    """Return the skin (sides and top, smooth) and the flat underside of a shell's left half."""
    unit, arc = _unit_ring(spec)
    rings = _profile_rings(spec)
    front = unit[:, 0] > 0
    lengths = np.where(front[None], spec.front_m - rings[:, 2:3], spec.rear_m - rings[:, 3:4])
    x = spec.centre_x_m + lengths * unit[None, :, 0]
    widths = spec.half_width_m - rings[:, 1:2]
    y = widths * unit[None, :, 1]
    level = np.repeat(rings[:, :1], len(unit), axis=1)
    # The top: from the last ring to a spine in the middle plane that stops short of both ends, against slivers.
    inward = np.linspace(0.0, 1.0, spec.across + 1)[1:, None]
    short = min(0.8 * float(widths[-1, 0]), 0.4 * float(x[-1].max() - x[-1].min()))
    spine = np.clip(x[-1:], x[-1].min() + short, x[-1].max() - short)
    x = np.concatenate([x, x[-1:] + inward * (spine - x[-1:])])
    y = np.concatenate([y, y[-1:] * (1 - inward)])
    level = np.concatenate([level, np.ones((spec.across, len(unit)))])
    low = spec.low(x)
    high = spec.high(x) - spec.crown_m * (y / spec.half_width_m) ** 2
    z = low + level * (high - low)
    y = y + _bulge_m(spec, x, y, z)
    points = np.stack([x, y, z], axis=-1)
    rows = len(points)
    coords = np.stack(
        [
            np.broadcast_to(unit[:, 0], (rows, len(unit))),
            np.concatenate(
                [np.broadcast_to(unit[:, 1], (len(rings), len(unit))), (1 - inward) * unit[None, :, 1]],
            ),
            level,
            np.broadcast_to(arc, (rows, len(unit))),
        ],
        axis=-1,
    )
    skin = _grid_patch(points, coords, float(arc[-1]))
    under = np.stack([points[0], points[0] * np.array([1.0, 0.0, 1.0])])[::-1]
    under_coords = np.stack([coords[0], coords[0]])
    return skin, _grid_patch(under, under_coords, float(arc[-1]))


def _unit_ring(spec: ShellSpec) -> tuple[Array, Array]:
    """Return (columns, 2) points of the unit superellipse, front to rear by the left, and the way along the widest."""
    angle = np.linspace(0.0, np.pi, 2001)
    cosine, sine = np.cos(angle), np.sin(angle)
    power = np.where(cosine > 0, spec.front_power, spec.rear_power)
    radius = (np.abs(cosine) ** power + np.abs(sine) ** power) ** (-1 / power)
    unit = np.stack([radius * cosine, radius * sine], axis=-1)
    unit[[0, -1], 1] = 0.0
    real = unit * np.stack([np.where(cosine > 0, spec.front_m, spec.rear_m), np.full(2001, spec.half_width_m)], axis=-1)
    step = np.diff(real, axis=0)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(step, axis=1))])
    heading = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    # Corners get more points than straight sides: half of them follow the turning.
    turning = np.concatenate([[0.0], np.abs(np.diff(heading)), [0.0]]).cumsum()
    measure = 0.62 * length / length[-1] + 0.38 * turning / turning[-1]
    at = np.interp(np.linspace(0.0, 1.0, spec.columns), measure, np.arange(2001.0))
    index = np.arange(2001.0)
    ring = np.stack([np.interp(at, index, unit[:, 0]), np.interp(at, index, unit[:, 1])], axis=-1)
    return ring, np.interp(at, index, length)


def _profile_rings(spec: ShellSpec) -> Array:
    """Return (levels, 4): the profile's curve, with its own points kept near."""
    knots = np.array(spec.profile)
    scale = np.array([1.0, 1.0, 0.35, 0.35])  # a raked windscreen counts less than the turn of a shoulder
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots * scale, axis=0), axis=1) + 0.02)])
    at = np.linspace(0.0, way[-1], spec.levels)
    curve = np.stack([Akima1DInterpolator(way, column, method="makima")(at) for column in knots.T], axis=1)
    curve[:, 0] = np.maximum.accumulate(np.clip(curve[:, 0], 0.0, 1.0))
    return np.asarray(curve)


def _bulge_m(spec: ShellSpec, x: Array, y: Array, z: Array) -> Array:
    out = np.zeros_like(x)
    for centre_x, centre_z, radius, height, breadth in spec.bulges:
        off = (np.hypot(x - centre_x, z - centre_z) - radius) / breadth
        out += height * np.exp(-(off**2)) * np.clip((y / spec.half_width_m - 0.75) / 0.2, 0.0, 1.0)
    return out


def _grid_patch(points: Array, coords: Array, perimeter_m: float) -> Patch:
    """Return a (rows, cols, 3) grid as a smooth patch, without its faces of no area. Rows rise, columns run to the left."""
    rows, cols = points.shape[:2]
    index = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    vertices = points.reshape(-1, 3)
    faces = faces[_area_m2(vertices, faces) > 1e-9]
    normals = vertex_normals(vertices, faces)
    middle = np.abs(vertices[:, 1]) < 1e-9  # the mirror image goes on there
    normals[middle, 1] = 0.0
    normals = _unit(normals)
    return Patch(vertices, normals, coords.reshape(-1, coords.shape[-1]), faces, perimeter_m).with_faces(faces)


def vertex_normals(vertices_m: Array, faces: NDArray[np.int64]) -> Array:
    """Return (n, 3) normals averaged over all faces at a place, by angle; coincident vertices count as one."""
    corners = vertices_m[faces]
    edges = corners[:, [1, 2, 0]] - corners
    normal = _unit(np.cross(edges[:, 0], -edges[:, 2]))
    directions = _unit(edges)
    angle = np.arccos(np.clip(-(directions * np.roll(directions, 1, axis=1)).sum(axis=2), -1.0, 1.0))
    _, place = np.unique(np.round(vertices_m / 1e-6).astype(np.int64), axis=0, return_inverse=True)
    place = place.reshape(-1)
    sums = np.zeros((place.max() + 1, 3))
    np.add.at(sums, place[faces].ravel(), (angle[..., None] * normal[:, None]).reshape(-1, 3))
    return _unit(sums)[place]


def refined(patch: Patch, field_: Field, *, edge_m: float, rounds: int = 4) -> Patch:
    """Return the patch with edges at the field's zero line halved where the field bends along them; none below `edge_m`."""
    for _ in range(rounds):
        values = field_(patch)
        edges, of_face = _edges(patch.faces)
        ends = patch.vertices_m[edges]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        mark = (np.abs(values[edges]).min(axis=1) < 0.75 * length) & (length > edge_m)
        if mark.any():
            middles = _middles(patch, edges[mark])
            mark[mark] = np.abs(field_(middles) - values[edges[mark]].mean(axis=1)) > _BEND_M
        if not mark.any():
            break
        patch = _with_edge_points(patch, edges, of_face, mark, np.full(len(edges), 0.5))
    return patch


def _middles(patch: Patch, edges: NDArray[np.int64]) -> Patch:
    vertices, normals, coords = (values[edges].mean(axis=1) for values in (patch.vertices_m, patch.normals, patch.coords))
    return Patch(vertices, normals, coords, np.empty((0, 3), dtype=np.int64), patch.perimeter_m)


def split(patch: Patch, field_: Field) -> tuple[Patch | None, Patch | None]:
    """Return what lies where the field is negative, and the rest; None where nothing does."""
    values = field_(patch).copy()
    values[np.abs(values) < _SNAP_M] = 0.0
    edges, of_face = _edges(patch.faces)
    ends = values[edges]
    mark = ends[:, 0] * ends[:, 1] < 0
    if mark.any():
        where = np.divide(ends[:, 0], ends[:, 0] - ends[:, 1], out=np.full(len(edges), 0.5), where=mark)
        patch = _with_edge_points(patch, edges, of_face, mark, where)
        values = np.concatenate([values, np.zeros(int(mark.sum()))])
    corners = values[patch.faces]
    inside = corners.sum(axis=1) < 0  # no face has both signs now
    pieces = (patch.faces[inside], patch.faces[~inside])
    first, second = (patch.with_faces(faces) if len(faces) else None for faces in pieces)
    return first, second


def _edges(faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return unique edges (k, 2), and for each face the three edges (0-1, 1-2, 2-0)."""
    pairs = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    code = pairs[:, 0] * (int(faces.max()) + 1) + pairs[:, 1]
    _, first, back = np.unique(code, return_index=True, return_inverse=True)
    return np.asarray(pairs[first]), back.reshape(-1, 3)


def _with_edge_points(
    patch: Patch, edges: NDArray[np.int64], of_face: NDArray[np.int64], mark: NDArray[np.bool_], where: Array
) -> Patch:
    """Return the patch with points put on the marked edges and the faces at them divided; no gaps, no hanging points."""
    share = where[mark, None]
    start, stop = edges[mark].T

    def between(values: Array) -> Array:
        return np.concatenate([values, values[start] * (1 - share) + values[stop] * share])

    number = np.full(len(edges), -1, dtype=np.int64)
    number[mark] = len(patch.vertices_m) + np.arange(int(mark.sum()))
    points = number[of_face]
    count = (points >= 0).sum(axis=1)
    new = [patch.faces[count == 0]]
    for marked in (1, 2, 3):
        rows = count == marked
        new.append(_divided(patch.faces[rows], points[rows], marked))
    normals = _unit(between(patch.normals))
    return Patch(between(patch.vertices_m), normals, between(patch.coords), np.concatenate(new), patch.perimeter_m)


def _divided(faces: NDArray[np.int64], points: NDArray[np.int64], marked: int) -> NDArray[np.int64]:
    """Return faces divided at `marked` of their edges, after turning each so that the marked ones stand at known places."""
    if not len(faces):
        return faces
    has = points >= 0
    first = np.argmax(has, axis=1) if marked == 1 else (np.argmin(has, axis=1) + 1) % 3
    turn = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, turn, axis=1).T
    p, q, r = np.take_along_axis(points, turn, axis=1).T
    if marked == 1:  # a-b
        rows = [[a, p, c], [p, b, c]]
    elif marked == 2:  # a-b and b-c
        rows = [[p, b, q], [a, p, q], [a, q, c]]
    else:
        rows = [[a, p, r], [p, b, q], [r, q, c], [p, q, r]]
    return np.concatenate([np.stack(row, axis=1) for row in rows])


def boundary_edges(patch: Patch) -> NDArray[np.int64]:
    """Return (k, 2) edges of one face only, along the face's direction, those in the middle plane left out."""
    directed = patch.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, place = np.unique(np.round(patch.vertices_m / 1e-7).astype(np.int64), axis=0, return_inverse=True)
    pairs = np.sort(place.reshape(-1)[directed], axis=1)
    code = pairs[:, 0] * (int(pairs.max()) + 1) + pairs[:, 1]
    _, back, counts = np.unique(code, return_inverse=True, return_counts=True)
    lone = directed[counts[back] == 1]
    middle = np.abs(patch.vertices_m[lone, 1]).max(axis=1) < 1e-6
    return np.asarray(lone[~middle])


def recessed(patch: Patch, depth_m: float) -> tuple[Patch, Shape | None]:
    """Return the patch sunk along its normals (raised where negative), and the wall that its outline leaves."""
    low = patch.vertices_m - depth_m * patch.normals
    moved = Patch(low, patch.normals, patch.coords, patch.faces, patch.perimeter_m)
    edges = boundary_edges(patch)
    return moved, _wall(patch.vertices_m, low, edges)


def _wall(top_m: Array, low_m: Array, edges: NDArray[np.int64]) -> Shape | None:
    if not len(edges):
        return None
    start, stop = edges.T
    quads = np.stack([low_m[stop], low_m[start], top_m[start], top_m[stop]], axis=1)
    index = np.arange(4 * len(edges)).reshape(-1, 4)
    faces = np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])
    vertices = quads.reshape(-1, 3)
    return Shape(vertices, faces[_area_m2(vertices, faces) > 1e-10])


def outline_walls(removed: Sequence[Patch], field_: Field, y_m: float) -> list[Shape]:
    """Return walls from where removed patches ended at the field's zero line to the plane y = `y_m`: a wheel well's liner."""
    walls = []
    for patch in removed:
        edges = boundary_edges(patch)
        on_line = np.abs(field_(patch))[edges].max(axis=1) < _ON_LINE_M
        low = patch.vertices_m.copy()
        low[:, 1] = y_m
        wall = _wall(patch.vertices_m, low, edges[on_line])
        walls += [wall] if wall is not None else []
    return walls


@dataclass(slots=True)
class Panels:
    """Patches by name, cut out of each other; and loose shapes (walls, fittings) by name. All of the left half."""

    patches: dict[str, list[Patch]] = field(default_factory=dict)
    loose: dict[str, list[Shape]] = field(default_factory=dict)

    def add(self, name: str, *patches: Patch) -> None:
        """Put patches under a name."""
        self.patches.setdefault(name, []).extend(patches)

    def add_loose(self, name: str, *shapes: Shape | None) -> None:
        """Put shapes of the left half under a name."""
        self.loose.setdefault(name, []).extend(shape for shape in shapes if shape is not None)

    def cut(
        self, source: str, target: str, field_: Field, *, edge_m: float = 0.03, depth_m: float = 0.0, wall: str = ""
    ) -> None:
        """Move what lies inside a field from one name to another, sunk by `depth_m`; walls go to `wall` (or `target`)."""
        found = []
        left = []
        for patch in self.patches.get(source, []):
            values = field_(patch)
            if values.min() > 0:
                left.append(patch)
                continue
            inside, outside = split(refined(patch, field_, edge_m=edge_m), field_)
            found += [inside] if inside is not None else []
            left += [outside] if outside is not None else []
        self.patches[source] = left
        self._add_sunk(target, found, depth_m, wall)

    def _add_sunk(self, target: str, patches: Sequence[Patch], depth_m: float, wall: str) -> None:
        if depth_m == 0.0:
            self.add(target, *patches)
            return
        for patch in patches:
            moved, made = recessed(patch, depth_m)
            self.add_loose(wall or target, made)
            self.add(target, moved)

    def strip(
        self,
        source: str,
        target: str,
        field_: Field,
        *,
        half_width_m: float = 0.003,
        edge_m: float = 0.03,
        depth_m: float = 0.0,
        wall: str = "",
    ) -> None:
        """Move a narrow strip along a field's zero line to another name: the gap between two panels, a pillar, a bar."""
        inner = "\0inner"
        self.cut(source, inner, lambda patch: field_(patch) - half_width_m, edge_m=edge_m)
        self.cut(inner, source, lambda patch: field_(patch) + half_width_m, edge_m=1.0)
        self._add_sunk(target, self.patches.pop(inner, []), depth_m, wall)

    def names(self) -> tuple[str, ...]:
        """Return all names that hold anything, in the order they came up."""
        names = dict.fromkeys([*self.patches, *self.loose])
        return tuple(name for name in names if self.patches.get(name) or self.loose.get(name))

    def left(self, *names: str) -> Shape | None:
        """Return the left half of some names as one shape; None where they hold nothing."""
        shapes = [patch.shape() for name in names for patch in self.patches.get(name, [])]
        shapes += [shape for name in names for shape in self.loose.get(name, [])]
        return joined(shapes) if shapes else None


def surface_at(patches: Sequence[Patch], axis: str, first_m: float, second_m: float, *, last: bool = True) -> float:
    """Return where a line along an axis (x, y or z) leaves the patches (`last`: at the largest coordinate) [m].

    `first_m` and `second_m` are the two other coordinates, in the order x, y, z. Raises ValueError where it meets none.
    """
    along = "xyz".index(axis)
    rest = [index for index in range(3) if index != along]
    hits = []
    for patch in patches:
        corners = patch.vertices_m[patch.faces]
        a, b, c = (corners[:, corner][:, rest] for corner in range(3))
        point = np.array([first_m, second_m])
        area = _cross(b - a, c - a)
        weights = np.stack([_cross(b - point, c - point), _cross(c - point, a - point), _cross(a - point, b - point)], axis=1)
        share = np.divide(weights, area[:, None], out=np.full_like(weights, -1.0), where=np.abs(area[:, None]) > 1e-12)
        inside = (share >= -1e-6).all(axis=1)
        hits += list((share[inside] * corners[inside][:, :, along]).sum(axis=1))
    if not hits:
        raise ValueError(
            f"no surface along {axis} at {first_m:g} m, {second_m:g} m; place the fitting within the vehicle's outline"
        )
    return float(max(hits) if last else min(hits))


def _cross(first: Array, second: Array) -> Array:
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])


def both_sides(shape: Shape) -> Shape:
    """Return a left half with its mirror image."""
    return joined([shape, shape.mirrored()])


def below(axis: str, at_m: float) -> Field:
    """Return the region where x, y or z is less than a value."""
    index = "xyz".index(axis)
    return lambda patch: np.asarray(patch.vertices_m[:, index] - at_m)


def beyond(axis: str, at_m: float) -> Field:
    """Return the region where x, y or z is more than a value."""
    index = "xyz".index(axis)
    return lambda patch: np.asarray(at_m - patch.vertices_m[:, index])


def inset(field_: Field, by_m: float) -> Field:
    """Return a region smaller by a margin."""
    return lambda patch: field_(patch) + by_m


def opposite(field_: Field) -> Field:
    """Return the region outside a field."""
    return lambda patch: -field_(patch)


def intersection(fields: Sequence[Field], *, radius_m: float = 0.0) -> Field:
    """Return the region inside all fields, convex corners rounded by a radius."""

    def value(patch: Patch) -> Array:
        result = fields[0](patch)
        for field_ in fields[1:]:
            other = field_(patch)
            corner = np.hypot(np.maximum(result + radius_m, 0.0), np.maximum(other + radius_m, 0.0))
            result = np.minimum(np.maximum(result, other), -radius_m) + corner if radius_m else np.maximum(result, other)
        return result

    return value


def _area_m2(vertices_m: Array, faces: NDArray[np.int64]) -> Array:
    corners = vertices_m[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.linalg.norm(cross, axis=1) / 2)


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 1e-12))
