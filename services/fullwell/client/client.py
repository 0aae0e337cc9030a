"""The client: one method per thing that the service does."""

from __future__ import annotations

import json
import secrets
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Self

import httpx

from fullwell.client.assets import AssetClient
from fullwell.client.fetching import fetch_frame
from fullwell.client.files import collect_files
from fullwell.client.records import (
    Event,
    Fetched,
    Frame,
    FrameDetail,
    Job,
    Product,
    Verdict,
    frame_detail_from,
    frame_from,
    job_from,
    product_from,
)
from fullwell.client.transport import Transport
from fullwell.core import FieldError, ServiceError, sha256_file
from fullwell.core.settings import load_settings
from fullwell.jobs.embedded import running_service
from fullwell.jobs.files import relative_path
from fullwell.schema.paths import apply_override
from fullwell.schema.reading import parse_value, read_source

__all__ = ["FullwellClient"]

PAGE = 1000
FETCH_THREADS = 4
Recipe = Mapping[str, Any] | Path | str


class FullwellClient:
    """The service at an address.

    Parameters
    ----------
    base_url
        Like ``http://127.0.0.1:8000``. Empty: FULLWELL_URL, else the running `fullwell serve` of this user, else that address.
    api_key
        Empty: FULLWELL_API_KEY.
    timeout_s
        Of one request.
    patience_s
        How long a service that does not answer is tried again; submitting twice is made impossible by an idempotency key.
    """

    def __init__(self, base_url: str = "", api_key: str = "", *, timeout_s: float = 60.0, patience_s: float = 10.0) -> None:
        settings = load_settings()
        if not base_url and not settings.url and (service := running_service(settings.home)) is not None:
            base_url = service.url
        self._transport = Transport(
            base_url or settings.client_url,
            api_key or settings.api_key.get_secret_value(),
            timeout_s=timeout_s,
            patience_s=patience_s,
        )

    @property
    def assets(self) -> AssetClient:
        """The asset store of the service."""
        return AssetClient(self._transport)

    @property
    def base_url(self) -> str:
        """The service's address."""
        return self._transport.base_url

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._transport.close()

    def submit(
        self,
        recipe: Recipe,
        *,
        overrides: Mapping[str, Any] | None = None,
        files: Mapping[str, Path | str] | None = None,
        priority: int = 3,
        idempotency_key: str = "",
    ) -> Job:
        """Submit a recipe: plain data, YAML or JSON text, or a file. Files that it names are uploaded when they are new.

        Parameters
        ----------
        overrides
            Path in the recipe: value, as with ``--set``.
        files
            {path in the recipe: file}, for recipes without a folder, or for more than the recipe names itself.
        idempotency_key
            The same key gives the same job again; by default each call makes a job, exactly once.

        Raises
        ------
        FieldError
            A file does not exist or lies outside the recipe's folder.
        ApiError
            The service refuses the recipe; `errors` lists every field.
        """
        body = self._submission(recipe, overrides, files, upload=True) | {"priority": priority}
        headers = {"Idempotency-Key": idempotency_key or secrets.token_hex(16), "Content-Type": "application/json"}
        return job_from(self._transport.json("POST", "/v1/jobs", content=json.dumps(body), headers=headers))

    def validate(
        self,
        recipe: Recipe,
        *,
        overrides: Mapping[str, Any] | None = None,
        files: Mapping[str, Path | str] | None = None,
    ) -> Verdict:
        """Ask whether the service would take a recipe; nothing is uploaded or stored."""
        body = json.dumps(self._submission(recipe, overrides, files, upload=False))
        headers = {"Content-Type": "application/json"}
        answer = self._transport.json("POST", "/v1/recipes/validate", content=body, headers=headers)
        errors = tuple(error["message"] for error in answer["errors"])
        return Verdict(answer["valid"], answer["name"], answer["frames"], errors)

    def job(self, job_id: str) -> Job:
        """Return a job as it is now."""
        return job_from(self._transport.json("GET", f"/v1/jobs/{_step(job_id)}"))

    def jobs(self, *, limit: int = 50, state: str = "") -> list[Job]:
        """Return the latest jobs, newest first."""
        found: list[Job] = []
        cursor: str | None = None
        while len(found) < limit:
            query = {"limit": str(min(PAGE, limit - len(found)))} | ({"state": state} if state else {})
            page = self._transport.json("GET", "/v1/jobs", params=query | ({"cursor": cursor} if cursor else {}))
            found += [job_from(item) for item in page["items"]]
            cursor = page["next_cursor"]
            if cursor is None:
                break
        return found

    def frames(self, job_id: str, *, state: str = "") -> Iterator[Frame]:
        """Yield the frames of a job in order of their numbers."""
        cursor: int | None = -1
        while cursor is not None:
            query = {"limit": str(PAGE), "cursor": str(cursor)} | ({"state": state} if state else {})
            page = self._transport.json("GET", f"/v1/jobs/{_step(job_id)}/frames", params=query)
            yield from (frame_from(item) for item in page["items"])
            cursor = page["next_cursor"]

    def frame(self, job_id: str, number: int) -> FrameDetail:
        """Return a frame and every attempt at it."""
        return frame_detail_from(self._transport.json("GET", f"/v1/jobs/{_step(job_id)}/frames/{number}"))

    def products(self, job_id: str, number: int) -> list[Product]:
        """Return the products of a frame; none until it is done."""
        answer = self._transport.json("GET", f"/v1/jobs/{_step(job_id)}/frames/{number}/products")
        return [product_from(item) for item in answer["items"]]

    def workers(self) -> int:
        """Return the number of workers that are alive. ServiceError when the service is not ready."""
        return int(self._transport.json("GET", "/readyz")["workers"])

    def cancel(self, job_id: str) -> Job:
        """Cancel a job; frames that run stop between two passes. ConflictError when it has ended."""
        return job_from(self._transport.json("POST", f"/v1/jobs/{_step(job_id)}/cancel"))

    def retry(self, job_id: str) -> tuple[int, Job]:
        """Queue the failed frames again; return how many, and the job. ConflictError when there are none."""
        answer = self._transport.json("POST", f"/v1/jobs/{_step(job_id)}/retry", safe_again=False)
        return answer["retried"], job_from(answer["job"])

    def wait(
        self,
        job_id: str,
        *,
        progress: Callable[[Job], None] | None = None,
        timeout_s: float | None = None,
        interval_s: float = 0.5,
        patience_s: float = 120.0,
    ) -> Job:
        """Return the job when it has ended. A service that restarts meanwhile is waited for, for `patience_s`.

        Raises
        ------
        ServiceError
            The job has not ended within `timeout_s`, or the service stayed away.
        """
        started = last_answer = time.monotonic()
        while True:
            try:
                job = self.job(job_id)
            except ServiceError:
                if time.monotonic() - last_answer > patience_s:
                    raise
            else:
                last_answer = time.monotonic()
                if progress is not None:
                    progress(job)
                if job.ended:
                    return job
            if timeout_s is not None and time.monotonic() - started > timeout_s:
                raise ServiceError(f"job {job_id} has not ended within {timeout_s:g} s; it goes on running.")
            time.sleep(interval_s)

    def events(self, job_id: str) -> Iterator[Event]:
        """Yield what happens to a job, from its present state to its end; a broken connection is taken up again."""
        last_id = ""
        failures = 0
        while True:
            headers = {"Accept": "text/event-stream"} | ({"Last-Event-ID": last_id} if last_id else {})
            try:
                timeout = httpx.Timeout(60.0, connect=10.0)
                with self._transport.stream(f"/v1/jobs/{_step(job_id)}/events", headers=headers, timeout=timeout) as answer:
                    for kind, event_id, data in _server_events(answer.iter_lines()):
                        failures, last_id = 0, event_id
                        yield _event_from(kind, data)
                        if kind == "end":
                            return
            except (httpx.TransportError, ServiceError) as error:
                failures += 1
                if failures > 10:
                    raise ServiceError(f"the events of job {job_id} cannot be read: {error}") from error
            time.sleep(min(5.0, 0.2 * 2**failures))

    def fetch(self, job_id: str, folder: Path | str, *, progress: Callable[[int, int], None] | None = None) -> Fetched:
        """Load the products of every frame that is done into `folder`/frames/<number>/, verified by the manifests' digests.

        Every file appears whole or not at all; files that are here and whole are not loaded again, so an interrupted fetch
        is resumed by calling it again. `progress` gets (frames finished, frames to fetch).
        """
        root = Path(folder)
        all_frames = list(self.frames(job_id))
        done = [frame.number for frame in all_frames if frame.state == "done"]
        loaded = kept = 0
        with ThreadPoolExecutor(FETCH_THREADS) as threads:
            tasks = [
                threads.submit(fetch_frame, self._transport, _step(job_id), number, root / "frames" / str(number))
                for number in done
            ]
            try:
                for finished, task in enumerate(tasks, start=1):
                    new, old = task.result()
                    loaded, kept = loaded + new, kept + old
                    if progress is not None:
                        progress(finished, len(done))
            except BaseException:
                threads.shutdown(wait=False, cancel_futures=True)
                raise
        missing = tuple(frame.number for frame in all_frames if frame.state != "done")
        return Fetched(root, tuple(done), missing, loaded, kept)

    def _submission(
        self,
        recipe: Recipe,
        overrides: Mapping[str, Any] | None,
        files: Mapping[str, Path | str] | None,
        *,
        upload: bool,
    ) -> dict[str, Any]:
        document, base_dir = read_source(recipe)
        given = {relative_path(name): Path(file) for name, file in (files or {}).items()}
        for name, file in given.items():
            if not file.is_file():
                raise FieldError(f"files[{name!r}] is {str(file)!r}, which does not exist.", f"files[{name!r}]", str(file))
        local = dict(given)
        if base_dir is not None:
            local |= collect_files(_overridden(document, overrides), base_dir, given=given)
        digests = {name: sha256_file(file) for name, file in sorted(local.items())}
        if upload:
            self._upload({digest: local[name] for name, digest in digests.items()})
        return {"recipe": document, "overrides": dict(overrides or {}), "files": digests}

    def _upload(self, files: Mapping[str, Path]) -> None:
        if not files:
            return
        body = json.dumps({"digests": list(files)})
        headers = {"Content-Type": "application/json"}
        missing = self._transport.json("POST", "/v1/blobs/missing", content=body, headers=headers)["missing"]
        for digest in missing:
            with files[digest].open("rb") as file:
                self._transport.upload(f"/v1/blobs/{digest}", file)


def _overridden(document: dict[str, Any], overrides: Mapping[str, Any] | None) -> dict[str, Any]:
    changed: dict[str, Any] = json.loads(json.dumps(document))
    for path, value in (overrides or {}).items():
        apply_override(changed, path, parse_value(value) if isinstance(value, str) else value)
    return changed


def _step(job_id: str) -> str:
    """Return a job id that is safe as a part of an address."""
    if not job_id or not job_id.isalnum() or not job_id.isascii():
        raise FieldError(f"{job_id!r} is not a job id; `fullwell status` lists them.", "job", job_id)
    return job_id


def _server_events(lines: Iterator[str]) -> Iterator[tuple[str, str, str]]:
    """Yield (name, id, data) of server-sent events."""
    name, event_id = "message", ""
    data: list[str] = []
    for line in lines:
        if not line:
            if data:
                yield name, event_id, "\n".join(data)
            name, data = "message", []
            continue
        field, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if field == "event":
            name = value
        elif field == "id":
            event_id = value
        elif field == "data":
            data.append(value)


def _event_from(kind: str, data: str) -> Event:
    document = json.loads(data)
    if kind == "frame":
        return Event(kind, None, frame_from(document))
    return Event(kind, job_from(document), None)
