"""Motion in the light: streaks and leans of known size, cameras against objects, and the same light where nothing moves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fullwell.core import FieldError
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import LightRequest, MotionRequest, SamplingGoal, activate, count_moments, render_light
from fullwell.scene import (
    BeamPattern,
    Camera,
    ConstantEnvironment,
    Cube,
    Diffuse,
    Emission,
    Film,
    GoniometricLight,
    Lens,
    Part,
    Rectangle,
    SceneDescription,
    SceneObject,
    SpotLight,
    look_at,
)
from fullwell.scene.motion import AT_REST, Motion
from fullwell.scene.moving import camera_at, scene_at

GRID = WavelengthGrid(450.0, 650.0, 50.0)
ROWS, COLS, FOCAL_PX = 48, 64, 40.0
DISTANCE_M, SPEED_M_S, EXPOSURE_S = 10.0, 200.0, 0.02
PX_PER_S = SPEED_M_S * FOCAL_PX / DISTANCE_M
STREAK_PX = PX_PER_S * EXPOSURE_S
"""16 px."""
X = np.arange(COLS) + 0.5
TO_THE_RIGHT = Motion(np.array([0.0, -SPEED_M_S, 0.0]))
"""The camera looks along +x: right in the picture is -y of the world."""
FACING = np.array([[0.0, 0.0, -1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])

RAMP = 0.05
"""Of the full light: moments are steps of one pixel, and samples of edges are few."""
SUM = 0.01
"""Of a streak's light: its edges are sampled by chance."""


