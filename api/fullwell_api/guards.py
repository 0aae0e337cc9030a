"""What stands before every route: keys, sizes, and protection of an open service from other sites' pages."""

from __future__ import annotations

import hashlib
import hmac
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, TypeAlias
from urllib.parse import urlsplit

from fastapi import Depends, Request
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Send
from starlette.types import Scope as RequestScope

from fullwell.core.settings import Settings
from fullwell_api.problems import problem_response

__all__ = ["Caller", "Curator", "HostGuard", "Scope", "SizeLimit", "identify", "require_curator", "require_key"]

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
LOCAL_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})
BLOBS = "/v1/blobs"

UPLOADS: Final = ("/v1/assets", "/v1/assets/archives", "/assets/files")
"""Routes whose POST takes whole files in one body."""

Scope: TypeAlias = Literal["use", "curate"]
"""`use`: jobs, reading assets, uploading blobs. `curate`: changing assets."""

USE: Final[frozenset[Scope]] = frozenset({"use"})
EVERYTHING: Final[frozenset[Scope]] = frozenset({"use", "curate"})

_bearer = HTTPBearer(
    auto_error=False,
    description="One of FULLWELL_API_KEYS or FULLWELL_CURATOR_KEYS; an embedded service on 127.0.0.1 needs none.",
)
Bearer = Annotated[HTTPAuthorizationCredentials | None, Depends(_bearer)]


@dataclass(frozen=True, slots=True)
class Caller:
    """Who sent a request: a name for the record, never a key, and what its key allows."""

    name: str
    scopes: frozenset[Scope]

    @property
    def may_curate(self) -> bool:
        """Whether this caller may change assets."""
        return "curate" in self.scopes


def identify(settings: Settings, token: str | None) -> Caller | None:
    """Return who has this key; None where keys are set and this is none of them.

    Without any keys everybody is "local" and may do everything: such a service answers to its own machine only.
    """
    if not settings.has_keys:
        return Caller("local", EVERYTHING)
    if token is None:
        return None
    # Digests have one length and every key is compared, so that the time tells nothing about any of them.
    digest = hashlib.sha256(token.encode("utf-8", "surrogateescape")).digest()
    curators = [entry for entry in settings.curator_keys if _same(digest, entry.key.get_secret_value())]
    users = [key for key in settings.api_keys if _same(digest, key.get_secret_value())]
    if curators:
        return Caller(curators[0].name, EVERYTHING)
    return Caller("api", USE) if users else None


def _same(digest: bytes, key: str) -> bool:
    return hmac.compare_digest(digest, hashlib.sha256(key.encode()).digest())


def require_key(request: Request, given: Bearer) -> Caller:
    """Return who sends the request; refuse one without a valid key, where keys are set."""
    caller = identify(request.app.state.services.settings, None if given is None else given.credentials)
    if caller is not None:
        return caller
    if given is None:
        raise HTTPException(
            401, "a key is needed: send Authorization: Bearer KEY", {"WWW-Authenticate": 'Bearer realm="fullwell"'}
        )
    raise HTTPException(401, "the key is not valid", {"WWW-Authenticate": 'Bearer realm="fullwell", error="invalid_token"'})


def require_curator(request: Request, caller: Annotated[Caller, Depends(require_key)]) -> Caller:
    """Return who sends the request; refuse one whose key may not change assets."""
    if caller.may_curate:
        return caller
    settings: Settings = request.app.state.services.settings
    where = "" if settings.curator_keys else " None is set yet: set FULLWELL_CURATOR_KEYS=name:key and start the service again."
    raise HTTPException(403, f"changing assets needs a key of FULLWELL_CURATOR_KEYS; this one may use the service only.{where}")


Curator = Annotated[Caller, Depends(require_curator)]
"""Parameter type of routes that change assets."""


class SizeLimit:
    """Refuses bodies that are too large, before or while they are read."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._settings = settings

    async def __call__(self, scope: RequestScope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        limit = self._limit(scope["method"], scope["path"])
        detail = f"the request's body is larger than {limit} bytes"
        length = dict(scope["headers"]).get(b"content-length", b"0")
        if length.isdigit() and int(length) > limit:
            await problem_response(413, detail, instance=scope["path"])(scope, receive, send)
            return
        received = 0

        async def counted() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > limit:
                raise HTTPException(413, detail)
            return message

        await self._app(scope, counted, send)

    def _limit(self, method: str, path: str) -> int:
        if path == BLOBS or (path.startswith(f"{BLOBS}/") and method == "PUT"):
            return self._settings.max_blob_bytes
        return self._settings.max_upload_bytes if method == "POST" and path in UPLOADS else self._settings.max_request_bytes


class HostGuard:
    """Keeps other sites' pages in the user's browser from using the service.

    A page can send simple requests anywhere, and can name its own host with our address (DNS rebinding). So changing
    requests must come from our own pages or no page at all, and an open service on a loopback address answers only to
    the names of such an address.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        names = set(settings.allowed_hosts)
        if not names and settings.is_loopback and not settings.has_keys:
            names = set(LOCAL_NAMES) | {settings.host}
        self._names = names

    async def __call__(self, scope: RequestScope, receive: Receive, send: Send) -> None:
        """Serve one request or socket."""
        refusal = self._refusal(HTTPConnection(scope)) if scope["type"] in ("http", "websocket") else None
        if refusal is None:
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            # Closed before it was accepted: the server answers 403.
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": "refused"})
        else:
            status, detail = refusal
            await problem_response(status, detail, instance=scope["path"])(scope, receive, send)

    def _refusal(self, request: HTTPConnection) -> tuple[int, str] | None:
        host = request.headers.get("host", "")
        name = _host_name(host)
        if self._names and name not in self._names:
            return 421, f"this service does not answer to the name {name[:100]!r}; FULLWELL_ALLOWED_HOSTS sets its names"
        # A socket can change things, and browsers let any page open one.
        if request.scope.get("method") in SAFE_METHODS:
            return None
        origin: Any = request.headers.get("origin")
        foreign = origin is not None and urlsplit(origin).netloc != host
        if foreign or request.headers.get("sec-fetch-site") == "cross-site":
            return 403, "requests that change something are not taken from other sites' pages"
        return None


def _host_name(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
