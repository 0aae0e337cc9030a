"""Documents of the HTTP interface to the asset store."""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from fullwell.assets.query import AssetQuery, ReviewState
from fullwell.assets.records import LicenceRecord
from fullwell.jobs.asset_documents import asset_detail_document, asset_document, event_document
from fullwell.jobs.asset_records import AssetEntry, AssetEvent, GarbageReport
from fullwell.jobs.asset_requests import AssetRequest
from fullwell.jobs.ingestions import IngestionKind, IngestionRecord, IngestionState
from fullwell_api.models import ErrorOut

__all__ = [
    "ArchiveOut",
    "AssetDetail",
    "AssetEdit",
    "AssetEventList",
    "AssetImport",
    "AssetList",
    "AssetOut",
    "AssetPageOut",
    "AssetSearch",
    "BulkEdit",
    "BulkReview",
    "ExportOrder",
    "GarbageOrder",
    "GarbageOut",
    "IngestionOut",
    "IngestionPage",
    "ReindexOut",
    "Review",
    "asset_detail",
    "asset_out",
    "event_list",
    "garbage_out",
    "ingestion_out",
]

Size = Annotated[float | None, Field(default=None, ge=0, le=1e5, allow_inf_nan=False)]
Words = Annotated[list[str], Field(max_length=1000)]


class _Given(BaseModel):
    model_config = ConfigDict(extra="forbid", populate_by_name=True)


class AssetImport(_Given):
    """A model to be ingested, from blobs that are uploaded already."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "main": "car.glb",
                    "files": {
                        "car.glb": "2c26b46b68ffc68ff99b453c1d30413413422d706483bfa0f98a5e886266e7ae",
                        "Textures/colormap.png": "fcde2b2edba56bf408601fb721fe9b5c338d10ee429ea04fae5511b68fbf8fb9",
                    },
                    "class": "car",
                    "licence": "CC0-1.0",
                    "attribution": "Kenney",
                    "tags": ["sedan"],
                    "length_m": 4.4,
                }
            ]
        }
    )

    files: dict[str, str] = Field(min_length=1, description="Relative path: SHA-256 of an uploaded blob.")
    main: str = Field(default="", description="The model among the files; may be left out where only one can be it.")
    asset_class: str = Field(alias="class", description="What it is, such as car; GET /v1/assets/classes lists all.")
    licence: str = Field(description="SPDX expression, such as CC0-1.0.")
    attribution: str = Field(default="", description="Whom to name.")
    licence_url: str = Field(default="", description="Where the licence is stated.")
    id: str = Field(default="", description="Made from the file's name where empty. A known id gets another version.")
    title: str = ""
    tags: Words = []
    unit_m: Size = Field(default=None, description="Metres per unit of the file; detected where empty.")
    up_axis: str = Field(default="", description="Axis of the file that points up: x, -x, y, -y, z or -z.")
    forward_axis: str = Field(default="", description="Axis of the file that points forward.")
    length_m: Size = Field(default=None, description="Length along x that the asset is scaled to [m].")
    variant: dict[str, str] = Field(default_factory=dict, description="USD variant set: variant.")
    member: str = Field(default="", description="Which file of an archive is the model.")

    def request(self) -> AssetRequest:
        """Return the checked request; FieldError names the first field that is not legal."""
        return AssetRequest(
            files=self.files,
            main=self.main,
            asset_class=self.asset_class,
            licence=LicenceRecord(self.licence, self.attribution, self.licence_url),
            id=self.id,
            title=self.title,
            tags=tuple(self.tags),
            unit_m=self.unit_m,
            up_axis=self.up_axis,
            forward_axis=self.forward_axis,
            length_m=self.length_m,
            variant=self.variant,
            member=self.member,
        ).checked()


class AssetSearch(_Given):
    """Conditions that all must hold; empty ones hold always. Sizes are along x (forward), y and z [m]."""

    asset_class: str = Field(default="", alias="class")
    tags: Words = []
    without_tags: Words = []
    licence: Words = []
    state: list[ReviewState] = Field(default=[], description="Any of these; every state where empty.")
    text: str = Field(default="", max_length=500, description="Words that all must begin a word of the asset's texts.")
    id: Words = Field(default=[], description="One of these assets.")
    min_length_m: Size = None
    max_length_m: Size = None
    min_width_m: Size = None
    max_width_m: Size = None
    min_height_m: Size = None
    max_height_m: Size = None

    def query(self) -> AssetQuery:
        """Return the query; FieldError for an unknown class, an illegal tag, or an empty range."""
        return AssetQuery(
            asset_class=self.asset_class,
            tags=tuple(self.tags),
            without_tags=tuple(self.without_tags),
            licences=tuple(self.licence),
            states=tuple(self.state),
            text=self.text,
            length_m=(self.min_length_m, self.max_length_m),
            width_m=(self.min_width_m, self.max_width_m),
            height_m=(self.min_height_m, self.max_height_m),
            ids=tuple(self.id),
        )


class _Selection(_Given):
    """Assets by id, or by a search."""

    ids: list[str] = Field(default=[], max_length=10_000)
    query: AssetSearch | None = Field(default=None, description="In place of ids: every asset that this finds.")


class Review(_Given):
    """A decision about an asset."""

    state: ReviewState
    reason: str = Field(default="", description="Needed to reject, and to approve where a check asks for a decision.")


class BulkReview(_Selection):
    """A decision about several assets; all of them or, where one is refused, none."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"query": {"class": "car", "tags": ["sedan"]}, "state": "approved", "reason": "looked at"}]
        }
    )

    state: ReviewState
    reason: str = ""


