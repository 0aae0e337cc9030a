"""Surfaces on the device: what a ray meets, and where the next one may start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fullwell.render.transport.collect import CURVED_OFFSET, RAY_OFFSET
from fullwell.render.transport.surfaces import CurvedShape, SceneSurfaces
from fullwell.render.transport.upload import upload

__all__ = ["Geometry", "Hit", "Tables"]

_CURVED_FLOATS = 16
_KINDS = {"sphere": 0, "disk": 1, "cylinder": 2}
_NO_LEAF = 0xFFFFFFFF
_MESH = 0xFFFFFFFF
_ESCAPE = 1e-12
"""Squared length below which an interpolated normal says nothing."""

Tables = dict[str, Any]
"""Device arrays by name: what a kernel reads of a scene. They are its arguments, never part of its code."""


@dataclass(slots=True)
class Hit:
    """What a ray met, in arrays of the lanes.

    `valid`; `distance` [m]; `point`; `front_normal`, geometric, on the surface's front side; `shading_normal` on the same
    side or as its vertices say; `uv`; `part` and `material` numbers; `leaf`, the number among the lamps or 0xFFFFFFFF;
    `offset_m`, how far off the surface a further ray must start.
    """

    valid: Any
    distance: Any
    point: Any
    front_normal: Any
    shading_normal: Any
    uv: Any
    part: Any
    material: Any
    leaf: Any
    offset_m: Any

    def start(self, direction: Any, mi: Any, dr: Any) -> Any:
        """Return where a ray along `direction` (Vector3f) starts so that it does not meet this surface again."""
        side = dr.select(dr.dot(self.front_normal, direction) >= 0, self.offset_m, -self.offset_m)
        return mi.Point3f(self.point + self.front_normal * side)


class Geometry:
    """The traced scene and its tables. One mesh holds all triangles, so that the tracing code is the same for all scenes.

    `features` is a subset of {"mesh", "curved", "normals", "uv"}.
    """

    def __init__(self, mi: Any, surfaces: SceneSurfaces) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        self.surfaces = surfaces
        self.tables: Tables = {}
        # Else the plane of a needle, a wire say, is off by its aspect times the rounding, and it shadows itself.
        contents: dict[str, Any] = {"type": "scene", "embree_use_robust_intersections": True}
        features = set()
        if len(surfaces.faces):
            features.add("mesh")
            contents["mesh"] = self._mesh()
        if surfaces.curved:
            features.add("curved")
            for number, shape in enumerate(surfaces.curved):
                contents[f"c{number:06d}"] = _curved_shape(mi, shape)
        if surfaces.normals is not None:
            features.add("normals")
            self.tables["normals"] = upload(mi.Float, surfaces.normals)
        if surfaces.uv is not None:
            features.add("uv")
            self.tables["uv"] = upload(mi.Float, surfaces.uv)
        self.features = frozenset(features)
        self.scene = mi.load_dict(contents, optimize=False)
        parts = np.array([part.material for part in surfaces.parts] or [0], dtype=np.uint32)
        self.tables["part_material"] = upload(mi.UInt32, parts)
        self.tables["emissive_faces"] = dr.opaque(mi.UInt32, surfaces.emissive_faces)
        self.tables["emissive_curved"] = dr.opaque(mi.UInt32, surfaces.emissive_curved)
        self._add_curved_tables()

    def _mesh(self) -> Any:
        mi, surfaces = self._mi, self.surfaces
        mesh = mi.Mesh("mesh", len(surfaces.vertices_m), len(surfaces.faces), mi.Properties(), False, False)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = upload(mi.Float, surfaces.vertices_m)
        parameters["faces"] = upload(mi.UInt32, surfaces.faces)
        parameters.update()
        self.tables["vertices"] = mi.Float(parameters["vertex_positions"])
        self.tables["faces"] = mi.UInt32(parameters["faces"])
        self.tables["face_part"] = upload(mi.UInt32, surfaces.face_part)
        return mesh

    def _add_curved_tables(self) -> None:
        mi, dr = self._mi, self._dr
        if "curved" not in self.features:
            return
        curved = self.surfaces.curved
        numbers: dict[int, int] = {}
        for shape in self.scene.shapes():
            key = int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])
            name = shape.id()
            numbers[key] = int(name[1:]) if name.startswith("c") and name != "mesh" else _MESH
        table = np.full(max(numbers, default=0) + 1, _MESH, dtype=np.uint32)
        for key, number in numbers.items():
            table[key] = number
        self.curved_of_shape = table
        self.tables["curved_of_shape"] = upload(mi.UInt32, table)
        self.tables["curved"] = upload(mi.Float, np.concatenate([_curved_record(shape) for shape in curved]))

    def occluded(self, scene: Any, ray: Any, active: Any) -> Any:
        """Return whether anything is in a ray's way."""
        return scene.ray_test(ray, coherent=False, active=active)

    def reach_m(self) -> float:
        """Return the distance from the origin that no surface exceeds [m]; 1 where there is none."""
        bounds = self.scene.bbox()
        if not bounds.valid():
            return 1.0
        corner = np.maximum(np.abs(np.array(bounds.min).ravel()), np.abs(np.array(bounds.max).ravel()))
        return float(np.linalg.norm(corner))

    def intersect(self, tables: Tables, scene: Any, ray: Any, active: Any) -> Hit:
        """Return what a ray meets first."""
        mi, dr = self._mi, self._dr
        found = scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        valid = active & found.is_valid()
        distance = dr.select(valid, found.t, dr.inf)
        on_mesh = mi.Mask(valid)
        number = mi.UInt32(0)
        if "curved" in self.features:
            shape = dr.reinterpret_array(mi.UInt32, found.shape)
            number = dr.gather(mi.UInt32, tables["curved_of_shape"], shape, valid)
            on_mesh = valid & (number == _MESH)
        hit = Hit(
            valid=valid,
            distance=distance,
            point=dr.zeros(mi.Point3f),
            front_normal=mi.Vector3f(0, 0, 1),
            shading_normal=mi.Vector3f(0, 0, 1),
            uv=dr.zeros(mi.Point2f),
            part=mi.UInt32(0),
            material=mi.UInt32(0),
            leaf=mi.UInt32(_NO_LEAF),
            offset_m=mi.Float(0),
        )
        if "mesh" in self.features:
            self._fill_from_mesh(hit, tables, found, on_mesh)
        if "curved" in self.features:
            self._fill_from_curved(hit, tables, ray, number, valid & ~on_mesh)
        hit.material = dr.gather(mi.UInt32, tables["part_material"], hit.part, valid)
        return hit

    def _fill_from_mesh(self, hit: Hit, tables: Tables, found: Any, active: Any) -> None:
        mi, dr = self._mi, self._dr
        face = found.prim_index
        corners = dr.gather(mi.Vector3u, tables["faces"], face, active)
        a, b, c = (dr.gather(mi.Point3f, tables["vertices"], corners[i], active) for i in range(3))
        v, w = found.prim_uv.x, found.prim_uv.y
        u = 1.0 - v - w
        crossed = dr.cross(b - a, c - a)
        # Twice: the squares of a millimetre triangle's sides underflow in a single normalisation.
        normal = dr.normalize(crossed * dr.rcp(dr.maximum(dr.max(dr.abs(crossed)), 1e-37)))
        shading = mi.Vector3f(normal)
        if "normals" in self.features:
            of_vertices = [dr.gather(mi.Vector3f, tables["normals"], corners[i], active) for i in range(3)]
            mean = of_vertices[0] * u + of_vertices[1] * v + of_vertices[2] * w
            smooth = dr.squared_norm(mean) > _ESCAPE
            shading = dr.select(smooth, mean * dr.rsqrt(dr.maximum(dr.squared_norm(mean), _ESCAPE)), normal)
            normal = dr.select(dr.dot(normal, shading) < 0, -normal, normal)
        if "uv" in self.features:
            of_corners = [dr.gather(mi.Point2f, tables["uv"], corners[i], active) for i in range(3)]
            hit.uv = dr.select(active, of_corners[0] * u + of_corners[1] * v + of_corners[2] * w, hit.uv)
        reach = dr.maximum(dr.maximum(dr.abs(a), dr.abs(b)), dr.abs(c))
        hit.point = dr.select(active, a * u + b * v + c * w, hit.point)
        hit.front_normal = dr.select(active, normal, hit.front_normal)
        hit.shading_normal = dr.select(active, shading, hit.shading_normal)
        hit.offset_m = dr.select(active, RAY_OFFSET * dr.dot(dr.abs(normal), reach), hit.offset_m)
        hit.part = dr.select(active, dr.gather(mi.UInt32, tables["face_part"], face, active), hit.part)
        hit.leaf = dr.select(active & (face < tables["emissive_faces"]), face, hit.leaf)

    def _fill_from_curved(self, hit: Hit, tables: Tables, ray: Any, number: Any, active: Any) -> None:
        mi, dr = self._mi, self._dr
        base = dr.select(active, number, 0) * _CURVED_FLOATS
        value = [dr.gather(mi.Float, tables["curved"], base + i, active) for i in range(_CURVED_FLOATS)]
        x_axis, y_axis, z_axis = (mi.Vector3f(*value[3 * i : 3 * i + 3]) for i in range(3))
        centre, radius, kind, half_height = mi.Point3f(*value[9:12]), value[12], value[13], value[14]
        part = mi.UInt32(value[15])
        point = ray(hit.distance)
        local = point - centre
        x, y, z = dr.dot(local, x_axis), dr.dot(local, y_axis), dr.dot(local, z_axis)
        sphere, disk = kind == _KINDS["sphere"], kind == _KINDS["disk"]
        radial = x_axis * x + y_axis * y
        outward = dr.select(sphere, local, radial)
        outward = outward * dr.rsqrt(dr.maximum(dr.squared_norm(outward), 1e-37))
        normal = dr.select(disk, z_axis, outward)
        # Back onto the surface: the traced distance alone is off by its own rounding.
        snapped = dr.select(sphere, centre + outward * radius, centre + outward * radius + z_axis * z)
        snapped = dr.select(disk, point - z_axis * z, snapped)
        azimuth = dr.atan2(y, x) * (0.5 / dr.pi)
        azimuth = dr.select(azimuth < 0, azimuth + 1.0, azimuth)
        polar = dr.safe_acos(z / radius) / dr.pi
        upwards = dr.select(sphere, polar, 0.5 + 0.5 * z / (half_height * radius))
        along = dr.select(disk, dr.sqrt(x * x + y * y) / radius, upwards)
        uv = dr.select(disk, mi.Point2f(along, azimuth), mi.Point2f(azimuth, along))
        leaf = dr.select(number < tables["emissive_curved"], tables["emissive_faces"] + number, _NO_LEAF)
        extent = dr.abs(centre.x) + dr.abs(centre.y) + dr.abs(centre.z) + 2.0 * radius
        hit.point = dr.select(active, snapped, hit.point)
        hit.front_normal = dr.select(active, normal, hit.front_normal)
        hit.shading_normal = dr.select(active, normal, hit.shading_normal)
        hit.uv = dr.select(active, uv, hit.uv)
        hit.offset_m = dr.select(active, CURVED_OFFSET * extent, hit.offset_m)
        hit.part = dr.select(active, part, hit.part)
        hit.leaf = dr.select(active, leaf, hit.leaf)


def _curved_shape(mi: Any, shape: CurvedShape) -> Any:
    match shape.kind:
        case "sphere" | "disk":
            return {"type": shape.kind, "to_world": mi.ScalarTransform4f(shape.to_world)}
        case "cylinder":
            ends = [[0.0, 0.0, -shape.half_height], [0.0, 0.0, shape.half_height]]
            return {
                "type": "cylinder",
                "p0": ends[0],
                "p1": ends[1],
                "radius": 1.0,
                "to_world": mi.ScalarTransform4f(shape.to_world),
            }


def _curved_record(shape: CurvedShape) -> Any:
    """Return the shape's row: unit axes, centre, radius, kind, half height, part."""
    axes = shape.to_world[:3, :3]
    radius = float(np.linalg.norm(axes[:, 0]))
    tail = [radius, _KINDS[shape.kind], shape.half_height, shape.part]
    return np.concatenate([(axes / radius).T.ravel(), shape.to_world[:3, 3], tail]).astype(np.float32)
