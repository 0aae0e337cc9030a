"""How the page gets into the application: its routes, its sockets, and what every answer of it carries."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import nicegui
from fastapi import FastAPI
from nicegui import core, ui
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fullwell_api.services import Services
from fullwell_api.web.curation import page
from fullwell_api.web.curation.context import CONTEXT_KEY, MOUNT, Curation
from fullwell_api.web.curation.routes import router
from fullwell_api.web.curation.sessions import Sessions

__all__ = ["mount_curation"]

RECONNECT_S: Final = 20.0
"""How long the server keeps a page whose connection was cut: a laptop that changes networks is back by then."""

# The component library builds its page from inline scripts and templates, so these must be allowed; nothing may come from,
# or go to, any other host.
POLICY: Final = "; ".join(
    (
        "default-src 'self'",
        "script-src 'self' 'unsafe-inline' 'unsafe-eval'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        "connect-src 'self' blob: data:",
        "worker-src 'self' blob:",
        "object-src 'none'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)
HEADERS: Final = {"Content-Security-Policy": POLICY, "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer"}
KEPT: Final = f"/_nicegui/{nicegui.__version__}/"
FOR_GOOD: Final = "public, max-age=31536000, immutable"


@dataclass(frozen=True, slots=True)
class _PageRoute:
    """What request meters call these requests."""

    path: str = MOUNT


def mount_curation(app: FastAPI, services: Services) -> None:
    """Put the page under ``/assets``, beside the routes that are there."""
    _configure()
    sessions = Sessions(services.settings)
    curation = Curation(services, sessions)
    app.state.curation = curation
    app.include_router(router, prefix=MOUNT)
    app.mount(MOUNT, _PageApp(core.app, curation))
    inner = app.router.lifespan_context

    @asynccontextmanager
    async def lifespan(outer: FastAPI) -> AsyncIterator[Any]:
        async with inner(outer) as state, core.app.router.lifespan_context(core.app):
            yield state

    app.router.lifespan_context = lifespan


@cache
def _configure() -> None:
    # There is one NiceGUI application in a process, and it can be configured once; applications of ours there may be several
    # (tests make many). So it is configured for an application that is thrown away, and mounted into ours by hand.
    ui.run_with(
        FastAPI(),
        title="Assets · Fullwell",
        viewport="width=device-width, initial-scale=1",
        language="en-US",
        dark=None,
        favicon=page.ICON,
        tailwind=False,
        reconnect_timeout=RECONNECT_S,
        binding_refresh_interval=None,
        show_welcome_message=False,
    )
    ui.page("/")(page.curation_page)
    core.app.on_exception(_tell_nothing_twice)


def _tell_nothing_twice(_error: Exception) -> None:
    """Errors are logged by the library already; handlers of the page tell the user."""


class _PageApp:
    """The page's application with what it needs in each request's scope, and the headers that each answer carries."""

    def __init__(self, app: ASGIApp, curation: Curation) -> None:
        self._app = app
        self._curation = curation

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or socket."""
        scope["route"] = _PageRoute()
        inner = dict(scope) | {CONTEXT_KEY: self._curation}
        if scope["type"] != "http":
            await self._app(inner, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
                kept = scope["path"].removeprefix(MOUNT).startswith(KEPT) and message["status"] == 200
                if kept and "/dynamic_resources/" not in scope["path"]:
                    headers["Cache-Control"] = FOR_GOOD
            await send(message)

        await self._app(inner, receive, with_headers)
