"""Bushes, hedges, grass and rocks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.aggregates import GROUPS, coarser_plant, fewer_blades, fewer_cards, half_card_m
from fullwell.assets.starter.branching import bark, card_area_m2, cards, colonised, noise, unit
from fullwell.assets.starter.building import BuiltAsset, BuiltLevel, BuiltPart, StarterEntry
from fullwell.assets.starter.implicit import vertex_normals
from fullwell.assets.starter.shapes import Shape, joined

__all__ = ["PLANTS", "grass_patch", "hedge", "rock", "shrub"]

Array = NDArray[np.float64]


def hedge(
    rng: np.random.Generator,
    *,
    size_m: tuple[float, float, float],
    leaf_count: int = 17000,
    leaf_m: tuple[float, float] = (0.055, 0.034),
    foliage: str = "foliage/hedge",
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a clipped block of hedge, (x, y, z) metres, to be set in rows along y."""
    size = np.array(size_m)
    # Dark twigs fill the inside; leaves lie in a layer of a hand's depth under the clipped faces.
    stems = []
    for y in np.arange(0.12 - size[1] / 2, size[1] / 2, 0.22):
        stems.append(_sprout(rng, np.array([rng.normal(0, 0.05), y, 0.0]), size, 46))
    inner = 0.86 * size
    lumps = float(rng.uniform(0, 6))

    def core(rows: int) -> BuiltPart:
        return BuiltPart("core", _lumpy_box(inner, 0.03, lumps, rows).moved(z_m=0.5 * inner[2] + 0.05), foliage)

    face, u, v, depth = (
        rng.integers(0, 7, leaf_count),
        *rng.uniform(-0.5, 0.5, (2, leaf_count)),
        rng.exponential(0.030, leaf_count),
    )
    areas = np.array([size[1] * size[2]] * 2 + [size[0] * size[2]] * 2 + [size[0] * size[1]])
    face = rng.choice(5, leaf_count, p=areas / areas.sum())
    axis = np.array([0, 0, 1, 1, 2])[face]
    out = np.zeros((leaf_count, 3))
    out[np.arange(leaf_count), axis] = np.array([1, -1, 1, -1, 1.0])[face]
    local = np.column_stack(
        [np.where(axis == 0, 0, u), np.where(axis == 1, 0, np.where(axis == 0, u, v)), np.where(axis == 2, 0, v)]
    )
    at = (local + 0.5 * out) * size + [0, 0, 0.5 * size[2]]
    bumps = 0.022 * noise(at * 2.2, 1.7)
    at = at - out * (np.minimum(depth, 0.14) + 0.02 + bumps)[:, None]
    # Edges are rounded by use.
    at[:, :2] *= 1 - 0.05 * np.clip((at[:, 2:3] / size[2] - 0.85) / 0.15, 0, 1)
    at[:, 2] = np.maximum(at[:, 2], 0.06)
    leaves = _twig_leaves(rng, at, out, leaf_m)
    parts = [
        BuiltPart("branches", joined(stems), "bark/oak"),
        core(24),
        BuiltPart("leaves", leaves, foliage),
    ]
    coarser = []
    for rows, group in zip((12, 6, 4), GROUPS, strict=True):
        fewer = fewer_cards(leaves, group)
        coarser.append(BuiltLevel((core(rows), BuiltPart("leaves", fewer, foliage)), half_card_m(fewer)))
    return _plant("bush", ("hedge", *tags), parts, {"leaf_area_m2": round(card_area_m2(leaves), 2)}, coarser)


