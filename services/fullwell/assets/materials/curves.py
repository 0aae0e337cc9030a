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


def reflectance_spectrum(values: ArrayLike, source: str) -> Spectrum:
    """Return values at `WAVELENGTH_NM` as a reflectance, to five decimals, ends held."""
    rounded: Array = np.asarray(values, dtype=np.float64).round(5)
    return Spectrum(WAVELENGTH_NM, rounded, outside="hold", source=source)
