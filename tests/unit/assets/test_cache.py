"""Blobs on a worker's disk: verified, fetched once, bounded, and not torn away from who reads them."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from fullwell.assets.cache import BlobCache, blob_key
from fullwell.core import AssetError, FieldError, NotFoundError, sha256_hex
from fullwell.storage import LocalStore

KILO = 1000


class CountingStore(LocalStore):
    """A local store that counts how often each key is fetched."""

    def __init__(self, root: Path) -> None:
        super().__init__(root)
        self.fetched: Counter[str] = Counter()

    def fetch_to(self, key: str, target: Path) -> None:
        self.fetched[key] += 1
        super().fetch_to(key, target)


@pytest.fixture
def store(tmp_path: Path) -> CountingStore:
    return CountingStore(tmp_path / "store")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "cache"


def put(store: LocalStore, content: bytes) -> str:
    digest = sha256_hex(content)
    store.put(blob_key(digest), content)
    return digest


def blobs_in(folder: Path) -> set[str]:
    return {path.name for path in folder.glob("[0-9a-f][0-9a-f]/*")}


def test_a_blob_is_fetched_once_and_has_the_suffix_that_was_asked_for(store: CountingStore, folder: Path) -> None:
    digest = put(store, b"model")
    for cache in (BlobCache(folder, KILO), BlobCache(folder, KILO)):
        path = cache.path_of(digest, ".glb", store)
        assert path.name == f"{digest}.glb"
        assert path.read_bytes() == b"model"
    assert store.fetched[blob_key(digest)] == 1


def test_nobody_can_write_to_a_cached_file_by_mistake(store: CountingStore, folder: Path) -> None:
    path = BlobCache(folder, KILO).path_of(put(store, b"model"), "", store)
    assert path.stat().st_mode & 0o222 == 0


def test_a_damaged_object_is_an_error_and_leaves_nothing(store: CountingStore, folder: Path) -> None:
    digest = sha256_hex(b"model")
    store.put(blob_key(digest), b"motel")
    cache = BlobCache(folder, KILO)
    with pytest.raises(AssetError, match="damaged"):
        cache.path_of(digest, ".glb", store)
    assert blobs_in(folder) == set()
    store.put(blob_key(digest), b"model")
    assert cache.path_of(digest, ".glb", store).read_bytes() == b"model"


def test_an_absent_object_is_named(store: CountingStore, folder: Path) -> None:
    digest = sha256_hex(b"nothing")
    with pytest.raises(NotFoundError, match=digest):
        BlobCache(folder, KILO).path_of(digest, "", store)
    assert blobs_in(folder) == set()


@pytest.mark.parametrize(("digest", "suffix"), [("../../etc/passwd", ""), ("ab" * 32, "/../x"), ("ab" * 32, ".fetching")])
def test_no_path_leaves_the_folder(store: CountingStore, folder: Path, digest: str, suffix: str) -> None:
    with pytest.raises(FieldError):
        BlobCache(folder, KILO).path_of(digest, suffix, store)


def test_the_least_recently_used_make_room(store: CountingStore, folder: Path) -> None:
    digests = [put(store, bytes([index]) * 300) for index in range(4)]
    cache = BlobCache(folder, KILO, hold_s=0.0)
    for age_s, digest in zip((30, 20, 10), digests, strict=False):
        path = cache.path_of(digest, "", store)
        then = time.time() - age_s
        os.utime(path, (then, then))
    cache.path_of(digests[0], "", store)
    cache.release()
    cache.path_of(digests[3], "", store)
    cache.release()
    cache.sweep()
    assert blobs_in(folder) == {digests[0], digests[2], digests[3]}


def test_the_folder_stays_within_its_limit(store: CountingStore, folder: Path) -> None:
    cache = BlobCache(folder, 10 * KILO, hold_s=0.0)
    for index in range(60):
        cache.path_of(put(store, index.to_bytes(2, "big") * 250), "", store)
        total = sum(path.stat().st_size for path in folder.glob("[0-9a-f][0-9a-f]/*"))
        assert total <= 10 * KILO + 500


def test_a_path_that_was_handed_out_stays_until_it_is_released(store: CountingStore, folder: Path) -> None:
    reader, other = BlobCache(folder, KILO), BlobCache(folder, KILO)
    path = reader.path_of(put(store, b"r" * 900), "", store)
    for index in range(5):
        other.path_of(put(store, bytes([index]) * 900), "", store)
        other.release()
    assert path.read_bytes() == b"r" * 900
    reader.release()
    other.path_of(put(store, b"x" * 900), "", store)
    assert not path.exists()


def test_an_open_file_can_be_read_to_its_end_after_eviction(store: CountingStore, folder: Path) -> None:
    cache = BlobCache(folder, KILO)
    path = cache.path_of(put(store, b"r" * 900), "", store)
    with path.open("rb") as stream:
        cache.release()
        cache.path_of(put(store, b"x" * 900), "", store)
        assert not path.exists()
        assert stream.read() == b"r" * 900


def test_a_blob_larger_than_the_limit_is_served_all_the_same(store: CountingStore, folder: Path) -> None:
    cache = BlobCache(folder, KILO)
    assert cache.path_of(put(store, b"L" * 5000), "", store).stat().st_size == 5000


def test_what_a_crash_has_left_goes_after_an_hour(store: CountingStore, folder: Path) -> None:
    cache = BlobCache(folder, KILO)
    path = cache.path_of(put(store, b"model"), "", store)
    old, new = path.with_name("f" * 64 + ".fetching"), path.with_name(".x.partial")
    for leftover in (old, new):
        leftover.write_bytes(b"half")
    os.utime(old, (0, 0))
    cache.sweep()
    assert not old.exists()
    assert new.exists()
    assert path.exists()


def test_threads_that_want_the_same_blob_fetch_it_once(store: CountingStore, folder: Path) -> None:
    digest = put(store, b"model" * 50)
    caches = [BlobCache(folder, KILO) for _ in range(4)]
    threads = [threading.Thread(target=cache.path_of, args=(digest, ".glb", store)) for cache in caches]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert store.fetched[blob_key(digest)] == 1


READER = """
import random, sys
from pathlib import Path
from fullwell.assets.cache import BlobCache
from fullwell.core import sha256_hex
from fullwell.storage import LocalStore
cache, store = BlobCache(Path(sys.argv[1]), 4000), LocalStore(Path(sys.argv[2]))
rng = random.Random(int(sys.argv[3]))
for _ in range(150):
    digest = rng.choice(sys.argv[4:])
    assert sha256_hex(cache.path_of(digest, ".glb", store).read_bytes()) == digest
    cache.release()
"""


def test_processes_that_evict_each_others_files_read_only_whole_ones(store: CountingStore, folder: Path) -> None:
    digests = [put(store, bytes([index]) * 1000) for index in range(12)]

    def readers() -> Iterator[subprocess.Popen[bytes]]:
        for seed in range(3):
            command = [sys.executable, "-c", READER, str(folder), str(store.root), str(seed), *digests]
            yield subprocess.Popen(command, stderr=subprocess.PIPE)

    for reader in list(readers()):
        _, errors = reader.communicate(timeout=60)
        assert reader.returncode == 0, errors.decode()
