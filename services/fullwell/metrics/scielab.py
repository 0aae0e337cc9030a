"""S-CIELAB: colour difference as an eye at a distance sees it, and the visual signal-to-noise ratio of a flat field."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.metrics.colour_difference import delta_e_2000, xyz_to_lab

__all__ = ["OPPONENT_FROM_XYZ", "s_cielab", "s_cielab_difference", "samples_per_degree", "visual_snr"]

OPPONENT_FROM_XYZ: Final = np.array(
    [[0.2885613, 0.6597617, -0.1305654], [-0.4648864, 0.3262702, 0.0624200], [0.0798787, -0.5547976, 0.4814746]]
)
"""CIE 1931 XYZ to the opponent colours (light, red-green, blue-yellow) of poirson1993, as isetcam tabulates it."""

FILTERS: Final = (
    ((0.921, 0.0283), (0.105, 0.133), (-0.108, 4.336)),
    ((0.531, 0.0392), (0.330, 0.494)),
    ((0.488, 0.0536), (0.371, 0.386)),
)
"""(weight, spread s [deg]) of exp(-r^2 / s^2), per opponent colour (zhang1997, table 1)."""

TRUNCATE_SIGMAS: Final = 4.0
"""The Gaussians end here: the rest is 6e-5 of each, and the weights are normalised."""

CENTRAL_SHARE: Final = 0.8
"""Share of the sides that `visual_snr` looks at: the picture's border is mirrored, not seen."""


def samples_per_degree(*, pitch_m: float, distance_m: float) -> float:
    """Return the samples that one degree of visual angle spans, straight ahead of a display of sample pitch [m] at [m].

    Raises FieldError for values that are not > 0 and finite.
    """
    for name, value in (("pitch_m", pitch_m), ("distance_m", distance_m)):
        if not 0 < value < math.inf:
            raise FieldError(f"{name} is {value}; must be > 0 and finite.", path=name, value=value)
    return 1.0 / math.degrees(math.atan(pitch_m / distance_m))


def s_cielab(xyz: ArrayLike, white_xyz: ArrayLike, *, samples_per_degree: float) -> NDArray[np.float64]:
    """Return the S-CIELAB image, (rows, cols, 3) L*, a*, b*: CIELAB after the eye's blur of each opponent colour.

    A uniform field keeps its CIELAB. The picture is mirrored at its border.

    Parameters
    ----------
    xyz
        (rows, cols, 3) CIE 1931 XYZ, >= 0, in the unit of the white.
    white_xyz
        (3,), each > 0.
    samples_per_degree
        Samples per degree of visual angle, > 0; see the function of that name.

    Raises
    ------
    ShapeError
        Not (rows, cols, 3).
    FieldError
        NaN, Inf or negative values, or samples_per_degree not > 0.

    References
    ----------
    zhang1997.
    """
    image = _checked_xyz(xyz)
    if not 0 < samples_per_degree < math.inf:
        message = f"samples_per_degree is {samples_per_degree}; must be > 0 and finite."
        raise FieldError(message, path="samples_per_degree", value=samples_per_degree)
    opponent = image @ OPPONENT_FROM_XYZ.T
    blurred = np.stack([_blur(opponent[..., k], FILTERS[k], samples_per_degree) for k in range(3)], axis=-1)
    return xyz_to_lab(blurred @ np.linalg.inv(OPPONENT_FROM_XYZ).T, white_xyz)


def s_cielab_difference(
    xyz: ArrayLike, other_xyz: ArrayLike, white_xyz: ArrayLike, *, samples_per_degree: float
) -> NDArray[np.float64]:
    """Return the map of CIEDE2000 differences, (rows, cols), between the S-CIELAB images of two pictures of one shape.

    Arguments and errors are those of `s_cielab`; ShapeError too where the shapes differ.
    """
    first, second = _checked_xyz(xyz), _checked_xyz(other_xyz)
    if first.shape != second.shape:
        raise ShapeError(f"the pictures have shapes {first.shape} and {second.shape}; they must be the same.")
    lab = s_cielab(first, white_xyz, samples_per_degree=samples_per_degree)
    return delta_e_2000(lab, s_cielab(second, white_xyz, samples_per_degree=samples_per_degree))


def visual_snr(xyz: ArrayLike, white_xyz: ArrayLike, *, samples_per_degree: float) -> float:
    """Return 1 over the root of the summed S-CIELAB variances [1 / delta E] of a flat field's middle; inf without noise.

    Arguments and errors are those of `s_cielab`; ShapeError too where the middle holds fewer than 2 pixels.

    References
    ----------
    farrell2012, visual signal-to-noise.
    """
    lab = s_cielab(xyz, white_xyz, samples_per_degree=samples_per_degree)
    rows, cols = (max(1, round(CENTRAL_SHARE * side)) for side in lab.shape[:2])
    if rows * cols < 2:
        raise ShapeError(f"the picture is {lab.shape[0]} x {lab.shape[1]}; its middle must hold at least 2 pixels.")
    top, left = (lab.shape[0] - rows) // 2, (lab.shape[1] - cols) // 2
    variance = float(np.sum(np.var(lab[top : top + rows, left : left + cols], axis=(0, 1), ddof=1)))
    return 1.0 / math.sqrt(variance) if variance > 0 else math.inf


def _blur(plane: NDArray[np.float64], gaussians: tuple[tuple[float, float], ...], per_degree: float) -> NDArray[np.float64]:
    """Return the weighted sum of Gaussian blurs, weights normalised to 1."""
    from scipy.ndimage import gaussian_filter  # noqa: PLC0415 - slow to load where no picture is compared

    total = sum(weight for weight, _ in gaussians)
    blurred = np.zeros_like(plane)
    for weight, spread_deg in gaussians:
        sigma = spread_deg / math.sqrt(2.0) * per_degree
        blurred += weight / total * gaussian_filter(plane, sigma, mode="reflect", truncate=TRUNCATE_SIGMAS)
    return blurred


def _checked_xyz(xyz: ArrayLike) -> NDArray[np.float64]:
    image = np.asarray(xyz, dtype=np.float64)
    if image.ndim != 3 or image.shape[2] != 3 or 0 in image.shape:
        raise ShapeError(f"xyz has shape {image.shape}; must be (rows, cols, 3).")
    if not (np.all(image >= 0) and np.all(np.isfinite(image))):
        raise FieldError("xyz holds NaN, Inf or negative values; must be >= 0 and finite.", path="xyz")
    return image
