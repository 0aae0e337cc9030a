"""Crosstalk: electrons that end up in a neighbour, and channels that see one another's light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve

from fullwell.radiometry import Spectrum
from fullwell.sensor.checks import refusal
from fullwell.sensor.parameters import ColorFilterArray

__all__ = ["mix_channels", "spread_electrons"]


def spread_electrons(rate: NDArray[np.float64], kernel: tuple[tuple[float, ...], ...]) -> NDArray[np.float64]:
    """Return mean electrons after diffusion into neighbours, (rows, cols), in the unit of `rate`.

    ``kernel[1 + i][1 + j]`` is the share of a pixel's electrons that its neighbour i rows down and j columns to the right
    collects; the sum is at most 1, the rest is lost. Beyond the border the image goes on as its mirror image, so that as much
    comes in as goes out and uniform light stays uniform.

    Electrons choose their pixel independently of one another, so the numbers collected are independent Poisson numbers of
    these means: spreading the means before the shot noise is exact (thinning and superposition of Poisson processes).
    """
    return np.asarray(convolve(rate, np.asarray(kernel), mode="reflect"))


def mix_channels(cfa: ColorFilterArray, matrix: NDArray[np.float64]) -> ColorFilterArray:
    """Return the colour filter array whose channel j sees ``sum_i channel_i matrix[i, j]``.

    `matrix` is (channels, channels), >= 0: the diagonal holds the gains, the rest the crosstalk. This is how crosstalk shows
    in quantum efficiencies measured on large uniform patches; it does not blur.

    Raises
    ------
    FieldError
        The matrix is not square, has negative or non-finite entries, or makes a quantum efficiency larger than 1.
    """
    count = len(cfa.channels)
    if matrix.shape != (count, count):
        raise refusal("crosstalk.channels", matrix.shape, f"a {count} x {count} matrix")
    if not np.all(np.isfinite(matrix)) or np.any(matrix < 0):
        raise refusal("crosstalk.channels", matrix.tolist(), ">= 0 and finite")
    curves = [curve for _, curve in cfa.channels]
    mixed = []
    for j, (name, own) in enumerate(cfa.channels):
        parts = [(float(matrix[i, j]), curve) for i, curve in enumerate(curves) if matrix[i, j] > 0]
        mixed.append((name, _sum(parts, own)))
    return ColorFilterArray(cfa.pattern, tuple(mixed))


def _sum(parts: list[tuple[float, Spectrum]], own: Spectrum) -> Spectrum:
    """Return the weighted sum of curves. A step at the end of a table becomes a ramp of one picometre."""
    if not parts:
        return own.scaled(0.0)
    knots = np.unique(np.concatenate([_knots(curve) for _, curve in parts]))
    values = np.sum([factor * curve.at(knots) for factor, curve in parts], axis=0)
    outside = "hold" if any(curve.outside == "hold" for _, curve in parts) else "zero"
    source = " + ".join(f"{factor:g} x ({curve.source})" for factor, curve in parts)
    return Spectrum(knots, values, outside=outside, unit=own.unit, source=source)  # type: ignore[arg-type]


_RAMP_NM = 1e-3


def _knots(curve: Spectrum) -> NDArray[np.float64]:
    if curve.outside == "hold":
        return curve.wavelength_nm
    ends = np.array([curve.wavelength_nm[0] - _RAMP_NM, curve.wavelength_nm[-1] + _RAMP_NM])
    return np.concatenate([curve.wavelength_nm, ends])
