"""ISETCam's numbers for the parts of the optics where its model and the physical one coincide."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fullwell.optics import (
    airy_radius_m,
    cos_fourth,
    cutoff_cycles_per_m,
    diffraction_otf,
    on_axis_factor_sr,
)
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.scene import Lens

GOLDEN_TOLERANCE = 1e-12
"""Relative; both sides are a few double-precision operations, and the file has 17 digits."""

SMALL_FIELD_TOLERANCE = 1e-4
"""Of the maximum; ISETCam spaces rows through degrees, which equals the spacing of columns only for small fields (here 0.5)."""

AIRY_TOLERANCE = 5e-4
"""Relative; 1.22 there, 1.21967 here."""

ISETCAM_FALLOFF_TOLERANCE = 1e-3
"""Relative, in a scene 10 degrees wide; the rest of its extended-source expression."""

GRID = WavelengthGrid(400.0, 700.0, 10.0)


def test_the_camera_equation_gives_isetcams_irradiance(reference: Callable[[str], Any]) -> None:
    for case in reference("isetcam/oi_diffraction.json")["cases"]:
        transmittance = Spectrum.constant(float(case["lens_transmittance"]))
        lens = Lens("thin_lens", case["focal_length_m"], case["f_number"], case["distance_m"], transmittance)
        found = np.array(case["scene_photons"]) * on_axis_factor_sr(lens, GRID)
        expected = np.array(case["irradiance_photons_on_axis_before_cos4_and_otf"])
        np.testing.assert_allclose(found, expected, rtol=GOLDEN_TOLERANCE)
        np.testing.assert_allclose(lens.magnification, case["magnification"], rtol=GOLDEN_TOLERANCE)
        np.testing.assert_allclose(lens.image_distance_m, case["image_distance_m"], rtol=GOLDEN_TOLERANCE)


def test_the_otf_and_its_cutoff_are_isetcams_for_an_object_at_infinity(reference: Callable[[str], Any]) -> None:
    for case in reference("isetcam/optics_otf_psf.json")["cases"]:
        frequency = np.array(case["freq_cyc_per_mm"]) * 1e3
        cutoff = cutoff_cycles_per_m(case["wave_nm"], case["f_number"]) / 1e3
        np.testing.assert_allclose(cutoff, case["cutoff_cyc_per_mm"], rtol=GOLDEN_TOLERANCE)
        for wavelength_nm, expected in zip(case["wave_nm"], case["otf"], strict=True):
            found = diffraction_otf(frequency, wavelength_nm=wavelength_nm, f_number=case["f_number"])
            np.testing.assert_allclose(found, expected, rtol=0, atol=GOLDEN_TOLERANCE)


def test_the_airy_radius_is_isetcams_to_the_three_digits_of_1_22(reference: Callable[[str], Any]) -> None:
    for case in reference("isetcam/optics_otf_psf.json")["cases"]:
        found_um = airy_radius_m(550.0, case["f_number"]) * 1e6
        np.testing.assert_allclose(found_um, case["airy_first_zero_radius_um_550"], rtol=AIRY_TOLERANCE)


def test_isetcams_blur_follows_from_our_otf_with_its_border(reference: Callable[[str], Any]) -> None:
    """Its border (nearly black, circular) is put on by hand; the transfer function is ours."""
    case = reference("isetcam/optics_otf_psf.json")["blur_isolated"]
    image, expected = np.array(case["irradiance_before_otf"]), np.array(case["oi_photons_after_otf_padded"])
    rows, cols = image.shape
    padded = np.full(expected.shape, 1e-9 * np.max(image))
    top, left = (expected.shape[0] - rows) // 2, (expected.shape[1] - cols) // 2
    padded[top : top + rows, left : left + cols] = image
    # Rows are spaced through degrees there: equal to the spacing of columns only for small fields.
    pitch_m = case["sample_spacing_used_for_otf_m"]
    fx = np.fft.fftfreq(padded.shape[1], pitch_m)
    fy = np.fft.fftfreq(padded.shape[0], pitch_m)
    otf = diffraction_otf(np.hypot(fy[:, None], fx[None, :]), wavelength_nm=case["wave_nm"], f_number=case["f_number"])
    found = np.abs(np.fft.ifft2(np.fft.fft2(padded) * otf))
    np.testing.assert_allclose(found, expected, rtol=0, atol=SMALL_FIELD_TOLERANCE * np.max(expected))


def test_isetcams_falloff_is_nearly_cos4(reference: Callable[[str], Any]) -> None:
    """ISETCam sets s where s^2 is meant, so its extended-source falloff comes close to cos^4."""
    case = reference("isetcam/oi_diffraction.json")["cases"][0]
    expected = np.array(case["cos4_map"])
    rows, cols = expected.shape
    pitch = 2 * np.tan(np.radians(case["hfov_deg_scene"] / 2)) / cols
    x = (np.arange(cols) + 0.5 - cols / 2) * pitch
    y = (np.arange(rows) + 0.5 - rows / 2) * pitch
    np.testing.assert_allclose(cos_fourth(np.hypot(y[:, None], x)), expected, rtol=ISETCAM_FALLOFF_TOLERANCE)
