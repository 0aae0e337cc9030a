"""The examples: each is legal, and its YAML and its Python are the same recipe and give the same bytes."""

from __future__ import annotations

import importlib.util
import runpy
from pathlib import Path
from typing import Any

import pytest

from assets_in_memory import MemoryAssets, street_boxes
from fullwell.schema import RecipeBuilder, load_recipe, validate

EXAMPLES = Path(__file__).parents[3] / "examples"
NAMES = sorted(path.stem for path in EXAMPLES.glob("[0-9]*.yaml"))


def python_recipe(name: str) -> dict[str, Any]:
    recipe: dict[str, Any] = runpy.run_path(str(EXAMPLES / f"{name}.py"))["RECIPE"]
    return recipe


def needs(name: str) -> None:
    if "street" in name and importlib.util.find_spec("sumo") is None:
        pytest.skip("eclipse-sumo, which brings the models, is not installed")


def test_every_example_exists_in_both_languages_and_is_listed() -> None:
    assert NAMES
    assert sorted(path.stem for path in EXAMPLES.glob("[0-9]*.py")) == NAMES
    listed = (EXAMPLES / "README.md").read_text()
    assert all(name in listed for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_yaml_and_python_are_the_same_recipe(name: str) -> None:
    assert load_recipe(EXAMPLES / f"{name}.yaml").canonical_json() == load_recipe(python_recipe(name)).canonical_json()


@pytest.fixture
def assets(tmp_path: Path) -> MemoryAssets:
    """A box for everything that streets are made of: what they look like is for pictures to show."""
    return MemoryAssets(*street_boxes(), folder=tmp_path)


@pytest.mark.parametrize("name", NAMES)
def test_every_example_is_valid_with_the_files_it_names(name: str, assets: MemoryAssets) -> None:
    needs(name)
    document = load_recipe(EXAMPLES / f"{name}.yaml")
    validate(document, base_dir=document.base_dir, assets=assets)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_yaml_and_python_give_the_same_bytes(name: str, tmp_path: Path, assets: MemoryAssets) -> None:
    pytest.importorskip("mitsuba")
    needs(name)
    from fullwell.pipeline import run_frame
    from fullwell.storage import LocalStore

    quick = {
        "quality": {"noise_ratio": 1.0, "max_samples_per_pixel": 8},
        "cameras[0].sensors[0].rows": 24,
        "cameras[0].sensors[0].cols": 32,
    }
    hashes = []
    for kind, source in (("yaml", EXAMPLES / f"{name}.yaml"), ("python", python_recipe(name))):
        document = load_recipe(source, overrides=quick)
        builder = RecipeBuilder(document, base_dir=EXAMPLES, assets=assets)
        manifest = run_frame(document, 0, LocalStore(tmp_path / kind), "frames/0", builder=builder)
        hashes.append({product["name"]: product["sha256"] for product in manifest["products"]})
    assert hashes[0] == hashes[1]
