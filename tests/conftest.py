"""Fixtures that every test folder may use."""

from __future__ import annotations

import gc
import logging
from collections.abc import Iterator

import pytest
import structlog

from servers import s3_server, valkey_server

__all__ = ["logs_end_with_their_test", "s3_server", "valkey_server"]


def pytest_collection_finish() -> None:
    """Take what collecting left in memory out of the garbage collector's rounds.

    The renderer asks for a round with each scene. Half a million objects of modules and of parameters that live to the end made
    one last 0.3 s: more than most of the scenes that tests render.
    """
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def logs_end_with_their_test() -> Iterator[None]:
    """Undo what a command or process set up for logs in this process: its stream is the test's, and is closed after it."""
    handlers, level = logging.root.handlers[:], logging.root.level
    yield
    structlog.reset_defaults()
    logging.root.handlers[:] = handlers
    logging.root.setLevel(level)
