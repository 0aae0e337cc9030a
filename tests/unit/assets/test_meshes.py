"""Mesh files: what is read from them, and what is refused before a parser or the renderer sees it."""

from __future__ import annotations

import json
import pickle
import struct
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image

from fullwell.assets import ModelError, load_model
from fullwell.core import AssetError, FieldError

pytest.importorskip("trimesh")

LONGEST_REFUSAL_S = 20.0
"""What takes this long hangs; alone, a bad file is refused well under 2 s."""


@pytest.fixture
def quickly() -> Iterator[None]:
    started = time.perf_counter()
    yield
    assert time.perf_counter() - started < LONGEST_REFUSAL_S


SQUARE_OBJ = """\
mtllib square.mtl
v 0 0 0
v 1 0 0
v 1 2 0
v 0 2 0
usemtl paint
f 1 2 3 4
"""


def write_obj(
    folder: Path, text: str = SQUARE_OBJ, mtl: str | None = "newmtl paint\nKd 0.5 0.25 0\nNs 198\nKs 1 1 1\n"
) -> Path:
    file = folder / "square.obj"
    file.write_text(text)
    if mtl is not None:
        (folder / "square.mtl").write_text(mtl)
    return file


def write_glb(
    folder: Path,
    *,
    positions: list[list[float]] | None = None,
    indices: list[int] | None = None,
    tree: dict[str, object] | None = None,
    node: dict[str, object] | None = None,
    material: dict[str, object] | None = None,
) -> Path:
    """A GLB of one primitive, written by hand so that it can be wrong."""
    points = np.array(positions or [[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")
    corners = np.array(indices or [0, 1, 2], dtype="<u4")
    binary = points.tobytes() + corners.tobytes()
    document: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, **(node or {})}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, **({"material": 0} if material else {})}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": len(corners), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": corners.nbytes},
        ],
        "buffers": [{"byteLength": len(binary)}],
    }
    if material:
        document["materials"] = [material]
    document.update(tree or {})
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    file = folder / "model.glb"
    file.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
    return file


# What is read --------------------------------------------------------------------------------------------------------


def test_obj_is_y_up_and_in_metres_and_says_so(tmp_path: Path) -> None:
    model = load_model(write_obj(tmp_path))
    assert_allclose(model.bounds_m, [[0, 0, 0], [1, 0, 2]])
    assert model.up_axis == "y"
    assert any("y up" in warning and "1 m per unit" in warning for warning in model.warnings)


def test_a_stated_unit_and_axis_need_no_warning(tmp_path: Path) -> None:
    model = load_model(write_obj(tmp_path), unit_m=0.01, up_axis="z")
    assert_allclose(model.bounds_m, [[0, 0, 0], [0.01, 0.02, 0]])
    assert model.warnings == ()


def test_x_up_turns_x_into_z(tmp_path: Path) -> None:
    model = load_model(write_obj(tmp_path), unit_m=1.0, up_axis="x")
    assert_allclose(model.bounds_m[:, 2], [0, 1])


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_turning_the_up_axis_keeps_the_winding(tmp_path: Path, axis: str) -> None:
    """A rotation, not a reflection: a tetrahedron's signed volume stays what it was."""
    file = write_obj(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", None)
    part = load_model(file, up_axis=axis).parts[0]  # type: ignore[arg-type]
    corners = part.vertices_m[part.faces]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(1 / 6)


def test_mtl_reflectance_is_linear_and_its_exponent_becomes_roughness(tmp_path: Path) -> None:
    part = load_model(write_obj(tmp_path)).parts[0]
    assert part.base_color_srgb == pytest.approx((0.7354, 0.5371, 0.0), abs=1e-3)
    assert part.roughness == pytest.approx(0.01**0.25)
    assert part.metallic == 0.0


def test_an_obj_without_its_material_file_is_read_and_warns(tmp_path: Path) -> None:
    model = load_model(write_obj(tmp_path, mtl=None))
    assert model.triangle_count == 2
    assert any("square.mtl" in warning and "missing" in warning for warning in model.warnings)


def test_obj_indices_that_count_backwards_mean_the_latest_vertices_so_far(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n"
    model = load_model(write_obj(tmp_path, text, None), up_axis="z")
    assert_allclose(model.bounds_m, [[0, 0, 0], [6, 1, 0]])
    assert model.triangle_count == 2


def test_flat_obj_faces_get_no_made_up_normals(tmp_path: Path) -> None:
    assert load_model(write_obj(tmp_path)).parts[0].normals is None


def test_a_texture_is_read_with_its_coordinates(tmp_path: Path) -> None:
    Image.fromarray(np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [9, 8, 7]]], np.uint8)).save(tmp_path / "t.png")
    text = SQUARE_OBJ.replace("usemtl", "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl").replace("f 1 2 3 4", "f 1/1 2/2 3/3 4/4")
    part = load_model(write_obj(tmp_path, text, "newmtl paint\nKd 1 1 1\nmap_Kd t.png\n"), up_axis="z").parts[0]
    assert part.base_color_texture is not None
    assert part.uv is not None
    assert part.base_color_texture[0, 0].tolist() == [255, 0, 0]
    top_left = int(np.argmin(np.abs(part.vertices_m - [0, 2, 0]).sum(axis=1)))
    assert part.uv[top_left].tolist() == [0, 1], "row 0 of the texture is at v = 1"


