"""Products of frames: list, and read from the object store, which is the truth about results."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Annotated, Any

from fastapi import APIRouter, Path, Response
from fastapi.responses import RedirectResponse, StreamingResponse

from fullwell.core import FieldError, NotFoundError
from fullwell.jobs.files import relative_path
from fullwell.jobs.states import FrameState
from fullwell.storage import ObjectStore
from fullwell_api.models import ProductList, ProductOut
from fullwell_api.services import ServiceParts, Services

__all__ = ["router"]

router = APIRouter(tags=["products"])

MANIFEST = "manifest.json"
URL_LIFE_S = 3600

FrameNumber = Annotated[int, Path(ge=0, le=2**31 - 1)]


def _prefix(job_id: str, number: int) -> str:
    return f"jobs/{job_id}/frames/{number}"


def _manifest(store: ObjectStore, prefix: str) -> dict[str, Any]:
    manifest: dict[str, Any] = json.loads(store.get(f"{prefix}/{MANIFEST}"))
    return manifest


@router.get("/jobs/{job_id}/frames/{number}/products", summary="The products of a frame")
def list_products(job_id: str, number: FrameNumber, parts: ServiceParts) -> ProductList:
    """Return names, sizes and digests, manifest included; none until the frame is done."""
    frame = parts.repository.frame(job_id, number)
    if frame.state != FrameState.DONE:
        return ProductList(items=[])
    prefix = _prefix(job_id, number)
    manifest = _manifest(parts.store, prefix)
    info = parts.store.stat(f"{prefix}/{MANIFEST}")
    here = f"/v1/jobs/{job_id}/frames/{number}/products"
    items = [
        ProductOut(
            name=product["name"],
            bytes=product["bytes"],
            sha256=product["sha256"],
            content_type=product.get("content_type", "application/octet-stream"),
            url=f"{here}/{product['name']}",
        )
        for product in manifest.get("products", [])
    ]
    items.append(
        ProductOut(name=MANIFEST, bytes=info.size, sha256=None, content_type=info.content_type, url=f"{here}/{MANIFEST}")
    )
    return ProductList(items=items)


@router.get(
    "/jobs/{job_id}/frames/{number}/products/{name:path}",
    summary="One product",
    response_class=Response,
    responses={200: {"content": {"application/octet-stream": {}}}, 307: {"description": "At the object store."}},
)
def get_product(job_id: str, number: FrameNumber, name: str, parts: ServiceParts) -> Response:
    """Send a product of a frame that is done, or redirect to it where FULLWELL_PRESIGN_PRODUCTS is set."""
    key = _product_key(parts, job_id, number, name)
    if parts.settings.presign_products and (url := parts.store.presigned_url(key, URL_LIFE_S)) is not None:
        return RedirectResponse(url, status_code=307)
    info = parts.store.stat(key)
    headers = {
        "Content-Length": str(info.size),
        "ETag": f'"{info.etag.strip(chr(34))}"',
        # The bytes come from recipes of others: a browser may show a picture, but run nothing.
        "X-Content-Type-Options": "nosniff",
        "Content-Security-Policy": "default-src 'none'; sandbox",
    }
    pieces: Iterator[bytes] = parts.store.stream(key)
    return StreamingResponse(pieces, media_type=info.content_type, headers=headers)


def _product_key(parts: Services, job_id: str, number: int, name: str) -> str:
    frame = parts.repository.frame(job_id, number)
    if frame.state != FrameState.DONE:
        raise NotFoundError(f"frame {number} of job {job_id} is {frame.state}; its products appear when it is done")
    try:
        normal = relative_path(name, path="product")
    except FieldError:
        normal = ""
    if not normal or normal != name:
        raise NotFoundError(f"frame {number} of job {job_id} has no product {name[:100]!r}")
    prefix = _prefix(job_id, number)
    known = [MANIFEST, *(product["name"] for product in _manifest(parts.store, prefix).get("products", []))]
    if normal not in known:
        raise NotFoundError(f"frame {number} of job {job_id} has no product {name[:100]!r}; it has {', '.join(sorted(known))}")
    return f"{prefix}/{normal}"
