"""Shift-invariant spread functions: energy, centroid, transfer function, files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.special import j1

from fullwell.core import AssetError, FieldError, ShapeError
from fullwell.optics import PointSpread, PointSpreadFilter, gaussian_psf, pillbox_psf, read_psf, write_psf
from fullwell.optics.psf import disc_kernel

ENERGY_TOLERANCE = 1e-6
"""Relative; what the product promises for the light of an image."""

TRANSFORM_ROUNDING = 1e-12
"""Relative to the largest value; rounding of a double-precision transform forth and back."""

GAUSSIAN_TOLERANCE = 1e-6
"""Of the OTF; the Gaussian is cut off at 6 sigma and sampled at a sixth of it."""

CENTROID_TOLERANCE = 2e-3
"""Of a sample; what is left of the ringing that the band-limited kernel fades out over 24 samples."""

DISC_TOLERANCE = 2e-3
"""Of the OTF; the rim is resolved to an eighth of a 64th of the diameter."""


def spread(rows: int, cols: int, spacing_m: float, seed: int = 0) -> PointSpread:
    return PointSpread(np.random.default_rng(seed).random((rows, cols)) ** 4, spacing_m)


def test_a_gaussian_has_a_gaussian_transfer_function() -> None:
    sigma_m = 2e-6
    frequency = np.linspace(0, 0.5 / 1e-6, 20)
    found = gaussian_psf(sigma_m).at(550.0).transfer([0.0], frequency)[0]
    np.testing.assert_allclose(found, np.exp(-2 * (math.pi * sigma_m * frequency) ** 2), atol=GAUSSIAN_TOLERANCE)


def test_a_pillbox_has_a_jinc_transfer_function() -> None:
    diameter_m = 10e-6
    argument = np.pi * diameter_m * np.linspace(1e4, 3e5, 30)
    found = pillbox_psf(diameter_m).at(550.0).transfer([0.0], argument / (np.pi * diameter_m))[0]
    np.testing.assert_allclose(found, 2 * j1(argument) / argument, atol=DISC_TOLERANCE)


@pytest.mark.parametrize(("pitch_m", "sigma_m"), [(1e-6, 0.7e-6), (1e-6, 2e-6), (2e-6, 0.5e-6)])
def test_a_cosine_loses_contrast_by_the_transfer_function(pitch_m: float, sigma_m: float) -> None:
    k, cols = 24, 64
    wave = 2 + np.cos(np.pi * k * (np.arange(cols) + 0.5) / cols)[None, :] * np.ones((8, 1))
    blurred = PointSpreadFilter(gaussian_psf(sigma_m).at(500.0), pitch_m=pitch_m).apply(wave)
    expected = math.exp(-2 * (math.pi * sigma_m * k / (2 * cols * pitch_m)) ** 2)
    np.testing.assert_allclose(blurred - 2, expected * (wave - 2), atol=1e-4)


@pytest.mark.parametrize("pitch_m", [0.3e-6, 1e-6, 5e-6])
@pytest.mark.parametrize("psf", [gaussian_psf(1.5e-6), pillbox_psf(4e-6)])
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (30, 41)])
def test_even_spread_functions_conserve_light(psf: PointSpread, pitch_m: float, shape: tuple[int, int]) -> None:
    picture = np.random.default_rng(1).random(shape) ** 6
    blurred = PointSpreadFilter(psf.at(550.0), pitch_m=pitch_m).apply(picture)
    assert blurred.shape == shape
    assert np.min(blurred) >= 0
    assert np.sum(blurred) == pytest.approx(np.sum(picture), rel=ENERGY_TOLERANCE)


@pytest.mark.parametrize("pitch_m", [0.4e-6, 1e-6, 7e-6])
def test_any_spread_function_conserves_light_within_the_picture_and_keeps_its_centroid(pitch_m: float) -> None:
    image = spread(15, 22, 0.5e-6).at(550.0)
    rows, cols = np.arange(141) - 70, np.arange(151) - 75
    blob = 0.2 + np.exp(-0.5 * (rows[:, None] ** 2 + cols**2) / 5.0**2)
    blurred = PointSpreadFilter(image, pitch_m=pitch_m).apply(blob)
    assert np.sum(blurred) == pytest.approx(np.sum(blob), rel=ENERGY_TOLERANCE)
    light = np.sum(blob - 0.2)
    found = np.array([(blurred - 0.2).sum(axis=1) @ rows, (blurred - 0.2).sum(axis=0) @ cols]) / light * pitch_m
    np.testing.assert_allclose(found, image.centroid_m(), atol=CENTROID_TOLERANCE * pitch_m)


@pytest.mark.parametrize("psf", [gaussian_psf(3e-6), pillbox_psf(9e-6), spread(31, 12, 1e-6)])
def test_a_uniform_picture_stays_uniform_to_its_border(psf: PointSpread) -> None:
    picture = np.full((20, 33), 7.0e18)
    blurred = PointSpreadFilter(psf.at(500.0), pitch_m=1e-6).apply(picture)
    np.testing.assert_allclose(blurred, picture, rtol=TRANSFORM_ROUNDING)


def test_nothing_wraps_around() -> None:
    picture = np.zeros((40, 40))
    picture[:, 0] = 1.0
    blurred = PointSpreadFilter(pillbox_psf(10e-6).at(500.0), pitch_m=1e-6).apply(picture)
    assert np.max(blurred[:, 20:]) < 1e-4
    assert np.min(blurred[:, :4]) > 0.05


def test_wavelengths_between_two_images_get_the_mean_of_both() -> None:
    values = np.stack([gaussian_psf(1e-6).values, np.ones((73, 73))])
    psf = PointSpread(values, 1e-6, (400.0, 600.0))
    ends = [psf.at(w).weights for w in (400.0, 600.0)]
    np.testing.assert_allclose(psf.at(450.0).weights, 0.75 * ends[0] + 0.25 * ends[1], atol=TRANSFORM_ROUNDING)
    np.testing.assert_array_equal(psf.at(300.0).weights, ends[0])
    np.testing.assert_array_equal(psf.at(900.0).weights, ends[1])


@pytest.mark.parametrize("waves", [None, (450.0, 550.0, 650.0)])
def test_a_file_gives_back_what_was_written(tmp_path: Path, waves: tuple[float, ...] | None) -> None:
    values = np.random.default_rng(2).random((5, 7) if waves is None else (3, 5, 7))
    write_psf(tmp_path / "lens.npz", PointSpread(values, 0.4e-6, waves))
    found = read_psf(tmp_path / "lens.npz")
    np.testing.assert_array_equal(found.values, values)
    assert (found.spacing_m, found.wavelengths_nm) == (0.4e-6, waves)


def test_a_file_that_is_no_spread_function_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.npz").write_text("not an archive")
    np.savez(tmp_path / "other.npz", weights=np.ones((3, 3)))
    for name in ("text.npz", "other.npz", "missing.npz"):
        with pytest.raises(AssetError, match="write_psf"):
            read_psf(tmp_path / name)


def test_spread_functions_that_are_no_light_are_refused() -> None:
    for bad in (np.full((3, 3), -1.0), np.zeros((3, 3)), np.full((3, 3), np.nan), np.full((3, 3), np.inf)):
        with pytest.raises(FieldError, match="values"):
            PointSpread(bad, 1e-6)
    with pytest.raises(FieldError, match="spacing_m"):
        PointSpread(np.ones((3, 3)), 0.0)
    with pytest.raises(FieldError, match="increase"):
        PointSpread(np.ones((2, 3, 3)), 1e-6, (500.0, 400.0))
    with pytest.raises(ShapeError, match="values"):
        PointSpread(np.ones((2, 3, 3)), 1e-6, (500.0,))
    with pytest.raises(FieldError, match="sigma_m"):
        gaussian_psf(0.0)


def test_a_spread_function_far_larger_than_any_picture_is_refused() -> None:
    with pytest.raises(FieldError, match="Crop"):
        PointSpreadFilter(spread(40, 40, 1e-3).at(500.0), pitch_m=1e-6)


@pytest.mark.parametrize("diameter", [0.3, 1.5, 2.0, 3.3, 7.0, 12.5])
def test_disc_kernels_have_the_variance_of_the_disc(diameter: float) -> None:
    kernel = disc_kernel(diameter)
    x = np.arange(len(kernel)) - len(kernel) // 2
    assert np.sum(kernel) == pytest.approx(1.0, rel=TRANSFORM_ROUNDING)
    # Within 0.08 square samples: the rim lies between whole cells.
    assert kernel.sum(axis=0) @ x**2 == pytest.approx(diameter**2 / 16, abs=0.08)


def test_no_blur_changes_nothing() -> None:
    np.testing.assert_array_equal(disc_kernel(0.0), [[1.0]])
    np.testing.assert_allclose(disc_kernel(1e-6), [[0, 0, 0], [0, 1, 0], [0, 0, 0]], atol=TRANSFORM_ROUNDING)
