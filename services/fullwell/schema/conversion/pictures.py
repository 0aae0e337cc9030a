"""Environment pictures as linear RGB."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import AssetError
from fullwell.radiometry import srgb_to_linear

__all__ = ["read_linear_rgb"]

_MAX_PIXELS = 64_000_000
_SUFFIXES = (".exr", ".hdr", ".jpeg", ".jpg", ".npy", ".png", ".tif", ".tiff")


def read_linear_rgb(file: Path) -> NDArray[np.float32]:
    """Return (rows, cols, 3) float32 linear RGB >= 0 of an EXR, HDR, NPY (linear) or PNG, JPEG, TIFF (sRGB) file.

    Raises AssetError where it cannot be read, holds NaN, Inf or negative values, or is too large.
    """
    suffix = file.suffix.lower()
    if suffix not in _SUFFIXES:
        raise AssetError(f"{file.name} is not of a known picture format; known are {', '.join(_SUFFIXES)}.")
    readers = {".exr": _exr, ".hdr": _radiance_hdr, ".npy": _npy}
    try:
        pixels = readers.get(suffix, _encoded)(file)
    except AssetError:
        raise
    except Exception as error:  # decoders answer damaged files with whatever their arithmetic raised
        raise AssetError(f"{file.name} cannot be read: {str(error)[:200]}. Save it again.") from error
    if pixels.ndim != 3 or pixels.shape[2] != 3 or 0 in pixels.shape:
        raise AssetError(f"{file.name} has shape {pixels.shape}; must be (rows, cols, 3).")
    if pixels.shape[0] * pixels.shape[1] > _MAX_PIXELS:
        raise AssetError(f"{file.name} has {pixels.shape[0]} x {pixels.shape[1]} pixels; at most {_MAX_PIXELS} are allowed.")
    if not np.all(np.isfinite(pixels)) or pixels.min() < 0:
        raise AssetError(f"{file.name} holds NaN, Inf or negative values; every pixel must be finite and >= 0.")
    return np.ascontiguousarray(pixels, dtype=np.float32)


def _npy(file: Path) -> NDArray[np.float32]:
    loaded = np.load(file, mmap_mode="r", allow_pickle=False)
    if loaded.ndim != 3 or loaded.size > 3 * _MAX_PIXELS or loaded.dtype.kind != "f":
        raise AssetError(f"{file.name} has shape {loaded.shape} and type {loaded.dtype}; must be (rows, cols, 3) floats.")
    return np.asarray(loaded, dtype=np.float32)


def _encoded(file: Path) -> NDArray[np.float32]:
    from PIL import Image  # noqa: PLC0415 - only for recipes that have such a picture

    with Image.open(file) as image:
        if image.width * image.height > _MAX_PIXELS:
            raise AssetError(f"{file.name} has {image.height} x {image.width} pixels; at most {_MAX_PIXELS} are allowed.")
        encoded = np.asarray(image.convert("RGB"), dtype=np.float64) / 255.0
    return srgb_to_linear(encoded).astype(np.float32)


def _exr(file: Path) -> NDArray[np.float32]:
    import OpenEXR  # noqa: PLC0415 - only for recipes that have such a picture

    with OpenEXR.File(str(file), separate_channels=True) as picture:
        channels = picture.channels()
        missing = [name for name in "RGB" if name not in channels]
        if missing:
            raise AssetError(f"{file.name} has no channel {missing[0]}; it must have R, G and B.")
        return np.stack([np.asarray(channels[name].pixels, dtype=np.float32) for name in "RGB"], axis=-1)


def _radiance_hdr(file: Path) -> NDArray[np.float32]:
    """Radiance RGBE, flat or run-length coded (Ward 1994, Graphics Gems II, "Real Pixels")."""
    content = file.read_bytes()
    header, _, body = content.partition(b"\n\n")
    size, _, packed = body.partition(b"\n")
    words = size.split()
    if not content.startswith(b"#?") or len(words) != 4 or words[0] != b"-Y" or words[2] != b"+X":
        raise AssetError(f"{file.name} is not a Radiance picture with rows from the top ('-Y rows +X cols').")
    if b"FORMAT=32-bit_rle_rgbe" not in header:
        raise AssetError(f"{file.name} is not in the format 32-bit_rle_rgbe.")
    rows, cols = int(words[1]), int(words[3])
    if rows < 1 or cols < 1 or rows * cols > _MAX_PIXELS:
        raise AssetError(f"{file.name} has {rows} x {cols} pixels; at most {_MAX_PIXELS} are allowed.")
    rgbe = _unpacked(packed, rows, cols)
    scale = np.where(rgbe[..., 3:] > 0, np.ldexp(1.0, rgbe[..., 3:].astype(np.int32) - 136), 0.0)
    return (rgbe[..., :3] * scale).astype(np.float32)


def _unpacked(packed: bytes, rows: int, cols: int) -> NDArray[np.uint8]:
    if not packed.startswith(b"\x02\x02"):
        return np.frombuffer(packed, dtype=np.uint8, count=rows * cols * 4).reshape(rows, cols, 4)
    rgbe = np.empty((rows, 4, cols), dtype=np.uint8)
    position = 0
    for row in range(rows):
        if packed[position : position + 2] != b"\x02\x02" or int.from_bytes(packed[position + 2 : position + 4]) != cols:
            raise ValueError(f"row {row} is damaged")
        position += 4
        for channel in range(4):
            col = 0
            while col < cols:
                count = packed[position]
                run = count > 128
                length = count - 128 if run else count
                piece = packed[position + 1 : position + 2] * length if run else packed[position + 1 : position + 1 + length]
                if not length or col + length > cols or len(piece) != length:
                    raise ValueError(f"row {row} is damaged")
                rgbe[row, channel, col : col + length] = np.frombuffer(piece, dtype=np.uint8)
                position += 2 if run else 1 + length
                col += length
    return rgbe.transpose(0, 2, 1)
