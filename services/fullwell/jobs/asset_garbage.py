"""Garbage collection: blobs and previews that nothing refers to go; what anything may refer to stays.

`cas/` belongs to two: files of jobs, which the API stores there, and assets. A blob goes only when neither needs it. Rendered
stages are below `cache/` and look after themselves (`pipeline.stage_store`).
"""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import structlog
from sqlalchemy import and_, delete, select
from sqlalchemy.orm import Session

from fullwell.assets.records import AssetManifest
from fullwell.assets.store import PREVIEW_PREFIX
from fullwell.core import AssetError, FieldError, NotFoundError
from fullwell.jobs.asset_files import VERSION_KINDS, AssetFile, next_micros, standing_of
from fullwell.jobs.asset_index import assets_locked, files_of, index_files, pieces
from fullwell.jobs.asset_reading import absorb
from fullwell.jobs.asset_records import GarbageReport
from fullwell.jobs.asset_rows import AssetEventRow, AssetHoldRow, AssetManifestRow, AssetVersionRow
from fullwell.jobs.database import Database
from fullwell.jobs.models import IngestionRow, JobRow
from fullwell.storage import ObjectStore

__all__ = ["collect_garbage"]

COLLECTOR: Final = "garbage collection"
BATCH: Final = 64
"""Objects that are removed in one transaction: other writers of the catalogue wait as long."""
MAX_MANIFEST_BYTES: Final = 4 << 20

_DIGEST: Final = re.compile(rb"(?=([0-9a-f]{64}))")
_BLOB: Final = re.compile(r"cas/([0-9a-f]{64})")
_PREVIEW: Final = re.compile(rf"{PREVIEW_PREFIX}/([0-9a-f]{{64}})/[^/]+")
_FRAME_MANIFEST: Final = re.compile(r"jobs/.*manifest[^/]*\.json")
_DATASET_MANIFEST: Final = re.compile(r"datasets/.*\.(json|jsonl|yaml|yml)")
_CARRY: Final = 63

log = structlog.get_logger("fullwell.assets")


@dataclass(frozen=True, slots=True)
class _Object:
    """Something that may go: `of` is the digest that would have to be referred to, of the blob or of the preview's look."""

    key: str
    of: str
    size: int
    is_young: bool

    @property
    def is_preview(self) -> bool:
        """Whether it is a preview, and no blob."""
        return self.key.startswith(PREVIEW_PREFIX)


@dataclass(frozen=True, slots=True)
class _Retired:
    """A version of a retired asset."""

    asset_id: str
    version: int
    digest: str


def collect_garbage(
    store: ObjectStore, database: Database, *, dry_run: bool, min_age_s: float, keep: frozenset[str]
) -> GarbageReport:
    """Remove what nothing refers to; see `AssetLibrary.collect_garbage`.

    Raises
    ------
    FieldError
        `min_age_s` is negative.
    AssetError
        A version's file or manifest cannot be read, so that what it refers to is not known. Nothing was removed.
    """
    if not min_age_s >= 0:
        raise FieldError(f"min_age_s is {min_age_s}; must be >= 0.", path="min_age_s", value=min_age_s)
    absorb(store, database, passing_over=False)
    _refuse_unreadable(database)
    with database.reading() as session:
        now = database.now(session)
    # Listed before references are gathered: what comes later is not judged.
    objects = _listing(store, now - min_age_s)
    pinned = set(keep) | _digests_in_manifests(store) | _digests_in_jobs(database)
    retired = _retired_versions(database, pinned, before=now - min_age_s)
    if not dry_run:
        retired = _mark_collected(store, database, retired)
    with database.reading() as session:
        seen = _digests_of_versions(session) - {file.digest for file in retired}
        live = pinned | _references_of(session, seen)
    live |= _references_of_stored_manifests(store, objects, pinned - seen)
    sweep = _Sweep(store, database, seen=seen, since=now, dry_run=dry_run)
    for item in objects:
        sweep.judge(item, is_live=item.of in live)
    sweep.remove()
    report = sweep.report(versions=len(retired))
    log.info("garbage collected", blobs=report.blobs, previews=report.previews, bytes=report.bytes, dry_run=dry_run)
    return report


