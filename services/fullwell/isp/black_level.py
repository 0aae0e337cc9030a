"""Black level subtraction and normalisation to the saturation level."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.scene.images import RawImage

__all__ = ["linear_signal"]


def linear_signal(raw: RawImage) -> NDArray[np.float64]:
    """Return the mosaic with 0 at the black level and 1 at saturation, (rows, cols).

    Noise below the black level stays negative: clipping it here would lift the mean of dark areas.
    """
    return (raw.dn.astype(np.float64) - raw.black_level_dn) / (raw.white_level_dn - raw.black_level_dn)