def shrub(
    rng: np.random.Generator,
    *,
    radius_m: float,
    height_m: float,
    leaf_count: int = 13000,
    leaf_m: tuple[float, float] = (0.07, 0.04),
    foliage: str = "foliage/hedge",
    clumps: float = 0.7,
    arching: float = 0.2,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a shrub of many stems; `arching` bends them outwards, `leaf_count` 0 leaves it bare."""
    size = np.array([2 * radius_m, 2 * radius_m, height_m])
    seed = float(rng.uniform(0, 6))
    points = rng.normal(size=(9000, 3))
    points = unit(points) * rng.uniform(0, 1, (9000, 1)) ** 0.4
    lumps = 1.0 + 0.16 * noise(points * 1.6, seed)
    points = points * lumps[:, None] * [radius_m, radius_m, 0.50 * height_m] + [0, 0, 0.47 * height_m]
    points = points[(points[:, 2] > 0.05) & (noise(points * 3.0 / radius_m, seed + 1.0) > -1.0 + clumps)]
    points = points[: 900 if leaf_count else 3200]
    start = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.05], [0.0, 0.0, 0.10]])
    step = (0.075 if leaf_count else 0.05) * max(height_m, radius_m)
    wood = colonised(start, points, step_m=step, reach_m=2 * radius_m, kill_m=1.4 * step, pull=np.array([0, 0, 0.3 - arching]))
    wood = wood.smoothed(2).thickened(0.045 * height_m, 0.0032)
    wood = replace(
        wood, nodes_m=np.column_stack([wood.nodes_m[:, :2], np.maximum(wood.nodes_m[:, 2], 0.02 * (wood.parent >= 0))])
    )
    thick, thin = bark(wood, thick_m=0.02 * height_m)
    parts = [BuiltPart("branches", joined([thick, thin]), "bark/oak")]
    area = 0.0
    if leaf_count:
        ends = np.flatnonzero((wood.radius_m < 0.010) & (wood.parent >= 0))
        twig = rng.choice(ends, leaf_count)
        at = wood.nodes_m[twig] + rng.normal(0, 0.055 * size[0] / 2, (leaf_count, 3))
        at[:, 2] = np.maximum(at[:, 2], 0.03)
        out = unit((at - [0, 0, 0.35 * height_m]) / (0.5 * size) + [0, 0, 0.25])
        leaves = _twig_leaves(rng, at, out, leaf_m)
        area = card_area_m2(leaves)
        parts.append(BuiltPart("leaves", leaves, foliage))
    coarser = coarser_plant(parts, wood, thick=0.44)
    return _plant("bush", ("shrub", *tags), parts, {"leaf_area_m2": round(area, 2)}, coarser)


def grass_patch(
    rng: np.random.Generator,
    *,
    size_m: tuple[float, float],
    height_m: float,
    blades: int,
    width_m: float = 0.005,
    lean: float = 0.35,
    material: str = "grass/green",
    dry: float = 0.0,
    ears: int = 0,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a patch of grass, (x, y) metres, blade by blade; a share `dry` of them is dead, `ears` carry seed heads."""
    at = np.column_stack([*(rng.uniform(-0.5, 0.5, (2, blades)) * np.array(size_m)[:, None]), np.zeros(blades)])
    # Tufts: blades gather, and tall ones stand together.
    at[:, :2] += 0.02 * np.column_stack([noise(at * 9.0, 1.0), noise(at * 9.0, 4.0)])
    tall = 1.0 + 0.35 * noise(at * 3.0, float(rng.uniform(0, 6)))
    height = height_m * np.clip(tall * rng.uniform(0.55, 1.15, blades), 0.25, 1.35)
    heading = rng.uniform(0, 2 * np.pi, blades)
    tilt = np.clip(np.abs(rng.normal(0, lean, blades)), 0.0, 0.9)
    dead = rng.uniform(size=blades) < dry
    stalks = np.zeros(blades, dtype=bool)
    stalks[:ears] = True
    height[stalks] = np.minimum(height[stalks] * 1.25, 1.3 * height_m)
    tilt[stalks] *= 0.45
    parts = [BuiltPart("blades", _blades(at[~dead], height[~dead], heading[~dead], tilt[~dead], width_m), material)]
    if dead.any():
        parts.append(BuiltPart("dry_blades", _blades(at[dead], height[dead], heading[dead], tilt[dead], width_m), "grass/dry"))
    if ears:
        parts.append(BuiltPart("ears", _ears(rng, at[stalks], height[stalks], heading[stalks], tilt[stalks]), "grass/dry"))
    coarser = [_fewer_grass(parts, group, 0.5 * width_m) for group in GROUPS]
    return _plant("grass", tags, parts, {"blades": float(blades), "blade_height_m": height_m}, coarser)


def _fewer_grass(parts: list[BuiltPart], group: int, half_m: float) -> BuiltLevel:
    fewer = tuple(
        replace(part, shape=fewer_cards(part.shape, group))
        if part.name == "ears"
        else replace(part, shape=fewer_blades(part.shape, _BLADE_VERTICES, group))
        for part in parts
    )
    return BuiltLevel(fewer, group * half_m)


def rock(
    rng: np.random.Generator, *, size_m: tuple[float, float, float], material: str, facets: int = 14, tags: tuple[str, ...] = ()
) -> BuiltAsset:
    """Return a boulder, (x, y, z) metres, broken along planes and weathered, sunk a little into the ground."""
    directions = _ball_mesh(40)
    # No plane faces far down: what stands on a narrow foot would have toppled.
    normals = unit(rng.normal(size=(facets, 3)) * [1, 1, 0.8] + [0, 0, 0.35])
    offsets = rng.uniform(0.72, 1.0, facets)
    facing = directions.vertices_m @ normals.T
    with np.errstate(divide="ignore"):
        limit = np.where(facing > 0.05, offsets / np.maximum(facing, 0.05), np.inf)
    # A soft minimum rounds the edges where the planes meet.
    radius = (np.minimum(limit, 3.0) ** -14).sum(axis=1) ** (-1 / 14)
    seed = float(rng.uniform(0, 6))
    radius *= 1 + 0.05 * noise(directions.vertices_m * 1.4, seed) + 0.018 * noise(directions.vertices_m * 6.0, seed + 1)
    points = directions.vertices_m * radius[:, None]
    points = (points - points.min(axis=0)) / np.ptp(points, axis=0) - [0.5, 0.5, 0.38]
    points = points * size_m / [1, 1, 0.62]
    points[:, 2] = np.maximum(points[:, 2], 0.0)
    parts = [BuiltPart("rock", _shaded(points, directions.faces), material)]
    return _plant("rock", tags, parts, {})


def _sprout(rng: np.random.Generator, foot: Array, size: Array, count: int) -> Shape:
    points = (
        foot
        + rng.uniform(-0.5, 0.5, (count, 3)) * [0.8 * size[0], 0.3, 0.0]
        + rng.uniform(0.1, 0.92, (count, 1)) * [0, 0, size[2]]
    )
    start = foot + np.array([[0, 0, 0.0], [0, 0, 0.05], [0, 0, 0.12]])
    wood = colonised(start, points, step_m=0.09, reach_m=2.0, kill_m=0.12, pull=np.array([0, 0, 0.2])).thickened(0.016, 0.003)
    return joined(bark(wood, thick_m=0.008))


def _lumpy_box(size: Array, lump_m: float, seed: float, rows: int) -> Shape:
    ball = _ball_mesh(rows)
    corner = np.abs(ball.vertices_m).max(axis=1, keepdims=True)
    soft = (np.abs(ball.vertices_m) ** 10).sum(axis=1, keepdims=True) ** 0.1
    points = ball.vertices_m / (0.7 * soft + 0.3 * corner) * 0.5 * size
    points = points + lump_m * noise(points * 3.0, seed)[:, None] * unit(points)
    return _shaded(points, ball.faces)


def _twig_leaves(rng: np.random.Generator, at: Array, out: Array, leaf_m: tuple[float, float]) -> Shape:
    count = len(at)
    along = unit(out + 1.0 * rng.normal(size=(count, 3)) + [0, 0, -0.1])
    facing = unit(0.7 * out + 0.6 * rng.normal(size=(count, 3)) + [0, 0, 0.6])
    size = rng.uniform(0.65, 1.25, count)
    return cards(at, along, facing, leaf_m[0] * size, leaf_m[1] * size)


_BLADE_VERTICES: Final = 7


def _blades(at: Array, height: Array, heading: Array, tilt: Array, width_m: float) -> Shape:
    """Return blades of three bent pieces: five triangles each."""
    out = np.column_stack([np.cos(heading), np.sin(heading), np.zeros(len(at))])
    side = np.column_stack([-np.sin(heading), np.cos(heading), np.zeros(len(at))])
    up = np.array([0.0, 0.0, 1.0])
    rows = []
    for t, width in ((0.0, 1.0), (0.4, 0.9), (0.75, 0.6), (1.0, 0.0)):
        angle = (tilt * (0.35 + 0.9 * t))[:, None]
        centre = at + (t * height)[:, None] * (np.cos(angle) * up + np.sin(angle) * out)
        half = 0.5 * width_m * width * side
        rows += [centre - half, centre + half] if t < 1.0 else [centre]
    vertices = np.stack(rows, axis=1)
    start = _BLADE_VERTICES * np.arange(len(at))[:, None]
    faces = [start + part for part in ([0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4], [4, 5, 6])]
    vertices = vertices.reshape(-1, 3)
    return Shape(np.column_stack([vertices[:, :2], np.maximum(vertices[:, 2], 0.0)]), np.concatenate(faces).astype(np.int64))


def _ears(rng: np.random.Generator, at: Array, height: Array, heading: Array, tilt: Array) -> Shape:
    out = np.column_stack([np.cos(heading), np.sin(heading), np.zeros(len(at))])
    angle = (tilt * 1.25)[:, None]
    along = np.cos(angle) * np.array([0.0, 0.0, 1.0]) + np.sin(angle) * out
    top = at + height[:, None] * along
    shapes = []
    for _ in range(5):
        around = rng.normal(size=(len(at), 3))
        base = top - along * rng.uniform(0.0, 0.10, (len(at), 1))
        shapes.append(cards(base, unit(along + 0.4 * unit(around)), around, np.full(len(at), 0.05), np.full(len(at), 0.012)))
    return joined(shapes)


def _ball_mesh(rows: int) -> Shape:
    """Return a unit sphere of even quads: a cube's faces, pushed out."""
    line = np.tan(np.linspace(-np.pi / 4, np.pi / 4, rows + 1))
    u, v = np.meshgrid(line, line, indexing="ij")
    ones = np.ones_like(u)
    points, faces, start = [], [], 0
    index = np.arange((rows + 1) ** 2).reshape(rows + 1, rows + 1)
    for axis in range(3):
        for sign in (1.0, -1.0):
            face = np.moveaxis(np.roll(np.array([sign * ones, u, sign * v]), axis, axis=0), 0, -1)
            points.append(unit(face.reshape(-1, 3)))
            a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
            quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4) + start
            faces.append(np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))
            start += (rows + 1) ** 2
    vertices = np.concatenate(points)
    _, first, back = np.unique(np.round(vertices, 9), axis=0, return_index=True, return_inverse=True)
    return Shape(vertices[first], back.reshape(-1)[np.concatenate(faces)].astype(np.int64))


