"""Cheap checks of a model file's header and of what it refers to, before a parser is let loose on it."""

from __future__ import annotations

import io
import json
import re
import struct
from collections.abc import Callable
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any
from urllib.parse import unquote

from PIL import Image

from fullwell.assets.model import ModelError, ModelSource

__all__ = ["PREFLIGHT", "ConfinedFiles", "as_utf8", "confined_path"]

_GLTF_READ_EXTENSIONS = frozenset({"KHR_draco_mesh_compression", "KHR_materials_unlit", "EXT_texture_webp"})
"""Extensions that may be *required*; others would leave the geometry or its colours wrong."""

_IMAGE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".tga", ".bmp", ".webp", ".tif", ".tiff"})

_ACCESSOR_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}


def confined_path(source: ModelSource, reference: str, *, base: Path, root: Path) -> Path:
    """Return the file that `reference` names, seen from folder `base`; it must be relative and stay within `root`.

    Links are followed before the check. Raises ModelError for absolute paths, drive letters, home folders, URLs and escapes.
    """
    text = reference.strip().strip('"')
    if re.match(r"^[A-Za-z][A-Za-z0-9+.-]+:", text):
        raise source.error(f"refers to {_short(text)}, a network address", "Download the file beside the model and refer to it")
    spelled = text.replace("\\", "/")
    if PurePosixPath(spelled).is_absolute() or PureWindowsPath(spelled).drive or spelled.startswith("~") or "\0" in spelled:
        raise source.error(
            f"refers to {_short(text)}, an absolute path", "Put the file beside the model and refer to it by a relative path"
        )
    target = (base / spelled).resolve()
    if not target.is_relative_to(root.resolve()):
        raise source.error(
            f"refers to {_short(text)}, which lies outside the folder {root}", "Put the file inside it, beside the model"
        )
    return target


def _short(text: str) -> str:
    return repr(text if len(text) <= 120 else text[:117] + "...")


class ConfinedFiles:
    """Files beside a model: reads those within its root, refuses the others, notes the missing ones."""

    def __init__(self, source: ModelSource, warnings: list[str]) -> None:
        self._source = source
        self._warnings = warnings
        self._base = source.file.parent
        self._root = source.root or source.file.parent
        self.read_files: set[Path] = set()
        self.refusal: ModelError | None = None
        """The first refusal: parsers may swallow what `read` raises, so the caller looks here afterwards."""

    def read(self, reference: str) -> bytes:
        """Return the bytes of a referred file; FileNotFoundError where it is missing (noted as a warning)."""
        try:
            return self._read(reference)
        except ModelError as error:
            self.refusal = self.refusal or error
            raise

    def _read(self, reference: str) -> bytes:
        target = confined_path(self._source, reference, base=self._base, root=self._root)
        if not target.is_file():
            plain = unquote(reference)
            if plain != reference:
                return self.read(plain)
            self._warnings.append(
                f"{self._source.file.name}: {_short(reference)} is missing; its materials or textures are lost."
            )
            raise FileNotFoundError(reference)
        if target.stat().st_size > self._source.max_bytes:
            raise self._source.error(
                f"refers to {_short(reference)}, which has more than {self._source.max_bytes} bytes", "Make it smaller"
            )
        content = target.read_bytes()
        self.read_files.add(target)
        if target.suffix.lower() in _IMAGE_SUFFIXES:
            self._check_image(reference, content)
        return as_utf8(content) if target.suffix.lower() == ".mtl" else content

    def _check_image(self, reference: str, content: bytes) -> None:
        try:
            Image.open(io.BytesIO(content)).close()
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
            raise self._source.error(
                f"refers to {_short(reference)}, which is not a readable image ({error})", "Export the texture again"
            ) from error

    def check(self, reference: str) -> None:
        """Raise ModelError where the reference is not allowed; a missing file is not an error here."""
        confined_path(self._source, unquote(reference), base=self._base, root=self._root)

    def exists(self, reference: str) -> bool:
        """Whether an allowed reference names a file."""
        return confined_path(self._source, unquote(reference), base=self._base, root=self._root).is_file()

    def resolver(self) -> Any:
        """Return the object through which trimesh reads every other file."""
        from trimesh.resolvers import Resolver  # noqa: PLC0415  (an extra)

        files, name = self, self._source.file.name

        class _Resolver(Resolver):  # type: ignore[misc]
            file_name = name

            def __init__(self) -> None: ...

            def get(self, key: str) -> bytes:
                return files.read(str(key))

            def keys(self) -> list[str]:
                return []

            def write(self, name: str, data: bytes) -> None:
                raise OSError("models are only read")

            def namespaced(self, namespace: str) -> _Resolver:
                return self

        return _Resolver()


