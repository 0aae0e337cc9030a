"""Work on assets: one worker at a time, what a killed one leaves, retries, and messages that get lost."""

from __future__ import annotations

import subprocess
import sys
import threading

import pytest

from fullwell.core import ConflictError, NotFoundError
from fullwell.jobs.database import Database
from fullwell.jobs.ingestions import (
    IngestionLease,
    IngestionRecord,
    IngestionRepository,
    IngestionState,
    NewIngestion,
    StoredAsset,
)
from fullwell.jobs.processes import ProcessIdentity, current_process, process_from_text
from fullwell.jobs.records import RetryRule
from fullwell.jobs.repository import JobRepository

RULE = RetryRule(max_attempts=2, delay_s=0.0)
ELSEWHERE = ProcessIdentity("another-host", "another-machine", 1, "1")


@pytest.fixture
def ingestions(database: Database) -> IngestionRepository:
    return IngestionRepository(database)


def new(ingestions: IngestionRepository, name: str = "car.glb", key: str | None = None, sha: str = "0" * 64) -> IngestionRecord:
    return ingestions.create(NewIngestion("upload", name, "ann", "{}", sha, idempotency_key=key))[0]


def take(
    ingestions: IngestionRepository, record: IngestionRecord, *, worker: str = "w", holder: ProcessIdentity = ELSEWHERE
) -> IngestionLease:
    lease = ingestions.acquire(record.id, worker=worker, holder=holder, lease_s=30, rule=RULE)
    assert lease is not None
    return lease


def dead_process() -> ProcessIdentity:
    program = "from fullwell.jobs.processes import current_process; print(current_process().to_text())"
    child = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    identity = process_from_text(child.stdout)
    assert identity is not None
    return identity


def test_new_work_is_queued_and_the_same_key_gives_it_again(ingestions: IngestionRepository) -> None:
    record = new(ingestions, key="k")
    assert (record.state, record.who, record.stored) == (IngestionState.QUEUED, "ann", None)
    assert new(ingestions, key="k").id == record.id
    with pytest.raises(ConflictError, match="another request"):
        new(ingestions, key="k", sha="1" * 64)
    with pytest.raises(NotFoundError, match="does not exist"):
        ingestions.get("nothing")


