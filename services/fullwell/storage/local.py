"""A folder as object store: the embedded default."""

from __future__ import annotations

import builtins
import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO

from fullwell.core.errors import ConflictError, FieldError, NotFoundError, StorageError
from fullwell.core.files import PARTIAL_SUFFIX, write_atomically
from fullwell.storage.protocol import CHUNK_BYTES, ObjectInfo, check_key, check_prefix, guess_content_type, reading

__all__ = ["LocalStore"]

_ATTEMPTS = 100


class LocalStore:
    """Objects as files below a folder, key = relative path; content types follow from the suffixes.

    A crash can leave ``.<name>.<random>.partial`` files behind. They are never listed or read, and are safe to delete.
    """

    def __init__(self, root: Path) -> None:
        self.root = Path(root).absolute()

    def __repr__(self) -> str:
        return f"LocalStore({str(self.root)!r})"

    def put(
        self, key: str, content: bytes | BinaryIO, content_type: str | None = None, *, if_absent: bool = False
    ) -> ObjectInfo:
        """Store `content`; see ObjectStore.put. `content_type` is not kept: the key's suffix decides."""
        target = self._file(key)
        if if_absent and target.exists():  # spares the writing; the link below is what decides
            raise _conflict(key)
        with self._failing_as_storage_error("write", key), self._partial_of(target) as (partial, sink):
            with sink:
                if isinstance(content, bytes | bytearray | memoryview):
                    sink.write(content)
                else:
                    shutil.copyfileobj(content, sink, CHUNK_BYTES)
                sink.flush()
                os.fsync(sink.fileno())
            # Described before it is published: afterwards another writer may already have replaced it.
            stored = _info(key, partial)
            if not if_absent:
                partial.replace(target)
                return stored
            try:
                os.link(partial, target)
            except FileExistsError:
                raise _conflict(key) from None
            return stored

    def put_file(self, key: str, file: Path, content_type: str | None = None, *, if_absent: bool = False) -> ObjectInfo:
        """Store the content of a file; see ObjectStore.put_file."""
        with reading(file) as source:
            return self.put(key, source, content_type, if_absent=if_absent)

    def get(self, key: str) -> bytes:
        """Return the content; see ObjectStore.get."""
        with self._open(key) as source:
            return source.read()

    def stream(self, key: str) -> Iterator[bytes]:
        """Return the content in pieces; see ObjectStore.stream."""
        source = self._open(key)

        def pieces() -> Iterator[bytes]:
            with source:
                while piece := source.read(CHUNK_BYTES):
                    yield piece

        return pieces()

    def fetch_to(self, key: str, target: Path) -> None:
        """Write the content to a file; see ObjectStore.fetch_to."""
        with self._open(key) as source, write_atomically(target) as partial, partial.open("wb") as sink:
            shutil.copyfileobj(source, sink, CHUNK_BYTES)

    def stat(self, key: str) -> ObjectInfo:
        """Return what is known about an object; see ObjectStore.stat."""
        file = self._file(key)
        if not file.is_file():
            raise NotFoundError(f"no object {key!r} in {self.root}.")
        with self._failing_as_storage_error("read", key):
            return _info(key, file)

    def exists(self, key: str) -> bool:
        """Return whether an object has this key."""
        return self._file(key).is_file()

    def list(self, prefix: str = "") -> Iterator[ObjectInfo]:
        """Return objects by prefix; see ObjectStore.list."""
        return self._walk(self.root, "", check_prefix(prefix))

    def delete(self, key: str) -> None:
        """Remove an object; see ObjectStore.delete."""
        file = self._file(key)
        with self._failing_as_storage_error("delete", key):
            try:
                file.unlink()
            except (FileNotFoundError, NotADirectoryError, IsADirectoryError):
                return
        self._prune(file.parent)

    def delete_prefix(self, prefix: str) -> int:
        """Remove objects by prefix; see ObjectStore.delete_prefix."""
        if not prefix:
            raise FieldError("the prefix to delete is empty, which would remove every object.", path="prefix", value=prefix)
        keys = [item.key for item in self.list(prefix)]
        for key in keys:
            self.delete(key)
        return len(keys)

    def presigned_url(self, key: str, expires_s: int = 3600) -> str | None:
        """Return None: a folder has no address of its own."""
        check_key(key)
        return None

    def check(self) -> None:
        """Raise StorageError where the folder cannot be written."""
        try:
            with write_atomically(self.root / ".check") as partial:
                partial.write_bytes(b"fullwell")
            (self.root / ".check").unlink(missing_ok=True)
        except OSError as error:
            raise StorageError(
                f"the object store's folder {self.root} cannot be written ({error.strerror}). Make it writable or choose "
                f"another with FULLWELL_STORE_URL=file:///path."
            ) from error

    def _file(self, key: str) -> Path:
        return self.root.joinpath(*check_key(key).split("/"))

    def _open(self, key: str) -> BinaryIO:
        file = self._file(key)
        with self._failing_as_storage_error("read", key):
            try:
                return file.open("rb")
            except (FileNotFoundError, NotADirectoryError, IsADirectoryError):
                raise NotFoundError(f"no object {key!r} in {self.root}.") from None

    def _walk(self, folder: Path, at: str, prefix: str) -> Iterator[ObjectInfo]:
        try:
            entries = builtins.list(os.scandir(folder))
        except (FileNotFoundError, NotADirectoryError):
            return
        # A folder sorts with its slash: "a-b" comes before "a/b", as in the order of whole keys.
        entries.sort(key=lambda entry: os.fsencode(entry.name + ("/" if entry.is_dir() else "")))
        for entry in entries:
            key = at + entry.name
            if entry.is_dir():
                if f"{key}/".startswith(prefix) or prefix.startswith(f"{key}/"):
                    yield from self._walk(folder / entry.name, f"{key}/", prefix)
            elif key.startswith(prefix) and not entry.name.endswith(PARTIAL_SUFFIX):
                with contextlib.suppress(FileNotFoundError):  # deleted since
                    yield _info(key, folder / entry.name)

    @contextlib.contextmanager
    def _partial_of(self, target: Path) -> Iterator[tuple[Path, BinaryIO]]:
        partial = target.with_name(f".{target.name}.{secrets.token_hex(8)}{PARTIAL_SUFFIX}")
        with contextlib.ExitStack() as stack:
            sink = stack.enter_context(self._create(partial))
            try:
                yield partial, sink
            finally:
                partial.unlink(missing_ok=True)

    def _create(self, partial: Path) -> BinaryIO:
        """Open a new file in a folder that is made where it is missing.

        A deleter may prune the empty folder between the two steps, or between two steps of making it; then both are done
        again. Once the file is there, the folder cannot be removed.
        """
        for _ in range(_ATTEMPTS):
            try:
                partial.parent.mkdir(parents=True, exist_ok=True)
                return partial.open("xb")
            except FileNotFoundError:
                continue
            except FileExistsError:
                if any(folder.is_file() for folder in partial.parents):
                    raise
        raise StorageError(
            f"the folder {partial.parent} keeps vanishing while an object is written to it; who else deletes there?"
        )

    def _prune(self, folder: Path) -> None:
        # rmdir refuses folders that are not empty, so a writer's new file is never lost.
        with contextlib.suppress(OSError):
            while folder != self.root and folder.is_relative_to(self.root):
                folder.rmdir()
                folder = folder.parent

    @contextlib.contextmanager
    def _failing_as_storage_error(self, action: str, key: str) -> Iterator[None]:
        try:
            yield
        except (FileExistsError, IsADirectoryError, NotADirectoryError) as error:
            raise ConflictError(
                f"object {key!r} cannot be stored: another key is its folder, or it is the folder of another key."
            ) from error
        except OSError as error:
            raise StorageError(
                f"could not {action} object {key!r} in {self.root}: {error.strerror or error}. Check its free space and rights."
            ) from error


def _conflict(key: str) -> ConflictError:
    return ConflictError(f"object {key!r} exists already; it was not replaced.")


def _info(key: str, file: Path) -> ObjectInfo:
    status = file.stat()
    return ObjectInfo(
        key=key,
        size=status.st_size,
        etag=f"{status.st_mtime_ns:x}-{status.st_size:x}-{status.st_ino:x}",
        modified=datetime.fromtimestamp(status.st_mtime, tz=UTC),
        content_type=guess_content_type(key),
    )
