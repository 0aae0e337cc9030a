"""What is planned of motion: nothing where nothing moves far enough, and bounds that hold."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.dataset import encode
from fullwell.labels import make_labels, optical_flow
from fullwell.pipeline import render_frame
from fullwell.pipeline.keys import light_key
from fullwell.pipeline.lighting import LightPlan, plan_light
from fullwell.pipeline.motion import Timing, plan_motion, rigs_by_exposure
from fullwell.pipeline.plan import plan_frame
from fullwell.pipeline.steps import PlanStep
from fullwell.render import query_surfaces, render_light
from fullwell.schema import build_frame, load_recipe
from fullwell.schema.errors import RecipeError
from fullwell.schema.frame import FrameDescription
from fullwell.storage import LocalStore

LINE_TIME_S = 1e-4


def frame_of(recipe: Mapping[str, Any]) -> FrameDescription:
    return build_frame(load_recipe(dict(recipe)))


def plan_of(recipe: Mapping[str, Any], *, skip: bool = True) -> LightPlan:
    frame = frame_of(recipe)
    return plan_light(frame, frame.cameras[0], 0, skip=skip)


def step_of(plan: LightPlan) -> PlanStep:
    (step,) = (step for step in plan.steps if step.what == "main: motion")
    return step


def key_of(recipe: Mapping[str, Any]) -> str:
    """Return the light's key with the recipe's motions taken out of what names the frame."""
    frame = frame_of(recipe)
    return light_key(frame, frame.cameras[0], plan_light(frame, frame.cameras[0], 0), variant="llvm_ad_spectral")


def with_motion(recipe: Mapping[str, Any], *, ball: Any = None, camera: Any = None, **sensor: Any) -> dict[str, Any]:
    """Return the recipe (the ball is 5.9 m away, 44 px are a tangent of 1) with motions, and another sensor."""
    changed = copy.deepcopy(dict(recipe))
    changed["outputs"] = ["image.png"]
    if ball is not None:
        changed["scene"]["objects"][1]["motion"] = ball
    if camera is not None:
        changed["cameras"][0]["pose"]["motion"] = camera
    changed["cameras"][0]["sensors"][0] |= sensor
    return changed


def exposed(time_s: float) -> dict[str, Any]:
    return {"exposure": {"time_s": time_s}}


# Whether anything is rendered moving ---------------------------------------------------------------------------------


def test_without_motion_nothing_is_planned(recipe: dict[str, Any]) -> None:
    plan = plan_of(with_motion(recipe))
    assert plan.request.motion is None
    assert (step_of(plan).decision, step_of(plan).why) == ("skip", "nothing moves")


@pytest.mark.parametrize(
    "motion",
    [
        {"ball": {"velocity_m_s": [0, 0, 0]}},
        {"ball": {"velocity_m_s": [2, 0, 0]}},
        {"camera": {"velocity_m_s": [0, 2, 0]}},
        {"camera": {"yaw_rate_deg_per_s": 20}},
    ],
)
def test_motion_too_slow_to_be_seen_changes_no_light(recipe: dict[str, Any], motion: dict[str, Any]) -> None:
    plan = plan_of(with_motion(recipe, **motion))
    assert plan.request.motion is None
    assert step_of(plan).decision == "skip"
    assert key_of(with_motion(recipe, **motion)) == key_of(with_motion(recipe))


def test_a_skip_tells_its_bound(recipe: dict[str, Any]) -> None:
    step = step_of(plan_of(with_motion(recipe, ball={"velocity_m_s": [2, 0, 0]})))
    assert 0.05 < float(step.error_bound.removesuffix(" px")) <= 0.25
    assert step.error_bound in step.why


@pytest.mark.parametrize(
    "motion",
    [
        {"ball": {"velocity_m_s": [40, 0, 0]}},
        {"camera": {"velocity_m_s": [0, 40, 0]}},
        {"camera": {"yaw_rate_deg_per_s": 720}},
    ],
)
def test_what_moves_far_enough_is_rendered_moving(recipe: dict[str, Any], motion: dict[str, Any]) -> None:
    plan = plan_of(with_motion(recipe, **motion))
    assert plan.request.motion is not None
    assert step_of(plan).decision == "run"
    assert "moments" in step_of(plan).why
    assert key_of(with_motion(recipe, **motion)) != key_of(with_motion(recipe))


def test_the_threshold_is_the_recipes(recipe: dict[str, Any]) -> None:
    fast = with_motion(recipe, ball={"velocity_m_s": [40, 0, 0]})
    fast["quality"]["motion_blur_px"] = 100
    assert plan_of(fast).request.motion is None


def test_without_skips_all_that_moves_at_all_is_rendered_moving(recipe: dict[str, Any]) -> None:
    slow = with_motion(recipe, ball={"velocity_m_s": [0.001, 0, 0]})
    assert plan_of(slow).request.motion is None
    motion = plan_of(slow, skip=False).request.motion
    assert motion is not None
    assert list(motion.motions) == ["ball"]
    assert plan_of(with_motion(recipe), skip=False).request.motion is None


def test_a_camera_that_moves_with_a_thing_does_not_see_it_move_but_the_rest(recipe: dict[str, Any]) -> None:
    together = {"velocity_m_s": [0, 40, 0]}
    alone = with_motion(recipe, ball=together, camera=together)
    motion = plan_of(alone).request.motion
    assert motion is not None
    only_floor = plan_of(with_motion(recipe, camera=together)).request.motion
    assert only_floor is not None
    assert motion.shift_px(0.01) == only_floor.shift_px(0.01)


# Bounds --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("motion", "slack"),
    [
        ({"ball": {"velocity_m_s": [30, 10, 5]}}, 2.0),
        ({"ball": {"yaw_rate_deg_per_s": 3000}}, 4.0),
        ({"camera": {"velocity_m_s": [-20, 30, 10]}}, 4.0),
        ({"camera": {"yaw_rate_deg_per_s": 900}}, 2.0),
        ({"camera": {"velocity_m_s": [0, 40, 0]}, "ball": {"velocity_m_s": [0, -40, 0]}}, 4.0),
    ],
)
def test_nothing_in_the_picture_moves_farther_than_the_bound(
    recipe: dict[str, Any], motion: dict[str, Any], slack: float
) -> None:
    frame = frame_of(with_motion(recipe, **motion))
    rig, time_s = frame.cameras[0], 1e-3
    shifts = plan_motion(frame, rig, 0).shifts
    assert shifts is not None
    labels = make_labels(frame.scene, rig.camera, query_surfaces(frame.scene, rig.camera))
    flow = optical_flow(labels, rig.camera, frame.motions, interval_s=time_s, camera_motion=rig.motion)
    largest = float(np.nanmax(np.hypot(flow[..., 0], flow[..., 1])))
    assert largest <= shifts(time_s) <= slack * largest


def test_what_may_pass_through_the_camera_has_no_bound(recipe: dict[str, Any]) -> None:
    frame = frame_of(with_motion(recipe, ball={"velocity_m_s": [1500, -1500, 0]}))
    plan = plan_motion(frame, frame.cameras[0], 0)
    assert plan.shifts is not None
    assert math.isinf(plan.shifts(0.005))
    assert plan.step.error_bound == "not bounded"


def test_the_difference_that_a_skip_makes_is_within_its_bound(recipe: dict[str, Any]) -> None:
    """A thing that is left still is off by at most the bound: so is each pixel by that share of its neighbours' difference."""
    slow = with_motion(recipe, ball={"velocity_m_s": [2, 2, 0]})
    slow["quality"] = {"samples_per_pixel": 256, "max_depth": 2}
    frame = frame_of(slow)
    plans = [plan_light(frame, frame.cameras[0], 0, skip=skip) for skip in (True, False)]
    bound_px = float(step_of(plans[0]).error_bound.removesuffix(" px"))
    still, moved = (
        render_light(plan.scene, frame.cameras[0].camera, plan.request).channels({}).sum(axis=0)[:16] for plan in plans
    )
    steps = [np.abs(np.diff(still, axis=axis)).max() for axis in (0, 1)]
    assert np.abs(moved - still).max() <= bound_px * max(steps) + 0.02 * still.max()  # Monte Carlo


