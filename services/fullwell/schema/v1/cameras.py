"""Cameras: pose, lens, sensors, exposure, image processing."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from fullwell.schema.v1.common import (
    Direction,
    Document,
    Flag,
    Fraction,
    MatrixRows,
    MotionDocument,
    Name,
    NonNegative,
    Number,
    Point,
    Positive,
    PositiveOrInf,
    Range,
    Text,
    exactly_one,
    refuse,
)
from fullwell.schema.v1.optics import ApertureDocument, PsfDocument, WavefrontDocument
from fullwell.schema.v1.sensors import (
    AutoExposureDocument,
    CfaDocument,
    CrosstalkDocument,
    ExposureDocument,
    MicrolensDocument,
    PhotodiodeDocument,
)
from fullwell.schema.v1.spectra import Reflectance, Spd

__all__ = [
    "AutoExposureDocument",
    "CameraDocument",
    "ColourMatrixDocument",
    "ExposureDocument",
    "IspDocument",
    "LensDocument",
    "MountDocument",
    "PoseDocument",
    "SensorDocument",
    "ToneDocument",
]

MAX_SIDE_PX = 20_000
_Side = Annotated[int, Range(ge=1, le=MAX_SIDE_PX, whole=True)]


def _place_form(value: Any) -> str:
    return "point" if isinstance(value, list | tuple) else "place"


class MountDocument(Document):
    """A camera on the ego vehicle of a traffic scene.

    `at` is a place on it, or [x, y, z] in metres forward and to the left of the middle of its bounding box, above the ground.
    `yaw_deg` turns to the left, `pitch_deg` upwards, `roll_deg` to the right, from straight ahead (from backwards at the rear).
    """

    at: Annotated[
        Annotated[Literal["windscreen", "bumper", "roof", "mirror_left", "mirror_right", "rear", "driver"], Tag("place")]
        | Annotated[Point, Tag("point")],
        Discriminator(_place_form),
    ] = "windscreen"
    yaw_deg: Number = 0.0
    pitch_deg: Annotated[float, Range(ge=-90, le=90)] = 0.0
    roll_deg: Number = 0.0


class PoseDocument(Document):
    """Where the camera is: `origin_m`, `target_m` and `up`, or `matrix`, or `mount` on a traffic scene's ego.

    `matrix` is the 4 x 4 rigid camera-to-world transform, camera axes x right, y down, z forward. `motion` says how the camera
    moves; one that is mounted moves with the ego.
    """

    origin_m: Point | None = None
    target_m: Point | None = None
    up: Direction | None = None
    matrix: MatrixRows | None = None
    mount: MountDocument | None = None
    motion: MotionDocument | None = None

    @model_validator(mode="after")
    def _one_way(self) -> PoseDocument:
        if self.mount is not None:
            if (self.origin_m, self.target_m, self.up, self.matrix) != (None, None, None, None):
                refuse("gives the pose twice; give mount alone, or no mount.")
            if self.motion is not None:
                refuse("is given beside mount; the camera moves as the ego does. Remove one of them.", "motion")
            return self
        points = [self.origin_m, self.target_m]
        ways = "give origin_m and target_m (and up), or matrix."
        if self.matrix is not None and (points != [None, None] or self.up is not None):
            refuse(f"gives the pose twice; {ways}")
        if self.matrix is None and None in points:
            refuse(f"is incomplete; {ways}")
        return self


class LensDocument(Document):
    """A pinhole or a thin lens. The field of view `hfov_deg` is that of the first sensor's width.

    The depth of field of a thin lens is traced ray by ray (`rendered`), or made from a sharp picture and its depths (`layers`),
    which lets many apertures and focus distances share one rendering. `psf` stands for the whole lens in place of `wavefront`
    and `aperture`.
    """

    kind: Literal["pinhole", "thin_lens"] = "pinhole"
    focal_length_m: Annotated[float, Range(gt=0, le=100)] | None = None
    hfov_deg: Annotated[float, Range(gt=0, lt=170)] | None = None
    f_number: Annotated[float, Range(gt=0, le=1000)]
    focus_distance_m: PositiveOrInf | None = None
    transmittance: Reflectance = 1.0
    diffraction: Flag = True
    depth_of_field: Literal["rendered", "layers"] = "rendered"
    wavefront: WavefrontDocument | None = None
    aperture: ApertureDocument | None = None
    psf: PsfDocument | None = None

    @model_validator(mode="after")
    def _one_length(self) -> LensDocument:
        exactly_one(self, "focal_length_m", "hfov_deg")
        focal, focus = self.focal_length_m, self.focus_distance_m
        if focal is not None and focus is not None and not focus > focal:
            refuse(f"is {focus:g}; must be > the focal length, {focal:g} m.", "focus_distance_m", value=focus)
        if self.depth_of_field == "layers" and self.kind != "thin_lens":
            refuse("is 'layers', but a pinhole has no depth of field; set kind: thin_lens.", "depth_of_field", value="layers")
        if self.psf is not None and (self.wavefront is not None or self.aperture is not None):
            refuse("is the image of a point through the whole lens; remove it, or wavefront and aperture.", "psf")
        if not self.diffraction and (self.wavefront is not None or self.aperture is not None):
            refuse("is false, but aberrations and flare come with diffraction; leave it true.", "diffraction", value=False)
        return self


class ColourMatrixDocument(Document):
    """How the colour matrix is fitted; `noise_fraction`, of the saturation signal, is for "noise_aware"."""

    method: Literal["least_squares", "noise_aware"] = "least_squares"
    noise_fraction: Annotated[float, Range(ge=0, le=1)] = 0.02


class ToneDocument(Document):
    """The tone curve; `gamma` is for "gamma", `contrast` and `pivot` are for "s_curve"."""

    curve: Literal["srgb", "linear", "gamma", "filmic", "s_curve"] = "srgb"
    exposure_ev: Annotated[float, Range(ge=-20, le=20)] = 0.0
    black_point: Annotated[float, Range(ge=0, lt=1)] = 0.0
    gamma: Annotated[float, Range(ge=0.1, le=10)] = 2.2
    contrast: Annotated[float, Range(ge=0.1, le=10)] = 1.5
    pivot: Annotated[float, Range(ge=0.001, le=0.999)] = 0.5


class IspDocument(Document):
    """From raw numbers to a picture; `illuminant` is the light that becomes white, "scene" that of the scene's own lights."""

    illuminant: Spd = "scene"
    white_balance: Literal["illuminant", "gray_world", "white_patch", "none"] = "illuminant"
    white_patch_percentile: Annotated[float, Range(gt=0, le=100)] = 99.0
    demosaic: Literal["bilinear", "malvar2004", "menon2007"] = "bilinear"
    colour_matrix: ColourMatrixDocument = Field(default_factory=ColourMatrixDocument)
    tone: ToneDocument = Field(default_factory=ToneDocument)


