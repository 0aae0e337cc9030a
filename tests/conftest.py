"""Fixtures that every test folder may use."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import pytest
import structlog

from servers import s3_server, valkey_server

__all__ = ["logs_end_with_their_test", "s3_server", "valkey_server"]


@pytest.fixture(autouse=True)
def logs_end_with_their_test() -> Iterator[None]:
    """Undo what a command or process set up for logs in this process: its stream is the test's, and is closed after it."""
    handlers, level = logging.root.handlers[:], logging.root.level
    yield
    structlog.reset_defaults()
    logging.root.handlers[:] = handlers
    logging.root.setLevel(level)
