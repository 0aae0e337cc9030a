"""Tables of the asset catalogue: an index of the version and event files in the object store, which can rebuild it."""

from __future__ import annotations

from sqlalchemy import BigInteger, Boolean, Float, ForeignKey, Index, Integer, String, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from fullwell.jobs.models import Base

__all__ = ["AssetEventRow", "AssetHoldRow", "AssetManifestRow", "AssetTagRow", "AssetVersionRow", "AssetWordRow", "Base"]

MAX_WORD_CHARACTERS = 500
"""Longer words are cut: PostgreSQL's index takes 2704 bytes."""


def _ordered_text(length: int) -> String:
    """Return a text type that compares by code points in both databases: by the locale, prefixes would not be ranges."""
    return String(length).with_variant(String(length, collation="C"), "postgresql")


_Key = BigInteger().with_variant(Integer, "sqlite")


class AssetManifestRow(Base):
    """A manifest's canonical JSON, once for all versions that have it."""

    __tablename__ = "asset_manifests"

    digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    document_json: Mapped[str] = mapped_column(Text)


class AssetVersionRow(Base):
    """One version of an asset, narrow, so that searching reads few pages.

    `line` is the version whose import brought the content that this one shows; edits stay on its line, and a decision about
    one version of a line is about all. `shown` marks the newest version of an asset that is not retired: what searches see.
    `tags`, with spaces between, are for counting; conditions on tags use AssetTagRow.
    """

    __tablename__ = "asset_versions"
    __table_args__ = (
        UniqueConstraint("asset_id", "version"),
        Index("ix_asset_versions_shown_asset_id", "shown", "asset_id"),
        Index("ix_asset_versions_shown_created_at", "shown", "created_at", "asset_id"),
        Index("ix_asset_versions_shown_title_folded", "shown", "title_folded", "asset_id"),
        Index("ix_asset_versions_shown_extent_m", "shown", "extent_m", "asset_id"),
        Index("ix_asset_versions_shown_triangles", "shown", "triangles", "asset_id"),
        Index("ix_asset_versions_facets", "shown", "asset_class", "state", "licence", "tags"),
    )

    key: Mapped[int] = mapped_column(_Key, primary_key=True, autoincrement=True)
    asset_id: Mapped[str] = mapped_column(_ordered_text(80))
    version: Mapped[int] = mapped_column(Integer)
    digest: Mapped[str] = mapped_column(ForeignKey("asset_manifests.digest"), index=True)
    look_digest: Mapped[str] = mapped_column(String(64))
    kind: Mapped[str] = mapped_column(String(16))
    line: Mapped[int] = mapped_column(Integer)
    shown: Mapped[bool] = mapped_column(Boolean)
    retired: Mapped[bool] = mapped_column(Boolean)
    state: Mapped[str] = mapped_column(String(16))
    asset_class: Mapped[str] = mapped_column(_ordered_text(40))
    title_folded: Mapped[str] = mapped_column(_ordered_text(400))
    licence: Mapped[str] = mapped_column(Text)
    licence_folded: Mapped[str] = mapped_column(Text)
    tags: Mapped[str] = mapped_column(Text)
    length_m: Mapped[float] = mapped_column(Float)
    width_m: Mapped[float] = mapped_column(Float)
    height_m: Mapped[float] = mapped_column(Float)
    extent_m: Mapped[float] = mapped_column(Float)
    triangles: Mapped[int] = mapped_column(BigInteger)
    created_at: Mapped[float] = mapped_column(Float)
    created_by: Mapped[str] = mapped_column(Text)
    reviewed_at: Mapped[float | None] = mapped_column(Float)
    reviewed_by: Mapped[str] = mapped_column(Text)
    reason: Mapped[str] = mapped_column(Text)


class AssetTagRow(Base):
    """A tag of a version."""

    __tablename__ = "asset_tags"
    __table_args__ = (Index("ix_asset_tags_version_key_tag", "version_key", "tag"), {"sqlite_with_rowid": False})

    tag: Mapped[str] = mapped_column(_ordered_text(40), primary_key=True)
    version_key: Mapped[int] = mapped_column(ForeignKey("asset_versions.key", ondelete="CASCADE"), primary_key=True)


class AssetWordRow(Base):
    """A word that a text search finds a version by; its index serves prefixes, in both databases alike."""

    __tablename__ = "asset_words"
    __table_args__ = (Index("ix_asset_words_version_key", "version_key"), {"sqlite_with_rowid": False})

    word: Mapped[str] = mapped_column(_ordered_text(MAX_WORD_CHARACTERS), primary_key=True)
    version_key: Mapped[int] = mapped_column(ForeignKey("asset_versions.key", ondelete="CASCADE"), primary_key=True)


class AssetEventRow(Base):
    """Something that happened to an asset. `name` sorts by time and is the name of its file in the object store.

    A version is an event too, with a name that ends in its number; its file is the version's.
    """

    __tablename__ = "asset_events"

    asset_id: Mapped[str] = mapped_column(_ordered_text(80), primary_key=True)
    name: Mapped[str] = mapped_column(_ordered_text(64), primary_key=True)
    kind: Mapped[str] = mapped_column(String(16))
    version: Mapped[int] = mapped_column(Integer)
    line: Mapped[int] = mapped_column(Integer)
    who: Mapped[str] = mapped_column(Text)
    at: Mapped[float] = mapped_column(Float)
    detail: Mapped[str] = mapped_column(Text)


class AssetHoldRow(Base):
    """A blob that someone is about to refer to: garbage collection leaves it until `until` (Unix time [s])."""

    __tablename__ = "asset_holds"

    digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    until: Mapped[float] = mapped_column(Float)
