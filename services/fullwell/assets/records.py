"""What the store keeps of an asset: an immutable manifest, and the blobs it names by their SHA-256."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any, Final, Literal

from fullwell.assets.classes import asset_class
from fullwell.core.errors import FieldError
from fullwell.core.hashing import digest_of

__all__ = [
    "ASSET_SCHEMA",
    "AssetManifest",
    "Check",
    "CheckState",
    "LevelRecord",
    "LicenceRecord",
    "MaterialChoice",
    "PartRecord",
    "PreparedAsset",
    "SourceRecord",
    "check_asset_id",
    "check_tags",
]

ASSET_SCHEMA: Final = "fullwell/asset/v1"

CheckState = Literal["ok", "mended", "warning", "decide", "failed"]
"""In rising order of concern: fine; repaired; unusual; a person must decide before approval; unusable."""

MaterialOrigin = Literal["generator", "rule", "curator", "upsampled", "texture"]
"""Who chose a material. `upsampled` and `texture` are the flagged fallbacks: their spectra are made up from sRGB."""

_ID: Final = re.compile(r"[a-z0-9](?:[a-z0-9._-]{0,78}[a-z0-9])?")
_TAG: Final = re.compile(r"[a-z0-9][a-z0-9_-]{0,39}")
MAX_TAGS: Final = 32


def check_asset_id(text: str, *, path: str = "id") -> str:
    """Return an asset's id where it is legal; raise FieldError where not."""
    if not _ID.fullmatch(text):
        raise FieldError(
            f"{path} is {text[:80]!r}; must be 1 to 80 lower-case letters, digits, dots, dashes and underscores, "
            "beginning and ending with a letter or digit.",
            path=path,
            value=text,
        )
    return text


def check_tags(tags: tuple[str, ...], *, path: str = "tags") -> tuple[str, ...]:
    """Return tags sorted and without repetition; raise FieldError for an illegal one, or too many."""
    for tag in tags:
        if not _TAG.fullmatch(tag):
            raise FieldError(
                f"{path} holds {tag[:80]!r}; a tag is 1 to 40 lower-case letters, digits, dashes and underscores.",
                path=path,
                value=tag,
            )
    unique = tuple(sorted(set(tags)))
    if len(unique) > MAX_TAGS:
        raise FieldError(f"{path} holds {len(unique)} tags; at most {MAX_TAGS} are allowed.", path=path, value=list(unique))
    return unique


@dataclass(frozen=True, slots=True)
class LicenceRecord:
    """Under what terms an asset may be used: an SPDX expression, whom to name, and where it says so."""

    spdx: str
    attribution: str = ""
    url: str = ""


@dataclass(frozen=True, slots=True)
class SourceRecord:
    """Where an asset comes from.

    Attributes
    ----------
    kind
        "upload", "generator" (of this project) or "package" (a model that an installed package carries).
    name
        File name, generator, or package and path.
    files
        {relative path: SHA-256} of what was read, uploads only; the blobs are kept.
    parameters
        Of a generator: plain data that makes the same asset again.
    unit_m, up_axis, forward_axis
        How the file's coordinates were read: metres per unit, and which axes became +z and +x.
    """

    kind: Literal["upload", "generator", "package"]
    name: str
    files: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    unit_m: float = 1.0
    up_axis: str = "z"
    forward_axis: str = "x"


@dataclass(frozen=True, slots=True)
class MaterialChoice:
    """What a part is made of.

    Attributes
    ----------
    origin
        Who chose.
    name
        Entry of the catalogue, such as "paint/red"; empty for the two fallbacks.
    base_color_srgb, roughness, metallic
        The metallic-roughness model of the file (sRGB-encoded, 0..1), which the fallbacks use and the others keep for record.
    """

    origin: MaterialOrigin
    name: str = ""
    base_color_srgb: tuple[float, float, float] = (0.735, 0.735, 0.735)
    roughness: float = 0.5
    metallic: float = 0.0


@dataclass(frozen=True, slots=True)
class PartRecord:
    """Triangles with one material. `paintable`: a recipe may give it another paint; its name stands in the GLB files."""

    name: str
    triangles: int
    area_m2: float
    material: MaterialChoice
    paintable: bool = False


