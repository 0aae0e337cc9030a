"""Colours come out as colorimetry says: white exact, the ColorChecker close, under several lights and sensors."""

from __future__ import annotations

from dataclasses import replace

import colour
import numpy as np
import pytest

from fullwell.core import FieldError, stream
from fullwell.isp import IspSettings, develop
from fullwell.isp.black_level import linear_signal
from fullwell.isp.colour_matrix import (
    adapted_srgb_targets,
    channel_responses,
    fit_colour_matrix,
    xyz_to_linear_srgb_matrix,
)
from fullwell.radiometry import COLORCHECKER_PATCHES, Spectrum, WavelengthGrid, band_photons, illuminant, reflectance
from fullwell.scene.images import OpticalImage, RawImage
from fullwell.sensor import AutoExposure, ColorFilterArray, expose, fixed_pattern_stream, sensor

GRID = WavelengthGrid(400.0, 700.0, 10.0)
PATCH_PX = 16

ROUNDING = 1e-12
"""Relative; small linear systems in double precision."""

MATRIX_TOLERANCE = 5e-4
"""Absolute; IEC 61966-2-1 prints the inverse of a matrix that it had rounded to four digits."""

FIT_RESIDUAL = 1e-3
"""Linear sRGB, of a white of 1: band means by 1 nm from 380 to 780 nm against sums by 1 nm from 360 to 830 nm."""

WHITE_TOLERANCE_CODES = 1.0
"""Of 255; the shot noise of a patch's mean and the rounding to whole codes."""

IDEAL_DELTA_E = 0.5
"""CIEDE2000, mean of 24 patches; bands of 10 nm against integrals by 1 nm, 8-bit codes, residual shot noise."""

IMX363_DELTA_E = 5.0
"""CIEDE2000, mean of 24 patches: its channels are no linear combination of the observer's, so a matrix cannot do better."""


def chart(light_name: str) -> OpticalImage:
    """Return an evenly lit ColorChecker on the sensor plane, 4 x 6 patches."""
    light = band_photons(illuminant(light_name), GRID)
    patches = np.stack([reflectance(f"colorchecker:{name}").band_average(GRID) for name in COLORCHECKER_PATCHES])
    photons = (patches * light / np.max(light) * 1e16).reshape(4, 6, GRID.count)
    return OpticalImage(np.kron(photons, np.ones((PATCH_PX, PATCH_PX, 1))).astype(np.float32), GRID, 4e-6)


def photograph(light_name: str, sensor_name: str, **changes: object) -> RawImage:
    model = replace(sensor(sensor_name), rows=4 * PATCH_PX, cols=6 * PATCH_PX, pixel_pitch_m=4e-6, **changes)  # type: ignore[arg-type]
    exposure = AutoExposure("full", level=0.9, max_time_s=1e3)
    return expose(chart(light_name), model, exposure, rng=stream(0, "isp"), fixed_pattern_rng=fixed_pattern_stream(model))


def patch_means(rgb: np.ndarray) -> np.ndarray:
    blocks = rgb.astype(float).reshape(4, PATCH_PX, 6, PATCH_PX, 3)
    return blocks[:, 4:-4, :, 4:-4].mean(axis=(1, 3)).reshape(24, 3)


def lab(srgb: np.ndarray) -> np.ndarray:
    xyz = colour.cctf_decoding(np.asarray(srgb), function="sRGB") @ np.linalg.inv(xyz_to_linear_srgb_matrix()).T
    return colour.XYZ_to_Lab(xyz, np.array([0.3127, 0.3290]))


def delta_e(light_name: str, sensor_name: str) -> np.ndarray:
    """Return CIEDE2000 of each patch, brought to the brightness of the picture's white by its G value."""
    found = patch_means(develop(photograph(light_name, sensor_name), IspSettings(illuminant(light_name))).rgb) / 255
    targets = adapted_srgb_targets(illuminant(light_name), adapt_white=True)[1:]
    brightness = colour.cctf_decoding(found[18, 1], function="sRGB") / targets[18, 1]
    wanted = colour.cctf_encoding(np.clip(targets * brightness, 0, 1), function="sRGB")
    return np.asarray(colour.delta_E(lab(found), lab(wanted), method="CIE 2000"))


