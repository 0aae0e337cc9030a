"""Digital Negatives: a raw reader that is not ours finds our numbers, our mosaic and our colours in them."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import colour
import numpy as np
import pytest

from fullwell.core import FieldError, stream
from fullwell.dataset import dng
from fullwell.dataset.dng import dng_colours, encode_raw_dng
from fullwell.dataset.filter_codes import cfa_codes
from fullwell.isp import ColourMatrixFit, IspSettings, ToneCurve, calibrate, develop
from fullwell.isp.colour_matrix import adapted_srgb_targets, channel_responses, white_xyz, xyz_to_linear_srgb_matrix
from fullwell.radiometry import COLORCHECKER_PATCHES, Spectrum, WavelengthGrid, band_photons, illuminant, reflectance
from fullwell.scene.images import OpticalImage, RawImage
from fullwell.sensor import AutoExposure, expose, fixed_pattern_stream, sensor

rawpy = pytest.importorskip("rawpy")
tifffile = pytest.importorskip("tifffile")

GRID = WavelengthGrid(400.0, 700.0, 10.0)
PATCH_PX = 16

MATRIX_TOLERANCE = 1e-3
"""Absolute; LibRaw has the matrix of sRGB to four digits, the file has ours to six."""

LIBRAW_DELTA_E = 0.3
"""CIEDE2000, mean of 24 patches; LibRaw works in 16-bit integers, and its gamma curve is rounded."""

LIBRAW_OTHER_LIGHT_DELTA_E = 5.0
"""The same under a light that is not D65: LibRaw takes the file's one matrix for that of D65 and has no ForwardMatrix."""

ROUNDING = 5e-6
"""Relative; the file's fractions have a denominator of a million."""


def photograph(light_name: str, sensor_name: str) -> RawImage:
    """Return a picture of an evenly lit ColorChecker, 64 x 96."""
    light = band_photons(illuminant(light_name), GRID)
    patches = np.stack([reflectance(f"colorchecker:{name}").band_average(GRID) for name in COLORCHECKER_PATCHES])
    photons = (patches * light / np.max(light) * 1e16).reshape(4, 6, GRID.count)
    optical = OpticalImage(np.kron(photons, np.ones((PATCH_PX, PATCH_PX, 1))).astype(np.float32), GRID, 4e-6)
    model = replace(sensor(sensor_name), rows=4 * PATCH_PX, cols=6 * PATCH_PX, pixel_pitch_m=4e-6)
    exposure = AutoExposure("full", level=0.9, max_time_s=1e3)
    return expose(optical, model, exposure, rng=stream(0, "dng"), fixed_pattern_rng=fixed_pattern_stream(model))


def curve(low_nm: float, high_nm: float, height: float = 0.5) -> Spectrum:
    return Spectrum(np.array([low_nm, (low_nm + high_nm) / 2, high_nm]), np.array([0.0, height, 0.0]), outside="zero")


CURVES = {
    "R": curve(560, 710),
    "G": curve(470, 620),
    "B": curve(390, 530),
    "Gr": curve(470, 620),
    "Gb": curve(470, 620),
    "C": curve(380, 720, 0.9),
    "W": curve(380, 720, 0.9),
    "Y": curve(480, 720, 0.8),
    "Cy": curve(390, 620, 0.7),
    "NIR": curve(640, 900),
    "X": curve(500, 600),
}
PATTERNS = {
    "RGGB": ("RG", "GB"),
    "BGGR": ("BG", "GR"),
    "GRBG": ("GR", "BG"),
    "GBRG": ("GB", "RG"),
    "RCCC": ("RC", "CC"),
    "RCCB": ("RC", "CB"),
    "RGBW": ("RG", "BW"),
}


def mosaic(pattern: tuple[tuple[str, ...], ...], **changes: Any) -> RawImage:
    """Return random numbers under a filter pattern, 40 x 60."""
    names = dict.fromkeys(name for row in pattern for name in row)
    dn = np.random.default_rng(0).integers(60, 1023, (40, 60), dtype=np.uint16)
    raw = RawImage(dn, pattern, tuple((n, CURVES[n]) for n in names), GRID, 63.95, 1023.0, 0.0123, "test", 10, 0.0)
    return replace(raw, **changes)


def rows(text: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(row) for row in text)


def opened(raw: RawImage, settings: IspSettings | None = None) -> Any:
    return rawpy.imread(io.BytesIO(encode_raw_dng(raw, settings or IspSettings())))


