"""From irradiance to volts at the pixels, and what ISETCam does to the volts: noise, gain, clipping, digitising."""

from __future__ import annotations

import math
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.radiometry.isetcam import bin_width_nm, round_half_away
from fullwell.scene.isetcam import IsetcamOpticalImage
from fullwell.sensor.isetcam_parameters import IsetcamSensor

__all__ = ["NoiseFlag", "add_noise", "check_noise_flag", "digitise", "read_out_volts", "shot_electrons", "volts_per_second"]

NoiseFlag: TypeAlias = Literal[-2, -1, 0, 1, 2]
"""-2 shot noise alone and -1 nothing, neither with gain, clip or ADC; 0 no noise, 1 shot noise, 2 every noise, with them."""

_GAUSSIAN_FROM_E: Final = 25.0
"""From this mean on shot noise is a rounded Gaussian, below it is Poisson."""


def volts_per_second(optical: IsetcamOpticalImage, sensor: IsetcamSensor) -> NDArray[np.float64]:
    """Return the mean volts per second of each pixel, (rows, cols). No dark voltage, noise, gain or clip.

    Rectangle sums over wavelength, a Gaussian over the pixel and the value at its centre. Pixels beyond the outermost
    samples of the image get 0.
    """
    efficiency = np.stack(
        [
            np.interp(optical.wavelength_nm, sensor.wavelength_nm, curve, left=0.0, right=0.0)
            for curve in sensor.quantum_efficiency.T
        ],
        axis=1,
    )
    weights = efficiency * bin_width_nm(optical.wavelength_nm)
    pitch_m = optical.sample_pitch_m
    sigma = math.ceil(sensor.pixel_height_m / pitch_m) / 4
    down = _axis_weights(sensor.rows, sensor.pixel_height_m, optical.rows, pitch_m, sigma)
    across = _axis_weights(sensor.cols, sensor.pixel_width_m, optical.cols, pitch_m, sigma)
    period_rows, period_cols = len(sensor.pattern), len(sensor.pattern[0])
    channels = np.moveaxis(optical.photons @ weights, 2, 0)
    pixels = np.empty((sensor.rows, sensor.cols))
    for r, row in enumerate(sensor.pattern):
        for c, index in enumerate(row):
            # The axis that throws away most comes first.
            seen = down[r::period_rows] @ channels[index]
            pixels[r::period_rows, c::period_cols] = (across[c::period_cols] @ seen.T).T
    area_m2 = sensor.pixel_height_m * sensor.pixel_width_m * sensor.fill_factor
    pixels *= area_m2 * sensor.conversion_gain_v_per_e
    return pixels if sensor.vignetting is None else pixels * sensor.vignetting