def test_the_matrix_to_srgb_is_that_of_the_standard() -> None:
    expected = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    np.testing.assert_allclose(xyz_to_linear_srgb_matrix(), expected, rtol=0, atol=MATRIX_TOLERANCE)
    np.testing.assert_allclose(xyz_to_linear_srgb_matrix() @ [0.3127 / 0.329, 1.0, 0.3583 / 0.329], 1.0, rtol=ROUNDING)


@pytest.mark.parametrize("light_name", ["D65", "A", "FL2", "blackbody:3000K"])
@pytest.mark.parametrize("sensor_name", ["imx363", "ideal-rgb"])
def test_a_white_patch_is_neutral(light_name: str, sensor_name: str) -> None:
    """The chart's own white is not perfectly flat, so a perfect white takes its place."""
    light = band_photons(illuminant(light_name), GRID)
    even = np.broadcast_to(light / np.max(light) * 1e16, (64, 96, GRID.count)).astype(np.float32)
    model = replace(sensor(sensor_name), rows=64, cols=96, pixel_pitch_m=4e-6)
    exposure = AutoExposure("mean", level=0.4, max_time_s=1e3)
    streams = {"rng": stream(0, "white"), "fixed_pattern_rng": fixed_pattern_stream(model)}
    raw = expose(OpticalImage(even, GRID, 4e-6), model, exposure, **streams)
    mean = develop(raw, IspSettings(illuminant(light_name))).rgb.mean(axis=(0, 1))
    assert np.ptp(mean) < WHITE_TOLERANCE_CODES


@pytest.mark.parametrize("light_name", ["D65", "A", "D50"])
def test_the_ideal_sensor_reproduces_the_colorchecker(light_name: str) -> None:
    assert np.mean(delta_e(light_name, "ideal-rgb")) < IDEAL_DELTA_E


@pytest.mark.parametrize("light_name", ["D65", "A"])
def test_the_imx363_comes_as_close_as_a_matrix_can(light_name: str) -> None:
    assert np.mean(delta_e(light_name, "imx363")) < IMX363_DELTA_E


def test_the_fit_keeps_white_exact_and_leaves_a_residual_no_other_matrix_beats() -> None:
    channels = tuple(curve for _, curve in sensor("imx363").cfa.channels)
    responses = channel_responses(channels, illuminant("A"), GRID)
    balanced = responses / responses[0]
    targets = adapted_srgb_targets(illuminant("A"), adapt_white=True)
    matrix = fit_colour_matrix(balanced, targets)
    np.testing.assert_allclose(matrix @ np.ones(3), targets[0], rtol=ROUNDING)
    best = np.sum((balanced[1:] @ matrix.T - targets[1:]) ** 2)
    rng = np.random.default_rng(0)
    for _ in range(50):
        step = rng.normal(size=(3, 3)) * 1e-3
        step -= step.mean(axis=1, keepdims=True)  # keeps white
        assert np.sum((balanced[1:] @ (matrix + step).T - targets[1:]) ** 2) > best


def test_an_observer_like_sensor_needs_only_the_exact_matrix() -> None:
    """With x, y, z over wavelength as channels, the residual of the fit is that of the 1 nm sums."""
    grid = WavelengthGrid(380.0, 780.0, 1.0)
    channels = tuple(curve for _, curve in sensor("ideal-rgb").cfa.channels)
    responses = channel_responses(channels, illuminant("D65"), grid)
    targets = adapted_srgb_targets(illuminant("D65"), adapt_white=True)
    balanced = responses / responses[0]
    residual = balanced @ fit_colour_matrix(balanced, targets).T - targets
    assert np.max(np.abs(residual)) < FIT_RESIDUAL


