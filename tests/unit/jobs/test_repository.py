"""Leases, strikes, cancelling, retrying, the outbox, idempotency, and two workers at once."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from dataclasses import replace

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import update

from fullwell.core import ConflictError, NotFoundError
from fullwell.jobs.database import Database
from fullwell.jobs.models import Base, FrameRow
from fullwell.jobs.processes import ProcessIdentity, current_process
from fullwell.jobs.records import JobInput, JobRecord, Lease, NewJob, RetryRule
from fullwell.jobs.repository import JobRepository
from fullwell.jobs.states import FrameState, JobState

RULE = RetryRule(max_attempts=3, delay_s=0.0)
ELSEWHERE = ProcessIdentity("another-host", "another-machine", 1, "1")


def new_job(repository: JobRepository, frames: int = 3, **changes: object) -> JobRecord:
    new = NewJob("box", frames, JobInput('{"name":"box"}'), request_sha256="0" * 64)
    return repository.create_job(replace(new, **changes))[0]  # type: ignore[arg-type]


def take(repository: JobRepository, job: JobRecord, number: int = 0, *, worker: str = "w1", lease_s: float = 30.0) -> Lease:
    lease = repository.acquire(job.id, number, worker=worker, holder=ELSEWHERE, lease_s=lease_s, rule=RULE)
    assert lease is not None
    return lease


def test_a_new_job_is_queued_with_all_its_frames(repository: JobRepository) -> None:
    job = new_job(repository, 3)
    assert job.state == JobState.QUEUED
    assert job.counts == {FrameState.QUEUED: 3}
    assert [frame.number for frame in repository.frames(job.id, limit=10)] == [0, 1, 2]
    assert [frame.number for frame in repository.frames(job.id, limit=1, after=1)] == [2]


def test_the_migration_makes_exactly_the_tables_of_the_models(database: Database) -> None:
    with database.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    assert database.is_current()
    database.upgrade()


def test_a_job_is_done_when_its_last_frame_is(repository: JobRepository) -> None:
    job = new_job(repository, 2)
    for number in (0, 1):
        assert repository.complete(take(repository, job, number))
    after = repository.job(job.id)
    assert after.state == JobState.DONE
    assert after.counts == {FrameState.DONE: 2}
    assert after.finished_at is not None


def test_a_frame_is_leased_once(repository: JobRepository) -> None:
    job = new_job(repository)
    take(repository, job)
    assert repository.acquire(job.id, 0, worker="w2", holder=ELSEWHERE, lease_s=30, rule=RULE) is None
    assert repository.acquire(job.id, 99, worker="w2", holder=ELSEWHERE, lease_s=30, rule=RULE) is None


def test_many_threads_lease_a_frame_once(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    leases: list[Lease | None] = []

    def try_it(name: str) -> None:
        leases.append(repository.acquire(job.id, 0, worker=name, holder=ELSEWHERE, lease_s=30, rule=RULE))

    threads = [threading.Thread(target=try_it, args=(f"w{n}",)) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len([lease for lease in leases if lease is not None]) == 1
    assert len(leases) == 8


FINISH_EVERY_OTHER = """
import sys
from fullwell.jobs.database import Database
from fullwell.jobs.processes import current_process
from fullwell.jobs.records import RetryRule
from fullwell.jobs.repository import JobRepository

url, job_id, start = sys.argv[1], sys.argv[2], int(sys.argv[3])
repository = JobRepository(Database(url))
for number in range(start, 40, 2):
    lease = repository.acquire(job_id, number, worker=str(start), holder=current_process(), lease_s=30, rule=RetryRule())
    assert repository.complete(lease)
