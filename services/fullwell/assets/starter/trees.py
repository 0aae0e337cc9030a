"""Trees: broadleaved ones grown into a crown's outline, conifers built whorl by whorl.

Heights, crown and stem diameters are those of open-grown urban trees of middle age, shaped after McPherson, van Doorn & Peper
2016, Urban tree database (USDA Forest Service RDS-2016-0005). Leaf area index of crowns 2 to 6 (Breda 2003, J. Exp. Bot. 54,
2403). One card stands for one large leaf or a few small ones, so that the area is right at a countable number.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.aggregates import coarser_plant
from fullwell.assets.starter.branching import Wood, bark, card_area_m2, cards, colonised, noise, unit
from fullwell.assets.starter.building import BuiltAsset, BuiltLevel, BuiltPart, StarterEntry
from fullwell.assets.starter.shapes import Shape, tube

__all__ = ["TREES", "broadleaf", "pine", "spruce"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Outline:
    """A crown: radius as a fraction of the largest, over height from its bottom (0) to its top (1)."""

    at: tuple[float, ...]
    radius: tuple[float, ...]


_OUTLINES: Final = {
    "round": _Outline((0.0, 0.08, 0.25, 0.5, 0.75, 0.92, 1.0), (0.25, 0.62, 0.93, 1.0, 0.82, 0.48, 0.05)),
    "oval": _Outline((0.0, 0.10, 0.3, 0.55, 0.8, 0.94, 1.0), (0.25, 0.70, 1.0, 0.92, 0.62, 0.30, 0.03)),
    "slender": _Outline((0.0, 0.10, 0.3, 0.55, 0.8, 0.94, 1.0), (0.30, 0.80, 1.0, 0.85, 0.50, 0.22, 0.02)),
    "column": _Outline((0.0, 0.06, 0.3, 0.6, 0.85, 0.96, 1.0), (0.45, 0.80, 1.0, 0.95, 0.65, 0.35, 0.10)),
    "vase": _Outline((0.0, 0.15, 0.4, 0.65, 0.85, 1.0), (0.20, 0.50, 0.85, 1.0, 0.80, 0.25)),
    "umbrella": _Outline((0.0, 0.2, 0.45, 0.7, 0.9, 1.0), (0.30, 0.75, 1.0, 0.95, 0.60, 0.15)),
}


def _crown_points(
    rng: np.random.Generator, outline: str, span_m: tuple[float, float], radius_m: float, *, count: int, clumps: float
) -> Array:
    """Draw points in a crown, denser towards its surface, with gaps between clumps."""
    shape = _OUTLINES[outline]
    low_m, high_m = span_m
    points: list[Array] = []
    seed = float(rng.uniform(0, 6))
    while sum(map(len, points)) < count:
        t = rng.uniform(0, 1, 4 * count)
        limit = np.interp(t, shape.at, shape.radius)
        keep = rng.uniform(0, 1, 4 * count) < limit**2
        t, limit = t[keep], limit[keep]
        angle = rng.uniform(0, 2 * np.pi, len(t))
        bulge = 1.0 + 0.16 * np.sin(3 * angle + 5 * t + seed) + 0.08 * np.sin(5 * angle - 7 * t + 2 * seed)
        r = radius_m * limit * bulge * rng.uniform(0, 1, len(t)) ** 0.42
        p = np.column_stack([r * np.cos(angle), r * np.sin(angle), low_m + t * (high_m - low_m)])
        points.append(p[noise(p * 0.42 * 4.0 / max(radius_m, 1.0), seed) > -1.0 + clumps])
    return np.concatenate(points)[:count]


def broadleaf(
    rng: np.random.Generator,
    *,
    species: str,
    height_m: float,
    crown_radius_m: float,
    trunk_radius_m: float,
    bare_m: float,
    outline: str = "round",
    leaf_count: int = 14000,
    leaf_m: tuple[float, float] = (0.15, 0.10),
    foliage: str = "foliage/broadleaf",
    bark_material: str = "bark/oak",
    branch_material: str = "bark/oak",
    droop: float = 0.0,
    rise: float = 0.12,
    points: int = 2200,
    step_m: float = 0.24,
    clumps: float = 0.62,
    marks: int = 0,
    staked: bool = False,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a broadleaved tree.

    Parameters
    ----------
    bare_m
        Height of the lowest branches.
    leaf_count, leaf_m
        Number of leaf cards (0 in winter), and their length and width.
    droop, rise
        How far twigs hang, and growth strives upward (0 to 1).
    points, step_m, clumps
        Fineness of the branching; share of the crown that is gaps between clumps.
    marks
        Dark scars on the bark, of birches.
    staked
        With a post and a tie, as young street trees.
    """
    crown = _crown_points(rng, outline, (bare_m, height_m), crown_radius_m, count=points, clumps=clumps)
    stem_top = bare_m + 0.18 * (height_m - bare_m)
    stem = _stem(rng, stem_top, step_m, crooked=0.02)
    reach = max(1.2, 0.9 * crown_radius_m)
    pull = np.array([0.0, 0.0, rise])
    wood = colonised(stem, crown, step_m=step_m, reach_m=reach, kill_m=1.7 * step_m, pull=pull)
    wood = wood.smoothed(3).thickened(trunk_radius_m, 0.0045)
    if droop > 0:
        wood = _weighed(wood, droop)
    wood = replace(
        wood, nodes_m=wood.nodes_m * [1, 1, height_m / (wood.nodes_m[:, 2].max() + 0.5 * leaf_m[0] * (leaf_count > 0))]
    )
    trunk, branches = bark(wood, thick_m=0.42 * trunk_radius_m, flare=0.45, ridges=0.06)
    parts = [BuiltPart("trunk", trunk, bark_material), BuiltPart("branches", branches, branch_material)]
    if marks:
        parts.append(BuiltPart("bark_marks", _bark_marks(rng, trunk, marks), "bark/oak"))
    leaves_m2 = 0.0
    if leaf_count:
        leaves = _leaves(rng, wood, leaf_count, leaf_m, droop)
        parts.append(BuiltPart("leaves", leaves, foliage))
        leaves_m2 = card_area_m2(leaves)
    if staked:
        parts += _stake(trunk_radius_m, bare_m)
    coarser = coarser_plant(parts, wood, thick=0.42, flare=0.45)
    return _tree(parts, species, ("broadleaf", *tags), trunk_radius_m, leaves_m2, coarser=coarser)


