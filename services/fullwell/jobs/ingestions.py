"""Work on assets that workers do: reading uploads into the store, rendering previews. Leases and outbox as frames have them.

One transaction per method. A row is claimed with a lease, so that two workers never do the same work, and a worker that
was killed loses it to the next one.
"""

from __future__ import annotations

import secrets
import time
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from sqlalchemy import func, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from fullwell.core import ConflictError, NotFoundError
from fullwell.jobs.database import Database
from fullwell.jobs.models import IngestionRow, WorkerRow
from fullwell.jobs.processes import ProcessIdentity, is_gone, process_from_text
from fullwell.jobs.records import RetryRule

__all__ = [
    "IngestionKind",
    "IngestionLease",
    "IngestionLoss",
    "IngestionRecord",
    "IngestionRepository",
    "IngestionState",
    "NewIngestion",
    "StoredAsset",
]

MAX_CAUSE_CHARACTERS = 4000
WORKER_LOST = "worker_lost"
RELEASED = "the worker was shut down"

IngestionKind = Literal["upload", "previews"]


class IngestionState(StrEnum):
    """Where the work is."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class NewIngestion:
    """Work to be done. `name` is for people, `who` asked for it, `request_json` is what the worker reads. Priority 0 to 9.

    `stored` is the version whose previews are to be rendered; uploads have none yet.
    """

    kind: IngestionKind
    name: str
    who: str
    request_json: str
    request_sha256: str
    priority: int = 3
    idempotency_key: str | None = None
    stored: StoredAsset | None = None


@dataclass(frozen=True, slots=True)
class StoredAsset:
    """The version that came out, and its checks as JSON."""

    asset_id: str
    version: int
    checks_json: str = "[]"


@dataclass(frozen=True, slots=True)
class IngestionRecord:
    """Work as it is now; times are Unix times [s], `fraction` in [0, 1]. `stored` is set once the asset is in the store."""

    id: str
    kind: IngestionKind
    name: str
    who: str
    state: IngestionState
    attempt: int
    stage: str
    fraction: float
    created_at: float
    started_at: float | None
    finished_at: float | None
    worker: str | None
    error: str | None
    error_code: str | None
    stored: StoredAsset | None
    preview_error: str
    request_json: str


@dataclass(frozen=True, slots=True)
class IngestionLease:
    """The right to do the work, good until it expires or is prolonged."""

    id: str
    attempt: int
    token: str
    worker: str


@dataclass(frozen=True, slots=True)
class IngestionLoss:
    """Work that was taken back from a worker, and why."""

    id: str
    attempt: int
    cause: str


def _new_id() -> str:
    """Return an id that sorts by the time it was made: 11 hexadecimal digits of milliseconds and 10 random ones."""
    return f"i{time.time_ns() // 1_000_000:011x}{secrets.token_hex(5)}"


class IngestionRepository:
    """The table of work on assets."""

    def __init__(self, database: Database) -> None:
        self._database = database

    # -- asked for ----------------------------------------------------------------------------------------------------

    def create(self, new: NewIngestion) -> tuple[IngestionRecord, bool]:
        """Store work and return it and whether it is new; a known idempotency key gives the earlier one.

        Raises
        ------
        ConflictError
            The key was used for a different request.
        """
        try:
            with self._database.writing() as session:
                if (known := self._by_idempotency_key(session, new)) is not None:
                    return known, False
                row = IngestionRow(
                    id=_new_id(),
                    kind=new.kind,
                    name=new.name[:200],
                    who=new.who[:64],
                    state=IngestionState.QUEUED,
                    priority=new.priority,
                    request_json=new.request_json,
                    request_sha256=new.request_sha256,
                    idempotency_key=new.idempotency_key,
                    created_at=self._database.now(session),
                    asset_id=None if new.stored is None else new.stored.asset_id,
                    asset_version=None if new.stored is None else new.stored.version,
                )
                session.add(row)
                session.flush()
                return _record(row), True
        except IntegrityError:
            # Two requests with one key at the same moment: the other one has won, so its row is there now.
            with self._database.reading() as session:
                if (known := self._by_idempotency_key(session, new)) is not None:
                    return known, False
            raise

    def _by_idempotency_key(self, session: Session, new: NewIngestion) -> IngestionRecord | None:
        if new.idempotency_key is None:
            return None
        row = session.scalar(select(IngestionRow).where(IngestionRow.idempotency_key == new.idempotency_key))
        if row is None:
            return None
        if row.request_sha256 != new.request_sha256:
            raise ConflictError(
                f"Idempotency-Key {new.idempotency_key!r} was used for another request (ingestion {row.id}). Use a new key."
            )
        return _record(row)

    def get(self, ingestion_id: str) -> IngestionRecord:
        """Return work as it is now; NotFoundError where there is none of that id."""
        with self._database.reading() as session:
            return _record(self._row(session, ingestion_id))

    def recent(
        self, *, limit: int, before: str | None = None, state: IngestionState | None = None, asset_id: str = ""
    ) -> list[IngestionRecord]:
        """Return up to `limit` records, newest first, older than the one with the id `before`."""
        query = select(IngestionRow).order_by(IngestionRow.id.desc()).limit(limit)
        if before is not None:
            query = query.where(IngestionRow.id < before)
        if state is not None:
            query = query.where(IngestionRow.state == state)
        if asset_id:
            query = query.where(IngestionRow.asset_id == asset_id)
        with self._database.reading() as session:
            return [_record(row) for row in session.scalars(query)]

    def retry(self, ingestion_id: str) -> IngestionRecord:
        """Queue failed work again, or previews that failed.

        Raises
        ------
        ConflictError
            It has not failed.
        """
        with self._database.writing() as session:
            row = self._locked(session, ingestion_id)
            if row.state != IngestionState.FAILED and not (row.state == IngestionState.DONE and row.preview_error):
                raise ConflictError(f"ingestion {ingestion_id} is {row.state}; only a failed one can be tried again")
            row.state, row.strikes, row.enqueued_at, row.not_before = IngestionState.QUEUED, 0, None, 0.0
            row.finished_at, row.error, row.error_code, row.preview_error = None, None, None, ""
            row.stage, row.fraction = "", 0.0
            return _record(row)

    def totals(self) -> dict[IngestionState, int]:
        """Return the number of records in each state; absent means none."""
        with self._database.reading() as session:
            rows = session.execute(select(IngestionRow.state, func.count()).group_by(IngestionRow.state))
            return {IngestionState(state): count for state, count in rows}

    # -- leases -------------------------------------------------------------------------------------------------------

    def acquire(
        self, ingestion_id: str, *, worker: str, holder: ProcessIdentity, lease_s: float, rule: RetryRule
    ) -> IngestionLease | None:
        """Take the lease on queued work, or on running work whose holder is dead or silent.

        Returns None where there is nothing to do: it has ended, another worker holds it, or it waits for its next try. A
        message that arrives twice therefore does no harm.
        """
        with self._database.writing() as session:
            row = session.scalar(select(IngestionRow).where(IngestionRow.id == ingestion_id).with_for_update())
            if row is None:
                return None
            now = self._database.now(session)
            if row.state == IngestionState.RUNNING and (cause := _reason_to_take_back(row, now)) is not None:
                self._lose(session, row, cause=cause, rule=rule, now=now)
            if row.state != IngestionState.QUEUED or row.not_before > now:
                return None
            row.state, row.attempt = IngestionState.RUNNING, row.attempt + 1
            row.worker, row.holder = worker[:255], holder.to_text()
            row.lease_token, row.lease_expires_at = secrets.token_hex(16), now + lease_s
            row.started_at, row.finished_at, row.stage, row.fraction = now, None, "", 0.0
            return IngestionLease(row.id, row.attempt, row.lease_token, row.worker)

    def heartbeat(self, lease: IngestionLease, *, lease_s: float, stage: str, fraction: float) -> bool:
        """Prolong a lease and store its progress; return whether it is still held."""
        with self._database.writing() as session:
            row = self._held(session, lease)
            if row is None:
                return False
            row.lease_expires_at = self._database.now(session) + lease_s
            row.stage, row.fraction = stage[:64], fraction
            return True

    def stored(self, lease: IngestionLease, asset: StoredAsset) -> None:
        """Record that the asset is in the store; accepted after the lease was lost too, for it is there."""
        with self._database.writing() as session:
            row = self._locked(session, lease.id)
            row.asset_id, row.asset_version, row.checks_json = asset.asset_id, asset.version, asset.checks_json

    def hand_over(self, lease: IngestionLease, *, stage: str, fraction: float, priority: int) -> bool:
        """Queue the rest of the work, as work of its own priority; return whether this lease still held it."""
        with self._database.writing() as session:
            row = self._held(session, lease)
            if row is None:
                return False
            self._requeue(row, 0.0)
            row.stage, row.fraction, row.priority = stage[:64], fraction, priority
            row.attempt, row.strikes = 0, 0
            row.error, row.error_code = None, None
            return True

    def complete(self, lease: IngestionLease, *, preview_error: str = "") -> bool:
        """Mark the work done; return whether this lease still held it."""
        with self._database.writing() as session:
            row = self._held(session, lease)
            if row is None:
                return False
            self._end(row, IngestionState.DONE, self._database.now(session))
            row.fraction, row.error, row.error_code = 1.0, None, None
            row.preview_error = preview_error[:MAX_CAUSE_CHARACTERS]
            return True

    def fail(self, lease: IngestionLease, *, cause: str, code: str, retryable: bool, rule: RetryRule) -> IngestionState | None:
        """Record that an attempt failed; return the new state, None where the lease was lost before."""
        with self._database.writing() as session:
            row = self._held(session, lease)
            if row is None:
                return None
            self._strike(row, cause=cause, code=code, retryable=retryable, rule=rule, now=self._database.now(session))
            return IngestionState(row.state)

    def lose(self, ingestion_id: str, *, worker: str, cause: str, rule: RetryRule) -> IngestionLoss | None:
        """Take back work from a worker whose process has died; `cause` says how. None where it does not run it."""
        with self._database.writing() as session:
            row = session.scalar(select(IngestionRow).where(IngestionRow.id == ingestion_id).with_for_update())
            if row is None or row.state != IngestionState.RUNNING or row.worker != worker[:255]:
                return None
            self._lose(session, row, cause=cause, rule=rule, now=self._database.now(session))
            return IngestionLoss(row.id, row.attempt, cause)

    def release_worker(self, worker: str) -> list[IngestionLoss]:
        """Give back, without a strike, what a worker holds; it is shutting down in good order."""
        with self._database.writing() as session:
            held = select(IngestionRow).where(IngestionRow.state == IngestionState.RUNNING, IngestionRow.worker == worker[:255])
            rows = session.scalars(held.with_for_update()).all()
            for row in rows:
                self._requeue(row, 0.0)
            return [IngestionLoss(row.id, row.attempt, RELEASED) for row in rows]

    def reap(self, rule: RetryRule) -> list[IngestionLoss]:
        """Take back all work whose lease has expired or whose holder is certainly dead."""
        with self._database.reading() as session:
            now = self._database.now(session)
            rows = session.scalars(select(IngestionRow).where(IngestionRow.state == IngestionState.RUNNING)).all()
            suspects = [row.id for row in rows if _reason_to_take_back(row, now) is not None]
        losses = []
        for ingestion_id in suspects:
            with self._database.writing() as session:
                row = self._locked(session, ingestion_id)
                now = self._database.now(session)
                if row.state != IngestionState.RUNNING or (cause := _reason_to_take_back(row, now)) is None:
                    continue
                self._lose(session, row, cause=cause, rule=rule, now=now)
                losses.append(IngestionLoss(row.id, row.attempt, cause))
        return losses

    # -- outbox -------------------------------------------------------------------------------------------------------

    def claim_due(self, *, limit: int) -> list[tuple[str, int]]:
        """Mark up to `limit` queued records, whose message is due, as enqueued; return their ids and priorities.

        Marked before their messages are sent: should the sender die in between, `forget_messages` finds them.
        """
        with self._database.writing() as session:
            now = self._database.now(session)
            due = (
                select(IngestionRow)
                .where(IngestionRow.state == IngestionState.QUEUED, IngestionRow.enqueued_at.is_(None))
                .where(IngestionRow.not_before <= now)
                .order_by(IngestionRow.priority, IngestionRow.id)
                .limit(limit)
                .with_for_update(skip_locked=True)
            )
            rows = session.scalars(due).all()
            for row in rows:
                row.enqueued_at = now
            return [(row.id, row.priority) for row in rows]

    def unclaim(self, ingestion_id: str) -> None:
        """Undo `claim_due`: the broker did not take the message."""
        with self._database.writing() as session:
            session.execute(
                update(IngestionRow)
                .where(IngestionRow.id == ingestion_id, IngestionRow.state == IngestionState.QUEUED)
                .values(enqueued_at=None)
            )

    def forget_messages(self, *, older_than_s: float) -> int:
        """Make due again what was sent that long ago and is still queued; return how much there was.

        To be called when the broker holds no waiting message: then theirs were lost with the broker's data.
        """
        with self._database.writing() as session:
            limit = self._database.now(session) - older_than_s
            return len(
                session.execute(
                    update(IngestionRow)
                    .where(IngestionRow.state == IngestionState.QUEUED, IngestionRow.enqueued_at < limit)
                    .values(enqueued_at=None)
                    .returning(IngestionRow.id)
                ).all()
            )

    # -- parts --------------------------------------------------------------------------------------------------------

    def _row(self, session: Session, ingestion_id: str) -> IngestionRow:
        row = session.get(IngestionRow, ingestion_id)
        if row is None:
            raise NotFoundError(f"ingestion {ingestion_id[:64]!r} does not exist; list the ingestions to see which do")
        return row

    def _locked(self, session: Session, ingestion_id: str) -> IngestionRow:
        row = session.scalar(select(IngestionRow).where(IngestionRow.id == ingestion_id).with_for_update())
        if row is None:
            raise NotFoundError(f"ingestion {ingestion_id[:64]!r} does not exist; list the ingestions to see which do")
        return row

    def _held(self, session: Session, lease: IngestionLease) -> IngestionRow | None:
        row = session.scalar(select(IngestionRow).where(IngestionRow.id == lease.id).with_for_update())
        held = row is not None and row.state == IngestionState.RUNNING and row.lease_token == lease.token
        return row if held else None

    def _lose(self, session: Session, row: IngestionRow, *, cause: str, rule: RetryRule, now: float) -> None:
        worker = session.get(WorkerRow, row.worker or "")
        if worker is not None and worker.leaving_at is not None:
            self._requeue(row, 0.0)
            return
        self._strike(row, cause=cause, code=WORKER_LOST, retryable=True, rule=rule, now=now)

    def _strike(self, row: IngestionRow, *, cause: str, code: str, retryable: bool, rule: RetryRule, now: float) -> None:
        row.strikes += 1
        row.error, row.error_code = cause[:MAX_CAUSE_CHARACTERS], code
        if retryable and row.strikes < rule.max_attempts:
            # The first loss of a worker says nothing about the files, so they are tried again at once.
            wait_s = 0.0 if code == WORKER_LOST and row.strikes == 1 else rule.delay_s * 2.0 ** (row.strikes - 1)
            self._requeue(row, now + wait_s)
            return
        tried = f" (after {row.strikes} attempts)" if row.strikes > 1 else ""
        if row.kind == "upload" and row.asset_id is not None:
            # The asset is in the store: what failed is its previews.
            self._end(row, IngestionState.DONE, now)
            row.preview_error, row.error, row.error_code = f"{row.error}{tried}", None, None
            return
        row.error = f"{row.error}{tried}"
        self._end(row, IngestionState.FAILED, now)

    def _requeue(self, row: IngestionRow, not_before: float) -> None:
        row.state, row.enqueued_at, row.not_before = IngestionState.QUEUED, None, not_before
        row.stage, row.fraction = "", 0.0
        _drop_lease(row)

    def _end(self, row: IngestionRow, state: IngestionState, now: float) -> None:
        row.state, row.finished_at = state, now
        _drop_lease(row)


def _drop_lease(row: IngestionRow) -> None:
    row.holder, row.lease_token, row.lease_expires_at = None, None, None


def _reason_to_take_back(row: IngestionRow, now: float) -> str | None:
    holder = process_from_text(row.holder or "")
    if holder is not None and is_gone(holder):
        return f"the worker process {holder.pid} on {holder.host} died"
    if row.lease_expires_at is None or row.lease_expires_at < now:
        return f"the worker {row.worker} gave no sign of life; its lease expired"
    return None


def _record(row: IngestionRow) -> IngestionRecord:
    stored = None
    if row.asset_id is not None and row.asset_version is not None:
        stored = StoredAsset(row.asset_id, row.asset_version, row.checks_json or "[]")
    return IngestionRecord(
        id=row.id,
        kind="previews" if row.kind == "previews" else "upload",
        name=row.name,
        who=row.who,
        state=IngestionState(row.state),
        attempt=row.attempt or 0,
        stage=row.stage or "",
        fraction=row.fraction or 0.0,
        created_at=row.created_at,
        started_at=row.started_at,
        finished_at=row.finished_at,
        worker=row.worker,
        error=row.error,
        error_code=row.error_code,
        stored=stored,
        preview_error=row.preview_error or "",
        request_json=row.request_json,
    )
