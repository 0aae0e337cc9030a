"""Full well: a pixel holds a limited number of electrons."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["limit_to_well"]


def limit_to_well(electrons: NDArray[np.float64], *, well_capacity_e: float) -> NDArray[np.float64]:
    """Return the electrons that stay in the well, same shape [e-]; the surplus drains away, no blooming."""
    return np.minimum(electrons, well_capacity_e)
