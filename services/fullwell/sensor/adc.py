"""The analog-to-digital converter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["black_level_dn", "full_scale_dn", "quantise", "volts_to_dn"]


def full_scale_dn(adc_bits: int) -> int:
    """Return the largest digital number, 2^bits - 1."""
    return (1 << adc_bits) - 1


def volts_to_dn(adc_v: float, *, voltage_swing_v: float, adc_bits: int) -> float:
    """Return a voltage on the scale of digital numbers, clipped to it but not rounded [DN]."""
    return min(max(adc_v / voltage_swing_v, 0.0), 1.0) * full_scale_dn(adc_bits)


def black_level_dn(*, analog_offset_v: float, voltage_swing_v: float, adc_bits: int) -> float:
    """Return the mean digital number of a pixel without light, dark current and noise, not rounded [DN]."""
    return volts_to_dn(analog_offset_v, voltage_swing_v=voltage_swing_v, adc_bits=adc_bits)


def quantise(adc_v: NDArray[np.float64], *, voltage_swing_v: float, adc_bits: int) -> NDArray[np.uint16]:
    """Return digital numbers 0 to 2^bits - 1, same shape: clip to [0, swing], scale, round to the nearest.

    Full scale is 2^bits - 1 at the swing, so every code occurs. Halves go to the even code (IEEE 754), which has no bias.
    """
    full_scale = full_scale_dn(adc_bits)
    codes = adc_v * (full_scale / voltage_swing_v)
    np.rint(codes, out=codes)
    np.clip(codes, 0.0, full_scale, out=codes)
    return codes.astype(np.uint16)
