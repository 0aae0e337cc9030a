"""Demosaicing: every channel at every pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from fullwell.core.errors import FieldError
from fullwell.isp.parameters import Demosaic

__all__ = ["check_demosaic", "demosaic", "demosaic_bilinear", "demosaic_malvar2004", "demosaic_menon2007"]

_SMALLEST_SIDE_PX = 2
"""The library's filters mirror the picture at its border, which a single row or column does not have."""


def demosaic(
    mosaic: NDArray[np.float64],
    pattern: tuple[tuple[str, ...], ...],
    channel_names: tuple[str, ...],
    *,
    method: Demosaic = "bilinear",
) -> NDArray[np.float64]:
    """Return every channel at every pixel by one of the methods, (rows, cols, channels), in the mosaic's unit.

    The arguments are those of `demosaic_bilinear`. Raises FieldError as `check_demosaic`.
    """
    methods = {"bilinear": demosaic_bilinear, "malvar2004": demosaic_malvar2004, "menon2007": demosaic_menon2007}
    return methods[method](mosaic, pattern, channel_names)


def check_demosaic(method: Demosaic, pattern: tuple[tuple[str, ...], ...]) -> None:
    """Refuse a method that the pattern does not suit.

    Bilinear suits any. The others need 2 x 2 pixels with one channel on a diagonal and two more on the other: the four
    Bayer orders, and patterns of that form in other colours such as RYYCy and RCCB.

    Raises
    ------
    FieldError
        The pattern is another one.
    """
    if method != "bilinear" and _bayer_roles(pattern) is None:
        raise FieldError(
            f"demosaic is {method!r}, but the filter pattern is {' / '.join(' '.join(row) for row in pattern)}; {method} needs "
            "2 x 2 pixels with one channel on a diagonal and two others beside it. Set demosaic: bilinear.",
            path="demosaic",
            value=method,
        )


def demosaic_bilinear(
    mosaic: NDArray[np.float64], pattern: tuple[tuple[str, ...], ...], channel_names: tuple[str, ...]
) -> NDArray[np.float64]:
    """Return every channel at every pixel, (rows, cols, channels), in the mosaic's unit.

    Measured values stay as they are; the others are means of the channel's pixels nearby, weighted by a tent one period of
    the pattern wide on each side. For a 2 x 2 Bayer pattern in any order this is bilinear interpolation. Beyond its border
    the mosaic is continued as a mirror image without repeating the border itself, which keeps a Bayer pattern's order.

    Parameters
    ----------
    mosaic
        (rows, cols).
    pattern
        Rows of channel names, any N x M; the top left one belongs to the top left pixel.
    channel_names
        The channels wanted, in order. One that no pixel has comes out as 0.

    References
    ----------
    Normalised convolution: knutsson1993.
    """
    rows, cols = mosaic.shape
    if len(pattern) == 1 and len(pattern[0]) == 1:
        return np.stack([mosaic if name == pattern[0][0] else np.zeros_like(mosaic) for name in channel_names], axis=2)
    names = np.array(pattern)
    at_pixel = names[np.arange(rows)[:, None] % names.shape[0], np.arange(cols)[None, :] % names.shape[1]]
    result = np.empty((rows, cols, len(channel_names)))
    for k, name in enumerate(channel_names):
        measured = at_pixel == name
        gathered = _tent(np.where(measured, mosaic, 0.0), names.shape)
        weight = _tent(measured.astype(np.float64), names.shape)
        interpolated = np.divide(gathered, weight, out=np.zeros_like(gathered), where=weight > 0)
        result[:, :, k] = np.where(measured, mosaic, interpolated)
    return result


def demosaic_malvar2004(
    mosaic: NDArray[np.float64], pattern: tuple[tuple[str, ...], ...], channel_names: tuple[str, ...]
) -> NDArray[np.float64]:
    """Return every channel at every pixel: bilinear, corrected by the curvature of the channel measured there.

    Five by five linear filters. They take edges to be equally steep in all channels, so balance the mosaic before. Arguments
    and result as `demosaic_bilinear`; values may overshoot. Raises FieldError as `check_demosaic`.

    References
    ----------
    malvar2004, by way of the library colour-demosaicing.
    """
    return _by_library("malvar2004", mosaic, pattern, channel_names)


def demosaic_menon2007(
    mosaic: NDArray[np.float64], pattern: tuple[tuple[str, ...], ...], channel_names: tuple[str, ...]
) -> NDArray[np.float64]:
    """Return every channel at every pixel: interpolated along edges instead of across, then refined.

    Takes colour differences to vary slowly, so balance the mosaic before. Arguments and result as `demosaic_bilinear`; values
    may overshoot. Raises FieldError as `check_demosaic`.

    References
    ----------
    menon2007, by way of the library colour-demosaicing.
    """
    return _by_library("menon2007", mosaic, pattern, channel_names)


def _by_library(
    method: Demosaic, mosaic: NDArray[np.float64], pattern: tuple[tuple[str, ...], ...], channel_names: tuple[str, ...]
) -> NDArray[np.float64]:
    check_demosaic(method, pattern)
    if min(mosaic.shape) < _SMALLEST_SIDE_PX:
        return demosaic_bilinear(mosaic, pattern, channel_names)
    import colour_demosaicing  # noqa: PLC0415 - takes a second to import

    functions = {
        "malvar2004": colour_demosaicing.demosaicing_CFA_Bayer_Malvar2004,
        "menon2007": colour_demosaicing.demosaicing_CFA_Bayer_Menon2007,
    }
    roles = _bayer_roles(pattern) or {}
    order = "".join(roles[name] for row in pattern for name in row)
    planes = functions[method](mosaic, order)
    result = np.zeros((*mosaic.shape, len(channel_names)))
    for k, name in enumerate(channel_names):
        if name in roles:
            result[:, :, k] = planes[:, :, "RGB".index(roles[name])]
    return result


def _bayer_roles(pattern: tuple[tuple[str, ...], ...]) -> dict[str, str] | None:
    """Return which channel plays R, G and B of a Bayer pattern, or None where the pattern has another form."""
    if len(pattern) != 2 or len(pattern[0]) != 2:
        return None
    (a, b), (c, d) = pattern
    for (one, other), (first, second) in (((a, d), (b, c)), ((b, c), (a, d))):
        if one == other and len({one, first, second}) == 3:
            return {first: "R", one: "G", second: "B"}
    return None


def _tent(values: NDArray[np.float64], periods: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the values convolved with the tent of each axis' period: 1 2 1 for a period of 2."""
    for axis, period in enumerate(periods):
        if period > 1:
            kernel = period - np.abs(np.arange(-(period - 1), period), dtype=np.float64)
            values = convolve1d(values, kernel, axis=axis, mode="mirror")
    return values
