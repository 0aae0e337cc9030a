"""Traffic scenes as recipes say them: clips, egos by rule, twins, rigs, targets, demand, own runs; and what is refused."""

from __future__ import annotations

import copy
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_in_memory import MemoryAssets, street_boxes
from fullwell.client.files import collect_files
from fullwell.schema import RecipeBuilder, RecipeError, build_frame, load_recipe
from fullwell.schema.frame import FrameDescription
from fullwell.traffic.networks import NetworkSpec, make_network

LENS = {"kind": "pinhole", "hfov_deg": 60, "f_number": 4}
SENSOR = {"name": "s", "model": "imx363", "rows": 48, "cols": 64, "exposure": {"time_s": 0.001}}
MILLIMETRE = 1e-3


def camera(name: str, **pose: Any) -> dict[str, Any]:
    return {"name": name, "pose": pose, "lens": LENS, "sensors": [SENSOR]}


def street(**more: Any) -> dict[str, Any]:
    traffic = {
        "network": {"layout": "cross", "length_m": 200},
        "demand": {"car": {"rate_per_s": 0.3, "density_per_km": 25}, "pedestrian": {"rate_per_s": 0.2}},
        "time_s": 12,
        "dressed": False,
        **more,
    }
    return {
        "schema": "fullwell/recipe/v1",
        "name": "street",
        "seed": 5,
        "scene": {
            "traffic": {name: value for name, value in traffic.items() if value is not None},
            "lights": [{"name": "sky", "kind": "constant_environment", "luminance_cd_m2": 3000, "spd": "D65"}],
        },
        "cameras": [camera("mast", origin_m=[92, 92, 6], target_m=[100, 100, 0])],
        "outputs": ["labels.json"],
    }


def mounted(recipe: dict[str, Any], **at: dict[str, Any]) -> dict[str, Any]:
    return recipe | {"cameras": [camera(name, mount=mount) for name, mount in at.items()]}


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> MemoryAssets:
    return MemoryAssets(*street_boxes(), folder=tmp_path_factory.mktemp("assets"))


def build(recipe: dict[str, Any], store: MemoryAssets) -> FrameDescription:
    return build_frame(load_recipe(recipe), assets=store)


def ego_of(frame: FrameDescription) -> Any:
    assert frame.driving is not None
    assert frame.driving.ego is not None
    return frame.driving.ego.user


# Clips ---------------------------------------------------------------------------------------------------------------


def test_a_clip_is_frames_at_a_rate_with_one_ego_and_the_same_tracks(store: MemoryAssets) -> None:
    recipe = mounted(street(ego={"kind": "car", "min_speed_m_s": 4}), front={"at": "windscreen"})
    recipe["vary"] = {"clip": {"frames": 4, "frame_rate_hz": 12.5}}
    builder = RecipeBuilder(load_recipe(recipe), assets=store)
    frames = [builder.frame(index) for index in range(4)]
    egos = [ego_of(frame) for frame in frames]
    assert {ego.sumo_id for ego in egos} == {egos[0].sumo_id}
    assert [frame.driving.time_s for frame in frames if frame.driving] == pytest.approx([12.0, 12.08, 12.16, 12.24])
    tracks: dict[str, list[Any]] = {}
    for frame in frames:
        assert frame.driving is not None
        for user in frame.driving.users:
            tracks.setdefault(user.sumo_id, []).append(user)
    whole = [users for users in tracks.values() if len(users) == 4 and users[0].kind == "car" and users[0].speed_m_s > 3]
    assert whole
    for users in whole:
        assert len({user.size_m for user in users}) == 1
        for before, after in pairwise(users):
            moved = np.linalg.norm(after.position_m - before.position_m)
            assert moved == pytest.approx(0.08 * before.speed_m_s, abs=0.06)
    # A single frame of the clip is a recipe of its own.
    alone = load_recipe(frames[2].recipe_json)
    again = build_frame(alone, assets=store)
    assert ego_of(again).position_m == pytest.approx(egos[2].position_m, abs=1e-9)


