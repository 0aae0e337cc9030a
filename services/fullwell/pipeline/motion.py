"""Whether anything moves far enough in the picture while it is taken, and what is then rendered. See docs/physics/motion.md."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.core.hashing import digest_of
from fullwell.pipeline.culling import Bounds, object_bounds
from fullwell.pipeline.noise import longest_capture
from fullwell.pipeline.steps import PlanStep
from fullwell.render import MotionRequest, count_moments
from fullwell.scene import Camera, Mesh, SceneDescription
from fullwell.scene.extents import objects_in_view
from fullwell.scene.motion import AT_REST, Motion
from fullwell.schema.frame import CameraRig, FrameDescription, SensorRig
from fullwell.sensor.exposure import base_exposure
from fullwell.sensor.exposures import AutoExposure, FixedExposure
from fullwell.sensor.rolling_shutter import readout_duration_s

__all__ = ["MotionPlan", "Shifts", "Timing", "plan_motion", "rigs_by_exposure"]

Array = NDArray[np.float64]

_MOST_MOMENTS = 64
_MOST_TRIANGLES = 8_000_000
"""Of what moves, in all moments together: 2 GB at the 250 bytes that one takes."""

_VIEW_SAMPLES = 65
_VIEW_MARGIN = 1e-3
"""Added to what a grid of so many directions over the film finds to be the largest share of a direction along an axis."""

_CORNERS = np.array(list(itertools.product([0, 1], repeat=3)))


# When rows are exposed -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Timing:
    """When the rows of a sensor are exposed.

    Attributes
    ----------
    line_time_s, rows, pitch_m
        Of the sensor; 0, 1 and 0 with a global shutter, where they do not matter.
    time_s
        Exposure time of the longest capture [s], where it is fixed; the longest that there may be, where it is not.
    automatic
        Digest of what decides an automatic exposure; "" for a fixed one.
    """

    line_time_s: float
    rows: int
    pitch_m: float
    time_s: float
    automatic: str = ""

    @classmethod
    def of(cls, sensor: SensorRig) -> Timing:
        """Return the timing of a sensor. Of several captures the longest counts."""
        model, base, (ratio, _) = sensor.model, base_exposure(sensor.exposure), longest_capture(sensor)
        rolling = (model.line_time_s, model.rows, model.pixel_pitch_m) if model.line_time_s > 0 else (0.0, 1, 0.0)
        if isinstance(base, FixedExposure):
            return cls(*rolling, time_s=base.time_s * ratio)
        assert isinstance(base, AutoExposure)
        return cls(*rolling, time_s=base.max_time_s * ratio, automatic=digest_of([model, sensor.exposure]))

    @property
    def window_s(self) -> float:
        """From the first row's start to the last row's end [s]."""
        return self.time_s + readout_duration_s(rows=self.rows, line_time_s=self.line_time_s)

    def row_middle_s(self, camera: Camera) -> Array:
        """Return (film rows,) the middle of each film row's exposure [s], after the middle of the sensor's middle row's."""
        if self.line_time_s == 0:
            return np.zeros(camera.film.rows)
        height_m = (np.arange(camera.film.rows) + 0.5 - camera.film.rows / 2) * camera.film.pitch_m
        row = np.clip(np.floor(height_m / self.pitch_m + self.rows / 2), 0, self.rows - 1)
        return np.asarray((row - (self.rows - 1) / 2) * self.line_time_s)


