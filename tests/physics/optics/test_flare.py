"""Flare from the shape of the aperture: scaling, symmetry, energy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.optics import (
    Aperture,
    OpticsOptions,
    PointSpreadFilter,
    Wavefront,
    aperture_mask,
    compute_irradiance,
    diffraction_otf,
    flare_point_image,
)
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene import Lens

ENERGY_TOLERANCE = 1e-6
"""Relative; what the product promises for the light of an image."""

ROUNDING = 1e-12
"""Relative; a few operations in double precision."""

AREA_TOLERANCE = 3e-3
"""Of the pupil; cells of a 512th of its diameter are open or closed as a whole."""

WAVELENGTH_NM, F_NUMBER = 550.0, 2.0


def point_image(aperture: Aperture, samples: int = 512, wavelength_nm: float = WAVELENGTH_NM):
    return flare_point_image(aperture_mask(aperture, samples), wavelength_nm=wavelength_nm, f_number=F_NUMBER)


@pytest.mark.parametrize("blades", [0, 3, 5, 6, 9])
def test_the_mask_has_the_area_of_the_inscribed_polygon(blades: int) -> None:
    area = math.pi if blades == 0 else 0.5 * blades * math.sin(2 * math.pi / blades)
    assert np.mean(aperture_mask(Aperture(blades, 17.0), 512)) * 4 == pytest.approx(area, abs=4 * AREA_TOLERANCE)


def test_a_polygons_first_corner_points_to_the_right_and_turns_counter_clockwise() -> None:
    right = aperture_mask(Aperture(3), 256)
    assert right[128, 250] == 1
    assert right[128, 20] == 0
    up = aperture_mask(Aperture(3, 90.0), 256)
    assert up[5, 128] == 1
    assert up[250, 128] == 0


def test_a_clean_circular_aperture_has_the_otf_of_diffraction() -> None:
    frequency = np.linspace(0, 1, 50) / (WAVELENGTH_NM * 1e-9 * F_NUMBER)
    found = point_image(Aperture()).transfer([0.0], frequency)[0]
    expected = diffraction_otf(frequency, wavelength_nm=WAVELENGTH_NM, f_number=F_NUMBER)
    np.testing.assert_allclose(found, expected, atol=1e-3)


@pytest.mark.parametrize("blades", [5, 6])
def test_each_edge_throws_a_streak_across_itself(blades: int) -> None:
    """Streaks stand at right angles to the edges, two for each; of opposite edges they fall together."""
    image = point_image(Aperture(blades))
    size = len(image.weights)
    y, x = (np.arange(size) - size // 2) * -1.0, np.arange(size) - size // 2
    radius, angle = np.hypot(y[:, None], x), np.degrees(np.arctan2(y[:, None], x)) % 360
    ring = (radius > 60) & (radius < 250)
    profile = np.bincount(angle[ring].astype(int), image.weights[ring], 360)
    streaks = blades if blades % 2 == 0 else 2 * blades
    expected = (np.arange(streaks) * 360 / streaks + (180 / blades if blades % 2 == 0 else 0)) % 360
    for position in expected:
        nearby = min(abs((s - position + 180) % 360 - 180) for s in np.argsort(profile)[-4 * streaks :])
        assert nearby <= 1.5


def test_the_flare_of_a_real_mask_is_even() -> None:
    weights = point_image(Aperture(5, 10.0, scratches=5, dust_grains=8, seed=3)).weights
    np.testing.assert_allclose(weights, weights[::-1, ::-1], atol=ROUNDING)


def test_flare_grows_with_the_wavelength() -> None:
    blue, red = (point_image(Aperture(6), wavelength_nm=w) for w in (450.0, 675.0))
    np.testing.assert_array_equal(blue.weights, red.weights)
    assert red.spacing_m == pytest.approx(1.5 * blue.spacing_m, rel=ROUNDING)


@pytest.mark.parametrize("pitch_m", [0.5e-6, 1.4e-6, 6e-6])
def test_flare_conserves_light(pitch_m: float) -> None:
    spread = PointSpreadFilter(point_image(Aperture(7, scratches=20, dust_grains=10, seed=1)), pitch_m=pitch_m)
    picture = np.random.default_rng(0).random((40, 50)) ** 9
    blurred = spread.apply(picture)
    assert np.min(blurred) >= 0
    assert np.sum(blurred) == pytest.approx(np.sum(picture), rel=ENERGY_TOLERANCE)
    np.testing.assert_allclose(spread.apply(np.full((9, 12), 2.0)), 2.0, rtol=1e-10)


def test_the_same_seed_gives_the_same_scratches_and_another_seed_others() -> None:
    first, again, other = (aperture_mask(Aperture(scratches=6, dust_grains=6, seed=s), 128) for s in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)


def test_dirt_sends_more_light_far_away() -> None:
    clean, dirty = point_image(Aperture()).weights, point_image(Aperture(scratches=40, dust_grains=40)).weights
    middle = len(clean) // 2
    near = np.s_[middle - 40 : middle + 41, middle - 40 : middle + 41]
    assert 1 - np.sum(dirty[near]) > 3 * (1 - np.sum(clean[near]))


@pytest.mark.parametrize("wavefront", [None, Wavefront(((4, 1e-7),))])
def test_a_lamp_in_the_picture_gets_its_star_only_when_asked(wavefront: Wavefront | None) -> None:
    grid = WavelengthGrid(500.0, 600.0, 100.0)
    photons = np.zeros((60, 70, 2), np.float32)
    photons[30, 35] = 1e20
    lens = Lens("pinhole", 4e-3, F_NUMBER, math.inf, Spectrum.constant(1.0))
    scene = RadianceImage(photons, grid, 1.4e-6 / 4e-3)
    plain = compute_irradiance(scene, lens)
    star = compute_irradiance(scene, lens, OpticsOptions(aperture=Aperture(6, scratches=10), wavefront=wavefront))
    assert any(note.startswith("flare: 2 bands") for note in star.notes)
    sums = [np.sum(image.photons, dtype=np.float64) for image in (star, plain)]
    assert sums[0] == pytest.approx(sums[1], rel=ENERGY_TOLERANCE)
    far = np.s_[:15]
    assert np.max(star.photons[far]) > 2 * np.max(plain.photons[far])


@pytest.mark.parametrize(
    "broken",
    [{"blades": 2}, {"blades": 65}, {"opacity": 1.1}, {"scratches": -1}, {"dust_diameter": 0.0}, {"rotation_deg": math.nan}],
)
def test_an_aperture_that_cannot_be_is_refused(broken: dict) -> None:
    with pytest.raises(FieldError, match=next(iter(broken))):
        Aperture(**broken)
