"""ISETCam's test scenes as spectral radiance, with its scaling: mean luminance 100 cd m^-2 unless asked otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.radiometry.isetcam import (
    DEFAULT_WAVELENGTH_NM,
    check_wavelengths,
    illuminant_photons,
    macbeth_reflectances,
    round_half_away,
)
from fullwell.scene.isetcam import DEFAULT_DISTANCE_M, IsetcamScene, with_mean_luminance

__all__ = [
    "bar_scene",
    "frequency_orientation_scene",
    "grid_lines_scene",
    "harmonic_scene",
    "line_scene",
    "macbeth_scene",
    "pattern_scene",
    "point_array_scene",
    "slanted_bar_scene",
    "sweep_scene",
    "uniform_scene",
    "zone_plate_scene",
]

_MEAN_LUMINANCE_CD_M2: Final = 100.0
_HFOV_DEG: Final = 10.0


def pattern_scene(
    reflectance: ArrayLike,
    *,
    illuminant: str = "equal photons",
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    hfov_deg: float = _HFOV_DEG,
    distance_m: float = DEFAULT_DISTANCE_M,
    luminance_cd_m2: float = _MEAN_LUMINANCE_CD_M2,
) -> IsetcamScene:
    """Return a flat pattern under a light, scaled to a mean luminance.

    Parameters
    ----------
    reflectance
        (rows, cols), or (rows, cols, bands), relative, >= 0.
    illuminant
        A name of `radiometry.isetcam.ILLUMINANTS` or "blackbody:3200".
    wavelength_nm
        (bands,) [nm].

    Raises
    ------
    FieldError
        A black pattern, or any argument out of range.
    """
    wave = check_wavelengths(wavelength_nm)
    light = illuminant_photons(illuminant, wave)
    pattern = np.asarray(reflectance, dtype=np.float64)
    if pattern.ndim not in (2, 3):
        raise ShapeError(f"reflectance has shape {pattern.shape}; must be (rows, cols) or (rows, cols, bands).")
    cube = pattern[:, :, None] if pattern.ndim == 2 else pattern
    scene = IsetcamScene(cube * light, wave, hfov_deg, distance_m, light)
    return with_mean_luminance(scene, luminance_cd_m2)


def uniform_scene(
    size: int | tuple[int, int] = 32,
    *,
    illuminant: str = "D65",
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    hfov_deg: float = _HFOV_DEG,
    distance_m: float = DEFAULT_DISTANCE_M,
    luminance_cd_m2: float = _MEAN_LUMINANCE_CD_M2,
) -> IsetcamScene:
    """Return a uniform field, `size` samples square or (rows, cols)."""
    shape = (size, size) if isinstance(size, int) else size
    return pattern_scene(
        np.ones(_checked_shape(shape)),
        illuminant=illuminant,
        wavelength_nm=wavelength_nm,
        hfov_deg=hfov_deg,
        distance_m=distance_m,
        luminance_cd_m2=luminance_cd_m2,
    )


def macbeth_scene(
    patch_px: int = 16,
    *,
    illuminant: str = "D65",
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    hfov_deg: float = _HFOV_DEG,
    distance_m: float = DEFAULT_DISTANCE_M,
    luminance_cd_m2: float = _MEAN_LUMINANCE_CD_M2,
) -> IsetcamScene:
    """Return the Macbeth chart, 4 x 6 patches of `patch_px` samples without borders; the mean, not the white, is scaled."""
    _checked_shape((patch_px, patch_px))
    patches = macbeth_reflectances(wavelength_nm).reshape(4, 6, -1)
    return pattern_scene(
        np.repeat(np.repeat(patches, patch_px, axis=0), patch_px, axis=1),
        illuminant=illuminant,
        wavelength_nm=wavelength_nm,
        hfov_deg=hfov_deg,
        distance_m=distance_m,
        luminance_cd_m2=luminance_cd_m2,
    )


def slanted_bar_scene(
    size: int = 384,
    *,
    slope: float = 2.6,
    hfov_deg: float = 2.0,
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    dark_level: float = 0.0,
    distance_m: float = DEFAULT_DISTANCE_M,
) -> IsetcamScene:
    """Return the hard slanted edge: white where Y > slope X on the integers -n..n, n = round(size / 2); equal energy.

    Levels are clipped below at 1e-6. The image has 2 n + 1 rows and columns.
    """
    n = int(round_half_away(_checked_shape((size, size))[0] / 2))
    axis = np.arange(-n, n + 1, dtype=np.float64)
    white = axis[:, None] > slope * axis[None, :]
    levels = np.maximum(np.where(white, 1.0, dark_level), 1e-6)
    return pattern_scene(
        levels, illuminant="equal energy", wavelength_nm=wavelength_nm, hfov_deg=hfov_deg, distance_m=distance_m
    )


def point_array_scene(
    size: int = 128,
    spacing: int = 16,
    *,
    illuminant: str = "equal photons",
    hfov_deg: float = 40.0,
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    distance_m: float = DEFAULT_DISTANCE_M,
) -> IsetcamScene:
    """Return single bright samples every `spacing` rows and columns, the first at round(spacing / 2), on black."""
    index = _lines(size, spacing)
    pattern = np.zeros((size, size))
    pattern[np.ix_(index, index)] = 1.0
    return pattern_scene(pattern, illuminant=illuminant, wavelength_nm=wavelength_nm, hfov_deg=hfov_deg, distance_m=distance_m)


def grid_lines_scene(
    size: int = 128,
    spacing: int = 16,
    *,
    illuminant: str = "equal photons",
    hfov_deg: float = 40.0,
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    distance_m: float = DEFAULT_DISTANCE_M,
) -> IsetcamScene:
    """Return bright lines one sample wide every `spacing` rows and columns; the ground is 1e-4 of them."""
    index = _lines(size, spacing)
    pattern = np.full((size, size), 1e-4)
    pattern[index, :] = 1.0
    pattern[:, index] = 1.0
    return pattern_scene(pattern, illuminant=illuminant, wavelength_nm=wavelength_nm, hfov_deg=hfov_deg, distance_m=distance_m)


def line_scene(size: int = 64, *, illuminant: str = "equal photons", hfov_deg: float = _HFOV_DEG) -> IsetcamScene:
    """Return one bright column in the middle; the ground is 1e-4 of it."""
    return _bar(size, 1, ground=1e-4, illuminant=illuminant, hfov_deg=hfov_deg)


def bar_scene(
    size: int = 64, width: int = 3, *, illuminant: str = "equal photons", hfov_deg: float = _HFOV_DEG
) -> IsetcamScene:
    """Return a bright bar of `width` columns in the middle; the ground is 1e-8 of it."""
    return _bar(size, width, ground=1e-8, illuminant=illuminant, hfov_deg=hfov_deg)


def frequency_orientation_scene(
    *,
    angles_rad: Sequence[float] | None = None,
    frequencies: Sequence[float] = (1, 2, 3, 4, 5, 6, 7, 8),
    block_px: int = 32,
    contrast: float = 1.0,
    illuminant: str = "equal energy",
    hfov_deg: float = _HFOV_DEG,
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    distance_m: float = DEFAULT_DISTANCE_M,
) -> IsetcamScene:
    """Return blocks of gratings: frequency [cycles per block] grows to the right, orientation turns downwards.

    `angles_rad` is by default 8 angles from 0 to pi / 2. Levels below 1e-4 of the maximum are raised to it.
    """
    angles = np.linspace(0, np.pi / 2, 8) if angles_rad is None else np.asarray(angles_rad, dtype=np.float64)
    axis = np.arange(_checked_shape((block_px, block_px))[0]) / block_px
    rows = []
    for angle in angles:
        phase = 2 * np.pi * (np.cos(angle) * axis[:, None] + np.sin(angle) * axis[None, :])
        rows.append(np.hstack([1.0 + contrast * np.sin(frequency * phase) for frequency in frequencies]))
    pattern = np.vstack(rows)
    pattern = np.maximum(pattern / np.max(pattern), 1e-4)
    return pattern_scene(pattern, illuminant=illuminant, wavelength_nm=wavelength_nm, hfov_deg=hfov_deg, distance_m=distance_m)


def sweep_scene(
    size: int = 128,
    max_frequency: float = 8.0,
    *,
    illuminant: str = "equal photons",
    hfov_deg: float = _HFOV_DEG,
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    distance_m: float = DEFAULT_DISTANCE_M,
) -> IsetcamScene:
    """Return a grating whose frequency grows to the right as x^2 and whose contrast falls downwards to 1 / size.

    sin(2 pi f x^3) with x = 1/size .. 1, stretched so that the smallest level is 1/256 of the largest.
    """
    x = (np.arange(_checked_shape((size, size))[0]) + 1.0) / size
    wave = x[::-1, None] * np.sin(2 * np.pi * max_frequency * x**2 * x)[None, :] + 0.5
    low, high = np.min(wave), np.max(wave)
    pattern = (wave - low) / (high - low) * 255.0 + 1.0
    return pattern_scene(
        pattern / np.max(pattern), illuminant=illuminant, wavelength_nm=wavelength_nm, hfov_deg=hfov_deg, distance_m=distance_m
    )


def harmonic_scene(
    *,
    frequencies: Sequence[float] = (1.0,),
    contrasts: Sequence[float] = (1.0,),
    phases_rad: Sequence[float] = (np.pi / 2,),
    angles_rad: Sequence[float] = (0.0,),
    rows: int = 64,
    cols: int = 64,
    illuminant: str = "equal photons",
    hfov_deg: float = _HFOV_DEG,
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    distance_m: float = DEFAULT_DISTANCE_M,
) -> IsetcamScene:
    """Return the mean of gratings 1 + contrast cos(2 pi f (x cos a + y sin a) + phase), x and y from 0 to 1 exclusive.

    Raises
    ------
    ShapeError
        The four sequences differ in length.
    """
    if not len(frequencies) == len(contrasts) == len(phases_rad) == len(angles_rad) >= 1:
        raise ShapeError("frequencies, contrasts, phases_rad and angles_rad must have the same length, at least 1.")
    _checked_shape((rows, cols))
    y, x = np.arange(rows)[:, None] / rows, np.arange(cols)[None, :] / cols
    pattern = np.zeros((rows, cols))
    for frequency, contrast, phase, angle in zip(frequencies, contrasts, phases_rad, angles_rad, strict=True):
        pattern += 1.0 + contrast * np.cos(2 * np.pi * frequency * (np.cos(angle) * x + np.sin(angle) * y) + phase)
    pattern /= len(frequencies)
    return pattern_scene(
        0.5 * pattern / np.max(pattern),
        illuminant=illuminant,
        wavelength_nm=wavelength_nm,
        hfov_deg=hfov_deg,
        distance_m=distance_m,
    )


def zone_plate_scene(
    size: int = 256,
    *,
    illuminant: str = "equal photons",
    hfov_deg: float = 4.0,
    wavelength_nm: ArrayLike = DEFAULT_WAVELENGTH_NM,
    distance_m: float = DEFAULT_DISTANCE_M,
) -> IsetcamScene:
    """Return rings cos(pi r^2 / size) whose frequency reaches Nyquist at the middle of each side; levels within [1e-4, 1].

    The pattern is this project's: no reference numbers of ISETCam's zone plate are at hand, only its 4 degrees.
    """
    axis = np.arange(_checked_shape((size, size))[0]) - (size - 1) / 2
    squared = axis[:, None] ** 2 + axis[None, :] ** 2
    pattern = np.maximum(0.5 + 0.5 * np.cos(np.pi * squared / size), 1e-4)
    return pattern_scene(pattern, illuminant=illuminant, wavelength_nm=wavelength_nm, hfov_deg=hfov_deg, distance_m=distance_m)


def _bar(size: int, width: int, *, ground: float, illuminant: str, hfov_deg: float) -> IsetcamScene:
    _checked_shape((size, width))
    pattern = np.full((size, size), ground)
    first = int(round_half_away(size / 2)) - 1 - (width - 1) // 2
    pattern[:, max(first, 0) : first + width] = 1.0
    return pattern_scene(pattern, illuminant=illuminant, hfov_deg=hfov_deg)


def _lines(size: int, spacing: int) -> NDArray[np.intp]:
    _checked_shape((size, spacing))
    return np.arange(int(round_half_away(spacing / 2)) - 1, size, spacing)


def _checked_shape(shape: tuple[int, int]) -> tuple[int, int]:
    if min(shape) < 1:
        raise FieldError(f"the size is {shape}; must be at least 1 sample each way.", path="size", value=min(shape))
    return shape