# How far things move in the picture ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Shifts:
    """Bounds on how far things move in the picture: calling it with a time [s] returns that of all of them [px].

    A point at the distance d that moves by v relative to the camera moves by up to v / d in angle, and on the film by up to
    v / d x focal length / cos^2 of the largest field angle. About the camera's place a motion is a velocity v0 and a turn w, so
    that v / d is at most v0 / d + w too. Within the time the distance shrinks by half of what is moved.

    Attributes
    ----------
    near_m
        (n,) distances of things from the camera, at least.
    fastest_m_s, at_camera_m_s, turn_rad_s
        (n,) largest speed of any of their points, speed of their motion about the camera's place, and their turn: all relative
        to the camera. inf where one is not known; the other then counts.
    focal_px
        Focal length over cos^2 of the largest field angle.
    """

    near_m: Array
    fastest_m_s: Array
    at_camera_m_s: Array
    turn_rad_s: Array
    focal_px: float

    def of_each(self, time_s: float) -> Array:
        """Return (n,) shifts [px]."""
        closing = np.minimum(self.fastest_m_s, self.at_camera_m_s)
        near = self.near_m - closing * (time_s / 2)
        at_place = np.where(near > 0, near, np.nan)
        with np.errstate(invalid="ignore"):  # what is endlessly far and endlessly fast counts by its turn
            moving = np.fmin(self.fastest_m_s / at_place, self.at_camera_m_s / at_place + self.turn_rad_s)
        moving = np.where(np.isnan(at_place), math.inf, moving)
        still = (self.fastest_m_s == 0) | ((self.at_camera_m_s == 0) & (self.turn_rad_s == 0))
        return np.where(still, 0.0, moving) * (self.focal_px * time_s)

    def __call__(self, time_s: float) -> float:
        """Return the largest of the shifts [px]; 0 where there is nothing."""
        return float(self.of_each(time_s).max(initial=0.0))

    def where(self, chosen: NDArray[np.bool_]) -> Shifts:
        """Return some of them."""
        return Shifts(
            self.near_m[chosen], self.fastest_m_s[chosen], self.at_camera_m_s[chosen], self.turn_rad_s[chosen], self.focal_px
        )

    def and_(self, other: Shifts) -> Shifts:
        """Return these and others."""
        return Shifts(
            np.concatenate([self.near_m, other.near_m]),
            np.concatenate([self.fastest_m_s, other.fastest_m_s]),
            np.concatenate([self.at_camera_m_s, other.at_camera_m_s]),
            np.concatenate([self.turn_rad_s, other.turn_rad_s]),
            self.focal_px,
        )


def _focal_px(camera: Camera, pitch_m: float) -> float:
    half = [(count / 2 + 1.0) * camera.tangent_pitch for count in (camera.film.cols, camera.film.rows)]
    return camera.lens.image_distance_m / pitch_m * (1.0 + half[0] ** 2 + half[1] ** 2)


def _object_shifts(
    bounds: Bounds, motions: Sequence[Motion], camera: Camera, *, camera_motion: Motion, focal_px: float
) -> Shifts:
    """Return the shifts of objects, whose boxes are `bounds`, as seen by a camera that moves by `camera_motion`."""
    place = camera.camera_to_world[:3, 3]
    near, fastest, at_camera, turn = (np.zeros(len(motions)) for _ in range(4))
    for number, motion in enumerate(motions):
        low, high = bounds.low_m[number], bounds.high_m[number]
        corners = low + _CORNERS * (high - low)
        near[number] = np.linalg.norm(np.maximum(np.maximum(low - place, place - high), 0.0))
        fastest[number] = np.linalg.norm(motion.velocity_at(corners) - camera_motion.velocity_at(corners), axis=-1).max()
        at_camera[number] = np.linalg.norm(motion.velocity_at(place) - camera_motion.velocity_at(place))
        turn[number] = abs(motion.yaw_rate_rad_s - camera_motion.yaw_rate_rad_s)
    return Shifts(near, fastest, at_camera, turn, focal_px)


