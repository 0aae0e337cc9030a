"""Vehicles of the starter library: true sizes, closed skins, lamps that shine outwards, wheels in their arches."""

from __future__ import annotations

import time
from collections import Counter
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from fullwell.assets.classes import size_problems
from fullwell.assets.materials.catalogue import asset_material_names
from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.two_wheelers import BICYCLE_KINDS, bicycle_shape
from fullwell.assets.starter.vehicles import VEHICLES

pytestmark = pytest.mark.slow  # forty vehicles are built

Array = NDArray[np.float64]

ALL = tuple(entry.id for entry in VEHICLES)
CARS = tuple(entry.id for entry in VEHICLES if entry.id.startswith(("sedan", "hatchback", "estate", "suv")))
ROAD_LIT = tuple(name for name in ALL if not name.startswith(("trailer", "bicycle")))

SURFACE_TOLERANCE_M = 1e-3
"""Tyres stand on the road to within a millimetre: their treads are polygons."""

RAYS = 72
FACES_PER_CHUNK = 4_000


@cache
def built(name: str) -> BuiltAsset:
    return next(entry for entry in VEHICLES if entry.id == name).build()


def points_of(asset: BuiltAsset) -> Array:
    return np.concatenate([part.shape.vertices_m for part in asset.parts])


def part_points(asset: BuiltAsset, name: str) -> Array:
    return next(part.shape.vertices_m for part in asset.parts if part.name == name)


