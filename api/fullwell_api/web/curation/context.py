"""What the page's parts share: the service behind it, who asks, and calls that never hold up the event loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final, ParamSpec, TypeVar, cast

from fastapi import Request

from fullwell.jobs.asset_library import AssetLibrary
from fullwell_api.guards import Caller
from fullwell_api.services import Services
from fullwell_api.web.curation.sessions import COOKIE, Sessions

__all__ = ["CONTEXT_KEY", "MOUNT", "Curation", "curation_of"]

MOUNT: Final = "/assets"
CONTEXT_KEY: Final = "fullwell.curation"

P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Curation:
    """The service as the page sees it."""

    services: Services
    sessions: Sessions

    @property
    def library(self) -> AssetLibrary:
        """The assets."""
        return self.services.library

    def caller(self, request: Request) -> Caller | None:
        """Return who sends a request, by its cookie."""
        return self.sessions.caller(request.cookies.get(COOKIE))

    async def run(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Return what a function that waits for the database or the store returns, from a thread of the service."""
        return await asyncio.get_running_loop().run_in_executor(self.services.threads, partial(function, *args, **kwargs))


def curation_of(request: Request) -> Curation:
    """Return the service behind a request to the page, or to one of its routes."""
    given = request.scope.get(CONTEXT_KEY)
    return cast(Curation, given if given is not None else request.app.state.curation)
