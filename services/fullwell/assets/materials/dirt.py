"""Dust and mud on surfaces: part of the surface covered by opaque grains, the rest clean.

A share c of a surface is hidden by grains of soil that scatter evenly; what comes back is the mean of both by area, which
is linear in c. Grains on a clear coat hide its gloss as well: the coat that is left reflects (1 - c) times as much along its
normal, which is a coat of a smaller index. The waviness of a film of grains widens the gloss.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.materials.curves import WAVELENGTH_NM, Array, reflectance_spectrum
from fullwell.assets.materials.pigments import mixture_reflectance
from fullwell.assets.materials.surface import mean_transmittance, normal_transmittance
from fullwell.assets.materials.tables import measured_reflectance
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["MOST_COAT", "DirtyCoat", "dirty_coat", "dirty_reflectance", "dust", "grime"]

MOST_COAT: Final = 0.96
"""From this coverage on a coat is no more: what is left is a diffuse surface of dust."""
_FILM_ALPHA: Final = 0.4
"""GGX alpha of gloss through a film that covers nearly everything; grows with the square root of coverage, as variances add."""
_TYRE_SHARE: Final = 0.35
"""Of the grains on roads: worn tyre and soot, beside soil."""


@cache
def dust() -> Spectrum:
    """Return the reflectance of dry mud and dust, as thrown on vehicles: measured soil."""
    values, source = measured_reflectance("soil/earth")
    return reflectance_spectrum(values, source)


@cache
def grime() -> Spectrum:
    """Return the reflectance of dirt on roads: soil with worn rubber and soot in it."""
    values, source = measured_reflectance("soil/earth")
    rubber = mixture_reflectance({"carbon_black": 0.3, "chalk": 2.8, "iron_oxide_yellow": 0.05})
    return reflectance_spectrum((1 - _TYRE_SHARE) * values + _TYRE_SHARE * rubber, f"{source}, with worn rubber")


def dirty_reflectance(clean: Spectrum, dirt: Spectrum, coverage: float) -> Spectrum:
    """Return the reflectance of a diffuse surface of which a share `coverage` in [0, 1] is hidden by dirt."""
    values = (1.0 - coverage) * clean.at(WAVELENGTH_NM) + coverage * dirt.at(WAVELENGTH_NM)
    return _like(clean, values, coverage)


@dataclass(frozen=True, slots=True, eq=False)
class DirtyCoat:
    """A body under a clear coat, as the renderer's plastic: body reflectance, GGX alpha and index of the coat."""

    body: Spectrum
    roughness: float
    interior_index: float


def dirty_coat(body: Spectrum, roughness: float, interior_index: float, dirt: Spectrum, coverage: float) -> DirtyCoat:
    """Return a coated surface of which a share `coverage` in [0, MOST_COAT] is hidden by dirt that lies on the coat.

    Seen without its gloss it is (1 - c) of the clean surface and c of dirt; along the normal its gloss is (1 - c) of the clean.
    """
    gloss = (1.0 - coverage) * ((interior_index - 1.0) / (interior_index + 1.0)) ** 2
    index = (1.0 + np.sqrt(gloss)) / (1.0 - np.sqrt(gloss))
    seen = (1.0 - coverage) * _seen(body.at(WAVELENGTH_NM), interior_index) + coverage * dirt.at(WAVELENGTH_NM)
    through, back = _coat(index)
    values = np.clip(seen / (through + seen * back), 0.0, 1.0)
    alpha = np.sqrt((1.0 - coverage) * roughness**2 + coverage * _FILM_ALPHA**2)
    return DirtyCoat(_like(body, values, coverage), float(alpha), float(index))


def _seen(body: Array, index: float) -> Array:
    through, back = _coat(index)
    return np.asarray(through * body / (1.0 - back * body))


@cache
def _coat(index: float) -> tuple[float, float]:
    """Return what a coat passes in and out along the normal, and what it throws back inside (Saunderson 1942)."""
    mean = float(mean_transmittance(index))
    return mean * float(normal_transmittance(index)) / index**2, 1.0 - mean / index**2


def _like(clean: Spectrum, values: NDArray[np.float64], coverage: float) -> Spectrum:
    note = f"{clean.source}, {100 * coverage:.0f} % under dirt"
    return Spectrum(WAVELENGTH_NM, values, outside="hold", source=note, upsampled=clean.upsampled)
