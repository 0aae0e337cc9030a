"""Adaptive sampling, clamping and light groups in scenes that are hard on them: they end, and they say what they did."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hostile_scenes import BLACK, DOME, GREY, constant, ground, lamp, lit, made, shifted
from numpy.typing import NDArray
from test_analytic_scenes import ANALYTIC_TOLERANCE, ONE, camera, pytestmark  # noqa: F401

from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import LightRequest, RenderedLight, SamplingGoal, render_light
from fullwell.scene import (
    Camera,
    Disk,
    Emission,
    Mirror,
    Part,
    PointLight,
    Rectangle,
    SceneDescription,
    SceneObject,
)

GRID = WavelengthGrid(500.0, 600.0, 50.0)
VIEW = camera(rows=24, cols=32)
CAP = 1024
FIRST_ROUND = 16
"""Samples per pixel before anything is decided."""

TYPICAL_LIGHT = 1e20
"""What a channel counts of the grey ground under a dome of 1 W sr^-1 m^-2 nm^-1, order of magnitude."""


class ShotNoise:
    """A sensor whose noise grows with the root of the light, above a floor."""

    key = "one channel"

    def __init__(self, full_well: float = np.inf) -> None:
        self._full_well = full_well

    def channels(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        return light

    def __call__(self, channels: NDArray[np.float64], sure: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        return 1e-4 * TYPICAL_LIGHT * (channels + 1e-3 * TYPICAL_LIGHT)

    def saturation(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.full(len(light), self._full_well)


def rendered(scene: SceneDescription, view: Camera, goal: SamplingGoal, target: ShotNoise | None, **more) -> RenderedLight:
    targets = () if target is None else (((), target),)
    request = LightRequest(
        grid=GRID, responses=(constant(1.0),), **({"keep_bands": False, "goal": goal, "targets": targets, "seed": 3} | more)
    )
    light = render_light(scene, view, request)
    assert np.all(np.isfinite(light.replicas))
    return light


def adaptive(scene: SceneDescription, view: Camera = VIEW, **more) -> RenderedLight:
    return rendered(scene, view, SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=CAP), ShotNoise(), **more)


def even(scene: SceneDescription, samples: int, *, clamp: float | None = None, well: float = np.inf, **more) -> RenderedLight:
    goal = SamplingGoal(noise_ratio=None, samples_per_pixel=samples, clamp_saturation=clamp)
    return rendered(scene, VIEW, goal, ShotNoise(well), **more)


def small_sun(solid_angle_sr: float) -> SceneObject:
    """Return a disk 10 m above the origin of this solid angle that sends down 1 W m^-2 nm^-1."""
    radius_m = 10 * np.sqrt(solid_angle_sr / np.pi)
    down = shifted(z=10.0) @ np.diag([1.0, -1.0, -1.0, 1.0])
    part = Part(Disk(radius_m), BLACK, emission=Emission(constant(1.0 / solid_angle_sr)))
    return SceneObject("sun", "", (part,), down)


def test_black_scene_ends_after_the_first_round() -> None:
    for scene in (SceneDescription((ground(),)), SceneDescription((ground(BLACK),), DOME), SceneDescription(())):
        light = adaptive(scene)
        assert light.replicas.max() == 0.0
        statistics = light.statistics
        assert (statistics.samples_max, statistics.passes, statistics.unmet_tiles) == (FIRST_ROUND, 1, 0)
        assert statistics.stopped_by == "target"


def test_sun_in_a_mirror_stops_at_the_cap_and_says_which_tiles_are_noisy() -> None:
    """The sun's image fills a tenth of one film sample."""
    mirror = made(Rectangle((20.0, 20.0)), Mirror(constant(1.0)), name="mirror")
    view = camera(origin=(1e-2, 0.0, 5.0), target=(0, 0, 0), rows=24, cols=32, hfov_deg=4)
    statistics = adaptive(SceneDescription((mirror, small_sun(1e-6))), view).statistics
    assert statistics.stopped_by == "samples"
    assert 1 <= statistics.unmet_tiles <= 4
    assert statistics.tiles == 12
    assert statistics.samples_max == CAP
    # All tiles are near the sun's: they get more than the first round, until they stand for themselves.
    assert FIRST_ROUND < statistics.samples_min < CAP
    assert statistics.noise_ratio_max > 0.5


def test_one_film_sample_is_a_tile_of_its_own() -> None:
    """It tells its error from four numbers, so that it may end too soon, but never beyond the cap."""
    scene = SceneDescription((ground(), lamp(Rectangle((4.0, 4.0)))))
    view = camera(origin=(3, 0, 1), target=(0.5, 0, 0), rows=1, cols=1, hfov_deg=1)
    light = adaptive(scene, view)
    assert light.replicas.shape[-2:] == (1, 1)
    assert (light.statistics.tiles, light.statistics.stopped_by) == (1, "target")
    assert FIRST_ROUND <= light.statistics.samples_max <= CAP
    goal = SamplingGoal(noise_ratio=None, samples_per_pixel=16384)
    exact = rendered(scene, view, goal, None).replicas.mean()
    noise = np.sqrt(ShotNoise()(np.array(exact, dtype=float)))
    assert exact > 0
    assert abs(light.replicas.mean() - exact) < 3 * 0.5 * noise


