"""The sensor in compatibility mode: where ISETCam is inconsistent, and what the physical model does instead."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import FieldError, ShapeError, stream
from fullwell.radiometry import WavelengthGrid
from fullwell.scene.images import OpticalImage
from fullwell.scene.isetcam import IsetcamOpticalImage
from fullwell.sensor import (
    AutoExposure,
    BracketExposure,
    FixedExposure,
    capture,
    cfa_pattern,
    fixed_pattern_stream,
    sensor,
)
from fullwell.sensor import isetcam as compat
from fullwell.sensor.isetcam_pixels import shot_electrons

STANDARD_ERRORS = 4.0
GRID = WavelengthGrid(400, 700, 10)


def _flat(photons: float, *, samples: int = 40, pitch_m: float = 1e-5) -> IsetcamOpticalImage:
    return IsetcamOpticalImage(np.full((samples, samples, GRID.count), photons), GRID.centres_nm, pitch_m, 3.9e-3)


def _quiet(**changes: object) -> compat.IsetcamSensor:
    base = compat.monochrome_sensor(rows=64, cols=64)
    return replace(base, read_noise_v=0.0, dark_voltage_v_per_s=0.0, **changes)  # type: ignore[arg-type]


def test_a_kernel_of_even_size_shifts_the_image_by_half_a_sample() -> None:
    """Inconsistency 5: a Gaussian and the centre sample, not a box; the physical model does not shift."""
    ramp = np.broadcast_to(np.arange(33.0), (33, 33))[:, :, None] * 1e15
    image = IsetcamOpticalImage(ramp, np.array([550.0]), 1e-6, 1.0)
    for pixel_m, shift in ((1e-6, 0.0), (2e-6, 0.5), (3e-6, 0.0), (4e-6, 0.5)):
        device = replace(compat.monochrome_sensor(rows=5, cols=5), pixel_height_m=pixel_m, pixel_width_m=pixel_m)
        volts = compat.volts_per_second(image, device)
        per_sample = (volts[2, 3] - volts[2, 2]) / (pixel_m / 1e-6)
        assert volts[2, 2] / per_sample == pytest.approx(16 + shift, abs=1e-9)


def test_pixels_beyond_the_image_are_dark() -> None:
    small = IsetcamOpticalImage(np.full((6, 6, 1), 1e16), np.array([550.0]), 1e-6, 1.0)
    volts = compat.volts_per_second(small, compat.monochrome_sensor(rows=8, cols=8))
    assert volts[0, 0] == 0
    assert volts[4, 4] > 0


def test_noise_flag_1_leaves_out_prnu_and_dsnu() -> None:
    """Inconsistency 6."""
    device = _quiet(prnu_fraction=0.1, dsnu_v=0.05, voltage_swing_v=10.0)
    volts = np.full((256, 256), 0.08)
    noisy, _ = compat.read_out_volts(volts, device, exposure_time_s=0.01, noise_flag=1, rng=stream(1, "flag1"))
    shot = 0.08 * device.conversion_gain_v_per_e
    assert noisy.var() == pytest.approx(shot, rel=STANDARD_ERRORS * math.sqrt(2 / volts.size))


def test_fixed_pattern_noise_is_another_one_in_each_capture() -> None:
    """Inconsistency 7: the physical model's is fixed for a serial."""
    rng = stream(2, "pattern")
    device = _quiet(dsnu_v=0.05)
    volts = np.full((128, 128), 0.5)
    first, second = (
        compat.read_out_volts(volts, device, exposure_time_s=0.01, noise_flag=2, rng=rng)[0].ravel() for _ in range(2)
    )
    assert abs(np.corrcoef(first, second)[0, 1]) < STANDARD_ERRORS / math.sqrt(volts.size)
    physical = replace(sensor("ideal-mono"), rows=64, cols=64, dsnu_v=0.05, analog_offset_v=0.3)
    light = OpticalImage(np.full((64, 64, 31), 1e12, dtype=np.float32), GRID, 4e-6)
    frames = [
        capture(light, physical, 1e-3, rng=stream(k, "frame"), fixed_pattern_rng=fixed_pattern_stream(physical)).dn.ravel()
        for k in range(2)
    ]
    assert np.corrcoef(frames[0].astype(float), frames[1].astype(float))[0, 1] > 0.9