class SensorDocument(Document):
    """A sensor of the catalogue; anything that describes it may be given instead of the catalogue's."""

    name: Name = "main"
    model: Text = "imx363"
    exposure: ExposureDocument = Field(default_factory=lambda: ExposureDocument(auto=AutoExposureDocument()))
    isp: IspDocument = Field(default_factory=IspDocument)
    rows: _Side | None = None
    cols: _Side | None = None
    pixel_pitch_m: Annotated[float, Range(gt=0, le=1e-2)] | None = None
    fill_factor: Annotated[float, Range(gt=0, le=1)] | None = None
    well_capacity_e: Positive | None = None
    conversion_gain_v_per_e: Positive | None = None
    voltage_swing_v: Positive | None = None
    dark_current_e_per_s: NonNegative | None = None
    read_noise_e: NonNegative | None = None
    dsnu_v: NonNegative | None = None
    prnu_fraction: Fraction | None = None
    analog_gain_ratio: Positive | None = None
    analog_offset_v: NonNegative | None = None
    adc_bits: Annotated[int, Range(ge=1, le=16, whole=True)] | None = None
    serial: Annotated[int, Range(ge=0, le=2**53, whole=True)] | None = None

    array_rows: _Side | None = None
    array_cols: _Side | None = None
    cfa: CfaDocument | None = None
    microlens: MicrolensDocument | None = None
    crosstalk: CrosstalkDocument | None = None
    photodetector_offset_m: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = None
    temperature_k: Annotated[float, Range(ge=50, le=500)] | None = None
    dark_reference_temperature_k: Annotated[float, Range(ge=50, le=500)] | None = None
    dark_doubling_k: Annotated[float, Range(ge=0.1, le=1000)] | None = None
    dark_activation_energy_ev: Annotated[float, Range(gt=0, le=10)] | None = None
    dcnu_fraction: NonNegative | None = None
    hot_pixel_fraction: Fraction | None = None
    hot_pixel_dark_current_e_per_s: NonNegative | None = None
    reset_noise_e: NonNegative | None = None
    readout_sampling: Literal["single", "correlated_double"] | None = None
    column_offset_v: NonNegative | None = None
    row_offset_v: NonNegative | None = None
    column_gain_fraction: NonNegative | None = None
    row_noise_v: NonNegative | None = None
    line_time_s: Annotated[float, Range(ge=0, le=1)] | None = None
    photodiodes: list[PhotodiodeDocument] | None = Field(default=None, max_length=8)
    combination: Literal["weighted", "select"] | None = None

    @model_validator(mode="after")
    def _one_dark_law(self) -> SensorDocument:
        if self.dark_doubling_k is not None and self.dark_activation_energy_ev is not None:
            refuse("is given beside dark_doubling_k; give one of them.", "dark_activation_energy_ev")
        return self

    def overrides(self) -> dict[str, int | float | str]:
        """Return the numbers and choices of the catalogue's model that the recipe replaces as they are."""
        return {key: value for key, value in self if key not in _MADE and value is not None}


