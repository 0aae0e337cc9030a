"""The camera from radiance to picture, by either model: the physical one, or ISETCam's for comparing numbers with it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.isp import develop
from fullwell.isp import isetcam as isetcam_isp
from fullwell.isp.model import DisplayImage
from fullwell.isp.tone import encode_srgb
from fullwell.optics import OpticsOptions, compute_irradiance, form_channel_image
from fullwell.optics import isetcam as isetcam_optics
from fullwell.radiometry import ChannelRadiance, RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene.images import OpticalImage, RawImage
from fullwell.schema.frame import CameraRig, SensorRig
from fullwell.sensor import ChannelCurrents, expose, fixed_pattern_stream
from fullwell.sensor import isetcam as isetcam_sensor

__all__ = ["develop_picture", "form_channels", "form_image", "take_picture"]

_ISETCAM_CORRECTION: dict[str, isetcam_isp.IlluminantCorrection] = {
    "none": "none",
    "illuminant": "none",
    "gray_world": "gray_world",
    "white_patch": "white_world",
}


def form_image(rig: CameraRig, radiance: RadianceImage, options: OpticsOptions) -> OpticalImage:
    """Return the optical image. ISETCam's scene lies flat at the distance that the lens is focused on."""
    if rig.model == "isetcam":
        return isetcam_optics.compute_optical_image(
            radiance, rig.camera.lens, scene_distance_m=rig.camera.lens.focus_distance_m
        )
    return compute_irradiance(radiance, rig.camera.lens, options)


def form_channels(
    rig: CameraRig, sensor: SensorRig, light: ChannelRadiance, grid: WavelengthGrid
) -> tuple[ChannelCurrents, tuple[str, ...]]:
    """Return what the sensor's channels count on the sensor plane, and notes for the manifest."""
    image = form_channel_image(light, rig.camera.lens, rig.optics)
    return ChannelCurrents(image.electrons, sensor.model.cfa, grid, image.sample_pitch_m), image.notes


def take_picture(
    rig: CameraRig, sensor: SensorRig, optical: OpticalImage | ChannelCurrents, *, rng: np.random.Generator
) -> RawImage:
    """Return the raw image with all noise; `rng` is that of the frame, the fixed pattern is the sensor's own."""
    if rig.model == "isetcam" and isinstance(optical, OpticalImage):
        return isetcam_sensor.expose(optical, sensor.model, sensor.exposure, rng=rng)
    return expose(
        optical,
        sensor.model,
        sensor.exposure,
        rng=rng,
        fixed_pattern_rng=fixed_pattern_stream(sensor.model),
        keep_mean_electrons=True,
    )


def develop_picture(
    rig: CameraRig, sensor: SensorRig, raw: RawImage, *, scene_light: Spectrum | None
) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    """Return the sRGB picture (rows, cols, 3) and what the manifest says about its making."""
    if rig.model == "isetcam":
        correction = _ISETCAM_CORRECTION[sensor.isp.white_balance]
        picture = isetcam_isp.process(raw, illuminant_correction=correction)
        document: dict[str, Any] = {
            "model": "isetcam",
            "illuminant_correction": correction,
            "sensor_to_xyz": picture.sensor_to_xyz.tolist(),
            "xyz_to_display": picture.xyz_to_display.tolist(),
        }
        return encode_srgb(picture.rgb), document
    display = develop(raw, sensor.isp, scene_light=scene_light)
    return display.rgb, _isp_document(display)


def _isp_document(display: DisplayImage) -> dict[str, Any]:
    """Return what made colours of the channels, and how much noise that costs in the dark."""
    calibration, matrix = display.calibration, display.colour_matrix
    return {
        "illuminant": calibration.illuminant.source,
        "illuminant_xy": calibration.illuminant_xy,
        "channels": list(calibration.channel_names),
        "channel_gain_ratio": display.channel_gain_ratio.tolist(),
        "colour_matrix": None if matrix is None else matrix.tolist(),
        "noise_amplification": calibration.noise_amplification,
    }
