"""Products as bytes: the same arrays give the same bytes, and what was written can be read."""

from __future__ import annotations

import io
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from fullwell.core import FieldError, ShapeError
from fullwell.core.constants import NM_PER_M, PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.dataset import encode
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene.images import CaptureRecord, OpticalImage, RawImage

GRID = WavelengthGrid(400, 700, 100)
FLOAT32_ROUNDING = 3e-7
"""Photons to energy and back in float32: two roundings of 6e-8 relative each, and a margin."""


def radiance() -> RadianceImage:
    photons = np.random.default_rng(1).random((3, 5, 4), dtype=np.float32) * np.float32(1e18)
    return RadianceImage(photons, GRID, 0.00123456789, np.full((3, 5), 0.25, np.float32))


def optical() -> OpticalImage:
    photons = np.random.default_rng(2).random((3, 5, 4), dtype=np.float32) * np.float32(1e15)
    return OpticalImage(photons, GRID, 1.4e-6, ("diffraction applied",))


def raw() -> RawImage:
    dn = np.random.default_rng(3).integers(0, 1023, (4, 6), dtype=np.uint16)
    curve = Spectrum(np.array([400.0, 700.0]), np.array([0.1, 0.5]), outside="zero", source="test")
    return RawImage(
        dn=dn,
        pattern=(("r", "g"), ("g", "b")),
        channels=(("r", curve), ("g", curve), ("b", curve)),
        grid=GRID,
        black_level_dn=63.9,
        white_level_dn=1023.0,
        exposure_time_s=0.01,
        sensor_name="imx363",
        adc_bits=10,
        saturated_fraction=0.25,
        mean_electrons=np.ones((4, 6), np.float32),
    )


def test_radiance_comes_back_to_float32_rounding() -> None:
    before = radiance()
    after = encode.decode_radiance_exr(encode.encode_radiance_exr(before))
    assert_allclose(after.photons, before.photons, rtol=FLOAT32_ROUNDING)
    assert after.grid == before.grid
    assert after.tangent_pitch == before.tangent_pitch
    assert after.standard_error is not None
    assert_array_equal(after.standard_error, before.standard_error)


def test_irradiance_comes_back_to_float32_rounding() -> None:
    before = optical()
    after = encode.decode_irradiance_exr(encode.encode_irradiance_exr(before))
    assert_allclose(after.photons, before.photons, rtol=FLOAT32_ROUNDING)
    assert (after.grid, after.sample_pitch_m, after.notes) == (before.grid, before.sample_pitch_m, before.notes)


def test_a_spectral_exr_holds_watts_in_channels_named_after_the_layout() -> None:
    import OpenEXR

    before = radiance()
    with OpenEXR.File(io.BytesIO(encode.encode_radiance_exr(before)), separate_channels=True) as file:
        channels, header = file.channels(), file.header()
        assert {"S0.400,000000nm", "S0.500,000000nm", "S0.600,000000nm", "S0.700,000000nm"} <= set(channels)
        assert header["emissiveUnits"] == "W.m^-2.sr^-1.nm^-1"
        quantum_j = PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * NM_PER_M / 500.0
        assert_allclose(channels["S0.500,000000nm"].pixels, before.photons[..., 1] * quantum_j, rtol=FLOAT32_ROUNDING)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_a_radiance_that_is_not_light_is_refused(bad: float) -> None:
    before = radiance()
    photons = before.photons.copy()
    photons[0, 0, 0] = bad
    with pytest.raises(FieldError, match="NaN, Inf or negative"):
        encode.encode_radiance_exr(RadianceImage(photons, GRID, 0.001))


def test_depth_comes_back_exactly_with_infinity_where_nothing_is() -> None:
    depth_z = np.array([[1.5, np.inf], [2.25, 1e-3]], np.float32)
    after = encode.decode_depth_exr(encode.encode_depth_exr(depth_z, depth_z * np.float32(1.1)))
    assert_array_equal(after.depth_z_m, depth_z)
    assert_array_equal(after.depth_range_m, depth_z * np.float32(1.1))
    assert after.depth_z_m.dtype == np.float32


@pytest.mark.parametrize("bad", [np.nan, 0.0, -1.0])
def test_an_impossible_depth_is_refused(bad: float) -> None:
    with pytest.raises(FieldError, match="depth_z_m"):
        encode.encode_depth_exr(np.full((2, 2), bad, np.float32), np.ones((2, 2), np.float32))


def test_depths_of_two_shapes_are_refused() -> None:
    with pytest.raises(ShapeError):
        encode.encode_depth_exr(np.ones((2, 2), np.float32), np.ones((2, 3), np.float32))


