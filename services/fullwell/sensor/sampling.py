"""Spatial sampling: the mean irradiance over each pixel's photodetector, by exact integration of the image's cells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.scene.images import OpticalImage
from fullwell.sensor.quantum_efficiency import ChannelCurrents

__all__ = ["COVERAGE_TOLERANCE", "PixelSampling", "axis_weights", "pixel_sampling"]

COVERAGE_TOLERANCE: Final = 1e-6
"""Share of the image's width by which a photodetector may reach over its edge: pitches are rounded differently."""


@dataclass(frozen=True, slots=True, eq=False)
class PixelSampling:
    """How pixels see the samples of an optical image.

    Attributes
    ----------
    row_weights, col_weights
        Sparse (pixels, samples), rows of sum 1: the share of the photodetector's extent that lies on each sample.
    """

    row_weights: scipy.sparse.csr_array
    col_weights: scipy.sparse.csr_array

    def mean_over_photodetectors(
        self, image: NDArray[np.float64], *, first_row: int = 0, row_step: int = 1, first_col: int = 0, col_step: int = 1
    ) -> NDArray[np.float64]:
        """Return the image's mean over the photodetectors of every `step`-th pixel, in the image's unit.

        `image` is (rows, cols) of samples; the result has one value for each selected pixel.
        """
        down, across = self.row_weights[first_row::row_step], self.col_weights[first_col::col_step]
        rows, cols = _selection(down), _selection(across)
        if rows is not None and cols is not None:
            return np.asarray(image[rows, cols])
        # The axis that throws away most comes first.
        return np.asarray((across @ (down @ image).T).T)


def axis_weights(
    *,
    pixels: int,
    pixel_pitch_m: float,
    aperture_m: float,
    samples: int,
    sample_pitch_m: float,
    axis: str,
    offset_m: float = 0.0,
) -> scipy.sparse.csr_array:
    """Return the weights of one axis: sparse (pixels, samples), every row of sum 1.

    Pixels and samples are both centred on the optical axis. Row i holds the lengths of the overlaps of the interval of
    `aperture_m` whose centre lies `offset_m` after that of pixel i with the samples' cells, divided by `aperture_m`.

    Raises
    ------
    FieldError
        A photodetector is not covered by the image; `axis` ("rows" or "cols") names the field.
    """
    centre = (np.arange(pixels) + 0.5 - pixels / 2) * (pixel_pitch_m / sample_pitch_m) + samples / 2
    centre += offset_m / sample_pitch_m
    half = 0.5 * aperture_m / sample_pitch_m
    low, high = centre - half, centre + half
    if low[0] < -COVERAGE_TOLERANCE * samples or high[-1] > samples * (1 + COVERAGE_TOLERANCE):
        covered = max(1, math.floor((samples * sample_pitch_m - aperture_m) / pixel_pitch_m * (1 + COVERAGE_TOLERANCE)) + 1)
        raise FieldError(
            f"{axis} is {pixels}: the sensor extends {pixels * pixel_pitch_m * 1e3:.6g} mm but the optical image only "
            f"{samples * sample_pitch_m * 1e3:.6g} mm, so that outer pixels would see nothing. Render a larger field of view "
            f"(film) or set {axis} to at most {covered}.",
            path=axis,
            value=pixels,
        )
    first = np.clip(np.floor(low), 0, samples - 1).astype(np.int64)
    last = np.clip(np.ceil(high) - 1, first, samples - 1).astype(np.int64)
    index = first[:, None] + np.arange(int(np.max(last - first)) + 1)
    overlap = np.minimum(high[:, None], index + 1) - np.maximum(low[:, None], index)
    # A sliver of an overlap is rounding of the pitches' ratio, not light.
    overlap[(overlap < COVERAGE_TOLERANCE * 2 * half) | (index > last[:, None])] = 0.0
    overlap /= np.sum(overlap, axis=1, keepdims=True)
    pixel, offset = np.nonzero(overlap)
    return scipy.sparse.csr_array((overlap[pixel, offset], (pixel, index[pixel, offset])), shape=(pixels, samples))


def pixel_sampling(
    optical: OpticalImage | ChannelCurrents,
    *,
    rows: int,
    cols: int,
    pixel_pitch_m: float,
    fill_factor: float,
    offset_m: tuple[float, float] = (0.0, 0.0),
) -> PixelSampling:
    """Return how a sensor's pixels see an optical image, for any ratio of the pitches.

    The photodetector is the square with `fill_factor` of the pixel's area whose centre lies `offset_m` (down, right) from
    the pixel's. The optical image is taken as
    constant within each of its cells, whose means it holds, so flux is conserved exactly where fill_factor is 1. Where
    pixels and samples coincide the samples are returned as they are.

    Raises
    ------
    FieldError
        The sensor is larger than the optical image: pixels beyond it would record darkness that is not in the scene.
    """
    aperture_m = pixel_pitch_m * math.sqrt(fill_factor)
    down, across = (
        axis_weights(
            pixels=pixels,
            pixel_pitch_m=pixel_pitch_m,
            aperture_m=aperture_m,
            samples=samples,
            sample_pitch_m=optical.sample_pitch_m,
            axis=axis,
            offset_m=offset,
        )
        for axis, pixels, samples, offset in (
            ("rows", rows, optical.rows, offset_m[0]),
            ("cols", cols, optical.cols, offset_m[1]),
        )
    )
    return PixelSampling(row_weights=down, col_weights=across)


def _selection(weights: scipy.sparse.csr_array) -> slice | None:
    """Return the slice of samples that the weights select where each pixel sees one sample and they are equally spaced."""
    pixels = weights.shape[0]
    if weights.nnz != pixels:
        return None
    chosen = weights.indices
    step = int(chosen[1] - chosen[0]) if pixels > 1 else 1
    if step < 1 or np.any(np.diff(chosen) != step):
        return None
    return slice(int(chosen[0]), int(chosen[-1]) + 1, step)
