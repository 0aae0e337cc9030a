"""Materials for people: their colour on a display, the colour of their light, and points to plot."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.materials.curves import WAVELENGTH_NM, Array
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.materials.surface import body_seen_through_coat, normal_transmittance
from fullwell.radiometry.illuminants import illuminant
from fullwell.radiometry.metals import normal_reflectance
from fullwell.radiometry.photometry import tristimulus
from fullwell.radiometry.spectrum import Spectrum
from fullwell.radiometry.upsample import linear_to_srgb, srgb_to_linear

__all__ = ["display_lab", "display_srgb", "emission_srgb", "lab_of_srgb", "seen_spectrum", "spectrum_points"]

Colour = tuple[float, float, float]


def display_srgb(material: SpectralMaterial) -> Colour:
    """Return the sRGB-encoded colour, 0 to 1, of the unlit material under D65, white being a perfect diffuser.

    Coated bodies without the gloss of their coat, metals and mirrors by their reflectance at normal incidence, clear glass by
    what a pane lets through. Colours outside sRGB are clipped. For swatches and as base colour of web viewers.
    """
    return _encoded(np.clip(_linear_srgb(_xyz(material)), 0.0, 1.0))


def emission_srgb(material: SpectralMaterial) -> Colour | None:
    """Return the sRGB-encoded colour of a lamp's light, its largest component 1, or None where it is no lamp."""
    if material.lamp is None:
        return None
    linear = np.maximum(_linear_srgb(tristimulus(material.lamp.spd)), 0.0)
    return _encoded(linear / linear.max())


def _encoded(linear: Array) -> Colour:
    # Colours go into digests of assets; their last bits differ between machines.
    red, green, blue = (round(float(value), 5) for value in linear_to_srgb(linear))
    return red, green, blue


def display_lab(material: SpectralMaterial) -> Array:
    """Return CIE 1976 L*, a*, b* of the material under D65, not clipped to sRGB."""
    return _lab(_xyz(material))


def lab_of_srgb(rgb: tuple[float, float, float]) -> Array:
    """Return CIE 1976 L*, a*, b*, white D65, of an sRGB-encoded colour."""
    return _lab(_srgb_matrix() @ srgb_to_linear(rgb))


def seen_spectrum(material: SpectralMaterial) -> Spectrum:
    """Return what share of light the material sends back, 380 to 1000 nm, as a spectrophotometer at normal incidence sees it.

    Gloss of a coat is left out; of clear glass it is the reflection of one face. A Spectrum to integrate or to plot.
    """
    return Spectrum(WAVELENGTH_NM, _seen(material), outside="hold", source=material.source)


def spectrum_points(material: SpectralMaterial) -> list[tuple[float, float, str]]:
    """Return one curve to plot: (wavelength [nm], value, what it is), 380 to 1000 nm by 5 nm.

    Lamps: emission, relative to its highest mean over 5 nm. Others: `seen_spectrum`.
    """
    if material.lamp is not None:
        edges = np.append(WAVELENGTH_NM - 2.5, WAVELENGTH_NM[-1] + 2.5)
        values, label = material.lamp.spd.integral(edges), "relative emission"
        values = values / values.max()
    else:
        values, label = _seen(material), "reflectance"
    return [(float(nm), float(value), label) for nm, value in zip(WAVELENGTH_NM, values, strict=True)]


def _seen(material: SpectralMaterial) -> Array:
    if material.kind == "metal" and material.eta is not None and material.k is not None:
        return normal_reflectance(material.eta.at(WAVELENGTH_NM), material.k.at(WAVELENGTH_NM))
    if material.reflectance is None:
        return np.full_like(WAVELENGTH_NM, 1.0 - float(normal_transmittance(material.interior_index)))
    body = material.reflectance.at(WAVELENGTH_NM)
    return body_seen_through_coat(body, material.interior_index) if material.kind == "coated" else body


def _xyz(material: SpectralMaterial) -> Array:
    """Return X, Y, Z under D65 with Y = 1 for a perfect diffuser."""
    light = illuminant("D65")
    if material.kind == "glass":
        through = float(normal_transmittance(material.interior_index)) ** 2
        return np.asarray(through * tristimulus(light) / tristimulus(light)[1])
    return np.asarray(tristimulus(light.times(seen_spectrum(material))) / tristimulus(light)[1])


def _lab(xyz: NDArray[np.float64]) -> Array:
    """CIE 15:2018, section 8.2.1."""
    white = tristimulus(illuminant("D65"))
    ratio = xyz / (white / white[1])
    root = np.where(ratio > (6.0 / 29.0) ** 3, np.cbrt(ratio), ratio * (29.0 / 6.0) ** 2 / 3.0 + 4.0 / 29.0)
    return np.array([116.0 * root[1] - 16.0, 500.0 * (root[0] - root[1]), 200.0 * (root[1] - root[2])])


def _linear_srgb(xyz: NDArray[np.float64]) -> Array:
    return np.asarray(np.linalg.solve(_srgb_matrix(), xyz))


@cache
def _srgb_matrix() -> Array:
    """Return the matrix from linear sRGB to X, Y, Z: primaries of ITU-R BT.709 (IEC 61966-2-1:1999), white D65 with Y = 1."""
    x, y = np.array([[0.64, 0.30, 0.15], [0.33, 0.60, 0.06]])
    primaries = np.stack([x / y, np.ones(3), (1.0 - x - y) / y])
    white = tristimulus(illuminant("D65"))
    return np.asarray(primaries * np.linalg.solve(primaries, white / white[1]))
