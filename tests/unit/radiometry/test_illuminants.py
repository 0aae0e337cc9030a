"""Illuminants against closed forms and published chromaticities."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.core.constants import BOLTZMANN_J_PER_K, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.radiometry import (
    Spectrum,
    WavelengthGrid,
    chromaticity,
    colour_matching_functions,
    correlated_colour_temperature_k,
    coverage_note,
    illuminant,
    illuminant_names,
    planck_radiance,
)

ROUNDED = 5e-5
"""Published chromaticities have 4 or 5 digits and were made by sums over 5 nm, as the comparison does."""
INTEGRATED = 4e-4
"""Exact integrals between the 5 nm points of a lamp with lines differ that much from the sums the CIE publishes."""


def _summed_chromaticity(name: str) -> tuple[float, float]:
    wavelength_nm = np.arange(380.0, 781.0, 5.0)
    power = illuminant(name).at(wavelength_nm)
    x, y, z = (float(power @ curve.at(wavelength_nm)) for curve in colour_matching_functions())
    return x / (x + y + z), y / (x + y + z)


# CIE 15:2004, tables T.3 and T.8.1, 2-degree observer.
PUBLISHED = {
    "A": (0.44758, 0.40745),
    "C": (0.31006, 0.31616),
    "D50": (0.34567, 0.35851),
    "D55": (0.33243, 0.34744),
    "D65": (0.31272, 0.32903),
    "D75": (0.29903, 0.31488),
    "E": (1 / 3, 1 / 3),
    "FL1": (0.3131, 0.3371),
    "FL2": (0.3721, 0.3751),
    "FL4": (0.4402, 0.4031),
    "FL7": (0.3129, 0.3292),
    "FL8": (0.3458, 0.3586),
    "FL11": (0.3805, 0.3769),
    "FL12": (0.4370, 0.4042),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_chromaticities_are_those_published(name: str) -> None:
    assert _summed_chromaticity(name) == pytest.approx(PUBLISHED[name], abs=ROUNDED)
    assert chromaticity(illuminant(name)) == pytest.approx(PUBLISHED[name], abs=INTEGRATED)


def test_plancks_law_integrates_to_stefan_and_boltzmann() -> None:
    wavelength_nm = np.geomspace(50.0, 5e6, 400_001)
    for temperature_k in (300.0, 1000.0, 5772.0):
        radiance = planck_radiance(wavelength_nm, temperature_k)
        exitance = np.pi * np.trapezoid(radiance * wavelength_nm, np.log(wavelength_nm))
        sigma = 2 * np.pi**5 * BOLTZMANN_J_PER_K**4 / (15 * PLANCK_J_S**3 * SPEED_OF_LIGHT_M_PER_S**2)
        # The tail beyond 5 mm holds 1e-6 of the light at 300 K.
        assert exitance == pytest.approx(sigma * temperature_k**4, rel=2e-6)


def test_plancks_law_peaks_where_wien_says() -> None:
    # b = 2.897771955e-3 m K, CODATA 2018.
    for temperature_k in (2000.0, 5000.0):
        peak_nm = 2.897771955e6 / temperature_k
        around = planck_radiance(peak_nm + np.array([-1e-2, 0.0, 1e-2]), temperature_k)
        assert around[1] == around.max()
        fine = np.linspace(peak_nm - 5, peak_nm + 5, 2001)
        slope = np.gradient(planck_radiance(fine, temperature_k), fine)
        assert np.interp(0.0, -slope, fine) == pytest.approx(peak_nm, rel=1e-6)


def test_plancks_law_has_its_two_limits() -> None:
    # Rayleigh-Jeans, 2 c k T / lambda^4, and no overflow where exp(h c / lambda k T) is beyond any float.
    wavelength_nm = 1e11
    expected = 2 * SPEED_OF_LIGHT_M_PER_S * BOLTZMANN_J_PER_K * 300.0 / (wavelength_nm * 1e-9) ** 4 * 1e-9
    assert planck_radiance(wavelength_nm, 300.0) == pytest.approx(expected, rel=1e-6)
    with np.errstate(all="raise", under="ignore"):
        assert planck_radiance(100.0, 10.0) == 0.0


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf")])
def test_plancks_law_refuses_what_is_no_temperature(bad: float) -> None:
    with pytest.raises(FieldError, match="temperature_k"):
        planck_radiance(550.0, bad)
    with pytest.raises(FieldError, match="wavelength_nm"):
        planck_radiance(bad, 3000.0)


@pytest.mark.parametrize("temperature_k", [1500.0, 3000.0, 5000.0, 6500.0, 12345.0, 25000.0])
def test_a_blackbody_has_its_own_colour_temperature(temperature_k: float) -> None:
    assert correlated_colour_temperature_k(illuminant(f"blackbody:{temperature_k}")) == pytest.approx(temperature_k, rel=1e-4)


def test_green_light_and_darkness_have_no_colour_temperature() -> None:
    green = Spectrum(np.array([520.0, 530.0, 540.0]), np.array([0.0, 1.0, 0.0]), outside="zero")
    for light in (green, green.scaled(0.0), illuminant("blackbody:500K")):
        with pytest.raises(FieldError, match="colour temperature"):
            correlated_colour_temperature_k(light)


def test_band_averages_of_a_blackbody_are_those_of_plancks_law() -> None:
    grid = WavelengthGrid(380.0, 1000.0, 10.0)
    fine = grid.edges_nm[0] + 0.001 * (np.arange(630_000) + 0.5)
    for temperature_k, tolerance in ((1500.0, 1e-4), (3000.0, 1e-5), (10000.0, 1e-5)):
        exact = planck_radiance(fine, temperature_k).reshape(63, 10_000).mean(axis=1)
        scaled = 100.0 / planck_radiance(560.0, temperature_k)
        bands = illuminant(f"blackbody:{temperature_k}K").band_average(grid)
        assert bands == pytest.approx(exact * scaled, rel=tolerance)


def test_illuminant_a_is_a_blackbody_of_2856_kelvin() -> None:
    # 2848 K with the old c2 is 2855.5 K with today's.
    old, new = illuminant("A"), illuminant("blackbody:2855.5K")
    wavelength_nm = np.arange(380.0, 1000.0, 10.0)
    assert old.at(wavelength_nm) == pytest.approx(new.at(wavelength_nm), rel=2e-4)
    assert old.at(560.0) == pytest.approx(100.0, rel=1e-12)
    assert old.at([300.0, 700.0]) == pytest.approx([0.930483, 198.261], rel=1e-5)


def test_daylight_of_6504_kelvin_is_d65() -> None:
    wavelength_nm = np.arange(380.0, 781.0, 5.0)
    ours = illuminant(f"daylight:{6500 * 1.4388 / 1.438:.4f}K").at(wavelength_nm)
    # The table rounds M1 and M2 to three decimals.
    assert ours == pytest.approx(illuminant("D65").at(wavelength_nm), abs=0.02)


@pytest.mark.parametrize("temperature_k", [4000, 5000, 7000, 7001, 12000, 25000])
def test_daylight_has_the_temperature_asked_for(temperature_k: int) -> None:
    spectrum = illuminant(f"daylight:{temperature_k}K")
    assert spectrum.at(560.0) == pytest.approx(100.0, rel=1e-12)
    assert spectrum.values.min() >= 0.0
    # The formula for x is a fit; CIE 15 gives its temperatures to this accuracy.
    assert correlated_colour_temperature_k(spectrum) == pytest.approx(temperature_k, rel=1e-3)


def test_daylight_goes_on_to_830_nm() -> None:
    # CIE 15:2004, table T.1.
    assert illuminant("D65").at(830.0) == pytest.approx(60.3125, abs=1e-3)
    assert illuminant("D65").at(780.0) == pytest.approx(63.3828, abs=1e-3)


@pytest.mark.parametrize("name", illuminant_names())
def test_every_name_gives_a_spectrum_with_light_and_a_source(name: str) -> None:
    spectrum = illuminant(name.swapcase())
    assert spectrum is illuminant(name)
    assert spectrum.outside == "zero"
    assert spectrum.values.min() >= 0.0
    assert spectrum.band_average(WavelengthGrid()).sum() > 0.0
    assert spectrum.source
    assert spectrum.unit == "relative"


def test_f_and_fl_are_the_same_lamps() -> None:
    for number in range(1, 13):
        assert illuminant(f"f{number}") is illuminant(f"FL{number}")


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        ("D66", "did you mean 'D65'"),
        ("LEDB1", "did you mean 'LED-B1'"),
        ("black body:3000", "did you mean 'blackbody:3000K'"),
        ("blackbody", "blackbody:3000K"),
        ("", "known are"),
        ("blackbody:100K", "500 to 25000 K"),
        ("blackbody:1e999K", "500 to 25000 K"),
        ("daylight:3000K", "4000 to 25000 K"),
        ("daylight:..K", "holds no temperature"),
    ],
)
def test_unknown_names_and_temperatures_are_answered(name: str, answer: str) -> None:
    with pytest.raises(FieldError, match=answer) as caught:
        illuminant(name, path="scene.lights[0].spectrum")
    assert caught.value.path == "scene.lights[0].spectrum"


def test_a_grid_beyond_a_lamps_table_is_noted() -> None:
    wide, narrow = WavelengthGrid(400.0, 1000.0, 10.0), WavelengthGrid(400.0, 700.0, 10.0)
    assert coverage_note(illuminant("FL11"), narrow) == ""
    assert coverage_note(illuminant("A"), wide) == ""
    assert "380 to 780 nm" in coverage_note(illuminant("FL11"), wide)
    assert "taken as dark" in coverage_note(illuminant("D65"), wide)


def test_importing_and_asking_needs_no_colour_library_and_is_fast() -> None:
    code = (
        "import sys, fullwell.radiometry as r; r.illuminant('D65'); r.reflectance('colorchecker:red'); r.metal('gold');"
        "r.luminance_cd_m2(r.illuminant('A')); r.reflectance_from_srgb((1, 0, 0)); sys.exit('colour' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
