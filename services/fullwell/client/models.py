"""A model on this disk with the files that it names, and the models of a folder. Nothing but names and text is read here."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any, Final
from urllib.parse import unquote

from fullwell.core import FieldError

__all__ = ["ARCHIVE_SUFFIXES", "MODEL_SUFFIXES", "ModelFiles", "collect_model", "find_models"]

MODEL_SUFFIXES: Final = (".glb", ".gltf", ".obj", ".ply", ".stl", ".usd", ".usda", ".usdc", ".usdz")
ARCHIVE_SUFFIXES: Final = (".zip",)
LAYER_SUFFIXES: Final = (".usd", ".usda", ".usdc")
_SIDE_SUFFIXES: Final = frozenset(
    {
        *LAYER_SUFFIXES,
        ".usdz",
        ".mtl",
        ".bin",
        ".png",
        ".jpg",
        ".jpeg",
        ".tga",
        ".bmp",
        ".webp",
        ".tif",
        ".tiff",
        ".exr",
        ".hdr",
    }
)
"""What a model may take along: a damaged or hostile one must not have other files of this disk sent away."""
MAX_CLIMB: Final = 4
"""Kits of layers share folders above the model's own; further up nothing is taken."""
MAX_TEXT_BYTES: Final = 200_000_000
MAX_SIDE_FILES: Final = 5000

_OBJ = re.compile(r"^\s*mtllib\s+(.+?)\s*$", re.MULTILINE | re.IGNORECASE)
_MTL_OPTION = r"-\w+(?:\s+(?:[-+.\d]+|on|off|[a-z]))+\s+"
_MTL = re.compile(rf"^\s*(?:map_\w+|bump|disp|norm)\s+(?:{_MTL_OPTION})*(.+?)\s*$", re.MULTILINE | re.IGNORECASE)
_USD = re.compile(rb"@([^@\n]{1,500})@")


class ModelFiles(dict[str, Path]):
    """{relative path: file} of one model; `main` is the path of the model itself."""

    def __init__(self, main: str, files: dict[str, Path]) -> None:
        super().__init__(files)
        self.main = main


def collect_model(model: Path, *, root: Path | None = None) -> ModelFiles:
    """Return a model with the files that it names, and those that they name; absent ones are left out.

    Paths are relative to the deepest folder that holds all of them. A binary USD layer does not tell what it names without
    its library: then every layer and picture below `root` goes along, or below the layer's own folder.

    Raises
    ------
    FieldError
        The model does not exist, or is of no format that is read.
    """
    model = Path(model)
    if not model.is_file():
        raise FieldError(f"{str(model)!r} does not exist, or is not a file.", "PATH", str(model))
    if model.suffix.casefold() not in (*MODEL_SUFFIXES, *ARCHIVE_SUFFIXES):
        known = ", ".join((*MODEL_SUFFIXES, *ARCHIVE_SUFFIXES))
        raise FieldError(f"{model.name!r} is of no format that is read; must end in {known}.", "PATH", model.name)
    main = model.resolve()
    limit = _limit(main, root)
    found = {main}
    waiting = [main]
    while waiting and len(found) < MAX_SIDE_FILES:
        file = waiting.pop()
        for named in _named_by(file, limit if root is not None else file.parent):
            if (
                named not in found
                and named.is_relative_to(limit)
                and named.suffix.casefold() in _SIDE_SUFFIXES
                and named.is_file()
            ):
                found.add(named)
                waiting.append(named)
    base = _common_folder(found)
    files = {file.relative_to(base).as_posix(): file for file in sorted(found)}
    return ModelFiles(main.relative_to(base).as_posix(), files)


def find_models(folder: Path, *, recursive: bool) -> list[Path]:
    """Return the models in a folder, sorted. USD layers that others of them name are parts of those, not models."""
    pattern = "**/*" if recursive else "*"
    found = [file for file in sorted(folder.glob(pattern)) if file.is_file() and file.suffix.casefold() in MODEL_SUFFIXES]
    layers = [file for file in found if file.suffix.casefold() in LAYER_SUFFIXES]
    named = {name for file in layers for name in _named_by(file.resolve(), None)}
    return [file for file in found if file.resolve() not in named]


def _limit(main: Path, root: Path | None) -> Path:
    if root is not None:
        return root.resolve()
    folder = main.parent
    if main.suffix.casefold() not in LAYER_SUFFIXES:
        return folder
    for _ in range(MAX_CLIMB):
        if len(folder.parent.parts) < 3:  # never to the top of the file system, or a folder right below it
            break
        folder = folder.parent
    return folder


def _common_folder(files: set[Path]) -> Path:
    folder = min(files, key=lambda file: len(file.parts)).parent
    while not all(file.is_relative_to(folder) for file in files):
        folder = folder.parent
    return folder


def _named_by(file: Path, around: Path | None) -> Iterator[Path]:
    """Yield the files that a file names; `around` is what a binary layer takes along, None for nothing."""
    suffix = file.suffix.casefold()
    if file.stat().st_size > MAX_TEXT_BYTES:
        return
    if suffix in LAYER_SUFFIXES:
        yield from _named_by_layer(file, around)
        return
    for reference in _references(file, suffix):
        for text in dict.fromkeys((reference, unquote(reference))):
            if _is_plain(text):
                yield (file.parent / text.replace("\\", "/")).resolve()


def _named_by_layer(file: Path, around: Path | None) -> Iterator[Path]:
    content = file.read_bytes()
    if content.startswith(b"PXR-USDC"):
        for other in sorted(around.rglob("*")) if around is not None else ():
            if other.suffix.casefold() in _SIDE_SUFFIXES and other.is_file():
                yield other.resolve()
        return
    for reference in _USD.findall(content):
        text = reference.decode("utf-8", "replace").partition("[")[0]  # kit.usdz[texture.png] lies in kit.usdz
        if _is_plain(text):
            yield (file.parent / text).resolve()


def _references(file: Path, suffix: str) -> list[str]:
    if suffix in (".glb", ".gltf"):
        return _gltf_references(_gltf_tree(file, suffix))
    if suffix in (".obj", ".mtl"):
        text = file.read_text(encoding="utf-8", errors="replace")
        return (_OBJ if suffix == ".obj" else _MTL).findall(text)
    return []


def _gltf_tree(file: Path, suffix: str) -> Any:
    content = file.read_bytes()
    if suffix == ".glb":
        if len(content) < 20 or content[:4] != b"glTF":
            return None
        content = content[20 : 20 + int(struct.unpack("<I", content[12:16])[0])]
    try:
        return json.loads(content)
    except (ValueError, RecursionError):
        return None  # ingestion says what is wrong with it


def _gltf_references(tree: Any) -> list[str]:
    if not isinstance(tree, dict):
        return []
    entries = [entry for kind in ("buffers", "images") if isinstance(tree.get(kind), list) for entry in tree[kind]]
    uris = [entry.get("uri") for entry in entries if isinstance(entry, dict)]
    return [uri for uri in uris if isinstance(uri, str) and not uri.startswith("data:")]


def _is_plain(reference: str) -> bool:
    """Whether a reference is a relative path: addresses and absolute paths are left to ingestion, which refuses them."""
    path = PurePosixPath(reference.replace("\\", "/"))
    return (
        bool(reference) and "\0" not in reference and not path.is_absolute() and not re.match(r"^[A-Za-z][\w+.-]*:", reference)
    )
