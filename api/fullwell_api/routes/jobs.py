"""Jobs: submit, list, watch, cancel, retry."""

from __future__ import annotations

import json
from typing import Annotated, Any

from fastapi import APIRouter, Header, Query, Request, Response
from sse_starlette import EventSourceResponse

from fullwell.core import FieldError, digest_of
from fullwell.jobs.files import check_files
from fullwell.jobs.records import JobInput, NewJob
from fullwell.jobs.states import FrameState, JobState
from fullwell.schema import RecipeDocument
from fullwell_api.checks import check_blobs, checked_document
from fullwell_api.events import job_events
from fullwell_api.models import (
    FrameDetail,
    FramePage,
    JobOut,
    JobPage,
    RetryOut,
    Submission,
    attempt_out,
    frame_out,
    job_out,
)
from fullwell_api.services import ServiceParts

__all__ = ["router"]

router = APIRouter(tags=["jobs"])

Limit = Annotated[int, Query(ge=1, le=1000, description="Most entries of a page.")]
IdempotencyKey = Annotated[str | None, Header(min_length=1, max_length=255, pattern=r"^[\x20-\x7e]+$")]


@router.post("/jobs", status_code=202, summary="Submit a recipe")
def submit(submission: Submission, response: Response, parts: ServiceParts, idempotency_key: IdempotencyKey = None) -> JobOut:
    """Check the recipe, store the job and queue its frames. The same `Idempotency-Key` gives the same job again."""
    files = check_files(submission.files)
    document = checked_document(submission.recipe, submission.overrides, files, library=parts.library)
    limit = parts.settings.max_frames_per_job
    if document.frame_count() > limit:
        raise FieldError(
            f"the recipe makes {document.frame_count()} frames; this service takes at most {limit} per job. Split it.",
            "vary",
            document.frame_count(),
        )
    check_blobs(parts, files)
    recipe = json.dumps(_pinned(submission.recipe, document))
    job, _ = parts.repository.create_job(
        NewJob(
            name=document.name,
            frame_count=document.frame_count(),
            # Not sorted: the order of the keys of `vary` decides which frame has which number.
            given=JobInput(recipe, json.dumps(submission.overrides), json.dumps(files)),
            request_sha256=digest_of([json.dumps(submission.model_dump())]),
            priority=submission.priority,
            idempotency_key=idempotency_key,
        )
    )
    parts.dispatcher.wake()
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    return job_out(job)


@router.get("/jobs", summary="List jobs, newest first")
def list_jobs(
    parts: ServiceParts,
    limit: Limit = 50,
    cursor: Annotated[str | None, Query(max_length=64, description="next_cursor of the page before.")] = None,
    state: JobState | None = None,
) -> JobPage:
    """Return a page of jobs."""
    found = parts.repository.jobs(limit=limit + 1, before=cursor, state=state)
    more = len(found) > limit
    return JobPage(items=[job_out(job) for job in found[:limit]], next_cursor=found[limit - 1].id if more else None)


@router.get("/jobs/{job_id}", summary="A job as it is now")
def get_job(job_id: str, parts: ServiceParts) -> JobOut:
    """Return a job with the numbers of its frames by state."""
    return job_out(parts.repository.job(job_id))


@router.get("/jobs/{job_id}/recipe", summary="The recipe as it was submitted")
def get_recipe(job_id: str, parts: ServiceParts) -> Submission:
    """Return what was submitted."""
    given = parts.repository.input_of(job_id)
    job = parts.repository.job(job_id)
    return Submission(
        recipe=json.loads(given.recipe_json),
        overrides=json.loads(given.overrides_json),
        files=json.loads(given.files_json),
        priority=job.priority,
    )


@router.get("/jobs/{job_id}/frames", summary="The frames of a job")
def list_frames(
    job_id: str,
    parts: ServiceParts,
    limit: Limit = 100,
    cursor: Annotated[int, Query(ge=-1, le=2**31 - 1, description="next_cursor of the page before.")] = -1,
    state: FrameState | None = None,
) -> FramePage:
    """Return a page of frames in order of their numbers."""
    found = parts.repository.frames(job_id, limit=limit + 1, after=cursor, state=state)
    more = len(found) > limit
    return FramePage(items=[frame_out(frame) for frame in found[:limit]], next_cursor=found[limit - 1].number if more else None)


@router.get("/jobs/{job_id}/frames/{number}", summary="A frame and its attempts")
def get_frame(job_id: str, number: int, parts: ServiceParts) -> FrameDetail:
    """Return a frame with every attempt at it, and why each ended."""
    frame = parts.repository.frame(job_id, _frame_number(number))
    attempts = [attempt_out(attempt) for attempt in parts.repository.attempts(job_id, number)]
    return FrameDetail(**frame_out(frame).model_dump(), attempts=attempts)


@router.post("/jobs/{job_id}/cancel", status_code=202, summary="Cancel a job")
def cancel(job_id: str, parts: ServiceParts) -> JobOut:
    """Cancel the frames that wait and stop those that run between two passes. Frames that are done stay."""
    return job_out(parts.repository.cancel(job_id))


@router.post("/jobs/{job_id}/retry", status_code=202, summary="Run the failed frames again")
def retry(job_id: str, parts: ServiceParts) -> RetryOut:
    """Queue the failed frames, and only those, again."""
    retried = parts.repository.retry_failed(job_id)
    parts.dispatcher.wake()
    return RetryOut(retried=retried, job=job_out(parts.repository.job(job_id)))


@router.get("/jobs/{job_id}/events", summary="Progress as server-sent events", response_class=EventSourceResponse)
async def events(
    job_id: str, request: Request, parts: ServiceParts, last_event_id: Annotated[str | None, Header(max_length=64)] = None
) -> Any:
    """Send `job` and `frame` events as things change and `end` when the job has ended. `Last-Event-ID` resumes."""
    return EventSourceResponse(await job_events(parts, job_id, request, last_event_id), ping=15)


def _pinned(recipe: dict[str, Any], document: RecipeDocument) -> dict[str, Any]:
    """Return the recipe with the pins of its draws; one that draws nothing as it was given."""
    return recipe | {"assets": dict(document.assets)} if document.assets else recipe


def _frame_number(number: int) -> int:
    # Larger numbers exist in no job, and in no integer column either.
    return number if 0 <= number < 2**31 else -1
