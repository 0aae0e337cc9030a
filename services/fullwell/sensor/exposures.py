"""What describes an exposure: one time, one found from the light, or several captures that make one image."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, get_args

from fullwell.core.errors import FieldError, unknown_name_message

__all__ = [
    "MAX_FRAMES",
    "AutoExposure",
    "BracketExposure",
    "BurstExposure",
    "ChannelExposure",
    "Combination",
    "Exposure",
    "FixedExposure",
    "MeteringMethod",
    "SingleExposure",
]

MAX_FRAMES: Final = 256
"""Captures of one image; the sum of so many 16-bit values has 24 bits."""

MeteringMethod = Literal["full", "mean", "percentile", "luminance", "centre_weighted", "highlight", "area"]
Combination = Literal["weighted", "select"]


def _refuse(field: str, value: object, legal: str) -> FieldError:
    return FieldError(f"{field} is {value}; must be {legal}. Set exposure.{field}.", path=field, value=value)


@dataclass(frozen=True, slots=True)
class FixedExposure:
    """One exposure of `time_s` [s], > 0."""

    time_s: float

    def __post_init__(self) -> None:
        if not 0 < self.time_s < math.inf:
            raise _refuse("time_s", self.time_s, "> 0 and finite")


@dataclass(frozen=True, slots=True)
class AutoExposure:
    """Exposure time found from the noise-free image.

    `method` says what reaches `level` of the saturation signal (the well, or what the ADC's full scale leaves of it after
    analog gain and offset):

    - "full": the brightest pixel
    - "mean": the mean pixel
    - "percentile": the `percentile`-th pixel
    - "luminance": the brightest period of the colour filter array, by its brightest channel: small bright spots are averaged
    - "centre_weighted": the mean pixel, weighted by a Gaussian about the centre (docs/physics/exposure.md)
    - "highlight": the `percentile`-th pixel of the channel for which that is highest, so that no colour of a light is lost
    - "area": the mean pixel of `area`, (top, left, height, width) as fractions of the image

    The result is clipped to [min_time_s, max_time_s]; a black scene gets max_time_s.
    """

    method: MeteringMethod = "percentile"
    level: float = 0.7
    percentile: float = 99.0
    min_time_s: float = 1e-6
    max_time_s: float = 1.0
    area: tuple[float, float, float, float] = (0.25, 0.25, 0.5, 0.5)

    def __post_init__(self) -> None:
        if self.method not in get_args(MeteringMethod):
            message = unknown_name_message("exposure method", self.method, get_args(MeteringMethod))
            raise FieldError(message, path="method", value=self.method)
        if not 0 < self.level <= 1:
            raise _refuse("level", self.level, "> 0 and at most 1")
        if not 0 <= self.percentile <= 100:
            raise _refuse("percentile", self.percentile, "0 to 100")
        if not 0 < self.min_time_s <= self.max_time_s < math.inf:
            raise FieldError(
                f"min_time_s is {self.min_time_s} and max_time_s {self.max_time_s}; must be 0 < min_time_s <= max_time_s.",
                path="min_time_s",
                value=self.min_time_s,
            )
        top, left, height, width = self.area
        if not (0 <= top < 1 and 0 <= left < 1 and 0 < height <= 1 - top and 0 < width <= 1 - left):
            raise _refuse("area", self.area, "(top, left, height, width) with every edge within 0 to 1, not empty")


SingleExposure: TypeAlias = FixedExposure | AutoExposure


@dataclass(frozen=True, slots=True)
class BracketExposure:
    """Exposures one after the other, `ratios` times the time of `base`, combined into one linear image.

    The longest is the reference. "weighted" takes the mean of all unsaturated captures with inverse variances as weights,
    "select" the longest unsaturated one of each pixel.
    """

    base: SingleExposure
    ratios: tuple[float, ...]
    combination: Combination = "weighted"

    def __post_init__(self) -> None:
        if not 2 <= len(self.ratios) <= MAX_FRAMES:
            raise _refuse("bracket.ratios", self.ratios, f"2 to {MAX_FRAMES} numbers")
        if not all(0 < ratio < math.inf for ratio in self.ratios):
            raise _refuse("bracket.ratios", self.ratios, "> 0 and finite")
        if self.combination not in get_args(Combination):
            message = unknown_name_message("combination", self.combination, get_args(Combination))
            raise FieldError(message, path="bracket.combination", value=self.combination)


@dataclass(frozen=True, slots=True)
class BurstExposure:
    """`count` equal exposures one after the other, "sum" or "mean" of their digital numbers.

    The sum counts as one exposure of `count` times the time; the mean keeps the time and gets finer steps, so that nothing is
    lost by rounding it.
    """

    base: SingleExposure
    count: int
    combination: Literal["mean", "sum"] = "mean"

    def __post_init__(self) -> None:
        if not 2 <= self.count <= MAX_FRAMES:
            raise _refuse("burst.count", self.count, f"2 to {MAX_FRAMES}")
        if self.combination not in ("mean", "sum"):
            message = unknown_name_message("combination", self.combination, ("mean", "sum"))
            raise FieldError(message, path="burst.combination", value=self.combination)


@dataclass(frozen=True, slots=True)
class ChannelExposure:
    """Each channel with its own time in the same capture, `ratios` (name, number) times the time of `base`.

    Channels without a ratio have 1. Without any ratios each channel finds its own time by itself; `base` is then an automatic
    exposure by "full", "mean" or "percentile". The longest is the reference: the values of the others are multiplied up to it.
    """

    base: SingleExposure
    ratios: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        if not all(0 < ratio < math.inf for _, ratio in self.ratios):
            raise _refuse("channel_ratios", self.ratios, "> 0 and finite")
        by_itself = isinstance(self.base, AutoExposure) and self.base.method in ("full", "mean", "percentile")
        if not self.ratios and not by_itself:
            raise _refuse("channel_ratios", "auto", "numbers, unless auto.method is full, mean or percentile")


Exposure: TypeAlias = FixedExposure | AutoExposure | BracketExposure | BurstExposure | ChannelExposure
