"""The asset library: what the API, the command line and the curation page do with assets, each in one call.

The object store is the truth (`asset_files`), the database an index of it (`asset_index`). A change writes blobs first, then
the version's or event's file, then rows.
"""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar

from sqlalchemy import delete, func, insert, select
from sqlalchemy.orm import Session

from fullwell.assets.archive import ArchivedAsset, ExportReport, open_archive, write_archive
from fullwell.assets.query import REVIEW_STATES, AssetQuery, ReviewState
from fullwell.assets.records import LicenceRecord, PreparedAsset
from fullwell.assets.store import StoredManifest, blob_key, check_digest, preview_key, preview_names, put_preview
from fullwell.core import AssetError, ConflictError, FieldError, NotFoundError, sha256_hex
from fullwell.jobs.asset_catalogue import AssetCatalogue
from fullwell.jobs.asset_changes import AssetChanges, check_text, storable
from fullwell.jobs.asset_files import AssetFile, next_micros
from fullwell.jobs.asset_garbage import collect_garbage
from fullwell.jobs.asset_index import assets_locked, clear_index, files_of, index_files, pieces
from fullwell.jobs.asset_reading import absorb, manifests_of, read_file, stored_files
from fullwell.jobs.asset_records import AssetEntry, AssetEvent, AssetOrder, AssetPage, EventKind, GarbageReport
from fullwell.jobs.asset_rows import AssetHoldRow, AssetVersionRow
from fullwell.jobs.database import Database
from fullwell.storage import ObjectStore

__all__ = [
    "AssetEntry",
    "AssetEvent",
    "AssetLibrary",
    "AssetOrder",
    "AssetPage",
    "EventKind",
    "ExportReport",
    "GarbageReport",
]

HOLD_S: Final = 3600.0
"""How long garbage collection leaves blobs that an addition is about to refer to."""
MAX_REASON: Final = 2000
_ATTEMPTS: Final = 50
_STORE_THREADS: Final = 8

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


@dataclass(frozen=True, slots=True)
class _Past:
    """What a new version of an asset, or an event about it, follows."""

    latest: AssetEntry | None
    line: int
    imported_digest: str
    last_version: int
    last_name: str


