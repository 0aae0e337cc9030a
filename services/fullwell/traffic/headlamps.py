"""What headlamps throw ahead: luminous intensity over directions, made to meet the points that type approval measures.

UN Regulations 112 and 149 measure a lamp 25 m before a screen, aimed so that the horizontal part of its cut-off lies 0.57
degrees (1 %) below its axis. Azimuths are to the left, as in `BeamPattern`. What a lamp sends to all sides, stray light above
the cut-off included, is emitted by its lens; the patterns are what it concentrates.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.scene import BeamPattern

__all__ = ["BeamKind", "LampKind", "beam_intensity_cd", "beam_patterns"]

Array = NDArray[np.float64]
BeamKind = Literal["low", "high"]
LampKind = Literal["led", "halogen", "bicycle"]

_EDGE_DEG: Final = -0.57
"""Horizontal part of the cut-off, towards oncoming traffic."""

_RISE: Final = float(np.tan(np.radians(15.0)))
"""Slope of the cut-off on the own side, from the kink on the axis."""

_HIGHEST_DEG: Final = 1.0
"""Where the rising part goes over into level."""


@dataclass(frozen=True, slots=True)
class _Lobe:
    """A part of a beam, a Gaussian to the sides and below a line under the cut-off, even above it up to the cut-off.

    Attributes
    ----------
    intensity_cd
        At its middle.
    middle_deg, half_widths_deg
        Azimuth of the middle; standard deviations to the sides and downwards.
    below_deg
        How far under the cut-off it begins to fall; or, in a beam without a cut-off, its elevation.
    azimuth_deg, elevation_deg, steps_deg
        The table.
    """

    intensity_cd: float
    middle_deg: float
    half_widths_deg: tuple[float, float]
    below_deg: float
    azimuth_deg: tuple[float, float]
    elevation_deg: tuple[float, float]
    steps_deg: tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Beam:
    """Lobes, and over what angle [deg] the cut-off falls by e; 0 for none."""

    lobes: tuple[_Lobe, ...]
    softness_deg: float = 0.0


_HOT: Final = ((-16.0, 13.0), (-6.0, 2.5), (0.25, 0.1))
_WIDE: Final = ((-50.0, 50.0), (-22.0, 2.5), (0.5, 0.125))
_AHEAD: Final = ((-20.0, 20.0), (-9.0, 9.0), (0.5, 0.25))
_AROUND: Final = ((-45.0, 45.0), (-18.0, 15.0), (1.0, 0.5))

_BEAMS: Final[dict[tuple[LampKind, BeamKind], _Beam]] = {
    ("led", "low"): _Beam(
        (_Lobe(24_000.0, -1.8, (4.0, 1.1), 0.35, *_HOT), _Lobe(3_600.0, 0.0, (19.0, 6.0), 1.2, *_WIDE)), softness_deg=0.09
    ),
    ("halogen", "low"): _Beam(
        (_Lobe(16_500.0, -1.8, (4.2, 1.2), 0.35, *_HOT), _Lobe(2_500.0, 0.0, (17.0, 5.0), 1.2, *_WIDE)), softness_deg=0.14
    ),
    ("led", "high"): _Beam((_Lobe(62_000.0, 0.0, (4.0, 1.8), 0.0, *_AHEAD), _Lobe(4_500.0, 0.0, (15.0, 5.0), -1.0, *_AROUND))),
    ("halogen", "high"): _Beam(
        (_Lobe(46_000.0, 0.0, (3.8, 1.9), 0.0, *_AHEAD), _Lobe(3_000.0, 0.0, (13.0, 5.0), -1.0, *_AROUND))
    ),
    # A bicycle's lamp is aimed as a whole: 10 lx at 10 m on its axis.
    ("bicycle", "low"): _Beam((_Lobe(1_700.0, 0.0, (5.0, 1.6), 1.2, *_AHEAD),), softness_deg=0.25),
}
_BEAMS[("bicycle", "high")] = _BEAMS[("bicycle", "low")]


def _cut_off_deg(azimuth_deg: Array) -> Array:
    """Return the elevation of the cut-off of a lamp for right-hand traffic: level to the left, rising to the right."""
    return np.minimum(_EDGE_DEG + _RISE * np.maximum(-azimuth_deg, 0.0), _HIGHEST_DEG)


def _lobe_cd(lobe: _Lobe, softness_deg: float, azimuth_deg: Array, elevation_deg: Array) -> Array:
    aside, down = (azimuth_deg - lobe.middle_deg) / lobe.half_widths_deg[0], lobe.half_widths_deg[1]
    if softness_deg == 0:
        return np.asarray(lobe.intensity_cd * np.exp(-0.5 * (aside**2 + ((elevation_deg - lobe.below_deg) / down) ** 2)))
    under = _cut_off_deg(azimuth_deg) - elevation_deg
    fall = np.exp(-0.5 * (np.maximum(under - lobe.below_deg, 0.0) / down) ** 2)
    kept = 1.0 / (1.0 + np.exp(-np.clip(under / softness_deg, -60.0, 60.0)))
    return np.asarray(lobe.intensity_cd * np.exp(-0.5 * aside**2) * fall * kept)


@cache
def beam_patterns(lamp: LampKind, beam: BeamKind, *, drives_on: Literal["right", "left"] = "right") -> tuple[BeamPattern, ...]:
    """Return the patterns of one lamp, shares in cd; they add up. For traffic on the left the beam is mirrored."""
    kind = _BEAMS[lamp, beam]
    patterns = []
    for lobe in kind.lobes:
        cols, rows = (
            round((last - first) / step) + 1
            for (first, last), step in zip((lobe.azimuth_deg, lobe.elevation_deg), lobe.steps_deg, strict=True)
        )
        azimuth, elevation = np.linspace(*lobe.azimuth_deg, cols), np.linspace(*lobe.elevation_deg, rows)
        shares = _lobe_cd(lobe, kind.softness_deg, azimuth[None], elevation[:, None]).astype(np.float32)
        bounds = lobe.azimuth_deg
        if drives_on == "left":
            shares, bounds = shares[:, ::-1], (-bounds[1], -bounds[0])
        shares[shares < _LEAST_SHARE * shares.max()] = 0.0
        patterns.append(BeamPattern(np.ascontiguousarray(shares), bounds, lobe.elevation_deg))
    return tuple(patterns)


_LEAST_SHARE: Final = 1e-4
"""Of the brightest direction, below which nothing is sent."""


def beam_intensity_cd(
    patterns: tuple[BeamPattern, ...], azimuth_deg: ArrayLike, elevation_deg: ArrayLike
) -> NDArray[np.float64]:
    """Return the luminous intensity [cd] of a lamp's patterns together in directions."""
    return np.asarray(sum(pattern.share(azimuth_deg, elevation_deg) for pattern in patterns))
