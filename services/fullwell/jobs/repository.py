"""The job database: every question and every change that the service makes, each in one transaction.

Numbers of frames by state come from SQL aggregates in the transaction that needs them. A change to a frame first locks its
job's row, so that two workers that finish a job's last two frames cannot both miss that it is complete.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterable, Sequence

from sqlalchemy import and_, delete, func, insert, or_, select, text, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from fullwell.core import ConflictError, NotFoundError
from fullwell.jobs.database import Database
from fullwell.jobs.models import AttemptRow, FrameRow, JobRow, WorkerRow
from fullwell.jobs.processes import ProcessIdentity, is_gone, process_from_text
from fullwell.jobs.records import (
    AttemptRecord,
    Dispatch,
    FrameRecord,
    Heartbeat,
    JobInput,
    JobRecord,
    Lease,
    Loss,
    NewJob,
    RetryRule,
    WorkerRecord,
)
from fullwell.jobs.states import (
    FINAL_FRAME_STATES,
    FrameState,
    JobState,
    check_frame_move,
    check_job_move,
    job_state_of,
)

__all__ = ["JobRepository"]

MAX_CAUSE_CHARACTERS = 4000
INSERT_ROWS = 5000
WORKER_LOST = "worker_lost"


def _new_job_id() -> str:
    """Return an id that sorts by the time it was made: 11 hexadecimal digits of milliseconds and 10 random ones."""
    return f"j{time.time_ns() // 1_000_000:011x}{secrets.token_hex(5)}"


class JobRepository:
    """Jobs, frames, leases, attempts and workers."""

    def __init__(self, database: Database) -> None:
        self._database = database

    # -- jobs ---------------------------------------------------------------------------------------------------------

    def create_job(self, new: NewJob) -> tuple[JobRecord, bool]:
        """Store a job and its frames; return it and whether it is new.

        With an idempotency key that is known, the earlier job is returned when the request was the same one.

        Raises
        ------
        ConflictError
            The key was used for a different request.
        """
        try:
            with self._database.writing() as session:
                if (known := self._by_idempotency_key(session, new)) is not None:
                    return known, False
                return self._insert_job(session, new), True
        except IntegrityError:
            # Two requests with one key at the same moment: the other one has won, so its job is there now.
            with self._database.reading() as session:
                if (known := self._by_idempotency_key(session, new)) is not None:
                    return known, False
            raise

    def _by_idempotency_key(self, session: Session, new: NewJob) -> JobRecord | None:
        if new.idempotency_key is None:
            return None
        row = session.scalar(select(JobRow).where(JobRow.idempotency_key == new.idempotency_key))
        if row is None:
            return None
        if row.request_sha256 != new.request_sha256:
            raise ConflictError(
                f"Idempotency-Key {new.idempotency_key!r} was used for another request (job {row.id}). Use a new key."
            )
        return self._record(session, row)

    def _insert_job(self, session: Session, new: NewJob) -> JobRecord:
        now = self._database.now(session)
        row = JobRow(
            id=_new_job_id(),
            name=new.name[:200],
            state=JobState.QUEUED,
            priority=new.priority,
            frame_count=new.frame_count,
            recipe_json=new.given.recipe_json,
            overrides_json=new.given.overrides_json,
            files_json=new.given.files_json,
            idempotency_key=new.idempotency_key,
            request_sha256=new.request_sha256,
            created_at=now,
        )
        session.add(row)
        session.flush()
        for start in range(0, new.frame_count, INSERT_ROWS):
            numbers = range(start, min(start + INSERT_ROWS, new.frame_count))
            rows = [{"job_id": row.id, "number": n, "state": FrameState.QUEUED, "changed_at": now} for n in numbers]
            session.execute(insert(FrameRow), rows)
        return self._record(session, row)

    def job(self, job_id: str) -> JobRecord:
        """Return a job; NotFoundError when there is none of that id."""
        with self._database.reading() as session:
            return self._record(session, self._job_row(session, job_id))

    def jobs(self, *, limit: int, before: str | None = None, state: JobState | None = None) -> list[JobRecord]:
        """Return up to `limit` jobs, newest first, older than the job `before`."""
        query = select(JobRow).order_by(JobRow.id.desc()).limit(limit)
        if before is not None:
            query = query.where(JobRow.id < before)
        if state is not None:
            query = query.where(JobRow.state == state)
        with self._database.reading() as session:
            rows = session.scalars(query).all()
            counts = self._counts_of(session, [row.id for row in rows])
            return [_job_record(row, counts.get(row.id, {})) for row in rows]

    def input_of(self, job_id: str) -> JobInput:
        """Return what a worker needs to run frames of the job."""
        with self._database.reading() as session:
            row = self._job_row(session, job_id)
            return JobInput(row.recipe_json, row.overrides_json, row.files_json)

    def cancel(self, job_id: str) -> JobRecord:
        """Cancel what has not started and ask the workers to stop what has. Cancelling twice is the same as once.

        Raises
        ------
        ConflictError
            The job has ended already.
        """
        with self._database.writing() as session:
            row = self._locked_job(session, job_id)
            if row.state in (JobState.DONE, JobState.FAILED):
                raise ConflictError(f"job {job_id} is {row.state} already; only a queued or running job can be cancelled")
            now = self._database.now(session)
            row.cancel_requested_at = row.cancel_requested_at or now
            check_frame_move(FrameState.QUEUED, FrameState.CANCELLED)
            session.execute(
                update(FrameRow)
                .where(FrameRow.job_id == job_id, FrameRow.state == FrameState.QUEUED)
                .values(state=FrameState.CANCELLED, changed_at=now, finished_at=now)
            )
            return self._settle(session, row)

    def retry_failed(self, job_id: str) -> int:
        """Queue the failed frames again, with all attempts before them; return how many there were.

        Raises
        ------
        ConflictError
            No frame of the job has failed, or it was cancelled.
        """
        with self._database.writing() as session:
            row = self._locked_job(session, job_id)
            failed = self._counts(session, job_id).get(FrameState.FAILED, 0)
            if row.cancel_requested_at is not None:
                raise ConflictError(f"job {job_id} was cancelled; submit the recipe again instead")
            if not failed:
                raise ConflictError(f"job {job_id} has no failed frames; its state is {row.state}")
            check_frame_move(FrameState.FAILED, FrameState.QUEUED)
            now = self._database.now(session)
            session.execute(
                update(FrameRow)
                .where(FrameRow.job_id == job_id, FrameRow.state == FrameState.FAILED)
                .values(
                    state=FrameState.QUEUED,
                    strikes=0,
                    enqueued_at=None,
                    not_before=0.0,
                    changed_at=now,
                    finished_at=None,
                    error=None,
                    error_code=None,
                    stage="",
                    fraction=0.0,
                )
            )
            self._settle(session, row)
            return failed

    # -- frames -------------------------------------------------------------------------------------------------------

    def frames(self, job_id: str, *, limit: int, after: int = -1, state: FrameState | None = None) -> list[FrameRecord]:
        """Return up to `limit` frames with a number above `after`, in order of their numbers."""
        query = select(FrameRow).where(FrameRow.job_id == job_id, FrameRow.number > after).order_by(FrameRow.number)
        if state is not None:
            query = query.where(FrameRow.state == state)
        with self._database.reading() as session:
            self._job_row(session, job_id)
            return [_frame_record(row) for row in session.scalars(query.limit(limit))]

    def frame(self, job_id: str, number: int) -> FrameRecord:
        """Return one frame; NotFoundError when the job or the frame does not exist."""
        with self._database.reading() as session:
            job = self._job_row(session, job_id)
            row = session.get(FrameRow, (job_id, number))
            if row is None:
                raise NotFoundError(f"job {job_id} has no frame {number}; its frames are 0 to {job.frame_count - 1}")
            return _frame_record(row)

    def changed_frames(self, job_id: str, *, since: float, after: int = -1, limit: int) -> list[FrameRecord]:
        """Return up to `limit` frames in order of their last change (Unix time [s]) and number.

        Those that changed later than `since`, and of those that changed just then the ones with a number above `after`.
        """
        later = or_(FrameRow.changed_at > since, and_(FrameRow.changed_at == since, FrameRow.number > after))
        query = select(FrameRow).where(FrameRow.job_id == job_id, later)
        with self._database.reading() as session:
            rows = session.scalars(query.order_by(FrameRow.changed_at, FrameRow.number).limit(limit))
            return [_frame_record(row) for row in rows]

    def last_change(self, job_id: str) -> float:
        """Return when a frame of the job changed last (Unix time [s])."""
        with self._database.reading() as session:
            job = self._job_row(session, job_id)
            last = session.scalar(select(func.max(FrameRow.changed_at)).where(FrameRow.job_id == job_id))
            return job.created_at if last is None else float(last)

    def attempts(self, job_id: str, number: int) -> list[AttemptRecord]:
        """Return every attempt at a frame, in order."""
        query = select(AttemptRow).where(AttemptRow.job_id == job_id, AttemptRow.number == number).order_by(AttemptRow.id)
        with self._database.reading() as session:
            self._job_row(session, job_id)
            return [
                AttemptRecord(row.number, row.attempt, row.worker, row.started_at, row.ended_at, row.outcome, row.cause)
                for row in session.scalars(query)
            ]

    # -- leases -------------------------------------------------------------------------------------------------------

    def acquire(
        self, job_id: str, number: int, *, worker: str, holder: ProcessIdentity, lease_s: float, rule: RetryRule
    ) -> Lease | None:
        """Take the lease on a queued frame, or on a running one whose holder is dead or silent.

        Returns None when there is nothing to do: the frame has ended, another worker holds it, it waits for its next try
        (a message comes when that is due), or it is failed now. A message that arrives twice therefore does no harm.
        """
        with self._database.writing() as session:
            job = self._locked_job(session, job_id)
            row = session.get(FrameRow, (job_id, number))
            now = self._database.now(session)
            if row is None:
                return None
            if row.state == FrameState.RUNNING and (cause := _reason_to_take_back(row, now)) is not None:
                self._lose(session, job, row, cause=cause, rule=rule, now=now)
            if row.state != FrameState.QUEUED or row.not_before > now or job.cancel_requested_at is not None:
                return None
            return self._start(session, job, row, worker=worker, holder=holder, lease_s=lease_s, now=now)

    def _start(
        self, session: Session, job: JobRow, row: FrameRow, *, worker: str, holder: ProcessIdentity, lease_s: float, now: float
    ) -> Lease:
        _move(row, FrameState.RUNNING, now)
        row.attempt += 1
        row.worker, row.holder = worker[:255], holder.to_text()
        row.lease_token, row.lease_expires_at = secrets.token_hex(16), now + lease_s
        row.started_at, row.finished_at, row.stage, row.fraction = now, None, "", 0.0
        session.add(AttemptRow(job_id=row.job_id, number=row.number, attempt=row.attempt, worker=row.worker, started_at=now))
        self._settle(session, job)
        return Lease(row.job_id, row.number, row.attempt, row.lease_token, row.worker)

    def heartbeat(self, lease: Lease, *, lease_s: float, stage: str, fraction: float) -> Heartbeat:
        """Prolong a lease and store its progress; learn whether it is still held and whether to stop."""
        with self._database.writing() as session:
            now = self._database.now(session)
            result = session.execute(
                update(FrameRow)
                .where(
                    FrameRow.job_id == lease.job_id,
                    FrameRow.number == lease.number,
                    FrameRow.state == FrameState.RUNNING,
                    FrameRow.lease_token == lease.token,
                )
                .values(lease_expires_at=now + lease_s, stage=stage[:64], fraction=fraction, changed_at=now)
                .returning(FrameRow.number)
            ).all()
            asked = session.scalar(select(JobRow.cancel_requested_at).where(JobRow.id == lease.job_id))
            return Heartbeat(still_held=bool(result), cancel_requested=asked is not None)

    def complete(self, lease: Lease) -> bool:
        """Mark a frame done after its manifest has been committed; return whether that changed anything.

        Accepted from a worker that has lost its lease too: the manifest in the store is the commit point, so the frame
        *is* done, whoever is still at it.
        """
        with self._database.writing() as session:
            job = self._locked_job(session, lease.job_id)
            row = session.get(FrameRow, (lease.job_id, lease.number))
            now = self._database.now(session)
            self._end_attempt(session, lease, "done", None, now)
            if row is None or row.state not in (FrameState.QUEUED, FrameState.RUNNING):
                return False
            _move(row, FrameState.DONE, now)
            row.fraction, row.error, row.error_code = 1.0, None, None
            _drop_lease(row)
            self._settle(session, job)
            return True

    def fail(self, lease: Lease, *, cause: str, code: str, retryable: bool, rule: RetryRule) -> FrameState | None:
        """Record that an attempt failed; return the frame's new state, None when the lease was lost before."""
        with self._database.writing() as session:
            job = self._locked_job(session, lease.job_id)
            row = self._held(session, lease)
            now = self._database.now(session)
            if row is None:
                self._end_attempt(session, lease, "failed", cause, now)
                return None
            self._strike(session, job, row, outcome="failed", cause=cause, code=code, retryable=retryable, rule=rule, now=now)
            return FrameState(row.state)

    def stop(self, lease: Lease) -> None:
        """Record that an attempt ended because its job was cancelled, or because the lease was lost."""
        with self._database.writing() as session:
            job = self._locked_job(session, lease.job_id)
            now = self._database.now(session)
            if (row := self._held(session, lease)) is None:
                self._end_attempt(session, lease, "superseded", "another worker had taken the frame over", now)
                return
            self._end_attempt(session, lease, "cancelled", None, now)
            _move(row, FrameState.CANCELLED, now)
            _drop_lease(row)
            self._settle(session, job)

    def release_worker(self, worker: str, *, cause: str) -> list[Loss]:
        """Give back, without a strike, every frame that a worker holds; it is shutting down in good order."""
        with self._database.reading() as session:
            held = select(FrameRow.job_id, FrameRow.number).where(
                FrameRow.state == FrameState.RUNNING, FrameRow.worker == worker[:255]
            )
            keys = [(job_id, number) for job_id, number in session.execute(held)]
        losses = []
        for job_id, number in keys:
            with self._database.writing() as session:
                job = self._locked_job(session, job_id)
                row = session.get(FrameRow, (job_id, number))
                if row is None or row.state != FrameState.RUNNING or row.worker != worker[:255]:
                    continue
                losses.append(Loss(job_id, number, row.attempt, cause))
                self._requeue(session, job, row, outcome="released", cause=cause, now=self._database.now(session))
        return losses

    def lose(self, job_id: str, numbers: Iterable[int], *, worker: str, cause: str, rule: RetryRule) -> list[Loss]:
        """Take back those of the frames that `worker` runs: the process that ran them has died, `cause` says how.

        A frame that was taken back before, because its process was found dead, gets this better cause.
        """
        losses = []
        with self._database.writing() as session:
            job = self._locked_job(session, job_id)
            now = self._database.now(session)
            for number in numbers:
                row = session.get(FrameRow, (job_id, number))
                if row is None or row.worker != worker[:255]:
                    continue
                if row.state != FrameState.RUNNING:
                    self._explain_loss(session, row, cause)
                    continue
                losses.append(Loss(job_id, number, row.attempt, cause))
                self._lose(session, job, row, cause=cause, rule=rule, now=now)
        return losses

    def _explain_loss(self, session: Session, row: FrameRow, cause: str) -> None:
        changed = session.execute(
            update(AttemptRow)
            .where(AttemptRow.job_id == row.job_id, AttemptRow.number == row.number, AttemptRow.attempt == row.attempt)
            .where(AttemptRow.outcome == "lost")
            .values(cause=cause[:MAX_CAUSE_CHARACTERS])
            .returning(AttemptRow.id)
        ).all()
        if changed and row.error_code == WORKER_LOST and row.state == FrameState.QUEUED:
            row.error = cause[:MAX_CAUSE_CHARACTERS]

    def reap(self, rule: RetryRule) -> list[Loss]:
        """Take back every running frame whose lease has expired or whose holder is certainly dead."""
        with self._database.reading() as session:
            now = self._database.now(session)
            rows = session.scalars(select(FrameRow).where(FrameRow.state == FrameState.RUNNING)).all()
            suspects = [(row.job_id, row.number) for row in rows if _reason_to_take_back(row, now) is not None]
        losses = []
        for job_id, number in suspects:
            with self._database.writing() as session:
                job = self._locked_job(session, job_id)
                row = session.get(FrameRow, (job_id, number))
                now = self._database.now(session)
                if row is None or row.state != FrameState.RUNNING or (cause := _reason_to_take_back(row, now)) is None:
                    continue
                losses.append(Loss(job_id, number, row.attempt, cause))
                self._lose(session, job, row, cause=cause, rule=rule, now=now)
        return losses

    # -- outbox -------------------------------------------------------------------------------------------------------

    def claim_due(self, *, limit: int) -> list[Dispatch]:
        """Mark up to `limit` queued frames, whose message is due, as enqueued, and return them by job.

        Frames are marked before their messages are sent: should the sender die in between, `forget_messages` finds them.
        """
        with self._database.writing() as session:
            now = self._database.now(session)
            due = (
                select(FrameRow.job_id, FrameRow.number, JobRow.priority)
                .join(JobRow, JobRow.id == FrameRow.job_id)
                .where(FrameRow.state == FrameState.QUEUED, FrameRow.enqueued_at.is_(None), FrameRow.not_before <= now)
                .order_by(JobRow.priority, FrameRow.job_id, FrameRow.number)
                .limit(limit)
                .with_for_update(of=FrameRow, skip_locked=True)
            )
            grouped: dict[tuple[int, str], list[int]] = {}
            for job_id, number, priority in session.execute(due):
                grouped.setdefault((priority, job_id), []).append(number)
            for (_, job_id), numbers in grouped.items():
                self._set_enqueued(session, job_id, numbers, now)
        return [Dispatch(job_id, priority, tuple(numbers)) for (priority, job_id), numbers in grouped.items()]

    def unclaim(self, job_id: str, numbers: Sequence[int]) -> None:
        """Undo `claim_due`: the broker did not take the messages."""
        with self._database.writing() as session:
            self._set_enqueued(session, job_id, numbers, None)

    def forget_messages(self, *, older_than_s: float) -> int:
        """Make due again the queued frames whose message was sent that long ago; return how many there were.

        To be called when the broker holds no waiting message: then theirs were lost with the broker's data.
        """
        with self._database.writing() as session:
            limit = self._database.now(session) - older_than_s
            return len(
                session.execute(
                    update(FrameRow)
                    .where(FrameRow.state == FrameState.QUEUED, FrameRow.enqueued_at < limit)
                    .values(enqueued_at=None)
                    .returning(FrameRow.number)
                ).all()
            )

    def _set_enqueued(self, session: Session, job_id: str, numbers: Sequence[int], when: float | None) -> None:
        for start in range(0, len(numbers), 500):
            session.execute(
                update(FrameRow)
                .where(FrameRow.job_id == job_id, FrameRow.number.in_(numbers[start : start + 500]))
                .where(FrameRow.state == FrameState.QUEUED)
                .values(enqueued_at=when)
            )

    # -- workers and totals -------------------------------------------------------------------------------------------

    def beat_worker(self, name: str) -> None:
        """Record a sign of life of a worker."""
        with self._database.writing() as session:
            now = self._database.now(session)
            row = session.get(WorkerRow, name[:255])
            if row is None:
                session.add(WorkerRow(name=name[:255], started_at=now, seen_at=now))
            else:
                row.seen_at = now

    def worker_leaves(self, name: str) -> None:
        """Record that a worker was asked to end: a frame that it cannot finish in time is given back without a strike."""
        with self._database.writing() as session:
            now = self._database.now(session)
            row = session.get(WorkerRow, name[:255])
            if row is None:
                session.add(WorkerRow(name=name[:255], started_at=now, seen_at=now, leaving_at=now))
            else:
                row.leaving_at = now

    def remove_worker(self, name: str) -> None:
        """Forget a worker that has ended."""
        with self._database.writing() as session:
            session.execute(delete(WorkerRow).where(WorkerRow.name == name[:255]))

    def workers(self, *, seen_within_s: float) -> list[WorkerRecord]:
        """Return the workers that gave a sign of life that recently."""
        with self._database.reading() as session:
            limit = self._database.now(session) - seen_within_s
            rows = session.scalars(select(WorkerRow).where(WorkerRow.seen_at >= limit).order_by(WorkerRow.name))
            return [WorkerRecord(row.name, row.started_at, row.seen_at) for row in rows]

    def remove_silent_workers(self, *, silent_for_s: float) -> None:
        """Forget workers that gave no sign of life for that long."""
        with self._database.writing() as session:
            session.execute(delete(WorkerRow).where(WorkerRow.seen_at < self._database.now(session) - silent_for_s))

    def job_totals(self) -> dict[JobState, int]:
        """Return the number of jobs in each state; absent means none."""
        with self._database.reading() as session:
            rows = session.execute(select(JobRow.state, func.count()).group_by(JobRow.state))
            return {JobState(state): count for state, count in rows}

    def frame_totals(self) -> dict[FrameState, int]:
        """Return the number of frames of all jobs in each state; absent means none."""
        with self._database.reading() as session:
            rows = session.execute(select(FrameRow.state, func.count()).group_by(FrameRow.state))
            return {FrameState(state): count for state, count in rows}

    def check(self) -> None:
        """Raise ServiceError when the database does not answer."""
        with self._database.reading() as session:
            session.execute(text("SELECT 1"))

    # -- parts --------------------------------------------------------------------------------------------------------

    def _job_row(self, session: Session, job_id: str) -> JobRow:
        row = session.get(JobRow, job_id)
        if row is None:
            raise NotFoundError(f"job {job_id[:64]!r} does not exist; list the jobs to see which do")
        return row

    def _locked_job(self, session: Session, job_id: str) -> JobRow:
        row = session.scalar(select(JobRow).where(JobRow.id == job_id).with_for_update())
        if row is None:
            raise NotFoundError(f"job {job_id[:64]!r} does not exist; list the jobs to see which do")
        return row

    def _held(self, session: Session, lease: Lease) -> FrameRow | None:
        row = session.get(FrameRow, (lease.job_id, lease.number))
        held = row is not None and row.state == FrameState.RUNNING and row.lease_token == lease.token
        return row if held else None

    def _counts_of(self, session: Session, job_ids: Sequence[str]) -> dict[str, dict[FrameState, int]]:
        query = (
            select(FrameRow.job_id, FrameRow.state, func.count())
            .where(FrameRow.job_id.in_(job_ids))
            .group_by(FrameRow.job_id, FrameRow.state)
        )
        counts: dict[str, dict[FrameState, int]] = {}
        for job_id, state, count in session.execute(query):
            counts.setdefault(job_id, {})[FrameState(state)] = count
        return counts

    def _counts(self, session: Session, job_id: str) -> dict[FrameState, int]:
        return self._counts_of(session, [job_id]).get(job_id, {})

    def _record(self, session: Session, row: JobRow) -> JobRecord:
        return _job_record(row, self._counts(session, row.id))

    def _settle(self, session: Session, row: JobRow) -> JobRecord:
        """Derive the job's state from its frames, after they were changed in this transaction."""
        session.flush()
        now = self._database.now(session)
        counts = self._counts(session, row.id)
        new = job_state_of(counts)
        if new != row.state:
            check_job_move(JobState(row.state), new)
            row.state = new
        ended = new not in (JobState.QUEUED, JobState.RUNNING)
        row.finished_at = (row.finished_at or now) if ended else None
        if new == JobState.RUNNING:
            row.started_at = row.started_at or now
        session.flush()
        return self._record(session, row)

    def _lose(self, session: Session, job: JobRow, row: FrameRow, *, cause: str, rule: RetryRule, now: float) -> None:
        worker = session.get(WorkerRow, row.worker or "")
        if worker is not None and worker.leaving_at is not None:
            self._requeue(session, job, row, outcome="released", cause="the worker was shut down", now=now)
            return
        self._strike(session, job, row, outcome="lost", cause=cause, code=WORKER_LOST, retryable=True, rule=rule, now=now)

    def _strike(
        self,
        session: Session,
        job: JobRow,
        row: FrameRow,
        *,
        outcome: str,
        cause: str,
        code: str,
        retryable: bool,
        rule: RetryRule,
        now: float,
    ) -> None:
        """End an attempt badly: the frame is queued again, or failed when it may not be or has been too often."""
        row.strikes += 1
        row.error, row.error_code = cause[:MAX_CAUSE_CHARACTERS], code
        if job.cancel_requested_at is not None or (retryable and row.strikes < rule.max_attempts):
            # The first loss of a worker says nothing about the frame, so it is tried again at once.
            wait = 0.0 if outcome == "lost" and row.strikes == 1 else rule.delay_s * 2.0 ** (row.strikes - 1)
            self._requeue(session, job, row, outcome=outcome, cause=cause, now=now, not_before=now + wait)
            return
        tried = f" (after {row.strikes} attempts)" if row.strikes > 1 else ""
        row.error = f"{cause[:MAX_CAUSE_CHARACTERS]}{tried}"
        self._end_attempt(session, _lease_of(row), outcome, cause, now)
        _move(row, FrameState.FAILED, now)
        _drop_lease(row)
        self._settle(session, job)

    def _requeue(
        self, session: Session, job: JobRow, row: FrameRow, *, outcome: str, cause: str, now: float, not_before: float = 0.0
    ) -> None:
        self._end_attempt(session, _lease_of(row), outcome, cause, now)
        stopped = job.cancel_requested_at is not None
        _move(row, FrameState.CANCELLED if stopped else FrameState.QUEUED, now)
        row.enqueued_at, row.not_before = None, not_before
        _drop_lease(row)
        self._settle(session, job)

    def _end_attempt(self, session: Session, lease: Lease, outcome: str, cause: str | None, now: float) -> None:
        shown = cause[:MAX_CAUSE_CHARACTERS] if cause else None
        session.execute(
            update(AttemptRow)
            .where(AttemptRow.job_id == lease.job_id, AttemptRow.number == lease.number, AttemptRow.attempt == lease.attempt)
            .where(or_(AttemptRow.outcome.is_(None), AttemptRow.outcome == "lost"))
            .values(outcome=outcome, cause=shown, ended_at=now)
        )


