"""The asset catalogue: versions, their manifests, words and tags to search by, events, and holds on blobs."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def _ordered_text(length: int) -> sa.types.TypeEngine[str]:
    return sa.String(length).with_variant(sa.String(length, collation="C"), "postgresql")


def upgrade() -> None:
    """Make the tables of assets."""
    op.create_table(
        "asset_manifests",
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("document_json", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("digest", name="pk_asset_manifests"),
    )
    _create_versions()
    _create_words()
    op.create_table(
        "asset_events",
        sa.Column("asset_id", _ordered_text(80), nullable=False),
        sa.Column("name", _ordered_text(64), nullable=False),
        sa.Column("kind", sa.String(16), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("line", sa.Integer(), nullable=False),
        sa.Column("who", sa.Text(), nullable=False),
        sa.Column("at", sa.Float(), nullable=False),
        sa.Column("detail", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("asset_id", "name", name="pk_asset_events"),
    )
    op.create_table(
        "asset_holds",
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("until", sa.Float(), nullable=False),
        sa.PrimaryKeyConstraint("digest", name="pk_asset_holds"),
    )


def _create_versions() -> None:
    op.create_table(
        "asset_versions",
        sa.Column("key", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), autoincrement=True, nullable=False),
        sa.Column("asset_id", _ordered_text(80), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("look_digest", sa.String(64), nullable=False),
        sa.Column("kind", sa.String(16), nullable=False),
        sa.Column("line", sa.Integer(), nullable=False),
        sa.Column("shown", sa.Boolean(), nullable=False),
        sa.Column("retired", sa.Boolean(), nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("asset_class", _ordered_text(40), nullable=False),
        sa.Column("title_folded", _ordered_text(400), nullable=False),
        sa.Column("licence", sa.Text(), nullable=False),
        sa.Column("licence_folded", sa.Text(), nullable=False),
        sa.Column("tags", sa.Text(), nullable=False),
        *(sa.Column(name, sa.Float(), nullable=False) for name in ("length_m", "width_m", "height_m", "extent_m")),
        sa.Column("triangles", sa.BigInteger(), nullable=False),
        sa.Column("created_at", sa.Float(), nullable=False),
        sa.Column("created_by", sa.Text(), nullable=False),
        sa.Column("reviewed_at", sa.Float()),
        sa.Column("reviewed_by", sa.Text(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["digest"], ["asset_manifests.digest"], name="fk_asset_versions_digest_asset_manifests"),
        sa.PrimaryKeyConstraint("key", name="pk_asset_versions"),
        sa.UniqueConstraint("asset_id", "version", name="uq_asset_versions_asset_id_version"),
    )
    op.create_index("ix_asset_versions_digest", "asset_versions", ["digest"])
    op.create_index("ix_asset_versions_shown_asset_id", "asset_versions", ["shown", "asset_id"])
    for column in ("created_at", "title_folded", "extent_m", "triangles"):
        op.create_index(f"ix_asset_versions_shown_{column}", "asset_versions", ["shown", column, "asset_id"])
    facets = ["shown", "asset_class", "state", "licence", "tags"]
    op.create_index("ix_asset_versions_facets", "asset_versions", facets)


def _create_words() -> None:
    for table, column, length in (("asset_tags", "tag", 40), ("asset_words", "word", 500)):
        op.create_table(
            table,
            sa.Column(column, _ordered_text(length), nullable=False),
            sa.Column("version_key", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
            sa.ForeignKeyConstraint(
                ["version_key"], ["asset_versions.key"], name=f"fk_{table}_version_key_asset_versions", ondelete="CASCADE"
            ),
            sa.PrimaryKeyConstraint(column, "version_key", name=f"pk_{table}"),
            sqlite_with_rowid=False,
        )
    op.create_index("ix_asset_tags_version_key_tag", "asset_tags", ["version_key", "tag"])
    op.create_index("ix_asset_words_version_key", "asset_words", ["version_key"])


def downgrade() -> None:
    """Drop the tables of assets."""
    for table in ("asset_holds", "asset_events", "asset_words", "asset_tags", "asset_versions", "asset_manifests"):
        op.drop_table(table)