def _background_shifts(scene: SceneDescription, moving: frozenset[str], rig: CameraRig, focal_px: float) -> Shifts:
    """Return the shifts of what stands still in the world, where the camera moves: of the nearest of it that is in view."""
    camera, motion = rig.camera, rig.motion
    if not motion.moves:
        return Shifts(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0), focal_px)
    place = camera.camera_to_world[:3, 3]
    near = _nearest_m(scene, camera, moving)
    speed = float(np.linalg.norm(motion.velocity_at(place)))
    # The second is the sky, which only turns.
    return Shifts(
        np.array([near, math.inf]),
        np.full(2, math.inf),
        np.array([speed, 0.0]),
        np.full(2, abs(motion.yaw_rate_rad_s)),
        focal_px,
    )


def _nearest_m(scene: SceneDescription, camera: Camera, left_out: frozenset[str]) -> float:
    """Return how near any visible point of the objects is to the camera, at least; inf where there is none."""
    bounds = object_bounds(scene)
    candidates = objects_in_view(scene, camera) & np.array([item.id not in left_out for item in scene.objects], dtype=bool)
    reach = _view_reach(camera)
    distances = _distances_m(bounds, camera, reach)
    nearest = math.inf
    for number in np.argsort(distances, kind="stable"):
        if distances[number] >= nearest:
            break
        if candidates[number]:
            boxes = [_triangle_boxes(scene, int(number), part) for part in range(len(scene.objects[number].parts))]
            nearest = min([nearest, *(float(_distances_m(b, camera, reach).min(initial=math.inf)) for b in boxes)])
    return nearest


def _triangle_boxes(scene: SceneDescription, number: int, part: int) -> Bounds:
    """Return the boxes around the triangles of a part in the world, or around the whole of a shape."""
    item = scene.objects[number]
    of_part = item.parts[part]
    if not isinstance(of_part.geometry, Mesh):
        only = SceneDescription((type(item)(item.id, "", (of_part,), item.to_world),))
        return object_bounds(only)
    matrix = item.to_world @ of_part.to_object
    corners = (of_part.geometry.vertices_m @ matrix[:3, :3].T + matrix[:3, 3])[of_part.geometry.faces]
    return Bounds(corners.min(axis=1), corners.max(axis=1))


def _view_reach(camera: Camera) -> Array:
    """Return (2, 3) the largest share of a unit direction of view along -x, -y, -z and along +x, +y, +z of the world."""
    sides = [
        np.linspace(-1.0, 1.0, _VIEW_SAMPLES) * (count / 2 + 1.0) * camera.tangent_pitch
        for count in (camera.film.cols, camera.film.rows)
    ]
    x, y = np.meshgrid(*sides)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    directions = (rays / np.linalg.norm(rays, axis=-1, keepdims=True)) @ camera.camera_to_world[:3, :3].T
    return np.minimum(np.stack([(-directions).max(axis=(0, 1)), directions.max(axis=(0, 1))]) + _VIEW_MARGIN, 1.0)


