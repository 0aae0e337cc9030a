"""The sensor stage: the order of its effects, nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.core.hashing import digest_of
from fullwell.radiometry import WavelengthGrid
from fullwell.scene.images import OpticalImage, RawImage
from fullwell.sensor.adc import black_level_dn, full_scale_dn, quantise, volts_to_dn
from fullwell.sensor.amplifier import amplify
from fullwell.sensor.cfa import mosaic
from fullwell.sensor.crosstalk import spread_electrons
from fullwell.sensor.dark_current import dark_electrons
from fullwell.sensor.double_sampling import correlated_difference
from fullwell.sensor.exposure import check_exposure_time, saturation_electrons
from fullwell.sensor.fixed_pattern import FixedPattern, dsnu_pattern_v, fixed_patterns, prnu_pattern
from fullwell.sensor.full_well import limit_to_well
from fullwell.sensor.hot_pixels import dark_current_map
from fullwell.sensor.microlens import pixel_illumination
from fullwell.sensor.parameters import SensorModel
from fullwell.sensor.quantum_efficiency import ChannelCurrents, channel_currents
from fullwell.sensor.read_noise import read_noise_v
from fullwell.sensor.reset_noise import reset_noise_v
from fullwell.sensor.row_column_noise import column_gain_pattern, line_offsets_v, row_noise_v
from fullwell.sensor.sampling import pixel_sampling
from fullwell.sensor.shot_noise import poisson_electrons
from fullwell.sensor.substreams import split_generator

__all__ = [
    "READOUT_STREAMS",
    "Digitised",
    "black_level_of",
    "collect_electrons",
    "dark_noise_e",
    "digitise",
    "electrons_per_dn",
    "expose_and_digitise",
    "photo_electron_rate",
    "read_out",
    "white_level_dn",
]


def photo_electron_rate(light: OpticalImage | ChannelCurrents, sensor: SensorModel) -> NDArray[np.float64]:
    """Return the mean photo-electrons per second of each pixel, (rows, cols) [e- s^-1].

    Irradiance times quantum efficiency integrated over wavelength and over the pixel's photodetector, in the pixel's own
    channel, less what micro-lenses lose, after crosstalk. No responsivity differences, no dark current, no saturation. For a
    sensor with several photodiodes: of the first.

    Parameters
    ----------
    light
        Irradiance, or what `channel_currents` made of it for the same channels, to integrate over wavelength only once.

    Raises
    ------
    FieldError
        NaN, Inf or negative irradiance; the sensor reaches beyond the optical image; currents of other channels.
    """
    currents = _currents(light, sensor)
    fill_factor, offset_m, qe_ratio = sensor.fill_factor, sensor.photodetector_offset_m, 1.0
    if sensor.photodiodes:
        first = sensor.photodiodes[0]
        fill_factor, offset_m, qe_ratio = first.fill_factor, first.offset_m or offset_m, first.qe_ratio
    sampling = pixel_sampling(
        currents,
        rows=sensor.rows,
        cols=sensor.cols,
        pixel_pitch_m=sensor.pixel_pitch_m,
        fill_factor=fill_factor,
        offset_m=offset_m,
    )
    photodetector_area_m2 = sensor.pixel_pitch_m**2 * fill_factor
    rate = mosaic(currents.electrons, sensor.cfa, sampling)
    rate *= photodetector_area_m2 * qe_ratio
    if sensor.microlens is not None:
        rate *= pixel_illumination(sensor.microlens, rows=sensor.rows, cols=sensor.cols, pixel_pitch_m=sensor.pixel_pitch_m)
    if sensor.crosstalk_kernel is not None:
        rate = spread_electrons(rate, sensor.crosstalk_kernel)
    return rate


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
    """Turn photo-electron rates (rows, cols) [e- s^-1] into digital numbers of one capture.

    One photodiode and one readout: those of the sensor's own fields. `grid` is that of the light, passed on to the image
    processor; the other arguments are those of `capture`.
    """
    (pattern,) = fixed_patterns(sensor, fixed_pattern_rng, 1)
    shot_rng, *readout_rngs = split_generator(rng, 1 + READOUT_STREAMS)
    check_exposure_time(exposure_time_s)
    (digitised,) = expose_and_digitise(
        electron_rate,
        sensor,
        exposure_time_s,
        pattern=pattern,
        shot_rng=shot_rng,
        readouts=((sensor, tuple(readout_rngs)),),
    )
    mean_electrons = None
    if keep_mean_electrons:
        dark_e = dark_electrons(dark_current_e_per_s=dark_current_map(sensor, pattern), exposure_time_s=exposure_time_s)
        mean_electrons = (electron_rate * exposure_time_s + dark_e).astype(np.float32)
    return RawImage(
        dn=digitised.dn,
        pattern=sensor.cfa.pattern,
        channels=sensor.cfa.channels,
        grid=grid,
        black_level_dn=black_level_of(sensor),
        white_level_dn=white_level_dn(sensor),
        exposure_time_s=exposure_time_s,
        sensor_name=sensor.name,
        adc_bits=sensor.adc_bits,
        saturated_fraction=float(np.mean(digitised.saturated)),
        mean_electrons=mean_electrons,
        line_time_s=sensor.line_time_s,
        electrons_per_dn=electrons_per_dn(sensor),
    )


def expose_and_digitise(
    electron_rate: NDArray[np.float64],
    sensor: SensorModel,
    exposure_time_s: float | NDArray[np.float64],
    *,
    pattern: FixedPattern,
    shot_rng: np.random.Generator,
    readouts: tuple[tuple[SensorModel, tuple[np.random.Generator, ...]], ...],
) -> tuple[Digitised, ...]:
    """Collect electrons once and read them out by each of `readouts`: a model and its READOUT_STREAMS streams.

    Row by row in blocks that stay in the processor's cache; the streams run on from block to block, so the size of the blocks
    changes no number.
    """
    rows, cols = electron_rate.shape
    results = tuple(Digitised(np.empty((rows, cols), np.uint16), np.empty((rows, cols), np.bool_)) for _ in readouts)
    block = max(1, _PIXELS_AT_A_TIME // cols)
    for first in range(0, rows, block):
        part = slice(first, min(first + block, rows))
        of_rows = pattern.of_rows(first, part.stop - first)
        time_s = exposure_time_s[part] if isinstance(exposure_time_s, np.ndarray) else exposure_time_s
        electrons = collect_electrons(electron_rate[part], sensor, time_s, pattern=of_rows, rng=shot_rng)
        for (model, rngs), result in zip(readouts, results, strict=True):
            digitised = digitise(electrons, model, pattern=of_rows, rngs=rngs)
            result.dn[part] = digitised.dn
            result.saturated[part] = digitised.saturated
    return results


_PIXELS_AT_A_TIME = 1 << 16


def collect_electrons(
    electron_rate: NDArray[np.float64],
    sensor: SensorModel,
    exposure_time_s: float | NDArray[np.float64],
    *,
    pattern: FixedPattern,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return the electrons in each pixel's well after the exposure, (rows, cols), whole numbers [e-].

    `exposure_time_s` is one for all or (rows, cols).
    """
    mean_e = electron_rate * exposure_time_s
    responsivity = prnu_pattern(pattern, prnu_fraction=sensor.prnu_fraction)
    if responsivity is not None:
        mean_e *= responsivity
    dark_current = dark_current_map(sensor, pattern)
    mean_e += dark_electrons(dark_current_e_per_s=dark_current, exposure_time_s=exposure_time_s)
    return limit_to_well(poisson_electrons(mean_e, rng=rng), well_capacity_e=sensor.well_capacity_e)


