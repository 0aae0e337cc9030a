"""Levels of a raw image: what each channel's pixels hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.scene.images import RawImage

__all__ = ["ChannelLevels", "PixelRegion", "channel_levels", "channel_mask"]


@dataclass(frozen=True, slots=True)
class PixelRegion:
    """Columns x0 to x1 - 1 and rows y0 to y1 - 1."""

    x0: int
    y0: int
    x1: int
    y1: int

    def within(self, rows: int, cols: int) -> tuple[slice, slice]:
        """Return the slices (rows, cols) of the region. Raises FieldError where it is empty or leaves the image."""
        if not (0 <= self.x0 < self.x1 <= cols and 0 <= self.y0 < self.y1 <= rows):
            raise FieldError(
                f"the region {self.x0},{self.y0},{self.x1},{self.y1} is empty or leaves the image; must be x0,y0,x1,y1 with "
                f"0 <= x0 < x1 <= {cols} and 0 <= y0 < y1 <= {rows}.",
                path="region",
                value=f"{self.x0},{self.y0},{self.x1},{self.y1}",
            )
        return slice(self.y0, self.y1), slice(self.x0, self.x1)


@dataclass(frozen=True, slots=True)
class ChannelLevels:
    """Statistics of one channel [DN]; `snr_ratio` is the mean above black over the standard deviation of the pixels.

    In a picture of something that standard deviation holds the scene's contrast, and the ratio is no noise figure; in a flat
    region it is the sensor's noise, its fixed pattern included.
    """

    channel: str
    pixels: int
    mean_dn: float
    standard_deviation_dn: float
    min_dn: int
    max_dn: int
    saturated_fraction: float
    snr_ratio: float


def channel_mask(raw: RawImage, channel: str) -> NDArray[np.bool_]:
    """Return which pixels belong to a channel, (rows, cols). Raises FieldError for a channel the pattern does not have."""
    names = np.array(raw.pattern)
    if channel not in names:
        known = ", ".join(sorted({str(name) for name in names.ravel()}))
        raise FieldError(f"the sensor has no channel {channel!r}; it has {known}.", path="channel", value=channel)
    repeats = (-(-raw.rows // names.shape[0]), -(-raw.cols // names.shape[1]))
    return np.asarray(np.tile(names == channel, repeats)[: raw.rows, : raw.cols])


def channel_levels(raw: RawImage, region: PixelRegion | None = None) -> tuple[ChannelLevels, ...]:
    """Return the statistics of each channel in a region, or in the whole image.

    Channels come in the order of the sensor; those with no pixel in the region are left out. A pixel counts as saturated from
    the white level (rounded down) on.

    Raises FieldError for a region that is empty or leaves the image.
    """
    part = (region or PixelRegion(0, 0, raw.cols, raw.rows)).within(raw.rows, raw.cols)
    used = {name for row in raw.pattern for name in row}
    found = []
    for name in (name for name, _ in raw.channels if name in used):
        dn = raw.dn[part][channel_mask(raw, name)[part]]
        if dn.size:
            found.append(_levels(name, dn, raw))
    return tuple(found)


def _levels(name: str, dn: NDArray[np.unsignedinteger], raw: RawImage) -> ChannelLevels:
    mean, deviation = float(np.mean(dn)), float(np.std(dn, ddof=1)) if dn.size > 1 else 0.0
    return ChannelLevels(
        channel=name,
        pixels=int(dn.size),
        mean_dn=mean,
        standard_deviation_dn=deviation,
        min_dn=int(dn.min()),
        max_dn=int(dn.max()),
        saturated_fraction=float(np.mean(dn >= np.floor(raw.white_level_dn))),
        snr_ratio=(mean - raw.black_level_dn) / deviation if deviation > 0 else 0.0,
    )
