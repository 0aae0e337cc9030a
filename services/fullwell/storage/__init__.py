"""Object stores: a protocol with two adapters, a local folder and an S3 server."""

from fullwell.storage.local import LocalStore
from fullwell.storage.protocol import ObjectInfo, ObjectStore, check_key, check_prefix, guess_content_type
from fullwell.storage.urls import redacted_url, store_from_url

__all__ = [
    "LocalStore",
    "ObjectInfo",
    "ObjectStore",
    "check_key",
    "check_prefix",
    "guess_content_type",
    "redacted_url",
    "store_from_url",
]
