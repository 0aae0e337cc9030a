"""Branching plants: crowns grown into a cloud of points, radii by Leonardo's rule, bark tubes and leaf cards.

Growth is space colonisation (Runions, Lane & Prusinkiewicz 2007, Modeling trees with a space colonization algorithm). Where a
branch forks, the cross-sections above add up to that below, r^e = r1^e + r2^e with e near 2 (Leonardo's rule; Eloy 2011, Phys.
Rev. Lett. 107, 258101 gives 1.8 to 2.3 for real trees).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fullwell.assets.starter.shapes import Shape, joined

__all__ = ["Wood", "bark", "card_area_m2", "cards", "colonised", "noise", "unit"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Wood:
    """A branched skeleton: (n, 3) nodes [m], (n,) parents (the root has -1; parents come first), (n,) radii [m]."""

    nodes_m: Array
    parent: Indices
    radius_m: Array

    @property
    def main_child(self) -> Indices:
        """(n,) the thickest child of each node, or -1."""
        order = np.argsort(self.radius_m, kind="stable")
        order = order[self.parent[order] >= 0]
        child = np.full(len(self.parent), -1, dtype=np.int64)
        child[self.parent[order]] = order  # the thickest is written last
        return child

    def tips(self) -> Indices:
        """Nodes without children."""
        has_child = np.zeros(len(self.parent), dtype=bool)
        has_child[self.parent[self.parent >= 0]] = True
        return np.flatnonzero(~has_child)

    def kept(self, which: NDArray[np.bool_]) -> Wood:
        """Return only some nodes; those that are kept must have kept parents."""
        place = np.cumsum(which) - 1
        parent = np.where(self.parent >= 0, place[self.parent], -1)[which]
        return Wood(self.nodes_m[which], parent, self.radius_m[which])

    def smoothed(self, rounds: int) -> Wood:
        """Return it with the zigzag of growth relaxed; root and tips stay."""
        nodes, child = self.nodes_m.copy(), self.main_child
        inner = np.flatnonzero((self.parent >= 0) & (child >= 0))
        for _ in range(rounds):
            nodes[inner] = 0.5 * nodes[inner] + 0.25 * (nodes[self.parent[inner]] + nodes[child[inner]])
        return replace(self, nodes_m=nodes)

    def thickened(self, trunk_radius_m: float, tip_radius_m: float) -> Wood:
        """Return it with radii by Leonardo's rule, the exponent such that trunk and tips are as thick as asked."""
        count = np.zeros(len(self.parent))
        count[self.tips()] = 1.0
        for node in range(len(self.parent) - 1, 0, -1):
            count[self.parent[node]] += count[node]
        exponent = float(np.log(max(count[0], 2.0)) / np.log(trunk_radius_m / tip_radius_m))
        exponent = float(np.clip(exponent, 1.5, 3.0))
        radius = tip_radius_m * count ** (1.0 / exponent)
        return replace(self, radius_m=radius * np.where(count > 1, trunk_radius_m / radius[0], 1.0).clip(0.2, 5.0))


def colonised(
    start_m: Array,
    attractors_m: Array,
    *,
    step_m: float,
    reach_m: float,
    kill_m: float,
    pull: Array,
    rounds: int = 160,
) -> Wood:
    """Grow a skeleton from a stem into a cloud of points.

    Parameters
    ----------
    start_m
        (k, 3) nodes of the stem from the ground up.
    attractors_m
        (n, 3) points that draw growth from the nearest node within `reach_m` until a node is nearer than `kill_m`.
    step_m
        Length of a new segment.
    pull
        (3,) added to each growing direction: upwards for light, downwards for weight.
    """
    nodes = [np.asarray(start_m, dtype=np.float64)]
    parents = [np.arange(-1, len(start_m) - 1)]
    total = len(start_m)
    distance, nearest = cKDTree(nodes[0]).query(attractors_m)
    alive = np.ones(len(attractors_m), dtype=bool)
    positions = nodes[0]
    tried: set[tuple[int, int, int, int]] = set()
    for _ in range(rounds):
        active = np.flatnonzero(alive & (distance < reach_m))
        if not len(active):
            break
        grown, inverse = np.unique(nearest[active], return_inverse=True)
        towards = unit(attractors_m[active] - positions[nearest[active]])
        sums: Array = np.stack([np.bincount(inverse, towards[:, k], minlength=len(grown)) for k in range(3)], axis=1)
        heading = unit(unit(sums) + pull)
        fresh = positions[grown] + step_m * heading
        # Two points that pull apart can hold a node in place: the same segment is not grown twice.
        keys = np.column_stack([grown, np.round(fresh / (0.2 * step_m)).astype(np.int64)])
        new = np.array([tuple(key) not in tried for key in keys.tolist()], dtype=bool)
        tried.update(tuple(key) for key in keys[new].tolist())
        if not new.any():
            break
        fresh = fresh[new]
        nodes.append(fresh)
        parents.append(grown[new])
        near, index = cKDTree(fresh).query(attractors_m)
        closer = near < distance
        distance = np.where(closer, near, distance)
        nearest = np.where(closer, index + total, nearest)
        total += len(fresh)
        positions = np.concatenate([positions, fresh])
        alive &= distance > kill_m
    return Wood(positions, np.concatenate(parents).astype(np.int64), np.full(total, 0.01))


