"""A SceneDescription becomes plain arrays: every part's triangles in one mesh, around the camera, lamps first."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.render.conditioning import (
    check_glass_thickness,
    check_reach,
    naming,
    power_kept,
    with_whole_normals,
    without_repeated_faces,
)
from fullwell.render.transport.surfaces import CurvedShape, PartRecord, PlacedPattern, SceneSurfaces
from fullwell.scene import Cylinder, Dielectric, Disk, Material, Mesh, Part, SceneDescription, Sphere
from fullwell.scene.groups import group_names
from fullwell.scene.tessellate import is_similarity, mesh_of, transform_mesh
from fullwell.scene.validate import check_scene, may_repeat_faces

__all__ = ["BLACK", "CURVED_OFFSET", "RAY_OFFSET", "collect_surfaces"]

BLACK = 1e-35
"""Spectra below this are black: single precision has nothing smaller to work with."""

RAY_OFFSET = 1.5e-6
"""How far off a triangle rays start, times its largest coordinates along its normal: 25 roundings of single precision."""

CURVED_OFFSET = 3e-6
"""The same off curved shapes, times the coordinates of their centre and their diameter together."""

_SMALLEST_REACH_M = 1e-6
"""Scenes of a thirtieth of this are still right; below, the products of coordinates by which triangles are traced underflow."""


def collect_surfaces(
    scene: SceneDescription, centre_m: NDArray[np.float64], groups: tuple[str, ...] | None = None
) -> SceneSurfaces:
    """Return the surfaces of a scene with the world point `centre_m` [m] at the origin.

    `groups` are the names of the light groups where the scene is a part of one that has more.

    Raises
    ------
    FieldError
        The scene holds what cannot be rendered as it is meant; the message names the object.
    """
    check_scene(scene)
    check_reach(scene, centre_m, smallest_m=_SMALLEST_REACH_M)
    recentre = np.eye(4)
    recentre[:3, 3] = -np.asarray(centre_m, dtype=np.float64)
    collector = _Collector(group_names(scene) if groups is None else groups)
    for index, scene_object in enumerate(scene.objects):
        for number, part in enumerate(scene_object.parts):
            with naming(scene_object.id, index, number):
                collector.add(index, part, recentre @ scene_object.to_world @ part.to_object)
    return collector.finish()


@dataclass(slots=True)
class _Piece:
    mesh: Mesh
    part: int
    emissive: bool


@dataclass(slots=True)
class _Collector:
    groups: tuple[str, ...]
    pieces: list[_Piece] = field(default_factory=list)
    curved: list[tuple[CurvedShape, bool]] = field(default_factory=list)
    parts: list[PartRecord] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    material_numbers: dict[int, int] = field(default_factory=dict)

    def add(self, object_index: int, part: Part, to_world: NDArray[np.float64]) -> None:
        radiance = part.emission.radiance if part.emission is not None else None
        if radiance is not None and not np.any(radiance.values > BLACK):
            radiance = None
        group = self.groups.index(part.emission.group) if part.emission is not None and radiance is not None else 0
        curved = _curved(part, to_world, len(self.parts))
        if curved is None:
            local = mesh_of(part.geometry)
            if part.emission is not None and may_repeat_faces(local):
                local = without_repeated_faces(local)
            mesh = with_whole_normals(transform_mesh(to_world, local))
            if radiance is not None:
                mesh = _front_by_winding(mesh)
                radiance = power_kept(mesh, radiance)
            if isinstance(part.material, Dielectric):
                check_glass_thickness(mesh, _skipped_m)
            self.pieces.append(_Piece(mesh, len(self.parts), radiance is not None))
        else:
            self.curved.append((curved, radiance is not None))
        pattern = None
        if radiance is not None and part.emission is not None and part.emission.pattern is not None:
            pattern = PlacedPattern(part.emission.pattern, _axes(to_world))
        self.parts.append(PartRecord(object_index, self._material(part.material), radiance, group, pattern))

    def _material(self, material: Material) -> int:
        number = self.material_numbers.get(id(material))
        if number is None:
            number = self.material_numbers[id(material)] = len(self.materials)
            self.materials.append(material)
        return number

    def finish(self) -> SceneSurfaces:
        # Lamps first: the number of an emissive triangle is then its number among the lamps.
        pieces = sorted(self.pieces, key=lambda piece: not piece.emissive)
        curved = sorted(self.curved, key=lambda shape: not shape[1])
        counts = [len(piece.mesh.vertices_m) for piece in pieces]
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        faces = [piece.mesh.faces.astype(np.uint32) + np.uint32(start) for piece, start in zip(pieces, starts, strict=False)]
        return SceneSurfaces(
            vertices_m=_joined([p.mesh.vertices_m for p in pieces], 3, np.float32),
            faces=_joined(faces, 3, np.uint32),
            face_part=np.repeat(np.array([p.part for p in pieces], dtype=np.uint32), [len(p.mesh.faces) for p in pieces]),
            normals=_joined_where_any([p.mesh.normals for p in pieces], counts, 3),
            uv=_joined_where_any([p.mesh.uv for p in pieces], counts, 2),
            emissive_faces=sum(len(p.mesh.faces) for p in pieces if p.emissive),
            curved=tuple(shape for shape, _ in curved),
            emissive_curved=sum(emissive for _, emissive in curved),
            parts=tuple(self.parts),
            materials=tuple(self.materials),
            groups=self.groups,
        )


def _axes(to_world: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (3, 3) unit columns forward, left and up of a part: where it is mirrored, its left is on the other side."""
    forward, up = to_world[:3, 0] / np.linalg.norm(to_world[:3, 0]), to_world[:3, 2]
    left = np.cross(up, forward)
    left /= np.linalg.norm(left)
    return np.column_stack([forward, left, np.cross(forward, left)])


