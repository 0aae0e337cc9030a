"""Where assets are in an object store, and how a renderer gets at them without a database.

Objects::

    cas/<sha256>                               blobs, manifests among them (their digest is that of their canonical JSON)
    assets/<id>/versions/<8 digits>.json       a version: which manifest, who, when; written last, so it is the commit point
    assets/<id>/events/<time>-<random>.json    a decision about an asset; never changed
    assets/previews/<look digest>/<name>.png   pictures of a look
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

from fullwell.assets.cache import BlobCache, blob_key, check_digest
from fullwell.assets.records import AssetManifest, check_asset_id
from fullwell.core.errors import FieldError
from fullwell.core.hashing import digest_of, sha256_hex
from fullwell.storage.protocol import ObjectStore

__all__ = [
    "PREVIEW_PREFIX",
    "StoredAssets",
    "StoredManifest",
    "blob_key",
    "check_digest",
    "event_key",
    "preview_key",
    "preview_names",
    "put_preview",
    "version_key",
]

PREVIEW_PREFIX: Final = "assets/previews"

_PREVIEW_NAME: Final = re.compile(r"[a-z0-9][a-z0-9_-]{0,79}")
LEVEL_SUFFIX: Final = ".glb"


def version_key(asset_id: str, version: int) -> str:
    """Return the object key of a version's file."""
    return f"assets/{check_asset_id(asset_id)}/versions/{version:08d}.json"


def event_key(asset_id: str, name: str) -> str:
    """Return the object key of an event's file; names sort by time."""
    return f"assets/{check_asset_id(asset_id)}/events/{name}.json"


def preview_key(look_digest: str, name: str) -> str:
    """Return the object key of a picture of a look. Raises FieldError where either is not legal."""
    if not _PREVIEW_NAME.fullmatch(name):
        raise FieldError(
            f"the preview's name is {name[:80]!r}; must be 1 to 80 lower-case letters, digits, dashes and underscores.",
            path="name",
            value=name,
        )
    return f"{PREVIEW_PREFIX}/{check_digest(look_digest, path='look_digest')}/{name}.png"


def preview_names(store: ObjectStore, look_digest: str) -> tuple[str, ...]:
    """Return the names of the pictures that a look has, sorted; without suffix."""
    prefix = f"{PREVIEW_PREFIX}/{check_digest(look_digest, path='look_digest')}/"
    names = (PurePosixPath(info.key[len(prefix) :]) for info in store.list(prefix))
    return tuple(sorted(name.stem for name in names if name.suffix == ".png" and _PREVIEW_NAME.fullmatch(name.stem)))


def put_preview(store: ObjectStore, look_digest: str, name: str, png: bytes, *, if_absent: bool = False) -> None:
    """Store a picture of a look; one of the same name is replaced, or with `if_absent` raises ConflictError."""
    store.put(preview_key(look_digest, name), png, "image/png", if_absent=if_absent)


@dataclass(frozen=True, slots=True, eq=False)
class StoredManifest:
    """A manifest with its bytes and digests, each made once: making a document of a manifest takes milliseconds."""

    manifest: AssetManifest
    content: bytes
    digest: str
    look_digest: str

    @classmethod
    def from_content(cls, content: bytes) -> StoredManifest:
        """Return the manifest of canonical JSON. Raises FieldError where it is none, ValueError where it is no JSON."""
        document = json.loads(content)
        if not isinstance(document, dict):
            raise FieldError("the asset manifest is damaged: it is no object.", path="manifest")
        manifest = AssetManifest.from_document(document)
        look_digest = digest_of({"levels": document["levels"], "parts": document["parts"]})
        return cls(manifest, content, sha256_hex(content), look_digest)


class StoredAssets:
    """Manifests and level files by digest, from a store through a cache: all that a renderer needs.

    Parameters
    ----------
    store
        The object store.
    cache
        Where files are kept on this machine.
    """

    def __init__(self, store: ObjectStore, cache: BlobCache) -> None:
        self.store, self.cache = store, cache

    def manifest(self, digest: str) -> AssetManifest:
        """Return the manifest with that digest. Raises NotFoundError and, for a damaged one, AssetError."""
        return self.cache.manifest(digest, self.store)

    def level_file(self, manifest: AssetManifest, level: int) -> Path:
        """Return the GLB file of a level of detail, 0 the finest; beyond the coarsest, the coarsest.

        The file stays while this process holds it; see `BlobCache`. Raises FieldError for a negative level.
        """
        if level < 0:
            raise FieldError(f"level is {level}; must be >= 0, 0 is the finest.", path="level", value=level)
        record = manifest.levels[min(level, len(manifest.levels) - 1)]
        return self.cache.path_of(record.sha256, LEVEL_SUFFIX, self.store)
