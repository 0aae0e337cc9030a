"""Exposure time, fixed and automatic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import FieldError, stream
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import (
    AutoExposure,
    BracketExposure,
    BurstExposure,
    ChannelExposure,
    Exposure,
    FixedExposure,
    OpticalImage,
    RawImage,
    SensorModel,
    capture,
    expected_electrons,
    expose,
    exposure_time,
    fixed_pattern_stream,
    saturation_electrons,
    sensor,
)
from fullwell.sensor.cfa import channel_index_map
from fullwell.sensor.exposure import metered_rate

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


def rgb(**changes: object) -> SensorModel:
    return replace(sensor("ideal-rgb"), rows=10, cols=10, **changes)  # type: ignore[arg-type]


def test_the_brightest_period_counts_as_a_whole() -> None:
    """One white pixel among black ones fills a quarter of its period in a monochrome sensor with a 1 x 1 pattern: itself."""
    rate = np.zeros((4, 4))
    rate[1, 2] = 100.0
    assert metered_rate(rate, mono(), AutoExposure("luminance")) == 100.0
    assert metered_rate(rate, rgb(), AutoExposure("luminance")) == 50.0  # one of two green pixels


def test_centre_weighting_prefers_the_centre_and_keeps_uniform_light() -> None:
    centre, corner = np.ones((21, 21)), np.ones((21, 21))
    centre[10, 10], corner[0, 0] = 100.0, 100.0
    setting = AutoExposure("centre_weighted")
    assert metered_rate(np.full((9, 4), 3.0), mono(), setting) == pytest.approx(3.0, rel=ROUNDING)
    assert metered_rate(centre, mono(), setting) > 1.5
    assert metered_rate(corner, mono(), setting) < 1.1


def test_highlights_of_one_colour_are_kept() -> None:
    rate = np.ones((20, 20))
    rate[0::2, 0::2] = 50.0  # all red pixels, a quarter of the image
    assert metered_rate(rate, rgb(), AutoExposure("highlight", percentile=60.0)) == 50.0
    assert metered_rate(rate, rgb(), AutoExposure("percentile", percentile=60.0)) == 1.0


def test_an_area_is_metered_alone() -> None:
    rate = np.arange(100.0).reshape(10, 10)
    found = metered_rate(rate, mono(), AutoExposure("area", area=(0.2, 0.5, 0.3, 0.5)))
    assert found == pytest.approx(rate[2:5, 5:].mean(), rel=ROUNDING)
    assert metered_rate(rate, mono(), AutoExposure("area", area=(0.99, 0.99, 0.005, 0.005))) == 99.0


@pytest.mark.parametrize(
    "make",
    [
        lambda: AutoExposure(area=(0.5, 0.5, 0.6, 0.1)),
        lambda: AutoExposure(area=(0.0, 0.0, 0.0, 0.1)),
        lambda: BracketExposure(FixedExposure(0.01), (1.0,)),
        lambda: BracketExposure(FixedExposure(0.01), (1.0, 0.0)),
        lambda: BracketExposure(FixedExposure(0.01), (1.0, 0.5), "best"),  # type: ignore[arg-type]
        lambda: BurstExposure(FixedExposure(0.01), 1),
        lambda: BurstExposure(FixedExposure(0.01), 4, "median"),  # type: ignore[arg-type]
        lambda: ChannelExposure(FixedExposure(0.01), ()),
        lambda: ChannelExposure(FixedExposure(0.01), (("R", -1.0),)),
    ],
)
def test_an_impossible_plan_of_captures_is_refused(make: object) -> None:
    with pytest.raises(FieldError):
        make()  # type: ignore[operator]


def test_ratios_for_a_channel_that_is_not_there_are_answered_with_the_nearest() -> None:
    with pytest.raises(FieldError, match="did you mean 'R'"):
        shoot(rgb(), ChannelExposure(FixedExposure(0.01), (("r", 2.0),)))
    with pytest.raises(FieldError, match="several readouts"):
        shoot(replace(sensor("imx490"), rows=4, cols=4), ChannelExposure(FixedExposure(0.01), (("R", 2.0),)))


def shoot(camera: SensorModel, exposure: Exposure) -> RawImage:
    streams = {"rng": stream(1, "x"), "fixed_pattern_rng": fixed_pattern_stream(camera)}
    return expose(scene(), camera, exposure, **streams, keep_mean_electrons=True)


def test_channels_of_different_times_agree_on_the_light() -> None:
    camera = rgb(analog_offset_v=0.01)
    plain = shoot(camera, FixedExposure(0.002))
    ratios = (("R", 0.25), ("B", 0.5))
    apart = shoot(camera, ChannelExposure(FixedExposure(0.002), ratios))
    assert apart.exposure_time_s == 0.002
    assert dict(apart.channel_exposure_time_s) == pytest.approx({"R": 0.0005, "G": 0.002, "B": 0.001})
    np.testing.assert_allclose(apart.mean_electrons, plain.mean_electrons, rtol=1e-6)
    noise_dn = 6 * np.sqrt(4 * np.maximum(plain.mean_electrons, 1.0)) / plain.electrons_per_dn + 3  # type: ignore[arg-type, type-var]
    assert np.all(np.abs(apart.dn.astype(float) - plain.dn.astype(float)) < noise_dn)


def test_channels_find_their_own_times() -> None:
    camera = rgb()
    raw = shoot(camera, ChannelExposure(AutoExposure("full", level=0.5, max_time_s=100.0)))
    times_s = dict(raw.channel_exposure_time_s)
    rate = expected_electrons(scene(), camera, 1.0)
    index = channel_index_map(camera.cfa, rows=10, cols=10)
    for k, name in enumerate(camera.cfa.channel_names):
        assert np.max(rate[index == k]) * times_s[name] == pytest.approx(50_000, rel=ROUNDING)
    assert raw.exposure_time_s == max(times_s.values())


def test_the_size_of_the_blocks_changes_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    camera = replace(sensor("imx490"), rows=10, cols=10, dsnu_v=1e-3, prnu_fraction=0.01, row_noise_v=1e-3, row_offset_v=1e-3)
    camera = replace(camera, hot_pixel_fraction=0.1, hot_pixel_dark_current_e_per_s=1e4, column_offset_v=1e-3, reset_noise_e=3)
    whole = shoot(camera, FixedExposure(0.01)).dn
    for pixels in (1, 20, 70):
        monkeypatch.setattr("fullwell.sensor.model._PIXELS_AT_A_TIME", pixels)
        np.testing.assert_array_equal(shoot(camera, FixedExposure(0.01)).dn, whole)


def test_the_rows_of_a_rolling_shutter_start_one_after_the_other() -> None:
    raw = shoot(mono(line_time_s=2e-5), FixedExposure(0.004))
    np.testing.assert_allclose(raw.row_start_s, np.arange(10) * 2e-5)
    np.testing.assert_allclose(raw.row_middle_s, np.arange(10) * 2e-5 + 0.002)
    assert not np.any(shoot(mono(), FixedExposure(0.004)).row_start_s)


def test_a_bracket_says_when_its_captures_were_taken() -> None:
    raw = shoot(mono(line_time_s=1e-5), BracketExposure(FixedExposure(0.004), (1.0, 0.25)))
    assert [(record.start_s, record.exposure_time_s) for record in raw.captures] == [
        (0.0, 0.004),
        (pytest.approx(0.004 + 9e-5), 0.001),
    ]


@pytest.mark.parametrize(
    "exposure",
    [
        FixedExposure(0.01),
        BracketExposure(FixedExposure(0.01), (1.0, 0.25, 0.0625)),
        BracketExposure(AutoExposure(), (4.0, 1.0), "select"),
        BurstExposure(FixedExposure(0.01), 3, "mean"),
        BurstExposure(AutoExposure(), 256, "sum"),
    ],
)
@pytest.mark.parametrize("name", ["imx490", "ideal-mono"])
def test_every_plan_of_captures_gives_a_linear_image_within_its_levels(name: str, exposure: Exposure) -> None:
    camera = replace(sensor(name), rows=10, cols=10, pixel_pitch_m=4e-6)
    raw = shoot(camera, exposure)
    assert raw.dn.dtype == (np.uint16 if raw.adc_bits <= 16 else np.uint32)
    assert raw.black_level_dn < raw.white_level_dn <= 2**raw.adc_bits - 1 + 1e-6 * 2**raw.adc_bits
    assert raw.adc_bits <= 26
    assert np.max(raw.dn) <= 2**raw.adc_bits - 1
    signal_e = (raw.dn.astype(float) - raw.black_level_dn) * raw.electrons_per_dn
    assert raw.mean_electrons is not None
    unsaturated = raw.mean_electrons < 0.9 * (raw.white_level_dn - raw.black_level_dn) * raw.electrons_per_dn
    assert np.mean(signal_e[unsaturated]) == pytest.approx(float(np.mean(raw.mean_electrons[unsaturated])), rel=0.02)


def test_dark_current_that_fills_a_capture_to_combine_is_refused() -> None:
    hot = replace(sensor("imx490"), rows=10, cols=10, pixel_pitch_m=4e-6, dark_current_e_per_s=50.0, temperature_k=420.0)
    with pytest.raises(FieldError, match="sees no light"):
        shoot(hot, FixedExposure(1.0))
    assert shoot(replace(hot, photodiodes=()), FixedExposure(1.0)).saturated_fraction == 1.0


def test_a_burst_has_the_fixed_pattern_of_a_single_frame() -> None:
    camera = mono(dsnu_v=0.01, analog_offset_v=0.1)
    black = OpticalImage(np.zeros((10, 10, 11), np.float32), GRID, 4e-6)
    one, four = (
        expose(black, camera, exposure, rng=stream(1, "x"), fixed_pattern_rng=fixed_pattern_stream(camera))
        for exposure in (FixedExposure(0.01), BurstExposure(FixedExposure(0.01), 4, "sum"))
    )
    np.testing.assert_array_equal(four.dn, 4 * one.dn.astype(np.uint32))
