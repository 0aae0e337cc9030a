"""Refractive indices of glasses and water over wavelength, and of materials known by n_d and their Abbe number."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["AIR_INDEX", "glass", "glass_from_abbe", "glass_names", "index_of_line"]

AIR_INDEX = 1.000277
"""Of air at 589.3 nm, 15 degrees Celsius, 101325 Pa (Ciddor 1996); it varies by 1e-5 over the visible range."""

_D_LINE_NM, _F_LINE_NM, _C_LINE_NM = 587.5618, 486.1327, 656.2725
_SODIUM_NM = 589.3
_TABLE_NM = np.arange(300.0, 1102.0, 2.0)
"""Between entries 2 nm apart an index is linear to 2e-5."""

_SCHOTT = "SCHOTT optical glass data sheets (2023), relative to air"
_SELLMEIER: dict[str, tuple[float, str, tuple[tuple[float, float], ...]]] = {
    "F2": (AIR_INDEX, _SCHOTT, ((1.34533359, 0.00997743871), (0.209073176, 0.0470450767), (0.937357162, 111.886764))),
    "N-BK7": (AIR_INDEX, _SCHOTT, ((1.03961212, 0.00600069867), (0.231792344, 0.0200179144), (1.01046945, 103.560653))),
    "N-F2": (AIR_INDEX, _SCHOTT, ((1.39757037, 0.00995906143), (0.159201403, 0.0546931752), (1.2686543, 119.248346))),
    "N-SF11": (AIR_INDEX, _SCHOTT, ((1.73759695, 0.013188707), (0.313747346, 0.0623068142), (1.89878101, 155.23629))),
    "fused-silica": (
        AIR_INDEX,
        "Malitson 1965, relative to air",
        ((0.6961663, 0.0684043**2), (0.4079426, 0.1162414**2), (0.8974794, 9.896161**2)),
    ),
    "water": (
        1.0,
        "Daimon and Masumura 2007, 20 degrees Celsius, absolute",
        (
            (0.5684027565, 0.005101829712),
            (0.1726177391, 0.01821153936),
            (0.02086189578, 0.02620722293),
            (0.1130748688, 10.69792721),
        ),
    ),
}
"""Name: index of what the measurement is relative to, source, and the terms (B, C [um^2])."""


def glass(name: str, path: str = "") -> Spectrum:
    """Return the absolute refractive index (relative to vacuum) of a catalogue glass, 300-1100 nm.

    `name` is one of `glass_names()`, in any case; an unknown one raises FieldError with the nearest.

    References
    ----------
    F2, N-BK7, N-F2, N-SF11: SCHOTT, Optical Glass data sheets, 2023. Fused silica: Malitson 1965, J. Opt. Soc. Am. 55, 1205,
    eq. 1. Water: Daimon and Masumura 2007, Applied Optics 46, 3811, table 1 (20 degrees Celsius).
    """
    folded = {known.casefold(): known for known in _SELLMEIER}
    canonical = folded.get(str(name).strip().casefold())
    if canonical is None:
        raise FieldError(unknown_name_message("glass", str(name), tuple(_SELLMEIER)), path=path, value=name)
    return _tabulated(canonical)


def glass_names() -> tuple[str, ...]:
    """Return the names `glass` knows."""
    return tuple(_SELLMEIER)


def glass_from_abbe(n_d: float, abbe: float) -> Spectrum:
    """Return the index A + B / wavelength^2 (Cauchy) that has `n_d` at 587.56 nm and the Abbe number `abbe`, 300-1100 nm.

    V_d = (n_d - 1) / (n_F - n_C) gives B, then n_d gives A.
    """
    spread = (n_d - 1.0) / abbe
    slope = spread / (_F_LINE_NM**-2 - _C_LINE_NM**-2)
    values = n_d + slope * (_TABLE_NM**-2 - _D_LINE_NM**-2)
    return Spectrum(_TABLE_NM, values, outside="hold", source=f"Cauchy's formula for n_d = {n_d:g}, V_d = {abbe:g}")


def index_of_line(index: Spectrum) -> float:
    """Return the index at 589.3 nm, for what knows one index only."""
    return float(index.at(_SODIUM_NM))


@cache
def _tabulated(canonical: str) -> Spectrum:
    relative_to, source, terms = _SELLMEIER[canonical]
    values = relative_to * _sellmeier(_TABLE_NM, terms)
    return Spectrum(_TABLE_NM, values, outside="hold", source=f"index of {canonical}: {source}")


def _sellmeier(wavelength_nm: ArrayLike, terms: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    square_um2 = (np.asarray(wavelength_nm, dtype=np.float64) / 1000.0) ** 2
    return np.asarray(np.sqrt(1.0 + sum(b * square_um2 / (square_um2 - c) for b, c in terms)))
