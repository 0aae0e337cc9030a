"""Archives unpacked without trusting them: no entry leaves the folder, and none is larger than it may be."""

from __future__ import annotations

import re
import stat
import zipfile
from pathlib import Path, PurePosixPath
from typing import IO, Final

from fullwell.assets.ingest.options import IngestError, IngestLimits
from fullwell.assets.meshes import MODEL_SUFFIXES

__all__ = ["check_package", "model_in", "unpack"]

_CHUNK: Final = 1 << 20
_RATIO_FROM_BYTES: Final = 16 << 20
"""Smaller entries may pack as tightly as they like: a plain texture does, and no bomb fits into so little."""

_IGNORED: Final = ("__MACOSX/", ".DS_Store")
_UNREAD_FORMATS: Final = frozenset(
    (".dae", ".x3d", ".fbx", ".3ds", ".blend", ".max", ".3mf", ".abc", ".c4d", ".wrl", ".dxf", ".step", ".iges")
)


def unpack(archive: Path, folder: Path, limits: IngestLimits) -> list[Path]:
    """Unpack a .zip file into an empty folder and return the files, relative to it.

    Nothing is written before every entry's name, kind and stated size are checked, and no more is written than was stated.
    Raises IngestError; the caller removes the folder.
    """
    with _opened(archive) as entries:
        wanted = _checked_entries(archive, entries, limits)
        for entry in wanted:
            _unpack_entry(archive, entries, entry, folder / entry.filename)
        return [Path(entry.filename) for entry in wanted]


def check_package(package: Path, limits: IngestLimits) -> None:
    """Check a .usdz file, which is a zip archive that is read in place: names, kinds, sizes, and that nothing is packed.

    Raises IngestError.
    """
    with _opened(package) as entries:
        for entry in _checked_entries(package, entries, limits):
            if entry.compress_type != zipfile.ZIP_STORED:
                raise _refused(package, entry.filename, "is packed, which USDZ forbids", "Make the package with usdzip")


def _opened(archive: Path) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(archive)
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OSError) as error:
        raise IngestError(
            f"{archive.name} is damaged or not a zip archive ({error}). Copy or pack it again.", path="file", value=archive.name
        ) from error


def _checked_entries(archive: Path, entries: zipfile.ZipFile, limits: IngestLimits) -> list[zipfile.ZipInfo]:
    infos = entries.infolist()
    if len(infos) > limits.input_files:
        raise IngestError(
            f"{archive.name} holds {len(infos)} entries; at most {limits.input_files} are allowed. Pack the model alone.",
            path="file",
            value=len(infos),
        )
    total = sum(info.file_size for info in infos)
    if total > limits.input_bytes:
        raise IngestError(
            f"{archive.name} unpacks to {total} bytes; at most {limits.input_bytes} are allowed. Make the model smaller.",
            path="file",
            value=total,
        )
    wanted: dict[str, zipfile.ZipInfo] = {}
    for info in infos:
        _check_entry(archive, info, limits)
        if info.is_dir() or info.filename.startswith(_IGNORED) or info.filename.endswith(_IGNORED[1]):
            continue
        if info.filename in wanted:
            raise _refused(archive, info.filename, "is there twice", "Pack it again")
        wanted[info.filename] = info
    return list(wanted.values())


def _check_entry(archive: Path, info: zipfile.ZipInfo, limits: IngestLimits) -> None:
    # The stored name: `filename` ends at a NUL and has the separators changed.
    name = info.orig_filename
    parts = PurePosixPath(name.replace("\\", "/")).parts
    if not name or "\0" in name or len(name) > 500 or any(len(part.encode("utf-8", "replace")) > 255 for part in parts):
        raise _refused(archive, name, "has no usable name", "Pack it again")
    if name.startswith(("/", "\\", "~")) or re.match(r"^[A-Za-z]:", name) or "\\" in name:
        raise _refused(archive, name, "has an absolute path or backslashes in its name", "Pack it with relative paths")
    if ".." in parts:
        raise _refused(archive, name, "would be unpacked outside its folder", "Pack it with paths below the model's folder")
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        what = "is a symbolic link" if kind == stat.S_IFLNK else "is no plain file"
        raise _refused(archive, name, what, "Pack the files themselves")
    if info.flag_bits & 0x1:
        raise _refused(archive, name, "is encrypted", "Pack it without a password")
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise _refused(archive, name, f"is packed by method {info.compress_type}", "Pack it with the usual method, deflate")
    packed = max(info.compress_size, 1)
    if info.file_size > _RATIO_FROM_BYTES and info.file_size > limits.archive_ratio * packed:
        ratio = info.file_size / packed
        raise _refused(archive, name, f"unpacks to {ratio:.0f} times its size", f"Up to {limits.archive_ratio:g} is allowed")


def _unpack_entry(archive: Path, entries: zipfile.ZipFile, entry: zipfile.ZipInfo, target: Path) -> None:
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with entries.open(entry) as packed, target.open("xb") as plain:
            left = _copy(packed, plain, entry.file_size)
    except (MemoryError, KeyboardInterrupt):
        raise
    except Exception as error:  # zlib, checksum, format and file name errors of many classes
        raise _refused(archive, entry.filename, f"is damaged ({type(error).__name__}: {error})", "Pack it again") from error
    if left:
        what = "is cut short" if left > 0 else "is larger than the archive states"
        raise _refused(archive, entry.filename, what, "Copy or pack it again")


def _copy(packed: IO[bytes], plain: IO[bytes], size: int) -> int:
    """Copy what is stated; return what is missing then, negative where there is more."""
    left = size
    while piece := packed.read(min(_CHUNK, left + 1)):
        left -= len(piece)
        if left < 0:
            break
        plain.write(piece)
    return left


def _refused(archive: Path, name: str, what: str, next_step: str) -> IngestError:
    shown = name if len(name) <= 120 else name[:117] + "..."
    return IngestError(f"{archive.name}: entry {shown!r} {what}. {next_step}.", path="file", value=shown)


def model_in(files: list[Path], member: str, *, archive: str) -> Path:
    """Return which of the files of an archive is the model: the one asked for, or the only one nearest to the top.

    Raises IngestError where there is none, or several and `member` names none of them.
    """
    models = [file for file in files if file.suffix.lower() in MODEL_SUFFIXES]
    if member:
        found = next((file for file in models if file.as_posix() == member.strip("/")), None)
        if found is None:
            raise IngestError(f"{archive} holds no model {member!r}; it holds {_listed(models)}.", path="member", value=member)
        return found
    if not models:
        unread = sorted({file.suffix.lower() for file in files} & _UNREAD_FORMATS)
        hint = f" ({', '.join(unread)} is not read)" if unread else ""
        raise IngestError(
            f"{archive} holds no model of a known format{hint}; known are {', '.join(MODEL_SUFFIXES)}. Convert it to .glb.",
            path="file",
            value=archive,
        )
    top = min(len(file.parts) for file in models)
    nearest = [file for file in models if len(file.parts) == top]
    named = [file for file in nearest if file.stem.casefold() == Path(archive).stem.casefold()]
    choice = nearest if len(nearest) == 1 else named
    if len(choice) != 1:
        raise IngestError(
            f"{archive} holds several models: {_listed(nearest)}. Name one of them as member.", path="member", value=""
        )
    return choice[0]


def _listed(models: list[Path]) -> str:
    names = [repr(file.as_posix()) for file in models]
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "") if names else "none"
