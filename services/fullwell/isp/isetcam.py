"""ISETCam's image processor, number for number: the compatibility mode. The physical one is `isp.model`.

What is wrong with it on purpose is listed in docs/validation/isetcam.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError, unknown_name_message
from fullwell.isp.isetcam_demosaic import BayerPattern, DemosaicMethod, demosaic
from fullwell.radiometry.isetcam import (
    DEFAULT_WAVELENGTH_NM,
    check_wavelengths,
    display_primaries,
    illuminant_photons,
    macbeth_reflectances,
    observer_xyz,
    photons_to_energy,
)
from fullwell.scene.images import RawImage

__all__ = [
    "DemosaicMethod",
    "IlluminantCorrection",
    "IsetcamPicture",
    "correction_gains",
    "demosaic",
    "mcc_matrix",
    "monochrome_picture",
    "process",
    "process_mosaic",
    "xyz_to_display",
]

IlluminantCorrection: TypeAlias = Literal["none", "gray_world", "white_world"]

_WHITE_SHARE: Final = 0.7


@dataclass(frozen=True, slots=True, eq=False)
class IsetcamPicture:
    """What ISETCam's image processor delivers; matrices are multiplied from the right: row vector x matrix.

    Attributes
    ----------
    rgb
        (rows, cols, 3) linear display RGB, 0 to 1.
    demosaicked
        (rows, cols, 3) sensor values.
    sensor_to_xyz, correction, xyz_to_display
        (3, 3). The first includes the scaling of the picture's maximum to 1. Identities where there is one channel.
    """

    rgb: NDArray[np.float64]
    demosaicked: NDArray[np.float64]
    sensor_to_xyz: NDArray[np.float64]
    correction: NDArray[np.float64]
    xyz_to_display: NDArray[np.float64]


def process(
    raw: RawImage,
    *,
    illuminant_correction: IlluminantCorrection = "none",
    demosaic_method: DemosaicMethod = "bilinear",
) -> IsetcamPicture:
    """Develop a raw image as ISETCam does: digital numbers are not freed of their black level, the maximum becomes 1.

    Channels R, G, B in a 2 x 2 Bayer order, or a single channel. Wavelengths are the band centres of the raw image's grid.

    Raises
    ------
    FieldError
        Other channels or patterns, a black image.
    """
    values = raw.dn.astype(np.float64)
    used = {name for row in raw.pattern for name in row}
    if len(used) == 1:
        return monochrome_picture(values / raw.white_level_dn)
    curves = dict(raw.channels)
    if used != {"R", "G", "B"}:
        raise FieldError(
            f"the sensor's channels are {sorted(used)}; model isetcam develops R, G, B or a single channel.", path="channels"
        )
    wave = raw.grid.centres_nm
    return process_mosaic(
        values,
        _bayer(tuple(tuple("RGB".index(name) for name in row) for row in raw.pattern)),
        wavelength_nm=wave,
        quantum_efficiency=np.stack([curves[name].at(wave) for name in "RGB"], axis=1),
        illuminant_correction=illuminant_correction,
        demosaic_method=demosaic_method,
    )


def process_mosaic(
    mosaic: ArrayLike,
    pattern: BayerPattern,
    *,
    wavelength_nm: ArrayLike,
    quantum_efficiency: NDArray[np.float64],
    illuminant_correction: IlluminantCorrection = "none",
    demosaic_method: DemosaicMethod = "bilinear",
    zero_level: float = 0.0,
    largest: float = 1.0,
) -> IsetcamPicture:
    """Develop a mosaic in volts or digital numbers.

    Parameters
    ----------
    mosaic, pattern
        (rows, cols) and its Bayer order of 0 red, 1 green, 2 blue.
    wavelength_nm, quantum_efficiency
        (n,) [nm] and (n, 3) of the sensor, on its own wavelengths: the colour matrix is fitted there.
    zero_level
        Response to a black field, subtracted first; ISETCam subtracts it from volts, not from digital numbers.
    largest
        Maximum of the result: for an analog sensor its largest output over the voltage swing, else 1.

    Raises
    ------
    FieldError
        A black picture (ISETCam gives NaN), unknown names.
    """
    sensor_rgb = demosaic(np.asarray(mosaic, dtype=np.float64) - zero_level, pattern, method=demosaic_method)
    matrix = mcc_matrix(wavelength_nm, quantum_efficiency)
    xyz = np.maximum(sensor_rgb @ matrix, 0.0)
    brightest = float(np.max(xyz))
    if not brightest > 0:
        raise FieldError("the picture is black, so it cannot be scaled (ISETCam gives NaN). Expose longer.", path="mosaic")
    xyz /= brightest
    gains = correction_gains(xyz, illuminant_correction)
    to_display = xyz_to_display()
    rgb = (xyz * gains) @ to_display
    rgb = np.clip(rgb / np.max(rgb) * largest, 0.0, 1.0)
    return IsetcamPicture(rgb, sensor_rgb, matrix / brightest, np.diag(gains), to_display)


def monochrome_picture(relative: NDArray[np.float64]) -> IsetcamPicture:
    """Return a picture of one channel: the values over the swing (rows, cols) in all three planes."""
    if relative.ndim != 2:
        raise ShapeError(f"relative has shape {relative.shape}; must be (rows, cols).")
    planes = np.repeat(relative[:, :, None], 3, axis=2)
    return IsetcamPicture(planes, planes, np.eye(3), np.eye(3), np.eye(3))


def mcc_matrix(wavelength_nm: ArrayLike, quantum_efficiency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3, 3) matrix "MCC optimized": sensor responses to the 24 Macbeth patches under D65 to XYZ, least squares.

    No white is kept; only ratios of its entries matter. Raises FieldError outside 390 to 710 nm or for fewer than 3 bands.
    """
    wave = check_wavelengths(wavelength_nm)
    if quantum_efficiency.shape != (wave.size, 3):
        raise ShapeError(f"quantum_efficiency has shape {quantum_efficiency.shape}; must be ({wave.size}, 3).")
    patches = macbeth_reflectances(wave) * illuminant_photons("D65", wave)
    responses = patches @ quantum_efficiency
    if np.linalg.matrix_rank(responses) < 3:
        raise FieldError(
            "the three channels are not independent on these wavelengths, so no colour matrix exists; use 3 or more bands.",
            path="wavelength_nm",
        )
    targets = photons_to_energy(patches, wave) @ observer_xyz(wave)
    return np.asarray(np.linalg.lstsq(responses, targets, rcond=None)[0])


