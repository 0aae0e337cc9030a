"""The asset store of a service: import models, follow their ingestion, search, review, edit, export."""

from __future__ import annotations

import json
import secrets
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

import httpx

from fullwell.client.models import collect_model
from fullwell.client.transport import Transport
from fullwell.core import FieldError, ServiceError, sha256_file, write_atomically

__all__ = ["Asset", "AssetClient", "AssetEvent", "AssetPage", "Import", "Ingestion"]

PAGE: Final = 200
ENDED: Final = frozenset({"done", "failed"})
JSON: Final = {"Content-Type": "application/json"}
ARCHIVE_TIMEOUT_S: Final = 3600.0


@dataclass(frozen=True, slots=True)
class Asset:
    """One version of an asset. `document` is the service's answer as it came, the manifest among it where one was asked for.

    `size_m` are the extents along x (forward), y (left) and z (up) [m]; `state` is pending, approved or rejected.
    """

    id: str
    version: int
    digest: str
    title: str
    asset_class: str
    tags: tuple[str, ...]
    licence: str
    state: str
    size_m: tuple[float, float, float]
    triangles: int
    needs_decision: bool
    document: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class AssetPage:
    """A part of what a search found; `total` counts all of it, `next_cursor` is empty on the last page."""

    assets: tuple[Asset, ...]
    total: int
    next_cursor: str


@dataclass(frozen=True, slots=True)
class AssetEvent:
    """Who did what to which version, and when; `detail` is a reason, or says what was changed."""

    kind: str
    version: int
    who: str
    at: datetime
    detail: str


@dataclass(frozen=True, slots=True)
class Ingestion:
    """Work on an asset: `state` is queued, running, done or failed. `asset_id` and `version` are set once it is stored."""

    id: str
    kind: str
    name: str
    who: str
    state: str
    stage: str
    fraction: float
    attempt: int
    asset_id: str
    version: int | None
    error: str
    error_code: str
    preview_error: str
    document: Mapping[str, Any]

    @property
    def ended(self) -> bool:
        """Whether nothing of it runs or waits any more."""
        return self.state in ENDED


@dataclass(frozen=True, slots=True)
class Import:
    """A model that was handed over: its ingestion, how many files it has, and how many of them had to be sent."""

    ingestion: Ingestion
    files: int
    sent: int
    sent_bytes: int


