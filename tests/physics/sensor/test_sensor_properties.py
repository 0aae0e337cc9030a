"""Whatever the light, the time and the sensor: finite, within the levels, monotonous; nonsense is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fullwell.core import FieldError, stream
from fullwell.radiometry import DEFAULT_GRID, WavelengthGrid, band_photons, illuminant, scale_to_illuminance
from fullwell.sensor import (
    AutoExposure,
    BracketExposure,
    ChiefRayFalloff,
    FixedExposure,
    OpticalImage,
    RawImage,
    SensorModel,
    expose,
    fixed_pattern_stream,
    photo_electron_rate,
    sensor,
    sensor_names,
)

FLOAT32 = 1e-6
"""Relative; irradiance is stored in single precision."""

KERNEL = ((0.0, 0.02, 0.0), (0.02, 0.92, 0.02), (0.0, 0.02, 0.0))
GRIDS = (
    WavelengthGrid(550.0, 550.0, 10.0),
    DEFAULT_GRID,
    WavelengthGrid(400.0, 700.0, 1.0),
    WavelengthGrid(380.0, 1000.0, 20.0),
)

decades = st.floats(min_value=10.0, max_value=22.0).map(lambda exponent: 10.0**exponent)
times = st.floats(min_value=-6.0, max_value=0.0).map(lambda exponent: 10.0**exponent)


def dirty(name: str, rows: int, cols: int) -> SensorModel:
    """Return a sensor of the catalogue with every effect switched on."""
    return replace(
        sensor(name),
        rows=rows,
        cols=cols,
        prnu_fraction=0.02,
        dsnu_v=1e-3,
        dcnu_fraction=0.2,
        dark_current_e_per_s=50.0,
        hot_pixel_fraction=0.05,
        hot_pixel_dark_current_e_per_s=1e4,
        column_offset_v=1e-4,
        row_offset_v=1e-4,
        column_gain_fraction=0.01,
        row_noise_v=1e-4,
        reset_noise_e=3.0,
        crosstalk_kernel=KERNEL,
        microlens=ChiefRayFalloff(2.0, 4e-3),
        line_time_s=1e-5,
    )


def uniform(level: float, model: SensorModel, grid: WavelengthGrid) -> OpticalImage:
    return OpticalImage(np.full((model.rows, model.cols, grid.count), level, np.float32), grid, model.pixel_pitch_m)


def take(model: SensorModel, optical: OpticalImage, exposure: object) -> RawImage:
    streams = {"rng": stream(0, "property"), "fixed_pattern_rng": fixed_pattern_stream(model)}
    return expose(optical, model, exposure, **streams, keep_mean_electrons=True)  # type: ignore[arg-type]


def check(raw: RawImage) -> None:
    assert np.issubdtype(raw.dn.dtype, np.unsignedinteger)
    assert int(np.max(raw.dn)) <= 2**raw.adc_bits - 1
    assert raw.mean_electrons is not None
    assert np.all(np.isfinite(raw.mean_electrons))
    assert np.all(raw.mean_electrons >= 0)
    assert 0 <= raw.saturated_fraction <= 1
    assert math.isfinite(raw.black_level_dn)
    assert raw.black_level_dn < raw.white_level_dn


@pytest.mark.slow
@settings(deadline=None, max_examples=120)
@given(
    name=st.sampled_from(sensor_names()),
    level=st.one_of(st.just(0.0), decades),
    time_s=times,
    rows=st.integers(1, 9),
    cols=st.integers(1, 9),
    grid=st.sampled_from(GRIDS),
    sampling=st.sampled_from(("single", "correlated_double")),
)
@example(name="imx363", level=0.0, time_s=1e-6, rows=1, cols=1, grid=GRIDS[0], sampling="single")
@example(name="imx490", level=1e22, time_s=1.0, rows=1, cols=1, grid=GRIDS[2], sampling="correlated_double")
def test_any_light_any_time_any_size_gives_numbers_within_their_bits(
    *, name: str, level: float, time_s: float, rows: int, cols: int, grid: WavelengthGrid, sampling: str
) -> None:
    model = replace(dirty(name, rows, cols), readout_sampling=sampling)  # type: ignore[arg-type]
    optical = uniform(level, model, grid)
    check(take(model, optical, FixedExposure(time_s)))
    check(take(model, optical, AutoExposure("luminance", min_time_s=1e-6)))
    check(take(model, optical, BracketExposure(FixedExposure(time_s), (1.0, 1e-3))))


@settings(deadline=None, max_examples=60)
@given(level=decades, factor=st.floats(1e-6, 1e6), name=st.sampled_from(sensor_names()))
def test_electrons_are_proportional_to_the_light_over_twelve_decades(level: float, factor: float, name: str) -> None:
    model = dirty(name, 3, 4)
    one = photo_electron_rate(uniform(level, model, DEFAULT_GRID), model)
    other = photo_electron_rate(uniform(level * factor, model, DEFAULT_GRID), model)
    np.testing.assert_allclose(other, one * factor, rtol=FLOAT32)


@settings(deadline=None, max_examples=60)
@given(first=times, ratio=st.floats(1.0, 1e6), level=decades)
def test_a_noise_free_picture_never_gets_darker_with_time(first: float, ratio: float, level: float) -> None:
    model = replace(sensor("iset-a"), rows=2, cols=2, read_noise_e=0.0, dark_current_e_per_s=0.0)
    optical = uniform(level, model, GRIDS[0])
    short, long = (take(model, optical, FixedExposure(t)).mean_electrons for t in (first, first * ratio))
    assert np.all(long >= short)  # type: ignore[operator]


@pytest.mark.parametrize("lux", [1e-4, 1.0, 1e5, 1e9])
@pytest.mark.parametrize("time_s", [1e-6, 1.0])
def test_any_illuminance_is_digitised(lux: float, time_s: float) -> None:
    photons = band_photons(scale_to_illuminance(illuminant("D65"), lux), DEFAULT_GRID)
    for name in ("imx363", "imx490", "ar0132at-rgbw"):
        model = dirty(name, 6, 6)
        optical = OpticalImage(np.broadcast_to(photons, (6, 6, 31)).astype(np.float32), DEFAULT_GRID, model.pixel_pitch_m)
        check(take(model, optical, FixedExposure(time_s)))


@settings(deadline=None, max_examples=40)
@given(
    bad=st.sampled_from((math.nan, math.inf, -math.inf, -1.0, -1e-30)),
    row=st.integers(0, 3),
    col=st.integers(0, 4),
    band=st.integers(0, 30),
)
def test_light_that_is_no_light_is_refused_wherever_it_hides(bad: float, row: int, col: int, band: int) -> None:
    model = replace(sensor("imx490"), rows=4, cols=5)
    photons = np.ones((4, 5, 31), np.float32)
    photons[row, col, band] = bad
    with pytest.raises(FieldError, match="irradiance"):
        take(model, OpticalImage(photons, DEFAULT_GRID, model.pixel_pitch_m), FixedExposure(0.01))


@settings(deadline=None, max_examples=60)
@given(samples=st.integers(4, 40), pixels=st.integers(1, 40), fill_factor=st.floats(0.05, 1.0))
def test_uniform_light_gives_equal_electrons_for_any_ratio_of_the_pitches(
    samples: int, pixels: int, fill_factor: float
) -> None:
    model = replace(sensor("ideal-mono"), rows=pixels, cols=pixels, fill_factor=fill_factor, pixel_pitch_m=1e-4 / pixels)
    optical = OpticalImage(np.full((samples, samples, 1), 3e15, np.float32), GRIDS[0], 1e-4 / samples)
    expected = float(np.float32(3e15)) * 10.0 * model.pixel_pitch_m**2 * fill_factor
    np.testing.assert_allclose(photo_electron_rate(optical, model), expected, rtol=FLOAT32)
