"""History of the job database's schema (Alembic)."""
