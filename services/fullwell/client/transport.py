"""Requests to the service: connection errors are tried again with growing pauses, problems become errors."""

from __future__ import annotations

import random
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

import httpx

from fullwell.client.errors import ApiError, ApiProblem
from fullwell.core import ConflictError, FullwellError, NotFoundError, ServiceError

__all__ = ["Transport"]

FIRST_PAUSE_S: Final = 0.25
LONGEST_PAUSE_S: Final = 5.0
AGAIN_STATUSES: Final = frozenset({429, 502, 503, 504})
PROBLEM_MEDIA_TYPE: Final = "application/problem+json"


class Transport:
    """One connection pool. `patience_s` is how long a service that does not answer is tried again."""

    def __init__(self, base_url: str, api_key: str, *, timeout_s: float, patience_s: float) -> None:
        headers = {"User-Agent": "fullwell-client"}
        if api_key:
            headers["Authorization"] = f"Bearer {api_key}"
        self.base_url = base_url.rstrip("/")
        self._patience_s = patience_s
        # Environment proxies are not used: the service is named by its address, and the key is for it alone.
        self._http = httpx.Client(
            base_url=self.base_url, headers=headers, timeout=timeout_s, follow_redirects=True, trust_env=False
        )

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def json(self, method: str, path: str, *, safe_again: bool = True, **request: Any) -> Any:
        """Return the JSON of the answer. `safe_again` says that sending the request twice does no harm.

        Raises
        ------
        NotFoundError, ConflictError
            The service said so.
        ApiError
            It refused the request for another reason.
        ServiceError
            It cannot be reached, or is not ready.
        """
        return self._send(method, path, safe_again=safe_again, **request).json()

    def status(self, method: str, path: str) -> int:
        """Return the status of the answer, whatever it is."""
        return self._patiently(lambda: self._http.request(method, path), safe_again=True).status_code

    def upload(self, path: str, file: Any) -> None:
        """Send a file's content, from its beginning at every try."""

        def attempt() -> httpx.Response:
            file.seek(0)
            return self._http.put(path, content=_pieces(file), headers={"Content-Type": "application/octet-stream"})

        self._checked(self._patiently(attempt, safe_again=True))

    def post_file(self, path: str, file: Any, *, timeout_s: float) -> Any:
        """Post a file's content, from its beginning at every try, and return the JSON of the answer."""

        def attempt() -> httpx.Response:
            file.seek(0)
            headers = {"Content-Type": "application/octet-stream"}
            return self._http.post(path, content=_pieces(file), headers=headers, timeout=httpx.Timeout(timeout_s, connect=10.0))

        return self._checked(self._patiently(attempt, safe_again=True)).json()

    @contextmanager
    def stream(self, path: str, *, method: str = "GET", **request: Any) -> Iterator[httpx.Response]:
        """Yield an answer whose body has not been read yet; connection errors come through to the caller."""
        with self._http.stream(method, path, **request) as answer:
            if not answer.is_success:
                answer.read()
                self._checked(answer)
            yield answer

    def _send(self, method: str, path: str, *, safe_again: bool, **request: Any) -> httpx.Response:
        return self._checked(self._patiently(lambda: self._http.request(method, path, **request), safe_again=safe_again))

    def _patiently(self, attempt: Any, *, safe_again: bool) -> httpx.Response:
        deadline = time.monotonic() + self._patience_s
        pause_s = FIRST_PAUSE_S
        while True:
            try:
                answer: httpx.Response = attempt()
            except httpx.ConnectError as error:
                self._pause_or_give_up(deadline, pause_s, error)
            except httpx.TransportError as error:
                # The request may have arrived: it is sent again only where twice is the same as once.
                if not safe_again:
                    raise self._unreachable(error) from error
                self._pause_or_give_up(deadline, pause_s, error)
            else:
                if answer.status_code not in AGAIN_STATUSES or not safe_again or time.monotonic() + pause_s > deadline:
                    return answer
                time.sleep(pause_s)
            pause_s = min(LONGEST_PAUSE_S, pause_s * random.uniform(1.5, 2.5))

    def _pause_or_give_up(self, deadline: float, pause_s: float, error: httpx.TransportError) -> None:
        if time.monotonic() + pause_s > deadline:
            raise self._unreachable(error) from error
        time.sleep(pause_s)

    def _unreachable(self, error: Exception) -> ServiceError:
        return ServiceError(
            f"the service at {self.base_url} cannot be reached ({error or type(error).__name__}). "
            "Start it with `fullwell serve`, or set FULLWELL_URL to its address."
        )

    def _checked(self, answer: httpx.Response) -> httpx.Response:
        if answer.is_success:
            return answer
        raise _error_of(answer)


def _error_of(answer: httpx.Response) -> FullwellError:
    problem: Mapping[str, Any] = {}
    if answer.headers.get("content-type", "").startswith(PROBLEM_MEDIA_TYPE):
        problem = answer.json()
    detail = problem.get("detail") or f"the service answered {answer.status_code} {answer.reason_phrase}"
    if answer.status_code == httpx.codes.NOT_FOUND:
        return NotFoundError(detail)
    if answer.status_code in (httpx.codes.CONFLICT, httpx.codes.PRECONDITION_FAILED):
        return ConflictError(detail)
    if answer.status_code == httpx.codes.UNAUTHORIZED:
        detail = f"{detail}. Set FULLWELL_API_KEY."
    if answer.status_code in AGAIN_STATUSES:
        return ServiceError(detail)
    errors = tuple(ApiProblem(item.get("path", ""), item.get("message", "")) for item in problem.get("errors", []))
    return ApiError(detail, answer.status_code, problem.get("code", ""), errors)


def _pieces(file: Any) -> Iterator[bytes]:
    while piece := file.read(1 << 20):
        yield piece
