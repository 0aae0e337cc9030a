"""The image signal processor: the order of its steps, nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import ShapeError
from fullwell.isp.black_level import linear_signal
from fullwell.isp.calibration import ColourCalibration, calibrate
from fullwell.isp.demosaic import demosaic
from fullwell.isp.parameters import IspSettings
from fullwell.isp.tone import encode_tone
from fullwell.isp.white_balance import apply_gains, balance_mosaic
from fullwell.radiometry import Spectrum
from fullwell.scene.images import RawImage

__all__ = ["DisplayImage", "develop"]


@dataclass(frozen=True, slots=True, eq=False)
class DisplayImage:
    """A picture for a display.

    Attributes
    ----------
    rgb
        (rows, cols, 3) uint8, sRGB.
    channel_gain_ratio
        (channels,) white balance gains that were applied.
    colour_matrix
        (3, channels) from balanced channels to linear sRGB; None for a sensor with one channel or without visible light.
    calibration
        Where gains and matrix come from.
    """

    rgb: NDArray[np.uint8]
    channel_gain_ratio: NDArray[np.float64]
    colour_matrix: NDArray[np.float64] | None
    calibration: ColourCalibration

    def __post_init__(self) -> None:
        if self.rgb.ndim != 3 or self.rgb.shape[2] != 3:
            raise ShapeError(f"rgb has shape {self.rgb.shape}; must be (rows, cols, 3).")


def develop(raw: RawImage, settings: IspSettings, *, scene_light: Spectrum | None = None) -> DisplayImage:
    """Turn a raw image into an sRGB picture: black level, white balance, demosaic, colour matrix, tone curve.

    The sensor's saturation level becomes display white, unless the tone curve says otherwise. Balanced before demosaicing,
    because methods that compare channels take grey to be equal in all of them. A sensor with one channel gives a grey picture,
    and so does one that sees no visible light (the mean of its channels). No sharpening, denoising or lens shading correction.

    Parameters
    ----------
    scene_light
        Relative power of the scene's light, for settings that name no illuminant; see `fullwell.isp.scene_illuminant`.

    Raises
    ------
    FieldError
        The illuminant is invisible to the eye or to the sensor; the demosaicing method does not suit the pattern.
    """
    calibration = calibrate(raw, settings, scene_light=scene_light)
    names, gains, matrix = calibration.channel_names, calibration.channel_gain_ratio, calibration.colour_matrix
    balanced = balance_mosaic(linear_signal(raw), raw.pattern, names, gains)
    method = settings.demosaic if len(names) > 1 else "bilinear"
    values = apply_gains(demosaic(balanced, raw.pattern, names, method=method), np.ones(len(names)))
    linear = np.repeat(values.mean(axis=2, keepdims=True), 3, axis=2) if matrix is None else values @ matrix.T
    return DisplayImage(encode_tone(linear, settings.tone), gains, matrix, calibration)
