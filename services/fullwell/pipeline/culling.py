"""Objects out of the camera's view that may be left out, with a bound on what that changes. See docs/physics/skips.md."""

from __future__ import annotations

import functools
import math
import weakref
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fullwell.pipeline.path_depth import LargestReflectance, largest_reflectance
from fullwell.pipeline.steps import PlanStep
from fullwell.radiometry import SkyRadiance, Spectrum, WavelengthGrid, clear_sky
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
    DirectionalLight,
    ImageEnvironment,
    Light,
    Mesh,
    SceneDescription,
    SceneObject,
    SunSky,
)
from fullwell.scene.extents import box_of

__all__ = ["Bounds", "leave_out", "object_bounds", "out_of_view", "relative_changes"]

Array = NDArray[np.float64]

_BUDGET = 2e-3
"""Change of any visible surface's irradiance, by all objects that are left out, in parts of the full, unshaded one."""

_MARGIN_PX = 1.0
"""The film is taken this much larger, so that rounding never drops what touches its edge."""

_SKY_ROWS, _SKY_COLS = 32, 64
_FINER_SKY = 1.1
"""The brightest point of the sky's map that is rendered, over that of this coarse one: at most 1.06 for turbidity 3."""

_LOWEST_SUN_SINE = 1e-5
"""As in the picture."""

_CORNERS = np.stack(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], indexing="ij"), axis=-1).reshape(8, 3)


# What may be left out ------------------------------------------------------------------------------------------------


def leave_out(
    scene: SceneDescription, camera: Camera, grid: WavelengthGrid, *, weighted: bool = False
) -> tuple[SceneDescription, PlanStep]:
    """Return the scene without the objects that cannot matter to the picture, and the decision.

    An object may go if no camera ray meets the ball around it, and if the bound on what its absence does to the irradiance of
    any visible surface is, with those of the others that go, below a budget. Nothing goes where that cannot be bounded.
    `weighted` says that views weight light groups, so that no light is known to be weak.
    """
    what = f"{camera.name}: objects out of view"
    bounds = object_bounds(scene)
    hidden = out_of_view(bounds, camera)
    if not hidden.any():
        return scene, PlanStep(what, "run", f"the camera may see all {len(scene.objects)} objects")
    count = f"{hidden.sum()} of {len(scene.objects)} objects"
    obstacle = _obstacle(scene, largest_reflectance(scene, grid), weighted=weighted)
    if obstacle:
        return scene, PlanStep(what, "run", f"{count} kept: {obstacle}")
    changes = _changes(scene, camera, grid, bounds, hidden)
    order = np.argsort(changes, kind="stable")
    dropped = order[np.cumsum(changes[order]) <= _BUDGET]
    if not len(dropped):
        least = float(changes.min())
        weakest = f"the irradiance by up to {least:.2g}" if math.isfinite(least) else "all light there is"
        return scene, PlanStep(what, "run", f"{count} kept: they are near or bright; the least of them may change {weakest}")
    gone = set(dropped.tolist())
    kept = tuple(item for number, item in enumerate(scene.objects) if number not in gone)
    triangles = sum(_triangles(scene.objects[number]) for number in gone)
    why = f"{len(gone)} of {len(scene.objects)} objects ({triangles} triangles) left out: far away and in no light's way"
    bound = f"{float(changes[dropped].sum()):.2g} of the full irradiance on any surface"
    return replace(scene, objects=kept), PlanStep(what, "skip", why, bound)


def relative_changes(scene: SceneDescription, camera: Camera, grid: WavelengthGrid) -> Array:
    """Return (objects,) bounds on what the absence of each does to any visible surface's irradiance, in parts of the full one.

    inf for objects in view, and where nothing is known.
    """
    bounds = object_bounds(scene)
    if _obstacle(scene, largest_reflectance(scene, grid), weighted=False):
        return np.full(len(scene.objects), math.inf)
    return _changes(scene, camera, grid, bounds, out_of_view(bounds, camera))


