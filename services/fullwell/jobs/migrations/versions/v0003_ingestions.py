"""Work on assets: uploads that are read into the store, previews that are rendered."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the table of ingestions."""
    op.create_table(
        "ingestions",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("kind", sa.String(16), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("who", sa.String(64), nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("request_json", sa.Text(), nullable=False),
        sa.Column("request_sha256", sa.String(64), nullable=False),
        sa.Column("idempotency_key", sa.String(255)),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("strikes", sa.Integer(), nullable=False),
        sa.Column("enqueued_at", sa.Float()),
        sa.Column("not_before", sa.Float(), nullable=False),
        sa.Column("created_at", sa.Float(), nullable=False),
        sa.Column("started_at", sa.Float()),
        sa.Column("finished_at", sa.Float()),
        sa.Column("worker", sa.String(255)),
        sa.Column("holder", sa.Text()),
        sa.Column("lease_token", sa.String(32)),
        sa.Column("lease_expires_at", sa.Float()),
        sa.Column("stage", sa.String(64), nullable=False),
        sa.Column("fraction", sa.Float(), nullable=False),
        sa.Column("error", sa.Text()),
        sa.Column("error_code", sa.String(64)),
        sa.Column("asset_id", sa.String(80)),
        sa.Column("asset_version", sa.Integer()),
        sa.Column("checks_json", sa.Text(), nullable=False),
        sa.Column("preview_error", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_ingestions"),
        sa.UniqueConstraint("idempotency_key", name="uq_ingestions_idempotency_key"),
    )
    op.create_index("ix_ingestions_state_enqueued_at", "ingestions", ["state", "enqueued_at"])
    op.create_index("ix_ingestions_asset_id", "ingestions", ["asset_id"])


def downgrade() -> None:
    """Drop it."""
    op.drop_table("ingestions")
