"""render, plan, validate and show as a user types them: output, exit codes, one clear error."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from commands import fullwell

RECIPE = """
schema: fullwell/recipe/v1
name: ball
seed: 1
scene:
  objects:
    - {id: floor, class: ground, geometry: {kind: rectangle, size_m: [20, 20]}, material: {kind: diffuse, reflectance: 0.3}}
    - {id: ball, class: ball, geometry: {kind: sphere, radius_m: 0.5}, transform: {translate_m: [0, 0, 0.5]},
       material: {kind: diffuse, reflectance: "colorchecker:red"}}
  lights: [{name: sky, kind: constant_environment, luminance_cd_m2: 1000, spd: D65}]
cameras:
  - name: main
    pose: {origin_m: [4, -4, 2], target_m: [0, 0, 0.5]}
    lens: {kind: pinhole, hfov_deg: 30, f_number: 2}
    sensors: [{name: phone, rows: 12, cols: 16}]
quality: {samples_per_pixel: 2, max_depth: 3}
vary: {grid: {seed: [1, 2, 3]}}
"""


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    path = tmp_path / "ball.yaml"
    path.write_text(RECIPE)
    return path


def test_render_makes_the_frames_asked_for_and_show_draws_one(recipe: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = fullwell("render", recipe, "-o", out, "--frames", "1-2", "--json")
    assert done.returncode == 0, done.stderr
    frames = json.loads(done.stdout)["frames"]
    assert [frame["index"] for frame in frames] == [1, 2]
    assert sorted(path.name for path in (out / "frames").iterdir()) == ["1", "2"]
    shown = fullwell("show", out / "frames" / "1")
    assert shown.returncode == 0, shown.stderr
    assert (out / "frames" / "1" / "show.png").read_bytes().startswith(b"\x89PNG")


def test_show_of_a_render_with_several_frames_asks_which(recipe: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    fullwell("render", recipe, "-o", out, "--frames", "0-1", "--set", "outputs=[labels.json]")
    shown = fullwell("show", out)
    assert shown.returncode == 1
    assert "holds 2 frames; name one" in shown.stderr


def test_changed_recipe_needs_force_to_replace_a_frame(recipe: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("render", recipe, "-o", out, "--frames", "0", "--set", "outputs=[labels.json]")
    assert fullwell(*words).returncode == 0
    changed = fullwell(*words, "--set", "scene.objects[1].geometry.radius_m=0.4")
    assert changed.returncode == 1
    assert "another frame is published" in changed.stderr
    assert fullwell(*words, "--set", "scene.objects[1].geometry.radius_m=0.4", "--force").returncode == 0


def test_plan_names_the_stages_that_are_skipped(recipe: Path) -> None:
    done = fullwell("plan", recipe, "--set", "outputs=[labels.json]", "--json")
    assert done.returncode == 0, done.stderr
    skipped = {step["what"] for step in json.loads(done.stdout)["plan"] if step["decision"] == "skip"}
    assert "radiance" in skipped


def test_validate_says_how_many_frames(recipe: Path) -> None:
    done = fullwell("validate", recipe)
    assert done.returncode == 0
    assert "3 frames" in done.stdout


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("scene.objects[1].geometry.radius_m=.nan", "scene.objects[1].geometry.radius_m is nan"),
        ("scene.objects[1].geometry.radius_m=-1", "must be > 0"),
        ("cameras[0].sensors[0].model=imx636", "did you mean 'imx363'"),
        ("cameras[0].sensors[0].rows=1000000000", "must be >= 1 and <= 20000"),
        ("scene.objects=[]", "scene"),
        ("cameras[0].pose.origin_m=[0, 0.1, 0.5]", "inside the opaque object 'ball'"),
        ("scene.objects[1].geometry={kind: model, file: no.glb}", "does not exist"),
        (
            "scene.lights=[{name: beam, kind: spot, position_m: [0, 0, 3], direction: [0, 0, -1], beam_deg: 0.01, "
            "cutoff_deg: 0.05, luminous_intensity_cd: 9, spd: A}]",
            "cutoff_deg >= 0.2",
        ),
    ],
)
def test_nonsense_gets_one_clear_error_and_leaves_nothing_behind(
    recipe: Path, tmp_path: Path, override: str, expected: str
) -> None:
    out = tmp_path / "out"
    words = ["render", recipe, "-o", out, "--set", override]
    if override == "scene.objects=[]":
        words += ["--set", "scene.lights=[]"]
    done = fullwell(*words)
    assert done.returncode == 1
    assert expected in done.stderr
    assert done.stderr.count("error:") == 1
    assert "Traceback" not in done.stderr
    assert not (out / "frames").exists()


@pytest.mark.parametrize("words", [("render",), ("render", "x.yaml", "--nosuch"), ("nosuch",)])
def test_wrong_usage_has_exit_code_two(words: tuple[str, ...]) -> None:
    assert fullwell(*words).returncode == 2


def test_frames_outside_the_recipe_are_refused(recipe: Path) -> None:
    done = fullwell("render", recipe, "--frames", "2-9")
    assert done.returncode == 1
    assert "frames 0 to 2" in done.stderr
