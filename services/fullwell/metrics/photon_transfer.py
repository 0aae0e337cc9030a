"""Photon transfer: from flat and dark pictures in digital numbers to the sensor's parameters in electrons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, ShapeError

__all__ = ["ExposedStack", "PhotonTransfer", "TransferPoint", "photon_transfer"]

FIT_SHARE: Final = 0.7
"""Up to this share of saturation variance is proportional to the mean (emva1288: 0 to 70 %)."""

PRNU_RANGE: Final = (0.2, 0.7)
"""Share of saturation within which the spatial variance is mostly responsivity, and not yet clipped."""

SATURATED_BELOW: Final = 0.9
"""A level is saturated where its mean is below this share of the straight line through the lower levels."""

MIN_DARK_NOISE_DN: Final = 0.49
"""Below it the ADC's steps hide the noise and the variance of a step is no longer 1/12 (emva1288: 0.24 DN^2)."""

MAX_CLIPPED_SHARE: Final = 1e-3
"""More dark pixels than this at 0 DN cut the dark noise's distribution."""


@dataclass(frozen=True, slots=True, eq=False)
class ExposedStack:
    """Pictures of the same uniform light, or of darkness, with the same exposure time.

    Attributes
    ----------
    dn
        (frames, rows, cols) [DN], at least two frames; pixels of one channel only.
    exposure_time_s
        Exposure time [s], > 0.
    """

    dn: NDArray[np.generic]
    exposure_time_s: float

    def __post_init__(self) -> None:
        if self.dn.ndim != 3 or self.dn.shape[0] < 2 or self.dn.shape[1] * self.dn.shape[2] < 2:
            raise ShapeError(f"dn has shape {self.dn.shape}; must be (frames, rows, cols), at least 2 frames and 2 pixels.")
        if not 0 < self.exposure_time_s < math.inf:
            message = f"exposure_time_s is {self.exposure_time_s}; must be > 0 and finite."
            raise FieldError(message, path="exposure_time_s", value=self.exposure_time_s)
        if not np.all(np.isfinite(self.dn)):
            raise FieldError("dn holds NaN or Inf; every pixel must be finite.", path="dn")


@dataclass(frozen=True, slots=True)
class TransferPoint:
    """One stack: exposure time [s], mean [DN], temporal and spatial variance of single pixels [DN^2]."""

    exposure_time_s: float
    mean_dn: float
    temporal_variance_dn2: float
    spatial_variance_dn2: float


@dataclass(frozen=True, slots=True)
class PhotonTransfer:
    """Parameters of a sensor's channel.

    Attributes
    ----------
    conversion_gain_e_per_dn, conversion_gain_standard_error
        Electrons per digital number, and its statistical standard error from the fit.
    black_level_dn
        Mean dark level at zero exposure time [DN].
    read_noise_e
        Temporal noise of a dark pixel at zero exposure time, quantisation taken off [e-].
    dark_current_e_per_s
        Growth of the dark level with time [e-/s].
    full_well_e
        Level at which the mean stops growing, above black [e-]; None where no level saturates. It is the well, or what the
        ADC's full scale leaves of it.
    prnu_fraction, dsnu_e
        Spatial standard deviations of the responsivity (a fraction; None without a level in the middle of the range) and of the
        dark level [e-].
    flats, darks
        The points measured, by exposure time.
    notes
        What limits the figures.
    """

    conversion_gain_e_per_dn: float
    conversion_gain_standard_error: float
    black_level_dn: float
    read_noise_e: float
    dark_current_e_per_s: float
    full_well_e: float | None
    prnu_fraction: float | None
    dsnu_e: float
    flats: tuple[TransferPoint, ...]
    darks: tuple[TransferPoint, ...]
    notes: tuple[str, ...]


