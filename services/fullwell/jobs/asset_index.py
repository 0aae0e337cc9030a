"""The catalogue's tables as a function of the version and event files: whoever writes them, in whatever order, comes out alike.

Files are written first, rows after. What a crash leaves between the two is found by the next writer of the same asset, by
garbage collection and by reindexing.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final, TypeVar, cast

from sqlalchemy import delete, insert, select, text, update
from sqlalchemy.orm import Session

from fullwell.assets.store import StoredManifest
from fullwell.jobs.asset_files import AssetFile, Standing, standing_of
from fullwell.jobs.asset_records import EventKind
from fullwell.jobs.asset_rows import AssetEventRow, AssetManifestRow, AssetTagRow, AssetVersionRow, AssetWordRow
from fullwell.jobs.asset_search import words_of
from fullwell.jobs.database import Database

__all__ = ["assets_locked", "clear_index", "files_of", "index_files", "pieces"]

_Item = TypeVar("_Item")

ASSETS_LOCK: Final = 0x61737365
"""Key of PostgreSQL's advisory lock: writers of the catalogue take turns, as they do in SQLite anyway."""
PIECE: Final = 500
"""Values in one IN list, rows in one INSERT."""


@contextmanager
def assets_locked(database: Database) -> Iterator[Session]:
    """Yield a write transaction that no other one of the catalogue overlaps."""
    with database.writing() as session:
        if not database.is_sqlite:
            session.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": ASSETS_LOCK})
        yield session


def pieces(items: Sequence[_Item], size: int = PIECE) -> Iterator[Sequence[_Item]]:
    """Yield a sequence in parts of at most `size`."""
    for start in range(0, len(items), size):
        yield items[start : start + size]


def index_files(session: Session, files: Collection[AssetFile], manifests: Mapping[str, StoredManifest]) -> int:
    """Bring the tables to where they know these files, too; return how many were new.

    Parameters
    ----------
    session
        Of `assets_locked`.
    files
        Versions and events of any assets. Known ones are passed over.
    manifests
        {digest: manifest} of the versions among them; one without is known to have been, and no more: its number stays taken.
    """
    by_asset: dict[str, dict[str, AssetFile]] = defaultdict(dict)
    for file in files:
        by_asset[file.id][file.name] = file
    known = files_of(session, list(by_asset))
    new = []
    for asset_id, named in by_asset.items():
        names = {file.name for file in known.get(asset_id, ())}
        new += [file for name, file in named.items() if name not in names]
    _insert_events(session, new)
    _insert_versions(session, [file for file in new if file.is_version and file.digest in manifests], manifests)
    for file in new:
        known.setdefault(file.id, []).append(file)
    _refresh(session, {asset_id: known[asset_id] for asset_id in {file.id for file in new}})
    return len(new)


def clear_index(session: Session) -> None:
    """Empty the catalogue's tables, but for the holds."""
    for row in (AssetWordRow, AssetTagRow, AssetEventRow, AssetVersionRow, AssetManifestRow):
        session.execute(delete(row))


def files_of(session: Session, asset_ids: Sequence[str]) -> dict[str, list[AssetFile]]:
    """Return all files of assets that the tables know, in order of their names. Digests are left out."""
    found: dict[str, list[AssetFile]] = defaultdict(list)
    for part in pieces(asset_ids):
        query = select(AssetEventRow).where(AssetEventRow.asset_id.in_(part))
        for row in session.scalars(query.order_by(AssetEventRow.asset_id, AssetEventRow.name)):
            micros, _, mark = row.name.partition("-")
            kind = cast(EventKind, row.kind)
            found[row.asset_id].append(
                AssetFile(row.asset_id, row.version, row.line, kind, row.who, int(micros), mark, row.detail)
            )
    return found


def _insert_events(session: Session, files: Sequence[AssetFile]) -> None:
    rows = [
        {
            "asset_id": file.id,
            "name": file.name,
            "kind": file.kind,
            "version": file.version,
            "line": file.line,
            "who": file.who,
            "at": file.when,
            "detail": file.detail,
        }
        for file in files
    ]
    if rows:
        session.execute(insert(AssetEventRow), rows)


