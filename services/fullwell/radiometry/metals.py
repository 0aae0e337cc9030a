"""Complex refractive indices of metals: the Brendel-Bormann model with published parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.constants import ELEMENTARY_CHARGE_C, NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["metal", "metal_names", "normal_reflectance"]


@dataclass(frozen=True, slots=True)
class _Metal:
    """Plasma energy [eV], Drude strength and damping [eV], and (strength, damping, energy, width) [-, eV, eV, eV] each."""

    plasma_ev: float
    drude_strength: float
    drude_damping_ev: float
    oscillators: tuple[tuple[float, float, float, float], ...]


# Rakic, Djurisic, Elazar and Majewski 1998, Applied Optics 37, 5271, tables 1 and 3 (Brendel-Bormann).
_METALS = {
    "aluminium": _Metal(14.98, 0.526, 0.047, (
        (0.213, 0.312, 0.163, 0.013), (0.060, 0.315, 1.561, 0.042), (0.182, 1.587, 1.827, 0.256), (0.014, 2.145, 4.495, 1.735),
    )),
    "chromium": _Metal(10.75, 0.154, 0.048, (
        (0.338, 4.256, 0.281, 0.115), (0.261, 3.957, 0.584, 0.252), (0.817, 2.218, 1.919, 0.225), (0.105, 6.983, 6.997, 4.903),
    )),
    "copper": _Metal(10.83, 0.562, 0.030, (
        (0.076, 0.056, 0.416, 0.562), (0.081, 0.047, 2.849, 0.469), (0.324, 0.113, 4.819, 1.131), (0.726, 0.172, 8.136, 1.719),
    )),
    "gold": _Metal(9.03, 0.770, 0.050, (
        (0.054, 0.074, 0.218, 0.742), (0.050, 0.035, 2.885, 0.349), (0.312, 0.083, 4.069, 0.830), (0.719, 0.125, 6.137, 1.246),
        (1.648, 0.179, 27.97, 1.795),
    )),
    "nickel": _Metal(15.92, 0.083, 0.022, (
        (0.357, 2.820, 0.317, 0.606), (0.039, 0.120, 1.059, 1.454), (0.127, 1.822, 4.583, 0.379), (0.654, 6.637, 8.825, 0.510),
    )),
    "silver": _Metal(9.01, 0.821, 0.049, (
        (0.050, 0.189, 2.025, 1.894), (0.133, 0.067, 5.185, 0.665), (0.051, 0.019, 4.343, 0.189), (0.467, 0.117, 9.809, 1.170),
        (4.000, 0.052, 18.56, 0.516),
    )),
}  # fmt: skip

_ALIASES = {
    "aluminum": "aluminium",
    "al": "aluminium",
    "cr": "chromium",
    "cu": "copper",
    "au": "gold",
    "ni": "nickel",
    "ag": "silver",
}
_TABLE_NM = np.arange(300.0, 1100.5, 2.0)


def metal(name: str, path: str = "") -> tuple[Spectrum, Spectrum]:
    """Return the refractive index eta and the extinction coefficient k of a metal, 300-1100 nm by 2 nm, ends held.

    `name` is one of `metal_names()` or the element's symbol; an unknown one raises FieldError with the nearest.
    Films of high quality are meant: oxide, roughness and impurities change k by several per cent.

    References
    ----------
    Rakic et al. 1998, Applied Optics 37, 5271: a fit to measurements, within some per cent of them in the visible.
    """
    folded = str(name).strip().casefold()
    canonical = _ALIASES.get(folded, folded)
    if canonical not in _METALS:
        raise FieldError(unknown_name_message("metal", str(name), metal_names()), path=path, value=name)
    return _tabulated(canonical)


def metal_names() -> tuple[str, ...]:
    """Return the names `metal` knows."""
    return tuple(_METALS)


def normal_reflectance(eta: ArrayLike, extinction: ArrayLike) -> NDArray[np.float64]:
    """Return the Fresnel reflectance at normal incidence from vacuum, in [0, 1] (Born and Wolf, 7th ed., eq. 14.2.16)."""
    n, k = np.asarray(eta, dtype=np.float64), np.asarray(extinction, dtype=np.float64)
    return np.asarray(((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2))


@cache
def _tabulated(canonical: str) -> tuple[Spectrum, Spectrum]:
    index = np.sqrt(_permittivity(_METALS[canonical], _TABLE_NM))
    source = f"{canonical}, Brendel-Bormann model of Rakic et al. 1998, Applied Optics 37, 5271"
    eta = Spectrum(_TABLE_NM, index.real, outside="hold", unit="1", source=f"eta of {source}")
    return eta, Spectrum(_TABLE_NM, index.imag, outside="hold", unit="1", source=f"k of {source}")


def _permittivity(parameters: _Metal, wavelength_nm: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return the relative permittivity with the time dependence exp(-i omega t): Rakic et al. 1998, eqs. 8 to 11.

    Each interband oscillator is a Lorentz line smeared by a Gaussian, which gives Faddeeva functions w(z).
    """
    from scipy.special import wofz  # noqa: PLC0415 - scipy.special costs start-up time that validation does not need

    energy_ev = PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M / (wavelength_nm * ELEMENTARY_CHARGE_C)
    plasma = parameters.plasma_ev**2
    total = 1.0 - parameters.drude_strength * plasma / (energy_ev * (energy_ev + 1j * parameters.drude_damping_ev))
    for strength, damping_ev, centre_ev, width_ev in parameters.oscillators:
        root = np.sqrt(energy_ev * (energy_ev + 1j * damping_ev))
        scale = np.sqrt(2.0) * width_ev
        lines = wofz((root - centre_ev) / scale) + wofz((root + centre_ev) / scale)
        total = total + 1j * np.sqrt(np.pi) * strength * plasma / (2.0 * scale * root) * lines
    return np.asarray(total, dtype=np.complex128)
