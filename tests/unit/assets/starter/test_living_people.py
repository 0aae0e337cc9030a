"""Bodies: segments in published proportion, gaits that step as people do, riders that hold on."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.assets.starter.bodies import SIDES, Build, posed, reaching, running, standing, walking
from fullwell.assets.starter.people import pedestrian
from fullwell.assets.starter.riding import Contacts, seated

BUILDS = [Build(1.52, "f"), Build(1.68, "f"), Build(1.76, "m"), Build(1.93, "m", girth=1.1)]
SEGMENTS = {
    # Over stature: span of Drillis & Contini 1966, Winter 2009 (5th to 95th percentiles lie within).
    ("hip", "knee"): (0.235, 0.255),
    ("knee", "ankle"): (0.236, 0.256),
    ("shoulder", "elbow"): (0.176, 0.196),
    ("elbow", "wrist"): (0.136, 0.156),
}
SOLE_M = 0.022


def rng() -> np.random.Generator:
    return np.random.Generator(np.random.Philox(7))


@pytest.mark.parametrize("build", BUILDS)
@pytest.mark.parametrize("pose", [standing(), walking(0.3), running(0.7)], ids=["standing", "walking", "running"])
def test_bones_keep_published_lengths_in_any_pose(build: Build, pose: object) -> None:
    skeleton = posed(build, pose)  # type: ignore[arg-type]
    for (first, second), (low, high) in SEGMENTS.items():
        for side in SIDES:
            length = np.linalg.norm(skeleton.joints_m[f"{first}_{side}"] - skeleton.joints_m[f"{second}_{side}"])
            assert low <= length / build.stature_m <= high


@pytest.mark.parametrize(
    ("stature_m", "sex", "child"), [(1.62, "f", False), (1.84, "m", False), (1.20, "f", True), (1.45, "m", True)]
)
def test_a_person_is_as_tall_as_asked(stature_m: float, sex: str, child: bool) -> None:
    asset = pedestrian(rng(), stature_m=stature_m, sex=sex, child=child, posture="standing", head="fringe")  # type: ignore[arg-type]
    skin = next(part.shape for part in asset.parts if part.name == "skin")
    assert float(skin.vertices_m[:, 2].max()) - SOLE_M == pytest.approx(stature_m, rel=0.02)
    eye = float(asset.attributes["eye_height_m"]) - SOLE_M
    assert 0.89 <= eye / stature_m <= 0.95  # Drillis & Contini: 0.936 for adults


def test_children_have_larger_heads_and_shorter_legs() -> None:
    small, tall = Build(1.10, "f", child=True).lengths_m(), Build(1.70, "f").lengths_m()
    assert small["head"] / 1.10 == pytest.approx(1 / 5.6, rel=0.08)  # Domljan et al. 2024: about 5.5 heads at six years
    assert tall["head"] / 1.70 == pytest.approx(0.130, rel=1e-9)
    assert small["hip_height"] / 1.10 < tall["hip_height"] / 1.70


def test_both_feet_of_a_standing_person_are_on_the_ground() -> None:
    asset = pedestrian(rng(), stature_m=1.75, sex="m", posture="standing")
    lows = [float(part.shape.vertices_m[:, 2].min()) for part in asset.parts if part.name.startswith("soles")]
    assert len(lows) == 2
    assert max(lows) < 0.015


@pytest.mark.parametrize("build", BUILDS)
def test_a_walking_step_is_as_long_as_people_step(build: Build) -> None:
    skeleton = posed(build, walking(0.0))
    step = skeleton.joints_m["ankle_left"][0] - skeleton.joints_m["ankle_right"][0]
    assert 0.34 <= step / build.stature_m <= 0.48  # Murray et al. 1964: 0.41 to 0.45 at free speed


def test_arms_swing_against_the_legs() -> None:
    skeleton = posed(BUILDS[1], walking(0.0))
    ahead = {side: skeleton.joints_m[f"wrist_{side}"][0] - skeleton.joints_m[f"shoulder_{side}"][0] for side in SIDES}
    assert ahead["right"] > ahead["left"] + 0.2


def test_half_a_stride_later_left_and_right_have_changed_places() -> None:
    first, later = posed(BUILDS[2], walking(0.2)), posed(BUILDS[2], walking(0.7))
    flip = np.array([1.0, -1.0, 1.0])
    for joint in ("knee", "ankle", "elbow", "wrist"):
        assert np.allclose(first.joints_m[f"{joint}_left"], later.joints_m[f"{joint}_right"] * flip, atol=1e-9)


def test_a_runner_folds_the_swinging_leg() -> None:
    skeleton = posed(BUILDS[2], running(0.2))
    thigh = skeleton.joints_m["knee_right"] - skeleton.joints_m["hip_right"]
    shank = skeleton.joints_m["ankle_right"] - skeleton.joints_m["knee_right"]
    bend = np.rad2deg(np.arccos(thigh @ shank / np.linalg.norm(thigh) / np.linalg.norm(shank)))
    assert 85 <= bend <= 125  # Novacheck 1998: about 105 degrees


def test_two_bones_reach_their_target_and_no_further_than_they_can() -> None:
    start, near, far = np.zeros(3), np.array([0.3, 0.1, -0.2]), np.array([2.0, 0.0, 0.0])
    middle, end = reaching(start, near, 0.3, 0.25, np.array([0.0, 0.0, -1.0]))
    assert np.allclose(end, near)
    assert np.linalg.norm(middle - start) == pytest.approx(0.3)
    assert np.linalg.norm(end - middle) == pytest.approx(0.25)
    _, end = reaching(start, far, 0.3, 0.25, np.array([0.0, 0.0, -1.0]))
    assert np.linalg.norm(end) == pytest.approx(0.55, rel=0.01)


@pytest.mark.parametrize("build", BUILDS[1:])
def test_a_rider_holds_the_grips_and_stands_on_the_pedals(build: Build) -> None:
    scale = build.stature_m / 1.75
    grips = (np.array([0.38, 0.29, 1.05]), np.array([0.38, -0.29, 1.05]))
    pedals = (np.array([0.10, 0.12, 0.42]), np.array([-0.10, -0.12, 0.14]))
    contacts = Contacts(np.array([-0.22, 0.0, 0.90 * scale + 0.02]), grips, pedals)
    skeleton = seated(build, contacts)
    for index, side in enumerate(SIDES):
        assert np.linalg.norm(skeleton.joints_m[f"grip_{side}"] - grips[index]) < 0.06
        sole = skeleton.joints_m[f"ball_{side}"] - pedals[index]
        assert abs(sole[0]) < 0.04
        assert 0.0 < sole[2] < 0.08
        for (first, second), (low, high) in SEGMENTS.items():
            length = np.linalg.norm(skeleton.joints_m[f"{first}_{side}"] - skeleton.joints_m[f"{second}_{side}"])
            assert low <= length / build.stature_m <= high


def test_clothes_lie_outside_of_the_skin_of_the_legs() -> None:
    bare = pedestrian(rng(), stature_m=1.75, sex="m", posture="standing", top="tshirt", bottom="shorts")
    dressed = pedestrian(rng(), stature_m=1.75, sex="m", posture="standing", top="tshirt", bottom="straight")
    legs = next(part.shape for part in bare.parts if part.name == "skin").vertices_m
    trousers = next(part.shape for part in dressed.parts if part.name == "trousers").vertices_m
    for height in (0.25, 0.35, 0.55):
        inner = legs[np.abs(legs[:, 2] - height) < 0.02]
        outer = trousers[np.abs(trousers[:, 2] - height) < 0.02]
        assert np.ptp(outer[:, 1]) > np.ptp(inner[:, 1])
        assert np.ptp(outer[:, 0]) > np.ptp(inner[:, 0])
