"""Workers that were asked to end: what they then lose is no strike against the frame."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the time at which a worker was asked to end."""
    op.add_column("workers", sa.Column("leaving_at", sa.Float()))


def downgrade() -> None:
    """Drop it again."""
    op.drop_column("workers", "leaving_at")
