"""Stage outputs by content key in the object store: checked when read, bounded in size, shared by any number of workers.

Objects, all below ``cache/``::

    cache/<kind>/<key[:2]>/<key>         an entry: magic line, SHA-256 of what follows and of its address, content
    cache/<kind>/<key[:2]>/<key>.used    empty; its time of modification says when the entry was used (to the hour)
    cache/<kind>/<key[:2]>/<key>.lease   a worker is making this entry; its content changes while that worker lives

A crash leaves a lease behind, and nothing else: entries appear whole or not at all. Others on the same machine see that its
process is gone; those on other machines take it for dead after `LEASE_S`.
"""

from __future__ import annotations

import contextlib
import hashlib
import re
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TypeVar

import structlog

from fullwell.core.errors import ConflictError, FieldError, NotFoundError
from fullwell.jobs.processes import current_process, is_gone, process_from_text
from fullwell.storage import ObjectStore

__all__ = ["LEASE_S", "StageStore", "Turn"]

PREFIX = "cache"
LEASE_S = 15.0
"""A lease that has not changed for this long, by the clock of the one who waits, belongs to a dead worker."""
WAIT_S = 600.0
"""Nobody waits for another worker's entry longer than this."""
TOUCH_S = 3600.0
"""Use is noted at most this often for each entry and process."""
AWAY_S = 30.0
"""A store that failed is left alone for this long, so that a broken cache does not delay every frame."""

_FULL_SHARE = 0.9
"""Eviction goes on down to this share of the limit, so that not every new entry evicts one."""
_SWEEP_SHARE = 32
"""A process looks at the whole cache when it has written the limit divided by this: the bound on each worker's overrun."""
_STALE_LEASE_S = 86400.0
_MAX_REMEMBERED = 10_000

_MAGIC = b"fullwell-stage-1\n"
_DIGEST_BYTES = 32
_OBJECT = re.compile(
    rf"(?P<address>{PREFIX}/[a-z]+/(?P<head>[0-9a-f]{{2}})/(?P=head)[0-9a-f]{{62}})(?P<suffix>|\.used|\.lease)"
)

Tick = Callable[[], None]
T = TypeVar("T")

log = structlog.get_logger("fullwell.cache")


@dataclass(frozen=True, slots=True)
class Turn:
    """Who makes an entry: `ours` where this worker holds the lease; `waited_s` is what was spent on another's."""

    ours: bool
    waited_s: float


