"""Keys of curators, and how illegal ones are refused without being shown."""

from __future__ import annotations

import pytest

from fullwell.core import FieldError
from fullwell.core.settings import CuratorKey, Settings, load_settings


def test_curator_keys_carry_a_name_or_the_common_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FULLWELL_CURATOR_KEYS", "ann:secret-of-ann, secret-without-name")
    keys = load_settings().curator_keys
    assert [(key.name, key.key.get_secret_value()) for key in keys] == [
        ("ann", "secret-of-ann"),
        ("curator", "secret-without-name"),
    ]
    assert load_settings().has_keys
    assert "secret-of-ann" not in repr(keys)


@pytest.mark.parametrize("text", ["ann:short", "short", "not a name:long-enough-key", ":long-enough-key"])
def test_an_illegal_curator_key_is_refused_without_being_shown(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setenv("FULLWELL_CURATOR_KEYS", text)
    with pytest.raises(FieldError, match="FULLWELL_CURATOR_KEYS") as caught:
        load_settings()
    assert text.partition(":")[2] not in str(caught.value) or not text.partition(":")[2]


def test_no_keys_means_that_none_are_needed() -> None:
    assert not Settings().has_keys
    assert Settings(curator_keys=(CuratorKey.from_text("ann:secret-of-ann"),)).has_keys
