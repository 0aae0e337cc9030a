"""Camera pose, lens and film: the one geometry that image, labels and depth share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["Camera", "Film", "Lens", "look_at"]


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """A pinhole or thin lens.

    Attributes
    ----------
    kind
        "pinhole" renders everything in focus; "thin_lens" renders depth of field. Both have an f-number, which sets the
        irradiance and the diffraction limit.
    focal_length_m, f_number
        Focal length [m] and f-number (focal length / entrance pupil diameter), both > 0.
    focus_distance_m
        Distance from the lens to the plane in focus [m], > focal length; inf focuses at infinity.
    transmittance
        Spectral transmittance in [0, 1].
    diffraction
        Whether the optics stage applies the diffraction-limited OTF.
    """

    kind: Literal["pinhole", "thin_lens"]
    focal_length_m: float
    f_number: float
    focus_distance_m: float
    transmittance: Spectrum
    diffraction: bool = True

    @property
    def image_distance_m(self) -> float:
        """Distance from the lens to the film [m], 1 / (1/f - 1/d)."""
        return 1.0 / (1.0 / self.focal_length_m - 1.0 / self.focus_distance_m)

    @property
    def magnification(self) -> float:
        """Lateral magnification in the plane of focus, negative (inverted image); 0 when focused at infinity."""
        return -self.image_distance_m / self.focus_distance_m

    @property
    def pupil_diameter_m(self) -> float:
        """Diameter of the entrance pupil [m]."""
        return self.focal_length_m / self.f_number


@dataclass(frozen=True, slots=True)
class Film:
    """The grid of samples that the renderer fills, centred on the optical axis."""

    rows: int
    cols: int
    pitch_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A posed camera.

    Attributes
    ----------
    name
        Stable name, used in product names.
    camera_to_world
        (4, 4) rigid transform from camera to world [m]. Camera axes follow OpenCV: x right, y down, z forward.
    lens, film
        See there. Rows run down, columns to the right.
    """

    name: str
    camera_to_world: NDArray[np.float64]
    lens: Lens
    film: Film

    @property
    def tangent_pitch(self) -> float:
        """Sample spacing in the tangent of the field angle."""
        return self.film.pitch_m / self.lens.image_distance_m

    @property
    def intrinsics_px(self) -> NDArray[np.float64]:
        """(3, 3) pinhole matrix [px]; pixel centres at +0.5, so the axis hits (cols/2, rows/2)."""
        focal_px = 1.0 / self.tangent_pitch
        return np.array([[focal_px, 0, self.film.cols / 2], [0, focal_px, self.film.rows / 2], [0, 0, 1]])

    @property
    def world_to_camera(self) -> NDArray[np.float64]:
        """(4, 4) inverse of `camera_to_world`."""
        rotation = self.camera_to_world[:3, :3]
        inverse = np.eye(4)
        inverse[:3, :3] = rotation.T
        inverse[:3, 3] = -rotation.T @ self.camera_to_world[:3, 3]
        return inverse


_PARALLEL_SINE = 1e-9
"""Sine of the angle between `up` and the view below which right and left cannot be told apart in double precision."""


def look_at(origin_m: NDArray[np.float64], target_m: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (4, 4) camera-to-world transform of a camera at `origin_m` that looks at `target_m`.

    `up` is the world direction that appears upwards in the image. Raises FieldError where origin and target coincide or
    `up` is parallel to the viewing direction.
    """
    origin, target, up = (np.asarray(v, dtype=np.float64) for v in (origin_m, target_m, up))
    forward = target - origin
    distance = float(np.linalg.norm(forward))
    if distance == 0:
        raise FieldError(
            f"the camera's target {target.tolist()} is also its origin; they must differ. Move one of them.",
            path="target",
            value=target.tolist(),
        )
    forward = forward / distance
    right = np.cross(forward, up)
    width = float(np.linalg.norm(right))
    if width <= _PARALLEL_SINE * float(np.linalg.norm(up)):
        raise FieldError(
            f"up {up.tolist()} is zero or parallel to the viewing direction; choose another one.",
            path="up",
            value=up.tolist(),
        )
    right = right / width
    pose = np.eye(4)
    pose[:3, 0] = right
    pose[:3, 1] = np.cross(forward, right)
    pose[:3, 2] = forward
    pose[:3, 3] = origin
    return pose
