"""Blobs: files that recipes refer to, by the digest of their content. Uploading one twice stores it once."""

from __future__ import annotations

import hashlib
import tempfile
from typing import Annotated

from fastapi import APIRouter, Path, Request, Response
from pydantic import BaseModel, ConfigDict, Field
from starlette.concurrency import run_in_threadpool

from fullwell.core import ConflictError, FieldError, NotFoundError
from fullwell.jobs.files import blob_key, check_digest
from fullwell_api.services import ServiceParts, Services

__all__ = ["router"]

router = APIRouter(tags=["blobs"])

SPOOL_BYTES = 4 << 20
WRITE_BYTES = 1 << 20
Digest = Annotated[str, Path(pattern="^[0-9a-f]{64}$", description="SHA-256 of the content.")]


class BlobOut(BaseModel):
    """A stored blob."""

    sha256: str
    bytes: int


class DigestList(BaseModel):
    """Digests to look for."""

    model_config = ConfigDict(extra="forbid")

    digests: list[str] = Field(max_length=10_000)


class MissingOut(BaseModel):
    """The digests that have not been uploaded."""

    missing: list[str]


@router.post("/blobs/missing", summary="Which blobs are to be uploaded")
def missing(wanted: DigestList, parts: ServiceParts) -> MissingOut:
    """Return those of the digests whose content is not here."""
    digests = [check_digest(digest, path="digests") for digest in dict.fromkeys(wanted.digests)]
    parts.library.hold(digests)  # who is told that a blob is here must find it here in a moment
    found = parts.threads.map(parts.store.exists, [blob_key(digest) for digest in digests])
    return MissingOut(missing=[digest for digest, there in zip(digests, found, strict=True) if not there])


@router.head("/blobs/{sha256}", summary="Whether a blob is here", response_class=Response)
def head_blob(sha256: Digest, parts: ServiceParts) -> Response:
    """Answer 200 or 404."""
    if not parts.store.exists(blob_key(sha256)):
        raise NotFoundError(f"the content {sha256} has not been uploaded")
    return Response()


@router.put("/blobs/{sha256}", status_code=201, summary="Upload a blob")
async def put_blob(sha256: Digest, request: Request, response: Response, parts: ServiceParts) -> BlobOut:
    """Store the request's body when its SHA-256 is the one in the address; 200 when it was here already."""
    return await _receive(request, response, parts, sha256)


@router.post("/blobs", status_code=201, summary="Upload a blob and learn its digest")
async def post_blob(request: Request, response: Response, parts: ServiceParts) -> BlobOut:
    """Store the request's body under its SHA-256; 200 when it was here already."""
    return await _receive(request, response, parts, None)


async def _receive(request: Request, response: Response, parts: Services, expected: str | None) -> BlobOut:
    digest, size = hashlib.sha256(), 0
    # Unnamed on disk: nothing is left behind when the process dies in the middle.
    with tempfile.SpooledTemporaryFile(max_size=SPOOL_BYTES) as body:
        pending = bytearray()
        async for piece in request.stream():
            digest.update(piece)
            size += len(piece)
            pending += piece
            if len(pending) >= WRITE_BYTES:
                await run_in_threadpool(body.write, bytes(pending))
                pending.clear()
        body.write(bytes(pending))
        found = digest.hexdigest()
        if expected is not None and found != expected:
            raise FieldError(
                f"the body's SHA-256 is {found}, not {expected}; it was cut or changed on its way. Upload it again.",
                "sha256",
                found,
            )
        body.seek(0)
        try:
            await run_in_threadpool(lambda: parts.store.put(blob_key(found), body, if_absent=True))  # type: ignore[arg-type]
        except ConflictError:
            response.status_code = 200
    return BlobOut(sha256=found, bytes=size)
