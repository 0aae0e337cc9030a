"""The jobs page: one file that asks the API; nothing in it is made from anyone's data on the server."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from fastapi import APIRouter
from fastapi.responses import HTMLResponse, Response

from fullwell.core import NotFoundError

__all__ = ["router"]

router = APIRouter(include_in_schema=False)

POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' blob:",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)
HEADERS = {"Content-Security-Policy": POLICY, "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer"}
TYPES = {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml", ".html": "text/html"}
FILES = frozenset({"jobs.css", "jobs.js", "icon.svg"})


@cache
def _file(name: str) -> bytes:
    return (Path(__file__).parent / "files" / name).read_bytes()


@router.get("/")
def jobs_page() -> Response:
    """Return the jobs page."""
    return HTMLResponse(_file("jobs.html"), headers={**HEADERS, "Cache-Control": "no-cache"})


@router.get("/web/{name}")
def web_file(name: str) -> Response:
    """Return a file of the pages."""
    if name not in FILES:
        raise NotFoundError(f"there is no page file {name[:80]!r}")
    return Response(_file(name), media_type=TYPES[Path(name).suffix], headers={**HEADERS, "Cache-Control": "no-cache"})
