"""Which pixels need a closer look than their centre, and where within them the further rays go."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError

__all__ = ["edge_pixels", "film_positions", "following_pixels", "sample_offsets"]


def sample_offsets(count: int) -> NDArray[np.float64]:
    """Return (count, 2) offsets (x, y) from the pixel's centre [px] of `count` further rays, `count` even and >= 2.

    With the centre they are a rank-1 lattice of count + 1 points over the pixel: (i / n, a i / n), wrapped to [-1/2, 1/2),
    with the `a` that keeps the points farthest apart. All n positions along x, and along y, are different and equally far
    apart: an upright edge is seen to 1/n of a pixel. For 16 rays, n = 17 = 4^2 + 1 and a = 4: a turned square grid.
    """
    if count < 2 or count % 2:  # an odd number would not leave the centre in the middle
        raise FieldError(f"subsamples is {count}; must be even and >= 2. 16 is the default.", path="subsamples", value=count)
    n = count + 1
    number = np.arange(1, n)
    best, best_gap = number[:0], -1
    for factor in range(1, n // 2 + 1):
        if np.gcd(factor, n) != 1:
            continue
        other = factor * number % n
        gap = int(np.min(np.minimum(number, n - number) ** 2 + np.minimum(other, n - other) ** 2))
        if gap > best_gap:
            best, best_gap = other, gap
    wrapped = np.stack([number, best], axis=1)
    return np.asarray(np.where(wrapped > n // 2, wrapped - n, wrapped) / n)


def edge_pixels(ids: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return (rows, cols) whether any of a pixel's eight neighbours shows another object than the pixel does."""
    edge = np.zeros(ids.shape, dtype=bool)
    for here, there in (
        (np.s_[:, 1:], np.s_[:, :-1]),
        (np.s_[1:], np.s_[:-1]),
        (np.s_[1:, 1:], np.s_[:-1, :-1]),
        (np.s_[1:, :-1], np.s_[:-1, 1:]),
    ):
        differs = ids[here] != ids[there]
        edge[here] |= differs
        edge[there] |= differs
    return edge


def following_pixels(
    pixels: NDArray[np.int64],
    foreign: NDArray[np.bool_],
    offsets: NDArray[np.float64],
    shape: tuple[int, int],
    *,
    steps: int,
) -> NDArray[np.int64]:
    """Return the pixels to which what the further rays have met may go on, `steps` along each way out, some repeatedly.

    A thin thing passes between the centres of many pixels in a row. Where a further ray meets another object than the
    pixel's centre (`foreign`, (pixels, rays)), in the half of the pixel towards a neighbour, that neighbour is named.
    """
    rows, cols = shape
    row, col = np.divmod(pixels, cols)
    named = []
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            if not (down or right):
                continue
            towards = (offsets[:, 0] * right >= 0) & (offsets[:, 1] * down >= 0)
            out = foreign[:, towards].any(axis=1)
            for step in range(1, steps + 1):
                y, x = row[out] + step * down, col[out] + step * right
                inside = (y >= 0) & (y < rows) & (x >= 0) & (x < cols)
                named.append(y[inside] * cols + x[inside])
    return np.concatenate(named)


def film_positions(
    pixels: NDArray[np.int64], offsets: NDArray[np.float64], cols: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return film positions x and y [px], (pixels * offsets,) each, at `offsets` (n, 2) from the centres of pixels."""
    row, col = np.divmod(pixels, cols)
    x, y = col[:, None] + (0.5 + offsets[:, 0]), row[:, None] + (0.5 + offsets[:, 1])
    return x.ravel().astype(np.float32), y.ravel().astype(np.float32)
