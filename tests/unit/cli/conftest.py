"""Commands under test keep no radiance images in the user's own cache folder."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def no_stage_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FULLWELL_CACHE_BYTES", "0")