def test_a_clip_multiplies_what_else_varies(store: MemoryAssets) -> None:
    recipe = street() | {"vary": {"grid": {"scene.traffic.wet": [False, True]}, "clip": {"frames": 3}}}
    document = load_recipe(recipe)
    assert document.frame_count() == 6
    builder = RecipeBuilder(document, assets=store)
    told = [(builder.frame(index).varied) for index in (0, 2, 3)]
    assert [dict(values) for values in told] == [
        {"scene.traffic.wet": False, "scene.traffic.time_s": 12.0},
        {"scene.traffic.wet": False, "scene.traffic.time_s": 12.2},
        {"scene.traffic.wet": True, "scene.traffic.time_s": 12.0},
    ]


def test_a_clip_without_traffic_is_refused() -> None:
    recipe = street() | {"vary": {"clip": {"frames": 3}}}
    del recipe["scene"]["traffic"]
    with pytest.raises(RecipeError, match=r"lets traffic go on; add scene\.traffic") as caught:
        load_recipe(recipe)
    assert caught.value.path == "vary.clip"


def test_an_ego_that_leaves_during_a_clip_is_told(store: MemoryAssets) -> None:
    recipe = mounted(street(ego={"kind": "car", "min_speed_m_s": 8, "lane": "-arm_*"}), front={"at": "roof"})
    recipe["vary"] = {"clip": {"frames": 2, "frame_rate_hz": 0.02}}
    builder = RecipeBuilder(load_recipe(recipe), assets=store)
    builder.frame(0)
    with pytest.raises(RecipeError, match="which has left the network at 62 s") as caught:
        builder.frame(1)
    assert caught.value.path == "scene.traffic.ego"


# Egos and cameras ----------------------------------------------------------------------------------------------------


def test_an_ego_has_the_lane_and_the_vehicle_ahead_that_it_is_to_have(store: MemoryAssets) -> None:
    ego = {"kind": "car", "lane": "arm_*_1", "vehicle_ahead_m": 30}
    frame = build(mounted(street(ego=ego), front={"at": "windscreen"}), store)
    user = ego_of(frame)
    assert user.lane.startswith("arm_")
    assert frame.driving is not None
    forward = np.array([math.cos(user.yaw_rad), math.sin(user.yaw_rad)])
    ahead = [
        (other.position_m - user.position_m)[:2] @ forward - (other.size_m[0] + user.size_m[0]) / 2
        for other in frame.driving.users
        if other.kind != "pedestrian" and other.lane == user.lane and other.sumo_id != user.sumo_id
    ]
    assert any(0 < gap <= 30 for gap in ahead)


def test_a_rule_that_nobody_meets_is_one_clear_error(store: MemoryAssets) -> None:
    for rule in ({"min_speed_m_s": 60}, {"lane": "nowhere"}, {"vehicle_ahead_m": 0.01}):
        with pytest.raises(RecipeError, match=r"fits none of the \d+ vehicles of kind 'car'") as caught:
            build(mounted(street(ego={"kind": "car", **rule}), front={"at": "roof"}), store)
        assert caught.value.path == "scene.traffic.ego"


def test_a_surround_rig_looks_all_around_and_mirrors_look_back(store: MemoryAssets) -> None:
    rig = {f"at_{yaw}": {"at": "roof", "yaw_deg": yaw} for yaw in (0, 90, 180, 270)}
    rig["mirror"] = {"at": "mirror_left", "yaw_deg": 160}
    frame = build(mounted(street(ego={"kind": "car"}), **rig), store)
    user = ego_of(frame)
    looks = {each.camera.name: each.camera.camera_to_world for each in frame.cameras}
    for yaw in (0, 90, 180, 270):
        angle = user.yaw_rad + math.radians(yaw)
        assert looks[f"at_{yaw}"][:3, 2] == pytest.approx([math.cos(angle), math.sin(angle), 0.0], abs=1e-9)
        assert looks[f"at_{yaw}"][2, 3] > user.size_m[2]
    mirror = looks["mirror"]
    left = np.array([-math.sin(user.yaw_rad), math.cos(user.yaw_rad)])
    assert (mirror[:2, 3] - user.position_m[:2]) @ left == pytest.approx(user.size_m[1] / 2 + 0.05)
    assert mirror[:2, 2] @ [math.cos(user.yaw_rad), math.sin(user.yaw_rad)] < -0.9


