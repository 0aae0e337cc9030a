"""The models that spectra of the catalogue come from: layers, surfaces, leaves, skin, pigments."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.assets.materials.curves import (
    WAVELENGTH_NM,
    band,
    edge,
    layer_over,
    layer_reflectance,
    through_knots,
)
from fullwell.assets.materials.leaves import Leaf, leaf_reflectance, leaf_transmittance
from fullwell.assets.materials.pigments import mixture_reflectance, pigment_names
from fullwell.assets.materials.skin import skin_body_reflectance
from fullwell.assets.materials.surface import body_seen_through_coat, mean_transmittance, normal_transmittance
from fullwell.assets.materials.tables import measured_names, measured_reflectance

TABLE_STEP_TOLERANCE = 5e-4
"""Coefficients every 5 nm, linear between, against a table every 1 nm."""


def at(values: np.ndarray, wavelength_nm: float) -> float:
    return float(np.interp(wavelength_nm, WAVELENGTH_NM, values))


# Layers --------------------------------------------------------------------------------------------------------------


def test_reflectance_of_a_layer_inverts_to_its_ratio() -> None:
    ratio = np.geomspace(1e-6, 1e4, 50)
    reflectance = layer_reflectance(ratio, np.ones_like(ratio))
    assert (1 - reflectance) ** 2 / (2 * reflectance) == pytest.approx(ratio, rel=1e-9)


def test_a_layer_without_absorption_is_white() -> None:
    assert layer_reflectance(0.0, 1.0) == 1.0


def test_a_thick_layer_hides_its_base_and_a_thin_one_shows_it() -> None:
    absorption, scattering = np.array([0.5, 20.0]), np.array([10.0, 10.0])
    thick = layer_over(np.array([1.0, 1.0]), absorption, scattering, thickness_cm=1e3)
    assert thick == pytest.approx(layer_reflectance(absorption, scattering), rel=1e-9)
    thin = layer_over(np.array([0.3, 0.7]), absorption, scattering, thickness_cm=1e-9)
    assert thin == pytest.approx([0.3, 0.7], rel=1e-6)


def test_two_thin_layers_are_one_of_their_thickness() -> None:
    absorption, scattering = np.array([0.7, 30.0]), np.array([12.0, 5.0])
    once = layer_over(np.array([0.4, 0.4]), absorption, scattering, thickness_cm=0.05)
    lower = layer_over(np.array([0.4, 0.4]), absorption, scattering, thickness_cm=0.02)
    assert layer_over(lower, absorption, scattering, thickness_cm=0.03) == pytest.approx(once, rel=1e-12)


def test_knots_are_met_and_never_overshot() -> None:
    values = through_knots([(380, 0.1), (500, 0.1), (520, 0.8), (1000, 0.8)])
    assert at(values, 500) == pytest.approx(0.1)
    assert at(values, 520) == pytest.approx(0.8)
    assert values.min() >= 0.1
    assert values.max() <= 0.8


def test_bands_and_edges_have_their_place() -> None:
    assert WAVELENGTH_NM[np.argmax(band(650.0, 20.0))] == 650.0
    assert at(edge(500.0, 8.0, 2.0), 500) == pytest.approx(1.0)
    assert at(edge(500.0, 8.0, 2.0), 900) < 1e-9


# Surfaces ------------------------------------------------------------------------------------------------------------


def test_diffuse_transmittance_is_that_of_the_textbook() -> None:
    # Walsh 1926, in closed form as given by Judd 1942, Journal of Research of the NBS 29, 329.
    for n in (1.333, 1.4, 1.5, 1.6):
        reflected = (
            0.5
            + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
            + n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * np.log((n - 1) / (n + 1))
            - 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
            + 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * np.log(n)
        )
        assert float(mean_transmittance(n)) == pytest.approx(1 - reflected, abs=1e-5)


def test_a_narrow_cone_is_normal_incidence() -> None:
    assert float(mean_transmittance(1.5, 0.5)) == pytest.approx(float(normal_transmittance(1.5)), abs=1e-5)


def test_the_coat_agrees_with_the_closed_form_of_saunderson() -> None:
    # k1 = 0.04 along the normal, k2 = 1 - T / n^2 = 0.5963: the usual constants of paint of index 1.5.
    diffuse = float(mean_transmittance(1.5))
    inside = 1 - diffuse / 1.5**2
    assert inside == pytest.approx(0.596, abs=1e-3)
    body = np.array([0.02, 0.3, 0.9])
    expected = 0.96 * (1 - inside) * body / (1 - inside * body)
    assert body_seen_through_coat(body, 1.5) == pytest.approx(expected, rel=1e-6)


def test_a_white_body_under_a_coat_returns_all_that_enters() -> None:
    # Seen along the normal; over all directions it is exactly what entered.
    assert float(body_seen_through_coat(1.0, 1.5)) == pytest.approx(0.96, rel=1e-6)


# Leaves --------------------------------------------------------------------------------------------------------------


def test_leaf_agrees_with_another_program() -> None:
    # PROSPECT-D of the package prosail 2.0.5: N 1.6, Cab 42, Car 9, Cw 0.012, Cm 0.006.
    leaf = Leaf(1.6, 42.0, 9.0, water_cm=0.012, dry_matter_g_per_cm2=0.006)
    reflectance, transmittance = leaf_reflectance(leaf), leaf_transmittance(leaf)
    for wavelength_nm, expected in ((450, 0.04124532), (550, 0.15565559), (670, 0.03649237), (800, 0.47180841)):
        assert at(reflectance, wavelength_nm) == pytest.approx(expected, abs=TABLE_STEP_TOLERANCE)
    for wavelength_nm, expected in ((550, 0.13577996), (800, 0.47092115)):
        assert at(transmittance, wavelength_nm) == pytest.approx(expected, abs=TABLE_STEP_TOLERANCE)


@pytest.mark.parametrize("layers", [1.0, 1.5, 2.7])
def test_a_leaf_never_returns_more_than_it_gets(layers: float) -> None:
    leaf = Leaf(layers, 30.0, 8.0)
    total = leaf_reflectance(leaf) + leaf_transmittance(leaf)
    assert total.max() < 1
    assert total.min() > 0.02


def test_more_chlorophyll_moves_the_red_edge_to_longer_waves() -> None:
    edges = [
        WAVELENGTH_NM[np.searchsorted(leaf_reflectance(Leaf(1.5, amount, 8.0))[60:80], 0.25) + 60] for amount in (15, 40, 80)
    ]
    assert edges == sorted(edges)
    assert edges[0] < edges[-1]


def test_water_shows_at_970_nm() -> None:
    wet = leaf_reflectance(Leaf(1.5, 40.0, 8.0, water_cm=0.03))
    assert at(wet, 970) < at(wet, 910)


# Skin ----------------------------------------------------------------------------------------------------------------


def test_blood_reddens_and_melanin_darkens() -> None:
    plain = skin_body_reflectance(melanin_share=0.02, blood_share=0.002)
    flushed = skin_body_reflectance(melanin_share=0.02, blood_share=0.02)
    tanned = skin_body_reflectance(melanin_share=0.1, blood_share=0.002)
    assert at(flushed, 650) / at(flushed, 545) > at(plain, 650) / at(plain, 545)
    assert np.all(tanned < plain)


def test_oxygen_splits_the_band_of_blood() -> None:
    full = skin_body_reflectance(melanin_share=0.02, blood_share=0.01, oxygenation=1.0)
    empty = skin_body_reflectance(melanin_share=0.02, blood_share=0.01, oxygenation=0.0)
    assert at(full, 560) > at(full, 575)
    assert at(empty, 555) < at(empty, 575)


# Pigments and tables -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", pigment_names())
def test_pigments_in_white_stay_in_bounds_and_darken_it(name: str) -> None:
    white, tinted = mixture_reflectance({"rutile": 1.0}), mixture_reflectance({"rutile": 1.0, name: 0.3})
    assert tinted.min() > 0
    assert tinted.max() < 1
    if name not in ("rutile", "chalk"):
        assert tinted.mean() < white.mean()


def test_rutile_is_white_from_430_nm_and_absorbs_the_ultraviolet() -> None:
    white = mixture_reflectance({"rutile": 1.0})
    assert at(white, 385) < 0.3
    assert at(white, 450) > 0.9
    assert at(white, 700) > 0.9


@pytest.mark.parametrize("name", measured_names())
def test_measured_spectra_are_continued_below_their_range_downwards(name: str) -> None:
    values, source = measured_reflectance(name)
    assert values.size == WAVELENGTH_NM.size
    assert 0 < values[0] <= values[4] * 1.001
    assert "400 nm" in source
