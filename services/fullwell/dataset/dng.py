"""Raw images as Digital Negatives (DNG 1.4), which raw converters open. The same image gives the same bytes.

One uncompressed strip of 16-bit numbers, little-endian, in one image file directory; no previews, no dates.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.dataset.filter_codes import cfa_codes
from fullwell.isp import ColourMatrixFit, IspSettings, calibrate
from fullwell.isp.calibration import ColourCalibration, used_channels
from fullwell.isp.colour_matrix import (
    adapted_srgb_targets,
    bradford_adaptation,
    channel_responses,
    fit_colour_matrix,
    white_xyz,
    xyz_to_linear_srgb_matrix,
)
from fullwell.radiometry import Spectrum, chromaticity, illuminant
from fullwell.scene.images import RawImage

__all__ = ["DngColours", "check_dng_pattern", "dng_colours", "encode_raw_dng"]

MAX_PLANES = 4
"""Filter colours that raw converters hold (the DNG SDK's and LibRaw's limit)."""

_BITS = 16
_HIGHEST_DN = 2**_BITS - 1
_D50_XYZ = np.array([0.9642, 1.0, 0.8249])
"""White of the profile connection space (ISO 15076-1:2010, section 6.3.1), to which ForwardMatrix leads."""

_LIGHT_SOURCES = {"A": 17, "C": 19, "D55": 20, "D65": 21, "D75": 22, "D50": 23}
"""EXIF 2.3, tag LightSource."""

_OTHER_LIGHT = 255
_SAME_LIGHT_XY = 0.002
"""Lights whose chromaticities differ by less than this, a noticeable step or two, are given the standard's name."""

_MATRIX_DENOMINATOR = 10**6


@dataclass(frozen=True, slots=True, eq=False)
class DngColours:
    """What a DNG says about colours.

    Attributes
    ----------
    plane_codes
        Codes of the filter colours, in the order of the planes.
    colour_matrix
        (planes, 3) from CIE XYZ under the calibration light to unbalanced camera values; None for one plane or no colours.
    forward_matrix
        (3, planes) from balanced camera values to XYZ under D50; None likewise.
    as_shot_neutral
        (planes,) camera values of what the white balance makes neutral, the greatest 1.
    light_source
        EXIF code of the calibration light, 255 where it is none of the standard's.
    """

    plane_codes: tuple[int, ...]
    colour_matrix: NDArray[np.float64] | None
    forward_matrix: NDArray[np.float64] | None
    as_shot_neutral: NDArray[np.float64]
    light_source: int


def check_dng_pattern(pattern: tuple[tuple[str, ...], ...]) -> None:
    """Refuse a filter pattern of more colours than raw converters hold; raises FieldError."""
    names = list(dict.fromkeys(name for row in pattern for name in row))
    if len(set(cfa_codes(names))) > MAX_PLANES:
        raise FieldError(
            f"raw.dng cannot hold the {len(names)} filter colours {', '.join(names)}; must be at most {MAX_PLANES}. Ask for "
            "raw.npz or raw.tiff.",
            path="outputs",
            value="raw.dng",
        )


# Colours -------------------------------------------------------------------------------------------------------------


def dng_colours(raw: RawImage, settings: IspSettings, *, scene_light: Spectrum | None = None) -> DngColours:
    """Return what a DNG of this image says about colours; arguments as for `fullwell.isp.develop`.

    The matrix is the plain least-squares one: a noise-aware fit is the image processor's taste, not the sensor's property.
    Three planes get the exact inverse of our matrix, so that converters show our colours; other numbers the least-squares fit
    the other way round.

    Raises
    ------
    FieldError
        More than four filter colours; the settings' illuminant is invisible to the eye or the sensor.

    References
    ----------
    dng14, chapter 6, "Mapping Camera Color Space to CIE XYZ Space". Derived in docs/physics/raw-files.md.
    """
    check_dng_pattern(raw.pattern)
    shown = calibrate(raw, settings, scene_light=scene_light)
    codes = cfa_codes(shown.channel_names)
    planes = tuple(dict.fromkeys(codes))
    members = np.array([[code == plane for code in codes] for plane in planes], dtype=np.float64)
    averaging = members / members.sum(axis=1, keepdims=True)
    neutral = averaging @ (1.0 / shown.channel_gain_ratio)
    neutral = neutral / np.max(neutral)
    plain = replace(settings, illuminant=shown.illuminant, white_balance="illuminant", colour_matrix=ColourMatrixFit())
    fitted = calibrate(raw, plain)
    if fitted.colour_matrix is None:
        return DngColours(planes, None, None, neutral, _light_source(shown.illuminant))
    camera_white = averaging @ fitted.white_response
    balanced_to_srgb = fitted.colour_matrix @ members.T
    balanced_of_xyz = _balanced_of_xyz(raw, fitted, averaging, balanced_to_srgb)
    colours = DngColours(
        planes,
        (camera_white / np.max(camera_white))[:, None] * balanced_of_xyz,
        bradford_adaptation(_srgb_white_xyz(), _D50_XYZ) @ np.linalg.inv(xyz_to_linear_srgb_matrix()) @ balanced_to_srgb,
        neutral,
        _light_source(shown.illuminant),
    )
    return _with_absent_plane(colours) if len(planes) == 2 else colours


