"""The numbers put into a sensor come back out of its pictures, within one per cent."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import stream
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import (
    OpticalImage,
    SensorModel,
    capture,
    electrons_per_dn,
    expected_electrons,
    fixed_pattern_stream,
    sensor,
)

RECOVERY = 0.01
"""Relative; the promise. The estimates below have standard errors of at most a quarter of it."""

ROWS, COLS = 400, 500
GRID = WavelengthGrid(550.0, 550.0, 10.0)
LEVELS = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8])
"""Of the full well."""


def frames(model: SensorModel, time_s: float, count: int) -> list[np.ndarray]:
    optical = OpticalImage(np.full((ROWS, COLS, 1), 1e16 if time_s > 0 else 0.0, np.float32), GRID, model.pixel_pitch_m)
    return [
        capture(
            optical, model, time_s or 1e-6, rng=stream(0, "ptc", str(time_s), k), fixed_pattern_rng=fixed_pattern_stream(model)
        ).dn.astype(float)
        for k in range(count)
    ]


CAMERA = replace(
    sensor("ideal-mono"),
    rows=ROWS,
    cols=COLS,
    well_capacity_e=20_000.0,
    conversion_gain_v_per_e=4.5e-5,
    read_noise_e=15.0,
    dsnu_v=1.5e-3,
    prnu_fraction=0.015,
    analog_offset_v=0.05,
    adc_bits=14,
)


def test_a_photon_transfer_curve_returns_gain_read_noise_full_well_prnu_and_dsnu() -> None:
    """EMVA 1288: temporal variance from differences of two frames, spatial variance from the covariance of two."""
    optical = OpticalImage(np.full((ROWS, COLS, 1), 1e16, np.float32), GRID, CAMERA.pixel_pitch_m)
    rate = float(np.mean(expected_electrons(optical, CAMERA, 1.0)))
    mean, temporal, spatial = [], [], []
    for level in LEVELS:
        one, two = frames(CAMERA, level * CAMERA.well_capacity_e / rate, 2)
        mean.append((one.mean() + two.mean()) / 2)
        temporal.append(np.var(one - two) / 2)
        spatial.append(np.mean((one - one.mean()) * (two - two.mean())))
    signal, variance = np.array(mean) - mean[0], np.array(temporal)
    slope, dark_variance = np.polyfit(signal, variance, 1, w=1 / variance)
    step_e = electrons_per_dn(CAMERA)
    assert 1 / slope == pytest.approx(step_e, rel=RECOVERY)
    assert math.sqrt(dark_variance - 1 / 12) * step_e == pytest.approx(CAMERA.read_noise_e, rel=RECOVERY)
    prnu_squared, dsnu_squared = np.polyfit(signal**2, spatial, 1, w=1 / np.maximum(np.array(spatial), 1.0))
    assert math.sqrt(prnu_squared) == pytest.approx(CAMERA.prnu_fraction, rel=RECOVERY)
    dn_v = CAMERA.voltage_swing_v / (2**CAMERA.adc_bits - 1)
    assert math.sqrt(dsnu_squared) * dn_v == pytest.approx(CAMERA.dsnu_v, rel=RECOVERY)
    (full,) = frames(replace(CAMERA, prnu_fraction=0.0), 10 * CAMERA.well_capacity_e / rate, 1)
    assert (full.mean() - mean[0]) * step_e == pytest.approx(CAMERA.well_capacity_e, rel=RECOVERY)


def test_dark_frames_of_two_times_return_the_dark_current() -> None:
    model = replace(CAMERA, dark_current_e_per_s=400.0, temperature_k=306.15, prnu_fraction=0.0)  # 8 K warmer: doubled
    black = OpticalImage(np.zeros((ROWS, COLS, 1), np.float32), GRID, model.pixel_pitch_m)
    means = [
        capture(black, model, t, rng=stream(0, "dark", str(t)), fixed_pattern_rng=fixed_pattern_stream(model)).dn.mean()
        for t in (0.1, 2.1)
    ]
    assert (means[1] - means[0]) / 2.0 * electrons_per_dn(model) == pytest.approx(800.0, rel=RECOVERY)


@pytest.mark.parametrize("mean_e", [950.0, 1000.0, 1050.0, 2000.0])
def test_a_well_clips_the_mean_and_the_variance_of_a_cut_poisson_distribution(mean_e: float) -> None:
    """With well W and Poisson k: E[min(k, W)] = sum k p + W P(k > W), and so on for the square."""
    from scipy import stats

    model = replace(sensor("ideal-mono"), rows=ROWS, cols=COLS, well_capacity_e=1000.0, conversion_gain_v_per_e=1e-3)
    optical = OpticalImage(np.full((ROWS, COLS, 1), 1e16, np.float32), GRID, model.pixel_pitch_m)
    time_s = mean_e / float(np.mean(expected_electrons(optical, model, 1.0)))
    raw = capture(optical, model, time_s, rng=stream(0, "clip"), fixed_pattern_rng=fixed_pattern_stream(model))
    k = np.arange(0, 1000)
    p, above = stats.poisson.pmf(k, mean_e), stats.poisson.sf(999, mean_e)
    mean = float(np.sum(k * p) + 1000 * above)
    variance = float(np.sum(k**2 * p) + 1000**2 * above) - mean**2
    found = raw.dn.astype(float) / 65.535
    assert np.mean(found) == pytest.approx(mean, abs=4 * math.sqrt(variance / found.size) + 0.005)
    fourth = float(np.sum((k - mean) ** 4 * p) + (1000 - mean) ** 4 * above)
    error = 4 * math.sqrt(max(fourth - variance**2, 0.0) / found.size)
    assert np.var(found) == pytest.approx(variance, abs=error + 1e-3)
    assert raw.saturated_fraction == pytest.approx(above, abs=4 * math.sqrt(above * (1 - above) / found.size) + 1e-9)
