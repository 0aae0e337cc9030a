"""What is asked of ingestion is checked, field by field, before any work."""

from __future__ import annotations

from typing import Any

import pytest

from fullwell.assets.records import LicenceRecord
from fullwell.core import FieldError
from fullwell.core.settings import Settings
from fullwell.jobs.asset_requests import RESERVED_IDS, AssetRequest, default_asset_id, ingest_limits, main_file

SHA = "ab" * 32


def request(**changes: Any) -> AssetRequest:
    given: dict[str, Any] = {
        "files": {"car.glb": SHA},
        "main": "",
        "asset_class": "car",
        "licence": LicenceRecord("cc0-1.0", "Ann"),
    }
    return AssetRequest(**given | changes)


def test_a_checked_request_is_in_normal_form_and_survives_its_json() -> None:
    checked = request(files={"./car.glb": SHA}, tags=("red", "red", "old"), variant={"colour": "red"}).checked()
    assert (checked.main, checked.id, checked.tags, checked.licence.spdx) == ("car.glb", "car", ("old", "red"), "CC0-1.0")
    assert AssetRequest.from_json(checked.to_json()) == checked
    assert checked.options().variants == {"colour": "red"}


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"asset_class": "cart"}, "class"),
        ({"licence": LicenceRecord("free for all")}, "licence"),
        ({"licence": LicenceRecord("")}, "licence"),
        ({"licence": LicenceRecord("CC0-1.0", "x" * 501)}, "attribution"),
        ({"id": "Not An Id"}, "id"),
        ({"id": "facets"}, "id"),
        ({"files": {"../car.glb": SHA}}, "files"),
        ({"files": {"car.glb": "abc"}}, "files"),
        ({"files": {"car.txt": SHA}}, "files"),
        ({"main": "other.glb"}, "main"),
        ({"unit_m": 0.0}, "unit_m"),
        ({"length_m": float("nan")}, "length_m"),
        ({"up_axis": "w"}, "up_axis"),
        ({"forward_axis": "forward"}, "forward_axis"),
        ({"tags": ("Not a tag",)}, "tags"),
    ],
)
def test_an_illegal_field_is_refused_by_its_name(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(FieldError) as caught:
        request(**changes).checked()
    assert caught.value.path.startswith(field)


def test_the_nearest_licence_is_suggested() -> None:
    with pytest.raises(FieldError, match=r"Did you mean CC0-1\.0"):
        request(licence=LicenceRecord("CC0")).checked()


def test_the_model_is_found_among_its_files_and_asked_for_where_several_can_be_it() -> None:
    assert main_file(["a/car.obj", "a/car.mtl", "a/t.png"]) == "a/car.obj"
    assert main_file(["kit.zip"]) == "kit.zip"
    with pytest.raises(FieldError, match="Name one of them in main"):
        main_file(["a.glb", "b.glb"])
    assert main_file(["a.glb", "b.glb"], "b.glb") == "b.glb"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Old Cars/Red Car (1).GLB", "red-car-1"),
        ("Übergröße.obj", "ubergroe"),
        ("facets.glb", "asset-facets"),
        ("x" * 200 + ".glb", "x" * 80),
    ],
)
def test_an_id_is_made_from_the_files_name(name: str, expected: str) -> None:
    assert default_asset_id(name) == expected
    assert expected not in RESERVED_IDS


def test_a_name_without_any_letter_gives_a_legal_id_too() -> None:
    assert default_asset_id("日本.glb").startswith("asset-")


def test_limits_follow_the_settings() -> None:
    limits = ingest_limits(Settings(ingest_time_limit_s=10, ingest_memory_bytes=1 << 30, max_upload_bytes=1 << 20))
    assert (limits.memory_bytes, limits.cpu_s, limits.wall_s, limits.input_bytes) == (1 << 30, 10.0, 15.0, 1 << 20)