class AssetEdit(_Given):
    """What to change; fields that are left out stay. The change is a new version, in the state of the one before."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"title": "Estate, red", "add_tags": ["estate"]}]})

    title: str | None = None
    asset_class: str | None = Field(default=None, alias="class")
    tags: list[str] | None = Field(default=None, description="In place of all present ones.")
    add_tags: Words = []
    remove_tags: Words = []
    licence: str | None = None
    attribution: str | None = None
    licence_url: str | None = None
    part_materials: dict[str, str] = Field(default_factory=dict, description="Part: entry of the catalogue, like paint/red.")


class BulkEdit(_Selection):
    """The same change for several assets; all of them or, where one is refused, none."""

    changes: AssetEdit


class ExportOrder(_Selection):
    """Assets to be written into one archive."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"query": {"class": "car", "state": ["approved"]}}]})


class GarbageOrder(_Given):
    """Whether to remove what nothing refers to, or only to say what would go."""

    dry_run: bool = True


class LicenceOut(BaseModel):
    """Under what terms an asset may be used."""

    spdx: str
    attribution: str
    url: str


class AssetLinks(BaseModel):
    """Addresses of an asset's parts, below the service's root."""

    self: str
    thumb: str
    file: str
    versions: str
    events: str


class AssetOut(BaseModel):
    """One version of an asset. `size_m` are the extents along x (forward), y (left), z (up) [m]."""

    id: str
    version: int
    digest: str
    title: str
    asset_class: str = Field(alias="class")
    tags: list[str]
    licence: LicenceOut
    state: ReviewState
    size_m: tuple[float, float, float]
    triangles: int
    levels: int
    needs_decision: bool
    retired: bool
    created_at: datetime
    created_by: str
    reviewed_at: datetime | None
    reviewed_by: str
    reason: str
    links: AssetLinks

    model_config = ConfigDict(populate_by_name=True)


class AssetDetail(AssetOut):
    """A version with its manifest (schema fullwell/asset/v1) and the names of its previews."""

    manifest: dict[str, Any]
    previews: list[str]


class AssetPageOut(BaseModel):
    """Part of what a search found; `total` counts all of it, `next_cursor` is empty on the last page."""

    items: list[AssetOut]
    total: int
    next_cursor: str | None = None


class AssetList(BaseModel):
    """Versions of an asset, newest first; or what a change left."""

    items: list[AssetOut]


class AssetEventOut(BaseModel):
    """Who did what to which version, and when; `detail` is a reason, or says what was changed."""

    kind: str
    version: int
    who: str
    at: datetime
    detail: str


class AssetEventList(BaseModel):
    """Events of an asset, newest first."""

    items: list[AssetEventOut]


class StoredOut(BaseModel):
    """The version that an ingestion made."""

    id: str
    version: int


class IngestionLinks(BaseModel):
    """Addresses, below the service's root."""

    self: str
    asset: str | None


class IngestionOut(BaseModel):
    """Work on an asset. `asset` and `checks` are there once it is stored; previews follow. `fraction` is in [0, 1]."""

    id: str
    kind: IngestionKind
    name: str
    who: str
    state: IngestionState
    stage: str
    fraction: float
    attempt: int
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    error: ErrorOut | None
    asset: StoredOut | None
    checks: list[dict[str, Any]]
    preview_error: str
    links: IngestionLinks


class IngestionPage(BaseModel):
    """Ingestions, newest first; `next_cursor` is empty on the last page."""

    items: list[IngestionOut]
    next_cursor: str | None = None


class ArchiveOut(BaseModel):
    """What an archive brought: the versions that are new here."""

    items: list[AssetOut]


class GarbageOut(BaseModel):
    """What garbage collection removed, or with `dry_run` would remove."""

    dry_run: bool
    blobs: int
    previews: int
    bytes: int
    versions: int
    kept: int
    young: int


class ReindexOut(BaseModel):
    """How many versions the object store holds."""

    versions: int


def _time(seconds: float | None) -> datetime | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)


def asset_out(entry: AssetEntry) -> AssetOut:
    """Return the document of a version."""
    return AssetOut(**asset_document(entry))


def asset_detail(entry: AssetEntry, previews: Sequence[str]) -> AssetDetail:
    """Return the document of a version with its manifest."""
    return AssetDetail(**asset_detail_document(entry, previews))


def event_list(events: Sequence[AssetEvent]) -> AssetEventList:
    """Return the document of an asset's events."""
    return AssetEventList(items=[AssetEventOut(**event_document(event)) for event in events])


def ingestion_out(record: IngestionRecord) -> IngestionOut:
    """Return the document of an ingestion."""
    stored = record.stored
    error = None if record.error is None else ErrorOut(code=record.error_code or "error", message=record.error)
    return IngestionOut(
        id=record.id,
        kind=record.kind,
        name=record.name,
        who=record.who,
        state=record.state,
        stage=record.stage,
        fraction=record.fraction,
        attempt=record.attempt,
        created_at=datetime.fromtimestamp(record.created_at, UTC),
        started_at=_time(record.started_at),
        finished_at=_time(record.finished_at),
        error=error,
        asset=None if stored is None else StoredOut(id=stored.asset_id, version=stored.version),
        checks=[] if stored is None else json.loads(stored.checks_json),
        preview_error=record.preview_error,
        links=IngestionLinks(
            self=f"/v1/assets/ingestions/{record.id}",
            asset=None if stored is None else f"/v1/assets/{stored.asset_id}",
        ),
    )


def garbage_out(report: GarbageReport) -> GarbageOut:
    """Return the document of a garbage collection."""
    return GarbageOut(**{name: getattr(report, name) for name in GarbageOut.model_fields})