def _shaded(points: Array, faces: NDArray[np.int64]) -> Shape:
    return Shape(points, faces, vertex_normals(points, faces))


def _plant(
    asset_class: str,
    tags: tuple[str, ...],
    parts: list[BuiltPart],
    attributes: dict[str, float | str],
    coarser: Sequence[BuiltLevel] = (),
) -> BuiltAsset:
    rounded = tuple(_rounded(part) for part in parts)
    levels = tuple(
        replace(level, parts=tuple(_rounded(part) for part in level.parts if len(part.shape.faces))) for level in coarser
    )
    height = max(float(part.shape.vertices_m[:, 2].max()) for part in rounded)
    return BuiltAsset(asset_class, tags, rounded, attributes | {"height_m": round(height, 3)}, levels)


def _rounded(part: BuiltPart) -> BuiltPart:
    vertices = np.round(part.shape.vertices_m, 5)
    vertices[:, 2] = np.maximum(vertices[:, 2], 0.0)
    return replace(part, shape=replace(part.shape, vertices_m=vertices))


def _entry(name: str, title: str, seed: int, make: Callable[..., BuiltAsset], **parameters: object) -> StarterEntry:
    return StarterEntry(name, title, make, parameters, seed)


PLANTS: Final = (
    _entry("hedge-01", "Clipped hedge, one block of a row", 401, hedge, size_m=(0.65, 1.6, 1.25), tags=("clipped",)),
    _entry("shrub-round-01", "Round shrub", 402, shrub, radius_m=0.75, height_m=1.25, tags=("round",)),
    _entry(
        "shrub-tall-01",
        "Tall loose shrub",
        403,
        shrub,
        radius_m=0.95,
        height_m=2.3,
        leaf_count=12000,
        leaf_m=(0.10, 0.055),
        foliage="foliage/broadleaf",
        clumps=0.75,
        arching=0.05,
        tags=("tall",),
    ),
    _entry(
        "shrub-autumn-01",
        "Arching shrub, autumn",
        404,
        shrub,
        radius_m=0.9,
        height_m=1.1,
        leaf_count=9000,
        leaf_m=(0.065, 0.04),
        foliage="foliage/autumn",
        clumps=0.65,
        arching=0.45,
        tags=("autumn",),
    ),
    _entry(
        "shrub-winter-01",
        "Bare shrub in winter",
        405,
        shrub,
        radius_m=0.7,
        height_m=1.3,
        leaf_count=0,
        clumps=0.4,
        tags=("winter", "bare"),
    ),
    _entry(
        "grass-lawn-01",
        "Lawn, 1.5 m square",
        411,
        grass_patch,
        size_m=(1.5, 1.5),
        height_m=0.065,
        blades=8000,
        width_m=0.0045,
        lean=0.5,
        dry=0.06,
        tags=("lawn", "short"),
    ),
    _entry(
        "grass-meadow-01",
        "Meadow grass, 1.4 m square",
        412,
        grass_patch,
        size_m=(1.4, 1.4),
        height_m=0.48,
        blades=5200,
        width_m=0.0075,
        lean=0.30,
        dry=0.16,
        ears=420,
        tags=("meadow", "tall"),
    ),
    _entry(
        "grass-dry-01",
        "Dry verge grass, 1.4 m square",
        413,
        grass_patch,
        size_m=(1.4, 1.4),
        height_m=0.30,
        blades=5200,
        width_m=0.006,
        lean=0.45,
        material="grass/dry",
        ears=300,
        tags=("dry", "verge"),
    ),
    _entry(
        "rock-granite-01", "Granite boulder", 421, rock, size_m=(1.15, 0.85, 0.70), material="stone/granite", tags=("granite",)
    ),
    _entry(
        "rock-sandstone-01",
        "Sandstone block",
        422,
        rock,
        size_m=(0.75, 0.60, 0.36),
        material="stone/sandstone",
        facets=9,
        tags=("sandstone",),
    ),
)
"""Bushes, grass and rocks of the starter library."""
