"""Signal to noise, dynamic range and exposure value in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.core.errors import FieldError
from fullwell.metrics import (
    decibels,
    exposure_value,
    exposure_value_at_iso_100,
    photometric_exposure_lux_s,
    sensor_figures,
    snr_ratio,
    stops,
)


def test_shot_noise_alone_gives_the_square_root_of_the_signal() -> None:
    signal = np.array([0.0, 1e-3, 1.0, 100.0, 1e9])
    np.testing.assert_allclose(snr_ratio(signal), np.sqrt(signal), rtol=1e-15)


def test_prnu_limits_the_snr_at_high_signal() -> None:
    assert snr_ratio(1e12, prnu_fraction=0.01) == pytest.approx(100.0, rel=1e-6)


def test_every_noise_term_adds_its_variance() -> None:
    found = snr_ratio(100.0, read_noise_e=3.0, dark_e=7.0, quantisation_step_e=6.0, dsnu_e=2.0, prnu_fraction=0.1)
    assert found == pytest.approx(100 / math.sqrt(100 + 9 + 7 + 3 + 4 + 100))


def test_the_snr_is_one_at_the_absolute_sensitivity_threshold() -> None:
    noise = {"read_noise_e": 4.0, "dark_e": 3.0, "quantisation_step_e": 1.5}
    figures = sensor_figures(saturation_capacity_e=10_000.0, quantum_efficiency=0.5, **noise)
    assert snr_ratio(figures.absolute_sensitivity_threshold_e, **noise) == pytest.approx(1.0)
    assert figures.absolute_sensitivity_threshold_photons == 2 * figures.absolute_sensitivity_threshold_e


def test_an_ideal_sensor_sees_one_electron_and_has_its_well_as_dynamic_range() -> None:
    figures = sensor_figures(saturation_capacity_e=2.0**14, read_noise_e=0.0)
    assert figures.absolute_sensitivity_threshold_e == 1.0
    assert figures.dynamic_range_stops == pytest.approx(14.0)
    assert figures.dynamic_range_db == pytest.approx(20 * 14 * math.log10(2))
    assert figures.snr_max_ratio == 128.0
    assert figures.snr_max_db == pytest.approx(20 * math.log10(128))


def test_dark_signal_uses_some_of_the_well() -> None:
    assert sensor_figures(saturation_capacity_e=1000.0, read_noise_e=1.0, dark_e=300.0).saturation_capacity_e == 700.0
    with pytest.raises(FieldError, match="Shorten the exposure"):
        sensor_figures(saturation_capacity_e=1000.0, read_noise_e=1.0, dark_e=1000.0)


def test_ratios_in_decibels_and_stops() -> None:
    assert decibels(10.0) == pytest.approx(20.0)
    assert stops(8.0) == 3.0
    assert decibels(0.0) == -math.inf
    assert stops(0.0) == -math.inf


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_impossible_noise_is_refused_by_name(value: float) -> None:
    with pytest.raises(FieldError, match="read_noise_e"):
        snr_ratio(1.0, read_noise_e=value)
    with pytest.raises(FieldError, match="signal_e"):
        snr_ratio(value)
    with pytest.raises(FieldError, match="read_noise_e"):
        sensor_figures(saturation_capacity_e=1.0, read_noise_e=value)


@pytest.mark.parametrize("value", [0.0, 1.5, math.nan])
def test_an_impossible_quantum_efficiency_is_refused(value: float) -> None:
    with pytest.raises(FieldError, match="quantum_efficiency"):
        sensor_figures(saturation_capacity_e=10.0, read_noise_e=0.0, quantum_efficiency=value)


def test_the_exposure_value_is_0_at_f_1_and_one_second_and_counts_stops() -> None:
    assert exposure_value(f_number=1.0, exposure_time_s=1.0) == 0.0
    assert exposure_value(f_number=16.0, exposure_time_s=1 / 128) == pytest.approx(15.0)
    assert exposure_value_at_iso_100(f_number=16.0, exposure_time_s=1 / 128, iso_speed=400) == pytest.approx(13.0)


def test_extreme_settings_stay_finite() -> None:
    assert math.isfinite(exposure_value(f_number=1e-300, exposure_time_s=1e300))


def test_photometric_exposure_is_illuminance_times_time() -> None:
    assert photometric_exposure_lux_s(10.0, exposure_time_s=0.02) == pytest.approx(0.2)
    with pytest.raises(FieldError, match="illuminance_lux"):
        photometric_exposure_lux_s(-1.0, exposure_time_s=0.02)
    with pytest.raises(FieldError, match="f_number"):
        exposure_value(f_number=0.0, exposure_time_s=1.0)
