"""Rows, columns, hot pixels, double sampling, and the pattern of a chip of which a part is read."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import stream
from fullwell.radiometry import WavelengthGrid
from fullwell.sensor import OpticalImage, SensorModel, capture, fixed_pattern_stream, sensor
from fullwell.sensor.fixed_pattern import array_window, fixed_patterns
from fullwell.sensor.hot_pixels import dark_current_map

ROWS, COLS = 240, 250
PIXELS = ROWS * COLS
GRID = WavelengthGrid(550.0, 550.0, 10.0)
DN_V = 1.0 / 65535
"""Of the 16-bit converter with a swing of 1 V."""

Z_LIMIT = 4.0
"""Standard errors of the estimate; about 30 comparisons, so a false alarm has a chance of 0.2 %."""


def mono(**changes: object) -> SensorModel:
    base = replace(sensor("ideal-mono"), rows=ROWS, cols=COLS, analog_offset_v=0.2)
    return replace(base, **changes)  # type: ignore[arg-type]


def dark_v(camera: SensorModel, frame: int = 0, time_s: float = 0.01) -> np.ndarray:
    """Return a dark frame over the black level [V]."""
    black = OpticalImage(np.zeros((camera.rows, camera.cols, 1), np.float32), GRID, 4e-6)
    raw = capture(black, camera, time_s, rng=stream(0, "f", frame), fixed_pattern_rng=fixed_pattern_stream(camera))
    return raw.dn.astype(float) * DN_V - 0.2


def test_row_noise_is_the_same_along_a_row_and_new_in_each_frame() -> None:
    one, two = (dark_v(mono(row_noise_v=0.01), frame) for frame in (0, 1))
    assert np.max(np.std(one, axis=1)) < DN_V
    rows = one[:, 0], two[:, 0]
    assert np.std(rows[0]) == pytest.approx(0.01, rel=Z_LIMIT / math.sqrt(2 * ROWS))
    assert abs(np.corrcoef(*rows)[0, 1]) < Z_LIMIT / math.sqrt(ROWS)


def test_column_and_row_offsets_stay_with_the_sensor() -> None:
    camera = mono(column_offset_v=0.01, row_offset_v=0.003)
    one, two = dark_v(camera, 0), dark_v(camera, 1)
    np.testing.assert_array_equal(one, two)
    columns, rows = one.mean(axis=0), one.mean(axis=1)
    assert np.std(columns) == pytest.approx(0.01, rel=Z_LIMIT / math.sqrt(2 * COLS))
    assert np.std(rows) == pytest.approx(0.003, rel=Z_LIMIT / math.sqrt(2 * ROWS))
    np.testing.assert_allclose(one, columns[None, :] + rows[:, None] - one.mean(), atol=2 * DN_V)
    assert not np.array_equal(one, dark_v(replace(camera, serial=7)))


def test_the_gain_of_columns_scales_the_signal() -> None:
    camera = mono(column_gain_fraction=0.05, dark_current_e_per_s=1e6)  # 10 000 e- are 0.1 V
    columns = dark_v(camera).mean(axis=0)
    assert np.std(columns) == pytest.approx(0.005, rel=Z_LIMIT / math.sqrt(2 * COLS) + 0.01)
    np.testing.assert_allclose(columns, dark_v(camera, 1).mean(axis=0), atol=Z_LIMIT * 1.5e-3 / math.sqrt(ROWS))


def test_reset_noise_adds_to_a_single_sample() -> None:
    found = dark_v(mono(reset_noise_e=300.0, read_noise_e=400.0))
    assert np.std(found) == pytest.approx(500e-5, rel=Z_LIMIT / math.sqrt(2 * PIXELS))


def test_double_sampling_removes_reset_noise_and_offsets_and_widens_the_read_noise() -> None:
    everything = {"reset_noise_e": 900.0, "dsnu_v": 0.02, "column_offset_v": 0.02, "row_offset_v": 0.02}
    found = dark_v(mono(**everything, readout_sampling="correlated_double", read_noise_e=100.0))
    assert np.std(found) == pytest.approx(math.sqrt(2) * 100e-5, rel=Z_LIMIT / math.sqrt(2 * PIXELS))
    assert abs(np.mean(found)) < Z_LIMIT * math.sqrt(2) * 100e-5 / math.sqrt(PIXELS)
    quiet = dark_v(mono(**everything, readout_sampling="correlated_double"))
    assert np.max(np.abs(quiet)) < DN_V
    assert np.std(dark_v(mono(**everything))) > 0.03


def test_double_sampling_keeps_the_signal_and_the_dark_current() -> None:
    camera = mono(readout_sampling="correlated_double", dark_current_e_per_s=1e6, dsnu_v=0.05)
    found = dark_v(camera)
    assert np.mean(found) == pytest.approx(0.1, abs=Z_LIMIT * 1e-3 / math.sqrt(PIXELS))
    assert np.var(found) == pytest.approx(1e4 * 1e-10, rel=Z_LIMIT * math.sqrt(2 / PIXELS) + 0.01)


def test_row_noise_of_both_samples_remains() -> None:
    rows = dark_v(mono(readout_sampling="correlated_double", row_noise_v=0.01))[:, 0]
    assert np.std(rows) == pytest.approx(math.sqrt(2) * 0.01, rel=Z_LIMIT / math.sqrt(2 * ROWS))


CHIP = {"array_rows": ROWS, "array_cols": COLS}


def test_a_part_of_the_chip_has_a_part_of_its_pattern() -> None:
    camera = mono(**CHIP, dsnu_v=0.02, column_offset_v=0.01, row_offset_v=0.01, column_gain_fraction=0.1)
    part = dark_v(replace(camera, rows=100, cols=60))
    np.testing.assert_array_equal(part, dark_v(camera)[70:170, 95:155])


def test_a_part_of_the_chip_has_its_hot_pixels() -> None:
    camera = mono(**CHIP, dark_current_e_per_s=10.0, dcnu_fraction=0.3)
    camera = replace(camera, hot_pixel_fraction=0.01, hot_pixel_dark_current_e_per_s=1e4)
    part = replace(camera, rows=100, cols=60)
    maps = [dark_current_map(model, fixed_patterns(model, fixed_pattern_stream(model), 1)[0]) for model in (camera, part)]
    np.testing.assert_array_equal(maps[1], maps[0][70:170, 95:155])  # type: ignore[index]


def test_a_part_of_the_chip_starts_with_a_whole_period_of_the_filters() -> None:
    colour = replace(sensor("imx363"), rows=11, cols=10)
    window = array_window(colour)
    assert (window.top % 2, window.left % 2) == (0, 0)
    assert abs(window.top + 5.5 - 1512) <= 1
    assert array_window(replace(colour, rows=5000)).array_rows == 5000


def test_hot_pixels_are_as_many_and_as_hot_as_asked() -> None:
    camera = mono(hot_pixel_fraction=0.01, hot_pixel_dark_current_e_per_s=2e5)  # a mean of 2000 e- in 10 ms
    one, two = dark_v(camera, 0) / 1e-5, dark_v(camera, 1) / 1e-5
    hot = one > 20
    share = 0.01 * math.exp(-0.01)  # of an exponential of mean 2000 about 1 % lies below 20
    assert np.mean(hot) == pytest.approx(share, abs=Z_LIMIT * math.sqrt(share / PIXELS) + 1e-4)
    count = 0.01 * PIXELS
    assert np.sum(one) == pytest.approx(2000 * count, rel=Z_LIMIT * math.sqrt(2 / count) + 0.01)
    assert np.corrcoef(one[hot], two[hot])[0, 1] > 0.99


def test_hot_pixels_cool_down() -> None:
    camera = mono(hot_pixel_fraction=0.01, hot_pixel_dark_current_e_per_s=2e6)
    cold = replace(camera, temperature_k=camera.temperature_k - 24.0)
    assert np.sum(dark_v(cold)) == pytest.approx(np.sum(dark_v(camera)) / 8, rel=0.02)


def test_dark_current_differs_from_pixel_to_pixel_by_its_spread() -> None:
    camera = mono(dark_current_e_per_s=1e6, dcnu_fraction=0.1)
    one, two = dark_v(camera, 0) / 1e-5, dark_v(camera, 1) / 1e-5
    fixed = np.mean((one - one.mean()) * (two - two.mean()))  # shot noise of two frames is independent
    assert fixed == pytest.approx((0.1 * 1e4) ** 2, rel=Z_LIMIT * math.sqrt(2 / PIXELS) + 0.01)
