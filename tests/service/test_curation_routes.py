"""What the curation page's routes give to whom, and what no other site's page gets; the page itself is tested in a browser."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from PIL import Image
from standins import RememberingQueue
from starlette.websockets import WebSocketDisconnect

from assets_in_memory import small_car
from fullwell.assets.store import put_preview
from fullwell.core.settings import Settings
from fullwell_api.app import create_app
from fullwell_api.services import Services

SOCKET = "ws://127.0.0.1/assets/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
HERE = "http://127.0.0.1"
UPGRADE = {"upgrade": "websocket"}


@pytest.fixture
def locked(tmp_path: Path) -> Iterator[TestClient]:
    """A service with a key to look and a key to change."""
    settings = Settings(home=tmp_path / "locked", api_keys="just-looking", curator_keys="maria:let-me-change")
    with TestClient(create_app(settings, queue=RememberingQueue()), base_url=HERE, raise_server_exceptions=False) as client:
        yield client


def sign_in(client: TestClient, key: str) -> dict[str, object]:
    answer = client.post("/assets/session", json={"key": key})
    assert answer.status_code == 200, answer.text
    document: dict[str, object] = answer.json()
    return document


def png() -> bytes:
    target = io.BytesIO()
    Image.new("RGB", (4, 3), "red").save(target, "PNG")
    return target.getvalue()


def test_the_page_is_there_beside_the_jobs_page_and_the_api(client: TestClient) -> None:
    page = client.get("/assets")
    assert page.status_code == 200
    assert page.url.path == "/assets/"
    assert "Assets · Fullwell" in page.text
    assert "Fullwell jobs" in client.get("/").text
    assert client.get("/v1/assets").status_code == 200


def test_a_link_keeps_its_filters_when_its_slash_is_missing(client: TestClient) -> None:
    assert client.get("/assets?state=pending&tag=red").url.query == b"state=pending&tag=red"


def test_nothing_of_the_page_comes_from_another_host(client: TestClient) -> None:
    page = client.get("/assets/")
    assert re.findall(r"(?:src|href)=[\"']?(?:https?:)?//[^\"'\s>]+", page.text) == []
    policy = page.headers["content-security-policy"]
    assert "default-src 'self'" in policy
    assert "http" not in policy
    loaded = set(re.findall(r"[\"'(](/assets/[^\"')\s]+?\.(?:js|css|mjs)[^\"')\s]*)", page.text))
    assert len(loaded) > 5
    for address in sorted(loaded):
        answer = client.get(address)
        assert answer.status_code == 200, address
        assert "immutable" in answer.headers["cache-control"], address


def test_pages_of_other_sites_cannot_open_its_socket(client: TestClient) -> None:
    for headers in (
        {"origin": "http://evil.example"},
        {"origin": HERE, "host": "evil.example"},
        {"sec-fetch-site": "cross-site"},
    ):
        with pytest.raises(WebSocketDisconnect), client.websocket_connect(SOCKET, headers=UPGRADE | headers):
            pass
    with client.websocket_connect(SOCKET, headers=UPGRADE | {"origin": HERE}) as socket:
        assert socket.receive_text().startswith("0{")


def test_pages_of_other_sites_cannot_sign_in_or_send_files(client: TestClient) -> None:
    headers = {"origin": "http://evil.example"}
    assert client.post("/assets/session", json={"key": "x"}, headers=headers).status_code == 403
    assert client.post("/assets/files", content=b"x", headers=headers).status_code == 403


def test_a_file_is_stored_by_its_digest_and_never_larger_than_allowed(client: TestClient, parts: Services) -> None:
    content = b"model" * 50_000
    assert len(content) > parts.settings.max_request_bytes
    answer = client.post("/assets/files", content=content)
    assert answer.status_code == 201
    assert answer.json() == {"sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)}
    assert parts.store.get(f"cas/{answer.json()['sha256']}") == content


def test_a_file_that_is_too_large_is_refused_before_it_is_read(tmp_path: Path) -> None:
    settings = Settings(home=tmp_path, max_upload_bytes=2048)
    with TestClient(create_app(settings, queue=RememberingQueue()), base_url=HERE) as client:
        answer = client.post("/assets/files", content=b"x" * 2049)
        assert (answer.status_code, "2048 bytes" in answer.json()["detail"]) == (413, True)


def test_a_preview_that_is_not_there_yet_is_no_error(client: TestClient, parts: Services) -> None:
    look = small_car("red-car").manifest.look_digest
    address = f"/assets/pictures/{look}/thumb.png"
    missing = client.get(address)
    assert (missing.status_code, missing.headers["cache-control"]) == (204, "no-store")
    put_preview(parts.store, look, "thumb", png())
    found = client.get(address)
    assert (found.status_code, found.headers["content-type"], found.content) == (200, "image/png", png())
    again = client.get(address, headers={"if-none-match": found.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


@pytest.mark.parametrize("address", ["pictures/abc/thumb.png", f"pictures/{'0' * 64}/..%2Fx.png", "models/nothing/1/0.glb"])
def test_names_that_cannot_be_are_not_found(client: TestClient, address: str) -> None:
    assert client.get(f"/assets/{address}").status_code == 404


def test_a_model_comes_as_glb_and_as_a_download_with_a_name(client: TestClient, parts: Services) -> None:
    prepared = small_car("red-car")
    parts.library.add(prepared, who="maria")
    (content,) = prepared.blobs.values()
    shown = client.get("/assets/models/red-car/1/0.glb")
    assert (shown.headers["content-type"], shown.content) == ("model/gltf-binary", content)
    assert "sandbox" in shown.headers["content-security-policy"]
    assert "content-disposition" not in shown.headers
    saved = client.get("/assets/models/red-car/1/0.glb?download=1")
    assert saved.headers["content-disposition"] == 'attachment; filename="red-car_v1_level0.glb"'
    assert client.get("/assets/models/red-car/1/1.glb").status_code == 404
    assert client.get("/assets/models/red-car/2/0.glb").status_code == 404


def test_who_has_no_key_sees_neither_assets_nor_pictures(locked: TestClient) -> None:
    page = locked.get("/assets/")
    assert page.status_code == 200
    assert "This library needs a key" in page.text
    assert "fw-grid" not in page.text
    for address in (f"pictures/{'0' * 64}/thumb.png", "models/red-car/1/0.glb"):
        assert locked.get(f"/assets/{address}").status_code == 401
    assert locked.post("/assets/files", content=b"x").status_code == 401


def test_a_wrong_key_opens_no_session(locked: TestClient) -> None:
    answer = locked.post("/assets/session", json={"key": "wrong-key"})
    assert (answer.status_code, answer.json()["detail"]) == (401, "this key is not valid")
    assert "set-cookie" not in answer.headers


def test_a_users_key_may_look_but_send_nothing(locked: TestClient) -> None:
    assert sign_in(locked, "just-looking") == {"name": "api", "may_curate": False}
    assert locked.get(f"/assets/pictures/{'0' * 64}/thumb.png").status_code == 204
    refused = locked.post("/assets/files", content=b"x")
    assert (refused.status_code, "FULLWELL_CURATOR_KEYS" in refused.json()["detail"]) == (403, True)


def test_a_curators_key_may_send_files_until_the_session_is_closed(locked: TestClient) -> None:
    assert sign_in(locked, " let-me-change ") == {"name": "maria", "may_curate": True}
    assert "let-me-change" not in locked.get("/assets/").text
    assert locked.post("/assets/files", content=b"x").status_code == 201
    token = locked.cookies["fullwell-session"]
    assert locked.delete("/assets/session").status_code == 204
    locked.cookies.set("fullwell-session", token, path="/assets")
    assert locked.post("/assets/files", content=b"x").status_code == 401


def test_the_sessions_cookie_is_for_the_page_alone_and_for_no_script(locked: TestClient) -> None:
    cookie = locked.post("/assets/session", json={"key": "let-me-change"}).headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=lax" in cookie
    assert "path=/assets" in cookie
    assert "let-me-change" not in cookie
    sign_in(locked, "let-me-change")
    assert locked.get("/v1/assets").status_code == 401


def test_the_service_leaves_no_files_of_the_page_where_it_was_started(client: TestClient, tmp_path: Path) -> None:
    client.get("/assets/")
    assert not (Path.cwd() / ".nicegui").exists()
