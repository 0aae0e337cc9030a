"""Files that come in with a request: into the object store by digest, or onto this disk while they are read."""

from __future__ import annotations

import contextlib
import hashlib
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import BinaryIO

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from fullwell.core import ConflictError
from fullwell.jobs.files import blob_key
from fullwell.storage import ObjectStore

__all__ = ["received_file", "stored_upload"]

WRITE_BYTES = 1 << 20


def stored_upload(store: ObjectStore, file: BinaryIO) -> str:
    """Store a file's content as a blob where it is not there yet; return its SHA-256."""
    file.seek(0)
    digest = hashlib.sha256()
    while piece := file.read(WRITE_BYTES):
        digest.update(piece)
    name = digest.hexdigest()
    file.seek(0)
    with contextlib.suppress(ConflictError):  # it is here already
        store.put(blob_key(name), file, if_absent=True)
    return name


@asynccontextmanager
async def received_file(request: Request) -> AsyncIterator[Path]:
    """Yield a file with the request's body; it is gone when the block ends.

    A killed process leaves a folder ``fullwell-upload-*`` in the temporary folder behind; nothing reads it.
    """
    with tempfile.TemporaryDirectory(prefix="fullwell-upload-") as folder:
        target = Path(folder) / "body"
        with target.open("wb") as sink:
            pending = bytearray()
            async for piece in request.stream():
                pending += piece
                if len(pending) >= WRITE_BYTES:
                    await run_in_threadpool(sink.write, bytes(pending))
                    pending.clear()
            sink.write(bytes(pending))
        yield target