def tags_of(content: bytes) -> dict[int, Any]:
    with tifffile.TiffFile(io.BytesIO(content)) as file:
        return {tag.code: tag.value for tag in file.pages[0].tags}


def fractions(values: tuple[int, ...]) -> np.ndarray:
    pairs = np.array(values, dtype=float).reshape(-1, 2)
    return pairs[:, 0] / pairs[:, 1]


@pytest.mark.parametrize("name", PATTERNS)
def test_libraw_finds_our_numbers_mosaic_and_levels(name: str) -> None:
    raw = mosaic(rows(PATTERNS[name]))
    with opened(raw) as file:
        np.testing.assert_array_equal(file.raw_image, raw.dn)
        assert file.raw_image_visible.shape == (40, 60)
        assert file.black_level_per_channel == [64, 64, 64, 64]
        assert file.white_level == 1023
        assert file.other.shutter_speed == pytest.approx(0.0123, rel=1e-6)
        assert file.sizes.flip == 0
        # LibRaw numbers colours by first appearance in its plane order; equal filters must get equal numbers.
        channels = list(dict.fromkeys(cfa_codes([n for n, _ in raw.channels])))
        found = np.where(file.raw_colors == 3, 1, file.raw_colors) if file.num_colors == 3 else file.raw_colors
        codes = np.array([[channels.index(cfa_codes([n for n, _ in raw.channels])[k]) for k in row] for row in _indices(raw)])
        np.testing.assert_array_equal(found, np.tile(codes, (20, 30)))


def _indices(raw: RawImage) -> list[list[int]]:
    order = [name for name, _ in raw.channels]
    return [[order.index(name) for name in row] for row in raw.pattern]


def test_a_sensor_without_filters_is_read_as_monochrome() -> None:
    raw = mosaic((("W",),))
    content = encode_raw_dng(raw, IspSettings())
    assert tags_of(content)[262] == 34892
    with rawpy.imread(io.BytesIO(content)) as file:
        np.testing.assert_array_equal(file.raw_image, raw.dn)
        assert file.num_colors == 1


@pytest.mark.parametrize("sensor_name", ["imx363", "ideal-rgb"])
def test_libraw_has_our_colour_matrix_and_white_balance_under_daylight(sensor_name: str) -> None:
    raw, settings = photograph("D65", sensor_name), IspSettings(illuminant("D65"))
    ours = calibrate(raw, settings)
    assert ours.colour_matrix is not None
    with opened(raw, settings) as file:
        np.testing.assert_allclose(file.color_matrix[:, :3], ours.colour_matrix, atol=MATRIX_TOLERANCE)
        np.testing.assert_allclose(file.camera_whitebalance[:3], ours.channel_gain_ratio, rtol=1e-5)


@pytest.mark.parametrize(
    ("light_name", "bound"), [("D65", LIBRAW_DELTA_E), ("A", LIBRAW_OTHER_LIGHT_DELTA_E), ("FL2", LIBRAW_OTHER_LIGHT_DELTA_E)]
)
@pytest.mark.parametrize("sensor_name", ["imx363", "ideal-rgb"])
def test_libraw_develops_the_colorchecker_in_our_colours(sensor_name: str, light_name: str, bound: float) -> None:
    raw, settings = photograph(light_name, sensor_name), IspSettings(illuminant(light_name))
    with opened(raw, settings) as file:
        theirs = file.postprocess(
            use_camera_wb=True,
            no_auto_bright=True,
            adjust_maximum_thr=0.0,
            gamma=(2.4, 12.92),
            demosaic_algorithm=rawpy.DemosaicAlgorithm.LINEAR,
        )
    means = [picture.astype(float).reshape(4, 16, 6, 16, 3)[:, 4:-4, :, 4:-4].mean(axis=(1, 3)).reshape(24, 3) / 255
             for picture in (theirs, develop(raw, settings).rgb)]  # fmt: skip
    to_xyz = np.linalg.inv(xyz_to_linear_srgb_matrix()).T
    lab = [
        colour.XYZ_to_Lab(colour.cctf_decoding(mean, function="sRGB") @ to_xyz, np.array([0.3127, 0.3290])) for mean in means
    ]
    assert np.mean(colour.delta_E(*lab, method="CIE 2000")) < bound


