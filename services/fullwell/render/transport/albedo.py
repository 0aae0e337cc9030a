"""Directional albedos of rough surfaces, by quadrature: what their single scattering returns of the light from one direction.

A row is a table over the cosine of incidence, mu, at equal steps of the root of mu: dense towards grazing incidence, where
the albedo of nearly smooth surfaces changes fastest.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fullwell.render.transport.fresnel import dielectric_on_host
from fullwell.render.transport.microfacet import POLISHED_BELOW

__all__ = [
    "NODE_COUNT",
    "coat_transmittance",
    "entering",
    "glass_albedo",
    "hemisphere_mean",
    "metal_albedo",
    "mitsuba_internal",
]

NODE_COUNT = 256

_KNOT_COUNT = 48
_ALPHA_COUNT = 32
_LOG_RANGE = -np.log(POLISHED_BELOW)
_SMALLEST_MU = 1e-5
_ROUGH = 0.2

_Row = NDArray[np.float64]
_Light = Callable[[_Row, _Row, _Row], _Row]
"""What goes on from a facet, by the cosine to its normal and the z of the reflected and of the refracted direction."""


def metal_albedo(alpha: float) -> _Row:
    """Return (NODE_COUNT,) the albedo of a rough surface whose facets reflect everything."""
    return _between_alphas(_metal_knots, alpha)


def coat_transmittance(alpha: float, index: float) -> _Row:
    """Return (NODE_COUNT,) what a rough coat of relative `index` does not reflect at once."""
    if alpha < POLISHED_BELOW:
        return np.asarray(1.0 - dielectric_on_host(_nodes(), index)[0])
    return 1.0 - _between_alphas(functools.partial(_coat_knots, index), alpha)


def entering(alpha: float, index: float) -> _Row:
    """Return (NODE_COUNT,) what a rough coat lets through at once, which is less: facets mask a part of it."""
    return _between_alphas(functools.partial(_entering_knots, index), max(alpha, POLISHED_BELOW))


@functools.lru_cache(maxsize=4096)
def glass_albedo(alpha: float, index: float) -> _Row:
    """Return (NODE_COUNT,) reflected plus refracted light where the far side has the relative `index`."""
    # From inside, total reflection begins with an infinite slope, which costs points where the surface is rough.
    points = (48, 32) if index > 1.0 else (160, 112) if alpha > _ROUGH else (128, 48)

    mirrored, bent = _mirrored(alpha, index), _bent(alpha, index)
    return _as_row(_at_knots(alpha, index, points, lambda *facet: mirrored(*facet) + bent(*facet)))


def hemisphere_mean(row: _Row) -> float:
    """Return the mean of a row over the hemisphere, weighted by the cosine, as the device interpolates it."""
    # Between nodes the row is linear in x, mu = x^2, so that 2 mu dmu = 4 x^3 dx: three Gauss points are exact.
    nodes, weights = _unit_gauss(3)
    x = (np.arange(NODE_COUNT - 1)[:, None] + nodes) / (NODE_COUNT - 1)
    value = row[:-1, None] * (1.0 - nodes) + row[1:, None] * nodes
    return float(np.sum(4.0 * x**3 * value * weights) / (NODE_COUNT - 1))


@functools.lru_cache(maxsize=4096)
def mitsuba_internal(alpha: float, index: float) -> float:
    """Return the diffuse reflectance of a rough coat from below as Mitsuba's `roughplastic` computes it: a mean of 64 nodes."""
    mu = np.maximum(1e-6, np.linspace(0.0, 1.0, 64))
    return float(2.0 * np.mean(_integral(mu, alpha, 1.0 / index, (128, 64), _mirrored(alpha, 1.0 / index)) * mu))


def _nodes() -> _Row:
    """Return the cosines at which a row's values stand."""
    return np.asarray(np.linspace(0.0, 1.0, NODE_COUNT) ** 2)


def _knots() -> _Row:
    """Return the cosines at which albedos are integrated: their cube roots have equal steps."""
    return np.maximum(np.linspace(0.0, 1.0, _KNOT_COUNT) ** 3, _SMALLEST_MU)


def _between_alphas(knots: Callable[[int], _Row], alpha: float) -> _Row:
    """Return a row between the alphas whose knots are kept, cubic in log alpha."""
    position = (_ALPHA_COUNT - 1) * (1.0 + np.log(alpha) / _LOG_RANGE)
    first = int(np.clip(np.floor(position) - 1, 0, _ALPHA_COUNT - 4))
    t = position - first
    weights = [np.prod([(t - j) / (i - j) for j in range(4) if j != i]) for i in range(4)]
    rows = sum(w * knots(first + i) for i, w in enumerate(weights) if w != 0.0)
    return _as_row(np.asarray(rows))


