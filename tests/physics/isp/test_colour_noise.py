"""The noise-aware colour matrix trades colour for noise as stated, and channels that see nothing do no harm."""

from __future__ import annotations

from dataclasses import replace

import colour
import numpy as np
import pytest

from fullwell.core import FieldError, stream
from fullwell.isp import ColourMatrixFit, IspSettings, calibrate, develop
from fullwell.isp.colour_matrix import (
    adapted_srgb_targets,
    channel_responses,
    fit_colour_matrix,
    noise_amplification,
    xyz_to_linear_srgb_matrix,
)
from fullwell.isp.white_balance import gains_for_white
from fullwell.radiometry import Spectrum, WavelengthGrid, illuminant
from fullwell.scene.images import RawImage
from fullwell.sensor import sensor

GRID = WavelengthGrid(400.0, 700.0, 10.0)
ROUNDING = 1e-12
"""Relative; small linear systems in double precision."""

DRAWS = 20_000
SAMPLING_ERRORS = 5.0
"""Standard errors that a mean over random numbers may be off."""


def flat_raw(channels: tuple[tuple[str, Spectrum], ...], grid: WavelengthGrid = GRID, level: int = 500) -> RawImage:
    pattern = (("R", "G"), ("G", "B"))
    return RawImage(np.full((8, 8), level, np.uint16), pattern, channels, grid, 64.0, 1023.0, 0.01, "test", 10, 0.0)


