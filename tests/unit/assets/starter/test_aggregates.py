"""Coarser plants: fewer, larger leaves that cover as much, of the same angles and materials."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fullwell.assets.starter.aggregates import GROUPS, fewer_blades, fewer_cards
from fullwell.assets.starter.branching import card_area_m2, cards, unit
from fullwell.assets.starter.building import BuiltAsset, BuiltPart
from fullwell.assets.starter.library import prepare_starter, starter_entry
from fullwell.assets.starter.shapes import Shape

PIXEL_M = 0.008
COVER_TOLERANCE = {0: 0.05, 1: 0.08, 2: 0.13}
"""By level: leaves are gathered in clumps along twigs, which larger leaves are not; the coarsest are for a few pixels."""
SMALL_TREES = ("birch-02", "spruce-02")


@cache
def built(entry_id: str) -> BuiltAsset:
    return starter_entry(entry_id).build()


def covered_m2(parts: tuple[BuiltPart, ...], towards: tuple[float, float, float]) -> float:
    """Area of the shadow of all triangles on a plane across a direction."""
    direction = unit(np.array(towards, dtype=np.float64))
    across = unit(np.cross(direction, [0.3, 0.2, 0.9]))
    axes = np.stack([across, np.cross(direction, across)], axis=1)
    flat = [(part.shape.vertices_m @ axes, part.shape.faces) for part in parts]
    low = np.min([points.min(axis=0) for points, _ in flat], axis=0)
    size = np.max([points.max(axis=0) for points, _ in flat], axis=0) - low
    shadow = Image.new("1", tuple(int(side / PIXEL_M) + 2 for side in size))
    draw = ImageDraw.Draw(shadow)
    for points, faces in flat:
        for triangle in ((points - low) / PIXEL_M)[faces]:
            draw.polygon([tuple(corner) for corner in triangle], fill=1)
    return float(np.count_nonzero(np.asarray(shadow)) * PIXEL_M**2)


def some_cards(count: int, *, size_m: float = 0.1) -> Shape:
    rng = np.random.Generator(np.random.Philox(3))
    base = rng.uniform(-1.0, 1.0, (count, 3))
    along, facing = unit(rng.normal(size=(count, 3))), unit(rng.normal(size=(count, 3)))
    return cards(base, along, facing, np.full(count, size_m), np.full(count, size_m))


@pytest.mark.parametrize("entry_id", SMALL_TREES)
def test_coarser_trees_cover_as_much_of_what_is_behind_them(entry_id: str) -> None:
    tree = built(entry_id)
    for towards in ((1.0, 0.0, 0.05), (0.4, 1.0, 0.6)):
        fine = covered_m2(tree.parts, towards)
        for level, tolerance in COVER_TOLERANCE.items():
            assert covered_m2(tree.coarser[level].parts, towards) == pytest.approx(fine, rel=tolerance)


@pytest.mark.parametrize("entry_id", [*SMALL_TREES, "shrub-round-01", "hedge-01", "grass-meadow-01"])
def test_levels_have_fewer_triangles_of_the_same_materials(entry_id: str) -> None:
    plant = built(entry_id)
    counts = [
        sum(len(part.shape.faces) for part in parts) for parts in (plant.parts, *(level.parts for level in plant.coarser))
    ]
    assert len(counts) == 1 + len(GROUPS)
    assert all(after < 0.5 * before for before, after in pairwise(counts))
    assert counts[-1] < 0.09 * counts[0]
    materials = {part.name: part.material for part in plant.parts}
    for level in plant.coarser:
        assert {part.name: part.material for part in level.parts}.items() <= materials.items()
        assert all(part.shape.vertices_m[:, 2].min() >= 0.0 for part in level.parts)


@pytest.mark.parametrize("entry_id", SMALL_TREES)
def test_leaf_area_and_leaf_angles_stay(entry_id: str) -> None:
    tree = built(entry_id)
    fine = next(part.shape for part in tree.parts if part.name == "leaves")
    for level in tree.coarser:
        coarse = next(part.shape for part in level.parts if part.name == "leaves")
        assert 0.8 < card_area_m2(coarse) / card_area_m2(fine) <= 1.0  # less what leaves of a group hide of each other
        assert steepness(coarse) == pytest.approx(steepness(fine), abs=0.05)


def steepness(leaves: Shape) -> float:
    a, b, c = np.moveaxis(leaves.vertices_m[leaves.faces], 1, 0)
    normal: NDArray[np.float64] = np.cross(b - a, c - a)
    return float(np.abs(normal[:, 2]).sum() / np.linalg.norm(normal, axis=1).sum())


def test_leaves_far_apart_keep_their_area_together() -> None:
    sparse = some_cards(4000, size_m=0.002)  # nothing hides anything
    assert card_area_m2(fewer_cards(sparse, 8)) == pytest.approx(card_area_m2(sparse), rel=1e-3)


def test_a_group_becomes_one_card_in_its_middle() -> None:
    leaves = some_cards(64)
    few = fewer_cards(leaves, 16)
    assert len(few.faces) == 2 * 4
    middles = few.vertices_m.reshape(-1, 4, 3).mean(axis=1)
    assert middles.mean(axis=0) == pytest.approx(leaves.vertices_m.mean(axis=0), abs=1e-9)
    assert fewer_cards(leaves, 16).vertices_m.tobytes() == few.vertices_m.tobytes()


def test_fewer_blades_are_as_high_and_as_broad_together() -> None:
    grass = next(part.shape for part in built("grass-lawn-01").parts if part.name == "blades")
    few = fewer_blades(grass, 7, 10)
    assert len(few.faces) == pytest.approx(len(grass.faces) / 10, rel=0.01)
    assert card_area_m2(few) == pytest.approx(card_area_m2(grass), rel=0.05)
    tops = [shape.vertices_m.reshape(-1, 7, 3)[:, 6, 2] for shape in (grass, few)]
    assert tops[1].mean() == pytest.approx(tops[0].mean(), rel=0.05)


def test_levels_stand_in_the_manifest_with_growing_errors() -> None:
    levels = prepare_starter(starter_entry("birch-02")).manifest.levels
    errors = [level.error_m for level in levels]
    assert errors[0] == 0.0
    assert errors == sorted(errors)
    # A piece of a level is never larger than twice what is said to be lost.
    pieces = [level.grain_m for level in built("birch-02").coarser]
    micrometre = 1e-6  # errors are rounded to it
    assert all(error >= grain - micrometre for error, grain in zip(errors[1:], pieces, strict=True))
