"""The optics in compatibility mode: where ISETCam is inconsistent, and what the physical model does instead."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.fft

from fullwell.core import FieldError
from fullwell.optics import compute_irradiance as physical_irradiance
from fullwell.optics import cutoff_cycles_per_m, disc_falloff, working_f_number
from fullwell.optics.isetcam import (
    IsetcamLens,
    compute_irradiance,
    compute_optical_image,
    frequency_support,
    off_axis_map,
    otf_table,
    transfer_function,
    wavefront_lens,
    wavefront_psf,
)
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene import Lens
from fullwell.scene.isetcam_charts import pattern_scene, uniform_scene

DIGITS_OF_THE_DESCRIPTION = 5e-4
"""Half the last digit of 0.565 and 0.596 in the description of ISETCam."""


def test_the_falloff_takes_s_for_s_squared() -> None:
    """Inconsistency 1."""
    theirs = off_axis_map(rows=1, cols=3, hfov_deg=2 * math.degrees(math.atan(1.5 * math.tan(math.radians(30)))),
                          image_distance_m=0.004, f_number=1.8, magnification=0.0)[0, 0]  # fmt: skip
    ours = float(disc_falloff(np.tan(np.radians(30.0)), tan_pupil=0.5 / 1.8))
    assert theirs == pytest.approx(0.565, abs=DIGITS_OF_THE_DESCRIPTION)
    assert ours == pytest.approx(0.596, abs=DIGITS_OF_THE_DESCRIPTION)


def test_the_cutoff_leaves_out_the_magnification() -> None:
    """Inconsistency 2: at m = -1 a physical lens passes half as much."""
    limit = 1e9 / (550.0 * 4.0)
    assert transfer_function(0.75 * limit, wavelength_nm=550.0, f_number=4.0) > 0
    assert cutoff_cycles_per_m(550.0, working_f_number(4.0, -1.0)) == pytest.approx(0.5 * limit)


def test_the_pitch_of_the_image_grows_by_the_magnification_behind_the_blur() -> None:
    """Inconsistency 3. The image is always made from the scene, so there is no second computation that changes it."""
    scene, lens = uniform_scene(16, distance_m=0.05), IsetcamLens()
    image = compute_irradiance(scene, lens)
    pitch_of_blur = 2 * lens.focal_length_m * math.tan(math.radians(scene.hfov_deg / 2)) / scene.cols
    assert image.sample_pitch_m / pitch_of_blur == pytest.approx(1 + abs(lens.magnification(scene.distance_m)), rel=1e-12)
    again = compute_irradiance(scene, lens)
    np.testing.assert_array_equal(again.photons, image.photons)


def test_the_falloff_takes_the_magnification_of_its_own_scene() -> None:
    """Inconsistency 4: ISETCam asks for the scene selected last; here it is the scene given, whatever came before."""
    near, far = uniform_scene(8, distance_m=0.02, hfov_deg=60.0), uniform_scene(8, distance_m=1e6, hfov_deg=60.0)
    lens = IsetcamLens(f_number=1.4)
    first = compute_irradiance(near, lens).photons
    compute_irradiance(far, lens)
    np.testing.assert_array_equal(compute_irradiance(near, lens).photons, first)


def test_a_single_sample_is_refused_and_two_work() -> None:
    """Inconsistency 11: 0 / 0 in ISETCam."""
    for size in ((1, 1), (1, 20), (20, 1)):
        with pytest.raises(FieldError, match="NaN"):
            compute_irradiance(uniform_scene(size), IsetcamLens())
    assert np.all(compute_irradiance(uniform_scene(2), IsetcamLens()).photons > 0)
    single = compute_irradiance(uniform_scene(1), IsetcamLens(blur="skip"))
    assert single.photons.shape == (1, 1, 31)


@pytest.mark.parametrize("size", [(2, 3), (5, 8), (9, 9), (33, 12), (31, 64)])
@pytest.mark.parametrize("f_number", [0.5, 4.0, 64.0])
def test_any_size_and_f_number_gives_finite_light_that_diffraction_keeps(size: tuple[int, int], f_number: float) -> None:
    scene = uniform_scene(size, wavelength_nm=[450.0, 550.0])
    image = compute_irradiance(scene, IsetcamLens(f_number=f_number, off_axis="skip"))
    rows, cols = (n + 2 * math.floor(n / 8 + 0.5) for n in size)
    assert image.photons.shape == (rows, cols, 2)
    assert np.all(np.isfinite(image.photons) & (image.photons >= 0))
    lens = IsetcamLens(f_number=f_number, blur="skip", off_axis="skip")
    bare = compute_irradiance(scene, lens).photons.sum()
    m = lens.image_distance_m(scene.distance_m) / scene.distance_m
    scale = (1 + 4 * (2 * f_number) ** 2) / (1 + 4 * (f_number * (1 + m)) ** 2)
    border = 1e-8  # a share of 1e-9 in the border
    assert image.photons.sum() == pytest.approx(bare * scale, rel=border)


def test_frequencies_of_odd_sizes_are_stretched() -> None:
    np.testing.assert_allclose(frequency_support(4), [-1, -0.5, 0, 0.5])
    np.testing.assert_allclose(frequency_support(5), [-1, -0.5, 0, 0.5, 1])


def test_the_border_is_dark_and_bleeds_where_the_physical_model_mirrors() -> None:
    grid = WavelengthGrid(550, 550, 10)
    radiance = RadianceImage(np.full((16, 16, 1), 1e16, dtype=np.float32), grid, tangent_pitch=1e-3)
    lens = Lens("thin_lens", 0.004, 16.0, 1.2, Spectrum.constant(1.0))
    theirs = compute_optical_image(radiance, lens, scene_distance_m=1.2)
    ours = physical_irradiance(radiance, lens)
    assert theirs.photons.shape == (20, 20, 1)
    assert ours.photons.shape == (16, 16, 1)
    assert theirs.photons.dtype == np.float64
    assert theirs.photons[2, 10, 0] < 0.9 * theirs.photons[10, 10, 0]
    assert ours.photons[0, 8, 0] > 0.999 * ours.photons[8, 8, 0]
    assert theirs.sample_pitch_m == pytest.approx(ours.sample_pitch_m, rel=1e-12)


def test_the_switch_for_diffraction_keeps_the_border() -> None:
    radiance = RadianceImage(np.full((8, 8, 1), 1e16, dtype=np.float32), WavelengthGrid(550, 550, 10), tangent_pitch=1e-3)
    lens = Lens("pinhole", 0.004, 4.0, 1.2, Spectrum.constant(0.5), diffraction=False)
    image = compute_optical_image(radiance, lens, scene_distance_m=1.2)
    assert image.photons.shape == (10, 10, 1)
    assert image.photons[0, 0, 0] == pytest.approx(1e-9 * image.photons.max(), rel=1e-12)


def test_a_scene_nearer_than_the_focal_length_is_refused() -> None:
    with pytest.raises(FieldError, match="focal_length_m"):
        compute_irradiance(uniform_scene(4, distance_m=0.003), IsetcamLens())


@pytest.mark.parametrize(
    "fault",
    [
        {"f_number": 0.0},
        {"f_number": math.inf},
        {"focal_length_m": -1.0},
        {"off_axis": "cos3"},
        {"blur": "diffract"},
        {"blur": "shift_invariant"},
        {"transmittance": Spectrum.constant(1.5)},
    ],
)
def test_a_lens_out_of_range_is_refused(fault: dict[str, object]) -> None:
    with pytest.raises(FieldError):
        IsetcamLens(**fault)  # type: ignore[arg-type]


def test_a_point_image_of_one_sample_changes_nothing() -> None:
    psf = np.zeros((1, 64, 64))
    psf[0, 32, 32] = 1.0
    table = otf_table(psf, wavelength_nm=[550.0], pitch_m=1e-7)
    pattern = np.random.default_rng(3).random((16, 16))
    scene = pattern_scene(pattern, wavelength_nm=[550.0], hfov_deg=1.0)
    sharp = IsetcamLens(off_axis="skip", blur="shift_invariant", otf=table)
    image = compute_irradiance(scene, sharp).photons[2:-2, 2:-2, 0]
    np.testing.assert_allclose(image / image.mean(), pattern / pattern.mean(), rtol=1e-9)


def test_defocus_in_wavefront_optics_lowers_the_peak_and_keeps_the_sum() -> None:
    peaks = []
    for defocus_um in (0.0, 0.2, 0.5):
        _, psf = wavefront_psf((0, 0, 0, 0, defocus_um))
        assert psf.sum() == pytest.approx(1.0, rel=1e-12)
        peaks.append(psf.max())
    assert peaks == sorted(peaks, reverse=True)


def test_a_tilt_moves_the_point_image_and_astigmatism_turns_with_its_sign() -> None:
    _, tilted = wavefront_psf((0, 0, 1.0))
    assert np.argmax(tilted.sum(axis=0)) != 100
    assert np.argmax(tilted.sum(axis=1)) == 100
    _, plus = wavefront_psf((0, 0, 0, 0.3))
    _, minus = wavefront_psf((0, 0, 0, -0.3))
    np.testing.assert_allclose(plus, minus[::-1], atol=1e-12)


def test_a_wavefront_lens_needs_the_wavelengths_of_the_scene() -> None:
    lens = wavefront_lens(wavelength_nm=[550.0])
    with pytest.raises(FieldError, match="OTF table"):
        compute_irradiance(uniform_scene(4, wavelength_nm=[500.0]), lens)
    assert compute_irradiance(uniform_scene(4, wavelength_nm=[550.0]), lens).photons.shape == (6, 6, 1)


def test_one_of_the_table_at_frequency_zero_keeps_the_light() -> None:
    table = otf_table(np.ones((1, 4, 4)), wavelength_nm=[550.0], pitch_m=1e-6)
    assert table.otf[0, 2, 2] == pytest.approx(1.0)
    assert scipy.fft.fftshift(scipy.fft.fftfreq(4, 1e-6))[2] == table.frequency_cycles_per_m[2] == 0
