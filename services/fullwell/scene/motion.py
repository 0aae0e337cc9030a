"""What moves in a scene and what the road is: facts that labels tell, beside what can be seen of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "AT_REST",
    "DrivingFacts",
    "EgoFacts",
    "GroundRegion",
    "LaneFacts",
    "MapFacts",
    "Motion",
    "RoadUser",
    "SignalFacts",
    "SignalLinkFacts",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """How a rigid thing moves: with `velocity_m_s` (3,) at `pivot_m` (3,), turning about the vertical through it.

    All in world axes; `yaw_rate_rad_s` is counter-clockwise from above.
    """

    velocity_m_s: Array
    yaw_rate_rad_s: float = 0.0
    pivot_m: Array | None = None

    def turn(self, interval_s: float) -> Array:
        """Return the (3, 3) rotation over an interval."""
        angle = self.yaw_rate_rad_s * interval_s
        cosine, sine = math.cos(angle), math.sin(angle)
        return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])

    @property
    def moves(self) -> bool:
        """Whether it does anything but rest."""
        return bool(np.any(self.velocity_m_s)) or self.yaw_rate_rad_s != 0

    def transform(self, interval_s: float) -> Array:
        """Return the (4, 4) rigid transform of world points over an interval [s], which may be negative; see `shift_m`."""
        matrix = np.eye(4)
        matrix[:3, 3] = self.velocity_m_s * interval_s
        if self.yaw_rate_rad_s != 0 and self.pivot_m is not None:
            matrix[:3, :3] = self.turn(interval_s)
            matrix[:3, 3] += self.pivot_m - matrix[:3, :3] @ self.pivot_m
        return matrix

    def velocity_at(self, point_m: Array) -> Array:
        """Return the velocity [m s^-1] of points (..., 3) of the thing, in the shape of the points."""
        if self.pivot_m is None:
            return np.broadcast_to(self.velocity_m_s, np.shape(point_m))
        arm = point_m - self.pivot_m
        across = np.stack([-arm[..., 1], arm[..., 0], np.zeros(arm.shape[:-1])], axis=-1)
        return np.asarray(self.velocity_m_s + self.yaw_rate_rad_s * across)

    def shift_m(self, points_m: Array, interval_s: float) -> Array:
        """Return by how much (..., 3) the motion moves points (..., 3) within an interval [s], which may be negative."""
        shift = np.broadcast_to(self.velocity_m_s * interval_s, points_m.shape)
        if self.yaw_rate_rad_s == 0 or self.pivot_m is None:
            return np.asarray(shift)
        return np.asarray(shift + (points_m - self.pivot_m) @ (self.turn(interval_s) - np.eye(3)).T)


AT_REST = Motion(np.zeros(3))


@dataclass(frozen=True, slots=True, eq=False)
class RoadUser:
    """One vehicle or person on the road, or parked beside it.

    Attributes
    ----------
    object_id
        Of its object in the scene, which may have been left out where it is far from every camera.
    role, kind
        Whether SUMO drives it ("mover"), the recipe put it there ("target"), or it is parked; SUMO's kind or the asset's class.
    sumo_id, lane
        "" for what SUMO does not know, and off the lanes.
    position_m, yaw_rad, size_m
        (3,) on the ground below its middle; of its forward axis, counter-clockwise from +x; length, width, height [m].
    velocity_m_s, speed_m_s, acceleration_m_s2
        (3,) in world axes; along its forward axis.
    yaw_rate_rad_s
        None where unknown.
    brake, left, right, reverse
        Lamps that are on: brake lights, indicators, reversing lights.
    """

    object_id: str
    role: Literal["mover", "target", "parked"]
    kind: str
    sumo_id: str
    lane: str
    position_m: Array
    yaw_rad: float
    size_m: tuple[float, float, float]
    velocity_m_s: Array
    speed_m_s: float = 0.0
    acceleration_m_s2: float = 0.0
    yaw_rate_rad_s: float | None = None
    brake: bool = False
    left: bool = False
    right: bool = False
    reverse: bool = False

    @property
    def motion(self) -> Motion:
        """Its rigid motion; an unknown yaw rate counts as none."""
        return Motion(self.velocity_m_s, self.yaw_rate_rad_s or 0.0, self.position_m)


@dataclass(frozen=True, slots=True, eq=False)
class EgoFacts:
    """The vehicle that carries cameras, and the names of the cameras that it carries."""

    user: RoadUser
    cameras: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class LaneFacts:
    """One lane: `centre_m`, `left_m`, `right_m` are (n, 3) lines in driving direction, on the surface [m]."""

    id: str
    kind: str
    street: str
    width_m: float
    speed_limit_m_s: float
    centre_m: Array
    left_m: Array
    right_m: Array


@dataclass(frozen=True, slots=True, eq=False)
class GroundRegion:
    """A region of the ground: ring (n, 3) [m] around it, and rings of its holes. The last point of a ring is not the first."""

    outer_m: Array
    holes_m: tuple[Array, ...] = ()


@dataclass(frozen=True, slots=True)
class SignalLinkFacts:
    """One movement that a traffic light controls: from lane to lane, with SUMO's letter of its state, "" where unknown."""

    from_lane: str
    to_lane: str
    state: str


@dataclass(frozen=True, slots=True)
class SignalFacts:
    """One traffic light: SUMO's id of its `controller`, its letter of the `state` ("" where unknown), names of what is lit."""

    object_id: str
    controller: str
    state: str
    shown: tuple[str, ...]
    links: tuple[SignalLinkFacts, ...]


@dataclass(frozen=True, slots=True)
class MapFacts:
    """Where the world lies on the map that it was made of: map = world + `offset_m` (east, north) [m].

    `projection` is the map's, as a string of PROJ; "" where the file has none.
    """

    offset_m: tuple[float, float] = (0.0, 0.0)
    projection: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class DrivingFacts:
    """A street at `time_s` [s] after the start of its traffic. Lanes and regions are those within range of a camera."""

    time_s: float
    users: tuple[RoadUser, ...]
    ego: EgoFacts | None
    lanes: tuple[LaneFacts, ...]
    drivable: tuple[GroundRegion, ...]
    crossings: tuple[GroundRegion, ...]
    signals: tuple[SignalFacts, ...]
    map: MapFacts = MapFacts()

    def motions(self) -> Mapping[str, Motion]:
        """Return {object id: motion} of what moves; everything else is at rest."""
        moving = (user for user in self.users if np.any(user.velocity_m_s) or user.yaw_rate_rad_s)
        return {user.object_id: user.motion for user in moving}

    def motion_of_camera(self, name: str) -> Motion:
        """Return the motion of a camera: that of the ego where it carries it."""
        if self.ego is None or name not in self.ego.cameras:
            return AT_REST
        return self.ego.user.motion
