"""Recipes that differ only in how a scene is looked at share the scene that their process made."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from assets_in_memory import MemoryAssets, small_car, street_boxes
from fullwell.schema import KeptScene, RecipeBuilder, RecipeError, load_recipe
from fullwell.schema.assets import pin_assets
from fullwell.traffic.networks import NetworkSpec, make_network


@pytest.fixture
def model_recipe(recipe: dict[str, Any], tmp_path: Path) -> Path:
    """A recipe with a model file of the user's own, in a folder."""
    recipe["scene"]["objects"].append(
        {"id": "cube", "geometry": {"kind": "model", "file": "cube.obj", "unit_m": 1, "up_axis": "z"}, "material": "grey"}
    )
    recipe["scene"].setdefault("materials", {})["grey"] = {"kind": "diffuse", "reflectance": 0.2}
    (tmp_path / "cube.obj").write_text(trimesh.creation.box((0.1, 0.1, 0.1)).export(file_type="obj"))
    file = tmp_path / "recipe.yaml"
    file.write_text(json.dumps(recipe))
    return file


def with_contrast(recipe: dict[str, Any], contrast: float) -> dict[str, Any]:
    other = copy.deepcopy(recipe)
    other["cameras"][0]["sensors"][0]["isp"] = {"tone": {"contrast": contrast}}
    return other


def test_another_sensor_finds_the_scene_made(recipe: dict[str, Any]) -> None:
    kept = KeptScene()
    first, second = (RecipeBuilder(load_recipe(with_contrast(recipe, c)), kept=kept).frame(0) for c in (1.0, 1.2))
    assert first.scene is second.scene
    assert first.recipe_json != second.recipe_json
    alone = RecipeBuilder(load_recipe(with_contrast(recipe, 1.2))).frame(0)
    assert second.recipe_json == alone.recipe_json
    assert (second.warnings, second.count, second.quality) == (alone.warnings, alone.count, alone.quality)


def test_builders_share_nothing_unless_they_are_told_to(recipe: dict[str, Any]) -> None:
    first, second = (RecipeBuilder(load_recipe(recipe)).frame(0) for _ in range(2))
    assert first.scene is not second.scene


def test_another_scene_or_other_bands_are_made_anew(recipe: dict[str, Any]) -> None:
    kept = KeptScene()
    first = RecipeBuilder(load_recipe(recipe), kept=kept).frame(0)
    other = copy.deepcopy(recipe)
    other["scene"]["lights"].append(
        {"kind": "point", "name": "p", "position_m": [0, 0, 3], "luminous_intensity_cd": 5, "spd": "A"}
    )
    assert len(RecipeBuilder(load_recipe(other), kept=kept).frame(0).scene.lights) == len(first.scene.lights) + 1
    assert RecipeBuilder(load_recipe(recipe | {"spectral": {"step_nm": 20}}), kept=kept).frame(0).scene is not first.scene


def test_a_changed_model_file_is_read_again(model_recipe: Path) -> None:
    kept = KeptScene()

    def frame() -> Any:
        return RecipeBuilder(load_recipe(model_recipe), kept=kept).frame(0)

    first, second = frame(), frame()
    assert first.scene is second.scene
    (model_recipe.parent / "cube.obj").write_text(trimesh.creation.box((0.2, 0.2, 0.2)).export(file_type="obj"))
    third = frame()
    assert third.scene is not first.scene
    assert float(third.scene.objects[-1].parts[0].geometry.vertices_m.max()) == pytest.approx(0.1)


def test_a_recipe_from_elsewhere_does_not_get_at_anothers_files(model_recipe: Path, tmp_path: Path) -> None:
    kept = KeptScene()
    RecipeBuilder(load_recipe(model_recipe), kept=kept).frame(0)
    empty = tmp_path / "empty"
    empty.mkdir()
    sent = load_recipe(json.loads(model_recipe.read_text()))
    with pytest.raises(RecipeError, match=r"cube\.obj.*does not exist"):
        RecipeBuilder(sent, base_dir=empty, kept=kept).frame(0)


def test_only_pinned_draws_are_shared(recipe: dict[str, Any], tmp_path: Path) -> None:
    recipe["scene"]["objects"].append({"id": "car", "geometry": {"kind": "asset", "class": "car"}})
    few = MemoryAssets(small_car("sedan-a"), folder=tmp_path)
    kept = KeptScene()
    first = RecipeBuilder(load_recipe(recipe), assets=few, kept=kept).frame(0)
    other = MemoryAssets(small_car("sedan-b"), folder=tmp_path)
    second = RecipeBuilder(load_recipe(recipe), assets=other, kept=kept).frame(0)
    assert first.recipe_json != second.recipe_json
    pinned = pin_assets(load_recipe(recipe), few)
    third, fourth = (RecipeBuilder(pinned, assets=few, kept=kept).frame(0) for _ in range(2))
    assert third.scene is fourth.scene


def test_roads_of_another_folder_are_another_scene(tmp_path: Path) -> None:
    store = MemoryAssets(*street_boxes(), folder=tmp_path)
    recipe = {
        "schema": "fullwell/recipe/v1",
        "name": "roads",
        "scene": {
            "traffic": {"network": {"file": "roads.net.xml"}, "time_s": 1, "dressed": False},
            "lights": [{"name": "sky", "kind": "constant_environment", "luminance_cd_m2": 3000, "spd": "D65"}],
        },
        "cameras": [
            {
                "name": "mast",
                "pose": {"origin_m": [92, 92, 6], "target_m": [100, 100, 0]},
                "lens": {"kind": "pinhole", "hfov_deg": 60, "f_number": 4},
                "sensors": [{"name": "s", "model": "imx363", "rows": 48, "cols": 64, "exposure": {"time_s": 0.001}}],
            }
        ],
        "outputs": ["labels.json"],
    }
    folders = []
    for length_m in (200.0, 300.0):
        folders.append(tmp_path / f"{length_m:g}")
        folders[-1].mkdir()
        (folders[-1] / "roads.net.xml").write_bytes(make_network(NetworkSpec("cross", length_m=length_m)).xml)
    kept, pinned = KeptScene(), pin_assets(load_recipe(recipe), store)

    def scene(folder: Path) -> Any:
        return RecipeBuilder(pinned, base_dir=folder, assets=store, kept=kept).frame(0).scene

    short, again, long = scene(folders[0]), scene(folders[0]), scene(folders[1])
    assert short is again
    assert long is not short
    reaches = [max(float(np.abs(part.geometry.vertices_m).max()) for part in s.objects[0].parts) for s in (short, long)]
    assert reaches[1] > reaches[0]
