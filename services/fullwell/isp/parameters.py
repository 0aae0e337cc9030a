"""What describes the image signal processor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fullwell.radiometry.spectrum import Spectrum

__all__ = ["IspSettings"]


@dataclass(frozen=True, slots=True, eq=False)
class IspSettings:
    """From raw digital numbers to an sRGB picture.

    `illuminant` (relative spectral power) is the light for which the colour matrix is fitted on the ColorChecker and, with
    `white_balance` "illuminant", for which a perfect white becomes neutral.
    """

    illuminant: Spectrum
    white_balance: Literal["illuminant", "gray_world", "none"] = "illuminant"
    demosaic: Literal["bilinear"] = "bilinear"
