"""The asset store over HTTP without workers: uploads, hostile ones too, searches, reviews, edits, archives, keys."""

from __future__ import annotations

import hashlib
import json
import threading
import zipfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from recipes import tiny_recipe
from standins import RememberingQueue

from asset_files import CUBE_OBJ, box_glb, zipped
from fullwell.assets.ingest import IngestProcess
from fullwell.core.settings import CuratorKey, Settings
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.asset_requests import ingest_limits
from fullwell.jobs.database import Database
from fullwell.jobs.ingestions import IngestionRecord, IngestionRepository
from fullwell.jobs.processes import current_process
from fullwell.jobs.records import RetryRule
from fullwell.storage import LocalStore
from fullwell_api.app import create_app
from fullwell_api.guards import identify
from fullwell_api.services import Services
from fullwell_worker.ingesting import AssetContext, run_ingestion

PROBLEM = "application/problem+json"
FORM = {"class": "car", "licence": "CC0-1.0", "attribution": "Ann", "forward_axis": "z"}


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(
        home=tmp_path / "home",
        reap_interval_s=0.1,
        max_request_bytes=200_000,
        max_upload_bytes=300_000,
        preview_on_ingest=False,
    )


@pytest.fixture(scope="module")
def reader() -> Iterator[IngestProcess]:
    with IngestProcess(ingest_limits(Settings())) as process:
        yield process


class Workshop:
    """A client, and a worker that works when it is told to."""

    def __init__(self, client: TestClient, parts: Services, reader: IngestProcess) -> None:
        self.client = client
        self.parts = parts
        self.context = AssetContext(
            name="w",
            settings=parts.settings,
            ingestions=parts.ingestions,
            library=parts.library,
            store=parts.store,
            runner=_no_runner,
            reader=reader,
        )

    def post(self, files: dict[str, bytes], **fields: str) -> Any:
        return self.client.post("/v1/assets", files=[("files", item) for item in files.items()], data=FORM | fields)

    def finish(self, answer: Any) -> IngestionRecord:
        assert answer.status_code == 202, answer.text
        run_ingestion(self.context, answer.json()["id"])
        return self.parts.ingestions.get(answer.json()["id"])

    def car(self, asset_id: str, **fields: str) -> str:
        """Put a car into the store and return its id."""
        record = self.finish(self.post({f"{asset_id}.glb": box_glb()}, **fields))
        assert record.stored is not None, record.error
        return record.stored.asset_id


def _no_runner(*_: Any, **__: Any) -> None:
    raise AssertionError("these tests render nothing")


@pytest.fixture
def shop(client: TestClient, parts: Services, reader: IngestProcess) -> Workshop:
    return Workshop(client, parts, reader)


# -- ingestion --------------------------------------------------------------------------------------------------------


def test_a_posted_model_is_queued_and_comes_out_as_a_pending_asset(shop: Workshop, queue: RememberingQueue) -> None:
    answer = shop.post({"Red Car.glb": box_glb()}, tags="sedan, red", title="A red car")
    assert answer.status_code == 202
    assert answer.headers["Location"] == f"/v1/assets/ingestions/{answer.json()['id']}" == answer.json()["links"]["self"]
    assert (answer.json()["state"], answer.json()["asset"], answer.json()["who"]) == ("queued", None, "local")
    shop.finish(answer)
    done = shop.client.get(answer.headers["Location"]).json()
    assert (done["state"], done["error"], done["asset"]) == ("done", None, {"id": "red-car", "version": 1})
    assert {"triangles", "size", "watertight"} <= {check["name"] for check in done["checks"]}
    asset = shop.client.get(done["links"]["asset"]).json()
    assert (asset["title"], asset["class"], asset["tags"], asset["state"]) == ("A red car", "car", ["red", "sedan"], "pending")
    assert asset["licence"] == {"spdx": "CC0-1.0", "attribution": "Ann", "url": ""}
    assert [round(extent, 3) for extent in asset["size_m"]] == [4.4, 1.8, 1.5]
    assert asset["manifest"]["source"]["files"]["Red Car.glb"] == hashlib.sha256(box_glb()).hexdigest()
    assert shop.client.get("/v1/assets/ingestions").json()["items"][0]["id"] == done["id"]


