"""What a smooth dielectric surface lets through, on average, and what a body under it looks like from outside."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["body_seen_through_coat", "mean_transmittance", "normal_transmittance"]

_NODES = 64


def normal_transmittance(index: ArrayLike) -> NDArray[np.float64]:
    """Return the transmittance of a surface to a body of this index at normal incidence, same shape."""
    n = np.asarray(index, dtype=np.float64)
    return np.asarray(4.0 * n / (n + 1.0) ** 2)


def mean_transmittance(index: ArrayLike, largest_angle_deg: float = 90.0) -> NDArray[np.float64]:
    """Return the transmittance into a body, mean over light that comes evenly from a cone about the normal, same shape.

    The integral of Fresnel's unpolarised transmittance times 2 sin(t) cos(t), over the same without it (Stern 1964), by
    Gauss quadrature in sin^2(t). 90 degrees is diffuse light.
    """
    n = np.asarray(index, dtype=np.float64)[..., None]
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    sine_squared = 0.5 * (node + 1.0) * np.sin(np.radians(largest_angle_deg)) ** 2
    cosine = np.sqrt(1.0 - sine_squared)
    inside = np.sqrt(1.0 - sine_squared / n**2)
    across = (cosine - n * inside) / (cosine + n * inside)
    parallel = (n * cosine - inside) / (n * cosine + inside)
    through = 1.0 - 0.5 * (across**2 + parallel**2)
    return np.asarray((through * 0.5 * weight).sum(axis=-1))


def body_seen_through_coat(body: ArrayLike, index: float) -> NDArray[np.float64]:
    """Return what diffuse light makes of a body under a clear coat, seen along the normal, without the coat's own gloss.

    T_diffuse T_normal / n^2 x body / (1 - body R_inside), R_inside = 1 - T_diffuse / n^2 (Saunderson 1942): the renderer's
    plastic, of which a spectrophotometer with the specular part excluded measures this.
    """
    reflectance = np.asarray(body, dtype=np.float64)
    diffuse = _mean_transmittance_of(index)
    back = 1.0 - diffuse / index**2
    return np.asarray(diffuse * float(normal_transmittance(index)) / index**2 * reflectance / (1.0 - reflectance * back))


@cache
def _mean_transmittance_of(index: float) -> float:
    return float(mean_transmittance(index))
