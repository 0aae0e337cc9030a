"""Refractive indices: catalogue values of n_d and Abbe numbers return."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core.errors import FieldError
from fullwell.radiometry.glasses import AIR_INDEX, glass, glass_from_abbe, glass_names, index_of_line

LINES_NM = np.array([486.1327, 587.5618, 656.2725])
INDEX_TOLERANCE = 2e-5
"""Half of it is the table's step, half the catalogue's rounding."""


@pytest.mark.parametrize(
    ("name", "n_d", "abbe"),
    [
        ("N-BK7", 1.51680, 64.17),
        ("F2", 1.62004, 36.37),
        ("N-F2", 1.62005, 36.43),
        ("N-SF11", 1.78472, 25.68),
        ("fused-silica", 1.45846, 67.82),
    ],
)
def test_glasses_have_their_catalogue_index_and_abbe_number(name: str, n_d: float, abbe: float) -> None:
    n_f, n, n_c = glass(name).at(LINES_NM) / AIR_INDEX
    assert n == pytest.approx(n_d, abs=INDEX_TOLERANCE)
    assert (n - 1) / (n_f - n_c) == pytest.approx(abbe, rel=2e-3)


def test_water_refracts_as_measured() -> None:
    assert index_of_line(glass("water")) / AIR_INDEX == pytest.approx(1.33299, abs=INDEX_TOLERANCE)


@pytest.mark.parametrize(("n_d", "abbe"), [(1.5168, 64.17), (1.9, 20.0), (1.0, 50.0)])
def test_cauchys_formula_returns_what_it_was_made_from(n_d: float, abbe: float) -> None:
    n_f, n, n_c = glass_from_abbe(n_d, abbe).at(LINES_NM)
    assert n == pytest.approx(n_d, abs=INDEX_TOLERANCE)
    assert n_f - n_c == pytest.approx((n_d - 1) / abbe, abs=INDEX_TOLERANCE)


def test_cauchys_formula_is_near_sellmeiers_for_crown_glass() -> None:
    visible_nm = np.linspace(400, 700, 31)
    np.testing.assert_allclose(
        glass_from_abbe(1.5168, 64.17).at(visible_nm), glass("N-BK7").at(visible_nm) / AIR_INDEX, atol=1e-3
    )


def test_names_are_found_in_any_case_and_unknown_ones_answered() -> None:
    assert glass("n-bk7") is glass("N-BK7")
    assert all(np.all(glass(name).values > 1) for name in glass_names())
    with pytest.raises(FieldError, match="did you mean 'N-SF11'"):
        glass("N-SF12")
