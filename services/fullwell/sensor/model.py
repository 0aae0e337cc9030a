"""The sensor stage: the order of its effects, nothing else."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.radiometry import WavelengthGrid
from fullwell.scene.images import OpticalImage, RawImage
from fullwell.sensor.adc import black_level_dn, quantise, volts_to_dn
from fullwell.sensor.amplifier import amplify
from fullwell.sensor.cfa import mosaic
from fullwell.sensor.dark_current import dark_electrons
from fullwell.sensor.exposure import exposure_time_for_rate, saturation_electrons
from fullwell.sensor.fixed_pattern import dsnu_pattern_v, prnu_pattern
from fullwell.sensor.full_well import limit_to_well
from fullwell.sensor.parameters import Exposure, SensorModel
from fullwell.sensor.quantum_efficiency import band_quantum_efficiency, integrate_bands
from fullwell.sensor.read_noise import read_noise_v
from fullwell.sensor.sampling import pixel_sampling
from fullwell.sensor.shot_noise import poisson_electrons
from fullwell.sensor.substreams import split_generator

__all__ = ["capture", "expected_electrons", "expose", "exposure_time", "photo_electron_rate", "read_out"]


def photo_electron_rate(optical: OpticalImage, sensor: SensorModel) -> NDArray[np.float64]:
    """Return the mean photo-electrons per second of each pixel, (rows, cols) [e- s^-1].

    Irradiance times quantum efficiency integrated over wavelength and over the pixel's photodetector, in the pixel's own
    channel. No responsivity differences, no dark current, no saturation.

    Raises
    ------
    FieldError
        NaN, Inf or negative irradiance; the sensor reaches beyond the optical image.
    """
    _check_irradiance(optical)
    sampling = pixel_sampling(
        optical, rows=sensor.rows, cols=sensor.cols, pixel_pitch_m=sensor.pixel_pitch_m, fill_factor=sensor.fill_factor
    )
    efficiency = band_quantum_efficiency(sensor.cfa, optical.grid)
    channel_images = integrate_bands(optical.photons, efficiency, bandwidth_nm=optical.grid.step_nm)
    photodetector_area_m2 = sensor.pixel_pitch_m**2 * sensor.fill_factor
    return mosaic(channel_images, sensor.cfa, sampling) * photodetector_area_m2


def expected_electrons(optical: OpticalImage, sensor: SensorModel, exposure_time_s: float) -> NDArray[np.float64]:
    """Return the mean photo-electrons of each pixel, (rows, cols) [e-]. No noise, no dark current, no saturation."""
    return photo_electron_rate(optical, sensor) * _checked_time(exposure_time_s)


def exposure_time(optical: OpticalImage, sensor: SensorModel, exposure: Exposure) -> float:
    """Return the exposure time [s]: the fixed one, or the automatic one from the noise-free image."""
    return exposure_time_for_rate(photo_electron_rate(optical, sensor), sensor, exposure)


def capture(
    optical: OpticalImage,
    sensor: SensorModel,
    exposure_time_s: float,
    *,
    rng: np.random.Generator,
    fixed_pattern_rng: np.random.Generator,
    keep_mean_electrons: bool = False,
) -> RawImage:
    """Take one picture: expose, add every noise, clip, amplify and digitise.

    Parameters
    ----------
    optical
        Irradiance; must cover the sensor.
    exposure_time_s
        > 0 [s].
    rng
        Noise of this frame.
    fixed_pattern_rng
        A fresh `fixed_pattern_stream(sensor)`: it is advanced, so a used one gives another pattern.
    keep_mean_electrons
        Whether the result carries the noise-free electrons too.

    Raises
    ------
    FieldError
        As `photo_electron_rate`, or an exposure time that is not > 0 and finite.
    """
    return read_out(
        photo_electron_rate(optical, sensor),
        sensor,
        exposure_time_s,
        grid=optical.grid,
        rng=rng,
        fixed_pattern_rng=fixed_pattern_rng,
        keep_mean_electrons=keep_mean_electrons,
    )


def expose(
    optical: OpticalImage,
    sensor: SensorModel,
    exposure: Exposure,
    *,
    rng: np.random.Generator,
    fixed_pattern_rng: np.random.Generator,
    keep_mean_electrons: bool = False,
) -> RawImage:
    """Find the exposure time and take the picture: `exposure_time` and `capture` with the light integrated only once."""
    rate = photo_electron_rate(optical, sensor)
    return read_out(
        rate,
        sensor,
        exposure_time_for_rate(rate, sensor, exposure),
        grid=optical.grid,
        rng=rng,
        fixed_pattern_rng=fixed_pattern_rng,
        keep_mean_electrons=keep_mean_electrons,
    )


def read_out(
    electron_rate: NDArray[np.float64],
    sensor: SensorModel,
    exposure_time_s: float,
    *,
    grid: WavelengthGrid,
    rng: np.random.Generator,
    fixed_pattern_rng: np.random.Generator,
    keep_mean_electrons: bool = False,
) -> RawImage:
    """Turn photo-electron rates (rows, cols) [e- s^-1] into digital numbers; the arguments are those of `capture`.

    `grid` is that of the light, passed on to the image processor.
    """
    shot_rng, read_rng = split_generator(rng, 2)
    prnu_rng, dsnu_rng = split_generator(fixed_pattern_rng, 2)
    rows, cols = electron_rate.shape
    photo_e = electron_rate * _checked_time(exposure_time_s)
    dark_e = dark_electrons(dark_current_e_per_s=sensor.dark_current_e_per_s, exposure_time_s=exposure_time_s)
    responsivity = prnu_pattern(rows=rows, cols=cols, prnu_fraction=sensor.prnu_fraction, rng=prnu_rng)

    electrons = poisson_electrons(photo_e * responsivity + dark_e, rng=shot_rng)
    electrons = limit_to_well(electrons, well_capacity_e=sensor.well_capacity_e)
    pixel_v = electrons * sensor.conversion_gain_v_per_e
    pixel_v += dsnu_pattern_v(rows=rows, cols=cols, dsnu_v=sensor.dsnu_v, rng=dsnu_rng)
    pixel_v += read_noise_v(
        rows=rows,
        cols=cols,
        read_noise_e=sensor.read_noise_e,
        conversion_gain_v_per_e=sensor.conversion_gain_v_per_e,
        rng=read_rng,
    )
    adc_v = amplify(pixel_v, analog_gain_ratio=sensor.analog_gain_ratio, analog_offset_v=sensor.analog_offset_v)
    dn = quantise(adc_v, voltage_swing_v=sensor.voltage_swing_v, adc_bits=sensor.adc_bits)

    saturated = (electrons >= sensor.well_capacity_e) | (adc_v >= sensor.voltage_swing_v)
    return RawImage(
        dn=dn,
        pattern=sensor.cfa.pattern,
        channels=sensor.cfa.channels,
        grid=grid,
        black_level_dn=black_level_dn(
            analog_offset_v=sensor.analog_offset_v, voltage_swing_v=sensor.voltage_swing_v, adc_bits=sensor.adc_bits
        ),
        white_level_dn=_white_level_dn(sensor),
        exposure_time_s=exposure_time_s,
        sensor_name=sensor.name,
        adc_bits=sensor.adc_bits,
        saturated_fraction=float(np.mean(saturated)),
        mean_electrons=(photo_e + dark_e).astype(np.float32) if keep_mean_electrons else None,
    )


def _white_level_dn(sensor: SensorModel) -> float:
    """Return the digital number of a pixel at its saturation signal, not rounded [DN]."""
    signal_v = saturation_electrons(sensor) * sensor.conversion_gain_v_per_e * sensor.analog_gain_ratio
    adc_v = signal_v + sensor.analog_offset_v
    return volts_to_dn(adc_v, voltage_swing_v=sensor.voltage_swing_v, adc_bits=sensor.adc_bits)


def _checked_time(exposure_time_s: float) -> float:
    if not 0 < exposure_time_s < math.inf:
        raise FieldError(
            f"exposure_time_s is {exposure_time_s}; must be > 0 and finite. Set exposure.time_s.",
            path="exposure_time_s",
            value=exposure_time_s,
        )
    return exposure_time_s


def _check_irradiance(optical: OpticalImage) -> None:
    # A NaN anywhere makes both extremes NaN, and every comparison with NaN is false.
    low, high = float(np.min(optical.photons)), float(np.max(optical.photons))
    if not (low >= 0 and high < math.inf):
        raise FieldError(
            f"irradiance ranges from {low} to {high}; must be finite and >= 0. Look for the fault in the optics stage.",
            path="irradiance",
            value=low,
        )
