"""Shapes and where they are."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from fullwell.schema.v1.common import (
    Direction,
    Document,
    Length,
    MatrixRows,
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
    """A model file (GLB, glTF, OBJ, PLY, STL, USD), relative to the recipe, or "asset:<reference>".

    `unit_m` is the length of one unit of the file [m] and `up_axis` its upward axis, where the file does not say.
    """

    kind: Literal["model"]
    file: Text
    unit_m: Length | None = None
    up_axis: Literal["x", "y", "z"] | None = None


GeometryDocument = Annotated[
    SphereGeometry
    | RectangleGeometry
    | DiskGeometry
    | CubeGeometry
    | CylinderGeometry
    | QuadGeometry
    | MeshGeometry
    | ModelGeometry,
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
