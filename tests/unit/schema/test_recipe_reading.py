"""Recipe text: bounded, without surprises, the same from YAML, JSON and Python."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

from fullwell.core import NotFoundError, digest_of
from fullwell.schema import RecipeDocument, RecipeError, build_frame, load_recipe
from fullwell.schema.frame import PRODUCTS
from fullwell.schema.reading import parse_text
from fullwell.schema.v1 import recipe as recipe_module

HANGING_S = 20.0
"""A refusal that takes this long hangs. An idle machine needs a second at most; speed itself is a benchmark's business."""


def test_yaml_json_and_python_give_the_same_recipe_and_the_same_frame(recipe: dict[str, Any], tmp_path: Path) -> None:
    file = tmp_path / "ball.yaml"
    file.write_text(yaml.safe_dump(recipe))
    documents = [
        load_recipe(recipe),
        load_recipe(yaml.safe_dump(recipe)),
        load_recipe(json.dumps(recipe).encode()),
        load_recipe(file),
        load_recipe(str(file)),
        RecipeDocument.model_validate(recipe),
    ]
    assert len({document.canonical_json() for document in documents}) == 1
    assert len({digest_of(build_frame(document)) for document in documents}) == 1


def test_canonical_json_is_itself_a_recipe(recipe: dict[str, Any]) -> None:
    recipe["cameras"][0]["lens"]["focus_distance_m"] = float("inf")
    text = load_recipe(recipe).canonical_json()
    assert load_recipe(text).canonical_json() == text


def test_loading_does_not_change_what_it_is_given(recipe: dict[str, Any]) -> None:
    before = json.dumps(recipe)
    load_recipe(recipe, overrides={"cameras[0].lens.f_number": 4.0})
    assert json.dumps(recipe) == before


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("no", "no"),
        ("on", "on"),
        ("true", True),
        ("1e-3", 0.001),
        ("1.", 1.0),
        (".5", 0.5),
        ("-2", -2),
        ("12:30:00", "12:30:00"),
        ("2024-06-21", "2024-06-21"),
        ("0o17", "0o17"),
        ("007", 7),
        ("~", None),
        ("", None),
        ("[1, 2e2]", [1, 200.0]),
        ("{a: null}", {"a": None}),
        ("1_000", "1_000"),
    ],
)
def test_scalars_are_read_by_the_rules_of_yaml_1_2(text: str, value: Any) -> None:
    read = parse_text(text)
    assert read == value
    assert type(read) is type(value)


def test_a_number_that_yaml_1_1_left_as_text_counts_as_a_number(recipe: dict[str, Any]) -> None:
    recipe["cameras"][0]["sensors"][0]["exposure"] = {"time_s": "1e-3"}
    assert load_recipe(recipe).cameras[0].sensors[0].exposure.time_s == 0.001


def test_merge_keys_and_anchors_work_and_share_nothing(recipe: dict[str, Any]) -> None:
    read = parse_text("a: &a {x: [1]}\nb: {<<: *a, y: 2}\nc: *a\n")
    assert read == {"a": {"x": [1]}, "b": {"x": [1], "y": 2}, "c": {"x": [1]}}
    read["a"]["x"].append(2)
    assert read["c"] == {"x": [1]}


BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 10)
)
MERGE_BOMB = "a0: &a0 {k: v}\n" + "".join(f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 10)}]}}\n" for i in range(1, 10))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BOMB, "more than"),
        (MERGE_BOMB, "more than"),
        ("a: &a [*a]", "refers to what it is part of"),
        ("[" * 5000, "nests deeper"),
        ('{"a":' * 5000, "nests deeper"),
        ("- " * 5000 + "1", "nests deeper"),
        ("a: 1\na: 2", "'a' occurs twice"),
        ('{"a": 1, "a": 2}', "'a' occurs twice"),
        ("? [1, 2]\n: 3", "key must be text"),
        ("a: !!python/object/apply:os.system ['true']", "could not determine a constructor"),
        ("a: [1, 2", "line"),
        ("a: 1\n---\nb: 2", "document"),
        ("a: " + "9" * 100_000, "more than 40 digits"),
        (b"\xff\xfe\xfa", "not UTF-8"),
        ("a: \x07", "cannot be read"),
        ("x" * 10_000_001, "longer than 10 MB"),
        ("[" + ("1, " * 150_000) + "1]\n# not JSON", "more than"),
    ],
)
def test_hostile_text_gives_one_clear_error_quickly(text: str | bytes, words: str) -> None:
    started = time.perf_counter()
    with pytest.raises(RecipeError, match=words):
        parse_text(text)
    assert time.perf_counter() - started < HANGING_S


@pytest.mark.parametrize("text", ["\n", "- 1\n", "5\n", "{}\n"])
def test_text_that_is_no_recipe_is_refused(text: str) -> None:
    with pytest.raises(RecipeError, match="schema"):
        load_recipe(text)


def test_a_missing_recipe_file_is_named() -> None:
    with pytest.raises(NotFoundError, match=r"nowhere\.yaml"):
        load_recipe("nowhere.yaml")


def test_another_schema_is_refused(recipe: dict[str, Any]) -> None:
    with pytest.raises(RecipeError, match="this version reads fullwell/recipe/v1"):
        load_recipe(recipe | {"schema": "fullwell/recipe/v2"})


def test_products_of_documents_and_frames_are_the_same() -> None:
    assert recipe_module._PRODUCTS == PRODUCTS


def test_a_bad_recipe_is_refused_in_a_second_from_a_cold_start() -> None:
    code = "import fullwell.schema as s\ntry: s.load_recipe('schema: x\\n')\nexcept s.RecipeError as e: print(e.path)"
    started = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "schema\n"
    assert time.perf_counter() - started < HANGING_S


def test_reading_recipes_imports_no_renderer_and_no_mesh_reader() -> None:
    code = "import sys, fullwell.schema; print(sorted({'mitsuba', 'trimesh', 'colour', 'scipy', 'PIL'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
