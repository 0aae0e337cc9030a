"""The sensor's own noise, expressed as light: how exact a rendering need be."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterator

import numpy as np
from numpy.typing import NDArray

from fullwell.optics import projected_solid_angle_sr, relative_illumination
from fullwell.schema.frame import CameraRig, SensorRig
from fullwell.sensor import SensorModel, dark_noise_e, reference_model
from fullwell.sensor.exposure import saturation_electrons
from fullwell.sensor.exposures import BracketExposure, BurstExposure, ChannelExposure

__all__ = ["SensorNoise", "electrons_per_light", "longest_capture"]

_CLIPPED = 1.2
"""Times the saturation signal: an error that does not bring the light below that leaves no trace."""

_CLIPPED_ERROR = 0.1
"""Largest relative error allowed there: it still may spread to neighbours by diffraction and crosstalk."""


def electrons_per_light(rig: CameraRig, sensor: SensorModel, exposure_time_s: float) -> NDArray[np.float64]:
    """Return the electrons a pixel at each film sample collects per channel light, (rows, cols) [e- per e- s^-1 m^-2 sr^-1]."""
    camera, model = rig.camera, reference_model(sensor)
    film, lens = camera.film, camera.lens
    falloff = relative_illumination(rows=film.rows, cols=film.cols, tangent_pitch=camera.tangent_pitch, lens=lens)
    qe_ratio = sensor.photodiodes[0].qe_ratio if sensor.photodiodes else 1.0
    area_m2 = sensor.pixel_pitch_m**2 * model.fill_factor * qe_ratio
    solid_angle_sr = projected_solid_angle_sr(lens.f_number, lens.magnification)
    return np.broadcast_to(falloff * (solid_angle_sr * area_m2 * exposure_time_s), (film.rows, film.cols))


class SensorNoise:
    """Noise variance of a camera's sensors as light: a `fullwell.render.NoiseTarget`.

    Shot noise, dark current's shot noise and the readout's noise, of the capture that collects most. Where a pixel is
    saturated anyway, its light may err by what is beyond 1.2 times saturation, and by a tenth at most. Fixed patterns are no
    noise: they do not hide an error.
    """

    def __init__(
        self,
        rig: CameraRig,
        sensors: tuple[tuple[SensorRig, tuple[tuple[int, ...], ...]], ...],
        exposure_time_s: Callable[[SensorRig, NDArray[np.float64]], float],
    ) -> None:
        """Prepare for sensors, each with the responses that its channels are the sums of.

        `exposure_time_s` finds a base time from the light of a sensor's channels.
        """
        self._rig = rig
        self._sensors = sensors
        self._find_time = exposure_time_s
        self.times_s: dict[int, float] = {}
        """Base exposure times by the sensor's place, found from the first light that was shown."""

    @property
    def key(self) -> Hashable:
        """What `channels` depends on."""
        return tuple(parts for _, parts in self._sensors)

    def channels(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (..., channels of all sensors, rows, cols) sums of responses, from (..., responses, rows, cols) of light."""
        sums = [light[..., list(part), :, :].sum(axis=-3) for _, parts in self._sensors for part in parts]
        return np.stack(sums, axis=-3)

    def __call__(self, channels: NDArray[np.float64], sure: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Return (channels, rows, cols) noise variances of film samples, as light; `sure` light tells what is saturated."""
        allowed = np.empty(channels.shape)
        for number, (sensor, span) in enumerate(self._spans()):
            light = channels[span]
            if number not in self.times_s:
                self.times_s[number] = self._find_time(sensor, light)
            allowed[span] = self._variance(sensor, self.times_s[number], light, light if sure is None else sure[span])
        return allowed

    def saturation(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (responses,) the light that saturates a pixel on the axis; inf where no sensor has the response."""
        self(self.channels(light))
        limits = np.full(len(light), np.inf)
        for number, (sensor, parts) in enumerate(self._sensors):
            on_axis = float(electrons_per_light(self._rig, sensor.model, self.times_s[number]).max())
            for index in itertools.chain(*parts):
                limits[index] = min(limits[index], saturation_electrons(reference_model(sensor.model)) / on_axis)
        return limits

    def _spans(self) -> Iterator[tuple[SensorRig, slice]]:
        start = 0
        for sensor, parts in self._sensors:
            yield sensor, slice(start, start + len(parts))
            start += len(parts)

    def _variance(
        self, sensor: SensorRig, base_time_s: float, light: NDArray[np.float64], sure: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        ratio, captures = longest_capture(sensor)
        time_s = base_time_s * ratio
        model = reference_model(sensor.model)
        factor = electrons_per_light(self._rig, sensor.model, time_s)
        mean_e = light * factor
        noise_e2 = mean_e + model.dark_current_e_per_s * time_s + dark_noise_e(model) ** 2
        samples_per_pixel = (sensor.model.pixel_pitch_m / self._rig.camera.film.pitch_m) ** 2
        variance = noise_e2 / factor**2 * (samples_per_pixel / captures)
        if ratio == 1.0 and captures == 1 and not sensor.model.photodiodes:
            # Continuous where saturation begins: what is full by a hair in one estimate is not in the next.
            beyond = np.maximum(sure - _CLIPPED * saturation_electrons(model) / factor, 0.0)
            variance = np.maximum(variance, np.minimum(beyond, _CLIPPED_ERROR * sure) ** 2)
        return np.asarray(variance)


def longest_capture(sensor: SensorRig) -> tuple[float, int]:
    """Return (time of the longest capture over the base time, captures that are averaged)."""
    match sensor.exposure:
        case BracketExposure(ratios=ratios):
            return max(ratios), 1
        case BurstExposure(count=count):
            return 1.0, count
        case ChannelExposure(ratios=ratios):
            return max([1.0, *(ratio for _, ratio in ratios)]), 1
        case _:
            return 1.0, 1
