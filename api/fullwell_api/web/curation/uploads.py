"""Imports from the page: what was sent becomes an ingestion, which is followed until its previews are there."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from nicegui import ui

from fullwell.core import FullwellError
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.asset_requests import AssetRequest
from fullwell.jobs.ingestions import IngestionRecord, IngestionState
from fullwell_api.routes.assets import queue_import
from fullwell_api.web.curation import dialogs
from fullwell_api.web.curation.components import Uploader
from fullwell_api.web.curation.dialogs import UploadTerms
from fullwell_api.web.curation.words import picture

if TYPE_CHECKING:
    from fullwell_api.web.curation.page import CurationPage

__all__ = ["Uploads", "row_of"]

POLL_S: Final = 1.0
ADOPTED: Final = 20
SHOWN_CHECKS: Final = 3
STAGES: Final = {"": "reading the model", "previews": "rendering previews"}


@dataclass
class _Followed:
    """An ingestion in the list: its row, and what of it was shown last."""

    row: str
    ingestion: str
    stored: bool = False
    shown: dict[str, Any] = field(default_factory=dict)


class Uploads:
    """The uploads of one page."""

    def __init__(self, page: CurationPage) -> None:
        self._page = page
        self._last: UploadTerms | None = None
        self._terms: dict[str, UploadTerms] = {}
        self._followed: dict[str, _Followed] = {}
        settings = page.curation.services.settings
        self._list = Uploader(allowed=not page.refusal(), address="files", most_bytes=settings.max_upload_bytes)
        self._list.when("chosen", self._chosen)
        self._list.when("sent", self._sent)
        self._list.when("open", page.open)
        self._list.when("retry", self._retry)
        self._list.when("refused", lambda text: ui.notify(str(text), type="negative", multi_line=True, close_button="Close"))
        self._timer = ui.timer(POLL_S, self._poll, active=False)

    def choose(self) -> None:
        """Open the browser's choice of files."""
        self._list.choose()

    async def adopt(self) -> None:
        """Show work that was under way before the page was opened."""
        ingestions = self._page.curation.services.ingestions
        try:
            recent = await self._page.run(ingestions.recent, limit=ADOPTED)
        except FullwellError:
            return  # the page tells already that the database is away
        running = [
            record
            for record in reversed(recent)
            if record.kind == "upload" and record.state in (IngestionState.QUEUED, IngestionState.RUNNING)
        ]
        for record in running:
            self._followed[record.id] = _Followed(record.id, record.id, stored=record.stored is not None)
        self._list.adopt([{"key": record.id, "name": record.name, **row_of(record)} for record in running])
        self._timer.active = bool(self._followed)

    async def _chosen(self, models: list[dict[str, Any]]) -> None:
        terms = await dialogs.ask_upload(models, self._last)
        if terms is not None:
            self._last = terms
            batch = f"b{len(self._terms)}"
            self._terms[batch] = terms
            self._list.start(batch)

    async def _sent(self, sent: dict[str, Any]) -> None:
        """Ask for the ingestion of a model whose files are here."""
        page, terms = self._page, self._terms[sent["batch"]]
        caller = page.caller()
        try:
            if refusal := page.refusal():
                raise FullwellError(f"{refusal}.")
            wanted = AssetRequest(
                files=dict(sent["files"]),
                main=sent["main"],
                asset_class=terms.asset_class,
                licence=terms.licence,
                tags=terms.tags,
                unit_m=terms.unit_m,
                up_axis=terms.up_axis,
                forward_axis=terms.forward_axis,
            ).checked()
            name = caller.name if caller is not None else ""
            queued = await page.run(queue_import, page.curation.services, wanted, name, None)
        except FullwellError as error:
            self._list.follow([{"key": sent["key"], "state": "failed", "note": error.message}])
            return
        self._followed[queued.id] = _Followed(sent["key"], queued.id)
        self._timer.active = True

    async def _retry(self, row: str) -> None:
        services = self._page.curation.services
        known = next((followed for followed in self._followed.values() if followed.row == row), None)
        if known is not None and await self._page.attempt(services.ingestions.retry, known.ingestion) is not None:
            services.dispatcher.wake()
            self._timer.active = True

    async def _poll(self) -> None:
        """Look once at everything that is under way."""
        ingestions = self._page.curation.services.ingestions
        open_ones = [followed for followed in self._followed.values() if followed.shown.get("state") not in ("done", "failed")]
        changes, came = [], False
        for followed in open_ones:
            try:
                record = await self._page.run(ingestions.get, followed.ingestion)
                row = row_of(record) | await self._page.run(_picture_of, self._page.library, record)
            except FullwellError as error:
                changes.append({"key": followed.row, "note": error.message})
                continue
            came |= (record.stored is not None and not followed.stored) or row["state"] == "done"
            followed.stored = record.stored is not None
            if row != followed.shown:
                changes.append({"key": followed.row, **row})
                followed.shown = row
        if changes:
            self._list.follow(changes)
        if came:
            await self._page.arrived()
        self._timer.active = any(one.shown.get("state") not in ("done", "failed") for one in self._followed.values())


def _picture_of(library: AssetLibrary, record: IngestionRecord) -> dict[str, str]:
    """Return where the picture of a finished import is; nothing for others."""
    if record.state != IngestionState.DONE or record.stored is None or record.preview_error:
        return {}
    manifest = library.get(record.stored.asset_id, record.stored.version).manifest
    return {"picture": picture(manifest.look_digest, "thumb")}


def row_of(record: IngestionRecord) -> dict[str, Any]:
    """Return what the list shows of an ingestion."""
    row: dict[str, Any] = {"fraction": record.fraction, "asset": "", "retry": False, "checks": []}
    if record.stored is not None:
        checks = json.loads(record.stored.checks_json)
        concerns = ("failed", "decide", "warning")
        shown = sorted((one for one in checks if one["state"] in concerns), key=lambda one: concerns.index(one["state"]))
        row |= {
            "asset": record.stored.asset_id,
            "checks": [{"state": check["state"], "text": check["message"]} for check in shown[:SHOWN_CHECKS]],
        }
    if record.state == IngestionState.QUEUED:
        note = "waiting for a worker" if record.stored is None else "imported, waiting for its previews"
        return row | {"state": "queued", "note": note}
    if record.state == IngestionState.RUNNING:
        stage = "previews" if record.stored is not None else record.stage
        return row | {"state": "running", "note": STAGES.get(stage, stage.replace("_", " "))}
    if record.state == IngestionState.FAILED:
        return row | {"state": "failed", "note": record.error or "failed", "retry": True}
    if record.preview_error:
        return row | {"state": "done", "note": f"imported; no previews: {record.preview_error}", "retry": True}
    return row | {"state": "done", "note": "imported, waits for a decision"}