def test_double_sampling_raises_the_noise_and_leaves_the_dark_voltage() -> None:
    """Inconsistency 8."""
    device = replace(_quiet(dsnu_v=0.01, adc_bits=10), dark_voltage_v_per_s=10.0)
    volts = np.full((256, 256), 0.4)
    plain, numbers = compat.read_out_volts(volts, device, exposure_time_s=0.01, noise_flag=2, rng=stream(3, "cds"))
    doubled, same_numbers = compat.read_out_volts(
        volts, replace(device, correlated_double_sampling=True), exposure_time_s=0.01, noise_flag=2, rng=stream(3, "cds")
    )
    rel = STANDARD_ERRORS * math.sqrt(2 / volts.size) * 2
    assert doubled.var() == pytest.approx(plain.var() + 0.01**2, rel=rel)
    assert doubled.mean() == pytest.approx(0.5, abs=STANDARD_ERRORS * doubled.std() / 256)
    np.testing.assert_array_equal(numbers, same_numbers)


def test_full_scale_is_two_to_the_bits() -> None:
    """Inconsistency 9: 1024 of 10 bits, where the physical model ends at 1023."""
    taken = compat.capture_volts(_flat(1e25), replace(_quiet(), adc_bits=10), 1.0, rng=stream(4), noise_flag=0)
    assert taken.digital_numbers is not None
    assert taken.digital_numbers.max() == 1024
    physical = replace(sensor("ideal-mono"), rows=8, cols=8, adc_bits=10)
    light = OpticalImage(np.full((8, 8, 31), 1e25, dtype=np.float32), GRID, 4e-6)
    theirs = compat.capture(light, physical, 1.0, rng=stream(5), noise_flag=0)
    assert theirs.dn.max() == theirs.white_level_dn == 1024
    ours = capture(light, physical, 1.0, rng=stream(5), fixed_pattern_rng=fixed_pattern_stream(physical))
    assert ours.dn.max() == 1023


def test_exposure_0_means_automatic_and_black_has_none() -> None:
    """Inconsistency 10: ISETCam answers +Inf for black; refused here. The physical model refuses exposure 0."""
    device = compat.bayer_sensor()
    taken = compat.capture_volts(_flat(1e16), device, 0.0, rng=stream(6), noise_flag=0)
    assert float(taken.exposure_times_s) == compat.auto_exposure_time_s(_flat(1e16), device)
    assert taken.volts.max() == pytest.approx(0.95, rel=1e-3)
    with pytest.raises(FieldError, match="Inf"):
        compat.capture_volts(_flat(0.0), device, 0.0, rng=stream(6), noise_flag=0)
    with pytest.raises(FieldError):
        FixedExposure(0.0)


def test_an_image_of_one_sample_is_refused_where_isetcam_stops_with_an_error() -> None:
    """Inconsistency 11."""
    with pytest.raises(FieldError, match="interpolated"):
        compat.volts_per_second(_flat(1e16, samples=1), compat.monochrome_sensor())
    assert compat.volts_per_second(_flat(1e16, samples=2), compat.monochrome_sensor()).max() > 0


def test_few_electrons_are_poisson_and_many_a_rounded_gaussian() -> None:
    """Inconsistency 13: the branch that forgets the conversion gain is never taken where ISETCam is used."""
    for mean in (0.3, 24.9, 25.0, 1000.0):
        electrons = shot_electrons(np.full(200_000, mean), rng=stream(7, str(mean)))
        assert np.all(electrons == np.rint(electrons))
        assert electrons.mean() == pytest.approx(mean, abs=STANDARD_ERRORS * math.sqrt(mean / electrons.size))
        rounding = 1 / 12 if mean >= 25 else 0.0
        spread = STANDARD_ERRORS * math.sqrt((2 + 1 / mean) / electrons.size)
        assert electrons.var() == pytest.approx(mean + rounding, rel=spread)


def test_electrons_are_output_volts_over_the_conversion_gain() -> None:
    """Inconsistency 14: behind gain and offset they are no photo-electrons."""
    device = compat.imx363_sensor(rows=8, cols=8)
    taken = compat.capture_volts(_flat(0.0), device, 0.01, rng=stream(8), noise_flag=0)
    assert taken.volts.max() == pytest.approx(64 * 0.44875e-3)
    assert taken.electrons.max() == pytest.approx(64 * 0.44875e-3 / device.conversion_gain_v_per_e)


def test_dark_frames_are_biased_upward() -> None:
    """Inconsistency 15: negative volts are clipped, so the mean of read noise s is s / sqrt(2 pi)."""
    device = replace(_quiet(), read_noise_v=1e-3)
    volts, _ = compat.read_out_volts(np.zeros((256, 256)), device, exposure_time_s=1e-3, noise_flag=2, rng=stream(9))
    expected = 1e-3 / math.sqrt(2 * math.pi)
    assert volts.mean() == pytest.approx(expected, abs=STANDARD_ERRORS * volts.std() / 256)


