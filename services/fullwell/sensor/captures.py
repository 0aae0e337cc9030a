"""Pictures of one or several captures: frames, photodiodes and readouts, and what becomes of them."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.scene.images import CaptureRecord, OpticalImage, RawImage
from fullwell.sensor.adc import full_scale_dn
from fullwell.sensor.cfa import channel_index_map
from fullwell.sensor.combination import Capture, combine_captures
from fullwell.sensor.exposure import check_exposure_time, exposure_time_for_rate
from fullwell.sensor.exposures import (
    BracketExposure,
    BurstExposure,
    ChannelExposure,
    Combination,
    Exposure,
    FixedExposure,
)
from fullwell.sensor.fixed_pattern import FixedPattern, fixed_patterns
from fullwell.sensor.hot_pixels import dark_current_map, mean_dark_current
from fullwell.sensor.model import (
    READOUT_STREAMS,
    black_level_of,
    dark_noise_e,
    electrons_per_dn,
    expose_and_digitise,
    photo_electron_rate,
    read_out,
    white_level_dn,
)
from fullwell.sensor.parameters import SensorModel
from fullwell.sensor.photodiodes import Photodiode, Readout
from fullwell.sensor.quantum_efficiency import ChannelCurrents, channel_currents
from fullwell.sensor.rolling_shutter import readout_duration_s
from fullwell.sensor.substreams import split_generator

__all__ = ["capture", "expected_electrons", "expose", "exposure_time", "readout_model", "reference_model"]


def expected_electrons(
    light: OpticalImage | ChannelCurrents, sensor: SensorModel, exposure_time_s: float
) -> NDArray[np.float64]:
    """Return the mean photo-electrons of each pixel, (rows, cols) [e-]. No noise, no dark current, no saturation."""
    return photo_electron_rate(light, sensor) * check_exposure_time(exposure_time_s)


def exposure_time(light: OpticalImage | ChannelCurrents, sensor: SensorModel, exposure: Exposure) -> float:
    """Return the base exposure time [s]: the fixed one, or the automatic one from the noise-free image."""
    return exposure_time_for_rate(photo_electron_rate(light, sensor), reference_model(sensor), exposure)


def reference_model(sensor: SensorModel) -> SensorModel:
    """Return the sensor as its first photodiode at its lowest gain sees it: what exposure and combined images refer to."""
    if not sensor.photodiodes:
        return sensor
    first = sensor.photodiodes[0]
    lowest = min(first.readouts, key=lambda readout: readout.conversion_gain_v_per_e * readout.analog_gain_ratio)
    return readout_model(sensor, first, lowest)


def readout_model(sensor: SensorModel, photodiode: Photodiode, readout: Readout) -> SensorModel:
    """Return the sensor with one photodiode and one readout that stands for one of several."""
    dark_current = photodiode.dark_current_e_per_s
    return replace(
        sensor,
        fill_factor=photodiode.fill_factor,
        photodetector_offset_m=photodiode.offset_m or sensor.photodetector_offset_m,
        dark_current_e_per_s=sensor.dark_current_e_per_s if dark_current is None else dark_current,
        well_capacity_e=min(photodiode.well_capacity_e, readout.well_capacity_e),
        conversion_gain_v_per_e=readout.conversion_gain_v_per_e,
        read_noise_e=readout.read_noise_e,
        reset_noise_e=readout.reset_noise_e,
        analog_gain_ratio=sensor.analog_gain_ratio * readout.analog_gain_ratio,
        photodiodes=(),
    )


def capture(
    light: OpticalImage | ChannelCurrents,
    sensor: SensorModel,
    exposure_time_s: float,
    *,
    rng: np.random.Generator,
    fixed_pattern_rng: np.random.Generator,
    keep_mean_electrons: bool = False,
) -> RawImage:
    """Take one picture: expose, add every noise, clip, amplify, digitise and, where there are several readouts, combine.

    Parameters
    ----------
    light
        Irradiance, or `channel_currents` of it; must cover the sensor.
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
    return expose(
        light,
        sensor,
        FixedExposure(check_exposure_time(exposure_time_s)),
        rng=rng,
        fixed_pattern_rng=fixed_pattern_rng,
        keep_mean_electrons=keep_mean_electrons,
    )


