"""Complex refractive indices of metals, from published measurements."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["metal", "metal_names", "normal_reflectance"]

_NAMES = ("aluminium", "chromium", "copper", "gold", "nickel", "silver")
_ALIASES = {
    "ag": "silver",
    "al": "aluminium",
    "aluminum": "aluminium",
    "au": "gold",
    "cr": "chromium",
    "cu": "copper",
    "ni": "nickel",
}


def metal(name: str, path: str = "") -> tuple[Spectrum, Spectrum]:
    """Return the refractive index eta and the extinction coefficient k of a metal, about 300-1100 nm, ends held.

    `name` is one of `metal_names()` or the element's symbol; an unknown one raises FieldError with the nearest. Clean
    evaporated films at room temperature: oxide, roughness and impurities lower the reflectance by some per cent.

    References
    ----------
    Silver, gold, copper: Johnson and Christy 1972, Physical Review B 6, 4370. Chromium, nickel: Johnson and Christy 1974,
    Physical Review B 9, 5056. Aluminium: Rakic 1995, Applied Optics 34, 4755.
    """
    folded = str(name).strip().casefold()
    canonical = _ALIASES.get(folded, folded)
    if canonical not in _NAMES:
        raise FieldError(unknown_name_message("metal", str(name), _NAMES), path=path, value=name)
    return _tabulated(canonical)


def metal_names() -> tuple[str, ...]:
    """Return the names `metal` knows."""
    return _NAMES


def normal_reflectance(eta: ArrayLike, extinction: ArrayLike) -> NDArray[np.float64]:
    """Return the Fresnel reflectance at normal incidence from vacuum, in [0, 1] (Born and Wolf, 7th ed., section 14.2)."""
    n, k = np.asarray(eta, dtype=np.float64), np.asarray(extinction, dtype=np.float64)
    return np.asarray(((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2))


@cache
def _tabulated(canonical: str) -> tuple[Spectrum, Spectrum]:
    text = resources.files("fullwell.radiometry").joinpath("data", "metals.json").read_text(encoding="utf-8")
    table = json.loads(text)["metals"][canonical]
    wavelength_nm = np.array(table["wavelength_nm"], dtype=np.float64)
    eta, extinction = (
        Spectrum(wavelength_nm, np.array(table[column]), outside="hold", source=f"{column} of {canonical}: {table['source']}")
        for column in ("eta", "k")
    )
    return eta, extinction
