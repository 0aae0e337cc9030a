"""Captures become one linear image with the signal and the noise they should have."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import stream
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import (
    BracketExposure,
    BurstExposure,
    Exposure,
    FixedExposure,
    OpticalImage,
    Photodiode,
    RawImage,
    Readout,
    SensorModel,
    capture,
    expected_electrons,
    expose,
    fixed_pattern_stream,
    sensor,
)
from fullwell.sensor.combination import SWITCH_LEVEL

ROWS, COLS = 120, 150
PIXELS = ROWS * COLS
GRID = WavelengthGrid(550.0, 550.0, 10.0)

Z_LIMIT = 4.0
"""Standard errors of the estimate; about 60 comparisons, so a false alarm has a chance of 0.4 %."""


def mono(**changes: object) -> SensorModel:
    base = replace(sensor("ideal-mono"), rows=ROWS, cols=COLS, analog_offset_v=0.01, read_noise_e=3.0)
    return replace(base, **changes)  # type: ignore[arg-type]


def take(camera: SensorModel, mean_e: float, exposure: Exposure | None = None, frame: int = 0) -> RawImage:
    """Expose uniform light that gives `mean_e` photo-electrons in 10 ms to the reference."""
    one = OpticalImage(np.full((ROWS, COLS, 1), 1e16, np.float32), GRID, camera.pixel_pitch_m)
    level = 1e16 * mean_e / float(np.mean(expected_electrons(one, camera, 0.01)))
    optical = OpticalImage(np.full((ROWS, COLS, 1), level, np.float32), GRID, camera.pixel_pitch_m)
    streams = {"rng": stream(0, "hdr", frame), "fixed_pattern_rng": fixed_pattern_stream(camera)}
    return expose(optical, camera, exposure or FixedExposure(0.01), **streams)


def electrons(raw: RawImage) -> np.ndarray:
    return (raw.dn.astype(float) - raw.black_level_dn) * raw.electrons_per_dn


def split_pixel(combination: str = "select", **changes: object) -> SensorModel:
    """A large photodiode of 20 000 e- and a small one of 10 000 e- that sees a twentieth of the light; 14 bits."""
    swing_v, offset_v = 1.02, 0.02
    large, small = 1.0 / 20e3, 1.0 / 10e3
    return mono(
        voltage_swing_v=swing_v,
        analog_offset_v=offset_v,
        adc_bits=14,
        combination=combination,
        photodiodes=(
            Photodiode("large", 0.8, 20e3, (Readout("high", 4 * large, 2.0), Readout("low", large, 8.0))),
            Photodiode("small", 0.04, 10e3, (Readout("main", small, 4.0),)),
        ),
        **changes,
    )


LEVELS = (100.0, 1000.0, 10_000.0, 30_000.0, 150_000.0)


@pytest.mark.parametrize("combination", ["select", "weighted"])
@pytest.mark.parametrize("mean_e", LEVELS)
def test_a_split_pixel_is_linear_over_both_photodiodes(combination: str, mean_e: float) -> None:
    raw = take(split_pixel(combination), mean_e)
    found = electrons(raw)
    assert np.mean(found) == pytest.approx(mean_e, abs=Z_LIMIT * np.std(found) / math.sqrt(PIXELS))
    assert raw.saturated_fraction == 0


@pytest.mark.parametrize(
    ("mean_e", "variance"),
    [
        (1000.0, 1000 + 2.0**2),  # large at high gain
        (10_000.0, 10_000 + 8.0**2),  # large at low gain
        (30_000.0, 20 * 30_000 + (20 * 4.0) ** 2),  # small: its noise times the ratio of the sensitivities
        (150_000.0, 20 * 150_000 + (20 * 4.0) ** 2),
    ],
)
def test_selection_has_the_noise_of_the_selected_capture(mean_e: float, variance: float) -> None:
    found = electrons(take(split_pixel(), mean_e))
    quantised = (20 * 10e3 / 16383 * 1.02) ** 2 / 12
    assert np.var(found) == pytest.approx(variance + quantised, rel=Z_LIMIT * math.sqrt(2 / PIXELS) + quantised / variance)


def test_the_signal_to_noise_ratio_dips_where_the_small_photodiode_takes_over() -> None:
    """From 18 000 e- to 22 000 e- of the large photodiode's scale: sqrt(20) is lost, less 1.1 of the higher signal."""
    below, above = (electrons(take(split_pixel(), mean_e)) for mean_e in (17_000.0, 22_000.0))
    drop = (np.mean(below) / np.std(below)) / (np.mean(above) / np.std(above))
    expected = (17_000 / math.sqrt(17_064)) / (22_000 / math.sqrt(20 * 22_000 + 6400))
    assert drop == pytest.approx(expected, rel=Z_LIMIT * math.sqrt(2 / PIXELS) + 0.01)
    assert drop > 3


