"""Charts in a picture: the mean of each patch between four corners."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError

__all__ = ["patch_means"]

PATCH_SHARE: Final = 0.5
"""Middle share of each patch's sides that is averaged: borders between patches, and blur, stay out."""

SAMPLES_PER_SIDE: Final = 9
"""A patch is sampled at so many places along each side, bilinearly."""


def patch_means(image: ArrayLike, corners_px: ArrayLike, *, rows: int, cols: int) -> NDArray[np.float64]:
    """Return the mean of each patch of a chart, (rows * cols, channels), row by row from the first corner.

    Parameters
    ----------
    image
        (height, width, channels), linear.
    corners_px
        (4, 2) x, y of the chart's outer corners: top left, top right, bottom right, bottom left as the chart is named, however
        it lies in the picture. Pixel centres at +0.5.
    rows, cols
        Patches of the chart, all of equal size and without gaps; the middle half of each is averaged.

    Raises
    ------
    ShapeError
        Not an image with channels, or not four corners.
    FieldError
        A corner outside the image, corners that do not go round a convex chart, or patches smaller than 4 pixels.
    """
    picture, corners = np.asarray(image, dtype=np.float64), np.asarray(corners_px, dtype=np.float64)
    if picture.ndim != 3:
        raise ShapeError(f"image has shape {picture.shape}; must be (height, width, channels).")
    if corners.shape != (4, 2):
        raise ShapeError(f"corners_px has shape {corners.shape}; must be (4, 2).")
    _check_corners(corners, picture.shape[0], picture.shape[1], rows, cols)
    places = (np.arange(SAMPLES_PER_SIDE) + 0.5) / SAMPLES_PER_SIDE * PATCH_SHARE + 0.5 * (1.0 - PATCH_SHARE)
    u = (np.arange(cols)[:, None] + places).ravel() / cols
    v = (np.arange(rows)[:, None] + places).ravel() / rows
    samples = _bilinear(picture, *_project(corners, *np.meshgrid(u, v)))
    blocks = samples.reshape(rows, SAMPLES_PER_SIDE, cols, SAMPLES_PER_SIDE, -1)
    return np.asarray(blocks.mean(axis=(1, 3)).reshape(rows * cols, -1))


def _check_corners(corners: NDArray[np.float64], height: int, width: int, rows: int, cols: int) -> None:
    inside = (corners >= 0) & (corners <= (width, height))
    if not np.all(inside):
        outside = corners[~inside.all(axis=1)][0].tolist()
        raise FieldError(
            f"the corner {outside} is outside the picture of {width} x {height} pixels.", path="corners", value=str(outside)
        )
    sides = np.roll(corners, -1, axis=0) - corners
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    if not (np.all(turns > 0) or np.all(turns < 0)):
        raise FieldError(
            f"the corners {corners.tolist()} do not go round a chart; give top left, top right, bottom right, bottom left.",
            path="corners",
            value=str(corners.tolist()),
        )
    lengths = np.linalg.norm(sides, axis=1)
    smallest = min(lengths[[0, 2]].min() / cols, lengths[[1, 3]].min() / rows)
    if smallest < 4.0:
        raise FieldError(
            f"a patch is only {smallest:.1f} pixels wide; must be at least 4. Render the chart larger.",
            path="corners",
            value=float(smallest),
        )


def _project(
    corners: NDArray[np.float64], u: NDArray[np.float64], v: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return picture coordinates of chart coordinates in [0, 1]^2: the perspective map that takes corners to corners."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    equations, wanted = [], []
    for (s, t), (x, y) in zip(square, corners, strict=True):
        equations += [[s, t, 1, 0, 0, 0, -s * x, -t * x], [0, 0, 0, s, t, 1, -s * y, -t * y]]
        wanted += [x, y]
    a, b, c, d, e, f, g, h = np.linalg.solve(np.array(equations), np.array(wanted))
    depth = g * u + h * v + 1.0
    return (a * u + b * v + c) / depth, (d * u + e * v + f) / depth


def _bilinear(picture: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    height, width = picture.shape[:2]
    across, down = np.clip(x - 0.5, 0, width - 1), np.clip(y - 0.5, 0, height - 1)
    left, top = np.minimum(across.astype(np.int64), width - 2), np.minimum(down.astype(np.int64), height - 2)
    right_share, down_share = (across - left)[..., None], (down - top)[..., None]
    upper = picture[top, left] * (1 - right_share) + picture[top, left + 1] * right_share
    lower = picture[top + 1, left] * (1 - right_share) + picture[top + 1, left + 1] * right_share
    return np.asarray(upper * (1 - down_share) + lower * down_share)
