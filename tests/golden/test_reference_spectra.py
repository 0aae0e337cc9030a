"""Spectra against those that ISETCam used for its reference numbers (isetcam/spectra.json)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fullwell.core.constants import PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.radiometry import (
    colour_matching_functions,
    energy_to_photons,
    illuminant,
    luminous_efficiency,
)

FILE = "isetcam/spectra.json"
LAST_DIGIT = 5e-9
"""Both are the CIE's table; ISETCam's file has 7 to 9 decimals."""
OWN_DAYLIGHT = 1.1e-3
"""ISETCam makes its D illuminants from daylight components of its own; they differ from the CIE's table by up to that."""


@pytest.fixture
def spectra(reference: Callable[[str], Any]) -> dict[str, Any]:
    return dict(reference(FILE))


def _normalised(values: Any) -> np.ndarray:
    array = np.asarray(values, dtype=np.float64)
    return array / array[16]  # 560 nm


def test_v_lambda_is_the_same(spectra: dict[str, Any]) -> None:
    ours = luminous_efficiency()
    assert ours.at(spectra["wave_nm"]) == pytest.approx(spectra["V_lambda"], abs=LAST_DIGIT)


def test_v_lambda_between_the_wavelengths_is_the_same(spectra: dict[str, Any]) -> None:
    check = spectra["interp_check"]
    assert luminous_efficiency().at(check["wave_nm"]) == pytest.approx(check["V_lambda"], abs=LAST_DIGIT)


def test_the_colour_matching_functions_are_the_same(spectra: dict[str, Any]) -> None:
    theirs = np.array(spectra["xyz_cmf_energy"])
    for column, ours in enumerate(colour_matching_functions()):
        assert ours.at(spectra["wave_nm"]) == pytest.approx(theirs[:, column], abs=LAST_DIGIT)


def test_photons_weigh_as_theirs(spectra: dict[str, Any]) -> None:
    wavelength_nm = np.array(spectra["wave_nm"], dtype=np.float64)
    per_photon = np.array(spectra["xyz_cmf_energy"])[:, 1] / energy_to_photons(1.0, wavelength_nm)
    theirs = np.array(spectra["xyz_cmf_quanta"])[:, 1]
    constants = spectra["constants"]
    ratio = constants["h_J_s"] * constants["c_m_s"] / (PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S)
    assert theirs == pytest.approx(per_photon * ratio, rel=1e-9)


@pytest.mark.parametrize(("name", "key", "tolerance"), [
    ("A", "illuminantA", 3e-4),  # theirs is rounded to two decimals: 0.005 of 14.7
    ("C", "illuminantC", 1e-12),
    ("D50", "D50", OWN_DAYLIGHT),
    ("D65", "D65", OWN_DAYLIGHT),
    ("D75", "D75", OWN_DAYLIGHT),
    ("E", "equalEnergy", 1e-12),
])  # fmt: skip
def test_illuminants_are_the_same(spectra: dict[str, Any], name: str, key: str, tolerance: float) -> None:
    theirs = _normalised(spectra[f"illuminant_relative_energy_{key}"])
    ours = _normalised(illuminant(name).at(spectra["wave_nm"]))
    assert ours == pytest.approx(theirs, rel=tolerance)


def test_equal_photons_is_energy_falling_with_wavelength(spectra: dict[str, Any]) -> None:
    wavelength_nm = np.array(spectra["wave_nm"], dtype=np.float64)
    photons = energy_to_photons(spectra["illuminant_relative_energy_equalPhotons"], wavelength_nm)
    assert photons == pytest.approx(np.full(31, photons[0]), rel=1e-9)
