"""Chief rays into a loaded scene: the first thing that each of them meets, and how far each object reaches on the film."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fullwell.render.outlines import Extents, film_extents
from fullwell.render.rays import CameraRays
from fullwell.render.subpixel import film_positions
from fullwell.render.translate import TranslatedScene
from fullwell.render.transport.geometry import Geometry
from fullwell.render.transport.upload import upload
from fullwell.scene import Camera

__all__ = ["Caster", "CompiledCaster", "ScalarCaster", "Seen"]

_MAX_LAYERS = 512
"""Surfaces that the scalar query follows along one ray when counting hidden objects; deeper ones are not counted."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """First surfaces along n rays: `objects` (n,) int32 indices, -1 for nothing; `range_m` (n,) float32, +inf for nothing;
    `normal` (n, 3) float32 in world axes, turned towards the camera, 0 for nothing."""

    objects: NDArray[np.int32]
    range_m: NDArray[np.float32]
    normal: NDArray[np.float32]


class Caster(Protocol):
    """Knows one scene through one camera."""

    def first(self, x_px: NDArray[np.float32], y_px: NDArray[np.float32]) -> Seen:
        """Return the first surfaces along the chief rays through film positions (n,)."""
        ...

    def first_objects(self, x_px: NDArray[np.float32], y_px: NDArray[np.float32]) -> NDArray[np.int32]:
        """Return only the `objects` of `first`."""
        ...

    def extents(self, offsets: NDArray[np.float64]) -> Extents:
        """Return on how much of the film each object lies, hidden or not, by samples at all centres and `offsets` from them."""
        ...


class CompiledCaster:
    """Compiled kernels, the same for all scenes whose geometry has the same features."""

    def __init__(self, mi: Any, geometry: Geometry, camera: Camera, objects: int) -> None:
        self._mi, self._geometry, self._camera, self._objects = mi, geometry, camera, objects
        self._rays = CameraRays(mi, camera)
        of_part = [part.object_index for part in geometry.surfaces.parts] or [0]
        # At least two entries: an array of one is taken for a constant, and another kernel would be compiled.
        self._object_of_part = upload(mi.Int32, np.array([*of_part, 0], dtype=np.int32))

    def first(self, x_px: NDArray[np.float32], y_px: NDArray[np.float32]) -> Seen:
        """Return the first surfaces along the chief rays through film positions (n,)."""
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        hit, direction = self._hit(x_px, y_px)
        objects = self._object(hit)
        facing = dr.select(dr.dot(hit.shading_normal, direction) > 0, -hit.shading_normal, hit.shading_normal)
        normal = dr.select(hit.valid, facing, 0.0)
        dr.eval(objects, hit.distance, normal)
        count = len(x_px)
        return Seen(
            np.asarray(objects.numpy(), dtype=np.int32)[:count],
            np.asarray(hit.distance.numpy(), dtype=np.float32)[:count],
            # Axis by axis: Dr.Jit writes the number of vectors into the code that interleaves them.
            np.stack([axis.numpy() for axis in normal], axis=-1)[:count],
        )

    def first_objects(self, x_px: NDArray[np.float32], y_px: NDArray[np.float32]) -> NDArray[np.int32]:
        """Return only the `objects` of `first`: a kernel that does less."""
        objects = self._object(self._hit(x_px, y_px)[0])
        return np.asarray(objects.numpy(), dtype=np.int32)[: len(x_px)]

    def extents(self, offsets: NDArray[np.float64]) -> Extents:
        """Return the extents of the projected triangles, without a ray."""
        return film_extents(self._mi, self._geometry, self._camera, self._objects, offsets)

    def _hit(self, x_px: NDArray[np.float32], y_px: NDArray[np.float32]) -> tuple[Any, Any]:
        import drjit as dr  # noqa: PLC0415

        mi, geometry = self._mi, self._geometry
        room = max(0, 2 - len(x_px))  # an array of one would be taken for a constant
        direction = self._rays.chief(*(upload(mi.Float, np.pad(v, (0, room)) if room else v) for v in (x_px, y_px)))
        lanes = len(x_px) + room
        ray = mi.Ray3f(o=dr.zeros(mi.Point3f, lanes), d=direction)
        return geometry.intersect(geometry.tables, geometry.scene, ray, dr.full(mi.Mask, True, lanes)), direction

    def _object(self, hit: Any) -> Any:
        import drjit as dr  # noqa: PLC0415

        return dr.select(hit.valid, dr.gather(self._mi.Int32, self._object_of_part, hit.part, hit.valid), -1)


class ScalarCaster:
    """The same, ray by ray, for machines without a usable LLVM (seconds instead of tenths)."""

    def __init__(self, mi: Any, translated: TranslatedScene, camera: Camera, objects: int) -> None:
        self._mi, self._scene, self._object_of_shape = mi, translated.scene, translated.object_of_shape
        self._camera, self._objects = camera, objects

    def first(self, x_px: NDArray[np.float32], y_px: NDArray[np.float32]) -> Seen:
        """Return the first surfaces along the chief rays through film positions (n,)."""
        count = len(x_px)
        seen = Seen(
            np.full(count, -1, dtype=np.int32), np.full(count, np.inf, dtype=np.float32), np.zeros((count, 3), np.float32)
        )
        for number, direction in enumerate(self._directions(x_px, y_px)):
            si = self._scene.ray_intersect(self._ray(direction))
            if si.is_valid():
                normal = np.array(si.sh_frame.n, dtype=np.float64).ravel()
                seen.objects[number] = self._object_at(si)
                seen.range_m[number] = float(si.t)
                seen.normal[number] = -normal if normal @ direction > 0 else normal
        return seen

    def _object_at(self, si: Any) -> int:
        """Return the object that a ray met; a mesh that many objects share is known by its instance."""
        return self._object_of_shape[(si.shape if si.instance is None else si.instance).id()]

    def first_objects(self, x_px: NDArray[np.float32], y_px: NDArray[np.float32]) -> NDArray[np.int32]:
        """Return only the `objects` of `first`."""
        return self.first(x_px, y_px).objects

    def extents(self, offsets: NDArray[np.float64]) -> Extents:
        """Return the extents by the rays through the centres, surface by surface until they leave the scene; no areas."""
        met = np.zeros(self._objects, dtype=np.int64)
        pixels = np.arange(self._camera.film.rows * self._camera.film.cols)
        for direction in self._directions(*film_positions(pixels, np.zeros((1, 2)), self._camera.film.cols)):
            ray, along = self._ray(direction), set()
            for _ in range(_MAX_LAYERS):
                si = self._scene.ray_intersect(ray)
                if not si.is_valid():
                    break
                along.add(self._object_at(si))
                ray = si.spawn_ray(ray.d)
            met[list(along)] += 1
        return Extents(met, None, np.empty(0, dtype=np.int64))

    def _directions(self, x_px: NDArray[np.float32], y_px: NDArray[np.float32]) -> NDArray[np.float64]:
        film, pitch = self._camera.film, self._camera.tangent_pitch
        x, y = (x_px.astype(np.float64) - film.cols / 2) * pitch, (y_px.astype(np.float64) - film.rows / 2) * pitch
        world = np.stack([x, y, np.ones_like(x)], axis=-1) @ self._camera.camera_to_world[:3, :3].T
        return np.asarray(world / np.linalg.norm(world, axis=1, keepdims=True))

    def _ray(self, direction: NDArray[np.float64]) -> Any:
        return self._mi.Ray3f([0, 0, 0], [float(v) for v in direction])