def _changes(scene: SceneDescription, camera: Camera, grid: WavelengthGrid, bounds: Bounds, hidden: NDArray[np.bool_]) -> Array:
    reflectance = largest_reflectance(scene, grid).value
    light = _light_of(scene, grid, reflectance)
    if not 0.0 < light.contrast < math.inf:
        return np.full(len(hidden), math.inf)
    return light.contrast * _reach(bounds, hidden, camera, light, reflectance)


def _obstacle(scene: SceneDescription, reflectance: LargestReflectance, *, weighted: bool) -> str:
    """Return why nothing can be bounded, or nothing."""
    if scene.fog is not None:
        return "fog carries light from all sides"
    if not reflectance.matte:
        return f"{reflectance.object_id!r} is not matte and may mirror them"
    if weighted:
        return "the views weight light groups"
    if reflectance.value >= 1.0:
        return f"{reflectance.object_id!r} returns all light"
    if any(not isinstance(light, _FAR_LIGHTS) for light in scene.lights):
        return "near a point or spot light the light has no bound"
    if not scene.lights:
        return "lamps within the scene give all its light"
    return ""


def _triangles(item: SceneObject) -> int:
    """Return the triangles of an object's meshes; shapes count as one."""
    return sum(len(part.geometry.faces) if isinstance(part.geometry, Mesh) else 1 for part in item.parts)


# How far an object reaches -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """Boxes and balls around objects: `low_m`, `high_m`, `centre_m` (n, 3) and `radius_m` (n,)."""

    low_m: Array
    high_m: Array

    @property
    def centre_m(self) -> Array:
        return np.asarray((self.low_m + self.high_m) / 2)

    @property
    def radius_m(self) -> Array:
        return np.asarray(np.linalg.norm(self.high_m - self.low_m, axis=1) / 2)


_bounds: weakref.WeakKeyDictionary[SceneDescription, Bounds] = weakref.WeakKeyDictionary()


def object_bounds(scene: SceneDescription) -> Bounds:
    """Return bounds in the world of all objects."""
    found = _bounds.get(scene)
    if found is None:
        found = _bounds[scene] = _object_bounds(scene)
    return found


def _object_bounds(scene: SceneDescription) -> Bounds:
    middles: list[Array] = []
    halves: list[Array] = []
    placed: list[Array] = []
    starts: list[int] = []
    for item in scene.objects:
        starts.append(len(placed))
        for part in item.parts:
            middle, half = box_of(part.geometry)
            middles.append(middle)
            halves.append(half)
            placed.append(item.to_world @ part.to_object)
    if not starts:
        return Bounds(np.zeros((0, 3)), np.zeros((0, 3)))
    matrices = np.array(placed)
    corners = np.array(middles)[:, None] + np.array(halves)[:, None] * _CORNERS
    points = np.einsum("nij,ncj->nci", matrices[:, :3, :3], corners) + matrices[:, None, :3, 3]
    low = np.minimum.reduceat(points.min(axis=1), starts, axis=0)
    return Bounds(low, np.maximum.reduceat(points.max(axis=1), starts, axis=0))


def out_of_view(bounds: Bounds, camera: Camera) -> NDArray[np.bool_]:
    """Return (n,) whether no camera ray, through any point of the pupil, can meet the ball around an object."""
    return np.asarray(_beyond_m(camera, bounds.centre_m) > bounds.radius_m)


def _beyond_m(camera: Camera, points_m: Array) -> Array:
    """Return (n,) how far points are outside the camera's rays, at least; negative inside.

    The rays of a thin lens lie within the pyramid of the chief rays, widened by the pupil's radius a before the focus and by
    a z / focus behind it.
    """
    lens = camera.lens
    pupil_m = lens.pupil_diameter_m / 2 if lens.kind == "thin_lens" else 0.0
    x, y, z = (points_m @ camera.world_to_camera[:3, :3].T + camera.world_to_camera[:3, 3]).T
    beyond = -z
    for across, count in ((x, camera.film.cols), (y, camera.film.rows)):
        slope = (count / 2 + _MARGIN_PX) * camera.tangent_pitch + pupil_m / lens.focus_distance_m
        beyond = np.maximum(beyond, (np.abs(across) - slope * z - pupil_m) / math.hypot(1.0, slope))
    return np.asarray(beyond)


