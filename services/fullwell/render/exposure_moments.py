"""The time that a film is exposed for, cut into moments so short that what moves is nearly still in each."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.render.transport.moments import Moments
from fullwell.scene import Camera, SceneDescription
from fullwell.scene.motion import Motion
from fullwell.scene.moving import camera_at, scene_at

__all__ = ["MotionRequest", "count_moments", "cut_exposure"]

FEWEST_MOMENTS = 4
"""Of an exposure in which something moves at all."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionRequest:
    """What moves while the film is exposed, and when its rows are.

    Attributes
    ----------
    motions, camera_motion
        By the object's id, and of the camera, about the time that scene and camera are described at.
    row_middle_s
        (rows,) middle of each film row's exposure after that time [s].
    exposure_time_s
        Of each row [s]; or what finds it from (responses, rows, cols) of light of the scene standing still.
    group_weights
        By the light group's name, in the light that the time is found from; 1 for those left out.
    shift_px
        Returns how far anything moves in the picture within a time [s], at most [px]; inf where that is not known.
    least_px
        Shift from the first row's start to the last row's end up to which everything stands still.
    most_moments
        Bounds memory: each moment with another scene is one more scene.
    """

    motions: Mapping[str, Motion]
    camera_motion: Motion
    row_middle_s: NDArray[np.float64]
    exposure_time_s: float | Callable[[NDArray[np.float64]], float]
    group_weights: Mapping[str, float]
    shift_px: Callable[[float], float]
    least_px: float
    most_moments: int

    @property
    def readout_s(self) -> float:
        """How much later the last row is exposed than the first [s]."""
        return float(np.ptp(self.row_middle_s))


def count_moments(shift_px: float, *, least_px: float, most: int) -> int:
    """Return the number of moments: each a shift of a pixel or less where `most` allows; 1 for nothing to move.

    A power of two, so that numbers of samples that are one too share evenly among them.
    """
    if not shift_px > least_px:
        return 1
    wanted = most if math.isinf(shift_px) else max(FEWEST_MOMENTS, math.ceil(shift_px))
    return min(most, 1 << (wanted - 1).bit_length())


def cut_exposure(scene: SceneDescription, camera: Camera, request: MotionRequest, exposure_time_s: float) -> Moments | None:
    """Return scene and camera in the middle of each moment; None where nothing moves far enough."""
    shift_px = request.shift_px(exposure_time_s + request.readout_s)
    count = count_moments(shift_px, least_px=request.least_px, most=request.most_moments)
    if count == 1:
        return None
    starts_s = request.row_middle_s - 0.5 * exposure_time_s
    first_s = float(starts_s.min())
    moment_s = (exposure_time_s + request.readout_s) / count
    times_s = [first_s + (number + 0.5) * moment_s for number in range(count)]
    return Moments(
        scenes=tuple(scene_at(scene, request.motions, time_s) for time_s in times_s),
        cameras=tuple(camera_at(camera, request.camera_motion, time_s) for time_s in times_s),
        start=(starts_s - first_s) / moment_s,
        length=exposure_time_s / moment_s,
    )
