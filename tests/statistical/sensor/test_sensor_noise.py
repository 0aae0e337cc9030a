"""Noise through the whole sensor: variances add as they should, patterns stay, frames differ."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import stream
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import (
    OpticalImage,
    RawImage,
    SensorModel,
    capture,
    expected_electrons,
    fixed_pattern_stream,
    sensor,
)

ROWS, COLS = 200, 250
PIXELS = ROWS * COLS
GRID = WavelengthGrid(550.0, 550.0, 10.0)

Z_LIMIT = 4.0
"""Standard errors of the estimate."""

QUANTISATION_VARIANCE_DN2 = 1 / 12


def light(level: float = 1e16) -> OpticalImage:
    return OpticalImage(np.full((ROWS, COLS, 1), level, np.float32), GRID, 4e-6)


def mono(**changes: object) -> SensorModel:
    return replace(sensor("ideal-mono"), rows=ROWS, cols=COLS, analog_offset_v=0.01, **changes)  # type: ignore[arg-type]


def take(model: SensorModel, mean_e: float, frame: int = 0, *, seed: int = 0) -> RawImage:
    optical = light()
    if mean_e == 0:
        dark = OpticalImage(np.zeros((ROWS, COLS, 1), np.float32), GRID, 4e-6)
        return capture(dark, model, 0.01, rng=stream(seed, "t", frame), fixed_pattern_rng=fixed_pattern_stream(model))
    time_s = mean_e / float(np.mean(expected_electrons(optical, model, 1.0)))
    return capture(optical, model, time_s, rng=stream(seed, "t", frame), fixed_pattern_rng=fixed_pattern_stream(model))


def volts(raw: RawImage, model: SensorModel) -> np.ndarray:
    return raw.dn.astype(float) * model.voltage_swing_v / (2**model.adc_bits - 1) - model.analog_offset_v


def temporal_variance(model: SensorModel, mean_e: float) -> float:
    """Return half the variance of the difference of two frames [DN^2]: the fixed pattern cancels."""
    one, two = (take(model, mean_e, frame).dn.astype(float) for frame in (0, 1))
    return float(np.var(one - two)) / 2


def test_a_photon_transfer_curve_returns_the_conversion_gain_and_the_read_noise() -> None:
    model = mono(read_noise_e=12.0, prnu_fraction=0.02, dsnu_v=1e-4, analog_gain_ratio=1.0)
    levels = np.array([0.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0, 16000.0, 32000.0])
    signal = np.array([np.mean(volts(take(model, level), model)) for level in levels])
    dn_v = model.voltage_swing_v / (2**model.adc_bits - 1)
    variance = np.array([temporal_variance(model, level) * dn_v**2 for level in levels])
    weight = 1 / (variance * math.sqrt(2 / PIXELS))
    slope, intercept = np.polyfit(signal, variance, 1, w=weight)
    covariance = np.polyfit(signal, variance, 1, w=weight, cov="unscaled")[1]
    assert abs(slope - model.conversion_gain_v_per_e) < Z_LIMIT * math.sqrt(covariance[0, 0])
    read_variance = (model.read_noise_e * model.conversion_gain_v_per_e) ** 2 + QUANTISATION_VARIANCE_DN2 * dn_v**2
    assert abs(intercept - read_variance) < Z_LIMIT * math.sqrt(covariance[1, 1])


def test_analog_gain_scales_the_signal_and_its_noise_but_not_the_offset() -> None:
    weak, strong = mono(read_noise_e=5.0), mono(read_noise_e=5.0, analog_gain_ratio=4.0)
    ratio = np.mean(volts(take(strong, 2000), strong)) / np.mean(volts(take(weak, 2000), weak))
    assert ratio == pytest.approx(4.0, rel=Z_LIMIT * math.sqrt(2 / 2000 / PIXELS))
    noise = temporal_variance(strong, 2000) / temporal_variance(weak, 2000)
    quantised = (16 * 2025 / 1.5259**2 + QUANTISATION_VARIANCE_DN2) / (2025 / 1.5259**2 + QUANTISATION_VARIANCE_DN2)
    assert noise == pytest.approx(quantised, rel=Z_LIMIT * math.sqrt(4 / PIXELS))
    assert np.all(take(mono(analog_gain_ratio=4.0), 0).dn == round(0.01 * 65535))


def test_spatial_variance_is_the_sum_of_its_parts() -> None:
    model = mono(read_noise_e=20.0, prnu_fraction=0.03, dsnu_v=2e-4, dark_current_e_per_s=5000.0)
    mean_e = 5000.0
    optical = light()
    time_s = mean_e / float(np.mean(expected_electrons(optical, model, 1.0)))
    raw = capture(optical, model, time_s, rng=stream(0, "sum"), fixed_pattern_rng=fixed_pattern_stream(model))
    dark_e = 5000.0 * time_s
    cg = model.conversion_gain_v_per_e
    expected = (mean_e + dark_e) * cg**2 + (0.03 * mean_e * cg) ** 2 + (20.0 * cg) ** 2 + 2e-4**2 + (1 / 65535) ** 2 / 12
    found = volts(raw, model)
    assert np.var(found) == pytest.approx(expected, rel=Z_LIMIT * math.sqrt(2 / PIXELS))
    assert np.mean(found) == pytest.approx((mean_e + dark_e) * cg, abs=Z_LIMIT * math.sqrt(expected / PIXELS))


def test_dark_current_adds_its_mean_and_its_shot_noise() -> None:
    model = mono(dark_current_e_per_s=20_000.0)
    raw = take(model, 0)  # 0.01 s
    electrons = volts(raw, model) / model.conversion_gain_v_per_e
    assert np.mean(electrons) == pytest.approx(200.0, abs=Z_LIMIT * math.sqrt(200 / PIXELS))
    assert np.var(electrons) == pytest.approx(200.0 + 1.5259**2 / 12, rel=Z_LIMIT * math.sqrt(2 / PIXELS))


def test_read_noise_is_gaussian_and_new_in_each_frame() -> None:
    model = mono(read_noise_e=50.0)
    one, two = (take(model, 0, frame).dn.astype(float) for frame in (0, 1))
    assert np.std(one) * 1.5259 == pytest.approx(50.0, rel=Z_LIMIT / math.sqrt(2 * PIXELS))
    assert abs(np.corrcoef(one.ravel(), two.ravel())[0, 1]) < Z_LIMIT / math.sqrt(PIXELS)


def test_shot_noise_of_two_frames_is_independent() -> None:
    model = mono()
    one, two = (take(model, 500, frame).dn.astype(float) for frame in (0, 1))
    assert abs(np.corrcoef(one.ravel(), two.ravel())[0, 1]) < Z_LIMIT / math.sqrt(PIXELS)


def test_the_fixed_pattern_is_the_same_in_every_picture_of_one_serial() -> None:
    model = mono(dsnu_v=3e-3)
    np.testing.assert_array_equal(take(model, 0, 0).dn, take(model, 0, 1, seed=99).dn)
    other = replace(model, serial=1)
    one, two = take(model, 0).dn.astype(float), take(other, 0).dn.astype(float)
    assert abs(np.corrcoef(one.ravel(), two.ravel())[0, 1]) < Z_LIMIT / math.sqrt(PIXELS)


def test_responsivity_differs_by_the_prnu_and_stays_with_the_sensor() -> None:
    model = mono(prnu_fraction=0.05)
    mean_e = 30_000.0
    one, two = (volts(take(model, mean_e, frame), model) for frame in (0, 1))
    fixed = np.mean((one - np.mean(one)) * (two - np.mean(two)))  # shot noise of two frames is independent
    expected = (0.05 * mean_e * model.conversion_gain_v_per_e) ** 2
    assert fixed == pytest.approx(expected, rel=Z_LIMIT * math.sqrt(2 / PIXELS))


def test_switching_one_noise_off_leaves_the_others_as_they_were() -> None:
    everything = mono(dsnu_v=3e-3, prnu_fraction=0.05, read_noise_e=0.0)
    without_prnu = replace(everything, prnu_fraction=0.0)
    np.testing.assert_array_equal(take(everything, 0).dn, take(without_prnu, 0).dn)
    shot, shot_and_read = (volts(take(mono(read_noise_e=r), 1000), mono()) for r in (0.0, 10.0))
    added_e = (shot_and_read - shot) / 1e-5
    expected = math.sqrt(10.0**2 + 2 * 1.5259**2 / 12)  # each picture is rounded to steps of 1.5 e-
    assert np.std(added_e) == pytest.approx(expected, rel=Z_LIMIT / math.sqrt(2 * PIXELS))


def test_the_same_seeds_give_the_same_bytes() -> None:
    model = mono(read_noise_e=5.0, prnu_fraction=0.01, dsnu_v=1e-4)
    assert take(model, 700).dn.tobytes() == take(model, 700).dn.tobytes()


def test_quantisation_adds_a_twelfth_of_a_squared_step() -> None:
    from fullwell.sensor.adc import quantise

    ramp = np.random.default_rng(0).random(PIXELS) * 0.9 + 0.05
    error = quantise(ramp, voltage_swing_v=1.0, adc_bits=10).astype(float) - ramp * 1023
    # Of a uniform distribution the variance of the sample variance is (1/80 - 1/144) / n.
    assert np.var(error) == pytest.approx(1 / 12, abs=Z_LIMIT * math.sqrt((1 / 80 - 1 / 144) / PIXELS))
    assert abs(np.mean(error)) < Z_LIMIT * math.sqrt(1 / 12 / PIXELS)


def test_imx363_levels_are_those_predicted_by_hand() -> None:
    """A green pixel under light of 545-555 nm.

    Quantum efficiency of G at 540, 550, 560 nm from the table, with 0.08 r + 0.59 g + 0.25 b behind the infrared filter:
    .98680 x (.08 x .05460 + .59 x .61697 + .25 x .08371) = .38417, .96669 x (.08 x .04745 + .59 x .60660 + .25 x .06569)
    = .36552 and .94672 x (.08 x .04669 + .59 x .57082 + .25 x .05122) = .33450; the mean over 545-555 nm of the straight
    lines between them is 3/4 of the middle one and 1/8 of each neighbour: .36397. A pixel of 1.96e-12 m^2 collects in 10 ms
    from 1e16 photons s^-1 m^-2 nm^-1 over 10 nm 1e16 x 10 x 1.96e-12 x .01 x .36397 = 713.4 e-, which make
    (713.4 x 7.65e-5 + .0287) / .4591 x 1023 = 185.55 DN. Read noise 65.36 e-, shot noise 26.71 e-, DSNU 8.37 e-, PRNU
    13.55 e-: together 72.86 e- or 12.42 DN.
    """
    model = replace(sensor("imx363"), rows=ROWS, cols=COLS)
    optical = OpticalImage(np.full((ROWS, COLS, 1), 1e16, np.float32), GRID, 1.4e-6)
    raw = capture(optical, model, 0.01, rng=stream(0, "hand"), fixed_pattern_rng=fixed_pattern_stream(model))
    green = raw.dn[0::2, 1::2].astype(float)
    arithmetic = 0.05  # DN; four-digit figures above
    assert np.mean(green) == pytest.approx(185.55, abs=arithmetic + Z_LIMIT * 12.42 / math.sqrt(green.size))
    assert np.std(green) == pytest.approx(12.42, rel=Z_LIMIT / math.sqrt(2 * green.size) + 1e-3)
    assert raw.black_level_dn == pytest.approx(63.95, abs=0.005)
    assert raw.white_level_dn == 1023
