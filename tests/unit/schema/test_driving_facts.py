"""What labels may tell of a street agrees with the street itself."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from assets_in_memory import MemoryAssets, small_car
from fullwell.scene.motion import DrivingFacts, GroundRegion
from fullwell.schema import RecipeError, build_frame, load_recipe
from fullwell.schema.conversion.driving import driving_facts
from fullwell.schema.conversion.traffic import StreetView
from fullwell.traffic.networks import NetworkSpec
from fullwell.traffic.placement import PlacedAsset
from fullwell.traffic.simulation import TrafficDemand
from fullwell.traffic.street import Street, StreetSpec
from fullwell.traffic.surfaces import KERB_HEIGHT_M
from fullwell.traffic.templates import CrossSection
from fullwell.traffic.trajectories import Signals
from street_assets import make_shelf

SECTION = CrossSection(lanes=1, parking_width_m=2.2, sidewalk_width_m=3.0)
STEP_S = 0.1
MIDDLE_M = (80.0, 80.0)
"""Of the junction."""


def a_street(layout: str = "cross") -> Street:
    network = NetworkSpec(layout, length_m=160.0, section=SECTION)
    demand = TrafficDemand({"car": 0.6, "pedestrian": 0.2}, {"car": 12.0})
    return Street(StreetSpec(network, demand, times_s=(30.0, 30.0 + STEP_S), seed=3), make_shelf())


def view_of(street: Street) -> StreetView:
    moment = street.moment(0)
    ego = next(item for item in moment.assets if item.mover is not None and item.mover.kind == "car")
    return StreetView(street, moment, ego, (), ())


def facts_of(view: StreetView, range_m: float = 400.0) -> DrivingFacts:
    return driving_facts(view, places_m=[np.array([*MIDDLE_M, 1.4])], range_m=range_m, mounted=["front"])


@pytest.fixture(scope="module")
def view() -> StreetView:
    return view_of(a_street())


@pytest.fixture(scope="module")
def facts(view: StreetView) -> DrivingFacts:
    return facts_of(view)


def polygon(region: GroundRegion) -> Any:
    return shapely.Polygon(region.outer_m[:, :2], [hole[:, :2] for hole in region.holes_m])


def test_every_mover_and_parked_car_is_told_once_with_its_velocity(view: StreetView, facts: DrivingFacts) -> None:
    movers = {item.id: item for item in view.moment.assets if item.mover is not None}
    told = {user.object_id: user for user in facts.users if user.role == "mover"}
    assert set(told) == set(movers)
    for name, user in told.items():
        mover = movers[name].mover
        assert mover is not None
        assert user.sumo_id == mover.id
        assert np.linalg.norm(user.velocity_m_s) == pytest.approx(user.speed_m_s)
        assert (user.brake, user.left, user.right) == (mover.signals.brake, mover.signals.left, mover.signals.right)
    parked = [user for user in facts.users if user.role == "parked"]
    assert len(parked) == sum(item.role == "parked" for item in view.moment.assets) > 0
    assert not any(np.any(user.velocity_m_s) for user in parked)


def test_velocities_lead_to_the_next_moment_of_the_run(view: StreetView, facts: DrivingFacts) -> None:
    """SUMO moves by the speed at the end of a step, along the lane: in 0.1 s no more than decimetres from straight on."""
    later = {item.id: item for item in view.street.moment(1).assets if item.mover is not None}
    checked = 0
    for user in facts.users:
        if user.kind == "car" and user.role == "mover" and user.speed_m_s > 3 and user.object_id in later:
            moved = later[user.object_id].position_m - user.position_m
            assert moved == pytest.approx(user.velocity_m_s * STEP_S, abs=0.15)
            checked += 1
    assert checked > 3


def test_yaw_rates_come_from_the_moment_that_follows(view: StreetView, facts: DrivingFacts) -> None:
    later = {item.id: item for item in view.street.moment(1).assets if item.mover is not None}
    known = [user for user in facts.users if user.role == "mover" and user.object_id in later]
    assert known
    for user in known:
        assert user.yaw_rate_rad_s is not None
        turned = user.yaw_rad + user.yaw_rate_rad_s * STEP_S
        assert math.remainder(turned - later[user.object_id].yaw_rad, math.tau) == pytest.approx(0, abs=1e-9)


def test_lane_borders_are_half_a_width_beside_the_centre_and_sidewalks_lie_on_the_kerb(facts: DrivingFacts) -> None:
    kinds = {lane.kind for lane in facts.lanes}
    assert {"drive", "sidewalk", "parking", "internal", "crossing"} <= kinds
    assert "walking_area" not in kinds
    for lane in facts.lanes:
        ahead = lane.centre_m[1] - lane.centre_m[0]
        aside = lane.left_m[0] - lane.centre_m[0]
        assert np.linalg.norm(aside) == pytest.approx(lane.width_m / 2, rel=1e-6)
        assert ahead[0] * aside[1] - ahead[1] * aside[0] > 0, "left is to the left of the driving direction"
        assert lane.right_m[0] - lane.centre_m[0] == pytest.approx(-aside, abs=1e-9)
        assert lane.centre_m[:, 2] == pytest.approx(KERB_HEIGHT_M if lane.kind == "sidewalk" else 0.0)


def test_the_drivable_area_is_the_carriageway(view: StreetView, facts: DrivingFacts) -> None:
    drivable = shapely.union_all([polygon(region) for region in facts.drivable])
    assert drivable.symmetric_difference(view.street.plan.carriageway).area < 0.1
    crossings = shapely.union_all([polygon(region) for region in facts.crossings])
    assert crossings.area == pytest.approx(view.street.plan.crossings.area, rel=1e-3)
    cars = [user for user in facts.users if user.role == "mover" and user.kind == "car"]
    assert all(drivable.contains(shapely.Point(user.position_m[:2])) for user in cars)


def test_what_is_out_of_range_of_every_camera_is_left_out(view: StreetView) -> None:
    near = facts_of(view, 20.0)
    assert 0 < len(near.lanes) < len(facts_of(view).lanes)
    assert all(np.abs(region.outer_m[:, :2] - MIDDLE_M).max() <= 20.0 + 1e-9 for region in near.drivable)


def test_a_light_shows_what_its_approach_is_told(view: StreetView, facts: DrivingFacts) -> None:
    assert len(facts.signals) == 4
    lit = {item.id: item.lit for item in view.moment.assets}
    states = {signal.state for signal in facts.signals}
    assert states & set("Gg")
    assert states & set("ry"), "a junction is never green for all"
    for signal in facts.signals:
        assert signal.links
        text = view.moment.signals[signal.controller]
        assert {link.state for link in signal.links} <= set(text)
        expected = {"G": ("green",), "g": ("green",), "y": ("amber",), "u": ("red", "amber"), "r": ("red",)}[signal.state]
        assert signal.shown == expected
        assert len(lit[signal.object_id]) == len(signal.shown)
        approaches = {link.from_lane for link in signal.links}
        assert all(view.street.lane(name) is not None for name in approaches)


def test_the_ego_moves_the_cameras_that_it_carries(view: StreetView, facts: DrivingFacts) -> None:
    assert facts.ego is not None
    assert view.ego is not None
    assert facts.ego.user.object_id == view.ego.id
    assert facts.motion_of_camera("front").velocity_m_s == pytest.approx(view.ego.velocity_m_s)
    assert not facts.motion_of_camera("roadside").velocity_m_s.any()


def test_lamps_of_a_mover_are_told(view: StreetView) -> None:
    item = next(item for item in view.moment.assets if item.mover is not None and item.mover.kind == "car")
    assert item.mover is not None
    mover = replace(item.mover, signals=Signals(brake=True, left=True))
    changed = PlacedAsset(item.id, item.asset, "mover", item.position_m, item.yaw_rad, mover=mover)
    moment = replace(view.moment, assets=(changed,))
    (user,) = facts_of(replace(view, moment=moment)).users
    assert (user.brake, user.left, user.right, user.reverse) == (True, True, False, False)


def street_recipe() -> dict[str, Any]:
    sensor = {"name": "s", "model": "imx363", "rows": 48, "cols": 64, "exposure": {"time_s": 0.001}}
    lens = {"kind": "pinhole", "hfov_deg": 60, "f_number": 4}
    traffic = {
        "network": {"layout": "cross", "length_m": 160},
        "demand": {"car": {"rate_per_s": 0.3, "density_per_km": 12}},
        "time_s": 30,
        "ego": {"kind": "car"},
    }
    return {
        "schema": "fullwell/recipe/v1",
        "name": "street",
        "seed": 3,
        "scene": {
            "traffic": traffic,
            "lights": [{"name": "sky", "kind": "constant_environment", "luminance_cd_m2": 3000, "spd": "D65"}],
        },
        "cameras": [
            {"name": "front", "pose": {"mount": {"at": "windscreen"}}, "lens": lens, "sensors": [sensor]},
            {"name": "pole", "pose": {"origin_m": [92, 92, 6], "target_m": [80, 80, 0]}, "lens": lens, "sensors": [sensor]},
        ],
        "outputs": ["labels.json"],
    }


def test_a_recipe_with_traffic_has_the_facts_and_one_without_has_none(tmp_path: Path) -> None:
    store = MemoryAssets(small_car("sedan-01"), small_car("estate-01", paint="paint/white"), folder=tmp_path)
    frame = build_frame(load_recipe(street_recipe()), assets=store)
    assert frame.driving is not None
    assert frame.driving.ego is not None
    assert frame.driving.ego.cameras == ("front",)
    ids = {item.id for item in frame.scene.objects}
    shown = {user.object_id for user in frame.driving.users} - {frame.driving.ego.user.object_id}
    assert shown <= ids, "every road user within range is an object of the scene"
    plain = street_recipe()
    plain["scene"] = {"lights": plain["scene"]["lights"]}
    plain["cameras"] = plain["cameras"][1:]
    assert build_frame(load_recipe(plain)).driving is None


def test_driving_labels_of_a_scene_without_traffic_are_refused() -> None:
    recipe = street_recipe() | {"outputs": ["labels.json", "driving.json"]}
    recipe["scene"] = {"lights": recipe["scene"]["lights"]}
    with pytest.raises(RecipeError, match=r"asks for driving\.json, which tells of a street; add scene\.traffic") as caught:
        load_recipe(recipe)
    assert caught.value.path == "outputs"


def test_the_map_of_the_facts_is_that_of_the_network(view: StreetView, facts: DrivingFacts) -> None:
    point = np.array([12.0, -3.0])
    assert point + facts.map.offset_m == pytest.approx(view.street.network.to_map(point))
    assert facts.map.projection == "", "a drawn network has none"
