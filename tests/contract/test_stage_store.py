"""What the stage cache promises on every object store: entries are whole or absent, one makes them, the size is bounded."""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from fullwell.core import CancelledError, FieldError
from fullwell.pipeline import StageStore
from fullwell.storage import ObjectStore, store_from_url
from servers import S3Server

LIMIT = 10_000_000
THREADS = 8


@pytest.fixture(params=["local", pytest.param("s3", marks=pytest.mark.service)])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> ObjectStore:
    if request.param == "local":
        return store_from_url(f"file://{tmp_path}/objects")
    server: S3Server = request.getfixturevalue("s3_server")
    return store_from_url(server.url())


@pytest.fixture
def stages(store: ObjectStore) -> StageStore:
    return StageStore(store, max_bytes=LIMIT)


def key_of(number: int) -> str:
    return hashlib.sha256(str(number).encode()).hexdigest()


def content_of(number: int, size: int = 1000) -> bytes:
    return hashlib.shake_128(str(number).encode()).digest(size)


def keys_in(store: ObjectStore) -> list[str]:
    return [info.key for info in store.list() if not info.key.endswith(".used")]


def test_what_was_kept_is_found_by_kind_and_key(stages: StageStore) -> None:
    assert stages.get("radiance", key_of(1)) is None
    assert stages.put("radiance", key_of(1), b"one", memoryview(b"two"))
    assert stages.get("radiance", key_of(1)) == b"onetwo"
    assert stages.has("radiance", key_of(1))
    assert stages.get("irradiance", key_of(1)) is None
    assert stages.get("radiance", key_of(2)) is None


def test_entries_lie_below_cache_by_kind_and_first_letters(store: ObjectStore, stages: StageStore) -> None:
    key = key_of(1)
    stages.put("radiance", key, b"x")
    assert keys_in(store) == [f"cache/radiance/{key[:2]}/{key}"]


@pytest.mark.parametrize(("kind", "key"), [("radiance", "../x"), ("radiance", "ab"), ("../jobs", key_of(1)), ("", key_of(1))])
def test_names_that_are_no_digests_are_refused(stages: StageStore, kind: str, key: str) -> None:
    with pytest.raises(FieldError, match="does not name"):
        stages.put(kind, key, b"x")


def _flipped(sealed: bytes) -> bytes:
    return sealed[:-5] + bytes([sealed[-5] ^ 1]) + sealed[-4:]


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "truncated": lambda sealed: sealed[:-1],
    "cut in the digest": lambda sealed: sealed[:20],
    "empty": lambda sealed: b"",
    "one bit flipped": _flipped,
    "longer": lambda sealed: sealed + b"x",
    "something else": lambda sealed: b"not an entry at all, and long enough to be one: " * 4,
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_damaged_entry_is_absent_and_deleted_so_that_it_can_be_kept_again(
    store: ObjectStore, stages: StageStore, damage: Callable[[bytes], bytes]
) -> None:
    stages.put("radiance", key_of(1), content_of(1))
    address = stages.address("radiance", key_of(1))
    store.put(address, damage(store.get(address)))
    assert stages.get("radiance", key_of(1)) is None
    assert not store.exists(address)
    assert stages.put("radiance", key_of(1), content_of(1))
    assert stages.get("radiance", key_of(1)) == content_of(1)


def test_entry_under_another_ones_address_is_damaged(store: ObjectStore, stages: StageStore) -> None:
    stages.put("radiance", key_of(1), content_of(1))
    store.put(stages.address("radiance", key_of(2)), store.get(stages.address("radiance", key_of(1))))
    assert stages.get("radiance", key_of(2)) is None


def test_first_of_several_writers_wins(store: ObjectStore) -> None:
    workers = [StageStore(store, max_bytes=LIMIT) for _ in range(THREADS)]
    barrier = threading.Barrier(THREADS)

    def write(number: int) -> bool:
        barrier.wait()
        return workers[number].put("radiance", key_of(1), content_of(number, 200_000))

    with ThreadPoolExecutor(THREADS) as pool:
        assert all(pool.map(write, range(THREADS)))
    kept = workers[0].get("radiance", key_of(1))
    assert kept in [content_of(number, 200_000) for number in range(THREADS)]
    workers[1].put("radiance", key_of(1), b"later")
    assert workers[2].get("radiance", key_of(1)) == kept


