"""A submitted recipe may read what was submitted with it, and nothing else."""

from __future__ import annotations

import pytest

from fullwell.core import FieldError
from fullwell.jobs.files import check_files, check_references, file_references, relative_path

DIGEST = "ab" * 32

ESCAPES = [
    "/etc/passwd",
    "../secret.obj",
    "a/../../b.obj",
    "~/.ssh/id",
    "C:/windows/x",
    "C:x",
    "a\\..\\b",
    "file:///etc/passwd",
    "http://host/x",
    "a\x00b",
    "",
    ".",
    "//host/share",
]


@pytest.mark.parametrize("text", ESCAPES)
def test_a_path_that_leaves_the_recipes_folder_is_refused(text: str) -> None:
    with pytest.raises(FieldError):
        relative_path(text)
    with pytest.raises(FieldError):
        check_files({text: DIGEST})
    with pytest.raises(FieldError):
        check_references({"scene": {"objects": [{"geometry": {"kind": "model", "file": text}}]}}, {text: DIGEST})


def test_a_path_has_one_normal_form() -> None:
    assert relative_path("./models//car.obj") == "models/car.obj"
    assert check_files({"./a.obj": DIGEST}) == {"a.obj": DIGEST}


def test_files_that_vary_sets_are_checked_too() -> None:
    recipe = {
        "vary": {
            "grid": {"scene.objects[car].geometry.file": ["a.obj", "/etc/passwd"], "seed": [1]},
            "random": {
                "frames": 2,
                "values": {'scene.lights[0]."file"': {"distribution": "choice", "values": ["sky.exr"]}},
            },
        }
    }
    assert [text for _, text in file_references(recipe)] == ["a.obj", "/etc/passwd", "sky.exr"]
    with pytest.raises(FieldError, match="etc/passwd"):
        check_references(recipe, {"a.obj": DIGEST, "sky.exr": DIGEST})


def test_a_whole_geometry_that_vary_sets_is_checked_too() -> None:
    recipe = {"vary": {"grid": {"scene.objects[0].geometry": [{"kind": "model", "file": "/etc/shadow"}]}}}
    with pytest.raises(FieldError, match="etc/shadow"):
        check_references(recipe, {})


@pytest.mark.parametrize("path", ["scene.objects[0].geometry[file]", 'scene.objects[0]."geometry"."file"', "file"])
def test_every_way_to_write_a_varied_path_is_seen(path: str) -> None:
    with pytest.raises(FieldError):
        check_references({"vary": {"grid": {path: ["/etc/passwd"]}}}, {})


def test_a_file_that_was_not_submitted_is_named() -> None:
    with pytest.raises(FieldError, match=r"scene\.objects\[0\]\.geometry\.file is 'car\.obj'; that file was not submitted"):
        check_references({"scene": {"objects": [{"geometry": {"file": "car.obj"}}]}}, {})


def test_a_reference_into_the_services_library_needs_no_file_and_cannot_climb() -> None:
    check_references({"file": "sumo:car"}, {})
    with pytest.raises(FieldError):
        check_references({"file": "sumo:../../etc/passwd"}, {})


def test_a_name_cannot_be_a_file_and_a_folder() -> None:
    with pytest.raises(FieldError, match="both as a file and as a folder"):
        check_files({"a": DIGEST, "a/b": DIGEST})


def test_a_digest_has_64_digits() -> None:
    with pytest.raises(FieldError, match="64 lower-case hexadecimal digits"):
        check_files({"a": "AB" * 32})
