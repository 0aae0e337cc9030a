"""Cameras of a recipe: pose, lens, film and sensors."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.isp.demosaic import check_demosaic
from fullwell.isp.parameters import ColourMatrixFit, IspSettings, ToneCurve
from fullwell.radiometry import Spectrum
from fullwell.scene import Camera, Film, Lens
from fullwell.scene.camera import look_at
from fullwell.schema.conversion.context import Context, fail, located
from fullwell.schema.conversion.optics import optics_options
from fullwell.schema.conversion.sensors import exposure_of, sensor_model
from fullwell.schema.conversion.spectra import reflectance_of, spd_of
from fullwell.schema.conversion.traffic import mount_pose
from fullwell.schema.errors import RecipeError
from fullwell.schema.frame import CameraRig, SensorRig
from fullwell.schema.v1.cameras import (
    CameraDocument,
    LensDocument,
    PoseDocument,
    SensorDocument,
    ToneDocument,
)
from fullwell.sensor.parameters import SensorModel

__all__ = ["MAX_FILM_BYTES", "MAX_FILM_SAMPLES", "camera_rig"]

MAX_FILM_SAMPLES = 64_000_000
MAX_FILM_BYTES = 8 * 2**30
SCENE_LIGHT = "scene"
"""The name in `isp.illuminant` of the light that the scene's own lights give."""

_RIGID_TOLERANCE = 1e-6


def camera_rig(document: CameraDocument, path: str, oversampling: int, context: Context) -> CameraRig:
    """Return the camera and the sensors behind its lens; raises RecipeError where they are too large to render."""
    pose = _pose(document.pose, f"{path}.pose", context)
    models = [sensor_model(sensor, f"{path}.sensors[{i}]", context) for i, sensor in enumerate(document.sensors)]
    film = _film(models, path, oversampling, context)
    lens = _lens(document, f"{path}.lens", models[0], context)
    sensors = [
        SensorRig(
            sensor.name,
            model,
            exposure_of(sensor.exposure, model, f"{path}.sensors[{i}].exposure"),
            _isp(sensor, model, f"{path}.sensors[{i}].isp", context),
        )
        for i, (sensor, model) in enumerate(zip(document.sensors, models, strict=True))
    ]
    options = optics_options(document.lens, lens, f"{path}.lens", context)
    layers = document.lens.depth_of_field == "layers"
    if layers:
        lens = dataclasses.replace(lens, kind="pinhole")
    return CameraRig(Camera(document.name, pose, lens, film), tuple(sensors), options, document.model, depth_layers=layers)


def _pose(document: PoseDocument, path: str, context: Context) -> NDArray[np.float64]:
    if document.mount is not None:
        return mount_pose(document.mount, context.street, f"{path}.mount")
    if document.matrix is not None:
        return _rigid(np.array(document.matrix, dtype=np.float64), f"{path}.matrix")
    up = document.up or (0.0, 0.0, 1.0)
    try:
        return look_at(np.array(document.origin_m), np.array(document.target_m), np.array(up))
    except FieldError as error:
        names = {"target": "target_m"}
        raise RecipeError(f"{path}: {error.message}", f"{path}.{names.get(error.path, error.path)}", error.value) from error


def _rigid(matrix: NDArray[np.float64], path: str) -> NDArray[np.float64]:
    rotation = matrix[:3, :3]
    if not np.allclose(rotation.T @ rotation, np.eye(3), atol=_RIGID_TOLERANCE) or np.linalg.det(rotation) < 0:
        fail(
            path,
            "is not a rotation and a translation; its first three columns must be perpendicular unit vectors, right-handed.",
        )
    if not np.array_equal(matrix[3], [0, 0, 0, 1]):
        fail(path, f"has the last row {matrix[3].tolist()}; must be [0, 0, 0, 1].")
    return matrix


