"""Quantum efficiencies by name: sets of channels that filter patterns are made of."""

from __future__ import annotations

from functools import cache
from typing import Final

import numpy as np

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry import Spectrum, colour_matching_functions
from fullwell.sensor.filters import logistic_edge
from fullwell.sensor.parameters import ColorFilterArray
from fullwell.sensor.tables import read_table

__all__ = ["CHANNEL_SET_NAMES", "cfa_of", "channel_set"]

CHANNEL_SET_NAMES: Final = ("ideal", "imx363", "mt9v024", "representative")

_UNIT: Final = "e- photon^-1"
_IDEAL_RANGE_NM: Final = np.array([300.0, 1100.0])

_IMX363_CHANNEL_CORRECTION: Final = np.array([[0.56, 0.08, 0.01], [0.0, 0.59, 0.0], [0.0, 0.25, 0.71]])
"""Channel gains and crosstalk of the Pixel 4a's camera: the row (r, g, b) of a wavelength is multiplied by it (lyu2022)."""

_SILICON_DEPTH_NM: Final = 5000.0
_SURFACE_TRANSMITTANCE: Final = 0.68
"""Representative of a front-illuminated pixel without colour filter: a peak of 0.67, above the MT9V024's colour channels."""


def channel_set(name: str, *, path: str = "channels") -> dict[str, Spectrum]:
    """Return quantum efficiencies by channel name; case does not matter.

    "imx363": R, G, B, with the sensor's infrared filter (lyu2022).
    "mt9v024": R, G, B of the sensor's data sheet, 390-710 nm, and clear (C, W) as "representative" has it; no infrared filter.
    "representative": R, G, B, Y, Cy, NIR and clear (C, W), 380-1100 nm, no infrared filter: silicon of 5 um behind a surface
    that transmits 0.68, and filters with logistic edges. Made up to be typical; no product's.
    "ideal": R, G, B as the CIE 1931 standard observer sees, clear (C, W) with every photon an electron.

    Raises FieldError, naming the nearest known set, where `name` is not known; `path` is the field that asked.
    """
    makers = {"ideal": _ideal, "imx363": _imx363, "mt9v024": _mt9v024, "representative": _representative}
    maker = makers.get(name.casefold())
    if maker is None:
        raise FieldError(unknown_name_message("channel set", name, makers), path=path, value=name)
    return dict(maker())


def cfa_of(pattern: tuple[tuple[str, ...], ...], channels: dict[str, Spectrum], *, path: str = "cfa") -> ColorFilterArray:
    """Return the colour filter array of a pattern with the channels that it uses, in the order of `channels`.

    Raises FieldError, naming the nearest known channel, where the pattern uses one that is not there.
    """
    used = [name for row in pattern for name in row]
    for name in used:
        if name not in channels:
            raise FieldError(unknown_name_message("channel", name, channels), path=path, value=name)
    return ColorFilterArray(pattern, tuple((name, curve) for name, curve in channels.items() if name in used))


@cache
def _imx363() -> tuple[tuple[str, Spectrum], ...]:
    wavelength_nm, columns = read_table("imx363.csv")
    corrected = (columns[:, :3] * columns[:, 3:]) @ _IMX363_CHANNEL_CORRECTION
    source = "ISETCam (MIT, 2021-06-05), filters x infrared filter x channel correction of lyu2022"
    return tuple(
        (name, Spectrum(wavelength_nm, corrected[:, k], outside="zero", unit=_UNIT, source=source))
        for k, name in enumerate("RGB")
    )


@cache
def _mt9v024() -> tuple[tuple[str, Spectrum], ...]:
    wavelength_nm, columns = read_table("imx363.csv")
    source = "MT9V024 data sheet, digitised for ISETCam (MIT, 2021-06-05)"
    colours = [
        (name, Spectrum(wavelength_nm, columns[:, k], outside="zero", unit=_UNIT, source=source))
        for k, name in enumerate("RGB")
    ]
    return (*colours, ("C", _clear()), ("W", _clear()))


def _clear() -> Spectrum:
    wavelength_nm, columns = read_table("silicon.csv")
    absorbed = 1.0 - np.exp(-4.0 * np.pi * columns[:, 0] * _SILICON_DEPTH_NM / wavelength_nm)
    source = f"representative: {_SURFACE_TRANSMITTANCE:g} of the light, absorbed in 5 um of silicon (schinke2015)"
    return Spectrum(wavelength_nm, _SURFACE_TRANSMITTANCE * absorbed, outside="zero", unit=_UNIT, source=source)


@cache
def _representative() -> tuple[tuple[str, Spectrum], ...]:
    """Dye filters open again in the near infrared; the visible blocker of NIR does not let the visible through."""
    clear = _clear()
    opens = logistic_edge(((800.0, 60.0),), source="near infrared", top=0.9)
    filters = {
        "R": logistic_edge(((588.0, 20.0),), source="red filter", floor=0.03, top=0.95),
        "G": _either(logistic_edge(((495.0, 40.0), (585.0, -45.0)), source="green filter", floor=0.04, top=0.95), opens),
        "B": _either(logistic_edge(((400.0, 40.0), (500.0, -45.0)), source="blue filter", floor=0.03, top=0.85), opens),
        "Y": logistic_edge(((500.0, 40.0),), source="yellow filter", floor=0.04, top=0.96),
        "Cy": _either(logistic_edge(((395.0, 40.0), (580.0, -50.0)), source="cyan filter", floor=0.04, top=0.92), opens),
        "NIR": logistic_edge(((800.0, 40.0),), source="visible blocker", floor=0.005, top=0.92),
    }
    channels = []
    for name, transmittance in filters.items():
        product = clear.times(transmittance, unit=_UNIT)
        values = np.clip(product.values, 0.0, 1.0)
        source = f"representative {transmittance.source} on {clear.source}"
        channels.append((name, Spectrum(product.wavelength_nm, values, outside="zero", unit=_UNIT, source=source)))
    return (*channels, ("C", clear), ("W", clear))


def _either(one: Spectrum, other: Spectrum) -> Spectrum:
    """Return what gets through where either of two mechanisms lets it: 1 - (1 - a)(1 - b), on their common grid."""
    values = 1.0 - (1.0 - one.values) * (1.0 - other.values)
    return Spectrum(one.wavelength_nm, values, one.outside, one.unit, one.source)


@cache
def _ideal() -> tuple[tuple[str, Spectrum], ...]:
    """Channels that meet the Luther condition, and clear.

    The observer's functions weigh energy, electrons count photons: dividing by the wavelength turns one into the other. Each
    colour is scaled to a peak of 1.
    """
    channels = []
    for name, curve in zip("RGB", colour_matching_functions(), strict=True):
        per_photon = curve.values / curve.wavelength_nm
        efficiency = per_photon / np.max(per_photon)
        source = "CIE 1931 standard observer over wavelength, peak 1"
        channels.append((name, Spectrum(curve.wavelength_nm, efficiency, outside="zero", unit=_UNIT, source=source)))
    everything = Spectrum(_IDEAL_RANGE_NM, np.ones(2), outside="zero", unit=_UNIT, source="ideal")
    return (*channels, ("C", everything), ("W", everything))