def _job_record(row: JobRow, counts: dict[FrameState, int]) -> JobRecord:
    return JobRecord(
        id=row.id,
        name=row.name,
        state=JobState(row.state),
        priority=row.priority,
        frame_count=row.frame_count,
        created_at=row.created_at,
        started_at=row.started_at,
        finished_at=row.finished_at,
        cancel_requested=row.cancel_requested_at is not None,
        request_sha256=row.request_sha256,
        counts=counts,
    )


def _move(row: FrameRow, new: FrameState, now: float) -> None:
    check_frame_move(FrameState(row.state), new)
    row.state = new
    row.changed_at = now
    row.finished_at = now if new in FINAL_FRAME_STATES else None
    if new == FrameState.QUEUED:
        row.stage, row.fraction = "", 0.0


def _lease_of(row: FrameRow) -> Lease:
    return Lease(row.job_id, row.number, row.attempt, row.lease_token or "", row.worker or "")


def _drop_lease(row: FrameRow) -> None:
    row.holder, row.lease_token, row.lease_expires_at = None, None, None


def _reason_to_take_back(row: FrameRow, now: float) -> str | None:
    holder = process_from_text(row.holder or "")
    if holder is not None and is_gone(holder):
        return f"the worker process {holder.pid} on {holder.host} died"
    if row.lease_expires_at is None or row.lease_expires_at < now:
        return f"the worker {row.worker} gave no sign of life; its lease expired"
    return None


def _frame_record(row: FrameRow) -> FrameRecord:
    return FrameRecord(
        job_id=row.job_id,
        number=row.number,
        state=FrameState(row.state),
        attempt=row.attempt,
        worker=row.worker,
        stage=row.stage,
        fraction=row.fraction,
        changed_at=row.changed_at,
        started_at=row.started_at,
        finished_at=row.finished_at,
        error=row.error,
        error_code=row.error_code,
    )