@dataclass(frozen=True, slots=True)
class LevelRecord:
    """One level of detail: a GLB file (metres, y up as glTF demands). `error_m` is what simplifying may have cost."""

    triangles: int
    sha256: str
    bytes: int
    error_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Check:
    """One finding of ingestion: what was looked at, how it stands, a sentence for people, and the numbers behind it."""

    name: str
    state: CheckState
    message: str
    numbers: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class AssetManifest:
    """One version of an asset. Immutable: a change of any field is a new version with another digest.

    Attributes
    ----------
    id, title
        Unique in a store and stable over versions; a name for people.
    asset_class, tags
        Entry of `ASSET_CLASSES`; sorted words to search by.
    size_m
        Extents along x (forward), y (left), z (up) [m] in the canonical pose: pivot on the ground below the centre of the
        bounding box, facing +x.
    levels
        Finest first, at least one.
    parts
        Of the finest level; coarser levels have the same parts or fewer.
    attributes
        Numbers and words that classes have of their own, such as front_overhang_m.
    checks
        The report of ingestion.
    """

    id: str
    title: str
    asset_class: str
    tags: tuple[str, ...]
    size_m: tuple[float, float, float]
    levels: tuple[LevelRecord, ...]
    parts: tuple[PartRecord, ...]
    licence: LicenceRecord
    source: SourceRecord
    attributes: Mapping[str, float | str] = field(default_factory=dict)
    checks: tuple[Check, ...] = ()

    def __post_init__(self) -> None:
        check_asset_id(self.id)
        asset_class(self.asset_class)
        object.__setattr__(self, "tags", check_tags(self.tags))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the canonical document: what a pin names."""
        return digest_of(self.document())

    @property
    def look_digest(self) -> str:
        """SHA-256 of what can be seen: previews are kept by it, so that a new tag costs no rendering."""
        return digest_of({"levels": self.document()["levels"], "parts": self.document()["parts"]})

    @property
    def needs_decision(self) -> bool:
        """Whether a check asks a person to decide, or failed."""
        return any(check.state in ("decide", "failed") for check in self.checks)

    def blobs(self) -> frozenset[str]:
        """Return the SHA-256 of everything in the store that this version needs."""
        return frozenset({level.sha256 for level in self.levels} | set(self.source.files.values()))

    def document(self) -> dict[str, Any]:
        """Return plain data, as it is stored."""
        plain: dict[str, Any] = {"schema": ASSET_SCHEMA, **asdict(self)}
        return plain

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> AssetManifest:
        """Return the manifest of a stored document; FieldError where it is of another schema or damaged."""
        if document.get("schema") != ASSET_SCHEMA:
            raise FieldError(f"schema is {document.get('schema')!r}; must be {ASSET_SCHEMA!r}.", path="schema")
        fields = {key: value for key, value in document.items() if key != "schema"}
        try:
            return cls(
                **fields
                | {
                    "tags": tuple(fields["tags"]),
                    "size_m": _triple(fields["size_m"]),
                    "levels": tuple(LevelRecord(**level) for level in fields["levels"]),
                    "parts": tuple(_part(part) for part in fields["parts"]),
                    "licence": LicenceRecord(**fields["licence"]),
                    "source": SourceRecord(**fields["source"]),
                    "checks": tuple(Check(**check) for check in fields["checks"]),
                }
            )
        except (KeyError, TypeError, ValueError) as error:
            raise FieldError(f"the asset manifest is damaged: {error}.", path="manifest") from error

    def with_changes(self, **changes: Any) -> AssetManifest:
        """Return another version with some fields changed."""
        return replace(self, **changes)


def _part(document: Mapping[str, Any]) -> PartRecord:
    choice = dict(document["material"])
    choice["base_color_srgb"] = _triple(choice["base_color_srgb"])
    return PartRecord(**{**document, "material": MaterialChoice(**choice)})


def _triple(values: Any) -> tuple[float, float, float]:
    first, second, third = (float(value) for value in values)
    return first, second, third


@dataclass(frozen=True, slots=True, eq=False)
class PreparedAsset:
    """An asset ready to be stored: its manifest, and every blob that it names by SHA-256."""

    manifest: AssetManifest
    blobs: Mapping[str, bytes]
