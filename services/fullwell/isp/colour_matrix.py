"""The colour matrix: from balanced sensor channels to linear sRGB, fitted on the ColorChecker."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.radiometry import (
    COLORCHECKER_PATCHES,
    Spectrum,
    WavelengthGrid,
    band_photons,
    colour_matching_functions,
    reflectance,
)

__all__ = [
    "adapted_srgb_targets",
    "bradford_adaptation",
    "channel_responses",
    "fit_colour_matrix",
    "noise_amplification",
    "white_xyz",
    "xyz_to_linear_srgb_matrix",
]

_SRGB_PRIMARIES_XY = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
_SRGB_WHITE_XY = (0.3127, 0.3290)
"""IEC 61966-2-1:1999, tables 1 and 2."""

_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
"""XYZ to the sharpened cone responses of the Bradford transform (lam1985)."""

_OBSERVER_NM = np.arange(360.0, 831.0)


@cache
def xyz_to_linear_srgb_matrix() -> NDArray[np.float64]:
    """Return the (3, 3) matrix from CIE XYZ (white Y = 1) to linear sRGB, from the standard's primaries and white."""
    primaries = np.array([_xyz_of_xy(xy) for xy in _SRGB_PRIMARIES_XY]).T
    scale = np.linalg.solve(primaries, _xyz_of_xy(_SRGB_WHITE_XY))
    return np.asarray(np.linalg.inv(primaries * scale))


def channel_responses(channels: tuple[Spectrum, ...], illuminant: Spectrum, grid: WavelengthGrid) -> NDArray[np.float64]:
    """Return the channels' relative electrons for a perfect white and the 24 patches under a light, (25, channels).

    Summed over the same bands as the exposure, so that a white in the picture meets the white here.

    Raises
    ------
    FieldError
        No channel sees anything of the light.
    """
    light = band_photons(illuminant, grid)
    patches = np.stack([np.ones(grid.count), *(patch.band_average(grid) for patch in _patches())])
    efficiency = np.stack([channel.band_average(grid) for channel in channels], axis=1)
    responses = (patches * light) @ efficiency
    if not np.any(responses[0] > 0):
        raise FieldError(
            f"the isp illuminant {illuminant.source or 'of the recipe'!r} gives the channels of the sensor no light between "
            f"{grid.edges_nm[0]:g} and {grid.edges_nm[-1]:g} nm; choose an illuminant and a wavelength grid that they see.",
            path="illuminant",
            value=illuminant.source,
        )
    return np.asarray(responses)


def adapted_srgb_targets(illuminant: Spectrum, *, adapt_white: bool) -> NDArray[np.float64]:
    """Return what a perfect white and the 24 patches under a light should look like, (25, 3) linear sRGB, white Y = 1.

    With `adapt_white` the light's white becomes sRGB white (Bradford transform); without, the light keeps its tint.

    Raises
    ------
    FieldError
        The light is invisible.
    """
    patches = np.stack([np.ones_like(_OBSERVER_NM), *(patch.at(_OBSERVER_NM) for patch in _patches())])
    xyz = (patches * illuminant.at(_OBSERVER_NM)) @ _observer()
    if not xyz[0, 1] > 0:
        raise FieldError(
            f"the isp illuminant {illuminant.source or 'of the recipe'!r} has no visible light; choose one with power within "
            "360 to 830 nm.",
            path="illuminant",
            value=illuminant.source,
        )
    xyz = xyz / xyz[0, 1]
    if adapt_white:
        xyz = xyz @ bradford_adaptation(xyz[0], _xyz_of_xy(_SRGB_WHITE_XY)).T
    return np.asarray(xyz @ xyz_to_linear_srgb_matrix().T)


def white_xyz(illuminant: Spectrum) -> NDArray[np.float64]:
    """Return X, Y, Z of a perfect white under a light, (3,), Y = 1, by the sums of `adapted_srgb_targets`."""
    xyz = illuminant.at(_OBSERVER_NM) @ _observer()
    return np.asarray(xyz / xyz[1])


def bradford_adaptation(from_xyz: NDArray[np.float64], to_xyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3, 3) matrix that turns colours seen with one white, X, Y, Z (3,), into those seen with another (lam1985)."""
    scale = (_BRADFORD @ to_xyz) / (_BRADFORD @ from_xyz)
    return np.asarray(np.linalg.solve(_BRADFORD, scale[:, None] * _BRADFORD))


def fit_colour_matrix(
    balanced: NDArray[np.float64],
    targets: NDArray[np.float64],
    *,
    channel_noise: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Return the (3, channels) matrix with the least squared error over the patches that keeps white exact.

    Parameters
    ----------
    balanced
        (25, channels) channel values, row 0 the white, whose channels are all 1.
    targets
        (25, 3) linear sRGB, row 0 the white.
    channel_noise
        (channels,) standard deviation of the noise of the balanced channels, independent of one another; the matrix then has
        the least expected squared error of colour and noise together. None: no noise.

    The condition "white maps to white" fixes each row's sum; the fit runs over the directions that leave the sum alone.
    Derived in docs/physics/colour-matrix.md.
    """
    channels = balanced.shape[1]
    neutral = np.outer(targets[0], np.full(channels, 1.0 / channels))
    sum_free = np.linalg.svd(np.ones((1, channels)))[2][1:]
    rows = balanced[1:]
    remaining = targets[1:] - rows @ neutral.T
    if channel_noise is not None:
        # Noise adds its variance through the matrix to every patch: as rows of the equations, one for each channel.
        noise = np.sqrt(rows.shape[0]) * np.diag(channel_noise)
        remaining = np.concatenate([remaining, -noise @ neutral.T])
        rows = np.concatenate([rows, noise])
    if channels == 1:
        return neutral
    solution = np.linalg.lstsq(rows @ sum_free.T, remaining, rcond=None)[0]
    return np.asarray(neutral + solution.T @ sum_free)


def noise_amplification(colour_matrix: NDArray[np.float64], channel_gain_ratio: NDArray[np.float64]) -> float:
    """Return the noise of linear sRGB, root mean square of its three channels, over that of the raw channels in the dark.

    `colour_matrix` is (3, channels), `channel_gain_ratio` (channels,); raw noise is equal and independent. Interpolation,
    which lowers noise and correlates pixels, is left out.
    """
    return float(np.sqrt(np.mean(np.sum((colour_matrix * channel_gain_ratio) ** 2, axis=1))))


def _observer() -> NDArray[np.float64]:
    return np.stack([curve.at(_OBSERVER_NM) for curve in colour_matching_functions()], axis=1)


def _patches() -> tuple[Spectrum, ...]:
    return tuple(reflectance(f"colorchecker:{name}") for name in COLORCHECKER_PATCHES)


def _xyz_of_xy(xy: tuple[float, float]) -> NDArray[np.float64]:
    x, y = xy
    return np.array([x / y, 1.0, (1.0 - x - y) / y])
