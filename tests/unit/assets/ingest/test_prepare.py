"""Model files and generated things become assets: every format, the report, and what is refused."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fullwell.assets.ingest import IngestError, IngestLimits, IngestOptions, prepare_built, prepare_file, read_level
from fullwell.assets.records import AssetManifest, Check, LicenceRecord, PreparedAsset, SourceRecord
from fullwell.assets.starter.building import BuiltAsset, BuiltPart
from fullwell.assets.starter.shapes import box, sphere
from fullwell.core.errors import FieldError
from fullwell.core.hashing import sha256_hex

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("fast_simplification")

CC0 = LicenceRecord("CC0-1.0", "A. Author")


def options(**changes: object) -> IngestOptions:
    return IngestOptions(**{"id": "thing", "asset_class": "other", "licence": CC0, **changes})  # type: ignore[arg-type]


def check(prepared: PreparedAsset, name: str) -> Check:
    return next(entry for entry in prepared.manifest.checks if entry.name == name)


def sound(prepared: PreparedAsset) -> AssetManifest:
    """What holds of every prepared asset."""
    manifest = prepared.manifest
    assert manifest.blobs() == set(prepared.blobs)
    assert all(sha256_hex(content) == digest for digest, content in prepared.blobs.items())
    assert AssetManifest.from_document(json.loads(json.dumps(manifest.document()))) == manifest
    models = [read_level(prepared.blobs[level.sha256]) for level in manifest.levels]
    assert [model.triangle_count for model in models] == [level.triangles for level in manifest.levels]
    assert [p.name for p in models[0].parts] == [p.name for p in manifest.parts]
    assert [len(p.faces) for p in models[0].parts] == [p.triangles for p in manifest.parts]
    low, high = models[0].bounds_m
    assert tuple(high - low) == manifest.size_m
    assert abs(low[2]) < 1e-6
    assert np.abs(low + high)[:2].max() < 1e-5
    for coarse in models[1:]:
        assert {p.name for p in coarse.parts} <= {p.name for p in models[0].parts}
    assert all(b"A. Author" in prepared.blobs[level.sha256] for level in manifest.levels)
    return manifest


def car_scene() -> object:
    """A car with wheels in a glTF's axes: y up, z forward; two wheels are instances of one mesh."""
    body = trimesh.creation.box((1.8, 1.2, 4.4))
    body.apply_translation((0, 0.9, 0))
    wheel = trimesh.creation.icosphere(4, radius=0.3)
    scene = trimesh.Scene()
    scene.add_geometry(body, node_name="body", geom_name="Cube.001")
    for name, x, z in (("wheel_front_left", 0.8, 1.4), ("wheel_front_right", -0.8, 1.4), ("wheel_rear_left", 0.8, -1.4)):
        move = trimesh.transformations.translation_matrix((x, 0.3, z))
        scene.add_geometry(wheel, node_name=name, geom_name="Sphere", transform=move)
    return scene


@pytest.fixture
def car(tmp_path: Path) -> Path:
    folder = tmp_path / "upload"
    folder.mkdir()
    car_scene().export(folder / "car.glb")  # type: ignore[attr-defined]
    return folder


def test_a_car_becomes_an_asset(car: Path) -> None:
    prepared = prepare_file(car, "car.glb", options(asset_class="car", title="A car", tags=("sedan",)))
    manifest = sound(prepared)
    assert manifest.size_m == pytest.approx((4.4, 2.2, 1.5), abs=0.01)
    assert (manifest.id, manifest.title, manifest.asset_class, manifest.tags) == ("thing", "A car", "car", ("sedan",))
    assert (manifest.source.kind, manifest.source.name, manifest.source.up_axis, manifest.source.forward_axis) == (
        "upload", "car.glb", "y", "z",
    )  # fmt: skip
    assert manifest.source.files == {"car.glb": sha256_hex((car / "car.glb").read_bytes())}
    assert len(manifest.levels) == 3
    assert manifest.levels[1].triangles < 0.3 * manifest.levels[0].triangles
    assert 0 < manifest.levels[1].error_m < manifest.levels[2].error_m < 0.1


