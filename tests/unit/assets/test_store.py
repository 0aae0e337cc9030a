"""Where assets are in the object store, and how a renderer gets at them without a database."""

from __future__ import annotations

from pathlib import Path

import pytest

from fullwell.assets.cache import BlobCache
from fullwell.assets.store import (
    StoredAssets,
    StoredManifest,
    blob_key,
    preview_key,
    preview_names,
    put_preview,
    version_key,
)
from fullwell.core import AssetError, ConflictError, FieldError, NotFoundError, canonical_json
from fullwell.storage import LocalStore
from stored_assets import PNG, prepared_asset

LOOK = "ab" * 32


@pytest.fixture
def store(tmp_path: Path) -> LocalStore:
    return LocalStore(tmp_path / "store")


def test_previews_are_found_by_look_and_by_nothing_else(store: LocalStore) -> None:
    for name in ("turn_1", "thumb", "turn_0"):
        put_preview(store, LOOK, name, PNG)
    store.put(f"assets/previews/{LOOK}/notes.txt", b"not a picture")
    assert preview_names(store, LOOK) == ("thumb", "turn_0", "turn_1")
    assert preview_names(store, "cd" * 32) == ()
    assert store.get(preview_key(LOOK, "thumb")) == PNG


def test_a_preview_that_is_there_is_replaced_only_when_that_is_wanted(store: LocalStore) -> None:
    put_preview(store, LOOK, "thumb", PNG)
    with pytest.raises(ConflictError):
        put_preview(store, LOOK, "thumb", PNG + b"2", if_absent=True)
    put_preview(store, LOOK, "thumb", PNG + b"3")
    assert store.get(preview_key(LOOK, "thumb")) == PNG + b"3"


@pytest.mark.parametrize("name", ["", "../thumb", "a/b", "Thumb", ".png", "x" * 81])
def test_no_preview_has_a_name_that_leaves_its_folder(name: str) -> None:
    with pytest.raises(FieldError, match="name"):
        preview_key(LOOK, name)


@pytest.mark.parametrize("digest", ["", "ab", "AB" * 32, "../" + "a" * 61])
def test_no_key_is_made_of_what_is_no_digest(digest: str) -> None:
    with pytest.raises(FieldError, match="64 lower-case"):
        blob_key(digest)
    with pytest.raises(FieldError, match="look_digest"):
        preview_key(digest, "thumb")


def test_versions_sort_by_number() -> None:
    assert version_key("car-1", 9) < version_key("car-1", 10)
    with pytest.raises(FieldError, match="id"):
        version_key("../car", 1)


def test_a_renderer_gets_manifest_and_levels_by_digest(store: LocalStore, tmp_path: Path) -> None:
    asset = prepared_asset("car-1")
    manifest = asset.manifest
    store.put(blob_key(manifest.digest), canonical_json(manifest.document()))
    for digest, content in asset.blobs.items():
        store.put(blob_key(digest), content)
    assets = StoredAssets(store, BlobCache(tmp_path / "cache", 1 << 20))
    assert assets.manifest(manifest.digest) == manifest
    for level in (0, 7):
        file = assets.level_file(manifest, level)
        assert file.suffix == ".glb"
        assert file.read_bytes() == b"a model"
    with pytest.raises(FieldError, match="level is -1"):
        assets.level_file(manifest, -1)
    with pytest.raises(NotFoundError, match=LOOK):
        assets.manifest(LOOK)


def test_a_blob_that_is_no_manifest_is_refused(store: LocalStore, tmp_path: Path) -> None:
    assets = StoredAssets(store, BlobCache(tmp_path / "cache", 1 << 20))
    for content in (b"[]", b"{}", b"\xff", b'{"schema":"fullwell/asset/v1"}'):
        asset = prepared_asset("x", content)
        digest = asset.manifest.levels[0].sha256
        store.put(blob_key(digest), content)
        with pytest.raises(AssetError, match="not an asset's manifest"):
            assets.manifest(digest)


def test_the_digests_of_a_stored_manifest_are_those_of_the_manifest() -> None:
    manifest = prepared_asset("car-1").manifest
    stored = StoredManifest.from_content(canonical_json(manifest.document()))
    assert (stored.manifest, stored.digest, stored.look_digest) == (manifest, manifest.digest, manifest.look_digest)