def test_negative_flags_neither_clip_nor_digitise() -> None:
    device = replace(_quiet(), adc_bits=8, gain_divisor=0.5)
    for flag in (-2, -1):
        taken = compat.capture_volts(_flat(1e20), device, 1.0, rng=stream(10), noise_flag=flag)
        assert taken.digital_numbers is None
        assert taken.volts.max() > device.voltage_swing_v


def test_a_logarithmic_pixel_and_a_vignetting_map_follow_their_formulas() -> None:
    light = _flat(1e15)
    device = compat.monochrome_sensor(rows=8, cols=8)
    linear = compat.capture_volts(light, device, 0.01, rng=stream(11), noise_flag=-1).volts
    logarithmic = compat.capture_volts(light, replace(device, log_response=True), 0.01, rng=stream(11), noise_flag=-1).volts
    np.testing.assert_allclose(logarithmic, np.log10(linear + 1e-3) + 3, rtol=1e-12)
    half = replace(device, vignetting=np.full((8, 8), 0.5))
    np.testing.assert_allclose(compat.volts_per_second(light, half), 0.5 * compat.volts_per_second(light, device))


def test_any_pattern_and_any_shape_of_pixel_is_taken() -> None:
    curves = np.stack([np.full(2, value) for value in (0.1, 0.2, 0.3, 0.4)], axis=1)
    device = compat.IsetcamSensor(
        "quad", 7, 9, ((0, 1, 2), (3, 2, 1)), np.array([300.0, 1100.0]), curves, ("r", "g", "b", "w"),
        pixel_height_m=2e-6, pixel_width_m=3e-6,
    )  # fmt: skip
    volts = compat.volts_per_second(_flat(1e15), device)
    unit = volts[0, 0] / 0.1
    expected = np.array([[0.1, 0.2, 0.3], [0.4, 0.3, 0.2]])[np.arange(7)[:, None] % 2, np.arange(9) % 3] * unit
    np.testing.assert_allclose(volts, expected, rtol=1e-12)
    times = compat.cfa_auto_exposure_times_s(_flat(1e15), device)
    taken = compat.capture_volts(_flat(1e15), device, times, rng=stream(12), noise_flag=0)
    assert taken.mode == "cfa"
    assert taken.volts.shape == (7, 9, 6)
    np.testing.assert_allclose(taken.combined(), volts, rtol=1e-9)


def test_a_single_exposure_of_a_monochrome_sensor_is_not_taken_for_one_per_filter() -> None:
    device = compat.monochrome_sensor(rows=4, cols=4)
    assert compat.capture_volts(_flat(1e14), device, 0.01, rng=stream(13)).mode == "single"
    assert compat.capture_volts(_flat(1e14), device, [0.01], rng=stream(13)).mode == "bracketed"
    assert compat.capture_volts(_flat(1e14), device, [[0.01]], rng=stream(13)).mode == "cfa"
    assert compat.capture_volts(_flat(1e14), device, [0.01, 0.01], rng=stream(13), burst=True).mode == "burst"


@pytest.mark.parametrize("time_s", [-1.0, math.nan, math.inf, [0.01, 0.0]])
def test_times_out_of_range_are_refused(time_s: object) -> None:
    with pytest.raises(FieldError):
        compat.capture_volts(_flat(1e14), compat.bayer_sensor(), time_s, rng=stream(14))  # type: ignore[arg-type]


def test_times_in_another_shape_and_unknown_flags_are_refused() -> None:
    with pytest.raises(ShapeError):
        compat.capture_volts(_flat(1e14), compat.bayer_sensor(), np.ones((3, 3)), rng=stream(15))
    with pytest.raises(ShapeError):
        compat.capture_volts(_flat(1e14), compat.bayer_sensor(), [], rng=stream(15))
    with pytest.raises(FieldError, match="noise_flag"):
        compat.capture_volts(_flat(1e14), compat.bayer_sensor(), 0.1, rng=stream(15), noise_flag=3)  # type: ignore[arg-type]
    with pytest.raises(FieldError, match="hdr"):
        compat.auto_exposure_time_s(_flat(1e14), compat.bayer_sensor(), method="hdr")  # type: ignore[arg-type]
    with pytest.raises(FieldError, match="rectangle"):
        compat.auto_exposure_time_s(_flat(1e14), compat.bayer_sensor(), method="weighted", rectangle=(1, 1, 40, 40))


