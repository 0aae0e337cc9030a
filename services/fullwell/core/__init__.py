"""Constants, errors, random streams, hashing, registries and atomic files. Imports nothing else of the project."""

from fullwell.core.errors import (
    AssetError,
    CancelledError,
    ConflictError,
    FieldError,
    FullwellError,
    NotFoundError,
    RenderError,
    RenderMemoryError,
    RenderProcessError,
    RenderTimeError,
    ServiceError,
    ShapeError,
    StorageError,
    nearest_names,
    unknown_name_message,
)
from fullwell.core.files import atomic_write, write_atomically
from fullwell.core.hashing import canonical_json, digest_of, sha256_file, sha256_hex
from fullwell.core.registry import Registry
from fullwell.core.rng import seed32, stream

__all__ = [
    "AssetError",
    "CancelledError",
    "ConflictError",
    "FieldError",
    "FullwellError",
    "NotFoundError",
    "Registry",
    "RenderError",
    "RenderMemoryError",
    "RenderProcessError",
    "RenderTimeError",
    "ServiceError",
    "ShapeError",
    "StorageError",
    "atomic_write",
    "canonical_json",
    "digest_of",
    "nearest_names",
    "seed32",
    "sha256_file",
    "sha256_hex",
    "stream",
    "unknown_name_message",
    "write_atomically",
]
