"""Relative illumination of the pixels: what micro-lenses and metal lose where light comes in obliquely."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fullwell.sensor.checks import check_not_negative, check_positive, refusal

__all__ = ["ChiefRayFalloff", "PixelFalloff", "RadialFalloff", "pixel_illumination"]


@dataclass(frozen=True, slots=True)
class ChiefRayFalloff:
    """cos^exponent of the angle by which the chief ray misses the one that the micro-lenses are shifted for.

    Attributes
    ----------
    exponent
        >= 0; 0 is no loss.
    exit_pupil_distance_m
        From the sensor to the lens' exit pupil [m]: the chief ray angle at radius r is atan(r / distance).
    design_distance_m
        The exit pupil distance that the micro-lenses' shift is made for [m]; infinite: they are not shifted.
    """

    exponent: float
    exit_pupil_distance_m: float
    design_distance_m: float = math.inf

    def __post_init__(self) -> None:
        check_not_negative("exponent", self.exponent, of="microlens")
        check_positive("exit_pupil_distance_m", self.exit_pupil_distance_m, of="microlens")
        if not self.design_distance_m > 0:
            raise refusal("design_distance_m", self.design_distance_m, "> 0", of="microlens")


@dataclass(frozen=True, slots=True)
class RadialFalloff:
    """A table: `ratio` in [0, 1] at `radius_m` >= 0 [m] from the axis, increasing; linear between, held beyond its ends."""

    radius_m: tuple[float, ...]
    ratio: tuple[float, ...]

    def __post_init__(self) -> None:
        radius, ratio = np.array(self.radius_m), np.array(self.ratio)
        if radius.size == 0 or radius.shape != ratio.shape:
            raise refusal("ratio", self.ratio, "as many numbers as radius_m, at least one", of="microlens")
        if not (np.all(np.isfinite(radius)) and radius[0] >= 0 and np.all(np.diff(radius) > 0)):
            raise refusal("radius_m", self.radius_m, ">= 0 and strictly increasing", of="microlens")
        if not np.all((ratio >= 0) & (ratio <= 1)):
            raise refusal("ratio", self.ratio, "within 0 to 1", of="microlens")


PixelFalloff: TypeAlias = ChiefRayFalloff | RadialFalloff


def pixel_illumination(falloff: PixelFalloff, *, rows: int, cols: int, pixel_pitch_m: float) -> NDArray[np.float64]:
    """Return the share of its light that each pixel keeps, (rows, cols), in [0, 1], 1 at the axis of a chief-ray law.

    Evaluated at pixel centres. The lens' own relative illumination is the optics'.

    References
    ----------
    catrysse2002, pixel vignetting.
    """
    down = (np.arange(rows) + 0.5 - rows / 2) * pixel_pitch_m
    across = (np.arange(cols) + 0.5 - cols / 2) * pixel_pitch_m
    radius_m = np.hypot(down[:, None], across[None, :])
    if isinstance(falloff, RadialFalloff):
        return np.asarray(np.interp(radius_m, falloff.radius_m, falloff.ratio))
    missed = np.arctan(radius_m / falloff.exit_pupil_distance_m) - np.arctan(radius_m / falloff.design_distance_m)
    return np.asarray(np.cos(missed) ** falloff.exponent)
