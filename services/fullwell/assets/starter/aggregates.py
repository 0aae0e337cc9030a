"""Coarser plants: fewer, larger leaves and twigs that together look like the many small ones.

Simplifying meshes eats leaves, since each is a piece of its own. Here a level keeps one leaf of each group of neighbours and
enlarges it (stochastic simplification: Cook, Halstead, Planck & Ryu 2007, Stochastic simplification of aggregate detail, ACM
Trans. Graph. 26(3), 79). The spread of leaf angles and the material stay. What a group of n leaves of area A covers, seen
through the box around it whose mean shadow is S, is S (1 - exp(-G n A / S)) with G = 1/2 (leaves placed at random, of all
angles; Nilson 1971); the enlarged leaf covers as much, so that crowns let as much sky through and are as bright as they were.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.branching import Wood, bark, cards, unit
from fullwell.assets.starter.building import BuiltLevel, BuiltPart
from fullwell.assets.starter.shapes import Shape, joined

__all__ = ["GROUPS", "PlantLevel", "coarser_plant", "fewer_blades", "fewer_cards", "half_card_m"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class PlantLevel:
    """One coarser level: leaves to a group, the thinnest branch that is kept as a tube, and sides of tubes by girth."""

    leaves: int
    thinnest: float
    sides: tuple[int, int, int]


GROUPS: Final = (4, 14, 40)
"""Leaves to a group, level by level."""

_LEVELS: Final = (
    PlantLevel(GROUPS[0], 0.07, (8, 4, 3)),
    PlantLevel(GROUPS[1], 0.16, (6, 3, 3)),
    PlantLevel(GROUPS[2], 0.35, (5, 3, 3)),
)
"""`thinnest` is a share of the trunk's radius."""


_FACING: Final = 0.5
"""Mean projection of leaves of all angles (G)."""


def coarser_plant(parts: list[BuiltPart], wood: Wood, *, thick: float, flare: float = 0.0) -> tuple[BuiltLevel, ...]:
    """Return a plant's coarser levels, the finest of them first.

    Parameters
    ----------
    parts
        Of the finest level; those named "trunk" and "branches" are made anew from `wood`, "leaves" are thinned, others stay.
    wood
        The skeleton, at its final place.
    thick
        Branches thicker than this share of the trunk's radius belong to the trunk.
    """
    return tuple(_level(parts, wood, level, thick=thick, flare=flare) for level in _LEVELS)


def _level(parts: list[BuiltPart], wood: Wood, level: PlantLevel, *, thick: float, flare: float) -> BuiltLevel:
    trunk_m = float(wood.radius_m[0])
    kept = _rooted(wood, wood.radius_m > level.thinnest * trunk_m)
    trunk, branches = bark(wood.kept(kept), thick_m=thick * trunk_m, flare=flare, sides=level.sides)
    twigs = fewer_cards(_twig_cards(wood, ~kept), level.leaves)
    fine = {part.name: part.shape for part in parts}
    made = {"trunk": trunk, "branches": joined([branches, twigs] if "trunk" in fine else [trunk, branches, twigs])}
    grain_m = half_card_m(twigs)
    if "leaves" in fine:
        made["leaves"] = fewer_cards(fine["leaves"], level.leaves)
        grain_m = half_card_m(made["leaves"])
    return BuiltLevel(tuple(replace(part, shape=made.get(part.name, part.shape)) for part in parts), grain_m)


def half_card_m(leaves: Shape) -> float:
    """Return half the mean length of cards."""
    corners = leaves.vertices_m.reshape(-1, 4, 3)
    return float(np.linalg.norm(corners[:, 2] - corners[:, 0], axis=1).mean() / 2) if len(corners) else 0.0


