"""The analog amplifier between pixel and ADC."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["amplify"]


def amplify(pixel_v: NDArray[np.float64], *, analog_gain_ratio: float, analog_offset_v: float) -> NDArray[np.float64]:
    """Return the voltage at the ADC, same shape [V]: gain first, then the offset. No clipping; no noise of its own.

    The offset is added after the full-well clip and the gain: it uses no well capacity and does not grow with the gain.
    """
    return pixel_v * analog_gain_ratio + analog_offset_v
