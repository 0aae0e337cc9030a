"""Reflectances from sRGB colours: a smooth curve in [0, 1] that has the colour under D65."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError
from fullwell.radiometry.illuminants import illuminant
from fullwell.radiometry.photometry import tristimulus
from fullwell.radiometry.spectrum import Spectrum
from fullwell.radiometry.tables import table_spectrum

__all__ = ["linear_to_srgb", "reflectance_from_linear_srgb", "reflectance_from_srgb", "srgb_to_linear"]

_SOURCE = "upsampled from sRGB with the basis of Mallett and Yuksel 2019"


def srgb_to_linear(encoded: ArrayLike) -> NDArray[np.float64]:
    """Return linear values of sRGB-encoded ones, both 0 to 1, same shape (IEC 61966-2-1:1999, section 5.2)."""
    value = np.asarray(encoded, dtype=np.float64)
    return np.asarray(np.where(value <= 0.04045, value / 12.92, ((np.maximum(value, 0.0) + 0.055) / 1.055) ** 2.4))


def linear_to_srgb(linear: ArrayLike) -> NDArray[np.float64]:
    """Return sRGB-encoded values of linear ones, both 0 to 1, same shape (IEC 61966-2-1:1999, section 5.2)."""
    value = np.asarray(linear, dtype=np.float64)
    return np.asarray(np.where(value <= 0.0031308, 12.92 * value, 1.055 * np.maximum(value, 0.0031308) ** (1 / 2.4) - 0.055))


def reflectance_from_srgb(rgb: Sequence[float], path: str = "") -> Spectrum:
    """Return a reflectance in [0, 1] with the colour `rgb`: three sRGB-encoded values from 0 to 1.

    See `reflectance_from_linear_srgb`. 8-bit colours must be divided by 255.
    """
    return _mixed(srgb_to_linear(_checked(rgb, path)))


def reflectance_from_linear_srgb(rgb: Sequence[float], path: str = "") -> Spectrum:
    """Return a reflectance in [0, 1] with the linear sRGB colour `rgb` under D65, 380-780 nm, ends held.

    The curve is made up (`upsampled` is True): the colour under D65 returns to 1e-5, other lights may see any metamer.
    Raises FieldError where `rgb` is not three finite values from 0 to 1.

    References
    ----------
    Mallett and Yuksel 2019, Spectral Primary Decomposition for Rendering with sRGB Reflectance, EGSR, eq. 1.
    """
    return _mixed(_checked(rgb, path))


def _checked(rgb: Sequence[float], path: str) -> NDArray[np.float64]:
    try:
        values = np.asarray(rgb, dtype=np.float64)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.shape != (3,) or not np.all(np.isfinite(values)) or np.any(values < 0) or np.any(values > 1):
        raise FieldError(
            f"the colour is {rgb!r}; must be three values (red, green, blue) from 0 to 1. Divide 8-bit values by 255.",
            path=path,
            value=rgb,
        )
    return values


def _mixed(linear: NDArray[np.float64]) -> Spectrum:
    basis = _basis()
    values = np.stack([curve.values for curve in basis], axis=1) @ (_weights_of_colours() @ linear)
    # The published basis adds up to 1 only to its fifth digit.
    return Spectrum(basis[0].wavelength_nm, np.clip(values, 0.0, 1.0), outside="hold", source=_SOURCE, upsampled=True)


def _basis() -> tuple[Spectrum, Spectrum, Spectrum]:
    red, green, blue = (table_spectrum("mallett2019", name, "hold", "1") for name in ("red", "green", "blue"))
    return red, green, blue


@cache
def _weights_of_colours() -> NDArray[np.float64]:
    """Return the (3, 3) matrix from linear sRGB to weights of the basis: the identity to 1e-3.

    The basis was made with sums over 5 nm; our colours are exact integrals, which differ by 1e-3 from such sums. Undoing
    that keeps the round trip at rounding instead of at 1e-3.
    """
    light = illuminant("D65")
    white = tristimulus(light)
    colours = np.stack([tristimulus(light.times(curve)) / white[1] for curve in _basis()], axis=1)
    return np.asarray(np.linalg.solve(colours, _xyz_of_linear_srgb(white / white[1])))


def _xyz_of_linear_srgb(white: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3, 3) matrix from linear sRGB to XYZ for its primaries (ITU-R BT.709) and a white of Y = 1."""
    x, y = np.array([[0.64, 0.30, 0.15], [0.33, 0.60, 0.06]])
    primaries = np.stack([x / y, np.ones(3), (1.0 - x - y) / y])
    return np.asarray(primaries * np.linalg.solve(primaries, white))
