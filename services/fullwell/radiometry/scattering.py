"""Diffuse light of a layered atmosphere by successive orders of scattering, exact in energy.

Azimuth is expanded in cosines, zenith angle in Gauss points of each hemisphere, height in layers of constant source. The
derivation is on docs/physics/sky.md. No ground: its light is a second problem, lit from below.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.radiometry.atmosphere import (
    AEROSOL_LOBES,
    RAYLEIGH_SECOND_MOMENT,
    Atmosphere,
    air_mass,
    clear_atmosphere,
)

__all__ = [
    "MODES",
    "DiffuseLight",
    "GroundLight",
    "light_from_below",
    "light_from_sun",
    "single_scattering",
    "stream_sines",
    "stream_weights",
]

Array = NDArray[np.float64]

STREAMS: Final = 8
"""Gauss points per hemisphere. With 2 * STREAMS Legendre moments the quadrature keeps energy to rounding."""

MODES: Final = 2 * STREAMS
"""Azimuthal cosines of light scattered more than once; light scattered once needs none, its phase function is used whole."""

ORDERS: Final = 14
_ORDERS_OF_AZIMUTH: Final = 6
"""Orders of scattering before the rest is a geometric series; light forgets its azimuth sooner."""

_SMALL_DEPTH: Final = 1e-8
"""Below this (1 - exp(-x)) / x is 1 to rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class DiffuseLight:
    """Diffuse light per unit irradiance of the sun on a card that faces it, above a black ground.

    Attributes
    ----------
    multiple
        (MODES, views, n) [sr^-1], of light scattered more than once towards each view: factors of cos(m azimuth from the sun).
    stream_radiance
        (STREAMS, n) [sr^-1], mean over azimuth of all diffuse light at the ground, from the elevations of `stream_sines`.
    irradiance
        (n,) of horizontal ground.
    lost_upwards, absorbed
        (n,) what leaves the top of the atmosphere, and what the aerosol keeps, per area of ground.
    """

    multiple: Array
    stream_radiance: Array
    irradiance: Array
    lost_upwards: Array
    absorbed: Array


@dataclass(frozen=True, slots=True, eq=False)
class GroundLight:
    """What the atmosphere sends back of a ground of radiance 1 in all directions.

    `radiance` (views, n): of the sky. `albedo` (n,): irradiance from the sky over irradiance from the ground.
    """

    radiance: Array
    albedo: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Transport:
    """Linear maps of a layered atmosphere from sources (n, layers) to light along the streams, down first, then up.

    `mean` (2 STREAMS, n, layers, layers): to the mean radiance in each layer. `exit` (2 STREAMS, n, layers): to the radiance
    that leaves, at the ground for the first half, at the top for the second. `air` and `aerosol` (n, layers): scattering albedo
    of each constituent, its share of the depth included.
    """

    mean: Array
    exit: Array
    air: Array
    aerosol: Array


def stream_sines() -> tuple[float, ...]:
    """Return the sines of elevation of the streams that reach the ground, (STREAMS,)."""
    return tuple(_half_cosines().tolist())


def stream_weights() -> Array:
    """Return the weights of the streams' radiances in the irradiance of the ground over 2 pi, (STREAMS,); they add to 1/2."""
    return _half_weights() * _half_cosines()


def light_from_sun(
    turbidity: float, *, sine_of_elevation: float, view_sines: tuple[float, ...], orders: int = ORDERS, modes: int = MODES
) -> DiffuseLight:
    """Return the diffuse light of a sun of unit irradiance over black ground, no absorbing gases."""
    atmosphere, transport = clear_atmosphere(turbidity), _transport(turbidity)
    sun_mass = float(air_mass(sine_of_elevation))
    first = _first_source(atmosphere, transport, sine_of_elevation=sine_of_elevation, sun_mass=sun_mass, modes=modes)
    field = _all_orders(transport, _carried(transport, first), orders)
    stream_source = first[0] + _scattered(transport, field[:1], _stream_cosines())[0]
    leaving = np.einsum("snk,snk->sn", transport.exit, stream_source)
    weight, cosine = _half_weights(), _half_cosines()
    source = _scattered(transport, field, np.array(view_sines) * -1.0)
    absorbed_share = atmosphere.depth * (1.0 - transport.air - transport.aerosol)
    mean_intensity = 2.0 * np.pi * np.einsum("s,snk->nk", np.tile(weight, 2), field[0]) + _beam(atmosphere, sun_mass)
    return DiffuseLight(
        multiple=np.einsum("vnk,mvnk->mvn", _view_weights(turbidity, view_sines), source),
        stream_radiance=leaving[:STREAMS],
        irradiance=2.0 * np.pi * (weight * cosine) @ leaving[:STREAMS],
        lost_upwards=2.0 * np.pi * (weight * cosine) @ leaving[STREAMS:],
        absorbed=np.sum(absorbed_share * mean_intensity, axis=1),
    )


