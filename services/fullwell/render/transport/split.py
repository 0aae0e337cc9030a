"""Surfaces in two scenes: those that stand still, loaded once, and those that move, loaded anew for each moment."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fullwell.render.transport.geometry import Geometry, Hit, Tables
from fullwell.render.transport.surfaces import SceneSurfaces
from fullwell.render.transport.upload import upload

__all__ = ["SplitGeometry"]

_NO_LEAF = 0xFFFFFFFF
_PREFIX = "moving_"
_SOME_FACES = 1024
"""Of those without light, by which the irradiance on what the camera sees is estimated."""


class SplitGeometry:
    """A `Geometry` of two, traced one after the other.

    Lamps count as if all were in one: emissive triangles that stand still, those that move, and curved lamps in the same way.
    `surfaces` holds the lamps, some of the other triangles, and the materials and parts of both.
    """

    def __init__(self, mi: Any, still: Geometry, moving: Geometry) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        self._still, self._moving = still, moving
        self.scene = (still.scene, moving.scene)
        self.surfaces, of_moving = _joined(still.surfaces, moving.surfaces)
        self.features = frozenset({f"still {name}" for name in still.features} | {f"moving {name}" for name in moving.features})
        self.tables: Tables = still.tables | {_PREFIX + name: table for name, table in moving.tables.items()}
        materials = np.array([part.material for part in of_moving] or [0], dtype=np.uint32)
        self.tables[_PREFIX + "part_material"] = upload(mi.UInt32, materials)

    def intersect(self, tables: Tables, scene: Any, ray: Any, active: Any) -> Hit:
        """Return what a ray meets first."""
        dr = self._dr
        of_moving = {name.removeprefix(_PREFIX): table for name, table in tables.items() if name.startswith(_PREFIX)}
        still = self._still.intersect(tables, scene[0], ray, active)
        moving = self._moving.intersect(of_moving, scene[1], ray, active)
        faces, curved = tables["emissive_faces"], tables["emissive_curved"]
        more = of_moving["emissive_faces"]
        on_face = (still.leaf < faces) | (still.leaf == _NO_LEAF)
        still.leaf = dr.select(on_face, still.leaf, still.leaf + more)
        on_face = moving.leaf < more
        place = dr.select(on_face, moving.leaf + faces, moving.leaf + faces + curved)
        moving.leaf = dr.select(moving.leaf == _NO_LEAF, moving.leaf, place)
        nearer = moving.valid & (moving.distance < still.distance)
        fields = ("distance", "point", "front_normal", "shading_normal", "uv", "part", "material", "leaf", "offset_m")
        chosen = {name: dr.select(nearer, getattr(moving, name), getattr(still, name)) for name in fields}
        return Hit(valid=still.valid | moving.valid, **chosen)

    def occluded(self, scene: Any, ray: Any, active: Any) -> Any:
        """Return whether anything is in a ray's way."""
        first = self._still.occluded(scene[0], ray, active)
        return first | self._moving.occluded(scene[1], ray, active & ~first)

    def reach_m(self) -> float:
        """Return the distance from the origin that no surface exceeds [m]."""
        return max(self._still.reach_m(), self._moving.reach_m())


def _joined(still: SceneSurfaces, moving: SceneSurfaces) -> tuple[SceneSurfaces, tuple[Any, ...]]:
    """Return what the lights need of both, and the parts of the moving one with the materials' numbers in both."""
    numbers = {id(material): number for number, material in enumerate(still.materials)}
    materials = list(still.materials)
    for material in moving.materials:
        if id(material) not in numbers:
            numbers[id(material)] = len(materials)
            materials.append(material)
    parts = tuple(replace(part, material=numbers[id(moving.materials[part.material])]) for part in moving.parts)
    first = len(still.parts)
    stride = max(1, (len(still.faces) + len(moving.faces)) // _SOME_FACES)
    corners, of_part = [], []
    for lamps in (True, False):
        for surfaces, start in ((still, 0), (moving, first)):
            split = surfaces.emissive_faces
            chosen = slice(0, split) if lamps else slice(split, None, stride)
            corners.append(surfaces.vertices_m[surfaces.faces[chosen]].reshape(-1, 3))
            of_part.append(surfaces.face_part[chosen] + np.uint32(start))
    curved_of_moving = [replace(shape, part=shape.part + first) for shape in moving.curved[: moving.emissive_curved]]
    vertices = np.concatenate(corners)
    surfaces = SceneSurfaces(
        vertices_m=vertices,
        faces=np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3),
        face_part=np.concatenate(of_part),
        normals=None,
        uv=None,
        emissive_faces=still.emissive_faces + moving.emissive_faces,
        curved=(*still.curved[: still.emissive_curved], *curved_of_moving),
        emissive_curved=still.emissive_curved + moving.emissive_curved,
        parts=(*still.parts, *parts),
        materials=tuple(materials),
        groups=still.groups,
    )
    return surfaces, parts
