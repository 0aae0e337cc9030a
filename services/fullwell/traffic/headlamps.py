"""What headlamps throw ahead: the beams of vehicles as cones of light, by the regulations' figures.

A passing beam has a sharp upper edge just below the horizon, so that it does not dazzle: its two cones are tilted down until
their upper edges lie there. The lens itself is a surface that emits as catalogued; the cones are what it concentrates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["BEAMS", "Beam", "BeamKind", "beam_direction"]

Array = NDArray[np.float64]
BeamKind = Literal["low", "high"]


@dataclass(frozen=True, slots=True)
class Beam:
    """A cone: luminous intensity on its axis [cd], half angles of full light and of its end [deg], tilt downwards [deg]."""

    intensity_cd: float
    beam_deg: float
    cutoff_deg: float
    down_deg: float


BEAMS: Final[dict[BeamKind, tuple[Beam, ...]]] = {
    # Hot spot and apron. UN R112 class B asks for 5 100 to 37 000 cd (E at 25 m: 8 to 60 lx) below the edge on the own side,
    # and for less than 440 cd towards oncoming eyes; the edge is 1 % (0.57 deg) below the horizon.
    "low": (Beam(16_000.0, 0.7, 2.2, 2.8), Beam(2_200.0, 5.0, 10.0, 10.6)),
    # Driving beam: 40 500 to 215 000 cd at its middle in UN R112.
    "high": (Beam(45_000.0, 1.2, 5.0, 0.3), Beam(4_000.0, 5.0, 12.0, 3.0)),
}
"""The cones of one lamp, of two, by the beam that is on."""


def beam_direction(forward: Array, up: Array, down_deg: float) -> Array:
    """Return the unit direction (3,) of a cone that is tilted down from `forward` about the vehicle's left axis."""
    angle = math.radians(down_deg)
    return np.asarray(math.cos(angle) * forward - math.sin(angle) * up)
