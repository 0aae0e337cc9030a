"""ISETCam's demosaicing of 2 x 2 Bayer mosaics: bilinear, nearest, Laplacian and adaptive Laplacian.

Found from its numbers (ip_demosaic.json): borders are continued by blocks of four rows and columns; the Laplacian methods work
in GRBG order, so that pictures of other orders come out shifted by a row or column, and treat blue more simply than red.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError, unknown_name_message
from fullwell.isp.demosaic import demosaic_bilinear

__all__ = ["BayerPattern", "DemosaicMethod", "demosaic"]

DemosaicMethod: TypeAlias = Literal["bilinear", "nearest", "laplacian", "adaptive_laplacian"]
BayerPattern: TypeAlias = tuple[tuple[int, int], tuple[int, int]]

_SHIFTS: Final[dict[BayerPattern, tuple[int, int]]] = {
    ((1, 0), (2, 1)): (0, 0),
    ((0, 1), (1, 2)): (0, 1),
    ((2, 1), (1, 0)): (1, 0),
    ((1, 2), (0, 1)): (1, 1),
}
"""Rows and columns by which each order lies off GRBG; 0, 1, 2 are red, green, blue."""

_BLOCK: Final = 4

Plane: TypeAlias = NDArray[np.float64]


def demosaic(mosaic: ArrayLike, pattern: BayerPattern, *, method: DemosaicMethod = "bilinear") -> Plane:
    """Return red, green and blue at every pixel, (rows, cols, 3), in the mosaic's unit.

    Parameters
    ----------
    mosaic
        (rows, cols), at least 2 x 2; at least 5 x 5 for the Laplacian methods.
    pattern
        A Bayer order of 0 red, 1 green, 2 blue.

    Raises
    ------
    FieldError
        Another pattern, unknown method, or "adaptive_laplacian" in GBRG order, where ISETCam stops with an error.
    ShapeError
        The mosaic is too small.
    """
    values = np.asarray(mosaic, dtype=np.float64)
    if method not in get_args(DemosaicMethod):
        message = unknown_name_message("demosaic method", method, get_args(DemosaicMethod))
        raise FieldError(message, path="demosaic", value=method)
    if pattern not in _SHIFTS:
        raise FieldError(f"pattern is {pattern}; model isetcam demosaics 2 x 2 Bayer orders only.", path="pattern")
    least = 5 if method in ("laplacian", "adaptive_laplacian") else 2
    if values.ndim != 2 or min(values.shape) < least:
        raise ShapeError(f"mosaic has shape {values.shape}; must be (rows, cols), at least {least} x {least}.")
    if method == "bilinear":
        names = tuple(tuple("RGB"[index] for index in row) for row in pattern)
        return demosaic_bilinear(values, names, ("R", "G", "B"))
    return _nearest(values, pattern) if method == "nearest" else _laplacian(values, pattern, adaptive=method != "laplacian")


def _nearest(mosaic: Plane, pattern: BayerPattern) -> Plane:
    """Return each 2 x 2 block's own red and blue, and each row's own green; odd sizes are continued by their mirror image."""
    rows, cols = mosaic.shape
    even = np.pad(mosaic, ((0, rows % 2), (0, cols % 2)), mode="reflect")
    rgb = np.empty((*even.shape, 3))
    for r in range(2):
        for c in range(2):
            own = even[r::2, c::2]
            index = pattern[r][c]
            if index == 1:
                rgb[r::2, :, 1] = np.repeat(own, 2, axis=1)
            else:
                rgb[:, :, index] = np.repeat(np.repeat(own, 2, axis=0), 2, axis=1)
    return rgb[:rows, :cols]


@dataclass(frozen=True, slots=True)
class _Neighbours:
    """A plane's neighbours of each sample, the plane continued by blocks."""

    extended: Plane

    def at(self, down: int, right: int) -> Plane:
        rows, cols = self.extended.shape
        top, left = _BLOCK + down, _BLOCK + right
        return self.extended[top : rows - _BLOCK + down or rows, left : cols - _BLOCK + right or cols]


def _continued(plane: Plane) -> _Neighbours:
    """Return the plane with its first four rows before and its last four after it, not mirrored; columns alike."""
    tall = np.concatenate([plane[:_BLOCK], plane, plane[-_BLOCK:]], axis=0)
    return _Neighbours(np.concatenate([tall[:, :_BLOCK], tall, tall[:, -_BLOCK:]], axis=1))


