"""People, animals and plants of the starter library as assets: sizes, ground, materials, closed skins, the same bytes again."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest

from fullwell.assets.classes import size_problems
from fullwell.assets.materials.catalogue import asset_material_names
from fullwell.assets.records import check_asset_id, check_tags
from fullwell.assets.starter.building import BuiltAsset, StarterEntry
from fullwell.assets.starter.living import LIVING
from fullwell.assets.starter.shapes import Shape

pytestmark = pytest.mark.slow  # fifty bodies and plants are built

GROUND_M = 1e-9
TRIANGLES = {
    "pedestrian": (25_000, 110_000),
    "cyclist": (30_000, 140_000),
    "motorcycle": (30_000, 140_000),
    "deer": (20_000, 80_000),
    "dog": (8_000, 50_000),
    "tree": (12_000, 65_000),
    "bush": (5_000, 60_000),
    "grass": (10_000, 50_000),
    "rock": (5_000, 25_000),
}
"""What a finest level may hold; coarser ones are made from it."""

CLOSED = ("skin", "top", "trousers", "shorts", "skirt", "tights", "vest", "hair", "coat", "rock", "headscarf")
"""Parts that are skins of bodies: no light gets in."""

BODIES = [
    entry
    for entry in LIVING
    if entry.id.startswith(("woman", "man", "elderly", "girl", "boy", "toddler", "teen", "cyclist", "deer", "dog", "rock"))
]


@cache
def built(entry_id: str) -> BuiltAsset:
    return entry_named(entry_id).build()


def entry_named(entry_id: str) -> StarterEntry:
    return next(entry for entry in LIVING if entry.id == entry_id)


def points_of(asset: BuiltAsset) -> np.ndarray:
    return np.concatenate([part.shape.vertices_m for part in asset.parts])


def ids(entries: list[StarterEntry] | tuple[StarterEntry, ...]) -> list[str]:
    return [entry.id for entry in entries]


@pytest.mark.parametrize("entry_id", ids(LIVING))
def test_an_asset_is_of_plausible_size_and_stands_on_the_ground(entry_id: str) -> None:
    asset = built(entry_id)
    points = points_of(asset)
    size = tuple(float(value) for value in np.ptp(points, axis=0))
    assert size_problems(asset.asset_class, asset.tags, (size[0], size[1], size[2])) == ()
    assert abs(points[:, 2].min()) < GROUND_M
    low, high = TRIANGLES[asset.asset_class]
    assert low <= sum(len(part.shape.faces) for part in asset.parts) <= high


@pytest.mark.parametrize("entry_id", ids(LIVING))
def test_parts_are_sound_triangles_of_known_materials(entry_id: str) -> None:
    entry, asset = entry_named(entry_id), built(entry_id)
    check_asset_id(entry.id)
    assert check_tags(asset.tags)
    json.dumps(entry.parameters)
    for part in asset.parts:
        shape = part.shape
        assert part.material in asset_material_names(), part.name
        assert np.isfinite(shape.vertices_m).all()
        assert shape.faces.min() >= 0
        assert shape.faces.max() < len(shape.vertices_m)
        if shape.normals is not None and not part.name.startswith("bicycle_"):  # those are tested with the bicycles
            assert np.allclose(np.linalg.norm(shape.normals, axis=1), 1.0, atol=1e-6), part.name


@pytest.mark.parametrize("entry_id", ids(BODIES))
def test_skins_are_closed_and_face_outwards(entry_id: str) -> None:
    checked = 0
    for part in built(entry_id).parts:
        if part.name in CLOSED:
            assert unmatched_edges(part.shape) == 0, part.name
            assert volume_m3(part.shape) > 0, part.name
            checked += 1
    assert checked


def unmatched_edges(shape: Shape) -> int:
    """Directed edges without as many of the opposite direction."""
    edges = np.concatenate([shape.faces[:, [0, 1]], shape.faces[:, [1, 2]], shape.faces[:, [2, 0]]])
    size = len(shape.vertices_m)
    there, there_count = np.unique(edges[:, 0] * size + edges[:, 1], return_counts=True)
    back, back_count = np.unique(edges[:, 1] * size + edges[:, 0], return_counts=True)
    if len(there) != len(back) or (there != back).any():
        return len(np.setdiff1d(there, back))
    return int((there_count != back_count).sum())


def volume_m3(shape: Shape) -> float:
    a, b, c = np.moveaxis(shape.vertices_m[shape.faces], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    "entry_id",
    [
        "woman-walking-01",
        "man-running-01",
        "deer-stag-01",
        "dog-terrier-01",
        "oak-01",
        "spruce-01",
        "hedge-01",
        "rock-granite-01",
    ],
)
def test_the_same_seed_gives_the_same_bytes(entry_id: str) -> None:
    first, second = built(entry_id), entry_named(entry_id).build()
    for one, other in zip(first.parts, second.parts, strict=True):
        assert one.name == other.name
        assert one.shape.vertices_m.tobytes() == other.shape.vertices_m.tobytes()
        assert one.shape.faces.tobytes() == other.shape.faces.tobytes()


@pytest.mark.parametrize("entry_id", ["woman-walking-02", "oak-01", "shrub-round-01", "grass-meadow-01"])
def test_another_seed_gives_another_individual(entry_id: str) -> None:
    entry = entry_named(entry_id)
    other = StarterEntry(entry.id, entry.title, entry.make, entry.parameters, entry.seed + 1).build()
    first = points_of(built(entry_id))
    second = points_of(other)
    assert first.shape != second.shape or not np.allclose(first, second, atol=1e-3)


def test_the_library_has_the_kinds_that_streets_need() -> None:
    assert len(set(ids(LIVING))) == len(LIVING)
    classes = [built(entry.id).asset_class for entry in LIVING]
    for kind, least in (
        ("pedestrian", 14),
        ("cyclist", 3),
        ("deer", 2),
        ("dog", 2),
        ("tree", 9),
        ("bush", 4),
        ("grass", 3),
        ("rock", 2),
    ):
        assert classes.count(kind) >= least
    children = [entry for entry in LIVING if "child" in built(entry.id).tags]
    assert len(children) >= 3
