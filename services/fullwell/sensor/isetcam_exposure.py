"""ISETCam's automatic exposure and its ways of combining several exposures."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.isetcam import round_half_away
from fullwell.scene.isetcam import IsetcamOpticalImage
from fullwell.sensor.isetcam_parameters import IsetcamSensor
from fullwell.sensor.isetcam_pixels import NoiseFlag, add_noise, check_noise_flag, volts_per_second

__all__ = [
    "AutoMethod",
    "Rectangle",
    "auto_exposure_time_s",
    "cfa_auto_exposure_times_s",
    "combine_bracketed",
    "combine_burst",
    "combine_cfa",
]

AutoMethod: TypeAlias = Literal["luminance", "full", "mean", "specular", "weighted", "video"]

Rectangle: TypeAlias = tuple[int, int, int, int]
"""First column and row, counted from 1, width and height; it holds height + 1 rows and width + 1 columns."""

_LEVEL: Final = 0.95
_LONGEST_VIDEO_S: Final = 1 / 60
_BLOCKS: Final = 8
_BRACKET_LIMIT: Final = 0.95
_CFA_LIMIT: Final = 0.99


def auto_exposure_time_s(
    optical: IsetcamOpticalImage,
    sensor: IsetcamSensor,
    *,
    method: AutoMethod = "luminance",
    level: float = _LEVEL,
    rectangle: Rectangle | None = None,
    noise_flag: NoiseFlag = 0,
    rng: np.random.Generator | None = None,
) -> float:
    """Return ISETCam's automatic exposure time [s], from a capture of 1 s that is not clipped.

    Parameters
    ----------
    method
        "luminance": the brightest spot as a uniform field; "full": the brightest pixel; "mean": the mean pixel, gain 1;
        "specular": the percentile 100 `level` reaches the swing; "weighted": "full" within `rectangle`; "video": that, at
        most 1/60 s. All but "specular" aim at `level` times the voltage swing.
    level
        In (0, 1].
    rectangle
        Of the optical image, for "weighted" and "video"; None for all of it.
    noise_flag, rng
        The capture's noise; `rng` is needed from flag 1 on. The dark voltage counts always.

    Raises
    ------
    FieldError
        The image is black (ISETCam gives +Inf) or the representative signal is not above 0; unknown method.
    """
    _check(optical, level, noise_flag, rng)
    if method not in get_args(AutoMethod):
        message = unknown_name_message("automatic exposure method", method, get_args(AutoMethod))
        raise FieldError(message, path="method", value=method)
    if method == "luminance":
        optical, sensor = _brightest_spot(optical, sensor)
    elif method in ("weighted", "video"):
        optical, sensor = _cropped(optical, sensor, rectangle)
    elif method == "mean":
        sensor = replace(sensor, gain_divisor=1.0)
    volts = _volts_of_one_second(optical, sensor, noise_flag, rng)
    if method == "mean":
        return _time(level * sensor.voltage_swing_v, float(np.mean(volts)))
    if method == "specular":
        return _time(sensor.voltage_swing_v, float(np.percentile(volts, 100 * level, method="hazen")))
    time_s = _time(level * sensor.voltage_swing_v, float(np.max(volts)))
    return min(time_s, _LONGEST_VIDEO_S) if method == "video" else time_s


def cfa_auto_exposure_times_s(
    optical: IsetcamOpticalImage,
    sensor: IsetcamSensor,
    *,
    level: float = _LEVEL,
    noise_flag: NoiseFlag = 0,
    rng: np.random.Generator | None = None,
) -> NDArray[np.float64]:
    """Return one exposure time per position of the pattern, in the pattern's shape [s]: its brightest pixel at the level."""
    _check(optical, level, noise_flag, rng)
    volts = _volts_of_one_second(optical, sensor, noise_flag, rng)
    rows, cols = len(sensor.pattern), len(sensor.pattern[0])
    target = level * sensor.voltage_swing_v
    return np.array([[_time(target, float(np.max(volts[r::rows, c::cols]))) for c in range(cols)] for r in range(rows)])


def combine_bracketed(
    volts: NDArray[np.float64], exposure_times_s: NDArray[np.float64], *, voltage_swing_v: float
) -> NDArray[np.float64]:
    """Return one image (rows, cols) of bracketed planes (rows, cols, planes): relative, its maximum 1.

    Values above 0.95 of the swing count as 0; the largest of the rest is divided by its plane's time. Raises FieldError
    where nothing is left, which ISETCam answers with NaN.
    """
    usable = np.where(volts > _BRACKET_LIMIT * voltage_swing_v, 0.0, volts)
    plane = np.argmax(usable, axis=2)
    rate = np.take_along_axis(usable, plane[:, :, None], axis=2)[:, :, 0] / np.asarray(exposure_times_s)[plane]
    largest = float(np.max(rate))
    if not largest > 0:
        raise FieldError(
            "every pixel is black or saturated in every plane (ISETCam gives NaN); choose other exposure times.",
            path="exposure_times_s",
        )
    return np.asarray(rate / largest)