def test_many_workers_get_one_lease(ingestions: IngestionRepository) -> None:
    record = new(ingestions)
    taken: list[IngestionLease | None] = []

    def try_it(name: str) -> None:
        taken.append(ingestions.acquire(record.id, worker=name, holder=current_process(), lease_s=30, rule=RULE))

    threads = [threading.Thread(target=try_it, args=(f"w{number}",)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(taken) == 6
    assert sum(lease is not None for lease in taken) == 1


def test_progress_and_result_are_recorded(ingestions: IngestionRepository) -> None:
    record = new(ingestions)
    lease = take(ingestions, record)
    assert ingestions.heartbeat(lease, lease_s=30, stage="mend", fraction=0.25)
    running = ingestions.get(record.id)
    assert (running.state, running.stage, running.fraction) == (IngestionState.RUNNING, "mend", 0.25)
    ingestions.stored(lease, StoredAsset("car", 1, "[]"))
    assert ingestions.get(record.id).stored == StoredAsset("car", 1, "[]")
    assert ingestions.complete(lease)
    done = ingestions.get(record.id)
    assert (done.state, done.fraction, done.error) == (IngestionState.DONE, 1.0, None)
    assert not ingestions.complete(lease)
    with pytest.raises(ConflictError, match="only a failed one"):
        ingestions.retry(record.id)


def test_what_a_dead_worker_held_is_taken_back_at_once_and_the_second_loss_is_the_last(ingestions: IngestionRepository) -> None:
    record = new(ingestions)
    take(ingestions, record, holder=dead_process())
    assert [loss.id for loss in ingestions.reap(RULE)] == [record.id]
    assert ingestions.get(record.id).state == IngestionState.QUEUED
    take(ingestions, record, holder=dead_process())
    ingestions.reap(RULE)
    failed = ingestions.get(record.id)
    assert (failed.state, failed.error_code) == (IngestionState.FAILED, "worker_lost")
    assert "after 2 attempts" in (failed.error or "")
    assert ingestions.retry(record.id).state == IngestionState.QUEUED
    take(ingestions, record)


def test_the_rest_of_the_work_is_queued_behind_what_others_wait_for(ingestions: IngestionRepository) -> None:
    record, other = new(ingestions, "a.glb"), new(ingestions, "b.glb")
    lease = take(ingestions, record)
    ingestions.stored(lease, StoredAsset("a", 1))
    assert ingestions.hand_over(lease, stage="previews", fraction=0.3, priority=4)
    assert not ingestions.hand_over(lease, stage="previews", fraction=0.3, priority=4)
    waiting = ingestions.get(record.id)
    assert (waiting.state, waiting.stage, waiting.fraction, waiting.attempt) == (IngestionState.QUEUED, "previews", 0.3, 0)
    assert [claimed for claimed, _ in ingestions.claim_due(limit=10)] == [other.id, record.id]


def test_a_lease_is_taken_over_from_a_dead_worker_without_waiting(ingestions: IngestionRepository) -> None:
    record = new(ingestions)
    old = take(ingestions, record, holder=dead_process())
    take(ingestions, record, worker="w2")
    assert not ingestions.heartbeat(old, lease_s=30, stage="", fraction=0.0)
    assert ingestions.fail(old, cause="late", code="x", retryable=False, rule=RULE) is None


def test_a_silent_worker_loses_its_lease(ingestions: IngestionRepository) -> None:
    record = new(ingestions)
    lease = ingestions.acquire(record.id, worker="w", holder=ELSEWHERE, lease_s=-1.0, rule=RULE)
    assert lease is not None
    assert "no sign of life" in ingestions.reap(RULE)[0].cause


def test_an_asset_that_is_stored_is_no_failure_when_its_previews_kill_worker_after_worker(
    ingestions: IngestionRepository,
) -> None:
    record = new(ingestions)
    for _ in range(2):
        lease = take(ingestions, record, holder=dead_process())
        ingestions.stored(lease, StoredAsset("car", 1))
        ingestions.reap(RULE)
    done = ingestions.get(record.id)
    assert (done.state, done.error) == (IngestionState.DONE, None)
    assert "died" in done.preview_error
    assert ingestions.retry(record.id).preview_error == ""


def test_refused_files_fail_at_once_and_faults_of_the_machine_are_tried_again(ingestions: IngestionRepository) -> None:
    record = new(ingestions)
    assert ingestions.fail(take(ingestions, record), cause="x", code="c", retryable=True, rule=RULE) == IngestionState.QUEUED
    assert ingestions.fail(take(ingestions, record), cause="y", code="c", retryable=False, rule=RULE) == IngestionState.FAILED
    other = new(ingestions)
    assert ingestions.fail(take(ingestions, other), cause="z", code="c", retryable=False, rule=RULE) == IngestionState.FAILED


def test_a_worker_that_leaves_in_good_order_gives_back_without_a_strike(
    ingestions: IngestionRepository, database: Database
) -> None:
    record = new(ingestions)
    take(ingestions, record, worker="w1")
    assert [loss.id for loss in ingestions.release_worker("w1")] == [record.id]
    JobRepository(database).worker_leaves("w2")
    for _ in range(3):
        take(ingestions, record, worker="w2", holder=dead_process())
        ingestions.reap(RULE)
        assert ingestions.get(record.id).state == IngestionState.QUEUED


def test_a_loss_is_recorded_only_of_the_worker_that_runs_it(ingestions: IngestionRepository) -> None:
    record = new(ingestions)
    take(ingestions, record, worker="w1")
    assert ingestions.lose(record.id, worker="w2", cause="killed", rule=RULE) is None
    loss = ingestions.lose(record.id, worker="w1", cause="killed", rule=RULE)
    assert loss is not None
    assert ingestions.get(record.id).error == "killed"


def test_messages_are_claimed_once_and_come_again_when_they_are_lost(ingestions: IngestionRepository) -> None:
    first, second = new(ingestions, "a.glb"), new(ingestions, "b.glb")
    assert [claimed for claimed, _ in ingestions.claim_due(limit=10)] == sorted([first.id, second.id])
    assert ingestions.claim_due(limit=10) == []
    ingestions.unclaim(first.id)
    assert [claimed for claimed, _ in ingestions.claim_due(limit=10)] == [first.id]
    assert ingestions.forget_messages(older_than_s=60.0) == 0
    assert ingestions.forget_messages(older_than_s=-1.0) == 2
    assert ingestions.totals() == {IngestionState.QUEUED: 2}


def test_the_list_pages_from_new_to_old(ingestions: IngestionRepository) -> None:
    records = [new(ingestions, f"{number}.glb") for number in range(3)]
    newest_first = sorted((record.id for record in records), reverse=True)
    page = ingestions.recent(limit=2)
    assert [record.id for record in page] == newest_first[:2]
    assert [record.id for record in ingestions.recent(limit=2, before=page[-1].id)] == newest_first[2:]
    assert ingestions.recent(limit=5, state=IngestionState.DONE) == []