def _stem(rng: np.random.Generator, top_m: float, step_m: float, *, crooked: float) -> Array:
    count = max(int(top_m / step_m), 3)
    z = np.linspace(0.0, top_m, count)
    sway = np.cumsum(rng.normal(0, crooked * step_m * 3, (count, 2)), axis=0)
    sway = sway - sway[0]
    return np.column_stack([sway, z])


def _weighed(wood: Wood, droop: float) -> Wood:
    """Let thin branches hang: each segment turns down the more, the thinner it is."""
    nodes = wood.nodes_m.copy()
    parent = wood.parent
    for node in range(1, len(parent)):
        step = wood.nodes_m[node] - wood.nodes_m[parent[node]]
        weak = droop * np.exp(-wood.radius_m[node] / 0.012)
        length = float(np.linalg.norm(step))
        bent = step / max(length, 1e-9) + np.array([0.0, 0.0, -1.6 * weak])
        nodes[node] = nodes[parent[node]] + length * bent / np.linalg.norm(bent)
    return replace(wood, nodes_m=nodes)


def _leaves(rng: np.random.Generator, wood: Wood, count: int, leaf_m: tuple[float, float], droop: float) -> Shape:
    """Put leaves along the thin twigs, flat to the sky more than not."""
    thin = np.flatnonzero((wood.radius_m < 0.013) & (wood.parent >= 0))
    tip = np.isin(thin, wood.tips())
    weight = np.where(tip, 2.2, 1.0)
    twig = rng.choice(thin, count, p=weight / weight.sum())
    start, end = wood.nodes_m[wood.parent[twig]], wood.nodes_m[twig]
    heading = unit(end - start)
    around = unit(rng.normal(size=(count, 3)))
    around = unit(around - (around * heading).sum(axis=1, keepdims=True) * heading)
    at = start + rng.uniform(0.1, 1.15, (count, 1)) * (end - start)
    petiole = rng.uniform(0.02, 0.14, (count, 1)) * (leaf_m[0] / 0.15)
    base = at + around * petiole
    along = unit(0.7 * heading + 0.8 * around + [0, 0, -0.25 - 0.7 * droop])
    facing = unit(np.array([0, 0, 1.0]) + 0.75 * rng.normal(size=(count, 3)))
    size = rng.uniform(0.72, 1.25, count)
    return cards(base, along, facing, leaf_m[0] * size, leaf_m[1] * size)