@dataclass(frozen=True, slots=True, eq=False)
class Digitised:
    """`dn` (rows, cols) uint16 [DN]; `saturated` (rows, cols): where the well is full or the ADC at its full scale."""

    dn: NDArray[np.uint16]
    saturated: NDArray[np.bool_]


READOUT_STREAMS = 5
"""Random streams of one readout: read noise, reset noise, row noise, and read and row noise of the reset sample."""


def digitise(
    electrons: NDArray[np.float64],
    sensor: SensorModel,
    *,
    pattern: FixedPattern,
    rngs: tuple[np.random.Generator, ...],
) -> Digitised:
    """Read out electrons (rows, cols) [e-]: convert, add offsets and noise, sample, amplify, digitise.

    `rngs` are READOUT_STREAMS streams. A well that is smaller than the electrons given limits them first.
    """
    read_rng, reset_rng, row_rng, second_read_rng, second_row_rng = rngs
    electrons = limit_to_well(electrons, well_capacity_e=sensor.well_capacity_e)
    pixel_v = electrons * sensor.conversion_gain_v_per_e
    column_gain = column_gain_pattern(pattern, column_gain_fraction=sensor.column_gain_fraction)
    if column_gain is not None:
        pixel_v *= column_gain
    offset_v = _reset_level_v(electrons.shape, sensor, pattern, reset_rng)
    pixel_v = _sample(pixel_v, offset_v, sensor, read_rng, row_rng)
    if sensor.readout_sampling == "correlated_double":
        reset_v = _sample(np.zeros(electrons.shape), offset_v, sensor, second_read_rng, second_row_rng)
        pixel_v = correlated_difference(pixel_v, reset_v)
    adc_v = amplify(pixel_v, analog_gain_ratio=sensor.analog_gain_ratio, analog_offset_v=sensor.analog_offset_v)
    saturated = (electrons >= sensor.well_capacity_e) | (adc_v >= sensor.voltage_swing_v)
    return Digitised(quantise(adc_v, voltage_swing_v=sensor.voltage_swing_v, adc_bits=sensor.adc_bits), saturated)