# When rows are exposed -----------------------------------------------------------------------------------------------


def test_rows_of_the_film_are_exposed_with_the_rows_of_the_sensor_they_lie_on(recipe: dict[str, Any]) -> None:
    fine = with_motion(recipe, line_time_s=LINE_TIME_S)
    fine["quality"]["oversampling"] = 2
    rig = frame_of(fine).cameras[0]
    middle_s = Timing.of(rig.sensors[0]).row_middle_s(rig.camera)
    assert middle_s == pytest.approx(np.repeat((np.arange(16) - 7.5) * LINE_TIME_S, 2))


def test_all_rows_of_a_global_shutter_are_exposed_at_the_scenes_time(recipe: dict[str, Any]) -> None:
    rig = frame_of(with_motion(recipe)).cameras[0]
    timing = Timing.of(rig.sensors[0])
    assert np.all(timing.row_middle_s(rig.camera) == 0)
    assert timing.window_s == 0.005


def test_of_a_bracket_the_longest_capture_counts(recipe: dict[str, Any]) -> None:
    bracket = {"exposure": {"time_s": 0.001, "bracket": {"ratios": [1, 4, 16]}}}
    assert Timing.of(frame_of(with_motion(recipe, **bracket)).cameras[0].sensors[0]).time_s == pytest.approx(0.016)


def test_an_automatic_exposure_is_found_when_it_is_rendered(recipe: dict[str, Any]) -> None:
    auto = with_motion(recipe, ball={"velocity_m_s": [40, 0, 0]}, exposure={"auto": {"max_time_s": 0.1}})
    plan = plan_of(auto)
    motion = plan.request.motion
    assert motion is not None
    assert callable(motion.exposure_time_s)
    assert "found from a first picture" in step_of(plan).why
    channels = len(plan.request.responses)
    bright, dark = (motion.exposure_time_s(np.full((channels, 16, 24), level)) for level in (1e25, 1e20))
    assert bright < dark <= 0.1


