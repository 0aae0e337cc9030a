"""What describes the image signal processor."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.radiometry.spectrum import Spectrum

__all__ = ["ColourMatrixFit", "CurveName", "Demosaic", "IspSettings", "MatrixMethod", "ToneCurve", "WhiteBalance"]

WhiteBalance = Literal["illuminant", "gray_world", "white_patch", "none"]
Demosaic = Literal["bilinear", "malvar2004", "menon2007"]
MatrixMethod = Literal["least_squares", "noise_aware"]
CurveName = Literal["srgb", "linear", "gamma", "filmic", "s_curve"]


def _known(kind: str, path: str, value: str, names: Any) -> None:
    if value not in get_args(names):
        raise FieldError(unknown_name_message(kind, value, get_args(names)), path=path, value=value)


def _within(path: str, value: float, low: float, high: float, legal: str) -> None:
    if not low <= value <= high:
        raise FieldError(f"{path} is {value}; must be {legal}. Set {path} of the isp.", path=path, value=value)


@dataclass(frozen=True, slots=True)
class ToneCurve:
    """From linear values, 1 at the sensor's saturation level, to display values; formulas in `fullwell.isp.tone`.

    Attributes
    ----------
    curve
        "srgb" the standard's encoding and nothing else; "linear"; "gamma"; "filmic" highlights rolled off; "s_curve".
    exposure_ev
        Brightening by 2^exposure_ev before the curve, -20 to 20.
    black_point
        The linear value that becomes 0, 0 to less than 1.
    gamma
        Exponent's reciprocal of "gamma", 0.1 to 10.
    contrast, pivot
        Of "s_curve": slope at the pivot, 0.1 to 10, and the encoded value that stays, above 0 to below 1.
    """

    curve: CurveName = "srgb"
    exposure_ev: float = 0.0
    black_point: float = 0.0
    gamma: float = 2.2
    contrast: float = 1.5
    pivot: float = 0.5

    def __post_init__(self) -> None:
        _known("tone curve", "curve", self.curve, CurveName)
        _within("exposure_ev", self.exposure_ev, -20.0, 20.0, "-20 to 20")
        _within("black_point", self.black_point, 0.0, math.nextafter(1.0, 0.0), "at least 0 and below 1")
        _within("gamma", self.gamma, 0.1, 10.0, "0.1 to 10")
        _within("contrast", self.contrast, 0.1, 10.0, "0.1 to 10")
        _within("pivot", self.pivot, 1e-3, 1.0 - 1e-3, "0.001 to 0.999")


@dataclass(frozen=True, slots=True)
class ColourMatrixFit:
    """How the colour matrix is fitted on the ColorChecker.

    "least_squares" has the least colour error; "noise_aware" the least expected error of colour and noise together where the
    raw picture has noise of standard deviation `noise_fraction`, a fraction of its saturation signal, 0 to 1, on a chart
    whose white just saturates. Take the noise over the signal of a white in the picture's darker parts.
    """

    method: MatrixMethod = "least_squares"
    noise_fraction: float = 0.02

    def __post_init__(self) -> None:
        _known("colour matrix method", "method", self.method, MatrixMethod)
        _within("noise_fraction", self.noise_fraction, 0.0, 1.0, "0 to 1")


@dataclass(frozen=True, slots=True, eq=False)
class IspSettings:
    """From raw digital numbers to an sRGB picture.

    Attributes
    ----------
    illuminant
        Relative spectral power of the light for which the colour matrix is fitted and, with `white_balance` "illuminant", a
        perfect white becomes neutral. None: the light of the scene, which the caller of `develop` tells; D65 where it does not.
    white_balance
        "illuminant"; "gray_world", the picture's mean becomes neutral; "white_patch", its brightest values do; "none", the
        light keeps its tint, as colorimetry sees it.
    demosaic
        "bilinear", "malvar2004" or "menon2007".
    white_patch_percentile
        Which values "white_patch" takes for white, above 0 to 100.
    colour_matrix, tone
        The fit of the matrix; the tone curve.

    Raises
    ------
    FieldError
        On making it with an unknown name or a value out of its range.
    """

    illuminant: Spectrum | None = None
    white_balance: WhiteBalance = "illuminant"
    demosaic: Demosaic = "bilinear"
    white_patch_percentile: float = 99.0
    colour_matrix: ColourMatrixFit = field(default_factory=ColourMatrixFit)
    tone: ToneCurve = field(default_factory=ToneCurve)

    def __post_init__(self) -> None:
        _known("white balance", "white_balance", self.white_balance, WhiteBalance)
        _known("demosaic method", "demosaic", self.demosaic, Demosaic)
        if not 0 < self.white_patch_percentile <= 100:
            raise FieldError(
                f"white_patch_percentile is {self.white_patch_percentile}; must be > 0 and at most 100.",
                path="white_patch_percentile",
                value=self.white_patch_percentile,
            )