_SIDES: Final = (14, 6, 3)
"""Of tubes of limbs, branches and twigs."""


def bark(
    wood: Wood, *, thick_m: float, flare: float = 0.0, ridges: float = 0.0, sides: tuple[int, int, int] = _SIDES
) -> tuple[Shape, Shape]:
    """Return the trunk with all limbs thicker than `thick_m`, and the thinner branches, as smooth tubes.

    `flare` widens the foot of the trunk by that fraction, `ridges` roughens its girth; `sides` are those of limbs, branches and
    twigs. With fewer sides than the usual ones tubes are so much thicker that they look as wide.
    """
    child = wood.main_child
    parent = wood.parent
    count = len(parent)
    leader = np.zeros(count, dtype=bool)  # goes on where its parent came from
    inner = np.flatnonzero(parent >= 0)
    leader[inner] = child[parent[inner]] == inner
    first = np.arange(count)  # the first node of the branch that a node is part of
    for node in range(1, count):
        if leader[node] and parent[node] != 0:
            first[node] = first[parent[node]]
        elif leader[node]:
            first[node] = 0
    radius = wood.radius_m * (1 + flare * np.exp(-(wood.nodes_m[:, 2] - wood.nodes_m[0, 2]) / 0.28))
    radius = np.where(child >= 0, radius, 0.35 * radius)
    frames = _carried_frames(wood, child)
    girth = wood.radius_m[first]
    shapes = []
    spans = ((thick_m, np.inf), (0.022, thick_m), (0.0, 0.022))
    for kind, (low, high) in enumerate(spans):
        member = (girth >= low) & (girth < high) & (parent >= 0)
        wider = _girth(_SIDES[kind]) / _girth(sides[kind])
        ridged = ridges if kind == 0 else 0.0
        shapes.append(_tubes(wood, member, leader, wider * radius, frames=frames, sides=sides[kind], ridges=ridged))
    return shapes[0], joined(shapes[1:])


def _girth(sides: int) -> float:
    """Perimeter of a regular polygon over that of the circle around it: its mean width over the circle's (Cauchy)."""
    return sides / np.pi * float(np.sin(np.pi / sides))


def _carried_frames(wood: Wood, child: Indices) -> tuple[Array, Array]:
    """Return two directions across each node's branch, carried along from its parent without twist."""
    parent = wood.parent
    count = len(parent)
    incoming = np.zeros((count, 3))
    inner = parent >= 0
    incoming[inner] = unit(wood.nodes_m[inner] - wood.nodes_m[parent[inner]])
    outgoing = np.where((child >= 0)[:, None], incoming[child], incoming)
    incoming[~inner] = outgoing[~inner]
    tangent = unit(np.asarray(incoming + outgoing))
    across = np.zeros((count, 3))
    across[0] = unit(np.cross(tangent[0], [0.0, 1.0, 0.1])[None])[0]
    depth = np.zeros(count, dtype=np.int64)
    for node in range(1, count):
        depth[node] = depth[parent[node]] + 1
    order = np.argsort(depth, kind="stable")
    for level in np.split(order, np.flatnonzero(np.diff(depth[order])) + 1)[1:]:
        carried = across[parent[level]] + 1e-3 * np.array([0.3, 0.5, 0.7])
        along = tangent[level]
        across[level] = unit(carried - (carried * along).sum(axis=1, keepdims=True) * along)
    return across, np.cross(tangent, across)