def _as_row(at_knots: _Row) -> _Row:
    spline = CubicSpline(np.linspace(0.0, 1.0, _KNOT_COUNT), at_knots)
    return np.asarray(np.clip(spline(np.cbrt(_nodes())), 0.0, 1.0))


def _alpha(number: int) -> float:
    return float(np.exp(_LOG_RANGE * (number / (_ALPHA_COUNT - 1) - 1.0)))


@functools.lru_cache(maxsize=4096)
def _metal_knots(number: int) -> _Row:
    alpha = _alpha(number)
    return _at_knots(alpha, 1.0, (64, 24), _mirrored(alpha, None))


@functools.lru_cache(maxsize=4096)
def _coat_knots(index: float, number: int) -> _Row:
    alpha = _alpha(number)

    return _at_knots(alpha, index, (32, 24), _mirrored(alpha, index))


@functools.lru_cache(maxsize=4096)
def _entering_knots(index: float, number: int) -> _Row:
    return _at_knots(_alpha(number), index, (32, 24), _bent(_alpha(number), index))


def _mirrored(alpha: float, index: float | None) -> _Light:
    """Return what facets mirror; None stands for facets that mirror everything."""

    def light(cosine: _Row, reflected: _Row, _: _Row) -> _Row:
        fresnel = 1.0 if index is None else dielectric_on_host(cosine, index)[0]
        return np.where(reflected > 0, fresnel * _masking(reflected, alpha), 0.0)

    return light


def _bent(alpha: float, index: float) -> _Light:
    """Return what facets refract."""

    def light(cosine: _Row, _: _Row, refracted: _Row) -> _Row:
        return np.where(refracted < 0, (1.0 - dielectric_on_host(cosine, index)[0]) * _masking(refracted, alpha), 0.0)

    return light


def _at_knots(alpha: float, index: float, points: tuple[int, int], light: _Light) -> _Row:
    """Return the integral of `light` over the visible normals at each knot."""
    slanted = _integral(_knots()[:-1], alpha, index, points, light)
    # At normal incidence nothing depends on the azimuth, and nothing smooths the edges of masking and total reflection.
    upright = _integral(np.ones(1), alpha, index, (2048, 1), light)
    return np.concatenate([slanted, upright])


def _integral(mu: _Row, alpha: float, index: float, points: tuple[int, int], light: _Light) -> _Row:
    cosine, reflected, refracted, weight = _visible(mu, alpha, index, points)
    return np.asarray(np.einsum("ijk,jk->i", light(cosine, reflected, refracted), weight))


def _visible(mu: _Row, alpha: float, index: float, points: tuple[int, int]) -> tuple[_Row, _Row, _Row, _Row]:
    """Return quadrature over the normals that are visible from each mu (see `microfacet.visible_normal`).

    These are the cosine to the normal, the z of the reflected and of the refracted direction, all (mu, polar, azimuthal), and
    the weights (polar, azimuthal), which add up to 1.
    """
    (u, u_weight), (v, v_weight) = _towards_one(points[0]), _unit_gauss(points[1])
    mu, u = mu[:, None, None], u[None, :, None]
    azimuth = np.pi * v[None, None, :]
    sine = np.sqrt(np.maximum(0.0, 1.0 - mu * mu))
    length = np.hypot(alpha * sine, mu)
    side, up = alpha * sine / length, mu / length
    z = (1.0 - u) * (1.0 + up) - up
    radius = np.sqrt(np.maximum(0.0, u * (1.0 + up) * (1.0 + z)))
    x, y, z = alpha * (radius * np.cos(azimuth) + side), alpha * radius * np.sin(azimuth), (1.0 - u) * (1.0 + up)
    length = np.sqrt(x * x + y * y + z * z)
    x, z = x / length, z / length
    cosine = x * sine + z * mu
    refracted = z * (cosine / index - dielectric_on_host(cosine, index)[1]) - mu / index
    return cosine, 2.0 * cosine * z - mu, refracted, u_weight[:, None] * v_weight[None, :]


@functools.cache
def _unit_gauss(count: int) -> tuple[_Row, _Row]:
    """Return Gauss points in [0, 1], in panels of at most 256: finding them takes the cube of their number."""
    panels = -(-count // 256)
    nodes, weights = np.polynomial.legendre.leggauss(count // panels)
    inside = (np.arange(panels)[:, None] + 0.5 * (nodes + 1.0)) / panels
    return inside.ravel(), np.tile(0.5 * weights / panels, panels)


def _towards_one(count: int) -> tuple[_Row, _Row]:
    """Return Gauss points that crowd at 1, where the steep microfacets are whose light is masked or reflected totally."""
    nodes, weights = _unit_gauss(count)
    return 1.0 - (1.0 - nodes) ** 2, 2.0 * (1.0 - nodes) * weights


def _masking(z: _Row, alpha: float) -> _Row:
    z_2 = z * z
    return np.asarray(2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * (1.0 - z_2) / np.maximum(z_2, 1e-30))))
