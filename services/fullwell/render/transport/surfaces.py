"""The surfaces of a scene as plain arrays: one mesh of all triangles, and the curved shapes that are traced exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.radiometry.spectrum import Spectrum
from fullwell.scene import BeamPattern, Material

__all__ = ["CurvedShape", "PartRecord", "PlacedPattern", "SceneSurfaces"]


@dataclass(frozen=True, slots=True, eq=False)
class PlacedPattern:
    """A pattern and the (3, 3) unit columns forward, left and up of its axes in the world."""

    pattern: BeamPattern
    frame: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PartRecord:
    """What all triangles or the curved shape of one part share.

    Attributes
    ----------
    object_index
        Into ``SceneDescription.objects``.
    material
        Index into ``SceneSurfaces.materials``.
    radiance
        Emitted on the side of the normal [W m^-2 sr^-1 nm^-1], or None.
    group
        Index into ``SceneSurfaces.groups`` of what is emitted.
    pattern
        How what is emitted is spread over directions, or None for evenly.
    """

    object_index: int
    material: int
    radiance: Spectrum | None = None
    group: int = 0
    pattern: PlacedPattern | None = None


@dataclass(frozen=True, slots=True, eq=False)
class CurvedShape:
    """A sphere, disk or cylinder of unit radius, placed by `to_world` (a similarity, camera at the origin).

    The sphere is about the origin, the disk in the xy plane with its normal along +z, the cylinder along z from -half_height
    to +half_height (in units of its radius) with normals outwards.
    """

    kind: Literal["sphere", "disk", "cylinder"]
    to_world: NDArray[np.float64]
    part: int
    half_height: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class SceneSurfaces:
    """All surfaces, in metres, world axes, camera at the origin.

    Attributes
    ----------
    vertices_m
        (n, 3) float32.
    faces
        (m, 3) uint32; the first `emissive_faces` of them emit light.
    face_part
        (m,) uint32 index into `parts`.
    normals, uv
        (n, 3), (n, 2) float32 per vertex; a vertex without has zeros. None where no part has any.
    curved
        The curved shapes; those that emit light first, `emissive_curved` of them.
    parts, materials, groups
        Shared records; `groups` are the names of light groups, in alphabetical order.
    """

    host_only: ClassVar[bool] = True

    vertices_m: NDArray[np.float32]
    faces: NDArray[np.uint32]
    face_part: NDArray[np.uint32]
    normals: NDArray[np.float32] | None
    uv: NDArray[np.float32] | None
    emissive_faces: int
    curved: tuple[CurvedShape, ...]
    emissive_curved: int
    parts: tuple[PartRecord, ...]
    materials: tuple[Material, ...]
    groups: tuple[str, ...]
