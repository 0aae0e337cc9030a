"""What every object store offers, and which keys are legal in all of them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import BinaryIO, Protocol, runtime_checkable

from fullwell.core.errors import FieldError, StorageError
from fullwell.core.files import PARTIAL_SUFFIX

__all__ = ["CHUNK_BYTES", "ObjectInfo", "ObjectStore", "check_key", "check_prefix", "guess_content_type", "reading"]

CHUNK_BYTES = 1 << 20
"""Piece size of streams."""

MAX_KEY_BYTES = 1024
"""The limit of S3."""

MAX_SEGMENT_BYTES = 200
"""A segment becomes a file name in folders and in POSIX-backed servers (255 bytes), and a partial file's name is longer."""

_CONTENT_TYPES = {
    ".bin": "application/octet-stream",
    ".csv": "text/csv",
    ".dng": "image/x-adobe-dng",
    ".exr": "image/x-exr",
    ".glb": "model/gltf-binary",
    ".gltf": "model/gltf+json",
    ".htm": "text/html",
    ".html": "text/html",
    ".jpg": "image/jpeg",
    ".json": "application/json",
    ".jsonl": "application/x-ndjson",
    ".md": "text/markdown",
    ".npy": "application/x-npy",
    ".npz": "application/x-npz",
    ".parquet": "application/vnd.apache.parquet",
    ".ply": "model/ply",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".tar": "application/x-tar",
    ".tif": "image/tiff",
    ".tiff": "image/tiff",
    ".txt": "text/plain",
    ".xml": "application/xml",
    ".yaml": "application/yaml",
    ".yml": "application/yaml",
    ".zip": "application/zip",
}


def guess_content_type(key: str) -> str:
    """Return the content type that a key's suffix stands for; a fixed table, so that every machine says the same."""
    return _CONTENT_TYPES.get(PurePosixPath(key).suffix.casefold(), "application/octet-stream")


@dataclass(frozen=True, slots=True)
class ObjectInfo:
    """What a store knows about an object without reading it.

    Attributes
    ----------
    key
        The object's key.
    size
        Bytes.
    etag
        Changes when the content does; comparable only within one store and not a digest of the content.
    modified
        Time of the last write, with time zone.
    content_type
        As given to `put`, or what the key's suffix stands for (always the latter in listings and in local stores).
    """

    key: str
    size: int
    etag: str
    modified: datetime
    content_type: str


def check_key(key: str) -> str:
    """Return `key` where it is legal in every store; raise FieldError where not.

    Segments separated by "/", at most 1024 bytes in UTF-8 and 200 per segment. No empty, "." or ".." segment, no backslash, no
    control character, no suffix of unfinished files.
    """
    problem = _problem_of(key) or ("it is empty" if not key else "")
    if problem:
        raise FieldError(
            f"the object key {key[:80]!r} is not legal: {problem}. Use segments of printable characters separated by single "
            f"slashes, at most {MAX_KEY_BYTES} bytes in all.",
            path="key",
            value=key,
        )
    return key


def check_prefix(prefix: str) -> str:
    """Return `prefix` where keys can start with it: a key's beginning, which may be empty or end in a slash."""
    problem = _problem_of(prefix.removesuffix("/"))
    if problem or prefix == "/":
        raise FieldError(
            f"the key prefix {prefix[:80]!r} is not legal: {problem or 'it is empty'}.", path="prefix", value=prefix
        )
    return prefix


def _problem_of(key: str) -> str:
    if not key:
        return ""
    try:
        encoded = key.encode()
    except UnicodeEncodeError:
        return "it is not valid Unicode"
    if len(encoded) > MAX_KEY_BYTES:
        return f"it is {len(encoded)} bytes long"
    if "\\" in key or any(ord(character) < 0x20 or ord(character) == 0x7F for character in key):
        return "it holds a backslash or a control character"
    for segment in key.split("/"):
        if segment in ("", ".", ".."):
            return f"it holds the segment {segment!r}"
        if len(segment.encode()) > MAX_SEGMENT_BYTES:
            return f"a segment is longer than {MAX_SEGMENT_BYTES} bytes"
        if segment.endswith(PARTIAL_SUFFIX):
            return f"a segment ends in {PARTIAL_SUFFIX!r}, which marks unfinished files"
    return ""


@contextmanager
def reading(file: Path) -> Iterator[BinaryIO]:
    """Open a file that is to be stored; StorageError names it where it cannot be read."""
    with ExitStack() as stack:
        try:
            source = stack.enter_context(Path(file).open("rb"))
        except OSError as error:
            raise StorageError(f"could not read the file {file} to store it: {error.strerror or error}.") from error
        yield source


@runtime_checkable
class ObjectStore(Protocol):
    """Objects by key. Objects appear whole or not at all, and are safe to use from several threads.

    No key may be a folder of another ("a" and "a/b"): folders and POSIX-backed servers cannot hold both.
    Every method raises FieldError for an illegal key and StorageError where the store fails or cannot be reached.
    """

    def put(
        self, key: str, content: bytes | BinaryIO, content_type: str | None = None, *, if_absent: bool = False
    ) -> ObjectInfo:
        """Store `content`, from a stream's present position to its end, and return what was stored.

        With `if_absent` exactly one of any number of writers wins; the others get ConflictError.
        """
        ...

    def put_file(self, key: str, file: Path, content_type: str | None = None, *, if_absent: bool = False) -> ObjectInfo:
        """Store the content of a file, as `put` does."""
        ...

    def get(self, key: str) -> bytes:
        """Return the content. Raises NotFoundError."""
        ...

    def stream(self, key: str) -> Iterator[bytes]:
        """Return the content in pieces. NotFoundError is raised at once, not at the first piece."""
        ...

    def fetch_to(self, key: str, target: Path) -> None:
        """Write the content to a file, which appears whole or not at all. Raises NotFoundError."""
        ...

    def stat(self, key: str) -> ObjectInfo:
        """Return what is known about an object. Raises NotFoundError."""
        ...

    def exists(self, key: str) -> bool:
        """Return whether an object has this key."""
        ...

    def list(self, prefix: str = "") -> Iterator[ObjectInfo]:
        """Return the objects whose keys start with `prefix`, in the order of the keys' UTF-8 bytes."""
        ...

    def delete(self, key: str) -> None:
        """Remove an object; a key without object is no error."""
        ...

    def delete_prefix(self, prefix: str) -> int:
        """Remove every object whose key starts with `prefix` (not empty) and return how many. Not atomic."""
        ...

    def presigned_url(self, key: str, expires_s: int = 3600) -> str | None:
        """Return an address at which anyone may read the object for `expires_s` seconds; None where the store has none."""
        ...

    def check(self) -> None:
        """Raise StorageError where the store cannot be used: for health pages and doctors."""
        ...