@dataclass(frozen=True, slots=True)
class _Sun:
    """Light from one direction: the way it travels, and the radius of its disk [rad]."""

    travel: tuple[float, float, float]
    radius_rad: float


@dataclass(frozen=True, slots=True)
class _Light:
    """What falls into a scene: `contrast`, the largest radiance anywhere (the suns' disks left out) over that of a white
    surface in full light; and the suns."""

    contrast: float
    suns: tuple[_Sun, ...]


def _reach(bounds: Bounds, hidden: NDArray[np.bool_], camera: Camera, light: _Light, reflectance: float) -> Array:
    """Return (n,) the share of a visible surface's light that may have to do with an object; inf for those not `hidden`.

    The chance that a walk from a visible point, along directions by the cosine law and with `reflectance` for each bounce,
    ever enters the ball around the object and its shadow: (radius / distance)^(2 (1 - reflectance)).
    """
    shares = np.full(len(hidden), math.inf)
    numbers = np.flatnonzero(hidden)
    seen = Bounds(bounds.low_m[~hidden], bounds.high_m[~hidden])
    centre, radius = bounds.centre_m[numbers], bounds.radius_m[numbers]
    ends = Bounds(bounds.low_m.min(axis=0), bounds.high_m.max(axis=0))
    balls = [_with_shadow(centre, radius, sun, ends) for sun in light.suns] or [(centre, radius)]
    total = np.zeros(len(numbers))
    for middle, size in balls:
        distance = _distance_to_view_m(camera, seen, middle)
        ratio = np.divide(size, distance, out=np.full(len(size), math.inf), where=distance > size)
        total += np.where(ratio < 1.0, ratio ** (2.0 * (1.0 - reflectance)), math.inf)
    shares[numbers] = np.where(np.isfinite(total), total, math.inf)
    return shares


def _with_shadow(centre: Array, radius: Array, sun: _Sun, ends: Bounds) -> tuple[Array, Array]:
    """Return balls around balls and their shadows, which end where the scene does."""
    travel = np.array(sun.travel)
    ahead = np.where(travel > 0, ends.high_m + radius[:, None], ends.low_m - radius[:, None]) - centre
    lengths = np.divide(ahead, travel, out=np.full(ahead.shape, math.inf), where=travel != 0)
    length = lengths.min(axis=1)
    return centre + travel * (length / 2)[:, None], length / 2 + radius + length * math.tan(sun.radius_rad)


def _distance_to_view_m(camera: Camera, seen: Bounds, points_m: Array) -> Array:
    """Return (n,) distances of points to what the camera may see, at least: the parts of boxes within its rays."""
    if not len(seen.low_m):
        return np.full(len(points_m), math.inf)
    gaps = np.maximum(seen.low_m - points_m[:, None], points_m[:, None] - seen.high_m)
    to_boxes = np.linalg.norm(np.maximum(gaps, 0.0), axis=2).min(axis=1)
    return np.asarray(np.maximum(to_boxes, _beyond_m(camera, points_m)))


# How bright it may be ------------------------------------------------------------------------------------------------

_FAR_LIGHTS = (ConstantEnvironment, ImageEnvironment, SunSky, DirectionalLight)


@dataclass(frozen=True, slots=True, eq=False)
class _FarLight:
    """A light from far away, by bands: largest radiance of its dome, and irradiances by dome and sun."""

    radiance: Array
    of_dome: Array
    of_sun: Array
    sun: _Sun | None = None


