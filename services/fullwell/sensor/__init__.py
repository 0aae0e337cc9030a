"""From irradiance to digital numbers: one module per effect, `model` holds their order."""

from fullwell.scene.images import CaptureRecord, OpticalImage, RawImage
from fullwell.sensor.captures import capture, expected_electrons, expose, exposure_time, readout_model, reference_model
from fullwell.sensor.catalogue import sensor, sensor_names
from fullwell.sensor.cfa import PATTERN_NAMES, cfa_pattern
from fullwell.sensor.channel_sets import CHANNEL_SET_NAMES, cfa_of, channel_set
from fullwell.sensor.crosstalk import mix_channels
from fullwell.sensor.dark_current import ArrheniusLaw, DarkCurrentLaw, DoublingLaw
from fullwell.sensor.exposure import saturation_electrons
from fullwell.sensor.exposures import (
    AutoExposure,
    BracketExposure,
    BurstExposure,
    ChannelExposure,
    Exposure,
    FixedExposure,
    SingleExposure,
)
from fullwell.sensor.filters import infrared_cut, with_filters
from fullwell.sensor.fixed_pattern import fixed_pattern_stream
from fullwell.sensor.microlens import ChiefRayFalloff, PixelFalloff, RadialFalloff
from fullwell.sensor.model import dark_noise_e, electrons_per_dn, photo_electron_rate
from fullwell.sensor.parameters import ColorFilterArray, SensorModel
from fullwell.sensor.photodiodes import Photodiode, Readout
from fullwell.sensor.quantum_efficiency import ChannelCurrents, channel_currents
from fullwell.sensor.reset_noise import thermal_reset_noise_e

__all__ = [
    "CHANNEL_SET_NAMES",
    "PATTERN_NAMES",
    "ArrheniusLaw",
    "AutoExposure",
    "BracketExposure",
    "BurstExposure",
    "CaptureRecord",
    "ChannelCurrents",
    "ChannelExposure",
    "ChiefRayFalloff",
    "ColorFilterArray",
    "DarkCurrentLaw",
    "DoublingLaw",
    "Exposure",
    "FixedExposure",
    "OpticalImage",
    "Photodiode",
    "PixelFalloff",
    "RadialFalloff",
    "RawImage",
    "Readout",
    "SensorModel",
    "SingleExposure",
    "capture",
    "cfa_of",
    "cfa_pattern",
    "channel_currents",
    "channel_set",
    "dark_noise_e",
    "electrons_per_dn",
    "expected_electrons",
    "expose",
    "exposure_time",
    "fixed_pattern_stream",
    "infrared_cut",
    "mix_channels",
    "photo_electron_rate",
    "readout_model",
    "reference_model",
    "saturation_electrons",
    "sensor",
    "sensor_names",
    "thermal_reset_noise_e",
    "with_filters",
]