def _bark_marks(rng: np.random.Generator, trunk: Shape, count: int) -> Shape:
    """Dark horizontal scars, more of them low on the stem."""
    corners = trunk.vertices_m[trunk.faces]
    centre = corners.mean(axis=1)
    normal = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    weight = np.exp(-centre[:, 2] / 4.0) * np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    pick = rng.choice(len(centre), count, p=weight / weight.sum())
    mix = rng.dirichlet((1.0, 1.0, 1.0), count)
    at = (corners[pick] * mix[:, :, None]).sum(axis=1)
    out = normal[pick]
    level = unit(np.cross([0.0, 0.0, 1.0], out))
    length = rng.uniform(0.04, 0.16, count)
    return cards(
        at - level * (0.5 * length)[:, None] + 0.004 * out, level, out, length, length * rng.uniform(0.15, 0.4, count), fold=0.0
    )


def _stake(trunk_radius_m: float, bare_m: float) -> list[BuiltPart]:
    high = min(bare_m * 0.85, 1.8)
    x = trunk_radius_m + 0.16
    post = tube(np.array([[x, 0.0, 0.0], [x, 0.0, 0.5 * high], [x, 0.0, high]]), 0.035, sides=10)
    tie = tube(
        np.array([[x, 0.0, high - 0.12], [0.0, 0.02, high - 0.10], [-trunk_radius_m - 0.01, 0.0, high - 0.10]]), 0.014, sides=6
    )
    return [BuiltPart("stake", post, "wood/weathered"), BuiltPart("tie", tie, "plastic/black")]


