"""The recipe: a scene, the cameras that see it, what comes out, and how it varies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PrivateAttr, field_validator, model_validator

from fullwell.core.errors import unknown_name_message
from fullwell.core.hashing import canonical_json
from fullwell.schema.v1.cameras import CameraDocument
from fullwell.schema.v1.common import (
    Class,
    Document,
    Flag,
    Fraction,
    Group,
    Id,
    MotionDocument,
    NonNegative,
    Number,
    Range,
    Text,
    TextPattern,
    refuse,
)
from fullwell.schema.v1.geometry import GeometryDocument, Transform
from fullwell.schema.v1.lights import LightDocument
from fullwell.schema.v1.materials import MaterialDocument, MaterialReference
from fullwell.schema.v1.traffic import TrafficDocument
from fullwell.schema.v1.vary import VaryDocument

__all__ = [
    "SCHEMA_NAME",
    "LabelsDocument",
    "ObjectDocument",
    "PartDocument",
    "QualityDocument",
    "RecipeDocument",
    "SceneDocument",
    "SpectralDocument",
    "json_schema",
]

SCHEMA_NAME = "fullwell/recipe/v1"
_PRODUCTS = (
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
"""The same as ``fullwell.schema.frame.PRODUCTS`` (tested); not imported from there, so that documents load without arrays."""

_DEFAULT_PRODUCTS = ("image.png", "raw.npz", "depth.exr", "instances.png", "semantic.png", "labels.json")
"""A labelled camera frame; the labels cost a few per cent of the picture."""

_RecipeName = Annotated[
    str,
    TextPattern(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,127}", "1 to 128 letters, digits, blanks or ._-, the first a letter or digit"),
]
_Digest = Annotated[str, TextPattern(r"[0-9a-f]{64}", "a SHA-256 in 64 lower-case hexadecimal digits")]


def _with_lists(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _with_lists(item) for key, item in value.items()}
    return [_with_lists(item) for item in value] if isinstance(value, list | tuple) else value


class SpectralDocument(Document):
    """The wavelength bands: centres from `first_nm` to `last_nm`, each `step_nm` wide."""

    first_nm: Annotated[float, Range(ge=380, le=1000)] = 400.0
    last_nm: Annotated[float, Range(ge=380, le=1000)] = 700.0
    step_nm: Annotated[float, Range(ge=1, le=100)] = 10.0

    @model_validator(mode="after")
    def _whole_steps(self) -> SpectralDocument:
        span = self.last_nm - self.first_nm
        if span < 0:
            refuse(f"is {self.last_nm:g}; must be >= first_nm, {self.first_nm:g}.", "last_nm", value=self.last_nm)
        if abs(span / self.step_nm - round(span / self.step_nm)) > 1e-6:
            refuse(
                f"is {self.step_nm:g}; last_nm - first_nm = {span:g} must be a whole number of steps.",
                "step_nm",
                value=self.step_nm,
            )
        return self


class PartDocument(Document):
    """One shape with one material, placed in its object."""

    name: Id | None = None
    geometry: GeometryDocument
    material: MaterialReference | None = None
    materials: dict[str, MaterialReference] = Field(default_factory=dict)
    transform: Transform | None = None


class ObjectDocument(Document):
    """What labels count as one thing: a `geometry` with a `material`, or several `parts`.

    Model files bring materials; `material` replaces all of them, `materials` those whose part name matches a pattern such
    as "wheel*". `inside_ok` says that a camera may be inside (a room, a dome). `motion` says how the object moves.
    """

    id: Id
    semantic_class: Class = Field(default="", alias="class")
    geometry: GeometryDocument | None = None
    material: MaterialReference | None = None
    materials: dict[str, MaterialReference] = Field(default_factory=dict)
    parts: list[PartDocument] | None = Field(default=None, min_length=1, max_length=100_000)
    transform: Transform | None = None
    motion: MotionDocument | None = None
    inside_ok: Flag = False
    licences: list[Text] = Field(default_factory=list)

    @model_validator(mode="after")
    def _one_shape(self) -> ObjectDocument:
        if (self.geometry is None) == (self.parts is None):
            given = "neither" if self.parts is None else "both"
            refuse(
                f"has {given} geometry and parts; give exactly one of them."
                if given == "both"
                else "has neither geometry nor parts; give exactly one of them."
            )
        if self.parts is not None and (self.material is not None or self.materials):
            refuse("belongs to the parts of an object with parts; move it there.", "material" if self.material else "materials")
        return self


class FogDocument(Document):
    """A layer of fog, without end to the sides, from `bottom_m` to `top_m` above the world's origin.

    `visibility_m` is the meteorological optical range, over which 5 % of the light remain. `albedo` is the share of the lost
    light that is scattered, `asymmetry` the mean cosine of its angle.
    """

    kind: Literal["fog"]
    visibility_m: Annotated[float, Range(ge=1, le=1e6)]
    albedo: Fraction = 0.999
    asymmetry: Annotated[float, Range(ge=-0.99, le=0.99)] = 0.85
    bottom_m: Number = -10_000.0
    top_m: Number = 100.0

    @model_validator(mode="after")
    def _has_height(self) -> FogDocument:
        if not self.bottom_m < self.top_m:
            refuse(f"is {self.top_m:g}; must be above bottom_m, {self.bottom_m:g}.", "top_m", value=self.top_m)
        return self


class SceneDocument(Document):
    """Materials by name, objects, lights, and the order of the semantic classes.

    `light_groups` weights the light of named groups in the picture: other weights of the same scene render nothing anew.
    """

    materials: dict[str, MaterialDocument] = Field(default_factory=dict)
    objects: list[ObjectDocument] = Field(default_factory=list, max_length=200_000)
    lights: list[LightDocument] = Field(default_factory=list, max_length=10_000)
    light_groups: dict[Group, NonNegative] = Field(default_factory=dict)
    atmosphere: FogDocument | None = None
    traffic: TrafficDocument | None = None
    classes: list[Class] | None = None

    @model_validator(mode="after")
    def _consistent(self) -> SceneDocument:
        self._check_ids()
        self._check_classes()
        return self

    def _check_ids(self) -> None:
        seen: dict[str, str] = {}
        for index, item in enumerate(self.objects):
            if item.id in seen:
                refuse(f"is {item.id!r}, as is {seen[item.id]}; ids must differ.", "objects", index, "id", value=item.id)
            seen[item.id] = f"scene.objects[{index}].id"
        for index, light in enumerate(self.lights):
            if light.name in seen:
                clash = seen[light.name]
                refuse(f"is {light.name!r}, as is {clash}; they must differ.", "lights", index, "name", value=light.name)
            seen[light.name] = f"scene.lights[{index}].name"

    def _check_classes(self) -> None:
        if self.classes is None:
            return
        for index, name in enumerate(self.classes):
            if name in self.classes[:index] or not name:
                refuse(f"is {name!r}; classes must differ and must not be empty.", "classes", index, value=name)
        for index, item in enumerate(self.objects):
            if item.semantic_class and item.semantic_class not in self.classes:
                sentence = unknown_name_message("class", item.semantic_class, self.classes)
                refuse(f"is not in scene.classes: {sentence}", "objects", index, "class", value=item.semantic_class)


class QualityDocument(Document):
    """How much work the renderer does.

    By default it samples every part of the picture until its own error is `noise_ratio` of the noise that the sensor adds
    there, with at most `max_samples_per_pixel` and, where given, within `time_limit_s` (results then depend on the machine).
    `samples_per_pixel` asks for equal samples everywhere instead. `max_sample_saturation` clamps single samples to that many
    times the light that fills the sensor's well: less noise from rare bright paths, at the price of a little light, whose
    amount is measured. `oversampling` is the number of film samples along the side of the finest pixel. What moves by less than
    `motion_blur_px` pixels while the picture is taken is rendered as if it stood still.
    """

    noise_ratio: Annotated[float, Range(ge=0.01, le=100)] | None = None
    samples_per_pixel: Annotated[int, Range(ge=1, le=65536, whole=True)] | None = None
    max_samples_per_pixel: Annotated[int, Range(ge=4, le=1_048_576, whole=True)] = 4096
    time_limit_s: Annotated[float, Range(gt=0)] | None = None
    max_sample_saturation: Annotated[float, Range(ge=1)] | None = None
    max_depth: Annotated[int, Range(ge=1, le=1000, whole=True)] = 8
    oversampling: Annotated[int, Range(ge=1, le=16, whole=True)] = 1
    motion_blur_px: Annotated[float, Range(gt=0, le=1e6)] = 0.25

    @model_validator(mode="after")
    def _one_way(self) -> QualityDocument:
        if self.samples_per_pixel is not None and self.noise_ratio is not None:
            refuse(
                f"is {self.samples_per_pixel}, and noise_ratio is {self.noise_ratio:g}: samples are either equal everywhere or "
                "follow the noise. Give one of them; max_samples_per_pixel caps the latter.",
                "samples_per_pixel",
                value=self.samples_per_pixel,
            )
        return self


class LabelsDocument(Document):
    """Choices about labels. `flow.exr` tells where things will be seen `flow_interval_s` later."""

    flow_interval_s: Annotated[float, Range(gt=0, le=60)] = 0.1


class RecipeDocument(Document):
    """A recipe, version 1.

    Read one with ``fullwell.schema.load_recipe``; its errors name the field, the value and the legal range.
    """

    schema_name: Literal["fullwell/recipe/v1"] = Field(alias="schema")
    name: _RecipeName
    description: Text | None = None
    seed: Annotated[int, Range(ge=0, le=2**53, whole=True)] = 0
    spectral: SpectralDocument = Field(default_factory=SpectralDocument)
    scene: SceneDocument
    cameras: list[CameraDocument] = Field(min_length=1, max_length=64)
    outputs: list[str] = Field(default_factory=lambda: list(_DEFAULT_PRODUCTS), min_length=1)
    quality: QualityDocument = Field(default_factory=QualityDocument)
    labels: LabelsDocument | None = None
    vary: VaryDocument | None = None
    files: dict[str, _Digest] = Field(default_factory=dict)
    """SHA-256 of files by their path in the recipe; a file that differs is refused."""
    assets: dict[str, list[str]] = Field(default_factory=dict)
    """Pins: the assets ("<id>@<digest>") that each draw chooses among, by the canonical text of its conditions.

    A service writes them when a job is submitted: what its curators do later changes no frame of the job.
    """

    _base_dir: Path | None = PrivateAttr(default=None)

    @field_validator("outputs", mode="after")
    @classmethod
    def _known_outputs(cls, outputs: list[str]) -> list[str]:
        for index, product in enumerate(outputs):
            if product not in _PRODUCTS:
                refuse(f"is not known: {unknown_name_message('product', product, _PRODUCTS)}", index, value=product)
        return [product for product in _PRODUCTS if product in outputs]

    @model_validator(mode="after")
    def _has_what_products_need(self) -> RecipeDocument:
        if "driving.json" in self.outputs and self.scene.traffic is None:
            sentence = "asks for driving.json, which tells of a street; add scene.traffic, or ask for labels.json instead."
            refuse(sentence, "outputs", value="driving.json")
        if self.vary is not None and self.vary.clip is not None and self.scene.traffic is None:
            refuse("lets traffic go on; add scene.traffic, or use repeat for more frames of the same.", "vary", "clip")
        return self

    @model_validator(mode="after")
    def _unique_names(self) -> RecipeDocument:
        names: list[str] = []
        for index, camera in enumerate(self.cameras):
            if camera.name.casefold() in names:
                refuse(
                    f"is {camera.name!r}, as is another camera's; they must differ.",
                    "cameras",
                    index,
                    "name",
                    value=camera.name,
                )
            names.append(camera.name.casefold())
            sensors = [sensor.name.casefold() for sensor in camera.sensors]
            for position, sensor in enumerate(sensors):
                if sensor in sensors[:position]:
                    sentence = f"is {sensor!r}, as is another sensor's of this camera; they must differ."
                    refuse(sentence, "cameras", index, "sensors", position, "name", value=sensor)
        return self

    @property
    def base_dir(self) -> Path | None:
        """The folder that file names are relative to; None where the recipe did not come from a file."""
        return self._base_dir

    def frame_count(self) -> int:
        """Return the number of frames that the recipe makes."""
        return 1 if self.vary is None else self.vary.frame_count()

    def plain(self) -> dict[str, Any]:
        """Return the recipe as plain data (mappings, lists, numbers, text) with all defaults filled in."""
        dumped: dict[str, Any] = _with_lists(self.model_dump(mode="python", by_alias=True, exclude_none=True))
        return dumped

    def canonical_json(self) -> str:
        """Return the recipe as canonical JSON text: equal for equal recipes, and itself a legal recipe."""
        return canonical_json(self.plain()).decode()


def json_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of recipes. What only the reader checks (names, files) is not in it."""
    schema = RecipeDocument.model_json_schema(by_alias=True)
    return schema | {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Fullwell recipe, version 1"}