def _laplacian(mosaic: Plane, pattern: BayerPattern, *, adaptive: bool) -> Plane:
    down, right = _SHIFTS[pattern]
    if adaptive and (down, right) == (1, 1):
        raise FieldError(
            "adaptive_laplacian of a GBRG mosaic stops ISETCam with an error; choose another method.", path="demosaic"
        )
    # Shifted to GRBG. The row or column lost is continued by the mirror image, or by zeros where both are.
    mode: Literal["constant", "reflect"] = "constant" if (down, right) == (1, 1) else "reflect"
    raw = np.pad(mosaic[down:, right:], ((0, down), (0, right)), mode=mode)
    near = _continued(raw)
    row, col = np.arange(raw.shape[0])[:, None] % 2, np.arange(raw.shape[1])[None, :] % 2
    red, blue = (row == 0) & (col == 1), (row == 1) & (col == 0)
    green = np.where(red, _green_at_red(near, adaptive=adaptive), raw)
    green = np.where(blue, _green_at_blue(near, adaptive=adaptive), green)
    greens = _continued(green)
    across = _directional(near, greens, (0, 1))
    along = _directional(near, greens, (1, 0))
    diagonal = _diagonal(near, greens, adaptive=adaptive)
    even_green, odd_green = (row == 0) & (col == 0), (row == 1) & (col == 1)
    planes = [
        np.select([red, even_green, odd_green], [raw, across, along], diagonal),
        green,
        np.select([blue, odd_green, even_green], [raw, across, along], diagonal),
    ]
    return np.stack(planes, axis=2)


def _pair(near: _Neighbours, step: tuple[int, int], reach: int = 1) -> tuple[Plane, Plane]:
    down, right = step
    return near.at(-reach * down, -reach * right), near.at(reach * down, reach * right)


def _curvature(near: _Neighbours, step: tuple[int, int], reach: int) -> Plane:
    before, after = _pair(near, step, reach)
    return 2.0 * near.at(0, 0) - before - after


def _mean(near: _Neighbours, step: tuple[int, int]) -> Plane:
    before, after = _pair(near, step)
    return (before + after) / 2.0


def _difference(near: _Neighbours, step: tuple[int, int]) -> Plane:
    before, after = _pair(near, step)
    return np.abs(before - after)


def _smoother(first: Plane, first_cost: Plane, second: Plane, second_cost: Plane) -> Plane:
    """Return the estimate of lower cost, the mean of both where they cost the same."""
    equal = (first + second) / 2.0
    return np.where(first_cost < second_cost, first, np.where(first_cost > second_cost, second, equal))


def _green_at_red(near: _Neighbours, *, adaptive: bool) -> Plane:
    bends = [_curvature(near, step, 2) for step in ((0, 1), (1, 0))]
    across, along = (_mean(near, step) + bend / 4.0 for step, bend in zip(((0, 1), (1, 0)), bends, strict=True))
    if not adaptive:
        return (across + along) / 2.0
    costs = [np.abs(bend) + _difference(near, step) for step, bend in zip(((0, 1), (1, 0)), bends, strict=True)]
    return _smoother(across, costs[0], along, costs[1])


def _green_at_blue(near: _Neighbours, *, adaptive: bool) -> Plane:
    """Return plain means: there is no second derivative at blue, in contrast to red."""
    across, along = _mean(near, (0, 1)), _mean(near, (1, 0))
    if not adaptive:
        return (across + along) / 2.0
    return _smoother(across, _difference(near, (0, 1)), along, _difference(near, (1, 0)))


def _directional(near: _Neighbours, greens: _Neighbours, step: tuple[int, int]) -> Plane:
    return _mean(near, step) + _curvature(greens, step, 1) / 4.0


def _diagonal(near: _Neighbours, greens: _Neighbours, *, adaptive: bool) -> Plane:
    falling, rising = (1, 1), (1, -1)
    first, second = _directional(near, greens, falling), _directional(near, greens, rising)
    if not adaptive:
        return (first + second) / 2.0
    costs = [np.abs(_curvature(greens, step, 1)) + _difference(near, step) for step in (falling, rising)]
    return _smoother(first, costs[0], second, costs[1])
