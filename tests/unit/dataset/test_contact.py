"""The picture of all products: it shows what is there, and survives what is odd."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fullwell.core import FieldError
from fullwell.dataset import encode
from fullwell.dataset.contact import picture_of_products
from fullwell.dataset.drawing import colour_map, distinct_colour, flow_picture, nice_ticks
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene.images import RawImage

ROWS, COLS = 24, 32
GRID = WavelengthGrid()


def entry(number: int, **changes: Any) -> dict[str, Any]:
    fields: dict[str, Any] = {"id": f"car_{number}", "instance": number, "class": "car", "class_id": 1, "visible_px": 20}
    return fields | {"bbox_visible_px": [number, 2, number + 4, 7], "distance_m": 5.0 * number} | changes


def labels(objects: list[dict[str, Any]]) -> bytes:
    document = {"schema": "fullwell/labels/v1", "image_size_px": [COLS, ROWS], "classes": [{"id": 1, "name": "car"}]}
    return encode.encode_json(document | {"objects": objects})


def all_products() -> dict[str, bytes]:
    rng = np.random.default_rng(1)
    ids = np.zeros((ROWS, COLS), np.uint32)
    ids[2:7, 1:5] = 1
    ids[2:7, 8:12] = 2
    depth = np.where(ids > 0, 5.0, np.inf).astype(np.float32)
    curve = Spectrum.constant(0.5)
    raw = RawImage(
        dn=rng.integers(60, 1000, (ROWS, COLS), dtype=np.uint16),
        pattern=(("r", "g"), ("g", "b")),
        channels=(("r", curve), ("g", curve), ("b", curve)),
        grid=GRID,
        black_level_dn=64.0,
        white_level_dn=1023.0,
        exposure_time_s=0.01,
        sensor_name="imx363",
        adc_bits=10,
        saturated_fraction=0.0,
    )
    photons = rng.random((ROWS, COLS, GRID.count), dtype=np.float32) * np.float32(1e18)
    normals = np.zeros((ROWS, COLS, 3), np.float32)
    normals[ids > 0] = (0, 0, -1)
    return {
        "image.png": encode.encode_rgb_png(rng.integers(0, 255, (ROWS, COLS, 3), dtype=np.uint8)),
        "raw.npz": encode.encode_raw_npz(raw),
        "raw.tiff": encode.encode_raw_tiff(raw),
        "radiance.exr": encode.encode_radiance_exr(RadianceImage(photons, GRID, 0.001)),
        "depth.exr": encode.encode_depth_exr(depth, depth),
        "normals.exr": encode.encode_normals_exr(normals),
        "instances.png": encode.encode_ids_png(ids),
        "semantic.png": encode.encode_ids_png((ids > 0).astype(np.uint32)),
        "labels.json": labels([entry(1), entry(2)]),
        "manifest.json": encode.encode_json({"seed": 1, "run": {"seconds": 1.5}, "warnings": ["a note"]}),
    }


def picture(products: Mapping[str, bytes]) -> Image.Image:
    return Image.open(io.BytesIO(picture_of_products(products, "a frame")))


def test_flow_has_a_panel_of_its_own() -> None:
    flow = np.zeros((ROWS, COLS, 2), np.float32)
    flow[:4] = np.nan
    flow[8:, :, 0] = 2.0
    alone = {"flow.exr": encode.encode_flow_exr(encode.FlowImage(flow, 0.1))}
    shown = np.asarray(picture(alone).convert("RGB"))
    assert (shown == (255, 0, 0)).all(axis=2).sum() > 10_000, "what flows to the right is red"
    still = {"flow.exr": encode.encode_flow_exr(encode.FlowImage(np.zeros((ROWS, COLS, 2), np.float32), 0.1))}
    assert (np.asarray(picture(still).convert("RGB")) == 255).all(axis=2).sum() > 100_000, "what rests is white"


def test_colours_of_flow_tell_its_direction_and_its_size() -> None:
    arrows = np.array([[[1.0, 0.0], [0.0, -1.0], [-1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.0, 0.0], [np.nan, 0.0], [9.0, 0.0]]])
    right, up, left, down, half, rest, unknown, fast = flow_picture(arrows, 1.0)[0].tolist()
    assert right == fast == [255, 0, 0]
    assert up == [128, 255, 0]
    assert left == [0, 255, 255]
    assert down == [128, 0, 255]
    assert half == [255, 128, 128]
    assert rest == [255, 255, 255]
    assert unknown == list(distinct_colour(0))


def test_all_products_are_shown_and_the_bytes_are_the_same_each_time() -> None:
    products = all_products()
    first = picture_of_products(products, "a frame")
    assert Image.open(io.BytesIO(first)).size[0] > 1500
    assert picture_of_products(products, "a frame") == first


@pytest.mark.parametrize("name", sorted(all_products().keys() - {"labels.json", "manifest.json"}))
def test_each_product_can_be_shown_alone(name: str) -> None:
    assert picture({name: all_products()[name]}).size[0] < 600


def test_products_in_folders_of_their_camera_are_found() -> None:
    assert picture({f"left/main/{name}": content for name, content in all_products().items()}).size[0] > 1500


def test_irradiance_does_not_answer_for_radiance() -> None:
    content = all_products()["image.png"]
    with pytest.raises(FieldError):
        picture_of_products({"irradiance.exr": content}, "not an EXR file")
    assert picture({"xradiance.exr": b"", "image.png": content}).size


def test_no_product_is_answered_with_what_to_do() -> None:
    with pytest.raises(FieldError, match="outputs"):
        picture_of_products({"manifest.json": b"{}"}, "nothing")


def test_empty_views_and_crowds_can_be_drawn() -> None:
    products = all_products()
    nothing = np.full((ROWS, COLS), np.inf, np.float32)
    products["depth.exr"] = encode.encode_depth_exr(nothing, nothing)
    products["instances.png"] = encode.encode_ids_png(np.zeros((ROWS, COLS), np.uint32))
    products["labels.json"] = labels([])
    assert picture(products).size
    crowd = [
        entry(number, bbox_visible_px=None if number % 5 == 0 else [number % 30, 3, number % 30 + 1, 4])
        for number in range(1, 99)
    ]
    products["labels.json"] = labels(crowd)
    assert picture(products).size


def test_a_black_scene_divides_nothing_by_zero() -> None:
    products = all_products()
    products["radiance.exr"] = encode.encode_radiance_exr(
        RadianceImage(np.zeros((ROWS, COLS, GRID.count), np.float32), GRID, 0.001)
    )
    assert picture(products).size


def test_the_colour_map_rises_in_lightness() -> None:
    lightness = colour_map(np.linspace(0, 1, 64)).astype(float) @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(lightness) > -1)
    assert lightness[-1] > lightness[0] + 150


def test_neighbouring_ids_have_different_colours() -> None:
    for number in range(200):
        a, b = np.array(distinct_colour(number)), np.array(distinct_colour(number + 1))
        assert np.abs(a - b).sum() > 60


def test_ticks_are_round_and_inside() -> None:
    assert nice_ticks(0, 1, about=4) == [0, 0.25, 0.5, 0.75, 1.0]
    assert nice_ticks(395, 705, about=6)[0] == 400
    assert nice_ticks(3, 3) == [3]