def test_weighting_beats_selection_by_what_the_other_captures_know() -> None:
    """Shot noise alone: the electrons of all captures count, so the variance falls by the sum of the sensitivities."""
    ratios = (1.0, 0.5, 0.25)
    quiet = mono(read_noise_e=0.0)
    for combination, expected in (("select", 1.0), ("weighted", 1.75)):
        found = electrons(take(quiet, 20_000.0, BracketExposure(FixedExposure(0.01), ratios, combination)))
        assert 20_000.0 / np.var(found) == pytest.approx(expected, rel=Z_LIMIT * math.sqrt(2 / PIXELS) + 0.005)
        assert np.mean(found) == pytest.approx(20_000.0, abs=Z_LIMIT * np.std(found) / math.sqrt(PIXELS))


@pytest.mark.parametrize("combination", ["select", "weighted"])
@pytest.mark.parametrize("mean_e", [200.0, 5000.0, 80_000.0, 120_000.0, 390_000.0, 1_200_000.0])
def test_a_bracket_is_linear_beyond_the_well(combination: str, mean_e: float) -> None:
    exposure = BracketExposure(FixedExposure(0.01), (1.0, 0.25, 0.0625), combination)
    raw = take(mono(), mean_e, exposure)
    found = electrons(raw)
    assert raw.exposure_time_s == 0.01
    assert np.mean(found) == pytest.approx(mean_e, abs=Z_LIMIT * np.std(found) / math.sqrt(PIXELS))


@pytest.mark.parametrize("share", [0.99, 0.997, 1.0, 1.003])
def test_choosing_by_a_noisy_value_costs_what_a_cut_gaussian_costs(share: float) -> None:
    """Values above the switch level T are replaced by independent ones: the mean falls by sigma phi((T - mean) / sigma).

    The saturation signal is 99 000 e-, so T = 94 050 e-; at T itself that is 0.4 sigma, 0.13 %.
    """
    switch_e = SWITCH_LEVEL * 99_000.0
    mean_e = share * switch_e
    found = electrons(take(mono(), mean_e, BracketExposure(FixedExposure(0.01), (1.0, 0.25), "select")))
    sigma_e = math.sqrt(mean_e + 9.0)
    density = math.exp(-0.5 * ((switch_e - mean_e) / sigma_e) ** 2) / math.sqrt(2 * math.pi)
    bias_e = np.mean(found) - mean_e
    assert bias_e == pytest.approx(-sigma_e * density, abs=Z_LIMIT * np.std(found) / math.sqrt(PIXELS))


def test_dark_current_is_taken_off_a_combined_image() -> None:
    camera = mono(dark_current_e_per_s=5e4)
    found = electrons(take(camera, 3000.0, BracketExposure(FixedExposure(0.01), (1.0, 0.1))))
    assert np.mean(found) == pytest.approx(3000.0, abs=Z_LIMIT * np.std(found) / math.sqrt(PIXELS))


def test_light_beyond_all_captures_is_the_white_level() -> None:
    for camera in (split_pixel(), split_pixel("weighted"), mono()):
        raw = take(camera, 1e12, BracketExposure(FixedExposure(0.01), (1.0, 0.25)))
        assert np.min(raw.dn) > 0.99 * raw.white_level_dn
        assert raw.saturated_fraction > 0.99