def test_part_names_are_those_of_the_nodes(car: Path) -> None:
    manifest = prepare_file(car, "car.glb", options(asset_class="car")).manifest
    assert {p.name for p in manifest.parts} == {"body", "wheel_front_left", "wheel_front_right", "wheel_rear_left"}


def test_wheels_end_up_where_their_names_say(car: Path) -> None:
    prepared = prepare_file(car, "car.glb", options(asset_class="car"))
    model = read_level(prepared.blobs[prepared.manifest.levels[0].sha256])
    centre = {p.name: p.vertices_m.mean(axis=0) for p in model.parts}
    assert centre["wheel_front_left"][0] > 1
    assert centre["wheel_front_left"][1] > 0.5
    assert centre["wheel_front_right"][1] < -0.5
    assert centre["wheel_rear_left"][0] < -1


def test_the_same_file_gives_the_same_asset(car: Path) -> None:
    first, second = (prepare_file(car, "car.glb", options(asset_class="car")) for _ in range(2))
    assert first.manifest.digest == second.manifest.digest
    assert dict(first.blobs) == dict(second.blobs)


def test_progress_rises_to_one(car: Path) -> None:
    seen: list[tuple[float, str]] = []
    prepare_file(car, "car.glb", options(asset_class="car"), progress=lambda share, stage: seen.append((share, stage)))
    shares = [share for share, _ in seen]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)


@pytest.mark.parametrize("suffix", ["glb", "gltf", "obj", "ply", "stl"])
def test_every_mesh_format_is_taken_in(tmp_path: Path, suffix: str) -> None:
    trimesh.Scene(trimesh.creation.icosphere(2, radius=0.5)).export(tmp_path / f"ball.{suffix}")
    manifest = sound(prepare_file(tmp_path, f"ball.{suffix}", options(unit_m=2.0)))
    assert manifest.size_m == pytest.approx((2.0, 2.0, 2.0), abs=0.1)
    assert manifest.parts[0].area_m2 == pytest.approx(4 * np.pi, rel=0.03)


@pytest.mark.parametrize("suffix", ["usd", "usda", "usdc", "usdz"])
def test_every_usd_format_is_taken_in(tmp_path: Path, suffix: str) -> None:
    write_usd(tmp_path / f"stage.{suffix if suffix != 'usdz' else 'usdc'}")
    if suffix == "usdz":
        from pxr import UsdUtils

        UsdUtils.CreateNewUsdzPackage(str(tmp_path / "stage.usdc"), str(tmp_path / "stage.usdz"))
    manifest = sound(prepare_file(tmp_path, f"stage.{suffix}", options()))
    assert manifest.size_m == pytest.approx((2.0, 2.0, 2.0))
    assert manifest.parts[0].name == "/World/Box"


def write_usd(file: Path, **attributes: object) -> None:
    from pxr import Gf, Usd, UsdGeom

    stage = Usd.Stage.CreateNew(str(file))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    mesh = UsdGeom.Mesh.Define(stage, "/World/Box")
    corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    faces = [0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5]
    mesh.CreatePointsAttr([Gf.Vec3f(*corner) for corner in corners])
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr(faces)
    mesh.CreateSubdivisionSchemeAttr(attributes.get("scheme", "none"))
    stage.GetRootLayer().Save()


def test_subdivision_surfaces_are_put_to_a_person_and_refined_when_asked(tmp_path: Path) -> None:
    write_usd(tmp_path / "s.usda", scheme="catmullClark")
    asked = prepare_file(tmp_path, "s.usda", options())
    assert check(asked, "subdivision").state == "decide"
    assert asked.manifest.levels[0].triangles == 12
    finer = prepare_file(tmp_path, "s.usda", options(subdivide=2))
    assert check(finer, "subdivision").state == "ok"
    assert finer.manifest.levels[0].triangles == 12 * 16
    assert finer.manifest.size_m[0] < 1.9, "a refined box is round"
    kept = prepare_file(tmp_path, "s.usda", options(subdivide=0))
    assert check(kept, "subdivision").state == "ok"


