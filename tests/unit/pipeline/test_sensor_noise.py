"""The sensor's own noise as light: closed forms, and the noise of pictures that the sensor model takes."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fullwell.optics import IDEAL_LENS, form_channel_image
from fullwell.pipeline.noise import SensorNoise, electrons_per_light
from fullwell.radiometry import ChannelRadiance, WavelengthGrid
from fullwell.schema import build_frame, load_recipe
from fullwell.schema.frame import CameraRig, SensorRig
from fullwell.sensor import (
    BracketExposure,
    BurstExposure,
    ChannelCurrents,
    ChannelExposure,
    FixedExposure,
    SensorModel,
    dark_noise_e,
    expected_electrons,
    expose,
    fixed_pattern_stream,
    saturation_electrons,
    sensor,
)

EXACT = 1e-12
TIME_S = 0.01
DARK_E_PER_S = 3000.0
READ_E = 7.0

NOISY = {"dark_current_e_per_s": DARK_E_PER_S, "read_noise_e": READ_E, "dsnu_v": 0.0, "prnu_fraction": 0.0}


def noisy_model(rows: int = 12, cols: int = 16, **changes: Any) -> SensorModel:
    return replace(sensor("ideal-mono"), rows=rows, cols=cols, **(NOISY | changes))


def rig_of(recipe: dict[str, Any], model: SensorModel, *, oversampling: int = 1) -> CameraRig:
    """Return a pinhole camera, a film behind it, and one sensor on that."""
    recipe["cameras"][0]["lens"] = {"kind": "pinhole", "hfov_deg": 30, "f_number": 2}
    recipe["cameras"][0]["sensors"][0] |= {"model": "ideal-mono", "rows": model.rows, "cols": model.cols}
    recipe["cameras"][0]["sensors"][0]["pixel_pitch_m"] = model.pixel_pitch_m
    recipe["quality"] = {"oversampling": oversampling}
    rig = build_frame(load_recipe(recipe)).cameras[0]
    seen = replace(rig.sensors[0], model=model, exposure=FixedExposure(TIME_S))
    return replace(rig, sensors=(seen,))


def noise_of(rig: CameraRig, exposure: Any = None) -> SensorNoise:
    seen = rig.sensors[0] if exposure is None else replace(rig.sensors[0], exposure=exposure)
    return SensorNoise(rig, ((seen, ((0,),)),), lambda *_: TIME_S)


def uniform(rig: CameraRig, light: float) -> np.ndarray:
    return np.full((1, rig.camera.film.rows, rig.camera.film.cols), light)


def light_of(rig: CameraRig, electrons: float) -> float:
    """Return the light that gives so many electrons on the axis."""
    return electrons / float(electrons_per_light(rig, rig.sensors[0].model, TIME_S).max())


# Electrons -----------------------------------------------------------------------------------------------------------


def test_electrons_per_light_follow_the_camera_equation_and_cos_fourth(recipe: dict[str, Any]) -> None:
    model = noisy_model(fill_factor=0.5)
    rig = rig_of(recipe, model)
    x = (np.arange(16) - 7.5) * rig.camera.tangent_pitch
    y = (np.arange(12) - 5.5) * rig.camera.tangent_pitch
    cos_fourth = (1 + x[None, :] ** 2 + y[:, None] ** 2) ** -2
    solid_angle_sr = math.pi / (1 + 4 * 2.0**2)
    expected = cos_fourth * solid_angle_sr * model.pixel_pitch_m**2 * 0.5 * TIME_S
    np.testing.assert_allclose(electrons_per_light(rig, model, TIME_S), expected, rtol=1e-9)


@pytest.mark.parametrize("kind", ["pinhole", "thin_lens"])
def test_electrons_per_light_are_those_of_the_camera_chain(recipe: dict[str, Any], kind: str) -> None:
    model = noisy_model(fill_factor=0.6)
    rig = rig_of(recipe, model)
    lens = replace(rig.camera.lens, kind=kind, diffraction=False, focus_distance_m=2.0)
    rig = replace(rig, camera=replace(rig.camera, lens=lens))
    light = np.random.default_rng(0).random((1, 12, 16)) * 1e18
    seen = ChannelRadiance(light, np.array([550.0]), np.array([0]), rig.camera.tangent_pitch)
    image = form_channel_image(seen, lens, IDEAL_LENS)
    currents = ChannelCurrents(image.electrons, model.cfa, WavelengthGrid(400, 700, 10), image.sample_pitch_m)
    electrons = expected_electrons(currents, model, TIME_S)
    np.testing.assert_allclose(light[0] * electrons_per_light(rig, model, TIME_S), electrons, rtol=1e-9)


# Variance ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("electrons", [0.0, 1.0, 1e3, 1e4])
def test_variance_is_shot_and_dark_and_read_noise_as_light(recipe: dict[str, Any], electrons: float) -> None:
    model = noisy_model()
    rig = rig_of(recipe, model)
    factor = electrons_per_light(rig, model, TIME_S)
    light = uniform(rig, light_of(rig, electrons))
    electrons_per_dn = model.voltage_swing_v / (2**model.adc_bits - 1) / model.conversion_gain_v_per_e / model.analog_gain_ratio
    of_one_reading_e2 = READ_E**2 + electrons_per_dn**2 / 12
    expected = (light[0] * factor + DARK_E_PER_S * TIME_S + of_one_reading_e2) / factor**2
    np.testing.assert_allclose(noise_of(rig)(light)[0], expected, rtol=1e-4)
    assert dark_noise_e(model) ** 2 == pytest.approx(of_one_reading_e2, rel=1e-4)


@pytest.mark.parametrize("electrons", [30.0, 3000.0])
def test_variance_is_that_of_pictures(recipe: dict[str, Any], electrons: float) -> None:
    model = noisy_model(rows=200, cols=200)
    rig = rig_of(recipe, model)
    factor = electrons_per_light(rig, model, TIME_S)
    light = electrons / factor  # the same everywhere on the sensor
    irradiance = np.full((1, 200, 200), electrons / (model.pixel_pitch_m**2 * model.fill_factor * TIME_S))
    currents = ChannelCurrents(irradiance, model.cfa, WavelengthGrid(400, 700, 10), rig.camera.film.pitch_m)
    raw = expose(
        currents,
        model,
        FixedExposure(TIME_S),
        rng=np.random.default_rng(5),
        fixed_pattern_rng=fixed_pattern_stream(model),
        keep_mean_electrons=True,
    )
    of_picture_e2 = float(np.var(raw.dn.astype(np.float64)) * raw.electrons_per_dn**2)
    predicted_e2 = float(np.mean(noise_of(rig)(light[None])[0] * factor**2))
    # The variance of 40 000 pixels is known to sqrt(2 / 40000) = 0.7 %: four times that.
    assert of_picture_e2 == pytest.approx(predicted_e2, rel=0.028)


@pytest.mark.parametrize("oversampling", [2, 4])
def test_a_film_sample_may_err_more_than_the_pixel_that_averages_it(recipe: dict[str, Any], oversampling: int) -> None:
    model = noisy_model()
    plain, fine = rig_of(recipe, model), rig_of(recipe, model, oversampling=oversampling)
    assert fine.camera.film.rows == oversampling * plain.camera.film.rows
    light = light_of(plain, 1000.0)
    middle = noise_of(plain)(uniform(plain, light))[0, 5:7, 7:9].mean()
    middle_fine = noise_of(fine)(uniform(fine, light))[0]
    rows, cols = middle_fine.shape
    around = middle_fine[rows // 2 - 1 : rows // 2 + 1, cols // 2 - 1 : cols // 2 + 1].mean()
    # The mean of n^2 samples has the variance of one over n^2; the falloff over half a pixel is the rest.
    assert around == pytest.approx(oversampling**2 * middle, rel=0.01)


def test_saturated_pixels_ask_for_a_tenth_of_their_light_only(recipe: dict[str, Any]) -> None:
    model = noisy_model()
    rig = rig_of(recipe, model)
    full = saturation_electrons(model)
    below = light_of(rig, 1.19 * full)
    above = light_of(rig, 100 * full)
    variance = noise_of(rig)(uniform(rig, below))[0]
    factor = electrons_per_light(rig, model, TIME_S)
    shot = (below * factor + DARK_E_PER_S * TIME_S + dark_noise_e(model) ** 2) / factor**2
    np.testing.assert_allclose(variance, shot, rtol=EXACT)
    np.testing.assert_allclose(noise_of(rig)(uniform(rig, above))[0], (0.1 * above) ** 2, rtol=EXACT)


@pytest.mark.parametrize("beyond", [1.2, 1.2001, 1.25, 1.33, 1.34, 5.0])
def test_allowance_of_saturated_pixels_grows_from_nothing(recipe: dict[str, Any], beyond: float) -> None:
    """The light may err by what is beyond 1.2 times saturation: no estimate on the wrong side of a step is taken for exact."""
    model = noisy_model()
    rig = rig_of(recipe, model)
    factor = electrons_per_light(rig, model, TIME_S)
    full = saturation_electrons(model)
    light = light_of(rig, beyond * full)
    electrons = light * factor
    shot = (electrons + DARK_E_PER_S * TIME_S + dark_noise_e(model) ** 2) / factor**2
    allowed = np.minimum(np.maximum(electrons - 1.2 * full, 0.0), 0.1 * electrons) / factor
    np.testing.assert_allclose(noise_of(rig)(uniform(rig, light))[0], np.maximum(shot, allowed**2), rtol=1e-9)


def test_saturation_is_told_by_sure_light_and_shot_noise_by_all_of_it(recipe: dict[str, Any]) -> None:
    model = noisy_model()
    rig = rig_of(recipe, model)
    factor = electrons_per_light(rig, model, TIME_S)
    full = saturation_electrons(model)
    light, sure = uniform(rig, light_of(rig, 50 * full)), uniform(rig, light_of(rig, 0.01 * full))
    shot = (light[0] * factor + DARK_E_PER_S * TIME_S + dark_noise_e(model) ** 2) / factor**2
    np.testing.assert_allclose(noise_of(rig)(light, sure)[0], shot, rtol=EXACT)
    np.testing.assert_array_equal(noise_of(rig)(light, light), noise_of(rig)(light))


def test_saturating_light_fills_the_well_on_the_axis(recipe: dict[str, Any]) -> None:
    model = noisy_model()
    rig = rig_of(recipe, model)
    (limit,) = noise_of(rig).saturation(uniform(rig, 1.0))
    assert limit * electrons_per_light(rig, model, TIME_S).max() == pytest.approx(saturation_electrons(model), rel=EXACT)
    seen = rig.sensors[0]
    second_only = SensorNoise(rig, ((seen, ((1,),)),), lambda *_: TIME_S)
    limits = second_only.saturation(np.ones((3, 12, 16)))
    assert limits[0] == limits[2] == np.inf
    assert limits[1] == limit


# Exposures -----------------------------------------------------------------------------------------------------------


def test_longest_capture_of_a_bracket_is_the_strictest(recipe: dict[str, Any]) -> None:
    rig = rig_of(recipe, noisy_model())
    light = uniform(rig, light_of(rig, 500.0))
    bracket = noise_of(rig, BracketExposure(FixedExposure(TIME_S), ratios=(0.25, 1.0, 4.0)))(light)
    single = SensorNoise(rig, ((rig.sensors[0], ((0,),)),), lambda *_: 4 * TIME_S)(light)
    np.testing.assert_allclose(bracket, single, rtol=EXACT)


def test_a_burst_has_less_noise_by_its_count(recipe: dict[str, Any]) -> None:
    rig = rig_of(recipe, noisy_model())
    light = uniform(rig, light_of(rig, 500.0))
    burst = noise_of(rig, BurstExposure(FixedExposure(TIME_S), count=8))(light)
    np.testing.assert_allclose(8 * burst, noise_of(rig)(light), rtol=EXACT)


def test_longest_channel_time_counts(recipe: dict[str, Any]) -> None:
    rig = rig_of(recipe, noisy_model())
    light = uniform(rig, light_of(rig, 500.0))
    longer = noise_of(rig, ChannelExposure(FixedExposure(TIME_S), ratios=(("W", 2.0),)))(light)
    single = SensorNoise(rig, ((rig.sensors[0], ((0,),)),), lambda *_: 2 * TIME_S)(light)
    np.testing.assert_allclose(longer, single, rtol=EXACT)


def test_automatic_time_is_found_once_from_the_first_light(recipe: dict[str, Any]) -> None:
    rig = rig_of(recipe, noisy_model())
    asked: list[float] = []

    def find(_: SensorRig, light: np.ndarray) -> float:
        asked.append(float(light.mean()))
        return TIME_S

    noise = SensorNoise(rig, ((rig.sensors[0], ((0,),)),), find)
    first, second = light_of(rig, 100.0), light_of(rig, 200.0)
    noise(uniform(rig, first))
    noise(uniform(rig, second))
    assert asked == [pytest.approx(first)]
    assert noise.times_s == {0: TIME_S}


# Channels ------------------------------------------------------------------------------------------------------------


def test_channels_are_the_sums_of_their_parts_for_every_leading_axis(recipe: dict[str, Any]) -> None:
    rig = rig_of(recipe, noisy_model())
    seen = rig.sensors[0]
    noise = SensorNoise(rig, ((seen, ((0, 1), (2,))), (seen, ((3, 0),))), lambda *_: TIME_S)
    light = np.random.default_rng(0).random((4, 4, 12, 16))
    sums = noise.channels(light)
    assert sums.shape == (4, 3, 12, 16)
    np.testing.assert_array_equal(sums[:, 0], light[:, 0] + light[:, 1])
    np.testing.assert_array_equal(sums[:, 1], light[:, 2])
    np.testing.assert_array_equal(sums[:, 2], light[:, 3] + light[:, 0])
    assert noise(sums[0]).shape == (3, 12, 16)
