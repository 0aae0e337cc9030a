"""Well, amplifier, ADC and the ends of the scale."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import FieldError, stream
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import (
    OpticalImage,
    RawImage,
    SensorModel,
    capture,
    expected_electrons,
    fixed_pattern_stream,
    saturation_electrons,
    sensor,
)
from fullwell.sensor.adc import quantise
from fullwell.sensor.amplifier import amplify
from fullwell.sensor.full_well import limit_to_well

GRID = WavelengthGrid(500.0, 600.0, 10.0)


def model(name: str = "imx363", **changes: object) -> SensorModel:
    return replace(sensor(name), rows=20, cols=30, pixel_pitch_m=2e-6, **changes)  # type: ignore[arg-type]


def take(light: float, camera: SensorModel, time_s: float = 0.01) -> RawImage:
    optical = OpticalImage(np.full((20, 30, 11), light, np.float32), GRID, 2e-6)
    return capture(optical, camera, time_s, rng=stream(0, "limits"), fixed_pattern_rng=fixed_pattern_stream(camera))


def test_zero_light_gives_black_level() -> None:
    camera = model(read_noise_e=0.0, dsnu_v=0.0)
    raw = take(0.0, camera)
    assert raw.black_level_dn == pytest.approx(0.0287 / 0.4591 * 1023)
    assert np.all(raw.dn == round(raw.black_level_dn))
    assert raw.saturated_fraction == 0


@pytest.mark.parametrize("light", [1e25, 3e38])
@pytest.mark.parametrize("name", ["imx363", "ideal-mono"])
def test_light_without_end_gives_the_white_level(light: float, name: str) -> None:
    raw = take(light, model(name))
    assert np.all(raw.dn == 2**raw.adc_bits - 1)
    assert raw.white_level_dn == pytest.approx(2**raw.adc_bits - 1)
    assert raw.saturated_fraction == 1


def test_a_well_smaller_than_the_adc_clips_first() -> None:
    camera = model("ideal-mono", well_capacity_e=20_000.0)
    raw = take(1e25, camera)
    assert np.all(raw.dn == round(0.2 * 65535))
    assert raw.white_level_dn == pytest.approx(0.2 * 65535)
    assert raw.saturated_fraction == 1


def test_the_offset_uses_no_well_capacity() -> None:
    camera = model("ideal-mono", well_capacity_e=30_000.0, analog_offset_v=0.1)
    assert np.all(take(1e25, camera).dn == round(0.4 * 65535))


def test_analog_gain_lowers_the_saturation_signal() -> None:
    assert saturation_electrons(model("ideal-mono", analog_gain_ratio=4.0)) == pytest.approx(25_000)
    assert saturation_electrons(model("ideal-mono", analog_gain_ratio=0.5)) == pytest.approx(100_000)


@pytest.mark.parametrize("bits", [1, 8, 10, 12, 16])
def test_full_scale_is_two_to_the_bits_minus_one(bits: int) -> None:
    found = quantise(np.array([-1.0, 0.0, 0.5, 1.0]), voltage_swing_v=0.5, adc_bits=bits)
    assert found.tolist() == [0, 0, 2**bits - 1, 2**bits - 1]
    assert found.dtype == np.uint16


def test_halves_are_rounded_to_the_even_code() -> None:
    assert quantise(np.array([0.5, 1.5, 2.5, 3.5]), voltage_swing_v=255.0, adc_bits=8).tolist() == [0, 2, 2, 4]


def test_every_code_occurs() -> None:
    ramp = np.linspace(0, 1, 40_001)
    assert np.unique(quantise(ramp, voltage_swing_v=1.0, adc_bits=10)).size == 1024


def test_the_amplifier_multiplies_before_it_adds() -> None:
    np.testing.assert_allclose(amplify(np.array([0.0, 0.1]), analog_gain_ratio=3.0, analog_offset_v=0.2), [0.2, 0.5])


def test_the_well_keeps_what_fits() -> None:
    assert limit_to_well(np.array([0.0, 99.0, 100.0, 1e9]), well_capacity_e=100.0).tolist() == [0, 99, 100, 100]


def test_electrons_are_area_time_fill_factor_and_efficiency_times_light() -> None:
    camera = model("ideal-mono", fill_factor=0.6)
    optical = OpticalImage(np.full((20, 30, 11), 2e15, np.float32), GRID, 2e-6)
    light = float(np.float32(2e15))
    np.testing.assert_allclose(expected_electrons(optical, camera, 0.02), light * 110 * 4e-12 * 0.6 * 0.02, rtol=1e-12)


def test_the_noise_free_electrons_come_along_on_request() -> None:
    camera = model("ideal-mono", dark_current_e_per_s=1000.0)
    optical = OpticalImage(np.full((20, 30, 11), 2e15, np.float32), GRID, 2e-6)
    generators = {"rng": stream(0, "a"), "fixed_pattern_rng": stream(0, "b")}
    raw = capture(optical, camera, 0.01, **generators, keep_mean_electrons=True)
    np.testing.assert_allclose(raw.mean_electrons, expected_electrons(optical, camera, 0.01) + 10.0, rtol=1e-6)
    assert take(1e15, camera).mean_electrons is None


def test_the_raw_image_knows_what_the_image_processor_needs() -> None:
    raw = take(1e15, model())
    assert raw.pattern == (("R", "G"), ("G", "B"))
    assert [name for name, _ in raw.channels] == ["R", "G", "B"]
    assert (raw.sensor_name, raw.adc_bits, raw.exposure_time_s, raw.grid) == ("imx363", 10, 0.01, GRID)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_irradiance_that_is_not_light_is_refused(bad: float) -> None:
    photons = np.ones((20, 30, 11), np.float32)
    photons[4, 5, 6] = bad
    with pytest.raises(FieldError, match="irradiance"):
        expected_electrons(OpticalImage(photons, GRID, 2e-6), model(), 0.01)


@pytest.mark.parametrize("time_s", [0.0, -1.0, float("nan"), float("inf")])
def test_an_impossible_exposure_time_is_refused(time_s: float) -> None:
    with pytest.raises(FieldError, match="exposure_time_s"):
        take(1e15, model(), time_s)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("rows", 0),
        ("cols", -3),
        ("pixel_pitch_m", 0.0),
        ("pixel_pitch_m", float("nan")),
        ("fill_factor", 0.0),
        ("fill_factor", 1.1),
        ("well_capacity_e", -200.0),
        ("well_capacity_e", 1e13),
        ("conversion_gain_v_per_e", 0.0),
        ("voltage_swing_v", float("inf")),
        ("dark_current_e_per_s", -1.0),
        ("read_noise_e", float("nan")),
        ("dsnu_v", -1e-3),
        ("prnu_fraction", -0.1),
        ("analog_gain_ratio", 0.0),
        ("analog_offset_v", -0.01),
        ("analog_offset_v", 0.5),
        ("adc_bits", 0),
        ("adc_bits", 17),
    ],
)
def test_an_impossible_parameter_is_refused_by_its_name(field: str, value: float) -> None:
    with pytest.raises(FieldError, match=rf"^{field} is ") as caught:
        replace(sensor("imx363"), **{field: value})
    assert caught.value.path == field
