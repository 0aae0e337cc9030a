"""Surface queries through the pixel centres: what is seen, and what is there behind it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import CancelledError, FullwellError, RenderError
from fullwell.render.rays import CameraRays
from fullwell.render.translate import TranslatedScene, translate
from fullwell.render.variant import activate
from fullwell.scene import Camera, SceneDescription, SurfaceHits
from fullwell.scene.validate import check_camera

__all__ = ["query_surfaces"]

_MAX_LAYERS = 512
"""Surfaces followed along one ray when counting hidden objects; deeper ones are not counted."""


def query_surfaces(
    scene: SceneDescription,
    camera: Camera,
    *,
    should_cancel: Callable[[], bool] | None = None,
) -> SurfaceHits:
    """Return the first surface behind every pixel centre, and for how many pixels each object lies on the ray at all.

    The rays are the chief rays of the camera's lens, the same that make the image. A ray goes on behind each surface, so an
    object's amodal pixel count includes what others hide, but not what lies outside the film.

    Raises
    ------
    FieldError
        The camera or a part of the scene cannot be rendered; the message names it.
    RenderError
        The renderer refused the scene.
    CancelledError
        `should_cancel` returned true between two layers.
    """
    check_camera(camera)
    mi = activate()
    translated = translate(mi, scene, camera.camera_to_world[:3, 3])
    try:
        kind: type[_WavefrontCaster | _ScalarCaster] = _WavefrontCaster if mi.variant().startswith("llvm") else _ScalarCaster
        return _collect(kind(mi, translated, camera), scene, camera, should_cancel)
    except FullwellError:
        raise
    except Exception as error:
        raise RenderError(f"the surface query failed: {error.__cause__ or error}") from error


_MAX_PENDING_PAIRS = 20_000_000


class _Layer:
    """One surface per ray that is still alive: pixel (n,), object (n,), range_m (n,), normal (n, 3) in world axes."""

    def __init__(self, pixel: Any, objects: Any, range_m: Any, normal: Any) -> None:
        self.pixel: NDArray[np.int64] = pixel
        self.objects: NDArray[np.int32] = objects
        self.range_m: NDArray[np.float64] = range_m
        self.normal: NDArray[np.float64] = normal


def _collect(
    caster: _WavefrontCaster | _ScalarCaster,
    scene: SceneDescription,
    camera: Camera,
    should_cancel: Callable[[], bool] | None,
) -> SurfaceHits:
    rows, cols = camera.film.rows, camera.film.cols
    pixels, objects = rows * cols, max(1, len(scene.objects))
    object_index = np.full(pixels, -1, dtype=np.int32)
    range_m = np.full(pixels, np.inf, dtype=np.float32)
    normals = np.zeros((pixels, 3), dtype=np.float32)
    seen: list[NDArray[np.int64]] = []
    for depth in range(_MAX_LAYERS):
        if should_cancel is not None and should_cancel():
            raise CancelledError("the label pass was cancelled; nothing was written")
        layer = caster.next_layer()
        if layer is None:
            break
        if depth == 0:
            object_index[layer.pixel] = layer.objects
            range_m[layer.pixel] = layer.range_m
            normals[layer.pixel] = layer.normal @ camera.camera_to_world[:3, :3]
        # A ray meets a closed object at least twice; each (pixel, object) pair counts once.
        seen.append(layer.pixel * objects + layer.objects)
        if sum(map(len, seen)) > _MAX_PENDING_PAIRS:
            seen = [np.unique(np.concatenate(seen))]
    pairs = np.unique(np.concatenate(seen)) if seen else np.empty(0, dtype=np.int64)
    amodal = np.bincount(pairs % objects, minlength=objects)[: len(scene.objects)]
    return SurfaceHits(
        object_index=object_index.reshape(rows, cols),
        range_m=range_m.reshape(rows, cols),
        normal_camera=normals.reshape(rows, cols, 3),
        amodal_px=amodal.astype(np.int64),
    )


class _WavefrontCaster:
    """Peels the scene layer by layer with compiled wavefronts, dropping rays that have left it."""

    def __init__(self, mi: Any, translated: TranslatedScene, camera: Camera) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr, self._scene = mi, dr, translated.scene
        self._pixel = np.arange(camera.film.rows * camera.film.cols, dtype=np.int64)
        lane = dr.arange(mi.UInt32, len(self._pixel))
        cols = dr.opaque(mi.UInt32, camera.film.cols)
        row = lane // cols
        x_px, y_px = mi.Float(lane - row * cols) + 0.5, mi.Float(row) + 0.5
        direction = CameraRays(mi, camera).chief(x_px, y_px)
        self._ray = mi.Ray3f(o=dr.zeros(mi.Point3f, len(self._pixel)), d=direction)
        self._travelled = dr.zeros(mi.Float, len(self._pixel))
        self._object_of = self._lookup(translated)

    def _lookup(self, translated: TranslatedScene) -> NDArray[np.int32]:
        mi, dr = self._mi, self._dr
        registry: dict[int, int] = {}
        for shape in translated.scene.shapes():
            key: Any = dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))
            registry[int(key[0])] = translated.object_of_shape[shape.id()]
        table = np.full(max(registry, default=0) + 1, -1, dtype=np.int32)
        for key, value in registry.items():
            table[key] = value
        return table

    def next_layer(self) -> _Layer | None:
        """Return the next surface of every ray still inside the scene; None when none is."""
        mi, dr = self._mi, self._dr
        if len(self._pixel) == 0:
            return None
        si = self._scene.ray_intersect(self._ray)
        hit = si.is_valid()
        shape = dr.select(hit, dr.reinterpret_array(mi.UInt32, si.shape), 0)
        normal = dr.select(dr.dot(si.sh_frame.n, self._ray.d) > 0, -si.sh_frame.n, si.sh_frame.n)
        travelled = self._travelled + si.t
        onward = si.spawn_ray(self._ray.d)
        dr.eval(hit, shape, normal, travelled, onward)
        alive = np.asarray(hit.numpy(), dtype=bool)
        if not alive.any():
            return None
        layer = _Layer(
            self._pixel[alive],
            self._object_of[shape.numpy()[alive]],
            travelled.numpy()[alive].astype(np.float64),
            normal.numpy().T[alive].astype(np.float64),
        )
        # Offsetting the origin against self-intersection moves it by about 1e-7 of the distance: range stays within float32.
        kept = mi.UInt32(np.flatnonzero(alive).astype(np.uint32))
        self._pixel = layer.pixel
        self._travelled = dr.gather(mi.Float, travelled, kept)
        self._ray = mi.Ray3f(o=dr.gather(mi.Point3f, onward.o, kept), d=dr.gather(mi.Vector3f, onward.d, kept))
        return layer


class _ScalarCaster:
    """The same, ray by ray, for machines without a usable LLVM (seconds instead of tenths)."""

    def __init__(self, mi: Any, translated: TranslatedScene, camera: Camera) -> None:
        self._mi, self._scene, self._object_of_shape = mi, translated.scene, translated.object_of_shape
        rows, cols = camera.film.rows, camera.film.cols
        y, x = np.mgrid[0:rows, 0:cols] + 0.5
        local = np.stack([(x - cols / 2) * camera.tangent_pitch, (y - rows / 2) * camera.tangent_pitch, np.ones_like(x)], -1)
        world = local.reshape(-1, 3) @ camera.camera_to_world[:3, :3].T
        world /= np.linalg.norm(world, axis=1, keepdims=True)
        self._alive = [(pixel, mi.Ray3f([0, 0, 0], [float(v) for v in d]), 0.0) for pixel, d in enumerate(world)]

    def next_layer(self) -> _Layer | None:
        """Return the next surface of every ray still inside the scene; None when none is."""
        found, onward = [], []
        for pixel, ray, travelled in self._alive:
            si = self._scene.ray_intersect(ray)
            if not si.is_valid():
                continue
            normal = np.array(si.sh_frame.n, dtype=np.float64).ravel()
            facing = -normal if normal @ np.array(ray.d, dtype=np.float64).ravel() > 0 else normal
            found.append((pixel, self._object_of_shape[si.shape.id()], travelled + float(si.t), facing))
            onward.append((pixel, si.spawn_ray(ray.d), travelled + float(si.t)))
        self._alive = onward
        if not found:
            return None
        pixels, objects, ranges, normals = zip(*found, strict=True)
        return _Layer(np.array(pixels), np.array(objects, dtype=np.int32), np.array(ranges), np.array(normals))