def fewer_cards(leaves: Shape, group: int) -> Shape:
    """Return one of each `group` neighbouring cards, set into the group's middle and enlarged to what the group covers.

    Cards are as `branching.cards` makes them: four vertices each.
    """
    corners = leaves.vertices_m.reshape(-1, 4, 3)
    if not len(corners):
        return leaves
    middle = corners.mean(axis=1)
    area = _card_areas(corners)
    order, starts = _groups(middle, group)
    sums = np.add.reduceat(area[order], starts)
    # A member near the median of its group's areas, so that none is enlarged much more than others.
    chosen = np.array(
        [block[np.argsort(area[block], kind="stable")[len(block) // 2]] for block in np.split(order, starts[1:])],
        dtype=np.int64,
    )
    depth = _FACING * sums / _shadows(corners[order], starts)
    covered = sums * -np.expm1(-depth) / depth
    grown = np.sqrt(covered / area[chosen])[:, None, None]
    centre = np.add.reduceat(middle[order], starts, axis=0) / np.diff(np.append(starts, len(order)))[:, None]
    enlarged = centre[:, None] + grown * (corners[chosen] - middle[chosen][:, None])
    start = 4 * np.arange(len(chosen))[:, None]
    return Shape(enlarged.reshape(-1, 3), np.concatenate([start + [0, 1, 2], start + [0, 2, 3]]).astype(np.int64))


def fewer_blades(blades: Shape, vertices: int, group: int) -> Shape:
    """Return one of each `group` blades of grass of so many vertices, broadened about its midrib as many times."""
    count = len(blades.vertices_m) // vertices
    points = blades.vertices_m.reshape(count, vertices, 3)
    order, starts = _groups(points[:, :1].mean(axis=1), group)
    sizes = np.diff(np.append(starts, count))
    height = np.ptp(points[..., 2], axis=1)
    blocks = np.split(order, starts[1:])
    chosen = np.array([block[np.argsort(height[block], kind="stable")[len(block) // 2]] for block in blocks], dtype=np.int64)
    rows = points[chosen]
    pairs = rows[:, : vertices - 1].reshape(len(chosen), -1, 2, 3)
    midrib = pairs.mean(axis=2, keepdims=True)
    rows = np.concatenate(
        [(midrib + sizes[:, None, None, None] * (pairs - midrib)).reshape(len(chosen), -1, 3), rows[:, -1:]], axis=1
    )
    per_blade = blades.faces.reshape(-1, count, 3)[:, 0]
    faces = (vertices * np.arange(len(chosen))[None, :, None] + per_blade[:, None]).reshape(-1, 3)
    return Shape(rows.reshape(-1, 3), faces.astype(np.int64))


def _rooted(wood: Wood, wanted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which of the wanted nodes are joined to the root by others."""
    kept = wanted.copy()
    kept[0] = True
    for node in range(1, len(kept)):
        kept[node] &= kept[wood.parent[node]]
    return kept


def _twig_cards(wood: Wood, which: NDArray[np.bool_]) -> Shape:
    """Return flat cards for the segments that end in some nodes, each with the area that its tube shows from all sides.

    A convex body shows on average a quarter of its surface (Cauchy): the tube of three sides 3 sqrt(3) r L / 4, a card A / 2.
    """
    nodes = np.flatnonzero(which & (wood.parent >= 0))
    start, end = wood.nodes_m[wood.parent[nodes]], wood.nodes_m[nodes]
    along = end - start
    length = np.linalg.norm(along, axis=1)
    # Across: turned from card to card by the golden angle, so that all directions are met.
    turn = np.arange(len(nodes)) * np.pi * (3.0 - np.sqrt(5.0))
    first = unit(np.cross(unit(along), [0.31, 0.17, 0.94]))
    facing = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * np.cross(unit(along), first)
    # A kite fills half of its length times width.
    return cards(start, unit(along), facing, length, 3.0 * np.sqrt(3.0) * wood.radius_m[nodes], fold=0.0)


def _shadows(corners: Array, starts: Indices) -> Array:
    """Mean area [m2] of the shadow of each group's bounding box (Cauchy: a quarter of its surface)."""
    low = np.minimum.reduceat(corners.min(axis=1), starts, axis=0)
    high = np.maximum.reduceat(corners.max(axis=1), starts, axis=0)
    x, y, z = (high - low).T
    return np.asarray((x * y + y * z + z * x) / 2) + 1e-12


def _card_areas(corners: Array) -> Array:
    diagonal = corners[:, 2] - corners[:, 0]
    halves = [np.cross(corners[:, 1] - corners[:, 0], diagonal), np.cross(diagonal, corners[:, 3] - corners[:, 0])]
    return np.asarray(sum(0.5 * np.linalg.norm(half, axis=1) for half in halves)) + 1e-12


def _groups(points: Array, size: int) -> tuple[Indices, Indices]:
    """Return an order of (n, 3) points and where groups of at most `size` neighbours start: halved along the longest side."""
    order = np.arange(len(points))
    blocks = [order]
    done: list[Indices] = []
    while blocks:
        block = blocks.pop()
        if len(block) <= size:
            done.append(block)
            continue
        axis = int(np.argmax(np.ptp(points[block], axis=0)))
        ranked = block[np.argsort(points[block, axis], kind="stable")]
        # Whole groups on either side, so that all but the last are full.
        half = size * max(round(len(block) / size / 2), 1)
        blocks += [ranked[half:], ranked[:half]]
    starts = np.cumsum([0, *(len(block) for block in done[:-1])])
    return np.concatenate(done), starts.astype(np.int64)
