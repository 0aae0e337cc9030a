"""Version and event files read back from the object store, with the manifests of versions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import structlog
from sqlalchemy import select

from fullwell.assets.store import StoredManifest, blob_key
from fullwell.core import AssetError, FieldError, NotFoundError, sha256_hex
from fullwell.jobs.asset_files import AssetFile, file_from, is_asset_file, place_of
from fullwell.jobs.asset_index import assets_locked, index_files
from fullwell.jobs.asset_rows import AssetEventRow
from fullwell.jobs.database import Database
from fullwell.storage import ObjectStore

__all__ = ["absorb", "manifests_of", "read_file", "read_manifest", "stored_files"]

PREFIX = "assets/"

log = structlog.get_logger("fullwell.assets")


def read_file(store: ObjectStore, key: str) -> AssetFile:
    """Return a version or an event of the store. Raises AssetError where it is damaged, NotFoundError."""
    return file_from(key, store.get(key))


def read_manifest(store: ObjectStore, digest: str) -> StoredManifest:
    """Return a manifest of the store. Raises AssetError where it is absent or damaged."""
    try:
        content = store.get(blob_key(digest))
        if sha256_hex(content) != digest:
            raise ValueError("its content has another SHA-256")
        return StoredManifest.from_content(content)
    except (NotFoundError, ValueError, AttributeError, FieldError) as error:
        raise AssetError(f"the manifest {digest} cannot be read: {error} Import the asset again.") from error


def stored_files(store: ObjectStore, *, passing_over: bool) -> Iterator[AssetFile]:
    """Yield all versions and events in the store; damaged ones are logged and passed over, or raise AssetError."""
    yield from _read(store, (info.key for info in store.list(PREFIX) if is_asset_file(info.key)), passing_over=passing_over)


def _read(store: ObjectStore, keys: Iterable[str], *, passing_over: bool) -> Iterator[AssetFile]:
    for key in keys:
        try:
            yield read_file(store, key)
        except AssetError as error:
            if not passing_over:
                raise
            log.warning("damaged file of an asset", object=key, cause=str(error))


def manifests_of(store: ObjectStore, files: Iterable[AssetFile], *, passing_over: bool = False) -> dict[str, StoredManifest]:
    """Return {digest: manifest} of the versions among files; collected ones have none.

    One that cannot be read is logged and passed over, or raises AssetError.
    """
    files = list(files)
    collected = {(file.id, file.version) for file in files if file.kind == "collected"}
    manifests: dict[str, StoredManifest] = {}
    for file in files:
        if not file.is_version or file.digest in manifests or (file.id, file.version) in collected:
            continue
        try:
            manifests[file.digest] = read_manifest(store, file.digest)
        except AssetError as error:
            if not passing_over:
                raise
            log.warning("version without manifest", asset=file.id, version=file.version, cause=str(error))
    return manifests


def absorb(store: ObjectStore, database: Database, *, passing_over: bool) -> int:
    """Index files of the store that the tables do not know, such as a crash leaves; return how many there were."""
    with database.reading() as session:
        known = session.execute(select(AssetEventRow.asset_id, AssetEventRow.version, AssetEventRow.name)).all()
    names = {(asset_id, name) for asset_id, _, name in known}
    versions = {(asset_id, version) for asset_id, version, name in known if name.partition("-")[2].startswith("v")}
    unknown = []
    for info in store.list(PREFIX):
        place = place_of(info.key)
        if place is not None and place not in names and place not in versions:
            unknown.append(info.key)
    files = list(_read(store, unknown, passing_over=passing_over))
    manifests = manifests_of(store, files, passing_over=passing_over)
    if not files:
        return 0
    with assets_locked(database) as session:
        return index_files(session, files, manifests)