class StageStore:
    """Entries in an object store, up to about `max_bytes` in all; the least recently used make room.

    No method raises because of the store: trouble is logged, what cannot be read is absent, what cannot be written is not kept.
    Any number of threads, processes and machines may use one store at once. With W workers the size may pass the limit by
    W/32 of it for a while.

    Parameters
    ----------
    store
        Where the entries are. Only objects of the three forms above are ever written or deleted.
    max_bytes
        The limit, > 0.
    lease_s, wait_s, touch_s
        As the constants of this module say; tests shorten them.
    """

    def __init__(
        self,
        store: ObjectStore,
        *,
        max_bytes: int,
        lease_s: float = LEASE_S,
        wait_s: float = WAIT_S,
        touch_s: float = TOUCH_S,
    ) -> None:
        if max_bytes <= 0:
            raise FieldError(
                f"max_bytes is {max_bytes}; must be > 0. Leave the stage cache out instead.", path="max_bytes", value=max_bytes
            )
        self.store, self.max_bytes = store, max_bytes
        self._lease_s, self._wait_s, self._touch_s = lease_s, wait_s, touch_s
        self._touched: dict[str, float] = {}
        self._unswept_bytes = max_bytes  # the first write of a process looks at what others have left
        self._away_until = 0.0

    @staticmethod
    def address(kind: str, key: str) -> str:
        """Return the object key of an entry. Raises FieldError where `key` is not a SHA-256 or `kind` not a small word."""
        address = f"{PREFIX}/{kind}/{key[:2]}/{key}"
        if not _OBJECT.fullmatch(address):
            raise FieldError(
                f"{kind}/{key} does not name a stage's output: lower-case word, SHA-256 in hexadecimal.", path="key", value=key
            )
        return address

    def get(self, kind: str, key: str) -> memoryview | None:
        """Return an entry's content, or None. A damaged entry is deleted, so that the next worker can write it anew."""
        address = self.address(kind, key)
        if not self._is_near():
            return None
        with self._tolerating("read", address):
            content = _opened(address, self.store.get(address))
            if content is not None:
                self.touch(kind, key)
                return content
            log.warning("damaged cache entry", object=address, action="deleted; the stage runs again")
            self.store.delete(address)
        return None

    def read(self, kind: str, key: str, decode: Callable[[memoryview], T]) -> T | None:
        """Return what `decode` makes of an entry, or None. One that it refuses is deleted, whatever error it raises."""
        content = self.get(kind, key)
        if content is None:
            return None
        try:
            return decode(content)
        except Exception as error:  # intact as an object, yet of no use: it must not fail the frame
            log.warning("unusable cache entry", key=key, cause=str(error))
            self.discard(kind, key)
            return None

    def has(self, kind: str, key: str) -> bool:
        """Return whether an entry is there; it is not read."""
        address = self.address(kind, key)
        with self._tolerating("look for", address):
            return self._is_near() and self.store.exists(address)
        return False

    def put(self, kind: str, key: str, *parts: bytes | memoryview) -> bool:
        """Keep the concatenated parts; return whether they are kept now. The first of several writers wins."""
        address = self.address(kind, key)
        sealed = _sealed(address, parts)
        if len(sealed) > self.max_bytes or not self._is_near():
            return False
        with self._tolerating("write", address):
            with contextlib.suppress(ConflictError):  # the same content: the key says so
                self.store.put(address, sealed, if_absent=True)
                self._unswept_bytes += len(sealed)
            self._remember(address)
            if self._unswept_bytes > self.max_bytes / _SWEEP_SHARE:
                self.sweep()
            return True
        return False

    def discard(self, kind: str, key: str) -> None:
        """Delete an entry whose content turned out to be of no use."""
        address = self.address(kind, key)
        with self._tolerating("delete", address):
            self.store.delete(address)

    def touch(self, kind: str, key: str) -> None:
        """Note that an entry was used. Object stores keep no time of reading, so this writes a small object, once an hour."""
        address = self.address(kind, key)
        last = self._touched.get(address)
        if (last is not None and time.monotonic() - last < self._touch_s) or not self._is_near():
            return
        self._remember(address)
        with self._tolerating("touch", address):
            self.store.put(f"{address}.used", b"")

    def sweep(self) -> int:
        """Delete the least recently used entries where all together exceed the limit; return the bytes freed.

        Safe while others read and write: a reader that loses its entry runs its stage again, and two sweeps at once delete the
        same entries.
        """
        freed = 0
        with self._tolerating("sweep", f"{PREFIX}/"):
            sizes, used, leases = self._listing()
            self._unswept_bytes = 0
            now = datetime.now(tz=UTC)
            total = sum(sizes.values())
            if total > self.max_bytes:
                for address in sorted(sizes, key=lambda name: used[name]):
                    if total - freed <= _FULL_SHARE * self.max_bytes:
                        break
                    self.store.delete(address)
                    self.store.delete(f"{address}.used")
                    freed += sizes[address]
                log.info("stage cache swept", bytes=total, freed=freed, limit=self.max_bytes)
            for address in used.keys() - sizes.keys():  # left behind by a delete between the two of the loop above
                if (now - used[address]).total_seconds() > self._touch_s:
                    self.store.delete(f"{address}.used")
            for address, modified in leases.items():
                if (now - modified).total_seconds() > _STALE_LEASE_S:
                    self.store.delete(f"{address}.lease")
        return freed

    @contextlib.contextmanager
    def turn(self, kind: str, key: str, *, tick: Tick = lambda: None) -> Iterator[Turn]:
        """Hold the lease on an entry while the block makes it, or wait until another worker has made it or given up.

        One worker at a time has the lease, as a rule: where a lease is lost two work on the same bytes, which is waste and no
        error. Who has waited looks for the entry and, where it is still absent, makes it without a lease: a stage that always
        fails must not line all workers up. `tick` is called while waiting and may raise, to cancel.
        """
        lease = _Lease(self, f"{self.address(kind, key)}.lease")
        started = time.monotonic()
        ours = lease.take() or self._wait(lease, tick)
        waited_s = time.monotonic() - started
        try:
            if ours:
                lease.keep(self._lease_s / 6)
            yield Turn(ours, waited_s)
        finally:
            if ours:
                lease.release()

    def _wait(self, lease: _Lease, tick: Tick) -> bool:
        """Return True once a dead worker's lease was taken over, False when the lease is gone or the time is up."""
        started = seen_at = time.monotonic()
        seen: bytes | None = None
        pause_s = min(0.1, self._lease_s / 10)
        while (now := time.monotonic()) - started < self._wait_s:
            tick()
            content = lease.read()
            if content is None:
                return False
            if content != seen:
                seen, seen_at = content, now
            if now - seen_at > self._lease_s or _is_orphan(content):
                log.warning("lease of a dead worker", object=lease.name)
                lease.remove(content)
                if lease.take():
                    return True
            time.sleep(pause_s)
            pause_s = min(1.0, 1.5 * pause_s)
        log.warning("waited in vain for another worker", object=lease.name, seconds=self._wait_s)
        return False

    def _listing(self) -> tuple[dict[str, int], dict[str, datetime], dict[str, datetime]]:
        """Return the entries' sizes, when each was used last, and the leases' times; other objects are not looked at."""
        sizes: dict[str, int] = {}
        used: dict[str, datetime] = {}
        leases: dict[str, datetime] = {}
        for info in self.store.list(f"{PREFIX}/"):
            match = _OBJECT.fullmatch(info.key)
            if match is None:
                continue
            address, suffix = match["address"], match["suffix"]
            if suffix == ".lease":
                leases[address] = info.modified
                continue
            used[address] = max(info.modified, used.get(address, info.modified))
            if not suffix:
                sizes[address] = info.size
        return sizes, used, leases

    def _remember(self, address: str) -> None:
        if len(self._touched) > _MAX_REMEMBERED:
            self._touched.clear()
        self._touched[address] = time.monotonic()

    def _is_near(self) -> bool:
        return time.monotonic() >= self._away_until

    @contextlib.contextmanager
    def _tolerating(self, action: str, name: str) -> Iterator[None]:
        """Swallow and log what the store does wrong: a cache may cost a frame time, never its result."""
        try:
            yield
        except NotFoundError:
            return
        except Exception as error:
            self._away_until = time.monotonic() + AWAY_S
            log.warning("stage cache failed", action=action, object=name, cause=str(error), pause_s=AWAY_S)


