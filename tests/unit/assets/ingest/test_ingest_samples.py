"""Models made by others: the samples, and what eclipse-sumo ships."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from fullwell.assets.ingest import IngestOptions, prepare_file, read_level
from fullwell.assets.records import Check, PreparedAsset

ROOT = Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT))  # benchmarks/ is no part of the distribution

from benchmarks.ingestion import make_samples, packaged_samples, shared_samples  # noqa: E402

pytest.importorskip("trimesh")
pytest.importorskip("pxr")

KIT_CAR_LENGTH_M = 4.67
"""466.5 units of a kit made in centimetres."""


def check(prepared: PreparedAsset, name: str) -> Check:
    return next(entry for entry in prepared.manifest.checks if entry.name == name)


def sound(prepared: PreparedAsset) -> None:
    assert prepared.manifest.blobs() == set(prepared.blobs)
    assert {c.state for c in prepared.manifest.checks} <= {"ok", "mended", "warning", "decide"}
    for level in prepared.manifest.levels:
        model = read_level(prepared.blobs[level.sha256])
        assert model.triangle_count == level.triangles
        low, high = model.bounds_m
        slack_m = 1.01 * level.error_m + 1e-5 * max(high - low)
        assert abs(low[2]) <= slack_m, "it stands on the ground, coarser levels within their error"
        assert np.abs(low + high)[:2].max() <= 2 * slack_m


@pytest.mark.slow
@pytest.mark.parametrize(("folder", "count"), [("kenney_city", 15), ("kenney_vehicles", 3), ("usd_mini_car_kit", 5)])
def test_every_sample_is_taken_in(samples: Path, folder: str, count: int) -> None:
    found = [sample for sample in shared_samples(samples) if sample.folder.name == folder]
    assert len(found) == count
    for sample in found:
        sound(prepare_file(sample.folder, sample.main, sample.options, isolated=True))


@pytest.mark.slow
def test_every_model_of_the_sumo_package_is_taken_in() -> None:
    found = [sample for sample in packaged_samples() if sample.name != "tram"]
    if not found:
        pytest.skip("eclipse-sumo is not installed")
    for sample in found:
        options = sample.options.with_changes(source_kind="package")
        sound(prepare_file(sample.folder, sample.main, options, isolated=True))


@pytest.mark.slow
def test_the_samples_in_other_formats_are_taken_in(samples: Path, tmp_path: Path) -> None:
    sizes = {}
    for folder, mains in make_samples(samples, tmp_path):
        for main in mains:
            prepared = prepare_file(folder, main, IngestOptions(id="made", asset_class="car"), isolated=True)
            sound(prepared)
            sizes[main] = prepared.manifest.size_m
    trucks = [size for main, size in sizes.items() if main.startswith("truck")]
    assert len(trucks) == 5
    assert np.allclose(trucks, trucks[0], atol=1e-3), "one model, whatever the format"


@pytest.mark.parametrize("name", ["vehicle-truck-green", "vehicle-truck-red", "vehicle-motorcycle"])
def test_gltf_vehicles_face_forward_by_their_wheels(samples: Path, name: str) -> None:
    prepared = prepare_file(samples / "kenney_vehicles", f"{name}.glb", IngestOptions(id="v", asset_class="car"))
    assert prepared.manifest.source.forward_axis == "z"
    assert check(prepared, "forward_axis").state == "ok"
    model = read_level(prepared.blobs[prepared.manifest.levels[0].sha256])
    middles = {part.name: part.vertices_m.mean(axis=0) for part in model.parts}
    assert all(place[0] > 0 for part, place in middles.items() if "front" in part)
    assert all(place[0] < 0 for part, place in middles.items() if "back" in part)
    assert all(place[1] > 0 for part, place in middles.items() if "left" in part)


def test_the_usd_sedan_is_found_to_be_in_centimetres(samples: Path) -> None:
    kit = samples / "usd_mini_car_kit"
    main = "assets/vehicles/sedan/asset/sedanFullAsset.usda"
    prepared = prepare_file(kit, main, IngestOptions(id="sedan", asset_class="car", tags=("sedan",)), isolated=True)
    manifest = prepared.manifest
    assert manifest.source.unit_m == 0.01
    assert manifest.size_m[0] == pytest.approx(KIT_CAR_LENGTH_M, abs=0.01)
    assert check(prepared, "unit").state == "decide", "the file claims metres"
    assert check(prepared, "size").state == "ok"
    model = read_level(prepared.blobs[manifest.levels[0].sha256])
    lamps = {part.name.rsplit("_", 1)[1]: part.vertices_m.mean(axis=0)[0] for part in model.parts if "Light" in part.name}
    assert lamps["frontLightMax"] > 1.5
    assert lamps["backLightMax"] < -1.5
    assert len(manifest.source.files) > 10, "the layers and pictures that it is made of"


def test_the_variants_of_the_usd_wheel_are_named_and_can_be_chosen(samples: Path) -> None:
    kit, main = samples / "usd_mini_car_kit", "assets/wheels/wheelVariants.usda"
    usual = prepare_file(kit, main, IngestOptions(id="wheel"), isolated=True)
    message = check(usual, "variants").message
    assert all(name in message for name in ("wheelBlack", "wheelLargeRim", "wheelNormal", "wheelRed", "wheelVintage"))
    other = prepare_file(kit, main, IngestOptions(id="wheel", variants={"wheels": "wheelVintage"}), isolated=True)
    assert all("wheelVintage" in part.name for part in other.manifest.parts)
    assert other.manifest.look_digest != usual.manifest.look_digest


def test_a_toy_is_scaled_to_the_length_that_a_person_states(samples: Path) -> None:
    options = IngestOptions(id="truck", asset_class="van", length_m=4.8)
    manifest = prepare_file(samples / "kenney_vehicles", "vehicle-truck-red.glb", options).manifest
    assert manifest.size_m[0] == pytest.approx(4.8)
