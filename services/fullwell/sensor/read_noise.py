"""Read noise: what the source follower, reset and readout chain add to each pixel at each readout."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["read_noise_v"]


def read_noise_v(
    *, rows: int, cols: int, read_noise_e: float, conversion_gain_v_per_e: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return zero-mean Gaussian noise before the analog gain, (rows, cols) [V], new at each readout.

    References
    ----------
    janesick2007, chapter 3; emva1288.
    """
    return rng.standard_normal((rows, cols)) * (read_noise_e * conversion_gain_v_per_e)
