"""Files that a submitted recipe refers to: relative paths below one folder, by content digest; nothing of the server's disk."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from fullwell.core import FieldError
from fullwell.schema.errors import RecipeError
from fullwell.schema.paths import parse_path

__all__ = [
    "RESOLVED_PREFIXES",
    "blob_key",
    "check_digest",
    "check_files",
    "check_references",
    "file_references",
    "relative_path",
]

RESOLVED_PREFIXES: Final = ("sumo:",)
"""References that the service resolves from its own library; they name no file of the recipe's folder."""
MAX_FILES: Final = 10_000
MAX_PATH_CHARACTERS: Final = 500

_DIGEST = re.compile(r"[0-9a-f]{64}")
_DRIVE = re.compile(r"[A-Za-z]:")
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")


def check_digest(text: str, *, path: str = "sha256") -> str:
    """Return `text` when it is a SHA-256 in lower-case hexadecimal; FieldError otherwise."""
    if not _DIGEST.fullmatch(text):
        raise FieldError(f"{path} is {text[:80]!r}; must be 64 lower-case hexadecimal digits (SHA-256).", path, text[:80])
    return text


def blob_key(digest: str) -> str:
    """Return the object store's key of the content with that SHA-256."""
    return f"cas/{check_digest(digest)}"


def relative_path(text: str, *, path: str = "files") -> str:
    """Return a file reference in its one normal form: relative, forward slashes, no empty or dot parts.

    Raises
    ------
    FieldError
        It is absolute, leaves its folder, or has characters that mean something else on another system.
    """
    shown = text[:120]
    if not text or len(text) > MAX_PATH_CHARACTERS:
        raise FieldError(f"{path} is {shown!r}; a file path must have 1 to {MAX_PATH_CHARACTERS} characters.", path, shown)
    if any(ord(character) < 32 or character == "\x7f" for character in text) or "\\" in text:
        raise FieldError(f"{path} is {shown!r}; a file path must hold no backslash and no control character.", path, shown)
    parts = [part for part in text.split("/") if part not in ("", ".")]
    if text.startswith(("/", "~")) or _DRIVE.match(text) or _SCHEME.match(text) or ".." in parts or not parts:
        raise FieldError(
            f"{path} is {shown!r}; must be a path relative to the recipe that stays below its folder. "
            "Put the file beside the recipe and submit it with the job.",
            path,
            shown,
        )
    return "/".join(parts)


def check_files(files: Mapping[str, str]) -> dict[str, str]:
    """Return {relative path: sha256} with every path in normal form; FieldError for illegal paths, digests or clashes."""
    if len(files) > MAX_FILES:
        raise FieldError(
            f"files has {len(files)} entries; must have at most {MAX_FILES}. Pack small files.", "files", len(files)
        )
    checked: dict[str, str] = {}
    for name, digest in files.items():
        normal = relative_path(name, path=f"files[{name[:80]!r}]")
        if normal in checked and checked[normal] != digest:
            raise FieldError(f"files names {normal!r} twice with different content. Keep one.", "files", normal)
        checked[normal] = check_digest(digest, path=f"files[{normal!r}]")
    for name in checked:
        parts = name.split("/")
        for count in range(1, len(parts)):
            if (folder := "/".join(parts[:count])) in checked:
                raise FieldError(f"files has {folder!r} both as a file and as a folder of {name!r}.", "files", name)
    return checked


def file_references(recipe: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield (path in the recipe, reference) of every file that the recipe may read, those that `vary` sets included."""
    yield from _references(recipe, "")


def _references(value: Any, path: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            here = f"{path}.{key}" if path else str(key)
            if _last_step(str(key)) == "file":
                yield from _texts(item, here)
            else:
                yield from _references(item, here)
    elif isinstance(value, list | tuple):
        for index, item in enumerate(value):
            yield from _references(item, f"{path}[{index}]")


def _last_step(key: str) -> str:
    """Return the field that a key names: a key of `vary` is itself a path, such as ``scene.objects[0].geometry.file``."""
    try:
        return parse_path(key)[-1]
    except RecipeError:
        return key


def _texts(value: Any, path: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, str):
        yield path, value
    elif isinstance(value, Mapping):
        yield from _texts(value.get("values", []), f"{path}.values")
        yield from _references({key: item for key, item in value.items() if key != "values"}, path)
    elif isinstance(value, list | tuple):
        for index, item in enumerate(value):
            yield from _texts(item, f"{path}[{index}]")


def check_references(recipe: Mapping[str, Any], files: Mapping[str, str]) -> None:
    """Raise FieldError when the recipe refers to a file that was not submitted with it, above all to one of the server's."""
    for path, reference in file_references(recipe):
        if reference.startswith(RESOLVED_PREFIXES):
            prefix, _, rest = reference.partition(":")
            relative_path(rest.partition("@")[0], path=f"{path} ({prefix}:)")
            continue
        if relative_path(reference, path=path) not in files:
            raise FieldError(
                f"{path} is {reference[:120]!r}; that file was not submitted with the job. "
                "Upload it and name it in files (fullwell submit and the Python client do).",
                path,
                reference[:120],
            )
