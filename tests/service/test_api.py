"""The HTTP interface without workers: submission, paging, problems, guards, blobs, products, events, metrics."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from recipes import tiny_recipe
from standins import RememberingQueue

from fullwell.core import ServiceError
from fullwell.core.settings import Settings
from fullwell.jobs.processes import current_process
from fullwell.jobs.records import Lease, RetryRule
from fullwell_api.app import create_app
from fullwell_api.services import Services

RULE = RetryRule(max_attempts=1)
PROBLEM = "application/problem+json"


def submit(client: TestClient, frames: int = 2, **fields: Any) -> dict[str, Any]:
    answer = client.post("/v1/jobs", json={"recipe": tiny_recipe(frames), **fields})
    assert answer.status_code == 202, answer.text
    document: dict[str, Any] = answer.json()
    return document


def lease(parts: Services, job_id: str, number: int) -> Lease:
    taken = parts.repository.acquire(job_id, number, worker="w", holder=current_process(), lease_s=60, rule=RULE)
    assert taken is not None
    return taken


def finish(parts: Services, job_id: str, number: int, products: dict[str, bytes]) -> None:
    """Publish a frame as a worker would."""
    taken = lease(parts, job_id, number)
    prefix = f"jobs/{job_id}/frames/{number}"
    listing = []
    for name, content in products.items():
        parts.store.put(f"{prefix}/{name}", content)
        listing.append({"name": name, "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()})
    parts.store.put(f"{prefix}/manifest.json", json.dumps({"products": listing}).encode(), if_absent=True)
    parts.repository.complete(taken)


def wait_until(condition: Any, seconds: float = 5.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_a_submitted_recipe_becomes_a_queued_job_whose_frames_are_sent(client: TestClient, queue: RememberingQueue) -> None:
    answer = client.post("/v1/jobs", json={"recipe": tiny_recipe(3), "priority": 0})
    assert answer.status_code == 202
    job = answer.json()
    assert answer.headers["Location"] == f"/v1/jobs/{job['id']}" == job["links"]["self"]
    assert (job["state"], job["name"]) == ("queued", "two balls")
    assert job["frames"] == {"total": 3, "queued": 3, "running": 0, "done": 0, "failed": 0, "cancelled": 0}
    wait_until(lambda: queue.sent)
    assert queue.sent == [(job["id"], (0, 1, 2), 0)]
    assert client.get(f"/v1/jobs/{job['id']}/recipe").json()["recipe"] == tiny_recipe(3)


def test_an_illegal_recipe_is_refused_with_every_field_and_its_nearest_name(client: TestClient) -> None:
    recipe = tiny_recipe()
    recipe["cameras"][0]["sensors"][0]["exposure"]["time_s"] = -1
    recipe["outputs"] = ["image.pgn"]
    answer = client.post("/v1/jobs", json={"recipe": recipe})
    assert answer.status_code == 422
    assert answer.headers["content-type"] == PROBLEM
    problem = answer.json()
    assert problem["code"] == "invalid_recipe"
    messages = " ".join(item["message"] for item in problem["errors"])
    assert "cameras[0].sensors[0].exposure.time_s" in messages
    assert "image.png" in messages
    assert client.get("/v1/jobs").json()["items"] == []


def test_an_unknown_name_in_the_recipe_is_refused_before_any_work(client: TestClient) -> None:
    recipe = tiny_recipe()
    recipe["cameras"][0]["sensors"][0]["model"] = "imx336"
    answer = client.post("/v1/jobs", json={"recipe": recipe})
    assert answer.status_code == 422
    assert "imx363" in answer.json()["detail"].casefold()


def test_checking_a_recipe_loads_no_renderer() -> None:
    program = (
        "import sys, json; from fullwell_api.checks import checked_document; "
        "checked_document(json.loads(sys.stdin.read()), {}, {}); "
        "print([name for name in ('mitsuba', 'drjit', 'trimesh') if name in sys.modules])"
    )
    child = subprocess.run(
        [sys.executable, "-c", program], input=json.dumps(tiny_recipe()), capture_output=True, text=True, check=False
    )
    assert child.stdout.strip() == "[]", child.stderr


def test_overrides_are_applied_before_validation(client: TestClient) -> None:
    assert submit(client, 1, overrides={"vary.repeat": 4})["frames"]["total"] == 4
    answer = client.post("/v1/jobs", json={"recipe": tiny_recipe(), "overrides": {"qualty.x": 1}})
    assert answer.status_code == 422


def test_the_order_of_vary_survives_submission(client: TestClient) -> None:
    recipe = tiny_recipe()
    recipe["vary"] = {"grid": {"seed": [1, 2], "quality.max_depth": [2, 3]}}
    job = client.post("/v1/jobs", json={"recipe": recipe}).json()
    stored = client.get(f"/v1/jobs/{job['id']}/recipe").json()["recipe"]
    assert list(stored["vary"]["grid"]) == ["seed", "quality.max_depth"]


@pytest.mark.parametrize("file", ["/etc/passwd", "../../etc/passwd", "a/../../x.obj", "~/x.obj", "not-uploaded.obj"])
@pytest.mark.parametrize("place", ["geometry", "vary", "override"])
def test_a_recipe_cannot_name_a_file_of_the_server(client: TestClient, file: str, place: str) -> None:
    recipe = tiny_recipe()
    overrides: dict[str, Any] = {}
    if place == "geometry":
        recipe["scene"]["objects"][1]["geometry"] = {"kind": "model", "file": file}
    elif place == "vary":
        recipe["scene"]["objects"][1]["geometry"] = {"kind": "model", "file": "ok.obj"}
        recipe["vary"] = {"grid": {"scene.objects[red].geometry[file]": [file]}}
    else:
        overrides = {"scene.objects[red].geometry": {"kind": "model", "file": file}}
    answer = client.post("/v1/jobs", json={"recipe": recipe, "overrides": overrides})
    assert answer.status_code == 422, answer.text
    assert "file" in answer.json()["detail"]


def test_a_recipe_given_as_the_name_of_a_server_file_is_refused(client: TestClient) -> None:
    for recipe in ("/etc/passwd", ["/etc/passwd"], None):
        assert client.post("/v1/jobs", json={"recipe": recipe}).status_code == 422


def test_files_are_uploaded_once_and_named_by_the_job(client: TestClient) -> None:
    content = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    digest = hashlib.sha256(content).hexdigest()
    recipe = tiny_recipe()
    recipe["scene"]["objects"][1]["geometry"] = {"kind": "model", "file": "models/ball.obj"}
    body = {"recipe": recipe, "files": {"models/ball.obj": digest}}
    refused = client.post("/v1/jobs", json=body)
    assert refused.status_code == 422
    assert "has not been uploaded" in refused.json()["detail"]
    assert client.post("/v1/blobs/missing", json={"digests": [digest]}).json() == {"missing": [digest]}
    assert client.put(f"/v1/blobs/{digest}", content=content).status_code == 201
    assert client.put(f"/v1/blobs/{digest}", content=content).status_code == 200
    assert client.head(f"/v1/blobs/{digest}").status_code == 200
    assert client.post("/v1/blobs/missing", json={"digests": [digest]}).json() == {"missing": []}
    assert client.post("/v1/jobs", json=body).status_code == 202
    assert client.post("/v1/blobs", content=content).json() == {"sha256": digest, "bytes": len(content)}


def test_a_blob_that_is_not_its_digest_is_not_stored(client: TestClient) -> None:
    digest = hashlib.sha256(b"right").hexdigest()
    assert client.put(f"/v1/blobs/{digest}", content=b"wrong").status_code == 422
    assert client.head(f"/v1/blobs/{digest}").status_code == 404
    assert client.put("/v1/blobs/..%2f..%2fx", content=b"x").status_code in (404, 422)


def test_the_same_idempotency_key_gives_the_same_job(client: TestClient) -> None:
    headers = {"Idempotency-Key": "night-run-7"}
    first = client.post("/v1/jobs", json={"recipe": tiny_recipe()}, headers=headers)
    again = client.post("/v1/jobs", json={"recipe": tiny_recipe()}, headers=headers)
    other = client.post("/v1/jobs", json={"recipe": tiny_recipe(2)}, headers=headers)
    assert (first.status_code, again.status_code, other.status_code) == (202, 202, 409)
    assert first.json()["id"] == again.json()["id"]
    assert len(client.get("/v1/jobs").json()["items"]) == 1


def test_jobs_and_frames_are_paged_by_cursor(client: TestClient) -> None:
    made = []
    for _ in range(3):
        made.append(submit(client, 5)["id"])
        time.sleep(0.002)
    first = client.get("/v1/jobs", params={"limit": 2}).json()
    rest = client.get("/v1/jobs", params={"limit": 2, "cursor": first["next_cursor"]}).json()
    assert [job["id"] for job in first["items"] + rest["items"]] == made[::-1]
    assert rest["next_cursor"] is None
    numbers, cursor = [], -1
    while cursor is not None:
        page = client.get(f"/v1/jobs/{made[0]}/frames", params={"limit": 2, "cursor": cursor}).json()
        numbers += [frame["number"] for frame in page["items"]]
        cursor = page["next_cursor"]
    assert numbers == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("method", "path", "status", "code"),
    [
        ("GET", "/v1/jobs/j0", 404, "not_found"),
        ("GET", "/v1/jobs/j0/frames", 404, "not_found"),
        ("GET", "/v1/jobs/j0/frames/0", 404, "not_found"),
        ("GET", "/v1/jobs/j0/frames/99999999999999999999", 404, "not_found"),
        ("GET", "/v1/jobs/j0/events", 404, "not_found"),
        ("POST", "/v1/jobs/j0/cancel", 404, "not_found"),
        ("POST", "/v1/jobs/%00/cancel", 404, "not_found"),
        ("GET", "/v1/nothing", 404, "not_found"),
        ("GET", "/web/..%2fpages.py", 404, "not_found"),
        ("DELETE", "/v1/jobs", 405, "method_not_allowed"),
        ("GET", "/v1/jobs?limit=0", 422, "invalid_request"),
        ("GET", "/v1/jobs?state=half", 422, "invalid_request"),
        ("POST", "/v1/jobs", 422, "invalid_request"),
    ],
)
def test_every_error_is_a_problem_document(client: TestClient, method: str, path: str, status: int, code: str) -> None:
    answer = client.request(method, path)
    assert answer.status_code == status
    assert answer.headers["content-type"] == PROBLEM
    problem = answer.json()
    assert (problem["status"], problem["code"]) == (status, code)
    assert problem["detail"]


@pytest.mark.parametrize(
    "body",
    [
        b"{",
        b"[" * 100_000,
        b'{"recipe": NaN}',
        b'{"recipe": {"schema": "fullwell/recipe/v1", "seed": NaN, "x": "\\ud800"}}',
        b"\xff\xfe",
        b'{"recipe": {}, "unknown": 1}',
        b'{"recipe": {"name": "\\u0000"}}',
    ],
)
def test_broken_bodies_are_refused_without_an_internal_error(client: TestClient, body: bytes) -> None:
    answer = client.post("/v1/jobs", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code in (400, 422)
    assert answer.headers["content-type"] == PROBLEM


def test_a_body_that_is_too_large_is_refused_before_and_while_it_is_read(client: TestClient) -> None:
    large = b" " * 200_001
    assert client.post("/v1/jobs", content=large).status_code == 413
    assert client.post("/v1/jobs", content=iter([large[:100_000]] * 3)).status_code == 413
    assert client.post("/v1/blobs", content=large).status_code == 201
    assert client.post("/v1/blobs", content=iter([large] * 2)).status_code == 413


def test_an_internal_error_is_a_problem_that_gives_nothing_away(
    client: TestClient, parts: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_: object) -> None:
        raise RuntimeError("secret path")

    monkeypatch.setattr(type(parts.repository), "job", broken)
    answer = client.get("/v1/jobs/j0")
    assert answer.status_code == 500
    assert answer.headers["content-type"] == PROBLEM
    assert "secret" not in answer.text


def test_keys_are_required_where_they_are_set(tmp_path: Path, queue: RememberingQueue) -> None:
    settings = Settings(home=tmp_path, api_keys="first-key,second-key")  # type: ignore[arg-type]
    with TestClient(create_app(settings, queue=queue)) as client:
        assert client.get("/v1/jobs").status_code == 401
        assert client.get("/v1/jobs").headers["www-authenticate"].startswith("Bearer")
        for key, status in (("first-key", 200), ("second-key", 200), ("wrong-key", 401), ("first-key ", 200), ("", 401)):
            assert client.get("/v1/jobs", headers={"Authorization": f"Bearer {key}"}).status_code == status, key
        assert client.get("/v1/jobs", headers={"Authorization": "Basic first-key"}).status_code == 401
        assert client.get("/healthz").status_code == 200
        assert client.post("/v1/blobs", content=b"x").status_code == 401
        assert "first-key" not in repr(settings)


def test_an_open_service_for_other_machines_is_refused(tmp_path: Path, queue: RememberingQueue) -> None:
    with pytest.raises(ServiceError, match="FULLWELL_API_KEYS"):
        create_app(Settings(home=tmp_path, host="0.0.0.0"), queue=queue)
    create_app(Settings(home=tmp_path, host="0.0.0.0", allow_open=True), queue=queue)


def test_pages_of_other_sites_can_neither_read_nor_change_anything(client: TestClient) -> None:
    job = submit(client)
    assert client.get("/v1/jobs", headers={"Host": "evil.example"}).status_code == 421
    for headers in ({"Origin": "http://evil.example"}, {"Origin": "null"}, {"Sec-Fetch-Site": "cross-site"}):
        assert client.post(f"/v1/jobs/{job['id']}/cancel", headers=headers).status_code == 403
    assert client.post(f"/v1/jobs/{job['id']}/cancel", headers={"Origin": "http://127.0.0.1"}).status_code == 202


def test_products_appear_when_the_frame_is_done_and_nothing_else_can_be_read(client: TestClient, parts: Services) -> None:
    job = submit(client)["id"]
    base = f"/v1/jobs/{job}/frames/0/products"
    assert client.get(base).json() == {"items": []}
    assert client.get(f"{base}/image.png").status_code == 404
    finish(parts, job, 0, {"image.png": b"\x89PNG", "left/phone/labels.json": b"{}"})
    items = client.get(base).json()["items"]
    assert [item["name"] for item in items] == ["image.png", "left/phone/labels.json", "manifest.json"]
    picture = client.get(items[0]["url"])
    assert (picture.content, picture.headers["content-type"]) == (b"\x89PNG", "image/png")
    assert picture.headers["x-content-type-options"] == "nosniff"
    assert client.get(items[1]["url"]).content == b"{}"
    parts.store.put("secret.txt", b"secret")
    parts.store.put(f"jobs/{job}/frames/0/unlisted.txt", b"secret")
    for name in (
        "../../../../secret.txt",
        "..%2f..%2f..%2f..%2fsecret.txt",
        "%2e%2e/1/x",
        "/etc/passwd",
        "unlisted.txt",
    ):
        answer = client.get(f"{base}/{name}")
        assert answer.status_code in (404, 405), name
        assert b"secret" not in answer.content or b"secret.txt" in answer.content


def test_cancelling_and_retrying_follow_the_states(client: TestClient, parts: Services, queue: RememberingQueue) -> None:
    job = submit(client)["id"]
    assert client.post(f"/v1/jobs/{job}/retry").status_code == 409
    finish(parts, job, 0, {})
    parts.repository.fail(lease(parts, job, 1), cause="bad mesh", code="bad_asset", retryable=False, rule=RULE)
    frame = client.get(f"/v1/jobs/{job}/frames/1").json()
    assert frame["error"] == {"code": "bad_asset", "message": "bad mesh"}
    assert [(a["attempt"], a["outcome"], a["cause"]) for a in frame["attempts"]] == [(1, "failed", "bad mesh")]
    assert client.get(f"/v1/jobs/{job}").json()["state"] == "failed"
    assert client.post(f"/v1/jobs/{job}/cancel").status_code == 409
    sent = len(queue.sent)
    retried = client.post(f"/v1/jobs/{job}/retry").json()
    assert (retried["retried"], retried["job"]["state"]) == (1, "running")
    wait_until(lambda: len(queue.sent) > sent)
    assert queue.sent[-1][:2] == (job, (1,))
    cancelled = client.post(f"/v1/jobs/{job}/cancel").json()
    assert (cancelled["state"], cancelled["cancel_requested"]) == ("cancelled", True)


def test_a_job_is_taken_while_the_broker_is_away_and_sent_when_it_is_back(client: TestClient, queue: RememberingQueue) -> None:
    queue.away = True
    job = submit(client)["id"]
    assert client.get("/readyz").status_code == 503
    assert "broker" in client.get("/readyz").json()["detail"]
    time.sleep(0.3)
    assert queue.sent == []
    queue.away = False
    wait_until(lambda: queue.sent)
    assert queue.sent == [(job, (0, 1), 3)]
    ready = client.get("/readyz").json()
    assert ready["status"] == "ok"
    assert ready["workers"] == 0


def events_of(client: TestClient, job: str, **headers: str) -> list[tuple[str, dict[str, Any]]]:
    """Return the events of a job that ends, as (name, document)."""
    found, name = [], ""
    with client.stream("GET", f"/v1/jobs/{job}/events", headers=headers) as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        for line in answer.iter_lines():
            if line.startswith("event:"):
                name = line.removeprefix("event:").strip()
            elif line.startswith("data:"):
                found.append((name, json.loads(line.removeprefix("data:"))))
    return found


def test_events_tell_the_state_and_end_with_the_job(client: TestClient, parts: Services) -> None:
    job = submit(client)["id"]
    finish(parts, job, 0, {})
    finish(parts, job, 1, {})
    found = events_of(client, job)
    assert found[0][0] == "job"
    assert found[-1][0] == "end"
    assert found[-1][1]["state"] == "done"
    resumed = events_of(client, job, **{"Last-Event-ID": "1.0"})
    assert sorted(document["number"] for name, document in resumed if name == "frame") == [0, 1]


def test_a_recipe_is_checked_without_being_stored(client: TestClient) -> None:
    good = client.post("/v1/recipes/validate", json={"recipe": tiny_recipe(7)}).json()
    assert (good["valid"], good["name"], good["frames"], good["errors"]) == (True, "two balls", 7, [])
    bad = client.post("/v1/recipes/validate", json={"recipe": {"schema": "fullwell/recipe/v1"}}).json()
    assert not bad["valid"]
    assert {"name", "scene", "cameras"} <= {error["path"] for error in bad["errors"]}
    assert client.get("/v1/jobs").json()["items"] == []


def test_a_job_with_too_many_frames_is_refused(tmp_path: Path, queue: RememberingQueue) -> None:
    app = create_app(Settings(home=tmp_path, max_frames_per_job=10), queue=queue)
    with TestClient(app, base_url="http://127.0.0.1") as client:
        answer = client.post("/v1/jobs", json={"recipe": tiny_recipe(11)})
    assert answer.status_code == 422
    assert "at most 10" in answer.json()["detail"]


@pytest.mark.parametrize(("kind", "name"), [("sensors", "imx363"), ("illuminants", "D65"), ("materials", "gold")])
def test_catalogues_list_the_names_that_recipes_may_use(client: TestClient, kind: str, name: str) -> None:
    items = client.get(f"/v1/catalog/{kind}").json()["items"]
    assert name.casefold() in [item.casefold() for item in items]
    assert client.get("/v1/catalog/colours").status_code == 422


def test_metrics_count_frames_by_state(client: TestClient, parts: Services) -> None:
    job = submit(client, 3)["id"]
    finish(parts, job, 0, {})
    text = client.get("/metrics").text
    assert 'fullwell_frames{state="queued"} 2.0' in text
    assert 'fullwell_frames{state="done"} 1.0' in text
    assert 'route="/v1/jobs"' in text
    assert job not in text


def test_the_page_runs_only_its_own_scripts(client: TestClient) -> None:
    page = client.get("/")
    assert page.status_code == 200
    assert "script-src 'self'" in page.headers["content-security-policy"]
    assert '<script src="/web/jobs.js"' in page.text
    script = client.get("/web/jobs.js")
    assert script.status_code == 200
    for dangerous in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("):
        assert dangerous not in script.text


def test_the_openapi_document_describes_errors_and_keys(app: FastAPI) -> None:
    document = app.openapi()
    submit_route = document["paths"]["/v1/jobs"]["post"]
    assert submit_route["responses"]["422"]["content"].keys() == {PROBLEM}
    assert "HTTPBearer" in document["components"]["securitySchemes"]
