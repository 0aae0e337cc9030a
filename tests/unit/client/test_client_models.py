"""Which files go along with a model: those that it names, wherever they lie in its kit, and no others of the disk."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from fullwell.client.models import collect_model, find_models
from fullwell.core import FieldError


def write(folder: Path, files: dict[str, bytes | str]) -> None:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)


def glb(tree: object) -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<II", 2, 20 + len(text)) + struct.pack("<I4s", len(text), b"JSON") + text


def test_an_obj_takes_its_materials_and_their_textures_along(tmp_path: Path) -> None:
    write(tmp_path, {"m/car.obj": "mtllib mats/car.mtl\n", "m/mats/car.mtl": "map_Kd -s 1 1 1 ../t/red.png\n"})
    write(tmp_path, {"m/t/red.png": b"x", "m/other.png": b"y"})
    files = collect_model(tmp_path / "m" / "car.obj")
    assert (files.main, sorted(files)) == ("car.obj", ["car.obj", "mats/car.mtl", "t/red.png"])


def test_a_glb_takes_the_pictures_beside_it_along(tmp_path: Path) -> None:
    write(tmp_path, {"car.glb": glb({"images": [{"uri": "Textures/a%20b.png"}, {"uri": "data:,"}]}), "Textures/a b.png": b"x"})
    assert sorted(collect_model(tmp_path / "car.glb")) == ["Textures/a b.png", "car.glb"]


def test_a_kit_of_layers_goes_along_from_the_folder_that_holds_all_of_it(tmp_path: Path) -> None:
    write(
        tmp_path,
        {
            "one/two/kit/cars/sedan/sedan.usda": "#usda 1.0\nreferences = @../../wheels/wheel.usda@\n",
            "one/two/kit/wheels/wheel.usda": "#usda 1.0\nasset inputs:file = @./rubber.png@\n",
            "one/two/kit/wheels/rubber.png": b"x",
            "one/two/kit/unused.usda": "#usda 1.0\n",
        },
    )
    files = collect_model(tmp_path / "one/two/kit/cars/sedan/sedan.usda")
    assert files.main == "cars/sedan/sedan.usda"
    assert sorted(files) == ["cars/sedan/sedan.usda", "wheels/rubber.png", "wheels/wheel.usda"]
    assert files["wheels/rubber.png"].read_bytes() == b"x"


def test_a_binary_layer_takes_the_layers_and_pictures_around_it_along(tmp_path: Path) -> None:
    write(tmp_path, {"k/car.usdc": b"PXR-USDC....", "k/t/a.png": b"x", "k/notes.txt": b"private", "other.png": b"y"})
    assert sorted(collect_model(tmp_path / "k/car.usdc")) == ["car.usdc", "t/a.png"]


@pytest.mark.parametrize("reference", ["../../secret.txt", "/etc/hostname", "file:///etc/hostname", "../../key.png", "~/x.png"])
def test_a_hostile_model_takes_no_other_files_of_the_disk_along(tmp_path: Path, reference: str) -> None:
    write(tmp_path, {"a/b/car.gltf": json.dumps({"images": [{"uri": reference}]}), "secret.txt": "s", "key.png": b"k"})
    assert list(collect_model(tmp_path / "a/b/car.gltf")) == ["car.gltf"]


def test_a_layer_takes_no_files_along_that_are_no_part_of_a_model(tmp_path: Path) -> None:
    write(tmp_path, {"a/b/car.usda": "#usda 1.0\n@../../secret.key@ @../../t.png@", "secret.key": "s", "t.png": b"x"})
    assert sorted(collect_model(tmp_path / "a/b/car.usda")) == ["a/b/car.usda", "t.png"]
    assert list(collect_model(tmp_path / "a/b/car.usda", root=tmp_path / "a")) == ["car.usda"]


def test_what_is_no_model_is_refused(tmp_path: Path) -> None:
    write(tmp_path, {"notes.txt": b"x"})
    with pytest.raises(FieldError, match="no format"):
        collect_model(tmp_path / "notes.txt")
    with pytest.raises(FieldError, match="does not exist"):
        collect_model(tmp_path / "absent.glb")


def test_layers_that_others_name_are_no_models_of_a_folder(tmp_path: Path) -> None:
    write(tmp_path, {"a.glb": b"x", "sub/b.usda": "#usda 1.0\n@./part.usda@", "sub/part.usda": "#usda 1.0\n", "readme.md": b""})
    assert [file.name for file in find_models(tmp_path, recursive=False)] == ["a.glb"]
    assert [file.name for file in find_models(tmp_path, recursive=True)] == ["a.glb", "b.usda"]


@pytest.mark.parametrize("content", [b"", b"glTF", glb([1, 2]), b"glTF" + b"\xff" * 40])
def test_a_damaged_model_goes_alone(tmp_path: Path, content: bytes) -> None:
    write(tmp_path, {"car.glb": content})
    assert list(collect_model(tmp_path / "car.glb")) == ["car.glb"]