def combine_cfa(
    volts: NDArray[np.float64], exposure_times_s: NDArray[np.float64], *, voltage_swing_v: float
) -> NDArray[np.float64]:
    """Return volts per second (rows, cols) of per-position planes (rows, cols, planes), saturated pixels at swing / min(t).

    `exposure_times_s` has the pattern's shape; the planes run down its columns.
    """
    times = np.asarray(exposure_times_s, dtype=np.float64)
    rows, cols = times.shape
    merged = np.empty(volts.shape[:2])
    for c in range(cols):
        for r in range(rows):
            own = volts[r::rows, c::cols, c * rows + r]
            ceiling = voltage_swing_v / float(np.min(times))
            merged[r::rows, c::cols] = np.where(own > _CFA_LIMIT * voltage_swing_v, ceiling, own / times[r, c])
    return merged


def combine_burst(volts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sum of the planes of a burst, (rows, cols) [V]."""
    return np.asarray(np.sum(volts, axis=2))


def _check(optical: IsetcamOpticalImage, level: float, noise_flag: int, rng: np.random.Generator | None) -> None:
    check_noise_flag(noise_flag)
    if not 0 < level <= 1:
        raise FieldError(f"level is {level}; must be > 0 and at most 1. Set level.", path="level", value=level)
    if noise_flag not in (-1, 0) and rng is None:
        raise FieldError("rng is needed where the noise flag asks for noise.", path="rng")
    if not np.max(optical.photons) > 0:
        raise FieldError(
            "the optical image is black, so no exposure time is long enough (ISETCam gives +Inf). Set an exposure time.",
            path="exposure_time_s",
        )


def _time(target_v: float, volts_per_s: float) -> float:
    if not 0 < volts_per_s < math.inf:
        raise FieldError(
            f"the signal that sets the exposure is {volts_per_s} V/s; must be > 0. Set an exposure time.",
            path="exposure_time_s",
            value=volts_per_s,
        )
    return target_v / volts_per_s


def _volts_of_one_second(
    optical: IsetcamOpticalImage, sensor: IsetcamSensor, noise_flag: NoiseFlag, rng: np.random.Generator | None
) -> NDArray[np.float64]:
    volts = volts_per_second(optical, sensor)
    if noise_flag != 2:
        volts = volts + sensor.dark_voltage_v_per_s
    if rng is not None:
        volts = add_noise(volts, sensor, exposure_time_s=1.0, noise_flag=noise_flag, rng=rng)
    return np.asarray((volts + sensor.analog_offset_v) / sensor.gain_divisor)


def _brightest_spot(optical: IsetcamOpticalImage, sensor: IsetcamSensor) -> tuple[IsetcamOpticalImage, IsetcamSensor]:
    """Return the 2 x 2 samples at the largest illuminance spread over twice the angle of a sensor of 8 x 8 blocks.

    The sensor then reaches from the centres of the first samples nearly to those of the second.
    """
    if optical.rows < 2 or optical.cols < 2:
        raise FieldError("the optical image must have at least 2 x 2 samples.", path="optical", value=optical.rows)
    illuminance = optical.illuminance_lux
    # Column by column, as ISETCam searches: the first of equal values is theirs.
    col, row = divmod(int(np.argmax(illuminance.T)), optical.rows)
    row, col = min(row, optical.rows - 2), min(col, optical.cols - 2)
    small = replace(sensor, rows=_BLOCKS * len(sensor.pattern), cols=_BLOCKS * len(sensor.pattern[0]), vignetting=None)
    half = small.cols * small.pixel_width_m / 2 / optical.image_distance_m
    pitch_m = small.cols * small.pixel_width_m / (1.0 - half**2)
    return replace(optical, photons=optical.photons[row : row + 2, col : col + 2], sample_pitch_m=pitch_m), small


def _cropped(
    optical: IsetcamOpticalImage, sensor: IsetcamSensor, rectangle: Rectangle | None
) -> tuple[IsetcamOpticalImage, IsetcamSensor]:
    """Return the rectangle of the image and a sensor of its width and the old sensor's shape.

    ISETCam finds the field of view of the crop with the focal length and its width with the image distance: the spacing of
    the samples grows by their ratio, 1 + |m|.
    """
    if rectangle is None:
        return optical, sensor
    first_col, first_row, width, height = rectangle
    if not min(rectangle) >= 1 or (first_row + height > optical.rows or first_col + width > optical.cols):
        raise FieldError(
            f"rectangle is {rectangle}; must be first column, first row, width, height, all >= 1, within the "
            f"{optical.rows} x {optical.cols} samples of the optical image.",
            path="rectangle",
            value=rectangle,
        )
    photons = optical.photons[first_row - 1 : first_row + height, first_col - 1 : first_col + width]
    stretch = optical.image_distance_m / (optical.focal_length_m or optical.image_distance_m)
    crop = replace(optical, photons=photons, sample_pitch_m=optical.sample_pitch_m * stretch)
    return crop, _resized(sensor, crop.width_m)


def _resized(sensor: IsetcamSensor, width_m: float) -> IsetcamSensor:
    ratio = width_m / (sensor.cols * sensor.pixel_width_m)
    period_rows, period_cols = len(sensor.pattern), len(sensor.pattern[0])
    rows = math.ceil(float(round_half_away(sensor.rows * ratio)) / period_rows) * period_rows
    cols = math.ceil(float(round_half_away(sensor.cols * ratio)) / period_cols) * period_cols
    return replace(sensor, rows=max(rows, period_rows), cols=max(cols, period_cols), vignetting=None)