def test_uploaded_blobs_are_named_by_digest_and_sent_once(shop: Workshop) -> None:
    content = box_glb()
    digest = hashlib.sha256(content).hexdigest()
    assert shop.client.post("/v1/blobs/missing", json={"digests": [digest]}).json() == {"missing": [digest]}
    body = {"files": {"car.glb": digest}, "class": "car", "licence": "CC0-1.0", "length_m": 4.0}
    refused = shop.client.post("/v1/assets", json=body)
    assert (refused.status_code, refused.json()["errors"][0]["path"]) == (422, "files['car.glb']")
    assert shop.client.put(f"/v1/blobs/{digest}", content=content).status_code == 201
    assert shop.client.post("/v1/blobs/missing", json={"digests": [digest]}).json() == {"missing": []}
    record = shop.finish(shop.client.post("/v1/assets", json=body))
    assert record.stored is not None
    assert shop.client.get("/v1/assets/car").json()["size_m"][0] == pytest.approx(4.0)


def test_the_same_idempotency_key_gives_the_same_ingestion(shop: Workshop) -> None:
    digest = shop.client.post("/v1/blobs", content=box_glb()).json()["sha256"]
    body = {"files": {"car.glb": digest}, "class": "car", "licence": "CC0-1.0"}
    first, again = (shop.client.post("/v1/assets", json=body, headers={"Idempotency-Key": "k"}).json()["id"] for _ in range(2))
    assert first == again
    other = shop.client.post("/v1/assets", json=body | {"title": "x"}, headers={"Idempotency-Key": "k"})
    assert other.status_code == 409


def test_the_same_model_again_is_no_new_version_and_another_of_the_same_id_is(shop: Workshop) -> None:
    assert shop.car("car") == "car"
    shop.car("car")
    assert len(shop.client.get("/v1/assets/car/versions").json()["items"]) == 1
    shop.finish(shop.post({"car.glb": box_glb(4.6)}))
    versions = shop.client.get("/v1/assets/car/versions").json()["items"]
    assert [item["version"] for item in versions] == [2, 1]
    assert shop.client.get("/v1/assets/car/versions/1").json()["size_m"][0] == pytest.approx(4.4)
    assert shop.client.get("/v1/assets/car/versions/3").status_code == 404


def test_a_message_that_comes_twice_makes_one_asset(shop: Workshop) -> None:
    record = shop.finish(shop.post({"car.glb": box_glb()}))
    run_ingestion(shop.context, record.id)
    assert shop.parts.ingestions.get(record.id).attempt == 1


