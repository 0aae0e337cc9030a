"""Sun and sky in light groups of their own: each is right by itself, and together they are the one light that they were."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_analytic_scenes import camera, pytestmark  # noqa: F401

from fullwell.core.constants import NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.radiometry import Spectrum, WavelengthGrid, clear_sky
from fullwell.render import LightRequest, RenderedLight, SamplingGoal, render_light
from fullwell.scene import Cube, Diffuse, Part, Principled, Rectangle, SceneDescription, SceneObject, SunSky
from fullwell.scene.groups import group_names, only_groups

TOWARDS = (0.36, 0.48, 0.8)
GRID = WavelengthGrid(550.0, 550.0, 100.0)
SKY_TOLERANCE = 0.01
"""What the product promises of sun and sky."""

SIGMAS = 4.5
"""Of 80 pixels, each compared once in three ways: beyond it by chance once in 600 runs."""

PHOTONS_PER_J_NM = 1.0 / (PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M)


def scene(light: SunSky, *, thing: bool = False) -> SceneDescription:
    ground = SceneObject("ground", "", (Part(Rectangle((100, 100)), Diffuse(Spectrum.constant(1.0 if not thing else 0.4))),))
    box_at = np.eye(4)
    box_at[2, 3] = 0.5
    glossy = Principled(Spectrum.constant(0.6), 0.25, metallic=0.5)
    box = SceneObject("box", "", (Part(Cube((0.8, 0.8, 1.0)), glossy),), box_at)
    return SceneDescription((ground, box) if thing else (ground,), (light,))


def rendered(described: SceneDescription, samples: int, *, rows: int = 8, cols: int = 10, seed: int = 5) -> RenderedLight:
    request = LightRequest(
        grid=GRID,
        responses=(Spectrum.constant(1.0),),
        keep_bands=False,
        keep_groups=True,
        goal=SamplingGoal(noise_ratio=None, samples_per_pixel=samples),
        max_depth=4,
        seed=seed,
    )
    return render_light(described, camera(origin=(0, -2, 4), rows=rows, cols=cols, hfov_deg=25.0), request)


@pytest.mark.parametrize("turbidity", [2.0, 6.0])
def test_level_ground_gets_the_suns_and_the_skys_own_irradiance(turbidity: float) -> None:
    light = rendered(scene(SunSky(TOWARDS, turbidity, group="sky", sun_group="sun")), 256)
    sky = clear_sky(TOWARDS, turbidity=turbidity, ground_albedo=0.2, rows=128, cols=256)
    width_nm = 100.0
    for group, irradiance in (("sky", sky.sky_irradiance()), ("sun", sky.sun_irradiance() * TOWARDS[2])):
        photons = Spectrum(sky.wavelength_nm, irradiance * sky.wavelength_nm * PHOTONS_PER_J_NM, outside="zero")
        expected = photons.band_average(GRID)[0] * width_nm / np.pi
        alone = light.channels({name: float(name == group) for name in light.groups})
        assert alone.mean() == pytest.approx(expected, rel=SKY_TOLERANCE), group


def test_two_groups_add_up_to_the_one_light_and_each_is_that_light_alone() -> None:
    """Pixel by pixel, on a glossy box and its shadow, within the spread of the replicas."""
    one = SunSky(TOWARDS, group="sky")
    two = replace(one, sun_group="sun")
    apart = rendered(scene(two, thing=True), 512)
    cases = (
        (one, {}),
        (replace(one, sun_weight=0.0), {"sun": 0.0}),
        (replace(one, sky_weight=0.0, group="sun"), {"sky": 0.0}),
    )
    for light, weights in cases:
        alone = rendered(scene(light, thing=True), 512, seed=6)
        kept = [number for number, name in enumerate(apart.groups) if weights.get(name, 1.0) > 0]
        first = apart.replicas[:, kept, 0].sum(axis=1).astype(float)
        second = alone.replicas[:, :, 0].sum(axis=1).astype(float)
        difference = first.mean(axis=0) - second.mean(axis=0)
        error = np.sqrt((first.var(axis=0, ddof=1) + second.var(axis=0, ddof=1)) / len(first))
        # Four replicas tell a pixel's spread badly: that of all pixels is the least that counts.
        shared = np.sqrt(np.mean(error**2))
        assert np.max(np.abs(difference) / np.maximum(error, shared)) < SIGMAS
        assert abs(difference.sum()) < SIGMAS * np.sqrt((error**2).sum())


def test_groups_of_sun_and_sky_can_be_taken_out() -> None:
    both = SunSky(TOWARDS, group="sky", sun_group="sun")
    described = scene(both)
    assert group_names(described) == ("sky", "sun")
    (only_sky,) = only_groups(described, frozenset({"sky"})).lights
    (only_sun,) = only_groups(described, frozenset({"sun"})).lights
    assert (only_sky.sun_weight, only_sky.sky_weight) == (0.0, 1.0)
    assert (only_sun.sun_weight, only_sun.sky_weight) == (1.0, 0.0)
    assert only_groups(described, frozenset({"sky", "sun"})).lights == (both,)
    assert only_groups(described, frozenset({"other"})).lights == ()
    assert group_names(scene(SunSky(TOWARDS, group="day"))) == ("day",)
