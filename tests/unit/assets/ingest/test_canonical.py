"""Level files: exact, the same bytes each time, and readable by others."""

from __future__ import annotations

import io
import json
import struct
from dataclasses import fields, replace

import numpy as np
import pytest

from fullwell.assets.ingest import read_level, write_level
from fullwell.assets.model import LoadedPart, ModelError, srgb_to_linear
from ingest_models import grid_part, part

trimesh = pytest.importorskip("trimesh")


def awkward_parts() -> list[LoadedPart]:
    rng = np.random.default_rng(7)
    texture = rng.integers(0, 256, (5, 7, 3), dtype=np.uint8)
    vertices = rng.normal(0, 3, (40, 3)).astype(np.float32)
    normals = rng.normal(size=(40, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    uv = rng.normal(0, 40, (40, 2)).astype(np.float32)
    uv[0] = (1e-30, -7.3)
    faces = rng.integers(0, 40, (30, 3))
    full = part(
        vertices,
        faces,
        name='wheel "front/left" \u00e4\u20ac\U0001f697 .001',
        normals=normals.astype(float),
        uv=uv.astype(float),
        base_color_texture=texture,
        base_color_srgb=(0.1, 1 / 3, 0.987654321),
        roughness=0.123456789,
        metallic=1.0,
        emissive_srgb=(0.7, 0.2, 0.0),
        material_name="Gummi",
    )
    return [
        full,
        replace(full, name="same picture", normals=None),
        part(vertices, faces[:3], name="body", double_sided=True),
        grid_part(2, 4, name="body_2"),
    ]


def assert_same(first: LoadedPart, second: LoadedPart) -> None:
    for field in fields(LoadedPart):
        one, other = getattr(first, field.name), getattr(second, field.name)
        if isinstance(one, np.ndarray):
            assert np.array_equal(one, other), field.name
        else:
            assert one == other, field.name


def test_parts_come_back_exactly() -> None:
    parts = awkward_parts()
    model = read_level(write_level(parts))
    assert len(model.parts) == len(parts)
    for written, read in zip(parts, model.parts, strict=True):
        assert_same(written, read)
    low = np.min([p.vertices_m.min(axis=0) for p in parts], axis=0)
    assert np.array_equal(model.bounds_m[0], low)


def test_the_same_parts_give_the_same_bytes_and_read_parts_do_too() -> None:
    content = write_level(awkward_parts(), attribution="A. Author, CC BY 4.0")
    assert content == write_level(awkward_parts(), attribution="A. Author, CC BY 4.0")
    assert content == write_level(read_level(content).parts, attribution="A. Author, CC BY 4.0")


def json_of(content: bytes) -> dict[str, object]:
    length = struct.unpack("<I", content[12:16])[0]
    tree: dict[str, object] = json.loads(content[20 : 20 + length])
    return tree


def test_the_attribution_stands_in_the_file() -> None:
    tree = json_of(write_level(awkward_parts(), attribution="A. Author, CC BY 4.0"))
    assert tree["asset"]["copyright"] == "A. Author, CC BY 4.0"  # type: ignore[index]


def test_parts_that_share_a_picture_store_it_once() -> None:
    assert len(json_of(write_level(awkward_parts()))["images"]) == 1  # type: ignore[arg-type]


def test_another_reader_sees_the_same_names_places_and_colours() -> None:
    parts = awkward_parts()
    scene = trimesh.load_scene(io.BytesIO(write_level(parts)), file_type="glb", process=False)
    assert set(scene.geometry) == {p.name for p in parts}
    body = scene.geometry["body"]
    x, y, z = parts[2].vertices_m.T
    np.testing.assert_array_equal(np.asarray(body.vertices, dtype=np.float32), np.stack([x, z, -y], axis=1))
    grey = round(float(srgb_to_linear(np.array(0.5))) * 255)
    assert body.visual.material.baseColorFactor[:3].tolist() == [grey] * 3


def test_another_reader_finds_the_picture_the_right_way_up() -> None:
    """Texture coordinate (u, v up) of a pixel centre gives that pixel in any viewer: glTF counts v from the top."""
    texture = np.zeros((2, 2, 3), dtype=np.uint8)
    texture[0, 0] = (255, 0, 0)  # row 0 lies at v = 1
    square = grid_part(1, 1, base_color_texture=texture)
    scene = trimesh.load_scene(io.BytesIO(write_level([square])), file_type="glb", process=False)
    visual = scene.geometry["part"].visual
    image = np.asarray(visual.material.baseColorTexture.convert("RGB"))
    vertex = int(np.flatnonzero((square.vertices_m == (0.0, 1.0, 0.0)).all(axis=1))[0])
    u, v_up = visual.uv[vertex]  # this reader turns v up, as most do
    assert image[min(int((1 - v_up) * 2), 1), min(int(u * 2), 1)].tolist() == [255, 0, 0]


@pytest.mark.parametrize("cut", [0, 3, 11, 19, 200, 1500])
def test_damaged_level_files_are_refused(cut: int) -> None:
    with pytest.raises(ModelError, match="damaged"):
        read_level(write_level(awkward_parts())[:cut])


def test_files_of_other_programs_are_refused() -> None:
    content = trimesh.creation.box().export(file_type="glb")
    with pytest.raises(ModelError, match="not written by this project"):
        read_level(content)
