"""Every error a user can meet: it names field, value, legal range and next step, and survives pickling."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

__all__ = [
    "AssetError",
    "CancelledError",
    "ConflictError",
    "FieldError",
    "FullwellError",
    "NotFoundError",
    "RenderError",
    "RenderMemoryError",
    "RenderProcessError",
    "RenderTimeError",
    "ServiceError",
    "ShapeError",
    "StorageError",
    "nearest_names",
    "unknown_name_message",
]


class FullwellError(Exception):
    """Base of all errors raised on purpose. ``code`` is stable and machine-readable."""

    code = "error"

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.message = message

    def __str__(self) -> str:
        return self.message


class FieldError(FullwellError):
    """One field of a document or one argument is outside its legal range.

    Parameters
    ----------
    message
        Complete sentence(s) for a person: what is wrong, what is legal, what to do next.
    path
        Path of the field, for example ``cameras[0].lens.f_number``.
    value
        What was given (kept as a short text, so that the error stays picklable and printable).
    """

    code = "invalid_field"

    def __init__(self, message: str, path: str = "", value: Any = None) -> None:
        super().__init__(message)
        self.path = path
        self.value = value if isinstance(value, str | int | float | bool | type(None)) else repr(value)[:200]

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self.message, self.path, self.value))


class ShapeError(FullwellError):
    """Arrays that must agree in shape do not."""

    code = "shape_mismatch"


class AssetError(FullwellError):
    """A model, texture or table cannot be read or is not usable."""

    code = "bad_asset"


class RenderError(FullwellError):
    """The renderer could not make the image."""

    code = "render_failed"


class RenderProcessError(RenderError):
    """The process that rendered the frame ended without an answer, by a signal for example."""

    code = "render_process_died"


class RenderMemoryError(RenderProcessError):
    """The frame needed more memory than a render process may have."""

    code = "out_of_memory"


class RenderTimeError(RenderProcessError):
    """The frame took longer than a frame may."""

    code = "time_limit"


class StorageError(FullwellError):
    """The object store refused, failed or could not be reached."""

    code = "storage_failed"


class NotFoundError(FullwellError):
    """The thing asked for does not exist."""

    code = "not_found"


class ConflictError(FullwellError):
    """The thing exists already, or is in a state that forbids the request."""

    code = "conflict"


class ServiceError(FullwellError):
    """The service, its broker or its database could not be reached."""

    code = "service_unavailable"


class CancelledError(FullwellError):
    """The work was cancelled on request; nothing was published."""

    code = "cancelled"


def nearest_names(name: str, known: Iterable[str], *, count: int = 3) -> list[str]:
    """Return up to `count` known names that look like `name`, best first."""
    folded = {candidate.casefold(): candidate for candidate in known}
    return [folded[match] for match in difflib.get_close_matches(name.casefold(), folded, n=count, cutoff=0.5)]


def unknown_name_message(kind: str, name: str, known: Iterable[str]) -> str:
    """Return the sentence that answers an unknown name with the nearest known one."""
    names = sorted(known)
    close = nearest_names(name, names)
    if close:
        return f"{kind} {name!r} is not known; did you mean {' or '.join(repr(c) for c in close)}?"
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"{kind} {name!r} is not known; known are: {shown}."
