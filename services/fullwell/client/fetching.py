"""Products of a job to a folder: each file whole and verified, what is here already is not loaded again."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx

from fullwell.client.transport import Transport
from fullwell.core import ServiceError, sha256_file, write_atomically
from fullwell.jobs.files import relative_path

__all__ = ["fetch_frame"]

MANIFEST = "manifest.json"
TRIES = 4


def fetch_frame(transport: Transport, job_id: str, number: int, folder: Path) -> tuple[int, int]:
    """Load the products of one frame into `folder`; return how many were loaded and how many were here and whole.

    The manifest is written last here too: a folder that has one holds every product that it names.

    Raises
    ------
    ServiceError
        A product does not have the digest of the manifest, again and again.
    """
    base = f"/v1/jobs/{job_id}/frames/{number}/products"
    manifest_bytes = _load(transport, f"{base}/{MANIFEST}")
    manifest: Mapping[str, Any] = json.loads(manifest_bytes)
    loaded = kept = 0
    for product in manifest["products"]:
        target = folder / relative_path(product["name"], path="product")
        if target.is_file() and target.stat().st_size == product["bytes"] and sha256_file(target) == product["sha256"]:
            kept += 1
            continue
        _load_to(transport, f"{base}/{quote(product['name'])}", target, product["sha256"])
        loaded += 1
    target = folder / MANIFEST
    if target.is_file() and target.read_bytes() == manifest_bytes:
        return loaded, kept + 1
    with write_atomically(target) as partial:
        partial.write_bytes(manifest_bytes)
    return loaded + 1, kept


def _load(transport: Transport, path: str) -> bytes:
    for attempt in range(TRIES):
        try:
            with transport.stream(path) as answer:
                return answer.read()
        except (httpx.TransportError, ServiceError) as error:
            _pause(attempt, path, error)
    raise AssertionError  # _pause raises at the last try


def _load_to(transport: Transport, path: str, target: Path, sha256: str) -> None:
    for attempt in range(TRIES):
        try:
            with write_atomically(target) as partial:
                digest = hashlib.sha256()
                with transport.stream(path) as answer, partial.open("wb") as sink:
                    for piece in answer.iter_bytes(1 << 20):
                        digest.update(piece)
                        sink.write(piece)
                if digest.hexdigest() != sha256:
                    raise ServiceError(f"{path} has SHA-256 {digest.hexdigest()}, the manifest says {sha256}")
            return
        except (httpx.TransportError, ServiceError) as error:
            _pause(attempt, path, error)


def _pause(attempt: int, path: str, error: Exception) -> None:
    if attempt == TRIES - 1:
        raise ServiceError(f"{path} could not be loaded: {error or type(error).__name__}. Run the fetch again.") from error
    time.sleep(0.3 * 2**attempt)