def face_vectors(part_vertices: Array, faces: NDArray[np.int64]) -> Array:
    corners = part_vertices[faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2


def first_hits(triangles: Array, origins: Array, directions: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return distance to the nearest triangle (inf: none) and its index, by Moller and Trumbore's test."""
    nearest = np.full(len(origins), np.inf)
    which = np.full(len(origins), -1)
    for start in range(0, len(triangles), FACES_PER_CHUNK):
        a, b, c = np.moveaxis(triangles[start : start + FACES_PER_CHUNK], 1, 0)
        edge1, edge2 = b - a, c - a
        p = np.cross(directions[:, None], edge2[None])
        scale = (edge1[None] * p).sum(axis=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / scale
            s = origins[:, None] - a[None]
            u = (s * p).sum(axis=2) * inverse
            q = np.cross(s, edge1[None])
            v = (directions[:, None] * q).sum(axis=2) * inverse
            t = (edge2[None] * q).sum(axis=2) * inverse
        t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
        best = t.argmin(axis=1)
        distance = t[np.arange(len(t)), best]
        closer = distance < nearest
        nearest[closer], which[closer] = distance[closer], best[closer] + start
    return nearest, which


def test_there_are_enough_vehicles_of_each_kind() -> None:
    counts = Counter(name.rsplit("-", 1)[0] for name in ALL)
    wanted = {"sedan": 3, "hatchback": 3, "estate": 3, "suv": 3, "van": 2, "ambulance": 1}
    wanted |= {"lorry": 4, "trailer": 3, "bus": 3, "tram": 1, "motorcycle": 3, "bicycle": 3}
    assert len(ALL) >= 32
    assert all(counts[name] >= least for name, least in wanted.items())


@pytest.mark.parametrize("name", CARS)
def test_the_first_tag_of_a_car_says_its_build(name: str) -> None:
    assert built(name).asset_class == "car"
    assert built(name).tags[0] == name.rsplit("-", 1)[0]


def test_ids_are_unique() -> None:
    assert len(set(ALL)) == len(ALL)


@pytest.mark.parametrize("name", ALL)
def test_its_size_is_plausible_for_its_class(name: str) -> None:
    asset = built(name)
    size = np.ptp(points_of(asset), axis=0)
    assert size_problems(asset.asset_class, asset.tags, (size[0], size[1], size[2])) == ()


@pytest.mark.parametrize("name", ALL)
def test_it_stands_on_the_road(name: str) -> None:
    assert points_of(built(name))[:, 2].min() == pytest.approx(0.0, abs=SURFACE_TOLERANCE_M)


@pytest.mark.parametrize("name", ALL)
def test_all_materials_are_of_the_catalogue(name: str) -> None:
    assert {part.material for part in built(name).parts} <= set(asset_material_names())


@pytest.mark.parametrize("name", ALL)
def test_numbers_are_finite_and_normals_are_unit_vectors(name: str) -> None:
    for part in built(name).parts:
        assert np.isfinite(part.shape.vertices_m).all()
        assert part.shape.faces.min() >= 0
        assert part.shape.faces.max() < len(part.shape.vertices_m)
        if part.shape.normals is not None:
            used = part.shape.normals[np.unique(part.shape.faces)]
            assert np.linalg.norm(used, axis=1) == pytest.approx(1.0, abs=1e-6), part.name


@pytest.mark.parametrize("name", ALL)
def test_shading_normals_are_on_the_side_of_their_faces(name: str) -> None:
    """A shading normal that points away from its face turns a lit surface black."""
    for part in built(name).parts:
        if part.shape.normals is None:
            continue
        vectors = face_vectors(part.shape.vertices_m, part.shape.faces)
        area = np.linalg.norm(vectors, axis=1)
        agreement = (part.shape.normals[part.shape.faces].mean(axis=1) * vectors).sum(axis=1)
        assert area[agreement < 0].sum() <= 0.002 * area.sum(), part.name


@pytest.mark.parametrize("name", CARS)
def test_a_car_is_its_own_mirror_image_but_for_the_plate(name: str) -> None:
    for part in built(name).parts:
        if part.name == "plate_text" or part.name.endswith(("_left", "_right")):
            continue
        rows = np.round(part.shape.vertices_m, 5) + 0.0
        mirrored = np.round(part.shape.vertices_m * np.array([1.0, -1.0, 1.0]), 5) + 0.0
        assert {tuple(row) for row in rows} == {tuple(row) for row in mirrored}, part.name


@pytest.mark.parametrize("name", CARS)
def test_left_and_right_parts_of_a_car_mirror_each_other(name: str) -> None:
    parts = {part.name: part.shape for part in built(name).parts}
    lefts = [part for part in parts if part.endswith("_left")]
    assert len(lefts) >= 12
    for part in lefts:
        other = parts[part.removesuffix("_left") + "_right"]
        assert np.allclose(parts[part].vertices_m * np.array([1.0, -1.0, 1.0]), other.vertices_m, atol=1e-9)


@pytest.mark.parametrize("name", CARS)
def test_the_proportions_of_a_car_agree_with_its_attributes(name: str) -> None:
    asset = built(name)
    front, rear = part_points(asset, "tyre_front_left"), part_points(asset, "tyre_rear_left")
    bumper = points_of(asset)[:, 0].max()
    numbers = {key: float(value) for key, value in asset.attributes.items() if not isinstance(value, str)}
    middle = front.mean(axis=0)[0]
    assert middle - rear.mean(axis=0)[0] == pytest.approx(numbers["wheelbase_m"], abs=0.002)
    assert bumper - middle == pytest.approx(numbers["front_overhang_m"], abs=0.02)
    assert np.ptp(front[:, 2]) == pytest.approx(2 * numbers["wheel_radius_m"], abs=0.003)
    assert 2 * (front[:, 1].max() + front[:, 1].min()) / 2 == pytest.approx(numbers["track_m"], abs=0.002)
    assert 0.52 < numbers["wheelbase_m"] / np.ptp(points_of(asset)[:, 0]) < 0.70


@pytest.mark.parametrize("name", CARS)
def test_wheels_stand_in_their_arches(name: str) -> None:
    """Outer walls lie within the body's width, and no skin comes nearer to the axle than the tyre does."""
    asset = built(name)
    skin = np.concatenate([part.shape.vertices_m for part in asset.parts if part.name in ("body", "trim", "seams")])
    for place in ("front", "rear"):
        tyre = part_points(asset, f"tyre_{place}_left")
        middle = (tyre.max(axis=0) + tyre.min(axis=0)) / 2
        radius = np.ptp(tyre[:, 2]) / 2
        assert tyre[:, 1].max() < float(asset.attributes["body_width_m"]) / 2 - 0.01
        beside = skin[skin[:, 1] > tyre[:, 1].min()]
        gap = np.hypot(beside[:, 0] - middle[0], beside[:, 2] - middle[2]).min() - radius
        assert 0.02 < gap < 0.12


@pytest.mark.parametrize("name", ALL)
def test_lamps_shine_outwards(name: str) -> None:
    """A surface emits on the side of its normal: forward in front, backward behind, and away from the middle."""
    for part in built(name).parts:
        if not part.material.startswith("lamp/"):
            continue
        total = face_vectors(part.shape.vertices_m, part.shape.faces).sum(axis=0)
        direction = total / np.linalg.norm(total)
        centre = part.shape.vertices_m.mean(axis=0)
        assert direction[0] * np.sign(centre[0]) > 0.3, part.name
        assert direction @ (centre - np.array([0.0, 0.0, 0.6])) > 0, part.name


@pytest.mark.parametrize("name", ROAD_LIT)
def test_it_has_the_lamps_and_plates_that_traffic_rules_ask_for(name: str) -> None:
    names = {part.name for part in built(name).parts}
    stems = {part.removesuffix("_left").removesuffix("_right") for part in names}
    wanted = {"headlight", "taillight", "brakelight", "indicator_front"}
    assert wanted <= stems
    if not name.startswith("tram"):
        assert "plate_rear" in names
        assert "indicator_rear" in stems
    if not name.startswith(("tram", "motorcycle")):
        assert {"plate_front", "reverselight_left", "drl_left", "mirror_glass_left"} <= names


@pytest.mark.parametrize("name", [*CARS, "van-01", "van-02", "ambulance-01"])
def test_a_car_has_windows_and_named_wheels(name: str) -> None:
    names = {part.name for part in built(name).parts}
    assert {"window_windscreen", "window_side_left", "window_side_right", "window_rear"} <= names
    assert {
        f"{part}_{place}_{side}" for part in ("tyre", "rim") for place in ("front", "rear") for side in ("left", "right")
    } <= names
    assert any(part.paintable and part.name == "body" for part in built(name).parts)


@pytest.mark.parametrize(
    "name", ["sedan-01", "hatchback-04", "suv-03", "van-02", "lorry-03", "bus-01", "tram-01", "trailer-01"]
)
def test_one_cannot_look_inside(name: str) -> None:
    """Rays from all around and above towards points within always meet a front face first: skins are closed from outside."""
    asset = built(name)
    triangles = np.concatenate([part.shape.vertices_m[part.shape.faces] for part in asset.parts])
    rng = np.random.Generator(np.random.Philox(7))
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    targets = low + (high - low) * rng.uniform([0.05, 0.2, 0.1], [0.95, 0.8, 0.9], (RAYS, 3))
    turn, rise = rng.uniform(0, 2 * np.pi, RAYS), rng.uniform(0.02, 0.9, RAYS)
    away = np.stack([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)], axis=1)
    distance, index = first_hits(triangles, targets + 40.0 * away, -away)
    hit = np.isfinite(distance)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[index]
    owners = np.repeat([part.name for part in asset.parts], [len(part.shape.faces) for part in asset.parts])
    behind = hit & ((normals * -away).sum(axis=1) > 0)
    assert hit.mean() > 0.5
    assert not behind.any(), sorted(set(owners[index[behind]]))


@pytest.mark.parametrize("name", ["sedan-02", "lorry-02", "bus-02", "motorcycle-01", "bicycle-02"])
def test_the_same_seed_gives_the_same_bytes(name: str) -> None:
    entry = next(entry for entry in VEHICLES if entry.id == name)
    first, second = built(name), entry.build()
    for one, other in zip(first.parts, second.parts, strict=True):
        assert one.name == other.name
        assert one.shape.vertices_m.tobytes() == other.shape.vertices_m.tobytes()
        assert one.shape.faces.tobytes() == other.shape.faces.tobytes()


def test_another_seed_gives_another_plate_and_nothing_else() -> None:
    entry = next(entry for entry in VEHICLES if entry.id == "hatchback-01")
    other = entry.make(np.random.Generator(np.random.Philox(entry.seed + 1)), **entry.parameters)
    changed = {
        one.name
        for one, two in zip(built("hatchback-01").parts, other.parts, strict=True)
        if one.shape.vertices_m.tobytes() != two.shape.vertices_m.tobytes()
    }
    assert changed == {"plate_text"}


@pytest.mark.parametrize("name", ALL)
def test_triangle_counts_are_within_bounds(name: str) -> None:
    count = sum(len(part.shape.faces) for part in built(name).parts)
    assert 5_000 < count < 100_000
    if name in CARS:
        assert 30_000 < count < 65_000


def test_building_does_not_hang() -> None:
    """A sanity limit: a second or so of processor time is usual."""
    start = time.process_time()
    next(entry for entry in VEHICLES if entry.id == "bus-03").build()
    assert time.process_time() - start < 20.0


@pytest.mark.parametrize("kind", BICYCLE_KINDS)
def test_a_rider_finds_saddle_grips_and_pedals(kind: str) -> None:
    made = bicycle_shape(kind)  # type: ignore[arg-type]
    parts = {part.name: part.shape.vertices_m for part in made.parts}
    saddle, grips, pedals = parts["bicycle_saddle"], parts["bicycle_grips"], parts["bicycle_pedals"]
    assert saddle[:, 2].max() == pytest.approx(made.saddle_m[2], abs=0.03)
    assert saddle[:, 0].min() < made.saddle_m[0] < saddle[:, 0].max()
    for place, cloud in (
        (made.grips_m[0], grips),
        (made.grips_m[1], grips),
        (made.pedals_m[0], pedals),
        (made.pedals_m[1], pedals),
    ):
        assert np.linalg.norm(cloud - np.array(place), axis=1).min() < 0.08
    assert 0.6 < made.saddle_m[2] - made.bottom_bracket_m[2] < 0.75
    assert made.grips_m[0][0] > made.saddle_m[0] + 0.3
