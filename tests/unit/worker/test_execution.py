"""How the end of a render process is recorded: a failed attempt with its cause, and only so many of them."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from recipes import tiny_recipe

from fullwell.core.settings import Settings
from fullwell.jobs.database import Database
from fullwell.jobs.records import FrameRecord, JobInput, NewJob
from fullwell.jobs.repository import JobRepository
from fullwell.jobs.states import FrameState
from fullwell.storage import LocalStore
from fullwell_worker.execution import CurrentJob, WorkerContext, run_frames
from fullwell_worker.isolation import IsolatedRunner
from fullwell_worker.limits import RenderLimits

FOLDER = Path(__file__).resolve().parent


class Worker:
    """A worker whose render process does to a frame what `ends` says of its number; other frames are made."""

    def __init__(self, folder: Path) -> None:
        settings = Settings(home=folder, lease_s=1.0, retry_delay_s=0.0, max_attempts=2)
        database = Database(settings.database)
        database.upgrade()
        self.repository = JobRepository(database)
        store = LocalStore(folder / "store")
        limits = RenderLimits(1 << 30, 1 << 29, time_s=30.0, max_frames=50, cancel_patience_s=0.2)
        self.isolated = IsolatedRunner(
            store_url=settings.store, limits=limits, runner="render_standins:Standin", environment={"PYTHONPATH": str(FOLDER)}
        )
        self.ends: dict[int, str] = {}
        self.context = WorkerContext("w", settings, self.repository, store, CurrentJob(), self._run)

    def _run(self, document: Any, index: int, store: Any, prefix: str, **options: Any) -> Any:
        return self.isolated(document, index, store, f"{prefix}/{self.ends.get(index, 'fine')}", **options)

    def submit(self, frames: int) -> str:
        new = NewJob("x", frames, JobInput(json.dumps(tiny_recipe(frames))), request_sha256="0" * 64)
        return self.repository.create_job(new)[0].id

    def frame(self, job: str, number: int) -> FrameRecord:
        return self.repository.frame(job, number)


@pytest.fixture
def worker(tmp_path: Path) -> Iterator[Worker]:
    worker = Worker(tmp_path)
    yield worker
    worker.isolated.close()


def test_a_frame_that_crashes_its_process_is_failed_after_its_attempts_and_the_next_one_is_done(worker: Worker) -> None:
    worker.ends[0] = "segfault"
    job = worker.submit(2)
    run_frames(worker.context, job, [0, 1])
    assert (worker.frame(job, 0).state, worker.frame(job, 1).state) == (FrameState.QUEUED, FrameState.DONE)
    run_frames(worker.context, job, [0])
    frame = worker.frame(job, 0)
    assert (frame.state, frame.error_code) == (FrameState.FAILED, "render_process_died")
    assert "died by SIGSEGV (signal 11) in stage 'render' (25%): LLVM ERROR: something is wrong" in (frame.error or "")
    assert [attempt.outcome for attempt in worker.repository.attempts(job, 0)] == ["failed", "failed"]
    run_frames(worker.context, job, [0])
    assert worker.frame(job, 0).attempt == 2


@pytest.mark.parametrize(
    ("end", "state", "code"),
    [
        ("asks_for_too_much", FrameState.QUEUED, "out_of_memory"),
        ("mistake", FrameState.QUEUED, "internal_error"),
        ("wrong_field", FrameState.FAILED, "invalid_field"),
    ],
)
def test_what_the_recipe_is_to_blame_for_is_final_and_the_rest_is_tried_again(
    worker: Worker, end: str, state: FrameState, code: str
) -> None:
    worker.ends[0] = end
    job = worker.submit(1)
    run_frames(worker.context, job, [0])
    assert (worker.frame(job, 0).state, worker.frame(job, 0).error_code) == (state, code)


@pytest.mark.parametrize("end", ["waits", "sleeps"])
def test_a_cancelled_frame_is_cancelled_whether_it_stops_or_is_ended(worker: Worker, end: str) -> None:
    worker.ends[0] = end
    job = worker.submit(1)
    run_once: Callable[..., Any] = worker.isolated.__call__

    def cancelled_at_work(*given: Any, progress: Callable[[Any], None], **options: Any) -> Any:
        def at(where: Any) -> None:
            progress(where)
            worker.repository.cancel(job)

        return run_once(*given[:3], f"{given[3]}/{end}", progress=at, **options)

    worker.context = WorkerContext(
        "w", worker.context.settings, worker.repository, worker.context.store, CurrentJob(), cancelled_at_work
    )
    run_frames(worker.context, job, [0])
    assert worker.frame(job, 0).state == FrameState.CANCELLED
    assert (worker.isolated.pid is not None) == (end == "waits")
    if worker.isolated.pid is not None:
        os.kill(worker.isolated.pid, 0)
