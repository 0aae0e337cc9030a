"""Jobs through a real broker, a real S3 server and real workers: killed, cancelled, retried, and with the broker gone."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from recipes import tiny_recipe
from running import RunningService, children_of, running_service, wait_for

from fullwell.client import ApiError, FullwellClient
from fullwell.core import ConflictError, NotFoundError
from fullwell.core.settings import Settings
from fullwell.jobs.queue import CeleryTaskQueue
from fullwell.storage import store_from_url
from servers import S3Server, ValkeyServer, free_port, start_valkey_server

pytestmark = [pytest.mark.service, pytest.mark.slow]

SLOW = {"quality": {"samples_per_pixel": 512, "max_depth": 3}}
"""About a second for each frame: long enough to be killed in the middle."""
ENDLESS = {"quality": {"samples_per_pixel": 65536, "max_depth": 64}}


@pytest.fixture(scope="module")
def service(
    tmp_path_factory: pytest.TempPathFactory, s3_server: S3Server, valkey_server: ValkeyServer
) -> Iterator[RunningService]:
    folder = tmp_path_factory.mktemp("service")
    with running_service(folder, broker_url=valkey_server.url(3), store_url=s3_server.url()) as running:
        yield running


@pytest.fixture(scope="module")
def worker(service: RunningService) -> RunningService:
    service.start_worker()
    return service


def outcomes(client: FullwellClient, job_id: str, count: int) -> list[list[str | None]]:
    """Return how each attempt at each frame ended."""
    return [[attempt.outcome for attempt in client.frame(job_id, number).attempts] for number in range(count)]


def distinct(frames: int) -> dict[str, object]:
    """Return a recipe whose frames share no render: each has its own seed."""
    return tiny_recipe(**SLOW) | {"vary": {"grid": {"seed": list(range(1, frames + 1))}}}


def test_eight_frames_come_out_once_though_worker_and_child_are_killed(service: RunningService, tmp_path: Path) -> None:
    client = service.client
    first = service.start_worker()
    job = client.submit(distinct(8))
    wait_for(lambda: client.job(job.id).frames.done >= 1 and client.job(job.id).frames.running == 1, what="a frame in work")
    first.kill()
    second = service.start_worker()
    done = client.job(job.id).frames.done
    wait_for(lambda: client.job(job.id).frames.done > done and client.job(job.id).frames.running == 1, what="the takeover")
    child = children_of(second.pid)[0]
    os.kill(child, signal.SIGKILL)
    ended = client.wait(job.id, timeout_s=60)

    assert (ended.state, ended.frames.done) == ("done", 8)
    ends = outcomes(client, job.id, 8)
    assert all(end.count("done") == 1 and end[-1] == "done" for end in ends), ends
    assert sum(end.count("lost") for end in ends) >= 1
    store = store_from_url(service.environment["FULLWELL_STORE_URL"])
    manifests = [info.key for info in store.list(f"jobs/{job.id}/") if info.key.endswith("/manifest.json")]
    assert sorted(manifests) == [f"jobs/{job.id}/frames/{number}/manifest.json" for number in range(8)]

    fetched = client.fetch(job.id, tmp_path)
    assert (fetched.frames, fetched.missing) == (tuple(range(8)), ())
    for number in range(8):
        manifest = json.loads((tmp_path / "frames" / str(number) / "manifest.json").read_text())
        assert manifest["index"] == number
        for product in manifest["products"]:
            content = (tmp_path / "frames" / str(number) / product["name"]).read_bytes()
            assert hashlib.sha256(content).hexdigest() == product["sha256"]
    (tmp_path / "frames" / "3" / "image.png").write_bytes(b"damaged")
    (tmp_path / "frames" / "5" / "image.png").unlink()
    again = client.fetch(job.id, tmp_path)
    assert again.loaded == 2
    assert client.fetch(job.id, tmp_path).loaded == 0
    second.terminate()
    assert second.wait(20) is not None


def test_messages_that_come_twice_run_nothing_twice(worker: RunningService) -> None:
    client = worker.client
    job = client.submit(tiny_recipe(3))
    settings = Settings(queue=worker.environment["FULLWELL_QUEUE"])
    queue = CeleryTaskQueue(settings, worker.environment["FULLWELL_BROKER_URL"])
    for _ in range(3):
        queue.enqueue(job.id, [0, 1, 2])
    assert client.wait(job.id, timeout_s=60).state == "done"
    queue.enqueue(job.id, [0, 1, 2])
    queue.enqueue("j0", [0])
    wait_for(lambda: queue.waiting() == 0, what="the end of the duplicates")
    queue.close()
    last = client.submit(tiny_recipe(1))  # the worker takes it after them: then they have done what they do
    assert client.wait(last.id, timeout_s=60).state == "done"
    assert outcomes(client, job.id, 3) == [["done"]] * 3


def test_a_running_job_is_cancelled_between_passes_and_publishes_nothing(worker: RunningService) -> None:
    client = worker.client
    job = client.submit(tiny_recipe(2, **ENDLESS))
    wait_for(lambda: client.job(job.id).frames.running == 1, what="a frame in work")
    frame = next(client.frames(job.id, state="running"))
    asked = client.cancel(job.id)
    assert asked.cancel_requested
    ended = client.wait(job.id, timeout_s=30)
    assert (ended.state, ended.frames.cancelled) == ("cancelled", 2)
    assert client.products(job.id, frame.number) == []
    with pytest.raises(ConflictError, match="cancelled"):
        client.retry(job.id)


def test_a_frame_fails_with_its_cause_and_can_be_retried(worker: RunningService, tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "bad.obj").write_text("this is no model\n")
    recipe = tiny_recipe()
    recipe["scene"]["objects"][1]["geometry"] = {"kind": "model", "file": "models/bad.obj"}
    (tmp_path / "recipe.json").write_text(json.dumps(recipe))
    client = worker.client
    job = client.submit(tmp_path / "recipe.json")
    ended = client.wait(job.id, timeout_s=30)
    assert (ended.state, ended.frames.failed) == ("failed", 1)
    frame = client.frame(job.id, 0)
    assert frame.frame.attempt == 1
    assert "bad.obj" in (frame.frame.error or "")
    assert client.retry(job.id)[0] == 1
    assert client.wait(job.id, timeout_s=30).state == "failed"
    assert outcomes(client, job.id, 1) == [["failed", "failed"]]


def test_a_render_process_that_crashes_costs_its_frame_one_attempt_and_the_worker_nothing(worker: RunningService) -> None:
    client = worker.client
    job = client.submit(tiny_recipe(1, **ENDLESS))
    wait_for(lambda: client.frame(job.id, 0).frame.stage == "render", what="rendering")
    (taker,) = children_of(worker.processes[-1].pid)
    (renderer,) = children_of(taker)
    os.kill(renderer, signal.SIGSEGV)
    wait_for(lambda: client.frame(job.id, 0).frame.attempt == 2, what="the next attempt")
    first = client.frame(job.id, 0).attempts[0]
    assert first.outcome == "failed"
    assert "the render process died by SIGSEGV (signal 11) in stage 'render'" in (first.cause or "")
    client.cancel(job.id)
    assert client.wait(job.id, timeout_s=30).state == "cancelled"
    assert client.wait(client.submit(tiny_recipe(1)).id, timeout_s=30).state == "done"
    assert children_of(worker.processes[-1].pid) == [taker]
    assert children_of(taker) not in ([], [renderer])


def test_a_recipe_with_a_model_file_runs_from_the_uploaded_copy(worker: RunningService, tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "tent.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    recipe = tiny_recipe()
    recipe["scene"]["objects"][1]["geometry"] = {"kind": "model", "file": "models/tent.obj", "unit_m": 1, "up_axis": "z"}
    (tmp_path / "recipe.json").write_text(json.dumps(recipe))
    client = worker.client
    job = client.submit(tmp_path / "recipe.json")
    ended = client.wait(job.id, timeout_s=30)
    assert ended.state == "done", [frame.error for frame in client.frames(job.id)]


def test_events_follow_a_job_to_its_end(worker: RunningService) -> None:
    client = worker.client
    job = client.submit(tiny_recipe(2))
    events = list(client.events(job.id))
    assert events[0].kind == "job"
    assert events[-1].kind == "end"
    assert events[-1].job is not None
    assert events[-1].job.state == "done"
    done = {event.frame.number for event in events if event.frame is not None and event.frame.state == "done"}
    assert done == {0, 1}


def test_the_client_reports_what_the_service_refuses(worker: RunningService) -> None:
    recipe = tiny_recipe()
    recipe["quality"]["samples_per_pixel"] = 0
    with pytest.raises(ApiError, match="samples_per_pixel") as caught:
        worker.client.submit(recipe)
    assert [problem.path for problem in caught.value.errors] == ["quality.samples_per_pixel"]
    assert not worker.client.validate(recipe).valid
    assert worker.client.validate(tiny_recipe(5)).frames == 5
    with pytest.raises(NotFoundError):
        worker.client.job("j0")


def test_a_worker_that_is_asked_to_end_hands_its_frame_back_without_a_strike(service: RunningService) -> None:
    client = service.client
    for process in service.processes[1:]:
        if process.poll() is None:
            process.terminate()
            process.wait(20)
    leaving = service.start_worker()
    job = client.submit(tiny_recipe(1, **ENDLESS))
    wait_for(lambda: client.job(job.id).frames.running == 1, what="a frame in work")
    leaving.terminate()
    leaving.wait(30)
    frame = client.frame(job.id, 0)
    assert frame.frame.state == "queued"
    assert [attempt.outcome for attempt in frame.attempts] == ["released"]
    client.cancel(job.id)
    assert client.job(job.id).state == "cancelled"


def test_a_broker_that_loses_everything_loses_no_frame(tmp_path: Path, s3_server: S3Server) -> None:
    port = free_port()
    broker_url = f"redis://127.0.0.1:{port}/0"
    with start_valkey_server(tmp_path / "first", port=port):
        service = RunningService(tmp_path, broker_url=broker_url, store_url=s3_server.url())
        service.start_api()
        service.start_worker()
        job = service.client.submit(distinct(4))
        wait_for(lambda: service.client.job(job.id).frames.done >= 1, what="the first frame")
    try:
        time.sleep(0.5)
        late = service.client.submit(tiny_recipe(1))  # taken though the broker is away
        assert late.state == "queued"
        with start_valkey_server(tmp_path / "second", port=port):
            assert service.client.wait(job.id, timeout_s=60).state == "done"
            assert service.client.wait(late.id, timeout_s=30).state == "done"
            assert all(end.count("done") == 1 for end in outcomes(service.client, job.id, 4))
    finally:
        service.stop()
