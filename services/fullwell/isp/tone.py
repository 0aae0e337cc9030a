"""Tone: from linear sRGB to eight bits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fullwell.isp.parameters import ToneCurve
from fullwell.radiometry import linear_to_srgb

__all__ = ["apply_tone", "encode_srgb", "encode_tone"]


def encode_srgb(linear: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return sRGB-encoded values 0 to 255 of linear ones, same shape; values outside 0 to 1 are clipped.

    No tone curve beside the standard's own: 1, the saturation level of the sensor, is display white.

    References
    ----------
    iec61966, section 5.2.
    """
    return encode_tone(linear, ToneCurve())


def encode_tone(linear: NDArray[np.float64], tone: ToneCurve) -> NDArray[np.uint8]:
    """Return display codes 0 to 255 of linear values, same shape: exposure, black point, curve, rounding."""
    return np.asarray(np.rint(apply_tone(linear, tone) * 255.0).astype(np.uint8))


def apply_tone(linear: NDArray[np.float64], tone: ToneCurve) -> NDArray[np.float64]:
    """Return display values 0 to 1 of linear ones, same shape, each channel by itself.

    With x the linear value less the black point, scaled so that 1 stays 1, and times 2^exposure_ev, and s() the encoding of
    sRGB (iec61966, section 5.2):

    "srgb" s(x); "linear" x; "gamma" x^(1/gamma); "filmic" s(x (1 + x / w^2) / (1 + x)) for w = 2^exposure_ev > 1, which rolls
    highlights off so that the sensor's saturation level is just display white (reinhard2002, eq. 4; s(x) for w <= 1, where
    nothing has to be saved); "s_curve" the value whose logit is `contrast` times as far from that of `pivot` as that of s(x).
    All are clipped to 0 to 1; "filmic" clips after its curve.
    """
    white = 2.0**tone.exposure_ev
    exposed = np.maximum((linear - tone.black_point) / (1.0 - tone.black_point), 0.0) * white
    clipped: NDArray[np.float64] = np.minimum(exposed, 1.0)
    match tone.curve:
        case "srgb":
            return linear_to_srgb(clipped)
        case "linear":
            return clipped
        case "gamma":
            return np.asarray(clipped ** (1.0 / tone.gamma))
        case "filmic":
            if white <= 1.0:
                return linear_to_srgb(clipped)
            return linear_to_srgb(np.minimum(exposed * (1.0 + exposed / white**2) / (1.0 + exposed), 1.0))
        case "s_curve":
            return _s_curve(linear_to_srgb(clipped), contrast=tone.contrast, pivot=tone.pivot)


def _s_curve(encoded: NDArray[np.float64], *, contrast: float, pivot: float) -> NDArray[np.float64]:
    """Return y with y / (1 - y) = p / (1 - p) * (x / (1 - x) * (1 - p) / p)^contrast: fixed at 0, p and 1."""
    above = pivot * (encoded * (1.0 - pivot)) ** contrast
    below = (1.0 - pivot) * ((1.0 - encoded) * pivot) ** contrast
    return np.asarray(above / (above + below))