_MADE = frozenset(
    {
        "name",
        "model",
        "exposure",
        "isp",
        "cfa",
        "microlens",
        "crosstalk",
        "photodetector_offset_m",
        "dark_doubling_k",
        "dark_activation_energy_ev",
        "photodiodes",
    }
)
"""Keys of a sensor that something is made of, or that are not the model's."""


class CameraDocument(Document):
    """A pose, one lens, and the sensors that see through it.

    `model: isetcam` computes optics, sensor and picture as ISETCam does, quirks included, for comparisons with it; the scene
    then lies flat at `lens.focus_distance_m`.
    """

    name: Name = "main"
    model: Literal["physical", "isetcam"] = "physical"
    pose: PoseDocument
    lens: LensDocument
    sensors: list[SensorDocument] = Field(min_length=1, max_length=16)

    @model_validator(mode="after")
    def _known_to_isetcam(self) -> CameraDocument:
        if self.model == "physical":
            return self
        for name in ("wavefront", "aperture", "psf"):
            if getattr(self.lens, name) is not None:
                refuse("is not part of model isetcam; remove it, or use model: physical.", "lens", name)
        if self.lens.kind != "pinhole":
            sentence = "is 'thin_lens', but model isetcam has the whole scene in focus; set kind: pinhole."
            refuse(sentence, "lens", "kind", value=self.lens.kind)
        if self.lens.focus_distance_m is None or math.isinf(self.lens.focus_distance_m):
            refuse("is missing; model isetcam needs the distance of the scene [m].", "lens", "focus_distance_m")
        for position, sensor in enumerate(self.sensors):
            if sensor.isp.demosaic != "bilinear":
                sentence = f"is {sensor.isp.demosaic!r}; model isetcam develops bilinear."
                refuse(sentence, "sensors", position, "isp", "demosaic", value=sensor.isp.demosaic)
        return self
