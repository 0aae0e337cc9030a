"""The asset store: upload, ingest, search, review, edit, export."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, BinaryIO, Final, TypeVar

from fastapi import APIRouter, Header, Query, Request, Response
from fastapi import Path as PathParameter
from fastapi.exceptions import RequestValidationError
from fastapi.responses import RedirectResponse, StreamingResponse
from pydantic import BaseModel, ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.exceptions import HTTPException

from fullwell.assets.classes import ASSET_CLASSES
from fullwell.assets.query import AssetQuery
from fullwell.core import ConflictError, FieldError, NotFoundError, digest_of
from fullwell.jobs.asset_edits import edit_assets, edit_from
from fullwell.jobs.asset_records import AssetEntry, AssetOrder
from fullwell.jobs.asset_requests import AssetRequest
from fullwell.jobs.files import blob_key, relative_path
from fullwell.jobs.ingestions import IngestionState, NewIngestion, StoredAsset
from fullwell_api.asset_models import (
    ArchiveOut,
    AssetDetail,
    AssetEdit,
    AssetEventList,
    AssetImport,
    AssetList,
    AssetOut,
    AssetPageOut,
    AssetSearch,
    BulkEdit,
    BulkReview,
    ExportOrder,
    GarbageOrder,
    GarbageOut,
    IngestionOut,
    IngestionPage,
    ReindexOut,
    Review,
    asset_detail,
    asset_out,
    event_list,
    garbage_out,
    ingestion_out,
)
from fullwell_api.checks import check_blobs
from fullwell_api.guards import Curator
from fullwell_api.services import ServiceParts, Services
from fullwell_api.uploads import received_file, stored_upload

__all__ = ["queue_import", "queue_previews", "router"]

router = APIRouter(tags=["assets"])

Given = TypeVar("Given", bound=BaseModel)

GLB: Final = "model/gltf-binary"
PNG: Final = "image/png"
FOREVER: Final = "public, max-age=31536000, immutable"
URL_LIFE_S: Final = 3600
GARBAGE_AGE_S: Final = 86400.0
MAX_FORM_FILES: Final = 2000
UPLOAD_PRIORITY: Final = 0
"""Before all frames: somebody waits for it, and it takes seconds."""

AssetId = Annotated[str, PathParameter(min_length=1, max_length=80)]
VersionNumber = Annotated[int, PathParameter(ge=1, le=99_999_999)]
AnyVersion = Annotated[int | None, Query(ge=1, le=99_999_999, description="A version; the newest one where empty.")]
IngestionId = Annotated[str, PathParameter(min_length=1, max_length=64)]
IdempotencyKey = Annotated[str | None, Header(min_length=1, max_length=255, pattern=r"^[\x20-\x7e]+$")]
IfMatch = Annotated[str | None, Header(max_length=100, description='ETag of the asset, which is its version: "3".')]

_FORM_TEXTS: Final = tuple(name for name in AssetImport.model_fields if name not in ("files", "tags", "variant", "asset_class"))
_FORM_SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "required": ["files", "class", "licence"],
    "properties": {
        "files": {"type": "array", "items": {"type": "string", "format": "binary"}, "description": "Of one asset."},
        "class": {"type": "string"},
        "licence": {"type": "string", "description": "SPDX expression."},
        "tags": {"type": "string", "description": "Separated by commas."},
        "variant": {"type": "string", "description": "set=variant, separated by commas."},
        **{name: {"type": "string"} for name in _FORM_TEXTS if name != "licence"},
    },
}


# -- ingestion --------------------------------------------------------------------------------------------------------


@router.post(
    "/assets",
    status_code=202,
    summary="Import a model",
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {"schema": AssetImport.model_json_schema(ref_template="#/components/schemas/{model}")},
                "multipart/form-data": {"schema": _FORM_SCHEMA},
            },
        }
    },
)
async def import_asset(
    request: Request, response: Response, parts: ServiceParts, caller: Curator, idempotency_key: IdempotencyKey = None
) -> IngestionOut:
    """Queue the ingestion of one model: as a form with its files, or as JSON that names blobs that are uploaded already."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().casefold()
    if kind == "multipart/form-data":
        given = await _from_form(request, parts)
    elif kind == "application/json":
        given = _validated(AssetImport, await request.body())
    else:
        raise HTTPException(415, "send multipart/form-data with the files, or application/json that names uploaded blobs")
    wanted = given.request()
    record = await run_in_threadpool(queue_import, parts, wanted, caller.name, idempotency_key)
    response.headers["Location"] = record.links.self
    return record


