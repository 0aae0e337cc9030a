"""Human skin: dermis that scatters and holds blood, under an epidermis that holds melanin."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from fullwell.assets.materials.curves import WAVELENGTH_NM, Array, layer_over, layer_reflectance
from fullwell.assets.materials.leaves import water_absorption_per_cm
from fullwell.assets.materials.tables import material_table

__all__ = ["SKIN_INDEX", "SKIN_SOURCE", "skin_body_reflectance"]

SKIN_SOURCE = (
    "layers after Jacques 1998 and 2013 (melanin, bloodless skin, scattering) with haemoglobin as compiled by Prahl 1998 and "
    "water of Feret et al. 2017"
)
SKIN_INDEX = 1.4
_EPIDERMIS_CM = 0.006
_HAEMOGLOBIN_MOL_PER_L = 150.0 / 64500.0
_WATER_SHARE = 0.65


def skin_body_reflectance(*, melanin_share: float, blood_share: float, oxygenation: float = 0.75) -> Array:
    """Return the reflectance of skin below its surface, at WAVELENGTH_NM.

    Parameters
    ----------
    melanin_share
        Volume of melanosomes in the epidermis: 0.013-0.063 light, 0.11-0.16 medium, 0.18-0.43 dark (Jacques 1998).
    blood_share
        Volume of blood in the dermis, 0.002-0.01.
    oxygenation
        Share of haemoglobin that carries oxygen.

    Layers of Kubelka and Munk, the dermis infinite, with K = 2 mu_a and S = 3/4 mu_s' (Star et al. 1988).
    """
    tissue = 0.244 + 85.3 * np.exp(-(WAVELENGTH_NM - 154.0) / 66.2)
    melanin = 6.6e11 * WAVELENGTH_NM**-3.33
    blood = math.log(10.0) * _HAEMOGLOBIN_MOL_PER_L * _haemoglobin(oxygenation)
    dermis = blood_share * blood + _WATER_SHARE * water_absorption_per_cm() + (1.0 - blood_share) * tissue
    scattering = 46.0 * (WAVELENGTH_NM / 500.0) ** -1.421
    epidermis = melanin_share * melanin + (1.0 - melanin_share) * tissue
    base = layer_reflectance(2.0 * dermis, 0.75 * scattering)
    return layer_over(base, 2.0 * epidermis, 0.75 * scattering, thickness_cm=_EPIDERMIS_CM)


@cache
def _haemoglobin(oxygenation: float) -> Array:
    """Return the decadic molar extinction [cm^-1 (mol / l)^-1] at WAVELENGTH_NM."""
    table = material_table("haemoglobin")["tables"]["per_cm_per_mol_per_l"]
    mixed = oxygenation * np.array(table["oxygenated"]) + (1.0 - oxygenation) * np.array(table["deoxygenated"])
    return np.interp(WAVELENGTH_NM, table["wavelength_nm"], mixed)
