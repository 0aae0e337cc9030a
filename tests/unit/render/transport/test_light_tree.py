"""The tree of lights as built on the host: every light once, bounded by all nodes above it, at most 31 levels deep."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.render.transport.light_tree import LeafBounds, LightTree, build_light_tree

LEAF = 0x80000000
SINGLE_PRECISION = 1e-5


def bounds_of(place: np.ndarray, radius: float = 0.1, intensity: np.ndarray | None = None, seed: int = 0) -> LeafBounds:
    count = len(place)
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=(count, 3))
    return LeafBounds(
        low_m=place - radius,
        high_m=place + radius,
        radius_m=np.full(count, radius),
        axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
        spread_rad=rng.uniform(0, 1, count),
        emission_rad=np.full(count, np.pi / 2),
        intensity=np.ones(count) if intensity is None else intensity,
    )


def walk(tree: LightTree, item: int) -> list[int]:
    """Nodes from the root to the leaf, by the trail."""
    child = tree.nodes[:, 11].copy().view(np.uint32)
    nodes, trail = [0], int(tree.trail[item])
    while not child[nodes[-1]] & LEAF:
        nodes.append(int(child[nodes[-1]]) + (trail & 1))
        trail >>= 1
    assert trail == 0
    return nodes


@pytest.mark.parametrize("count", [1, 2, 3, 7, 100])
def test_each_trail_leads_to_its_own_leaf(count: int) -> None:
    leaf = np.random.default_rng(0).permutation(1000)[:count]
    tree = build_light_tree(bounds_of(np.random.default_rng(1).normal(size=(count, 3))), leaf)
    child = tree.nodes[:, 11].copy().view(np.uint32)
    found = [int(child[walk(tree, item)[-1]]) ^ LEAF for item in range(count)]
    assert found == leaf.tolist()
    assert len(tree.nodes) == 2 * count - 1


def test_every_node_bounds_the_lights_below_it() -> None:
    place = np.random.default_rng(1).normal(size=(200, 3)) * [10, 3, 1]
    bounds = bounds_of(place, intensity=np.random.default_rng(2).exponential(size=200))
    tree = build_light_tree(bounds, np.arange(200))
    total = np.zeros(len(tree.nodes))
    for item in range(200):
        for node in walk(tree, item):
            x, y, z, squared, *axis, _, cosine, _, _ = tree.nodes[node, :11]
            assert np.linalg.norm(place[item] - [x, y, z]) + 0.1 <= np.sqrt(squared) * (1 + SINGLE_PRECISION)
            angle = np.arccos(np.clip(np.dot(axis, bounds.axis[item]), -1, 1)) + bounds.spread_rad[item]
            assert min(angle, np.pi) <= np.arccos(max(cosine, -1.0)) + 1e-3
            total[node] += bounds.intensity[item]
    assert tree.nodes[:, 7] == pytest.approx(total, rel=SINGLE_PRECISION)


def test_far_groups_are_parted_first() -> None:
    place = np.concatenate([np.random.default_rng(0).normal(size=(20, 3)), np.random.default_rng(1).normal(size=(5, 3)) + 100])
    tree = build_light_tree(bounds_of(place), np.arange(25))
    first = tree.trail & 1
    assert np.ptp(first[:20]) == 0
    assert np.ptp(first[20:]) == 0
    assert first[0] != first[20]


@pytest.mark.parametrize("kind", ["one place", "geometric line", "powers of ten"])
def test_no_leaf_is_deeper_than_31(kind: str) -> None:
    """Lights that a greedy split would peel off one by one."""
    count = 600
    place, intensity = np.zeros((count, 3)), np.ones(count)
    if kind == "geometric line":
        place[:, 0] = 2.0 ** (np.arange(count) / 10) * 1e-10
    if kind == "powers of ten":
        place[:, 0] = np.arange(count)
        intensity = 10.0 ** -np.arange(count, dtype=float).clip(0, 300)
    tree = build_light_tree(bounds_of(place, 0.0, intensity), np.arange(count))
    assert max(len(walk(tree, item)) for item in range(count)) <= 32
    assert tree.depth <= 31


def test_a_chain_of_lamps_is_balanced_where_the_depth_runs_out() -> None:
    count = 2**12
    place = np.zeros((count, 3))
    place[:, 0] = 1.01 ** np.arange(count)
    tree = build_light_tree(bounds_of(place, 0.0, 0.9 ** np.arange(count)), np.arange(count))
    assert tree.depth <= 31