async def _from_form(request: Request, parts: Services) -> AssetImport:
    """Store the files of a form as blobs; return what the form asks for."""
    async with request.form(max_files=MAX_FORM_FILES, max_fields=100) as form:
        fields: dict[str, Any] = {"files": {}}
        for name, value in form.multi_items():
            if isinstance(value, UploadFile):
                path = relative_path(value.filename or "", path="files")
                fields["files"][path] = await run_in_threadpool(stored_upload, parts.store, value.file)
            elif name == "tags":
                fields["tags"] = [*fields.get("tags", []), *_split(value)]
            elif name == "variant":
                fields["variant"] = fields.get("variant", {}) | dict(_pair(item) for item in _split(value))
            elif value != "":
                fields[name] = value
    if not fields["files"]:
        raise FieldError("the form holds no file. Send the model, and what it refers to, as files.", "files")
    return _validated(AssetImport, json.dumps(fields))


def queue_import(parts: Services, wanted: AssetRequest, who: str, idempotency_key: str | None) -> IngestionOut:
    """Queue the ingestion of uploaded files. Raises FieldError where one of them has not been uploaded."""
    # Held before they are looked for: what is there now stays until the ingestion's row refers to it.
    parts.library.hold(wanted.files.values())
    check_blobs(parts, wanted.files)
    text = wanted.to_json()
    record, _ = parts.ingestions.create(
        NewIngestion("upload", wanted.main, who, text, digest_of([text]), UPLOAD_PRIORITY, idempotency_key)
    )
    parts.dispatcher.wake()
    return ingestion_out(record)


@router.get("/assets/ingestions", summary="List ingestions, newest first")
def list_ingestions(
    parts: ServiceParts,
    limit: Annotated[int, Query(ge=1, le=1000)] = 50,
    cursor: Annotated[str | None, Query(max_length=64, description="next_cursor of the page before.")] = None,
    state: IngestionState | None = None,
    asset: Annotated[str, Query(max_length=80, description="Only those of one asset.")] = "",
) -> IngestionPage:
    """Return a page of ingestions."""
    found = parts.ingestions.recent(limit=limit + 1, before=cursor, state=state, asset_id=asset)
    more = len(found) > limit
    items = [ingestion_out(record) for record in found[:limit]]
    return IngestionPage(items=items, next_cursor=found[limit - 1].id if more else None)


@router.get("/assets/ingestions/{ingestion_id}", summary="An ingestion as it is now")
def get_ingestion(ingestion_id: IngestionId, parts: ServiceParts) -> IngestionOut:
    """Return state, progress, and what came out: the asset and its checks, or the error."""
    return ingestion_out(parts.ingestions.get(ingestion_id))


@router.post("/assets/ingestions/{ingestion_id}/retry", status_code=202, summary="Try a failed ingestion again")
def retry_ingestion(ingestion_id: IngestionId, parts: ServiceParts, caller: Curator) -> IngestionOut:
    """Queue a failed ingestion, or previews that failed, again."""
    record = parts.ingestions.retry(ingestion_id)
    parts.dispatcher.wake()
    return ingestion_out(record)


# -- search -----------------------------------------------------------------------------------------------------------


class ClassOut(BaseModel):
    """A class and the extents that are plausible for it [m]."""

    name: str
    group: str
    length_m: tuple[float, float]
    width_m: tuple[float, float]
    height_m: tuple[float, float]
    subclasses: dict[str, tuple[float, float]]


class ClassList(BaseModel):
    """All classes."""

    items: list[ClassOut]


@router.get("/assets/classes", summary="What an asset can be")
def list_classes() -> ClassList:
    """Return all classes; a tag of `subclasses` has a narrower length."""
    return ClassList(
        items=[
            ClassOut(
                name=entry.name,
                group=entry.group,
                length_m=entry.length_m,
                width_m=entry.width_m,
                height_m=entry.height_m,
                subclasses=dict(entry.subclasses),
            )
            for entry in ASSET_CLASSES.values()
        ]
    )


class _Page(AssetSearch):
    """Conditions, and which page."""

    cursor: Annotated[str, Query(max_length=2000, description="next_cursor of the page before.")] = ""
    limit: Annotated[int, Query(ge=1, le=500)] = 50
    order: AssetOrder = "id"