@lru_cache(maxsize=8)
def light_from_below(turbidity: float, view_sines: tuple[float, ...], orders: int = ORDERS) -> GroundLight:
    """Return what the sky sends back to a ground that shines with radiance 1, no absorbing gases."""
    transport = _transport(turbidity)
    depth = clear_atmosphere(turbidity).depth
    unscattered = np.zeros((1, 2 * STREAMS, *depth.shape))
    slant = depth / _half_cosines()[:, None, None]
    below = np.cumsum(slant[..., ::-1], axis=-1)[..., ::-1] - slant
    unscattered[0, STREAMS:] = np.exp(-below) * _mean_decay(slant)
    field = _all_orders(transport, unscattered, orders)
    leaving = np.einsum("snk,snk->sn", transport.exit[:STREAMS], _scattered(transport, field, -_half_cosines())[0])
    source = _scattered(transport, field, np.array(view_sines) * -1.0)[0]
    return GroundLight(
        radiance=np.einsum("vnk,vnk->vn", _view_weights(turbidity, view_sines), source),
        albedo=2.0 * (_half_weights() * _half_cosines()) @ leaving,
    )


def single_scattering(turbidity: float, *, sun_mass: float, view_masses: Array) -> tuple[Array, Array]:
    """Return light scattered once by air and by aerosol in each layer, 2 x (views, n, layers) [sr^-1].

    Per unit irradiance of the sun and per unit phase function (mean 1), exact for each layer's mixture.
    """
    atmosphere, transport = clear_atmosphere(turbidity), _transport(turbidity)
    depth = atmosphere.depth
    above = np.cumsum(depth, axis=1) - depth
    below = depth.sum(axis=1, keepdims=True) - above - depth
    mass = view_masses[:, None, None]
    path = np.exp(-sun_mass * above - mass * (below + depth)) * mass * depth * _mean_decay((sun_mass - mass) * depth)
    path /= 4.0 * np.pi
    return path * transport.air, path * transport.aerosol


def _first_source(
    atmosphere: Atmosphere, transport: _Transport, *, sine_of_elevation: float, sun_mass: float, modes: int
) -> Array:
    """Return the source of light scattered once (modes, 2 STREAMS, n, layers) [sr^-1]."""
    beam = _beam(atmosphere, sun_mass) / (4.0 * np.pi)
    sun = _legendre(np.array([-sine_of_elevation]))
    stream = _legendre(_stream_cosines())
    both = np.where(np.arange(modes) == 0, 1.0, 2.0)
    air, aerosol = (both[:, None] * _phase(moments, stream, sun)[:modes, :, 0] for moments in _moments())
    return np.asarray(air[:, :, None, None] * (transport.air * beam) + aerosol[:, :, None, None] * (transport.aerosol * beam))


def _beam(atmosphere: Atmosphere, sun_mass: float) -> Array:
    """Return the sun's mean irradiance in each layer on a card that faces it, (n, layers), 1 outside the atmosphere."""
    slant = sun_mass * atmosphere.depth
    return np.asarray(np.exp(slant - np.cumsum(slant, axis=1)) * _mean_decay(slant))


def _all_orders(transport: _Transport, once: Array, orders: int) -> Array:
    """Return the field of all orders (modes, 2 STREAMS, n, layers) that starts with `once`; the tail is a geometric series."""
    total, field = once.copy(), once
    for order in range(2, orders + 1):
        if order == _ORDERS_OF_AZIMUTH:
            field = field[:1]
        before = field[0].sum(axis=(0, 2))
        field = _carried(transport, _scattered(transport, field, _stream_cosines()))
        total[: len(field)] += field
    ratio = field[0].sum(axis=(0, 2)) / np.maximum(before, np.finfo(float).tiny)
    total[0] += field[0] * (ratio / (1.0 - ratio))[:, None]
    return np.asarray(total)


def _scattered(transport: _Transport, field: Array, cosines: Array) -> Array:
    """Return the source that a field makes along directions of given cosines, (modes, directions, n, layers)."""
    modes = len(field)
    flat = field.reshape(modes, 2 * STREAMS, -1)
    air, aerosol = _scattering_matrices(tuple(cosines))
    shape = (modes, len(cosines), *field.shape[2:])
    few = min(modes, 3)  # Air scatters into three cosines only.
    source = (aerosol[:modes] @ flat).reshape(shape) * transport.aerosol
    source[:few] += (air[:few] @ flat[:few]).reshape(few, *shape[1:]) * transport.air
    return np.asarray(source)


def _carried(transport: _Transport, source: Array) -> Array:
    """Return the mean radiance in each layer from a source, (modes, 2 STREAMS, n, layers)."""
    return np.asarray(np.moveaxis(np.matmul(transport.mean, np.moveaxis(source, 0, -1)), -1, 0))