def photon_transfer(flats: Sequence[ExposedStack], darks: Sequence[ExposedStack]) -> PhotonTransfer:
    """Return a sensor's parameters from stacks of flat fields and of dark pictures.

    The light is constant and the exposure time varies. Temporal variance comes from differences between frames (with two
    frames, half the variance of their difference), so that fixed patterns and uneven light cancel and a common flicker of the
    light does too. Spatial variance is that of the mean frame, less the temporal noise left in it; it counts whatever shading
    the light has, so use pixels from the middle of an even field.

    Parameters
    ----------
    flats
        At least three levels up to 70 % of saturation; a level or more well beyond saturation gives the full well.
    darks
        At least one stack; two exposure times give the dark current (one gives 0, with a note).

    Raises
    ------
    FieldError
        Too few levels, stacks of different pixels, or a variance that does not grow with the mean.

    References
    ----------
    emva1288 (two-image method); janesick2007, chapter 5.
    """
    _check_stacks(flats, darks)
    notes: list[str] = []
    bright, dark = tuple(sorted(map(_point, flats), key=_time)), tuple(sorted(map(_point, darks), key=_time))
    black_dn, dark_rate_dn = _dark_line(dark, notes)
    signal = np.array([point.mean_dn - black_dn for point in bright])
    time_s = np.array([point.exposure_time_s for point in bright])
    saturated = _saturated(time_s, signal)
    ceiling_dn = float(np.max(signal[saturated])) if np.any(saturated) else float(np.max(signal))
    linear = [
        point
        for point, full in zip(bright, saturated, strict=True)
        if not full and point.mean_dn - black_dn <= FIT_SHARE * ceiling_dn
    ]
    _check_levels(linear, ceiling_dn)
    frames = min(stack.dn.shape[0] for stack in (*flats, *darks))
    freedom = (frames - 1) * flats[0].dn.shape[1] * flats[0].dn.shape[2]
    gain, error, dark_variance = _gain_and_dark_variance([*linear, *dark], black_dn, freedom)
    read_variance = dark_variance - 1.0 / 12.0
    _note_dark_limits(dark_variance, darks, notes)
    prnu = _prnu(bright, dark[0].spatial_variance_dn2, black_dn, dark_rate_dn, ceiling_dn)
    if prnu is None:
        notes.append(f"no flat level lies within {PRNU_RANGE[0]:.0%} to {PRNU_RANGE[1]:.0%} of saturation: PRNU not known")
    if not np.any(saturated):
        notes.append("no level saturates: the full well is not known; add exposures beyond it")
    return PhotonTransfer(
        conversion_gain_e_per_dn=1.0 / gain,
        conversion_gain_standard_error=error / gain**2,
        black_level_dn=black_dn,
        read_noise_e=math.sqrt(max(read_variance, 0.0)) / gain,
        dark_current_e_per_s=dark_rate_dn / gain,
        full_well_e=ceiling_dn / gain if np.any(saturated) else None,
        prnu_fraction=prnu,
        dsnu_e=math.sqrt(max(dark[0].spatial_variance_dn2, 0.0)) / gain,
        flats=bright,
        darks=dark,
        notes=tuple(notes),
    )


def _time(point: TransferPoint) -> float:
    return point.exposure_time_s


def _check_stacks(flats: Sequence[ExposedStack], darks: Sequence[ExposedStack]) -> None:
    if len(flats) < 3:
        raise FieldError(f"{len(flats)} flat levels; at least 3 are needed, better 10 or more.", path="flats", value=len(flats))
    if not darks:
        raise FieldError("no dark stack; at least 1 is needed, 2 exposure times for the dark current.", path="darks", value=0)
    shapes = {stack.dn.shape[1:] for stack in (*flats, *darks)}
    if len(shapes) != 1:
        raise FieldError(f"the stacks have pixels {sorted(shapes)}; all must show the same ones.", path="flats")


def _point(stack: ExposedStack) -> TransferPoint:
    dn = stack.dn.astype(np.float64)
    frames = dn.shape[0]
    levels = dn.mean(axis=(1, 2))
    # A change of all pixels together is the light's, not the pixels': EMVA takes the same term off.
    temporal = float(np.mean(np.var(dn - levels[:, None, None], axis=0, ddof=1)))
    spatial = float(np.var(dn.mean(axis=0), ddof=1)) - temporal / frames
    return TransferPoint(stack.exposure_time_s, float(levels.mean()), temporal, spatial)


