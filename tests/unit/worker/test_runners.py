"""The runner of a worker: jobs one after the other in the same process."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest

from fullwell.schema import load_recipe
from fullwell.schema.conversion import scenes
from fullwell.storage import LocalStore
from fullwell_worker.runners import PipelineRunner

RECIPE: dict[str, Any] = {
    "schema": "fullwell/recipe/v1",
    "name": "ball",
    "scene": {
        "objects": [
            {"id": "ball", "geometry": {"kind": "sphere", "radius_m": 1}, "material": {"kind": "diffuse", "reflectance": 0.5}}
        ],
        "lights": [{"kind": "constant_environment", "name": "sky", "luminance_cd_m2": 100, "spd": "D65"}],
    },
    "cameras": [
        {
            "name": "main",
            "pose": {"origin_m": [-6, 0, 0], "target_m": [0, 0, 0]},
            "lens": {"hfov_deg": 30, "f_number": 4},
            "sensors": [{"name": "main", "model": "ideal-rgb", "cols": 24, "rows": 16, "exposure": {"time_s": 0.01}}],
        }
    ],
    "outputs": ["image.png", "labels.json"],
    "quality": {"samples_per_pixel": 4},
}


def test_a_job_that_varies_only_its_sensor_makes_no_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    original = scenes.scene_of

    def counted(*arguments: Any, **named: Any) -> Any:
        made.append(arguments[1].document.name)
        return original(*arguments, **named)

    monkeypatch.setattr(scenes, "scene_of", counted)
    runner, store = PipelineRunner(), LocalStore(tmp_path)

    def run(recipe: dict[str, Any], prefix: str) -> dict[str, Any]:
        manifest: dict[str, Any] = runner(
            load_recipe(recipe), 0, store, prefix, base_dir=None, progress=None, should_cancel=None
        )
        return manifest

    run(RECIPE, "one")
    longer = copy.deepcopy(RECIPE) | {"name": "longer"}
    longer["cameras"][0]["sensors"][0]["exposure"]["time_s"] = 0.02
    manifest = run(longer, "two")
    assert made == ["ball"]
    assert manifest["run"]["cache"][0]["source"] in {"memory", "store"}
    assert any("labels reused" in note for note in manifest["run"]["notes"])
    other = copy.deepcopy(RECIPE) | {"name": "other"}
    other["scene"]["objects"][0]["geometry"]["radius_m"] = 0.5
    run(other, "three")
    assert made == ["ball", "other"]
