"""What every object store promises, run on a local folder and on a real S3 server."""

from __future__ import annotations

import hashlib
import io
import socket
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from fullwell.core import ConflictError, FieldError, NotFoundError, StorageError
from fullwell.storage import LocalStore, ObjectStore, store_from_url
from fullwell.storage.s3 import S3Store
from servers import S3Server, free_port

THREADS = 16
LARGE_BYTES = 20 * (1 << 20) + 12345
UNREACHABLE_SECONDS = 15.0
"""Two attempts to connect with 3 s each, and slack for a busy machine."""

ODD_KEYS = (
    "plain.json",
    "with space/and+plus & more.txt",
    "percent%20/100%.txt",
    "question?/hash#/semi;colon=1,2.txt",
    "umlauts/äöü-ß/日本語/🚗.png",
    'quotes/it\'s "quoted".txt',
    "tilde~/star*/(brackets)[x]{y}.txt",
    ".hidden/.file",
    "trailing./dots..",
    "a" * 200 + "/" + "b" * 200,
)


@pytest.fixture(params=["local", pytest.param("s3", marks=pytest.mark.service)])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> ObjectStore:
    if request.param == "local":
        return store_from_url(f"file://{tmp_path}/objects")
    server: S3Server = request.getfixturevalue("s3_server")
    return store_from_url(server.url())


class _Unseekable(io.RawIOBase):
    def __init__(self, content: bytes) -> None:
        self._content = io.BytesIO(content)

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return False

    def read(self, size: int = -1, /) -> bytes:
        return self._content.read(min(size, 70_000) if size >= 0 else -1)


def _pseudo_random(size: int) -> bytes:
    return hashlib.shake_128(b"fullwell").digest(size)


def test_a_store_follows_the_protocol(store: ObjectStore) -> None:
    assert isinstance(store, ObjectStore)


def test_what_was_put_is_got(store: ObjectStore) -> None:
    written = store.put("jobs/1/frames/0/manifest.json", b'{"a": 1}')
    assert store.get("jobs/1/frames/0/manifest.json") == b'{"a": 1}'
    assert b"".join(store.stream("jobs/1/frames/0/manifest.json")) == b'{"a": 1}'
    found = store.stat("jobs/1/frames/0/manifest.json")
    assert (found.key, found.size, found.content_type) == ("jobs/1/frames/0/manifest.json", 8, "application/json")
    assert found.etag == written.etag
    assert found.modified.tzinfo is not None
    assert store.exists("jobs/1/frames/0/manifest.json")


def test_an_empty_object_is_an_object(store: ObjectStore) -> None:
    store.put("empty", b"")
    assert store.get("empty") == b""
    assert store.stat("empty").size == 0
    assert [found.key for found in store.list()] == ["empty"]


def test_an_empty_stream_is_an_object(store: ObjectStore) -> None:
    assert store.put("empty", io.BytesIO(b"")).size == 0
    assert store.get("empty") == b""


def test_putting_again_replaces_and_changes_the_etag(store: ObjectStore) -> None:
    first = store.put("k", b"one")
    second = store.put("k", b"two!")
    assert store.get("k") == b"two!"
    assert first.etag != second.etag == store.stat("k").etag


@pytest.mark.parametrize(
    "ask",
    [
        lambda store: store.get("missing"),
        lambda store: store.stream("missing"),
        lambda store: store.stat("missing"),
        lambda store: store.get("missing/deeper"),
    ],
    ids=["get", "stream", "stat", "deeper"],
)
def test_a_missing_object_is_not_found_at_once(store: ObjectStore, ask: Callable[[ObjectStore], object]) -> None:
    with pytest.raises(NotFoundError, match="missing"):
        ask(store)  # in a store that was never written, and below in one that was
    store.put("other", b"x")
    with pytest.raises(NotFoundError, match="missing"):
        ask(store)
    assert not store.exists("missing")


def test_fetching_a_missing_object_leaves_no_file(store: ObjectStore, tmp_path: Path) -> None:
    target = tmp_path / "down" / "file"
    with pytest.raises(NotFoundError):
        store.fetch_to("missing", target)
    assert not target.exists()
    assert not target.parent.exists() or not list(target.parent.iterdir())


