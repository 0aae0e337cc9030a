"""Dark current: electrons that the silicon makes without light."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import BOLTZMANN_J_PER_K, ELEMENTARY_CHARGE_C
from fullwell.sensor.checks import check_positive

__all__ = ["DEFAULT_LAW", "ArrheniusLaw", "DarkCurrentLaw", "DoublingLaw", "dark_electrons", "temperature_ratio"]

_BOLTZMANN_EV_PER_K: Final = BOLTZMANN_J_PER_K / ELEMENTARY_CHARGE_C


@dataclass(frozen=True, slots=True)
class DoublingLaw:
    """Dark current doubles with every `doubling_k` kelvin; 8 K is representative of silicon about room temperature."""

    doubling_k: float = 8.0

    def __post_init__(self) -> None:
        check_positive("doubling_k", self.doubling_k)


@dataclass(frozen=True, slots=True)
class ArrheniusLaw:
    """Dark current is proportional to exp(-activation energy / kT).

    Half of silicon's band gap, 0.56 eV, where traps generate it; the gap, 1.12 eV, where it diffuses in (widenhorn2002).
    """

    activation_energy_ev: float

    def __post_init__(self) -> None:
        check_positive("activation_energy_ev", self.activation_energy_ev)


DarkCurrentLaw: TypeAlias = DoublingLaw | ArrheniusLaw

DEFAULT_LAW: Final = DoublingLaw()


def temperature_ratio(law: DarkCurrentLaw, *, temperature_k: float, reference_temperature_k: float) -> float:
    """Return the dark current at a temperature over that at the reference temperature.

    References
    ----------
    emva1288, temperature dependence of the dark current (doubling); widenhorn2002, eq. 5 (Arrhenius).
    """
    if isinstance(law, DoublingLaw):
        return float(2.0 ** ((temperature_k - reference_temperature_k) / law.doubling_k))
    inverse_k = 1.0 / temperature_k - 1.0 / reference_temperature_k
    return math.exp(-law.activation_energy_ev / _BOLTZMANN_EV_PER_K * inverse_k)


def dark_electrons(
    *, dark_current_e_per_s: float | NDArray[np.float64], exposure_time_s: float | NDArray[np.float64]
) -> float | NDArray[np.float64]:
    """Return the mean dark electrons [e-] of a pixel, or of all, (rows, cols), where current or time differ.

    Their shot noise is that of all electrons in the well.

    References
    ----------
    janesick2007, chapter 3; emva1288.
    """
    return dark_current_e_per_s * exposure_time_s
