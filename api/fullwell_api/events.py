"""Progress of a job as server-sent events, read from the database: any replica can serve any client."""

from __future__ import annotations

from collections.abc import AsyncIterator

import anyio
from fastapi import Request
from sse_starlette import ServerSentEvent
from starlette.concurrency import run_in_threadpool

from fullwell.core import FullwellError, NotFoundError
from fullwell.jobs.records import FrameRecord, JobRecord
from fullwell.jobs.states import JobState
from fullwell_api.models import frame_out, job_out
from fullwell_api.services import Services

__all__ = ["job_events"]

POLL_S = 0.5
OVERLAP_S = 5.0
"""Changes are asked for again that far back: a transaction may become visible after a later one's time stamp was seen."""
BATCH = 500
ENDED = frozenset({JobState.DONE, JobState.FAILED, JobState.CANCELLED})


async def job_events(
    parts: Services, job_id: str, request: Request, last_event_id: str | None
) -> AsyncIterator[ServerSentEvent]:
    """Return the events of a job from now on, or from the change after `last_event_id`. NotFoundError comes at once."""
    job = await run_in_threadpool(parts.repository.job, job_id)
    since = _time_of(last_event_id)
    if since is None:  # a new client gets the state of the job, not its history
        since = await run_in_threadpool(parts.repository.last_change, job_id)
    return _follow(parts, job, request, since)


async def _follow(parts: Services, job: JobRecord, request: Request, since: float) -> AsyncIterator[ServerSentEvent]:
    seen: dict[int, FrameRecord] = {}
    yield _job_event("job", job, since)
    while not await request.is_disconnected():
        # The job is read first: should it end right after, its last frames are still found below, or in the next round.
        try:
            newer = await run_in_threadpool(parts.repository.job, job.id)
            changes = await run_in_threadpool(_all_changes, parts, job.id, since=since - OVERLAP_S)
        except NotFoundError:
            return
        except FullwellError as error:
            yield ServerSentEvent(comment=f"waiting: {str(error)[:100]}".replace("\n", " "))
            await anyio.sleep(POLL_S * 4)
            continue
        for frame in changes:
            since = max(since, frame.changed_at)
            if seen.get(frame.number) != frame:
                seen[frame.number] = frame
                yield ServerSentEvent(event="frame", id=f"{frame.changed_at:.6f}", data=frame_out(frame).model_dump_json())
        seen = {number: frame for number, frame in seen.items() if frame.changed_at >= since - OVERLAP_S}
        if newer != job:
            job = newer
            yield _job_event("job", job, since)
        if job.state in ENDED:
            yield _job_event("end", job, since)
            return
        await anyio.sleep(POLL_S)


def _all_changes(parts: Services, job_id: str, *, since: float) -> list[FrameRecord]:
    """Return the frames that changed since then, oldest change first."""
    changes: list[FrameRecord] = []
    after = -1
    while page := parts.repository.changed_frames(job_id, since=since, after=after, limit=BATCH):
        changes += page
        since, after = page[-1].changed_at, page[-1].number
    return changes


def _job_event(event: str, job: JobRecord, since: float) -> ServerSentEvent:
    return ServerSentEvent(event=event, id=f"{since:.6f}", data=job_out(job).model_dump_json())


def _time_of(event_id: str | None) -> float | None:
    try:
        moment = float(event_id) if event_id else None
    except ValueError:
        return None
    return moment if moment is not None and 0 <= moment < 1e11 else None
