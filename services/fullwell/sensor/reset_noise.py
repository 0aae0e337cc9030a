"""Reset noise: a capacitor that is switched off keeps a thermal charge of its own."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import BOLTZMANN_J_PER_K, ELEMENTARY_CHARGE_C

__all__ = ["reset_noise_v", "thermal_reset_noise_e"]


def thermal_reset_noise_e(*, conversion_gain_v_per_e: float, temperature_k: float) -> float:
    """Return the standard deviation of a sense node's reset noise, sqrt(k T C) / q with C = q / conversion gain [e-].

    References
    ----------
    janesick2007, sense node reset noise.
    """
    capacitance_f = ELEMENTARY_CHARGE_C / conversion_gain_v_per_e
    return math.sqrt(BOLTZMANN_J_PER_K * temperature_k * capacitance_f) / ELEMENTARY_CHARGE_C


def reset_noise_v(
    *, rows: int, cols: int, reset_noise_e: float, conversion_gain_v_per_e: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return zero-mean Gaussian noise of the reset level before the analog gain, (rows, cols) [V], new at each reset."""
    return rng.standard_normal((rows, cols)) * (reset_noise_e * conversion_gain_v_per_e)
