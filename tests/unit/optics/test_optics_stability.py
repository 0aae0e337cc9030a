"""The optics stage over everything it may meet: 12 orders of magnitude of light, one sample, one wavelength, f/0.5 and f/64."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fullwell.core import FieldError
from fullwell.optics import (
    Aperture,
    OpticsOptions,
    Wavefront,
    compute_irradiance,
    gaussian_psf,
    on_axis_factor_sr,
    pillbox_psf,
)
from fullwell.optics.ringing import without_negative_light, without_ringing
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene import Lens

ENERGY_TOLERANCE = 1e-6
"""Relative; what the product promises for the light of an image."""

UNIFORM_TOLERANCE = 1e-5
"""Relative; single precision in and out, and the transforms of what is not its own mirror image."""

SCALING_TOLERANCE = 1e-5
"""Relative to the brightest; single precision in and out."""

ONE_BAND = WavelengthGrid(550.0, 550.0, 10.0)
THREE_BANDS = WavelengthGrid(400.0, 700.0, 150.0)

OPTIONS = {
    "ideal": OpticsOptions(),
    "aberrated": OpticsOptions(wavefront=Wavefront(((4, 1e-7), (8, 5e-8)))),
    "measured": OpticsOptions(psf=gaussian_psf(2e-6)),
}


def camera_lens(f_number: float, focus_m: float = math.inf) -> Lens:
    return Lens("pinhole", 4e-3, f_number, focus_m, Spectrum.constant(1.0))


def night(shape: tuple[int, int], grid: WavelengthGrid, *, brightest: float, contrast: float, seed: int) -> np.ndarray:
    """Return light spread evenly over `contrast` in the logarithm, in places exactly none."""
    rng = np.random.default_rng(seed)
    photons = brightest * contrast ** -rng.random((*shape, grid.count))
    photons[rng.random(photons.shape) < 0.1] = 0.0
    return photons.astype(np.float32)


@settings(max_examples=40, deadline=None)
@given(
    rows=st.integers(1, 24),
    cols=st.integers(1, 40),
    exponent=st.floats(4, 22),
    contrast=st.floats(1, 1e12),
    f_number=st.sampled_from([0.5, 1.4, 2.8, 8.0, 64.0]),
    pitch_m=st.floats(0.3e-6, 30e-6),
    grid=st.sampled_from([ONE_BAND, THREE_BANDS]),
    seed=st.integers(0, 99),
)
def test_any_scene_gives_finite_light_and_keeps_its_sum(
    *, rows: int, cols: int, exponent: float, contrast: float, f_number: float, pitch_m: float, grid: WavelengthGrid, seed: int
) -> None:
    photons = night((rows, cols), grid, brightest=10.0**exponent, contrast=contrast, seed=seed)
    lens = camera_lens(f_number)
    optical = compute_irradiance(RadianceImage(photons, grid, pitch_m / lens.image_distance_m), lens, terms=("diffraction",))
    assert optical.photons.shape == photons.shape
    assert np.all(np.isfinite(optical.photons))
    assert np.min(optical.photons) >= 0
    expected = np.sum(photons, axis=(0, 1), dtype=np.float64) * on_axis_factor_sr(lens, grid)
    np.testing.assert_allclose(np.sum(optical.photons, axis=(0, 1), dtype=np.float64), expected, rtol=ENERGY_TOLERANCE)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    rows=st.integers(1, 12),
    cols=st.integers(1, 20),
    exponent=st.floats(4, 20),
    name=st.sampled_from(sorted(OPTIONS)),
    f_number=st.sampled_from([0.5, 2.0, 16.0]),
    pitch_m=st.sampled_from([0.5e-6, 1.4e-6, 6e-6]),
)
def test_a_uniform_scene_stays_uniform_through_every_lens(
    *, rows: int, cols: int, exponent: float, name: str, f_number: float, pitch_m: float
) -> None:
    lens = camera_lens(f_number)
    scene = RadianceImage(np.full((rows, cols, 1), 10.0**exponent, np.float32), ONE_BAND, pitch_m / lens.image_distance_m)
    terms = ("psf", "aberrations", "diffraction")
    found = compute_irradiance(scene, lens, OPTIONS[name], terms=terms).photons
    np.testing.assert_allclose(found, 10.0**exponent * on_axis_factor_sr(lens, ONE_BAND)[0], rtol=UNIFORM_TOLERANCE)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(scale=st.floats(1e-6, 1e6), name=st.sampled_from(sorted(OPTIONS)), seed=st.integers(0, 9))
def test_twice_the_light_gives_twice_the_image(scale: float, name: str, seed: int) -> None:
    photons = night((12, 17), THREE_BANDS, brightest=1e14, contrast=1e4, seed=seed)
    lens = camera_lens(2.8)
    one, other = (
        compute_irradiance(RadianceImage((photons * s).astype(np.float32), THREE_BANDS, 3e-4), lens, OPTIONS[name]).photons
        for s in (1.0, scale)
    )
    np.testing.assert_allclose(other / scale, one, rtol=0, atol=SCALING_TOLERANCE * np.max(one))


@pytest.mark.parametrize("name", sorted(OPTIONS))
@pytest.mark.parametrize("bad", [math.nan, math.inf, -1.0])
def test_light_that_is_none_is_refused_by_every_lens(name: str, bad: float) -> None:
    photons = np.ones((4, 5, 3), np.float32)
    photons[1, 2, 0] = bad
    with pytest.raises(FieldError, match="radiance"):
        compute_irradiance(RadianceImage(photons, THREE_BANDS, 3e-4), camera_lens(2.0), OPTIONS[name])


def test_a_million_times_the_noon_sun_in_one_sample_leaves_the_rest_lit() -> None:
    photons = np.full((40, 50, 1), 1e8, np.float32)
    photons[20, 25] = 1e26
    found = compute_irradiance(RadianceImage(photons, ONE_BAND, 3e-4), camera_lens(2.8)).photons
    assert np.all(np.isfinite(found))
    assert np.min(found) > 0


def test_spread_functions_exclude_wavefront_and_aperture() -> None:
    for other in ({"wavefront": Wavefront()}, {"aperture": Aperture()}):
        with pytest.raises(FieldError, match="psf"):
            OpticsOptions(psf=pillbox_psf(1e-6), **other)


def test_what_is_asked_for_can_be_left_out_again() -> None:
    scene = RadianceImage(night((12, 17), THREE_BANDS, brightest=1e14, contrast=10.0, seed=0), THREE_BANDS, 3e-4)
    lens = camera_lens(2.8)
    plain = compute_irradiance(scene, lens)
    left_out = compute_irradiance(scene, lens, OPTIONS["aberrated"], terms=("relative_illumination", "diffraction"))
    np.testing.assert_array_equal(plain.photons, left_out.photons)


def test_a_spread_function_far_below_a_sample_is_left_out_with_its_bound() -> None:
    scene = RadianceImage(night((12, 17), THREE_BANDS, brightest=1e14, contrast=10.0, seed=0), THREE_BANDS, 3e-4)
    found = compute_irradiance(scene, camera_lens(2.8), OpticsOptions(psf=gaussian_psf(1e-8)))
    (note,) = found.notes
    assert note.startswith("psf: left out in 3 of 3 bands")
    assert "changes by at most" in note


def test_the_note_on_aberrations_gives_the_strehl_ratio() -> None:
    scene = RadianceImage(night((12, 17), THREE_BANDS, brightest=1e14, contrast=10.0, seed=0), THREE_BANDS, 3e-4)
    (note,) = compute_irradiance(scene, camera_lens(2.8), OPTIONS["aberrated"]).notes
    assert "Strehl ratio is 0." in note


@pytest.mark.parametrize("shape", [(1, 1), (1, 30), (23, 31)])
@pytest.mark.parametrize("few", [True, False])
def test_bounding_keeps_the_sum_one_by_one_and_all_at_once(shape: tuple[int, int], few: bool) -> None:
    rng = np.random.default_rng(4)
    smooth = rng.random(shape) + 0.5
    exact = smooth.copy()
    chosen = rng.choice(smooth.size, size=1 if few else max(1, smooth.size // 3), replace=False)
    exact.flat[chosen] *= rng.choice([-1.0, 0.1, 4.0], size=len(chosen))
    total = float(np.sum(np.abs(exact)))
    found = without_ringing(exact.copy(), smooth, bound=0.5, total=total)
    assert np.sum(found) == pytest.approx(total, rel=1e-12)
    assert np.min(found) > 0
    positive = without_negative_light(exact.copy(), total=total)
    assert np.min(positive) >= 0
