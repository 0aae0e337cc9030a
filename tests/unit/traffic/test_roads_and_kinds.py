"""What roads hold and who uses it: every lane in every layout, rails and trams, bus stops, presets, driving on the left."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import shapely

from fullwell.traffic.demand import JUNCTION_SHARES, LEVELS, PRESETS, preset
from fullwell.traffic.networks import GENERATED_NAMES, NetworkSpec, make_network
from fullwell.traffic.placement import AssetShelf
from fullwell.traffic.roads import RoadNetwork, read_network
from fullwell.traffic.simulation import TrafficDemand, VehicleModel, simulate
from fullwell.traffic.stops import bus_stops
from fullwell.traffic.street import Street, StreetSpec
from fullwell.traffic.sumo import TrafficError
from fullwell.traffic.surfaces import RoadStyle, ground_plan, road_surfaces
from fullwell.traffic.templates import CrossSection
from fullwell.traffic.trajectories import Mover, TrafficKind
from street_assets import SIZES, make_shelf, manifest

ALL_LANES = CrossSection(2, 3.2, 2.5, 2.2, bike_lane_width_m=1.6, bus_lane_width_m=3.3, tram_lane_width_m=3.4)
WITH_TRAMS = CrossSection(tram_lane_width_m=3.4)
TRAM = VehicleModel("tram-01", "tram", 30.0, 2.4, 3.5)
CAR = VehicleModel("sedan-01", "car", 4.7, 1.9)
GAUGE_M = 1.435

OSM_WITH_TRAM = """<?xml version="1.0"?><osm version="0.6">
<node id="1" lat="48.1370" lon="11.5750"/><node id="2" lat="48.1370" lon="11.5790"/>
<node id="3" lat="48.1372" lon="11.5750"/><node id="4" lat="48.1372" lon="11.5790"/>
<way id="10"><nd ref="1"/><nd ref="2"/><tag k="highway" v="residential"/></way>
<way id="11"><nd ref="3"/><nd ref="4"/><tag k="railway" v="tram"/></way></osm>"""


def network_of(layout: str, section: CrossSection = WITH_TRAMS) -> RoadNetwork:
    return read_network(make_network(NetworkSpec(layout, section=section, length_m=300.0, size=(3, 3))))


def movers_of(network: RoadNetwork, demand: TrafficDemand, models: Sequence[VehicleModel], time_s: float = 40.0) -> list[Mover]:
    return list(simulate(network, demand, models, seed=2, times_s=[time_s]).frames[0].movers)


@pytest.mark.parametrize("layout", ["grid", "spider", "random", "straight", "cross"])
def test_every_layout_has_the_whole_cross_section(layout: str) -> None:
    spec = NetworkSpec(layout, section=ALL_LANES, length_m=160.0, size=(12, 0) if layout == "random" else (3, 2))
    network = read_network(make_network(spec))
    by_edge: dict[str, list[tuple[int, str, float]]] = {}
    for lane in network.lanes:
        if lane.kind not in ("internal", "crossing", "walking_area"):
            by_edge.setdefault(lane.edge_id, []).append((lane.index, lane.kind, lane.width_m))
    wanted = [("sidewalk", 2.5), ("parking", 2.2), ("bike", 1.6), ("bus", 3.3), ("drive", 3.2), ("drive", 3.2), ("rail", 3.4)]
    assert all([(kind, width) for _, kind, width in sorted(lanes)] == wanted for lanes in by_edge.values())
    assert bool(network.signals) == (layout != "straight")


def test_rails_lie_in_gauge_on_tram_lanes_and_through_junctions() -> None:
    network = network_of("cross")
    rails = [surface for surface in road_surfaces(network, ground_plan(network), RoadStyle()) if surface.name == "rail"]
    (surface,) = rails
    covered = shapely.union_all([shapely.Polygon(surface.vertices_m[face, :2]) for face in surface.faces])
    lane = next(lane for lane in network.of_kind("rail") if lane.length_m > 50)
    point, direction = lane.at(30.0)
    aside = np.array([-direction[1], direction[0]])
    for offset_m, on_rail in ((GAUGE_M / 2 - 0.01, False), (GAUGE_M / 2 + 0.02, True), (GAUGE_M / 2 + 0.07, False)):
        for side in (-1, 1):
            place = shapely.Point(point[:2] + side * offset_m * aside)
            assert covered.covers(place) == on_rail
    middle = next(junction for junction in network.junctions if junction.id == "centre")
    assert shapely.Polygon(middle.outline_m[:, :2]).intersection(covered).area > 1.0
    assert not [s for s in road_surfaces(*plain("cross"), RoadStyle()) if s.name == "rail"]


def plain(layout: str):  # type: ignore[no-untyped-def]
    network = network_of(layout, CrossSection())
    return network, ground_plan(network)


@pytest.mark.parametrize("layout", ["straight", "blocks"])
def test_trams_keep_to_their_lanes_and_cars_off_them(layout: str) -> None:
    network = network_of(layout)
    movers = movers_of(network, TrafficDemand({"tram": 0.1, "car": 0.3}, {"car": 10.0}), [TRAM, CAR])
    kinds = {lane.id: lane for lane in network.lanes}
    trams = [mover for mover in movers if mover.kind == "tram"]
    assert trams
    assert all(kinds[mover.lane].has_rails for mover in trams)
    cars = [mover for mover in movers if mover.kind == "car"]
    assert cars
    assert not any(kinds[mover.lane].kind == "rail" for mover in cars)


def test_trams_of_openstreetmap_run_on_their_tracks(tmp_path: Path) -> None:
    (tmp_path / "tram.osm").write_text(OSM_WITH_TRAM)
    network = read_network(make_network(NetworkSpec(file=tmp_path / "tram.osm")))
    assert network.of_kind("rail")
    assert all(lane.has_rails for lane in network.of_kind("rail"))
    trams = movers_of(network, TrafficDemand({"tram": 0.1}, {"tram": 4.0}), [TRAM], 20.0)
    assert trams
    assert all(network.lane(mover.lane).kind == "rail" for mover in trams)


def test_a_network_without_tracks_refuses_trams() -> None:
    with pytest.raises(TrafficError, match="the network has no lane for a tram"):
        movers_of(network_of("roundabout"), TrafficDemand({"tram": 0.1}), [TRAM])


def test_movers_on_their_way_out_leave_and_do_not_turn_back() -> None:
    network = network_of("straight", CrossSection())
    run = simulate(network, TrafficDemand({"car": 0.5}), [CAR], seed=1, times_s=[float(time) for time in range(10, 60, 5)])
    edges: dict[str, set[str]] = {}
    for frame in run.frames:
        for mover in frame.movers:
            edges.setdefault(mover.id, set()).add(mover.lane.rpartition("_")[0])
    assert all(len(seen) == 1 for seen in edges.values())


# Buses ---------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def street() -> Street:
    times = tuple(float(time) for time in range(20, 90, 2))
    section = CrossSection(sidewalk_width_m=3.5)
    spec = StreetSpec(NetworkSpec("blocks", length_m=300, section=section), TrafficDemand({"bus": 0.12}), times_s=times, seed=2)
    return Street(spec, make_shelf())


def test_buses_stand_at_stops_and_nowhere_else_for_long(street: Street) -> None:
    stops = {stop.lane_id: stop for stop in bus_stops(street.network, seed=2)}
    assert stops
    calls = Counter(
        mover.id
        for frame in street.run.frames
        for mover in frame.movers
        if mover.kind == "bus" and mover.speed_m_s < 0.1 and mover.lane in stops
        and stops[mover.lane].start_m <= mover.position_m <= stops[mover.lane].end_m + 0.5
    )  # fmt: skip
    assert sum(number >= 4 for number in calls.values()) >= 2, "a stop takes 10 to 25 s"


def test_shelters_stand_at_stops_only_on_the_pavement_facing_the_road(street: Street) -> None:
    shelters = [item for item in street.standing if item.asset.asset_class == "bus_stop"]
    stops = {f"bus_stop/{stop.edge_id}": stop for stop in bus_stops(street.network, seed=2)}
    assert shelters
    assert {item.id for item in shelters} <= set(stops)
    for item in shelters:
        stop = stops[item.id]
        point, direction = street.network.lane(stop.lane_id).at(stop.end_m)
        behind = (point - item.position_m) @ direction
        assert 0 < behind < 8
        assert street.plan.walk.buffer(0.05).contains(item.outline())
        assert np.array([np.cos(item.yaw_rad), np.sin(item.yaw_rad)]) @ [-direction[1], direction[0]] == pytest.approx(1)
    others = shapely.union_all([item.outline() for item in street.standing if item.role in ("building", "furniture", "light")])
    assert others.area == pytest.approx(
        sum(item.outline().area for item in street.standing if item.role in ("building", "furniture", "light")), rel=1e-3
    )


def test_the_dressing_moves_no_bus(street: Street) -> None:
    spec = StreetSpec(street.spec.network, street.spec.demand, times_s=(60.0,), seed=2, style="rural")
    bare = Street(spec, make_shelf()).run.frames[0].movers
    dressed = next(frame for frame in street.run.frames if frame.time_s == 60.0).movers
    assert [mover.front_m.tolist() for mover in bare] == [mover.front_m.tolist() for mover in dressed]


# Presets -------------------------------------------------------------------------------------------------------------


def models() -> list[VehicleModel]:
    kinds: tuple[TrafficKind, ...] = ("car", "van", "bus", "lorry", "motorcycle", "cyclist", "pedestrian")
    return [VehicleModel(SIZES[kind][0][0], kind, SIZES[kind][0][1], SIZES[kind][0][2]) for kind in kinds]


def test_levels_and_kinds_of_presets_are_those_of_the_original() -> None:
    assert dict(LEVELS) == {"low": 0.5, "medium": 1.0, "high": 1.5}
    for name, figures in (("city", (0.1, 0.5, 0.05, 0.05, 0.05)), ("suburb", (0.05, 0.1, 0.01, 0.01, 0.03))):
        rates = PRESETS[name]
        cars = rates["car"] + rates["van"] + rates["motorcycle"]
        assert (rates["pedestrian"], cars, rates["bus"], rates["lorry"], rates["cyclist"]) == pytest.approx(figures)
    assert preset("city", "high", without=["bus"])["car"] == pytest.approx(1.5 * 0.44)
    assert "bus" not in preset("city", "high", without=["bus"])


def test_a_preset_brings_as_many_as_its_rates_say() -> None:
    """On one road of 400 m with two ways in, 0.44 cars per second and way at 13.9 m/s are 25 on the road, at any time."""
    network = read_network(make_network(NetworkSpec("straight", length_m=400.0)))
    demand = TrafficDemand(entry_rates_per_s={"car": 0.44})
    expected = 2 * 400.0 * 0.44 / 13.9
    counts = [len(simulate(network, demand, models(), seed=seed, times_s=[1.0]).frames[0].movers) for seed in range(6)]
    assert abs(sum(counts) - 6 * expected) < 4.5 * (6 * expected) ** 0.5
    levels = [len(movers_of(network, TrafficDemand(entry_rates_per_s=preset("suburb", level)), models())) for level in LEVELS]
    assert levels == sorted(levels)
    assert levels[0] < levels[2]


@pytest.mark.slow
def test_a_city_where_roads_meet_does_not_stand_still() -> None:
    for layout, meets in (("straight", False), ("curve", False), ("motorway", False), ("cross", True), ("roundabout", True)):
        assert network_of(layout, CrossSection()).has_junctions == meets
    network, speeds = network_of("blocks", CrossSection()), []
    for level in ("low", "high"):
        demand = TrafficDemand(entry_rates_per_s=preset("city", level), junction_share=JUNCTION_SHARES["city"])
        cars = [mover.speed_m_s for mover in movers_of(network, demand, models(), 60.0) if mover.kind == "car"]
        speeds.append(float(np.mean(cars)))
    assert speeds[0] > 4.0
    assert speeds[0] > speeds[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "layout"), [("city", "cross"), ("suburb", "grid"), ("rural", "curve"), ("motorway", "motorway")]
)
def test_every_preset_drives_on_its_roads(name: str, layout: str) -> None:
    network = network_of(layout, CrossSection())
    movers = movers_of(network, TrafficDemand(entry_rates_per_s=preset(name, "medium")), models())
    kinds = Counter(mover.kind for mover in movers)
    assert kinds["car"] >= 3
    assert ("pedestrian" in kinds) == (name != "motorway")


def test_a_preset_leaves_out_what_the_roads_or_the_store_do_not_have() -> None:
    network = network_of("motorway", CrossSection())
    movers = movers_of(network, TrafficDemand(entry_rates_per_s=preset("city", "low")), models()[:1])
    assert {mover.kind for mover in movers} == {"car"}


# Networks as they are given ------------------------------------------------------------------------------------------


def test_a_network_of_a_present_version_is_taken_as_it_is(tmp_path: Path) -> None:
    """Building it again would move junctions that were edited by hand, away from the user's own runs."""
    text = make_network(NetworkSpec("cross", length_m=150.0)).xml
    edited = re.sub(rb'(<lane id=":centre_\d+_0"[^>]*shape=")[^"]+', rb"\g<1>10.000,10.000 70.000,75.000", text)
    assert edited != text
    (tmp_path / "a.net.xml").write_bytes(edited)
    network = read_network(make_network(NetworkSpec(file=tmp_path / "a.net.xml")))
    moved = [lane for lane in network.of_kind("internal") if np.allclose(lane.centre_m[0, :2], 10.0)]
    assert moved


def test_driving_on_the_left_is_refused(tmp_path: Path) -> None:
    text = make_network(NetworkSpec("cross", length_m=150.0)).xml
    (tmp_path / "uk.net.xml").write_bytes(text.replace(b"<net ", b'<net lefthand="true" ', 1))
    with pytest.raises(TrafficError, match="which drives on the left") as caught:
        read_network(make_network(NetworkSpec(file=tmp_path / "uk.net.xml")))
    assert caught.value.path == "scene.traffic.network"


def test_a_shelf_with_trams_draws_them() -> None:
    shelf = AssetShelf({"tram": [manifest("tram-01", "tram", (30.0, 2.4, 3.5))]})
    spec = StreetSpec(
        NetworkSpec("straight", length_m=300.0, section=WITH_TRAMS), TrafficDemand({"tram": 0.2}), times_s=(30.0,)
    )
    moment = Street(spec, shelf).moment(0)
    assert {item.asset.asset_class for item in moment.assets} == {"tram"}
    assert set(GENERATED_NAMES) == {"grid", "spider", "random"}