def test_uploads_at_the_same_time_all_come_in(shop: Workshop) -> None:
    answers: list[Any] = []

    def upload(number: int) -> None:
        answers.append(shop.post({f"car-{number}.glb": box_glb(4.0 + 0.1 * number)}))

    threads = [threading.Thread(target=upload, args=(number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    workers = [threading.Thread(target=shop.finish, args=(answer,)) for answer in answers for _ in range(2)]
    for thread in workers:
        thread.start()
    for thread in workers:
        thread.join()
    found = shop.client.get("/v1/assets").json()
    assert (found["total"], {item["version"] for item in found["items"]}) == (6, {1})


def test_an_interrupted_ingestion_whose_asset_is_stored_is_not_read_again(shop: Workshop) -> None:
    answer = shop.post({"car.glb": box_glb()})
    record = shop.finish(answer)
    repository = IngestionRepository(shop.parts.database)
    with shop.parts.database.writing() as session:
        from fullwell.jobs.models import IngestionRow

        row = session.get(IngestionRow, record.id)
        assert row is not None
        row.state, row.request_json = "queued", "{}"  # it could not be read any more
    run_ingestion(shop.context, record.id)
    assert repository.get(record.id).state == "done"


# -- hostile and mistaken uploads -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"car.glb": box_glb()[:-50]}, "truncated"),
        ({"car.glb": b""}, "car.glb"),
        ({"car.glb": b"glTF" + b"\xff" * 100}, "car.glb"),
        ({"kit.zip": zipped({"../../evil.glb": box_glb()})}, "kit.zip"),
        ({"kit.zip": zipped({"/etc/evil.glb": box_glb()})}, "kit.zip"),
        ({"kit.zip": zipped({"a.glb": box_glb(), "b.glb": box_glb()})}, "member"),
        ({"kit.zip": zipped({"bomb.glb": b"\0" * 60_000_000})}, "kit.zip"),
        ({"car.obj": b"mtllib ../../../etc/passwd\n" + CUBE_OBJ}, "passwd"),
    ],
)
def test_a_hostile_upload_fails_with_a_clear_cause_and_leaves_no_asset(
    shop: Workshop, files: dict[str, bytes], words: str
) -> None:
    record = shop.finish(shop.post(files))
    assert record.state == "failed"
    assert record.error_code == "ingest_failed"
    assert words in (record.error or "")
    assert record.attempt == 1, "what the file is to blame for is not tried again"
    assert shop.client.get("/v1/assets").json()["total"] == 0
    shown = shop.client.get(f"/v1/assets/ingestions/{record.id}").json()
    assert shown["error"] == {"code": "ingest_failed", "message": record.error}
    assert shop.client.post(f"/v1/assets/ingestions/{record.id}/retry").status_code == 202


@pytest.mark.parametrize(
    ("fields", "path"),
    [
        ({"class": "cart"}, "class"),
        ({"licence": "do what you want"}, "licence"),
        ({"licence": ""}, "licence"),
        ({"id": "../up"}, "id"),
        ({"tags": "Not A Tag"}, "tags"),
        ({"up_axis": "w"}, "up_axis"),
        ({"unit_m": "-1"}, "unit_m"),
        ({"unit_m": "nan"}, "unit_m"),
        ({"variant": "red"}, "variant"),
        ({"main": "other.glb"}, "main"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_an_illegal_field_is_refused_before_any_work(shop: Workshop, fields: dict[str, str], path: str) -> None:
    answer = shop.post({"car.glb": box_glb()}, **fields)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == PROBLEM
    assert answer.json()["errors"][0]["path"].startswith(path), answer.text
    assert shop.client.get("/v1/assets/ingestions").json()["items"] == []


def test_a_file_name_that_leaves_its_folder_is_refused(shop: Workshop) -> None:
    for name in ("../car.glb", "/etc/car.glb", "C:/car.glb", "a/../../car.glb"):
        assert shop.post({name: box_glb()}).status_code == 422, name


def test_a_form_without_files_and_other_kinds_of_bodies_are_refused(shop: Workshop) -> None:
    assert shop.client.post("/v1/assets", data=FORM, files=[("files", ("", b""))]).status_code == 422
    assert shop.client.post("/v1/assets", content=b"x", headers={"Content-Type": "text/plain"}).status_code == 415
    assert shop.client.post("/v1/assets", content=b"{", headers={"Content-Type": "application/json"}).status_code == 422
    broken = shop.client.post("/v1/assets", content=b"--x\r\n", headers={"Content-Type": "multipart/form-data; boundary=x"})
    assert broken.status_code in (400, 422)


def test_too_large_an_upload_is_refused(shop: Workshop) -> None:
    answer = shop.post({"car.glb": b"x" * 400_000})
    assert (answer.status_code, answer.json()["code"]) == (413, "too_large")
    assert shop.client.post("/v1/assets/archives", content=b"x" * 400_000).status_code == 413
    assert shop.client.post("/v1/assets/review", content=b"x" * 250_000).status_code == 413


def test_a_missing_texture_is_a_warning_that_names_it(shop: Workshop) -> None:
    material = b"newmtl paint\nKd 0.8 0.1 0.1\nmap_Kd paint.png\n"
    record = shop.finish(shop.post({"cube.obj": CUBE_OBJ, "cube.mtl": material}, **{"class": "other"}))
    assert record.stored is not None, record.error
    checks = json.loads(record.stored.checks_json)
    told = [check for check in checks if "paint.png" in check["message"]]
    assert told, checks
    assert all(check["state"] in ("warning", "decide") for check in told)


# -- search, files, pictures ------------------------------------------------------------------------------------------


def test_searches_filter_count_and_page(shop: Workshop) -> None:
    for number in range(3):
        shop.car(f"car-{number}", tags="sedan" if number else "suv", title=f"Car number {number}")
    shop.finish(shop.post({"box.glb": box_glb(1.0, 0.5, 0.5)}, **{"class": "other", "licence": "CC-BY-4.0"}))

    def ids(**query: Any) -> list[str]:
        return [item["id"] for item in shop.client.get("/v1/assets", params=query).json()["items"]]

    assert ids() == ["box", "car-0", "car-1", "car-2"]
    assert ids(**{"class": "car"}) == ["car-0", "car-1", "car-2"]
    assert ids(tags="sedan") == ["car-1", "car-2"]
    assert ids(without_tags=["sedan", "suv"]) == ["box"]
    assert ids(licence=["cc-by-4.0"]) == ["box"]
    assert ids(min_length_m=2, max_length_m=5) == ["car-0", "car-1", "car-2"]
    assert ids(text="number 2") == ["car-2"]
    assert ids(id=["box", "car-1"]) == ["box", "car-1"]
    assert ids(state="approved") == []
    page = shop.client.get("/v1/assets", params={"limit": 3}).json()
    assert (page["total"], len(page["items"])) == (4, 3)
    rest = shop.client.get("/v1/assets", params={"limit": 3, "cursor": page["next_cursor"]}).json()
    assert ([item["id"] for item in rest["items"]], rest["next_cursor"]) == (["car-2"], None)
    facets = shop.client.get("/v1/assets/facets").json()
    assert (facets["class"], facets["tag"]["sedan"], facets["state"]) == ({"car": 3, "other": 1}, 2, {"pending": 4})
    for query in ({"class": "cart"}, {"order": "shoe"}, {"limit": 0}, {"min_length_m": 5, "max_length_m": 1}, {"shoe": "1"}):
        assert shop.client.get("/v1/assets", params=query).status_code == 422, query
    assert shop.client.get("/v1/assets", params={"cursor": "made up"}).status_code == 422


def test_the_model_is_sent_with_its_type_and_kept_by_browsers_for_ever_by_version(shop: Workshop) -> None:
    shop.car("car")
    asset = shop.client.get("/v1/assets/car").json()
    answer = shop.client.get(asset["links"]["file"])
    assert answer.content[:4] == b"glTF"
    assert answer.headers["content-type"] == "model/gltf-binary"
    assert "immutable" in answer.headers["cache-control"]
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert hashlib.sha256(answer.content).hexdigest() == asset["manifest"]["levels"][0]["sha256"]
    again = shop.client.get(asset["links"]["file"], headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert shop.client.get("/v1/assets/car/files/0").headers["cache-control"] == "no-cache"
    assert shop.client.get("/v1/assets/car/files/99").status_code == 404
    assert shop.client.get("/v1/assets/none/files/0").status_code == 404


def test_pictures_are_sent_when_they_are_there_and_asked_for_again_by_hand(shop: Workshop, queue: RememberingQueue) -> None:
    shop.car("car")
    for name in ("thumb", "../../cas/x", "UPPER"):
        assert shop.client.get(f"/v1/assets/car/preview/{name}").status_code == 404
    entry = shop.parts.library.get("car")
    shop.parts.store.put(shop.parts.library.preview_key(entry.manifest.look_digest, "thumb"), b"\x89PNG", "image/png")
    picture = shop.client.get("/v1/assets/car/preview/thumb")
    assert (picture.content, picture.headers["content-type"]) == (b"\x89PNG", "image/png")
    assert shop.client.get("/v1/assets/car").json()["previews"] == ["thumb"]
    answer = shop.client.post("/v1/assets/car/previews")
    assert (answer.status_code, answer.json()["kind"], answer.json()["asset"]) == (202, "previews", {"id": "car", "version": 1})


# -- decisions --------------------------------------------------------------------------------------------------------


def test_decisions_need_reasons_where_they_matter_and_leave_a_record(shop: Workshop) -> None:
    shop.car("car")
    assert shop.client.post("/v1/assets/car/review", json={"state": "rejected"}).status_code == 422
    rejected = shop.client.post("/v1/assets/car/review", json={"state": "rejected", "reason": "wheels are missing"})
    assert (rejected.json()["state"], rejected.json()["reason"]) == ("rejected", "wheels are missing")
    assert shop.client.post("/v1/assets/car/review", json={"state": "approved", "reason": "a box will do"}).status_code == 200
    events = shop.client.get("/v1/assets/car/events").json()["items"]
    assert [(event["kind"], event["who"], event["detail"]) for event in events] == [
        ("approved", "local", "a box will do"),
        ("rejected", "local", "wheels are missing"),
        ("imported", "local", ""),
    ]
    assert shop.client.post("/v1/assets/none/review", json={"state": "approved"}).status_code == 404


def test_many_assets_are_decided_about_by_search_or_not_at_all(shop: Workshop) -> None:
    for number in range(3):
        shop.car(f"car-{number}")
    decision = {"query": {"class": "car"}, "state": "approved", "reason": "seen"}
    changed = shop.client.post("/v1/assets/review", json=decision).json()["items"]
    assert [item["state"] for item in changed] == ["approved"] * 3
    refused = shop.client.post("/v1/assets/review", json={"ids": ["car-0", "none"], "state": "rejected", "reason": "x"})
    assert refused.status_code == 404
    assert shop.client.get("/v1/assets/car-0").json()["state"] == "approved"
    for empty in ({}, {"ids": [], "state": "approved"}, {"ids": ["car-0"], "query": {}, "state": "approved"}):
        assert shop.client.post("/v1/assets/review", json=empty).status_code == 422


def test_an_edit_is_a_new_version_and_never_overwrites_anothers(shop: Workshop) -> None:
    shop.car("car", tags="red,old")
    etag = shop.client.get("/v1/assets/car").headers["etag"]
    changes = {"title": "Estate", "tags": ["red", "estate"], "attribution": "Bob", "part_materials": {"body": "paint/blue"}}
    edited = shop.client.patch("/v1/assets/car", json=changes, headers={"If-Match": etag})
    assert edited.status_code == 200, edited.text
    assert (edited.json()["version"], edited.headers["etag"]) == (2, '"2"')
    assert (edited.json()["title"], edited.json()["tags"]) == ("Estate", ["estate", "red"])
    assert edited.json()["licence"] == {"spdx": "CC0-1.0", "attribution": "Bob", "url": ""}
    material = shop.client.get("/v1/assets/car").json()["manifest"]["parts"][0]["material"]
    assert (material["name"], material["origin"]) == ("paint/blue", "curator")
    late = shop.client.patch("/v1/assets/car", json={"title": "Mine"}, headers={"If-Match": etag})
    assert (late.status_code, late.json()["code"]) == (412, "precondition_failed")
    assert shop.client.get("/v1/assets/car").json()["title"] == "Estate"
    for illegal in ({"class": "cart"}, {"licence": "free"}, {"part_materials": {"body": "paint/rde"}}, {"shoe": 1}):
        assert shop.client.patch("/v1/assets/car", json=illegal).status_code == 422, illegal
    assert shop.client.patch("/v1/assets/car", json={"title": "x"}, headers={"If-Match": "abc"}).status_code == 422


def test_many_assets_are_edited_at_once(shop: Workshop) -> None:
    for number in range(2):
        shop.car(f"car-{number}", tags="red")
    both = {"ids": ["car-0", "car-1"], "changes": {"add_tags": ["kit"], "remove_tags": ["red"]}}
    assert [item["tags"] for item in shop.client.patch("/v1/assets", json=both).json()["items"]] == [["kit"], ["kit"]]
    assert shop.client.patch("/v1/assets", json=both | {"changes": {"tags": ["a"]}}).status_code == 422


def test_a_retired_asset_is_found_no_more_until_it_comes_in_again(shop: Workshop) -> None:
    shop.car("car")
    assert shop.client.delete("/v1/assets/car", params={"reason": "a duplicate"}).json()["retired"] is True
    assert shop.client.get("/v1/assets").json()["total"] == 0
    shop.car("car")
    assert shop.client.get("/v1/assets").json()["total"] == 1


# -- archives and upkeep ----------------------------------------------------------------------------------------------


def test_an_exported_archive_comes_in_elsewhere(shop: Workshop, tmp_path: Path) -> None:
    shop.car("car")
    shop.client.post("/v1/assets/car/review", json={"state": "approved", "reason": "seen"})
    answer = shop.client.post("/v1/assets/export", json={"ids": ["car"]})
    assert answer.headers["content-type"] == "application/zip"
    assert any(name.endswith("LICENCES.md") for name in zipfile.ZipFile(BytesIO(answer.content)).namelist())
    assert shop.client.post("/v1/assets/export", json={"query": {"class": "bus"}}).status_code == 422
    file = tmp_path / "assets.zip"
    file.write_bytes(answer.content)
    database = Database(f"sqlite:///{tmp_path / 'elsewhere.sqlite3'}")
    database.upgrade()
    elsewhere = AssetLibrary(LocalStore(tmp_path / "elsewhere"), database)
    came = elsewhere.import_archive(file, who="bob", trust_states=True)
    assert [(entry.id, entry.state, entry.digest) for entry in came] == [
        ("car", "approved", shop.parts.library.get("car").digest)
    ]
    database.close()


def test_an_archive_comes_in_whole_or_not_at_all(shop: Workshop) -> None:
    shop.car("car")
    archive = shop.client.post("/v1/assets/export", json={"ids": ["car"]}).content
    shop.client.delete("/v1/assets/car")
    for damaged in (
        b"",
        b"PK\x05\x06" + b"\0" * 18,
        archive[:-200],
        archive[:2000] + bytes([archive[2000] ^ 1]) + archive[2001:],
        zipped({"../x": b"y"}),
    ):
        refused = shop.client.post("/v1/assets/archives", content=damaged)
        assert (refused.status_code, refused.json()["code"]) == (422, "bad_asset"), damaged[:10]
    assert shop.client.get("/v1/assets").json()["total"] == 0
    came = shop.client.post("/v1/assets/archives", content=archive)
    assert [(item["id"], item["version"]) for item in came.json()["items"]] == [("car", 1)]


def test_garbage_is_only_counted_unless_it_is_to_go_and_the_catalogue_comes_back_from_the_store(shop: Workshop) -> None:
    shop.car("car")
    report = shop.client.post("/v1/assets/gc", json={}).json()
    assert (report["dry_run"], report["blobs"]) == (True, 0)
    assert shop.client.post("/v1/assets/reindex").json() == {"versions": 1}
    assert shop.client.get("/v1/assets/car").status_code == 200


# -- recipes ----------------------------------------------------------------------------------------------------------


def test_a_submitted_recipe_is_pinned_to_what_it_draws_from_now(shop: Workshop) -> None:
    recipe = tiny_recipe()
    recipe["scene"]["objects"][1] = {"id": "car", "geometry": {"kind": "asset", "class": "car"}}
    none_yet = shop.client.post("/v1/jobs", json={"recipe": recipe})
    assert none_yet.status_code == 422
    assert "finds no asset" in none_yet.json()["detail"]
    assert shop.client.post("/v1/recipes/validate", json={"recipe": recipe}).json()["valid"] is False
    shop.car("car")
    shop.client.post("/v1/assets/car/review", json={"state": "approved", "reason": "seen"})
    job = shop.client.post("/v1/jobs", json={"recipe": recipe})
    assert job.status_code == 202, job.text
    stored = shop.client.get(f"/v1/jobs/{job.json()['id']}/recipe").json()["recipe"]
    assert list(stored["assets"].values()) == [[f"car@{shop.parts.library.get('car').digest}"]]


# -- keys -------------------------------------------------------------------------------------------------------------


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[TestClient]:
    curators = (CuratorKey.from_text("ann:key-of-ann"), CuratorKey.from_text("bob:key-of-bob"))
    settings = Settings(home=tmp_path / "g", api_keys="key-of-user", curator_keys=curators)  # type: ignore[arg-type]
    with TestClient(create_app(settings, queue=RememberingQueue()), base_url="http://127.0.0.1") as client:
        yield client


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


CHANGES = [
    ("post", "/v1/assets"),
    ("patch", "/v1/assets"),
    ("post", "/v1/assets/review"),
    ("post", "/v1/assets/archives"),
    ("post", "/v1/assets/gc"),
    ("post", "/v1/assets/reindex"),
    ("patch", "/v1/assets/car"),
    ("delete", "/v1/assets/car"),
    ("post", "/v1/assets/car/review"),
    ("post", "/v1/assets/car/previews"),
    ("post", "/v1/assets/ingestions/x/retry"),
]


@pytest.mark.parametrize(("method", "path"), CHANGES)
def test_only_a_curators_key_changes_assets(guarded: TestClient, method: str, path: str) -> None:
    assert guarded.request(method, path).status_code == 401
    assert guarded.request(method, path, headers=bearer("wrong-key")).status_code == 401
    refused = guarded.request(method, path, headers=bearer("key-of-user"), json={})
    assert (refused.status_code, refused.json()["code"]) == (403, "forbidden")
    assert "FULLWELL_CURATOR_KEYS" in refused.json()["detail"]
    assert guarded.request(method, path, headers=bearer("key-of-ann"), json={}).status_code not in (401, 403)


def test_a_users_key_reads_assets_and_uploads_blobs_and_a_curators_key_runs_jobs_too(guarded: TestClient) -> None:
    user, curator = bearer("key-of-user"), bearer("key-of-bob")
    assert guarded.get("/v1/assets", headers=user).status_code == 200
    assert guarded.get("/v1/assets/ingestions", headers=user).status_code == 200
    assert guarded.post("/v1/blobs", content=b"x", headers=user).status_code == 201
    assert guarded.get("/v1/jobs", headers=curator).status_code == 200
    assert guarded.get("/v1/assets").status_code == 401


def test_the_record_carries_the_curators_name_and_never_a_key(guarded: TestClient) -> None:
    digest = guarded.post("/v1/blobs", content=box_glb(), headers=bearer("key-of-user")).json()["sha256"]
    body = {"files": {"car.glb": digest}, "class": "car", "licence": "CC0-1.0"}
    assert guarded.post("/v1/assets", json=body, headers=bearer("key-of-ann")).json()["who"] == "ann"


def test_without_a_curators_key_a_change_is_refused_with_the_name_of_the_variable(tmp_path: Path) -> None:
    settings = Settings(home=tmp_path, api_keys="key-of-user")  # type: ignore[arg-type]
    with TestClient(create_app(settings, queue=RememberingQueue()), base_url="http://127.0.0.1") as client:
        refused = client.post("/v1/assets/gc", json={}, headers=bearer("key-of-user"))
    assert refused.status_code == 403
    assert "set FULLWELL_CURATOR_KEYS=name:key" in refused.json()["detail"]


def test_callers_are_told_apart_by_their_keys(tmp_path: Path) -> None:
    settings = Settings(home=tmp_path, curator_keys=(CuratorKey.from_text("ann:key-of-ann"),))
    ann = identify(settings, "key-of-ann")
    assert ann is not None
    assert (ann.name, ann.may_curate) == ("ann", True)
    assert identify(settings, None) is None
    assert identify(settings, "key-of-bob") is None
    local = identify(Settings(home=tmp_path), None)
    assert local is not None
    assert (local.name, local.may_curate) == ("local", True)


# -- documents --------------------------------------------------------------------------------------------------------


def test_the_openapi_examples_are_what_the_service_takes(app: FastAPI, shop: Workshop) -> None:
    document = app.openapi()
    examples = {
        name: schema["examples"][0] for name, schema in document["components"]["schemas"].items() if "examples" in schema
    }
    assert {"BulkReview", "AssetEdit", "ExportOrder"} <= set(examples)
    shop.car("car", tags="sedan")
    review = shop.client.post("/v1/assets/review", json=examples["BulkReview"])
    assert (review.status_code, len(review.json()["items"])) == (200, 1)
    assert shop.client.patch("/v1/assets/car", json=examples["AssetEdit"]).status_code == 200
    assert shop.client.post("/v1/assets/export", json=examples["ExportOrder"]).status_code == 200
    upload = document["paths"]["/v1/assets"]["post"]["requestBody"]["content"]
    body = upload["application/json"]["schema"]["examples"][0]
    missing = shop.client.post("/v1/assets", json=body).json()
    assert missing["errors"][0]["path"].startswith("files"), "all but the blobs, which nobody has uploaded, is in order"
    assert set(upload["multipart/form-data"]["schema"]["required"]) == {"files", "class", "licence"}


def test_classes_and_materials_are_listed_with_their_sizes_and_spectra(client: TestClient) -> None:
    classes = {item["name"]: item for item in client.get("/v1/assets/classes").json()["items"]}
    assert classes["car"]["subclasses"]["sedan"] == [3.5, 5.5]
    assert "paint/red" in client.get("/v1/catalog/materials").json()["items"]
    red = client.get("/v1/catalog/materials/paint/red").json()
    assert (red["curve"]["wavelength_nm"][0], red["curve"]["wavelength_nm"][-1]) == (380.0, 1000.0)
    assert len(red["curve"]["values"]) == 125
    at = dict(zip(red["curve"]["wavelength_nm"], red["curve"]["values"], strict=True))
    assert at[650.0] > 3 * at[500.0], "red paint sends back red light"
    unknown = client.get("/v1/catalog/materials/paint/rde")
    assert unknown.status_code == 404
    assert "paint/red" in unknown.json()["detail"]


def test_a_retried_ingestion_of_a_killed_worker_is_finished_by_the_next(shop: Workshop) -> None:
    answer = shop.post({"car.glb": box_glb()})
    rule = RetryRule(max_attempts=3, delay_s=0.0)
    lease = shop.parts.ingestions.acquire(
        answer.json()["id"], worker="killed", holder=current_process(), lease_s=-1.0, rule=rule
    )
    assert lease is not None
    record = shop.finish(answer)
    assert (record.state, record.attempt, record.worker) == ("done", 2, "w")
