"""The tables in the package are those of colour-science, digit for digit."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.radiometry import COLORCHECKER_PATCHES, chromaticity, illuminant
from fullwell.radiometry.tables import TABLE_FILES, table_names, table_spectrum

colour = pytest.importorskip("colour")


@pytest.mark.parametrize("name", table_names("illuminants"))
def test_illuminants_are_those_of_the_library(name: str) -> None:
    theirs = colour.SDS_ILLUMINANTS[name]
    assert illuminant(name).at(theirs.wavelengths) == pytest.approx(theirs.values, rel=1e-12)


def test_illuminant_a_is_that_of_the_library() -> None:
    theirs = colour.SDS_ILLUMINANTS["A"]
    assert illuminant("A").at(theirs.wavelengths) == pytest.approx(theirs.values, rel=2e-5)  # six digits are published


def test_the_observer_is_that_of_the_library() -> None:
    theirs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    for axis, values in zip("xyz", theirs.values.T, strict=True):
        assert table_spectrum("observer", f"{axis}_bar", "zero", "1").values == pytest.approx(values, rel=1e-12, abs=1e-15)
    efficiency = colour.SDS_LEFS["CIE 1924 Photopic Standard Observer"]
    assert table_spectrum("observer", "v_lambda", "zero", "1").values == pytest.approx(efficiency.values, rel=1e-12, abs=1e-15)


def test_the_colorchecker_is_that_of_the_library() -> None:
    theirs = colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"]
    assert table_names("colorchecker") == COLORCHECKER_PATCHES
    for ours, patch in zip(COLORCHECKER_PATCHES, theirs, strict=True):
        assert table_spectrum("colorchecker", ours, "hold", "1").values == pytest.approx(theirs[patch].values, rel=1e-12)


def test_the_basis_of_upsampling_is_that_of_the_library() -> None:
    from colour.recovery import MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019

    for column, name in enumerate(("red", "green", "blue")):
        theirs = MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019.values[:, column]
        assert table_spectrum("mallett2019", name, "hold", "1").values == pytest.approx(theirs, rel=1e-12)


@pytest.mark.parametrize("file", TABLE_FILES)
def test_every_table_names_its_source(file: str) -> None:
    for name in table_names(file):
        spectrum = table_spectrum(file, name, "zero", "1")
        assert len(spectrum.source) > 30
        assert np.all(np.isfinite(spectrum.values))


@pytest.mark.parametrize("temperature_k", [2000.0, 3000.0, 5000.0, 10000.0, 25000.0])
def test_blackbodies_have_the_chromaticity_of_the_librarys(temperature_k: float) -> None:
    xyz = colour.sd_to_XYZ(colour.sd_blackbody(temperature_k, colour.SpectralShape(360, 780, 1)))
    # The library's c2 is 1.4388e-2 m K, ours 1.438777e-2.
    assert chromaticity(illuminant(f"blackbody:{temperature_k}K")) == pytest.approx(xyz[:2] / xyz.sum(), abs=1e-5)