@pytest.mark.parametrize("key", ODD_KEYS)
def test_odd_keys_are_kept(store: ObjectStore, key: str) -> None:
    store.put(key, key.encode())
    assert store.get(key) == key.encode()
    assert [found.key for found in store.list()] == [key]
    assert [found.key for found in store.list(key[:-1])] == [key]
    assert store.stat(key).key == key
    store.delete(key)
    assert not store.exists(key)


@pytest.mark.parametrize(
    "key",
    ["", "/absolute", "a//b", "a/", "../up", "a/../b", "./a", "a/.", "back\\slash", "nul\0", "new\nline", "x" * 201, "\ud800",
     "a/" * 600 + "a", "unfinished.partial", "x.partial/y"],
)  # fmt: skip
def test_illegal_keys_are_refused_by_every_method(store: ObjectStore, key: str, tmp_path: Path) -> None:
    for ask in (
        lambda: store.put(key, b""),
        lambda: store.get(key),
        lambda: store.stream(key),
        lambda: store.stat(key),
        lambda: store.exists(key),
        lambda: store.delete(key),
        lambda: store.presigned_url(key),
        lambda: store.fetch_to(key, tmp_path / "target"),
    ):
        with pytest.raises(FieldError):
            ask()


def test_listing_is_in_byte_order_and_by_prefix(store: ObjectStore) -> None:
    keys = ["a-b", "a/b", "a/b.x", "a/c/d", "a0", "ab/c", "b", "z/é", "z/z"]
    for key in reversed(keys):
        store.put(key, b".")
    assert [found.key for found in store.list()] == sorted(keys, key=str.encode)
    assert [found.key for found in store.list("a/")] == ["a/b", "a/b.x", "a/c/d"]
    assert [found.key for found in store.list("a/b")] == ["a/b", "a/b.x"]
    assert [found.key for found in store.list("a")] == ["a-b", "a/b", "a/b.x", "a/c/d", "a0", "ab/c"]
    assert [found.key for found in store.list("nothing/")] == []


def test_listing_a_store_that_was_never_written_is_empty(store: ObjectStore) -> None:
    assert list(store.list()) == []
    assert list(store.list("a/")) == []


def test_listing_more_than_one_page_is_complete(store: ObjectStore) -> None:
    keys = [f"many/{number:05d}" for number in range(1050)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda key: store.put(key, b""), keys))
    assert [found.key for found in store.list("many/")] == keys
    assert store.delete_prefix("many/") == len(keys)
    assert list(store.list()) == []


def test_deleting_twice_is_no_error(store: ObjectStore) -> None:
    store.put("d/e/f", b"x")
    store.delete("d/e/f")
    store.delete("d/e/f")
    store.delete("never/there")
    assert list(store.list()) == []


def test_deleting_by_prefix_spares_the_rest(store: ObjectStore) -> None:
    for key in ("jobs/1/a", "jobs/1/b/c", "jobs/10/a", "jobs/2/a"):
        store.put(key, b"x")
    assert store.delete_prefix("jobs/1/") == 2
    assert [found.key for found in store.list()] == ["jobs/10/a", "jobs/2/a"]
    with pytest.raises(FieldError, match="every object"):
        store.delete_prefix("")


def test_a_key_cannot_be_the_folder_of_another(store: ObjectStore) -> None:
    store.put("a", b"file")
    with pytest.raises(ConflictError, match="folder"):
        store.put("a/b", b"below a file")
    store.put("c/d", b"x")
    with pytest.raises(ConflictError, match="folder"):
        store.put("c", b"over a folder")
    assert store.get("a") == b"file"
    assert store.get("c/d") == b"x"


def test_if_absent_refuses_an_existing_key(store: ObjectStore) -> None:
    store.put("k", b"first", if_absent=True)
    with pytest.raises(ConflictError, match="'k' exists already"):
        store.put("k", b"second", if_absent=True)
    with pytest.raises(ConflictError):
        store.put("k", io.BytesIO(b"third"), if_absent=True)
    assert store.get("k") == b"first"
    store.delete("k")
    store.put("k", b"fourth", if_absent=True)
    assert store.get("k") == b"fourth"