def _light_of(scene: SceneDescription, grid: WavelengthGrid, reflectance: float) -> _Light:
    """Return how bright anything in the scene may be.

    A surface returns at most `reflectance` of what the suns and the largest radiance bring, so that largest radiance is that
    of the domes, or else (emission + reflectance x irradiance / pi) / (1 - reflectance).
    """
    lights = [_far_light(light, grid) for light in scene.lights]
    dome = np.sum([light.radiance for light in lights], axis=0)
    of_sun = np.sum([light.of_sun for light in lights], axis=0)
    full = (of_sun + np.sum([light.of_dome for light in lights], axis=0)) / math.pi
    emitted = np.zeros(grid.count)
    for spectrum in {id(s): s for s in _emissions(scene)}.values():
        emitted = np.maximum(emitted, spectrum.band_average(grid))
    largest = np.maximum(dome, (emitted + reflectance * of_sun / math.pi) / (1.0 - reflectance))
    contrast = np.divide(largest, full, out=np.where(largest > 0, math.inf, 0.0), where=full > 0)
    suns = tuple(light.sun for light in lights if light.sun is not None)
    return _Light(float(contrast.max()), suns)


def _emissions(scene: SceneDescription) -> list[Spectrum]:
    found = (part.emission for item in scene.objects for part in item.parts if part.emission is not None)
    return [e.radiance if e.pattern is None else e.radiance.scaled(float(e.pattern.shares.max())) for e in found]


def _far_light(light: Light, grid: WavelengthGrid) -> _FarLight:
    nothing = np.zeros(grid.count)
    match light:
        case ConstantEnvironment():
            radiance = light.radiance.band_average(grid)
            return _FarLight(radiance, math.pi * radiance, nothing)
        case ImageEnvironment():
            radiance = light.radiance.band_average(grid)
            return _FarLight(radiance * float(light.pixels.max()), math.pi * radiance * _weakest_mean(light), nothing)
        case DirectionalLight():
            return _FarLight(nothing, nothing, light.irradiance.band_average(grid), _Sun(_unit(light.direction), 0.0))
        case SunSky():
            return _sun_and_sky(light, grid)
    raise TypeError(f"{type(light).__name__} is not far away")


def _weakest_mean(light: ImageEnvironment) -> float:
    """Return the mean over all directions of the image's weakest colour."""
    rows = light.pixels.shape[0]
    solid_angle = np.sin((np.arange(rows) + 0.5) * np.pi / rows)
    mean = np.average(light.pixels.astype(np.float64).mean(axis=1), axis=0, weights=solid_angle)
    return float(mean.min())


def _sun_and_sky(light: SunSky, grid: WavelengthGrid) -> _FarLight:
    x, y, z = _unit(light.sun_direction)
    towards = (x, y, max(_LOWEST_SUN_SINE, z))
    sky = _clear_sky(towards, float(light.turbidity), float(light.ground_albedo))

    def bands(values: Array, weight: float) -> Array:
        return Spectrum(sky.wavelength_nm, np.maximum(values, 0.0) * weight, outside="zero").band_average(grid)

    brightest = sky.radiance().reshape(-1, len(sky.wavelength_nm)).max(axis=0) * _FINER_SKY
    sun = _Sun((-towards[0], -towards[1], -towards[2]), sky.sun_radius_rad) if light.sun_weight > 0 else None
    return _FarLight(
        bands(brightest, light.sky_weight),
        bands(sky.sky_irradiance(), light.sky_weight),
        bands(sky.sun_irradiance(), light.sun_weight),
        sun,
    )


@functools.lru_cache(maxsize=4)
def _clear_sky(towards: tuple[float, float, float], turbidity: float, ground_albedo: float) -> SkyRadiance:
    """Return the sky, remembered: the frames of one recipe share it."""
    return clear_sky(towards, turbidity=turbidity, ground_albedo=ground_albedo, rows=_SKY_ROWS, cols=_SKY_COLS)


def _unit(direction: tuple[float, float, float]) -> tuple[float, float, float]:
    length = math.hypot(*direction)
    x, y, z = (float(value) / length for value in direction)
    return x, y, z
