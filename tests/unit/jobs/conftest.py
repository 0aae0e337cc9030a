"""A repository on an empty SQLite file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from fullwell.jobs.database import Database
from fullwell.jobs.repository import JobRepository


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    database = Database(f"sqlite:///{tmp_path}/jobs.sqlite3")
    database.upgrade()
    yield database
    database.close()


@pytest.fixture
def repository(database: Database) -> JobRepository:
    return JobRepository(database)
