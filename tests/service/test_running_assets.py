"""Assets through a real broker, S3 server and workers: uploads resumed, workers killed, pictures rendered, commands."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import trimesh
from PIL import Image
from running import RunningService, children_of, running_service, wait_for

from asset_files import box_glb
from fullwell.client import ApiError, FullwellClient, Ingestion
from fullwell.core import ConflictError, NotFoundError, sha256_hex
from fullwell.core.settings import Settings
from fullwell.jobs.queue import CeleryTaskQueue
from servers import S3Server, ValkeyServer

pytestmark = [pytest.mark.service, pytest.mark.slow]

CAR: dict[str, Any] = {"asset_class": "car", "licence": "CC0-1.0", "forward_axis": "z"}
PATIENCE_S = 120.0


@pytest.fixture(scope="module")
def service(
    tmp_path_factory: pytest.TempPathFactory, s3_server: S3Server, valkey_server: ValkeyServer
) -> Iterator[RunningService]:
    folder = tmp_path_factory.mktemp("assets")
    with running_service(folder, broker_url=valkey_server.url(5), store_url=s3_server.url()) as running:
        running.environment["FULLWELL_PREVIEW_ON_INGEST"] = "0"
        yield running


@pytest.fixture(scope="module")
def worker(service: RunningService) -> RunningService:
    service.start_worker()
    return service


def car_file(folder: Path, name: str, length: float = 4.4) -> Path:
    file = folder / name
    file.write_bytes(box_glb(length))
    return file


def large_glb() -> bytes:
    """Return a ball that takes some seconds to take in: long enough to be killed in the middle."""
    ball = trimesh.creation.icosphere(subdivisions=6, radius=2.0)
    return bytes(trimesh.Scene({"body": ball}).export(file_type="glb"))


def finished(client: FullwellClient, ingestion: Ingestion) -> Ingestion:
    return client.assets.wait(ingestion.id, timeout_s=PATIENCE_S)


def fullwell(service: RunningService, *words: object, ok: bool = True) -> Any:
    """Run a command against the service and return its JSON."""
    code = "from fullwell.cli.main import main; main()"
    command = [sys.executable, "-c", code, "assets", *map(str, words), "--json", "--server", service.client.base_url]
    ended = subprocess.run(command, env=service.environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert (ended.returncode == 0) == ok, ended.stderr + ended.stdout
    return json.loads(ended.stdout)


def test_an_asset_comes_in_once_though_worker_and_child_are_killed(service: RunningService, tmp_path: Path) -> None:
    client = service.client
    file = tmp_path / "ball.glb"
    file.write_bytes(large_glb())
    first = service.start_worker()
    handed_over = client.assets.import_model(file, asset_class="other", licence="CC0-1.0")

    def running(attempt: int) -> bool:
        now = client.assets.ingestion(handed_over.ingestion.id)
        assert now.state != "failed", now.error
        return now.state == "running" and now.attempt == attempt

    wait_for(lambda: running(1), what="the ingestion")
    first.kill()
    second = service.start_worker()
    wait_for(lambda: running(2), what="the takeover")
    os.kill(children_of(second.pid)[0], signal.SIGKILL)
    ended = finished(client, handed_over.ingestion)
    assert (ended.state, ended.asset_id, ended.version) == ("done", "ball", 1)
    assert ended.attempt == 3
    assert [version.version for version in client.assets.versions("ball")] == [1]
    assert [event.kind for event in client.assets.events("ball")] == ["imported"]
    second.terminate()
    assert second.wait(20) is not None


def test_an_upload_is_resumed_by_digest(worker: RunningService, tmp_path: Path) -> None:
    client = worker.client
    file = car_file(tmp_path, "resumed.glb")
    first = client.assets.import_model(file, **CAR)
    assert (first.files, first.sent) == (1, 1)
    again = client.assets.import_model(file, **CAR)
    assert (again.sent, again.sent_bytes) == (0, 0)
    one, other = finished(client, first.ingestion), finished(client, again.ingestion)
    assert (one.state, other.state, one.version, other.version) == ("done", "done", 1, 1)


def test_messages_that_come_twice_make_no_second_version(worker: RunningService, tmp_path: Path) -> None:
    client = worker.client
    queue = CeleryTaskQueue(Settings(queue=worker.environment["FULLWELL_QUEUE"]), worker.environment["FULLWELL_BROKER_URL"])
    ingestion = client.assets.import_model(car_file(tmp_path, "twice.glb"), **CAR).ingestion
    for _ in range(3):
        queue.enqueue_ingestion(ingestion.id)
    queue.enqueue_ingestion("none")
    assert finished(client, ingestion).attempt == 1
    wait_for(lambda: queue.waiting() == 0, what="the end of the duplicates")
    queue.close()
    # The worker takes it after them: then they have done what they do.
    finished(client, client.assets.import_model(car_file(tmp_path, "after.glb"), **CAR).ingestion)
    assert len(client.assets.versions("twice")) == 1


def test_a_damaged_model_fails_with_its_cause_and_the_worker_goes_on(worker: RunningService, tmp_path: Path) -> None:
    client = worker.client
    file = tmp_path / "cut.glb"
    file.write_bytes(box_glb()[:-30])
    failed = finished(client, client.assets.import_model(file, **CAR).ingestion)
    assert (failed.state, failed.error_code, failed.attempt) == ("failed", "ingest_failed", 1)
    assert "cut.glb" in failed.error
    with pytest.raises(NotFoundError):
        client.assets.get("cut")
    assert finished(client, client.assets.retry(failed.id)).state == "failed"
    good = finished(client, client.assets.import_model(car_file(tmp_path, "good.glb"), **CAR).ingestion)
    assert good.state == "done"
    with pytest.raises(ConflictError, match="only a failed one"):
        client.assets.retry(good.id)


def test_the_client_searches_decides_edits_and_moves_assets(worker: RunningService, tmp_path: Path) -> None:
    assets = worker.client.assets
    names = ["moved-0", "moved-1"]
    for number, name in enumerate(names):
        handed_over = assets.import_model(car_file(tmp_path, f"{name}.glb", 4.0 + number), tags=["moved"], **CAR)
        finished(worker.client, handed_over.ingestion)
    assert [asset.id for asset in assets.all(tags=["moved"])] == names
    assert assets.search(tags=["moved"], limit=1).next_cursor
    assert [asset.id for asset in assets.all(tags=["moved"], min_length_m=4.5)] == ["moved-1"]
    assert assets.facets(tags=["moved"])["state"] == {"pending": 2}
    decided = assets.review("approved", query={"tags": ["moved"]}, reason="seen")
    assert [asset.state for asset in decided] == ["approved"] * 2
    edited = assets.edit("moved-0", {"title": "Moved"}, version=1)
    assert (edited.title, edited.version) == ("Moved", 2)
    with pytest.raises(ConflictError):
        assets.edit("moved-0", {"title": "Late"}, version=1)
    with pytest.raises(ApiError) as refused:
        assets.edit("moved-0", {"class": "cart"})
    assert refused.value.errors[0].path == "class"
    model = assets.level("moved-0")
    assert sha256_hex(model) == assets.get("moved-0").document["manifest"]["levels"][0]["sha256"]
    assets.export(tmp_path / "moved.zip", query={"tags": ["moved"]})
    assert [asset.id for asset in assets.import_archive(tmp_path / "moved.zip")] == names
    assert assets.collect_garbage()["dry_run"] is True
    assert assets.reindex() >= 3


def test_commands_import_a_folder_and_send_nothing_twice(worker: RunningService, tmp_path: Path) -> None:
    for number in range(2):
        car_file(tmp_path, f"fleet-{number}.glb", 4.2 + 0.1 * number)
    (tmp_path / "fleet-broken.glb").write_bytes(b"glTF")
    words = ("import", tmp_path, "--class", "car", "--licence", "cc0-1.0", "--tag", "fleet", "--forward", "z")
    report = fullwell(worker, *words, ok=False)["items"]
    by_name = {Path(row["path"]).name: row for row in report}
    assert by_name["fleet-broken.glb"]["error"]
    assert by_name["fleet-1.glb"]["asset"]["id"] == "fleet-1"
    (tmp_path / "fleet-broken.glb").unlink()
    again = fullwell(worker, *words)["items"]
    assert [(row["sent"], row["files"]) for row in again] == [(0, 1), (0, 1)]
    assert [item["id"] for item in fullwell(worker, "list", "--tag", "fleet")["items"]] == ["fleet-0", "fleet-1"]
    approved = fullwell(worker, "approve", "--tag", "fleet", "--all", "--reason", "seen")["items"]
    assert [item["state"] for item in approved] == ["approved", "approved"]
    shown = fullwell(worker, "show", "fleet-0")
    assert [event["kind"] for event in shown["events"]] == ["approved", "imported"]
    assert shown["licence"]["spdx"] == "CC0-1.0"
    exported = fullwell(worker, "export", "-o", tmp_path / "fleet.zip", "--tag", "fleet")
    assert Path(exported["path"]).stat().st_size == exported["bytes"]


@pytest.mark.slow
def test_a_worker_renders_the_pictures_of_what_came_in(worker: RunningService, tmp_path: Path) -> None:
    client = worker.client
    ingestion = client.assets.import_model(car_file(tmp_path, "shown.glb"), **CAR).ingestion
    finished(client, ingestion)
    with pytest.raises(NotFoundError, match="no picture"):
        client.assets.preview("shown")
    ended = client.assets.wait(client.assets.render_previews("shown").id, timeout_s=280)
    assert (ended.kind, ended.state, ended.error) == ("previews", "done", "")
    names = client.assets.get("shown").document["previews"]
    assert {"thumb", "turntable", "chart", "view_0", "view_7"} <= set(names)
    picture = Image.open(io.BytesIO(client.assets.preview("shown", "turntable")))
    low, high = picture.convert("L").getextrema()
    assert high - low > 50, "something is to be seen"