@pytest.mark.parametrize("light_name", ["D65", "A", "FL2", "blackbody:3000K"])
@pytest.mark.parametrize("name", ["RGGB", "RCCB", "RCCC", "RGBW"])
def test_the_matrices_mean_what_the_specification_says(name: str, light_name: str) -> None:
    """ColorMatrix1 takes the light's XYZ to the camera's neutral, ForwardMatrix1 the neutral to the white of D50."""
    raw, light = mosaic(rows(PATTERNS[name])), illuminant(light_name)
    tags = tags_of(encode_raw_dng(raw, IspSettings(light)))
    planes = len(tags[50710])
    to_camera, forward = fractions(tags[50721]).reshape(planes, 3), fractions(tags[50964]).reshape(3, planes)
    neutral = fractions(tags[50728])
    used = slice(0, 2) if name == "RCCC" else slice(None)  # RCCC has a third plane without pixels
    seen = (to_camera @ white_xyz(light))[used]
    np.testing.assert_allclose(seen / np.max(seen), neutral[used] / np.max(neutral[used]), rtol=2 * ROUNDING)
    np.testing.assert_allclose(forward @ np.ones(planes), [0.9642, 1.0, 0.8249], atol=5e-6)


@pytest.mark.parametrize("light_name", ["A", "blackbody:3000K"])
def test_a_reader_that_follows_the_specification_gets_our_colours(light_name: str) -> None:
    light = illuminant(light_name)
    raw = photograph(light_name, "imx363")
    tags = tags_of(encode_raw_dng(raw, IspSettings(light)))
    forward, neutral = fractions(tags[50964]).reshape(3, 3), fractions(tags[50728])
    camera = channel_responses(tuple(c for _, c in raw.channels), light, raw.grid)
    in_d50 = camera / np.max(camera[0]) / neutral @ forward.T
    adapted = colour.adaptation.chromatic_adaptation_VonKries(
        in_d50, np.array([0.9642, 1.0, 0.8249]), np.linalg.solve(xyz_to_linear_srgb_matrix(), np.ones(3)), transform="Bradford"
    )
    ours = calibrate(raw, IspSettings(light))
    assert ours.colour_matrix is not None
    expected = camera / camera[0] @ ours.colour_matrix.T
    found = adapted @ xyz_to_linear_srgb_matrix().T
    np.testing.assert_allclose(found / found[0, 1], expected / expected[0, 1], atol=1e-4)
    # And by ColorMatrix1 alone, inverted and adapted from the light to the white of sRGB.
    to_camera = fractions(tags[50721]).reshape(3, 3)
    in_light = np.linalg.solve(to_camera, camera.T).T
    by_colour_matrix = colour.adaptation.chromatic_adaptation_VonKries(
        in_light / in_light[0, 1],
        white_xyz(light),
        np.linalg.solve(xyz_to_linear_srgb_matrix(), np.ones(3)),
        transform="Bradford",
    )
    np.testing.assert_allclose(by_colour_matrix @ xyz_to_linear_srgb_matrix().T, expected, atol=1e-4)


@pytest.mark.parametrize(
    ("light_name", "code"),
    [
        ("D65", 21),
        ("A", 17),
        ("D50", 23),
        ("D55", 20),
        ("D75", 22),
        ("daylight:6504K", 21),
        ("blackbody:3000K", 255),
        ("FL2", 255),
    ],
)
def test_the_light_is_named_where_the_standard_has_a_name(light_name: str, code: int) -> None:
    assert tags_of(encode_raw_dng(mosaic(rows(PATTERNS["RGGB"])), IspSettings(illuminant(light_name))))[50778] == code


def test_four_planes_are_fitted_better_than_no_colours_at_all() -> None:
    """The four-plane matrix is a least-squares fit; its error on the patches is that of a camera that sees otherwise."""
    light = illuminant("D65")
    raw = mosaic(rows(PATTERNS["RGBW"]))
    colours = dng_colours(raw, IspSettings(light))
    assert colours.colour_matrix is not None
    xyz = adapted_srgb_targets(light, adapt_white=False) @ np.linalg.inv(xyz_to_linear_srgb_matrix()).T
    camera = channel_responses(tuple(c for _, c in raw.channels), light, raw.grid)
    error = xyz @ colours.colour_matrix.T - camera / np.max(camera[0])
    assert np.sqrt(np.mean(error**2)) < 0.05
    np.testing.assert_allclose(error[0], 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("names", "codes"),
    [
        (("R", "G", "B"), (0, 1, 2)),
        (("r", "gr", "gb", "b"), (0, 1, 1, 2)),
        (("R", "C"), (0, 6)),
        (("R", "Y", "Cy"), (0, 5, 3)),
        (("C", "M", "Y"), (3, 4, 5)),
        (("R", "G", "B", "NIR"), (0, 1, 2, 6)),
        (("R", "W", "NIR"), (0, 6, 1)),
        (("C", "W"), (6, 1)),
    ],
)
def test_filters_get_the_codes_of_the_standard_and_unknown_ones_a_free_code(
    names: tuple[str, ...], codes: tuple[int, ...]
) -> None:
    assert cfa_codes(names) == codes


