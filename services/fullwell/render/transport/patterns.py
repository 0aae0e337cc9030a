"""How lamps with a beam spread their light: tables over directions, on the device. See docs/physics/lights.md."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.render.transport.surfaces import PlacedPattern
from fullwell.render.transport.upload import upload
from fullwell.scene import BeamPattern

__all__ = ["PatternBounds", "PatternTable", "pattern_bounds"]

Array = NDArray[np.float64]

_RECORD = 16
"""Forward and the table's offset; up and the number of rows; first azimuth and elevation [rad] and steps per radian; the number
of columns, three spare."""

_EDGE = 1e-3
"""Share of a step by which a direction may miss a table's edge, for rounding."""

_BRIGHT = 0.25
"""Share of the largest intensity that bounds the directions in which the light tree takes a beam for full."""


_WIDEST_FALL = np.radians(75.0)
"""Between the bright part and the end: there the tree lets importance fall by a cosine, which must not reach 0 before."""


_LEAST_FALL = 0.01
"""[rad]: the tree takes a lamp whose light falls within nothing for one that has none."""


@dataclass(frozen=True, slots=True, eq=False)
class PatternBounds:
    """A cone about a pattern: unit axis (3,) in (forward, left, up), half angle [rad] of its bright part, and from there on."""

    axis: Array
    bright_rad: float
    end_rad: float


def pattern_bounds(pattern: BeamPattern) -> PatternBounds:
    """Return a cone about the middle of a pattern's light that holds it all, and one that holds its bright part."""
    directions = pattern.directions()
    shares = np.asarray(pattern.shares, dtype=np.float64)
    azimuth, elevation = pattern.steps_rad()
    weight = shares * np.cos(pattern.elevations_rad())[:, None]
    mean = np.einsum("rc,rcx->x", weight, directions)
    length = float(np.linalg.norm(mean))
    if not length > 1e-3 * float(weight.sum()):  # as much to all sides
        return PatternBounds(np.array([1.0, 0.0, 0.0]), np.pi, _LEAST_FALL)
    axis = mean / length
    angle = np.arccos(np.clip(directions @ axis, -1.0, 1.0))
    cell = float(np.hypot(azimuth, elevation))
    end = min(np.pi, float(angle[shares > 0].max()) + cell)
    bright = max(min(end, float(angle[shares >= _BRIGHT * shares.max()].max()) + cell), end - _WIDEST_FALL)
    return PatternBounds(axis, bright, max(end - bright, _LEAST_FALL))


class PatternTable:
    """The patterns of a scene's lamps on the device; lamps of one pattern share its table."""

    def __init__(self, mi: Any, patterns: Sequence[PlacedPattern]) -> None:
        self._mi = mi
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._dr, self._four = dr, dr.llvm.ad.Array4f
        offsets: dict[int, int] = {}
        values: list[NDArray[np.float32]] = []
        records = np.zeros((max(1, len(patterns)), _RECORD), dtype=np.float32)
        names = records.view(np.uint32)
        total = 0
        for number, placed in enumerate(patterns):
            pattern = placed.pattern
            if id(pattern) not in offsets:
                offsets[id(pattern)] = total
                values.append(np.asarray(pattern.shares, dtype=np.float32).ravel())
                total += values[-1].size
            rows, cols = pattern.shares.shape
            azimuth, elevation = pattern.steps_rad()
            records[number, 0:3], records[number, 4:7] = placed.frame[:, 0], placed.frame[:, 2]
            first = np.radians([pattern.azimuth_deg[0], pattern.elevation_deg[0]])
            records[number, 8:12] = *first, 1 / azimuth, 1 / elevation
            names[number, 3], names[number, 7], names[number, 12] = offsets[id(pattern)], rows, cols
        # At least two: a gather from an array of one would be other code.
        joined = np.concatenate([*values, np.zeros(2, np.float32)])
        self._records, self._shares = upload(mi.Float, records), upload(mi.Float, joined)

    def share(self, number: Any, towards: Any, active: Any) -> Any:
        """Return the share that pattern `number` sends `towards` (unit)."""
        dr, mi = self._dr, self._mi
        ahead, above, second, last = (dr.gather(self._four, self._records, number * 4 + k, active) for k in range(4))
        forward, up = mi.Vector3f(ahead.x, ahead.y, ahead.z), mi.Vector3f(above.x, above.y, above.z)
        left = dr.cross(up, forward)
        x, y, z = dr.dot(towards, forward), dr.dot(towards, left), dr.dot(towards, up)
        col = (dr.atan2(y, x) - second.x) * second.z
        row = (dr.atan2(z, dr.sqrt(x * x + y * y)) - second.y) * second.w
        whole = dr.reinterpret_array(mi.UInt32, above.w), dr.reinterpret_array(mi.UInt32, last.x)
        last_row, last_col = mi.Float(whole[0]) - 1.0, mi.Float(whole[1]) - 1.0
        within = active & (col > -_EDGE) & (row > -_EDGE) & (col < last_col + _EDGE) & (row < last_row + _EDGE)
        row, col = dr.clip(row, 0.0, last_row), dr.clip(col, 0.0, last_col)
        top, side = dr.minimum(dr.floor(row), last_row - 1.0), dr.minimum(dr.floor(col), last_col - 1.0)
        place = dr.reinterpret_array(mi.UInt32, ahead.w) + mi.UInt32(top) * whole[1] + mi.UInt32(side)
        corners = [dr.gather(mi.Float, self._shares, place + k, within) for k in (0, 1)]
        below = [dr.gather(mi.Float, self._shares, place + whole[1] + k, within) for k in (0, 1)]
        across = col - side
        mixed = dr.lerp(dr.lerp(*corners, across), dr.lerp(*below, across), row - top)
        return dr.select(within, mixed, 0.0)
