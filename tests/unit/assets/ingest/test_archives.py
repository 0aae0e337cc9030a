"""Archives: what is unpacked, and what is refused before anything is written."""

from __future__ import annotations

import stat
import struct
import zipfile
from pathlib import Path

import pytest

from fullwell.assets.ingest.archives import check_package, model_in, unpack
from fullwell.assets.ingest.options import IngestError, IngestLimits

LIMITS = IngestLimits(input_bytes=50 << 20, input_files=20)


def archive(folder: Path, entries: dict[str, bytes], *, packed: bool = True) -> Path:
    file = folder / "model.zip"
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED) as stream:
        for name, content in entries.items():
            stream.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED)
    return file


def unpacked(file: Path, tmp_path: Path, limits: IngestLimits = LIMITS) -> list[Path]:
    target = tmp_path / "in" / "side"
    target.mkdir(parents=True)
    return unpack(file, target, limits)


def assert_refused(file: Path, tmp_path: Path, match: str, limits: IngestLimits = LIMITS) -> None:
    before = {path for path in tmp_path.rglob("*") if path.is_file()}
    with pytest.raises(IngestError, match=match) as caught:
        unpacked(file, tmp_path, limits)
    assert caught.value.cause == "refused"
    after = {path for path in tmp_path.rglob("*") if path.is_file()}
    assert after == before, "nothing may be written"


def test_files_come_out_as_they_went_in(tmp_path: Path) -> None:
    content = {"a/model.obj": b"v 0 0 0\n" * 9, "a/b/picture.png": bytes(range(256)), "__MACOSX/a/._model.obj": b"x"}
    files = unpacked(archive(tmp_path, content), tmp_path)
    assert sorted(file.as_posix() for file in files) == ["a/b/picture.png", "a/model.obj"]
    assert (tmp_path / "in" / "side" / "a" / "b" / "picture.png").read_bytes() == bytes(range(256))


@pytest.mark.parametrize(
    "name",
    ["../evil.obj", "a/../../evil.obj", "/evil.obj", "C:/evil.obj", "..\\evil.obj", "a\\b.obj", "~/evil.obj", "a/" + "n" * 600],
)
def test_names_that_lead_elsewhere_are_refused(tmp_path: Path, name: str) -> None:
    assert_refused(archive(tmp_path, {"good.obj": b"v", name: b"v"}), tmp_path, "name|outside")


def test_symbolic_links_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "links.zip"
    info = zipfile.ZipInfo("model.obj")
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(file, "w") as stream:
        stream.writestr(info, "/etc/passwd")
    assert_refused(file, tmp_path, "symbolic link")


def test_a_bomb_is_refused_by_its_ratio(tmp_path: Path) -> None:
    assert_refused(archive(tmp_path, {"model.obj": bytes(20 << 20)}), tmp_path, "times its size")


def test_too_much_in_total_is_refused(tmp_path: Path) -> None:
    limits = IngestLimits(input_bytes=1000)
    assert_refused(archive(tmp_path, {f"{n}.obj": bytes(600) for n in range(2)}), tmp_path, "unpacks to 1200 bytes", limits)


def test_too_many_entries_are_refused(tmp_path: Path) -> None:
    assert_refused(archive(tmp_path, {f"{n}.obj": b"" for n in range(21)}), tmp_path, "21 entries")


def test_an_entry_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "twice.zip"
    with zipfile.ZipFile(file, "w") as stream:
        stream.writestr("model.obj", "first")
        with pytest.warns(UserWarning, match="Duplicate"):
            stream.writestr("model.obj", "second")
    assert_refused(file, tmp_path, "twice")


def test_encrypted_entries_are_refused(tmp_path: Path) -> None:
    file = archive(tmp_path, {"model.obj": b"content"})
    content = bytearray(file.read_bytes())
    for magic, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        where = content.find(magic) + offset
        content[where] |= 1
    file.write_bytes(content)
    assert_refused(file, tmp_path, "encrypted")


def test_an_entry_that_holds_more_than_it_states_is_refused(tmp_path: Path) -> None:
    file = archive(tmp_path, {"model.obj": b"x" * 5000}, packed=False)
    content = file.read_bytes().replace(struct.pack("<II", 5000, 5000), struct.pack("<II", 5000, 10))
    file.write_bytes(content)
    with pytest.raises(IngestError, match=r"damaged|larger"):
        unpacked(file, tmp_path)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 nothing more", b"no archive at all" * 100])
def test_damaged_archives_are_refused(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "broken.zip"
    file.write_bytes(content)
    assert_refused(file, tmp_path, "damaged or not a zip archive")


def test_a_truncated_archive_is_refused(tmp_path: Path) -> None:
    file = archive(tmp_path, {"model.obj": bytes(range(256)) * 50})
    file.write_bytes(file.read_bytes()[:-40])
    assert_refused(file, tmp_path, "damaged")


def test_usdz_packages_must_not_be_packed(tmp_path: Path) -> None:
    check_package(archive(tmp_path, {"model.usdc": b"PXR-USDC"}, packed=False), LIMITS)
    with pytest.raises(IngestError, match="USDZ forbids"):
        check_package(archive(tmp_path, {"model.usdc": b"PXR-USDC" * 10}), LIMITS)
    with pytest.raises(IngestError, match="outside"):
        check_package(archive(tmp_path, {"../model.usdc": b"PXR-USDC"}, packed=False), LIMITS)


class TestWhichModel:
    def test_the_only_one_is_taken(self) -> None:
        assert model_in([Path("a/b.png"), Path("a/c.OBJ")], "", archive="x.zip") == Path("a/c.OBJ")

    def test_the_one_nearest_to_the_top_is_taken(self) -> None:
        files = [Path("kit.usda"), Path("layers/wheel.usda"), Path("layers/body.usda")]
        assert model_in(files, "", archive="x.zip") == Path("kit.usda")

    def test_the_one_named_like_the_archive_is_taken(self) -> None:
        assert model_in([Path("car.glb"), Path("tree.glb")], "", archive="Car.zip") == Path("car.glb")

    def test_several_are_put_to_the_caller_by_name(self) -> None:
        with pytest.raises(IngestError, match=r"'car\.glb', 'tree\.glb'") as caught:
            model_in([Path("car.glb"), Path("tree.glb")], "", archive="x.zip")
        assert caught.value.path == "member"

    def test_the_one_asked_for_is_taken(self) -> None:
        assert model_in([Path("a/car.glb"), Path("tree.glb")], "a/car.glb", archive="x.zip") == Path("a/car.glb")
        with pytest.raises(IngestError, match="holds no model"):
            model_in([Path("tree.glb")], "car.glb", archive="x.zip")

    def test_formats_that_are_not_read_are_named(self) -> None:
        with pytest.raises(IngestError, match=r"\.dae is not read"):
            model_in([Path("model.dae"), Path("t.png")], "", archive="x.zip")
