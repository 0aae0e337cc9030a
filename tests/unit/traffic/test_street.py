"""Streets: nothing on the road that should not be, nothing in anything else, the same again, one thing changed at a time."""

from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
import shapely

from fullwell.traffic.dressing import CAR_PAINTS, STYLES, draw_paint, street_style
from fullwell.traffic.networks import NetworkSpec
from fullwell.traffic.placement import AssetShelf, Footprints, PlacedAsset, footprint
from fullwell.traffic.ribbons import cut, dashes, length_m, offset, ribbon
from fullwell.traffic.simulation import TrafficDemand
from fullwell.traffic.street import Street, StreetSpec
from fullwell.traffic.sumo import TrafficError
from fullwell.traffic.surfaces import KERB_HEIGHT_M
from fullwell.traffic.templates import CrossSection
from street_assets import make_shelf

SECTION = CrossSection(lanes=1, parking_width_m=2.2, sidewalk_width_m=3.0)
DEMAND = TrafficDemand({"car": 0.3, "pedestrian": 0.2}, {"car": 5.0})


def spec(layout: str = "blocks", **more: object) -> StreetSpec:
    section = CrossSection() if layout == "motorway" else SECTION
    demand = TrafficDemand({"car": 0.5}) if layout == "motorway" else DEMAND
    known = {"demand": demand, "times_s": (30.0,), "seed": 3} | more
    return StreetSpec(NetworkSpec(layout, length_m=240.0, section=section), **known)  # type: ignore[arg-type]


def is_solid(item: PlacedAsset) -> bool:
    """Whether its bounds count: walkers swing their arms, and poles are thinner than the arms that they carry."""
    return item.role not in ("light", "signal") and item.asset.asset_class != "pedestrian"


def standing_outline(item: PlacedAsset) -> shapely.Polygon:
    """What touches the ground: trunks and poles, not crowns and arms."""
    if item.asset.asset_class == "tree":
        return footprint(item.position_m, item.yaw_rad, (0.5, 0.5))
    return item.outline()


@pytest.fixture(scope="module")
def street() -> Street:
    return Street(spec(), make_shelf())


def test_ids_are_unique_and_a_block_has_hundreds_of_things(street: Street) -> None:
    moment = street.moment(0)
    ids = [item.id for item in moment.assets]
    assert len(set(ids)) == len(ids) > 300
    roles = Counter(item.role for item in moment.assets)
    assert set(roles) == {"mover", "parked", "furniture", "light", "signal", "vegetation", "building"}


def test_nothing_stands_on_the_carriageway_and_buildings_keep_off_pavements(street: Street) -> None:
    for item in street.standing:
        outline = standing_outline(item)
        if item.role == "parked":
            assert not outline.intersects(street.plan.walk.buffer(-0.05))
        elif item.role not in ("light", "signal"):
            assert outline.intersection(street.plan.carriageway).area < 1e-3, item.id
        if item.role == "building":
            assert outline.intersection(street.plan.walk).area < 1e-3, item.id


def test_nothing_overlaps(street: Street) -> None:
    items = [item for item in street.moment(0).assets if is_solid(item)]
    outlines = [standing_outline(item).buffer(-0.1) for item in items]
    tree = shapely.STRtree(outlines)
    first, second = tree.query(outlines, predicate="intersects")
    assert [(items[a].id, items[b].id) for a, b in zip(first, second, strict=True) if a < b] == []


def test_buildings_face_their_street(street: Street) -> None:
    roads = street.plan.carriageway
    for item in street.standing:
        if item.role != "building":
            continue
        forward = item.to_world()[:2, 0]
        front = item.position_m[:2] + forward * (item.asset.size_m[0] / 2 + 3.0)
        back = item.position_m[:2] - forward * (item.asset.size_m[0] / 2 + 3.0)
        assert roads.distance(shapely.Point(front)) < roads.distance(shapely.Point(back)) + 1e-6