def test_without_white_balance_lamplight_keeps_its_tint() -> None:
    raw = photograph("A", "ideal-rgb")
    white = patch_means(develop(raw, IspSettings(illuminant("A"), white_balance="none")).rgb)[18]
    assert white[0] > white[1] > white[2] + 50


def test_gray_world_makes_the_mean_of_the_channels_equal_before_the_matrix() -> None:
    raw = photograph("A", "ideal-rgb")
    by_mean = develop(raw, IspSettings(illuminant("A"), white_balance="gray_world"))
    signal = linear_signal(raw)
    means = np.array([signal[::2, ::2].mean(), (signal[::2, 1::2] + signal[1::2, ::2]).mean() / 2, signal[1::2, 1::2].mean()])
    np.testing.assert_allclose(by_mean.channel_gain_ratio * means, np.max(means), rtol=ROUNDING)


def test_a_sensor_without_filters_gives_a_grey_picture() -> None:
    picture = develop(photograph("D65", "ideal-mono"), IspSettings(illuminant("D65")))
    assert picture.rgb.dtype == np.uint8
    assert picture.colour_matrix is None
    np.testing.assert_array_equal(picture.rgb[:, :, 0], picture.rgb[:, :, 1])
    np.testing.assert_array_equal(picture.rgb[:, :, 0], picture.rgb[:, :, 2])


@pytest.mark.parametrize(("level", "code"), [(0.0, 0), (1e19, 255)])
def test_darkness_is_black_and_overexposure_white(level: float, code: int) -> None:
    model = replace(sensor("imx363"), rows=8, cols=8, read_noise_e=0.0, dsnu_v=0.0, analog_offset_v=64 / 1023 * 0.4591)
    optical = OpticalImage(np.full((8, 8, GRID.count), level, np.float32), GRID, 1.4e-6)
    streams = {"rng": stream(0, "end"), "fixed_pattern_rng": fixed_pattern_stream(model)}
    raw = expose(optical, model, AutoExposure(min_time_s=0.1, max_time_s=0.1), **streams)
    assert np.all(develop(raw, IspSettings(illuminant("D65"))).rgb == code)


def test_a_pattern_of_red_and_clear_is_developed_too() -> None:
    imx = dict(sensor("imx363").cfa.channels)
    clear = Spectrum(np.array([390.0, 710.0]), np.array([0.6, 0.6]), outside="zero")
    rccc = ColorFilterArray((("R", "C"), ("C", "C")), (("R", imx["R"]), ("C", clear)))
    picture = develop(photograph("D65", "imx363", cfa=rccc), IspSettings(illuminant("D65")))
    assert picture.rgb.shape == (64, 96, 3)
    assert picture.colour_matrix is not None
    assert picture.colour_matrix.shape == (3, 2)


def test_an_illuminant_that_a_channel_cannot_see_is_refused() -> None:
    line = Spectrum(np.array([840.0, 850.0, 860.0]), np.array([0.0, 1.0, 0.0]), outside="zero", source="NIR lamp")
    with pytest.raises(FieldError, match="no light between"):
        develop(photograph("D65", "imx363"), IspSettings(line))


def test_an_invisible_illuminant_is_refused() -> None:
    line = Spectrum(np.array([840.0, 850.0, 860.0]), np.array([0.0, 1.0, 0.0]), outside="zero", source="NIR lamp")
    with pytest.raises(FieldError, match="no visible light"):
        adapted_srgb_targets(line, adapt_white=True)


def test_unknown_settings_are_answered_with_the_nearest() -> None:
    with pytest.raises(FieldError, match="gray_world"):
        IspSettings(illuminant("D65"), white_balance="grey_world")  # type: ignore[arg-type]
    with pytest.raises(FieldError, match="bilinear"):
        IspSettings(illuminant("D65"), demosaic="bilinaer")  # type: ignore[arg-type]
