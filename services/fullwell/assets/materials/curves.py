"""Curves that spectra of the catalogue are made from: smooth ones through knots, edges, bands, and pigmented layers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from fullwell.radiometry.spectrum import Spectrum

__all__ = [
    "DOMAIN_NM",
    "WAVELENGTH_NM",
    "band",
    "edge",
    "layer_over",
    "layer_reflectance",
    "reflectance_spectrum",
    "through_knots",
]

Array = NDArray[np.float64]

DOMAIN_NM: Final = (380.0, 1000.0)
"""What every spectrum of the catalogue covers."""

WAVELENGTH_NM: Final[Array] = np.arange(380.0, 1000.1, 5.0)
"""Where spectra are tabulated: a red edge or a dye's flank takes some 40 nm."""
WAVELENGTH_NM.setflags(write=False)


def through_knots(points: Sequence[tuple[float, float]]) -> Array:
    """Return values at `WAVELENGTH_NM` of a monotone cubic through (wavelength [nm], value) points, ends held.

    Between two knots the curve stays between their values (Fritsch and Carlson 1980), so a reflectance stays in [0, 1].
    """
    wavelength_nm, values = np.array(points, dtype=np.float64).T
    curve = PchipInterpolator(wavelength_nm, values)
    return np.asarray(curve(np.clip(WAVELENGTH_NM, wavelength_nm[0], wavelength_nm[-1])))


def band(centre_nm: float, width_nm: float, height: float = 1.0) -> Array:
    """Return a Gaussian absorption band of standard deviation `width_nm` at `WAVELENGTH_NM`."""
    return np.asarray(height * np.exp(-0.5 * ((WAVELENGTH_NM - centre_nm) / width_nm) ** 2))


def edge(centre_nm: float, width_nm: float, height: float = 1.0) -> Array:
    """Return an absorption edge: `height` far below `centre_nm`, 0 far above, exponential tails of `width_nm`."""
    return np.asarray(height / (1.0 + np.exp((WAVELENGTH_NM - centre_nm) / width_nm)))


def layer_reflectance(absorption: ArrayLike, scattering: ArrayLike) -> Array:
    """Return the reflectance of an opaque layer from its absorption and scattering, same unit and shape.

    1 + K/S - sqrt((K/S)^2 + 2 K/S) (Kubelka and Munk 1931, for infinite thickness), without reflection at its surface.
    """
    ratio = np.asarray(absorption, dtype=np.float64) / np.asarray(scattering, dtype=np.float64)
    # The reciprocal form keeps its digits for dark layers, where 1 + K/S and the root nearly cancel.
    return np.asarray(1.0 / (1.0 + ratio + np.sqrt(ratio * (ratio + 2.0))))


def layer_over(base: ArrayLike, absorption_per_cm: ArrayLike, scattering_per_cm: ArrayLike, *, thickness_cm: float) -> Array:
    """Return the reflectance of a layer of finite thickness over a base of known reflectance (Kubelka 1948, eqs. 20 and 27).

    Absorption and scattering are K and S of Kubelka and Munk, twice and 3/4 times those of transport theory; all of one shape.
    """
    below = np.asarray(base, dtype=np.float64)
    scattering = np.asarray(scattering_per_cm, dtype=np.float64)
    a = 1.0 + np.asarray(absorption_per_cm, dtype=np.float64) / scattering
    b = np.sqrt(a**2 - 1.0)
    # Divided by cosh, so that thick, dark layers do not overflow.
    depth = b * scattering * thickness_cm
    divisor = a * np.tanh(depth) + b
    back, through = np.tanh(depth) / divisor, b / (divisor * np.cosh(np.minimum(depth, 300.0)))
    return np.asarray(back + through**2 * below / (1.0 - back * below))


def reflectance_spectrum(values: ArrayLike, source: str) -> Spectrum:
    """Return values at `WAVELENGTH_NM` as a reflectance, to five decimals, ends held."""
    rounded: Array = np.asarray(values, dtype=np.float64).round(5)
    return Spectrum(WAVELENGTH_NM, rounded, outside="hold", source=source)
