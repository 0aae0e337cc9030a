"""What somebody asks ingestion for: uploaded files by digest, and what they say of them. Checked before any work."""

from __future__ import annotations

import json
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import PurePosixPath
from typing import Any, Final

from fullwell.assets.classes import asset_class
from fullwell.assets.ingest.options import IngestLimits, IngestOptions
from fullwell.assets.licences import check_licence
from fullwell.assets.meshes import MODEL_SUFFIXES
from fullwell.assets.records import LicenceRecord, check_asset_id, check_tags
from fullwell.core import FieldError, sha256_hex
from fullwell.core.settings import Settings
from fullwell.jobs.files import check_files, relative_path

__all__ = ["ARCHIVE_SUFFIXES", "RESERVED_IDS", "AssetRequest", "default_asset_id", "ingest_limits", "main_file"]

ARCHIVE_SUFFIXES: Final = (".zip",)
"""Archives whose content is unpacked by ingestion."""
WALL_OVER_CPU: Final = 1.5
"""A shared machine does not give all of its time to one process."""
RESERVED_IDS: Final = frozenset({"archives", "classes", "export", "facets", "gc", "ingestions", "reindex", "review"})
"""Words that stand in an id's place in the addresses of the HTTP interface."""
MAX_TEXT: Final = 500


@dataclass(frozen=True, slots=True)
class AssetRequest:
    """One asset to be made from uploaded files.

    Attributes
    ----------
    files
        {relative path: SHA-256} of the blobs.
    main
        The path in `files` that is the model, or an archive with one in it.
    asset_class, title, id, tags, licence
        As in the manifest; an empty id or title is made from the file's name.
    unit_m, up_axis, forward_axis
        Metres per unit and axes of the file; empty where they are to be detected. Axes are "x", "-x" and so on.
    length_m
        Extent along x that the asset is scaled to [m]; None keeps the file's scale.
    variant
        {USD variant set: variant}.
    member
        Which file of an archive is the model; needed where it holds several.
    """

    files: Mapping[str, str]
    main: str
    asset_class: str
    licence: LicenceRecord
    id: str = ""
    title: str = ""
    tags: tuple[str, ...] = ()
    unit_m: float | None = None
    up_axis: str = ""
    forward_axis: str = ""
    length_m: float | None = None
    variant: Mapping[str, str] = field(default_factory=dict)
    member: str = ""

    def checked(self) -> AssetRequest:
        """Return the request in normal form; FieldError names the first field that is not legal."""
        files = check_files(self.files)
        asset_class(self.asset_class, path="class")
        _check_texts({"title": self.title, "attribution": self.licence.attribution, "licence_url": self.licence.url})
        licence = replace(self.licence, spdx=check_licence(self.licence.spdx))
        asset_id = check_asset_id(self.id) if self.id else default_asset_id(self.main or main_file(files))
        if asset_id in RESERVED_IDS:
            raise FieldError(f"id is {asset_id!r}, which the service's addresses use. Give another id.", "id", asset_id)
        main = main_file(files, self.main)
        checked = replace(self, files=files, main=main, id=asset_id, tags=check_tags(self.tags), licence=licence)
        checked.options()  # what ingestion would refuse is refused now
        return checked

    def to_json(self) -> str:
        """Return the request as JSON that `from_json` reads."""
        return json.dumps(asdict(self), sort_keys=True)

    def options(self) -> IngestOptions:
        """Return what ingestion is told beside the files."""
        return IngestOptions(
            id=self.id,
            asset_class=self.asset_class,
            title=self.title,
            tags=self.tags,
            licence=self.licence,
            source_name=PurePosixPath(self.main).name,
            unit_m=self.unit_m,
            length_m=self.length_m,
            up_axis=self.up_axis or None,  # type: ignore[arg-type] # checked there
            forward_axis=self.forward_axis or None,  # type: ignore[arg-type] # checked there
            member=self.member,
            variants=dict(self.variant),
        )

    @classmethod
    def from_json(cls, text: str) -> AssetRequest:
        """Return the request that `to_json` wrote."""
        given: dict[str, Any] = json.loads(text)
        return cls(**given | {"licence": LicenceRecord(**given["licence"]), "tags": tuple(given["tags"])})


def ingest_limits(settings: Settings) -> IngestLimits:
    """Return what taking in one asset may cost on this machine."""
    return IngestLimits(
        memory_bytes=settings.ingest_memory_bytes,
        cpu_s=settings.ingest_time_limit_s,
        wall_s=settings.ingest_time_limit_s * WALL_OVER_CPU,
        input_bytes=settings.max_upload_bytes,
    )


def default_asset_id(name: str) -> str:
    """Return the id that a file's name stands for: "Old Cars/Red Car (1).glb" is "red-car-1"."""
    folded = unicodedata.normalize("NFKD", PurePosixPath(name).stem).encode("ascii", "ignore").decode().casefold()
    plain = re.sub(r"[^a-z0-9._]+", "-", folded).strip("-._")[:80].strip("-._")
    return plain if plain and plain not in RESERVED_IDS else f"asset-{plain or sha256_hex(name.encode())[:8]}"


def main_file(names: Iterable[str], given: str = "") -> str:
    """Return the model among files: as given, or the only one that can be it.

    Raises
    ------
    FieldError
        None can be it, several can, or the given one is not among them.
    """
    known = list(names)
    if given:
        main = relative_path(given, path="main")
        if main not in known:
            raise FieldError(f"main is {given[:120]!r}; must be one of the files: {_some(known)}.", "main", given[:120])
        return main
    suffixes = (*MODEL_SUFFIXES, *ARCHIVE_SUFFIXES)
    found = [name for name in known if PurePosixPath(name).suffix.casefold() in suffixes]
    if len(found) == 1:
        return found[0]
    if not found:
        raise FieldError(f"files holds no model; one must end in {', '.join(suffixes)}. There are: {_some(known)}.", "files")
    raise FieldError(f"files holds {len(found)} models: {_some(found)}. Name one of them in main.", "main")


def _check_texts(texts: Mapping[str, str]) -> None:
    for name, text in texts.items():
        if len(text) > MAX_TEXT or any(ord(character) < 32 for character in text):
            raise FieldError(
                f"{name} has {len(text)} characters; must have at most {MAX_TEXT}, none of them a control character.", name
            )


def _some(names: list[str]) -> str:
    return ", ".join(repr(name[:80]) for name in names[:5]) + (", ..." if len(names) > 5 else "") or "none"
