"""Colour difference: CIELAB and the three formulas of the CIE."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError

__all__ = ["delta_e_1976", "delta_e_1994", "delta_e_2000", "xyz_to_lab"]

_LINEAR_BELOW: Final = (6.0 / 29.0) ** 3
_LINEAR_SLOPE: Final = (29.0 / 6.0) ** 2 / 3.0
_LINEAR_OFFSET: Final = 4.0 / 29.0
"""CIELAB's cube root and the line that continues it without a step (cie15, 8.2.1.1: exact fractions)."""

_CHROMA_25_POW_7: Final = 25.0**7


def xyz_to_lab(xyz: ArrayLike, white_xyz: ArrayLike) -> NDArray[np.float64]:
    """Return CIELAB L*, a*, b*, (..., 3), of tristimulus values in the same unit as the white's.

    Parameters
    ----------
    xyz
        (..., 3). Values a little below 0, as filtering leaves them, continue on the linear part.
    white_xyz
        (3,), each > 0.

    Raises
    ------
    ShapeError
        The last axis does not have 3 entries.
    FieldError
        NaN or Inf in `xyz`, or a white that is not > 0 and finite.

    References
    ----------
    cie15, section 8.2.1.1.
    """
    values, white = _triples(xyz, "xyz"), _triples(white_xyz, "white_xyz")
    if white.shape != (3,) or not np.all(white > 0):
        raise FieldError(
            f"white_xyz is {white.tolist()}; must be three values > 0.", path="white_xyz", value=str(white.tolist())
        )
    ratio = values / white
    root = np.where(ratio > _LINEAR_BELOW, np.cbrt(ratio), _LINEAR_SLOPE * ratio + _LINEAR_OFFSET)
    x, y, z = np.moveaxis(root, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def delta_e_1976(lab: ArrayLike, other_lab: ArrayLike) -> NDArray[np.float64]:
    """Return the Euclidean distance in CIELAB, (...), of colours (..., 3) that broadcast together (cie15, 8.2.1.3).

    Raises ShapeError and FieldError as `delta_e_2000` does.
    """
    first, second = _pair(lab, other_lab)
    return np.asarray(np.linalg.norm(first - second, axis=-1))


def delta_e_1994(reference_lab: ArrayLike, sample_lab: ArrayLike) -> NDArray[np.float64]:
    """Return the CIE 1994 difference, (...), for graphic arts (all k = 1); it is not symmetric: the first is the standard.

    Raises ShapeError and FieldError as `delta_e_2000` does.

    References
    ----------
    cie116, eqs. 1 to 4.
    """
    reference, sample = _pair(reference_lab, sample_lab)
    chroma = np.hypot(reference[..., 1], reference[..., 2])
    lightness = reference[..., 0] - sample[..., 0]
    chroma_difference = chroma - np.hypot(sample[..., 1], sample[..., 2])
    opponent = np.sum((reference[..., 1:] - sample[..., 1:]) ** 2, axis=-1)
    # Rounding may leave the squared hue difference of equal hues just below 0.
    hue_squared = np.maximum(opponent - chroma_difference**2, 0.0)
    weighted = (chroma_difference / (1.0 + 0.045 * chroma)) ** 2 + hue_squared / (1.0 + 0.015 * chroma) ** 2
    return np.asarray(np.sqrt(lightness**2 + weighted))


def delta_e_2000(lab: ArrayLike, other_lab: ArrayLike) -> NDArray[np.float64]:
    """Return the CIEDE2000 difference, (...), with all k = 1, of colours (..., 3) that broadcast together.

    Raises
    ------
    ShapeError
        The last axis does not have 3 entries, or the shapes do not broadcast.
    FieldError
        NaN or Inf.

    References
    ----------
    cie142; sharma2005, eqs. 2 to 22, whose choices for hues half a turn apart are taken.
    """
    first, second = _pair(lab, other_lab)
    chroma_mean = 0.5 * (np.hypot(first[..., 1], first[..., 2]) + np.hypot(second[..., 1], second[..., 2]))
    stretch = 1.5 - 0.5 * np.sqrt(chroma_mean**7 / (chroma_mean**7 + _CHROMA_25_POW_7))
    a_one, a_two = first[..., 1] * stretch, second[..., 1] * stretch
    c_one, c_two = np.hypot(a_one, first[..., 2]), np.hypot(a_two, second[..., 2])
    h_one, h_two = _hue_deg(a_one, first[..., 2]), _hue_deg(a_two, second[..., 2])
    hue_step, hue_mean = _hue_step_and_mean(h_one, h_two, neutral=(c_one * c_two == 0))

    lightness = second[..., 0] - first[..., 0]
    chroma = c_two - c_one
    hue = 2.0 * np.sqrt(c_one * c_two) * np.sin(np.radians(0.5 * hue_step))
    l_mean, c_mean = 0.5 * (first[..., 0] + second[..., 0]), 0.5 * (c_one + c_two)
    weight_l = 1.0 + 0.015 * (l_mean - 50.0) ** 2 / np.sqrt(20.0 + (l_mean - 50.0) ** 2)
    weight_c = 1.0 + 0.045 * c_mean
    weight_h = 1.0 + 0.015 * c_mean * _hue_weight(hue_mean)
    rotation = -np.sin(np.radians(60.0 * np.exp(-(((hue_mean - 275.0) / 25.0) ** 2))))
    rotation = rotation * 2.0 * np.sqrt(c_mean**7 / (c_mean**7 + _CHROMA_25_POW_7))
    terms = (lightness / weight_l) ** 2 + (chroma / weight_c) ** 2 + (hue / weight_h) ** 2
    squared = terms + rotation * (chroma / weight_c) * (hue / weight_h)
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)))


def _hue_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.degrees(np.arctan2(b, a)) % 360.0)


def _hue_step_and_mean(
    one: NDArray[np.float64], two: NDArray[np.float64], *, neutral: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the difference within +-180 and the mean hue [deg]; without chroma the step is 0 and the mean the sum."""
    step, total = two - one, one + two
    far = np.abs(step) > 180.0
    wrapped = np.where(far, step - np.sign(step) * 360.0, step)
    mean = np.where(far, np.where(total < 360.0, 0.5 * (total + 360.0), 0.5 * (total - 360.0)), 0.5 * total)
    return np.where(neutral, 0.0, wrapped), np.where(neutral, total, mean)


def _hue_weight(hue_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return T of CIEDE2000 (sharma2005, eq. 15)."""
    turns = ((-0.17, 1.0, -30.0), (0.24, 2.0, 0.0), (0.32, 3.0, 6.0), (-0.20, 4.0, -63.0))
    return np.asarray(1.0 + sum(height * np.cos(np.radians(times * hue_deg + phase)) for height, times, phase in turns))


def _pair(lab: ArrayLike, other_lab: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    first, second = _triples(lab, "lab"), _triples(other_lab, "other_lab")
    try:
        one, two = np.broadcast_arrays(first, second)
    except ValueError:
        raise ShapeError(f"the colours have shapes {first.shape} and {second.shape}, which do not broadcast.") from None
    return one, two


def _triples(values: ArrayLike, name: str) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ShapeError(f"{name} has shape {array.shape}; must be (..., 3).")
    if not np.all(np.isfinite(array)):
        raise FieldError(f"{name} holds NaN or Inf; every value must be finite.", path=name)
    return array
