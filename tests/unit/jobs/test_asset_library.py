"""Adding, finding, deciding, editing: the asset library on a real store and a real database."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from fullwell.assets.query import AssetQuery, ReviewState
from fullwell.assets.records import LicenceRecord, PreparedAsset
from fullwell.assets.store import blob_key, put_preview, version_key
from fullwell.core import AssetError, ConflictError, FieldError, NotFoundError, StorageError, sha256_hex
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.database import Database
from fullwell.storage import LocalStore
from stored_assets import PNG, open_check, prepared_asset

ANY = AssetQuery(states=())


@pytest.fixture
def store(tmp_path: Path) -> LocalStore:
    return LocalStore(tmp_path / "store")


@pytest.fixture
def library(store: LocalStore, database: Database) -> AssetLibrary:
    return AssetLibrary(store, database)


def ids_of(library: AssetLibrary, query: AssetQuery) -> list[str]:
    return [entry.id for entry in library.search(query, limit=500).entries]


# -- additions --------------------------------------------------------------------------------------------------------


def test_a_new_asset_is_pending_and_can_be_found_by_id_digest_and_search(library: AssetLibrary, store: LocalStore) -> None:
    asset = prepared_asset("car-1")
    entry = library.add(asset, who="ada")
    assert (entry.id, entry.version, entry.state, entry.created_by) == ("car-1", 1, "pending", "ada")
    assert entry.manifest == asset.manifest
    assert entry.digest == asset.manifest.digest
    assert library.get("car-1") == library.get("car-1", 1) == library.by_digest(entry.digest) == entry
    assert library.search(ANY).entries == (entry,)
    assert library.search(AssetQuery()).total == 0
    assert sha256_hex(store.get(blob_key(entry.digest))) == entry.digest


def test_adding_the_same_twice_is_adding_it_once(library: AssetLibrary) -> None:
    first = library.add(prepared_asset("car-1"), who="ada")
    assert library.add(prepared_asset("car-1"), who="bob") == first
    assert len(library.versions("car-1")) == 1


def test_another_content_is_the_next_version_and_pending_again(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    library.review(["car-1"], "approved", who="cara")
    second = library.add(prepared_asset("car-1", b"better"), who="ada")
    assert (second.version, second.state) == (2, "pending")
    assert [(entry.version, entry.state) for entry in library.versions("car-1")] == [(2, "pending"), (1, "approved")]


def test_importing_again_what_a_curator_has_edited_keeps_the_edits(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    (edited,) = library.edit(["car-1"], who="cara", add_tags=("red",))
    assert library.add(prepared_asset("car-1"), who="ada") == edited
    assert library.add(prepared_asset("car-1", b"new"), who="ada").version == 3


def test_whole_numbers_in_a_size_give_the_digest_of_what_comes_back(library: AssetLibrary) -> None:
    entry = library.add(prepared_asset("car-1", size_m=(4, 2, 1)), who="ada")
    assert entry.manifest.digest == entry.digest
    assert library.reindex() == 1
    assert library.get("car-1").digest == entry.digest


def test_a_blob_that_is_not_what_it_says_is_refused_and_leaves_no_asset(library: AssetLibrary) -> None:
    asset = prepared_asset("car-1")
    (digest,) = asset.blobs
    with pytest.raises(AssetError, match="has SHA-256"):
        library.add(PreparedAsset(asset.manifest, {digest: b"something else"}), who="ada")
    with pytest.raises(AssetError, match=digest):
        library.add(PreparedAsset(asset.manifest, {}), who="ada")
    with pytest.raises(NotFoundError):
        library.get("car-1")


def test_a_blob_that_was_uploaded_before_need_not_be_given(library: AssetLibrary, store: LocalStore) -> None:
    asset = prepared_asset("car-1")
    (digest,) = asset.blobs
    store.put(blob_key(digest), asset.blobs[digest])
    assert library.add(PreparedAsset(asset.manifest, {}), who="ada").version == 1


def test_a_blob_that_was_cut_in_the_store_is_mended_by_adding_it_again(library: AssetLibrary, store: LocalStore) -> None:
    asset = prepared_asset("car-1")
    (digest,) = asset.blobs
    store.put(blob_key(digest), b"a")
    library.add(asset, who="ada")
    assert store.get(blob_key(digest)) == asset.blobs[digest]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"title": "x" * 201}, "title"),
        ({"title": "a\x00b"}, "title"),
        ({"title": "a\ud800"}, "title"),
        ({"size_m": (float("nan"), 1.0, 1.0)}, "size_m"),
        ({"size_m": (float("inf"), 1.0, 1.0)}, "size_m"),
        ({"levels": ()}, "levels"),
        ({"licence": LicenceRecord("")}, "licence.spdx"),
        ({"licence": LicenceRecord("MIT", "a\nb")}, "licence.attribution"),
        ({"attributes": {"x": float("nan")}}, "manifest"),
    ],
)
def test_a_manifest_that_would_not_come_back_is_refused(library: AssetLibrary, changes: dict[str, object], field: str) -> None:
    with pytest.raises(FieldError) as caught:
        library.add(prepared_asset("car-1", **changes), who="ada")
    assert caught.value.path == field
    assert library.search(ANY).total == 0


def test_an_unknown_asset_is_answered_with_the_nearest_names(library: AssetLibrary) -> None:
    with pytest.raises(NotFoundError, match="empty"):
        library.get("car-1")
    for asset_id in ("sedan-red", "sedan-blue", "tree-oak"):
        library.add(prepared_asset(asset_id), who="ada")
    with pytest.raises(NotFoundError, match="'sedan-red'"):
        library.get("sedan-rad")
    with pytest.raises(NotFoundError, match="it has 1"):
        library.get("sedan-red", 2)
    with pytest.raises(NotFoundError, match="digest"):
        library.by_digest("ab" * 32)


def test_threads_that_add_versions_of_one_asset_lose_none(library: AssetLibrary) -> None:
    def add(index: int) -> None:
        library.add(prepared_asset("car-1", f"content {index}".encode()), who=f"writer {index}")

    threads = [threading.Thread(target=add, args=(index,)) for index in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    versions = library.versions("car-1")
    assert [entry.version for entry in versions] == [8, 7, 6, 5, 4, 3, 2, 1]
    assert len({entry.digest for entry in versions}) == 8
    before = [(entry.version, entry.digest) for entry in versions]
    library.reindex()
    assert [(entry.version, entry.digest) for entry in library.versions("car-1")] == before


# -- decisions --------------------------------------------------------------------------------------------------------


def test_a_decision_carries_name_time_and_reason(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    (entry,) = library.review(["car-1"], "rejected", who="cara", reason="its wheels are square")
    assert (entry.state, entry.reviewed_by, entry.reason) == ("rejected", "cara", "its wheels are square")
    assert entry.reviewed_at is not None
    assert entry.reviewed_at > entry.created_at
    kinds = [(event.kind, event.who, event.detail) for event in library.events("car-1")]
    assert kinds == [("rejected", "cara", "its wheels are square"), ("imported", "ada", "")]


def test_deciding_the_same_again_changes_nothing(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    first = library.review(["car-1"], "approved", who="cara")
    assert library.review(["car-1"], "approved", who="dora") == first
    assert len(library.events("car-1")) == 2


def test_decisions_that_need_a_reason_are_refused_without_and_then_none_is_made(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    library.add(prepared_asset("car-2", checks=(open_check(),)), who="ada")
    with pytest.raises(FieldError, match="rejection needs one"):
        library.review(["car-1"], "rejected", who="cara", reason="  ")
    with pytest.raises(FieldError, match=r"open checks \(scale\)"):
        library.review(["car-1", "car-2"], "approved", who="cara")
    assert {entry.state for entry in library.search(ANY).entries} == {"pending"}
    library.review(["car-1", "car-2"], "approved", who="cara", reason="measured it")
    assert {entry.state for entry in library.search(ANY).entries} == {"approved"}
    with pytest.raises(NotFoundError, match="car-2"):
        library.review(["car-1", "car-22"], "pending", who="cara")
    assert library.get("car-1").state == "approved"


def test_a_decision_can_be_taken_back(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    library.review(["car-1"], "approved", who="cara")
    (entry,) = library.review(["car-1"], "pending", who="cara")
    assert entry.state == "pending"
    assert ids_of(library, AssetQuery()) == []


def test_an_expected_version_guards_against_what_another_has_done_meanwhile(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    library.edit(["car-1"], who="bob", add_tags=("red",), expected_version=1)
    with pytest.raises(ConflictError, match="version 2, not 1: bob"):
        library.review(["car-1"], "approved", who="cara", expected_version=1)
    with pytest.raises(ConflictError, match="version 2, not 1"):
        library.edit(["car-1"], who="cara", title="Mine", expected_version=1)
    with pytest.raises(FieldError, match="expected_version"):
        library.review(["car-1", "car-2"], "approved", who="cara", expected_version=2)
    assert library.get("car-1").state == "pending"
    assert library.review(["car-1"], "approved", who="cara", expected_version=2)[0].state == "approved"


# -- edits ------------------------------------------------------------------------------------------------------------


def test_an_edit_makes_a_version_that_keeps_the_state_and_says_what_it_did(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    library.review(["car-1"], "approved", who="cara", reason="fine")
    (entry,) = library.edit(
        ["car-1"],
        who="dora",
        asset_class="van",
        add_tags=("red",),
        remove_tags=("sedan",),
        title="A Van",
        licence=LicenceRecord("MIT", "Ada"),
        part_materials={"body": "paint/blue"},
    )
    manifest = entry.manifest
    assert (entry.version, entry.state, entry.reviewed_by, entry.created_by) == (2, "approved", "cara", "dora")
    assert (manifest.asset_class, manifest.tags, manifest.title) == ("van", ("red",), "A Van")
    assert manifest.licence == LicenceRecord("MIT", "Ada")
    assert (manifest.parts[0].material.origin, manifest.parts[0].material.name) == ("curator", "paint/blue")
    assert manifest.parts[1] == prepared_asset("car-1").manifest.parts[1]
    detail = library.events("car-1")[0].detail
    for words in (
        "class car to van",
        "tag red added",
        "tag sedan removed",
        "'A Van'",
        "CC-BY-4.0 to MIT",
        "body to paint/blue",
    ):
        assert words in detail
    assert library.get("car-1", 1).manifest == prepared_asset("car-1").manifest


def test_an_edit_that_changes_nothing_makes_no_version(library: AssetLibrary) -> None:
    entry = library.add(prepared_asset("car-1"), who="ada")
    assert library.edit(["car-1"], who="cara", asset_class="car", add_tags=("sedan",), remove_tags=("red",)) == (entry,)


@pytest.mark.parametrize(
    "changes",
    [
        {"asset_class": "spaceship"},
        {"add_tags": ("Not A Tag",)},
        {"title": " "},
        {"part_materials": {"bonnet": "paint/red"}},
        {"part_materials": {"body": "paint/no-such-paint"}},
        {"add_tags": tuple(f"tag-{index}" for index in range(40))},
    ],
)
def test_an_illegal_edit_changes_no_asset_at_all(library: AssetLibrary, changes: dict[str, object]) -> None:
    for asset_id in ("car-1", "car-2"):
        library.add(prepared_asset(asset_id), who="ada")
    with pytest.raises(FieldError):
        library.edit(["car-1", "car-2"], who="cara", **changes)  # type: ignore[arg-type]
    assert {entry.version for entry in library.search(ANY).entries} == {1}


def test_threads_that_edit_one_asset_lose_no_change(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    tags = [f"tag-{index}" for index in range(6)]
    threads = [
        threading.Thread(target=library.edit, args=(["car-1"],), kwargs={"who": "cara", "add_tags": (tag,)}) for tag in tags
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(tags) < set(library.get("car-1").manifest.tags)
    assert library.get("car-1").version == 7


def test_a_rejection_reaches_the_versions_that_differ_only_by_edits(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    library.review(["car-1"], "approved", who="cara")
    library.edit(["car-1"], who="cara", add_tags=("red",))
    library.review(["car-1"], "rejected", who="cara", reason="stolen")
    assert [entry.state for entry in library.versions("car-1")] == ["rejected", "rejected"]
    assert library.candidates(AssetQuery()) == ()


# -- draws ------------------------------------------------------------------------------------------------------------


def test_an_asset_whose_newest_version_is_pending_is_drawn_at_its_approved_one(library: AssetLibrary) -> None:
    first = library.add(prepared_asset("car-1"), who="ada")
    library.add(prepared_asset("tree-1", asset_class="tree"), who="ada")
    library.review(["car-1"], "approved", who="cara")
    library.add(prepared_asset("car-1", b"new"), who="ada")
    assert library.candidates(AssetQuery("car")) == (("car-1", first.digest),)
    assert ids_of(library, AssetQuery("car")) == []
    assert library.candidates(AssetQuery("car", states=("pending",)))[0][1] == library.get("car-1").digest


def test_a_car_that_a_curator_made_a_van_is_drawn_as_a_van_only(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    library.review(["car-1"], "approved", who="cara")
    (van,) = library.edit(["car-1"], who="cara", asset_class="van")
    assert library.candidates(AssetQuery("car")) == ()
    assert library.candidates(AssetQuery("van")) == (("car-1", van.digest),)


def test_candidates_come_sorted_by_id(library: AssetLibrary) -> None:
    for asset_id in ("b", "a.1", "a-1", "a", "a_1", "a1"):
        library.add(prepared_asset(asset_id), who="ada")
    found = [asset_id for asset_id, _ in library.candidates(ANY)]
    assert found == sorted(found) == ids_of(library, ANY)


# -- retiring ---------------------------------------------------------------------------------------------------------


def test_a_retired_asset_is_neither_searched_nor_drawn_but_still_there(library: AssetLibrary) -> None:
    entry = library.add(prepared_asset("car-1"), who="ada")
    library.review(["car-1"], "approved", who="cara")
    assert library.retire("car-1", who="cara", reason="licence withdrawn").retired
    assert ids_of(library, ANY) == []
    assert library.candidates(AssetQuery()) == ()
    assert library.facets(ANY)["class"] == {}
    assert library.by_digest(entry.digest).retired
    assert library.events("car-1")[0].detail == "licence withdrawn"
    assert not library.restore("car-1", who="cara").retired
    assert ids_of(library, AssetQuery()) == ["car-1"]


def test_importing_a_retired_asset_again_brings_it_back(library: AssetLibrary) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    library.retire("car-1", who="cara")
    assert library.add(prepared_asset("car-1"), who="ada").version == 1
    assert ids_of(library, ANY) == ["car-1"]
    library.retire("car-1", who="cara")
    assert library.add(prepared_asset("car-1", b"new"), who="ada").version == 2
    assert ids_of(library, ANY) == ["car-1"]


# -- the store is the truth -------------------------------------------------------------------------------------------


def furnished(library: AssetLibrary) -> None:
    for index in range(4):
        library.add(prepared_asset(f"car-{index}", f"content {index}".encode()), who="ada")
    library.review(["car-0", "car-1"], "approved", who="cara", reason="fine")
    library.edit(["car-1", "car-2"], who="cara", add_tags=("red",))
    library.review(["car-2"], "rejected", who="cara", reason="bad")
    library.add(prepared_asset("car-0", b"newer"), who="ada")
    library.retire("car-3", who="cara")


def test_reindexing_gives_the_same_catalogue_in_an_empty_database(
    library: AssetLibrary, store: LocalStore, tmp_path: Path
) -> None:
    furnished(library)
    empty = Database(f"sqlite:///{tmp_path}/empty.sqlite3")
    empty.upgrade()
    other = AssetLibrary(store, empty)
    assert other.search(ANY).total == 0
    assert other.reindex() == 7
    for index in range(4):
        asset_id = f"car-{index}"
        assert other.versions(asset_id) == library.versions(asset_id)
        assert other.events(asset_id) == library.events(asset_id)
    assert other.search(ANY) == library.search(ANY)
    assert other.candidates(AssetQuery()) == library.candidates(AssetQuery())
    assert other.facets(ANY) == library.facets(ANY)
    assert other.reindex() == 7
    empty.close()


def test_reindexing_passes_over_damaged_files_and_keeps_their_numbers_taken(library: AssetLibrary, store: LocalStore) -> None:
    furnished(library)
    store.put(version_key("car-1", 2), b"not json")
    store.delete(blob_key(library.get("car-2").digest))
    store.put("assets/car-0/notes.txt", b"someone's notes")
    assert library.reindex() == 5
    assert [entry.version for entry in library.versions("car-2")] == [1]
    assert library.add(prepared_asset("car-2", b"more"), who="ada").version == 3


def test_a_version_that_a_crash_kept_from_the_tables_is_found_by_the_next_writer(
    library: AssetLibrary, store: LocalStore, tmp_path: Path
) -> None:
    library.add(prepared_asset("car-1"), who="ada")
    empty = Database(f"sqlite:///{tmp_path}/empty.sqlite3")
    empty.upgrade()
    other = AssetLibrary(store, empty)
    assert other.add(prepared_asset("car-1", b"new"), who="bob").version == 2
    assert [entry.created_by for entry in other.versions("car-1")] == ["bob", "ada"]
    assert other.add(prepared_asset("car-1", b"new"), who="bob").version == 2
    empty.close()


class FailingStore(LocalStore):
    """A local store that refuses to write some events."""

    refuse = ""

    def put(self, key, content, content_type=None, *, if_absent=False):  # type: ignore[no-untyped-def]
        if self.refuse and self.refuse in key:
            raise StorageError(f"no room for {key}.")
        return super().put(key, content, content_type, if_absent=if_absent)


def test_the_tables_follow_what_a_failing_store_has_taken(database: Database, tmp_path: Path) -> None:
    store = FailingStore(tmp_path / "store")
    library = AssetLibrary(store, database)
    for index in range(6):
        library.add(prepared_asset(f"car-{index}"), who="ada")
    store.refuse = "car-3/events"
    ids = [f"car-{index}" for index in range(6)]
    with pytest.raises(StorageError, match="no room"):
        library.review(ids, "approved", who="cara")
    states: dict[str, ReviewState] = {entry.id: entry.state for entry in library.search(ANY).entries}
    assert states.pop("car-3") == "pending"
    library.reindex()
    assert {asset_id: library.get(asset_id).state for asset_id in states} == states
    store.refuse = ""
    assert {entry.state for entry in library.review(ids, "approved", who="cara")} == {"approved"}


# -- archives ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def elsewhere(tmp_path: Path) -> AssetLibrary:
    database = Database(f"sqlite:///{tmp_path}/elsewhere.sqlite3")
    database.upgrade()
    return AssetLibrary(LocalStore(tmp_path / "elsewhere"), database)


def test_an_archive_carries_assets_to_another_store_where_they_are_pending(
    library: AssetLibrary, elsewhere: AssetLibrary, store: LocalStore, tmp_path: Path
) -> None:
    furnished(library)
    look = library.get("car-1").manifest.look_digest
    put_preview(store, look, "thumb", PNG)
    report = library.export(ANY, tmp_path / "all.zip")
    assert (report.assets, report.previews) == (3, 1)
    entries = elsewhere.import_archive(tmp_path / "all.zip", who="bob")
    assert [(entry.id, entry.digest) for entry in entries] == [
        (entry.id, entry.digest) for entry in library.search(ANY).entries
    ]
    assert {(entry.state, entry.version, entry.created_by) for entry in entries} == {("pending", 1, "bob")}
    assert elsewhere.preview_names(look) == ("thumb",)
    assert elsewhere.store.get(elsewhere.preview_key(look, "thumb")) == PNG
    assert elsewhere.import_archive(tmp_path / "all.zip", who="bob") == entries


def test_states_of_an_archive_are_taken_over_only_where_they_are_trusted(
    library: AssetLibrary, elsewhere: AssetLibrary, tmp_path: Path
) -> None:
    furnished(library)
    library.export(["car-1", "car-2"], tmp_path / "two.zip")
    elsewhere.add(prepared_asset("car-1", b"content 1"), who="bob")
    elsewhere.review(["car-1"], "rejected", who="bob", reason="not here")
    entries = elsewhere.import_archive(tmp_path / "two.zip", who="bob", trust_states=True)
    assert [(entry.id, entry.state) for entry in entries] == [("car-1", "approved"), ("car-2", "rejected")]
    assert entries[1].reason == "rejected by cara where the archive was made: bad"


def test_an_archive_that_is_refused_leaves_nothing_behind(
    library: AssetLibrary, elsewhere: AssetLibrary, tmp_path: Path
) -> None:
    furnished(library)
    library.export(ANY, tmp_path / "all.zip")
    content = bytearray((tmp_path / "all.zip").read_bytes())
    position = content.index(b"content 2")
    content[position] ^= 1
    (tmp_path / "all.zip").write_bytes(content)
    with pytest.raises(AssetError, match="damaged"):
        elsewhere.import_archive(tmp_path / "all.zip", who="bob")
    assert list(elsewhere.store.list()) == []
    assert elsewhere.search(ANY).total == 0


def test_an_empty_or_unknown_choice_makes_no_archive(library: AssetLibrary, tmp_path: Path) -> None:
    with pytest.raises(FieldError, match="no asset is chosen"):
        library.export(ANY, tmp_path / "none.zip")
    library.add(prepared_asset("car-1"), who="ada")
    with pytest.raises(NotFoundError, match="car-1"):
        library.export(["car-2"], tmp_path / "none.zip")
    assert not (tmp_path / "none.zip").exists()
