"""What the curation page says of sizes, times, versions, materials and imports."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from assets_in_memory import small_car
from fullwell.assets.materials.catalogue import asset_material_names
from fullwell.assets.records import AssetManifest, Check, LicenceRecord, MaterialChoice
from fullwell.jobs.asset_records import AssetEntry
from fullwell.jobs.ingestions import IngestionRecord, IngestionState, StoredAsset
from fullwell_api.web.curation.comparing import differences
from fullwell_api.web.curation.spectra import chart_options, curve_of, material_lines, material_title, swatch
from fullwell_api.web.curation.uploads import row_of
from fullwell_api.web.curation.words import ago, bytes_text, card, short_size_text, size_text, turntable_pictures


def entry(manifest: AssetManifest, version: int = 1, **changes: object) -> AssetEntry:
    made = AssetEntry(manifest.id, version, manifest.digest, manifest, "pending", created_at=0.0, created_by="maria")
    return replace(made, **changes)  # type: ignore[arg-type]


def test_sizes_have_the_digits_that_matter() -> None:
    assert size_text((4.617, 1.8, 0.0451)) == "4.62 × 1.80 × 0.045 m"
    assert short_size_text((14.83, 4.617, 0.0451)) == "15 × 4.6 × 0.05 m"


@pytest.mark.parametrize(
    ("count", "text"), [(0, "0 B"), (1023, "1023 B"), (1536, "1.5 KiB"), (3 << 20, "3.0 MiB"), (5 << 30, "5.0 GiB")]
)
def test_bytes_are_told_in_the_unit_that_suits(count: int, text: str) -> None:
    assert bytes_text(count) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (-5, "just now"),
        (59, "just now"),
        (60, "1 minute ago"),
        (7199, "1 hour ago"),
        (7200, "2 hours ago"),
        (90000, "1 day ago"),
    ],
)
def test_times_are_told_as_how_long_ago(seconds: float, text: str) -> None:
    assert ago(1_000_000.0 - seconds, now_s=1_000_000.0) == text


def test_long_ago_is_a_date() -> None:
    assert ago(1_000_000_000.0, now_s=1_700_000_000.0).startswith("2001-09-")


def test_a_card_flags_open_questions_until_they_are_decided() -> None:
    manifest = small_car("red-car").manifest.with_changes(checks=(Check("size", "decide", "how long?"),))
    assert card(entry(manifest))["decide"]
    assert not card(entry(manifest, state="approved"))["decide"]
    assert card(entry(manifest))["picture"] == f"pictures/{manifest.look_digest}/thumb.png"


def test_views_turn_in_order_whatever_else_is_there() -> None:
    manifest = small_car("red-car").manifest
    names = ["chart", "thumb", *(f"view_{number}" for number in (10, 2, 0, 1))]
    shown = [address.rpartition("/")[2] for address in turntable_pictures(manifest.look_digest, names)]
    assert shown == ["view_0.png", "view_1.png", "view_2.png", "view_10.png"]


def test_equal_versions_differ_in_nothing() -> None:
    made = entry(small_car("red-car").manifest)
    assert not any(line.differs for line in differences(made, replace(made, version=2)))


def test_each_change_shows_as_one_difference() -> None:
    manifest = small_car("red-car").manifest
    body = manifest.parts[0]
    changed = manifest.with_changes(
        title="Blue car",
        tags=("modern", "old"),
        licence=LicenceRecord("MIT", "The testers"),
        parts=(replace(body, material=MaterialChoice("curator", "paint/red")), *manifest.parts[1:-1]),
    )
    found = {line.field: line for line in differences(entry(manifest), entry(changed, 2)) if line.differs}
    assert set(found) == {"title", "tags", "licence", f"part {body.name}", f"part {manifest.parts[-1].name}"}
    assert found["tags"].first == "modern, +sedan"
    assert found["tags"].second == "modern, +old"
    assert found[f"part {manifest.parts[-1].name}"].second == "–"


def test_every_material_of_the_catalogue_can_be_chosen_and_plotted() -> None:
    lines = material_lines()
    assert {line.name for line in lines} == set(asset_material_names())
    for line in lines:
        curve = curve_of(MaterialChoice("curator", line.name))
        wavelengths = [nm for nm, _ in curve.points]
        assert (min(wavelengths), max(wavelengths)) == (380.0, 1000.0)
        assert all(0.0 <= value <= 1.0 + 1e-9 for _, value in curve.points), line.name
        assert len(line.colour) == 7
        assert int(line.colour[1:], 16) >= 0


def test_a_made_up_material_says_so_and_keeps_its_colour() -> None:
    choice = MaterialChoice("upsampled", "", (1.0, 0.5, 0.0))
    assert swatch(choice) == "#ff8000"
    assert "made up" in curve_of(choice).title
    assert material_title(MaterialChoice("texture")) == "texture of the file"


def test_a_material_that_this_catalogue_does_not_know_is_shown_by_its_name() -> None:
    choice = MaterialChoice("curator", "paint/of-tomorrow", (0.0, 0.0, 1.0))
    assert material_title(choice) == "paint/of-tomorrow"
    assert swatch(choice) == "#0000ff"
    assert curve_of(choice).points


def test_the_plot_ends_above_its_highest_value() -> None:
    for name in ("paint/black", "paint/white"):
        curve = curve_of(MaterialChoice("curator", name))
        options = chart_options([curve])
        assert options["yAxis"]["max"] >= max(value for _, value in curve.points)
        assert (options["xAxis"]["min"], options["xAxis"]["max"]) == (380, 1000)


def record(state: IngestionState, **changes: object) -> IngestionRecord:
    made = IngestionRecord(
        id="i1",
        kind="upload",
        name="car.glb",
        who="maria",
        state=state,
        attempt=1,
        stage="",
        fraction=0.25,
        created_at=0.0,
        started_at=None,
        finished_at=None,
        worker=None,
        error=None,
        error_code=None,
        stored=None,
        preview_error="",
        request_json="{}",
    )
    return replace(made, **changes)  # type: ignore[arg-type]


def test_an_import_says_where_it_is() -> None:
    assert row_of(record(IngestionState.QUEUED))["note"] == "waiting for a worker"
    running = row_of(record(IngestionState.RUNNING, stage="previews"))
    assert (running["state"], running["note"], running["fraction"]) == ("running", "rendering previews", 0.25)


def test_a_refused_import_says_why_and_can_be_tried_again() -> None:
    row = row_of(record(IngestionState.FAILED, error="car.glb ends too early."))
    assert (row["state"], row["note"], row["retry"]) == ("failed", "car.glb ends too early.", True)


def test_a_finished_import_links_to_its_asset_and_tells_what_is_not_fine() -> None:
    checks = json.dumps([{"state": "ok", "message": "fine"}, {"state": "decide", "message": "which way is forward?"}])
    row = row_of(record(IngestionState.DONE, stored=StoredAsset("car", 1, checks)))
    assert (row["state"], row["asset"], row["retry"]) == ("done", "car", False)
    assert row["checks"] == [{"state": "decide", "text": "which way is forward?"}]


def test_an_import_without_previews_is_done_but_says_so() -> None:
    row = row_of(record(IngestionState.DONE, stored=StoredAsset("car", 1), preview_error="out of memory"))
    assert (row["state"], row["retry"]) == ("done", True)
    assert "out of memory" in row["note"]