def correction_gains(xyz: NDArray[np.float64], method: IlluminantCorrection) -> NDArray[np.float64]:
    """Return the gains (3,) of X, Y, Z that give a picture (rows, cols, 3) the ratios of D65, that of X being 1.

    "gray_world" compares the means of all pixels, "white_world" those of the pixels at or above 0.7 of the maximum of the
    channel that has the largest one.
    """
    if method not in get_args(IlluminantCorrection):
        message = unknown_name_message("illuminant correction", method, get_args(IlluminantCorrection))
        raise FieldError(message, path="illuminant_correction", value=method)
    if method == "none":
        return np.ones(3)
    pixels = xyz.reshape(-1, 3)
    if method == "white_world":
        brightest = pixels[:, int(np.argmax(np.max(pixels, axis=0)))]
        pixels = pixels[brightest >= _WHITE_SHARE * np.max(brightest)]
    mean = np.mean(pixels, axis=0)
    if not np.all(mean > 0):
        raise FieldError("a channel of the picture is black, so its light cannot be estimated.", path="illuminant_correction")
    wave = np.array(DEFAULT_WAVELENGTH_NM, dtype=np.float64)
    white = photons_to_energy(illuminant_photons("D65", wave), wave) @ observer_xyz(wave)
    return np.asarray(white / white[0] / (mean / mean[0]))


def xyz_to_display() -> NDArray[np.float64]:
    """Return the (3, 3) matrix from XYZ to the linear RGB of ISETCam's example LCD."""
    wave = np.array(DEFAULT_WAVELENGTH_NM, dtype=np.float64)
    return np.asarray(np.linalg.inv(display_primaries(wave).T @ observer_xyz(wave)))


def _bayer(pattern: tuple[tuple[int, ...], ...]) -> BayerPattern:
    if len(pattern) != 2 or len(pattern[0]) != 2:
        raise FieldError(f"pattern is {len(pattern)} x {len(pattern[0])}; model isetcam demosaics 2 x 2 only.", path="pattern")
    return ((pattern[0][0], pattern[0][1]), (pattern[1][0], pattern[1][1]))