def _dark_line(dark: tuple[TransferPoint, ...], notes: list[str]) -> tuple[float, float]:
    """Return the dark mean at zero time [DN] and its growth [DN/s]."""
    time_s = np.array([point.exposure_time_s for point in dark])
    mean = np.array([point.mean_dn for point in dark])
    if np.ptp(time_s) == 0:
        notes.append("one dark exposure time only: the dark current is not known and taken as 0")
        return float(mean.mean()), 0.0
    rate, black = np.polyfit(time_s, mean, 1)
    return float(black), float(rate)


def _saturated(time_s: NDArray[np.float64], signal: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which levels fell behind the line through those below half of the brightest."""
    low = signal <= 0.5 * np.max(signal)
    if np.count_nonzero(low) < 2:
        return np.zeros(signal.size, dtype=bool)
    slope = float(np.sum(time_s[low] * signal[low]) / np.sum(time_s[low] ** 2))
    return signal < SATURATED_BELOW * slope * time_s


def _check_levels(linear: list[TransferPoint], ceiling_dn: float) -> None:
    if len(linear) < 2:
        raise FieldError(
            f"{len(linear)} flat levels lie below {FIT_SHARE:.0%} of the brightest, {ceiling_dn:.4g} DN above black; at least "
            "2 are needed. Add shorter exposures.",
            path="flats",
            value=len(linear),
        )


def _gain_and_dark_variance(points: list[TransferPoint], black_dn: float, freedom: int) -> tuple[float, float, float]:
    """Return DN per electron with its standard error, and the temporal variance at zero signal [DN^2].

    A straight line through (mean, variance), each point weighted with the inverse variance of a sample variance,
    2 var^2 / `freedom`. Dark points lie on the same line: dark electrons have shot noise too.
    """
    mean = np.array([point.mean_dn - black_dn for point in points])
    variance = np.array([point.temporal_variance_dn2 for point in points])
    gain = error = intercept = math.nan
    expected = np.maximum(variance, 1.0 / 12.0)
    for _ in range(3):  # weights from the fitted line: those of the noisy points themselves would favour low ones
        design = np.stack([mean, np.ones_like(mean)], axis=1) / expected[:, None]
        covariance = np.linalg.inv(design.T @ design)
        gain, intercept = covariance @ design.T @ (variance / expected)
        error = math.sqrt(covariance[0, 0] * 2.0 / freedom)
        expected = np.maximum(intercept + gain * mean, 1.0 / 12.0)
    if not gain > 0:
        raise FieldError(
            f"the temporal variance does not grow with the mean (slope {gain:.3g} DN): the pictures hold no shot noise. Give "
            "raw digital numbers, not processed pictures.",
            path="flats",
            value=float(gain),
        )
    return float(gain), error, float(intercept)


def _prnu(
    bright: tuple[TransferPoint, ...], dark_spatial_dn2: float, black_dn: float, dark_rate_dn: float, ceiling_dn: float
) -> float | None:
    """Return the responsivity's relative standard deviation from the levels in the middle of the range."""
    low, high = PRNU_RANGE
    squares, weights = [], []
    for point in bright:
        signal = point.mean_dn - black_dn - dark_rate_dn * point.exposure_time_s
        if low * ceiling_dn <= signal <= high * ceiling_dn:
            squares.append((point.spatial_variance_dn2 - dark_spatial_dn2) / signal**2)
            # A sample variance is as uncertain as it is large; the temporal noise left in the mean frame counts.
            weights.append((signal**2 / (point.spatial_variance_dn2 + point.temporal_variance_dn2)) ** 2)
    if not squares:
        return None
    return math.sqrt(max(float(np.average(squares, weights=weights)), 0.0))


def _note_dark_limits(dark_variance: float, darks: Sequence[ExposedStack], notes: list[str]) -> None:
    if dark_variance < MIN_DARK_NOISE_DN**2:
        notes.append(
            f"the dark noise is {math.sqrt(max(dark_variance, 0.0)):.2g} DN, below {MIN_DARK_NOISE_DN:g}: the ADC's steps hide "
            "read noise and DSNU; raise the analog gain"
        )
    clipped = max(float(np.mean(stack.dn == 0)) for stack in darks)
    if clipped > MAX_CLIPPED_SHARE:
        notes.append(f"{clipped:.1%} of the dark pixels are 0 DN: read noise and DSNU are cut; raise the analog offset")
