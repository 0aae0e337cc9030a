"""The files that a recipe names, beside it on this disk."""

from __future__ import annotations

import json
import posixpath
import re
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import Any

from fullwell.core import FieldError
from fullwell.jobs.files import RESOLVED_PREFIXES, file_references, relative_path

__all__ = ["collect_files"]

MAX_SIDE_FILE_BYTES = 50_000_000


def collect_files(recipe: Mapping[str, Any], base_dir: Path, *, given: Container[str] = ()) -> dict[str, Path]:
    """Return {relative path: file} of everything that the recipe reads, with what those files name in turn.

    References in `given` are left out: their files lie elsewhere.

    Raises
    ------
    FieldError
        A file does not exist, or lies outside the recipe's folder.
    """
    found: dict[str, Path] = {}
    for path, reference in file_references(recipe):
        if reference.startswith(RESOLVED_PREFIXES):
            continue
        name = relative_path(reference, path=path)
        if name in given:
            continue
        file = base_dir / name
        if not file.is_file():
            raise FieldError(f"{path} is {reference!r}; {file} does not exist.", path, reference)
        found[name] = file
        for side_name, side_file in _side_files(name, file, base_dir, {name}):
            found.setdefault(side_name, side_file)
    return found


def _side_files(name: str, file: Path, base_dir: Path, seen: set[str]) -> Iterator[tuple[str, Path]]:
    """Yield what a file names: materials and textures of OBJ, buffers and pictures of glTF, inputs of a SUMO configuration.

    Absent ones are left out.
    """
    for reference in _named_by(file):
        try:
            side_name = relative_path(posixpath.normpath(posixpath.join(posixpath.dirname(name), reference)))
        except FieldError:
            continue  # the reader refuses such a file with its own words
        side_file = base_dir / side_name
        if side_file.is_file() and side_name not in seen:
            seen.add(side_name)
            yield side_name, side_file
            if side_file.suffix.casefold() in (".mtl", ".xml"):
                yield from _side_files(side_name, side_file, base_dir, seen)


def _named_by(file: Path) -> list[str]:
    suffix = file.suffix.casefold()
    if suffix in (".sumocfg", ".xml"):
        return _named_by_sumo(file)
    if suffix not in (".obj", ".mtl", ".gltf") or file.stat().st_size > MAX_SIDE_FILE_BYTES:
        return []
    text = file.read_text(encoding="utf-8", errors="replace")
    if suffix == ".gltf":
        try:
            document = json.loads(text)
        except ValueError:
            return []
        items = [*document.get("buffers", []), *document.get("images", [])] if isinstance(document, dict) else []
        return [str(item["uri"]) for item in items if "uri" in item and not str(item["uri"]).startswith("data:")]
    pattern = r"^\s*mtllib\s+(.+?)\s*$" if suffix == ".obj" else r"^\s*(?:map_\w+|bump|disp|norm)\s+(?:-\S+\s+\S+\s+)*(.+?)\s*$"
    return re.findall(pattern, text, flags=re.MULTILINE | re.IGNORECASE)


def _named_by_sumo(file: Path) -> list[str]:
    """Return the inputs that a configuration of SUMO names, or what one of its inputs takes in."""
    if file.name.casefold().endswith(".net.xml") or file.stat().st_size > MAX_SIDE_FILE_BYTES:
        return []
    text = file.read_text(encoding="utf-8", errors="replace")
    options = r"<(?:n|net|net-file|r|routes|route-files|a|additional|additional-files|w|weights|weight-files)\s+v(?:alue)?="
    lists = re.findall(options + r"[\"']([^\"']+)[\"']", text)
    taken_in = re.findall(r"<(?:include|rerouter|variableSpeedSign)\s[^>]*?\b(?:href|file)=[\"']([^\"']+)[\"']", text)
    return [part.strip() for names in lists for part in names.split(",") if part.strip()] + taken_in