def expose(
    light: OpticalImage | ChannelCurrents,
    sensor: SensorModel,
    exposure: Exposure,
    *,
    rng: np.random.Generator,
    fixed_pattern_rng: np.random.Generator,
    keep_mean_electrons: bool = False,
) -> RawImage:
    """Find the exposure time and take the picture, of as many captures as exposure and sensor ask for.

    The light is integrated over wavelength once; to share that between several calls, give `channel_currents` of it. Brackets
    and sensors with several photodiodes or readouts give one linear image of up to 24 bits, whose `captures` say what it was
    made of; the other arguments are those of `capture`.

    Raises
    ------
    FieldError
        As `photo_electron_rate`; channel ratios for a channel that the sensor has not, or on a sensor with several readouts;
        captures to combine that dark current alone fills.
    """
    currents = channel_currents(light, sensor.cfa) if isinstance(light, OpticalImage) else light
    rate = photo_electron_rate(currents, sensor)
    time_s = exposure_time_for_rate(rate, reference_model(sensor), exposure)
    job = _Job(currents, rate, sensor, rng, fixed_pattern_rng, keep_mean_electrons)
    match exposure:
        case BurstExposure():
            return _burst(job, time_s, exposure)
        case BracketExposure():
            longest_s = time_s * max(exposure.ratios)
            return _combined(job, tuple(time_s * ratio for ratio in exposure.ratios), longest_s, exposure.combination)
        case ChannelExposure():
            return _channels(job, time_s, exposure)
        case _:
            return _frame(job, time_s, rng)


@dataclass(frozen=True, slots=True, eq=False)
class _Job:
    """What the captures of one picture share."""

    currents: ChannelCurrents
    rate: NDArray[np.float64]
    sensor: SensorModel
    rng: np.random.Generator
    fixed_pattern_rng: np.random.Generator
    keep_mean_electrons: bool

    def mean_electrons(self, pattern: FixedPattern, time_s: float) -> NDArray[np.float32] | None:
        """Return the noise-free electrons of the reference capture, where they are asked for."""
        if not self.keep_mean_electrons:
            return None
        dark_current = dark_current_map(reference_model(self.sensor), pattern)
        return ((self.rate + dark_current) * time_s).astype(np.float32)


def _frame(job: _Job, time_s: float, rng: np.random.Generator) -> RawImage:
    # Every frame of a burst has the same fixed pattern, so each reads the stream from its start.
    fixed_pattern_rng = copy.deepcopy(job.fixed_pattern_rng)
    if job.sensor.photodiodes:
        job = replace(job, rng=rng, fixed_pattern_rng=fixed_pattern_rng)
        return _combined(job, (time_s,), time_s, job.sensor.combination)
    return read_out(
        job.rate,
        job.sensor,
        time_s,
        grid=job.currents.grid,
        rng=rng,
        fixed_pattern_rng=fixed_pattern_rng,
        keep_mean_electrons=job.keep_mean_electrons,
    )


def _burst(job: _Job, time_s: float, exposure: BurstExposure) -> RawImage:
    """Return the sum or mean of equal frames, each with noise of its own and the same fixed pattern."""
    count = exposure.count
    frames = [_frame(job, time_s, rng) for rng in split_generator(job.rng, count)]
    first = frames[0]
    total = np.asarray(np.sum([frame.dn for frame in frames], axis=0, dtype=np.float64))
    extra_bits = math.ceil(math.log2(count))
    # The mean is kept in steps so fine that it loses nothing: as many codes as the sum has.
    sums = exposure.combination == "sum"
    scale, times = (1.0, count) if sums else (2.0**extra_bits / count, 1)
    bits = first.adc_bits + extra_bits
    step_s = time_s + readout_duration_s(rows=job.sensor.rows, line_time_s=job.sensor.line_time_s)
    return replace(
        first,
        dn=_stored(total * scale, bits),
        black_level_dn=first.black_level_dn * count * scale,
        white_level_dn=first.white_level_dn * count * scale,
        exposure_time_s=time_s * times,
        adc_bits=bits,
        saturated_fraction=float(np.mean([frame.saturated_fraction for frame in frames])),
        mean_electrons=None if first.mean_electrons is None else first.mean_electrons * np.float32(times),
        electrons_per_dn=first.electrons_per_dn * times / (count * scale),
        captures=tuple(
            CaptureRecord("main", "main", k * step_s, time_s, 1.0, frame.electrons_per_dn, frame.saturated_fraction, 1.0)
            for k, frame in enumerate(frames)
        ),
    )


