"""What the asset library takes and gives: frozen records. Times are Unix times [s]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fullwell.assets.query import ReviewState
from fullwell.assets.records import AssetManifest

__all__ = ["AssetEntry", "AssetEvent", "AssetOrder", "AssetPage", "EventKind", "GarbageReport"]

AssetOrder = Literal["id", "newest", "title", "class", "size", "triangles"]
"""By id, title or class from a to z; newest version first; largest extent first; most triangles in the finest level first."""

EventKind = Literal["imported", "edited", "approved", "rejected", "pending", "retired", "restored", "collected"]
"""A version came in, or was made by an edit; a decision; the asset was taken out of the catalogue, or put back; a retired
version's content was removed."""


@dataclass(frozen=True, slots=True)
class AssetEntry:
    """One version of an asset in the catalogue.

    `state` is the last decision about the content that this version shows: it holds for the version that was imported and for
    the edits made from it. `reviewed_at`, `reviewed_by` and `reason` are that decision's.
    """

    id: str
    version: int
    digest: str
    manifest: AssetManifest
    state: ReviewState
    created_at: float
    created_by: str
    reviewed_at: float | None = None
    reviewed_by: str = ""
    reason: str = ""
    retired: bool = False


@dataclass(frozen=True, slots=True)
class AssetPage:
    """Part of a search's result. `next_cursor` is empty on the last page; `total` counts all pages."""

    entries: tuple[AssetEntry, ...]
    next_cursor: str
    total: int


@dataclass(frozen=True, slots=True)
class AssetEvent:
    """Who did what to which version of an asset, and when; `detail` is a reason, or says what was changed."""

    kind: EventKind
    version: int
    who: str
    when: float
    detail: str = ""


@dataclass(frozen=True, slots=True)
class GarbageReport:
    """What a garbage collection removed, or would remove.

    Attributes
    ----------
    dry_run
        Nothing was removed.
    blobs, previews, bytes
        Objects removed, and their size together.
    versions
        Retired versions whose content went.
    kept, young
        Blobs that something refers to, and unreferred ones that are too young or held by an upload.
    digests
        The blobs removed, sorted.
    """

    dry_run: bool
    blobs: int
    previews: int
    bytes: int
    versions: int
    kept: int
    young: int
    digests: tuple[str, ...] = ()