def _balanced_of_xyz(
    raw: RawImage, fitted: ColourCalibration, averaging: NDArray[np.float64], balanced_to_srgb: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (planes, 3) matrix from XYZ under the light to balanced planes; its white gives ones."""
    white = white_xyz(fitted.illuminant)
    if balanced_to_srgb.shape == (3, 3) and np.linalg.cond(balanced_to_srgb) < 1 / np.sqrt(np.finfo(np.float64).eps):
        to_srgb = xyz_to_linear_srgb_matrix() @ bradford_adaptation(white, _srgb_white_xyz())
        return np.asarray(np.linalg.solve(balanced_to_srgb, to_srgb))
    responses = channel_responses(tuple(curve for _, curve in used_channels(raw)), fitted.illuminant, raw.grid)
    seen = np.where(responses[0] > 0, responses[0], 1.0)
    unadapted = adapted_srgb_targets(fitted.illuminant, adapt_white=False) @ np.linalg.inv(xyz_to_linear_srgb_matrix()).T
    return fit_colour_matrix(unadapted / white, (responses / seen) @ averaging.T) / white


def _with_absent_plane(colours: DngColours) -> DngColours:
    """Return two planes as three, of which the third has no pixel: LibRaw refuses files of two colours.

    The third plane is taken to see Z, so that the matrix can be inverted; the forward matrix gives it no weight.
    """
    assert colours.colour_matrix is not None
    assert colours.forward_matrix is not None
    absent = next(code for code in (1, 2, 0) if code not in colours.plane_codes)
    return replace(
        colours,
        plane_codes=(*colours.plane_codes, absent),
        colour_matrix=np.vstack([colours.colour_matrix, [0.0, 0.0, 1.0]]),
        forward_matrix=np.hstack([colours.forward_matrix, np.zeros((3, 1))]),
        as_shot_neutral=np.append(colours.as_shot_neutral, 1.0),
    )


def _srgb_white_xyz() -> NDArray[np.float64]:
    return np.asarray(np.linalg.solve(xyz_to_linear_srgb_matrix(), np.ones(3)))


def _light_source(light: Spectrum) -> int:
    try:
        x, y = chromaticity(light)
    except FieldError:
        return _OTHER_LIGHT
    for name, code in _LIGHT_SOURCES.items():
        standard_x, standard_y = chromaticity(illuminant(name))
        if np.hypot(x - standard_x, y - standard_y) < _SAME_LIGHT_XY:
            return code
    return _OTHER_LIGHT


# The file ------------------------------------------------------------------------------------------------------------


def encode_raw_dng(raw: RawImage, settings: IspSettings, *, scene_light: Spectrum | None = None) -> bytes:
    """Return a raw image as DNG 1.4, 16 bits per pixel.

    `settings` and `scene_light` as for `fullwell.isp.develop`: the light that the colour matrix is for, the white balance for
    AsShotNeutral, and the tone curve's exposure for BaselineExposure. BlackLevel is rounded to a whole number, because LibRaw
    cuts fractions off (the exact one is in raw.npz). Images of more than 16 bits lose their lowest bits. A sensor with one
    channel is written as a linear monochrome image. Filters that the standard has no code for get a free one.

    Raises
    ------
    FieldError
        As `dng_colours`.

    References
    ----------
    dng14; ISO 12234-2:2001 (TIFF/EP).
    """
    colours = dng_colours(raw, settings, scene_light=scene_light)
    scale = 2.0 ** -max(0, raw.adc_bits - _BITS)
    dn = raw.dn if scale == 1.0 else np.floor(raw.dn * scale)
    tags = _image_tags(raw, scale) + _camera_tags(raw, settings) + _colour_tags(raw, colours)
    return _tiff(tags, np.ascontiguousarray(dn, dtype="<u2").tobytes())


@dataclass(frozen=True, slots=True)
class _Tag:
    """An entry of an image file directory: number, TIFF type, count and packed value."""

    number: int
    kind: int
    count: int
    value: bytes


def _bytes(number: int, values: Sequence[int]) -> _Tag:
    return _Tag(number, 1, len(values), bytes(values))


def _text(number: int, text: str) -> _Tag:
    value = text.encode("ascii", "replace") + b"\0"
    return _Tag(number, 2, len(value), value)


def _shorts(number: int, *values: int) -> _Tag:
    return _Tag(number, 3, len(values), struct.pack(f"<{len(values)}H", *values))


def _longs(number: int, *values: int) -> _Tag:
    return _Tag(number, 4, len(values), struct.pack(f"<{len(values)}I", *values))


def _rational(number: int, *values: float) -> _Tag:
    """Values >= 0, each the best fraction of two 32-bit numbers."""
    parts: list[int] = []
    for value in values:
        fraction = Fraction(value).limit_denominator(int((2**32 - 1) / max(1.0, value)))
        parts += [fraction.numerator, fraction.denominator]
    return _Tag(number, 5, len(values), struct.pack(f"<{len(parts)}I", *parts))


def _signed(number: int, values: NDArray[np.float64]) -> _Tag:
    flat = np.clip(np.rint(values.ravel() * _MATRIX_DENOMINATOR), -(2**31), 2**31 - 1).astype(np.int64)
    parts = [part for numerator in flat.tolist() for part in (numerator, _MATRIX_DENOMINATOR)]
    return _Tag(number, 10, flat.size, struct.pack(f"<{len(parts)}i", *parts))


def _image_tags(raw: RawImage, scale: float) -> list[_Tag]:
    black, white = round(raw.black_level_dn * scale), round(raw.white_level_dn * scale)
    return [
        _longs(254, 0),  # NewSubfileType: the image itself
        _longs(256, raw.cols),
        _longs(257, raw.rows),
        _shorts(258, _BITS),
        _shorts(259, 1),  # Compression: none
        _shorts(274, 1),  # Orientation: row 0 is the top
        _shorts(277, 1),  # SamplesPerPixel
        _longs(278, raw.rows),  # RowsPerStrip
        _shorts(284, 1),  # PlanarConfiguration
        _shorts(50713, 1, 1),  # BlackLevelRepeatDim
        _longs(50714, black),
        _longs(50717, max(min(white, _HIGHEST_DN), black + 1)),
        _rational(50718, 1.0, 1.0),  # DefaultScale
        _longs(50719, 0, 0),  # DefaultCropOrigin
        _longs(50720, raw.cols, raw.rows),  # DefaultCropSize
        _longs(50829, 0, 0, raw.rows, raw.cols),  # ActiveArea
    ]


def _camera_tags(raw: RawImage, settings: IspSettings) -> list[_Tag]:
    return [
        _text(271, "Fullwell"),
        _text(272, raw.sensor_name),
        _rational(33434, raw.exposure_time_s),
        _bytes(50706, (1, 4, 0, 0)),  # DNGVersion
        _bytes(50707, (1, 1, 0, 0)),  # DNGBackwardVersion: ForwardMatrix1, which came later, can be ignored
        _text(50708, f"Fullwell {raw.sensor_name}"),
        _signed(50730, np.array([settings.tone.exposure_ev])),  # BaselineExposure
    ]


def _colour_tags(raw: RawImage, colours: DngColours) -> list[_Tag]:
    if len(colours.plane_codes) == 1:
        return [_shorts(262, 34892)]  # PhotometricInterpretation: LinearRaw
    names = [name for name, _ in used_channels(raw)]
    code = dict(zip(names, cfa_codes(names), strict=True))
    tags = [
        _shorts(262, 32803),  # PhotometricInterpretation: CFA
        _shorts(33421, len(raw.pattern), len(raw.pattern[0])),
        _bytes(33422, [code[name] for row in raw.pattern for name in row]),
        _bytes(50710, colours.plane_codes),  # CFAPlaneColor
        _shorts(50711, 1),  # CFALayout: square
        _rational(50728, *colours.as_shot_neutral.tolist()),
    ]
    if colours.colour_matrix is not None and colours.forward_matrix is not None:
        tags += [
            _signed(50721, colours.colour_matrix),
            _shorts(50778, colours.light_source),
            _signed(50964, colours.forward_matrix),
        ]
    return tags


def _tiff(tags: list[_Tag], strip: bytes) -> bytes:
    """Return a TIFF file of one directory and one strip: header, directory, long values, strip."""
    header = 8
    count = len(tags) + 2
    longer_at = header + 2 + 12 * count + 4
    values = [tag.value for tag in tags if len(tag.value) > 4]
    strip_at = longer_at + sum(_even(len(value)) for value in values)
    entries, longer = [], b""
    for tag in sorted([*tags, _longs(273, strip_at), _longs(279, len(strip))], key=lambda tag: tag.number):
        if len(tag.value) > 4:
            field = struct.pack("<I", longer_at + len(longer))
            longer += tag.value.ljust(_even(len(tag.value)), b"\0")
        else:
            field = tag.value.ljust(4, b"\0")
        entries.append(struct.pack("<HHI", tag.number, tag.kind, tag.count) + field)
    directory = struct.pack("<H", count) + b"".join(entries) + struct.pack("<I", 0)
    return struct.pack("<2sHI", b"II", 42, header) + directory + longer + strip


def _even(length: int) -> int:
    return length + length % 2