def test_the_exposure_is_part_of_the_lights_key_where_something_moves(recipe: dict[str, Any]) -> None:
    fast = {"ball": {"velocity_m_s": [40, 0, 0]}}
    keys = {key_of(with_motion(recipe, **fast, **exposed(time_s))) for time_s in (0.005, 0.006)}
    assert len(keys) == 2
    assert len({key_of(with_motion(recipe, **exposed(time_s))) for time_s in (0.005, 0.006)}) == 1


# Sensors of one camera -----------------------------------------------------------------------------------------------


@pytest.fixture
def two(recipe: dict[str, Any]) -> dict[str, Any]:
    """The ball in motion before two sensors, the second exposed a tenth as long."""
    recipe = with_motion(recipe, ball={"velocity_m_s": [40, 0, 0]})
    (phone,) = recipe["cameras"][0]["sensors"]
    recipe["cameras"][0]["sensors"].append(phone | {"name": "short", **exposed(0.0005)})
    return recipe


def test_sensors_of_other_times_get_a_light_each_where_something_moves(two: dict[str, Any]) -> None:
    lights = plan_frame(frame_of(two)).lights
    assert [[sensor.name for sensor in lit.rig.sensors] for lit in lights] == [["phone"], ["short"]]
    assert len({lit.plan.identity for lit in lights}) == 2


def test_they_share_one_where_nothing_moves_or_their_times_agree(two: dict[str, Any]) -> None:
    still = copy.deepcopy(two)
    del still["scene"]["objects"][1]["motion"]
    assert len(plan_frame(frame_of(still)).lights) == 1
    same = copy.deepcopy(two)
    same["cameras"][0]["sensors"][1]["exposure"] = {"time_s": 0.005}
    frame = frame_of(same)
    assert rigs_by_exposure(frame, frame.cameras[0]) == (frame.cameras[0],)


def test_one_light_for_sensors_of_other_times_is_refused(two: dict[str, Any]) -> None:
    frame = frame_of(two)
    with pytest.raises(FieldError, match="phone, short, which are exposed at different times"):
        plan_motion(frame, frame.cameras[0], 0)


def test_a_frame_of_two_times_has_both_pictures(two: dict[str, Any], tmp_path: Any) -> None:
    two["quality"] = {"samples_per_pixel": 16, "max_depth": 2}
    manifest = render_frame(frame_of(two), LocalStore(tmp_path), "frame")
    assert {item["name"] for item in manifest["products"]} == {"phone/image.png", "short/image.png"}
    long, short = (sensor["radiance"]["motion"] for sensor in manifest["cameras"][0]["sensors"])
    assert long["exposure_time_s"] == 0.005
    assert short is None or short["exposure_time_s"] == 0.0005


# Recipes -------------------------------------------------------------------------------------------------------------


def test_a_frame_in_motion_tells_it_in_manifest_labels_and_flow(recipe: dict[str, Any], tmp_path: Any) -> None:
    moved = with_motion(recipe, ball={"velocity_m_s": [40, 0, 0]}, line_time_s=LINE_TIME_S)
    moved |= {"outputs": ["image.png", "labels.json", "flow.exr"], "quality": {"samples_per_pixel": 16, "max_depth": 2}}
    store = LocalStore(tmp_path)
    manifest = render_frame(frame_of(moved), store, "frame")
    (camera,) = manifest["cameras"]
    motion = camera["radiance"]["motion"]
    assert motion["exposure_time_s"] == 0.005
    assert motion["moments"] >= 4
    assert motion["step_px"] <= 1.0
    shutter = camera["sensors"][0]["shutter"]
    assert shutter["scene_time_s"] == pytest.approx(0.0025 + 7.5 * LINE_TIME_S)
    labels = encode.decode_json(store.get("frame/labels.json"))
    assert {item["id"]: item["velocity"]["world_m_s"] for item in labels["objects"]} == {
        "floor": [0.0, 0.0, 0.0],
        "ball": [40.0, 0.0, 0.0],
    }


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        ({"ball": {"velocity_m_s": [1e5, 0, 0]}}, r"objects\[1\]\.motion\.velocity_m_s\[0\].*<= 10000"),
        ({"ball": {"speed_m_s": 3}}, r"objects\[1\]\.motion\.speed_m_s is not a known key"),
        ({"camera": {"yaw_rate_deg_per_s": "fast"}}, r"pose\.motion\.yaw_rate_deg_per_s.*must be a number"),
    ],
)
def test_bad_motion_is_refused(recipe: dict[str, Any], motion: dict[str, Any], message: str) -> None:
    with pytest.raises(RecipeError, match=message):
        load_recipe(with_motion(recipe, **motion))


def test_a_mounted_camera_has_no_motion_of_its_own(recipe: dict[str, Any]) -> None:
    recipe["cameras"][0]["pose"] = {"mount": {"at": "roof"}, "motion": {"velocity_m_s": [1, 0, 0]}}
    with pytest.raises(RecipeError, match="moves as the ego does"):
        load_recipe(recipe)
