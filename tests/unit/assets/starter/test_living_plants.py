"""Trees and plants: Leonardo's rule at forks, leaves in the crown, leaf area as told."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fullwell.assets.starter.branching import Wood, bark, cards, colonised
from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.plants import grass_patch
from fullwell.assets.starter.shapes import Shape
from fullwell.assets.starter.trees import TREES

LEAFY = [entry.id for entry in TREES if "winter" not in entry.id]


@cache
def built(entry_id: str) -> BuiltAsset:
    return next(entry for entry in TREES if entry.id == entry_id).build()


def area_m2(shape: Shape) -> float:
    a, b, c = np.moveaxis(shape.vertices_m[shape.faces], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def rng() -> np.random.Generator:
    return np.random.Generator(np.random.Philox(5))


def small_tree() -> Wood:
    cloud = rng().normal(size=(300, 3)) * 0.8 + [0, 0, 3.0]
    stem = np.column_stack([np.zeros((8, 2)), np.linspace(0, 1.4, 8)])
    return colonised(stem, cloud, step_m=0.15, reach_m=2.0, kill_m=0.25, pull=np.zeros(3))


def test_a_skeleton_is_one_tree_of_even_segments() -> None:
    wood = small_tree()
    assert (wood.parent[1:] < np.arange(1, len(wood.parent))).all()
    assert (wood.parent[1:] >= 0).all()
    grown = np.arange(8, len(wood.parent))
    length = np.linalg.norm(wood.nodes_m[grown] - wood.nodes_m[wood.parent[grown]], axis=1)
    assert np.allclose(length, 0.15)


def test_a_skeleton_comes_near_most_of_the_points_that_draw_it() -> None:
    cloud = rng().normal(size=(300, 3)) * 0.8 + [0, 0, 3.0]
    nodes = small_tree().nodes_m
    nearest = np.linalg.norm(cloud[:, None] - nodes[None], axis=2).min(axis=1)
    assert (nearest < 0.26).mean() > 0.9


def test_radii_follow_leonardo_at_every_fork() -> None:
    wood = small_tree().thickened(0.08, 0.004)
    tips = len(wood.tips())
    exponent = np.log(tips) / np.log(0.08 / 0.004)
    assert 1.5 < exponent < 3.0  # else it would have been clipped
    power = wood.radius_m**exponent
    above = np.bincount(wood.parent[1:], power[1:], minlength=len(power))
    inner = above > 0
    assert np.allclose(above[inner], power[inner], rtol=1e-6)
    assert wood.radius_m[0] == pytest.approx(0.08)


def test_bark_is_as_thick_as_the_branch() -> None:
    straight = Wood(np.array([[0, 0, z] for z in (0.0, 0.5, 1.0, 1.5)]), np.array([-1, 0, 1, 2]), np.full(4, 0.1))
    trunk, branches = bark(straight, thick_m=0.05)
    around = trunk.vertices_m[trunk.vertices_m[:, 2] < 1.2]
    assert np.allclose(np.hypot(around[:, 0], around[:, 1]), 0.1, atol=1e-9)
    assert len(branches.faces) == 0
    a, b, c = np.moveaxis(trunk.vertices_m[trunk.faces], 1, 0)
    outward = (np.cross(b - a, c - a) * ((a + b + c) / 3 * [1, 1, 0])).sum(axis=1)
    assert (outward > 0).all()


def test_a_leaf_has_the_length_and_about_the_area_of_its_kite() -> None:
    leaf = cards(
        np.zeros((1, 3)), np.array([[1.0, 0, 0]]), np.array([[0.0, 0, 1]]), np.array([0.10]), np.array([0.06]), fold=0.0
    )
    assert np.ptp(leaf.vertices_m[:, 0]) == pytest.approx(0.10)
    assert area_m2(leaf) == pytest.approx(0.5 * 0.10 * 0.06, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("entry_id", LEAFY)
def test_leaves_fill_the_crown_with_a_plausible_area(entry_id: str) -> None:
    tree = built(entry_id)
    leaves = next(part.shape for part in tree.parts if part.name == "leaves")
    assert area_m2(leaves) == pytest.approx(float(tree.attributes["leaf_area_m2"]), rel=0.01)
    # Breda 2003: stands 2 to 6; conifers and columns hold more over the little ground that they cover.
    assert 2.0 <= float(tree.attributes["leaf_area_index"]) <= (13.0 if {"conifer", "columnar"} & set(tree.tags) else 7.0)
    reach = np.hypot(leaves.vertices_m[:, 0], leaves.vertices_m[:, 1])
    assert reach.max() <= 1.35 * float(tree.attributes["crown_radius_m"])
    assert leaves.vertices_m[:, 2].min() > 0.0


@pytest.mark.parametrize("entry_id", [entry.id for entry in TREES])
def test_a_trunk_is_as_thick_as_told_at_breast_height(entry_id: str) -> None:
    tree = built(entry_id)
    trunk = next(part.shape for part in tree.parts if part.name == "trunk").vertices_m
    told = float(tree.attributes["trunk_radius_m"])
    at = trunk[(trunk[:, 2] > 0.4) & (trunk[:, 2] < 1.4)]
    radius = np.linalg.norm(at[:, :2] - at[:, :2].mean(axis=0), axis=1)
    assert 0.65 * told <= np.median(radius) <= 1.45 * told


def test_a_winter_tree_has_no_leaves_but_many_twigs() -> None:
    tree = built("winter-tree-01")
    assert [part.name for part in tree.parts] == ["trunk", "branches"]
    assert len(tree.parts[1].shape.faces) > 20_000


def test_heights_are_those_asked_for() -> None:
    for entry in TREES:
        asked = entry.parameters["height_m"]
        assert float(built(entry.id).attributes["height_m"]) == pytest.approx(asked, rel=0.03)


def test_grass_has_its_blades_rooted_in_its_patch() -> None:
    patch = grass_patch(rng(), size_m=(1.0, 0.5), height_m=0.1, blades=500, dry=0.2)
    blades = sum(len(part.shape.faces) for part in patch.parts) // 5
    assert blades == 500
    roots = np.concatenate([part.shape.vertices_m for part in patch.parts])
    roots = roots[roots[:, 2] == 0.0]
    assert np.abs(roots[:, 0]).max() < 0.55
    assert np.abs(roots[:, 1]).max() < 0.30
    assert 0.08 < max(float(part.shape.vertices_m[:, 2].max()) for part in patch.parts) < 0.14
