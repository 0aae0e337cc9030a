"""Errors of a picture against a reference: relative by band, and in units of the noise that the sensor itself adds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import LUMINOUS_EFFICACY_LM_PER_W
from fullwell.optics import OpticsOptions, OpticsTerm, compute_irradiance
from fullwell.radiometry import RadianceImage, WavelengthGrid, luminous_efficiency, photons_to_energy
from fullwell.scene.images import OpticalImage
from fullwell.schema.frame import CameraRig
from fullwell.sensor import channel_currents, dark_noise_e, exposure_time, reference_model

__all__ = [
    "SensorError",
    "SensorScale",
    "band_relative_mse",
    "luminance",
    "luminance_relative_mse",
    "mean_relative_mse",
    "noise_std_e",
    "sensor_electrons",
    "sensor_error",
    "sensor_scale",
]

TILE_PX = 8
"""Side of the tiles among which the worst is looked for."""

RELATIVE_FLOOR = 1e-2
"""Share of the band's mean that is added to the reference before dividing: black pixels have a relative error too."""


# Radiance ------------------------------------------------------------------------------------------------------------


def band_relative_mse(
    measured: NDArray[np.floating], reference: NDArray[np.floating], *, floor: float = RELATIVE_FLOOR
) -> NDArray[np.float64]:
    """Return the mean of squared relative errors of each band, (bands,).

    (measured - reference)^2 / (reference^2 + (floor * band mean)^2), averaged over the pixels of (rows, cols, bands).
    """
    truth = np.asarray(reference, dtype=np.float64)
    difference = np.asarray(measured, dtype=np.float64) - truth
    scale = truth**2 + (floor * truth.mean(axis=(0, 1))) ** 2
    return np.asarray(np.mean(np.divide(difference**2, scale, out=np.zeros_like(truth), where=scale > 0), axis=(0, 1)))


def mean_relative_mse(measured: NDArray[np.floating], reference: NDArray[np.floating]) -> float:
    """Return the mean over bands of `band_relative_mse`."""
    return float(band_relative_mse(measured, reference).mean())


def luminance(photons: NDArray[np.floating], grid: WavelengthGrid) -> NDArray[np.float64]:
    """Return the luminance (rows, cols) [cd m^-2] of photon radiance in bands (rows, cols, bands)."""
    per_band = photons_to_energy(luminous_efficiency().band_average(grid) * grid.step_nm, grid.centres_nm)
    return np.asarray(np.asarray(photons, dtype=np.float64) @ (LUMINOUS_EFFICACY_LM_PER_W * per_band))


def luminance_relative_mse(
    measured: NDArray[np.floating],
    reference: NDArray[np.floating],
    *,
    clip_percentile: float = 100.0,
    trimmed_fraction: float = 0.0,
) -> float:
    """Return the relative mean square error of a luminance image (rows, cols), in any unit, against its reference.

    Parameters
    ----------
    clip_percentile
        Pixels above this percentile of the reference (lamps seen directly) do not count.
    trimmed_fraction
        Share of the pixels, those with the largest errors, that is left out. A few fireflies otherwise decide the mean, and
        another seed has others.
    """
    truth, other = (np.asarray(image, dtype=np.float64) for image in (reference, measured))
    seen = truth <= np.percentile(truth, clip_percentile)
    truth, other = truth[seen], other[seen]
    errors = np.sort((other - truth) ** 2 / (truth**2 + (RELATIVE_FLOOR * truth.mean()) ** 2))
    return float(errors[: max(1, round(errors.size * (1 - trimmed_fraction)))].mean())


# Sensor --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SensorScale:
    """What turns light into electrons and noise: exposure time [s], dark noise [e-], saturation [e-]."""

    exposure_time_s: float
    dark_noise_e: float
    well_capacity_e: float


@dataclass(frozen=True, slots=True)
class SensorError:
    """Error in units of the sensor's noise: over all pixels and channels, in the worst tile, and the mean (bias)."""

    rms: float
    worst_tile: float
    mean: float
    worst_tile_row_col: tuple[int, int]


def sensor_scale(reference: RadianceImage, rig: CameraRig) -> SensorScale:
    """Return the scale of the rig's first sensor, with the exposure that it chooses for the reference."""
    model = rig.sensors[0].model
    seen = reference_model(model)
    time_s = exposure_time(_formed(reference, rig), model, rig.sensors[0].exposure)
    return SensorScale(time_s, dark_noise_e(seen), seen.well_capacity_e)


def sensor_electrons(radiance: RadianceImage, rig: CameraRig, scale: SensorScale) -> NDArray[np.float64]:
    """Return the mean photo-electrons of every channel at every pixel, (rows, cols, channels) [e-].

    As if each channel covered the whole sensor; the lens's transmittance, pupil and falloff are in, its blur is not: it would
    hide the noise of single pixels. One film sample is one pixel.
    """
    model = rig.sensors[0].model
    currents = channel_currents(_formed(radiance, rig), model.cfa).electrons
    area_m2 = model.pixel_pitch_m**2 * reference_model(model).fill_factor
    return np.moveaxis(currents, 0, -1) * (area_m2 * scale.exposure_time_s)


def _formed(radiance: RadianceImage, rig: CameraRig) -> OpticalImage:
    terms: tuple[OpticsTerm, ...] = ("relative_illumination",)
    return compute_irradiance(radiance, rig.camera.lens, OpticsOptions(), terms=terms)


def noise_std_e(reference_e: NDArray[np.floating], *, dark_noise_e: float) -> NDArray[np.float64]:
    """Return the standard deviation of shot and dark noise, sqrt(mean + dark^2) [e-], of any shape."""
    return np.asarray(np.sqrt(np.maximum(np.asarray(reference_e, dtype=np.float64), 0.0) + dark_noise_e**2))


def sensor_error(
    measured_e: NDArray[np.floating],
    reference_e: NDArray[np.floating],
    *,
    dark_noise_e: float,
    well_capacity_e: float = math.inf,
    tile_px: int = TILE_PX,
) -> SensorError:
    """Return the error of (rows, cols, channels) electrons in units of the noise that the sensor adds there.

    Both are limited to the full well first: what is saturated anyhow has no error. Tiles at the right and lower edges may be
    smaller.
    """
    truth = np.minimum(np.asarray(reference_e, dtype=np.float64), well_capacity_e)
    error = np.minimum(np.asarray(measured_e, dtype=np.float64), well_capacity_e) - truth
    error /= noise_std_e(truth, dark_noise_e=dark_noise_e)
    tiles = _tile_rms(error**2, tile_px)
    worst = np.unravel_index(int(tiles.argmax()), tiles.shape)
    return SensorError(
        rms=float(np.sqrt(np.mean(error**2))),
        worst_tile=float(tiles[worst]),
        mean=float(error.mean()),
        worst_tile_row_col=(int(worst[0]) * tile_px, int(worst[1]) * tile_px),
    )


def _tile_rms(squares: NDArray[np.float64], tile_px: int) -> NDArray[np.float64]:
    """Return the root of the mean over each tile's pixels and channels, (tile rows, tile cols)."""
    rows, cols, channels = squares.shape
    starts = np.arange(0, rows, tile_px), np.arange(0, cols, tile_px)
    sums = np.add.reduceat(np.add.reduceat(squares.sum(axis=2), starts[0], axis=0), starts[1], axis=1)
    heights, widths = np.diff([*starts[0], rows]), np.diff([*starts[1], cols])
    return np.asarray(np.sqrt(sums / (np.outer(heights, widths) * channels)))
