"""A frame is complete, published once, repeatable, and does no more than its outputs need."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fullwell.core.errors import CancelledError, ConflictError
from fullwell.core.hashing import sha256_hex
from fullwell.dataset import encode
from fullwell.pipeline import FrameProgress, LightCache, plan_frame, render_frame, run_frame
from fullwell.pipeline.kept_labels import _last as kept_labels
from fullwell.schema import build_frame, load_recipe
from fullwell.storage import LocalStore


def make(recipe: dict[str, Any], folder: Path, index: int = 0, **options: Any) -> tuple[dict[str, Any], LocalStore]:
    store = LocalStore(folder)
    return run_frame(load_recipe(recipe), index, store, f"frames/{index}", **options), store


def test_every_product_asked_for_is_there_with_its_digest(recipe: dict[str, Any], tmp_path: Path) -> None:
    manifest, store = make(recipe, tmp_path)
    listed = {product["name"]: product["sha256"] for product in manifest["products"]}
    assert sorted(listed) == sorted(recipe["outputs"])
    for name, digest in listed.items():
        assert sha256_hex(store.get(f"frames/0/{name}")) == digest
    assert encode.decode_json(store.get("frames/0/manifest.json")) == json.loads(json.dumps(manifest))


def test_products_agree_with_each_other(recipe: dict[str, Any], tmp_path: Path) -> None:
    manifest, store = make(recipe, tmp_path)
    raw = encode.decode_raw_npz(store.get("frames/0/raw.npz"))
    instances = encode.decode_ids_png(store.get("frames/0/instances.png"))
    semantic = encode.decode_ids_png(store.get("frames/0/semantic.png"))
    depth = encode.decode_depth_exr(store.get("frames/0/depth.exr"))
    labels = encode.decode_json(store.get("frames/0/labels.json"))
    image = encode.decode_rgb_png(store.get("frames/0/image.png"))
    assert raw.dn.shape == instances.shape == semantic.shape == image.shape[:2] == (16, 24)
    table = {entry["id"]: entry["instance"] for entry in manifest["instances"]}
    ball = next(item for item in labels["objects"] if item["id"] == "ball")
    assert ball["instance"] == table["ball"]
    assert ball["visible_px"] == np.count_nonzero(instances == table["ball"])
    assert set(np.unique(semantic[instances == table["ball"]])) == {ball["class_id"]}
    assert np.all(np.isinf(depth.depth_z_m) == (instances == 0))
    assert manifest["cameras"][0]["sensors"][0]["exposure_time_s"] == 0.005


def test_no_stage_lets_a_nan_or_a_negative_photon_through(recipe: dict[str, Any], tmp_path: Path) -> None:
    _, store = make(recipe, tmp_path)
    radiance = encode.decode_radiance_exr(store.get("frames/0/radiance.exr"))
    irradiance = encode.decode_irradiance_exr(store.get("frames/0/irradiance.exr"))
    for photons in (radiance.photons, irradiance.photons):
        assert np.all(np.isfinite(photons))
        assert photons.min() >= 0
        assert photons.max() > 0


PRODUCE = """
import sys, json, drjit
from fullwell.render import activate
activate()
drjit.set_thread_count(int(sys.argv[1]))
from fullwell.pipeline import run_frame
from fullwell.schema import load_recipe
from fullwell.storage import LocalStore
manifest = run_frame(load_recipe(json.loads(sys.stdin.read())), 0, LocalStore(sys.argv[2]), "f")
print(json.dumps({p["name"]: p["sha256"] for p in manifest["products"]}))
"""


@pytest.mark.slow
def test_same_recipe_gives_the_same_bytes_in_another_process_with_another_number_of_threads(
    recipe: dict[str, Any], tmp_path: Path
) -> None:
    def digests(threads: int) -> Any:
        command = [sys.executable, "-c", PRODUCE, str(threads), str(tmp_path / str(threads))]
        done = subprocess.run(command, input=json.dumps(recipe), env=os.environ, check=True, capture_output=True, text=True)
        return json.loads(done.stdout)

    assert digests(1) == digests(4)


def test_another_seed_gives_another_noise_but_the_same_labels(recipe: dict[str, Any], tmp_path: Path) -> None:
    first, _ = make(recipe, tmp_path / "a")
    second, _ = make(recipe | {"seed": 4}, tmp_path / "b")
    one = {p["name"]: p["sha256"] for p in first["products"]}
    two = {p["name"]: p["sha256"] for p in second["products"]}
    for name in ("raw.npz", "radiance.exr", "image.png"):
        assert one[name] != two[name]
    for name in ("labels.json", "instances.png", "depth.exr", "semantic.png", "normals.exr"):
        assert one[name] == two[name]


def test_what_is_kept_between_frames_of_a_scene_changes_no_byte(recipe: dict[str, Any], tmp_path: Path) -> None:
    """Labels, their files and the error of the light are worked out once for a scene, here by a frame with another sensor."""
    longer = json.loads(json.dumps(recipe))
    longer["cameras"][0]["sensors"][0]["exposure"] = {"time_s": 0.02}
    frames = [build_frame(load_recipe(document), 0) for document in (recipe, longer)]
    frames[1] = replace(frames[1], scene=frames[0].scene)
    alone = render_frame(frames[1], LocalStore(tmp_path / "alone"), "f")
    kept_labels.clear()
    cache, store = LightCache(), LocalStore(tmp_path / "together")
    first, second = (render_frame(frame, store, f"f{number}", cache=cache) for number, frame in enumerate(frames))
    assert second["run"]["cache"][0]["source"] == "memory"
    assert second["products"] == alone["products"] != first["products"]
    for what in ("sensors", "camera_to_world"):
        assert second["cameras"][0][what] == alone["cameras"][0][what]
    error = "relative_standard_error_rms"
    assert second["cameras"][0]["radiance"][error] == alone["cameras"][0]["radiance"][error] > 0


def test_published_frame_is_returned_without_work(
    recipe: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, _ = make(recipe, tmp_path)
    monkeypatch.setattr("fullwell.pipeline.frame.render_light", None)
    again, _ = make(recipe, tmp_path)
    assert again == json.loads(json.dumps(first))


def test_another_recipe_does_not_overwrite_a_published_frame(recipe: dict[str, Any], tmp_path: Path) -> None:
    make(recipe, tmp_path)
    with pytest.raises(ConflictError, match="another frame is published"):
        make(recipe | {"seed": 9}, tmp_path)


def test_products_without_a_manifest_are_overwritten(recipe: dict[str, Any], tmp_path: Path) -> None:
    """What a worker that died before the commit point leaves behind."""
    manifest, store = make(recipe, tmp_path)
    store.delete("frames/0/manifest.json")
    store.put("frames/0/image.png", b"half a picture")
    again, _ = make(recipe, tmp_path)
    assert again["products"] == manifest["products"]
    assert sha256_hex(store.get("frames/0/image.png")) in {p["sha256"] for p in manifest["products"]}


def test_cancelled_frame_publishes_nothing(recipe: dict[str, Any], tmp_path: Path) -> None:
    seen: list[FrameProgress] = []
    with pytest.raises(CancelledError):
        make(recipe | {"seed": 11}, tmp_path, progress=seen.append, should_cancel=lambda: len(seen) > 2)
    assert not LocalStore(tmp_path).exists("frames/0/manifest.json")


def test_progress_grows_from_zero_to_one(recipe: dict[str, Any], tmp_path: Path) -> None:
    seen: list[FrameProgress] = []
    make(recipe | {"seed": 12}, tmp_path, progress=seen.append)
    fractions = [step.fraction for step in seen]
    assert fractions == sorted(fractions)
    assert fractions[0] == 0.0
    assert fractions[-1] == 1.0


def test_labels_alone_render_nothing(recipe: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fullwell.pipeline.frame.render_light", None)
    manifest, _ = make(recipe | {"outputs": ["instances.png", "labels.json"]}, tmp_path)
    skipped = {step["what"] for step in manifest["plan"] if step["decision"] == "skip"}
    assert {"radiance", "optics", "sensor", "display"} <= skipped


def test_sweep_over_exposure_renders_once(recipe: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import fullwell.pipeline.frame as frame_module

    calls: list[int] = []
    original = frame_module.render_light

    def counted(*args: Any, **options: Any) -> Any:
        calls.append(1)
        return original(*args, **options)

    monkeypatch.setattr(frame_module, "render_light", counted)
    swept = recipe | {"vary": {"grid": {"cameras[0].sensors[0].exposure.time_s": [0.001, 0.004]}}}
    document, store, cache = load_recipe(swept), LocalStore(tmp_path), LightCache()
    manifests = [render_frame(build_frame(document, i), store, f"f/{i}", cache=cache) for i in range(2)]
    assert len(calls) == 1
    electrons = [m["cameras"][0]["sensors"][0]["mean_electrons"] for m in manifests]
    assert electrons[1] == pytest.approx(4 * electrons[0], rel=1e-5)


def test_several_cameras_and_sensors_have_their_own_folders(recipe: dict[str, Any], tmp_path: Path) -> None:
    first = recipe["cameras"][0]
    second = json.loads(json.dumps(first))
    second["name"] = "rear"
    second["sensors"].append(second["sensors"][0] | {"name": "small", "rows": 8, "cols": 12})
    manifest, _ = make(recipe | {"cameras": [first, second], "outputs": ["image.png", "instances.png"]}, tmp_path)
    names = {product["name"] for product in manifest["products"]}
    assert names == {
        "main/image.png",
        "main/instances.png",
        "rear/phone/image.png",
        "rear/phone/instances.png",
        "rear/small/image.png",
        "rear/small/instances.png",
    }


def test_plan_says_what_is_skipped_and_why(recipe: dict[str, Any]) -> None:
    plan = plan_frame(build_frame(load_recipe(recipe | {"outputs": ["radiance.exr"]})))
    assert plan.radiance
    assert not plan.sensor
    assert all(step.why for step in plan.steps)


@pytest.mark.parametrize(("pixel_pitch_m", "decision"), [(1.4e-6, "run"), (2e-3, "skip")])
def test_plan_leaves_diffraction_out_where_samples_are_too_coarse_and_the_run_agrees(
    recipe: dict[str, Any], tmp_path: Path, pixel_pitch_m: float, decision: str
) -> None:
    recipe["cameras"][0]["sensors"][0]["pixel_pitch_m"] = pixel_pitch_m
    manifest, _ = make(recipe, tmp_path)
    (step,) = (step for step in manifest["plan"] if step["what"] == "main: diffraction")
    assert step["decision"] == decision
    left_out = any("diffraction: left out in 31 of 31 bands" in note for note in manifest["run"]["notes"])
    assert left_out == (decision == "skip")
