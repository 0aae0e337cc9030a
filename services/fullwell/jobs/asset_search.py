"""Searches as SQL: one statement for both databases, in agreement with AssetQuery.matches, and cursors for paging."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Collection, Iterator
from typing import Any, Final

from sqlalchemy import ColumnElement, and_, or_, select
from sqlalchemy.orm import InstrumentedAttribute

from fullwell.assets.query import AssetQuery
from fullwell.assets.records import AssetManifest
from fullwell.core import FieldError
from fullwell.jobs.asset_rows import MAX_WORD_CHARACTERS, AssetTagRow, AssetVersionRow, AssetWordRow

__all__ = ["ORDERS", "after_cursor", "conditions", "cursor_at", "order_by", "words_of"]

MAX_IDS: Final = 10_000
_LAST_CHARACTER: Final = "\U0010ffff"
"""No word holds it, so it bounds the range of all words with one beginning."""

ORDERS: Final[dict[str, tuple[InstrumentedAttribute[Any], bool] | None]] = {
    "id": None,
    "newest": (AssetVersionRow.created_at, True),
    "title": (AssetVersionRow.title_folded, False),
    "class": (AssetVersionRow.asset_class, False),
    "size": (AssetVersionRow.extent_m, True),
    "triangles": (AssetVersionRow.triangles, True),
}
"""{order: (column, whether from large to small)}; ties, and "id", go by id."""


def words_of(manifest: AssetManifest) -> set[str]:
    """Return the words that a text search finds a manifest by, as AssetQuery.matches takes them."""
    texts = (manifest.id, manifest.title, manifest.asset_class, *manifest.tags)
    return set(_words(" ".join((*texts, manifest.licence.spdx, manifest.licence.attribution))))


def _words(text: str) -> list[str]:
    spaced = "".join(character if character.isalnum() else " " for character in text.casefold())
    return [word[:MAX_WORD_CHARACTERS] for word in spaced.split()]


def conditions(query: AssetQuery, *, without: Collection[str] = ()) -> list[ColumnElement[bool]]:
    """Return the conditions on AssetVersionRow under which the version matches; those of the fields `without` are left out."""
    if len(query.ids) > MAX_IDS:
        raise FieldError(f"ids has {len(query.ids)} entries; at most {MAX_IDS} are allowed.", "ids", len(query.ids))
    return [condition for field, condition in _conditions(query) if field not in without]


def _conditions(query: AssetQuery) -> Iterator[tuple[str, ColumnElement[bool]]]:
    row = AssetVersionRow
    if query.asset_class:
        yield "asset_class", row.asset_class == query.asset_class
    if query.states:
        yield "states", row.state.in_(query.states)
    if query.licences:
        yield "licences", row.licence_folded.in_([name.casefold() for name in query.licences])
    if query.ids:
        yield "ids", row.asset_id.in_(query.ids)
    for tag in query.tags:
        yield "tags", row.key.in_(select(AssetTagRow.version_key).where(AssetTagRow.tag == tag))
    if query.without_tags:
        yield "without_tags", row.key.not_in(select(AssetTagRow.version_key).where(AssetTagRow.tag.in_(query.without_tags)))
    for word in dict.fromkeys(_words(query.text)):
        begins = and_(AssetWordRow.word >= word, AssetWordRow.word < word + _LAST_CHARACTER)
        yield "text", row.key.in_(select(AssetWordRow.version_key).where(begins))
    for name in ("length_m", "width_m", "height_m"):
        least, most = getattr(query, name)
        if least is not None:
            yield name, getattr(row, name) >= least
        if most is not None:
            yield name, getattr(row, name) <= most


def order_by(order: str) -> list[ColumnElement[Any]]:
    """Return the terms of ORDER BY. Raises FieldError for an unknown order."""
    if order not in ORDERS:
        raise FieldError(f"order is {order!r}; must be one of {', '.join(ORDERS)}.", path="order", value=order)
    by_id = AssetVersionRow.asset_id.asc()
    if (chosen := ORDERS[order]) is None:
        return [by_id]
    column, falling = chosen
    return [column.desc() if falling else column.asc(), by_id]


def cursor_at(order: str, row: AssetVersionRow) -> str:
    """Return the cursor that stands behind a row."""
    chosen = ORDERS[order]
    place = [order, None if chosen is None else getattr(row, chosen[0].key), row.asset_id]
    return base64.urlsafe_b64encode(json.dumps(place, separators=(",", ":")).encode()).decode().rstrip("=")


def after_cursor(order: str, cursor: str) -> ColumnElement[bool]:
    """Return the condition that a row comes after the cursor. Raises FieldError where it is not one of this order."""
    try:
        of_order, value, asset_id = json.loads(base64.urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)))
    except (binascii.Error, ValueError, TypeError, RecursionError):
        of_order, value, asset_id = "", None, None
    chosen = ORDERS[order]
    kind: type | tuple[type, ...] = type(None)
    if chosen is not None:
        kind = str if chosen[0].key in ("title_folded", "asset_class") else (int, float)
    if of_order != order or not isinstance(asset_id, str) or not isinstance(value, kind):
        raise FieldError(
            f"cursor is {cursor[:80]!r}, which is none of the order {order!r}. Begin again without a cursor.",
            path="cursor",
            value=cursor,
        )
    later = AssetVersionRow.asset_id > asset_id
    if chosen is None:
        return later
    column, falling = chosen
    return or_(column < value if falling else column > value, and_(column == value, later))
