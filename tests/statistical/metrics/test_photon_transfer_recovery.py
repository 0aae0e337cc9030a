"""A photon-transfer measurement returns the parameters that were put into the simulated sensor."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fullwell.core import stream
from fullwell.metrics import ExposedStack, PhotonTransfer, photon_transfer
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import OpticalImage, SensorModel, capture, fixed_pattern_stream, sensor

RECOVERY = 0.01
"""The promise: parameters put in come back within 1 %."""

SIDE_PX = 256
FRAMES = 12
FULL_TIME_S = 0.1
"""Exposure at which the light fills the well."""

GRID = WavelengthGrid(550.0, 550.0, 10.0)


@cache
def _model() -> SensorModel:
    """A 14-bit sensor whose noise is resolved by its ADC: 0.68 e- per DN, read noise 5 e-, DSNU 8 e-, PRNU 2 %."""
    return replace(
        sensor("ideal-mono"),
        rows=SIDE_PX,
        cols=SIDE_PX,
        well_capacity_e=10_000.0,
        conversion_gain_v_per_e=9e-5,
        voltage_swing_v=1.0,
        adc_bits=14,
        read_noise_e=5.0,
        dsnu_v=7.2e-4,
        prnu_fraction=0.02,
        dark_current_e_per_s=50.0,
        analog_offset_v=0.02,
    )


def _stack(model: SensorModel, light: float, time_s: float, frames: int, name: str) -> ExposedStack:
    """Light 1 fills the well in FULL_TIME_S."""
    photons = light * model.well_capacity_e / FULL_TIME_S / (model.pixel_pitch_m**2 * model.fill_factor * GRID.step_nm)
    optical = OpticalImage(np.full((SIDE_PX, SIDE_PX, 1), photons, np.float32), GRID, model.pixel_pitch_m)
    frame_dn = [
        capture(optical, model, time_s, rng=stream(7, name, str(time_s), k), fixed_pattern_rng=fixed_pattern_stream(model)).dn
        for k in range(frames)
    ]
    return ExposedStack(np.stack(frame_dn), time_s)


@cache
def _measured() -> PhotonTransfer:
    model = _model()
    times_s = [*(FULL_TIME_S * np.linspace(0.05, 0.7, 12)), 1.2 * FULL_TIME_S, 2.0 * FULL_TIME_S]
    flats = [_stack(model, 1.0, float(time_s), FRAMES, "flat") for time_s in times_s]
    return photon_transfer(flats, [_stack(model, 0.0, time_s, 2 * FRAMES, "dark") for time_s in (0.01, 2.0)])


def _step_e(model: SensorModel) -> float:
    return model.voltage_swing_v / (2**model.adc_bits - 1) / model.conversion_gain_v_per_e


def test_the_conversion_gain_comes_back() -> None:
    measured, expected = _measured(), _step_e(_model())
    assert measured.conversion_gain_e_per_dn == pytest.approx(expected, rel=RECOVERY)
    z = (measured.conversion_gain_e_per_dn - expected) / measured.conversion_gain_standard_error
    assert abs(z) < 4.0, "four standard errors"


def test_the_read_noise_comes_back() -> None:
    assert _measured().read_noise_e == pytest.approx(_model().read_noise_e, rel=RECOVERY)


def test_the_full_well_comes_back() -> None:
    assert _measured().full_well_e == pytest.approx(_model().well_capacity_e, rel=RECOVERY)


def test_the_prnu_comes_back() -> None:
    assert _measured().prnu_fraction == pytest.approx(_model().prnu_fraction, rel=RECOVERY)


def test_the_dsnu_comes_back() -> None:
    model = _model()
    assert _measured().dsnu_e == pytest.approx(model.dsnu_v / model.conversion_gain_v_per_e, rel=RECOVERY)


def test_the_dark_current_and_the_black_level_come_back() -> None:
    model, measured = _model(), _measured()
    assert measured.dark_current_e_per_s == pytest.approx(model.dark_current_e_per_s, rel=RECOVERY)
    black_dn = model.analog_offset_v / model.voltage_swing_v * (2**model.adc_bits - 1)
    assert measured.black_level_dn == pytest.approx(black_dn, abs=0.2), "the DSNU's mean over 65 536 pixels: 0.05 DN"
    assert measured.notes == ()


def test_two_frames_per_level_are_enough() -> None:
    """EMVA's two-image method; the statistics of one pair are wider, so the standard error decides."""
    model = _model()
    flats = [_stack(model, 1.0, float(FULL_TIME_S * share), 2, "pair") for share in np.linspace(0.1, 0.7, 8)]
    measured = photon_transfer(flats, [_stack(model, 0.0, 0.01, 2, "dark pair")])
    z = (measured.conversion_gain_e_per_dn - _step_e(model)) / measured.conversion_gain_standard_error
    assert abs(z) < 4.0
    assert measured.full_well_e is None
    assert any("full well is not known" in note for note in measured.notes)
    assert any("dark current is not known" in note for note in measured.notes)
