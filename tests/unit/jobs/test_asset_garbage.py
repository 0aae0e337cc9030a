"""Garbage collection removes what nothing refers to, and never anything else, whoever adds what meanwhile."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import delete, update

from fullwell.assets.query import AssetQuery
from fullwell.assets.records import SourceRecord
from fullwell.assets.store import blob_key, preview_key, put_preview, version_key
from fullwell.core import AssetError, FieldError, NotFoundError, canonical_json, sha256_hex
from fullwell.jobs import asset_garbage
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.asset_rows import AssetHoldRow
from fullwell.jobs.database import Database
from fullwell.jobs.records import JobInput, NewJob
from fullwell.jobs.repository import JobRepository
from fullwell.storage import LocalStore
from stored_assets import PNG, prepared_asset

HOUR_S = 3600.0
ANY = AssetQuery(states=())


@pytest.fixture
def store(tmp_path: Path) -> LocalStore:
    return LocalStore(tmp_path / "store")


@pytest.fixture
def library(store: LocalStore, database: Database) -> AssetLibrary:
    return AssetLibrary(store, database)


def age(store: LocalStore, *, by_s: float = 48 * HOUR_S) -> None:
    """Make all objects of the store older."""
    then = time.time() - by_s
    for file in store.root.rglob("*"):
        os.utime(file, (then, then))


def release_holds(database: Database) -> None:
    """End every hold."""
    with database.writing() as session:
        session.execute(delete(AssetHoldRow))


def put_blob(store: LocalStore, content: bytes) -> str:
    digest = sha256_hex(content)
    store.put(blob_key(digest), content)
    return digest


def blobs(store: LocalStore) -> set[str]:
    return {info.key.removeprefix("cas/") for info in store.list("cas/")}


def collect(library: AssetLibrary, *, dry_run: bool = False, keep: tuple[str, ...] = ()) -> set[str]:
    """Return the digests of the blobs that went."""
    return set(library.collect_garbage(dry_run=dry_run, min_age_s=HOUR_S, keep=keep).digests)


def test_what_any_version_names_stays_and_the_rest_goes(library: AssetLibrary, store: LocalStore) -> None:
    original = put_blob(store, b"the uploaded file")
    source = SourceRecord("upload", "car.obj", files={"car.obj": original})
    library.add(prepared_asset("car-1", source=source), who="ada")
    library.add(prepared_asset("car-1", b"newer"), who="ada")
    library.edit(["car-1"], who="cara", add_tags=("red",))
    library.review(["car-1"], "rejected", who="cara", reason="no")
    needed = blobs(store)
    assert len(needed) == 6
    waste = put_blob(store, b"waste")
    age(store)
    assert collect(library, dry_run=True) == {waste}
    assert blobs(store) == needed | {waste}
    report = library.collect_garbage(dry_run=False, min_age_s=HOUR_S)
    assert (report.blobs, report.bytes, report.kept, report.young, report.digests) == (1, 5, 6, 0, (waste,))
    assert blobs(store) == needed
    assert collect(library) == set()


def test_what_is_young_or_held_or_to_be_kept_stays(library: AssetLibrary, store: LocalStore) -> None:
    held, kept = put_blob(store, b"held"), put_blob(store, b"kept")
    age(store)
    young = put_blob(store, b"young")
    library.hold([held])
    assert collect(library, keep=(kept,)) == set()
    library.hold([held], for_s=-1.0)
    assert library.collect_garbage(dry_run=True, min_age_s=HOUR_S).young >= 1
    assert blobs(store) == {held, kept, young}


def test_a_hold_that_has_ended_holds_no_more(library: AssetLibrary, store: LocalStore) -> None:
    blob = put_blob(store, b"held")
    age(store)
    library.hold([blob])
    assert collect(library) == set()
    with library._database.writing() as session:
        session.execute(update(AssetHoldRow).values(until=time.time() - 1.0))
    assert collect(library) == {blob}


def test_a_longer_hold_is_not_cut_by_a_shorter_one(library: AssetLibrary, store: LocalStore) -> None:
    blob = put_blob(store, b"held")
    age(store)
    library.hold([blob], for_s=HOUR_S)
    library.hold([blob], for_s=-1.0)
    assert collect(library) == set()


@pytest.mark.parametrize(
    "given",
    [
        lambda digest: JobInput("{}", files_json=json.dumps({"model.glb": digest})),
        lambda digest: JobInput(json.dumps({"scene": {"objects": [{"asset": f"asset:car-1@{digest}"}]}})),
        lambda digest: JobInput("{}", overrides_json=json.dumps({"scene.assets.pins": {"car-1": digest}})),
    ],
)
def test_what_a_job_names_stays(
    library: AssetLibrary, repository: JobRepository, store: LocalStore, given: Callable[[str], JobInput]
) -> None:
    needed, waste = put_blob(store, b"needed"), put_blob(store, b"waste")
    age(store)
    repository.create_job(NewJob("box", 1, given(needed), request_sha256="0" * 64))
    assert collect(library) == {waste}


@pytest.mark.parametrize(
    "key",
    [
        "jobs/j1/frames/0/manifest.json",
        "jobs/j1/frames/12/attempts/2/manifest.json",
        "datasets/city/1/manifest.json",
        "datasets/city/1/shards/samples.jsonl",
    ],
)
def test_what_a_manifest_pins_stays_with_all_that_it_needs(library: AssetLibrary, store: LocalStore, key: str) -> None:
    entry = library.add(prepared_asset("car-1"), who="ada")
    put_preview(store, entry.manifest.look_digest, "thumb", PNG)
    library.retire("car-1", who="cara")
    store.put(key, json.dumps({"assets": {"car-1": entry.digest}}).encode())
    age(store)
    release_holds(library._database)
    assert library.collect_garbage(dry_run=False, min_age_s=0.0).versions == 0
    assert blobs(store) == entry.manifest.blobs() | {entry.digest}
    assert store.exists(preview_key(entry.manifest.look_digest, "thumb"))
    assert library.by_digest(entry.digest).retired


def test_a_digest_that_lies_across_two_pieces_of_a_manifest_is_seen(library: AssetLibrary, store: LocalStore) -> None:
    needed = put_blob(store, b"needed")
    store.put("datasets/city/1/manifest.json", b" " * ((1 << 20) - 30) + needed.encode())
    age(store)
    assert collect(library) == set()


def test_a_pin_is_enough_when_the_catalogue_does_not_know_the_asset(library: AssetLibrary, store: LocalStore) -> None:
    asset = prepared_asset("car-1")
    manifest = put_blob(store, canonical_json(asset.manifest.document()))
    level = put_blob(store, b"a model")
    store.put("jobs/j1/frames/0/manifest.json", json.dumps({"assets": {"car-1": manifest}}).encode())
    waste = put_blob(store, b'{"no": "manifest"}')
    age(store)
    assert collect(library) == {waste}
    assert blobs(store) == {manifest, level}


def test_a_retired_asset_that_nothing_pins_goes_and_its_history_stays(library: AssetLibrary, store: LocalStore) -> None:
    first = library.add(prepared_asset("car-1"), who="ada")
    second = library.add(prepared_asset("car-1", b"newer"), who="ada")
    put_preview(store, first.manifest.look_digest, "thumb", PNG)
    store.put("jobs/j1/frames/0/manifest.json", json.dumps({"assets": {"car-1": second.digest}}).encode())
    library.retire("car-1", who="cara", reason="no licence")
    age(store)
    assert library.collect_garbage(dry_run=False, min_age_s=HOUR_S).versions == 0, "it was retired just now"
    release_holds(library._database)
    assert library.collect_garbage(dry_run=True, min_age_s=0.0).versions == 1
    assert [entry.version for entry in library.versions("car-1")] == [2, 1]
    report = library.collect_garbage(dry_run=False, min_age_s=0.0)
    assert (report.versions, report.previews, set(report.digests)) == (
        1,
        1,
        first.manifest.blobs() | {first.digest},
    )
    assert [entry.version for entry in library.versions("car-1")] == [2]
    assert [event.kind for event in library.events("car-1")] == ["collected", "retired", "imported", "imported"]
    library.reindex()
    assert [entry.version for entry in library.versions("car-1")] == [2]
    store.delete("jobs/j1/frames/0/manifest.json")
    library.collect_garbage(dry_run=False, min_age_s=0.0)
    assert blobs(store) == set()
    with pytest.raises(NotFoundError, match="content removed"):
        library.get("car-1")
    library.reindex()
    assert library.add(prepared_asset("car-1"), who="ada").version == 3
    assert library.search(ANY).total == 1


def test_previews_go_with_the_last_version_that_looks_so(library: AssetLibrary, store: LocalStore) -> None:
    entry = library.add(prepared_asset("car-1"), who="ada")
    for look in (entry.manifest.look_digest, "ab" * 32):
        put_preview(store, look, "thumb", PNG)
    age(store)
    report = library.collect_garbage(dry_run=False, min_age_s=HOUR_S)
    assert report.previews == 1
    assert library.preview_names(entry.manifest.look_digest) == ("thumb",)
    assert library.preview_names("ab" * 32) == ()


def test_other_objects_are_never_touched(library: AssetLibrary, store: LocalStore) -> None:
    others = [
        f"cache/light/ab/{'ab' * 32}",
        "cas/README",
        "cas/" + "AB" * 32,
        f"jobs/j1/frames/0/{'cd' * 32}",
        "assets/car-1/notes.txt",
        "datasets/city/1/shard-000.tar",
    ]
    for key in others:
        store.put(key, b"not ours")
    age(store)
    library.collect_garbage(dry_run=False, min_age_s=0.0)
    assert [key for key in others if not store.exists(key)] == []


def test_an_empty_database_beside_a_full_store_costs_no_blob(library: AssetLibrary, store: LocalStore, tmp_path: Path) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    age(store)
    before = blobs(store)
    empty = Database(f"sqlite:///{tmp_path}/empty.sqlite3")
    empty.upgrade()
    other = AssetLibrary(store, empty)
    assert collect(other) == set()
    assert blobs(store) == before
    assert other.get("car-1").version == 1
    empty.close()


def test_nothing_goes_while_a_version_cannot_be_read(library: AssetLibrary, store: LocalStore) -> None:
    entry = library.add(prepared_asset("car-1"), who="ada")
    waste = put_blob(store, b"waste")
    content = store.get(version_key("car-1", 1))
    store.put("assets/car-2/versions/00000001.json", content)
    age(store)
    with pytest.raises(AssetError, match="car-2"):
        library.collect_garbage(dry_run=False, min_age_s=0.0)
    store.delete("assets/car-2/versions/00000001.json")
    store.delete(blob_key(entry.digest))
    library.reindex()
    with pytest.raises(AssetError, match="no readable manifest"):
        library.collect_garbage(dry_run=False, min_age_s=0.0)
    assert waste in blobs(store)


@pytest.mark.parametrize("min_age_s", [-1.0, float("nan")])
def test_an_age_must_be_one(library: AssetLibrary, min_age_s: float) -> None:
    with pytest.raises(FieldError, match="min_age_s"):
        library.collect_garbage(dry_run=True, min_age_s=min_age_s)


def test_an_asset_added_between_looking_and_removing_keeps_its_old_blobs(
    library: AssetLibrary, store: LocalStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    level = put_blob(store, b"a model")
    age(store)
    gathered = asset_garbage._references_of_stored_manifests

    def meanwhile(*arguments: object) -> set[str]:
        found = gathered(*arguments)  # type: ignore[arg-type]
        library.add(prepared_asset("car-1"), who="ada")
        release_holds(library._database)
        return found

    monkeypatch.setattr(asset_garbage, "_references_of_stored_manifests", meanwhile)
    assert collect(library) == set()
    assert level in blobs(store)


def test_an_asset_that_is_restored_after_it_was_chosen_to_go_stays(
    library: AssetLibrary, store: LocalStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry = library.add(prepared_asset("car-1"), who="ada")
    library.retire("car-1", who="cara")
    age(store)
    release_holds(library._database)
    chosen_before = asset_garbage._retired_versions

    def meanwhile(*arguments: Any, **named: Any) -> Any:
        chosen = chosen_before(*arguments, **named)
        assert len(chosen) == 1
        library.restore("car-1", who="ada")
        release_holds(library._database)
        return chosen

    monkeypatch.setattr(asset_garbage, "_retired_versions", meanwhile)
    report = library.collect_garbage(dry_run=False, min_age_s=0.0)
    assert (report.versions, report.blobs) == (0, 0)
    assert library.get("car-1") == entry


def test_an_asset_that_someone_is_about_to_restore_stays(library: AssetLibrary, store: LocalStore) -> None:
    entry = library.add(prepared_asset("car-1"), who="ada")
    library.retire("car-1", who="cara")
    age(store)
    library.hold([entry.digest])
    assert library.collect_garbage(dry_run=False, min_age_s=0.0).versions == 0
    release_holds(library._database)
    assert library.collect_garbage(dry_run=False, min_age_s=0.0).versions == 1


def test_a_job_made_between_looking_and_removing_keeps_its_files(
    library: AssetLibrary, repository: JobRepository, store: LocalStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    needed = put_blob(store, b"a model")
    age(store)
    gathered = asset_garbage._references_of_stored_manifests

    def meanwhile(*arguments: object) -> set[str]:
        files = json.dumps({"model.glb": needed})
        repository.create_job(NewJob("box", 1, JobInput("{}", files_json=files), request_sha256="0" * 64))
        return gathered(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(asset_garbage, "_references_of_stored_manifests", meanwhile)
    assert collect(library) == set()


def test_assets_that_come_and_go_while_garbage_is_collected_are_whole(library: AssetLibrary, store: LocalStore) -> None:
    """Writers add assets whose blobs lie about, old and unreferred to, and retire them again; a collector runs all the time."""
    stop = threading.Event()
    failures: list[BaseException] = []

    def collector() -> None:
        while not stop.is_set():
            try:
                library.collect_garbage(dry_run=False, min_age_s=0.0)
            except BaseException as error:  # told below
                failures.append(error)
                return

    def writer(index: int) -> None:
        try:
            for turn in range(6):
                asset = prepared_asset(f"car-{index}", f"content {index} {turn % 2}".encode())
                entry = library.add(asset, who="ada")
                needed = entry.manifest.blobs() | {entry.digest}
                assert needed <= blobs(store), asdict(entry)
                if turn % 3 == 1:
                    library.retire(entry.id, who="ada")
        except BaseException as error:  # told below
            failures.append(error)

    collecting = threading.Thread(target=collector)
    writers = [threading.Thread(target=writer, args=(index,)) for index in range(3)]
    for thread in (collecting, *writers):
        thread.start()
    for thread in writers:
        thread.join()
    stop.set()
    collecting.join()
    assert failures == []
    release_holds(library._database)
    library.collect_garbage(dry_run=False, min_age_s=0.0)
    entries = library.search(ANY).entries
    assert [entry.id for entry in entries] == ["car-0", "car-1", "car-2"]
    for entry in entries:
        for version in library.versions(entry.id):
            assert version.manifest.blobs() | {version.digest} <= blobs(store)
