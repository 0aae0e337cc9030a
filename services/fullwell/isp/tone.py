"""Tone: from linear sRGB to eight bits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.radiometry import linear_to_srgb

__all__ = ["encode_srgb"]


def encode_srgb(linear: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return sRGB-encoded values 0 to 255 of linear ones, same shape; values outside 0 to 1 are clipped.

    No tone curve beside the standard's own: 1, the saturation level of the sensor, is display white.

    References
    ----------
    iec61966, section 5.2.
    """
    return np.asarray(np.rint(linear_to_srgb(np.clip(linear, 0.0, 1.0)) * 255.0).astype(np.uint8))