def shot_electrons(mean_electrons: NDArray[np.float64], *, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return ISETCam's shot noise on mean electrons, same shape: Poisson below 25, else a rounded Gaussian.

    The Gaussian may go below 0.
    """
    noisy = round_half_away(mean_electrons + np.sqrt(mean_electrons) * rng.standard_normal(mean_electrons.shape))
    few = mean_electrons < _GAUSSIAN_FROM_E
    noisy[few] = rng.poisson(mean_electrons[few])
    return noisy


def add_noise(
    volts: NDArray[np.float64],
    sensor: IsetcamSensor,
    *,
    exposure_time_s: float,
    noise_flag: NoiseFlag,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return mean volts (rows, cols) with the noise of the flag: dark, shot, read, fixed pattern, columns, in this order."""
    everything = noise_flag == 2
    if everything:
        volts = volts + sensor.dark_voltage_v_per_s * exposure_time_s
    if noise_flag in (-2, 1, 2):
        gain = sensor.conversion_gain_v_per_e
        volts = shot_electrons(volts / gain, rng=rng) * gain
    if not everything:
        return volts
    volts = volts + sensor.read_noise_v * rng.standard_normal(volts.shape)
    # Fixed pattern noise acts on signal, shot and read noise alike, and is another one in each capture.
    volts = volts * (1.0 + sensor.prnu_fraction * rng.standard_normal(volts.shape))
    volts = volts + sensor.dsnu_v * rng.standard_normal(volts.shape)
    if sensor.column_offset_sd_v > 0 or sensor.column_gain_sd > 0:
        cols = volts.shape[1]
        volts = volts * (1.0 + sensor.column_gain_sd * rng.standard_normal(cols))
        volts = volts + sensor.column_offset_sd_v * rng.standard_normal(cols)
    return volts


def digitise(output_volts: NDArray[np.float64], sensor: IsetcamSensor) -> NDArray[np.float64] | None:
    """Return digital numbers 0 to 2^n inclusive, same shape, or None for an analog sensor."""
    if sensor.adc_bits is None:
        return None
    return round_half_away(output_volts / (sensor.voltage_swing_v / 2**sensor.adc_bits))


def read_out_volts(
    mean_volts: NDArray[np.float64],
    sensor: IsetcamSensor,
    *,
    exposure_time_s: float,
    noise_flag: NoiseFlag,
    rng: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Return output volts and digital numbers (None where there are none), each (rows, cols), of mean volts."""
    if sensor.log_response:
        mean_volts = np.log10(mean_volts + sensor.read_noise_v) - math.log10(sensor.read_noise_v)
    volts = add_noise(mean_volts, sensor, exposure_time_s=exposure_time_s, noise_flag=noise_flag, rng=rng)
    if noise_flag < 0:
        return volts, None
    output = np.clip((volts + sensor.analog_offset_v) / sensor.gain_divisor, 0.0, sensor.voltage_swing_v)
    numbers = digitise(output, sensor)
    if sensor.correlated_double_sampling and noise_flag == 2:
        # After clipping and digitising, and with a draw of its own: it adds noise and leaves the dark voltage.
        output = output - sensor.dsnu_v * rng.standard_normal(output.shape)
    return output, numbers


def check_noise_flag(noise_flag: int) -> None:
    """Raise FieldError unless the flag is -2 to 2."""
    if noise_flag not in get_args(NoiseFlag):
        raise FieldError(
            f"noise_flag is {noise_flag}; must be -2, -1, 0, 1 or 2. Set noise_flag.", path="noise_flag", value=noise_flag
        )


def _axis_weights(pixels: int, pixel_m: float, samples: int, pitch_m: float, sigma: float) -> scipy.sparse.csr_array:
    """Return (pixels, samples): convolution with the kernel, zeros outside, then linear interpolation at pixel centres."""
    taps = math.ceil(pixel_m / pitch_m)
    offset = np.arange(taps) - (taps - 1) / 2
    kernel = np.exp(-0.5 * (offset / sigma) ** 2)
    kernel /= np.sum(kernel)
    # The central part of the full convolution; it starts half a sample late where the kernel is even.
    first = math.ceil((taps - 1) / 2)
    diagonals = [np.full(samples, tap) for tap in kernel]
    wanted = [first - k for k in range(taps)]
    kept = [(d, o) for d, o in zip(diagonals, wanted, strict=True) if abs(o) < samples]
    blur = scipy.sparse.dia_array(
        scipy.sparse.diags([d[: samples - abs(o)] for d, o in kept], [o for _, o in kept], shape=(samples, samples))
    ).tocsr()
    return scipy.sparse.csr_array(_interpolation(pixels, pixel_m, samples, pitch_m) @ blur)


def _interpolation(pixels: int, pixel_m: float, samples: int, pitch_m: float) -> scipy.sparse.csr_array:
    """Return (pixels, samples) weights of linear interpolation at pixel centres; rows outside the samples are empty."""
    if samples < 2:
        raise FieldError(
            "an optical image of a single row or column cannot be interpolated (ISETCam stops with an error); use at least "
            "2 x 2 samples.",
            path="optical",
            value=samples,
        )
    centre_m = (np.arange(pixels) + 0.5 - pixels / 2) * pixel_m
    sample_m = (np.arange(samples) + 0.5 - samples / 2) * pitch_m
    inside = np.flatnonzero((centre_m >= sample_m[0]) & (centre_m <= sample_m[-1]))
    left = np.clip(np.searchsorted(sample_m, centre_m[inside], side="right") - 1, 0, samples - 2)
    share = (centre_m[inside] - sample_m[left]) / (sample_m[left + 1] - sample_m[left])
    rows = np.concatenate([inside, inside])
    cols = np.concatenate([left, left + 1])
    return scipy.sparse.csr_array((np.concatenate([1.0 - share, share]), (rows, cols)), shape=(pixels, samples))