@pytest.mark.parametrize("same", [False, True], ids=["different contents", "the same content"])
def test_of_many_writers_exactly_one_wins(store: ObjectStore, same: bool) -> None:
    store.put("warm-up", b"")
    for round_number in range(5):
        key = f"manifest-{round_number}.json"
        together = threading.Barrier(THREADS)

        def publish(number: int, key: str = key, together: threading.Barrier = together) -> int | None:
            together.wait()
            try:
                store.put(key, b"same" if same else f"writer {number}".encode(), if_absent=True)
            except ConflictError:
                return None
            return number

        with ThreadPoolExecutor(THREADS) as pool:
            winners = [number for number in pool.map(publish, range(THREADS)) if number is not None]
        assert len(winners) == 1
        assert store.get(key) == (b"same" if same else f"writer {winners[0]}".encode())


def test_readers_see_the_old_content_or_the_new_never_a_mixture(store: ObjectStore) -> None:
    old, new = b"o" * 300_000, b"n" * 300_000
    store.put("k", old)
    done = threading.Event()
    seen: set[bytes] = set()

    def read() -> None:
        while not done.is_set():
            seen.add(store.get("k"))

    with ThreadPoolExecutor(4) as pool:
        readers = [pool.submit(read) for _ in range(3)]
        try:
            for number in range(20):
                store.put("k", new if number % 2 == 0 else old)
        finally:
            done.set()
        for reader in readers:
            reader.result()
    assert seen <= {old, new}


@pytest.mark.parametrize("seekable", [True, False])
def test_a_large_stream_arrives_whole(store: ObjectStore, seekable: bool, tmp_path: Path) -> None:
    content = _pseudo_random(LARGE_BYTES)
    source = io.BytesIO(content) if seekable else _Unseekable(content)
    written = store.put("large.bin", source)  # type: ignore[arg-type]
    assert written.size == LARGE_BYTES
    assert store.stat("large.bin").size == LARGE_BYTES
    assert store.stat("large.bin").etag == written.etag
    store.fetch_to("large.bin", tmp_path / "down" / "large.bin")
    assert (tmp_path / "down" / "large.bin").read_bytes() == content
    assert max(len(piece) for piece in store.stream("large.bin")) <= 1 << 20


def test_a_large_stream_with_if_absent_does_not_replace(store: ObjectStore) -> None:
    content = _pseudo_random(LARGE_BYTES)
    store.put("large.bin", io.BytesIO(content), if_absent=True)
    with pytest.raises(ConflictError):
        store.put("large.bin", io.BytesIO(bytes(LARGE_BYTES)), if_absent=True)
    assert store.get("large.bin") == content


def test_a_file_is_put_and_fetched(store: ObjectStore, tmp_path: Path) -> None:
    source = tmp_path / "source.exr"
    source.write_bytes(b"image")
    store.put_file("frames/0/radiance.exr", source)
    assert store.stat("frames/0/radiance.exr").content_type == "image/x-exr"
    store.fetch_to("frames/0/radiance.exr", tmp_path / "target.exr")
    assert (tmp_path / "target.exr").read_bytes() == b"image"
    with pytest.raises(StorageError, match=r"nowhere\.exr"):
        store.put_file("k", tmp_path / "nowhere.exr")


class _Failing(io.RawIOBase):
    def __init__(self, after: int) -> None:
        self._left = after

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1, /) -> bytes:
        if self._left <= 0:
            raise RuntimeError("the source broke")
        piece = bytes(min(self._left, size if size >= 0 else self._left))
        self._left -= len(piece)
        return piece


@pytest.mark.parametrize("after", [1000, 18 << 20])
def test_a_source_that_breaks_leaves_nothing(store: ObjectStore, after: int) -> None:
    with pytest.raises(RuntimeError, match="the source broke"):
        store.put("broken.bin", _Failing(after))  # type: ignore[arg-type]
    assert not store.exists("broken.bin")
    assert list(store.list()) == []


def test_the_health_check_passes_and_leaves_nothing(store: ObjectStore) -> None:
    store.check()
    assert list(store.list()) == []


def test_a_local_store_has_no_address_for_its_objects(tmp_path: Path) -> None:
    assert LocalStore(tmp_path).presigned_url("k") is None