class AssetClient:
    """The assets of the service that a `FullwellClient` is connected to. A key of FULLWELL_CURATOR_KEYS may change them."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    # -- in and out ---------------------------------------------------------------------------------------------------

    def import_model(
        self,
        model: Path | str,
        *,
        asset_class: str,
        licence: str,
        attribution: str = "",
        licence_url: str = "",
        id: str = "",  # noqa: A002 - the asset's own word for it
        title: str = "",
        tags: Iterable[str] = (),
        unit_m: float | None = None,
        up_axis: str = "",
        forward_axis: str = "",
        length_m: float | None = None,
        variant: Mapping[str, str] | None = None,
        member: str = "",
        root: Path | None = None,
        idempotency_key: str = "",
    ) -> Import:
        """Upload a model with the files that it names, and have it ingested. What the service has is not sent again.

        Parameters
        ----------
        model
            GLB, glTF, OBJ, PLY, STL, USD, or a ZIP archive of one.
        licence
            SPDX expression, such as CC0-1.0.
        unit_m, length_m
            Metres per unit of the file, or the length that the asset is scaled to [m].
        member
            Which file of an archive is the model.
        root
            Folder whose files the model may take along; by default its own, for USD up to four above it.

        Raises
        ------
        FieldError
            The model does not exist or is of no format that is read.
        ApiError
            The service refuses it; `errors` lists the fields.
        """
        files = collect_model(Path(model), root=root)
        digests = {name: sha256_file(file) for name, file in files.items()}
        sent, sent_bytes = self._upload({digest: files[name] for name, digest in digests.items()})
        body: dict[str, Any] = {"main": files.main, "files": digests, "class": asset_class, "licence": licence}
        body |= {"attribution": attribution, "licence_url": licence_url, "id": id, "title": title, "tags": list(tags)}
        body |= {"unit_m": unit_m, "up_axis": up_axis, "forward_axis": forward_axis, "length_m": length_m}
        body |= {"variant": dict(variant or {}), "member": member}
        headers = JSON | {"Idempotency-Key": idempotency_key or secrets.token_hex(16)}
        answer = self._transport.json("POST", "/v1/assets", content=json.dumps(body), headers=headers)
        return Import(ingestion_from(answer), len(files), sent, sent_bytes)

    def _upload(self, files: Mapping[str, Path]) -> tuple[int, int]:
        body = json.dumps({"digests": list(files)})
        missing = self._transport.json("POST", "/v1/blobs/missing", content=body, headers=JSON)["missing"]
        for digest in missing:
            with files[digest].open("rb") as file:
                self._transport.upload(f"/v1/blobs/{digest}", file)
        return len(missing), sum(files[digest].stat().st_size for digest in missing)

    def ingestion(self, ingestion_id: str) -> Ingestion:
        """Return an ingestion as it is now."""
        return ingestion_from(self._transport.json("GET", f"/v1/assets/ingestions/{_step(ingestion_id)}"))

    def ingestions(self, *, limit: int = 50, state: str = "") -> list[Ingestion]:
        """Return the latest ingestions, newest first."""
        query = {"limit": str(min(limit, 1000))} | ({"state": state} if state else {})
        return [ingestion_from(item) for item in self._transport.json("GET", "/v1/assets/ingestions", params=query)["items"]]

    def retry(self, ingestion_id: str) -> Ingestion:
        """Queue a failed ingestion, or previews that failed, again. ConflictError where it has not failed."""
        path = f"/v1/assets/ingestions/{_step(ingestion_id)}/retry"
        return ingestion_from(self._transport.json("POST", path, safe_again=False))

    def wait(
        self,
        ingestion_id: str,
        *,
        progress: Callable[[Ingestion], None] | None = None,
        timeout_s: float | None = None,
        interval_s: float = 0.3,
        stored_is_enough: bool = False,
    ) -> Ingestion:
        """Return the ingestion when it has ended, or with `stored_is_enough` when the asset is there without previews.

        Raises
        ------
        ServiceError
            It has not ended within `timeout_s`.
        """
        started = time.monotonic()
        while True:
            now = self.ingestion(ingestion_id)
            if progress is not None:
                progress(now)
            if now.ended or (stored_is_enough and now.version is not None):
                return now
            if timeout_s is not None and time.monotonic() - started > timeout_s:
                raise ServiceError(f"ingestion {ingestion_id} has not ended within {timeout_s:g} s; it goes on running.")
            time.sleep(interval_s)

    def export(self, target: Path | str, *, ids: Iterable[str] = (), query: Mapping[str, Any] | None = None) -> None:
        """Write assets, by id or by search, with everything they need into one archive. It appears whole or not at all."""
        body = json.dumps(_selection(ids, query))
        timeout = httpx.Timeout(ARCHIVE_TIMEOUT_S, connect=10.0)
        with (
            write_atomically(Path(target)) as partial,
            self._transport.stream("/v1/assets/export", method="POST", content=body, headers=JSON, timeout=timeout) as answer,
            partial.open("wb") as sink,
        ):
            for piece in answer.iter_bytes(1 << 20):
                sink.write(piece)

    def import_archive(self, archive: Path | str, *, trust_states: bool = False) -> tuple[Asset, ...]:
        """Take in an archive that `export` wrote and return its assets.

        New versions are pending; with `trust_states` they are approved or rejected as they were where it was made.
        """
        path = f"/v1/assets/archives?trust_states={'true' if trust_states else 'false'}"
        with Path(archive).open("rb") as file:
            answer = self._transport.post_file(path, file, timeout_s=ARCHIVE_TIMEOUT_S)
        return _assets_from(answer)

    # -- looking ------------------------------------------------------------------------------------------------------

    def search(self, *, limit: int = PAGE, cursor: str = "", order: str = "", **conditions: Any) -> AssetPage:
        """Return a page of assets.

        Conditions are those of `GET /v1/assets`: asset_class, tags, without_tags, licences, states, text, ids, and min_ and
        max_ of length_m, width_m, height_m. Empty ones hold always.
        """
        params = _search_params(conditions) + [("limit", str(limit))]
        params += [(name, value) for name, value in (("cursor", cursor), ("order", order)) if value]
        answer = self._transport.json("GET", "/v1/assets", params=params)
        return AssetPage(tuple(asset_from(item) for item in answer["items"]), answer["total"], answer["next_cursor"] or "")

    def all(self, *, order: str = "", **conditions: Any) -> Iterator[Asset]:
        """Yield every asset that a search finds."""
        cursor = ""
        while True:
            page = self.search(cursor=cursor, order=order, **conditions)
            yield from page.assets
            cursor = page.next_cursor
            if not cursor:
                return

    def facets(self, **conditions: Any) -> dict[str, dict[str, int]]:
        """Return {field: {value: number of assets}} of what a search finds."""
        answer: dict[str, dict[str, int]] = self._transport.json("GET", "/v1/assets/facets", params=_search_params(conditions))
        return answer

    def get(self, asset_id: str, version: int | None = None) -> Asset:
        """Return an asset's newest version, or the given one, with its manifest."""
        path = f"/v1/assets/{_step(asset_id)}" + ("" if version is None else f"/versions/{version}")
        return asset_from(self._transport.json("GET", path))

    def versions(self, asset_id: str) -> list[Asset]:
        """Return all versions of an asset, newest first."""
        answer = self._transport.json("GET", f"/v1/assets/{_step(asset_id)}/versions")
        return [asset_from(item) for item in answer["items"]]

    def events(self, asset_id: str) -> list[AssetEvent]:
        """Return who did what to an asset, newest first."""
        items = self._transport.json("GET", f"/v1/assets/{_step(asset_id)}/events")["items"]
        return [
            AssetEvent(item["kind"], item["version"], item["who"], datetime.fromisoformat(item["at"]), item["detail"])
            for item in items
        ]

    def preview(self, asset_id: str, name: str = "thumb") -> bytes:
        """Return a picture (PNG): thumb, view_0 to view_7, turntable or chart. NotFoundError until it is rendered."""
        with self._transport.stream(f"/v1/assets/{_step(asset_id)}/preview/{quote(name, safe='')}") as answer:
            return answer.read()

    def level(self, asset_id: str, level: int = 0, *, version: int | None = None) -> bytes:
        """Return the GLB file of a level of detail, 0 the finest."""
        params = {} if version is None else {"version": str(version)}
        with self._transport.stream(f"/v1/assets/{_step(asset_id)}/files/{level}", params=params) as answer:
            return answer.read()

    # -- deciding -----------------------------------------------------------------------------------------------------

    def review(
        self, state: str, *, ids: Iterable[str] = (), query: Mapping[str, Any] | None = None, reason: str = ""
    ) -> tuple[Asset, ...]:
        """Approve, reject or put back to pending several assets, by id or by search: all or, where one is refused, none.

        A rejection needs a reason; so does an approval where a check of an asset asks for a decision.
        """
        body = json.dumps(_selection(ids, query) | {"state": state, "reason": reason})
        return _assets_from(self._transport.json("POST", "/v1/assets/review", content=body, headers=JSON))

    def edit(self, asset_id: str, changes: Mapping[str, Any], *, version: int | None = None) -> Asset:
        """Change an asset and return its new version. With `version` only where that is still the newest.

        Changes are those of `PATCH /v1/assets/{id}`: title, class, tags, add_tags, remove_tags, licence, attribution,
        licence_url, part_materials.
        """
        headers = JSON | ({} if version is None else {"If-Match": f'"{version}"'})
        path = f"/v1/assets/{_step(asset_id)}"
        return asset_from(self._transport.json("PATCH", path, content=json.dumps(dict(changes)), headers=headers))

    def edit_many(
        self, changes: Mapping[str, Any], *, ids: Iterable[str] = (), query: Mapping[str, Any] | None = None
    ) -> tuple[Asset, ...]:
        """Change several assets in the same way, by id or by search: all or, where one is refused, none."""
        body = json.dumps(_selection(ids, query) | {"changes": dict(changes)})
        return _assets_from(self._transport.json("PATCH", "/v1/assets", content=body, headers=JSON))

    def retire(self, asset_id: str, *, reason: str = "") -> Asset:
        """Take an asset out of the catalogue: it is found and drawn no more; what was made with it stays."""
        path = f"/v1/assets/{_step(asset_id)}"
        return asset_from(self._transport.json("DELETE", path, params={"reason": reason}))

    def render_previews(self, asset_id: str) -> Ingestion:
        """Have an asset's previews rendered again."""
        return ingestion_from(self._transport.json("POST", f"/v1/assets/{_step(asset_id)}/previews", safe_again=False))

    def collect_garbage(self, *, dry_run: bool = True) -> dict[str, Any]:
        """Remove what no version, job or frame refers to; return what went, or with `dry_run` would go."""
        body = json.dumps({"dry_run": dry_run})
        report: dict[str, Any] = self._transport.json("POST", "/v1/assets/gc", content=body, headers=JSON)
        return report

    def reindex(self) -> int:
        """Rebuild the catalogue from the object store; return the number of versions found."""
        return int(self._transport.json("POST", "/v1/assets/reindex", safe_again=False)["versions"])


