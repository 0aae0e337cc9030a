"""Photometry, photons and colours against definitions."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError, ShapeError
from fullwell.radiometry import (
    Spectrum,
    WavelengthGrid,
    band_photons,
    chromaticity,
    colour_matching_functions,
    energy_to_photons,
    illuminance_lux,
    illuminant,
    luminance_cd_m2,
    luminous_efficiency,
    luminous_flux_lm,
    photon_energy_j,
    photons_to_energy,
    planck_radiance,
    scale_to_flux,
    scale_to_illuminance,
    scale_to_luminance,
    tristimulus,
)

EXACT = 1e-12


def _line(wavelength_nm: float, watts: float, half_width_nm: float = 1e-4) -> Spectrum:
    around = wavelength_nm + half_width_nm * np.array([-1.0, 0.0, 1.0])
    return Spectrum(around, np.array([0.0, watts / half_width_nm, 0.0]), outside="zero")


def test_one_watt_at_555_nm_is_683_lumens() -> None:
    # The narrow line sees the kink of V(lambda) at its peak: 1e-4 nm of a slope of 1e-5 per nm.
    assert luminous_flux_lm(_line(555.0, 1.0)) == pytest.approx(683.0, rel=1e-8)


def test_one_watt_at_the_ends_is_next_to_nothing() -> None:
    assert luminous_flux_lm(_line(400.0, 1.0)) == pytest.approx(683.0 * 0.000396, rel=1e-4)
    assert luminous_flux_lm(_line(700.0, 1.0)) == pytest.approx(683.0 * 0.004102, rel=1e-4)
    assert luminous_flux_lm(_line(1000.0, 1.0)) == 0.0


def test_the_tables_integral_of_v_lambda_is_that_of_y() -> None:
    # CIE 018:2019: the sum of V(lambda) over 1 nm is 106.857.
    edges = np.array([360.0, 830.0])
    assert luminous_efficiency().integral(edges) == pytest.approx([106.857], abs=5e-3)
    for curve in colour_matching_functions():
        assert curve.integral(edges) == pytest.approx([106.857], rel=5e-4)


def test_a_blackbody_at_the_freezing_point_of_platinum_is_60_candela_per_square_centimetre() -> None:
    # The candela of 1948 to 1979 was 60 cd cm^-2 at the freezing point, 2042 K. One kelvin changes it by 0.6 per cent.
    wavelength_nm = np.arange(360.0, 831.0, 1.0)
    radiance = Spectrum(wavelength_nm, planck_radiance(wavelength_nm, 2042.0), outside="zero")
    assert luminance_cd_m2(radiance) == pytest.approx(6.0e5, rel=6e-3)


@pytest.mark.parametrize("name", ["D65", "A", "FL11", "blackbody:500K"])
def test_scaling_gives_what_was_asked_for(name: str) -> None:
    spd = illuminant(name)
    assert luminance_cd_m2(scale_to_luminance(spd, 1000.0)) == pytest.approx(1000.0, rel=EXACT)
    assert illuminance_lux(scale_to_illuminance(spd, 0.1)) == pytest.approx(0.1, rel=EXACT)
    assert luminous_flux_lm(scale_to_flux(spd, 800.0)) == pytest.approx(800.0, rel=EXACT)
    assert scale_to_luminance(spd, 1.0).unit == "W sr^-1 m^-2 nm^-1"
    assert scale_to_illuminance(spd, 1.0).unit == "W m^-2 nm^-1"
    assert np.all(scale_to_flux(spd, 0.0).values == 0.0)


def test_light_nobody_sees_cannot_be_scaled() -> None:
    for dark in (_line(900.0, 1.0), Spectrum.constant(0.0)):
        with pytest.raises(FieldError, match="no luminance") as caught:
            scale_to_luminance(dark, 100.0)
        assert caught.value.path == "luminance_cd_m2"


@pytest.mark.parametrize("bad", [-1.0, float("nan"), float("inf")])
def test_negative_and_endless_light_is_refused(bad: float) -> None:
    with pytest.raises(FieldError, match="finite and >= 0"):
        scale_to_illuminance(illuminant("D65"), bad)


def test_luminance_is_the_y_of_the_tristimulus_values() -> None:
    spd = illuminant("FL4")
    assert tristimulus(spd)[1] == pytest.approx(luminance_cd_m2(spd), rel=1e-9)


def test_equal_energy_is_white() -> None:
    assert chromaticity(illuminant("E")) == pytest.approx((1 / 3, 1 / 3), abs=5e-5)


def test_darkness_has_no_chromaticity() -> None:
    with pytest.raises(FieldError, match="no light"):
        chromaticity(_line(950.0, 1.0))


def test_a_photon_of_1240_nm_carries_one_electron_volt() -> None:
    assert photon_energy_j(1239.841984) == pytest.approx(1.602176634e-19, rel=1e-9)


def test_photons_return_to_the_energy_they_came_from() -> None:
    rng = np.random.Generator(np.random.Philox(key=1))
    energy = rng.lognormal(sigma=10.0, size=(7, 5, 31))
    wavelength_nm = WavelengthGrid().centres_nm
    back = photons_to_energy(energy_to_photons(energy, wavelength_nm), wavelength_nm)
    assert np.max(np.abs(back / energy - 1.0)) <= 2 * np.finfo(np.float64).eps


def test_photons_need_one_wavelength_per_band() -> None:
    with pytest.raises(ShapeError, match=r"\(bands,\)"):
        energy_to_photons(np.ones((2, 30)), WavelengthGrid().centres_nm)
    with pytest.raises(ShapeError, match="photons"):
        photons_to_energy(np.ones((2, 30)), WavelengthGrid().centres_nm)
    with pytest.raises(FieldError, match="wavelength_nm"):
        energy_to_photons(1.0, 0.0)


def test_photons_of_a_band_count_each_wavelength_with_its_own_energy() -> None:
    grid = WavelengthGrid(400.0, 700.0, 10.0)
    flat = Spectrum.constant(1.0)
    assert band_photons(flat, grid) == pytest.approx(energy_to_photons(np.ones(31), grid.centres_nm), rel=EXACT)
    line = _line(404.0, 1.0)
    assert band_photons(line, grid)[0] * grid.step_nm == pytest.approx(energy_to_photons(1.0, 404.0), rel=1e-9)
