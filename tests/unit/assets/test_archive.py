"""Archives of assets: the same bytes for the same assets, and nothing believed that a digest does not prove."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from fullwell.assets.archive import ArchivedAsset, ArchiveLimits, open_archive, write_archive
from fullwell.assets.records import LicenceRecord
from fullwell.assets.store import blob_key, put_preview
from fullwell.core import AssetError, sha256_hex
from fullwell.storage import LocalStore
from stored_assets import PNG, prepared_asset

Members = dict[str, bytes]


@pytest.fixture
def store(tmp_path: Path) -> LocalStore:
    return LocalStore(tmp_path / "store")


def archived(store: LocalStore, asset_id: str, content: bytes) -> ArchivedAsset:
    asset = prepared_asset(asset_id, content)
    for digest, blob in asset.blobs.items():
        store.put(blob_key(digest), blob)
    put_preview(store, asset.manifest.look_digest, "thumb", PNG + content)
    return ArchivedAsset(asset.manifest, asset.manifest.digest, "approved", "curator", "fine")


@pytest.fixture
def archive(tmp_path: Path, store: LocalStore) -> Path:
    target = tmp_path / "cars.zip"
    write_archive(target, [archived(store, "car-1", b"one"), archived(store, "car-2", b"two")], store)
    return target


def members(archive: Path) -> Members:
    with zipfile.ZipFile(archive) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


def rewritten(archive: Path, changed: Members, *, packed: int = zipfile.ZIP_STORED) -> Path:
    with zipfile.ZipFile(archive, "w", packed) as opened:
        for name, content in changed.items():
            opened.writestr(name, content)
    return archive


def test_what_is_written_is_read_again(archive: Path) -> None:
    with open_archive(archive) as opened:
        assert [asset.manifest.id for asset in opened.assets] == ["car-1", "car-2"]
        second = opened.assets[1]
        assert (second.state, second.reviewed_by, second.reason) == ("approved", "curator", "fine")
        assert list(opened.prepared(second).blobs.values()) == [b"two"]
        assert list(opened.previews(second)) == [("thumb", PNG + b"two")]


def test_the_same_assets_give_the_same_bytes_in_any_order(tmp_path: Path, store: LocalStore, archive: Path) -> None:
    again = tmp_path / "again.zip"
    assets = [archived(store, "car-2", b"two"), archived(store, "car-1", b"one")]
    report = write_archive(again, assets, store)
    assert again.read_bytes() == archive.read_bytes()
    assert (report.assets, report.blobs, report.previews) == (2, 2, 2)
    assert (report.sha256, report.bytes) == (sha256_hex(again.read_bytes()), again.stat().st_size)


def test_every_licence_stands_on_the_page_whatever_is_in_its_texts(tmp_path: Path, store: LocalStore) -> None:
    asset = prepared_asset("car-1", licence=LicenceRecord("CC-BY-4.0", "A | B\n<script>", "https://example.org"))
    for digest, blob in asset.blobs.items():
        store.put(blob_key(digest), blob)
    target = tmp_path / "a.zip"
    write_archive(target, [ArchivedAsset(asset.manifest, asset.manifest.digest, "pending")], store)
    page = members(target)["LICENCES.md"].decode()
    line = next(line for line in page.splitlines() if "car-1" in line)
    assert line == r"| car-1 | Car 1 | CC-BY-4.0 | A \| B &lt;script> | https://example.org | tests |"


def test_a_damaged_or_absent_blob_makes_no_archive(tmp_path: Path, store: LocalStore) -> None:
    asset = archived(store, "car-1", b"one")
    key = blob_key(sha256_hex(b"one"))
    for spoil in (lambda: store.put(key, b"eno"), lambda: store.delete(key)):
        spoil()
        with pytest.raises(AssetError, match="blob"):
            write_archive(tmp_path / "bad.zip", [asset], store)
        assert [path.name for path in tmp_path.iterdir()] == ["store"]


def _with(name: str, content: bytes) -> Callable[[Members], Members]:
    return lambda found: {**found, name: content}


def _without(start: str) -> Callable[[Members], Members]:
    return lambda found: {name: content for name, content in found.items() if not name.startswith(start)}


def _altered(start: str) -> Callable[[Members], Members]:
    return lambda found: {name: content[:-1] + b"?" if name.startswith(start) else content for name, content in found.items()}


def _index(change: Callable[[dict[str, object]], object]) -> Callable[[Members], Members]:
    def apply(found: Members) -> Members:
        index = json.loads(found["index.json"])
        change(index)
        return {**found, "index.json": json.dumps(index).encode()}

    return apply


HOSTILE: dict[str, Callable[[Members], Members]] = {
    "a member outside the folder": _with("../evil.txt", b"x"),
    "an absolute member": _with("/etc/passwd", b"x"),
    "a member with backslashes": _with("blobs\\..\\evil", b"x"),
    "a program beside": _with("setup.py", b"x"),
    "a blob that no asset names": _with("blobs/" + sha256_hex(b"extra"), b"extra"),
    "a preview that the index does not name": _with("previews/" + "ab" * 32 + "/thumb.png", PNG),
    "no index": _without("index.json"),
    "no manifests": _without("manifests/"),
    "no blobs": _without("blobs/"),
    "no previews": _without("previews/"),
    "altered blobs": _altered("blobs/"),
    "altered previews": _altered("previews/"),
    "altered manifests": _altered("manifests/"),
    "an altered index": _altered("index.json"),
    "an index that is a list": _with("index.json", b"[]"),
    "a deep index": _with("index.json", b"[" * 100_000),
    "another schema": _index(lambda index: index.update(schema="fullwell/asset-archive/v9")),
    "an unknown state": _index(lambda index: index["assets"][0].update(state="perfect")),  # type: ignore[index]
    "another's id": _index(lambda index: index["assets"][0].update(id="car-9")),  # type: ignore[index]
    "an asset twice": _index(lambda index: index["assets"].append(index["assets"][0])),  # type: ignore[attr-defined,index]
    "assets that are numbers": _index(lambda index: index.update(assets=[1, 2])),
    "a digest that is a path": _index(lambda index: index["assets"][0].update(digest="../x")),  # type: ignore[index]
}


@pytest.mark.parametrize("how", HOSTILE)
def test_an_archive_is_refused_that_has(archive: Path, how: str) -> None:
    rewritten(archive, HOSTILE[how](members(archive)))
    with pytest.raises(AssetError, match=r"cars\.zip"), open_archive(archive):
        pass


def test_a_preview_must_be_a_picture(archive: Path) -> None:
    found = members(archive)
    name = next(name for name in found if name.startswith("previews/"))
    script = b"<script>alert(1)</script>"
    found |= {name: script}
    rewritten(archive, _index(lambda index: index["previews"].update({name: sha256_hex(script)}))(found))  # type: ignore[attr-defined]
    with pytest.raises(AssetError, match="no PNG"), open_archive(archive):
        pass


def test_limits_hold_before_anything_is_unpacked(archive: Path) -> None:
    rewritten(archive, members(archive), packed=zipfile.ZIP_DEFLATED)
    for limits, words in (
        (ArchiveLimits(total_bytes=100), "unpacks to"),
        (ArchiveLimits(member_bytes=100), "at most 100 are allowed"),
        (ArchiveLimits(members=3), "members"),
        (ArchiveLimits(text_bytes=10), "at most 10 are allowed"),
    ):
        with pytest.raises(AssetError, match=words), open_archive(archive, limits):
            pass
    with open_archive(archive) as opened:
        assert len(opened.assets) == 2


def test_a_bomb_that_lies_about_its_size_does_not_unpack_further_than_it_says(archive: Path) -> None:
    bomb = b"\0" * 5_000_000
    name = f"blobs/{sha256_hex(bomb)}"
    rewritten(archive, {**members(archive), name: bomb}, packed=zipfile.ZIP_DEFLATED)
    content = archive.read_bytes()
    assert content.count(len(bomb).to_bytes(4, "little")) >= 2
    archive.write_bytes(content.replace(len(bomb).to_bytes(4, "little"), (10).to_bytes(4, "little")))
    with pytest.raises(AssetError), open_archive(archive):
        pass


def test_every_cut_archive_is_refused(archive: Path) -> None:
    content = archive.read_bytes()
    for length in range(0, len(content) - 1, 97):
        archive.write_bytes(content[:length])
        with pytest.raises(AssetError), open_archive(archive):
            pass


def test_no_flipped_byte_changes_an_asset_unnoticed(archive: Path) -> None:
    content = archive.read_bytes()
    with open_archive(archive) as opened:
        expected = [asset.digest for asset in opened.assets]
    for position in range(0, len(content), 61):
        archive.write_bytes(content[:position] + bytes([content[position] ^ 0x55]) + content[position + 1 :])
        try:
            with open_archive(archive) as opened:
                assert [asset.digest for asset in opened.assets] == expected
                assert {sha256_hex(blob) for asset in opened.assets for blob in opened.prepared(asset).blobs.values()} == {
                    sha256_hex(b"one"),
                    sha256_hex(b"two"),
                }
        except AssetError:
            continue