def test_lamp_of_1e12_w_is_sampled_like_any_other_by_a_sensor_that_is_exposed_for_it() -> None:
    class Exposed(ShotNoise):
        def __call__(self, channels: NDArray[np.float64], sure: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
            return 1e-4 * channels.max() * (channels + 1e-3 * channels.max())

    goal = SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=CAP)
    found = []
    for power_w in (1.0, 1e12):
        bulb = PointLight((0, 0, 2), constant(power_w / (4 * np.pi)))
        light = rendered(
            SceneDescription((ground(), made(Rectangle(), GREY, shifted(1, 0, 0.5))), (bulb,)), VIEW, goal, Exposed()
        )
        found.append(
            (light.statistics.samples_per_pixel, light.statistics.stopped_by, light.replicas.mean(dtype=float) / power_w)
        )
    assert found[0][:2] == found[1][:2]
    assert found[1][1] == "target"
    assert found[1][2] == pytest.approx(found[0][2], rel=1e-4)


def fireflies() -> SceneDescription:
    """Return the ground under a small sun and its image in a mirror, which only chance finds."""
    tilted = np.eye(4)
    tilted[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    tilted[:3, 3] = [-1.5, 0, 1.0]
    mirror = made(Rectangle((4.0, 4.0)), Mirror(constant(1.0)), tilted, "mirror")
    bulb = PointLight((0, 0, 3), constant(1.0))
    sun = replace(
        small_sun(1e-2), to_world=shifted(1.0, 0.0, 1.5) @ np.array([[0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1.0]])
    )
    return SceneDescription((ground(), mirror, sun), (bulb,))


@pytest.mark.slow
@pytest.mark.parametrize("clamp", [0.3, 1.0, 3.0])
def test_clamped_fraction_is_the_light_that_is_missing(clamp: float) -> None:
    free = even(fireflies(), 1024)
    well = float(free.replicas.mean())
    clamped = even(fireflies(), 1024, clamp=clamp, well=well)
    missing = 1.0 - clamped.replicas.mean(dtype=np.float64) / free.replicas.mean(dtype=np.float64)
    assert free.statistics.clamped_fraction == 0.0
    assert clamped.statistics.clamped_fraction == pytest.approx(missing, abs=1e-5)
    assert 1e-4 < missing < 0.9


def two_groups() -> SceneDescription:
    lamps = (PointLight((0, 0, 2), ONE, group="warm"), PointLight((1, 0, 2), constant(2.0), group="cold"))
    return SceneDescription((ground(),), lamps)


@pytest.mark.slow
@pytest.mark.parametrize("importance", [(("warm", 0.0),), (("warm", 0.0), ("cold", 0.0))], ids=["one", "all"])
def test_group_of_weight_zero_keeps_its_light_and_can_be_left_out(importance: tuple[tuple[str, float], ...]) -> None:
    light = even(two_groups(), 4096, keep_groups=True, group_importance=importance)
    together = even(two_groups(), 4096)
    assert light.channels({}).mean() == pytest.approx(together.replicas.mean(), rel=ANALYTIC_TOLERANCE * 5)
    only_cold = light.channels({"warm": 0.0})
    alone = even(SceneDescription((ground(),), two_groups().lights[1:]), 256)
    assert only_cold.mean() == pytest.approx(alone.replicas.mean(), rel=ANALYTIC_TOLERANCE)
    assert np.all(light.channels({"warm": 0.0, "cold": 0.0}) == 0.0)


def test_weights_of_zero_in_a_view_end_the_sampling_at_once() -> None:
    goal = SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=CAP)
    request = LightRequest(
        grid=GRID,
        responses=(constant(1.0),),
        keep_bands=False,
        keep_groups=True,
        goal=goal,
        targets=(((("warm", 0.0), ("cold", 0.0)), ShotNoise()),),
    )
    statistics = render_light(two_groups(), VIEW, request).statistics
    assert (statistics.samples_max, statistics.stopped_by) == (FIRST_ROUND, "target")


@pytest.mark.parametrize("centre_nm", [380.0, 1000.0])
def test_one_band_of_1_nm_serves_channels_too(centre_nm: float) -> None:
    """The response is 1 from 300 to 1100 nm; what counts are the photons of the band."""
    wide = Spectrum([300.0, 1100.0], [1.0, 1.0])
    request = LightRequest(
        grid=WavelengthGrid(centre_nm, centre_nm, 1.0),
        responses=(wide,),
        keep_bands=True,
        goal=SamplingGoal(noise_ratio=None, samples_per_pixel=64),
    )
    light = render_light(SceneDescription((ground(),), DOME), VIEW, request)
    assert light.bands is not None
    assert light.replicas.mean() == pytest.approx(light.bands.mean() * 1.0, rel=ANALYTIC_TOLERANCE)
    direct = render_light(SceneDescription((ground(),), DOME), VIEW, replace(request, keep_bands=False))
    assert direct.replicas.mean() == pytest.approx(light.replicas.mean(), rel=ANALYTIC_TOLERANCE)


def test_paths_of_one_segment_end_at_lamps_only() -> None:
    scene = lit(PointLight((0, 0, 2), ONE)).scene()
    assert even(scene, 16, max_depth=1).replicas.max() == 0.0
    assert even(scene, 16, max_depth=2).replicas.min() > 0.0
