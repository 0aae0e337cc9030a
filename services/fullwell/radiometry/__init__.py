"""Spectra, wavelength grids, photometry and the conversions between energy and photons."""

from fullwell.radiometry.grid import DEFAULT_GRID, MAX_WAVELENGTH_NM, MIN_WAVELENGTH_NM, WavelengthGrid
from fullwell.radiometry.illuminants import (
    blackbody,
    coverage_note,
    daylight,
    illuminant,
    illuminant_names,
    planck_radiance,
)
from fullwell.radiometry.images import ChannelRadiance, RadianceImage
from fullwell.radiometry.metals import metal, metal_names, normal_reflectance
from fullwell.radiometry.photometry import (
    chromaticity,
    colour_matching_functions,
    correlated_colour_temperature_k,
    illuminance_lux,
    luminance_cd_m2,
    luminous_efficiency,
    luminous_flux_lm,
    scale_to_flux,
    scale_to_illuminance,
    scale_to_luminance,
    tristimulus,
)
from fullwell.radiometry.photons import band_photons, energy_to_photons, photon_energy_j, photons_to_energy
from fullwell.radiometry.reflectances import COLORCHECKER_PATCHES, reflectance, reflectance_names
from fullwell.radiometry.sky import SkyRadiance, clear_sky
from fullwell.radiometry.spectrum import Spectrum
from fullwell.radiometry.upsample import (
    linear_to_srgb,
    reflectance_from_linear_srgb,
    reflectance_from_srgb,
    srgb_to_linear,
)

__all__ = [
    "COLORCHECKER_PATCHES",
    "DEFAULT_GRID",
    "MAX_WAVELENGTH_NM",
    "MIN_WAVELENGTH_NM",
    "ChannelRadiance",
    "RadianceImage",
    "SkyRadiance",
    "Spectrum",
    "WavelengthGrid",
    "band_photons",
    "blackbody",
    "chromaticity",
    "clear_sky",
    "colour_matching_functions",
    "correlated_colour_temperature_k",
    "coverage_note",
    "daylight",
    "energy_to_photons",
    "illuminance_lux",
    "illuminant",
    "illuminant_names",
    "linear_to_srgb",
    "luminance_cd_m2",
    "luminous_efficiency",
    "luminous_flux_lm",
    "metal",
    "metal_names",
    "normal_reflectance",
    "photon_energy_j",
    "photons_to_energy",
    "planck_radiance",
    "reflectance",
    "reflectance_from_linear_srgb",
    "reflectance_from_srgb",
    "reflectance_names",
    "scale_to_flux",
    "scale_to_illuminance",
    "scale_to_luminance",
    "srgb_to_linear",
    "tristimulus",
]