def _stored(dn: NDArray[np.float64], bits: int) -> NDArray[np.uint16] | NDArray[np.uint32]:
    rounded = np.rint(dn)
    return rounded.astype(np.uint16) if bits <= 16 else rounded.astype(np.uint32)


def _channel_times_s(job: _Job, time_s: float, exposure: ChannelExposure) -> dict[str, float]:
    """Return the exposure time of each channel that the pattern uses and the sensor has pixels of [s]."""
    sensor = job.sensor
    if sensor.photodiodes:
        raise FieldError(
            f"channel_ratios are given for {sensor.name}, which has several readouts; use a bracket or another sensor.",
            path="channel_ratios",
            value=sensor.name,
        )
    names = sensor.cfa.channel_names
    for name, _ in exposure.ratios:
        if name not in names:
            raise FieldError(unknown_name_message("channel", name, names), path="channel_ratios", value=name)
    index = channel_index_map(sensor.cfa, rows=sensor.rows, cols=sensor.cols)
    used = [int(k) for k in np.unique(index)]
    if not exposure.ratios:
        return {names[k]: exposure_time_for_rate(job.rate[index == k][None], sensor, exposure.base) for k in used}
    ratios = dict(exposure.ratios)
    return {names[k]: time_s * ratios.get(names[k], 1.0) for k in used}


def _channels(job: _Job, time_s: float, exposure: ChannelExposure) -> RawImage:
    """Return the picture with a time for each channel, its values multiplied up to the longest."""
    sensor = job.sensor
    times_s = _channel_times_s(job, time_s, exposure)
    longest_s = max(times_s.values())
    index = channel_index_map(sensor.cfa, rows=sensor.rows, cols=sensor.cols)
    time_map_s = np.array([times_s.get(name, longest_s) for name in sensor.cfa.channel_names])[index]
    (pattern,) = fixed_patterns(sensor, job.fixed_pattern_rng, 1)
    shot_rng, *readout_rngs = split_generator(job.rng, 1 + READOUT_STREAMS)
    (digitised,) = expose_and_digitise(
        job.rate,
        sensor,
        time_map_s,
        pattern=pattern,
        shot_rng=shot_rng,
        readouts=((sensor, tuple(readout_rngs)),),
    )
    black_dn = black_level_of(sensor)
    up = longest_s / time_map_s
    most_dn = black_dn + (full_scale_dn(sensor.adc_bits) - black_dn) * float(np.max(up))
    bits = min(_MOST_BITS, max(sensor.adc_bits, math.ceil(math.log2(most_dn + 1.0))))
    return RawImage(
        dn=_stored(np.clip((digitised.dn - black_dn) * up + black_dn, 0.0, 2.0**bits - 1.0), bits),
        pattern=sensor.cfa.pattern,
        channels=sensor.cfa.channels,
        grid=job.currents.grid,
        black_level_dn=black_dn,
        white_level_dn=white_level_dn(sensor),
        exposure_time_s=longest_s,
        sensor_name=sensor.name,
        adc_bits=bits,
        saturated_fraction=float(np.mean(digitised.saturated)),
        mean_electrons=job.mean_electrons(pattern, longest_s),
        line_time_s=sensor.line_time_s,
        electrons_per_dn=electrons_per_dn(sensor),
        channel_exposure_time_s=tuple(times_s.items()),
    )


_MOST_BITS = 32