def asset_from(document: Mapping[str, Any]) -> Asset:
    """Return the asset of an answer."""
    first, second, third = document["size_m"]
    return Asset(
        id=document["id"],
        version=document["version"],
        digest=document["digest"],
        title=document["title"],
        asset_class=document["class"],
        tags=tuple(document["tags"]),
        licence=document["licence"]["spdx"],
        state=document["state"],
        size_m=(first, second, third),
        triangles=document["triangles"],
        needs_decision=document["needs_decision"],
        document=document,
    )


def ingestion_from(document: Mapping[str, Any]) -> Ingestion:
    """Return the ingestion of an answer."""
    asset, error = document["asset"] or {}, document["error"] or {}
    return Ingestion(
        id=document["id"],
        kind=document["kind"],
        name=document["name"],
        who=document["who"],
        state=document["state"],
        stage=document["stage"],
        fraction=document["fraction"],
        attempt=document["attempt"],
        asset_id=asset.get("id", ""),
        version=asset.get("version"),
        error=error.get("message", ""),
        error_code=error.get("code", ""),
        preview_error=document["preview_error"],
        document=document,
    )


def _assets_from(document: Mapping[str, Any]) -> tuple[Asset, ...]:
    return tuple(asset_from(item) for item in document["items"])


def _selection(ids: Iterable[str], query: Mapping[str, Any] | None) -> dict[str, Any]:
    return {"ids": list(ids)} if query is None else {"query": _search_body(query)}


_NAMES: Final = {"asset_class": "class", "licences": "licence", "states": "state", "ids": "id"}


def _search_body(conditions: Mapping[str, Any]) -> dict[str, Any]:
    return {_NAMES.get(name, name): value for name, value in conditions.items() if value not in (None, "", (), [])}


def _search_params(conditions: Mapping[str, Any]) -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    for name, value in _search_body(conditions).items():
        values: Sequence[Any] = value if isinstance(value, list | tuple) else [value]
        found += [(name, str(item)) for item in values]
    return found


def _step(name: str) -> str:
    """Return an id that is safe as a part of an address."""
    if not name or name in (".", "..") or not all(character.isalnum() or character in "._-" for character in name):
        raise FieldError(f"{name[:80]!r} is not an id; `fullwell assets list` shows them.", "id", name[:80])
    return quote(name, safe="")