class AssetLibrary(AssetCatalogue):
    """Assets, their versions, decisions about them, and the blobs behind them. Safe to use from several threads.

    Parameters
    ----------
    store
        Where everything is.
    database
        The index to search by; its schema must be up to date.
    """

    def __init__(self, store: ObjectStore, database: Database) -> None:
        super().__init__(database)
        self.store = store

    # -- additions ----------------------------------------------------------------------------------------------------

    def add(self, prepared: PreparedAsset, *, who: str) -> AssetEntry:
        """Store an asset, or the next version of it, and return its entry; new content is pending.

        What was imported last and has only been edited since is not imported again: the latest entry comes back. A retired
        asset returns to the catalogue. Blobs that the manifest does not name are left out.

        Raises
        ------
        AssetError
            A blob is not what its SHA-256 says, or the manifest names one that is neither given nor in the store.
        FieldError
            The manifest has an illegal field; see `storable`.
        """
        return self._add(prepared, who=check_text(who, path="who"))[0]

    def _add(self, prepared: PreparedAsset, *, who: str) -> tuple[AssetEntry, bool]:
        """Return the entry, and whether it is a new version."""
        stored = storable(prepared.manifest)
        manifest, digest = stored.manifest, stored.digest
        self._put_blobs([stored], prepared.blobs)
        for _ in range(_ATTEMPTS):
            past = self._pasts([manifest.id])[manifest.id]
            if past.latest is not None and past.imported_digest == digest:
                return (self.restore(manifest.id, who=who) if past.latest.retired else past.latest), False
            number = past.last_version + 1
            micros = next_micros(self._now(), past.last_name)
            file = AssetFile.of_version(manifest.id, number, line=number, digest=digest, who=who, micros=micros)
            if self._put_version(file):
                self._index([file], {digest: stored})
                return self.get(manifest.id, number), True
        raise _busy([manifest.id])

    def _put_blobs(self, manifests: Sequence[StoredManifest], given: Mapping[str, bytes]) -> None:
        """Store the manifests and the blobs that they name; nothing where a blob is wrong, or neither given nor there."""
        for digest, content in given.items():
            if (found := sha256_hex(content)) != digest:
                raise AssetError(
                    f"a blob of asset {manifests[0].manifest.id!r} is named {digest[:80]} but has SHA-256 {found}."
                )
        contents = {**given, **{stored.digest: stored.content for stored in manifests}}
        needed = {
            digest: stored.manifest.id for stored in manifests for digest in (*sorted(stored.manifest.blobs()), stored.digest)
        }
        # Held before they are looked for: what is there now stays there until a version refers to it.
        self.hold(needed)
        stored_bytes = dict(zip(needed, _in_parallel(self._stored_bytes, list(needed)), strict=True))
        for digest, asset_id in needed.items():
            if digest not in contents and stored_bytes[digest] is None:
                raise AssetError(
                    f"asset {asset_id!r} names the blob {digest}, which is neither given nor in the store. Upload it first."
                )
        # An object of another size was damaged in the store; this mends it.
        new = [digest for digest in needed if digest in contents and stored_bytes[digest] != len(contents[digest])]
        _in_parallel(lambda digest: self.store.put(blob_key(digest), contents[digest]), new)

    def _stored_bytes(self, digest: str) -> int | None:
        try:
            return self.store.stat(blob_key(digest)).size
        except NotFoundError:
            return None

    def hold(self, digests: Iterable[str], *, for_s: float = HOLD_S) -> None:
        """Keep garbage collection off blobs for a while, whether they are there or not yet.

        Whoever tells a client that a blob need not be sent again, or is about to store something that refers to blobs, holds
        them first and looks for them after.
        """
        wanted = sorted({check_digest(digest) for digest in digests})
        with assets_locked(self._database) as session:
            until = self._database.now(session) + for_s
            for part in pieces(wanted):
                longer = select(AssetHoldRow.digest).where(AssetHoldRow.digest.in_(part), AssetHoldRow.until >= until)
                new = sorted(set(part) - set(session.scalars(longer)))
                session.execute(delete(AssetHoldRow).where(AssetHoldRow.digest.in_(new)))
                if new:
                    session.execute(insert(AssetHoldRow), [{"digest": digest, "until": until} for digest in new])

    # -- changes ------------------------------------------------------------------------------------------------------

    def review(
        self,
        ids: Iterable[str],
        decision: ReviewState,
        *,
        who: str,
        reason: str = "",
        expected_version: int | None = None,
    ) -> tuple[AssetEntry, ...]:
        """Decide about the latest versions of assets and return their entries; all of them or, where one is refused, none.

        A decision is about the content: it holds for the version that was imported and all edits made from it. Deciding the
        same again, for the same reason, changes nothing.

        Raises
        ------
        FieldError
            A rejection without a reason; an approval without one where a check of the asset asks for a decision.
        ConflictError
            `expected_version`, for one asset, is not its latest version.
        NotFoundError
            An id is not known.
        """
        who, reason = check_text(who, path="who"), check_text(reason, path="reason", most=MAX_REASON)
        if decision not in REVIEW_STATES:
            raise FieldError(
                f"decision is {decision!r}; must be one of {', '.join(REVIEW_STATES)}.", path="decision", value=decision
            )
        pasts = self._existing(ids, expected_version)
        for latest, _ in pasts.values():
            _check_reason(latest, decision, reason)
        open_ones = {
            asset_id: (latest, past)
            for asset_id, (latest, past) in pasts.items()
            if (latest.state, latest.reason) != (decision, reason)
        }
        self._write_events(self._events_of(open_ones, decision, who=who, detail=reason))
        return self._entries(list(pasts))

    def edit(
        self,
        ids: Iterable[str],
        *,
        who: str,
        asset_class: str | None = None,
        add_tags: Iterable[str] = (),
        remove_tags: Iterable[str] = (),
        title: str | None = None,
        licence: LicenceRecord | None = None,
        part_materials: Mapping[str, str] | None = None,
        expected_version: int | None = None,
    ) -> tuple[AssetEntry, ...]:
        """Make new versions with some fields changed, in the state of what they are made from; return the latest entries.

        Where nothing changes no version is made. All changes are checked before the first is made.

        Raises
        ------
        FieldError
            A class, tag, part or material is not known, or the asset gets too many tags.
        ConflictError
            `expected_version`, for one asset, is not its latest version.
        NotFoundError
            An id is not known.
        """
        who = check_text(who, path="who")
        changes = AssetChanges(asset_class, tuple(add_tags), tuple(remove_tags), title, licence, dict(part_materials or {}))
        wanted = waiting = list(dict.fromkeys(ids))
        for _ in range(_ATTEMPTS):
            waiting = self._edit_once(waiting, changes, who=who, expected_version=expected_version)
            if not waiting:
                return self._entries(wanted)
        raise _busy(waiting)

    def _edit_once(self, ids: Sequence[str], changes: AssetChanges, *, who: str, expected_version: int | None) -> list[str]:
        """Edit assets; return those of which another writer has made a version at the same moment."""
        pasts = self._existing(ids, expected_version)
        manifests: dict[str, StoredManifest] = {}
        files: list[AssetFile] = []
        now = self._now()
        for asset_id, (latest, past) in pasts.items():
            changed, detail = changes.apply(latest.manifest)
            if not detail:
                continue
            stored = storable(changed)
            manifests[stored.digest] = stored
            micros = next_micros(now, past.last_name)
            file = AssetFile.of_version(
                asset_id, past.last_version + 1, line=past.line, digest=stored.digest, who=who, micros=micros, detail=detail
            )
            files.append(file)
        self._put_blobs(list(manifests.values()), {})
        written: list[AssetFile] = []

        def write(file: AssetFile) -> None:
            if self._put_version(file):
                written.append(file)

        try:
            _in_parallel(write, files)
        finally:  # where the store fails in the middle, the rows follow what it has taken
            self._index(written, manifests)
        return [file.id for file in files if file not in written]

    def retire(self, asset_id: str, *, who: str, reason: str = "") -> AssetEntry:
        """Take an asset out of the catalogue: no search and no draw finds it; `get`, `versions` and pins do.

        Garbage collection later removes those of its versions that no frame, dataset or job pins.
        """
        return self._happen(asset_id, "retired", who=who, reason=reason, already=True)

    def restore(self, asset_id: str, *, who: str, reason: str = "") -> AssetEntry:
        """Put a retired asset back into the catalogue."""
        return self._happen(asset_id, "restored", who=who, reason=reason, already=False)

    def _happen(self, asset_id: str, kind: EventKind, *, who: str, reason: str, already: bool) -> AssetEntry:
        who, reason = check_text(who, path="who"), check_text(reason, path="reason", most=MAX_REASON)
        # Held before it is looked at: garbage collection leaves retired versions that someone holds.
        self.hold(entry.digest for entry in self.versions(asset_id))
        pasts = self._existing([asset_id], None)
        if pasts[asset_id][0].retired is not already:
            self._write_events(self._events_of(pasts, kind, who=who, detail=reason))
        return self.get(asset_id)

    # -- files and rows -----------------------------------------------------------------------------------------------

    def _existing(self, ids: Iterable[str], expected_version: int | None) -> dict[str, tuple[AssetEntry, _Past]]:
        """Return the latest entry and the past of assets, by id; errors as `review` raises them."""
        wanted = list(dict.fromkeys(ids))
        if expected_version is not None and len(wanted) != 1:
            raise FieldError(
                f"expected_version is {expected_version} for {len(wanted)} assets; give it for one.",
                path="expected_version",
                value=expected_version,
            )
        found: dict[str, tuple[AssetEntry, _Past]] = {}
        for asset_id, past in self._pasts(wanted).items():
            latest = past.latest or self.get(asset_id)
            if expected_version is not None and latest.version != expected_version:
                raise ConflictError(
                    f"asset {asset_id!r} is at version {latest.version}, not {expected_version}: "
                    f"{latest.created_by or 'someone'} has changed it. Look at it again."
                )
            found[asset_id] = (latest, past)
        return found

    def _pasts(self, asset_ids: Sequence[str]) -> dict[str, _Past]:
        with self._database.reading() as session:
            latest = self._latest(session, asset_ids)
            files = files_of(session, asset_ids)
            lines = self._lines(session, latest)
        pasts = {}
        for asset_id in asset_ids:
            known = files.get(asset_id, [])
            line, imported = lines.get(asset_id, (0, ""))
            last_version = max((file.version for file in known), default=0)
            last_name = known[-1].name if known else ""
            pasts[asset_id] = _Past(latest.get(asset_id), line, imported, last_version, last_name)
        return pasts

    def _lines(self, session: Session, latest: Mapping[str, AssetEntry]) -> dict[str, tuple[int, str]]:
        """Return {asset: (line of its latest version, digest of what was imported there or, where that is gone, "")}."""
        row = AssetVersionRow
        found: dict[str, dict[int, tuple[int, str]]] = defaultdict(dict)
        for part in pieces(list(latest)):
            query = select(row.asset_id, row.version, row.line, row.digest).where(row.asset_id.in_(part))
            for asset_id, version, line, digest in session.execute(query):
                found[asset_id][version] = (line, digest)
        lines = {}
        for asset_id, entry in latest.items():
            line = found[asset_id][entry.version][0]
            lines[asset_id] = (line, found[asset_id].get(line, (line, ""))[1])
        return lines

    def _now(self) -> float:
        with self._database.reading() as session:
            return self._database.now(session)

    def _events_of(
        self, pasts: Mapping[str, tuple[AssetEntry, _Past]], kind: EventKind, *, who: str, detail: str
    ) -> list[AssetFile]:
        now = self._now()
        return [
            AssetFile.of_event(
                asset_id,
                latest.version,
                line=past.line,
                kind=kind,
                who=who,
                micros=next_micros(now, past.last_name),
                detail=detail,
            )
            for asset_id, (latest, past) in pasts.items()
        ]

    def _write_events(self, files: Sequence[AssetFile]) -> None:
        written: list[AssetFile] = []

        def write(file: AssetFile) -> None:
            self.store.put(file.key, file.content(), if_absent=True)
            written.append(file)

        try:
            _in_parallel(write, files)
        finally:  # where the store fails in the middle, the rows follow what it has taken
            self._index(written, {})

    def _put_version(self, file: AssetFile) -> bool:
        """Write a version's file: the commit. False where that version is there already; then the tables know it now."""
        try:
            self.store.put(file.key, file.content(), if_absent=True)
        except ConflictError:
            found = read_file(self.store, file.key)
            self._index([found], manifests_of(self.store, [found], passing_over=True))
            return False
        return True

    def _index(self, files: Sequence[AssetFile], manifests: Mapping[str, StoredManifest]) -> None:
        if files:
            with assets_locked(self._database) as session:
                index_files(session, files, manifests)

    def reindex(self) -> int:
        """Make the catalogue anew from the object store; return the number of versions in it.

        Damaged files are passed over and logged. Assets may be changed meanwhile.
        """
        files = list(stored_files(self.store, passing_over=True))
        manifests = manifests_of(self.store, files, passing_over=True)
        with assets_locked(self._database) as session:
            clear_index(session)
            index_files(session, files, manifests)
        # Files that were written after the listing and indexed before the tables were emptied:
        absorb(self.store, self._database, passing_over=True)
        with self._database.reading() as session:
            return session.scalar(select(func.count()).select_from(AssetVersionRow)) or 0

    # -- previews -----------------------------------------------------------------------------------------------------

    def preview_key(self, look_digest: str, name: str) -> str:
        """Return the object key of a picture of a look."""
        return preview_key(look_digest, name)

    def preview_names(self, look_digest: str) -> tuple[str, ...]:
        """Return the names of the pictures that a look has, sorted."""
        return preview_names(self.store, look_digest)

    # -- garbage and archives -----------------------------------------------------------------------------------------

    def collect_garbage(self, *, dry_run: bool, min_age_s: float, keep: Iterable[str] = ()) -> GarbageReport:
        """Remove blobs and previews that nothing refers to and that are older than `min_age_s`; see docs/assets-store.md.

        Parameters
        ----------
        dry_run
            Only report.
        min_age_s
            Objects younger than this stay [s]: they may belong to an upload under way.
        keep
            SHA-256 of manifests and blobs that stay, too.
        """
        return collect_garbage(self.store, self._database, dry_run=dry_run, min_age_s=min_age_s, keep=frozenset(keep))

    def export(self, chosen: AssetQuery | Iterable[str], target: Path) -> ExportReport:
        """Write the latest versions that match, or those of the named assets, into one archive.

        It holds manifests, blobs, previews and LICENCES.md; the same assets give the same bytes. Raises FieldError where
        nothing is chosen.
        """
        entries = self._chosen(chosen)
        if not entries:
            raise FieldError("no asset is chosen; the archive would be empty. Widen the search.", path="query")
        archived = [
            ArchivedAsset(entry.manifest, entry.digest, entry.state, entry.reviewed_by, entry.reason) for entry in entries
        ]
        return write_archive(target, archived, self.store)

    def _chosen(self, chosen: AssetQuery | Iterable[str]) -> tuple[AssetEntry, ...]:
        if not isinstance(chosen, AssetQuery):
            ids = sorted(set(chosen))
            self._existing(ids, None)
            return self._entries(ids)
        entries: list[AssetEntry] = []
        cursor = ""
        while True:
            page = self.search(chosen, cursor=cursor, limit=500)
            entries += page.entries
            if not (cursor := page.next_cursor):
                return tuple(entries)

    def import_archive(self, path: Path, *, who: str, trust_states: bool = False) -> tuple[AssetEntry, ...]:
        """Add all assets of an archive and return their entries, in the archive's order.

        The whole archive is verified before anything is stored. New versions are pending; with `trust_states` they get the
        states that they had where the archive was made.

        Raises
        ------
        AssetError
            It is no archive of assets, is damaged, or exceeds a limit.
        """
        who = check_text(who, path="who")
        ids = []
        with open_archive(path) as archive:
            for archived in archive.assets:
                entry, is_new = self._add(archive.prepared(archived), who=who)
                ids.append(entry.id)
                with contextlib.suppress(ConflictError):
                    for name, png in archive.previews(archived):
                        put_preview(self.store, archived.manifest.look_digest, name, png, if_absent=True)
                if trust_states and is_new and archived.state != "pending":
                    self._trust(entry, archived, who=who)
        return self._entries(ids)

    def _trust(self, entry: AssetEntry, archived: ArchivedAsset, *, who: str) -> None:
        by = f" by {archived.reviewed_by}" if archived.reviewed_by else ""
        reason = f"{archived.state}{by} where the archive was made{': ' if archived.reason else ''}{archived.reason}"
        self.review([entry.id], archived.state, who=who, reason=reason[:MAX_REASON])


def _check_reason(latest: AssetEntry, decision: ReviewState, reason: str) -> None:
    if reason or decision == "pending":
        return
    if decision == "rejected":
        raise FieldError("reason is empty; a rejection needs one.", path="reason", value="")
    if latest.manifest.needs_decision:
        names = [check.name for check in latest.manifest.checks if check.state in ("decide", "failed")]
        raise FieldError(
            f"reason is empty; asset {latest.id!r} has open checks ({', '.join(names[:5])}). "
            "Say why it is approved all the same.",
            path="reason",
            value="",
        )


def _in_parallel(function: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    """Return the results in order; all calls have ended when the first error is raised. For waiting on the object store."""
    if len(items) < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(min(_STORE_THREADS, len(items)), "fullwell-assets") as threads:
        futures = [threads.submit(function, item) for item in items]
    return [future.result() for future in futures]


def _busy(ids: Sequence[str]) -> ConflictError:
    return ConflictError(f"{', '.join(ids[:5])}: others change these assets all the time; try again.")
