"""A tree over many lamps that chooses one by how much it may light a point.

Built as in Conty Estevez and Kulla 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting, section 4, with a
full sweep instead of bins; walked with the importance of Pharr, Jakob and Humphreys 2023, Physically Based Rendering,
4th ed., section 12.6.3. See docs/physics/lights.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.render.transport.upload import upload

__all__ = ["NODE_FLOATS", "LeafBounds", "LightTree", "TreeWalk", "build_light_tree"]

Array = NDArray[np.float64]

NODE_FLOATS = 12
"""Centre and squared radius of a bounding ball; axis of a cone and intensity; cos and sin of the cone's half angle, cos of the
angle of emission about it, and the number of the first child (the second follows) or of the leaf."""

_LEAF = 0x80000000
_ABSENT = 0xFFFFFFFF
"""Trail of a light without power, which is not in the tree."""

_LARGEST_DEPTH = 31
_CONE_MARGIN = 1e-6
_BOUND_SHARE = 0.25
_BALL_SHARE = 0.125
"""How a node's cosines and distance are estimated: the largest cosines that its ball allows, for a quarter, else those of its
middle; distance^2 to the middle, and radius^2 / 8. By bounds alone (Conty Estevez and Kulla 2018) the variance with 1,000 lamps
is six times as large; it changes little within a factor of two of these."""

_NEAREST_M2 = 1e-20
"""Squared distances below this count as this, so that a lamp at the point itself does not make infinite importance."""


@dataclass(frozen=True, slots=True, eq=False)
class LeafBounds:
    """What bounds each light.

    Attributes
    ----------
    low_m, high_m
        (n, 3) corners of boxes.
    radius_m
        (n,) of a ball about the middle of the box that holds the light.
    axis
        (n, 3) unit axis of a cone of normals; zero where it is the whole sphere.
    spread_rad
        (n,) half angle of that cone, pi for the whole sphere.
    emission_rad
        (n,) angle from a normal within which light is emitted.
    intensity
        (n,) largest radiant intensity, weighted over the spectrum: > 0.
    """

    low_m: Array
    high_m: Array
    radius_m: Array
    axis: Array
    spread_rad: Array
    emission_rad: Array
    intensity: Array


@dataclass(frozen=True, slots=True, eq=False)
class LightTree:
    """Nodes (m, NODE_FLOATS) float32, root first; `trail` (n,) uint32 holds the way to each leaf, bit d the turn at depth d."""

    nodes: NDArray[np.float32]
    trail: NDArray[np.uint32]
    depth: int


# Building ------------------------------------------------------------------------------------------------------------


def build_light_tree(bounds: LeafBounds, leaf: NDArray[np.int64]) -> LightTree:
    """Return the tree of the lights, whose numbers as leaves are `leaf` (n,), at most 31 levels deep.

    Level by level, all nodes of a level at once: every place along a node's longest axis is weighed, by intensity, spread of
    directions and squared diagonal. Weighing all three axes makes no better trees (measured), and takes three times as long.
    """
    builder = _Builder(bounds, leaf)
    while builder.split_level():
        pass
    return builder.finish()


class _Builder:
    """Holds the lights of all nodes of a level, side by side in three orders: by x, by y and by z."""

    def __init__(self, bounds: LeafBounds, leaf: NDArray[np.int64]) -> None:
        count = len(leaf)
        self._bounds, self._leaf = bounds, leaf
        middle = 0.5 * (bounds.low_m + bounds.high_m)
        self._middle = middle
        low = bounds.low_m.min(axis=0)
        size = max(float(np.max(bounds.high_m.max(axis=0) - low)), np.finfo(np.float64).tiny)
        # Between 0 and 1, so that running maxima of many nodes can share one array, each node 2 above the last.
        self._unit_low, self._unit_high = ((corner - low).T / size for corner in (bounds.low_m, bounds.high_m))
        self._sums = np.ascontiguousarray(np.concatenate([np.ones((1, count)), bounds.axis.T]) * bounds.intensity)
        self._orders = [np.argsort(middle[:, k], kind="stable") for k in range(3)]
        self._starts = np.zeros(1, dtype=np.int64)
        self._nodes = np.zeros(1, dtype=np.int64)
        self._depth = 0
        self._trail = np.zeros(count, dtype=np.uint32)
        self._first_child = np.zeros(max(1, 2 * count - 1), dtype=np.uint32)
        self._records = np.zeros((max(1, 2 * count - 1), NODE_FLOATS), dtype=np.float32)
        self._used = 1
        self._describe(self._orders[0], self._starts, self._nodes)

    def split_level(self) -> bool:
        """Split every node of more than one light; return whether there was one."""
        self._drop_leaves()
        count = len(self._orders[0])
        if count == 0:
            return False
        starts = self._starts
        sizes = np.diff(np.append(starts, count))
        segment = np.repeat(np.arange(len(starts)), sizes)
        axis = self._longest_axis(segment)
        cost = self._costs(np.choose(axis[segment], self._orders), segment, sizes)
        left_count = self._cheapest_place(cost, segment)
        self._part(segment, sizes, axis, left_count)
        return True

    def _cheapest_place(self, cost: Array, segment: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return (nodes,) the number of lights to the left of each node's cheapest split."""
        lowest = np.minimum.reduceat(cost, self._starts)
        places = np.flatnonzero(cost == lowest[segment])
        first = places[np.searchsorted(segment[places], np.arange(len(self._starts)))]
        return np.asarray(first - self._starts + 1)

    def _longest_axis(self, segment: NDArray[np.int64]) -> NDArray[np.int64]:
        last = np.append(self._starts[1:], len(segment)) - 1
        spans = [
            values[order[last]] - values[order[self._starts]]
            for values, order in zip(self._middle.T, self._orders, strict=True)
        ]
        return np.asarray(np.argmax(spans, axis=0))

    def _drop_leaves(self) -> None:
        count = len(self._orders[0])
        sizes = np.diff(np.append(self._starts, count))
        single = sizes == 1
        items = self._orders[0][self._starts[single]]
        self._first_child[self._nodes[single]] = _LEAF | self._leaf[items].astype(np.uint32)
        kept = np.repeat(~single, sizes)
        self._orders = [order[kept] for order in self._orders]
        sizes = sizes[~single]
        self._starts = np.cumsum(sizes) - sizes
        self._nodes = self._nodes[~single]

    def _costs(self, order: NDArray[np.int64], segment: NDArray[np.int64], sizes: NDArray[np.int64]) -> Array:
        """Return (items,) the cost of splitting behind each item of `order`; infinite behind a node's last."""
        count, starts = len(order), self._starts
        last = np.repeat(starts + sizes - 1, sizes)
        before = np.repeat(starts - 1, sizes)
        offset = 2.0 * segment.astype(np.float64)
        backwards = (offset[-1] - offset)[::-1]
        squares = [np.zeros(count), np.zeros(count)]
        for high, low in zip(self._unit_high, self._unit_low, strict=True):
            ordered_high, ordered_low = high[order], 1.0 - low[order]
            squares[0] += _running_span(ordered_high, ordered_low, offset) ** 2
            squares[1] += _running_span(ordered_high[::-1], ordered_low[::-1], backwards)[::-1] ** 2
        left, right = [], []
        for values in self._sums:
            running = np.concatenate([np.cumsum(values[order]), [0.0]])  # the last is in front of the first
            left.append(running[:-1] - running[before])
            right.append(running[last] - running[:-1])
        cost = np.full(count, np.inf)
        cost[:-1] = _brightness(left)[:-1] * squares[0][:-1] + _brightness(right)[:-1] * squares[1][1:]
        done = np.arange(1, count + 1) - np.repeat(starts, sizes)
        rest = last + 1 - np.arange(1, count + 1)
        # Lights at one place cost nothing however they are split: halves then.
        cost += np.finfo(np.float64).tiny * np.abs(done - rest)
        most = 2 ** min(_LARGEST_DEPTH - self._depth - 1, 40)
        cost[(rest == 0) | (np.maximum(done, rest) > most)] = np.inf
        return cost

    def _part(
        self, segment: NDArray[np.int64], sizes: NDArray[np.int64], axis: NDArray[np.int64], left_count: NDArray[np.int64]
    ) -> None:
        starts = self._starts
        place = np.arange(len(segment)) - starts[segment]
        goes_right = np.zeros(len(self._leaf), dtype=bool)
        for k, order in enumerate(self._orders):
            chosen = axis[segment] == k
            goes_right[order[chosen]] = (place >= left_count[segment])[chosen]
        self._orders = [self._parted(order, segment, goes_right, left_count) for order in self._orders]
        self._trail[self._orders[0]] |= goes_right[self._orders[0]].astype(np.uint32) << np.uint32(self._depth)
        children = self._used + 2 * np.arange(len(starts))
        self._first_child[self._nodes] = children
        self._used += 2 * len(starts)
        self._starts = np.stack([starts, starts + left_count], axis=1).ravel()
        self._nodes = np.stack([children, children + 1], axis=1).ravel()
        self._depth += 1
        self._describe(self._orders[0], self._starts, self._nodes)

    def _parted(
        self, order: NDArray[np.int64], segment: NDArray[np.int64], goes_right: NDArray[np.bool_], left_count: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """Return `order` with each node's left lights before its right ones, otherwise as before."""
        right = goes_right[order]
        starts = self._starts[segment]
        rights = np.cumsum(right)
        rights_before = np.where(starts > 0, rights[starts - 1], 0)
        rank_right = rights - rights_before - 1
        rank_left = np.arange(len(order)) - starts - (rank_right + 1)
        parted = np.empty_like(order)
        parted[starts + np.where(right, left_count[segment] + rank_right, rank_left)] = order
        return parted

    def _describe(self, order: NDArray[np.int64], starts: NDArray[np.int64], nodes: NDArray[np.int64]) -> None:
        """Write the bounds of new nodes, whose lights stand in `order`."""
        bounds = self._bounds
        segment = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(order))))
        low = [np.minimum.reduceat(values[order], starts) for values in bounds.low_m.T]
        high = [np.maximum.reduceat(values[order], starts) for values in bounds.high_m.T]
        centre = [(0.5 * (a + b)).astype(np.float32).astype(np.float64) for a, b in zip(low, high, strict=True)]
        off = [values[order] - c[segment] for values, c in zip(self._middle.T, centre, strict=True)]
        reach = _length(off) + bounds.radius_m[order]
        # Half the box's diagonal, seen from a centre that is rounded to single precision.
        corner = _length([np.maximum(b - c, c - a) for a, b, c in zip(low, high, centre, strict=True)])
        radius = np.minimum(np.maximum.reduceat(reach, starts), corner)
        intensity, *total = (np.add.reduceat(values[order], starts) for values in self._sums)
        axis, spread = self._cones(total, order, segment, starts)
        emission = np.maximum.reduceat(bounds.emission_rad[order], starts)
        squared = (radius * (1.0 + _CONE_MARGIN)) ** 2
        columns = (*centre, squared, *axis, intensity, np.cos(spread), np.sin(spread), np.cos(emission))
        self._records[nodes, :-1] = np.stack(columns, axis=1)

    def _cones(
        self, total: list[Array], order: NDArray[np.int64], segment: NDArray[np.int64], starts: NDArray[np.int64]
    ) -> tuple[list[Array], Array]:
        """Return axes (x, y, z of the nodes) and half angles (nodes,) of cones that hold those of the lights."""
        bounds = self._bounds
        length = _length(total)
        usable = length > 0
        axis = [component / np.where(usable, length, 1.0) for component in total]
        cosine = sum(a[segment] * values[order] for a, values in zip(axis, bounds.axis.T, strict=True))
        angle = np.arccos(np.clip(cosine, -1.0, 1.0)) + bounds.spread_rad[order]
        spread = np.where(usable, np.maximum.reduceat(angle, starts), np.pi)
        return axis, np.minimum(spread + _CONE_MARGIN, np.pi)

    def finish(self) -> LightTree:
        """Return the tree."""
        self._records[:, 11] = self._first_child.view(np.float32)
        return LightTree(self._records, self._trail, self._depth)


