"""Reading the asset catalogue: entries, searches, facets, what draws may choose from, and what happened to an asset."""

from __future__ import annotations

import json
import threading
from collections import Counter, OrderedDict
from collections.abc import Sequence
from typing import Any, Final, cast

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session, aliased

from fullwell.assets.query import AssetQuery, ReviewState
from fullwell.assets.records import AssetManifest
from fullwell.core import FieldError, NotFoundError, unknown_name_message
from fullwell.jobs.asset_index import files_of, pieces
from fullwell.jobs.asset_records import AssetEntry, AssetEvent, AssetOrder, AssetPage
from fullwell.jobs.asset_rows import AssetEventRow, AssetManifestRow, AssetVersionRow
from fullwell.jobs.asset_search import after_cursor, conditions, cursor_at, order_by
from fullwell.jobs.database import Database

__all__ = ["AssetCatalogue"]

MAX_PAGE: Final = 500
_REMEMBERED_MANIFESTS: Final = 2048
_NEAR_NAMES: Final = 500

_Found = tuple[AssetVersionRow, str]
"""A version and its manifest's document."""


class AssetCatalogue:
    """The part of the library that reads; all of it from the database."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._manifests: OrderedDict[str, AssetManifest] = OrderedDict()
        self._guard = threading.Lock()

    # -- single assets ------------------------------------------------------------------------------------------------

    def get(self, asset_id: str, version: int | None = None) -> AssetEntry:
        """Return a version of an asset, without `version` the latest; NotFoundError with the nearest names or versions."""
        query = _entries_query().where(AssetVersionRow.asset_id == asset_id)
        if version is not None:
            query = query.where(AssetVersionRow.version == version)
        with self._database.reading() as session:
            found = _found(session, query.order_by(AssetVersionRow.version.desc()).limit(1))
            if not found:
                raise self._not_found(session, asset_id, version)
            return self._entry(found[0])

    def by_digest(self, digest: str) -> AssetEntry:
        """Return the newest version with that manifest; NotFoundError when there is none."""
        query = _entries_query().where(AssetVersionRow.digest == digest).order_by(AssetVersionRow.version.desc()).limit(1)
        with self._database.reading() as session:
            found = _found(session, query)
        if not found:
            raise NotFoundError(
                f"no asset has the digest {digest[:80]!r}. It was never imported here, or was removed: import its archive."
            )
        return self._entry(found[0])

    def versions(self, asset_id: str) -> tuple[AssetEntry, ...]:
        """Return all versions of an asset, newest first; NotFoundError when there is none of that id."""
        query = _entries_query().where(AssetVersionRow.asset_id == asset_id).order_by(AssetVersionRow.version.desc())
        with self._database.reading() as session:
            found = _found(session, query)
            if not found:
                raise self._not_found(session, asset_id, None)
            return tuple(self._entry(row) for row in found)

    def events(self, asset_id: str) -> tuple[AssetEvent, ...]:
        """Return what happened to an asset, newest first; of one whose content was removed, too."""
        with self._database.reading() as session:
            files = files_of(session, [asset_id]).get(asset_id)
            if not files:
                raise self._not_found(session, asset_id, None)
        return tuple(AssetEvent(file.kind, file.version, file.who, file.when, file.detail) for file in reversed(files))

    # -- many assets --------------------------------------------------------------------------------------------------

    def search(self, query: AssetQuery, *, cursor: str = "", limit: int = 50, order: AssetOrder = "id") -> AssetPage:
        """Return one page of the assets whose latest version matches; retired ones are not among them.

        Parameters
        ----------
        query
            See `AssetQuery.matches`.
        cursor
            `next_cursor` of the page before, of the same query and order.
        limit
            Entries on the page, 1 to 500.
        order
            See `AssetOrder`.
        """
        if not 1 <= limit <= MAX_PAGE:
            raise FieldError(f"limit is {limit}; must be 1 to {MAX_PAGE}.", path="limit", value=limit)
        matching = [AssetVersionRow.shown.is_(True), *conditions(query)]
        ordering = order_by(order)
        page = select(AssetVersionRow.key).where(*matching).order_by(*ordering).limit(limit + 1)
        if cursor:
            page = page.where(after_cursor(order, cursor))
        with self._database.reading() as session:
            total = session.scalar(select(func.count()).select_from(AssetVersionRow).where(*matching)) or 0
            # Keys first: sorting whole rows with their documents would take longer than all the rest.
            keys = session.scalars(page).all()
            rows = {found[0].key: found for found in _found(session, _entries_query().where(AssetVersionRow.key.in_(keys)))}
        shown = [rows[key] for key in keys[:limit] if key in rows]
        further = cursor_at(order, shown[-1][0]) if len(keys) > limit and shown else ""
        return AssetPage(tuple(self._entry(row) for row in shown), further, total)

    def facets(self, query: AssetQuery) -> dict[str, dict[str, int]]:
        """Return {"class", "state", "licence", "tag": {value: number of assets}}, largest number first.

        The first three leave their own condition out: they say what another choice there would show. Tags are counted among
        what matches.
        """
        row = AssetVersionRow
        groups = (row.asset_class, row.state, row.licence)
        rest = conditions(query, without=("asset_class", "states", "licences"))
        counted = (
            select(*groups, func.count(), func.aggregate_strings(row.tags, " "))
            .where(row.shown.is_(True), *rest)
            .group_by(*groups)
        )
        counts: dict[str, Counter[str]] = {name: Counter() for name in ("class", "state", "licence", "tag")}
        spellings: dict[str, str] = {}
        wanted = {name.casefold() for name in query.licences}
        with self._database.reading() as session:
            found = session.execute(counted.order_by(row.licence)).all()
        for asset_class, state, licence, number, tags in found:
            spelling = spellings.setdefault(licence.casefold(), licence)
            in_class = query.asset_class in ("", asset_class)
            in_state = not query.states or state in query.states
            in_licence = not wanted or licence.casefold() in wanted
            if in_state and in_licence:
                counts["class"][asset_class] += number
            if in_class and in_licence:
                counts["state"][state] += number
            if in_class and in_state:
                counts["licence"][spelling] += number
            if in_class and in_state and in_licence:
                counts["tag"].update(tags.split())
        return {name: _largest_first(counter) for name, counter in counts.items()}

    def candidates(self, query: AssetQuery) -> tuple[tuple[str, str], ...]:
        """Return (id, manifest digest) of what a draw may choose from, sorted by id.

        Of each asset the newest version in one of the query's states counts, and must match: while version 3 waits for its
        review, version 2 is drawn, and a car that a curator made a van is no car any more. Retired assets are not drawn.
        """
        row, later = AssetVersionRow, aliased(AssetVersionRow)
        newer = select(later.key).where(later.asset_id == row.asset_id, later.version > row.version)
        if query.states:
            newer = newer.where(later.state.in_(query.states))
        chosen = select(row.asset_id, row.digest).where(row.retired.is_(False), *conditions(query), ~newer.exists())
        with self._database.reading() as session:
            return tuple(sorted((asset_id, digest) for asset_id, digest in session.execute(chosen)))

    # -- parts --------------------------------------------------------------------------------------------------------

    def _entries(self, asset_ids: Sequence[str]) -> tuple[AssetEntry, ...]:
        """Return the latest entries of assets that exist, in the given order."""
        with self._database.reading() as session:
            latest = self._latest(session, asset_ids)
            for asset_id in asset_ids:
                if asset_id not in latest:
                    raise self._not_found(session, asset_id, None)
        return tuple(latest[asset_id] for asset_id in asset_ids)

    def _latest(self, session: Session, asset_ids: Sequence[str]) -> dict[str, AssetEntry]:
        latest: dict[str, AssetEntry] = {}
        for part in pieces(asset_ids):
            query = _entries_query().where(AssetVersionRow.asset_id.in_(part)).order_by(AssetVersionRow.version)
            newest = {found[0].asset_id: found for found in _found(session, query)}
            latest.update((asset_id, self._entry(found)) for asset_id, found in newest.items())
        return latest

    def _entry(self, found: _Found) -> AssetEntry:
        row, document = found
        return AssetEntry(
            id=row.asset_id,
            version=row.version,
            digest=row.digest,
            manifest=self._manifest(row.digest, document),
            state=cast(ReviewState, row.state),
            created_at=row.created_at,
            created_by=row.created_by,
            reviewed_at=row.reviewed_at,
            reviewed_by=row.reviewed_by,
            reason=row.reason,
            retired=row.retired,
        )

    def _manifest(self, digest: str, document: str) -> AssetManifest:
        """Return the manifest of a document; those used last are remembered, as reading one takes longer than finding it."""
        with self._guard:
            if (known := self._manifests.get(digest)) is not None:
                self._manifests.move_to_end(digest)
                return known
        manifest = AssetManifest.from_document(json.loads(document))
        with self._guard:
            self._manifests[digest] = manifest
            while len(self._manifests) > _REMEMBERED_MANIFESTS:
                self._manifests.popitem(last=False)
        return manifest

    def _not_found(self, session: Session, asset_id: str, version: int | None) -> NotFoundError:
        shown = asset_id[:80]
        known = session.scalars(
            select(AssetVersionRow.version).where(AssetVersionRow.asset_id == asset_id).order_by(AssetVersionRow.version)
        ).all()
        if known:
            return NotFoundError(f"asset {shown!r} has no version {version}; it has {', '.join(str(n) for n in known)}.")
        if session.scalar(select(AssetEventRow.name).where(AssetEventRow.asset_id == asset_id).limit(1)) is not None:
            return NotFoundError(f"asset {shown!r} was retired and its content removed. Import it again.")
        near = _near_ids(session, asset_id)
        if not near:
            return NotFoundError("the asset store is empty. Import assets first: fullwell assets import.")
        return NotFoundError(unknown_name_message("asset", shown, near))


def _entries_query() -> Select[Any]:
    columns: tuple[Any, ...] = (AssetVersionRow, AssetManifestRow.document_json)
    return select(*columns).join(AssetManifestRow, AssetManifestRow.digest == AssetVersionRow.digest)


def _found(session: Session, query: Select[Any]) -> list[_Found]:
    return [(row, document) for row, document in session.execute(query)]


def _near_ids(session: Session, asset_id: str) -> list[str]:
    """Return up to some hundred ids around this one and with the same beginnings: comparing with all would take seconds."""
    ids: list[str] = []
    for length in (4, 2, 1, 0):
        query = select(AssetVersionRow.asset_id).where(AssetVersionRow.shown.is_(True)).order_by(AssetVersionRow.asset_id)
        begins = AssetVersionRow.asset_id.startswith(asset_id[:length], autoescape=True)
        ids += session.scalars(query.where(begins).limit(_NEAR_NAMES))
    return list(dict.fromkeys(ids))


def _largest_first(counts: Counter[str]) -> dict[str, int]:
    return dict(sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])))
