"""Physical constants (CODATA 2019 exact values, SI) and the few numerical ones that several modules share."""

from typing import Final

__all__ = [
    "BOLTZMANN_J_PER_K",
    "ELEMENTARY_CHARGE_C",
    "LUMINOUS_EFFICACY_LM_PER_W",
    "NM_PER_M",
    "PLANCK_J_S",
    "SPEED_OF_LIGHT_M_PER_S",
]

PLANCK_J_S: Final = 6.62607015e-34
SPEED_OF_LIGHT_M_PER_S: Final = 299792458.0
BOLTZMANN_J_PER_K: Final = 1.380649e-23
ELEMENTARY_CHARGE_C: Final = 1.602176634e-19

LUMINOUS_EFFICACY_LM_PER_W: Final = 683.0
"""K_m of photopic vision [lm/W], rounded as the CIE rounds it (CIE 18.2; 683.002 before rounding)."""

NM_PER_M: Final = 1e9