def camera(*, lens: str = "pinhole") -> Camera:
    pose = look_at(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    glass = Lens(lens, 5e-3, 4.0, DISTANCE_M, Spectrum.constant(1.0))  # type: ignore[arg-type]
    return Camera("main", pose, glass, Film(ROWS, COLS, glass.image_distance_m / FOCAL_PX))


def card(name: str = "card", *, y_m: float = 0.0, width_m: float = 4.0, height_m: float = 6.0) -> SceneObject:
    """A card that shines, across the view at the distance: 16 x 24 px."""
    to_world = FACING.copy()
    to_world[:3, 3] = [DISTANCE_M, y_m, 0.0]
    lamp = Emission(Spectrum.constant(1.0))
    return SceneObject(
        name, "", (Part(Rectangle((width_m, height_m)), Diffuse(Spectrum.constant(0.0)), emission=lamp),), to_world
    )


SHINING = SceneDescription((card(),))


def request(motion: MotionRequest | None = None, *, samples: int = 64, bands: bool = False, depth: int = 2) -> LightRequest:
    goal = SamplingGoal(noise_ratio=None, samples_per_pixel=samples)
    return LightRequest(GRID, (Spectrum.constant(1.0),), keep_bands=bands, max_depth=depth, goal=goal, seed=1, motion=motion)


def moving(
    motions: Mapping[str, Motion],
    camera_motion: Motion = AT_REST,
    *,
    line_time_s: float = 0.0,
    exposure_s: Any = EXPOSURE_S,
    px_per_s: float = PX_PER_S,
    most: int = 64,
) -> MotionRequest:
    middle_s = (np.arange(ROWS) - (ROWS - 1) / 2) * line_time_s
    return MotionRequest(motions, camera_motion, middle_s, exposure_s, {}, lambda time_s: px_per_s * time_s, 0.25, most)


def picture(scene: SceneDescription, motion: MotionRequest | None = None, **more: Any) -> NDArray[np.float64]:
    view = more.pop("view", None) or camera()
    return render_light(scene, view, request(motion, **more)).channels({})[0]


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    if not activate().variant().startswith("llvm"):
        pytest.skip("motion needs LLVM")


@pytest.fixture(scope="module")
def still() -> NDArray[np.float64]:
    return picture(SHINING)


def test_a_card_that_moves_is_a_trapezoid_with_ramps_of_the_streaks_length(still: NDArray[np.float64]) -> None:
    streak = picture(SHINING, moving({"card": TO_THE_RIGHT}))
    # The card's edges are at 24 and 40 px in the middle of the exposure; a pixel is lit while the card is before it.
    left, right = X - (COLS / 2 - 8), (COLS / 2 + 8) - X
    shares = np.clip(np.minimum(left, right) / STREAK_PX + 0.5, 0.0, 1.0)
    mean = streak[16:32].mean(axis=0) / still.max()
    assert mean == pytest.approx(shares, abs=RAMP)
    assert np.all(streak[:, X < COLS / 2 - 8 - STREAK_PX / 2] == 0)


def test_a_streak_has_all_the_light_of_the_thing_that_made_it(still: NDArray[np.float64]) -> None:
    streak = picture(SHINING, moving({"card": TO_THE_RIGHT}))
    assert streak.sum() == pytest.approx(still.sum(), rel=SUM)


def test_a_camera_that_moves_sees_the_world_move_the_other_way() -> None:
    by_object = picture(SHINING, moving({"card": TO_THE_RIGHT}))
    by_camera = picture(SHINING, moving({}, Motion(-TO_THE_RIGHT.velocity_m_s)))
    # The very same samples, traced in a world that is moved by whole roundings: a sample at an edge may fall to either side.
    assert by_camera == pytest.approx(by_object, abs=RAMP * by_object.max())
    assert by_camera.sum() == pytest.approx(by_object.sum(), rel=SUM)


def test_what_moves_with_the_camera_is_as_sharp_as_at_rest(still: NDArray[np.float64]) -> None:
    together = picture(SHINING, moving({"card": TO_THE_RIGHT}, TO_THE_RIGHT))
    assert together == pytest.approx(still, abs=RAMP * still.max())
    assert together[24, 20] == 0


def test_a_thing_that_turns_sweeps_the_arc_of_its_turn() -> None:
    half_m, turn_rad = 4.0, math.radians(60.0)
    bar = SceneDescription((card(width_m=2 * half_m, height_m=3.0),))
    turning = Motion(np.zeros(3), yaw_rate_rad_s=turn_rad / EXPOSURE_S, pivot_m=np.array([DISTANCE_M, 0.0, 0.0]))
    swept = picture(bar, moving({"card": turning}, px_per_s=30 / EXPOSURE_S))
    # Turned by a, its right edge is seen at f half cos(a) / (Z + half sin(a)); the radiance of a lamp does not change.
    angles = np.linspace(-turn_rad / 2, turn_rad / 2, 20_001)
    edge_px = FOCAL_PX * half_m * np.cos(angles) / (DISTANCE_M + half_m * np.sin(angles))
    shares = np.array([np.clip(edge_px - (x - 0.5), 0.0, 1.0).mean() for x in np.abs(X - COLS / 2)])
    assert swept[22:26].mean(axis=0) / swept.max() == pytest.approx(shares, abs=2 * RAMP)


@pytest.mark.parametrize("exposure_s", [1e-5, 5e-3])
def test_a_rolling_shutter_leans_upright_edges_by_the_line_time(exposure_s: float) -> None:
    line_time_s = 5e-4
    leaning = picture(SHINING, moving({"card": TO_THE_RIGHT}, line_time_s=line_time_s, exposure_s=exposure_s))
    rows = np.arange(12, 36)
    centre = (leaning[rows] * X).sum(axis=1) / leaning[rows].sum(axis=1)
    slope, offset = np.polyfit(rows - (ROWS - 1) / 2, centre, 1)
    assert slope == pytest.approx(PX_PER_S * line_time_s, rel=0.03)
    # The middle of the middle row's exposure is the scene's own time.
    assert offset == pytest.approx(COLS / 2, abs=0.1)
    width = leaning[rows].sum(axis=1) / leaning.max()
    assert width.mean() == pytest.approx(16.0, rel=SUM)
    assert np.abs(centre - (offset + slope * (rows - (ROWS - 1) / 2))).max() < 0.6  # half a moment's step, and samples


def test_the_rows_of_a_global_shutter_do_not_lean() -> None:
    straight = picture(SHINING, moving({"card": TO_THE_RIGHT}))
    centre = (straight[12:36] * X).sum(axis=1) / straight[12:36].sum(axis=1)
    slope, offset = np.polyfit(np.arange(24) - 11.5, centre, 1)
    assert abs(slope) < 0.01
    assert offset == pytest.approx(COLS / 2, abs=0.1)


def test_spectral_bands_see_every_moment(still: NDArray[np.float64]) -> None:
    light = render_light(SHINING, camera(), request(moving({"card": TO_THE_RIGHT}), samples=256, bands=True))
    bands = light.bands
    assert bands is not None
    shares = bands[0, 16:32].mean(axis=0) / bands[0, 16:32, COLS // 2].mean(axis=0)
    left, right = X - (COLS / 2 - 8), (COLS / 2 + 8) - X
    expected = np.clip(np.minimum(left, right) / STREAK_PX + 0.5, 0.0, 1.0)
    assert shares == pytest.approx(np.repeat(expected[:, None], GRID.count, axis=1), abs=0.08)


def test_what_stands_still_is_the_same_light_as_without_motion() -> None:
    """All moments' samples together are the sequence of a still picture: no noise is added where nothing changes."""
    wall = SceneObject("wall", "", (Part(Rectangle((30.0, 30.0)), Diffuse(Spectrum.constant(0.5))),), behind())
    sky = ConstantEnvironment(Spectrum.constant(1.0))
    small = replace(card(y_m=-6.0, width_m=0.2, height_m=0.2), id="card")
    scene = SceneDescription((wall, replace(small, parts=(replace(small.parts[0], emission=None),))), (sky,))
    alone = picture(scene, samples=64)
    beside = picture(scene, moving({"card": Motion(np.array([0.0, 0.0, 20.0]))}, px_per_s=80.0), samples=64)
    apart = np.abs(beside / alone - 1.0)[:, : COLS // 4]
    # All but a path or two, which come by the card from far away, to the order of the sums.
    assert np.quantile(apart, 0.99) < 1e-6
    assert apart.max() < 0.05


def behind() -> NDArray[np.float64]:
    to_world = FACING.copy()
    to_world[:3, 3] = [DISTANCE_M + 5.0, 0.0, 0.0]
    return to_world


def test_a_lamp_moves_with_the_object_that_carries_it() -> None:
    """Its light on the wall behind is a streak of its own length, seen at the wall's distance."""
    wall = SceneObject("wall", "", (Part(Rectangle((60.0, 60.0)), Diffuse(Spectrum.constant(0.5))),), behind())
    lamp = SpotLight((DISTANCE_M, 0.0, 0.0), (1.0, 0.0, 0.0), Spectrum.constant(1.0), 20.0, 25.0, carrier="carrier")
    scene = SceneDescription((wall,), (lamp,))
    spot = picture(scene, samples=16)
    streak = picture(scene, moving({"carrier": TO_THE_RIGHT}), samples=16)
    scale = FOCAL_PX * SPEED_M_S * EXPOSURE_S / (DISTANCE_M + 5.0)

    def spread(light: NDArray[np.float64]) -> float:
        weights = light.sum(axis=0) / light.sum()
        return float((weights * (X - (weights * X).sum()) ** 2).sum())

    assert spread(streak) - spread(spot) == pytest.approx(scale**2 / 12, rel=0.05)  # the variance of an even spread
    assert streak.sum() == pytest.approx(spot.sum(), rel=SUM)


def test_a_thin_lens_sees_the_same_streak() -> None:
    streak = picture(SHINING, moving({"card": TO_THE_RIGHT}), view=camera(lens="thin_lens"))
    by_pinhole = picture(SHINING, moving({"card": TO_THE_RIGHT}))
    assert streak[16:32].mean(axis=0) == pytest.approx(by_pinhole[16:32].mean(axis=0), abs=RAMP * by_pinhole.max())


# Nothing moves, or not far enough ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "motion",
    [
        pytest.param(moving({"card": TO_THE_RIGHT}, px_per_s=0.2 / EXPOSURE_S), id="below the threshold"),
        pytest.param(moving({}, AT_REST, px_per_s=0.0), id="nothing"),
    ],
)
def test_no_motion_is_no_other_light(motion: MotionRequest) -> None:
    sky = SceneDescription((), (ConstantEnvironment(Spectrum.constant(1.0)),))
    moved, plain = (render_light(sky, camera(), request(given, samples=8)) for given in (motion, None))
    np.testing.assert_array_equal(moved.replicas, plain.replicas)
    assert moved.statistics.moments == 1


def test_a_scene_at_its_own_time_is_the_very_scene() -> None:
    view = camera()
    assert scene_at(SHINING, {"card": TO_THE_RIGHT}, 0.0) is SHINING
    assert scene_at(SHINING, {"card": AT_REST, "other": TO_THE_RIGHT}, 1.0).objects == SHINING.objects
    assert camera_at(view, AT_REST, 1.0) is view


def test_lamps_with_a_pattern_turn_with_the_object_that_carries_them() -> None:
    pattern = BeamPattern(np.ones((2, 2), dtype=np.float32), (-10.0, 10.0), (-10.0, 10.0))
    lamp = GoniometricLight((2.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), pattern, Spectrum.constant(1.0), carrier="car")
    other = replace(lamp, carrier="")
    quarter = Motion(np.array([0.0, 4.0, 0.0]), math.pi / 2, np.zeros(3))
    moved = scene_at(SceneDescription((), (lamp, other)), {"car": quarter}, 1.0)
    assert moved.lights[1] is other
    assert isinstance(moved.lights[0], GoniometricLight)
    assert moved.lights[0].position_m == pytest.approx((0.0, 6.0, 1.0))
    assert moved.lights[0].forward == pytest.approx((0.0, 1.0, 0.0))
    assert moved.lights[0].up == pytest.approx((0.0, 0.0, 1.0))


def test_an_automatic_exposure_is_found_from_the_still_scene(still: NDArray[np.float64]) -> None:
    seen: list[NDArray[np.float64]] = []

    def metered(light: NDArray[np.float64]) -> float:
        seen.append(light)
        return EXPOSURE_S

    light = render_light(SHINING, camera(), request(moving({"card": TO_THE_RIGHT}, exposure_s=metered)))
    assert [part.shape for part in seen] == [(1, ROWS, COLS)]
    assert seen[0][0].sum() == pytest.approx(still.sum(), rel=SUM)
    assert light.statistics.exposure_time_s == EXPOSURE_S
    assert light.statistics.moments == 16
    assert light.statistics.moment_step_px == pytest.approx(1.0)


# The same everywhere -------------------------------------------------------------------------------------------------


def furnished() -> SceneDescription:
    box = SceneObject("box", "", (Part(Cube((2.0, 2.0, 2.0)), Diffuse(Spectrum.constant(0.6))),), placed(9.0, 2.0))
    wall = SceneObject("wall", "", (Part(Rectangle((30.0, 30.0)), Diffuse(Spectrum.constant(0.5))),), behind())
    return SceneDescription((wall, box, card(width_m=1.0, height_m=1.0)))


def placed(x_m: float, y_m: float) -> NDArray[np.float64]:
    to_world = np.eye(4)
    to_world[:2, 3] = x_m, y_m
    return to_world


def test_motion_has_the_same_bytes_for_any_number_of_threads() -> None:
    import drjit as dr

    motion = moving({"card": TO_THE_RIGHT, "box": Motion(np.array([0.0, 30.0, 0.0]))}, line_time_s=1e-4)
    before = dr.thread_count()
    found = []
    try:
        for threads in (1, 3):
            dr.set_thread_count(threads)
            found.append(render_light(furnished(), camera(), request(motion, samples=16, bands=True, depth=4)))
    finally:
        dr.set_thread_count(before)
    np.testing.assert_array_equal(found[0].replicas, found[1].replicas)
    np.testing.assert_array_equal(found[0].bands, found[1].bands)


def test_moments_compile_nothing_anew() -> None:
    import drjit as dr

    motion = moving({"card": TO_THE_RIGHT}, most=4)
    picture(furnished(), motion, samples=16)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        picture(furnished(), moving({"card": TO_THE_RIGHT}, most=8), samples=16)
        launched = [kernel for kernel in dr.kernel_history() if kernel["type"] == dr.KernelType.JIT]
    assert launched
    assert all(kernel["cache_hit"] for kernel in launched)
    assert len({kernel["hash"] for kernel in launched if kernel["operation_count"] > 1000}) == 1


# Moments -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shift_px", "most", "count"),
    [(0.25, 64, 1), (0.3, 64, 4), (4.0, 64, 4), (5.0, 64, 8), (100.0, 64, 64), (math.inf, 16, 16), (0.0, 64, 1)],
)
def test_moments_are_a_pixel_long_where_they_may_be(shift_px: float, most: int, count: int) -> None:
    assert count_moments(shift_px, least_px=0.25, most=most) == count


def test_without_the_compiled_renderer_motion_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from fullwell.render import light

    class Scalar:
        def variant(self) -> str:
            return "scalar_spectral"

    monkeypatch.setattr(light, "activate", Scalar)
    with pytest.raises(FieldError, match="motion_blur_px"):
        render_light(SHINING, camera(), request(moving({"card": TO_THE_RIGHT})))
