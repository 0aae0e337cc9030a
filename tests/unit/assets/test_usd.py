"""USD stages: composition, units, subsets, preview surfaces, and what is refused."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image

from fullwell.assets import LoadedModel, ModelError, load_model
from fullwell.assets.usd_probe import needs_probe

pytest.importorskip("pxr")

LONGEST_REFUSAL_S = 20.0
"""What takes this long hangs; alone, well under 2 s: layers that refer to others are read in a child process first."""

HEADER = '#usda 1.0\n(\n    defaultPrim = "World"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'

SQUARE = """
def Mesh "Square" {extra}
{{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 0)]
    uniform token subdivisionScheme = "none"
    {body}
}}
"""


def square(body: str = "", extra: str = "") -> str:
    return SQUARE.format(body=body, extra=extra)


def write(folder: Path, body: str, *, name: str = "model.usda", header: str = HEADER) -> Path:
    file = folder / name
    file.write_text(header + 'def Xform "World"\n{\n' + body + "\n}\n")
    return file


def load(folder: Path, body: str, header: str = HEADER) -> LoadedModel:
    return load_model(write(folder, body, header=header))


def test_the_unit_and_up_axis_of_the_stage_are_applied(tmp_path: Path) -> None:
    header = HEADER.replace("metersPerUnit = 1", "metersPerUnit = 0.01").replace('"Z"', '"Y"')
    model = load(tmp_path, square(), header)
    assert_allclose(model.bounds_m, [[0, 0, 0], [0.01, 0, 0.02]], atol=1e-15)
    assert (model.unit_m, model.up_axis, model.warnings) == (0.01, "y", ())


def test_a_stage_without_a_unit_is_in_centimetres_and_says_so(tmp_path: Path) -> None:
    model = load(tmp_path, square(), '#usda 1.0\n(\n    upAxis = "Z"\n)\n')
    assert model.bounds_m[1].tolist() == pytest.approx([0.01, 0.02, 0])
    assert any("metersPerUnit" in warning for warning in model.warnings)


def test_polygons_become_triangles_of_the_same_area(tmp_path: Path) -> None:
    body = """
    def Mesh "Pentagon"
    {
        int[] faceVertexCounts = [5, 3]
        int[] faceVertexIndices = [0, 1, 2, 3, 4, 0, 4, 5]
        point3f[] points = [(0, 0, 0), (2, 0, 0), (3, 1, 0), (1, 3, 0), (0, 2, 0), (-1, 1, 0)]
    }"""
    part = load(tmp_path, body).parts[0]
    a, b, c = (part.vertices_m[part.faces[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2
    assert len(areas) == 4
    assert np.all(areas > 0)
    assert areas.sum() == pytest.approx(6.0 + 1.0)


def test_nested_transforms_multiply(tmp_path: Path) -> None:
    body = f"""
    def Xform "Outer" {{
        double3 xformOp:translate = (10, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Xform "Inner" {{
            float3 xformOp:scale = (2, 2, 2)
            uniform token[] xformOpOrder = ["xformOp:scale"]
            {square()}
        }}
    }}"""
    assert_allclose(load(tmp_path, body).bounds_m, [[10, 0, 0], [12, 4, 0]])


def test_a_mirror_and_a_left_handed_mesh_both_keep_their_front(tmp_path: Path) -> None:
    mirror = 'float3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    for body, up in ((square(), 1), (square(mirror), 1), (square('uniform token orientation = "leftHanded"'), -1)):
        part = load(tmp_path, body).parts[0]
        a, b, c = part.vertices_m[part.faces[0]]
        assert np.sign(np.cross(b - a, c - a)[2]) == up


def test_references_payloads_variants_and_instances_are_composed(tmp_path: Path) -> None:
    write(tmp_path, square(), name="part.usda")
    body = """
    def "Referenced" ( prepend references = @./part.usda@ ) {}
    def "Paid" ( prepend payload = @./part.usda@ ) {
        double3 xformOp:translate = (5, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def "Instance" ( instanceable = true
        prepend references = @./part.usda@ ) {
        double3 xformOp:translate = (0, 5, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def "Varied" ( variants = { string size = "big" }
        prepend variantSets = "size" )
    {
        variantSet "size" = {
            "small" { }
            "big" {
                def "Big" ( prepend references = @./part.usda@ ) {
                double3 xformOp:translate = (0, 0, 9)
                    uniform token[] xformOpOrder = ["xformOp:translate"]
                }
            }
        }
    }"""
    model = load(tmp_path, body)
    assert len(model.parts) == 4
    assert model.references == ((tmp_path / "part.usda").resolve(),)
    assert_allclose(model.bounds_m, [[0, 0, 0], [6, 7, 9]])


def test_hidden_and_guide_prims_are_left_out(tmp_path: Path) -> None:
    body = square() + square('token visibility = "invisible"').replace("Square", "Hidden")
    body += square('uniform token purpose = "guide"').replace("Square", "Guide")
    body += square('uniform token purpose = "proxy"').replace("Square", "Proxy")
    body += square('uniform token purpose = "render"').replace("Square", "Shown")
    names = {part.name for part in load(tmp_path, body).parts}
    assert names == {"/World/Square", "/World/Shown"}


MATERIALS = """
def Material "Red" {
    token outputs:surface.connect = </World/Red/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.5, 0.25, 0)
        float inputs:roughness = 0.2
        float inputs:metallic = 1
        color3f inputs:emissiveColor = (0, 0, 1)
        token outputs:surface
    }
}
def Material "Picture" {
    token outputs:surface.connect = </World/Picture/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </World/Picture/T.outputs:rgb>
        token outputs:surface
    }
    def Shader "T" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./t.png@
        float3 outputs:rgb
    }
}
"""


def test_subsets_get_their_own_materials(tmp_path: Path) -> None:
    body = (
        MATERIALS
        + """
    def Mesh "Two" ( prepend apiSchemas = ["MaterialBindingAPI"] ) {
        int[] faceVertexCounts = [3, 3]
        int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 0)]
        color3f[] primvars:displayColor = [(1, 1, 1)]
        def GeomSubset "First" ( prepend apiSchemas = ["MaterialBindingAPI"] ) {
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = [0]
            rel material:binding = </World/Red>
        }
    }"""
    )
    parts = {part.name: part for part in load(tmp_path, body).parts}
    red = parts["/World/Two/First"]
    assert red.base_color_srgb == pytest.approx((0.7354, 0.5371, 0), abs=1e-3)
    assert (red.roughness, red.metallic) == pytest.approx((0.2, 1.0))
    assert red.emissive_srgb == pytest.approx((0, 0, 1))
    assert parts["/World/Two"].base_color_srgb == pytest.approx((1, 1, 1))
    assert len(parts["/World/Two"].faces) == len(red.faces) == 1


def test_a_texture_keeps_its_face_varying_coordinates(tmp_path: Path) -> None:
    Image.fromarray(np.array([[[255, 0, 0], [0, 255, 0]]], np.uint8)).save(tmp_path / "t.png")
    primvar = """
    rel material:binding = </World/Picture>
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] ( interpolation = "faceVarying" )"""
    part = load(tmp_path, MATERIALS + square(primvar, '( prepend apiSchemas = ["MaterialBindingAPI"] )')).parts[0]
    assert part.base_color_texture is not None
    assert part.base_color_texture.shape == (1, 2, 3)
    assert part.uv is not None
    assert_allclose(part.uv, part.vertices_m[:, :2] / [1, 2])


def test_usdz_packages_are_read(tmp_path: Path) -> None:
    from pxr import UsdUtils

    Image.fromarray(np.array([[[255, 0, 0], [0, 255, 0]]], np.uint8)).save(tmp_path / "t.png")
    primvar = """
    rel material:binding = </World/Picture>
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] ( interpolation = "faceVarying" )"""
    write(tmp_path, MATERIALS + square(primvar, '( prepend apiSchemas = ["MaterialBindingAPI"] )'))
    package = tmp_path / "model.usdz"
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "model.usda"), str(package))
    part = load_model(package).parts[0]
    assert part.base_color_texture is not None
    assert part.base_color_texture[0, 1].tolist() == [0, 255, 0]


def test_a_stage_that_was_read_well_needs_no_second_probe(tmp_path: Path) -> None:
    write(tmp_path, square(), name="part.usda")
    file = write(tmp_path, 'def "A" ( prepend references = @./part.usda@ ) {}')
    assert needs_probe(file)
    load_model(file)
    assert not needs_probe(file)
    write(tmp_path, square() + square().replace("Square", "Other"), name="part.usda")
    assert needs_probe(file), "a layer it refers to has changed"


def test_a_file_that_changed_is_read_again(tmp_path: Path) -> None:
    assert load(tmp_path, square()).triangle_count == 2
    assert load(tmp_path, square() + square().replace("Square", "Other")).triangle_count == 4


# What is refused -----------------------------------------------------------------------------------------------------


def refusal(file: Path, root: Path | None = None) -> str:
    started = time.perf_counter()
    with pytest.raises(ModelError) as caught:
        load_model(file, field_path="file", root=root)
    assert time.perf_counter() - started < LONGEST_REFUSAL_S
    assert file.name in str(caught.value)
    return str(caught.value)


def test_a_missing_reference_is_refused(tmp_path: Path) -> None:
    assert "wheel.usda" in refusal(write(tmp_path, 'def "A" ( prepend references = @./wheel.usda@ ) {}' + square()))


@pytest.mark.parametrize("where", ["/etc/hostname.usda", "http://example.org/a.usda", "../../../../../../../../../a.usda"])
def test_references_to_anywhere_are_refused(tmp_path: Path, where: str) -> None:
    refusal(write(tmp_path, f'def "A" ( prepend references = @{where}@ ) {{}}' + square()))


def test_an_explicit_root_confines_layers_and_textures(tmp_path: Path) -> None:
    write(tmp_path, square(), name="outside.usda")
    Image.new("RGB", (2, 2)).save(tmp_path / "t.png")
    folder = tmp_path / "model"
    folder.mkdir()
    file = write(folder, 'def "A" ( prepend references = @../outside.usda@ ) {}')
    assert "outside" in refusal(file, root=folder)
    assert load_model(file, root=tmp_path).triangle_count == 2
    assert load_model(file).triangle_count == 2, "kits of layers share folders"
    textured = write(folder, MATERIALS.replace("./t.png", "../t.png") + square(), name="textured.usda")
    refusal(textured, root=folder)


def test_indices_beyond_the_points_are_refused(tmp_path: Path) -> None:
    assert "vertex 7" in refusal(write(tmp_path, square().replace("[0, 1, 2, 3]", "[0, 1, 2, 7]")))
    assert "corners" in refusal(write(tmp_path, square().replace("[4]", "[4, 4]")))


def test_nan_points_are_refused(tmp_path: Path) -> None:
    assert "NaN" in refusal(write(tmp_path, square().replace("(1, 2, 0)", "(nan, 2, 0)")))


def test_a_stage_without_meshes_is_refused(tmp_path: Path) -> None:
    assert "Sphere" not in refusal(write(tmp_path, 'def Scope "Nothing" {}'))


def test_a_cycle_of_references_is_refused(tmp_path: Path) -> None:
    refusal(write(tmp_path, 'def "A" ( prepend references = @./model.usda@ ) {}'))