@pytest.mark.service
class TestOnS3:
    """What only a server can show."""

    def test_a_presigned_url_reads_without_keys(self, s3_server: S3Server) -> None:
        store = store_from_url(s3_server.url())
        store.put("a b/ü.json", b"{}")
        address = store.presigned_url("a b/ü.json", 60)
        assert address is not None
        assert s3_server.secret_key not in address
        with urllib.request.urlopen(address, timeout=10) as answer:
            assert answer.read() == b"{}"
            assert answer.headers["Content-Type"] == "application/json"
        tampered = address.replace("X-Amz-Expires=60", "X-Amz-Expires=600")
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(tampered, timeout=10)

    def test_presigned_urls_name_the_public_endpoint(self, s3_server: S3Server) -> None:
        store = store_from_url(s3_server.url("b00") + "&public=data.example.org&public_secure=1")
        assert str(store.presigned_url("k")).startswith("https://data.example.org/b00/k?")

    def test_a_presigned_url_lives_at_most_seven_days(self, s3_server: S3Server) -> None:
        store = store_from_url(s3_server.url())
        for seconds in (0, -1, 7 * 24 * 3600 + 1):
            with pytest.raises(FieldError, match="7 days"):
                store.presigned_url("k", seconds)

    def test_an_explicit_content_type_is_kept(self, s3_server: S3Server) -> None:
        store = store_from_url(s3_server.url())
        store.put("k", b"x", "text/x-own")
        assert store.stat("k").content_type == "text/x-own"

    def test_wrong_keys_are_refused_without_telling_the_secret(self, s3_server: S3Server) -> None:
        store = S3Store(s3_server.endpoint, s3_server.access_key, "wrong-secret-value", "bucket", secure=False)
        for ask in (store.check, lambda: store.put("k", b"x"), lambda: store.get("k"), lambda: list(store.list())):
            with pytest.raises(StorageError, match="Check the keys") as caught:
                ask()
            assert "wrong-secret-value" not in f"{caught.value}{caught.value!r}{caught.value.__context__!r}"
        assert "wrong-secret-value" not in repr(store) + repr(vars(store))

    def test_a_repeated_request_recognises_its_own_first_attempt(
        self, s3_server: S3Server, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        store = store_from_url(s3_server.url())
        assert isinstance(store, S3Store)
        store.check()
        pool = store._creator._http
        send = pool.urlopen

        def twice(*args: object, **options: object) -> object:
            send(*args, **options)  # arrives, but the answer is lost
            return send(*args, **options)

        monkeypatch.setattr(pool, "urlopen", twice)
        store.put("k", b"mine", if_absent=True)
        assert store.get("k") == b"mine"


@pytest.fixture
def silent_address() -> Iterator[str]:
    """host:port whose queue of connections is full: further ones are never answered."""
    with socket.socket() as full:
        full.bind(("127.0.0.1", 0))
        full.listen(0)
        fillers = [socket.socket() for _ in range(4)]
        for filler in fillers:
            filler.setblocking(False)
            filler.connect_ex(full.getsockname())
        yield f"127.0.0.1:{full.getsockname()[1]}"
        for filler in fillers:
            filler.close()


def _fails_as_unreachable(address: str, ask: Callable[[ObjectStore], object]) -> None:
    store = store_from_url(f"s3://key:very-secret@{address}/bucket?secure=0")
    begin = time.monotonic()
    with pytest.raises(StorageError, match=rf"http://{address} cannot be reached.*FULLWELL_STORE_URL") as caught:
        ask(store)
    assert time.monotonic() - begin < UNREACHABLE_SECONDS
    assert "very-secret" not in f"{caught.value!r}{caught.value.__context__!r}"


@pytest.mark.parametrize(
    "ask",
    [
        lambda store: store.check(),
        lambda store: store.put("k", b"x"),
        lambda store: store.put("k", b"x", if_absent=True),
        lambda store: store.get("k"),
        lambda store: store.exists("k"),
        lambda store: list(store.list()),
        lambda store: store.delete("k"),
    ],
    ids=["check", "put", "put if absent", "get", "exists", "list", "delete"],
)
def test_a_server_that_is_not_there_is_an_error_within_seconds(ask: Callable[[ObjectStore], object]) -> None:
    _fails_as_unreachable(f"127.0.0.1:{free_port()}", ask)


@pytest.mark.slow
def test_a_server_that_never_answers_is_an_error_within_seconds(silent_address: str) -> None:
    _fails_as_unreachable(silent_address, lambda store: store.get("k"))