class _Sweep:
    """Objects that go, in batches; each looks once more at what was added since the references were gathered."""

    def __init__(self, store: ObjectStore, database: Database, *, seen: set[str], since: float, dry_run: bool) -> None:
        self._store, self._database, self._seen, self._since, self._dry_run = store, database, seen, since, dry_run
        self._waste: list[_Object] = []
        self._kept = self._young = self._previews = self._bytes = 0
        self._blobs: list[str] = []

    def judge(self, item: _Object, *, is_live: bool) -> None:
        """Take an object into account."""
        if not is_live and not item.is_young:
            self._waste.append(item)
        elif not item.is_preview:
            self._kept += is_live
            self._young += not is_live

    def remove(self) -> None:
        """Remove what goes."""
        for batch in pieces(self._waste, BATCH):
            with assets_locked(self._database) as session:
                needed = self._needed_now(session, batch)
                for item in batch:
                    self._remove(item, is_needed=item.of in needed)
        if not self._dry_run:
            with assets_locked(self._database) as session:
                in_use = select(AssetVersionRow.digest)
                session.execute(delete(AssetManifestRow).where(AssetManifestRow.digest.not_in(in_use)))
                session.execute(delete(AssetHoldRow).where(AssetHoldRow.until < self._database.now(session)))

    def _remove(self, item: _Object, *, is_needed: bool) -> None:
        if is_needed:
            self._young += not item.is_preview
            return
        # Within the transaction: who holds a blob later looks for it only after it is gone.
        if not self._dry_run:
            self._store.delete(item.key)
        self._bytes += item.size
        if item.is_preview:
            self._previews += 1
        else:
            self._blobs.append(item.of)

    def _needed_now(self, session: Session, batch: Sequence[_Object]) -> set[str]:
        held = select(AssetHoldRow.digest).where(
            AssetHoldRow.digest.in_([item.of for item in batch]), AssetHoldRow.until >= self._database.now(session)
        )
        new = _digests_of_versions(session) - self._seen
        return set(session.scalars(held)) | _references_of(session, new) | _digests_in_jobs_of(session, since=self._since)

    def report(self, *, versions: int) -> GarbageReport:
        """Return what happened."""
        return GarbageReport(
            dry_run=self._dry_run,
            blobs=len(self._blobs),
            previews=self._previews,
            bytes=self._bytes,
            versions=versions,
            kept=self._kept,
            young=self._young,
            digests=tuple(sorted(self._blobs)),
        )


def _listing(store: ObjectStore, before: float) -> list[_Object]:
    """Return all blobs and previews; young is what was written after `before`, Unix time [s]."""
    found = []
    for prefix, pattern in (("cas/", _BLOB), (f"{PREVIEW_PREFIX}/", _PREVIEW)):
        for info in store.list(prefix):
            if (match := pattern.fullmatch(info.key)) is not None:
                found.append(_Object(info.key, match[1], info.size, info.modified.timestamp() > before))
    return found


def _digests_in_manifests(store: ObjectStore) -> set[str]:
    """Return whatever looks like a digest in the manifests of frames and datasets."""
    found: set[str] = set()
    for prefix, pattern in (("jobs/", _FRAME_MANIFEST), ("datasets/", _DATASET_MANIFEST)):
        for info in store.list(prefix):
            if pattern.fullmatch(info.key):
                with contextlib.suppress(NotFoundError):  # deleted since
                    found |= _digests_in(store.stream(info.key))
    return found


def _digests_in_jobs(database: Database) -> set[str]:
    with database.reading() as session:
        return _digests_in_jobs_of(session, since=0.0)


def _digests_in_jobs_of(session: Session, *, since: float) -> set[str]:
    """Return whatever looks like a digest in jobs and ingestions that were made at or after a time (Unix time [s])."""
    found: set[str] = set()
    job, ingestion = JobRow, IngestionRow
    for query in (
        select(job.recipe_json, job.overrides_json, job.files_json).where(job.created_at >= since),
        select(ingestion.request_json).where(ingestion.created_at >= since),
    ):
        for texts in session.execute(query.execution_options(yield_per=100)):
            for text in texts:
                found |= _digests_in([text.encode()])
    return found


def _digests_of_versions(session: Session) -> set[str]:
    return set(session.scalars(select(AssetVersionRow.digest)))


def _references_of(session: Session, digests: set[str]) -> set[str]:
    """Return manifests, the looks that they show and every blob that they name, by digest."""
    found = set(digests)
    for part in pieces(sorted(digests)):
        documents = select(AssetManifestRow.document_json).where(AssetManifestRow.digest.in_(part))
        for document in session.scalars(documents):
            found |= _digests_in([document.encode()])
        found.update(session.scalars(select(AssetVersionRow.look_digest).where(AssetVersionRow.digest.in_(part))))
    return found