def test_lights_lean_over_the_road_and_signals_face_the_drivers(street: Street) -> None:
    for item in street.standing:
        forward = item.to_world()[:2, 0]
        if item.role == "light":
            tip = item.position_m[:2] + forward * item.asset.size_m[0] / 2
            foot = item.position_m[:2] - forward * item.asset.size_m[0] / 2
            assert street.plan.carriageway.distance(shapely.Point(tip)) < street.plan.carriageway.distance(shapely.Point(foot))
        if item.role == "signal":
            lane = max(
                (lane for lane in street.network.lanes if lane.edge_id == item.id.removeprefix("signal/")),
                key=lambda lane: lane.index,
            )
            _, direction = lane.at(lane.length_m)
            assert forward @ direction[:2] < -0.95


def test_signals_show_what_sumo_says(street: Street) -> None:
    moment = street.moment(0)
    shown = {item.id: item.lit for item in moment.assets if item.role == "signal"}
    assert shown
    for name, lit in shown.items():
        lanes = {lane.id for lane in street.network.lanes if lane.edge_id == name.removeprefix("signal/")}
        links = [link for link in street.network.signals if link.from_lane in lanes and not link.crossing]
        states = {moment.signals[link.signal][link.index] for link in links}
        if states <= {"r"}:
            assert lit == ("light_red*",)
        if states <= {"G", "g"}:
            assert lit == ("light_green*",)


def test_walkers_stand_on_the_pavement_and_wheels_on_the_road(street: Street) -> None:
    for item in street.moment(0).assets:
        if item.role != "mover":
            continue
        on_pavement = street.plan.walk.contains(shapely.Point(item.position_m[:2]))
        if item.asset.asset_class == "pedestrian":
            assert item.position_m[2] == pytest.approx(KERB_HEIGHT_M if on_pavement else 0.0)
        else:
            assert item.position_m[2] == pytest.approx(0.0)


@pytest.mark.parametrize("style", sorted(STYLES))
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 5))])
def test_every_style_and_seed_assembles_without_overlap(style: str, seed: int) -> None:
    layout = "motorway" if style == "motorway" else "cross"
    built = Street(spec(layout, style=style, seed=seed), make_shelf())
    moment = built.moment(0)
    items = [item for item in moment.assets if is_solid(item)]
    outlines = [standing_outline(item).buffer(-0.1) for item in items]
    first, second = shapely.STRtree(outlines).query(outlines, predicate="intersects")
    assert (first == second).all()
    assert all(np.isfinite(item.to_world()).all() for item in moment.assets)


def test_the_same_spec_makes_the_same_street_and_a_twin_changes_one_thing() -> None:
    def placed(built: Street) -> dict[str, tuple[str, list[float], tuple[str, ...], str]]:
        return {i.id: (i.asset.id, i.to_world().ravel().tolist(), i.lit, i.paint) for i in built.moment(0).assets}

    first = placed(Street(spec("cross"), make_shelf()))
    assert placed(Street(spec("cross"), make_shelf())) == first
    night = placed(Street(spec("cross", lamps="night"), make_shelf()))
    assert {name: entry[:2] for name, entry in night.items()} == {name: entry[:2] for name, entry in first.items()}
    assert any(night[name][2] != entry[2] for name, entry in first.items())
    assert placed(Street(spec("cross", seed=4), make_shelf())) != first


def test_no_asset_stands_twice_beside_itself(street: Street) -> None:
    rows: dict[str, list[str]] = {}
    for item in street.standing:
        if item.role == "parked":
            rows.setdefault(item.id.split("/")[1], []).append(item.asset.id)
    pairs = [pair for row in rows.values() for pair in pairwise(row)]
    assert len(pairs) > 20
    # Places between may be empty, and vans are drawn apart: neighbours may be equal now and then, but not as by chance.
    assert sum(first == second for first, second in pairs) < len(pairs) / 4


def test_car_paints_follow_their_popularity() -> None:
    rng = np.random.Generator(np.random.Philox(1))
    counts = Counter(draw_paint(rng) for _ in range(5000))
    total = sum(CAR_PAINTS.values())
    for name, share in CAR_PAINTS.items():
        expected = 5000 * share / total
        assert abs(counts[name] - expected) < 4.5 * math.sqrt(expected)


