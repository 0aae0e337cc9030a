"""docs/recipe.md is true: its examples run, its JSON schema is the current one."""

from __future__ import annotations

import copy
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_in_memory import MemoryAssets, small_car
from fullwell.schema import apply_override, load_recipe, validate
from fullwell.schema.reading import parse_text
from fullwell.schema.v1.recipe import json_schema

DOCS = Path(__file__).parents[3] / "docs"
BLOCKS = re.findall(r"```yaml\n(.*?)```", (DOCS / "recipe.md").read_text(encoding="utf-8"), re.DOTALL)
SMALLEST, FRAGMENTS = BLOCKS[0], BLOCKS[1:]


def _place(fragment: str) -> str:
    found = re.match(r"# at (\S+)\n", fragment)
    assert found is not None, fragment
    return found[1]


def test_the_smallest_recipe_of_the_documentation_is_legal() -> None:
    assert validate(load_recipe(SMALLEST)) == ()


@pytest.mark.parametrize("fragment", FRAGMENTS, ids=_place)
def test_every_fragment_of_the_documentation_is_legal(fragment: str, tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "toy.obj").write_text("v 0 0 0\nv 90 0 0\nv 0 90 0\nv 0 0 90\nf 1 3 2\nf 1 2 4\nf 2 3 4\n")
    recipe: dict[str, Any] = parse_text(SMALLEST)
    oak = {"oak": {"kind": "diffuse", "reflectance": 0.3}}
    recipe["scene"]["materials"] = oak
    value = parse_text(fragment)
    apply_override(recipe, _place(fragment), value if _place(fragment) != "scene.materials" else oak | value)
    validate(load_recipe(recipe), base_dir=tmp_path, assets=MemoryAssets(small_car("sedan-01"), folder=tmp_path))


def test_the_committed_json_schema_has_the_definitions_of_the_documents() -> None:
    committed = json.loads((DOCS / "recipe-v1.schema.json").read_text(encoding="utf-8"))
    current = json_schema()

    def outline(schema: dict[str, Any]) -> dict[str, list[str]]:
        return {name: sorted(entry.get("properties", {})) for name, entry in {**schema["$defs"], "": schema}.items()}

    assert outline(committed) == outline(current), "run: python -m fullwell.schema > docs/recipe-v1.schema.json"


def test_the_json_schema_accepts_the_smallest_recipe_and_refuses_a_wrong_one() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    recipe: dict[str, Any] = parse_text(SMALLEST)
    jsonschema.validate(recipe, json_schema())
    wrong = copy.deepcopy(recipe)
    wrong["cameras"][0]["lens"]["f_number"] = -2
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(wrong, json_schema())


def test_the_sun_of_the_documentation_is_up(tmp_path: Path) -> None:
    fragment = next(f for f in FRAGMENTS if _place(f) == "scene.lights")
    sun = next(light for light in parse_text(fragment) if light["kind"] == "sun_sky")
    recipe: dict[str, Any] = parse_text(SMALLEST)
    recipe["scene"]["lights"] = [sun]
    from fullwell.schema import build_frame

    direction = np.array(build_frame(load_recipe(recipe)).scene.lights[0].sun_direction)  # type: ignore[union-attr]
    assert np.linalg.norm(direction) == pytest.approx(1)
    assert direction[2] > 0.8  # a summer morning in Munich, near noon