def _tubes(
    wood: Wood,
    member: NDArray[np.bool_],
    leader: NDArray[np.bool_],
    radius: Array,
    *,
    frames: tuple[Array, Array],
    sides: int,
    ridges: float,
) -> Shape:
    """Join each member node's ring with its parent's; a side branch starts with a ring of its own inside the parent."""
    nodes = np.flatnonzero(member)
    if not len(nodes):
        return Shape(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64), np.zeros((0, 3)))
    angle = np.arange(sides) * (2 * np.pi / sides)
    circle_a, circle_b = np.cos(angle), np.sin(angle)

    def rings(centre: Indices, frame: Indices, size: Array) -> tuple[Array, Array]:
        out = circle_a[:, None] * frames[0][frame][:, None] + circle_b[:, None] * frames[1][frame][:, None]
        rough = 1.0 + ridges * noise(wood.nodes_m[centre][:, None] * [1, 1, 0.4] + 0.9 * out, 3.1)
        return wood.nodes_m[centre][:, None] + (size[:, None] * rough)[..., None] * out, out

    # A branch's own ring, then the rings where branches begin.
    starts = nodes[~leader[nodes] | ~member[wood.parent[nodes]]]
    own, own_out = rings(nodes, nodes, radius[nodes])
    begin, begin_out = rings(wood.parent[starts], starts, np.where(leader[starts], radius[wood.parent[starts]], radius[starts]))
    row = np.full(len(wood.parent), -1, dtype=np.int64)
    row[nodes] = np.arange(len(nodes))
    below = row[wood.parent[nodes]]
    begins = np.full(len(wood.parent), -1, dtype=np.int64)
    begins[starts] = len(nodes) + np.arange(len(starts))
    below = np.where(begins[nodes] >= 0, begins[nodes], below)
    here, after = np.arange(sides), (np.arange(sides) + 1) % sides
    a, b = below[:, None] * sides + here, below[:, None] * sides + after
    c, d = row[nodes][:, None] * sides + after, row[nodes][:, None] * sides + here
    faces = np.concatenate([np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)])
    vertices = np.concatenate([own, begin]).reshape(-1, 3)
    return Shape(vertices, faces, np.concatenate([own_out, begin_out]).reshape(-1, 3))


def cards(base_m: Array, along: Array, facing: Array, length_m: Array, width_m: Array, *, fold: float = 0.25) -> Shape:
    """Return leaves: two triangles each, folded along the midrib, flat shaded.

    (n, 3) bases, directions and faces; (n,) lengths and widths [m]; `fold` raises the edges by that fraction of the width.
    """
    along = unit(along)
    facing = unit(facing - (facing * along).sum(axis=1, keepdims=True) * along)
    side = np.cross(facing, along)
    tip = base_m + length_m[:, None] * along - (0.12 * length_m)[:, None] * facing
    middle = base_m + (0.45 * length_m)[:, None] * along + (fold * 0.5 * width_m)[:, None] * facing
    half = (0.5 * width_m)[:, None] * side
    corners = np.stack([base_m, middle - half, tip, middle + half], axis=1)
    start = 4 * np.arange(len(base_m))[:, None]
    faces = np.concatenate([start + [0, 1, 2], start + [0, 2, 3]])
    return Shape(corners.reshape(-1, 3), faces.astype(np.int64))


def card_area_m2(shape: Shape) -> float:
    """One-sided area of all triangles."""
    corners = shape.vertices_m[shape.faces]
    return float(0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum())


def noise(points: Array, seed: float) -> Array:
    """Return a smooth field in about -1 to 1 with features of some tenths of a metre; the same for the same seed."""
    total = np.zeros(points.shape[:-1])
    for octave in range(3):
        k = 2.3 * 1.9**octave
        a = np.sin(k * points[..., 0] + seed + 1.7 * np.sin(0.8 * k * points[..., 1] + 2 * seed))
        b = np.sin(k * points[..., 1] - 1.3 * seed + 1.7 * np.sin(0.7 * k * points[..., 2] + seed))
        c = np.sin(k * points[..., 2] + 0.7 * seed + 1.7 * np.sin(0.9 * k * points[..., 0] - seed))
        total += (a + b + c) / 3 / 1.6**octave
    return total / 1.6


def unit(vectors: Array) -> Array:
    """Return vectors of length 1; those of length 0 point up."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.where(length > 1e-9, vectors / np.maximum(length, 1e-9), [0.0, 0.0, 1.0]))