def test_glb_nodes_are_placed_by_their_transforms(tmp_path: Path) -> None:
    model = load_model(write_glb(tmp_path, node={"translation": [10, 0, 0], "scale": [2, 2, 2]}))
    assert_allclose(model.bounds_m, [[10, 0, 0], [12, 0, 2]])
    assert model.warnings == ()


def test_a_mirrored_node_keeps_its_front_side(tmp_path: Path) -> None:
    part = load_model(write_glb(tmp_path, node={"scale": [-1, 1, 1]})).parts[0]
    a, b, c = part.vertices_m[part.faces[0]]
    # The triangle faced +z of glTF, which is -y here, and a reflection in x does not turn it round.
    assert np.cross(b - a, c - a)[1] < 0


def test_gltf_colour_factors_are_linear(tmp_path: Path) -> None:
    material: dict[str, object] = {
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.0, 1.0], "roughnessFactor": 0.3, "metallicFactor": 0.6},
        "emissiveFactor": [1.0, 0.5, 0.0],
        "doubleSided": True,
    }
    part = load_model(write_glb(tmp_path, material=material)).parts[0]
    assert part.base_color_srgb == pytest.approx((0.7354, 0.5371, 0.0), abs=3e-3)
    assert part.emissive_srgb == pytest.approx((1.0, 0.7354, 0.0), abs=3e-3)
    assert (part.roughness, part.metallic, part.double_sided) == (0.3, 0.6, True)


def test_few_vertex_colours_become_parts(tmp_path: Path) -> None:
    rows = ["0 0 0 255 0 0", "1 0 0 255 0 0", "0 1 0 255 0 0", "2 0 0 0 0 255", "3 0 0 0 0 255", "2 1 0 0 0 255"]
    header = "ply\nformat ascii 1.0\nelement vertex 6\n" + "".join(f"property float {axis}\n" for axis in "xyz")
    header += "".join(f"property uchar {colour}\n" for colour in ("red", "green", "blue"))
    header += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    file = tmp_path / "two.ply"
    file.write_text(header + "\n".join(rows) + "\n3 0 1 2\n3 3 4 5\n")
    colours = sorted(part.base_color_srgb for part in load_model(file).parts)
    assert colours == [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]


