"""What the page shows, as an address: filters, order, and which asset is open. Shared links and the back button live on it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Final, cast
from urllib.parse import parse_qsl, urlencode

from fullwell.assets.classes import ASSET_CLASSES
from fullwell.assets.query import REVIEW_STATES, AssetQuery, Span
from fullwell.assets.records import check_asset_id, check_tags
from fullwell.core import FieldError

__all__ = ["ANY_STATE", "SPAN_NAMES", "View", "parse_view"]

ANY_STATE: Final = "all"
SPAN_NAMES: Final = ("length", "width", "height")
NO_SPAN: Final[Span] = (None, None)
MAX_TEXT: Final = 200


@dataclass(frozen=True, slots=True)
class View:
    """What is asked for.

    Attributes
    ----------
    state
        A review state, "all", or empty where the address says nothing.
    asset_class, tags, licences, text, length, width, height
        As in `AssetQuery`; sizes in metres.
    order
        Name of an order of the library; empty for its first.
    asset, version, compare
        Id of the asset that is open; number of the version looked at, 0 for the newest; number of the version it is compared
        with, 0 for none.
    """

    state: str = ""
    asset_class: str = ""
    tags: tuple[str, ...] = ()
    licences: tuple[str, ...] = ()
    text: str = ""
    length: Span = NO_SPAN
    width: Span = NO_SPAN
    height: Span = NO_SPAN
    order: str = ""
    asset: str = ""
    version: int = 0
    compare: int = 0

    def query(self) -> AssetQuery:
        """Return the library's query."""
        states = tuple(state for state in REVIEW_STATES if state == self.state)
        return AssetQuery(
            asset_class=self.asset_class,
            tags=self.tags,
            licences=self.licences,
            states=states,
            text=self.text,
            length_m=self.length,
            width_m=self.width,
            height_m=self.height,
        )

    def address(self) -> str:
        """Return the query string, empty or beginning with "?"; equal views, equal addresses."""
        pairs = [("state", self.state), ("class", self.asset_class)]
        pairs += [("tag", tag) for tag in self.tags]
        pairs += [("licence", licence) for licence in self.licences]
        pairs.append(("q", self.text))
        pairs += [(name, _span_text(getattr(self, name))) for name in SPAN_NAMES]
        pairs += [("sort", self.order), ("asset", self.asset)]
        pairs += [("version", str(self.version or "")), ("compare", str(self.compare or ""))]
        given = [(name, value) for name, value in pairs if value]
        return f"?{urlencode(given)}" if given else ""

    @property
    def is_filtered(self) -> bool:
        """Whether anything but the state narrows the search."""
        return replace(self.unfiltered(), asset=self.asset, version=self.version, compare=self.compare) != self

    def unfiltered(self) -> View:
        """Return the view without any filter but the state."""
        return View(state=self.state, order=self.order)

    def toggled(self, name: str, value: str) -> View:
        """Return the view with one choice of a filter ("class", "tag" or "licence") made, or taken back."""
        if name == "class":
            return replace(self, asset_class="" if self.asset_class == value else value)
        if name == "tag":
            return replace(self, tags=_toggled(self.tags, value))
        return replace(self, licences=_toggled(self.licences, value))

    def spanned(self, name: str, span: Span) -> View:
        """Return the view with another range of "length", "width" or "height" [m]."""
        spans = {key: getattr(self, key) for key in SPAN_NAMES} | {name: span}
        return replace(self, length=spans["length"], width=spans["width"], height=spans["height"])

    def opened(self, asset: str) -> View:
        """Return the view with another asset open, or with none for an empty id."""
        return replace(self, asset=asset, version=0, compare=0)


def parse_view(query: str, orders: Iterable[str] = ()) -> View:
    """Return the view of an address's query string. What makes no sense in it is left out: people type and cut links."""
    found: dict[str, list[str]] = {}
    for name, value in parse_qsl(query.removeprefix("?"), max_num_fields=200):
        found.setdefault(name, []).append(value)
    first: Mapping[str, str] = {name: values[0] for name, values in found.items()}
    state, kind, order = first.get("state", ""), first.get("class", ""), first.get("sort", "")
    return View(
        state=state if state in (*REVIEW_STATES, ANY_STATE) else "",
        asset_class=kind if kind in ASSET_CLASSES else "",
        tags=_legal_tags(found.get("tag", [])),
        licences=tuple(sorted({text[:MAX_TEXT] for text in found.get("licence", [])})),
        text=first.get("q", "").strip()[:MAX_TEXT],
        length=_span(first.get("length", "")),
        width=_span(first.get("width", "")),
        height=_span(first.get("height", "")),
        order=order if order in set(orders) else "",
        asset=_legal_id(first.get("asset", "")),
        version=_number(first.get("version", "")),
        compare=_number(first.get("compare", "")),
    )


def _toggled(chosen: tuple[str, ...], value: str) -> tuple[str, ...]:
    return tuple(sorted({*chosen} ^ {value}))


def _legal_tags(texts: list[str]) -> tuple[str, ...]:
    legal: list[str] = []
    for text in texts:
        try:
            legal += check_tags((text,))
        except FieldError:
            continue
    return tuple(sorted(set(legal))[:32])


def _legal_id(text: str) -> str:
    try:
        return check_asset_id(text)
    except FieldError:
        return ""


def _number(text: str) -> int:
    return int(text) if text.isascii() and text.isdigit() and len(text) < 9 else 0


def _span(text: str) -> Span:
    low, colon, high = text.partition(":")
    span = (_metres(low), _metres(high) if colon else None)
    return NO_SPAN if None not in span and cast(float, span[0]) > cast(float, span[1]) else span


def _metres(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) and value >= 0.0 else None


def _span_text(span: Span) -> str:
    return "" if span == NO_SPAN else ":".join("" if end is None else f"{end:g}" for end in span)
