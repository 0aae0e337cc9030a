"""Errors as problem details (RFC 9457), whatever raised them."""

from __future__ import annotations

import json
import math
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response
from pydantic import BaseModel
from starlette.exceptions import HTTPException

from fullwell.core import (
    AssetError,
    CancelledError,
    ConflictError,
    FieldError,
    FullwellError,
    NotFoundError,
    ServiceError,
    StorageError,
)
from fullwell.schema import RecipeError

__all__ = ["PROBLEM_RESPONSES", "FieldProblem", "Problem", "add_problem_handlers", "problem_response"]

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_S = 5
log = structlog.get_logger("fullwell.api")


class FieldProblem(BaseModel):
    """One field that is not as it must be."""

    path: str
    message: str
    value: str | int | float | bool | None = None


class Problem(BaseModel):
    """Why a request was refused (RFC 9457); `code` is stable and machine-readable."""

    type: str = "about:blank"
    title: str
    status: int
    detail: str
    instance: str
    code: str
    errors: list[FieldProblem] = []


def _described(*statuses: int) -> dict[int | str, dict[str, Any]]:
    return {status: {"description": HTTPStatus(status).phrase, "model": Problem} for status in statuses}


PROBLEM_RESPONSES = _described(401, 403, 404, 409, 413, 422, 500, 503)
"""Responses that every route of the API may give, for the OpenAPI document."""

_STATUS_OF: tuple[tuple[type[FullwellError], int], ...] = (
    (FieldError, 422),
    (AssetError, 422),
    (NotFoundError, 404),
    (ConflictError, 409),
    (CancelledError, 409),
    (ServiceError, 503),
    (StorageError, 503),
)

_CODE_OF = {400: "bad_request", 401: "unauthorized", 403: "forbidden", 404: "not_found", 405: "method_not_allowed"} | {
    412: "precondition_failed",
    413: "too_large",
    415: "unsupported_media_type",
    421: "misdirected_request",
    503: "service_unavailable",
}


def problem_response(
    status: int,
    detail: str,
    *,
    instance: str,
    code: str = "",
    errors: list[dict[str, Any]] | None = None,
    headers: dict[str, str] | None = None,
    members: dict[str, Any] | None = None,
) -> Response:
    """Return the response of a problem. Its text is ASCII JSON, so that no odd character of the request can break it."""
    body: dict[str, Any] = {
        "type": "about:blank",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
        "instance": instance,
        "code": code or _CODE_OF.get(status, "error"),
    }
    if errors:
        body["errors"] = errors
    body |= members or {}
    given = dict(headers or {})
    if status == HTTPStatus.SERVICE_UNAVAILABLE:
        given.setdefault("Retry-After", str(RETRY_AFTER_S))
    return Response(json.dumps(body, allow_nan=False), status_code=status, media_type=MEDIA_TYPE, headers=given)


def _shown(value: Any) -> str | int | float | bool | None:
    """Return a value as JSON can hold it, cut where it is long."""
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    return str(value)[:200]


def _of_fullwell_error(request: Request, error: FullwellError) -> Response:
    status = next((status for kind, status in _STATUS_OF if isinstance(error, kind)), 500)
    errors: list[dict[str, Any]] = []
    if isinstance(error, RecipeError):
        errors = [{"path": item.path, "message": item.message, "value": _shown(item.value)} for item in error.errors]
    elif isinstance(error, FieldError):
        errors = [{"path": error.path, "message": error.message, "value": _shown(error.value)}]
    return problem_response(status, str(error), instance=request.url.path, code=error.code, errors=errors)


def _of_validation_error(request: Request, error: RequestValidationError) -> Response:
    errors = []
    for item in error.errors():
        place = [str(step) for step in item["loc"] if step not in ("body", "query", "path", "header")]
        path = ".".join(place) or "the request"
        errors.append({"path": path, "message": f"{path}: {item['msg']}", "value": _shown(item.get("input"))})
    detail = errors[0]["message"] if errors else "the request is not valid"
    return problem_response(422, str(detail), instance=request.url.path, code="invalid_request", errors=errors)


def _of_http_exception(request: Request, error: HTTPException) -> Response:
    detail = error.detail
    if error.status_code == HTTPStatus.NOT_FOUND and detail == HTTPStatus.NOT_FOUND.phrase:
        detail = f"there is nothing at {request.url.path}; /docs lists what there is"
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        detail = f"{request.method} is not possible at {request.url.path}"
    headers = dict(error.headers) if error.headers else None
    return problem_response(error.status_code, str(detail), instance=request.url.path, headers=headers)


def _of_anything(request: Request, error: Exception) -> Response:
    log.error("request failed", method=request.method, path=request.url.path, exc_info=error)
    detail = "the service failed on this request; its log says why"
    return problem_response(500, detail, instance=request.url.path, code="internal_error")


def _with_media_type(document: dict[str, Any]) -> dict[str, Any]:
    """Give problems their own media type in an OpenAPI document; the framework knows only that of the other answers."""
    problem = {"$ref": "#/components/schemas/Problem"}
    for path in document.get("paths", {}).values():
        for operation in path.values():
            for answer in operation.get("responses", {}).values():
                contents = answer.get("content", {})
                if any(content.get("schema") == problem for content in contents.values()):
                    answer["content"] = {MEDIA_TYPE: {"schema": problem}}
    return document


def add_problem_handlers(app: FastAPI) -> None:
    """Have the application answer every error with a problem, and say so in its OpenAPI document."""
    plain_openapi = app.openapi
    app.openapi = lambda: _with_media_type(plain_openapi())  # type: ignore[method-assign]
    app.add_exception_handler(FullwellError, _of_fullwell_error)  # type: ignore[arg-type]
    app.add_exception_handler(RequestValidationError, _of_validation_error)  # type: ignore[arg-type]
    app.add_exception_handler(HTTPException, _of_http_exception)  # type: ignore[arg-type]
    app.add_exception_handler(Exception, _of_anything)