@router.get("/assets", summary="Search assets")
def search(parts: ServiceParts, given: Annotated[_Page, Query()]) -> AssetPageOut:
    """Return a page of the assets that meet all conditions, by their newest versions."""
    page = parts.library.search(given.query(), order=given.order, cursor=given.cursor, limit=given.limit)
    return AssetPageOut(
        items=[asset_out(entry) for entry in page.entries], total=page.total, next_cursor=page.next_cursor or None
    )


@router.get("/assets/facets", summary="Count what a search finds by class, tag, licence and state")
def facets(parts: ServiceParts, given: Annotated[AssetSearch, Query()]) -> dict[str, dict[str, int]]:
    """Return {field: {value: number of assets}}."""
    return {field: dict(counts) for field, counts in parts.library.facets(given.query()).items()}


# -- several at once --------------------------------------------------------------------------------------------------


@router.patch("/assets", summary="Change several assets")
def edit_many(given: BulkEdit, parts: ServiceParts, caller: Curator) -> AssetList:
    """Make the same change to several assets: all of them or, where one is refused, none."""
    ids = _chosen(parts, given.ids, given.query)
    return AssetList(items=[asset_out(entry) for entry in _edited(parts, ids, given.changes, caller.name, None)])


@router.post("/assets/review", summary="Decide about several assets")
def review_many(given: BulkReview, parts: ServiceParts, caller: Curator) -> AssetList:
    """Approve, reject or put back several assets: all of them or, where one is refused, none."""
    ids = _chosen(parts, given.ids, given.query)
    entries = parts.library.review(ids, given.state, who=caller.name, reason=given.reason)
    return AssetList(items=[asset_out(entry) for entry in entries])


@router.post(
    "/assets/export",
    summary="Export assets as one archive",
    response_class=Response,
    responses={200: {"content": {"application/zip": {}}}},
)
def export(given: ExportOrder, parts: ServiceParts) -> Response:
    """Send manifests, files, previews and licences of the chosen assets; any service can import them."""
    chosen: AssetQuery | list[str] = given.query.query() if given.query is not None else _chosen(parts, given.ids, None)
    folder = Path(tempfile.mkdtemp(prefix="fullwell-export-"))
    try:
        report = parts.library.export(chosen, folder / "assets.zip")
        file = report.path.open("rb")
    finally:
        shutil.rmtree(folder, ignore_errors=True)  # the open file lives on until it is sent, however this process ends
    headers = {
        "Content-Length": str(report.bytes),
        "Content-Disposition": 'attachment; filename="assets.zip"',
        "ETag": f'"{report.sha256}"',
        "X-Content-Type-Options": "nosniff",
    }
    return StreamingResponse(_pieces(file), media_type="application/zip", headers=headers)


@router.post("/assets/archives", summary="Import an archive that was exported")
async def import_archive(request: Request, parts: ServiceParts, caller: Curator, trust_states: bool = False) -> ArchiveOut:
    """Take the request's body for an archive; it is verified as a whole before anything of it is stored.

    New versions are pending; with `trust_states` they are approved or rejected as they were where the archive was made.
    """
    async with received_file(request) as file:
        entries = await run_in_threadpool(parts.library.import_archive, file, who=caller.name, trust_states=trust_states)
    return ArchiveOut(items=[asset_out(entry) for entry in entries])


@router.post("/assets/gc", summary="Remove what nothing refers to")
def collect_garbage(given: GarbageOrder, parts: ServiceParts, caller: Curator) -> GarbageOut:
    """Remove blobs and previews that no version, job or ingestion refers to; by default only say what would go."""
    return garbage_out(parts.library.collect_garbage(dry_run=given.dry_run, min_age_s=GARBAGE_AGE_S))


@router.post("/assets/reindex", summary="Make the catalogue anew from the object store")
def reindex(parts: ServiceParts, caller: Curator) -> ReindexOut:
    """Read all version and event files again: they are the truth, the database an index."""
    return ReindexOut(versions=parts.library.reindex())


# -- one asset --------------------------------------------------------------------------------------------------------


@router.get("/assets/{asset_id}", summary="An asset")
def get_asset(asset_id: AssetId, response: Response, parts: ServiceParts) -> AssetDetail:
    """Return the newest version with its manifest; its ETag is the version."""
    return _detail(parts, parts.library.get(asset_id), response)


