"""ISETCam's sensor, number for number: the compatibility mode. The physical model is in `sensor.model`.

What is wrong with it on purpose is listed in docs/validation/isetcam.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.scene.images import OpticalImage, RawImage
from fullwell.scene.isetcam import IsetcamOpticalImage, from_optical_image
from fullwell.sensor.isetcam_exposure import (
    AutoMethod,
    Rectangle,
    auto_exposure_time_s,
    cfa_auto_exposure_times_s,
    combine_bracketed,
    combine_burst,
    combine_cfa,
)
from fullwell.sensor.isetcam_parameters import (
    BAYER_ORDERS,
    IsetcamSensor,
    bayer_sensor,
    from_sensor_model,
    imx363_sensor,
    monochrome_sensor,
    mt9v024_sensor,
    sensor_a,
    sensor_b,
)
from fullwell.sensor.isetcam_pixels import (
    NoiseFlag,
    add_noise,
    check_noise_flag,
    digitise,
    read_out_volts,
    shot_electrons,
    volts_per_second,
)
from fullwell.sensor.parameters import AutoExposure, Exposure, FixedExposure, SensorModel

__all__ = [
    "BAYER_ORDERS",
    "AutoMethod",
    "ExposureMode",
    "IsetcamCapture",
    "IsetcamSensor",
    "NoiseFlag",
    "Rectangle",
    "add_noise",
    "auto_exposure_time_s",
    "bayer_sensor",
    "capture",
    "capture_volts",
    "cfa_auto_exposure_times_s",
    "combine_bracketed",
    "combine_burst",
    "combine_cfa",
    "digitise",
    "expose",
    "from_sensor_model",
    "imx363_sensor",
    "monochrome_sensor",
    "mt9v024_sensor",
    "read_out_volts",
    "sensor_a",
    "sensor_b",
    "shot_electrons",
    "volts_per_second",
]

ExposureMode: TypeAlias = Literal["single", "bracketed", "cfa", "burst"]

_LARGEST_DN = 65535
_MIDDLE_HALF = (0.25, 0.25, 0.5, 0.5)
_AUTO_METHODS: dict[str, AutoMethod] = {
    "full": "full",
    "mean": "mean",
    "luminance": "luminance",
    "percentile": "specular",
    "highlight": "specular",
    "area": "weighted",
    "centre_weighted": "weighted",
}


@dataclass(frozen=True, slots=True, eq=False)
class IsetcamCapture:
    """What ISETCam's sensor delivers.

    Attributes
    ----------
    volts
        (rows, cols), or (rows, cols, planes) for several exposures; output volts, after gain, offset and clip [V].
    digital_numbers
        Same shape, 0 to 2^n inclusive, or None for an analog sensor or a negative noise flag.
    exposure_times_s
        () of a single exposure, (planes,) of a bracket or burst, the pattern's shape of per-filter exposures.
    mode
        "single", "bracketed", "cfa" (planes down the columns of the pattern) or "burst".
    sensor
        As given.
    """

    volts: NDArray[np.float64]
    digital_numbers: NDArray[np.float64] | None
    exposure_times_s: NDArray[np.float64]
    mode: ExposureMode
    sensor: IsetcamSensor

    @property
    def electrons(self) -> NDArray[np.float64]:
        """Output volts / conversion gain, not rounded: photo-electrons only where gain is 1 and offset 0."""
        return self.volts / self.sensor.conversion_gain_v_per_e

    def combined(self) -> NDArray[np.float64]:
        """Return one image (rows, cols): volts of a single exposure; a bracket relative; per-filter exposures in V/s."""
        swing_v = self.sensor.voltage_swing_v
        if self.mode == "bracketed":
            return combine_bracketed(self.volts, self.exposure_times_s, voltage_swing_v=swing_v)
        if self.mode == "cfa":
            return combine_cfa(self.volts, self.exposure_times_s, voltage_swing_v=swing_v)
        return combine_burst(self.volts) if self.mode == "burst" else self.volts


def capture_volts(
    optical: IsetcamOpticalImage,
    sensor: IsetcamSensor,
    exposure_time_s: float | Sequence[float] | NDArray[np.float64],
    *,
    rng: np.random.Generator,
    noise_flag: NoiseFlag = 2,
    burst: bool = False,
) -> IsetcamCapture:
    """Return a capture in ISETCam's terms.

    Parameters
    ----------
    exposure_time_s
        A number: one exposure, and 0 means automatic by luminance, as in ISETCam. (n,): one plane each. The shape of the
        sensor's pattern, if that is not 1 x 1: one plane per position of the pattern.
    burst
        The planes are one burst, to be summed, and not a bracket.

    Raises
    ------
    FieldError, ShapeError
        A noise flag other than -2 to 2, times that are negative, NaN or of another shape.
    """
    check_noise_flag(noise_flag)
    times = np.asarray(exposure_time_s, dtype=np.float64)
    if times.ndim == 0 and times == 0:
        times = np.asarray(auto_exposure_time_s(optical, sensor, noise_flag=noise_flag, rng=rng))
    mode = _mode(times, sensor, burst=burst)
    if not (np.min(times) > 0 and np.max(times) < math.inf):
        raise FieldError(
            f"exposure_time_s is {times.tolist()}; must be > 0 and finite (a single 0 means automatic).",
            path="exposure_time_s",
            value=times.tolist(),
        )
    rate = volts_per_second(optical, sensor)
    planes = [
        read_out_volts(rate * time, sensor, exposure_time_s=float(time), noise_flag=noise_flag, rng=rng)
        for time in np.ravel(times, order="F")
    ]
    volts = [plane[0] for plane in planes]
    numbers = [plane[1] for plane in planes if plane[1] is not None]
    if mode == "single":
        return IsetcamCapture(volts[0], numbers[0] if numbers else None, times, mode, sensor)
    return IsetcamCapture(np.stack(volts, axis=2), np.stack(numbers, axis=2) if numbers else None, times, mode, sensor)


def capture(
    optical: OpticalImage,
    sensor: SensorModel,
    exposure_time_s: float,
    *,
    rng: np.random.Generator,
    noise_flag: NoiseFlag = 2,
) -> RawImage:
    """Take one picture with our description of a sensor, ISETCam's way.

    `from_sensor_model` says how the description maps. Digital numbers reach 2^n; with 16 bits the topmost one, 65536, is
    stored as 65535. Nothing is refused where the sensor is larger than the image: those pixels are dark.

    Raises
    ------
    FieldError
        A negative noise flag (there are no digital numbers then), an exposure time that is not > 0 and finite.
    """
    if not 0 < exposure_time_s < math.inf:
        raise FieldError(
            f"exposure_time_s is {exposure_time_s}; must be > 0 and finite. Set exposure.time_s.",
            path="exposure_time_s",
            value=exposure_time_s,
        )
    mapped = from_sensor_model(sensor)
    taken = capture_volts(from_optical_image(optical), mapped, exposure_time_s, rng=rng, noise_flag=noise_flag)
    if taken.digital_numbers is None:
        raise FieldError(
            f"noise_flag is {noise_flag}; must be 0, 1 or 2 for digital numbers.", path="noise_flag", value=noise_flag
        )
    full_scale = float(2**sensor.adc_bits)
    return RawImage(
        dn=np.minimum(taken.digital_numbers, _LARGEST_DN).astype(np.uint16),
        pattern=sensor.cfa.pattern,
        channels=sensor.cfa.channels,
        grid=optical.grid,
        black_level_dn=sensor.analog_offset_v / sensor.voltage_swing_v * full_scale,
        white_level_dn=full_scale,
        exposure_time_s=exposure_time_s,
        sensor_name=sensor.name,
        adc_bits=sensor.adc_bits,
        saturated_fraction=float(np.mean(taken.volts >= sensor.voltage_swing_v)),
    )


def expose(
    optical: OpticalImage,
    sensor: SensorModel,
    exposure: Exposure,
    *,
    rng: np.random.Generator,
    noise_flag: NoiseFlag = 2,
) -> RawImage:
    """Find the exposure time and take the picture.

    Automatic exposures become ISETCam's with the same level: "full", "mean" and "luminance" those of the same name (the
    latter for a lens focused at infinity), "percentile" and "highlight" its "specular", whose percentile is the level,
    "area" and "centre_weighted" its "weighted" within the area or the middle half. The limits of the time hold; a black
    image is refused.

    Raises
    ------
    FieldError
        A bracket, burst or per-channel exposure: `capture_volts` takes them, but ISETCam combines volts, not raw images.
    """
    if isinstance(exposure, FixedExposure):
        return capture(optical, sensor, exposure.time_s, rng=rng, noise_flag=noise_flag)
    if not isinstance(exposure, AutoExposure):
        raise FieldError(
            f"exposure is a {type(exposure).__name__}; model isetcam makes raw images of single exposures only. Use a fixed or "
            "automatic exposure, or sensor.isetcam.capture_volts.",
            path="exposure",
        )
    image = from_optical_image(optical)
    time_s = auto_exposure_time_s(
        image,
        from_sensor_model(sensor),
        method=_AUTO_METHODS[exposure.method],
        level=exposure.level,
        rectangle=_rectangle(image, exposure),
        noise_flag=noise_flag,
        rng=rng,
    )
    time_s = min(max(time_s, exposure.min_time_s), exposure.max_time_s)
    return capture(optical, sensor, time_s, rng=rng, noise_flag=noise_flag)


def _rectangle(optical: IsetcamOpticalImage, exposure: AutoExposure) -> Rectangle | None:
    if exposure.method not in ("area", "centre_weighted"):
        return None
    top, left, height, width = exposure.area if exposure.method == "area" else _MIDDLE_HALF
    first_row, first_col = int(top * optical.rows) + 1, int(left * optical.cols) + 1
    rows = max(1, min(round(height * optical.rows), optical.rows - first_row))
    cols = max(1, min(round(width * optical.cols), optical.cols - first_col))
    return (min(first_col, optical.cols - cols), min(first_row, optical.rows - rows), cols, rows)


def _mode(times: NDArray[np.float64], sensor: IsetcamSensor, *, burst: bool) -> ExposureMode:
    if times.ndim == 0:
        return "single"
    if times.size == 0:
        raise ShapeError("exposure_time_s is empty; give at least one time.")
    if burst and times.ndim == 1:
        return "burst"
    shape = (len(sensor.pattern), len(sensor.pattern[0]))
    if times.ndim == 2 and times.shape == shape:
        return "cfa"
    if times.ndim == 1 and not burst:
        return "bracketed"
    raise ShapeError(f"exposure_time_s has shape {times.shape}; must be (), (n,) or the pattern's {shape}.")