def test_brake_lights_and_indicators_follow_sumo(street: Street) -> None:
    movers = [item for item in street.moment(0).assets if item.mover is not None and item.asset.asset_class == "car"]
    for item in movers:
        assert item.mover is not None
        assert ("brakelight*" in item.lit) == item.mover.signals.brake
        assert ("indicator*left" in item.lit) == item.mover.signals.left
        assert "drl*" in item.lit
    assert any("brakelight*" in item.lit for item in movers)


def test_distances_ahead_are_exact_along_the_lane(street: Street) -> None:
    movers = [item for item in street.moment(0).assets if item.mover is not None and item.asset.asset_class == "car"]
    checked = 0
    for item in movers:
        assert item.mover is not None
        lane = street.lane(item.mover.lane)
        if lane is None or lane.kind != "drive" or lane.length_m - item.mover.position_m < 6:
            continue
        place = street.ahead_of(item, 5.0)
        assert place is not None
        point, direction = place
        assert (point - item.mover.front_m) @ direction == pytest.approx(5.0, abs=0.05)
        assert street.ahead_of(item, 5.0, lane=5) is None
        checked += 1
    assert checked


def test_an_unknown_style_is_answered_with_the_nearest() -> None:
    with pytest.raises(TrafficError, match="suburb"):
        street_style("suburbs")


def test_traffic_without_an_asset_for_it_is_one_clear_error() -> None:
    shelf = AssetShelf({"car": make_shelf().all("car")})
    with pytest.raises(TrafficError, match=r"demand\.pedestrian asks for traffic, but there is no model of a pedestrian"):
        Street(spec("cross"), shelf).moment(0)


# Lines and footprints ------------------------------------------------------------------------------------------------

CORNER = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0]])


def test_an_offset_line_keeps_its_distance_around_a_corner() -> None:
    moved = offset(CORNER, 1.0)
    np.testing.assert_allclose(moved, [[0, 1, 0], [9, 1, 0], [9, 10, 0]], atol=1e-12)
    np.testing.assert_allclose(offset(CORNER, -1.0)[1], [11, -1, 0], atol=1e-12)


def test_lines_are_cut_and_dashed_by_length() -> None:
    assert length_m(CORNER) == pytest.approx(20)
    np.testing.assert_allclose(cut(CORNER, 8.0, 12.0), [[8, 0, 0], [10, 0, 0], [10, 2, 0]], atol=1e-12)
    marks = list(dashes(CORNER, 3.0, 6.0))
    assert [length_m(mark) for mark in marks] == pytest.approx([3.0, 3.0])


def test_a_ribbon_faces_up_and_has_its_width() -> None:
    vertices, faces = ribbon(np.array([[0.0, 0, 0], [4, 0, 0]]), 0.5, raised_m=0.01)
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normal[:, 2] > 0).all()
    assert normal[:, 2].sum() / 2 == pytest.approx(2.0)
    assert (vertices[:, 2] == 0.01).all()


def test_footprints_that_touch_do_not_overlap() -> None:
    taken = Footprints()
    assert taken.claim(footprint(np.zeros(3), 0.0, (4.0, 2.0)))
    assert taken.claim(footprint(np.array([4.0, 0, 0]), 0.0, (4.0, 2.0)))
    assert not taken.claim(footprint(np.array([3.0, 1.5, 0]), 0.3, (4.0, 2.0)))
    assert taken.claim(footprint(np.array([0.0, 2.1, 0]), 0.0, (4.0, 2.0)))


def test_a_pose_turns_forward_and_climbs() -> None:
    asset = make_shelf().all("car")[0]
    matrix = PlacedAsset("a", asset, "mover", np.array([1.0, 2, 3]), math.pi / 2, math.radians(10)).to_world()
    np.testing.assert_allclose(matrix[:3, :3].T @ matrix[:3, :3], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(matrix[:3, 0], [0, math.cos(math.radians(10)), math.sin(math.radians(10))], atol=1e-12)
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1)
    assert matrix[2, 2] > 0.9
