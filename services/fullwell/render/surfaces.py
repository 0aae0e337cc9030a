"""Surface queries through the pixels: what is seen, how much of each pixel it fills, and what is there behind it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import CancelledError, FieldError, FullwellError, RenderError
from fullwell.render.casting import Caster, CompiledCaster, ScalarCaster, Seen
from fullwell.render.subpixel import edge_pixels, film_positions, following_pixels, sample_offsets
from fullwell.render.translate import translate
from fullwell.render.transport.loading import load_geometry
from fullwell.render.variant import activate
from fullwell.scene import Camera, Geometry, Mesh, SceneDescription, SurfaceHits
from fullwell.scene.extents import axis_cosines, objects_in_view
from fullwell.scene.validate import check_camera, check_scene

__all__ = ["query_depth", "query_surfaces"]

_STEPS = 4
"""Pixels that a thin thing is followed at once, from the second round on."""

_RAYS_AT_ONCE = 1 << 20

_MANY_TRIANGLES = 1 << 18
_SMALL_SHARE = 0.6
"""Of a scene of many triangles only what may be in view is loaded, where that is at most this share of them. Decided by the
scene and the camera alone: where two surfaces coincide, which of them is met depends on what else is there."""


def query_surfaces(
    scene: SceneDescription,
    camera: Camera,
    *,
    subsamples: int = 16,
    should_cancel: Callable[[], bool] | None = None,
) -> SurfaceHits:
    """Return the first surface behind every pixel centre, and the area on which each object is seen and lies at all.

    The rays are chief rays of the camera's lens, which meet the surfaces that the image is made of. Pixels in which more than
    one object may be seen get `subsamples` rays beside the one through their centre, at places that are always the same. An
    object's amodal extent includes what others hide, but not what lies outside the film.

    Raises
    ------
    FieldError
        The camera or a part of the scene cannot be rendered, or `subsamples` is not an even number; the message names it.
    RenderError
        The renderer refused the scene.
    CancelledError
        `should_cancel` returned true between two launches.
    """
    offsets = sample_offsets(subsamples)
    try:
        return _Query(scene, camera, should_cancel).surfaces(offsets)
    except FullwellError:
        raise
    except Exception as error:
        raise RenderError(f"the surface query failed: {error.__cause__ or error}") from error


def query_depth(
    scene: SceneDescription, camera: Camera, *, should_cancel: Callable[[], bool] | None = None
) -> NDArray[np.float32]:
    """Return (rows, cols) the depth along the optical axis behind every pixel centre [m]; +inf where nothing is.

    Raises what `query_surfaces` raises.
    """
    try:
        query = _Query(scene, camera, should_cancel)
        range_m = query.centres().range_m.reshape(query.shape)
    except FullwellError:
        raise
    except Exception as error:
        raise RenderError(f"the depth query failed: {error.__cause__ or error}") from error
    return np.asarray(range_m * axis_cosines(camera), dtype=np.float32)


class _Query:
    """One camera's rays into one scene."""

    def __init__(self, scene: SceneDescription, camera: Camera, should_cancel: Callable[[], bool] | None) -> None:
        check_camera(camera)
        self._camera, self._should_cancel = camera, should_cancel
        self.shape = camera.film.rows, camera.film.cols
        self._all_objects = len(scene.objects)
        self._numbers = _needed(scene, camera)
        """Of the objects that are loaded, in the scene; None: all are."""
        needed = scene
        if self._numbers is not None:
            needed = replace(scene, objects=tuple(scene.objects[number] for number in self._numbers))
        self._objects = len(needed.objects)
        try:
            self._caster = _caster(activate(), needed, camera)
        except FieldError:
            check_scene(scene)  # an error names the place in the scene that was given
            raise

    def centres(self) -> Seen:
        """Return what the rays through all pixel centres meet first."""
        places = self._places(np.arange(self.shape[0] * self.shape[1]), np.zeros((1, 2)))
        pieces = [self._caster.first(*place) for place in places]
        return Seen(
            np.concatenate([piece.objects for piece in pieces]),
            np.concatenate([piece.range_m for piece in pieces]),
            np.concatenate([piece.normal for piece in pieces]),
        )

    def surfaces(self, offsets: NDArray[np.float64]) -> SurfaceHits:
        """Return the hits, with rays at `offsets` from the centres of pixels that may show several objects."""
        extents = self._caster.extents(offsets)
        centre = self.centres()
        ids = centre.objects.reshape(self.shape)
        seen = _SeenAreas(centre.objects, self._objects)
        sampled = np.zeros(ids.size, dtype=bool)
        wanted = edge_pixels(ids).ravel()
        wanted[extents.missed_pixels] = True
        todo, steps = np.flatnonzero(wanted), 1
        while len(todo):
            sampled[todo] = True
            further = [self._caster.first_objects(*place) for place in self._places(todo, offsets)]
            foreign = seen.refine(todo, np.concatenate(further).reshape(len(todo), -1))
            mixed = foreign.any(axis=1)
            onward = following_pixels(todo[mixed], foreign[mixed], offsets, self.shape, steps=steps)
            todo, steps = np.unique(onward[~sampled[onward]]), _STEPS
        visible_px = np.bincount(centre.objects + 1, minlength=self._objects + 1)[1:]
        # Rounding may let the traced and the projected outline differ by a sample: what is seen is there.
        amodal_px = np.maximum(extents.amodal_px, visible_px)
        hidden_px = amodal_px - visible_px
        area_px = seen.area_px + hidden_px if extents.area_px is None else np.maximum(extents.area_px, seen.area_px)
        return SurfaceHits(
            object_index=ids if self._numbers is None else np.append(self._numbers, -1).astype(ids.dtype)[ids],
            range_m=centre.range_m.reshape(self.shape),
            normal_camera=(centre.normal @ self._camera.camera_to_world[:3, :3].astype(np.float32)).reshape(*self.shape, 3),
            coverage=seen.coverage.reshape(self.shape),
            amodal_px=self._of_all(amodal_px),
            visible_area_px=self._of_all(seen.area_px),
            amodal_area_px=self._of_all(area_px),
        )

    def _of_all(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return a value for each object of the scene: 0 for those that are not loaded."""
        if self._numbers is None:
            return values
        spread = np.zeros(self._all_objects, dtype=values.dtype)
        spread[self._numbers] = values
        return spread

    def _places(
        self, pixels: NDArray[np.int64], offsets: NDArray[np.float64]
    ) -> Iterator[tuple[NDArray[np.float32], NDArray[np.float32]]]:
        """Yield the film positions at `offsets` from the centres of `pixels`, as many as fit into one launch."""
        at_once = max(1, _RAYS_AT_ONCE // len(offsets))
        for start in range(0, len(pixels), at_once):
            if self._should_cancel is not None and self._should_cancel():
                raise CancelledError("the label pass was cancelled; nothing was written")
            yield film_positions(pixels[start : start + at_once], offsets, self.shape[1])


def _needed(scene: SceneDescription, camera: Camera) -> NDArray[np.int64] | None:
    """Return the numbers of the objects that may be in view, where loading only those is worth it; else None."""
    triangles = np.array([sum(_triangles(part.geometry) for part in item.parts) for item in scene.objects], dtype=np.int64)
    if triangles.sum() < _MANY_TRIANGLES:
        return None
    try:
        seen = objects_in_view(scene, camera)
    except ValueError:  # arrays that are no meshes: the check of the whole scene names them
        return None
    return np.flatnonzero(seen) if 0 < triangles[seen].sum() <= _SMALL_SHARE * triangles.sum() else None


def _triangles(geometry: Geometry) -> int:
    return len(geometry.faces) if isinstance(geometry, Mesh) else 1


def _caster(mi: Any, scene: SceneDescription, camera: Camera) -> Caster:
    centre_m = camera.camera_to_world[:3, 3]
    if mi.variant().startswith("llvm"):
        return CompiledCaster(mi, load_geometry(mi, scene, centre_m), camera, len(scene.objects))
    return ScalarCaster(mi, translate(mi, scene, centre_m), camera, len(scene.objects))


class _SeenAreas:
    """Areas [px] from the rays so far: a pixel counts as a whole for what its centre shows until further rays refine it."""

    def __init__(self, own: NDArray[np.int32], objects: int) -> None:
        self._own, self._objects = own, objects
        self.coverage = np.ones(len(own), dtype=np.float32)
        self.area_px = self._counts(own).astype(np.float64)

    def _counts(self, found: NDArray[np.int32]) -> NDArray[np.int64]:
        return np.bincount(found.ravel() + 1, minlength=self._objects + 1)[1:]

    def refine(self, pixels: NDArray[np.int64], found: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Take the objects `found` (pixels, rays) by further rays in; return where they are not the pixel's own.

        The weight of the centre goes from 1 to 1 / (rays + 1).
        """
        own, rays = self._own[pixels], found.shape[1]
        centre = self._counts(own)
        self.area_px += (self._counts(found) + centre) / (rays + 1) - centre
        foreign = found != own[:, None]
        self.coverage[pixels] = 1.0 - foreign.sum(axis=1) / (rays + 1)
        return np.asarray(foreign)
