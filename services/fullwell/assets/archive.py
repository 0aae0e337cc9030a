"""One file that carries assets from store to store: a zip of manifests, blobs, previews and LICENCES.md.

Members, in this order, nothing compressed and all of one date, so that the same assets give the same bytes on every machine::

    LICENCES.md                    who made what, under which terms; for people
    index.json                     which assets, with their states; the SHA-256 of every preview
    manifests/<sha256>.json        canonical JSON
    blobs/<sha256>
    previews/<look digest>/<name>.png

A reader takes members of these names and no others, never writes a member to disk by its name, and checks every digest.
"""

from __future__ import annotations

import hashlib
import json
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final, cast

from fullwell.assets.query import REVIEW_STATES, ReviewState
from fullwell.assets.records import AssetManifest, PreparedAsset
from fullwell.assets.store import blob_key, preview_key, preview_names
from fullwell.core.errors import AssetError, FieldError, NotFoundError
from fullwell.core.files import write_atomically
from fullwell.core.hashing import canonical_json, sha256_file, sha256_hex
from fullwell.storage.protocol import CHUNK_BYTES, ObjectStore

__all__ = ["ArchiveLimits", "ArchivedAsset", "ExportReport", "OpenArchive", "open_archive", "write_archive"]

SCHEMA: Final = "fullwell/asset-archive/v1"
INDEX: Final = "index.json"
LICENCES: Final = "LICENCES.md"

_DATE: Final = (1980, 1, 1, 0, 0, 0)
_MODE: Final = 0o100644 << 16
_MEMBER: Final = re.compile(
    r"index\.json|LICENCES\.md|manifests/[0-9a-f]{64}\.json|blobs/[0-9a-f]{64}|previews/[0-9a-f]{64}/[a-z0-9][a-z0-9_-]{0,79}\.png"
)
_PNG: Final = b"\x89PNG\r\n\x1a\n"
_ENCRYPTED: Final = 0x1


@dataclass(frozen=True, slots=True)
class ArchiveLimits:
    """What an archive may hold at most: bytes unpacked in all, bytes of one member, members, bytes of texts."""

    total_bytes: int = 64 << 30
    member_bytes: int = 1 << 30
    members: int = 500_000
    text_bytes: int = 64 << 20


@dataclass(frozen=True, slots=True)
class ExportReport:
    """An archive that was written: its file, size and SHA-256, and how much is in it."""

    path: Path
    sha256: str
    bytes: int
    assets: int
    blobs: int
    previews: int


@dataclass(frozen=True, slots=True)
class ArchivedAsset:
    """One asset of an archive, and how it was judged where the archive was made."""

    manifest: AssetManifest
    digest: str
    state: ReviewState
    reviewed_by: str = ""
    reason: str = ""


def write_archive(target: Path, assets: Sequence[ArchivedAsset], store: ObjectStore) -> ExportReport:
    """Write an archive; it appears whole or not at all.

    Raises
    ------
    AssetError
        A blob is absent from the store, or damaged.
    """
    assets = sorted(assets, key=lambda asset: asset.manifest.id)
    blobs = sorted({digest for asset in assets for digest in asset.manifest.blobs()})
    looks = sorted({asset.manifest.look_digest for asset in assets})
    pictures = [(look, name) for look in looks for name in preview_names(store, look)]
    previews = {f"previews/{look}/{name}.png": store.get(preview_key(look, name)) for look, name in pictures}
    index = {
        "schema": SCHEMA,
        "assets": [
            {
                "id": asset.manifest.id,
                "digest": asset.digest,
                "state": asset.state,
                "reviewed_by": asset.reviewed_by,
                "reason": asset.reason,
            }
            for asset in assets
        ],
        "previews": {name: sha256_hex(content) for name, content in previews.items()},
    }
    with (
        write_atomically(Path(target)) as partial,
        zipfile.ZipFile(partial, "w", zipfile.ZIP_STORED, allowZip64=True) as archive,
    ):
        archive.writestr(_member(LICENCES), licences_page([asset.manifest for asset in assets]).encode())
        archive.writestr(_member(INDEX), canonical_json(index))
        for asset in assets:
            archive.writestr(_member(f"manifests/{asset.digest}.json"), canonical_json(asset.manifest.document()))
        for digest in blobs:
            _write_blob(archive, digest, store)
        for name, content in previews.items():
            archive.writestr(_member(name), content)
    path = Path(target)
    return ExportReport(path, sha256_file(path), path.stat().st_size, len(assets), len(blobs), len(previews))


