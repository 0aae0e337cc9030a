"""A recipe that cannot be used: every problem with its path, the first one as the message."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fullwell.core.errors import FieldError

__all__ = ["Problem", "RecipeError"]


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong: where, what (complete sentences) and what was given (short text or number)."""

    path: str
    message: str
    value: str | int | float | bool | None = None


class RecipeError(FieldError):
    """A recipe is not legal. ``message``, ``path`` and ``value`` are those of the first problem, ``errors`` lists all."""

    code = "invalid_recipe"

    def __init__(self, message: str, path: str = "", value: Any = None, errors: tuple[Problem, ...] = ()) -> None:
        super().__init__(message, path, value)
        self.errors = errors or (Problem(self.path, self.message, self.value),)

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self.message, self.path, self.value, self.errors))

    @classmethod
    def of(cls, problems: tuple[Problem, ...]) -> RecipeError:
        """Return the error that reports `problems` (at least one)."""
        first = problems[0]
        return cls(first.message, first.path, first.value, problems)