def test_an_ego_is_hidden_shown_or_shown_in_parts(store: MemoryAssets) -> None:
    def parts(**ego: Any) -> list[str]:
        frame = build(mounted(street(ego={"kind": "car", **ego}), front={"at": "roof"}), store)
        name = ego_of(frame).object_id
        return [part.name for item in frame.scene.objects if item.id == name for part in item.parts]

    assert parts() == []
    whole = parts(show=True)
    assert "body" in whole
    assert parts(show=True, hide=["body"]) == [name for name in whole if name != "body"]
    with pytest.raises(RecipeError, match="leaves nothing of the ego"):
        parts(show=True, hide=["*"])


def test_twins_differ_in_one_thing_only(store: MemoryAssets) -> None:
    base = mounted(street(dressed=True, ego={"kind": "car"}), front={"at": "windscreen"})
    twin = copy.deepcopy(base)
    twin["scene"]["traffic"]["wet"] = True
    first, second = (build(recipe, store).scene for recipe in (base, twin))
    assert [item.id for item in first.objects] != [item.id for item in second.objects], "the road has another material"
    placed = [
        {item.id: item.to_world.tolist() for item in scene.objects if not item.id.startswith("street/road")}
        for scene in (first, second)
    ]
    assert placed[0] == placed[1]


@pytest.mark.parametrize("distance_m", [10.0, 33.3])
def test_a_target_is_exactly_that_far_from_the_bumper(store: MemoryAssets, distance_m: float) -> None:
    target = {"id": "mark", "class": "car", "distance_m": distance_m}
    recipe = street(
        network={"layout": "straight", "length_m": 400}, targets=[target], ego={"kind": "car", "min_road_ahead_m": 80}
    )
    frame = build(mounted(recipe, front={"at": "windscreen"}), store)
    user = ego_of(frame)
    assert frame.driving is not None
    mark = next(other for other in frame.driving.users if other.object_id == "mark")
    between = np.linalg.norm(mark.position_m - user.position_m) - (mark.size_m[0] + user.size_m[0]) / 2
    assert between == pytest.approx(distance_m, abs=5 * MILLIMETRE)


# Demand and own runs -------------------------------------------------------------------------------------------------


def test_a_preset_is_a_demand_and_kinds_replace_its_own(store: MemoryAssets) -> None:
    def kinds(demand: dict[str, Any]) -> dict[str, int]:
        frame = build(street(demand=demand), store)
        assert frame.driving is not None
        names = [user.kind for user in frame.driving.users]
        return {name: names.count(name) for name in set(names)}

    suburb = kinds({"preset": "suburb", "level": "high"})
    assert suburb["car"] >= 2
    assert suburb["pedestrian"] >= 5
    assert "car" not in kinds({"preset": "suburb", "level": "high", "car": {}})


@pytest.mark.parametrize(
    ("more", "path", "says"),
    [
        ({"demand": {"spaceship": {}}}, "scene.traffic.demand.spaceship", "is not a known key"),
        ({"demand": {"preset": "town"}}, "scene.traffic.demand.preset", "city"),
        ({"demand": {"preset": "city", "level": "mid"}}, "scene.traffic.demand.level", "low"),
        ({"network": None}, "scene.traffic.network", "is missing; give a layout or a file"),
        ({"run": {"file": "a.xml"}}, "scene.traffic.demand", "together with run"),
        (
            {"demand": None, "run": {"file": "a.sumocfg", "signals": {"file": "b.xml"}}},
            "scene.traffic.run.signals",
            "which tells them itself",
        ),
    ],
)
def test_traffic_that_makes_no_sense_is_refused(more: dict[str, Any], path: str, says: str) -> None:
    with pytest.raises(RecipeError, match=says) as caught:
        load_recipe(street(**more))
    assert caught.value.path == path


