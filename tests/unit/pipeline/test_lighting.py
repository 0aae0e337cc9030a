"""What of the light is rendered: no more than the sensors count, once for all frames that look at the same light."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fullwell.pipeline import lighting
from fullwell.pipeline.keys import light_key
from fullwell.pipeline.lighting import LightPlan, plan_light
from fullwell.pipeline.steps import PlanStep
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import REPLICAS
from fullwell.scene.groups import group_names
from fullwell.schema import RecipeBuilder, build_frame, load_recipe
from fullwell.schema.frame import FrameDescription

EXACT = 1e-9
"""Relative; sums of integrals in double precision."""

GRID = WavelengthGrid(400.0, 700.0, 10.0)


@pytest.fixture
def lamps(recipe: dict[str, Any]) -> dict[str, Any]:
    """The ball under a sky and two lamps in groups of their own; a picture only."""
    lamp = {"kind": "point", "luminous_intensity_cd": 500, "spd": "A"}
    recipe["scene"]["lights"] += [
        lamp | {"name": "left", "position_m": [-2, -2, 3], "group": "left"},
        lamp | {"name": "right", "position_m": [2, -2, 3], "group": "right"},
    ]
    return recipe | {"outputs": ["image.png"], "quality": {"noise_ratio": 0.5}}


def frame_of(recipe: dict[str, Any], index: int = 0) -> FrameDescription:
    return build_frame(load_recipe(recipe), index)


def plan_of(recipe: dict[str, Any], index: int = 0, *, skip: bool = True) -> LightPlan:
    frame = frame_of(recipe, index)
    return plan_light(frame, frame.cameras[0], 0, skip=skip)


def step_of(plan: LightPlan, what: str) -> PlanStep:
    """Return the last step about something."""
    return [step for step in plan.steps if step.what == f"main: {what}"][-1]


def keys_of(recipe: dict[str, Any]) -> list[str]:
    builder = RecipeBuilder(load_recipe(recipe))
    frames = [builder.frame(index) for index in range(load_recipe(recipe).frame_count())]
    return [light_key(f, f.cameras[0], plan_light(f, f.cameras[0], 0), variant="llvm_ad_spectral") for f in frames]


# Channels or bands ---------------------------------------------------------------------------------------------------


def test_a_picture_needs_channels_and_no_bands(lamps: dict[str, Any]) -> None:
    plan = plan_of(lamps)
    assert not plan.request.keep_bands
    assert list(plan.channels) == ["phone"]
    assert len(plan.channels["phone"]) == 3
    step = step_of(plan, "spectra")
    assert step.decision == "skip"
    assert "contrast within" in step.error_bound
    film = frame_of(lamps).cameras[0].camera.film
    replicas, bands = plan.shapes(film)
    assert replicas == (REPLICAS, 1, len(plan.request.responses), 16, 24)
    assert bands is None


@pytest.mark.parametrize("product", ["radiance.exr", "irradiance.exr"])
def test_spectral_products_need_bands_beside_the_channels(lamps: dict[str, Any], product: str) -> None:
    plan = plan_of(lamps | {"outputs": ["image.png", product]})
    assert plan.request.keep_bands
    assert plan.channels
    step = step_of(plan, "spectra")
    assert (step.decision, product in step.why) == ("run", True)
    assert plan.shapes(frame_of(lamps).cameras[0].camera.film)[1] == (1, 16, 24, 31)


def with_blur(camera: dict[str, Any]) -> None:
    camera["lens"]["psf"] = {"gaussian_sigma_m": 4e-6}


def with_wavefront(camera: dict[str, Any]) -> None:
    camera["lens"]["wavefront"] = {"zernike": [{"index": 4, "rms_m": 1e-7}]}


def with_aperture(camera: dict[str, Any]) -> None:
    camera["lens"]["aperture"] = {"blades": 6}


def with_layers(camera: dict[str, Any]) -> None:
    camera["lens"] |= {"depth_of_field": "layers", "focus_distance_m": 2.0}


def with_isetcam(camera: dict[str, Any]) -> None:
    camera["model"] = "isetcam"
    camera["lens"] = {"kind": "pinhole", "hfov_deg": 30, "f_number": 2, "focus_distance_m": 5.8}
    camera["sensors"][0]["model"] = "imx363-isetcam"


@pytest.mark.parametrize("change", [with_blur, with_wavefront, with_aperture, with_layers, with_isetcam])
def test_lens_that_treats_wavelengths_differently_needs_bands(
    lamps: dict[str, Any], change: Callable[[dict[str, Any]], None]
) -> None:
    change(lamps["cameras"][0])
    plan = plan_of(lamps)
    assert plan.request.keep_bands
    assert not plan.channels
    assert step_of(plan, "spectra").decision == "run"
    # The sensors' channels are counted all the same, whole: the error of the light is judged by them.
    assert len(plan.request.responses) == 3
    assert len(plan.request.targets) == 1


def test_nothing_is_left_out_where_that_is_asked_for(lamps: dict[str, Any]) -> None:
    lamps["scene"]["light_groups"] = {"left": 0.0}
    plan = plan_of(lamps, skip=False)
    assert plan.request.keep_bands
    assert not plan.channels
    assert len(plan.scene.lights) == 3
    assert "nothing is skipped" in step_of(plan, "spectra").why


def test_sensors_with_the_same_filters_share_their_responses(lamps: dict[str, Any]) -> None:
    lamps["cameras"][0]["lens"]["diffraction"] = False  # with it, each channel would be cut
    sensors = lamps["cameras"][0]["sensors"]
    sensors.append(sensors[0] | {"name": "second", "rows": 8})
    sensors.append(sensors[0] | {"name": "automotive", "model": "mt9v024-rgb", "pixel_pitch_m": 1.4e-6})
    plan = plan_of(lamps)
    assert plan.channels["phone"] == plan.channels["second"]
    assert not set(sum(plan.channels["phone"], ())) & set(sum(plan.channels["automotive"], ()))
    used = sorted(set(sum(plan.channels["phone"] + plan.channels["automotive"], ())))
    assert used == list(range(len(plan.request.responses)))


def test_many_different_responses_are_cheaper_as_a_spectrum(lamps: dict[str, Any]) -> None:
    models = ["imx363", "imx363-isetcam", "ar0132at-rgbw", "ideal-mono", "ideal-rgb"]
    sensor = lamps["cameras"][0]["sensors"][0] | {"pixel_pitch_m": 1e-5, "rows": 8, "cols": 8}
    lamps["cameras"][0]["sensors"] = [sensor | {"name": f"s{n}", "model": model} for n, model in enumerate(models)]
    plan = plan_of(lamps)
    assert plan.request.keep_bands
    assert not plan.channels
    assert "different responses" in step_of(plan, "spectra").why
    assert len(plan.request.responses) == 12


# Parts of channels ---------------------------------------------------------------------------------------------------


def curve(seed: int) -> Spectrum:
    """A quantum efficiency with knots anywhere, some of them outside the bands."""
    rng = np.random.default_rng(seed)
    wavelengths = np.sort(rng.uniform(350.0, 800.0, 40))
    return Spectrum(wavelengths, rng.random(40), outside="zero")


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(3))
def test_parts_of_a_response_add_up_to_the_whole(count: int, seed: int) -> None:
    response = curve(seed)
    parts = lighting._parts(GRID, response, count)
    assert len(parts) == count
    whole = response.band_average(GRID)
    np.testing.assert_allclose(sum(part.band_average(GRID) for part in parts), whole, rtol=EXACT)
    for other in parts[1:]:  # nothing is counted twice
        assert np.count_nonzero((parts[0].band_average(GRID) > 0) & (other.band_average(GRID) > 0)) <= 1


@pytest.mark.parametrize(("f_number", "most_parts"), [(2.0, 2), (5.6, 4)])
def test_channels_are_cut_where_diffraction_differs_within_them(
    lamps: dict[str, Any], f_number: float, most_parts: int
) -> None:
    lamps["cameras"][0]["lens"]["f_number"] = f_number
    frame = frame_of(lamps)
    plan = plan_light(frame, frame.cameras[0], 0)
    rig = frame.cameras[0]
    transmittance = rig.camera.lens.transmittance
    for places, (_, efficiency) in zip(plan.channels["phone"], rig.sensors[0].model.cfa.channels, strict=True):
        assert 1 <= len(places) <= most_parts
        found = sum(plan.request.responses[place].band_average(frame.grid) for place in places)
        np.testing.assert_allclose(found, efficiency.times(transmittance).band_average(frame.grid), rtol=EXACT, atol=EXACT)
        means = plan.wavelength_nm[list(places)]
        assert np.all(np.diff(means) > 0)
        assert np.all((means > frame.grid.edges_nm[0]) & (means < frame.grid.edges_nm[-1]))


def test_pixels_too_small_for_any_contrast_at_nyquist_are_cut_for_the_contrast_below_it(lamps: dict[str, Any]) -> None:
    lamps["cameras"][0]["lens"]["f_number"] = 16.0  # cut off at half of Nyquist
    assert min(len(places) for places in plan_of(lamps).channels["phone"]) > 1


def test_without_diffraction_channels_stay_whole(lamps: dict[str, Any]) -> None:
    lamps["cameras"][0]["lens"]["diffraction"] = False
    assert [len(places) for places in plan_of(lamps).channels["phone"]] == [1, 1, 1]


def test_light_of_a_sensor_is_the_sum_of_its_parts(lamps: dict[str, Any]) -> None:
    lamps["cameras"][0]["lens"]["f_number"] = 4.0
    frame = frame_of(lamps)
    rig, plan = frame.cameras[0], plan_light(frame, frame.cameras[0], 0)
    light = np.random.default_rng(0).random((len(plan.request.responses), 16, 24))
    seen = plan.light_of(rig.sensors[0], light, 1e-3)
    assert seen.tangent_pitch == 1e-3
    for channel, places in enumerate(plan.channels["phone"]):
        np.testing.assert_array_equal(seen.electrons[seen.channel == channel], light[list(places)])
        np.testing.assert_array_equal(seen.wavelength_nm[seen.channel == channel], plan.wavelength_nm[list(places)])


def test_mean_wavelength_is_that_of_the_photons_counted() -> None:
    box = Spectrum(np.array([499.99, 500.0, 600.0, 600.01]), np.array([0.0, 1.0, 1.0, 0.0]), outside="zero")
    (mean,) = lighting._mean_wavelengths(GRID, (box,), Spectrum.constant(1.0))
    # Equal power at all wavelengths is photons in proportion to the wavelength.
    assert mean == pytest.approx((600**3 - 500**3) / 3 / ((600**2 - 500**2) / 2), abs=0.05)
    dark = Spectrum(np.array([400.0, 401.0]), np.array([1.0, 1.0]), outside="zero")
    (unlit,) = lighting._mean_wavelengths(GRID, (box,), dark)
    assert unlit == pytest.approx(550.0, abs=0.05)  # nothing is counted: the middle of what could be


# Views of one light --------------------------------------------------------------------------------------------------


EXPOSURES = {"grid": {"cameras[0].sensors[0].exposure.time_s": [0.001, 0.004, 0.016]}}


def test_frames_that_vary_exposures_share_one_rendering(lamps: dict[str, Any]) -> None:
    assert len(set(keys_of(lamps | {"vary": EXPOSURES}))) == 1
    assert len(plan_of(lamps | {"vary": EXPOSURES}).request.targets) == 3


def test_sensors_on_another_film_have_another_rendering_and_no_say_in_this_one(lamps: dict[str, Any]) -> None:
    pitches = {"cameras[0].sensors[0].pixel_pitch_m": [1.4e-6, 2.8e-6]}
    lamps["vary"] = {"grid": pitches | EXPOSURES["grid"]}
    keys = keys_of(lamps)
    assert len(set(keys[:3])) == len(set(keys[3:])) == 1
    assert keys[0] != keys[3]
    for index, pitch_m in ((0, 1.4e-6), (5, 2.8e-6)):
        (views,) = frame_of(lamps, index).views
        assert [view.sensors[0].model.pixel_pitch_m for view in views] == [pitch_m] * 3


def test_a_film_that_no_shared_view_is_on_serves_its_own_frame(lamps: dict[str, Any]) -> None:
    lamps["vary"] = {"random": {"frames": 3, "values": {}}, "grid": {"quality.oversampling": [1, 2]}}
    lamps["vary"]["random"]["values"]["scene.light_groups.left"] = {"distribution": "uniform", "low": 0.5, "high": 2}
    (views,) = frame_of(lamps, 5).views
    assert len(views) == 1
    assert views[0].group_weights == frame_of(lamps, 5).group_weights


@pytest.mark.parametrize(
    "vary",
    [
        {"grid": {"cameras[0].sensors[0].isp.tone.exposure_ev": [0.0, 1.0]}},
        {"grid": {"cameras[0].sensors[0].well_capacity_e": [4000, 8000]}},
        {"grid": {"scene.light_groups.left": [0.0, 0.5, 1.0]}},
        {"grid": {"scene.light_groups.left": [0.0, 2.0], "cameras[0].sensors[0].exposure.time_s": [0.001, 0.01]}},
        {"random": {"frames": 4, "values": {"scene.light_groups.left": {"distribution": "uniform", "low": 0, "high": 2}}}},
        {"repeat": 3},
    ],
    ids=["development", "well", "group", "group and time", "random group", "repeat"],
)
def test_frames_that_look_at_the_same_light_share_one_rendering(lamps: dict[str, Any], vary: dict[str, Any]) -> None:
    assert len(set(keys_of(lamps | {"vary": vary}))) == 1


@pytest.mark.parametrize(
    "vary",
    [
        {"grid": {"cameras[0].pose.origin_m": [[4, -4, 2], [4, -4, 2.1]]}},
        {"grid": {"cameras[0].lens.f_number": [2.0, 4.0]}},
        {"grid": {"scene.lights[left].luminous_intensity_cd": [1, 2]}},
        {"grid": {"quality.noise_ratio": [0.5, 1.0]}},
        {"grid": {"quality.max_depth": [2, 4]}},
        {"grid": {"seed": [1, 2]}},
    ],
    ids=["pose", "f-number", "lamp", "noise ratio", "depth", "seed"],
)
def test_frames_with_other_light_have_other_renderings(lamps: dict[str, Any], vary: dict[str, Any]) -> None:
    assert len(set(keys_of(lamps | {"vary": vary}))) == 2


def test_exposure_decides_where_sampling_stops_but_not_equal_samples(lamps: dict[str, Any]) -> None:
    longer = copy.deepcopy(lamps)
    longer["cameras"][0]["sensors"][0]["exposure"] = {"time_s": 0.05}
    assert keys_of(lamps) != keys_of(longer)
    equal = {"quality": {"samples_per_pixel": 16}}
    assert keys_of(lamps | equal) == keys_of(longer | equal)


def test_every_view_has_a_target_with_its_own_weights(lamps: dict[str, Any]) -> None:
    lamps["vary"] = {"grid": {"scene.light_groups.left": [0.0, 2.0], "cameras[0].sensors[0].exposure.time_s": [0.001, 0.01]}}
    weights = sorted(dict(of_view)["left"] for of_view, _ in plan_of(lamps).request.targets)
    assert weights == [0.0, 0.0, 2.0, 2.0]


# Light groups --------------------------------------------------------------------------------------------------------


def test_without_weights_all_lamps_share_one_image(lamps: dict[str, Any]) -> None:
    plan = plan_of(lamps)
    assert not plan.request.keep_groups
    step = step_of(plan, "light groups")
    assert (step.decision, "3 in one image" in step.why) == ("skip", True)


def test_weights_of_one_keep_one_image_and_its_key(lamps: dict[str, Any]) -> None:
    weighted = copy.deepcopy(lamps)
    weighted["scene"]["light_groups"] = {"left": 1.0, "right": 1.0}
    plan = plan_of(weighted)
    assert not plan.request.keep_groups
    assert plan.request.group_importance == ()


def test_weights_keep_groups_apart_and_sample_the_bright_ones_more(lamps: dict[str, Any]) -> None:
    lamps["scene"]["light_groups"] = {"left": 0.25, "right": 4.0}
    plan = plan_of(lamps)
    assert plan.request.keep_groups
    assert plan.request.group_importance == (("left", 0.25), ("right", 4.0))
    assert plan.shapes(frame_of(lamps).cameras[0].camera.film)[0][1] == 3
    assert "default, left, right kept apart" in step_of(plan, "light groups").why


def test_lamps_that_no_view_shows_are_left_out(lamps: dict[str, Any]) -> None:
    lamps["scene"]["light_groups"] = {"left": 0.0, "right": 0.5}
    plan = plan_of(lamps)
    assert group_names(plan.scene) == ("default", "right")
    assert {light.group for light in plan.scene.lights} == {"default", "right"}
    skipped = [step for step in plan.steps if step.what == "main: light groups" and step.decision == "skip"]
    assert [step.why for step in skipped] == ["left: weight 0 in every view"]
    assert skipped[0].error_bound == "none"


def test_lamps_that_one_view_shows_are_kept(lamps: dict[str, Any]) -> None:
    lamps["vary"] = {"grid": {"scene.light_groups.left": [0.0, 0.5]}}
    for index in range(2):
        plan = plan_of(lamps, index)
        assert group_names(plan.scene) == ("default", "left", "right")
        assert plan.request.group_importance == (("left", 0.5),)


def test_bodies_of_dark_lamps_stay(lamps: dict[str, Any]) -> None:
    lamps["scene"]["objects"].append(
        {
            "id": "panel",
            "geometry": {"kind": "rectangle", "size_m": [1, 1]},
            "transform": {"translate_m": [0, 0, 3]},
            "material": {"kind": "emissive", "luminance_cd_m2": 100, "spd": "A", "group": "panel"},
        }
    )
    lamps["scene"]["light_groups"] = {"panel": 0.0}
    plan = plan_of(lamps)
    assert [item.id for item in plan.scene.objects] == ["floor", "ball", "panel"]
    assert plan.scene.objects[-1].parts[0].emission is None
    assert "panel" not in group_names(plan.scene)


def test_plan_leaves_the_frame_as_it_is(lamps: dict[str, Any]) -> None:
    lamps["scene"]["light_groups"] = {"left": 0.0}
    frame = frame_of(lamps)
    before = replace(frame)
    plan_light(frame, frame.cameras[0], 0)
    assert frame.scene is before.scene
    assert len(frame.scene.lights) == 3


# Cost ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("quality", "expected"),
    [
        ({"samples_per_pixel": 1000}, "about 0.26 CPU-s"),  # 24 x 16 pixels x 1000 rays at 1.5e6 a second
        ({"noise_ratio": 0.5, "max_samples_per_pixel": 1000}, "about 0.0041 to 0.26 CPU-s"),
        ({"noise_ratio": 0.5, "max_samples_per_pixel": 8}, "about 0.002 CPU-s"),
    ],
)
def test_plan_tells_what_rendering_costs_from_least_to_most(
    lamps: dict[str, Any], quality: dict[str, Any], expected: str
) -> None:
    assert step_of(plan_of(lamps | {"quality": quality}), "render").cost == expected
