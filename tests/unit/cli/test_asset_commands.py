"""`fullwell assets` on this machine's store, as a user types it: tables, JSON, exit codes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from asset_files import box_glb
from fullwell.cli.main import _register, app
from fullwell.core import FullwellError

_register()
IMPORT = ("--class", "car", "--licence", "CC0-1.0", "--forward", "z", "--no-previews")


class Command:
    """Runs commands on one home folder."""

    def __init__(self) -> None:
        self._runner = CliRunner()

    def __call__(self, *words: object, code: int = 0) -> str:
        ended = self._runner.invoke(app, ["assets", *map(str, words)])
        found = 1 if isinstance(ended.exception, FullwellError) else ended.exit_code  # main() makes 1 of it
        assert found == code, ended.output + repr(ended.exception)
        return ended.stdout if code == 0 else ended.output + str(ended.exception)

    def data(self, *words: object, code: int = 0) -> Any:
        return json.loads(self._runner.invoke(app, ["assets", *map(str, words), "--json"]).stdout)


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    monkeypatch.setenv("FULLWELL_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("FULLWELL_URL", raising=False)
    return Command()


@pytest.fixture
def fleet(command: Command, tmp_path: Path) -> Command:
    for number in range(2):
        (tmp_path / f"car-{number}.glb").write_bytes(box_glb(4.2 + 0.1 * number))
    command("import", tmp_path / "car-0.glb", tmp_path / "car-1.glb", "--tag", "kit,red", *IMPORT)
    return command


def test_the_starter_library_is_generated_approved_and_brought_once(command: Command) -> None:
    words = ("starter", "--only", "bench-modern", "--approve", "--no-previews")
    first, again = (command.data(*words)["items"] for _ in range(2))
    assert [(item["id"], item["state"], item["reviewed_by"]) for item in first] == [("bench-modern", "approved", "starter")]
    assert again == first
    assert [item["digest"] for item in command.data("list", "--state", "approved")["items"]] == [first[0]["digest"]]


def test_an_empty_store_says_what_to_do(command: Command) -> None:
    assert "fullwell assets import" in command("list")
    assert command.data("list") == {"items": [], "more": False}


def test_a_folder_comes_in_and_is_shown_with_its_findings(command: Command, tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "Red Car.glb").write_bytes(box_glb(12.0))
    said = command("import", tmp_path / "models", *IMPORT)
    assert "red-car" in said
    assert "decide" in said, "a car of 12 m is for a person to look at"
    assert "1 of 1 models are in the store" in said
    assert "is here already, as version 1" in command("import", tmp_path / "models", *IMPORT)


def test_one_bad_model_does_not_keep_the_others_out_and_the_exit_code_tells(command: Command, tmp_path: Path) -> None:
    (tmp_path / "good.glb").write_bytes(box_glb())
    (tmp_path / "bad.glb").write_bytes(b"glTF")
    said = command("import", tmp_path / "good.glb", tmp_path / "bad.glb", *IMPORT, code=1)
    assert "refused" in said
    assert "1 of 2 models" in said
    rows = command.data("import", tmp_path / "good.glb", tmp_path / "bad.glb", *IMPORT)["items"]
    assert [(row["asset"] is None, bool(row["error"])) for row in rows] == [(False, False), (True, True)]


@pytest.mark.parametrize(
    "words",
    [
        ("import", "absent.glb", *IMPORT),
        ("import", ".", *IMPORT),
        ("import", "a.glb", "b.glb", "--id", "x", *IMPORT),
        ("import", "a.glb", "--class", "car"),
        ("import", "a.glb", "--variant", "red", *IMPORT),
        ("edit", "car"),
        ("previews",),
        ("approve",),
    ],
)
def test_wrong_usage_is_exit_code_2(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    if "b.glb" in words or words[1:2] == ("a.glb",):
        for name in ("a.glb", "b.glb"):
            (folder / name).write_bytes(box_glb())
    command(*words, code=2)


def test_an_illegal_class_or_licence_is_refused_with_the_nearest_before_any_model_is_read(
    command: Command, tmp_path: Path
) -> None:
    (tmp_path / "a.glb").write_bytes(b"no model")
    assert "'car'" in command("import", tmp_path / "a.glb", "--class", "cat", "--licence", "CC0-1.0", code=2)
    assert "CC0-1.0 or" in " ".join(command("import", tmp_path / "a.glb", "--class", "car", "--licence", "CC0", code=2).split())


def test_searches_and_lists_agree(fleet: Command) -> None:
    assert [item["id"] for item in fleet.data("search", "car", "red")["items"]] == ["car-0", "car-1"]
    assert [item["id"] for item in fleet.data("list", "--min-length-m", "4.25")["items"]] == ["car-1"]
    assert fleet.data("list", "--state", "approved")["items"] == []
    assert fleet.data("list", "--limit", 1)["more"] is True
    assert "there are more" in fleet("list", "--limit", 1)
    assert "CC0-1.0" in fleet("list", "--tag", "kit")


def test_decisions_by_query_need_all_and_a_rejection_a_reason(fleet: Command) -> None:
    assert "--all for the 2 assets" in fleet("approve", "--tag", "kit", code=2)
    assert "reason" in fleet("reject", "car-0", code=1)
    assert "2 assets are approved" in fleet("approve", "--tag", "kit", "--all", "--reason", "seen")
    assert "1 asset is rejected" in fleet("reject", "car-0", "--reason", "too plain")
    shown = fleet.data("show", "car-0")
    assert (shown["state"], shown["reason"]) == ("rejected", "too plain")
    assert [event["kind"] for event in shown["events"]] == ["rejected", "approved", "imported"]
    assert "nothing was changed" in fleet("approve", "--tag", "none", "--all", code=1)


def test_an_edit_is_shown_as_a_new_version(fleet: Command) -> None:
    fleet("edit", "car-0", "--title", "A car", "--add-tag", "blue", "--remove-tag", "red", "--material", "body=paint/blue")
    said = fleet("show", "car-0")
    assert "A car" in said
    assert "paint/blue" in said
    assert "2 versions: 2, 1" in said
    assert fleet.data("show", "car-0", "--version", 1)["tags"] == ["kit", "red"]
    assert "no version 7" in fleet("show", "car-0", "--version", 7, code=1)
    assert "car-0" in fleet("show", "car-9", code=1)


def test_an_archive_moves_a_collection_to_another_home(fleet: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fleet("approve", "car-0", "--reason", "seen")
    archive = tmp_path / "kit.zip"
    assert "MB" in fleet("export", "-o", archive)
    monkeypatch.setenv("FULLWELL_HOME", str(tmp_path / "elsewhere"))
    assert "1 asset came in" in fleet("import-archive", archive, "--trust-states")
    assert [(item["id"], item["state"]) for item in fleet.data("list")["items"]] == [("car-0", "approved")]
    archive.write_bytes(archive.read_bytes()[:-100])
    fleet("import-archive", archive, code=1)


def test_a_retired_asset_is_listed_no_more(fleet: Command) -> None:
    assert "car-0 retired" in fleet("retire", "car-0", "--reason", "twice here")
    assert [item["id"] for item in fleet.data("list")["items"]] == ["car-1"]
    assert fleet.data("show", "car-0")["events"][0]["detail"] == "twice here"


def test_upkeep_reports_what_it_did(fleet: Command) -> None:
    assert "would be removed" in fleet("gc", "--dry-run")
    assert fleet.data("gc")["dry_run"] is False
    assert "2 versions are in the catalogue" in fleet("reindex")
    assert len(fleet.data("list")["items"]) == 2
