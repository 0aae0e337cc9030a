"""Version and event files of assets: the truth in the object store, of which the catalogue's tables are an index."""

from __future__ import annotations

import json
import re
import secrets
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Final, cast, get_args

from fullwell.assets.query import ReviewState
from fullwell.assets.records import check_asset_id
from fullwell.assets.store import check_digest, event_key, version_key
from fullwell.core import AssetError, FieldError, canonical_json
from fullwell.jobs.asset_records import EventKind

__all__ = ["DECISIONS", "AssetFile", "Standing", "file_from", "is_asset_file", "next_micros", "place_of", "standing_of"]

SCHEMA: Final = "fullwell/asset-event/v1"
DECISIONS: Final = frozenset({"approved", "rejected", "pending"})
VERSION_KINDS: Final = frozenset({"imported", "edited"})
_NAME_DIGITS: Final = 17
_KEY: Final = re.compile(r"assets/(?P<id>[^/]+)/(?:versions/(?P<version>\d{8})|events/(?P<name>\d{17}-[0-9a-f]{8}))\.json")


@dataclass(frozen=True, slots=True)
class AssetFile:
    """A version or an event, as its file says.

    Attributes
    ----------
    id, version
        Which version of which asset it is, or is about.
    line
        The version whose import brought what this version shows: itself, or for an edit what was edited.
    kind, who, detail
        As in AssetEvent.
    micros
        Unix time [us]; names sort by it.
    mark
        Tells events of one asset at one time apart: 8 hexadecimal digits; of a version "v" and its number.
    digest
        The manifest's, of versions; else empty.
    """

    id: str
    version: int
    line: int
    kind: EventKind
    who: str
    micros: int
    mark: str
    detail: str = ""
    digest: str = ""

    @property
    def name(self) -> str:
        """Text that sorts the events of an asset by time."""
        return f"{self.micros:0{_NAME_DIGITS}d}-{self.mark}"

    @property
    def when(self) -> float:
        """Unix time [s]."""
        return self.micros / 1e6

    @property
    def is_version(self) -> bool:
        """Whether it makes a version, so that its file is the version's."""
        return self.kind in VERSION_KINDS

    @property
    def key(self) -> str:
        """The object key of the file."""
        return version_key(self.id, self.version) if self.is_version else event_key(self.id, self.name)

    def content(self) -> bytes:
        """Return the file's bytes."""
        return canonical_json({"schema": SCHEMA, **asdict(self)})

    @classmethod
    def of_version(
        cls, asset_id: str, version: int, *, line: int, digest: str, who: str, micros: int, detail: str = ""
    ) -> AssetFile:
        """Return the file of a new version: imported where the line begins with it, edited otherwise."""
        kind: EventKind = "imported" if line == version else "edited"
        return cls(asset_id, version, line, kind, who, micros, f"v{version:08d}", detail, digest)

    @classmethod
    def of_event(
        cls, asset_id: str, version: int, *, line: int, kind: EventKind, who: str, micros: int, detail: str = ""
    ) -> AssetFile:
        """Return the file of a new event."""
        return cls(asset_id, version, line, kind, who, micros, secrets.token_hex(4), detail)


def next_micros(now: float, last: str) -> int:
    """Return a time [us] for a new event: now, but after the last event of the asset, whatever the clocks say."""
    return max(round(now * 1e6), int(last[:_NAME_DIGITS] or 0) + 1)


def is_asset_file(key: str) -> bool:
    """Return whether an object key is that of a version or an event."""
    return _KEY.fullmatch(key) is not None


def place_of(key: str) -> tuple[str, int | str] | None:
    """Return (asset, number of the version or name of the event) that an object key stands for, or None."""
    match = _KEY.fullmatch(key)
    if match is None:
        return None
    return match["id"], int(match["version"]) if match["version"] else match["name"]


def file_from(key: str, content: bytes) -> AssetFile:
    """Return what a file says. Raises AssetError where it is damaged or does not belong to its key."""
    try:
        document: dict[str, Any] = json.loads(content)
        if document.pop("schema") != SCHEMA:
            raise ValueError(f"its schema is not {SCHEMA}")
        found = AssetFile(**document)
        check_asset_id(found.id)
        if found.kind not in get_args(EventKind) or not 0 < found.line <= found.version or found.key != key:
            raise ValueError("it says something else than its place")
        if found.is_version:
            check_digest(found.digest)
    except (ValueError, TypeError, KeyError, AttributeError, FieldError) as error:
        raise AssetError(f"the object {key} is damaged: {error}. Restore it from a copy, or delete it.") from error
    return found


@dataclass(frozen=True, slots=True)
class Standing:
    """What all files of an asset say together.

    Attributes
    ----------
    decisions
        {line: the last decision about one of its versions}.
    retired
        Whether it is out of the catalogue.
    collected
        Versions whose content is gone.
    """

    decisions: dict[int, AssetFile]
    retired: bool
    collected: frozenset[int]

    def state(self, line: int) -> ReviewState:
        """Return the review state of a line's versions."""
        decision = self.decisions.get(line)
        return "pending" if decision is None else cast(ReviewState, decision.kind)


def standing_of(files: Iterable[AssetFile]) -> Standing:
    """Return what the files of one asset, in order of their names, say together."""
    decisions: dict[int, AssetFile] = {}
    retired, collected = False, set()
    for file in files:
        if file.kind in DECISIONS:
            decisions[file.line] = file
        elif file.kind in ("imported", "retired", "restored"):
            retired = file.kind == "retired"
        elif file.kind == "collected":
            collected.add(file.version)
    return Standing(decisions, retired, frozenset(collected))
