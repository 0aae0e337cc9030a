"""Shot noise: electrons come one by one, so their number is Poisson distributed."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["LARGEST_MEAN_E", "poisson_electrons"]

LARGEST_MEAN_E: Final = 1e12
"""Means above are drawn as this one. A thousand times the largest well allowed, so the full-well clip hides it; beyond about
1e13 the generator's arithmetic in double precision would no longer be exact."""


def poisson_electrons(mean_electrons: NDArray[np.float64], *, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return whole numbers of electrons drawn from the Poisson distribution of each mean, same shape [e-].

    Exact at every mean: no change to a Gaussian at high light.

    References
    ----------
    hormann1993, the transformed rejection that numpy's generator uses from a mean of 10 on.
    """
    if mean_electrons.size > 0 and float(np.max(mean_electrons)) > LARGEST_MEAN_E:
        mean_electrons = np.minimum(mean_electrons, LARGEST_MEAN_E)
    return rng.poisson(mean_electrons).astype(np.float64)
