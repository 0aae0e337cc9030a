"""Ingestion's tests need the libraries that read models; the samples' folder is FULLWELL_SAMPLES_DIR."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[4]
SAMPLES = Path(os.environ.get("FULLWELL_SAMPLES_DIR", REPOSITORY.parent / "shared" / "samples"))


@pytest.fixture(scope="session")
def samples() -> Path:
    """Return the folder of model files made by others; skips, or fails where every part is required, without it."""
    if not SAMPLES.is_dir():
        message = f"{SAMPLES} does not exist; set FULLWELL_SAMPLES_DIR"
        if os.environ.get("FULLWELL_REQUIRE_ALL") == "1":
            pytest.fail(message)
        pytest.skip(message)
    return SAMPLES