def _distances_m(bounds: Bounds, camera: Camera, reach: Array) -> Array:
    """Return (n,) distances from the camera of what of the boxes is in view, at least; inf for boxes that cannot be."""
    place = camera.camera_to_world[:3, 3]
    below, above = np.maximum(place - bounds.high_m, 0.0), np.maximum(bounds.low_m - place, 0.0)
    straight = np.linalg.norm(below + above, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = [
            np.where(gap > 0, np.where(part > 0, gap / part, math.inf), 0.0)
            for gap, part in zip((below, above), reach, strict=True)
        ]
    return np.asarray(np.maximum(straight, np.max(along, axis=(0, 2))))


# The decision --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class MotionPlan:
    """What moves, for `request`; the decision for people; and a digest of all of it that decides the light."""

    step: PlanStep
    timing: Timing | None = None
    motions: Mapping[str, Motion] | None = None
    camera_motion: Motion = AT_REST
    shifts: Shifts | None = None
    least_px: float = 0.0
    most_moments: int = 1

    @property
    def runs(self) -> bool:
        """Whether anything is rendered moving, unless an automatic exposure turns out to be too short for that."""
        return self.timing is not None

    def identity(self, group_weights: Mapping[str, float]) -> dict[str, Any]:
        """Return what decides the light; nothing where everything stands still."""
        if self.timing is None:
            return {}
        weights = sorted(group_weights.items()) if self.timing.automatic else []
        return {
            "motion": {
                "objects": dict(self.motions or {}),
                "camera": self.camera_motion,
                "timing": self.timing,
                "weights": weights,
                "least_px": self.least_px,
                "moments": self.most_moments,
            }
        }

    def request(
        self, camera: Camera, metering: Callable[[Array], float], group_weights: Mapping[str, float]
    ) -> MotionRequest | None:
        """Return what the renderer is asked for; `metering` finds an automatic exposure's time from light."""
        if self.timing is None or self.shifts is None:
            return None
        return MotionRequest(
            motions=dict(self.motions or {}),
            camera_motion=self.camera_motion,
            row_middle_s=self.timing.row_middle_s(camera),
            exposure_time_s=metering if self.timing.automatic else self.timing.time_s,
            group_weights=group_weights,
            shift_px=self.shifts,
            least_px=self.least_px,
            most_moments=self.most_moments,
        )


def rigs_by_exposure(frame: FrameDescription, rig: CameraRig, *, skip: bool = True) -> tuple[CameraRig, ...]:
    """Return the rig, or where something moves one for all its sensors that are exposed at the same times."""
    by_timing: dict[Timing, list[SensorRig]] = {}
    for sensor in rig.sensors:
        by_timing.setdefault(Timing.of(sensor), []).append(sensor)
    if len(by_timing) == 1 or not _plan(frame, rig, skip=skip).runs:
        return (rig,)
    return tuple(replace(rig, sensors=tuple(sensors)) for sensors in by_timing.values())


def plan_motion(frame: FrameDescription, rig: CameraRig, position: int, *, skip: bool = True) -> MotionPlan:
    """Return what is to be rendered moving for the camera at `position`; with `skip` false all that moves at all.

    Raises
    ------
    FieldError
        Something moves, and the camera's sensors are exposed at different times: see `rigs_by_exposure`.
    """
    plan = _plan(frame, rig, skip=skip)
    timings = {Timing.of(sensor) for sensor in rig.sensors}
    if plan.runs and len(timings) > 1:
        path = f"cameras[{position}].sensors"
        names = [sensor.name for sensor in rig.sensors]
        raise FieldError(
            f"{path} are {', '.join(names)}, which are exposed at different times while something moves: they do not see the "
            "same light. Plan each by itself.",
            path=path,
            value=names,
        )
    return plan


def _plan(frame: FrameDescription, rig: CameraRig, *, skip: bool) -> MotionPlan:
    what = f"{rig.camera.name}: motion"
    moving = {name: motion for name, motion in frame.motions.items() if motion.moves and _takes_part(name, frame.scene)}
    if not moving and not rig.motion.moves:
        return MotionPlan(PlanStep(what, "skip", "nothing moves"))
    least_px = frame.quality.motion_blur_px if skip else 0.0
    timings = [Timing.of(sensor) for sensor in rig.sensors]
    window_s = max(timing.window_s for timing in timings)
    shifts, chosen, still_px = _moving_shifts(frame.scene, moving, rig, least_px=least_px, window_s=window_s)
    largest_px = max(shifts(window_s), still_px)
    if largest_px <= least_px:
        why = f"nothing moves by more than {largest_px:.2g} px within the {_duration(window_s)} of the exposure"
        return MotionPlan(PlanStep(what, "skip", why, f"{largest_px:.2g} px"))
    most = _most_moments(frame.scene, chosen)
    subject = [f"{len(chosen)} object{'s' * (len(chosen) > 1)}"] if chosen else []
    subject += ["the camera"] if rig.motion.moves else []
    told = " and ".join(subject)
    if len(frame.cameras) > 0 and not any(rig.sensors == whole.sensors for whole in frame.cameras):
        told = f"for {', '.join(sensor.name for sensor in rig.sensors)}: {told}"
    step = _step(what, told, timings[0], shifts, least_px=least_px, most=most)
    return MotionPlan(step, timings[0], chosen, rig.motion, shifts, least_px, most)


def _takes_part(name: str, scene: SceneDescription) -> bool:
    """Return whether an object that moves is in the scene, or a lamp that it carries."""
    return any(item.id == name for item in scene.objects) or any(
        getattr(light, "carrier", "") == name for light in scene.lights
    )


def _moving_shifts(
    scene: SceneDescription, moving: Mapping[str, Motion], rig: CameraRig, *, least_px: float, window_s: float
) -> tuple[Shifts, dict[str, Motion], float]:
    """Return the shifts in the picture, the motions of the objects that move far enough by themselves, and how far others do.

    Those others stay where they are in the world. An object that is not in the scene carries lamps: it moves with the rest.
    """
    focal_px = _focal_px(rig.camera, min(sensor.model.pixel_pitch_m for sensor in rig.sensors))
    present = [(number, item.id) for number, item in enumerate(scene.objects) if item.id in moving]
    numbers, ids = [number for number, _ in present], tuple(name for _, name in present)
    every = object_bounds(scene)
    bounds = Bounds(every.low_m[numbers], every.high_m[numbers])
    motions = [moving[name] for name in ids]
    alone = _object_shifts(bounds, motions, rig.camera, camera_motion=AT_REST, focal_px=focal_px)
    seen = _object_shifts(bounds, motions, rig.camera, camera_motion=rig.motion, focal_px=focal_px)
    alone_px = alone.of_each(window_s)
    far_enough = alone_px > least_px
    chosen = {name: moving[name] for name, enough in zip(ids, far_enough, strict=True) if enough}
    background = _background_shifts(scene, frozenset(chosen), rig, focal_px)
    shifts = seen.where(far_enough).and_(background)
    carriers = {name: motion for name, motion in moving.items() if name not in ids}
    still_px = float(alone_px[~far_enough].max(initial=0.0))
    return shifts, chosen | (carriers if rig.motion.moves or chosen else {}), still_px


def _most_moments(scene: SceneDescription, chosen: Mapping[str, Motion]) -> int:
    """Return the most moments: each has what moves of its own, and all of that must fit the memory."""
    parts = [part.geometry for item in scene.objects if item.id in chosen for part in item.parts]
    triangles = sum(len(geometry.faces) if isinstance(geometry, Mesh) else 1 for geometry in parts)
    return min(_MOST_MOMENTS, max(4, 1 << max(1, _MOST_TRIANGLES // max(1, triangles)).bit_length() - 1))


def _step(what: str, subject: str, timing: Timing, shifts: Shifts, *, least_px: float, most: int) -> PlanStep:
    shift_px = shifts(timing.window_s)
    count = count_moments(shift_px, least_px=least_px, most=most)
    rolling = ", row by row" if timing.line_time_s > 0 else ""
    if timing.automatic:
        readout_s = timing.window_s - timing.time_s
        at_least = f", {shifts(readout_s):.2g} px within the readout" if readout_s > 0 else ""
        per_ms = f"{shifts(1e-3):.2g} px within 1 ms{at_least}"
        why = f"{subject}: up to {per_ms}; the exposure is found from a first picture, in up to {count} moments{rolling}"
        return PlanStep(what, "run", why, "half of what moves in a moment, in the manifest")
    far = "by an unknown distance" if math.isinf(shift_px) else f"by up to {shift_px:.2g} px"
    why = f"{subject} {far} within {_duration(timing.window_s)}: {count} moments{rolling}"
    bound = "not bounded" if math.isinf(shift_px) else f"{shift_px / count / 2:.2g} px"
    return PlanStep(what, "run", why, bound)


def _duration(seconds: float) -> str:
    return f"{seconds:.3g} s" if seconds >= 1 else f"{seconds * 1e3:.3g} ms"
