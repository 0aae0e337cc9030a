"""Texture images as reflectance spectra: an atlas of palette numbers and a palette of sigmoid coefficients.

Each sRGB colour is upsampled once with the table of Jakob and Hanika that ships with Mitsuba, which makes the same spectra of
Mitsuba's bitmaps. A palette keeps large images small: four bytes per texel, twelve per colour.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import RenderError
from fullwell.radiometry.upsample import srgb_to_linear
from fullwell.render.transport.upload import upload
from fullwell.scene import Texture

__all__ = ["Placed", "TextureAtlas", "coefficients_of_srgb", "sigmoid", "texel_of"]

_CERTAIN = 1e4
"""Stands for the infinite coefficient of pure black and white; the sigmoid is 0 or 1 to single precision."""


_AT_ONCE = 1 << 14
"""Colours whose intermediate results stay in the processor's cache."""


@dataclass(frozen=True, slots=True)
class Placed:
    """Where a texture's texels start in the atlas, and its size."""

    offset: int
    rows: int
    cols: int


class TextureAtlas:
    """Collects textures on the host. A texture object is stored once, however many materials share it."""

    def __init__(self) -> None:
        self._placed: dict[int, tuple[Texture, Placed]] = {}
        self._packed: list[NDArray[np.uint32]] = []
        self._count = 0

    def add(self, texture: Texture) -> Placed:
        """Return the place of a texture."""
        known = self._placed.get(id(texture))
        if known is None:
            rows, cols = texture.pixels.shape[:2]
            pixels = texture.pixels.astype(np.uint32).reshape(-1, 3)
            self._packed.append(np.asarray(pixels[:, 0] << 16 | pixels[:, 1] << 8 | pixels[:, 2], dtype=np.uint32))
            known = (texture, Placed(self._count, rows, cols))
            self._count += rows * cols
            self._placed[id(texture)] = known
        return known[1]

    def finish(self, mi: Any) -> tuple[Any, Any]:
        """Return the device arrays: the palette number of each texel, and three coefficients for each colour."""
        packed = np.concatenate(self._packed)
        present = np.zeros(1 << 24, dtype=bool)
        present[packed] = True
        colours = np.flatnonzero(present)
        number = np.zeros(1 << 24, dtype=np.uint32)
        number[colours] = np.arange(colours.size, dtype=np.uint32)
        encoded = np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=1).astype(np.uint8)
        return upload(mi.UInt32, number[packed]), upload(mi.Float, coefficients_of_srgb(encoded))


def coefficients_of_srgb(encoded: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the (n, 3) coefficients of sigmoid spectra of (n, 3) sRGB colours.

    References
    ----------
    jakob2019, section 4 (the table and its lookup).
    """
    parts = [_coefficients(encoded[start : start + _AT_ONCE]) for start in range(0, len(encoded), _AT_ONCE)]
    return np.concatenate(parts) if parts else np.zeros((0, 3), dtype=np.float32)


def _coefficients(encoded: NDArray[np.uint8]) -> NDArray[np.float32]:
    linear = _decoded()[encoded]
    scale, table = _model()
    size = scale.size
    largest = 2 - np.argmax(linear[:, ::-1], axis=1)  # of equal components the last counts
    rows = np.arange(len(linear))
    z = linear[rows, largest]
    shrink = (size - 1) / np.maximum(z, 1e-30)
    x, y = (linear[rows, (largest + shift) % 3] * shrink for shift in (1, 2))
    k = np.clip(np.searchsorted(scale, z, side="right") - 1, 0, size - 2)
    i, j = np.minimum(x.astype(int), size - 2), np.minimum(y.astype(int), size - 2)
    u, v, w = x - i, y - j, (z - scale[k]) / (scale[k + 1] - scale[k])
    first = ((largest * size + k) * size + j) * size + i
    result = np.zeros((len(linear), 3))
    for dk, dj, di in np.ndindex(2, 2, 2):
        weight = (u if di else 1 - u) * (v if dj else 1 - v) * (w if dk else 1 - w)
        result += weight[:, None] * table[first + (dk * size + dj) * size + di]
    return _with_exact_greys(linear, result).astype(np.float32)


@functools.cache
def _decoded() -> NDArray[np.float64]:
    """Return the linear value of each of the 256 encoded ones."""
    return srgb_to_linear(np.arange(256) / 255.0)


def _with_exact_greys(linear: NDArray[np.float64], coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the coefficients with those of greys replaced by constant spectra."""
    grey = (linear[:, 0] == linear[:, 1]) & (linear[:, 1] == linear[:, 2])
    level = linear[grey, 0]
    with np.errstate(divide="ignore"):
        constant = (level - 0.5) / np.sqrt(level * (1.0 - level))
    coefficients[grey] = 0.0
    coefficients[grey, 2] = np.clip(constant, -_CERTAIN, _CERTAIN)
    return coefficients


@functools.cache
def _model() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the table's scale (size,) and its coefficients (n, 3), in the order of largest component, scale, y, x."""
    import mitsuba  # noqa: PLC0415 - the renderer is loaded late

    path = Path(str(mitsuba.__file__)).parent / "data" / "srgb.coeff"
    content = path.read_bytes()
    size = int(np.frombuffer(content, dtype="<u4", count=1, offset=4)[0])
    if content[:4] != b"SPEC" or len(content) < 8 + 4 * size + 36 * size**3:
        raise RenderError(f"{path} is not a table of colour coefficients. Reinstall mitsuba.")
    scale = np.frombuffer(content, dtype="<f4", count=size, offset=8).astype(np.float64)
    table = np.frombuffer(content, dtype="<f4", count=9 * size**3, offset=8 + 4 * size).astype(np.float64)
    return scale, table.reshape(-1, 3)


def texel_of(mi: Any, dr: Any, uv: Any, u: Any, *, rows: Any, cols: Any) -> Any:
    """Return one of the four texels about `uv`, chosen with its bilinear weight: the mean is the bilinear value.

    Images repeat; row 0 is at v = 1. `u` in [0, 1) is used up.
    """
    x = dr.fma(uv.x - dr.floor(uv.x), mi.Float(cols), -0.5)
    y = dr.fma(1.0 - (uv.y - dr.floor(uv.y)), mi.Float(rows), -0.5)
    x_low, y_low = dr.floor(x), dr.floor(y)
    x_share, y_share = x - x_low, y - y_low
    right = u < x_share
    rest = dr.select(right, u / dr.maximum(x_share, 1e-20), (u - x_share) / dr.maximum(1.0 - x_share, 1e-20))
    col = mi.Int32(x_low) + dr.select(right, 1, 0)
    row = mi.Int32(y_low) + dr.select(rest < y_share, 1, 0)
    return _wrapped(mi, dr, row, mi.Int32(rows)) * cols + _wrapped(mi, dr, col, mi.Int32(cols))


def _wrapped(mi: Any, dr: Any, position: Any, count: Any) -> Any:
    inside = dr.select(position < 0, position + count, position)
    return mi.UInt32(dr.select(inside >= count, inside - count, inside))


def sigmoid(dr: Any, coefficients: Any, wavelengths_nm: list[Any]) -> Any:
    """Return the reflectance at each wavelength of the coefficients' spectrum (jakob2019, eq. 4)."""
    values = []
    for wavelength_nm in wavelengths_nm:
        x = dr.fma(dr.fma(coefficients.x, wavelength_nm, coefficients.y), wavelength_nm, coefficients.z)
        values.append(dr.fma(0.5 * x, dr.rsqrt(dr.fma(x, x, 1.0)), 0.5))
    return dr.llvm.ad.ArrayXf(values)
