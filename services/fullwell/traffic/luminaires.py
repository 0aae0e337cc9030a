"""How street lights spread their light: along the road and over it, so that it is evenly lit between them."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.scene import BeamPattern

__all__ = ["luminaire_pattern"]

Array = NDArray[np.float64]

_ROWS, _COLS = 61, 73
_REACH: Final = 2.1
"""Distance along the road over the height of the lamp that is lit in full: 65 degrees from straight down."""

_RISE: Final = 1.7
"""Power of 1 / cos by which the intensity rises towards there; 3 would light the ground evenly by one lamp alone."""

_ACROSS: Final = (-0.5, 1.5)
"""The same across the road: behind the lamp, and over the carriageway."""

_SOFT: Final = 0.22
_STRAY: Final = 0.12
"""Share of the flux that leaves evenly by the cosine of the angle from straight down."""

_LEAST_AREA: Final = 0.08
"""Of a lamp's surface: no direction is taken to see less of it."""

_DOWNWARD: Final = 0.5
"""Of its surface that a lamp shows from below; others, such as lanterns, shine to all sides as their surfaces do."""

_TWO_HEADS_M: Final = 1.2


def luminaire_pattern(corners_m: Array) -> BeamPattern | None:
    """Return the pattern of a street light's lamp, triangles (n, 3, 3) with x over the road and z up; None to shine evenly.

    Shares are those of radiance. The flux is that of the same radiance without a pattern, pi times radiance times area: the
    lamp's luminance that way is its intensity over the area that it shows. Lamps on two arms light both ways.
    """
    areas = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]) / 2
    whole = float(np.linalg.norm(areas, axis=1).sum())
    if not whole > 0 or float(np.maximum(-areas[:, 2], 0).sum()) < _DOWNWARD * whole:
        return None
    empty = BeamPattern(np.ones((_ROWS, _COLS), np.float32), (-180.0, 180.0), (-90.0, 0.0))
    towards = empty.directions()
    shown = np.maximum(np.einsum("rcx,nx->rcn", towards, areas), 0.0).sum(axis=2)
    both = float(np.ptp(corners_m[..., 0])) > _TWO_HEADS_M
    wing, even = _wing(towards, both=both), np.maximum(-towards[..., 2], 0.0)
    intensity = (1 - _STRAY) * wing / _flux(empty, wing) + _STRAY * even / np.pi
    shares = intensity / np.maximum(shown, _LEAST_AREA * whole)
    shares *= np.pi * whole / _flux(empty, shares * shown)
    return BeamPattern(shares.astype(np.float32), empty.azimuth_deg, empty.elevation_deg)


def _wing(towards: Array, *, both: bool) -> Array:
    """Return relative intensities in directions (..., 3)."""
    down = np.maximum(-towards[..., 2], 1e-6)
    along, across = np.abs(towards[..., 1]) / down, towards[..., 0] / down
    across = np.abs(across) if both else across
    behind, over = _ACROSS
    lit = _kept((_REACH - along) / _SOFT) * _kept((across - behind) / _SOFT) * _kept((over - across) / _SOFT)
    return np.asarray(lit * np.minimum(down**-_RISE, _LARGEST_RISE))


_LARGEST_RISE: Final = 20.0


def _kept(distance: Array) -> Array:
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(distance, -60.0, 60.0))))


def _flux(pattern: BeamPattern, intensity: Array) -> float:
    return BeamPattern(intensity.astype(np.float32), pattern.azimuth_deg, pattern.elevation_deg).solid_angle_sr()
