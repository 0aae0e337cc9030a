"""A repository on an empty SQLite file, or on the PostgreSQL database that FULLWELL_TEST_POSTGRES_URL names (it is emptied)."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import text

from fullwell.jobs.database import Database
from fullwell.jobs.repository import JobRepository

POSTGRES_URL = os.environ.get("FULLWELL_TEST_POSTGRES_URL", "")


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    database = Database(POSTGRES_URL or f"sqlite:///{tmp_path}/jobs.sqlite3")
    if POSTGRES_URL:
        with database.writing() as session:
            session.execute(text("DROP SCHEMA public CASCADE"))
            session.execute(text("CREATE SCHEMA public"))
    database.upgrade()
    yield database
    database.close()


@pytest.fixture
def repository(database: Database) -> JobRepository:
    return JobRepository(database)