def _combined(job: _Job, times_s: tuple[float, ...], reference_s: float, combination: Combination) -> RawImage:
    """Return one linear image of all frames, photodiodes and readouts; its electrons are the reference capture's."""
    sensor = job.sensor
    photodiodes = sensor.photodiodes or (_only_photodiode(sensor),)
    patterns = fixed_patterns(sensor, job.fixed_pattern_rng, len(photodiodes))
    rates = [job.rate]
    rates += [photo_electron_rate(job.currents, replace(sensor, photodiodes=(other,))) for other in photodiodes[1:]]
    reference_share = photodiodes[0].fill_factor * photodiodes[0].qe_ratio * reference_s
    captures: list[Capture] = []
    records: list[CaptureRecord] = []
    start_s = 0.0
    for time_s, frame_rng in zip(times_s, split_generator(job.rng, len(times_s)), strict=True):
        rngs = split_generator(frame_rng, len(photodiodes))
        for photodiode, rate, pattern, rng in zip(photodiodes, rates, patterns, rngs, strict=True):
            share = photodiode.fill_factor * photodiode.qe_ratio * time_s / reference_share
            timing = _Timing(start_s, time_s, share, group=len(captures))
            for capture_, record in _read_photodiode(sensor, photodiode, rate, timing=timing, pattern=pattern, rng=rng):
                captures.append(capture_)
                records.append(record)
        start_s += time_s + readout_duration_s(rows=sensor.rows, line_time_s=sensor.line_time_s)
    _check_room_for_light(captures, records)
    combined = combine_captures(tuple(captures), combination)
    return RawImage(
        dn=combined.dn,
        pattern=sensor.cfa.pattern,
        channels=sensor.cfa.channels,
        grid=job.currents.grid,
        black_level_dn=combined.black_level_dn,
        white_level_dn=combined.white_level_dn,
        exposure_time_s=reference_s,
        sensor_name=sensor.name,
        adc_bits=combined.bits,
        saturated_fraction=combined.saturated_fraction,
        mean_electrons=job.mean_electrons(patterns[0], reference_s),
        line_time_s=sensor.line_time_s,
        electrons_per_dn=combined.electrons_per_dn,
        captures=tuple(
            replace(record, used_fraction=used) for record, used in zip(records, combined.used_fractions, strict=True)
        ),
    )


def _check_room_for_light(captures: list[Capture], records: list[CaptureRecord]) -> None:
    """Refuse captures that dark current alone fills: nothing can be taken off them that leaves light."""
    for capture_, record in zip(captures, records, strict=True):
        if not capture_.largest_signal > 0:
            raise FieldError(
                f"dark current makes {capture_.dark_e:g} e- in {record.exposure_time_s:g} s, more than photodiode "
                f"{record.photodiode!r} with readout {record.readout!r} can hold, so that it sees no light. Lower "
                "dark_current_e_per_s, temperature_k or the exposure time.",
                path="dark_current_e_per_s",
                value=capture_.dark_e,
            )


def _only_photodiode(sensor: SensorModel) -> Photodiode:
    readout = Readout("main", sensor.conversion_gain_v_per_e, sensor.read_noise_e, sensor.reset_noise_e)
    return Photodiode("main", sensor.fill_factor, sensor.well_capacity_e, (readout,))


@dataclass(frozen=True, slots=True)
class _Timing:
    """When a photodiode's electrons were collected, and how many for one of the reference capture."""

    start_s: float
    time_s: float
    sensitivity_ratio: float
    group: int


def _read_photodiode(
    sensor: SensorModel,
    photodiode: Photodiode,
    rate: NDArray[np.float64],
    *,
    timing: _Timing,
    pattern: FixedPattern,
    rng: np.random.Generator,
) -> Iterator[tuple[Capture, CaptureRecord]]:
    """Collect a photodiode's electrons once and yield what each of its readouts makes of them."""
    shot_rng, *readout_rngs = split_generator(rng, 1 + len(photodiode.readouts))
    whole_well = readout_model(sensor, photodiode, replace(photodiode.readouts[0], well_capacity_e=math.inf))
    models = [readout_model(sensor, photodiode, readout) for readout in photodiode.readouts]
    streams = [split_generator(readout_rng, READOUT_STREAMS) for readout_rng in readout_rngs]
    readings = expose_and_digitise(
        rate,
        whole_well,
        timing.time_s,
        pattern=pattern,
        shot_rng=shot_rng,
        readouts=tuple(zip(models, streams, strict=True)),
    )
    for readout, model, digitised in zip(photodiode.readouts, models, readings, strict=True):
        step_e = electrons_per_dn(model)
        yield (
            Capture(
                group=timing.group,
                dn=digitised.dn,
                saturated=digitised.saturated,
                black_level_dn=black_level_of(model),
                white_level_dn=white_level_dn(model),
                electrons_per_dn=step_e,
                sensitivity_ratio=timing.sensitivity_ratio,
                dark_e=mean_dark_current(model) * timing.time_s,
                noise_e=dark_noise_e(model),
            ),
            CaptureRecord(
                photodiode=photodiode.name,
                readout=readout.name,
                start_s=timing.start_s,
                exposure_time_s=timing.time_s,
                sensitivity_ratio=timing.sensitivity_ratio,
                electrons_per_dn=step_e,
                saturated_fraction=float(np.mean(digitised.saturated)),
                used_fraction=0.0,
            ),
        )