def _reset_level_v(
    shape: tuple[int, ...], sensor: SensorModel, pattern: FixedPattern, rng: np.random.Generator
) -> NDArray[np.float64] | NDArray[np.float32] | float:
    """Return what a pixel's samples have in common without light, broadcastable to `shape` [V]."""
    level: NDArray[np.float64] | NDArray[np.float32] | float = 0.0
    dsnu_v = dsnu_pattern_v(pattern, dsnu_v=sensor.dsnu_v)
    if dsnu_v is not None:
        level = dsnu_v
    lines_v = line_offsets_v(pattern, column_offset_v=sensor.column_offset_v, row_offset_v=sensor.row_offset_v)
    if lines_v is not None:
        level = level + lines_v
    if sensor.reset_noise_e > 0:
        level = level + reset_noise_v(
            rows=shape[0],
            cols=shape[1],
            reset_noise_e=sensor.reset_noise_e,
            conversion_gain_v_per_e=sensor.conversion_gain_v_per_e,
            rng=rng,
        )
    return level


def _sample(
    pixel_v: NDArray[np.float64],
    offset_v: NDArray[np.float64] | NDArray[np.float32] | float,
    sensor: SensorModel,
    read_rng: np.random.Generator,
    row_rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return one reading, (rows, cols) [V]; `pixel_v` is used up."""
    rows, cols = pixel_v.shape
    pixel_v += offset_v
    if sensor.read_noise_e > 0:
        pixel_v += read_noise_v(
            rows=rows,
            cols=cols,
            read_noise_e=sensor.read_noise_e,
            conversion_gain_v_per_e=sensor.conversion_gain_v_per_e,
            rng=read_rng,
        )
    if sensor.row_noise_v > 0:
        pixel_v += row_noise_v(rows=rows, row_noise_v=sensor.row_noise_v, rng=row_rng)
    return pixel_v


def black_level_of(sensor: SensorModel) -> float:
    """Return the mean digital number of a pixel without light, dark current and noise, not rounded [DN]."""
    return black_level_dn(
        analog_offset_v=sensor.analog_offset_v, voltage_swing_v=sensor.voltage_swing_v, adc_bits=sensor.adc_bits
    )


def white_level_dn(sensor: SensorModel) -> float:
    """Return the digital number of a pixel at its saturation signal, not rounded [DN]."""
    signal_v = saturation_electrons(sensor) * sensor.conversion_gain_v_per_e * sensor.analog_gain_ratio
    adc_v = signal_v + sensor.analog_offset_v
    return volts_to_dn(adc_v, voltage_swing_v=sensor.voltage_swing_v, adc_bits=sensor.adc_bits)


def electrons_per_dn(sensor: SensorModel) -> float:
    """Return the electrons at the pixel that make one digital number [e-/DN]."""
    step_v = sensor.voltage_swing_v / full_scale_dn(sensor.adc_bits)
    return step_v / (sensor.conversion_gain_v_per_e * sensor.analog_gain_ratio)


def dark_noise_e(sensor: SensorModel) -> float:
    """Return the standard deviation of one reading's noise without light and dark current, quantisation included [e-].

    Of one pixel over time: offsets that stay are not noise here.
    """
    row_noise_e = sensor.row_noise_v / sensor.conversion_gain_v_per_e
    variance = sensor.read_noise_e**2 + row_noise_e**2
    variance = 2.0 * variance if sensor.readout_sampling == "correlated_double" else variance + sensor.reset_noise_e**2
    return float(np.sqrt(variance + electrons_per_dn(sensor) ** 2 / 12.0))


def _currents(light: OpticalImage | ChannelCurrents, sensor: SensorModel) -> ChannelCurrents:
    if isinstance(light, OpticalImage):
        return channel_currents(light, sensor.cfa)
    if light.cfa is not sensor.cfa and digest_of(light.cfa.channels) != digest_of(sensor.cfa.channels):
        raise FieldError(
            f"the channel currents are of the channels {', '.join(light.cfa.channel_names)} of another colour filter array "
            f"than that of {sensor.name}; call channel_currents with the sensor's own cfa.",
            path="cfa",
            value=sensor.name,
        )
    return light