def _length(vector: list[Array]) -> Array:
    x, y, z = vector
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def _running_span(high: Array, low_from_1: Array, offset: Array) -> Array:
    """Return the extent of all items of a node up to each, given 1 - low and twice the node's number in `offset`."""
    high, low_from_1 = high + offset, low_from_1 + offset
    np.maximum.accumulate(high, out=high)
    np.maximum.accumulate(low_from_1, out=low_from_1)
    high += low_from_1
    high -= 2.0 * offset + 1.0
    return high


def _brightness(sums: list[Array]) -> Array:
    """Return intensity times spread of directions, given the sums of the intensities and of the axes weighted by them.

    The solid angle into which a node shines is taken from the length R of the mean of its axes as pi (1 + 3 sqrt(1 - R)):
    right for one direction (pi) and for all (4 pi), and cheaper than a cone.
    """
    intensity, x, y, z = sums
    intensity = np.maximum(intensity, np.finfo(np.float64).tiny)
    length = np.sqrt(x * x + y * y + z * z) / intensity
    return np.asarray(intensity * (1.0 + 3.0 * np.sqrt(1.0 - np.minimum(length, 1.0))))


# Walking -------------------------------------------------------------------------------------------------------------


class TreeWalk:
    """The tree on the device. `lights` counts all leaves, those without power included."""

    def __init__(self, mi: Any, tree: LightTree, leaf: NDArray[np.int64], lights: int) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        self._four = dr.llvm.ad.Array4f
        # At least two: a gather from an array of one would be other code.
        trail = np.full(max(2, lights), _ABSENT, dtype=np.uint32)
        trail[leaf] = tree.trail
        self._nodes, self._trail = upload(mi.Float, tree.nodes), upload(mi.UInt32, trail)

    def choose(self, point: Any, normal: Any, u: Any, active: Any) -> tuple[Any, Any]:
        """Return (leaf, probability); the probability is 0 where no light of the chosen branch can light the point.

        `normal` of length 0 sets no bound.
        """
        dr, mi = self._dr, self._mi

        def step(node: Any, probability: Any, u: Any, going: Any) -> tuple[Any, Any, Any, Any]:
            left, right, left_child, right_child = self._look(node, point, normal, going)
            total = left + right
            share = left / total
            to_left = u < share
            taken = dr.select(to_left, share, right / total)
            # What is left of u within the chosen part is as good as new.
            renewed = dr.select(to_left, u, u - share) / taken
            lit = total > 0
            probability = dr.select(lit, probability * taken, 0.0)
            u = dr.select(lit, dr.minimum(renewed, 1.0 - 2.0**-24), u)
            node = dr.select(to_left, left_child, right_child)
            return node, probability, u, going & lit & ((node & _LEAF) == 0)

        node, probability, _, _ = dr.while_loop(
            state=self._start(u, active),
            cond=lambda node, probability, u, going: going,
            body=step,
            labels=("node", "probability", "u", "going"),
        )
        found = active & ((node & _LEAF) != 0)
        return dr.select(found, node & ~mi.UInt32(_LEAF), 0), dr.select(found, probability, 0.0)

    def probability(self, leaf: Any, point: Any, normal: Any, active: Any) -> Any:
        """Return the probability with which `choose` returns `leaf` for the point."""
        dr, mi = self._dr, self._mi
        trail = dr.gather(mi.UInt32, self._trail, leaf, active)
        active = active & (trail != _ABSENT)

        def step(node: Any, probability: Any, trail: Any, going: Any) -> tuple[Any, Any, Any, Any]:
            left, right, left_child, right_child = self._look(node, point, normal, going)
            total = left + right
            to_left = (trail & 1) == 0
            lit = total > 0
            probability = dr.select(lit, probability * (dr.select(to_left, left, right) / total), 0.0)
            node = dr.select(to_left, left_child, right_child)
            return node, probability, trail >> 1, going & (probability > 0) & ((node & _LEAF) == 0)

        node, probability, _, _ = self._start(point.x, active)
        _, probability, _, _ = dr.while_loop(
            state=(node, probability, trail, active & ((node & _LEAF) == 0)),
            cond=lambda node, probability, trail, going: going,
            body=step,
            labels=("node", "probability", "trail", "going"),
        )
        return dr.select(active, probability, 0.0)

    def _start(self, like: Any, active: Any) -> tuple[Any, Any, Any, Any]:
        """Return the loop's state at the root, as wide as `like`."""
        dr, mi = self._dr, self._mi
        root = dr.zeros(mi.UInt32, dr.width(like))
        node = self._child(dr.gather(self._four, self._nodes, root * 3 + 2, active))
        one = dr.full(mi.Float, 1.0, dr.width(like))
        return node, one, like, active & ((node & _LEAF) == 0)

    def _child(self, last: Any) -> Any:
        return self._dr.reinterpret_array(self._mi.UInt32, last.w)

    def _look(self, first: Any, point: Any, normal: Any, active: Any) -> tuple[Any, Any, Any, Any]:
        """Return importances and children of two sister nodes, of which `first` is the left one."""
        left, left_child = self._importance(first, point, normal, active)
        right, right_child = self._importance(first + 1, point, normal, active)
        return left, right, left_child, right_child

    def _importance(self, node: Any, point: Any, normal: Any, active: Any) -> tuple[Any, Any]:
        """Return how much the node may light the point, and its first child."""
        dr, mi = self._dr, self._mi
        ball, cone, rest = (dr.gather(self._four, self._nodes, node * 3 + k, active) for k in range(3))
        way = mi.Vector3f(ball.x, ball.y, ball.z) - mi.Vector3f(point)
        distance2 = dr.dot(way, way)
        towards = way * dr.rsqrt(dr.maximum(distance2, _NEAREST_M2))
        # The ball is seen under the half angle u; from inside it fills all directions.
        outside = distance2 > ball.w
        sin2_u = dr.select(outside, ball.w / dr.maximum(distance2, _NEAREST_M2), 0.0)
        sin_u, cos_u = dr.sqrt(sin2_u), dr.select(outside, dr.safe_sqrt(1.0 - sin2_u), -1.0)
        cos_axis = -dr.dot(mi.Vector3f(cone.x, cone.y, cone.z), towards)
        sin_axis = dr.safe_sqrt(1.0 - cos_axis * cos_axis)
        inside_cone = cos_axis > rest.x
        cos_off = dr.select(inside_cone, 1.0, cos_axis * rest.x + sin_axis * rest.y)
        sin_off = dr.select(inside_cone, 0.0, sin_axis * rest.x - cos_axis * rest.y)
        largest = self._largest_cosine(cos_off, sin_off, cos_u, sin_u)
        cos_light = dr.select(largest > rest.z, self._likely(cos_off, largest), 0.0)
        cos_normal = dr.dot(normal, towards)
        sin_normal = dr.safe_sqrt(1.0 - cos_normal * cos_normal)
        cos_point = self._likely(cos_normal, self._largest_cosine(cos_normal, sin_normal, cos_u, sin_u))
        cos_point = dr.select(dr.dot(normal, normal) > 0.5, cos_point, 1.0)
        spread2 = dr.maximum(distance2 + _BALL_SHARE * ball.w, _NEAREST_M2)
        return cone.w * cos_light * cos_point / spread2, self._child(rest)

    def _largest_cosine(self, cosine: Any, sine: Any, cos_u: Any, sin_u: Any) -> Any:
        """Return the cosine of an angle less u, of 0 where u is larger."""
        return self._dr.select(cosine > cos_u, 1.0, cosine * cos_u + sine * sin_u)

    def _likely(self, cosine: Any, largest: Any) -> Any:
        """Return a cosine for a whole ball, from that of its middle and its largest; 0 only where that is."""
        dr = self._dr
        largest = dr.maximum(largest, 0.0)
        return dr.lerp(dr.clip(cosine, 0.0, largest), largest, _BOUND_SHARE)
