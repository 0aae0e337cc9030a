"""One asset on a worker: what is recorded when its pictures fail, when files are to blame, and when the lease is lost."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from asset_files import box_glb
from fullwell.assets.ingest import IngestError, IngestProcess
from fullwell.assets.records import LicenceRecord
from fullwell.core import RenderMemoryError, StorageError, digest_of
from fullwell.core.settings import Settings
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.asset_requests import AssetRequest, ingest_limits
from fullwell.jobs.database import Database
from fullwell.jobs.files import blob_key
from fullwell.jobs.ingestions import IngestionRecord, IngestionRepository, NewIngestion, StoredAsset
from fullwell.storage import LocalStore
from fullwell_worker.ingesting import AssetContext, run_ingestion


class Renderer:
    """A renderer that says what it was asked for and ends as it is told."""

    def __init__(self, error: Exception | None = None) -> None:
        self.error = error
        self.asked: list[str] = []

    def __call__(self, document: Any, index: int, store: Any, prefix: str, **_: Any) -> None:
        self.asked.append(prefix)
        raise self.error or StorageError("the store is full")


class Bench:
    """A worker's context on a folder."""

    def __init__(self, folder: Path, reader: IngestProcess) -> None:
        settings = Settings(home=folder, lease_s=2.0, retry_delay_s=0.0, max_attempts=2)
        database = Database(settings.database)
        database.upgrade()
        store = LocalStore(folder / "store")
        self.renderer = Renderer()
        self.context = AssetContext(
            name="w",
            settings=settings,
            ingestions=IngestionRepository(database),
            library=AssetLibrary(store, database),
            store=store,
            runner=self.renderer,
            reader=reader,
        )

    def queue(self, content: bytes, name: str = "car.glb") -> IngestionRecord:
        digest = hashlib.sha256(content).hexdigest()
        self.context.store.put(blob_key(digest), content)
        text = AssetRequest({name: digest}, "", "car", LicenceRecord("CC0-1.0")).checked().to_json()
        return self.context.ingestions.create(NewIngestion("upload", name, "ann", text, digest_of([text])))[0]

    def run(self, record: IngestionRecord) -> IngestionRecord:
        """Do one part of the work: reading, or rendering."""
        run_ingestion(self.context, record.id)
        return self.context.ingestions.get(record.id)


@pytest.fixture(scope="module")
def reader() -> Iterator[IngestProcess]:
    with IngestProcess(ingest_limits(Settings())) as process:
        yield process


@pytest.fixture
def bench(tmp_path: Path, reader: IngestProcess) -> Bench:
    return Bench(tmp_path, reader)


def test_an_asset_without_pictures_is_an_asset_and_the_record_says_why(bench: Bench) -> None:
    bench.renderer.error = RenderMemoryError("the frame needs more memory")
    read = bench.run(bench.queue(box_glb()))
    assert (read.state, read.stage, bench.renderer.asked) == ("queued", "previews", []), "others are read before"
    done = bench.run(read)
    assert (done.state, done.error, done.preview_error) == ("done", None, "the frame needs more memory")
    assert done.stored is not None
    look = bench.context.library.get("car").manifest.look_digest
    assert bench.renderer.asked == [f"assets/previews/{look}/under-way/views"]
    assert bench.context.library.get("car").created_by == "ann"


def test_pictures_asked_for_by_hand_fail_as_such(bench: Bench) -> None:
    bench.run(bench.queue(box_glb()))
    new = NewIngestion("previews", "car", "bob", "{}", "0" * 64, stored=StoredAsset("car", 1))
    record = bench.context.ingestions.create(new)[0]
    assert bench.run(record).state == "queued", "a full store may have room again"
    failed = bench.run(record)
    assert (failed.state, failed.error_code) == ("failed", "storage_failed")
    assert "after 2 attempts" in (failed.error or "")


def test_settings_may_leave_pictures_out(bench: Bench) -> None:
    context = dataclasses.replace(
        bench.context, settings=bench.context.settings.model_copy(update={"preview_on_ingest": False})
    )
    record = bench.queue(box_glb())
    run_ingestion(context, record.id)
    assert (context.ingestions.get(record.id).preview_error, bench.renderer.asked) == ("", [])


def test_a_blob_that_was_changed_in_the_store_is_refused(bench: Bench) -> None:
    record = bench.queue(box_glb())
    bench.context.store.put(blob_key(hashlib.sha256(box_glb()).hexdigest()), b"other")
    bench.run(record)
    failed = bench.run(record)
    assert (failed.state, failed.error_code) == ("failed", "storage_failed")
    assert "SHA-256" in (failed.error or "")


@pytest.mark.parametrize(("cause", "attempts"), [("refused", 1), ("memory", 1), ("time", 1), ("died", 2), ("unforeseen", 2)])
def test_only_what_may_be_the_machines_fault_is_tried_again(bench: Bench, cause: Any, attempts: int) -> None:
    class Refusing(IngestProcess):
        def prepare(self, *_: Any, **__: Any) -> Any:
            raise IngestError("no", "file", "car.glb", cause)

    context = dataclasses.replace(bench.context, reader=Refusing())
    record = bench.queue(box_glb())
    for _ in range(3):
        run_ingestion(context, record.id)
    failed = context.ingestions.get(record.id)
    assert (failed.state, failed.attempt) == ("failed", attempts)


def test_a_fault_of_this_program_fails_the_asset_and_not_the_worker(bench: Bench) -> None:
    class Faulty(IngestProcess):
        def prepare(self, *_: Any, **__: Any) -> Any:
            raise ZeroDivisionError("oh")

    context = dataclasses.replace(bench.context, reader=Faulty())
    record = bench.queue(box_glb())
    run_ingestion(context, record.id)
    assert context.ingestions.get(record.id).error_code == "internal_error"


def test_nothing_is_left_on_the_workers_disk(bench: Bench, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    bench.context.reader.start()  # its own folder stays as long as it does, and lies where folders lay when it started
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    assert bench.run(bench.queue(box_glb()[:-30])).state == "failed"
    assert bench.run(bench.queue(box_glb())).stored is not None
    assert list(scratch.iterdir()) == []
