"""Fresnel reflectance of unpolarised light, on the device and, for tables, on the host."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["conductor", "conductor_mean", "dielectric", "dielectric_on_host"]

_TINY = 1e-20


def dielectric(dr: Any, cosine: Any, index: Any) -> tuple[Any, Any]:
    """Return the reflectance at a step of the index and the cosine of refraction (0 under total reflection).

    Parameters
    ----------
    cosine
        Of incidence, in [0, 1].
    index
        Of the far side, relative to the side of incidence. One value, or one per wavelength.
    """
    refracted = dr.safe_sqrt(1.0 - (1.0 - dr.square(cosine)) / dr.square(index))
    normal = (cosine - index * refracted) / dr.maximum(cosine + index * refracted, _TINY)
    parallel = (index * cosine - refracted) / dr.maximum(index * cosine + refracted, _TINY)
    return 0.5 * (dr.square(normal) + dr.square(parallel)), refracted


def dielectric_on_host(cosine: ArrayLike, index: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what `dielectric` does, in double precision."""
    c = np.asarray(cosine, dtype=np.float64)
    refracted = np.sqrt(np.maximum(0.0, 1.0 - (1.0 - c * c) / index**2))
    normal = (c - index * refracted) / np.maximum(c + index * refracted, _TINY)
    parallel = (index * c - refracted) / np.maximum(index * c + refracted, _TINY)
    return 0.5 * (normal**2 + parallel**2), refracted


def conductor(dr: Any, cosine: Any, eta: Any, k: Any) -> Any:
    """Return the reflectance of a metal of complex index eta + i k in vacuum.

    References
    ----------
    Born and Wolf 1999, Principles of Optics, 7th ed., section 14.2, squared moduli written without complex numbers.
    """
    cosine_2 = dr.square(cosine)
    sine_2 = 1.0 - cosine_2
    difference = dr.square(eta) - dr.square(k) - sine_2
    modulus = dr.sqrt(dr.square(difference) + 4.0 * dr.square(eta * k))
    across = 2.0 * cosine * dr.safe_sqrt(0.5 * (modulus + difference))
    normal = (modulus + cosine_2 - across) / dr.maximum(modulus + cosine_2 + across, _TINY)
    wide, narrow = modulus * cosine_2 + dr.square(sine_2), across * sine_2
    parallel = normal * (wide - narrow) / dr.maximum(wide + narrow, _TINY)
    return 0.5 * (normal + parallel)


def conductor_mean(eta: NDArray[np.float64], k: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the reflectance of metals under diffuse light: the mean over the hemisphere, weighted by the cosine."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    cosine, weight = 0.5 * (nodes + 1.0), 0.5 * weights
    index = np.sqrt((eta + 1j * k)[:, None] ** 2 - (1.0 - cosine**2))
    normal = np.abs((cosine - index) / (cosine + index)) ** 2
    square = (eta + 1j * k)[:, None] ** 2
    with np.errstate(invalid="ignore", divide="ignore"):
        parallel = np.abs((square * cosine - index) / (square * cosine + index)) ** 2
    parallel = np.where(np.isfinite(parallel), parallel, 1.0)
    return np.asarray((normal + parallel) @ (weight * cosine))