class _Lease:
    """The object that says who makes an entry. Its content changes while the holder lives, so no two clocks are compared."""

    def __init__(self, owner: StageStore, name: str) -> None:
        self.name = name
        self._owner = owner
        self._holder = secrets.token_hex(8)
        self._process = current_process().to_text()
        self._beats = 0
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def take(self) -> bool:
        """Return whether the lease is ours now."""
        if not self._owner._is_near():
            return False
        with self._owner._tolerating("lease", self.name), contextlib.suppress(ConflictError):
            self._owner.store.put(self.name, self._content(), if_absent=True)
            return True
        return False

    def read(self) -> bytes | None:
        """Return the lease's content; None where nobody holds it or the store fails."""
        if not self._owner._is_near():
            return None
        with self._owner._tolerating("lease", self.name):
            return self._owner.store.get(self.name)
        return None

    def remove(self, holder: bytes) -> None:
        """Delete the lease where its content still starts so."""
        if (self.read() or b"").startswith(holder):
            with self._owner._tolerating("release", self.name):
                self._owner.store.delete(self.name)

    def keep(self, interval_s: float) -> None:
        """Show from now on that the holder lives."""
        self._thread = threading.Thread(target=self._beat, args=(interval_s,), name="stage lease", daemon=True)
        self._thread.start()

    def release(self) -> None:
        """Let others have their turn."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join(timeout=10)
        self.remove(self._holder.encode())

    def _beat(self, interval_s: float) -> None:
        while not self._ended.wait(interval_s):
            content = self.read()
            if content is None:
                continue
            if not content.startswith(self._holder.encode()):
                return  # another worker took this one for dead; its lease is not ours to change
            self._beats += 1
            with self._owner._tolerating("lease", self.name):
                self._owner.store.put(self.name, self._content())

    def _content(self) -> bytes:
        return f"{self._holder} {self._beats} {self._process}".encode()


def _is_orphan(content: bytes) -> bool:
    """Tell whether a lease's holder was a process of this machine that has ended; False where that is not certain."""
    process = process_from_text(content.decode(errors="replace").split(" ", 2)[-1])
    return process is not None and is_gone(process)


def _sealed(address: str, parts: tuple[bytes | memoryview, ...]) -> bytes:
    digest = hashlib.sha256(address.encode())
    for part in parts:
        digest.update(part)
    return b"".join((_MAGIC, digest.digest(), *parts))


def _opened(address: str, sealed: bytes) -> memoryview | None:
    """Return the content, or None where it is not what was sealed under this address."""
    start = len(_MAGIC) + _DIGEST_BYTES
    if len(sealed) < start or not sealed.startswith(_MAGIC):
        return None
    content = memoryview(sealed)[start:]
    digest = hashlib.sha256(address.encode())
    digest.update(content)
    return content if digest.digest() == sealed[len(_MAGIC) : start] else None
