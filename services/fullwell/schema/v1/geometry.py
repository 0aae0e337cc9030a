"""Shapes and where they are."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from fullwell.schema.v1.common import (
    Direction,
    Document,
    Length,
    MatrixRows,
    NonNegative,
    Number,
    Point,
    Range,
    Sizes2,
    Sizes3,
    Text,
    Vector,
    exactly_one,
    refuse,
)

__all__ = [
    "AreaGeometry",
    "AssetGeometry",
    "CubeGeometry",
    "CylinderGeometry",
    "DiskGeometry",
    "GeometryDocument",
    "LookAt",
    "MeshGeometry",
    "ModelGeometry",
    "QuadGeometry",
    "RectangleGeometry",
    "Rotation",
    "SphereGeometry",
    "Transform",
    "TransformStep",
]


class SphereGeometry(Document):
    """Sphere about the origin."""

    kind: Literal["sphere"]
    radius_m: Length


class RectangleGeometry(Document):
    """Rectangle in the xy plane about the origin, normal +z; `size_m` = [x, y]."""

    kind: Literal["rectangle"]
    size_m: Sizes2


class DiskGeometry(Document):
    """Disk in the xy plane about the origin, normal +z."""

    kind: Literal["disk"]
    radius_m: Length


class CubeGeometry(Document):
    """Box about the origin; `size_m` = [x, y, z]."""

    kind: Literal["cube"]
    size_m: Sizes3


class CylinderGeometry(Document):
    """Open cylinder along z about the origin, normals outwards."""

    kind: Literal["cylinder"]
    radius_m: Length
    height_m: Length


class QuadGeometry(Document):
    """Four corners of a flat convex quadrilateral, counter-clockwise seen from its front (the side of its normal)."""

    kind: Literal["quad"]
    corners_m: tuple[Point, Point, Point, Point]


class MeshGeometry(Document):
    """Triangles written out in the recipe: `faces` holds three indices into `vertices_m`, counted from 0."""

    kind: Literal["mesh"]
    vertices_m: list[Point] = Field(min_length=3, max_length=200_000)
    faces: list[list[Annotated[int, Range(ge=0, whole=True)]]] = Field(min_length=1, max_length=400_000)

    @model_validator(mode="after")
    def _indices(self) -> MeshGeometry:
        for row, face in enumerate(self.faces):
            if len(face) != 3:
                refuse(f"has {len(face)} indices; must have 3.", "faces", row)
            for column, index in enumerate(face):
                if index >= len(self.vertices_m):
                    last = len(self.vertices_m) - 1
                    refuse(f"is {index}; must be <= {last}, the last vertex.", "faces", row, column, value=index)
        return self


class ModelGeometry(Document):
    """A model file (GLB, glTF, OBJ, PLY, STL, USD), relative to the recipe, or "sumo:<name>".

    `unit_m` is the length of one unit of the file [m] and `up_axis` its upward axis, where the file does not say.
    """

    kind: Literal["model"]
    file: Text
    unit_m: Length | None = None
    up_axis: Literal["x", "y", "z"] | None = None


_Span = tuple[NonNegative | None, NonNegative | None]


class AssetGeometry(Document):
    """A model of the asset store, drawn by the recipe's seed and the object's id among those that meet all conditions.

    `id` names one asset, or pins one version as "<id>@<digest>". Only approved assets are drawn unless `state` says otherwise.
    Sizes are [least, most], either null. `weights` gives assets by id, or by a tag they have, more or less chance than 1;
    factors multiply. `level` is the level of detail, 0 the finest. Parts whose names match a pattern of `lit` emit, as their
    lamp does.
    """

    kind: Literal["asset"]
    id: Text | None = None
    asset_class: Text | None = Field(default=None, alias="class")
    tags: list[Text] = Field(default_factory=list, max_length=32)
    without_tags: list[Text] = Field(default_factory=list, max_length=32)
    licence: list[Text] = Field(default_factory=list, max_length=32)
    state: list[Literal["pending", "approved", "rejected"]] = Field(default=["approved"], min_length=1)
    text: Text | None = None
    length_m: _Span | None = None
    width_m: _Span | None = None
    height_m: _Span | None = None
    weights: dict[str, Annotated[float, Range(ge=0)]] = Field(default_factory=dict, max_length=1000)
    level: Annotated[int, Range(ge=0, le=16, whole=True)] = 0
    lit: list[Text] = Field(default_factory=list, max_length=64)

    @model_validator(mode="after")
    def _pin_stands_alone(self) -> AssetGeometry:
        conditions = ("asset_class", "tags", "without_tags", "licence", "text", "length_m", "width_m", "height_m", "weights")
        if self.id is not None and "@" in self.id and (given := next((key for key in conditions if getattr(self, key)), None)):
            name = "class" if given == "asset_class" else given
            refuse(f"is given together with a pinned id, {self.id!r}; remove one of them.", name)
        return self


GeometryDocument = Annotated[
    SphereGeometry
    | RectangleGeometry
    | DiskGeometry
    | CubeGeometry
    | CylinderGeometry
    | QuadGeometry
    | MeshGeometry
    | ModelGeometry
    | AssetGeometry,
    Field(discriminator="kind"),
]
AreaGeometry = Annotated[
    SphereGeometry | RectangleGeometry | DiskGeometry | CubeGeometry | CylinderGeometry | QuadGeometry | MeshGeometry,
    Field(discriminator="kind"),
]


def _axis_form(value: Any) -> str:
    return "letter" if isinstance(value, str) else "direction"


class Rotation(Document):
    """Turn by `angle_deg` about `axis` ("x", "y", "z" or a direction), counter-clockwise seen against the axis."""

    axis: Annotated[
        Annotated[Literal["x", "y", "z"], Tag("letter")] | Annotated[Direction, Tag("direction")], Discriminator(_axis_form)
    ]
    angle_deg: Number


class LookAt(Document):
    """Put the origin at `origin_m`, turn +z towards `target_m` and +y as near to `up` as possible."""

    origin_m: Point
    target_m: Point
    up: Direction = (0.0, 0.0, 1.0)


def _rotation_form(value: Any) -> str:
    return "angles" if isinstance(value, list | tuple) else "axis"


def _scale_form(value: Any) -> str:
    return "factors" if isinstance(value, list | tuple) else "factor"


class TransformStep(Document):
    """One affine step, or several applied in the order scale, rotate_deg, translate_m. `matrix` and `look_at` stand alone.

    `rotate_deg` is {axis, angle_deg}, or three angles about the fixed axes x, then y, then z.
    """

    scale: (
        Annotated[
            Annotated[Length, Tag("factor")] | Annotated[Sizes3, Tag("factors")],
            Discriminator(_scale_form),
        ]
        | None
    ) = None
    rotate_deg: (
        Annotated[Annotated[Rotation, Tag("axis")] | Annotated[Vector, Tag("angles")], Discriminator(_rotation_form)] | None
    ) = None
    translate_m: Point | None = None
    matrix: MatrixRows | None = None
    look_at: LookAt | None = None

    @model_validator(mode="after")
    def _alone(self) -> TransformStep:
        given = [key for key in self.keys() if getattr(self, key) is not None]
        if not given:
            refuse("is empty; give scale, rotate_deg, translate_m, matrix or look_at, or leave the transform out.")
        if len(given) > 1 and ("matrix" in given or "look_at" in given):
            exactly_one(self, *given)
        return self


def _transform_form(value: Any) -> str:
    return "steps" if isinstance(value, list | tuple) else "step"


Transform = Annotated[
    Annotated[TransformStep, Tag("step")] | Annotated[list[TransformStep], Tag("steps")], Discriminator(_transform_form)
]
"""One step, or a list of steps of which the first is applied first."""