def imx363(light_name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return balanced responses (25, 3), targets (25, 3) and gains (3,) under a light."""
    curves = tuple(curve for _, curve in sensor("imx363").cfa.channels)
    responses = channel_responses(curves, illuminant(light_name), GRID)
    return (
        responses / responses[0],
        adapted_srgb_targets(illuminant(light_name), adapt_white=True),
        gains_for_white(responses[0]),
    )


def mean_delta_e(found: np.ndarray, wanted: np.ndarray) -> float:
    lab = [
        colour.XYZ_to_Lab(np.clip(values, 0, 1) @ np.linalg.inv(xyz_to_linear_srgb_matrix()).T, np.array([0.3127, 0.3290]))
        for values in (found, wanted)
    ]
    return float(np.mean(colour.delta_E(*lab, method="CIE 2000")))


@pytest.mark.parametrize("light_name", ["D65", "A", "blackbody:3000K"])
def test_more_expected_noise_means_less_amplification_more_colour_error_and_an_exact_white(light_name: str) -> None:
    balanced, targets, gains = imx363(light_name)
    matrices = [fit_colour_matrix(balanced, targets, channel_noise=noise * gains) for noise in (0.0, 0.01, 0.03, 0.1, 0.3)]
    for matrix in matrices:
        np.testing.assert_allclose(matrix @ np.ones(3), targets[0], rtol=1e-9)
    assert np.all(np.diff([noise_amplification(matrix, gains) for matrix in matrices]) < 0)
    assert np.all(np.diff([mean_delta_e(balanced[1:] @ matrix.T, targets[1:]) for matrix in matrices[1:]]) > 0)
    np.testing.assert_allclose(matrices[0], fit_colour_matrix(balanced, targets), rtol=1e-9)


def test_no_other_matrix_has_less_expected_error_at_its_noise() -> None:
    balanced, targets, gains = imx363("A")
    noise = 0.05 * gains

    def expected_error(matrix: np.ndarray) -> float:
        colour_error = np.sum((balanced[1:] @ matrix.T - targets[1:]) ** 2)
        return float(colour_error + 24 * np.sum((matrix * noise) ** 2))

    matrix = fit_colour_matrix(balanced, targets, channel_noise=noise)
    rng = np.random.default_rng(0)
    for _ in range(50):
        step = rng.normal(size=(3, 3)) * 1e-3
        step -= step.mean(axis=1, keepdims=True)  # keeps white
        assert expected_error(matrix + step) > expected_error(matrix)


def test_the_stated_amplification_is_the_noise_that_comes_out() -> None:
    balanced, targets, gains = imx363("A")
    matrix = fit_colour_matrix(balanced, targets)
    raw_noise = np.random.default_rng(1).normal(size=(DRAWS, 3))
    found = np.sqrt(np.mean((raw_noise * gains @ matrix.T) ** 2))
    assert found == pytest.approx(noise_amplification(matrix, gains), rel=SAMPLING_ERRORS / np.sqrt(2 * DRAWS))


def test_the_settings_reach_the_matrix_and_the_picture() -> None:
    raw = flat_raw(sensor("imx363").cfa.channels)
    plain = IspSettings(illuminant("A"))
    careful = replace(plain, colour_matrix=ColourMatrixFit("noise_aware", 0.1))
    found = [calibrate(raw, settings).noise_amplification for settings in (plain, careful)]
    assert found[0] is not None
    assert found[1] is not None
    assert found[1] < 0.8 * found[0]
    noisy = replace(raw, dn=(stream(0, "noise").normal(300, 20, (64, 64))).astype(np.uint16))
    chroma = [np.std(np.diff(develop(noisy, s).rgb.astype(float), axis=2)) for s in (plain, careful)]
    assert chroma[1] < chroma[0]


def test_a_channel_that_sees_nothing_of_the_light_takes_no_part() -> None:
    blue = Spectrum(np.array([440.0, 450.0, 460.0]), np.array([0.0, 1.0, 0.0]), outside="zero", source="blue lamp")
    channels = sensor("imx363").cfa.channels
    deaf = Spectrum(np.array([600.0, 650.0, 700.0]), np.array([0.0, 0.5, 0.0]), outside="zero")
    found = calibrate(flat_raw((("R", deaf), *channels[1:])), IspSettings(blue))
    assert found.channel_gain_ratio[0] == 1.0
    assert found.colour_matrix is not None
    np.testing.assert_array_equal(found.colour_matrix[:, 0], 0.0)
    np.testing.assert_allclose(found.colour_matrix.sum(axis=1), adapted_srgb_targets(blue, adapt_white=True)[0], rtol=1e-9)


def test_a_picture_without_visible_bands_is_grey() -> None:
    grid = WavelengthGrid(800.0, 1000.0, 10.0)
    leaks = tuple(
        (name, Spectrum(np.array([300.0, 1100.0]), np.array([level, level]), outside="zero"))
        for name, level in (("R", 0.3), ("G", 0.2), ("B", 0.1))
    )
    lamp = Spectrum(np.array([840.0, 850.0, 860.0]), np.array([0.0, 1.0, 0.0]), outside="zero", source="NIR lamp")
    picture = develop(flat_raw(leaks, grid), IspSettings(), scene_light=lamp)
    assert picture.colour_matrix is None
    np.testing.assert_array_equal(np.ptp(picture.rgb, axis=2), 0)
    np.testing.assert_allclose(picture.channel_gain_ratio, [1.0, 1.5, 3.0], rtol=ROUNDING)


def test_without_an_illuminant_the_light_of_the_scene_counts_and_daylight_where_it_cannot_be_seen() -> None:
    raw = flat_raw(sensor("imx363").cfa.channels)
    lamp = Spectrum(np.array([840.0, 850.0, 860.0]), np.array([0.0, 1.0, 0.0]), outside="zero", source="NIR lamp")
    warm, daylight = illuminant("A"), illuminant("D65")
    by_scene = calibrate(raw, IspSettings(), scene_light=warm).colour_matrix
    np.testing.assert_array_equal(by_scene, calibrate(raw, IspSettings(warm)).colour_matrix)
    expected = calibrate(raw, IspSettings(daylight)).colour_matrix
    for unseen in (None, lamp):
        np.testing.assert_array_equal(calibrate(raw, IspSettings(), scene_light=unseen).colour_matrix, expected)


def test_an_impossible_fit_is_refused() -> None:
    with pytest.raises(FieldError, match="noise_aware"):
        ColourMatrixFit("noise-aware")  # type: ignore[arg-type]
    with pytest.raises(FieldError, match="noise_fraction"):
        ColourMatrixFit("noise_aware", noise_fraction=-0.1)
    with pytest.raises(FieldError, match="white_patch_percentile"):
        IspSettings(white_patch_percentile=0.0)