def _curved(part: Part, to_world: NDArray[np.float64], number: int) -> CurvedShape | None:
    """Return a sphere, disk or cylinder as it is; None where triangles must do (planes, odd scales)."""
    if not isinstance(part.geometry, Sphere | Disk | Cylinder) or not is_similarity(to_world):
        return None
    match part.geometry:
        case Sphere(radius_m=radius):
            return CurvedShape("sphere", to_world @ np.diag([radius, radius, radius, 1.0]), number)
        case Disk(radius_m=radius):
            return CurvedShape("disk", to_world @ np.diag([radius, radius, radius, 1.0]), number)
        case Cylinder(radius_m=radius, height_m=height):
            placed = to_world @ np.diag([radius, radius, radius, 1.0])
            return CurvedShape("cylinder", placed, number, half_height=height / 2 / radius)
        case _:
            return None


def _skipped_m(corners: NDArray[np.float64], normals: NDArray[np.float64]) -> float:
    """Return the largest distance [m] off triangles of (n, 3, 3) `corners` at which rays start."""
    reach = np.abs(corners).max(axis=1)
    return RAY_OFFSET * float(np.einsum("ij,ij->i", np.abs(normals), reach).max())


def _front_by_winding(mesh: Mesh) -> Mesh:
    """Return the lamp with the corners of its triangles in the order that agrees with their vertex normals."""
    if mesh.normals is None:
        return mesh
    corners = mesh.vertices_m[mesh.faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    against = np.einsum("ij,ij->i", crossed, mesh.normals[mesh.faces].sum(axis=1)) < 0
    if not against.any():
        return mesh
    faces = mesh.faces.copy()
    faces[against] = faces[against][:, [0, 2, 1]]
    return Mesh(mesh.vertices_m, faces, mesh.normals, mesh.uv)


def _joined(pieces: list[Any], width: int, dtype: Any) -> NDArray[Any]:
    return np.concatenate([np.asarray(piece, dtype=dtype) for piece in pieces] or [np.empty((0, width), dtype)])


def _joined_where_any(pieces: list[Any], counts: list[int], width: int) -> NDArray[np.float32] | None:
    """Return the pieces joined, zeros for those without; None where none has any."""
    if all(piece is None for piece in pieces):
        return None
    filled = [np.zeros((count, width)) if piece is None else piece for piece, count in zip(pieces, counts, strict=True)]
    return _joined(filled, width, np.float32)