def _insert_versions(session: Session, files: Sequence[AssetFile], manifests: Mapping[str, StoredManifest]) -> None:
    if not files:
        return
    digests = sorted({file.digest for file in files})
    stored: set[str] = set()
    for part in pieces(digests):
        stored.update(session.scalars(select(AssetManifestRow.digest).where(AssetManifestRow.digest.in_(part))))
    documents = [
        {"digest": digest, "document_json": manifests[digest].content.decode()} for digest in digests if digest not in stored
    ]
    if documents:
        session.execute(insert(AssetManifestRow), documents)
    keys = session.scalars(
        insert(AssetVersionRow).returning(AssetVersionRow.key, sort_by_parameter_order=True),
        [_version_values(file, manifests[file.digest]) for file in files],
    ).all()
    tags = [
        {"tag": tag, "version_key": key}
        for key, file in zip(keys, files, strict=True)
        for tag in manifests[file.digest].manifest.tags
    ]
    words = [
        {"word": word, "version_key": key}
        for key, file in zip(keys, files, strict=True)
        for word in sorted(words_of(manifests[file.digest].manifest))
    ]
    for table, rows in ((AssetTagRow, tags), (AssetWordRow, words)):
        if rows:
            session.execute(insert(table), rows)


def _version_values(file: AssetFile, stored: StoredManifest) -> dict[str, Any]:
    manifest = stored.manifest
    length_m, width_m, height_m = manifest.size_m
    return {
        "asset_id": file.id,
        "version": file.version,
        "digest": file.digest,
        "look_digest": stored.look_digest,
        "kind": file.kind,
        "line": file.line,
        "shown": False,
        "retired": False,
        "state": "pending",
        "asset_class": manifest.asset_class,
        "title_folded": manifest.title.casefold()[:400],
        "licence": manifest.licence.spdx,
        "licence_folded": manifest.licence.spdx.casefold(),
        "tags": " ".join(manifest.tags),
        "length_m": length_m,
        "width_m": width_m,
        "height_m": height_m,
        "extent_m": max(manifest.size_m),
        "triangles": manifest.levels[0].triangles,
        "created_at": file.when,
        "created_by": file.who,
        "reviewed_at": None,
        "reviewed_by": "",
        "reason": "",
    }


def _refresh(session: Session, files: Mapping[str, Sequence[AssetFile]]) -> None:
    """Set what the rows of versions derive from all files of their assets."""
    changed: list[dict[str, Any]] = []
    for part in pieces(sorted(files)):
        standings = {asset_id: standing_of(sorted(files[asset_id], key=lambda file: file.name)) for asset_id in part}
        rows = list(session.scalars(select(AssetVersionRow).where(AssetVersionRow.asset_id.in_(part))))
        gone = [row.key for row in rows if row.version in standings[row.asset_id].collected]
        for keys in pieces(gone):
            session.execute(delete(AssetVersionRow).where(AssetVersionRow.key.in_(keys)))
        kept = [row for row in rows if row.version not in standings[row.asset_id].collected]
        newest: dict[str, int] = {}
        for row in kept:
            newest[row.asset_id] = max(row.version, newest.get(row.asset_id, 0))
        for row in kept:
            changed += _changed_values(row, standings[row.asset_id], is_newest=row.version == newest[row.asset_id])
    if changed:
        session.execute(update(AssetVersionRow), changed)
        session.expire_all()


def _changed_values(row: AssetVersionRow, standing: Standing, *, is_newest: bool) -> list[dict[str, Any]]:
    decision = standing.decisions.get(row.line)
    values = {
        "shown": is_newest and not standing.retired,
        "retired": standing.retired,
        "state": standing.state(row.line),
        "reviewed_at": None if decision is None else decision.when,
        "reviewed_by": "" if decision is None else decision.who,
        "reason": "" if decision is None else decision.detail,
    }
    return [{"key": row.key, **values}] if any(getattr(row, name) != value for name, value in values.items()) else []
