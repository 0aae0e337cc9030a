"""Filters before the photodetector: colour filters, infrared cut, anything with a transmittance."""

from __future__ import annotations

from typing import Final

import numpy as np

from fullwell.radiometry import Spectrum
from fullwell.sensor.checks import check_positive
from fullwell.sensor.parameters import ColorFilterArray

__all__ = ["infrared_cut", "logistic_edge", "with_filters"]

_STEP_NM: Final = 2.0
_FIRST_NM, _LAST_NM = 380.0, 1100.0


def with_filters(cfa: ColorFilterArray, *transmittances: Spectrum) -> ColorFilterArray:
    """Return the colour filter array with every channel's quantum efficiency times the transmittances, in [0, 1].

    Products of piecewise linear curves whose band means are those of the exact product (Spectrum.times).
    """
    channels = []
    for name, efficiency in cfa.channels:
        product = efficiency
        for transmittance in transmittances:
            product = product.times(transmittance, unit=efficiency.unit)
        within = np.clip(product.values, 0.0, 1.0)
        channels.append((name, Spectrum(product.wavelength_nm, within, product.outside, product.unit, product.source)))
    return ColorFilterArray(cfa.pattern, tuple(channels))


def infrared_cut(cut_nm: float, *, width_nm: float = 10.0) -> Spectrum:
    """Return the transmittance of an infrared cut filter: 0.5 at `cut_nm`, 0.9 to 0.1 within `width_nm`.

    A logistic curve, representative of absorbing glass and coatings; real ones differ in slope and residual ripple.
    """
    check_positive("cut_nm", cut_nm, of="the infrared cut filter")
    check_positive("width_nm", width_nm, of="the infrared cut filter")
    return logistic_edge(((cut_nm, -width_nm),), source=f"infrared cut at {cut_nm:g} nm, {width_nm:g} nm wide")


def logistic_edge(edges: tuple[tuple[float, float], ...], *, source: str, floor: float = 0.0, top: float = 1.0) -> Spectrum:
    """Return a transmittance: `floor` + (`top` - `floor`) x the product of logistic edges, 380-1100 nm, held beyond.

    Each edge is (wavelength of the half value [nm], 10-90 % width [nm]); a negative width falls towards longer wavelengths.
    """
    wavelength_nm = np.arange(_FIRST_NM, _LAST_NM + _STEP_NM / 2, _STEP_NM)
    product = np.ones_like(wavelength_nm)
    for half_nm, width_nm in edges:
        # ln 9 on each side of the half value leads from 10 to 90 %.
        steepness = 2.0 * np.log(9.0) / width_nm
        product *= 0.5 * (1.0 + np.tanh(0.5 * steepness * (wavelength_nm - half_nm)))
    return Spectrum(wavelength_nm, floor + (top - floor) * product, outside="hold", unit="1", source=source)
