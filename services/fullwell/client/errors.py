"""What the service refused, as an error with its fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fullwell.core import FullwellError

__all__ = ["ApiError", "ApiProblem"]


@dataclass(frozen=True, slots=True)
class ApiProblem:
    """One field that the service found wrong."""

    path: str
    message: str


class ApiError(FullwellError):
    """The service answered with a problem. `status` is the HTTP status, `problem_code` the stable code, `errors` the fields."""

    code = "refused"

    def __init__(self, message: str, status: int, problem_code: str = "", errors: tuple[ApiProblem, ...] = ()) -> None:
        super().__init__(message)
        self.status = status
        self.problem_code = problem_code
        self.errors = errors

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self.message, self.status, self.problem_code, self.errors))
