"""From irradiance to digital numbers: one module per effect, `model` holds their order."""

from fullwell.scene.images import OpticalImage, RawImage
from fullwell.sensor.catalogue import sensor, sensor_names
from fullwell.sensor.exposure import saturation_electrons
from fullwell.sensor.fixed_pattern import fixed_pattern_stream
from fullwell.sensor.model import capture, expected_electrons, expose, exposure_time, photo_electron_rate
from fullwell.sensor.parameters import AutoExposure, ColorFilterArray, Exposure, FixedExposure, SensorModel

__all__ = [
    "AutoExposure",
    "ColorFilterArray",
    "Exposure",
    "FixedExposure",
    "OpticalImage",
    "RawImage",
    "SensorModel",
    "capture",
    "expected_electrons",
    "expose",
    "exposure_time",
    "fixed_pattern_stream",
    "photo_electron_rate",
    "saturation_electrons",
    "sensor",
    "sensor_names",
]
