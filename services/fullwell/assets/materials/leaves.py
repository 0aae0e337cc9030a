"""Leaves: reflectance from their chemistry, as plates of pigment, water and dry matter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import exp1

from fullwell.assets.materials.curves import WAVELENGTH_NM, Array
from fullwell.assets.materials.surface import mean_transmittance
from fullwell.assets.materials.tables import material_table

__all__ = ["LEAF_SOURCE", "Leaf", "leaf_reflectance", "leaf_transmittance", "water_absorption_per_cm"]

LEAF_SOURCE = (
    "plate model of Allen et al. 1969 and Jacquemoud and Baret 1990 with the absorption coefficients of PROSPECT-D "
    "(Feret et al. 2017)"
)
_ROUGHNESS_CONE_DEG = 40.0
"""Light enters the first plate from within this cone: the wax is rough (Jacquemoud and Baret 1990)."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """Chemistry of a leaf.

    Attributes
    ----------
    layers
        Structure: number of plates, 1 (compact) to 2.5 (spongy, or many needles).
    chlorophyll_ug_per_cm2, carotenoids_ug_per_cm2, anthocyanins_ug_per_cm2
        Pigment per leaf area.
    water_cm, dry_matter_g_per_cm2
        Equivalent water thickness; mass per area.
    brown
        Amount of brown pigment, 0 (alive) to 4 (dead).
    """

    layers: float
    chlorophyll_ug_per_cm2: float
    carotenoids_ug_per_cm2: float
    anthocyanins_ug_per_cm2: float = 0.0
    water_cm: float = 0.01
    dry_matter_g_per_cm2: float = 0.006
    brown: float = 0.0


def leaf_reflectance(leaf: Leaf) -> Array:
    """Return the reflectance of one leaf, surface included, at WAVELENGTH_NM; nothing behind it."""
    return _leaf_optics(leaf)[0]


def leaf_transmittance(leaf: Leaf) -> Array:
    """Return what one leaf lets through, at WAVELENGTH_NM."""
    return _leaf_optics(leaf)[1]


def water_absorption_per_cm() -> Array:
    """Return the absorption coefficient of water [cm^-1] at WAVELENGTH_NM."""
    return _constituents()["water_per_cm"]


def _leaf_optics(leaf: Leaf) -> tuple[Array, Array]:
    """Return reflectance and transmittance: one plate that light enters from a cone, and `layers` - 1 in diffuse light."""
    table = _constituents()
    absorption = (
        leaf.chlorophyll_ug_per_cm2 * table["chlorophyll_cm2_per_ug"]
        + leaf.carotenoids_ug_per_cm2 * table["carotenoids_cm2_per_ug"]
        + leaf.anthocyanins_ug_per_cm2 * table["anthocyanins_cm2_per_ug"]
        + leaf.brown * table["brown"]
        + leaf.water_cm * table["water_per_cm"]
        + leaf.dry_matter_g_per_cm2 * table["dry_matter_cm2_per_g"]
    ) / leaf.layers
    # Transmittance of an absorbing slab for diffuse light (Allen et al. 1969, eq. 15).
    slab = (1.0 - absorption) * np.exp(-absorption) + absorption**2 * exp1(absorption)
    index = table["refractive_index"]
    diffuse_in, cone_in = mean_transmittance(index), mean_transmittance(index, _ROUGHNESS_CONE_DEG)
    out = diffuse_in / index**2
    inside = 1.0 - out
    trapped = 1.0 - (inside * slab) ** 2
    first_through = cone_in * slab * out / trapped
    first_back = 1.0 - cone_in + inside * slab * first_through
    through = diffuse_in * slab * out / trapped
    back = 1.0 - diffuse_in + inside * slab * through
    rest_back, rest_through = _pile(back, through, leaf.layers - 1.0)
    between = 1.0 - rest_back * back
    reflectance = first_back + first_through * rest_back * through / between
    return np.asarray(reflectance), np.asarray(first_through * rest_through / between)


def _pile(back: Array, through: Array, layers: float) -> tuple[Array, Array]:
    """Return reflectance and transmittance of a pile of equal plates, any real number of them (Stokes 1862)."""
    root = np.sqrt((1.0 + back + through) * (1.0 + back - through) * (1.0 - back + through) * (1.0 - back - through))
    a = (1.0 + back**2 - through**2 + root) / (2.0 * back)
    b = ((1.0 - back**2 + through**2 + root) / (2.0 * through)) ** layers
    divisor = a**2 * b**2 - 1.0
    return np.asarray(a * (b**2 - 1.0) / divisor), np.asarray(b * (a**2 - 1.0) / divisor)


@cache
def _constituents() -> Mapping[str, Array]:
    """Return the table at WAVELENGTH_NM; its values at 400 nm hold below."""
    table = material_table("leaf")["constituents"]["leaf"]
    columns = [name for name in table if name not in ("first_nm", "step_nm")]
    known_nm = table["first_nm"] + table["step_nm"] * np.arange(len(table[columns[0]]))
    return {name: np.interp(WAVELENGTH_NM, known_nm, table[name]) for name in columns}