def test_separate_greens_are_one_plane() -> None:
    raw = mosaic((("R", "Gr"), ("Gb", "B")))
    tags = tags_of(encode_raw_dng(raw, IspSettings()))
    assert bytes(tags[33422]) == bytes([0, 1, 1, 2])
    assert bytes(tags[50710]) == bytes([0, 1, 2])
    same = tags_of(encode_raw_dng(mosaic(rows(PATTERNS["RGGB"])), IspSettings()))
    # The fit over (r, gr, gb, b) of equal greens has the colours of the one over (r, g, b).
    np.testing.assert_allclose(fractions(tags[50964]), fractions(same[50964]), atol=1e-5)


def test_more_colours_than_readers_hold_are_refused_with_the_way_out() -> None:
    pattern = (("R", "G", "B"), ("W", "NIR", "R"))
    with pytest.raises(FieldError, match=r"at most 4.*raw\.npz"):
        encode_raw_dng(mosaic(pattern), IspSettings())
    with pytest.raises(FieldError, match="at most 4"):
        dng.check_dng_pattern(pattern)


def test_a_quad_pattern_is_written_as_it_is() -> None:
    tags = tags_of(encode_raw_dng(mosaic(rows(("RRGG", "RRGG", "GGBB", "GGBB"))), IspSettings()))
    assert tags[33421] == (4, 4)
    assert bytes(tags[33422]) == bytes([0, 0, 1, 1, 0, 0, 1, 1, 1, 1, 2, 2, 1, 1, 2, 2])


def test_images_of_more_than_sixteen_bits_lose_their_lowest_bits() -> None:
    dn = np.random.default_rng(0).integers(0, 2**20, (40, 60), dtype=np.uint32)
    raw = mosaic(rows(PATTERNS["RGGB"]), dn=dn, adc_bits=20, white_level_dn=2.0**20 - 1, black_level_dn=1024.0)
    with opened(raw) as file:
        np.testing.assert_array_equal(file.raw_image, dn >> 4)
        assert file.black_level_per_channel == [64, 64, 64, 64]
        assert file.white_level == 65535


def test_settings_of_taste_stay_out_of_the_matrix_and_exposure_goes_to_its_tag() -> None:
    raw = mosaic(rows(PATTERNS["RGGB"]))
    plain = tags_of(encode_raw_dng(raw, IspSettings(illuminant("A"))))
    taste = IspSettings(
        illuminant("A"), "gray_world", colour_matrix=ColourMatrixFit("noise_aware"), tone=ToneCurve(exposure_ev=1.5)
    )
    other = tags_of(encode_raw_dng(raw, taste))
    assert other[50721] == plain[50721]
    assert other[50728] != plain[50728]
    assert fractions(other[50730]).tolist() == [1.5]


def test_every_tag_that_a_dng_must_have_is_there_and_the_bytes_repeat() -> None:
    raw = mosaic(rows(PATTERNS["RGGB"]))
    content = encode_raw_dng(raw, IspSettings())
    tags = tags_of(content)
    assert bytes(tags[50706]) == bytes([1, 4, 0, 0])
    assert tags[50708] == "Fullwell test"
    assert (tags[274], tags[254], tags[262]) == (1, 0, 32803)
    assert tags[50829] == (0, 0, 40, 60)
    assert 306 not in tags, "the time of day is not part of the picture"
    assert content == encode_raw_dng(raw, IspSettings())


def test_a_picture_without_visible_bands_has_no_colour_tags_and_opens() -> None:
    raw = mosaic(rows(PATTERNS["RGGB"]), grid=WavelengthGrid(800.0, 900.0, 10.0))
    raw = replace(raw, channels=tuple((name, curve(750, 950)) for name, _ in raw.channels))
    content = encode_raw_dng(raw, IspSettings())
    assert 50721 not in tags_of(content)
    with rawpy.imread(io.BytesIO(content)) as file:
        np.testing.assert_array_equal(file.raw_image, raw.dn)