def _write_blob(archive: zipfile.ZipFile, digest: str, store: ObjectStore) -> None:
    found = hashlib.sha256()
    try:
        pieces = store.stream(blob_key(digest))
    except NotFoundError as error:
        raise AssetError(
            f"the object store has no blob {digest}, so the archive cannot be made. Import the asset again."
        ) from error
    # The size is not known when the header is written, so room for the largest is made in each: always the same bytes.
    with archive.open(_member(f"blobs/{digest}"), "w", force_zip64=True) as sink:
        for piece in pieces:
            found.update(piece)
            sink.write(piece)
    if found.hexdigest() != digest:
        raise AssetError(f"the stored blob {digest} is damaged: its content has SHA-256 {found.hexdigest()}.")


def _member(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, _DATE)
    info.external_attr, info.create_system = _MODE, 3
    return info


def licences_page(manifests: Sequence[AssetManifest]) -> str:
    """Return a page in Markdown that names the terms of every asset, and whom to name."""
    lines = ["# Licences", "", "Terms of the assets in this archive.", ""]
    lines += ["| Asset | Title | Licence | Attribution | Terms | Source |", "|---|---|---|---|---|---|"]
    for manifest in sorted(manifests, key=lambda manifest: manifest.id):
        licence = manifest.licence
        cells = (manifest.id, manifest.title, licence.spdx, licence.attribution, licence.url, manifest.source.name)
        lines.append(f"| {' | '.join(_cell(text) for text in cells)} |")
    return "\n".join([*lines, ""])


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("\\", "\\\\").replace("|", "\\|").replace("<", "&lt;") or "-"


class OpenArchive:
    """A verified archive that is open: its assets, and their contents one by one."""

    def __init__(
        self, archive: zipfile.ZipFile, assets: tuple[ArchivedAsset, ...], names: Mapping[str, zipfile.ZipInfo]
    ) -> None:
        self.assets = assets
        self._archive, self._names = archive, names

    def prepared(self, asset: ArchivedAsset) -> PreparedAsset:
        """Return an asset ready to be stored."""
        blobs = {digest: self._archive.read(self._names[f"blobs/{digest}"]) for digest in sorted(asset.manifest.blobs())}
        return PreparedAsset(asset.manifest, blobs)

    def previews(self, asset: ArchivedAsset) -> Iterator[tuple[str, bytes]]:
        """Yield the name and content of each picture of an asset's look."""
        prefix = f"previews/{asset.manifest.look_digest}/"
        for name, info in self._names.items():
            if name.startswith(prefix):
                yield name[len(prefix) :].removesuffix(".png"), self._archive.read(info)


@contextmanager
def open_archive(path: Path, limits: ArchiveLimits | None = None) -> Iterator[OpenArchive]:
    """Open an archive after all of it was verified: names, sizes as unpacked, digests, and that nothing is missing.

    Raises
    ------
    AssetError
        It is no archive of assets, is damaged, holds something that does not belong there, or exceeds a limit.
    """
    limits = limits or ArchiveLimits()
    try:
        archive = zipfile.ZipFile(path)
    except (OSError, zipfile.BadZipFile, ValueError, NotImplementedError) as error:
        raise AssetError(f"{Path(path).name} is not a readable zip archive: {error}.") from error
    with archive:
        yield _verified(archive, Path(path).name, limits)


def _verified(archive: zipfile.ZipFile, shown: str, limits: ArchiveLimits) -> OpenArchive:
    names = _checked_names(archive, shown, limits)
    try:
        index = json.loads(_text(archive, names, INDEX, shown, limits))
        if index["schema"] != SCHEMA:
            raise AssetError(f"{shown} has the schema {str(index['schema'])[:80]!r}; must be {SCHEMA!r}.")
        assets = tuple(_archived(archive, names, entry, shown, limits) for entry in index["assets"])
        previews = {str(name): str(digest) for name, digest in index["previews"].items()}
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError, FieldError) as error:
        raise AssetError(f"{shown} has a damaged index: {error!r:.300}.") from error
    needed = {f"blobs/{digest}" for asset in assets for digest in asset.manifest.blobs()}
    needed |= {f"manifests/{asset.digest}.json" for asset in assets}
    missing = sorted((needed | set(previews)) - set(names))
    if missing:
        raise AssetError(f"{shown} lacks {missing[0]}{f' and {len(missing) - 1} more members' if missing[1:] else ''}.")
    if len({asset.manifest.id for asset in assets}) != len(assets):
        raise AssetError(f"{shown} has an asset twice.")
    _check_contents(archive, names, needed, previews, shown)
    return OpenArchive(archive, assets, {name: names[name] for name in (*sorted(needed), *sorted(previews))})


