"""One asset on a worker: lease, read the uploaded files in a child process, store, render previews, record the outcome."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Final

import structlog

from fullwell.core import AssetError, CancelledError, FieldError, FullwellError, ShapeError
from fullwell.core.settings import Settings
from fullwell.jobs.database import Database
from fullwell.jobs.ingestions import IngestionLease, IngestionRecord, IngestionRepository, StoredAsset
from fullwell.jobs.processes import current_process
from fullwell.jobs.records import RetryRule
from fullwell.storage import ObjectStore
from fullwell_worker.execution import FrameRunner, Heart, patiently
from fullwell_worker.materials import JobFolder

if TYPE_CHECKING:
    from fullwell.assets.ingest import IngestProcess
    from fullwell.assets.records import AssetManifest
    from fullwell.jobs.asset_library import AssetLibrary

__all__ = ["AssetContext", "asset_context", "run_ingestion"]

PERMANENT: Final = (FieldError, ShapeError, AssetError)
"""Errors that the same files would meet again: such an ingestion is not tried twice."""
RETRYABLE_CAUSES: Final = ("died", "unforeseen")
"""Ends of the reading process that need not be the files' fault: the machine may have run out of memory."""
PREVIEW_PRIORITY: Final = 3
"""That of most jobs: uploads are read before, for somebody waits for what was found."""
READ_SHARE: Final = 0.3
"""Share of the progress that reading takes; previews take the rest."""

log = structlog.get_logger("fullwell.worker")


@dataclass(frozen=True, slots=True)
class AssetContext:
    """What one worker process works on assets with. Made after the fork."""

    name: str
    settings: Settings
    ingestions: IngestionRepository
    library: AssetLibrary
    store: ObjectStore
    runner: FrameRunner
    reader: IngestProcess

    @property
    def rule(self) -> RetryRule:
        """How often an ingestion may end badly."""
        return RetryRule(self.settings.max_attempts, self.settings.retry_delay_s)


def asset_context(name: str, settings: Settings, database: Database, store: ObjectStore, runner: FrameRunner) -> AssetContext:
    """Return the context of a worker; previews are rendered by `runner`, in a process of their own where frames are."""
    # Loaded at the first asset, not at the start.
    from fullwell.assets.ingest import IngestProcess  # noqa: PLC0415
    from fullwell.jobs.asset_library import AssetLibrary  # noqa: PLC0415
    from fullwell.jobs.asset_requests import ingest_limits  # noqa: PLC0415

    return AssetContext(
        name=name,
        settings=settings,
        ingestions=IngestionRepository(database),
        library=AssetLibrary(store, database),
        store=store,
        runner=runner,
        reader=IngestProcess(ingest_limits(settings)),
    )


def run_ingestion(context: AssetContext, ingestion_id: str) -> None:
    """Do the work of one ingestion, where it still needs it: a message that comes twice does nothing twice."""
    lease_s = context.settings.lease_s
    lease = context.ingestions.acquire(
        ingestion_id, worker=context.name, holder=current_process(), lease_s=lease_s, rule=context.rule
    )
    if lease is None:
        log.info("nothing to do", ingestion=ingestion_id)
        return

    def prolong(stage: str, fraction: float) -> bool:
        return context.ingestions.heartbeat(lease, lease_s=lease_s, stage=stage, fraction=fraction)

    fields = {"ingestion": lease.id, "attempt": lease.attempt}
    with structlog.contextvars.bound_contextvars(**fields), Heart(prolong, lease_s=lease_s, fields=fields) as heart:
        started = time.monotonic()
        log.info("ingestion started")
        try:
            ending = _work(context, lease, heart)
        except CancelledError:
            log.info("ingestion stopped; another worker has it")
            return
        except FullwellError as error:
            cause = getattr(error, "cause", "")
            if cause == "cancelled":
                log.info("ingestion stopped; another worker has it")
                return
            retryable = cause in RETRYABLE_CAUSES or not isinstance(error, PERMANENT)
            _record_failure(context, lease, str(error), error.code, retryable=retryable)
            return
        except MemoryError:
            _record_failure(context, lease, "the asset needs more memory than the worker has", "out_of_memory", retryable=True)
            return
        except Exception as error:  # a programming error must fail its asset, not the worker
            log.exception("ingestion failed")
            _record_failure(context, lease, f"{type(error).__name__}: {error}", "internal_error", retryable=True)
            return
        patiently(ending.record, lease_s)
        log.info(ending.name, seconds=round(time.monotonic() - started, 3))