VARIANTS = """#usda 1.0
(
    defaultPrim = "Thing"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "Thing" (
    variants = {
        string size = "small"
    }
    prepend variantSets = "size"
)
{
    variantSet "size" = {
        "small" {
            def Cube "Box"
            {
                double size = 1
            }
        }
        "large" {
            def Cube "Box"
            {
                double size = 3
            }
        }
    }
}
"""


def test_variants_are_named_and_chosen(tmp_path: Path) -> None:
    (tmp_path / "v.usda").write_text(VARIANTS)
    usual = prepare_file(tmp_path, "v.usda", options())
    assert usual.manifest.size_m == pytest.approx((1, 1, 1))
    found = check(usual, "variants")
    assert found.state == "warning"
    assert all(word in found.message for word in ("/Thing{size}", "'small'", "'large'"))
    for key in ("size", "/Thing{size}"):
        large = prepare_file(tmp_path, "v.usda", options(variants={key: "large"}))
        assert large.manifest.size_m == pytest.approx((3, 3, 3))
        assert check(large, "variants").state == "ok"


@pytest.mark.parametrize(("variants", "match"), [({"size": "lage"}, "'large'"), ({"sise": "large"}, "'size'")])
def test_unknown_variants_are_answered_with_the_nearest(tmp_path: Path, variants: dict[str, str], match: str) -> None:
    (tmp_path / "v.usda").write_text(VARIANTS)
    with pytest.raises(IngestError, match=match):
        prepare_file(tmp_path, "v.usda", options(variants=variants))