def test_flow_comes_back_exactly_with_its_interval_and_without_values_where_there_is_none() -> None:
    flow = np.random.default_rng(6).normal(size=(3, 4, 2)).astype(np.float32)
    flow[1, 2] = np.nan
    after = encode.decode_flow_exr(encode.encode_flow_exr(encode.FlowImage(flow, 1 / 30)))
    assert_array_equal(after.flow_px, flow)
    assert after.interval_s == 1 / 30
    with pytest.raises(FieldError, match="flow_px holds Inf"):
        encode.encode_flow_exr(encode.FlowImage(np.full((2, 2, 2), np.inf, np.float32), 0.1))
    with pytest.raises(ShapeError, match="rows, cols, 2"):
        encode.encode_flow_exr(encode.FlowImage(np.zeros((2, 2), np.float32), 0.1))


def test_normals_come_back_exactly() -> None:
    normals = np.random.default_rng(4).normal(size=(3, 4, 3)).astype(np.float32)
    assert_array_equal(encode.decode_normals_exr(encode.encode_normals_exr(normals)), normals)


@pytest.mark.parametrize("highest", [0, 1, 65535, 65536, 2**24 - 1])
def test_ids_come_back_exactly(highest: int) -> None:
    ids = np.array([[0, 1], [highest // 2, highest]], np.uint32)
    content = encode.encode_ids_png(ids)
    assert_array_equal(encode.decode_ids_png(content), ids)
    assert Image.open(io.BytesIO(content)).mode == ("I;16" if highest < 65536 else "RGB")


def test_ids_beyond_24_bits_are_refused() -> None:
    with pytest.raises(FieldError, match="16777215"):
        encode.encode_ids_png(np.array([[2**24]], np.uint32))


def test_coverage_in_seventeenths_comes_back_exactly() -> None:
    coverage = (np.arange(18, dtype=np.float32) / np.float32(17)).reshape(3, 6)
    content = encode.encode_coverage_png(coverage)
    assert_array_equal(np.rint(encode.decode_coverage_png(content) * 17), np.arange(18).reshape(3, 6))
    assert Image.open(io.BytesIO(content)).mode == "L"


@pytest.mark.parametrize("share", [-0.1, 1.1, np.nan])
def test_coverage_that_is_no_share_is_refused(share: float) -> None:
    with pytest.raises(FieldError, match="coverage"):
        encode.encode_coverage_png(np.full((2, 2), share, np.float32))


def test_an_srgb_image_comes_back_exactly() -> None:
    rgb = np.random.default_rng(5).integers(0, 255, (4, 6, 3), dtype=np.uint8)
    assert_array_equal(encode.decode_rgb_png(encode.encode_rgb_png(rgb)), rgb)


def test_a_raw_archive_comes_back_exactly() -> None:
    before = raw()
    after = encode.decode_raw_npz(encode.encode_raw_npz(before))
    assert_array_equal(after.dn, before.dn)
    assert after.mean_electrons is not None
    assert_array_equal(after.mean_electrons, before.mean_electrons)
    for name in ("pattern", "grid", "black_level_dn", "white_level_dn", "exposure_time_s", "sensor_name", "adc_bits"):
        assert getattr(after, name) == getattr(before, name)
    assert [name for name, _ in after.channels] == ["r", "g", "b"]
    assert_array_equal(after.channels[0][1].values, before.channels[0][1].values)


def test_a_raw_archive_keeps_what_a_combined_image_was_made_of() -> None:
    record = CaptureRecord("large", "low", 0.0, 0.01, 1.0, 5.9, 0.1, 0.75)
    before = replace(
        raw(),
        dn=np.full((4, 6), 2**20, np.uint32),
        line_time_s=1e-5,
        electrons_per_dn=5.9,
        channel_exposure_time_s=(("r", 0.02), ("g", 0.01)),
        captures=(record, replace(record, readout="high")),
    )
    after = encode.decode_raw_npz(encode.encode_raw_npz(before))
    assert after.dn.dtype == np.uint32
    assert_array_equal(after.dn, before.dn)
    for name in ("line_time_s", "electrons_per_dn", "channel_exposure_time_s", "captures"):
        assert getattr(after, name) == getattr(before, name)
    dn, _ = encode.decode_raw_tiff(encode.encode_raw_tiff(before))
    assert_array_equal(dn, before.dn)


def test_a_clear_filter_is_not_called_cyan_in_a_tiff() -> None:
    import tifffile

    before = raw()
    clear = replace(before, pattern=(("r", "C"), ("C", "C")), channels=(before.channels[0], ("C", before.channels[1][1])))
    with tifffile.TiffFile(io.BytesIO(encode.encode_raw_tiff(clear))) as file:
        assert bytes(file.pages[0].tags[33422].value) == b"\x00\x06\x06\x06"


def test_a_raw_archive_is_read_by_numpy_alone() -> None:
    with np.load(io.BytesIO(encode.encode_raw_npz(raw()))) as archive:
        assert archive["dn"].dtype == np.uint16


def test_a_raw_tiff_states_its_mosaic() -> None:
    import tifffile

    before = raw()
    content = encode.encode_raw_tiff(before)
    dn, metadata = encode.decode_raw_tiff(content)
    assert_array_equal(dn, before.dn)
    assert metadata["black_level_dn"] == 63.9
    with tifffile.TiffFile(io.BytesIO(content)) as file:
        tags = file.pages[0].tags
        assert tags[33421].value == (2, 2)
        assert bytes(tags[33422].value) == b"\x00\x01\x01\x02"
        assert 306 not in tags, "the time of day is not part of the picture"
    assert_array_equal(np.asarray(Image.open(io.BytesIO(content))), before.dn)


def test_a_mosaic_of_unusual_colours_has_no_mosaic_tag() -> None:
    import tifffile

    before = raw()
    odd = RawImage(
        **{
            **{name: getattr(before, name) for name in before.__slots__},
            "pattern": (("nir",),),
            "channels": (("nir", before.channels[0][1]),),
        }
    )
    with tifffile.TiffFile(io.BytesIO(encode.encode_raw_tiff(odd))) as file:
        assert 33422 not in file.pages[0].tags


def test_json_is_sorted_and_plain() -> None:
    document = {"b": np.float64(1.5), "a": [np.uint32(7), np.array([1, 2])], "ü": None}
    content = encode.encode_json(document)
    assert content.decode().index('"a"') < content.decode().index('"b"')
    assert content.endswith(b"\n")
    assert encode.decode_json(content) == {"a": [7, [1, 2]], "b": 1.5, "ü": None}


def test_json_refuses_nan_with_its_path() -> None:
    with pytest.raises(FieldError, match=r"objects\[1\]\.distance_m") as caught:
        encode.encode_json({"objects": [{}, {"distance_m": float("nan")}]})
    assert caught.value.path == "objects[1].distance_m"


@pytest.mark.parametrize(
    "make",
    [
        lambda: encode.encode_radiance_exr(radiance()),
        lambda: encode.encode_irradiance_exr(optical()),
        lambda: encode.encode_depth_exr(np.ones((3, 3), np.float32), np.ones((3, 3), np.float32)),
        lambda: encode.encode_raw_npz(raw()),
        lambda: encode.encode_raw_tiff(raw()),
        lambda: encode.encode_rgb_png(np.zeros((3, 3, 3), np.uint8)),
    ],
    ids=["radiance", "irradiance", "depth", "npz", "tiff", "png"],
)
def test_the_same_arrays_give_the_same_bytes_at_any_time(make: object, monkeypatch: pytest.MonkeyPatch) -> None:
    assert callable(make)
    first = make()
    now = time.time()
    monkeypatch.setattr(time, "time", lambda: now + 10_000_000.0)
    monkeypatch.setattr(time, "localtime", lambda *_: time.gmtime(now + 10_000_000.0))
    assert make() == first


DECODERS = [
    (encode.decode_radiance_exr, lambda: encode.encode_radiance_exr(radiance())),
    (encode.decode_json, lambda: encode.encode_json({"a": [1, 2, 3]})),
    (encode.decode_rgb_png, lambda: encode.encode_rgb_png(np.zeros((9, 9, 3), np.uint8))),
    (encode.decode_ids_png, lambda: encode.encode_ids_png(np.ones((9, 9), np.uint32))),
    (encode.decode_coverage_png, lambda: encode.encode_coverage_png(np.ones((9, 9), np.float32))),
    (encode.decode_raw_npz, lambda: encode.encode_raw_npz(raw())),
    (encode.decode_raw_tiff, lambda: encode.encode_raw_tiff(raw())),
]


@pytest.mark.parametrize(("decode", "make"), DECODERS, ids=lambda function: getattr(function, "__name__", ""))
def test_damaged_and_truncated_bytes_are_refused(decode: Callable[[bytes], object], make: Callable[[], bytes]) -> None:
    whole = make()
    for content in (b"", b"garbage" * 20, whole[: len(whole) // 2], whole[:20]):
        with pytest.raises(FieldError, match="damaged"):
            decode(content)