def test_of_many_workers_that_need_an_entry_at_once_one_makes_it(store: ObjectStore) -> None:
    made: list[int] = []
    barrier = threading.Barrier(THREADS)

    def obtain(number: int) -> bytes:
        stages = StageStore(store, max_bytes=LIMIT)
        barrier.wait()
        with stages.turn("radiance", key_of(1)):
            found = stages.get("radiance", key_of(1))
            if found is None:
                made.append(number)
                time.sleep(0.3)  # long enough for the others to come
                stages.put("radiance", key_of(1), content_of(1))
                return content_of(1)
            return bytes(found)

    with ThreadPoolExecutor(THREADS) as pool:
        assert set(pool.map(obtain, range(THREADS))) == {content_of(1)}
    assert len(made) == 1
    assert not [name for name in keys_in(store) if name.endswith(".lease")]


def test_lease_of_a_dead_worker_is_taken_over(store: ObjectStore) -> None:
    stages = StageStore(store, max_bytes=LIMIT, lease_s=0.3)
    lease = f"{stages.address('radiance', key_of(1))}.lease"
    store.put(lease, b"a worker that was killed")
    with stages.turn("radiance", key_of(1)) as turn:
        assert turn.ours
        assert turn.waited_s >= 0.3
        assert store.get(lease) != b"a worker that was killed"
    assert not store.exists(lease)


@pytest.mark.slow
def test_lease_of_a_living_worker_outlasts_its_term_and_is_waited_for_no_longer_than_the_bound(store: ObjectStore) -> None:
    holder = StageStore(store, max_bytes=LIMIT, lease_s=0.6)
    other = StageStore(store, max_bytes=LIMIT, lease_s=2.0, wait_s=4.5)
    with holder.turn("radiance", key_of(1)) as first, other.turn("radiance", key_of(1)) as second:
        assert first.ours
        assert not second.ours
        assert second.waited_s >= 4.5


def test_stage_that_fails_gives_the_lease_back(store: ObjectStore, stages: StageStore) -> None:
    with pytest.raises(ZeroDivisionError), stages.turn("radiance", key_of(1)):
        raise ZeroDivisionError
    assert keys_in(store) == []


def test_worker_that_lost_its_lease_leaves_the_new_holders_alone(store: ObjectStore) -> None:
    stages = StageStore(store, max_bytes=LIMIT, lease_s=0.3)
    lease = f"{stages.address('radiance', key_of(1))}.lease"
    with stages.turn("radiance", key_of(1)):
        store.put(lease, b"somebody else")
        time.sleep(0.3)  # several beats
    assert store.get(lease) == b"somebody else"


def test_waiting_can_be_cancelled(store: ObjectStore, stages: StageStore) -> None:
    def cancel() -> None:
        raise CancelledError("the frame was cancelled")

    with (
        stages.turn("radiance", key_of(1)),
        pytest.raises(CancelledError),
        StageStore(store, max_bytes=LIMIT).turn("radiance", key_of(1), tick=cancel),
    ):
        pass


def test_total_size_stays_within_the_limit_and_nothing_else_is_touched(store: ObjectStore) -> None:
    strangers = {"jobs/1/frames/0/manifest.json", "cas/" + key_of(0), "cache/README.txt", "cache/radiance/ab/not-a-digest"}
    for name in strangers:
        store.put(name, b"mine")
    stages = StageStore(store, max_bytes=100_000)
    for number in range(30):
        assert stages.put("radiance", key_of(number), content_of(number, 10_000))
    entries = [info for info in store.list("cache/") if info.key not in strangers]
    assert 50_000 <= sum(info.size for info in entries) <= 100_000
    assert {name for name in strangers if store.exists(name)} == strangers


def test_entry_above_the_limit_is_not_kept(store: ObjectStore) -> None:
    stages = StageStore(store, max_bytes=1000)
    stages.put("radiance", key_of(1), content_of(1, 100))
    assert not stages.put("radiance", key_of(2), content_of(2, 1000))
    assert stages.get("radiance", key_of(1)) is not None


@pytest.mark.slow
def test_readers_writers_and_sweepers_at_once_see_whole_entries_or_none(store: ObjectStore) -> None:
    """Each thread is a worker of its own; the limit holds a quarter of what they use, so entries vanish all the time."""

    def work(worker: int) -> tuple[int, int]:
        stages, hits, wrong = StageStore(store, max_bytes=50_000, touch_s=0.01), 0, 0
        for step in range(160):
            number = (step * 7 + worker * 3) % 20
            found = stages.get("radiance", key_of(number))
            if found is None:
                stages.put("radiance", key_of(number), content_of(number, 10_000))
                continue
            hits += 1
            wrong += found != content_of(number, 10_000)
        return hits, wrong

    with ThreadPoolExecutor(4) as pool:
        done = list(pool.map(work, range(4)))
    assert sum(wrong for _, wrong in done) == 0
    assert sum(hits for hits, _ in done) > 0
    StageStore(store, max_bytes=50_000).sweep()
    assert sum(info.size for info in store.list("cache/")) <= 50_000