# glTF ----------------------------------------------------------------------------------------------------------------


def _check_glb(source: ModelSource, content: bytes, files: ConfinedFiles) -> bytes:
    """glTF 2.0, section 4: a 12-byte header that states the length, then a JSON chunk."""
    if content[:4] != b"glTF":
        raise source.error("does not begin like a GLB file", "Check that it is one; a text glTF file ends in .gltf")
    if len(content) < 20:
        raise source.error(f"ends after {len(content)} bytes, inside its header", "Copy or download it again")
    version, length = struct.unpack("<II", content[4:12])
    if version != 2:
        raise source.error(f"is glTF version {version}; only version 2 is read", "Export it as glTF 2.0")
    if length > len(content):
        raise source.error(f"is truncated: {len(content)} of {length} bytes are there", "Copy or download it again")
    json_length, json_kind = struct.unpack("<I4s", content[12:20])
    if json_kind != b"JSON" or 20 + json_length > len(content):
        raise source.error("has a damaged first chunk", "Copy or download it again")
    binary_bytes = max(length - 20 - json_length - 8, 0)
    _check_gltf_tree(source, content[20 : 20 + json_length], files, binary_bytes=binary_bytes)
    return content


def _check_gltf(source: ModelSource, content: bytes, files: ConfinedFiles) -> bytes:
    _check_gltf_tree(source, content, files, binary_bytes=None)
    return content


def _check_gltf_tree(source: ModelSource, text: bytes, files: ConfinedFiles, *, binary_bytes: int | None) -> None:
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise source.error(f"holds damaged JSON ({error})", "Export it again") from error
    if not isinstance(tree, dict) or not isinstance(tree.get("asset"), dict):
        raise source.error("is not a glTF file: it has no 'asset' entry", "Export it as glTF 2.0")
    version = str(tree["asset"].get("version", "2.0"))
    if not version.startswith("2"):
        raise source.error(f"is glTF version {version}; only version 2 is read", "Export it as glTF 2.0")
    required = sorted(set(_strings(tree.get("extensionsRequired"))) - _GLTF_READ_EXTENSIONS)
    if required:
        raise source.error(f"requires the extensions {', '.join(required)}, which are not read", "Export it without them")
    _check_gltf_files(source, tree, files)
    _check_accessors(source, tree, binary_bytes=binary_bytes)


def _check_gltf_files(source: ModelSource, tree: dict[str, Any], files: ConfinedFiles) -> None:
    for kind in ("buffers", "images"):
        for entry in _dicts(tree.get(kind)):
            uri = entry.get("uri")
            if not isinstance(uri, str) or uri.startswith("data:"):
                continue
            files.check(uri)
            if kind == "buffers" and not files.exists(uri):
                raise source.error(f"refers to {_short(uri)}, which is missing", "Copy it beside the model")


def _check_accessors(source: ModelSource, tree: dict[str, Any], *, binary_bytes: int | None) -> None:
    """Counts that no buffer can hold are refused before memory is reserved for them."""
    buffers = _dicts(tree.get("buffers"))
    available = [int(b.get("byteLength", 0)) if isinstance(b.get("byteLength"), int) else 0 for b in buffers]
    limit = max([*available, 0]) if binary_bytes is None else max(binary_bytes, *[0, *available])
    limit = min(limit, source.max_bytes)
    for index, accessor in enumerate(_dicts(tree.get("accessors"))):
        count = accessor.get("count")
        size = _ACCESSOR_BYTES.get(accessor.get("componentType", 0), 1)
        if not isinstance(count, int) or count < 0 or ("bufferView" in accessor and count * size > limit):
            raise source.error(
                f"states a count of {count!r} in accessor {index}, more than its {limit} bytes can hold", "Export it again"
            )
        if "bufferView" not in accessor and count > source.max_triangles * 3:
            raise source.error(f"states a count of {count} in accessor {index}", "Export it again")
        if "sparse" in accessor:
            raise source.error(f"uses a sparse accessor ({index}), which is not read", "Export it without sparse accessors")


def _dicts(value: Any) -> list[dict[str, Any]]:
    return [entry for entry in value if isinstance(entry, dict)] if isinstance(value, list) else []


def _strings(value: Any) -> list[str]:
    return [entry for entry in value if isinstance(entry, str)] if isinstance(value, list) else []


# OBJ -----------------------------------------------------------------------------------------------------------------

