"""Exposure time, fixed and automatic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import FieldError, stream
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import (
    AutoExposure,
    FixedExposure,
    OpticalImage,
    SensorModel,
    capture,
    expected_electrons,
    expose,
    exposure_time,
    fixed_pattern_stream,
    saturation_electrons,
    sensor,
)

ROUNDING = 1e-12
"""Relative; a few operations in double precision."""

GRID = WavelengthGrid(500.0, 600.0, 10.0)


def mono(**changes: object) -> SensorModel:
    return replace(sensor("ideal-mono"), rows=10, cols=10, **changes)  # type: ignore[arg-type]


def scene() -> OpticalImage:
    """A hundred pixels from 1 to 100 times 1e13."""
    levels = (np.arange(100) + 1).reshape(10, 10, 1) * 1e13
    return OpticalImage(np.repeat(levels, 11, axis=2).astype(np.float32), GRID, 4e-6)


def test_a_fixed_exposure_is_what_it_says() -> None:
    assert exposure_time(scene(), mono(), FixedExposure(0.0125)) == 0.0125


@pytest.mark.parametrize("gain", [1.0, 4.0])
def test_full_brings_the_brightest_pixel_to_the_level(gain: float) -> None:
    camera = mono(analog_gain_ratio=gain)
    time_s = exposure_time(scene(), camera, AutoExposure("full", level=0.8, max_time_s=100.0))
    brightest = np.max(expected_electrons(scene(), camera, time_s))
    assert brightest == pytest.approx(0.8 * saturation_electrons(camera), rel=ROUNDING)


def test_mean_brings_the_mean_pixel_to_the_level() -> None:
    time_s = exposure_time(scene(), mono(), AutoExposure("mean", level=0.2, max_time_s=100.0))
    assert np.mean(expected_electrons(scene(), mono(), time_s)) == pytest.approx(20_000, rel=ROUNDING)


def test_percentile_leaves_the_brightest_out() -> None:
    time_s = exposure_time(scene(), mono(), AutoExposure("percentile", level=0.5, percentile=50.0, max_time_s=100.0))
    assert np.median(expected_electrons(scene(), mono(), time_s)) == pytest.approx(50_000, rel=ROUNDING)


def test_dark_current_counts_towards_the_level() -> None:
    camera = mono(dark_current_e_per_s=1e5)
    time_s = exposure_time(scene(), camera, AutoExposure("full", level=0.8, max_time_s=100.0))
    filled = np.max(expected_electrons(scene(), camera, time_s)) + 1e5 * time_s
    assert filled == pytest.approx(80_000, rel=ROUNDING)


def test_the_time_stays_within_its_limits() -> None:
    assert exposure_time(scene(), mono(), AutoExposure("full", max_time_s=0.001)) == 0.001
    assert exposure_time(scene(), mono(), AutoExposure("full", min_time_s=50.0, max_time_s=60.0)) == 50.0


def test_a_black_scene_gets_the_longest_time() -> None:
    black = OpticalImage(np.zeros((10, 10, 11), np.float32), GRID, 4e-6)
    for method in ("full", "mean", "percentile"):
        assert exposure_time(black, mono(), AutoExposure(method, max_time_s=0.5)) == 0.5


def test_expose_is_exposure_time_and_capture() -> None:
    camera = mono(read_noise_e=3.0, prnu_fraction=0.01)
    setting = AutoExposure(level=0.6)
    at_once = expose(scene(), camera, setting, rng=stream(1, "x"), fixed_pattern_rng=fixed_pattern_stream(camera))
    time_s = exposure_time(scene(), camera, setting)
    in_steps = capture(scene(), camera, time_s, rng=stream(1, "x"), fixed_pattern_rng=fixed_pattern_stream(camera))
    np.testing.assert_array_equal(at_once.dn, in_steps.dn)
    assert at_once.exposure_time_s == time_s


@pytest.mark.parametrize(
    "make",
    [
        lambda: FixedExposure(0.0),
        lambda: FixedExposure(float("nan")),
        lambda: AutoExposure("brightest"),  # type: ignore[arg-type]
        lambda: AutoExposure(level=0.0),
        lambda: AutoExposure(level=1.5),
        lambda: AutoExposure(percentile=101.0),
        lambda: AutoExposure(min_time_s=1.0, max_time_s=0.5),
    ],
)
def test_an_impossible_exposure_is_refused(make: object) -> None:
    with pytest.raises(FieldError):
        make()  # type: ignore[operator]
