"""What the planner leaves out changes a picture by less than it says: rendered with and without."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fullwell.pipeline.culling import leave_out, object_bounds, out_of_view, relative_changes
from fullwell.pipeline.lighting import LightPlan, plan_light
from fullwell.pipeline.path_depth import largest_reflectance, tail_bound
from fullwell.pipeline.steps import PlanStep
from fullwell.render import RenderedLight, render_light
from fullwell.scene import SceneDescription
from fullwell.schema import build_frame, load_recipe
from fullwell.schema.frame import FrameDescription

Array = NDArray[np.float64]

TILE = 8
STANDARD_ERRORS = 4.0
SKY_CD_M2, SUN_LUX = 1000.0, 6000.0
FULL = 1.0 + SUN_LUX / (np.pi * SKY_CD_M2)
"""Radiance of a white surface in full light, over that of the sky."""


def box(name: str, size: tuple[float, float, float], place: tuple[float, float, float], material: Any = 0.2) -> dict[str, Any]:
    """A box that stands on z = 0 at `place`."""
    surface = {"kind": "diffuse", "reflectance": material} if isinstance(material, float) else material
    return {
        "id": name,
        "geometry": {"kind": "cube", "size_m": list(size)},
        "material": surface,
        "transform": {"translate_m": [place[0], place[1], place[2] + size[2] / 2]},
    }


def frame_of(objects: list[dict[str, Any]], lights: list[dict[str, Any]], **quality: Any) -> FrameDescription:
    """A frame of 48 x 32 film samples, seen from 1.6 m above the origin along +y."""
    pose = {"origin_m": [0, 0, 1.6], "target_m": [0, 10, 1.6]}
    sensor = {"name": "s", "model": "imx363", "rows": 32, "cols": 48, "exposure": {"time_s": 0.005}}
    lens = {"kind": "pinhole", "hfov_deg": 60, "f_number": 2}
    recipe = {
        "schema": "fullwell/recipe/v1",
        "name": "skips",
        "seed": 7,
        "scene": {"objects": objects, "lights": lights},
        "cameras": [{"name": "main", "pose": pose, "lens": lens, "sensors": [sensor]}],
        "outputs": ["image.png"],
        "quality": {"samples_per_pixel": 1024, "max_depth": 8} | quality,
    }
    return build_frame(load_recipe(recipe), 0)


SKY = {"name": "sky", "kind": "constant_environment", "luminance_cd_m2": SKY_CD_M2, "spd": "D65"}
SUN = {"name": "sun", "kind": "directional", "direction": [0.6, 0.5, -1.0], "illuminance_lux": SUN_LUX, "spd": "D65"}


def ground(reflectance: float) -> dict[str, Any]:
    return box("ground", (8000, 8000, 0.2), (0, 0, -0.2), reflectance)


def street(reflectance: float = 0.1, behind: int = 60) -> list[dict[str, Any]]:
    """Houses to both sides before the camera, boxes on the ground far behind it, and one near."""
    houses = [box(f"house_{s}_{n}", (8, 9, 8), (s * 9, 10 + 10 * n, 0), reflectance) for s in (-1, 1) for n in range(5)]
    places = [(-60 + 4.0 * (n % 30), -900 - 40.0 * (n // 10), 0) for n in range(behind)]
    crowd = [box(f"far_{n}", (1.2, 2.0, 0.8), place, reflectance) for n, place in enumerate(places)]
    return [ground(reflectance), *houses, box("near", (1, 1, 2), (1.0, -2.5, 0), reflectance), *crowd]


def step_of(plan: LightPlan, what: str) -> PlanStep:
    return next(step for step in plan.steps if step.what == f"main: {what}")


def render(frame: FrameDescription, plan: LightPlan, scene: SceneDescription | None = None, seed: int = 1) -> RenderedLight:
    request = replace(plan.request, seed=seed, targets=(), goal=replace(plan.request.goal, noise_ratio=None))
    return render_light(scene or plan.scene, frame.cameras[0].camera, request)


def tiles(light: RenderedLight) -> Array:
    """(replicas, channels, tiles) means."""
    replicas = light.replicas[:, 0].astype(np.float64)
    count, channels, rows, cols = replicas.shape
    cut = replicas.reshape(count, channels, rows // TILE, TILE, cols // TILE, TILE)
    return cut.mean(axis=(3, 5)).reshape(count, channels, -1)


def sky_of(frame: FrameDescription, plan: LightPlan) -> Array:
    """(channels,) of the sky alone."""
    nothing = replace(frame.scene, objects=(), lights=frame.scene.lights[:1])
    return tiles(render(frame, plan, nothing)).mean(axis=(0, 2))


def difference(one: RenderedLight, other: RenderedLight) -> tuple[Array, Array]:
    """(channels, tiles) differences of tiles and their standard errors, those of their replicas pooled over all tiles."""
    apart = tiles(one) - tiles(other)
    spread = np.sqrt((apart.var(axis=0, ddof=1) / len(apart)).mean(axis=1, keepdims=True))
    return apart.mean(axis=0), np.broadcast_to(spread, apart.shape[1:])


def both(frame: FrameDescription) -> tuple[LightPlan, LightPlan]:
    rig = frame.cameras[0]
    return plan_light(frame, rig, 0), plan_light(frame, rig, 0, skip=False)


def direct(plan: LightPlan, frame: FrameDescription) -> LightPlan:
    """The plan without skips, but with the channels of the other one: the two are compared."""
    return replace(plan, scene=frame.scene, request=replace(plan.request, max_depth=frame.quality.max_depth))


@pytest.mark.slow
def test_a_street_looks_the_same_without_what_is_far_behind() -> None:
    frame = frame_of(street(), [SKY, SUN])
    plan, whole = both(frame)
    step = step_of(plan, "objects out of view")
    gone = {item.id for item in frame.scene.objects} - {item.id for item in plan.scene.objects}
    assert len(gone) > 10
    assert "near" not in gone
    assert whole.scene is frame.scene
    assert whole.request.max_depth == 8
    bound = float(step.error_bound.split()[0])
    assert bound <= 2e-3
    depth_bound = tail_bound(0.1, plan.request.max_depth)
    assert plan.request.max_depth < 8
    sky = sky_of(frame, plan)
    allowed = 0.1 * FULL * sky * (bound + depth_bound)
    apart, error = difference(render(frame, plan), render(frame, direct(plan, frame), seed=1))
    assert np.all(np.abs(apart) <= allowed[:, None] + STANDARD_ERRORS * error)


@pytest.mark.slow
@pytest.mark.parametrize("reflectance", [0.1, 0.3])
def test_things_near_by_change_no_more_than_their_bound(reflectance: float) -> None:
    """Things are taken away that the planner keeps: what that changes is seen, and below the bound."""
    near = [box(f"near_{n}", (1, 1, 3), (2.0 * n - 3, -12, 0), reflectance) for n in range(4)]
    wall = box("wall", (20, 1, 12), (0, 3, 0), reflectance)
    frame = frame_of([ground(reflectance), wall, *near], [SKY, SUN | {"direction": [0.1, 0.1, -1.0]}])
    plan, _ = both(frame)
    rig = frame.cameras[0]
    assert leave_out(frame.scene, rig.camera, frame.grid)[0] is frame.scene
    assert out_of_view(object_bounds(frame.scene), rig.camera).tolist() == [False, False, True, True, True, True]
    bound = float(relative_changes(frame.scene, rig.camera, frame.grid)[2:].sum())
    fewer = replace(frame.scene, objects=frame.scene.objects[:2])
    apart, error = difference(render(frame, plan, fewer), render(frame, plan, frame.scene))
    assert bound < 0.5
    allowed = bound * reflectance * FULL * sky_of(frame, plan)
    assert np.all(np.abs(apart) <= allowed[:, None] + STANDARD_ERRORS * error)
    assert np.any(np.abs(apart) > STANDARD_ERRORS * error), "the test would notice a change"


@pytest.mark.slow
def test_a_dark_room_looks_the_same_with_shorter_paths() -> None:
    corners = [[-0.5, 3.5, 3.9], [-0.5, 4.5, 3.9], [0.5, 4.5, 3.9], [0.5, 3.5, 3.9]]
    panel = {"kind": "quad", "corners_m": corners}
    lamp = {"name": "lamp", "kind": "area", "geometry": panel, "luminance_cd_m2": 5000, "spd": "A"}
    sides = [
        box("left", (0.2, 12, 4), (-3, 4, 0)),
        box("right", (0.2, 12, 4), (3, 4, 0)),
        box("back", (6, 0.2, 4), (0, 9, 0)),
        box("front", (6, 0.2, 4), (0, -2, 0)),
        box("floor", (6, 12, 0.2), (0, 4, -0.2)),
        box("ceiling", (6, 12, 0.2), (0, 4, 4)),
    ]
    frame = frame_of([*sides, box("cupboard", (1, 1, 2), (1, 6, 0))], [lamp])
    plan, _ = both(frame)
    assert plan.scene.objects == frame.scene.objects
    assert plan.request.max_depth == 6
    reflectance = largest_reflectance(frame.scene, frame.grid).value
    brightest = tiles(render(frame, replace(plan, request=replace(plan.request, max_depth=2)))).mean(axis=0).max(axis=1)
    allowed = tail_bound(reflectance, 6) * brightest
    apart, error = difference(render(frame, plan), render(frame, direct(plan, frame)))
    assert np.all(np.abs(apart) <= allowed[:, None] + STANDARD_ERRORS * error)


def test_where_a_mirror_stands_nothing_is_left_out() -> None:
    mirror = {"kind": "mirror", "reflectance": 0.9}
    frame = frame_of([*street(behind=10), box("mirror", (2, 0.1, 2), (0, 7, 0), mirror)], [SKY, SUN], samples_per_pixel=16)
    plan, _ = both(frame)
    assert plan.scene is frame.scene
    assert plan.request.max_depth == 8
    assert np.array_equal(render(frame, plan).replicas, render(frame, direct(plan, frame)).replicas)