def spruce(
    rng: np.random.Generator,
    *,
    species: str,
    height_m: float,
    crown_radius_m: float,
    trunk_radius_m: float,
    bare_m: float = 0.5,
    spacing_m: float = 0.36,
    sprays: int = 23000,
    needle_m: tuple[float, float] = (0.21, 0.085),
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a cone-shaped conifer: whorls of boughs that hang and lift at their tips, with flat sprays of needles."""
    stem_z = np.linspace(0.0, height_m - 0.02, max(int(height_m / 0.4), 8))
    stem = np.column_stack([0.02 * np.sin(1.3 * stem_z), 0.02 * np.cos(0.9 * stem_z) - 0.02, stem_z])
    nodes, parents, radii = (
        [*stem],
        list(range(-1, len(stem) - 1)),
        list(trunk_radius_m * (1 - stem_z / height_m) ** 0.8 + 0.006),
    )
    weights: list[float] = [0.0] * len(stem)
    z = bare_m
    while z < height_m - 0.25:
        share = 1 - (z - bare_m) / (height_m - bare_m)
        for angle in np.arange(rng.integers(5, 8)) * 2 * np.pi / 6 + rng.uniform(0, 6.3):
            length = crown_radius_m * share**0.85 * rng.uniform(0.78, 1.06)
            _bough(
                rng,
                (nodes, parents, radii, weights),
                stem_z,
                z + rng.normal(0, 0.07),
                angle=float(angle),
                length_m=length,
                share=share,
            )
        z += spacing_m * (0.45 + 0.55 * share) * rng.uniform(0.85, 1.15)
    wood = Wood(np.array(nodes), np.array(parents, dtype=np.int64), np.array(radii))
    # Side twigs vanish under their needles: only stem and boughs get bark.
    bare = wood.kept(np.array(radii) > 0.0046)
    trunk, branches = bark(bare, thick_m=0.6 * trunk_radius_m, flare=0.25, ridges=0.04)
    needles = _sprays(rng, wood, np.array(weights), sprays, needle_m)
    parts = [
        BuiltPart("trunk", trunk, "bark/pine"),
        BuiltPart("branches", branches, "bark/pine"),
        BuiltPart("leaves", needles, "foliage/conifer"),
    ]
    coarser = coarser_plant(parts, bare, thick=0.6, flare=0.25)
    return _tree(parts, species, ("conifer", "evergreen", *tags), trunk_radius_m, card_area_m2(needles), coarser=coarser)


_Lists = tuple[list[Array], list[int], list[float], list[float]]


def _bough(
    rng: np.random.Generator, lists: _Lists, stem_z: Array, z_m: float, *, angle: float, length_m: float, share: float
) -> None:
    """Add one bough with its side twigs."""
    nodes, parents, radii, weights = lists
    out = np.array([np.cos(angle), np.sin(angle), 0.0])
    side = np.array([-out[1], out[0], 0.0])
    count = max(int(length_m / 0.22), 2)
    below = int(np.searchsorted(stem_z, z_m) - 1)
    parent = max(min(below, len(stem_z) - 2), 0)
    start = np.array([nodes[parent][0], nodes[parent][1], z_m])
    # The bough begins at its own height: one node there, hanging on the stem.
    hang = min(0.42 * share + 0.05, max((z_m - 0.4) / (0.34 * length_m), 0.0))  # the lowest clear the ground
    previous = parent
    for step in range(count + 1):
        t = step / count
        fall = -hang * length_m * (t - 0.75 * t * t) + 0.30 * length_m * (1 - share) * t
        nodes.append(start + out * length_m * t * 0.97 + [0.0, 0.0, fall] + side * 0.04 * length_m * np.sin(3 * t + angle))
        parents.append(previous)
        radii.append(0.006 + 0.016 * length_m * 0.45 * (1 - t))
        weights.append(0.55 + t)
        previous = len(nodes) - 1
        if 0 < step < count:
            for sign in (-1.0, 1.0):
                twig = (0.42 * length_m * (1 - t) + 0.12) * rng.uniform(0.7, 1.1)
                tip = nodes[previous] + twig * (0.62 * out + sign * 0.78 * side) + [0.0, 0.0, -0.10 * twig - 0.03]
                for half in (0.5, 1.0):
                    nodes.append(nodes[previous] + half * (tip - nodes[previous]) + [0, 0, -0.02 * half])
                    parents.append(previous if half == 0.5 else len(nodes) - 2)
                    radii.append(0.0045)
                    weights.append(1.4 * twig / 0.4)


def _sprays(rng: np.random.Generator, wood: Wood, weights: Array, count: int, size_m: tuple[float, float]) -> Shape:
    """Put flat sprays of needles along twigs, slanting forward on both sides and hanging a little."""
    usable = (wood.parent >= 0) & (weights > 0)
    length = np.linalg.norm(wood.nodes_m - wood.nodes_m[wood.parent], axis=1)
    share = np.where(usable, weights * np.minimum(length, 0.5), 0.0)
    twig = rng.choice(len(share), count, p=share / share.sum())
    start, end = wood.nodes_m[wood.parent[twig]], wood.nodes_m[twig]
    heading = unit(end - start)
    level = unit(np.cross([0.0, 0.0, 1.0], heading))
    up = unit(np.cross(heading, level))
    spin = rng.normal(0, 0.6, count) + np.where(rng.uniform(size=count) < 0.5, 0.0, np.pi)
    out = np.cos(spin)[:, None] * level + np.sin(spin)[:, None] * up
    base = start + rng.uniform(0.0, 1.05, (count, 1)) * (end - start)
    along = unit(0.8 * heading + 0.75 * out + [0, 0, -0.12])
    facing = unit(up + 0.55 * rng.normal(size=(count, 3)))
    size = rng.uniform(0.7, 1.2, count)
    return cards(base, along, facing, size_m[0] * size, size_m[1] * size, fold=0.1)


def pine(
    rng: np.random.Generator,
    *,
    species: str,
    height_m: float,
    crown_radius_m: float,
    trunk_radius_m: float,
    bare_m: float,
    tufts: int = 1250,
    needles: int = 17,
    needle_m: tuple[float, float] = (0.21, 0.036),
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a pine: a long bare stem, an irregular crown, needles in tufts at the ends of twigs."""
    crown = _crown_points(rng, "umbrella", (bare_m, height_m - 0.1), crown_radius_m, count=800, clumps=0.80)
    stem = _stem(rng, bare_m + 0.45 * (height_m - bare_m), 0.3, crooked=0.012)
    wood = colonised(stem, crown, step_m=0.3, reach_m=2.6, kill_m=0.5, pull=np.array([0, 0, 0.05]))
    wood = wood.smoothed(2).thickened(trunk_radius_m, 0.008)
    wood = replace(wood, nodes_m=wood.nodes_m * [1, 1, (height_m - 0.7 * needle_m[0]) / wood.nodes_m[:, 2].max()])
    trunk, branches = bark(wood, thick_m=0.4 * trunk_radius_m, flare=0.3, ridges=0.07)
    thin = np.flatnonzero((wood.radius_m < 0.017) & (wood.parent >= 0))
    tip = np.isin(thin, wood.tips())
    weight = np.where(tip, 4.0, 1.0)
    twig = rng.choice(thin, tufts, p=weight / weight.sum())
    heading = unit(wood.nodes_m[twig] - wood.nodes_m[wood.parent[twig]] + [0, 0, 0.12])
    centre = wood.nodes_m[twig] + rng.normal(0, 0.10, (tufts, 3)) * [1, 1, 0.6]
    spread = unit(rng.normal(size=(tufts, needles, 3)) + 1.1 * heading[:, None] + [0, 0, 0.25]).reshape(-1, 3)
    base = np.repeat(centre, needles, axis=0) + 0.02 * spread
    size = rng.uniform(0.7, 1.15, len(base))
    leaves = cards(
        base, spread, unit(rng.normal(size=spread.shape) + [0, 0, 0.8]), needle_m[0] * size, needle_m[1] * size, fold=0.3
    )
    parts = [
        BuiltPart("trunk", trunk, "bark/pine"),
        BuiltPart("branches", branches, "bark/pine"),
        BuiltPart("leaves", leaves, "foliage/conifer"),
    ]
    coarser = coarser_plant(parts, wood, thick=0.4, flare=0.3)
    return _tree(parts, species, ("conifer", "evergreen", *tags), trunk_radius_m, card_area_m2(leaves), coarser=coarser)


def _tree(
    parts: list[BuiltPart],
    species: str,
    tags: tuple[str, ...],
    trunk_radius_m: float,
    leaves_m2: float,
    *,
    coarser: tuple[BuiltLevel, ...],
) -> BuiltAsset:
    grounded = _grounded(parts)
    points = np.concatenate([part.shape.vertices_m for part in grounded])
    reach = float(np.ptp(points[:, :2], axis=0).mean() / 2)
    ground_m2 = float(np.pi * reach**2)
    return BuiltAsset(
        "tree",
        (species, *tags),
        grounded,
        {
            "species": species,
            "height_m": round(float(points[:, 2].max()), 3),
            "crown_radius_m": round(float(reach), 3),
            "trunk_radius_m": trunk_radius_m,
            "leaf_area_m2": round(leaves_m2, 1),
            "leaf_area_index": round(leaves_m2 / ground_m2, 2),
        },
        tuple(replace(level, parts=_grounded(level.parts)) for level in coarser),
    )


def _grounded(parts: Sequence[BuiltPart]) -> tuple[BuiltPart, ...]:
    return tuple(replace(part, shape=_rounded(part.shape)) for part in parts if len(part.shape.faces))


def _rounded(shape: Shape) -> Shape:
    # To a hundredth of a millimetre, so that digests do not hang on the last bits; and nothing reaches below the ground.
    vertices = np.round(shape.vertices_m, 5)
    return replace(shape, vertices_m=np.column_stack([vertices[:, :2], np.maximum(vertices[:, 2], 0.0)]))


def _entry(name: str, title: str, seed: int, make: Callable[..., BuiltAsset], **parameters: object) -> StarterEntry:
    return StarterEntry(name, title, make, parameters, seed)


TREES: Final = (
    _entry(
        "oak-01",
        "Oak, summer",
        301,
        broadleaf,
        species="oak",
        height_m=11.5,
        crown_radius_m=4.6,
        trunk_radius_m=0.27,
        bare_m=2.4,
        leaf_count=20000,
        leaf_m=(0.20, 0.12),
        tags=("summer",),
    ),
    _entry(
        "maple-01",
        "Maple, summer",
        302,
        broadleaf,
        species="maple",
        height_m=9.2,
        crown_radius_m=3.3,
        trunk_radius_m=0.18,
        bare_m=2.2,
        outline="oval",
        leaf_count=17000,
        leaf_m=(0.15, 0.125),
        rise=0.25,
        tags=("summer",),
    ),
    _entry(
        "maple-autumn-01",
        "Maple, autumn",
        303,
        broadleaf,
        species="maple",
        height_m=8.0,
        crown_radius_m=2.9,
        trunk_radius_m=0.15,
        bare_m=2.0,
        outline="oval",
        leaf_count=12500,
        leaf_m=(0.15, 0.125),
        rise=0.25,
        foliage="foliage/autumn",
        tags=("autumn",),
    ),
    _entry(
        "linden-01",
        "Street linden, crown raised over the pavement",
        304,
        broadleaf,
        species="linden",
        height_m=12.0,
        crown_radius_m=3.2,
        trunk_radius_m=0.20,
        bare_m=3.4,
        outline="oval",
        leaf_count=19000,
        leaf_m=(0.14, 0.115),
        rise=0.3,
        tags=("summer", "street"),
    ),
    _entry(
        "plane-01",
        "Plane tree, vase-shaped",
        305,
        broadleaf,
        species="plane",
        height_m=13.0,
        crown_radius_m=5.0,
        trunk_radius_m=0.28,
        bare_m=3.2,
        outline="vase",
        leaf_count=18000,
        leaf_m=(0.21, 0.17),
        rise=0.2,
        tags=("summer", "street"),
    ),
    _entry(
        "birch-01",
        "Birch, summer",
        311,
        broadleaf,
        species="birch",
        height_m=13.0,
        crown_radius_m=2.3,
        trunk_radius_m=0.14,
        bare_m=2.6,
        outline="slender",
        leaf_count=18000,
        leaf_m=(0.105, 0.075),
        foliage="foliage/birch",
        bark_material="bark/birch",
        droop=0.55,
        rise=0.45,
        marks=420,
        tags=("summer",),
    ),
    _entry(
        "birch-02",
        "Young birch",
        312,
        broadleaf,
        species="birch",
        height_m=6.5,
        crown_radius_m=1.3,
        trunk_radius_m=0.065,
        bare_m=1.2,
        outline="slender",
        leaf_count=9000,
        leaf_m=(0.09, 0.065),
        foliage="foliage/birch",
        bark_material="bark/birch",
        droop=0.4,
        rise=0.5,
        step_m=0.16,
        marks=220,
        tags=("summer", "young"),
    ),
    _entry(
        "poplar-01",
        "Lombardy poplar, columnar",
        321,
        broadleaf,
        species="poplar",
        height_m=17.0,
        crown_radius_m=1.75,
        trunk_radius_m=0.24,
        bare_m=1.2,
        outline="column",
        leaf_count=20000,
        leaf_m=(0.125, 0.105),
        rise=0.9,
        points=2600,
        clumps=0.3,
        tags=("summer", "columnar"),
    ),
    _entry(
        "pine-01", "Scots pine", 331, pine, species="pine", height_m=14.0, crown_radius_m=3.2, trunk_radius_m=0.19, bare_m=6.0
    ),
    _entry(
        "spruce-01",
        "Spruce",
        341,
        spruce,
        species="spruce",
        height_m=14.5,
        crown_radius_m=2.7,
        trunk_radius_m=0.18,
        bare_m=0.95,
    ),
    _entry(
        "spruce-02",
        "Young spruce",
        342,
        spruce,
        species="spruce",
        height_m=4.6,
        crown_radius_m=1.25,
        trunk_radius_m=0.06,
        bare_m=0.45,
        spacing_m=0.24,
        sprays=13000,
        needle_m=(0.13, 0.05),
        tags=("young",),
    ),
    _entry(
        "winter-tree-01",
        "Bare oak in winter",
        351,
        broadleaf,
        species="oak",
        height_m=10.5,
        crown_radius_m=4.2,
        trunk_radius_m=0.22,
        bare_m=2.3,
        leaf_count=0,
        points=6500,
        step_m=0.16,
        clumps=0.35,
        tags=("winter", "bare"),
    ),
    _entry(
        "street-tree-01",
        "Young street tree with a stake",
        361,
        broadleaf,
        species="linden",
        height_m=4.8,
        crown_radius_m=1.05,
        trunk_radius_m=0.045,
        bare_m=2.0,
        outline="oval",
        leaf_count=5200,
        leaf_m=(0.10, 0.08),
        rise=0.3,
        step_m=0.13,
        points=700,
        clumps=0.45,
        staked=True,
        tags=("summer", "street", "young"),
    ),
)
"""Trees of the starter library."""
