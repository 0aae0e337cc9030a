"""Albedo tables: against direct quadrature at other roughness, and at limits that are known."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.render.transport import albedo
from fullwell.render.transport.fresnel import conductor_mean, dielectric_on_host

TABLE_TOLERANCE = 4e-4
"""Of an albedo, away from grazing incidence on all but polished surfaces, where a table's step is seen."""

MU = np.linspace(0.05, 1.0, 20)


def interpolated(row: np.ndarray) -> np.ndarray:
    return np.interp(np.sqrt(MU) * (albedo.NODE_COUNT - 1), np.arange(albedo.NODE_COUNT), row)


def sampled(alpha: float, index: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Return reflected and refracted shares by plain Monte Carlo over slopes, weighted by what each direction sees.

    An independent way: normals are drawn from the whole distribution instead of the visible part.
    """
    rng = np.random.default_rng(4)
    u, azimuth = rng.random(400_000), 2 * np.pi * rng.random(400_000)
    tangent = alpha * np.sqrt(u / (1 - u))
    z = 1 / np.sqrt(1 + tangent**2)
    x = z * tangent * np.cos(azimuth)
    reflected, refracted = [], []
    for mu in MU:
        cosine = x * np.sqrt(1 - mu**2) + z * mu
        seen = np.where(cosine > 0, cosine / (z * mu) * _masking(mu, alpha), 0.0)
        fresnel, through = dielectric_on_host(np.abs(cosine), index or 1.0)
        up = 2 * cosine * z - mu
        reflected.append(np.mean(seen * (1.0 if index is None else fresnel) * np.where(up > 0, _masking(up, alpha), 0)))
        down = z * (cosine / (index or 1.0) - through) - mu / (index or 1.0)
        refracted.append(np.mean(seen * (1 - fresnel) * np.where(down < 0, _masking(down, alpha), 0)))
    return np.array(reflected), np.array(refracted)


def _masking(z: np.ndarray | float, alpha: float) -> np.ndarray:
    square = np.maximum(np.square(z), 1e-30)
    return 2 / (1 + np.sqrt(1 + alpha**2 * (1 - square) / square))


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [0.07, 0.33, 0.9])
def test_tables_agree_with_monte_carlo_over_all_normals(alpha: float) -> None:
    monte_carlo_error = 6e-3
    np.testing.assert_allclose(interpolated(albedo.metal_albedo(alpha)), sampled(alpha, None)[0], atol=monte_carlo_error)
    reflected, refracted = sampled(alpha, 1.5)
    np.testing.assert_allclose(interpolated(albedo.coat_transmittance(alpha, 1.5)), 1 - reflected, atol=monte_carlo_error)
    np.testing.assert_allclose(interpolated(albedo.entering(alpha, 1.5)), refracted, atol=monte_carlo_error)
    np.testing.assert_allclose(interpolated(albedo.glass_albedo(alpha, 1.5)), reflected + refracted, atol=monte_carlo_error)


@pytest.mark.parametrize("alpha", [0.0113, 0.081, 0.47])
def test_rows_between_kept_alphas_are_right(alpha: float) -> None:
    between = interpolated(albedo.metal_albedo(alpha))
    direct = interpolated(albedo._as_row(albedo._at_knots(alpha, 1.0, (200, 80), albedo._mirrored(alpha, None))))
    np.testing.assert_allclose(between, direct, atol=TABLE_TOLERANCE)


def test_polished_coat_lets_in_what_fresnel_leaves() -> None:
    row = albedo.coat_transmittance(0.0, 1.5)
    np.testing.assert_allclose(interpolated(row), 1 - dielectric_on_host(MU, 1.5)[0], atol=TABLE_TOLERANCE)
    assert albedo.hemisphere_mean(row) == pytest.approx(1 - 0.09178, abs=1e-4)


def test_the_mean_over_the_hemisphere_is_that_of_the_interpolated_row() -> None:
    assert albedo.hemisphere_mean(np.ones(albedo.NODE_COUNT)) == pytest.approx(1.0, abs=1e-12)
    assert albedo.hemisphere_mean(np.linspace(0, 1, albedo.NODE_COUNT)) == pytest.approx(0.8, abs=1e-12)  # root of mu


def test_mean_reflectance_of_metals() -> None:
    assert conductor_mean(np.array([0.0]), np.array([1.0]))[0] == pytest.approx(1.0, abs=1e-9)
    assert conductor_mean(np.array([1.0]), np.array([0.0]))[0] == pytest.approx(0.0, abs=1e-9)
    assert conductor_mean(np.array([1.5]), np.array([0.0]))[0] == pytest.approx(0.09178, abs=1e-4)
