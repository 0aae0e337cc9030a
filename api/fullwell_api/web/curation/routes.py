"""What the page in the browser asks for beside its socket: signing in, pictures, models, and sending files."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path as FilePath
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Path, Request, Response
from fastapi.responses import StreamingResponse
from pydantic import BaseModel, ConfigDict, SecretStr
from starlette.exceptions import HTTPException

from fullwell.assets.store import blob_key, preview_key
from fullwell.core import FieldError, NotFoundError
from fullwell_api.guards import Caller
from fullwell_api.routes import blobs
from fullwell_api.web.curation.context import MOUNT, Curation, curation_of
from fullwell_api.web.curation.sessions import COOKIE, SESSION_LIFE_S

__all__ = ["router", "style_address"]

router = APIRouter(include_in_schema=False)

STYLE: Final = FilePath(__file__).parent / "files" / "curation.css"
SAFE: Final = {"X-Content-Type-Options": "nosniff", "Content-Security-Policy": "default-src 'none'; sandbox"}
PICTURE_LIFE_S: Final = 300
GLB: Final = "model/gltf-binary"


def _known_caller(request: Request) -> Caller:
    caller = curation_of(request).caller(request)
    if caller is None:
        raise HTTPException(401, "sign in with a key first")
    return caller


def _curator(caller: Annotated[Caller, Depends(_known_caller)]) -> Caller:
    if not caller.may_curate:
        raise HTTPException(403, "changing assets needs a key of FULLWELL_CURATOR_KEYS; this one may look only")
    return caller


Parts = Annotated[Curation, Depends(curation_of)]
Known = Annotated[Caller, Depends(_known_caller)]
MayCurate = Annotated[Caller, Depends(_curator)]


class SignIn(BaseModel):
    """A key."""

    model_config = ConfigDict(extra="forbid")

    key: SecretStr


class CallerOut(BaseModel):
    """Who a key belongs to."""

    name: str
    may_curate: bool


@router.post("/session")
def sign_in(given: SignIn, request: Request, response: Response, parts: Parts) -> CallerOut:
    """Begin a session for a key; the browser gets a token that scripts cannot read, never the key again."""
    opened = parts.sessions.open(given.key.get_secret_value().strip())
    if opened is None:
        raise HTTPException(401, "this key is not valid")
    token, caller = opened
    response.set_cookie(
        COOKIE,
        token,
        max_age=int(SESSION_LIFE_S),
        path=MOUNT,
        secure=request.url.scheme == "https",
        httponly=True,
        samesite="lax",
    )
    return CallerOut(name=caller.name, may_curate=caller.may_curate)


@router.delete("/session", status_code=204)
def sign_out(request: Request, response: Response, parts: Parts) -> None:
    """End the session."""
    parts.sessions.close(request.cookies.get(COOKIE))
    response.delete_cookie(COOKIE, path=MOUNT)


@router.get("/style.css")
def style() -> Response:
    """Return the page's style; its address changes with it."""
    headers = SAFE | {"Cache-Control": "public, max-age=31536000, immutable"}
    return Response(_style(), media_type="text/css", headers=headers)


@cache
def _style() -> bytes:
    return STYLE.read_bytes()


def style_address() -> str:
    """Return the address of the page's style, for the page."""
    return f"{MOUNT}/style.css?v={hashlib.sha256(_style()).hexdigest()[:12]}"


@router.get("/pictures/{look_digest}/{name}.png")
def get_picture(look_digest: str, name: str, request: Request, parts: Parts, _: Known) -> Response:
    """Return a preview; nothing (204) until the worker has made it, which is no error."""
    try:
        key = preview_key(look_digest, name)
    except FieldError as error:
        raise NotFoundError(error.message) from error
    store = parts.services.store
    try:
        tag = f'"{store.stat(key).etag.strip(chr(34))}"'
    except NotFoundError:
        return Response(status_code=204, headers=SAFE | {"Cache-Control": "no-store"})
    headers = SAFE | {"ETag": tag, "Cache-Control": f"private, max-age={PICTURE_LIFE_S}"}
    if request.headers.get("if-none-match") == tag:
        return Response(status_code=304, headers=headers)
    return Response(store.get(key), media_type="image/png", headers=headers)


@router.get("/models/{asset_id}/{version}/{level}.glb")
def get_model(
    asset_id: str,
    version: Annotated[int, Path(ge=1, lt=10**8)],
    level: Annotated[int, Path(ge=0, lt=100)],
    parts: Parts,
    _: Known,
    download: bool = False,
) -> Response:
    """Return the GLB file of a level of detail of a version."""
    manifest = parts.library.get(asset_id, version).manifest
    if level >= len(manifest.levels):
        raise NotFoundError(f"asset {manifest.id} has levels 0 to {len(manifest.levels) - 1}, no level {level}")
    record = manifest.levels[level]
    headers: dict[str, Any] = SAFE | {
        "Content-Length": str(record.bytes),
        "Cache-Control": "private, max-age=31536000, immutable",
    }
    if download:
        # An id consists of characters that need no quoting.
        headers["Content-Disposition"] = f'attachment; filename="{manifest.id}_v{version}_level{level}.glb"'
    pieces: Iterator[bytes] = parts.services.store.stream(blob_key(record.sha256))
    return StreamingResponse(pieces, media_type=GLB, headers=headers)


@router.post("/files", status_code=201)
async def send_file(request: Request, response: Response, parts: Parts, _: MayCurate) -> blobs.BlobOut:
    """Store a file that is about to be imported, and say its digest."""
    return await blobs.post_blob(request, response, parts.services)