def test_a_bracket_that_holds_nothing_is_refused() -> None:
    with pytest.raises(FieldError, match="NaN"):
        compat.capture_volts(_flat(1e25), compat.bayer_sensor(), [0.1, 0.2], rng=stream(16), noise_flag=0).combined()


def test_our_sensor_maps_to_the_same_electrons() -> None:
    """Coinciding grids: signal, gain and offset of both models agree; only the ADC's scale differs."""
    ours = replace(sensor("imx363"), rows=16, cols=16, read_noise_e=0.0, prnu_fraction=0.0, dsnu_v=0.0)
    light = OpticalImage(np.full((16, 16, 31), 2e14, dtype=np.float32), GRID, 1.4e-6)
    raw = compat.capture(light, ours, 0.01, rng=stream(17), noise_flag=0)
    mapped = compat.from_sensor_model(ours)
    volts = compat.volts_per_second(IsetcamOpticalImage(light.photons, GRID.centres_nm, 1.4e-6, 1.0), mapped) * 0.01
    output = np.minimum(volts * ours.analog_gain_ratio + ours.analog_offset_v, ours.voltage_swing_v)
    np.testing.assert_array_equal(raw.dn, np.floor(output / ours.voltage_swing_v * 1024 + 0.5))
    assert raw.black_level_dn == pytest.approx(ours.analog_offset_v / ours.voltage_swing_v * 1024)


@pytest.mark.parametrize("method", ["full", "mean", "percentile", "luminance", "highlight", "area", "centre_weighted"])
def test_our_automatic_exposures_map_to_isetcams(method: str) -> None:
    ours = replace(sensor("ideal-rgb"), rows=32, cols=32)
    light = OpticalImage(np.full((40, 40, 31), 1e15, dtype=np.float32), GRID, 4e-6)
    exposure = AutoExposure(method=method, level=0.5, max_time_s=100.0)  # type: ignore[arg-type]
    raw = compat.expose(light, ours, exposure, rng=stream(18), noise_flag=0)
    assert 0 < raw.exposure_time_s < 100
    if method in ("full", "luminance", "area", "centre_weighted"):
        assert raw.dn.max() == pytest.approx(0.5 * 65536, rel=1e-3)


def test_what_isetcam_has_not_is_refused() -> None:
    light = OpticalImage(np.full((40, 40, 31), 1e15, dtype=np.float32), GRID, 4e-6)
    ours = replace(sensor("ideal-rgb"), rows=8, cols=8)
    with pytest.raises(FieldError, match="BracketExposure"):
        compat.expose(light, ours, BracketExposure(FixedExposure(0.01), (1.0, 2.0)), rng=stream(19))
    with pytest.raises(FieldError, match="noise_flag"):
        compat.capture(light, ours, 0.01, rng=stream(19), noise_flag=-1)


def test_sixteen_bits_end_at_what_a_raw_image_holds() -> None:
    light = OpticalImage(np.full((8, 8, 31), 1e25, dtype=np.float32), GRID, 4e-6)
    raw = compat.capture(light, replace(sensor("ideal-mono"), rows=8, cols=8), 1.0, rng=stream(20), noise_flag=0)
    assert raw.dn.max() == 65535
    assert raw.saturated_fraction == 1.0


@pytest.mark.parametrize(
    "fault",
    [
        {"rows": 0},
        {"conversion_gain_v_per_e": math.nan},
        {"read_noise_v": -1.0},
        {"fill_factor": 1.5},
        {"analog_offset_v": math.inf},
        {"adc_bits": 0},
        {"pattern": ((4,),)},
        {"log_response": True, "read_noise_v": 0.0},
    ],
)
def test_a_sensor_out_of_range_is_refused(fault: dict[str, object]) -> None:
    with pytest.raises(FieldError):
        replace(compat.bayer_sensor(), **fault)  # type: ignore[arg-type]


def test_the_same_stream_gives_the_same_capture() -> None:
    device = replace(compat.bayer_sensor(), dsnu_v=1e-3, prnu_fraction=0.01, column_gain_sd=0.01)
    first, second = (compat.capture_volts(_flat(1e15), device, 0.01, rng=stream(21)).volts for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_named_patterns_of_the_catalogue_map() -> None:
    base = sensor("ideal-rgb")
    for name in ("rggb", "bggr"):
        pattern = cfa_pattern(name)
        mapped = compat.from_sensor_model(replace(base, cfa=replace(base.cfa, pattern=pattern)))
        assert mapped.pattern == compat.BAYER_ORDERS[name]