def _checked_names(archive: zipfile.ZipFile, shown: str, limits: ArchiveLimits) -> dict[str, zipfile.ZipInfo]:
    infos = archive.infolist()
    if len(infos) > limits.members:
        raise AssetError(f"{shown} has {len(infos)} members; at most {limits.members} are allowed.")
    names: dict[str, zipfile.ZipInfo] = {}
    for info in infos:
        name = info.orig_filename
        if not _MEMBER.fullmatch(name) or name in names:
            raise AssetError(
                f"{shown} holds {name[:120]!r}{' twice' if name in names else ', which is no part of an archive'}."
            )
        if info.flag_bits & _ENCRYPTED or info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise AssetError(f"{shown} holds {name!r} encrypted, or packed by another method than deflate.")
        if info.file_size > limits.member_bytes:
            raise AssetError(f"{shown} holds {name!r} of {info.file_size} bytes; at most {limits.member_bytes} are allowed.")
        names[name] = info
    total = sum(info.file_size for info in infos)
    if total > limits.total_bytes:
        raise AssetError(f"{shown} unpacks to {total} bytes; at most {limits.total_bytes} are allowed.")
    return names


def _archived(
    archive: zipfile.ZipFile, names: Mapping[str, zipfile.ZipInfo], entry: Mapping[str, Any], shown: str, limits: ArchiveLimits
) -> ArchivedAsset:
    digest, state = str(entry["digest"]), entry["state"]
    if state not in REVIEW_STATES:
        raise AssetError(f"{shown} has an asset in the state {str(state)[:40]!r}; must be one of {', '.join(REVIEW_STATES)}.")
    content = _text(archive, names, f"manifests/{digest}.json", shown, limits)
    manifest = AssetManifest.from_document(json.loads(content))
    if sha256_hex(content) != digest or manifest.digest != digest or manifest.id != entry["id"]:
        raise AssetError(f"{shown} has a manifest of asset {str(entry['id'])[:80]!r} that is not the one its index names.")
    return ArchivedAsset(
        manifest, digest, cast(ReviewState, state), str(entry["reviewed_by"])[:200], str(entry["reason"])[:2000]
    )


def _text(
    archive: zipfile.ZipFile, names: Mapping[str, zipfile.ZipInfo], name: str, shown: str, limits: ArchiveLimits
) -> bytes:
    if name not in names:
        raise AssetError(f"{shown} lacks {name}.")
    if names[name].file_size > limits.text_bytes:
        raise AssetError(f"{shown} holds {name} of {names[name].file_size} bytes; at most {limits.text_bytes} are allowed.")
    return b"".join(_unpacked(archive, names[name], shown))


def _check_contents(
    archive: zipfile.ZipFile,
    names: Mapping[str, zipfile.ZipInfo],
    needed: set[str],
    previews: Mapping[str, str],
    shown: str,
) -> None:
    """Read every member once: each must be named by the index, and be what its digest says."""
    for name, info in names.items():
        if name in (INDEX, LICENCES) or name.startswith("manifests/"):
            continue
        expected = previews.get(name, "") if name.startswith("previews/") else name.removeprefix("blobs/")
        if name not in needed and name not in previews:
            raise AssetError(f"{shown} holds {name}, which its index does not name.")
        found, first = hashlib.sha256(), b""
        for piece in _unpacked(archive, info, shown):
            first = first or piece[: len(_PNG)]
            found.update(piece)
        if found.hexdigest() != expected:
            raise AssetError(f"{shown} is damaged: {name} has SHA-256 {found.hexdigest()}, not {expected[:64]}.")
        if name.startswith("previews/") and first != _PNG:
            raise AssetError(f"{shown} holds {name}, which is no PNG picture.")


def _unpacked(archive: zipfile.ZipFile, info: zipfile.ZipInfo, shown: str) -> Iterator[bytes]:
    """Yield a member's content; not more than its header says, which the limits were checked against."""
    try:
        with archive.open(info) as source:
            yield from _pieces(source)
    except (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError) as error:
        raise AssetError(f"{shown} is damaged at {info.filename}: {error}.") from error


def _pieces(source: IO[bytes]) -> Iterator[bytes]:
    while piece := source.read(CHUNK_BYTES):
        yield piece
