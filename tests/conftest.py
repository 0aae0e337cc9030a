"""Fixtures that every test folder may use."""

from __future__ import annotations

import gc
import logging
import os
import sys
from collections.abc import Iterator

import pytest
import structlog

from servers import s3_server, valkey_server

__all__ = ["logs_end_with_their_test", "s3_server", "valkey_server"]


# Every run of the tests, and the processes that they start, compiles the same few hundred modules: once is enough.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


_BEFORE_PRINTING = structlog.get_config()["processors"][:-1]
_PRINTING = structlog.dev.ConsoleRenderer(exception_formatter=structlog.dev.plain_traceback)
"""The default one shows each frame's variables: of a test client's fifty frames that takes eight seconds."""


def pytest_collection() -> None:
    """Collect tests without rounds of the garbage collector: next to nothing of what is made is garbage."""
    gc.disable()


def pytest_collection_finish() -> None:
    """Take what collecting has made out of the garbage collector's rounds.

    The renderer asks for a round with each scene. Half a million objects of modules and parameters, which live to the end, made
    one last 0.3 s: more than most of the scenes that tests render.
    """
    gc.collect()
    gc.freeze()
    gc.enable()


@pytest.fixture(autouse=True)
def logs_end_with_their_test() -> Iterator[None]:
    """Print logs plainly; undo what a command or process set up for them: its stream is the test's, and is closed after it."""
    handlers, level = logging.root.handlers[:], logging.root.level
    structlog.configure(processors=[*_BEFORE_PRINTING, _PRINTING])
    yield
    structlog.reset_defaults()
    logging.root.handlers[:] = handlers
    logging.root.setLevel(level)