"""


def test_two_processes_finish_a_job_together(repository: JobRepository, database: Database) -> None:
    job = new_job(repository, 40)
    url = database.engine.url.render_as_string(hide_password=False)
    commands = [[sys.executable, "-c", FINISH_EVERY_OTHER, url, job.id, str(start)] for start in (0, 1)]
    processes = [subprocess.Popen(command) for command in commands]
    assert [process.wait(60) for process in processes] == [0, 0]
    assert repository.job(job.id).state == JobState.DONE


def test_an_expired_lease_is_taken_over_and_the_late_worker_does_no_harm(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    late = take(repository, job, lease_s=-1.0)
    assert not [loss for loss in repository.reap(RULE) if loss.number != 0]
    second = take(repository, job, worker="w2")
    assert second.attempt == 2
    assert not repository.heartbeat(late, lease_s=30, stage="", fraction=0).still_held
    assert repository.fail(late, cause="too late", code="x", retryable=True, rule=RULE) is None
    assert repository.frame(job.id, 0).state == FrameState.RUNNING
    # The late one had committed its manifest: then the frame is done, and the second finds it so.
    assert repository.complete(late)
    assert not repository.complete(second)
    assert repository.job(job.id).state == JobState.DONE
    assert [(a.attempt, a.outcome) for a in repository.attempts(job.id, 0)] == [(1, "failed"), (2, "done")]


def test_an_expired_lease_is_taken_over_at_acquiring_too(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    take(repository, job, lease_s=-1.0)
    assert take(repository, job, worker="w2").attempt == 2
    assert "gave no sign of life" in (repository.attempts(job.id, 0)[0].cause or "")


def test_a_heartbeat_keeps_the_lease(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    lease = take(repository, job, lease_s=0.05)
    assert repository.heartbeat(lease, lease_s=30, stage="render", fraction=0.5).still_held
    time.sleep(0.1)
    assert repository.reap(RULE) == []
    frame = repository.frame(job.id, 0)
    assert (frame.stage, frame.fraction) == ("render", 0.5)


def test_the_frame_of_a_dead_process_is_taken_back_before_its_lease_ends(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        here = current_process()
        started = open(f"/proc/{child.pid}/stat").read().rpartition(")")[2].split()[19]  # noqa: SIM115, PTH123
        holder = replace(here, pid=child.pid, started=started)
        assert repository.acquire(job.id, 0, worker="w", holder=holder, lease_s=3600, rule=RULE) is not None
        assert repository.reap(RULE) == []
        child.kill()
    losses = repository.reap(RULE)
    assert [loss.number for loss in losses] == [0]
    assert f"process {child.pid}" in losses[0].cause
    assert repository.frame(job.id, 0).state == FrameState.QUEUED


def test_a_better_cause_of_a_loss_replaces_the_first(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    take(repository, job, lease_s=-1.0)
    repository.reap(RULE)
    assert repository.lose(job.id, [0], worker="w1", cause="killed by signal 9", rule=RULE) == []
    assert repository.frame(job.id, 0).error == "killed by signal 9"
    assert [a.cause for a in repository.attempts(job.id, 0)] == ["killed by signal 9"]
    assert repository.lose(job.id, [0], worker="another", cause="?", rule=RULE) == []
    assert repository.frame(job.id, 0).error == "killed by signal 9"


def test_a_frame_that_loses_its_worker_three_times_is_failed_with_the_cause(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    for attempt in (1, 2, 3):
        assert take(repository, job).attempt == attempt
        repository.lose(job.id, [0], worker="w1", cause="signal 9 (SIGKILL)", rule=RULE)
    frame = repository.frame(job.id, 0)
    assert frame.state == FrameState.FAILED
    assert frame.error == "signal 9 (SIGKILL) (after 3 attempts)"
    assert repository.job(job.id).state == JobState.FAILED
    assert [a.outcome for a in repository.attempts(job.id, 0)] == ["lost", "lost", "lost"]


def test_an_error_in_the_recipe_is_not_tried_again(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    state = repository.fail(take(repository, job), cause="bad mesh", code="bad_asset", retryable=False, rule=RULE)
    assert state == FrameState.FAILED


def test_a_failed_attempt_waits_before_the_next(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    patient = RetryRule(max_attempts=3, delay_s=60.0)
    assert repository.claim_due(limit=10)
    repository.fail(take(repository, job), cause="store away", code="storage_failed", retryable=True, rule=patient)
    assert repository.frame(job.id, 0).state == FrameState.QUEUED
    assert repository.claim_due(limit=10) == []


def test_a_frame_given_back_at_shutdown_gets_no_strike(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    for _ in range(5):
        take(repository, job)
        assert len(repository.release_worker("w1", cause="worker shut down")) == 1
    assert repository.frame(job.id, 0).state == FrameState.QUEUED
    assert repository.frame(job.id, 0).attempt == 5


def test_what_a_leaving_worker_loses_is_no_strike(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    repository.worker_leaves("w1")
    for _ in range(4):
        take(repository, job, lease_s=-1.0)
        repository.reap(RULE)
    assert [a.outcome for a in repository.attempts(job.id, 0)] == ["released"] * 4
    assert repository.frame(job.id, 0).state == FrameState.QUEUED


def test_cancelling_stops_what_waits_and_asks_what_runs(repository: JobRepository) -> None:
    job = new_job(repository, 3)
    lease = take(repository, job)
    after = repository.cancel(job.id)
    assert after.state == JobState.RUNNING
    assert after.cancel_requested
    assert after.counts == {FrameState.RUNNING: 1, FrameState.CANCELLED: 2}
    assert repository.heartbeat(lease, lease_s=30, stage="", fraction=0).cancel_requested
    repository.stop(lease)
    assert repository.job(job.id).state == JobState.CANCELLED
    assert repository.cancel(job.id).state == JobState.CANCELLED


def test_a_cancelled_job_whose_worker_died_ends_as_cancelled(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    take(repository, job, lease_s=-1.0)
    repository.cancel(job.id)
    repository.reap(RULE)
    assert repository.job(job.id).state == JobState.CANCELLED


def test_a_done_job_cannot_be_cancelled(repository: JobRepository) -> None:
    job = new_job(repository, 1)
    repository.complete(take(repository, job))
    with pytest.raises(ConflictError, match="is done already"):
        repository.cancel(job.id)


def test_only_failed_frames_are_retried_with_fresh_attempts(repository: JobRepository) -> None:
    job = new_job(repository, 2)
    with pytest.raises(ConflictError, match="no failed frames"):
        repository.retry_failed(job.id)
    repository.complete(take(repository, job, 0))
    repository.fail(take(repository, job, 1), cause="x", code="y", retryable=False, rule=RULE)
    assert repository.retry_failed(job.id) == 1
    assert repository.job(job.id).counts == {FrameState.DONE: 1, FrameState.QUEUED: 1}
    assert repository.frame(job.id, 1).error is None
    repository.complete(take(repository, job, 1))
    assert repository.job(job.id).state == JobState.DONE


def test_due_frames_are_claimed_once_in_order_of_priority(repository: JobRepository) -> None:
    late = new_job(repository, 2, priority=9)
    soon = new_job(repository, 2, priority=0)
    batch = repository.claim_due(limit=10)
    assert [(due.job_id, due.numbers) for due in batch] == [(soon.id, (0, 1)), (late.id, (0, 1))]
    assert repository.claim_due(limit=10) == []
    repository.unclaim(soon.id, [1])
    assert [due.numbers for due in repository.claim_due(limit=10)] == [(1,)]


def test_frames_whose_messages_the_broker_lost_become_due_again(repository: JobRepository, database: Database) -> None:
    job = new_job(repository, 2)
    repository.claim_due(limit=10)
    assert repository.forget_messages(older_than_s=30) == 0
    with database.writing() as session:
        session.execute(update(FrameRow).values(enqueued_at=time.time() - 60))
    repository.complete(take(repository, job, 0))
    assert repository.forget_messages(older_than_s=30) == 1
    assert [due.numbers for due in repository.claim_due(limit=10)] == [(1,)]


def test_an_idempotency_key_gives_the_same_job_again(repository: JobRepository) -> None:
    new = NewJob("box", 1, JobInput("{}"), request_sha256="a" * 64, idempotency_key="k1")
    first, made = repository.create_job(new)
    again, made_again = repository.create_job(new)
    assert (made, made_again) == (True, False)
    assert first.id == again.id
    with pytest.raises(ConflictError, match="used for another request"):
        repository.create_job(replace(new, request_sha256="b" * 64))


def test_jobs_are_listed_newest_first_page_by_page(repository: JobRepository) -> None:
    made = []
    for _ in range(5):
        made.append(new_job(repository, 1).id)
        time.sleep(0.002)
    first = repository.jobs(limit=3)
    rest = repository.jobs(limit=3, before=first[-1].id)
    assert [job.id for job in first + rest] == made[::-1]
    assert repository.jobs(limit=3, state=JobState.DONE) == []


def test_an_unknown_job_is_answered_with_what_to_do(repository: JobRepository) -> None:
    with pytest.raises(NotFoundError, match="does not exist; list the jobs"):
        repository.job("j0")


def test_totals_and_workers_are_counted(repository: JobRepository) -> None:
    job = new_job(repository, 3)
    repository.complete(take(repository, job))
    assert repository.frame_totals() == {FrameState.DONE: 1, FrameState.QUEUED: 2}
    assert repository.job_totals() == {JobState.RUNNING: 1}
    repository.beat_worker("w1")
    repository.beat_worker("w1")
    assert [worker.name for worker in repository.workers(seen_within_s=10)] == ["w1"]
    repository.remove_worker("w1")
    assert repository.workers(seen_within_s=10) == []