@router.patch("/assets/{asset_id}", summary="Change an asset")
def edit(
    asset_id: AssetId,
    given: AssetEdit,
    response: Response,
    *,
    parts: ServiceParts,
    caller: Curator,
    if_match: IfMatch = None,
) -> AssetOut:
    """Make a new version with some fields changed. `If-Match` makes sure that nobody else has changed it meanwhile (412)."""
    with _precondition(if_match):
        entry = _edited(parts, [asset_id], given, caller.name, _version_of(if_match))[0]
    response.headers["ETag"] = f'"{entry.version}"'
    return asset_out(entry)


@router.post("/assets/{asset_id}/review", summary="Decide about an asset")
def review(
    asset_id: AssetId,
    given: Review,
    response: Response,
    *,
    parts: ServiceParts,
    caller: Curator,
    if_match: IfMatch = None,
) -> AssetOut:
    """Approve it, reject it with a reason, or put it back; an approval needs a reason where a check asks for a decision."""
    with _precondition(if_match):
        entry = parts.library.review(
            [asset_id], given.state, who=caller.name, reason=given.reason, expected_version=_version_of(if_match)
        )[0]
    response.headers["ETag"] = f'"{entry.version}"'
    return asset_out(entry)


@router.delete("/assets/{asset_id}", summary="Take an asset out of the catalogue")
def retire(
    asset_id: AssetId, parts: ServiceParts, caller: Curator, reason: Annotated[str, Query(max_length=2000)] = ""
) -> AssetOut:
    """Retire an asset: searches and draws no longer find it; what was made with it stays as it is. Importing it restores it."""
    return asset_out(parts.library.retire(asset_id, who=caller.name, reason=reason))


@router.get("/assets/{asset_id}/versions", summary="All versions of an asset")
def versions(asset_id: AssetId, parts: ServiceParts) -> AssetList:
    """Return all versions, newest first."""
    return AssetList(items=[asset_out(entry) for entry in parts.library.versions(asset_id)])


@router.get("/assets/{asset_id}/versions/{version}", summary="One version of an asset")
def get_version(asset_id: AssetId, version: VersionNumber, response: Response, parts: ServiceParts) -> AssetDetail:
    """Return a version with its manifest."""
    return _detail(parts, parts.library.get(asset_id, version), response)


@router.get("/assets/{asset_id}/events", summary="Who did what to an asset, and when")
def events(asset_id: AssetId, parts: ServiceParts) -> AssetEventList:
    """Return imports, edits and decisions, newest first."""
    return event_list(parts.library.events(asset_id))


@router.get(
    "/assets/{asset_id}/files/{level}",
    summary="The model, at a level of detail",
    response_class=Response,
    responses={200: {"content": {GLB: {}}}, 304: {"description": "Unchanged."}, 307: {"description": "At the object store."}},
)
def get_level(
    asset_id: AssetId,
    level: Annotated[int, PathParameter(ge=0, le=100, description="0 is the finest.")],
    request: Request,
    parts: ServiceParts,
    version: AnyVersion = None,
) -> Response:
    """Send the GLB file (metres, y up), or redirect to it where FULLWELL_PRESIGN_PRODUCTS is set."""
    levels = parts.library.get(asset_id, version).manifest.levels
    if level >= len(levels):
        raise NotFoundError(f"asset {asset_id!r} has no level {level}; its levels are 0 to {len(levels) - 1}")
    record = levels[level]
    key = blob_key(record.sha256)
    if parts.settings.presign_products and (url := parts.store.presigned_url(key, URL_LIFE_S)) is not None:
        return RedirectResponse(url, status_code=307)
    return _content(request, parts, key, etag=record.sha256, media_type=GLB, pinned=version is not None)


@router.get(
    "/assets/{asset_id}/preview/{name}",
    summary="A picture of an asset",
    response_class=Response,
    responses={200: {"content": {PNG: {}}}, 304: {"description": "Unchanged."}},
)
def get_preview(asset_id: AssetId, name: str, request: Request, parts: ServiceParts, version: AnyVersion = None) -> Response:
    """Send a picture: thumb, view_0 to view_7, turntable (all views) or chart (its materials and their spectra)."""
    manifest = parts.library.get(asset_id, version).manifest
    try:
        key = parts.library.preview_key(manifest.look_digest, name.removesuffix(".png"))
        etag = parts.store.stat(key).etag.strip('"')
    except (NotFoundError, FieldError):
        there = ", ".join(parts.library.preview_names(manifest.look_digest)) or "none yet; a worker renders them"
        raise NotFoundError(f"asset {asset_id!r} has no picture {name[:80]!r}. There are: {there}") from None
    # Pictures can be rendered again, so a browser asks whether its copy is still the one.
    return _content(request, parts, key, etag=etag, media_type=PNG, pinned=False)


