"""Relative illumination: how a flat field falls off from the axis to the corner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError

__all__ = ["RelativeIllumination", "relative_illumination"]

EVEN_POWERS: Final = 5
"""Powers r^0, r^2 .. r^10 of the fitted falloff; cos^4 to 40 degrees off the axis is followed to 1e-3."""


@dataclass(frozen=True, slots=True, eq=False)
class RelativeIllumination:
    """A radial falloff, 1 on the axis.

    Attributes
    ----------
    radius_px, ratio, standard_error
        (rings,) mean radius [px], mean over the axis' value, and the standard error of that mean from the ring's own scatter
        (noise and what is not rotationally symmetric).
    corner_radius_px, corner_ratio
        Radius of the farthest corner pixel's centre [px] and the fitted falloff there.
    axis_value
        Fitted value on the axis, in the image's unit.
    """

    radius_px: NDArray[np.float64]
    ratio: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    corner_radius_px: float
    corner_ratio: float
    axis_value: float


def relative_illumination(
    flat_field: ArrayLike, *, axis_px: tuple[float, float] | None = None, ring_count: int = 20
) -> RelativeIllumination:
    """Return the radial falloff of a picture of a uniform scene.

    Parameters
    ----------
    flat_field
        (rows, cols) linear values above black, one channel; NaN marks pixels to leave out (another channel's, saturated ones).
    axis_px
        (x, y) of the optical axis [px], pixel centres at +0.5; the middle where None.
    ring_count
        Rings of equal width from the axis to the corner; empty ones are left out.

    Raises
    ------
    ShapeError
        Not two-dimensional, or fewer valid pixels than the fit needs.
    FieldError
        Inf, no light on the axis, or ring_count < 1.

    References
    ----------
    iso17957 for the method; smith2008 for the term.
    """
    values = np.asarray(flat_field, dtype=np.float64)
    if values.ndim != 2:
        raise ShapeError(f"flat_field has shape {values.shape}; must be (rows, cols).")
    if not ring_count >= 1:
        raise FieldError(f"ring_count is {ring_count}; must be at least 1.", path="ring_count", value=ring_count)
    valid = ~np.isnan(values)
    if not np.all(np.isfinite(values[valid])):
        raise FieldError("flat_field holds Inf; mark pixels to leave out as NaN.", path="flat_field")
    if np.count_nonzero(valid) <= EVEN_POWERS + 1:
        raise ShapeError(
            f"flat_field has {np.count_nonzero(valid)} valid pixels; the falloff needs more than {EVEN_POWERS + 1}."
        )
    x, y = axis_px if axis_px is not None else (values.shape[1] / 2, values.shape[0] / 2)
    rows, cols = np.mgrid[: values.shape[0], : values.shape[1]]
    radius = np.hypot(cols + 0.5 - x, rows + 0.5 - y)
    corner = float(radius.max())
    coefficients = _even_fit(radius[valid] / corner, values[valid])
    axis_value = float(coefficients[0])
    if not axis_value > 0:
        raise FieldError(f"the light on the axis is {axis_value:.3g}; must be > 0.", path="flat_field", value=axis_value)
    mean_radius, mean, error = _rings(radius[valid], values[valid], corner, ring_count)
    return RelativeIllumination(
        radius_px=mean_radius,
        ratio=mean / axis_value,
        standard_error=error / axis_value,
        corner_radius_px=corner,
        corner_ratio=float(np.sum(coefficients)) / axis_value,
        axis_value=axis_value,
    )


def _even_fit(share: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the coefficients of 1, r^2 .. r^10 by least squares; r is 1 in the corner."""
    design = np.stack([share ** (2 * power) for power in range(EVEN_POWERS + 1)], axis=1)
    return np.asarray(np.linalg.lstsq(design, values, rcond=None)[0])


def _rings(
    radius: NDArray[np.float64], values: NDArray[np.float64], corner: float, count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    index = np.minimum((radius / max(corner, np.finfo(np.float64).tiny) * count).astype(np.int64), count - 1)
    number = np.bincount(index, minlength=count)
    used = number > 0
    pixels = number[used]
    mean = np.bincount(index, values, count)[used] / pixels
    square = np.bincount(index, values**2, count)[used] / pixels
    scatter = np.sqrt(np.maximum(square - mean**2, 0.0) / pixels)
    return np.bincount(index, radius, count)[used] / pixels, mean, scatter
