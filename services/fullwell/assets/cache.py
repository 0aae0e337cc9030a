"""Blobs of the object store on a worker's disk: fetched once, verified, and bounded in size.

Files, all below the cache's folder::

    <2 digits>/<sha256><suffix>     a verified blob, read-only; its time of modification says when it was used last
    <2 digits>/<sha256>.fetching    a blob on its way; a crash leaves it, and the next sweep after an hour removes it
    locks/<2 digits>, locks/sweep   empty; held while a blob is fetched, or while files are evicted

Who gets a path holds a shared lock on the file, and eviction passes over locked files: between learning a path and opening it
nothing is torn away. Locks end with their process.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import threading
import time
from collections import OrderedDict
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from fullwell.assets.records import AssetManifest
from fullwell.core.errors import AssetError, FieldError, NotFoundError
from fullwell.core.hashing import sha256_file
from fullwell.storage.protocol import ObjectStore

__all__ = ["BlobCache", "blob_key", "check_digest"]

HOLD_S: Final = 900.0
"""A path that was handed out is held for this long, by the process that asked for it."""
MAX_HELD: Final = 256
"""Open files that holding may cost; the longest held goes first."""
STALE_S: Final = 3600.0

_FULL_SHARE = 0.9
"""Eviction goes on down to this share of the limit, so that not every new file evicts one."""
_SWEEP_SHARE = 32
"""A process looks at the whole folder when it has fetched the limit divided by this."""
_DIGEST = re.compile(r"[0-9a-f]{64}")
_SUFFIX = re.compile(r"(\.[a-z0-9]{1,10})?")
_FILE = re.compile(r"[0-9a-f]{64}(\.[a-z0-9]{1,10})?")


def check_digest(text: str, *, path: str = "sha256") -> str:
    """Return `text` when it is a SHA-256 in lower-case hexadecimal; FieldError otherwise."""
    if not _DIGEST.fullmatch(text):
        raise FieldError(f"{path} is {text[:80]!r}; must be 64 lower-case hexadecimal digits (SHA-256).", path, text[:80])
    return text


def blob_key(digest: str) -> str:
    """Return the object store's key of the content with that SHA-256."""
    return f"cas/{check_digest(digest)}"


