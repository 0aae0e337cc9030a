"""What stands before every route: keys, sizes, and protection of an open service from other sites' pages."""

from __future__ import annotations

import hashlib
import hmac
from typing import Annotated, Any
from urllib.parse import urlsplit

from fastapi import Depends, Request
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer
from starlette.exceptions import HTTPException
from starlette.requests import Request as PlainRequest
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fullwell.core.settings import Settings
from fullwell_api.problems import problem_response

__all__ = ["HostGuard", "SizeLimit", "require_key"]

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
LOCAL_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})
BLOBS = "/v1/blobs"

_bearer = HTTPBearer(auto_error=False, description="One of FULLWELL_API_KEYS; an embedded service on 127.0.0.1 needs none.")


def require_key(request: Request, given: Annotated[HTTPAuthorizationCredentials | None, Depends(_bearer)]) -> None:
    """Refuse a request without a valid key, where keys are set."""
    settings: Settings = request.app.state.services.settings
    if not settings.api_keys:
        return
    if given is None:
        raise HTTPException(
            401, "a key is needed: send Authorization: Bearer KEY", {"WWW-Authenticate": 'Bearer realm="fullwell"'}
        )
    # Digests have one length and every key is compared, so that the time tells nothing about any of them.
    digest = hashlib.sha256(given.credentials.encode("utf-8", "surrogateescape")).digest()
    known = [hashlib.sha256(key.get_secret_value().encode()).digest() for key in settings.api_keys]
    if sum(hmac.compare_digest(digest, other) for other in known) == 0:
        raise HTTPException(401, "the key is not valid", {"WWW-Authenticate": 'Bearer realm="fullwell", error="invalid_token"'})


class SizeLimit:
    """Refuses bodies that are too large, before or while they are read."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        blob = scope["path"] == BLOBS or (scope["path"].startswith(f"{BLOBS}/") and scope["method"] == "PUT")
        limit = self._settings.max_blob_bytes if blob else self._settings.max_request_bytes
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


class HostGuard:
    """Keeps other sites' pages in the user's browser from using the service.

    A page can send simple requests anywhere, and can name its own host with our address (DNS rebinding). So changing
    requests must come from our own pages or no page at all, and an open service on a loopback address answers only to
    the names of such an address.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        names = set(settings.allowed_hosts)
        if not names and settings.is_loopback and not settings.api_keys:
            names = set(LOCAL_NAMES) | {settings.host}
        self._names = names

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] == "http" and (refusal := self._refusal(PlainRequest(scope))) is not None:
            status, detail = refusal
            await problem_response(status, detail, instance=scope["path"])(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _refusal(self, request: PlainRequest) -> tuple[int, str] | None:
        host = request.headers.get("host", "")
        name = _host_name(host)
        if self._names and name not in self._names:
            return 421, f"this service does not answer to the name {name[:100]!r}; FULLWELL_ALLOWED_HOSTS sets its names"
        if request.method in SAFE_METHODS:
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
