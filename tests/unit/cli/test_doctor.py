"""The doctor tells the truth about this installation, and its exit code can be relied on."""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from fullwell.cli import doctor
from fullwell.cli.doctor import Finding, Health
from servers import S3Server, ValkeyServer, free_port


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for variable in ("FULLWELL_DATABASE_URL", "FULLWELL_BROKER_URL", "FULLWELL_STORE_URL"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("FULLWELL_HOME", str(tmp_path / "home"))


def _app() -> typer.Typer:
    app = typer.Typer()
    app.callback()(lambda: None)
    doctor.register(app)
    return app


def _only(monkeypatch: pytest.MonkeyPatch, check: Callable[[], list[Finding]]) -> None:
    monkeypatch.setattr(doctor, "_CHECKS", {"part": check})


def test_a_working_installation_exits_with_0_and_valid_json() -> None:
    result = CliRunner().invoke(_app(), ["doctor", "--json"])
    report = json.loads(result.stdout)
    assert result.exit_code == 0, result.stdout
    assert report["ok"] is True
    areas = {finding["area"] for finding in report["findings"]}
    assert {"versions", "renderer", "traffic", "services", "machine"} <= areas


def test_the_table_names_the_chosen_renderer() -> None:
    result = CliRunner().invoke(_app(), ["doctor"], env={"COLUMNS": "300"})
    assert "_spectral" in result.stdout
    assert "Nothing needed is broken." in result.stdout


def test_something_broken_exits_with_1_and_its_advice(monkeypatch: pytest.MonkeyPatch) -> None:
    _only(monkeypatch, lambda: [Finding("part", "queue", Health.BROKEN, "no answer", "Start the broker.")])
    result = CliRunner().invoke(_app(), ["doctor"], env={"COLUMNS": "300"})
    assert result.exit_code == 1
    assert "Start the broker." in result.stdout
    assert "Broken: queue." in result.stdout


def test_a_check_that_fails_by_itself_does_not_hide_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails() -> list[Finding]:
        raise OSError("no such thing")

    monkeypatch.setattr(doctor, "_CHECKS", {"one": fails, "two": lambda: [Finding("two", "x", Health.OK, "fine")]})
    findings = doctor.examine()
    assert [finding.health for finding in findings] == [Health.BROKEN, Health.OK]
    assert "no such thing" in findings[0].found


def test_a_missing_extra_is_a_note_and_a_missing_requirement_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    def version(name: str) -> str:
        if name in ("numpy", "celery"):
            raise importlib.metadata.PackageNotFoundError(name)
        return "1.0"

    monkeypatch.setattr(importlib.metadata, "version", version)
    health = {finding.name: finding for finding in doctor._versions()}
    assert health["numpy"].health is Health.BROKEN
    assert health["celery"].health is Health.NOTE
    assert "fullwell[queue]" in health["celery"].advice


def test_text_in_square_brackets_is_printed_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    _only(monkeypatch, lambda: [Finding("part", "x", Health.NOTE, "y", "pip install 'fullwell[render]'")])
    result = CliRunner().invoke(_app(), ["doctor"], env={"COLUMNS": "300"})
    assert "fullwell[render]" in result.stdout


def test_embedded_services_are_fine_and_nothing_is_made_on_disk(tmp_path: Path) -> None:
    findings = doctor._services()
    assert [finding.name for finding in findings] == ["home", "database", "broker", "store"]
    assert {finding.health for finding in findings} == {Health.OK}
    assert not (tmp_path / "home").exists()


def test_services_that_do_not_answer_are_broken_and_keep_their_secrets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FULLWELL_DATABASE_URL", f"postgresql://fullwell:hush-hush@127.0.0.1:{free_port()}/fullwell")
    monkeypatch.setenv("FULLWELL_BROKER_URL", f"redis://:hush-hush@127.0.0.1:{free_port()}/0")
    monkeypatch.setenv("FULLWELL_STORE_URL", f"s3://key:hush-hush@127.0.0.1:{free_port()}/bucket?secure=0")
    findings = {finding.name: finding for finding in doctor._services()}
    for name in ("database", "broker", "store"):
        assert findings[name].health is Health.BROKEN
        assert f"FULLWELL_{name.upper()}_URL" in findings[name].advice
    assert "hush-hush" not in str(findings)


def test_a_home_that_cannot_be_a_folder_is_broken(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    assert doctor._home(file / "home").health is Health.BROKEN


@pytest.mark.service
def test_a_running_broker_and_store_are_found(
    valkey_server: ValkeyServer, s3_server: S3Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FULLWELL_BROKER_URL", valkey_server.url())
    address = s3_server.url()
    monkeypatch.setenv("FULLWELL_STORE_URL", address)
    findings = {finding.name: finding for finding in doctor._services()}
    assert findings["broker"].health is Health.OK, findings["broker"].found
    assert findings["store"].health is Health.OK, findings["store"].found
    assert s3_server.secret_key not in str(findings)
