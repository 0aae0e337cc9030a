"""Small pieces of a picture: fonts, colour maps, labels, curves. Pillow only."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

__all__ = [
    "BACKGROUND",
    "FAINT",
    "INK",
    "PANEL",
    "Rgb",
    "Tags",
    "colour_bar",
    "colour_map",
    "distinct_colour",
    "fit",
    "flow_picture",
    "font",
    "id_picture",
    "nice_ticks",
    "wavelength_colour",
]

Rgb = tuple[int, int, int]

BACKGROUND: Rgb = (24, 26, 30)
PANEL: Rgb = (36, 39, 45)
INK: Rgb = (232, 234, 237)
FAINT: Rgb = (150, 156, 166)

_VIRIDIS = np.array(
    [
        (68, 1, 84), (72, 36, 117), (65, 68, 135), (53, 95, 141), (42, 120, 142), (33, 145, 140),
        (34, 168, 132), (68, 191, 112), (122, 209, 81), (189, 223, 38), (253, 231, 37),
    ],
    dtype=np.float64,
)  # fmt: skip
"""Eleven equal steps of viridis (van der Walt and Smith 2015, CC0): equal steps look equal, also in grey."""


@cache
def font(size_px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Return the font of the pictures at a size; it comes with Pillow."""
    return ImageFont.load_default(size=size_px)


def colour_map(fraction: ArrayLike) -> NDArray[np.uint8]:
    """Return (..., 3) sRGB colours of values in [0, 1], dark violet to yellow."""
    values = np.clip(np.asarray(fraction, dtype=np.float64), 0.0, 1.0)
    steps = np.linspace(0.0, 1.0, len(_VIRIDIS))
    return np.stack([np.interp(values, steps, _VIRIDIS[:, k]) for k in range(3)], axis=-1).astype(np.uint8)


def distinct_colour(number: int) -> Rgb:
    """Return a colour that differs well from those of the numbers nearby; 0 is nothing and nearly black."""
    if number == 0:
        return (14, 15, 17)
    # Steps of the golden ratio never come close to one another on the hue circle.
    hue = (0.57 + number * 0.6180339887) % 1.0
    red, green, blue = colorsys.hls_to_rgb(hue, (0.52, 0.66, 0.42)[number % 3], (0.62, 0.78)[number // 3 % 2])
    return round(255 * red), round(255 * green), round(255 * blue)


def id_picture(ids: NDArray[np.uint32]) -> NDArray[np.uint8]:
    """Return ids in their distinct colours."""
    present, where = np.unique(ids, return_inverse=True)
    palette = np.array([distinct_colour(int(number)) for number in present], dtype=np.uint8)
    return palette[where.reshape(ids.shape)]


def flow_picture(flow: NDArray[Any], full: float) -> NDArray[np.uint8]:
    """Return flow (rows, cols, 2), to the right and down, as colours: hue by direction, white at rest, deep from `full` on.

    Red flows to the right, yellow-green up, cyan to the left, violet down. NaN is nearly black.
    """
    right, down = flow[..., 0].astype(np.float64), flow[..., 1].astype(np.float64)
    known = np.isfinite(right) & np.isfinite(down)
    right, down = np.where(known, right, 0.0), np.where(known, down, 0.0)
    depth = np.minimum(np.hypot(right, down) / full, 1.0)
    hue = (np.arctan2(-down, right) / (2 * np.pi)) % 1.0
    # Each channel is 1 within a sixth of its own hue and 0 within a sixth of its opposite (HSV at full value).
    away = np.abs((hue[..., None] - np.array([0.0, 1 / 3, 2 / 3]) + 0.5) % 1.0 - 0.5)
    pure = np.clip(2.0 - 6.0 * away, 0.0, 1.0)
    colours = np.asarray(np.rint(255.0 * (1.0 - depth[..., None] * (1.0 - pure))), dtype=np.uint8)
    colours[~known] = distinct_colour(0)
    return colours


def wavelength_colour(wavelength_nm: float) -> Rgb:
    """Return a colour that suggests a wavelength, for curves and titles only: hue by wavelength, no colorimetry."""
    hue = float(np.interp(wavelength_nm, [400, 440, 490, 515, 580, 620, 700], [0.77, 0.66, 0.5, 0.36, 0.155, 0.03, 0.0]))
    red, green, blue = colorsys.hls_to_rgb(hue, 0.58, 0.85)
    return round(255 * red), round(255 * green), round(255 * blue)


def fit(pixels: NDArray[np.uint8], size_px: tuple[int, int], *, smooth: bool = True) -> tuple[Image.Image, float]:
    """Return the picture scaled into (cols, rows) without distortion, and the factor. Ids must not be smoothed."""
    rows, cols = pixels.shape[:2]
    factor = min(size_px[0] / cols, size_px[1] / rows)
    target = (max(round(cols * factor), 1), max(round(rows * factor), 1))
    shrink = Image.Resampling.BOX if factor < 1 else Image.Resampling.BICUBIC
    method = shrink if smooth else Image.Resampling.NEAREST
    return Image.fromarray(np.ascontiguousarray(pixels)).resize(target, method), factor


def nice_ticks(low: float, high: float, *, about: int = 5) -> list[float]:
    """Return round numbers within [low, high]."""
    if not high > low:
        return [low]
    raw = (high - low) / about
    power = 10.0 ** np.floor(np.log10(raw))
    step = float(power * min((m for m in (1, 2, 2.5, 5, 10) if m * power >= raw), default=10))
    first = np.ceil(low / step - 1e-9) * step
    return [float(round(tick, 12)) + 0.0 for tick in np.arange(first, high + step * 1e-6, step)]


def colour_bar(height_px: int, width_px: int) -> Image.Image:
    """Return the colour map as a bar, its upper end at the top."""
    column = colour_map(np.linspace(1.0, 0.0, height_px))
    return Image.fromarray(np.repeat(column[:, None, :], width_px, axis=1))


@dataclass(slots=True)
class Tags:
    """Text tags that keep out of one another's way."""

    draw: ImageDraw.ImageDraw
    bounds: tuple[float, float, float, float]
    taken: list[tuple[float, float, float, float]]

    def put(self, anchor: tuple[float, float], text: str, colour: Rgb, *, size_px: int = 13) -> bool:
        """Write `text` with its lower left corner near `anchor`, or nothing where there is no room; returns whether it did."""
        left, top, right, bottom = self.draw.textbbox((0, 0), text, font=font(size_px))
        width, height = right - left + 6, bottom - top + 5
        for x, y in ((anchor[0], anchor[1] - height), (anchor[0], anchor[1] + 1), (anchor[0] - width, anchor[1] - height)):
            x0 = min(max(x, self.bounds[0]), self.bounds[2] - width)
            y0 = min(max(y, self.bounds[1]), self.bounds[3] - height)
            box = (x0, y0, x0 + width, y0 + height)
            if x0 < self.bounds[0] or any(_overlap(box, other) for other in self.taken):
                continue
            self.taken.append(box)
            self.draw.rectangle(box, fill=colour)
            dark = 0.3 * colour[0] + 0.59 * colour[1] + 0.11 * colour[2] > 130
            self.draw.text(
                (x0 + 3 - left, y0 + 2 - top), text, fill=(12, 12, 14) if dark else (250, 250, 250), font=font(size_px)
            )
            return True
        return False


def _overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
