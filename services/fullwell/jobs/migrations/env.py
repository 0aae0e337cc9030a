"""Entry point of Alembic: runs on the connection that `Database.upgrade` hands over.

Alembic loads this file under the name ``env_py``; imported by its own name it does nothing.
"""

from __future__ import annotations

from alembic import context

from fullwell.jobs.asset_rows import Base  # by way of the asset tables, which are Base's too

if __name__ == "env_py":
    context.configure(
        connection=context.config.attributes["connection"],
        target_metadata=Base.metadata,
        transactional_ddl=True,
        render_as_batch=True,
    )
    with context.begin_transaction():
        context.run_migrations()
