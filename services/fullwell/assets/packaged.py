"""Models that come inside an installed package: ``sumo:<name>`` names one of eclipse-sumo's 3D models."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from fullwell.assets.model import ModelError
from fullwell.core.errors import unknown_name_message

__all__ = ["SUMO_PREFIX", "PackagedModel", "packaged_model", "packaged_model_names"]

SUMO_PREFIX = "sumo:"
_PACKAGE = "eclipse-sumo"
_SUFFIX = ".obj"


@dataclass(frozen=True, slots=True)
class PackagedModel:
    """A model inside a package: its file, the package's licence (SPDX) and where it comes from, for manifests."""

    path: Path
    licence: str
    source: str


def packaged_model(name: str, *, field_path: str = "") -> PackagedModel:
    """Return the packaged model of a name like ``sumo:car-normal-citrus.obj`` (the ending may be left away).

    Raises ModelError where the package is not installed or holds no such model; the message tells the nearest names.
    """
    where = f"{field_path}: " if field_path else ""
    folder = _model_folder()
    if folder is None:
        raise ModelError(
            f"{where}{name!r} needs the package {_PACKAGE}, which is not installed. Install fullwell[traffic].",
            field_path,
            name,
        )
    relative = name.removeprefix(SUMO_PREFIX).strip("/")
    known = {path.relative_to(folder).as_posix(): path for path in _models_in(folder)}
    found = known.get(relative) or known.get(relative + _SUFFIX)
    if found is None:
        message = unknown_name_message("packaged model", name, (SUMO_PREFIX + entry for entry in known))
        raise ModelError(where + message, field_path, name)
    licence, source = _provenance()
    return PackagedModel(found, licence, f"{source}, data/3D/{found.relative_to(folder).as_posix()}")


def packaged_model_names() -> list[str]:
    """Return the names of all packaged models, sorted; empty where eclipse-sumo is not installed."""
    folder = _model_folder()
    return [] if folder is None else [SUMO_PREFIX + path.relative_to(folder).as_posix() for path in _models_in(folder)]


def _model_folder() -> Path | None:
    # The folder is found without importing the package: only traffic/ may import SUMO.
    for module, below in (("sumo", "data"), ("sumo_data", "data")):
        spec = find_spec(module)
        for place in [] if spec is None else (spec.submodule_search_locations or []):
            folder = Path(place) / below / "3D"
            if folder.is_dir():
                return folder
    return None


def _models_in(folder: Path) -> list[Path]:
    return sorted(folder.rglob(f"*{_SUFFIX}"))


def _provenance() -> tuple[str, str]:
    try:
        package = metadata.metadata(_PACKAGE)
    except metadata.PackageNotFoundError:
        # A build of SUMO on the import path without package metadata; its licence is the project's.
        return "EPL-2.0 OR GPL-2.0-or-later", "Eclipse SUMO"
    stated = next((package[key] for key in ("License-Expression", "License") if key in package), None)
    return stated or "EPL-2.0 OR GPL-2.0-or-later", f"Eclipse SUMO {package['Version']}"
