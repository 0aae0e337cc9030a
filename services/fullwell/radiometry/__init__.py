"""Spectra, wavelength grids, photometry and the conversions between energy and photons."""

from fullwell.radiometry.grid import DEFAULT_GRID, MAX_WAVELENGTH_NM, MIN_WAVELENGTH_NM, WavelengthGrid
from fullwell.radiometry.images import RadianceImage
from fullwell.radiometry.spectrum import Spectrum

__all__ = [
    "DEFAULT_GRID",
    "MAX_WAVELENGTH_NM",
    "MIN_WAVELENGTH_NM",
    "RadianceImage",
    "Spectrum",
    "WavelengthGrid",
]