_RELATIVE_FACE = re.compile(rb"^f[ \t][^\n]*-\d", re.MULTILINE)


def _check_obj(source: ModelSource, content: bytes, files: ConfinedFiles) -> bytes:
    if b"\0" in content[:4096]:
        raise source.error("is not a text file, which OBJ files are", "Check its format")
    vertices = len(re.findall(rb"^[ \t]*v[ \t]", content, re.MULTILINE))
    faces = len(re.findall(rb"^[ \t]*f[ \t]", content, re.MULTILINE))
    if not faces or not vertices:
        raise source.error(
            f"has {vertices} vertex lines and {faces} face lines; an OBJ mesh needs both", "Export it as a polygon mesh"
        )
    for library in re.findall(rb"^[ \t]*mtllib[ \t]+([^\r\n]+)", content, re.MULTILINE):
        files.check(library.decode("utf-8", "replace"))
    content = as_utf8(content)
    if _RELATIVE_FACE.search(content):
        return _with_absolute_indices(source, content)
    return content


def as_utf8(content: bytes) -> bytes:
    """Return text in UTF-8: what is none is taken for Latin-1, in which any bytes are text; it concerns names alone."""
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("latin-1").encode("utf-8")
    return content


def _with_absolute_indices(source: ModelSource, content: bytes) -> bytes:
    """Return the OBJ text with indices that count from 1; negative ones count back from the latest vertex *so far*."""
    counts = {b"v": 0, b"vt": 0, b"vn": 0}
    lines = content.split(b"\n")
    for number, line in enumerate(lines):
        words = line.split()
        if not words:
            continue
        if words[0] in counts:
            counts[words[0]] += 1
        elif words[0] == b"f":
            totals = (counts[b"v"], counts[b"vt"], counts[b"vn"])
            try:
                lines[number] = b"f " + b" ".join(_absolute_corner(word, totals) for word in words[1:])
            except ValueError as error:
                raise source.error(f"has a damaged face in line {number + 1}", "Export it again") from error
    return b"\n".join(lines)


def _absolute_corner(corner: bytes, totals: tuple[int, int, int]) -> bytes:
    indices = []
    for text, total in zip(corner.split(b"/"), totals, strict=False):
        index = int(text) if text else None
        if index is not None and (index == 0 or index < -total):
            raise ValueError(corner)
        indices.append(b"" if index is None else str(index + total + 1 if index < 0 else index).encode())
    return b"/".join(indices)


# PLY and STL ---------------------------------------------------------------------------------------------------------


def _check_ply(source: ModelSource, content: bytes, files: ConfinedFiles) -> bytes:
    if content[:3] != b"ply":
        raise source.error("does not begin with 'ply'", "Check its format")
    end = content.find(b"end_header", 0, 1 << 20)
    if end < 0:
        raise source.error("has no end of its header", "Copy or export it again")
    for name, count in re.findall(rb"^[ \t]*element[ \t]+(\w+)[ \t]+(\S+)", content[:end], re.MULTILINE):
        text = count.decode("ascii", "replace")
        # Every element takes at least one byte, so a larger count than the file has bytes is damage.
        if not text.isdigit() or int(text) > len(content):
            raise source.error(
                f"states {text[:40]} elements of {name.decode('ascii', 'replace')!r} in {len(content)} bytes",
                "It is damaged; export it again",
            )
    return content


def _check_stl(source: ModelSource, content: bytes, files: ConfinedFiles) -> bytes:
    """Binary: 80 bytes of header, a count, 50 bytes a triangle. Text: begins with 'solid' and holds facets."""
    stated = struct.unpack("<I", content[80:84])[0] if len(content) >= 84 else -1
    if stated >= 0 and len(content) == 84 + 50 * stated:
        return content
    text = content.lstrip()[:5].lower() == b"solid" and b"facet" in content[: 1 << 20]
    if text:
        if b"endsolid" not in content[-4096:]:
            raise source.error("is truncated: a text STL ends with 'endsolid'", "Copy or export it again")
        return content
    if stated >= 0 and len(content) > 84 + 50 * stated and stated > 0:
        return content[: 84 + 50 * stated]
    raise source.error(
        f"is truncated or not an STL file: {stated if stated >= 0 else 'no'} triangles stated, {len(content)} bytes there",
        "Copy or export it again",
    )


PREFLIGHT: dict[str, Callable[[ModelSource, bytes, ConfinedFiles], bytes]] = {
    ".glb": _check_glb,
    ".gltf": _check_gltf,
    ".obj": _check_obj,
    ".ply": _check_ply,
    ".stl": _check_stl,
}
