"""Pigments and dyes: absorption and scattering, from which the colour of paint, plastic, print and cloth follows."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

import numpy as np

from fullwell.assets.materials.curves import WAVELENGTH_NM, Array, band, edge, layer_reflectance

__all__ = ["PIGMENT_SOURCE", "mixture_reflectance", "pigment_names"]

PIGMENT_SOURCE = (
    "Kubelka and Munk 1931 with the absorption bands of the pigments in Herbst and Hunger 2004, Industrial Organic Pigments, "
    "Buxbaum and Pfaff 2005, Industrial Inorganic Pigments, and Cornell and Schwertmann 2003, The Iron Oxides"
)


def pigment_names() -> tuple[str, ...]:
    """Return the names that a mixture may hold."""
    return tuple(_pigments())


def mixture_reflectance(amounts: Mapping[str, float]) -> Array:
    """Return the reflectance, at WAVELENGTH_NM, of an opaque layer that holds pigments in these relative amounts.

    Absorption and scattering add up (Duncan 1940). Unit amount of rutile scatters 1 at 550 nm. Surface reflection is left out.
    """
    absorption, scattering = np.zeros_like(WAVELENGTH_NM), np.zeros_like(WAVELENGTH_NM)
    for name, amount in amounts.items():
        absorbs, scatters = _pigments()[name]
        absorption = absorption + amount * absorbs
        scattering = scattering + amount * scatters
    return layer_reflectance(absorption, scattering)


@cache
def _pigments() -> Mapping[str, tuple[Array, Array]]:
    relative = WAVELENGTH_NM / 550.0
    small, large = relative**-1.5, relative**-0.5
    water = band(970.0, 22.0)
    table = {
        # Rutile: band gap 3.0 eV with an exponential tail; scatters most where its size is tuned, less beyond.
        "rutile": (0.0012 + 4.0 * np.exp(-(WAVELENGTH_NM - 386.0) / 7.5), relative**-0.9),
        "chalk": (0.002 + 0.01 * np.exp(-(WAVELENGTH_NM - 400.0) / 60.0), 0.25 * large),
        "carbon_black": (30.0 * relative**-0.45, 0.09 * relative**-1.0),
        # Hematite: pair transitions at 530 nm, crystal field bands at 650 and 870 nm.
        "iron_oxide_red": (
            edge(570.0, 13.0, 7.0) + band(530.0, 30.0, 3.5) + band(655.0, 45.0, 0.22) + band(870.0, 62.0, 0.22) + 0.06,
            0.85 * large,
        ),
        # Goethite: 420 and 480 nm, crystal field bands at 650 and 920 nm.
        "iron_oxide_yellow": (
            edge(500.0, 14.0, 3.2) + band(430.0, 40.0, 1.2) + band(655.0, 50.0, 0.085) + band(920.0, 70.0, 0.13) + 0.02,
            0.6 * large,
        ),
        # Chromium oxide: crystal field bands at 460 and 600 nm, clear beyond 720 nm.
        "chromium_oxide": (band(455.0, 42.0, 2.4) + band(600.0, 42.0, 1.9) + edge(392.0, 10.0, 2.0) + 0.09, 0.9 * large),
        # Copper phthalocyanine, beta form: Q bands at 610 and 710 nm, Soret band in the near ultraviolet; clear beyond 800 nm.
        "phthalo_blue": (
            band(620.0, 38.0, 7.0) + band(712.0, 30.0, 5.5) + band(560.0, 26.0, 1.6) + band(350.0, 40.0, 4.0) + 0.05,
            0.03 * small,
        ),
        "phthalo_green": (
            band(645.0, 45.0, 6.5) + band(735.0, 30.0, 2.5) + band(595.0, 25.0, 1.5) + band(385.0, 48.0, 5.0) + 0.05,
            0.03 * small,
        ),
        "ultramarine": (band(600.0, 48.0, 2.8) + band(540.0, 35.0, 0.7) + 0.02, 0.05 * small),
        # Diketopyrrolopyrrole red: absorbs 420 to 580 nm, steep flank.
        "dpp_red": (edge(569.0, 8.5, 5.0) - edge(405.0, 14.0, 0.8) + 0.008, 0.32 * small),
        "organic_orange": (edge(547.0, 8.0, 4.0) - edge(400.0, 18.0, 1.0) + 0.01, 0.3 * small),
        "bismuth_vanadate": (edge(478.0, 9.0, 4.5) + 0.012, 0.75 * relative**-0.7),
        "organic_yellow": (edge(488.0, 8.0, 6.0) + 0.01, 0.1 * small),
        # A fibre or sheet of cellulose: yellowish tail, water at 970 nm.
        "fibre": (0.006 + 0.03 * np.exp(-(WAVELENGTH_NM - 380.0) / 55.0) + 0.006 * water, large),
        "bleached_fibre": (0.005 + 0.012 * np.exp(-(WAVELENGTH_NM - 380.0) / 25.0) + 0.005 * water, large),
        # Dyes scatter nothing; their bands end before 800 nm, and the fibre shows.
        "black_dye": (edge(735.0, 18.0, 9.0) + 0.05, np.zeros_like(relative)),
        "indigo": (
            band(660.0, 45.0, 4.0) + band(600.0, 45.0, 2.6) + band(530.0, 45.0, 1.4) + edge(425.0, 25.0, 0.8),
            0.0 * relative,
        ),
        "navy_dye": (
            band(600.0, 55.0, 5.0) + band(670.0, 30.0, 3.0) + band(520.0, 35.0, 2.5) + edge(450.0, 25.0, 1.8) + 0.03,
            0.0 * relative,
        ),
        "red_dye": (edge(583.0, 9.0, 4.0) - edge(405.0, 20.0, 0.6) + 0.01, 0.0 * relative),
        "green_dye": (
            band(655.0, 45.0, 4.0) + band(600.0, 30.0, 1.8) + edge(478.0, 14.0, 4.5) + 0.1,
            0.0 * relative,
        ),
        "yellow_dye": (edge(488.0, 10.0, 3.0) + 0.005, 0.0 * relative),
        "orange_dye": (edge(557.0, 9.0, 4.0) - edge(400.0, 20.0, 0.5) + 0.005, 0.0 * relative),
        # Melanins fall steadily with wavelength (Jacques 2013).
        "eumelanin": (relative**-3.3, 0.0 * relative),
        "pheomelanin": (relative**-4.75, 0.0 * relative),
        "keratin": (0.012 + 0.08 * np.exp(-(WAVELENGTH_NM - 380.0) / 60.0) + 0.008 * water, large),
    }
    return MappingProxyType(table)