def _film(models: list[SensorModel], path: str, oversampling: int, context: Context) -> Film:
    """The grid that covers the largest sensor at the finest pixel pitch / oversampling."""
    pitch_m = min(model.pixel_pitch_m for model in models) / oversampling
    height_m = max(model.rows * model.pixel_pitch_m for model in models)
    width_m = max(model.cols * model.pixel_pitch_m for model in models)
    rows, cols = (math.ceil(side_m / pitch_m - 1e-6) for side_m in (height_m, width_m))
    samples, bands = rows * cols, context.grid.count
    what = f"{rows} x {cols} = {samples:.4g} samples (the largest sensor at the finest pixel pitch"
    what += f", oversampling {oversampling})" if oversampling > 1 else ")"
    if samples > MAX_FILM_SAMPLES:
        fail(f"{path}.sensors", f"need a film of {what}; must be <= {MAX_FILM_SAMPLES:.4g}. Lower rows and cols.", samples)
    if samples * bands * 4 > MAX_FILM_BYTES:
        gib = samples * bands * 4 / 2**30
        fail(
            f"{path}.sensors",
            f"need {gib:.3g} GiB of radiance: {what} times {bands} bands; must be <= {MAX_FILM_BYTES / 2**30:g} GiB. Lower "
            "rows and cols, or widen spectral.step_nm.",
            samples * bands * 4,
        )
    return Film(rows, cols, pitch_m)


def _lens(document: CameraDocument, path: str, model: SensorModel, context: Context) -> Lens:
    lens = document.lens
    focus_distance_m = _focus_distance_m(lens, document.pose)
    if lens.focal_length_m is not None:
        focal_length_m = lens.focal_length_m
        if not focus_distance_m > focal_length_m:
            sentence = (
                f"is {focus_distance_m:g} m away, not beyond the focal length {focal_length_m:g} m; set lens.focus_distance_m."
            )
            fail(f"{path}.focus_distance_m", sentence, focus_distance_m)
    else:
        half = math.radians(float(lens.hfov_deg or 0.0)) / 2
        image_distance_m = model.cols * model.pixel_pitch_m / (2 * math.tan(half))
        focal_length_m = 1.0 / (1.0 / image_distance_m + 1.0 / focus_distance_m)
    transmittance = reflectance_of(lens.transmittance, f"{path}.transmittance", context)
    return Lens(lens.kind, focal_length_m, lens.f_number, focus_distance_m, transmittance, lens.diffraction)


def _focus_distance_m(lens: LensDocument, pose: PoseDocument) -> float:
    if lens.focus_distance_m is not None:
        return lens.focus_distance_m
    if lens.kind == "pinhole" or pose.origin_m is None or pose.target_m is None:
        return math.inf
    return math.dist(pose.origin_m, pose.target_m)


def _isp(document: SensorDocument, model: SensorModel, path: str, context: Context) -> IspSettings:
    isp = document.isp
    with located(f"{path}.demosaic"):
        check_demosaic(isp.demosaic, model.cfa.pattern)
    return IspSettings(
        _isp_light(isp.illuminant, f"{path}.illuminant", context),
        isp.white_balance,
        isp.demosaic,
        isp.white_patch_percentile,
        ColourMatrixFit(isp.colour_matrix.method, isp.colour_matrix.noise_fraction),
        _tone(isp.tone),
    )


def _tone(tone: ToneDocument) -> ToneCurve:
    return ToneCurve(tone.curve, tone.exposure_ev, tone.black_point, tone.gamma, tone.contrast, tone.pivot)


def _isp_light(given: Any, path: str, context: Context) -> Spectrum | None:
    """Return the light that becomes white; None is the scene's own, which is known only when the scene is built."""
    if isinstance(given, str) and given.strip().casefold() == SCENE_LIGHT:
        return None
    quiet = dataclasses.replace(context, warnings=[])  # that an illuminant's table ends changes no radiance here
    return spd_of(given, path, quiet)
