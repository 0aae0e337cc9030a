"""One frame of a recipe, resolved: what the pipeline runs. The last stop before dataclasses only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from fullwell.isp.parameters import IspSettings
from fullwell.optics import IDEAL_LENS, OpticsOptions
from fullwell.radiometry import WavelengthGrid
from fullwell.scene import Camera, SceneDescription
from fullwell.scene.motion import AT_REST, DrivingFacts, Motion
from fullwell.sensor.parameters import Exposure, SensorModel

__all__ = ["PRODUCTS", "CameraRig", "FrameDescription", "Quality", "SensorRig", "View"]

PRODUCTS: tuple[str, ...] = (
    "image.png",
    "raw.npz",
    "raw.tiff",
    "raw.dng",
    "radiance.exr",
    "irradiance.exr",
    "depth.exr",
    "normals.exr",
    "flow.exr",
    "instances.png",
    "semantic.png",
    "coverage.png",
    "labels.json",
    "driving.json",
)
"""Products that `outputs` may ask for; manifest.json is always written, last."""


@dataclass(frozen=True, slots=True)
class Quality:
    """How much work the renderer does.

    Attributes
    ----------
    noise_ratio
        Standard error of the light over the sensor's noise that is to be reached; None for equal samples.
    samples_per_pixel
        Camera rays per film sample where they are equal; None where they follow the noise.
    max_samples_per_pixel, time_limit_s
        Caps where samples follow the noise.
    max_sample_saturation
        Clamp of single samples, in lights that fill the well; None for none.
    max_depth
        Segments of the longest path.
    motion_blur_px
        Shift in the picture, in pixels of the sensor, below which what moves is rendered standing still.
    """

    noise_ratio: float | None = 0.5
    samples_per_pixel: int | None = None
    max_samples_per_pixel: int = 4096
    time_limit_s: float | None = None
    max_sample_saturation: float | None = None
    max_depth: int = 8
    motion_blur_px: float = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class SensorRig:
    """A sensor behind a lens, its exposure and its image processing."""

    name: str
    model: SensorModel
    exposure: Exposure
    isp: IspSettings


@dataclass(frozen=True, slots=True, eq=False)
class CameraRig:
    """A camera and the sensors that see through its lens."""

    camera: Camera
    sensors: tuple[SensorRig, ...]
    optics: OpticsOptions = IDEAL_LENS
    model: Literal["physical", "isetcam"] = "physical"
    """Whose camera it is: the physically right one, or ISETCam's with its quirks, to compare numbers with it."""
    depth_layers: bool = False
    """Whether depth of field is made from a sharp picture and its depths; the camera's lens is then a pinhole with a focus."""
    motion: Motion = AT_REST
    """Of the camera, about its pose."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One way in which frames of a recipe look at the same light: a camera's sensors, and weights of light groups."""

    sensors: tuple[SensorRig, ...]
    group_weights: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True, eq=False)
class FrameDescription:
    """Everything that decides the bytes of one frame.

    Attributes
    ----------
    recipe_name, seed, index, count
        Of the recipe; `index` runs from 0 to `count` - 1.
    varied
        (path, value) pairs that `vary` set for this frame.
    outputs
        Names from PRODUCTS.
    warnings
        Sentences for the manifest: upsampled colours and the like.
    recipe_json
        The recipe of this frame as canonical JSON text, with `vary` and overrides applied and removed.
    group_weights
        (name, factor) of light groups in the picture; those left out have 1.
    views
        For each camera, the views that frames of the recipe have of the same light, this frame's among them: what is rendered
        must serve them all, so that it need not be rendered again for the next. Empty where only this frame's counts.
    driving
        What labels may tell of a street; None without traffic.
    flow_interval_s
        Time from this frame to the one that optical flow leads to [s].
    motions
        Of the objects that move, by id: about where they are at the frame's own time, the middle of the exposure.
    """

    recipe_name: str
    seed: int
    index: int
    count: int
    varied: tuple[tuple[str, str | int | float | bool], ...]
    scene: SceneDescription
    cameras: tuple[CameraRig, ...]
    grid: WavelengthGrid
    outputs: tuple[str, ...]
    quality: Quality
    warnings: tuple[str, ...]
    recipe_json: str
    group_weights: tuple[tuple[str, float], ...] = ()
    views: tuple[tuple[View, ...], ...] = ()
    driving: DrivingFacts | None = None
    flow_interval_s: float = 0.1
    motions: Mapping[str, Motion] = field(default_factory=dict)