@lru_cache(maxsize=8)
def _transport(turbidity: float) -> _Transport:
    atmosphere = clear_atmosphere(turbidity)
    depth = atmosphere.depth
    slant = depth / _half_cosines()[:, None, None]
    down_mean, down_exit = _downwards(slant)
    up_mean, up_exit = _downwards(slant[..., ::-1])
    return _Transport(
        mean=np.concatenate([down_mean, up_mean[..., ::-1, ::-1]]),
        exit=np.concatenate([down_exit, up_exit[..., ::-1]]),
        air=atmosphere.rayleigh_depth / depth,
        aerosol=atmosphere.aerosol_albedo[:, None] * atmosphere.aerosol_depth / depth,
    )


def _downwards(slant: Array) -> tuple[Array, Array]:
    """Return the maps from sources to layer means (..., layers, layers) and to the far end (..., layers)."""
    layers = slant.shape[-1]
    reached = np.cumsum(slant, axis=-1)
    emitted = -np.expm1(-slant)
    between = np.maximum((reached - slant)[..., :, None] - reached[..., None, :], 0.0)
    carried = _mean_decay(slant)[..., :, None] * emitted[..., None, :] * np.exp(-between)
    carried *= np.tril(np.ones((layers, layers)), -1)
    kept = 1.0 - _mean_decay(slant)
    carried[..., np.arange(layers), np.arange(layers)] = kept
    return carried, emitted * np.exp(reached - reached[..., -1:])


@lru_cache(maxsize=8)
def _view_weights(turbidity: float, view_sines: tuple[float, ...]) -> Array:
    """Return the map from sources to the radiance seen from the ground, (views, n, layers)."""
    slant = clear_atmosphere(turbidity).depth * air_mass(view_sines)[:, None, None]
    reached = np.cumsum(slant, axis=-1)
    return np.asarray(-np.expm1(-slant) * np.exp(reached - reached[..., -1:]))


def _mean_decay(slant: Array) -> Array:
    """Return (1 - exp(-x)) / x, 1 at 0."""
    small = np.abs(slant) < _SMALL_DEPTH
    safe = np.where(small, 1.0, slant)
    return np.asarray(np.where(small, 1.0, -np.expm1(-safe) / safe))


@cache
def _half_points() -> tuple[Array, Array]:
    points, weights = np.polynomial.legendre.leggauss(STREAMS)
    return 0.5 * (points + 1.0), 0.5 * weights


def _half_cosines() -> Array:
    return _half_points()[0]


def _half_weights() -> Array:
    return _half_points()[1]


def _stream_cosines() -> Array:
    """Return cosines from the upward vertical of the directions in which light travels, (2 STREAMS,), down first."""
    return np.concatenate([-_half_cosines(), _half_cosines()])


@cache
def _moments() -> tuple[Array, Array]:
    """Return the Legendre moments of the phase functions of air and aerosol, each (2 STREAMS,), 1 first."""
    order = np.arange(2 * STREAMS)
    air = np.where(order == 0, 1.0, np.where(order == 2, RAYLEIGH_SECOND_MOMENT, 0.0))
    aerosol = np.sum([weight * np.array([float(g) ** degree for degree in order]) for weight, g in AEROSOL_LOBES], axis=0)
    return air, aerosol


@lru_cache(maxsize=8)
def _scattering_matrices(cosines: tuple[float, ...]) -> tuple[Array, Array]:
    """Return the maps from stream radiances to scattered light of air and aerosol, 2 x (MODES, directions, 2 STREAMS)."""
    to, streams = _legendre(np.array(cosines)), _legendre(_stream_cosines())
    weight = 0.5 * np.tile(_half_weights(), 2)
    air, aerosol = (_phase(moments, to, streams) * weight for moments in _moments())
    return air, aerosol


def _phase(moments: Array, to: Array, since: Array) -> Array:
    """Return the phase function's azimuthal parts by the addition theorem, (modes, directions to, directions from)."""
    factor = (2.0 * np.arange(len(moments)) + 1.0) * moments
    return np.asarray(np.einsum("l,mlt,mls->mts", factor, to, since, optimize=True))


def _legendre(cosine: Array) -> Array:
    """Return sqrt((n - m)! / (n + m)!) P_n^m without the sign (-1)^m, (modes m, degrees n, points) (chandrasekhar1960, VI)."""
    degrees = 2 * STREAMS
    found = np.zeros((degrees, degrees, len(cosine)))
    sine = np.sqrt(np.maximum(0.0, 1.0 - cosine**2))
    start = np.ones_like(cosine)
    for m in range(degrees):
        found[m, m] = start
        if m + 1 < degrees:
            found[m, m + 1] = np.sqrt(2.0 * m + 1.0) * cosine * start
        for n in range(m + 2, degrees):
            rise = (2.0 * n - 1.0) * cosine * found[m, n - 1] - np.sqrt((n - 1.0) ** 2 - m**2) * found[m, n - 2]
            found[m, n] = rise / np.sqrt(n**2 - m**2)
        start = start * sine * np.sqrt((2.0 * m + 1.0) / (2.0 * m + 2.0))
    return found
