"""Zernike wavefronts and their point images against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j1

from fullwell.core import FieldError
from fullwell.optics import (
    PointSpreadFilter,
    Wavefront,
    airy_radius_m,
    cutoff_cycles_per_m,
    defocus_coefficient_m,
    defocus_dioptres,
    diffract_band,
    diffraction_otf,
    strehl_ratio,
    wavefront_point_image,
    zernike,
    zernike_order,
)

MTF_TOLERANCE = 1e-3
"""What the product promises for a lens without aberrations."""

HOPKINS_TOLERANCE = 2e-3
"""Of the OTF: the pixelated rim of the pupil, 256 samples across, where its two copies overlap in a narrow strip."""

GEOMETRIC_TOLERANCE = 0.02
"""Of the OTF at 20 waves of defocus and frequencies up to 1.2 % of the cut-off: diffraction takes 1.5 % there."""

ENERGY_TOLERANCE = 1e-9
"""What the product promises for the light of a point image."""

QUADRATURE_TOLERANCE = 2e-3
"""Mean products over the disc on a 1200-point grid with a hard rim."""

ROUNDING = 1e-12
"""Relative; a few operations in double precision."""

WAVELENGTH_NM, F_NUMBER, PUPIL_M = 550.0, 4.0, 2e-3


def point_image(wavefront: Wavefront, wavelength_nm: float = WAVELENGTH_NM, pitch_m: float | None = None):
    return wavefront_point_image(
        wavefront, wavelength_nm=wavelength_nm, f_number=F_NUMBER, pupil_diameter_m=PUPIL_M, pitch_m=pitch_m
    )


def waves(index: int, rms: float) -> Wavefront:
    return Wavefront(((index, rms * WAVELENGTH_NM * 1e-9),))


def test_the_first_polynomials_have_the_published_orders() -> None:
    assert [zernike_order(j) for j in range(10)] == [
        (0, 0),
        (1, -1),
        (1, 1),
        (2, -2),
        (2, 0),
        (2, 2),
        (3, -3),
        (3, -1),
        (3, 1),
        (3, 3),
    ]


@pytest.mark.parametrize(
    ("index", "formula"),
    [
        (1, lambda r, t: 2 * r * np.sin(t)),
        (2, lambda r, t: 2 * r * np.cos(t)),
        (4, lambda r, _: math.sqrt(3) * (2 * r**2 - 1)),
        (5, lambda r, t: math.sqrt(6) * r**2 * np.cos(2 * t)),
        (7, lambda r, t: math.sqrt(8) * (3 * r**3 - 2 * r) * np.sin(t)),
        (12, lambda r, _: math.sqrt(5) * (6 * r**4 - 6 * r**2 + 1)),
    ],
)
def test_polynomials_have_the_osa_forms(index: int, formula) -> None:
    rho, theta = np.linspace(0, 1, 7), np.linspace(-3, 3, 7)
    np.testing.assert_allclose(zernike(index, rho, theta), formula(rho, theta), atol=10 * ROUNDING)


@pytest.mark.slow
def test_polynomials_are_orthonormal_over_the_disc() -> None:
    x = (np.arange(1200) + 0.5) / 600 - 1
    rho, theta = np.hypot(x[:, None], x), np.arctan2(-x[:, None], x)
    inside = rho <= 1
    stack = np.stack([zernike(j, rho[inside], theta[inside]) for j in range(28)])
    np.testing.assert_allclose(stack @ stack.T / stack.shape[1], np.eye(28), atol=QUADRATURE_TOLERANCE)


def test_a_lens_without_aberrations_has_the_mtf_of_a_clear_circle() -> None:
    image = point_image(Wavefront(), pitch_m=0.7e-6)
    frequency = np.linspace(0, 1.2, 301) * float(cutoff_cycles_per_m(WAVELENGTH_NM, F_NUMBER))
    expected = diffraction_otf(frequency, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER)
    for found in (image.transfer([0.0], frequency)[0], image.transfer(frequency, [0.0])[:, 0]):
        np.testing.assert_allclose(found, expected, atol=MTF_TOLERANCE)


def test_a_lens_without_aberrations_has_airys_dark_ring() -> None:
    pitch_m = airy_radius_m(WAVELENGTH_NM, F_NUMBER) / 20
    image = point_image(Wavefront(), pitch_m=pitch_m)
    middle = len(image.weights) // 2
    profile = image.weights[middle, middle : middle + 30]
    k = int(np.argmin(profile))
    assert k * image.spacing_m == pytest.approx(airy_radius_m(WAVELENGTH_NM, F_NUMBER), abs=0.6 * image.spacing_m)
    assert profile[k] < 1e-3 * profile[0]


@pytest.mark.parametrize(
    "wavefront", [Wavefront(), waves(4, 0.8), waves(7, 0.3), Wavefront(((3, 2e-7), (8, -1e-7), (12, 3e-7)))]
)
@pytest.mark.parametrize("pitch_m", [None, 0.5e-6, 3e-6])
def test_a_point_image_holds_all_the_light(wavefront: Wavefront, pitch_m: float | None) -> None:
    image = point_image(wavefront, pitch_m=pitch_m)
    assert np.min(image.weights) >= 0
    assert np.sum(image.weights) == pytest.approx(1.0, abs=ENERGY_TOLERANCE)


@pytest.mark.parametrize("index", [3, 4, 5, 7, 8, 12])
@pytest.mark.parametrize("rms_waves", [0.01, 0.03, 0.05])
def test_small_aberrations_have_marechals_strehl_ratio(index: int, rms_waves: float) -> None:
    """1 - (2 pi rms)^2 up to the fourth power of the phase: sixth moments of the polynomials keep it below phase^4."""
    phase = 2 * math.pi * rms_waves
    found = strehl_ratio(waves(index, rms_waves), wavelength_nm=WAVELENGTH_NM, pupil_diameter_m=PUPIL_M)
    assert found == pytest.approx(1 - phase**2, abs=phase**4 + QUADRATURE_TOLERANCE * phase**2)


def test_the_strehl_ratio_is_the_drop_of_the_peak() -> None:
    blurred, sharp = point_image(waves(12, 0.06)), point_image(Wavefront())
    middle = len(sharp.weights) // 2
    found = blurred.weights[len(blurred.weights) // 2, len(blurred.weights) // 2] / sharp.weights[middle, middle]
    expected = strehl_ratio(waves(12, 0.06), wavelength_nm=WAVELENGTH_NM, pupil_diameter_m=PUPIL_M)
    assert found == pytest.approx(expected, rel=1e-3)


def hopkins_otf(share: float, edge_waves: float) -> float:
    """Return the OTF of a defocused circle by the integral over the overlap of its two copies (hopkins1955).

    `edge_waves` is the error at the rim; the copies lie 2 `share` radii apart and differ in phase by 4 pi edge 2 share x.
    """
    if share >= 1:
        return 0.0
    slope = 8 * math.pi * edge_waves * share

    def strip(y: float) -> float:
        half = math.sqrt(1 - y * y) - share
        return 2 * half if slope == 0 else 2 * math.sin(slope * half) / slope

    limit = math.sqrt(1 - share**2)
    return quad(strip, -limit, limit, limit=400)[0] / math.pi


@pytest.mark.parametrize("edge_waves", [0.0, 0.25, 0.64, 1.5])
def test_defocus_alone_has_hopkins_otf(edge_waves: float) -> None:
    image = point_image(waves(4, edge_waves / (2 * math.sqrt(3))))
    share = np.linspace(0, 1, 33)
    found = image.transfer([0.0], share * float(cutoff_cycles_per_m(WAVELENGTH_NM, F_NUMBER)))[0]
    expected = [hopkins_otf(s, edge_waves) for s in share]
    np.testing.assert_allclose(found.real, expected, atol=HOPKINS_TOLERANCE)
    np.testing.assert_allclose(found.imag, 0, atol=HOPKINS_TOLERANCE)


def test_strong_defocus_tends_to_the_geometric_disc() -> None:
    edge_waves = 20.0
    image = point_image(waves(4, edge_waves / (2 * math.sqrt(3))))
    share = np.linspace(0.0005, 0.012, 20)
    radius = 4 * edge_waves  # of the blur, in wavelengths times f-number: 2 N dW/drho
    argument = 2 * math.pi * radius * share
    found = image.transfer([0.0], share * float(cutoff_cycles_per_m(WAVELENGTH_NM, F_NUMBER)))[0].real
    np.testing.assert_allclose(found, 2 * j1(argument) / argument, atol=GEOMETRIC_TOLERANCE)


def test_dioptres_and_the_defocus_coefficient_are_two_names_of_one_thing() -> None:
    """0.25 dioptre over 3 mm: 0.25 * 1.5e-3^2 / (4 sqrt 3) = 81.2 nm."""
    assert defocus_coefficient_m(0.25, 3e-3) == pytest.approx(8.1190e-8, rel=1e-4)
    assert defocus_dioptres(defocus_coefficient_m(-1.7, 4e-3), 4e-3) == pytest.approx(-1.7, rel=ROUNDING)


def test_chromatic_defocus_adds_to_the_defocus_of_the_wavefront() -> None:
    chromatic = Wavefront(chromatic_defocus=((450.0, -1.0), (650.0, 1.0)))
    for wavelength_nm, dioptres in ((450.0, -1.0), (550.0, 0.0), (600.0, 0.5), (700.0, 1.0)):
        plain = Wavefront(((4, defocus_coefficient_m(dioptres, PUPIL_M)),))
        np.testing.assert_allclose(
            point_image(chromatic, wavelength_nm).weights, point_image(plain, wavelength_nm).weights, atol=ROUNDING
        )


def test_an_error_in_metres_weighs_more_at_short_wavelengths() -> None:
    wavefront = Wavefront(((4, 5e-8),))
    blue, red = (strehl_ratio(wavefront, wavelength_nm=w, pupil_diameter_m=PUPIL_M) for w in (400.0, 800.0))
    assert math.log(blue) / math.log(red) == pytest.approx(4.0, rel=0.1)


def test_a_smaller_pupil_uses_the_middle_of_the_wavefront() -> None:
    wide = Wavefront(((4, 4e-7),), pupil_diameter_m=2 * PUPIL_M)
    same = Wavefront(((4, 1e-7),))
    np.testing.assert_allclose(point_image(wide).weights, point_image(same).weights, atol=ROUNDING)


def test_a_pupil_wider_than_the_coefficients_hold_for_is_refused() -> None:
    with pytest.raises(FieldError, match="extrapolated"):
        point_image(Wavefront(((4, 1e-7),), pupil_diameter_m=0.5 * PUPIL_M))


@pytest.mark.parametrize(("index", "axis", "sign"), [(1, 0, -1.0), (2, 1, 1.0)])
def test_a_tilt_moves_the_image_up_or_right(index: int, axis: int, sign: float) -> None:
    """W = 2 c rho along the axis: the image moves by 2 N dW/drho = 4 N c."""
    image = point_image(waves(index, 1.0))
    found = image.centroid_m()
    assert found[axis] == pytest.approx(sign * 4 * F_NUMBER * WAVELENGTH_NM * 1e-9, rel=0.05)
    assert found[1 - axis] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("pitch_um", [0.7, 1.4, 2.8])
def test_the_filter_of_a_perfect_wavefront_is_that_of_diffraction(pitch_um: float) -> None:
    picture = np.cumsum(np.random.default_rng(5).random((60, 70)), axis=1)
    spread = PointSpreadFilter(point_image(Wavefront(), pitch_m=pitch_um * 1e-6), pitch_m=pitch_um * 1e-6)
    expected = diffract_band(picture, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER, pitch_m=pitch_um * 1e-6)
    np.testing.assert_allclose(spread.apply(picture), expected, atol=MTF_TOLERANCE * np.max(picture))


@pytest.mark.parametrize(
    "broken",
    [
        {"coefficients_m": ((-1, 1e-7),)},
        {"coefficients_m": ((231, 1e-7),)},
        {"coefficients_m": ((4, math.nan),)},
        {"coefficients_m": ((4, 1e-7), (4, 1e-7))},
        {"pupil_diameter_m": 0.0},
        {"chromatic_defocus": ((500.0, 1.0), (400.0, 1.0))},
    ],
)
def test_a_wavefront_that_means_nothing_is_refused(broken: dict) -> None:
    with pytest.raises(FieldError):
        Wavefront(**broken)


def test_a_wavefront_too_steep_for_the_pupils_samples_is_refused() -> None:
    with pytest.raises(FieldError, match="waves across"):
        point_image(waves(4, 500.0))