def test_triangles_without_area_are_removed_and_counted(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 2\nf 1 2 4\n"
    model = load_model(write_obj(tmp_path, text, None))
    assert model.triangle_count == 1
    assert any("2 of 3 triangles" in warning for warning in model.warnings)


def test_part_names_are_unique(tmp_path: Path) -> None:
    tree: dict[str, object] = {"nodes": [{"mesh": 0}, {"mesh": 0, "translation": [3, 0, 0]}], "scenes": [{"nodes": [0, 1]}]}
    model = load_model(write_glb(tmp_path, tree=tree))
    assert len({part.name for part in model.parts}) == len(model.parts) == 2


def test_a_size_that_looks_like_a_wrong_unit_is_noted(tmp_path: Path) -> None:
    model = load_model(write_obj(tmp_path), unit_m=1000.0)
    assert any("if that is not meant, set unit_m" in warning for warning in model.warnings)


# What is refused -----------------------------------------------------------------------------------------------------


def refusal(file: Path, **limits: int) -> str:
    with pytest.raises(ModelError) as caught:
        load_model(file, field_path="scene.objects[2].file", **limits)
    error = caught.value
    assert isinstance(error, AssetError)
    assert isinstance(error, FieldError)
    assert error.path == "scene.objects[2].file"
    assert str(error).startswith("scene.objects[2].file: ")
    assert file.name in str(error)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    return str(error)


@pytest.mark.usefixtures("quickly")
class TestRefusals:
    def test_a_missing_file_is_answered_with_the_nearest_name(self, tmp_path: Path) -> None:
        write_obj(tmp_path)
        assert "did you mean 'square.obj'" in refusal(tmp_path / "sqare.obj")

    def test_a_missing_folder_is_named(self, tmp_path: Path) -> None:
        assert "there is no folder" in refusal(tmp_path / "no" / "square.obj")

    def test_an_unknown_format_lists_the_known_ones(self, tmp_path: Path) -> None:
        (tmp_path / "a.fbx").write_bytes(b"x")
        assert ".glb" in refusal(tmp_path / "a.fbx")

    @pytest.mark.slow
    @pytest.mark.parametrize("suffix", [".glb", ".gltf", ".obj", ".ply", ".stl", ".usd", ".usda", ".usdc", ".usdz"])
    @pytest.mark.parametrize("content", [b"", b"\x00", b"garbage\n" * 50, bytes(range(256)) * 40])
    def test_garbage_is_refused_in_every_format(self, tmp_path: Path, suffix: str, content: bytes) -> None:
        file = tmp_path / f"garbage{suffix}"
        file.write_bytes(content)
        refusal(file)

    def test_every_truncation_of_a_glb_is_refused(self, tmp_path: Path) -> None:
        whole = write_glb(tmp_path).read_bytes()
        file = tmp_path / "cut.glb"
        for length in range(1, len(whole), 37):
            file.write_bytes(whole[:length])
            refusal(file)

    def test_nan_and_inf_vertices_are_refused(self, tmp_path: Path) -> None:
        for bad in (float("nan"), float("inf")):
            message = refusal(write_glb(tmp_path, positions=[[0, 0, 0], [1, 0, bad], [0, 1, 0]]))
            assert "NaN or Inf" in message
            assert "vertex 1" in message

    def test_an_index_beyond_the_vertices_is_refused(self, tmp_path: Path) -> None:
        refusal(write_glb(tmp_path, indices=[0, 1, 7]))
        refusal(write_obj(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", None))
        refusal(write_obj(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -9\n", None))

    def test_a_model_without_triangles_is_refused(self, tmp_path: Path) -> None:
        assert "no triangles with an area" in refusal(write_obj(tmp_path, "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", None))
        assert "0 face lines" in refusal(write_obj(tmp_path, "v 0 0 0\n", None))

    def test_too_many_triangles_or_bytes_are_refused(self, tmp_path: Path) -> None:
        assert "more than 1 triangles" in refusal(write_obj(tmp_path), max_triangles=1)
        assert "at most 50 are allowed" in refusal(write_obj(tmp_path), max_bytes=50)

    def test_an_absurd_count_reserves_no_memory(self, tmp_path: Path) -> None:
        accessor = {"bufferView": 0, "componentType": 5126, "count": 10**12, "type": "VEC3"}
        refusal(write_glb(tmp_path, tree={"accessors": [accessor, accessor]}))
        no_view = {"componentType": 5126, "count": 10**12, "type": "VEC3"}
        refusal(write_glb(tmp_path, tree={"accessors": [no_view, accessor]}))
        header = b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\nproperty float x\nend_header\n"
        (tmp_path / "a.ply").write_bytes(header)
        assert "99999999999" in refusal(tmp_path / "a.ply")
        (tmp_path / "a.stl").write_bytes(b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 50)
        refusal(tmp_path / "a.stl")

    def test_a_coordinate_the_renderer_cannot_hold_is_refused(self, tmp_path: Path) -> None:
        assert "unit_m" in refusal(write_obj(tmp_path, "v 0 0 0\nv 1e300 0 0\nv 0 1e300 0\nf 1 2 3\n", None))

    @pytest.mark.parametrize("reference", ["../secret.mtl", "/etc/passwd", "a/../../secret.mtl", "..\\secret.mtl", "~/x.mtl"])
    def test_an_obj_may_not_refer_outside_its_folder(self, tmp_path: Path, reference: str) -> None:
        (tmp_path / "secret.mtl").write_text("newmtl paint\n")
        (tmp_path / "model").mkdir()
        refusal(write_obj(tmp_path / "model", SQUARE_OBJ.replace("square.mtl", reference), None))

    @pytest.mark.parametrize(
        "uri", ["../a.bin", "/etc/passwd", "http://example.org/a.bin", "file:///etc/passwd", "%2e%2e/a.bin"]
    )
    @pytest.mark.parametrize("kind", ["buffers", "images"])
    def test_a_gltf_may_not_refer_outside_its_folder(self, tmp_path: Path, uri: str, kind: str) -> None:
        (tmp_path / "a.bin").write_bytes(b"\0" * 48)
        (tmp_path / "model").mkdir()
        refusal(write_glb(tmp_path / "model", tree={kind: [{"uri": uri, "byteLength": 48}]}))

    def test_a_texture_may_not_lie_outside_the_folder(self, tmp_path: Path) -> None:
        Image.new("RGB", (2, 2)).save(tmp_path / "t.png")
        (tmp_path / "model").mkdir()
        text = SQUARE_OBJ.replace("usemtl", "vt 0 0\nusemtl").replace("f 1 2 3 4", "f 1/1 2/1 3/1 4/1")
        refusal(write_obj(tmp_path / "model", text, "newmtl paint\nmap_Kd ../t.png\n"))

    def test_a_link_may_not_lead_outside_the_folder(self, tmp_path: Path) -> None:
        (tmp_path / "secret.mtl").write_text("newmtl paint\n")
        (tmp_path / "model").mkdir()
        (tmp_path / "model" / "square.mtl").symlink_to(tmp_path / "secret.mtl")
        refusal(write_obj(tmp_path / "model", mtl=None))

    def test_a_damaged_texture_is_named(self, tmp_path: Path) -> None:
        Image.fromarray(np.random.default_rng(1).integers(0, 255, (64, 64, 3), np.uint8)).save(tmp_path / "t.png")
        whole = (tmp_path / "t.png").read_bytes()
        (tmp_path / "t.png").write_bytes(whole[: len(whole) // 2])
        text = SQUARE_OBJ.replace("usemtl", "vt 0 0\nusemtl").replace("f 1 2 3 4", "f 1/1 2/1 3/1 4/1")
        assert "texture" in refusal(write_obj(tmp_path, text, "newmtl paint\nmap_Kd t.png\n"))

    def test_a_required_extension_that_is_not_read_is_refused(self, tmp_path: Path) -> None:
        extensions = ["EXT_meshopt_compression"]
        assert "EXT_meshopt_compression" in refusal(write_glb(tmp_path, tree={"extensionsRequired": extensions}))


@pytest.mark.parametrize("unit_m", [0.0, -1.0, float("nan"), float("inf")])
def test_a_unit_must_be_positive(tmp_path: Path, unit_m: float) -> None:
    with pytest.raises(FieldError, match="must be > 0"):
        load_model(write_obj(tmp_path), unit_m=unit_m, field_path="scene.objects[0]")


def test_a_wider_root_lets_files_share_a_folder(tmp_path: Path) -> None:
    (tmp_path / "shared.mtl").write_text("newmtl paint\nKd 1 0 0\n")
    (tmp_path / "model").mkdir()
    file = write_obj(tmp_path / "model", SQUARE_OBJ.replace("square.mtl", "../shared.mtl"), None)
    model = load_model(file, root=tmp_path)
    assert model.parts[0].base_color_srgb == pytest.approx((1, 0, 0))
    assert model.references == ((tmp_path / "shared.mtl").resolve(),)