@dataclass(frozen=True, slots=True)
class _Ending:
    """How an attempt ended well: what to record, and its name for the log."""

    name: str
    record: Callable[[], object]


def _work(context: AssetContext, lease: IngestionLease, heart: Heart) -> _Ending:
    """Do the next part of the work: an upload is read first and, when all others that wait are read, gets its pictures."""
    ingestions = context.ingestions
    record = ingestions.get(lease.id)
    if record.stored is None:
        _store(context, lease, record, heart)
        if not context.settings.preview_on_ingest:
            return _Ending("ingestion done", lambda: ingestions.complete(lease))
        return _Ending(
            "ingestion goes on to previews",
            lambda: ingestions.hand_over(lease, stage="previews", fraction=READ_SHARE, priority=PREVIEW_PRIORITY),
        )
    manifest = context.library.get(record.stored.asset_id, record.stored.version).manifest
    if record.kind == "previews":
        # One picture less: then all are rendered, and the others stay to be seen until that is done.
        context.store.delete(context.library.preview_key(manifest.look_digest, "chart"))
        _render(context, manifest, heart, start=0.0)
        return _Ending("previews done", lambda: ingestions.complete(lease))
    preview_error = _rendered_or_why_not(context, manifest, heart)
    return _Ending("ingestion done", lambda: ingestions.complete(lease, preview_error=preview_error))


def _rendered_or_why_not(context: AssetContext, manifest: AssetManifest, heart: Heart) -> str:
    """Render an asset's pictures; return why there are none, empty where there are. The asset is whole without them."""
    if not context.settings.preview_on_ingest:
        return ""
    try:
        _render(context, manifest, heart, start=READ_SHARE)
    except CancelledError:
        raise
    except FullwellError as error:
        log.warning("previews failed", cause=str(error), code=error.code)
        return str(error)
    return ""


def _store(context: AssetContext, lease: IngestionLease, record: IngestionRecord, heart: Heart) -> None:
    from fullwell.jobs.asset_requests import AssetRequest  # noqa: PLC0415

    request = AssetRequest.from_json(record.request_json)
    folder = JobFolder()
    try:
        heart.report_stage("fetch files", 0.0)
        base = folder.prepare(record.id, request.files, context.store)
        heart.report_stage("read and check", 0.05)
        prepared = context.reader.prepare(
            base,
            request.main,
            request.options(),
            progress=lambda done, stage: heart.report_stage(stage, 0.05 + (READ_SHARE - 0.1) * done),
            should_cancel=heart.should_cancel,
        )
        heart.report_stage("store", READ_SHARE - 0.05)
        entry = context.library.add(prepared, who=record.who)
    finally:
        folder.clear()
    checks = json.dumps([asdict(check) for check in entry.manifest.checks])
    patiently(
        lambda: context.ingestions.stored(lease, StoredAsset(entry.manifest.id, entry.version, checks)),
        context.settings.lease_s,
    )
    log.info("asset stored", asset=entry.manifest.id, version=entry.version)


def _render(context: AssetContext, manifest: AssetManifest, heart: Heart, *, start: float) -> None:
    from fullwell.pipeline.previews import render_previews  # noqa: PLC0415

    heart.report_stage("previews", start)
    report: Callable[[float], None] = lambda done: heart.report_stage("previews", start + (1.0 - start) * done)  # noqa: E731
    render_previews(manifest, context.store, runner=context.runner, progress=report, should_cancel=heart.should_cancel)


def _record_failure(context: AssetContext, lease: IngestionLease, cause: str, code: str, *, retryable: bool) -> None:
    log.warning("ingestion attempt failed", cause=cause, code=code, retryable=retryable)
    patiently(
        lambda: context.ingestions.fail(lease, cause=cause, code=code, retryable=retryable, rule=context.rule),
        context.settings.lease_s,
    )