@router.post("/assets/{asset_id}/previews", status_code=202, summary="Render the pictures of an asset again")
def render_previews(asset_id: AssetId, response: Response, parts: ServiceParts, caller: Curator) -> IngestionOut:
    """Queue new pictures of the newest version; the present ones stay until then."""
    record = queue_previews(parts, parts.library.get(asset_id), caller.name)
    response.headers["Location"] = record.links.self
    return record


def queue_previews(parts: Services, entry: AssetEntry, who: str) -> IngestionOut:
    """Queue the rendering of a version's pictures."""
    text = json.dumps({"asset": entry.id, "version": entry.version})
    stored = StoredAsset(entry.id, entry.version)
    record, _ = parts.ingestions.create(NewIngestion("previews", entry.id, who, text, digest_of([text]), stored=stored))
    parts.dispatcher.wake()
    return ingestion_out(record)


# -- parts ------------------------------------------------------------------------------------------------------------


def _detail(parts: Services, entry: AssetEntry, response: Response) -> AssetDetail:
    response.headers["ETag"] = f'"{entry.version}"'
    return asset_detail(entry, parts.library.preview_names(entry.manifest.look_digest))


def _chosen(parts: Services, ids: list[str], query: AssetSearch | None) -> list[str]:
    """Return the ids of a selection: as given, or all that a search finds."""
    if query is None:
        if not ids:
            raise FieldError("ids is empty and there is no query; nothing is chosen.", "ids")
        return ids
    if ids:
        raise FieldError("ids and query are both given; give one of them.", "query")
    found: list[str] = []
    cursor = ""
    while True:
        page = parts.library.search(query.query(), cursor=cursor, limit=500)
        found += [entry.id for entry in page.entries]
        if not (cursor := page.next_cursor):
            break
    if not found:
        raise NotFoundError("no asset meets these conditions; nothing was changed")
    return found


def _edited(
    parts: Services, ids: list[str], given: AssetEdit, who: str, expected_version: int | None
) -> tuple[AssetEntry, ...]:
    edits = edit_from(given.model_dump(by_alias=True, exclude_unset=True))
    return edit_assets(parts.library, ids, edits, who=who, expected_version=expected_version)


def _version_of(if_match: str | None) -> int | None:
    if if_match is None or if_match.strip() == "*":
        return None
    text = if_match.strip().removeprefix("W/").strip('"')
    if not text.isascii() or not text.isdigit():
        raise FieldError(
            f'If-Match is {if_match[:40]!r}; must be the ETag of the asset, such as "3".', "If-Match", if_match[:40]
        )
    return int(text)


@contextmanager
def _precondition(if_match: str | None) -> Iterator[None]:
    """Answer 412 where the asset is not at the version that the request names."""
    try:
        yield
    except ConflictError as error:
        if if_match is None:
            raise
        raise HTTPException(412, str(error)) from error


def _content(request: Request, parts: Services, key: str, *, etag: str, media_type: str, pinned: bool) -> Response:
    headers = {
        "ETag": f'"{etag}"',
        # What belongs to one version never changes; what belongs to "the newest" may.
        "Cache-Control": FOREVER if pinned else "no-cache",
        # The bytes come from others' files: a browser may show them, but run nothing.
        "X-Content-Type-Options": "nosniff",
        "Content-Security-Policy": "default-src 'none'; sandbox",
    }
    if f'"{etag}"' in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    headers["Content-Length"] = str(parts.store.stat(key).size)
    return StreamingResponse(parts.store.stream(key), media_type=media_type, headers=headers)


def _pieces(file: BinaryIO) -> Iterator[bytes]:
    with file:
        while piece := file.read(1 << 20):
            yield piece


def _validated(model: type[Given], body: bytes | str) -> Given:
    try:
        return model.model_validate_json(body)
    except ValidationError as error:
        raise RequestValidationError(error.errors(include_url=False)) from None


def _split(value: str) -> list[str]:
    return [part.strip() for part in value.split(",") if part.strip()]


def _pair(text: str) -> tuple[str, str]:
    name, equals, choice = text.partition("=")
    if not equals:
        raise FieldError(f"variant is {text[:80]!r}; write set=variant.", "variant", text[:80])
    return name.strip(), choice.strip()
