"""Who sits before a page: the browser holds a random token in a cookie, this process the key that was given for it."""

from __future__ import annotations

import hashlib
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from pydantic import SecretStr

from fullwell.core.settings import Settings
from fullwell_api.guards import Caller, identify

__all__ = ["COOKIE", "SESSION_LIFE_S", "Sessions"]

COOKIE: Final = "fullwell-session"
SESSION_LIFE_S: Final = 12 * 3600.0
MOST_SESSIONS: Final = 10_000
TOKEN_BYTES: Final = 32


@dataclass(frozen=True, slots=True)
class _Session:
    key: SecretStr
    ends_at: float


class Sessions:
    """Sessions by the digest of their token. Kept in memory: no key is ever written down, and a restart ends them all."""

    def __init__(self, settings: Settings, clock: Callable[[], float] = time.monotonic) -> None:
        self._settings = settings
        self._clock = clock
        self._sessions: dict[str, _Session] = {}
        self._lock = threading.Lock()

    def open(self, key: str) -> tuple[str, Caller] | None:
        """Return a new session's token and whose it is; None where the key is not valid."""
        caller = identify(self._settings, key)
        if caller is None:
            return None
        token = secrets.token_urlsafe(TOKEN_BYTES)
        with self._lock:
            self._forget_old()
            self._sessions[_digest(token)] = _Session(SecretStr(key), self._clock() + SESSION_LIFE_S)
        return token, caller

    def caller(self, token: str | None) -> Caller | None:
        """Return who has this token, asked anew each time: a key that was taken away counts no more. None: nobody known."""
        with self._lock:
            session = self._sessions.get(_digest(token)) if token else None
        if session is not None and session.ends_at <= self._clock():
            session = None
        return identify(self._settings, None if session is None else session.key.get_secret_value())

    def close(self, token: str | None) -> None:
        """End a session; one that is not there is no error."""
        with self._lock:
            self._sessions.pop(_digest(token or ""), None)

    def _forget_old(self) -> None:
        now = self._clock()
        for digest in [digest for digest, session in self._sessions.items() if session.ends_at <= now]:
            del self._sessions[digest]
        while len(self._sessions) >= MOST_SESSIONS:
            del self._sessions[next(iter(self._sessions))]


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "surrogateescape")).hexdigest()