INSTANCES = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "World"
{
    def PointInstancer "Balls"
    {
        rel prototypes = [</World/Balls/Ball>, </World/Balls/Box>]
        int[] protoIndices = [0, 0, 1, 0]
        int64[] invisibleIds = [3]
        point3f[] positions = [(0, 0, 0), (10, 0, 0), (5, 0, 0), (90, 0, 0)]
        float3[] scales = [(1, 1, 1), (2, 2, 2), (1, 1, 1), (1, 1, 1)]
        def Sphere "Ball"
        {
            double radius = 1
        }
        def Cube "Box"
        {
            double size = 2
        }
    }
}
"""


def test_instances_of_points_are_joined_by_prototype_and_hidden_ones_left_out(tmp_path: Path) -> None:
    (tmp_path / "i.usda").write_text(INSTANCES)
    manifest = sound(prepare_file(tmp_path, "i.usda", options(forward_axis="x", level_ratios=())))
    assert {p.name: p.triangles for p in manifest.parts} == {"/World/Balls/Ball": 2 * 1280, "/World/Balls/Box": 12}
    assert manifest.size_m == pytest.approx((13.0, 4.0, 4.0), abs=0.02)


@pytest.mark.parametrize(
    ("solid", "size"),
    [
        ('Cylinder "S" { double radius = 1\n double height = 5\n uniform token axis = "X"\n}', (5, 2, 2)),
        ('Cone "S" { double radius = 1\n double height = 3\n uniform token axis = "Y"\n}', (2, 3, 2)),
        ('Capsule "S" { double radius = 0.5\n double height = 2\n uniform token axis = "Z"\n}', (1, 1, 3)),
        ('Sphere "S" { double radius = 2\n}', (4, 4, 4)),
    ],
)
def test_solids_of_usd_are_made_of_triangles(tmp_path: Path, solid: str, size: tuple[float, float, float]) -> None:
    head = '#usda 1.0\n(\n metersPerUnit = 1\n upAxis = "Z"\n)\ndef '
    (tmp_path / "s.usda").write_text(head + solid)
    manifest = sound(prepare_file(tmp_path, "s.usda", options(forward_axis="x")))
    assert manifest.size_m == pytest.approx(size, rel=0.02)
    assert check(prepare_file(tmp_path, "s.usda", options()), "winding").state == "ok"


def test_objects_and_materials_of_an_obj_become_parts(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text("newmtl glass\nKd 0.1 0.1 0.1\nnewmtl lack\nKd 0.8 0 0\n")
    triangle = "v {x} 0 0\nv {x}.5 0 0\nv {x} 1 0\n"
    lines = ["mtllib m.mtl"]
    for number, (name, material) in enumerate([("body", "lack"), ("window_front", "glass")]):
        lines += [f"o {name}", triangle.format(x=number), f"usemtl {material}"]
        lines += [f"f {3 * number + 1} {3 * number + 2} {3 * number + 3}"]
    (tmp_path / "m.obj").write_text("\n".join(lines))
    manifest = sound(prepare_file(tmp_path, "m.obj", options()))
    assert {p.name for p in manifest.parts} == {"body_lack", "window_front_glass"}
    assert set(manifest.source.files) == {"m.obj", "m.mtl"}


def test_names_that_are_not_utf_8_are_read(tmp_path: Path) -> None:
    text = "o T\u00fcr\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (tmp_path / "m.obj").write_bytes(text.encode("latin-1"))
    assert prepare_file(tmp_path, "m.obj", options()).manifest.parts[0].name == "T\u00fcr"


def textured(folder: Path, px: int) -> None:
    rng = np.random.default_rng(1)
    Image.fromarray(rng.integers(0, 255, (px, px // 2, 3), dtype=np.uint8)).save(folder / "t.png")
    (folder / "m.mtl").write_text("newmtl a\nmap_Kd t.png\n")
    (folder / "m.obj").write_text("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n")


def test_large_textures_are_reduced_and_counted(tmp_path: Path) -> None:
    textured(tmp_path, 256)
    prepared = prepare_file(tmp_path, "m.obj", options(max_texture_px=64))
    model = read_level(prepared.blobs[prepared.manifest.levels[0].sha256])
    texture = model.parts[0].base_color_texture
    assert texture is not None
    assert texture.shape == (64, 32, 3)
    found = check(prepared, "textures")
    assert (found.state, found.numbers["reduced"]) == ("mended", 1.0)
    assert check(prepare_file(tmp_path, "m.obj", options()), "textures").state == "ok"


def test_an_archive_is_unpacked_and_read(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    textured(inner, 32)
    with zipfile.ZipFile(tmp_path / "m.zip", "w", zipfile.ZIP_DEFLATED) as stream:
        for file in sorted(inner.iterdir()):
            stream.write(file, f"model/{file.name}")
    manifest = sound(prepare_file(tmp_path, "m.zip", options()))
    assert set(manifest.source.files) == {"model/m.obj", "model/m.mtl", "model/t.png"}
    assert manifest.source.parameters == {"main": "model/m.obj", "archive": "m.zip"}


def test_missing_normals_are_made_sharp_at_creases(tmp_path: Path) -> None:
    trimesh.creation.box().export(tmp_path / "b.stl")
    prepared = prepare_file(tmp_path, "b.stl", options())
    model = read_level(prepared.blobs[prepared.manifest.levels[0].sha256])
    normals = model.parts[0].normals
    assert normals is not None
    assert np.allclose(np.abs(normals).max(axis=1), 1.0)
    assert check(prepared, "normals").numbers["made"] == 1.0


def test_what_does_not_enclose_a_volume_is_said(tmp_path: Path) -> None:
    (tmp_path / "t.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    found = check(prepare_file(tmp_path, "t.obj", options()), "watertight")
    assert (found.state, found.numbers["open_edges"]) == ("warning", 3.0)


def test_a_packaged_model_keeps_no_files(car: Path) -> None:
    prepared = prepare_file(car, "car.glb", options(source_kind="package", source_name="a package 1.0, car.glb"))
    assert prepared.manifest.source.files == {}
    assert prepared.manifest.source.name == "a package 1.0, car.glb"
    assert set(prepared.blobs) == {level.sha256 for level in prepared.manifest.levels}


class TestRefusals:
    @pytest.mark.parametrize("main", ["../car.glb", "/etc/passwd", ".", "nothing.glb", "car.fbx", "x.dae"])
    def test_files_that_are_none(self, car: Path, main: str) -> None:
        (car / "x.dae").write_text("<!DOCTYPE a [<!ENTITY b 'b'>]><COLLADA/>")
        with pytest.raises(IngestError) as caught:
            prepare_file(car, main, options())
        assert caught.value.cause == "refused"
        assert str(car) not in caught.value.message

    @pytest.mark.parametrize("uri", ["http://example.org/a.bin", "/etc/passwd", "../secret.bin", "file:///etc/passwd"])
    def test_references_to_elsewhere(self, tmp_path: Path, uri: str) -> None:
        (tmp_path / "secret.bin").write_bytes(bytes(100))
        folder = tmp_path / "upload"
        folder.mkdir()
        tree = {"asset": {"version": "2.0"}, "buffers": [{"uri": uri, "byteLength": 100}]}
        (folder / "m.gltf").write_text(json.dumps(tree))
        with pytest.raises(IngestError, match="refers to"):
            prepare_file(folder, "m.gltf", options())

    def test_references_of_usd_to_elsewhere(self, tmp_path: Path) -> None:
        folder = tmp_path / "upload"
        folder.mkdir()
        write_usd(tmp_path / "secret.usda")
        (folder / "m.usda").write_text('#usda 1.0\ndef "A" ( prepend references = @../secret.usda@ ) {}\n')
        with pytest.raises(IngestError, match="outside"):
            prepare_file(folder, "m.usda", options())

    def test_too_many_triangles(self, car: Path) -> None:
        with pytest.raises(IngestError, match="triangles"):
            prepare_file(car, "car.glb", options(), limits=IngestLimits(triangles=1000))

    def test_too_many_bytes(self, car: Path) -> None:
        with pytest.raises(IngestError, match="bytes"):
            prepare_file(car, "car.glb", options(), limits=IngestLimits(input_bytes=1000))

    def test_nothing_to_draw(self, tmp_path: Path) -> None:
        (tmp_path / "p.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
        with pytest.raises(IngestError, match="no triangles"):
            prepare_file(tmp_path, "p.obj", options())


def built(*, height_m: float = 1.4) -> BuiltAsset:
    body = box((4.4, 1.8, height_m), centre_m=(1.0, 0.5, height_m / 2))
    parts = (
        BuiltPart("body", body, "paint/red", paintable=True),
        BuiltPart("knob", sphere(0.2, sides=80).moved(1.0, 0.5, 1.0), "metal/chrome"),
    )
    return BuiltAsset("car", ("sedan",), parts, {"wheelbase_m": 2.6})


def prepared_built(asset: BuiltAsset) -> PreparedAsset:
    source = SourceRecord("generator", "tests", parameters={"seed": 3})
    return prepare_built(asset, id="red-car", title="Red car", licence=CC0, source=source)


def test_a_generated_thing_becomes_an_asset() -> None:
    prepared = prepared_built(built())
    manifest = sound(prepared)
    assert manifest.size_m == pytest.approx((4.4, 1.8, 1.4), abs=1e-5)
    assert manifest.attributes == {"wheelbase_m": 2.6}
    assert manifest.source.parameters == {"seed": 3}
    first, second = manifest.parts
    assert (first.name, first.material.name, first.material.origin, first.paintable) == ("body", "paint/red", "generator", True)
    assert (second.name, second.material.name, second.paintable) == ("knob", "metal/chrome", False)
    assert first.material.base_color_srgb[0] > 2 * first.material.base_color_srgb[1]
    assert len(manifest.levels) == 3
    assert check(prepared, "size").state == "ok"
    model = read_level(prepared.blobs[manifest.levels[0].sha256])
    assert model.parts[0].normals is None, "a generator's flat parts stay flat"


def test_a_generated_thing_of_the_wrong_size_is_put_to_a_person() -> None:
    assert prepared_built(built(height_m=4.0)).manifest.needs_decision


def test_a_generated_thing_of_an_unknown_material_is_refused() -> None:
    part = BuiltPart("body", box((1, 1, 1)), "paint/rad")
    with pytest.raises(FieldError, match="paint/red"):
        prepared_built(BuiltAsset("car", (), (part,)))


def test_generated_things_are_the_same_each_time() -> None:
    assert prepared_built(built()).manifest.digest == prepared_built(built()).manifest.digest
