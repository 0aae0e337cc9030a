"""Sessions of the curation page: tokens in browsers, keys in memory, both forgotten in time."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from fullwell.core.settings import Settings
from fullwell_api.web.curation import sessions as module
from fullwell_api.web.curation.sessions import SESSION_LIFE_S, Sessions


class Clock:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def sessions(tmp_path: Path, clock: Clock) -> Sessions:
    settings = Settings(home=tmp_path, api_keys="just-looking", curator_keys="maria:let-me-change,key-without-name")
    return Sessions(settings, clock)


def test_a_curators_key_gives_a_token_that_is_not_the_key(sessions: Sessions) -> None:
    opened = sessions.open("let-me-change")
    assert opened is not None
    token, caller = opened
    assert (caller.name, caller.may_curate) == ("maria", True)
    assert "let-me-change" not in token
    assert len(token) >= 43
    assert sessions.caller(token) == caller


def test_a_user_key_may_look_only(sessions: Sessions) -> None:
    opened = sessions.open("just-looking")
    assert opened is not None
    assert not opened[1].may_curate


@pytest.mark.parametrize("key", ["", "let-me-chang", "maria:let-me-change", "LET-ME-CHANGE", "\udcff"])
def test_a_wrong_key_opens_nothing(sessions: Sessions, key: str) -> None:
    assert sessions.open(key) is None


@pytest.mark.parametrize("token", [None, "", "guess", "let-me-change", "\udcff"])
def test_an_unknown_token_is_nobody(sessions: Sessions, token: str | None) -> None:
    sessions.open("let-me-change")
    assert sessions.caller(token) is None


def test_two_sessions_of_one_key_end_apart(sessions: Sessions) -> None:
    first, second = sessions.open("let-me-change"), sessions.open("let-me-change")
    assert first is not None
    assert second is not None
    assert first[0] != second[0]
    sessions.close(first[0])
    assert sessions.caller(first[0]) is None
    assert sessions.caller(second[0]) is not None
    sessions.close(first[0])
    sessions.close(None)


def test_a_session_ends_after_its_time(sessions: Sessions, clock: Clock) -> None:
    opened = sessions.open("let-me-change")
    assert opened is not None
    clock.now += SESSION_LIFE_S - 1
    assert sessions.caller(opened[0]) is not None
    clock.now += 1
    assert sessions.caller(opened[0]) is None


def test_the_oldest_session_makes_room(sessions: Sessions, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_SESSIONS", 3)
    tokens = [opened[0] for opened in (sessions.open("let-me-change") for _ in range(5)) if opened is not None]
    assert [sessions.caller(token) is not None for token in tokens] == [False, False, True, True, True]


def test_without_keys_everybody_on_this_machine_may_change_things(tmp_path: Path) -> None:
    caller = Sessions(Settings(home=tmp_path)).caller(None)
    assert caller is not None
    assert caller.may_curate


def test_no_key_shows_in_what_a_session_prints(sessions: Sessions) -> None:
    sessions.open("let-me-change")
    (session,) = sessions._sessions.values()
    assert "let-me-change" not in repr(session)
    assert "let-me-change" not in str(dataclasses.asdict(session))
    assert "let-me-change" not in str(list(sessions._sessions))
