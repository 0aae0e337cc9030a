"""Textures no larger than asked, made smaller in linear light."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fullwell.assets.model import linear_to_srgb, srgb_to_linear

__all__ = ["bounded_texture"]

_LINEAR: Final = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)


def bounded_texture(pixels: NDArray[np.uint8], max_px: int) -> NDArray[np.uint8]:
    """Return an sRGB image (rows, cols, 3) whose longer side is at most `max_px`; the same array where it is already.

    Each new pixel is the mean linear light of the area that it covers (box filter): encoded values would come out too dark
    wherever bright and dark lie side by side.
    """
    rows, cols = pixels.shape[:2]
    if max(rows, cols) <= max_px:
        return pixels
    factor = max_px / max(rows, cols)
    size = (max(round(cols * factor), 1), max(round(rows * factor), 1))
    channels = []
    for channel in range(3):  # one after the other: in floats a large texture takes a lot of memory
        linear = Image.fromarray(_LINEAR[pixels[..., channel]])
        small = np.asarray(linear.resize(size, Image.Resampling.BOX), dtype=np.float64)
        channels.append(np.round(linear_to_srgb(small) * 255.0).astype(np.uint8))
    return np.stack(channels, axis=-1)
