"""What describes the image signal processor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["Demosaic", "IspSettings", "WhiteBalance"]

WhiteBalance = Literal["illuminant", "gray_world", "none"]
Demosaic = Literal["bilinear", "malvar2004", "menon2007"]


@dataclass(frozen=True, slots=True, eq=False)
class IspSettings:
    """From raw digital numbers to an sRGB picture.

    `illuminant` (relative spectral power) is the light for which the colour matrix is fitted on the ColorChecker and, with
    `white_balance` "illuminant", for which a perfect white becomes neutral. "gray_world" makes the picture's mean neutral;
    "none" keeps the light's own tint, as colorimetry sees it.
    """

    illuminant: Spectrum
    white_balance: WhiteBalance = "illuminant"
    demosaic: Demosaic = "bilinear"

    def __post_init__(self) -> None:
        if self.white_balance not in get_args(WhiteBalance):
            message = unknown_name_message("white balance", self.white_balance, get_args(WhiteBalance))
            raise FieldError(message, path="white_balance", value=self.white_balance)
        if self.demosaic not in get_args(Demosaic):
            message = unknown_name_message("demosaic method", self.demosaic, get_args(Demosaic))
            raise FieldError(message, path="demosaic", value=self.demosaic)