def test_two_gains_of_one_photodiode_see_the_same_electrons() -> None:
    """Weighting must not count the shot noise of two readings as independent: the variance stays that of one."""
    two = mono(photodiodes=(Photodiode("main", 1.0, 100e3, (Readout("high", 4e-5, 1.0), Readout("low", 1e-5, 1.0))),))
    found = electrons(take(two, 10_000.0))
    assert np.var(found) == pytest.approx(10_001.0, rel=Z_LIMIT * math.sqrt(2 / PIXELS) + 1e-3)


def test_a_high_gain_quietens_the_shadows_and_a_low_one_keeps_the_highlights() -> None:
    main = Photodiode("main", 1.0, 100e3, (Readout("high", 8e-5, 1.0), Readout("low", 1e-5, 12.0)))
    dual = mono(photodiodes=(main,))
    low_only = mono(read_noise_e=12.0)
    shadow = np.var(electrons(take(dual, 20.0))), np.var(electrons(take(low_only, 20.0)))
    assert shadow[0] == pytest.approx(21.0 + 0.2**2 / 12, rel=Z_LIMIT * math.sqrt(2 / PIXELS) + 0.01)
    assert shadow[1] == pytest.approx(164.0 + 1.5**2 / 12, rel=Z_LIMIT * math.sqrt(2 / PIXELS) + 0.01)
    bright = take(dual, 80_000.0)
    assert bright.saturated_fraction == 0
    assert np.mean(electrons(bright)) == pytest.approx(80_000.0, abs=Z_LIMIT * 285 / math.sqrt(PIXELS))


def test_lateral_overflow_reads_the_photodiode_first_and_then_everything() -> None:
    """A photodiode of 8000 e- that overflows into a capacitor; reading it leaves its reset noise in."""
    overflow = mono(
        photodiodes=(
            Photodiode(
                "main",
                1.0,
                90e3,
                (Readout("photodiode", 1e-4, 1.5, well_capacity_e=8000.0), Readout("all", 1e-5, 5.0, reset_noise_e=30.0)),
            ),
        )
    )
    for mean_e, variance in ((3000.0, 3000 + 1.5**2), (50_000.0, 50_000 + 5.0**2 + 30.0**2)):
        raw = take(overflow, mean_e)
        assert np.mean(electrons(raw)) == pytest.approx(mean_e, abs=Z_LIMIT * math.sqrt(variance / PIXELS))
        assert np.var(electrons(raw)) == pytest.approx(variance, rel=Z_LIMIT * math.sqrt(2 / PIXELS) + 1e-3)


@pytest.mark.parametrize("combination", ["sum", "mean"])
@pytest.mark.parametrize("count", [3, 8])
def test_a_burst_averages_the_noise_of_its_frames(combination: str, count: int) -> None:
    raw = take(mono(), 500.0, BurstExposure(FixedExposure(0.01), count, combination))  # type: ignore[arg-type]
    times = count if combination == "sum" else 1
    one_variance = 500.0 + 9.0 + 1.5259**2 / 12
    assert raw.exposure_time_s == pytest.approx(0.01 * times)
    found = electrons(raw)
    assert np.mean(found) == pytest.approx(500.0 * times, abs=Z_LIMIT * np.std(found) / math.sqrt(PIXELS))
    expected = one_variance * count if combination == "sum" else one_variance / count
    assert np.var(found) == pytest.approx(expected, rel=Z_LIMIT * math.sqrt(2 / PIXELS))


def test_crosstalk_leaves_the_shot_noise_poisson() -> None:
    kernel = ((0.01, 0.03, 0.01), (0.03, 0.84, 0.03), (0.01, 0.03, 0.01))
    camera = mono(crosstalk_kernel=kernel, read_noise_e=0.0)
    light = OpticalImage(np.full((ROWS, COLS, 1), 1e15, np.float32), GRID, 4e-6)
    mean_e = float(np.mean(expected_electrons(light, camera, 0.01)))
    streams = {"rng": stream(0, "xt"), "fixed_pattern_rng": fixed_pattern_stream(camera)}
    found = electrons(capture(light, camera, 0.01, **streams))
    assert np.var(found) == pytest.approx(mean_e + 1.5259**2 / 12, rel=Z_LIMIT * math.sqrt(2 / PIXELS))
    assert abs(np.corrcoef(found[:, 1:].ravel(), found[:, :-1].ravel())[0, 1]) < Z_LIMIT / math.sqrt(PIXELS)
