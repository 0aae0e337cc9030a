"""The image signal processor: the order of its steps, nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import ShapeError
from fullwell.isp.black_level import linear_signal
from fullwell.isp.colour_matrix import adapted_srgb_targets, channel_responses, fit_colour_matrix
from fullwell.isp.demosaic import demosaic_bilinear
from fullwell.isp.parameters import IspSettings
from fullwell.isp.tone import encode_srgb
from fullwell.isp.white_balance import apply_gains, gains_for_gray_world, gains_for_white
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
        (3, channels) from balanced channels to linear sRGB; None for a sensor with one channel.
    """

    rgb: NDArray[np.uint8]
    channel_gain_ratio: NDArray[np.float64]
    colour_matrix: NDArray[np.float64] | None

    def __post_init__(self) -> None:
        if self.rgb.ndim != 3 or self.rgb.shape[2] != 3:
            raise ShapeError(f"rgb has shape {self.rgb.shape}; must be (rows, cols, 3).")


def develop(raw: RawImage, settings: IspSettings) -> DisplayImage:
    """Turn a raw image into an sRGB picture: black level, demosaic, white balance, colour matrix, sRGB encoding.

    The sensor's saturation level becomes display white. A sensor with one channel gives a grey picture. No sharpening,
    denoising, lens shading correction or tone mapping.

    Raises
    ------
    FieldError
        The illuminant is invisible to the eye or to a channel of the sensor.
    """
    used = {name for row in raw.pattern for name in row}
    names, efficiencies = zip(*((name, curve) for name, curve in raw.channels if name in used), strict=True)
    values = demosaic_bilinear(linear_signal(raw), raw.pattern, names)
    if len(names) == 1:
        grey = np.repeat(encode_srgb(values), 3, axis=2)
        return DisplayImage(rgb=grey, channel_gain_ratio=np.ones(1), colour_matrix=None)

    responses = channel_responses(efficiencies, settings.illuminant, raw.grid)
    targets = adapted_srgb_targets(settings.illuminant, adapt_white=settings.white_balance != "none")
    matrix = fit_colour_matrix(responses / responses[0], targets)
    gray_world = settings.white_balance == "gray_world"
    gains = gains_for_gray_world(values) if gray_world else gains_for_white(responses[0])
    linear = apply_gains(values, gains) @ matrix.T
    return DisplayImage(rgb=encode_srgb(linear), channel_gain_ratio=gains, colour_matrix=matrix)