def _references_of_stored_manifests(store: ObjectStore, objects: Iterable[_Object], pinned: set[str]) -> set[str]:
    """Return what pinned manifests refer to that the catalogue does not have, such as one whose database was lost."""
    found: set[str] = set()
    for item in objects:
        if item.of not in pinned or item.is_preview or item.size > MAX_MANIFEST_BYTES:
            continue
        with contextlib.suppress(NotFoundError, ValueError, FieldError, AttributeError):  # then it is another kind of blob
            content = store.get(item.key)
            if content.startswith(b"{"):
                manifest = AssetManifest.from_document(json.loads(content))
                found |= {manifest.look_digest} | _digests_in([content])
    return found


def _digests_in(content: Iterable[bytes]) -> set[str]:
    """Return whatever looks like a digest in a text that comes in pieces."""
    found: set[str] = set()
    carried = b""
    for piece in content:
        text = carried + piece
        found.update(match.decode() for match in _DIGEST.findall(text))
        carried = text[-_CARRY:]
    return found


def _refuse_unreadable(database: Database) -> None:
    """Raise AssetError where a version is known whose manifest is not: nobody knows what it refers to."""
    event, row = AssetEventRow, AssetVersionRow
    missing = (
        select(event.asset_id, event.version)
        .outerjoin(row, and_(row.asset_id == event.asset_id, row.version == event.version))
        .where(event.kind.in_(VERSION_KINDS), row.key.is_(None))
    )
    with database.reading() as session:
        found = session.execute(missing).all()
        standings = {
            asset_id: standing_of(files) for asset_id, files in files_of(session, sorted({name for name, _ in found})).items()
        }
    for asset_id, version in found:
        standing = standings[asset_id]
        if version not in standing.collected and not standing.retired:
            raise AssetError(
                f"asset {asset_id!r} version {version} has no readable manifest, so that what it needs is not known. "
                "Restore the blob and reindex, or retire the asset."
            )


def _retired_versions(database: Database, pinned: set[str], *, before: float) -> list[_Retired]:
    """Return the versions of assets that were retired before a time (Unix time [s]) and that nothing pins."""
    row, event = AssetVersionRow, AssetEventRow
    with database.reading() as session:
        recent = select(event.asset_id).where(event.kind == "retired", event.at > before)
        chosen = select(row.asset_id, row.version, row.digest).where(row.retired.is_(True), row.asset_id.not_in(recent))
        found = [_Retired(*values) for values in session.execute(chosen.order_by(row.asset_id, row.version))]
    return [version for version in found if version.digest not in pinned]


def _mark_collected(store: ObjectStore, database: Database, chosen: Sequence[_Retired]) -> list[_Retired]:
    """Say of retired versions that their content is gone, before it goes; return those that are still retired.

    Who restores an asset holds its versions' digests first, and looks at it after.
    """
    marked: list[_Retired] = []
    for batch in pieces(chosen, BATCH):
        with assets_locked(database) as session:
            now = database.now(session)
            digests = [version.digest for version in batch]
            held = select(AssetHoldRow.digest).where(AssetHoldRow.digest.in_(digests), AssetHoldRow.until >= now)
            row = AssetVersionRow
            retired = select(row.asset_id, row.version).where(row.retired.is_(True), row.digest.in_(digests))
            still = {(asset_id, number) for asset_id, number in session.execute(retired.where(row.digest.not_in(held)))}
            going = [version for version in batch if (version.asset_id, version.version) in still]
            files = _collected_events(session, going, now)
            for file in files:
                store.put(file.key, file.content(), if_absent=True)
            index_files(session, files, {})
            marked += going
    return marked


def _collected_events(session: Session, going: Sequence[_Retired], now: float) -> list[AssetFile]:
    known = files_of(session, sorted({version.asset_id for version in going}))
    events = []
    for version in going:
        micros = next_micros(now, known[version.asset_id][-1].name)
        line = next(file.line for file in known[version.asset_id] if file.is_version and file.version == version.version)
        event = AssetFile.of_event(version.asset_id, version.version, line=line, kind="collected", who=COLLECTOR, micros=micros)
        known[version.asset_id].append(event)
        events.append(event)
    return events
