"""Reference numbers: FULLWELL_REFERENCE_DIR, by default beside the repository; missing files skip unless all are required."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def reference() -> Callable[[str], Any]:
    """Return a reader of reference files by their path below the reference folder, for example isetcam/spectra.json."""
    folder = Path(os.environ.get("FULLWELL_REFERENCE_DIR", ROOT.parent / "shared" / "reference"))

    def read(name: str) -> Any:
        path = folder / name
        if path.is_file():
            return json.loads(path.read_text())
        message = f"{path} is not there; set FULLWELL_REFERENCE_DIR to the folder of reference numbers"
        if os.environ.get("FULLWELL_REQUIRE_ALL") == "1":
            pytest.fail(message)
        pytest.skip(message)

    return read