def test_a_kind_without_an_asset_is_one_clear_error(store: MemoryAssets) -> None:
    with pytest.raises(RecipeError, match="there is no model of a tram") as caught:
        build(street(demand={"tram": {"rate_per_s": 0.1}}), store)
    assert caught.value.path == "scene.traffic.demand.tram"


@pytest.fixture
def own_run(tmp_path: Path) -> Path:
    """A recipe's folder with a configuration in a folder of its own; returns the recipe's folder."""
    folder = tmp_path / "recipe"
    (folder / "sumo" / "in").mkdir(parents=True)
    (folder / "sumo" / "in" / "cross.net.xml").write_bytes(make_network(NetworkSpec("cross", length_m=200.0)).xml)
    flow = '<flow id="f" from="arm_0" to="-arm_2" begin="0" end="90" period="3"/>'
    (folder / "sumo" / "in" / "a.rou.xml").write_text(f"<routes>{flow}</routes>")
    (folder / "sumo" / "more.add.xml").write_text('<additional><include href="in/p.add.xml"/></additional>')
    (folder / "sumo" / "in" / "p.add.xml").write_text("<additional/>")
    inputs = '<net-file value="in/cross.net.xml"/><route-files value="in/a.rou.xml"/><additional-files value="more.add.xml"/>'
    (folder / "sumo" / "run.sumocfg").write_text(f"<configuration><input>{inputs}</input></configuration>")
    return folder


def test_a_configuration_needs_no_network_and_all_its_files_are_known(own_run: Path, store: MemoryAssets) -> None:
    recipe = street(network=None, demand=None, run={"file": "sumo/run.sumocfg"}, time_s=12.5)
    frame = build_frame(load_recipe(recipe), base_dir=own_run, assets=store)
    assert frame.driving is not None
    assert [user.kind for user in frame.driving.users].count("car") == 5, "one every 3 s from 0 s on"
    assert all(user.yaw_rate_rad_s is not None for user in frame.driving.users if user.role == "mover")
    files = {"sumo/run.sumocfg", "sumo/in/cross.net.xml", "sumo/in/a.rou.xml", "sumo/more.add.xml", "sumo/in/p.add.xml"}
    assert all(name in frame.recipe_json for name in files), "the manifest names what was read"
    assert set(collect_files(recipe, own_run)) == files, "a submitted job brings them along"


def test_a_configuration_reads_nothing_outside_the_recipes_folder(own_run: Path, store: MemoryAssets) -> None:
    (own_run.parent / "secret.rou.xml").write_text("<routes/>")
    for reference in ("../../secret.rou.xml", str(own_run.parent / "secret.rou.xml")):
        text = (own_run / "sumo" / "run.sumocfg").read_text().replace("in/a.rou.xml", reference)
        (own_run / "sumo" / "bad.sumocfg").write_text(text)
        recipe = street(network=None, demand=None, run={"file": "sumo/bad.sumocfg"})
        with pytest.raises(RecipeError, match="lies outside the recipe's folder"):
            build_frame(load_recipe(recipe), base_dir=own_run, assets=store)


def test_a_configuration_that_names_an_absent_file_says_which(own_run: Path, store: MemoryAssets) -> None:
    (own_run / "sumo" / "in" / "a.rou.xml").unlink()
    recipe = street(network=None, demand=None, run={"file": "sumo/run.sumocfg"})
    with pytest.raises(RecipeError, match=r"names a file that is 'sumo/in/a\.rou\.xml', which does not exist"):
        build_frame(load_recipe(recipe), base_dir=own_run, assets=store)