class BlobCache:
    """Files by SHA-256, up to about `max_bytes` in all; the least recently used make room.

    Any number of threads and processes of one machine may use one folder. The size may pass the limit by 1/32 for each
    process, by what is held, and by a file that is larger than the limit itself.

    Parameters
    ----------
    folder
        On a local disk: file locks must work there. Made where it is missing.
    max_bytes
        The limit, > 0.
    hold_s
        How long a path stays after it was handed out [s].
    """

    def __init__(self, folder: Path, max_bytes: int, *, hold_s: float = HOLD_S) -> None:
        if max_bytes <= 0:
            raise FieldError(f"max_bytes is {max_bytes}; must be > 0.", path="max_bytes", value=max_bytes)
        self.folder, self.max_bytes = Path(folder).absolute(), max_bytes
        self._hold_s = hold_s
        self._held: OrderedDict[Path, tuple[int, float]] = OrderedDict()
        self._guard = threading.RLock()
        self._unswept_bytes = max_bytes  # the first fetch of a process looks at what others have left

    def path_of(self, sha256: str, suffix: str, store: ObjectStore) -> Path:
        """Return a file with that content, whose name ends in `suffix` (like ".glb", or empty). Read it, never write it.

        It is fetched where it is not here, and its digest is verified before anyone sees it. It stays for `hold_s` seconds,
        or until `release` or the end of this process.

        Raises
        ------
        NotFoundError
            The store has no such blob.
        AssetError
            What the store has is damaged. Nothing is left here.
        """
        target = self._target(sha256, suffix)
        with self._guard:
            while not self._hold(target):
                self._fetch(sha256, target, store)
            if self._unswept_bytes > self.max_bytes / _SWEEP_SHARE:
                self.sweep()
        return target

    def manifest(self, digest: str, store: ObjectStore) -> AssetManifest:
        """Return the manifest with that digest; errors as of `path_of`, and AssetError where it is no manifest."""
        content = self.path_of(digest, ".json", store).read_bytes()
        try:
            return AssetManifest.from_document(json.loads(content))
        except (ValueError, AttributeError, FieldError) as error:
            raise AssetError(f"the blob {digest} is not an asset's manifest: {error}") from error

    def release(self) -> None:
        """Let go of every path that was handed out: eviction may take them now."""
        with self._guard:
            while self._held:
                _, (descriptor, _) = self._held.popitem()
                os.close(descriptor)

    def sweep(self) -> int:
        """Remove the least recently used files where all together exceed the limit; return the bytes freed."""
        freed = 0
        with self._guard, self._lock("sweep"):
            self._expire_holds()
            files = sorted(self._listing(), key=lambda item: item[1].st_mtime_ns)
            self._unswept_bytes = 0
            total = sum(status.st_size for _, status in files)
            if total <= self.max_bytes:
                return 0
            for path, status in files:
                if total - freed <= _FULL_SHARE * self.max_bytes:
                    break
                if _remove_unless_held(path):
                    freed += status.st_size
        return freed

    def _target(self, sha256: str, suffix: str) -> Path:
        check_digest(sha256)
        if not _SUFFIX.fullmatch(suffix) or suffix == ".fetching":
            raise FieldError(f"suffix is {suffix[:20]!r}; must be empty or like '.glb'.", path="suffix", value=suffix)
        return self.folder / sha256[:2] / f"{sha256}{suffix}"

    def _hold(self, path: Path) -> bool:
        """Take a shared lock on a file and mark it as used; False where it is not there."""
        if path in self._held and path.exists():
            self._held[path] = (self._held[path][0], time.monotonic())
            self._held.move_to_end(path)
            _mark_used(path)
            return True
        try:
            descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        except FileNotFoundError:
            return False
        fcntl.flock(descriptor, fcntl.LOCK_SH)
        # An evictor may have removed the file between the opening and the lock.
        if not os.fstat(descriptor).st_nlink:
            os.close(descriptor)
            return False
        _mark_used(path)
        if path in self._held:
            os.close(self._held.pop(path)[0])
        self._held[path] = (descriptor, time.monotonic())
        while len(self._held) > MAX_HELD:
            _, (oldest, _) = self._held.popitem(last=False)
            os.close(oldest)
        return True

    def _expire_holds(self) -> None:
        now = time.monotonic()
        while self._held and now - next(iter(self._held.values()))[1] > self._hold_s:
            _, (descriptor, _) = self._held.popitem(last=False)
            os.close(descriptor)

    def _fetch(self, sha256: str, target: Path, store: ObjectStore) -> None:
        with self._lock(sha256[:2]):
            if target.exists():  # by another process, while this one waited for the lock
                return
            coming = target.with_name(f"{sha256}.fetching")
            try:
                store.fetch_to(blob_key(sha256), coming)
                found = sha256_file(coming)
                if found != sha256:
                    raise AssetError(
                        f"the stored blob {sha256} is damaged: its content has SHA-256 {found}. Import the asset again."
                    )
                coming.chmod(0o444)
                self._unswept_bytes += coming.stat().st_size
                coming.replace(target)
            except NotFoundError as error:
                raise NotFoundError(f"the object store has no blob {sha256}. Import the asset again.") from error
            finally:
                coming.unlink(missing_ok=True)

    @contextlib.contextmanager
    def _lock(self, name: str) -> Iterator[None]:
        path = self.folder / "locks" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield
        finally:
            os.close(descriptor)

    def _listing(self) -> Iterator[tuple[Path, os.stat_result]]:
        """Yield the blobs here; remove what a crash has left."""
        for folder in self.folder.glob("[0-9a-f][0-9a-f]"):
            for entry in os.scandir(folder):
                with contextlib.suppress(FileNotFoundError):
                    status = entry.stat()
                    if _FILE.fullmatch(entry.name) and not entry.name.endswith(".fetching"):
                        yield Path(entry.path), status
                    elif time.time() - status.st_mtime > STALE_S:
                        Path(entry.path).unlink()


def _mark_used(path: Path) -> None:
    with contextlib.suppress(OSError):  # gone since, or another user's file: then it only looks older than it is
        os.utime(path)


def _remove_unless_held(path: Path) -> bool:
    """Delete a file that nobody holds; return whether it is gone."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        path.unlink(missing_ok=True)
        return True
    except BlockingIOError:
        return False
    finally:
        os.close(descriptor)
