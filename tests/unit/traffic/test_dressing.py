"""What dresses streets: parked rows, colours, variety, seasons, hedges, woods; wear on roads and the ground around."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely

from fullwell.traffic.dressing import CAR_PAINTS, STYLES, dress
from fullwell.traffic.networks import NetworkSpec, make_network
from fullwell.traffic.placement import AssetShelf, PlacedAsset
from fullwell.traffic.ribbons import length_m
from fullwell.traffic.roads import RoadNetwork, read_network
from fullwell.traffic.simulation import TrafficDemand
from fullwell.traffic.street import Street, StreetSpec
from fullwell.traffic.surfaces import TERRAIN_MARGIN_M, GroundPlan, RoadSurface, ground_plan, terrain_m
from fullwell.traffic.templates import CrossSection
from fullwell.traffic.wear import far_ground, ground_cover, road_wear
from street_assets import SIZES, make_shelf, manifest

SECTION = CrossSection(lanes=1, parking_width_m=2.2, sidewalk_width_m=3.0)
SEEDS = range(8)
SIGMAS = 4.0
"""Of a binomial or Poisson count; some dozens of counts are looked at."""


@pytest.fixture(scope="module")
def roads() -> tuple[RoadNetwork, GroundPlan]:
    network = read_network(make_network(NetworkSpec("cross", length_m=300.0, section=SECTION), path="network"), path="network")
    return network, ground_plan(network)


@pytest.fixture(scope="module")
def streets(roads: tuple[RoadNetwork, GroundPlan]) -> list[tuple[PlacedAsset, ...]]:
    return [dress(*roads, STYLES["city"], make_shelf(), seed=seed) for seed in SEEDS]


def tagged_shelf() -> AssetShelf:
    """Plants with tags of seasons, and a block of hedge."""
    plants = {
        "tree": [
            ("oak-01", ("summer",)),
            ("maple-01", ("autumn",)),
            ("bare-01", ("winter", "bare")),
            ("pine-01", ("evergreen",)),
        ],
        "bush": [("hedge-01", ("hedge",)), ("shrub-01", ()), ("shrub-02", ("winter",))],
    }
    sizes = {"tree": (6.0, 6.0, 9.0), "bush": (0.76, 1.7, 1.3)}
    by_class = {kind: [manifest(name, kind, (x, y, z)) for name, x, y, z in entries] for kind, entries in SIZES.items()}
    for kind, entries in plants.items():
        by_class[kind] = [replace(manifest(name, kind, sizes[kind]), tags=tags) for name, tags in entries]
    return AssetShelf(by_class)


# Parked cars ---------------------------------------------------------------------------------------------------------


def test_parked_cars_fill_the_share_of_places_that_the_style_says(
    roads: tuple[RoadNetwork, GroundPlan], streets: list[tuple[PlacedAsset, ...]]
) -> None:
    style = STYLES["city"]
    lengths = [length_m(lane.centre_m) - 18.0 for lane in roads[0].of_kind("parking")]
    places = sum(int(length / style.parking_m) for length in lengths) * len(SEEDS)
    parked = sum(item.role == "parked" for street in streets for item in street)
    expected = style.parking_share * places
    assert abs(parked - expected) < SIGMAS * math.sqrt(expected * (1 - style.parking_share))


def test_parked_rows_stand_in_their_lane_and_face_along_it(
    roads: tuple[RoadNetwork, GroundPlan], streets: list[tuple[PlacedAsset, ...]]
) -> None:
    lanes = {lane.id: lane for lane in roads[0].of_kind("parking")}
    for item in (item for street in streets for item in street if item.role == "parked"):
        lane = lanes[item.id.split("/")[1]]
        line = shapely.LineString(lane.centre_m[:, :2])
        assert line.distance(shapely.Point(item.position_m[:2])) < 0.4
        _, direction = lane.at(line.project(shapely.Point(item.position_m[:2])))
        assert item.to_world()[:2, 0] @ direction[:2] > math.cos(0.08)


def test_parked_cars_have_the_colours_of_cars(streets: list[tuple[PlacedAsset, ...]]) -> None:
    parked = [item.paint for street in streets for item in street if item.role == "parked"]
    assert len(parked) > 400
    total = sum(CAR_PAINTS.values())
    for paint, share in CAR_PAINTS.items():
        expected = len(parked) * share / total
        assert abs(Counter(parked)[paint] - expected) < SIGMAS * math.sqrt(expected) + 1


# Variety -------------------------------------------------------------------------------------------------------------


def numbered(items: Sequence[PlacedAsset]) -> list[PlacedAsset]:
    return sorted(items, key=lambda item: int(item.id.rpartition("/")[2]))


@pytest.mark.parametrize("role", ["parked", "building"])
def test_neighbours_in_a_row_are_different_assets(streets: list[tuple[PlacedAsset, ...]], role: str) -> None:
    for street in streets:
        rows: dict[str, list[PlacedAsset]] = {}
        for item in street:
            if item.role == role and item.asset.asset_class != "van":  # there is one van to draw from
                rows.setdefault(item.id.rpartition("/")[0], []).append(item)
        for row in rows.values():
            same = [a.id for a, b in pairwise(numbered(row)) if a.asset.id == b.asset.id and steps(a, b) == 1]
            assert same == []


def steps(first: PlacedAsset, second: PlacedAsset) -> int:
    return int(second.id.rpartition("/")[2]) - int(first.id.rpartition("/")[2])


def test_all_assets_of_a_class_come_up_about_evenly(streets: list[tuple[PlacedAsset, ...]]) -> None:
    cars = Counter(item.asset.id for street in streets for item in street if item.role == "parked")
    counts = [cars[name] for name, *_ in SIZES["car"]]
    assert min(counts) > 0.6 * max(counts)


# Plants --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("season", "drawn"),
    [("summer", {"oak-01", "pine-01"}), ("autumn", {"maple-01", "pine-01"}), ("winter", {"bare-01", "pine-01"})],
)
def test_trees_are_those_of_one_season(roads: tuple[RoadNetwork, GroundPlan], season: str, drawn: set[str]) -> None:
    style = replace(STYLES["suburb"], season=season)
    items = dress(*roads, style, tagged_shelf(), seed=1)
    assert {item.asset.id for item in items if item.asset.asset_class == "tree"} == drawn
    assert ("shrub-02" in {item.asset.id for item in items}) == (season == "winter")


def test_hedges_are_rows_of_three_blocks_or_more_that_meet(roads: tuple[RoadNetwork, GroundPlan]) -> None:
    items = dress(*roads, replace(STYLES["suburb"], building_share=0.0), tagged_shelf(), seed=2)
    rows: dict[str, list[PlacedAsset]] = {}
    for item in items:
        if "hedge" in item.asset.tags:
            rows.setdefault(item.id.rpartition("/")[0], []).append(item)
    assert rows
    for row in rows.values():
        assert len(row) >= 3
        for first, second in pairwise(numbered(row)):
            apart = float(np.linalg.norm(first.position_m - second.position_m))
            assert apart == pytest.approx(first.asset.size_m[1] - 0.12, abs=0.02)
            assert first.yaw_rad == pytest.approx(second.yaw_rad, abs=0.05)


def test_distant_plants_keep_to_their_layers_and_gather_in_woods(roads: tuple[RoadNetwork, GroundPlan]) -> None:
    network, plan = roads
    style = STYLES["rural"]
    items = dress(network, plan, style, make_shelf(), seed=3)
    near = shapely.union_all([plan.carriageway, plan.walk])
    by_layer: dict[int, list[shapely.Point]] = {}
    for item in items:
        if "/layer" in item.id:
            by_layer.setdefault(int(item.id.split("layer")[1].split("/")[0]), []).append(shapely.Point(item.position_m[:2]))
    for layer, points in by_layer.items():
        nearest_m, farthest_m, per_hectare = style.layers[layer]
        distances = shapely.distance(near, np.array(points))
        assert nearest_m < distances.min()
        assert distances.max() <= farthest_m
        ground = near.buffer(farthest_m).area - near.buffer(nearest_m).area
        assert 0.3 * per_hectare < len(points) / (ground / 1e4) < 1.2 * per_hectare
    # More than chance makes of even ground: counts in squares of 50 m vary by more than a Poisson process does.
    places = np.array([(point.x, point.y) for point in by_layer[2]])
    squares = np.histogram2d(*places.T, bins=14)[0].ravel()
    squares = squares[squares > 0]
    assert squares.var() > 1.5 * squares.mean()


# Wear and ground -----------------------------------------------------------------------------------------------------


def area_m2(surface: RoadSurface) -> float:
    a, b, c = np.moveaxis(surface.vertices_m[surface.faces], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_wear_lies_flat_on_the_road_under_its_markings(roads: tuple[RoadNetwork, GroundPlan]) -> None:
    network, plan = roads
    found = road_wear(network, STYLES["city"].surfaces, seed=4)
    assert {surface.material for surface in found} == {"asphalt/new", "metal/cast_iron"}
    for surface in found:
        assert surface.name == "road"
        assert surface.vertices_m[:, 2].min() > 0.0
        assert surface.vertices_m[:, 2].max() < 0.004
        a, b, c = np.moveaxis(surface.vertices_m[surface.faces], 1, 0)
        assert (np.cross(b - a, c - a)[:, 2] >= -1e-9).mean() > 0.98  # a seal that turns sharply may fold
        middles = shapely.points(surface.vertices_m[surface.faces].mean(axis=1)[:, :2])
        assert plan.carriageway.buffer(0.1).contains(middles).all()
    worn = sum(area_m2(surface) for surface in found)
    assert 0.002 < worn / plan.carriageway.area < 0.12


def test_a_film_of_water_hides_repairs_but_no_covers(roads: tuple[RoadNetwork, GroundPlan]) -> None:
    style = replace(STYLES["city"].surfaces, road="asphalt/wet")
    assert {surface.material for surface in road_wear(roads[0], style, seed=4)} == {"metal/cast_iron"}


def test_new_asphalt_has_no_repairs(roads: tuple[RoadNetwork, GroundPlan]) -> None:
    style = STYLES["motorway"].surfaces
    assert style.road == "asphalt/new"
    assert not [surface for surface in road_wear(roads[0], style, seed=4) if surface.material.startswith("asphalt")]


def test_bare_patches_and_fields_keep_off_roads_and_each_other(roads: tuple[RoadNetwork, GroundPlan]) -> None:
    _, plan = roads
    found = ground_cover(plan, STYLES["rural"].surfaces, seed=5)
    near = shapely.union_all([plan.carriageway, plan.walk])
    assert {"grass/meadow", "grass/dry"} <= {surface.material for surface in found}
    for layer, distance_m in (("meadow", 0.3), ("others", 0.5)):
        of_layer = [surface for surface in found if (surface.material == "grass/meadow") == (layer == "meadow")]
        triangles = np.concatenate([surface.vertices_m[surface.faces] for surface in of_layer])
        assert len(triangles) > 200
        polygons = shapely.polygons(triangles[:, :, :2])
        assert shapely.distance(near, polygons).min() > distance_m
        assert shapely.union_all(polygons).area == pytest.approx(shapely.area(polygons).sum(), rel=1e-6)
    assert ground_cover(plan, STYLES["city"].surfaces, seed=5) == []  # paved


def test_ground_goes_on_to_the_horizon_without_a_gap(roads: tuple[RoadNetwork, GroundPlan]) -> None:
    _, plan = roads
    ring = far_ground(plan, STYLES["rural"].surfaces)
    inner = shapely.box(*plan.carriageway.union(plan.walk).bounds).buffer(TERRAIN_MARGIN_M, join_style="mitre")
    shape = shapely.union_all(shapely.polygons(ring.vertices_m[ring.faces][:, :, :2]))
    assert shape.area == pytest.approx(shapely.Polygon(shape.exterior).area - inner.area, rel=1e-9)
    assert shape.exterior.distance(inner.centroid) > 8000.0
    assert ring.vertices_m[:, 2] == pytest.approx(terrain_m(plan))
    a, b, c = np.moveaxis(ring.vertices_m[ring.faces], 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_an_undressed_street_is_new_and_a_dressed_one_the_same_again() -> None:
    def surfaces(**more: object) -> dict[str, bytes]:
        spec = StreetSpec(NetworkSpec("straight", length_m=200.0, section=SECTION), seed=6, **more)  # type: ignore[arg-type]
        return {f"{s.name} {s.material}": s.vertices_m.tobytes() for s in Street(spec, make_shelf()).surfaces}

    assert surfaces() == surfaces()
    assert "road metal/cast_iron" in surfaces()
    assert "road metal/cast_iron" not in surfaces(dressed=False)


def test_motorcycles_in_traffic_have_riders_where_there_are_any() -> None:
    by_class = {kind: [manifest(name, kind, (x, y, z)) for name, x, y, z in entries] for kind, entries in SIZES.items()}
    by_class["motorcycle"].append(replace(manifest("motorcyclist-01", "motorcycle", (2.1, 0.8, 1.8)), tags=("ridden",)))
    demand = TrafficDemand({"motorcycle": 0.3})
    spec = StreetSpec(NetworkSpec("straight", length_m=240.0, section=SECTION), demand, times_s=(30.0,), dressed=False)
    movers = Street(spec, AssetShelf(by_class)).moment(0).assets
    assert {item.asset.id for item in movers} == {"motorcyclist-01"}
    bare = Street(spec, make_shelf()).moment(0).assets
    assert {item.asset.id for item in bare} == {"motorcycle-01"}
