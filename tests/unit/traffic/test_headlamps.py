"""Headlamps against the points that type approval measures on a screen 25 m ahead."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.schema.conversion.street_lamps import INTENSITY_CD
from fullwell.traffic.headlamps import beam_intensity_cd, beam_patterns

LENS_CD = INTENSITY_CD["headlight"]
"""What the lens sends to all sides beside the beam, least and most."""

# Azimuth to the left and elevation [deg] of the points of UN R112 / R149 for traffic on the right, and least and most [cd].
PASSING = {
    "B50L": (3.43, 0.57, 0, 350),
    "BR": (-2.5, 1.0, 0, 1_750),
    "75R": (-1.15, -0.57, 10_100, np.inf),
    "75L": (3.43, -0.57, 0, 10_600),
    "50R": (-1.72, -0.86, 10_100, np.inf),
    "50L": (3.43, -0.86, 0, 18_480),
    "50V": (0.0, -0.86, 5_100, np.inf),
    "25L": (9.0, -1.72, 1_700, np.inf),
    "25R": (-9.0, -1.72, 1_700, np.inf),
    "HV": (0.0, 0.0, 0, 625),
}
DRIVING = {
    "HV": (0.0, 0.0, 40_500, 215_000),
    "H, 2.6 deg left": (2.6, 0.0, 20_300, 215_000),
    "H, 2.6 deg right": (-2.6, 0.0, 20_300, 215_000),
    "H, 5.2 deg left": (5.2, 0.0, 5_100, 215_000),
    "H, 5.2 deg right": (-5.2, 0.0, 5_100, 215_000),
}


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("lamp", ["led", "halogen"])
@pytest.mark.parametrize(("beam", "points"), [("low", PASSING), ("high", DRIVING)])
def test_every_point_of_the_regulation_is_met(lamp, beam, points, side: str) -> None:
    patterns = beam_patterns(lamp, beam, drives_on=side)
    mirrored = 1.0 if side == "right" else -1.0
    for name, (azimuth_deg, elevation_deg, least, most) in points.items():
        thrown = float(beam_intensity_cd(patterns, mirrored * azimuth_deg, elevation_deg))
        assert least <= thrown + LENS_CD[0], name
        assert thrown + LENS_CD[1] <= most, name


@pytest.mark.parametrize("lamp", ["led", "halogen"])
def test_cut_off_is_level_towards_oncoming_traffic_and_rises_by_15_degrees_on_the_own_side(lamp: str) -> None:
    """Its place is where the logarithm of the intensity falls fastest, and it falls by more than the regulation asks: 0.13 in
    0.1 degrees."""
    patterns = beam_patterns(lamp, "low")
    elevation = np.arange(-2.0, 2.0, 0.02)

    def edge(azimuth_deg: float) -> float:
        seen = np.log10(beam_intensity_cd(patterns, azimuth_deg, elevation) + LENS_CD[1])
        fall = seen[:-5] - seen[5:]
        assert fall.max() > 0.13
        return float(elevation[np.argmax(fall)] + 0.05)

    assert edge(2.5) == pytest.approx(edge(1.5), abs=0.08)
    assert edge(-4.0) - edge(-2.0) == pytest.approx(2.0 * np.tan(np.radians(15.0)), abs=0.08)
    # Zone III begins 0.57 degrees above the edge's own place.
    above = beam_intensity_cd(patterns, np.linspace(0.5, 8.0, 30)[None], np.linspace(0.0, 2.0, 20)[:, None])
    assert above.max() + LENS_CD[1] <= 625


def test_lamps_for_the_left_are_mirrored() -> None:
    for right, left in zip(beam_patterns("led", "low"), beam_patterns("led", "low", drives_on="left"), strict=True):
        assert left.azimuth_deg == (-right.azimuth_deg[1], -right.azimuth_deg[0])
        assert np.array_equal(left.shares, right.shares[:, ::-1])


def test_driving_beam_is_brightest_ahead() -> None:
    for lamp in ("led", "halogen"):
        patterns = beam_patterns(lamp, "high")
        grid = np.meshgrid(np.arange(-15, 15, 0.25), np.arange(-8, 8, 0.25))
        brightest = beam_intensity_cd(patterns, *grid).max()
        assert float(beam_intensity_cd(patterns, 0.0, 0.0)) >= 0.8 * brightest


def test_a_pair_has_the_flux_of_lamps_in_service() -> None:
    """Of one lamp on the road: 300 to 700 lm passing, 800 to 1,800 lm driving."""
    for lamp in ("led", "halogen"):
        low, high = (sum(pattern.solid_angle_sr() for pattern in beam_patterns(lamp, beam)) for beam in ("low", "high"))
        assert 300 < low < 700
        assert 800 < high < 1800


def test_bicycles_light_10_lux_at_10_metres_and_do_not_dazzle() -> None:
    patterns = beam_patterns("bicycle", "low")
    elevation = np.linspace(-5, 0, 200)
    assert beam_intensity_cd(patterns, 0.0, elevation).max() >= 10 * 10**2
    assert float(beam_intensity_cd(patterns, 0.0, 3.4)) < 200
