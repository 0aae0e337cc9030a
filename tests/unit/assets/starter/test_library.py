"""The starter library as a whole: enough of everything, prepared for the store, and still what its list says."""

from __future__ import annotations

import json
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from fullwell.assets.classes import ASSET_CLASSES
from fullwell.assets.ingest import read_level
from fullwell.assets.records import AssetManifest
from fullwell.assets.starter.library import (
    catalogue_row,
    packaged_assets,
    packaged_ids,
    prepare_starter,
    starter_entries,
    starter_entry,
)
from fullwell.core.hashing import canonical_json, sha256_hex

CATALOGUE = Path(__file__).parents[4] / "assets" / "catalogue.json"

SAMPLE = (
    "bench-park",
    "sign-speed-limit-50",
    "street-light-led-8",
    "clutter-pallet",
    "bin-wheelie-240",
    "building-terrace-yellow",
)
"""Quick to make, and of every kind of generator here; the slow test makes all."""


@cache
def _listed() -> dict[str, dict[str, Any]]:
    return {row["id"]: row for row in json.loads(CATALOGUE.read_text(encoding="utf-8"))}


def test_ids_are_unique_and_the_list_holds_them_all() -> None:
    ids = [entry.id for entry in starter_entries()]
    assert len(set(ids)) == len(ids)
    assert set(_listed()) == set(ids) | set(packaged_ids())


def test_the_library_has_at_least_eighty_assets_in_twenty_five_classes() -> None:
    classes = Counter(row["class"] for row in _listed().values())
    assert classes.total() >= 80
    assert len(classes) >= 25
    assert set(classes) <= set(ASSET_CLASSES)


def test_the_list_names_only_licences_that_may_be_shipped() -> None:
    assert {row["licence"] for row in _listed().values()} <= {"Apache-2.0", "EPL-2.0 OR GPL-2.0-or-later"}
    assert {row["licence"] for row in _listed().values() if not row["id"].startswith("sumo-")} == {"Apache-2.0"}


@pytest.mark.parametrize("asset_id", SAMPLE)
def test_generators_still_make_what_the_list_says(asset_id: str) -> None:
    assert catalogue_row(prepare_starter(starter_entry(asset_id)).manifest) == _listed()[asset_id]


@pytest.mark.slow
@pytest.mark.parametrize("asset_id", [entry.id for entry in starter_entries()])
def test_all_generators_still_make_what_the_list_says(asset_id: str) -> None:
    manifest = prepare_starter(starter_entry(asset_id)).manifest
    assert catalogue_row(manifest) == _listed()[asset_id]
    assert not manifest.needs_decision


def test_a_prepared_asset_says_how_to_make_it_again() -> None:
    asset = prepare_starter(starter_entry("sign-speed-limit-50"))
    source, licence = asset.manifest.source, asset.manifest.licence
    assert source.kind == "generator"
    assert source.name == "fullwell.assets.starter.signs.traffic_sign"
    assert source.parameters == {"parameters": {"sign": "speed_limit_50"}, "seed": 105}
    assert (licence.spdx, licence.attribution) == ("Apache-2.0", "The Fullwell developers")
    stored = json.loads(canonical_json(asset.manifest.document()))
    assert AssetManifest.from_document(stored).digest == asset.manifest.digest


def test_parameters_of_every_generator_are_plain_data() -> None:
    from fullwell.assets.starter.library import _plain

    for entry in starter_entries():
        assert json.loads(json.dumps(_plain(entry.parameters))) == _plain(entry.parameters)


def test_blobs_are_the_files_that_the_manifest_names() -> None:
    asset = prepare_starter(starter_entry("bench-park"))
    assert {sha256_hex(content) for content in asset.blobs.values()} == set(asset.manifest.blobs())
    finest = asset.manifest.levels[0]
    parts = read_level(asset.blobs[finest.sha256]).parts
    assert sum(len(part.faces) for part in parts) == finest.triangles
    assert {part.name for part in parts} == {part.name for part in asset.manifest.parts}


@pytest.mark.skipif(not packaged_ids(), reason="eclipse-sumo is not installed")
def test_packaged_models_come_in_true_size_under_their_own_licence() -> None:
    wanted = ("sumo-car-normal-citrus", "sumo-humanresting", "sumo-tlr")
    found = {asset.manifest.id: asset.manifest for asset in packaged_assets(wanted)}
    assert set(found) == set(wanted)
    car, person, signal = (found[name] for name in wanted)
    assert (car.asset_class, person.asset_class) == ("car", "pedestrian")
    assert car.size_m[0] == pytest.approx(3.7)
    assert person.size_m[2] == pytest.approx(1.8, abs=0.01)
    for manifest in found.values():
        assert manifest.licence.spdx == "EPL-2.0 OR GPL-2.0-or-later"
        assert manifest.source.kind == "package"
        assert not manifest.needs_decision
        assert catalogue_row(manifest) == _listed()[manifest.id]
    assert {part.name: part.material.name for part in signal.parts}["Red"] == "lamp/traffic_red"


@pytest.mark.skipif(not packaged_ids(), reason="eclipse-sumo is not installed")
def test_a_packaged_car_faces_forward() -> None:
    (asset,) = packaged_assets(("sumo-car-normal-citrus",))
    parts = {part.name: part for part in read_level(asset.blobs[asset.manifest.levels[0].sha256]).parts}
    assert parts["lights"].vertices_m[:, 0].mean() > 0.5 > -0.5 > parts["lights.red"].vertices_m[:, 0].mean()
