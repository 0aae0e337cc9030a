"""Canonical JSON and content digests: the one place that decides what "the same" means."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import weakref
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["Unchanging", "canonical_json", "digest_of", "sha256_file", "sha256_hex"]


class Unchanging:
    """Base of frozen dataclasses, compared by identity, whose arrays nobody writes to: their digest is worked out once.

    In canonical JSON they stand as their digest. Two with equal content have equal digests.
    """

    __slots__ = ("__weakref__",)


_digests: weakref.WeakKeyDictionary[Unchanging, str] = weakref.WeakKeyDictionary()


def _remembered(value: Unchanging) -> str:
    digest = _digests.get(value)
    if digest is None:
        digest = _digests[value] = digest_of(_fields(value))
    return digest


def _fields(value: Any) -> dict[str, Any]:
    return {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        array = np.ascontiguousarray(value)
        return {"dtype": array.dtype.str, "shape": list(array.shape), "sha256": sha256_hex(array.tobytes())}
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        if math.isnan(value):
            raise ValueError("NaN has no canonical JSON form")
        if math.isinf(value):
            return "inf" if value > 0 else "-inf"
        return 0.0 if value == 0 else value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        if isinstance(value, Unchanging):
            return {"type": type(value).__name__, "sha256": _remembered(value)}
        return {"type": type(value).__name__, **_plain(_fields(value))}
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, set | frozenset):
        return sorted(_plain(item) for item in value)
    if value is None or isinstance(value, str | int | bool):
        return value
    if isinstance(value, Path):
        raise TypeError("a path is not content; hash the file's bytes instead")
    raise TypeError(f"{type(value).__name__} has no canonical JSON form")


def canonical_json(value: Any) -> bytes:
    """Return `value` as JSON bytes that are equal whenever the values are: sorted keys, no spaces, shortest floats.

    Dataclasses become objects with their type's name, arrays become their digest. Raises TypeError for paths and other
    things that are not content, ValueError for NaN.
    """
    text = json.dumps(_plain(value), sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.encode()


def sha256_hex(content: bytes) -> str:
    """Return the SHA-256 of `content` in lower-case hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def sha256_file(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, read in pieces."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while piece := stream.read(1 << 20):
            digest.update(piece)
    return digest.hexdigest()


def digest_of(value: Any) -> str:
    """Return the SHA-256 of the canonical JSON of `value`."""
    return sha256_hex(canonical_json(value))
