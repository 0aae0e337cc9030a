"""What a person says about a model that is taken in, the limits it must keep, and the error where it cannot be."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Final, Literal

from fullwell.assets.classes import asset_class
from fullwell.assets.meshes import MAX_SUBDIVISION
from fullwell.assets.model import AXES, UpAxis
from fullwell.assets.records import LicenceRecord, check_asset_id, check_tags
from fullwell.core.errors import AssetError, FieldError

__all__ = ["FORWARD_AXES", "IngestCause", "IngestError", "IngestLimits", "IngestOptions"]

ForwardAxis = Literal["x", "-x", "y", "-y", "z", "-z"]
FORWARD_AXES: Final[tuple[ForwardAxis, ...]] = ("x", "-x", "y", "-y", "z", "-z")

IngestCause = Literal["refused", "memory", "time", "size", "died", "cancelled", "unforeseen"]
"""The file is not acceptable; a limit was passed; the process died; somebody cancelled; a fault of this program."""


class IngestError(AssetError, FieldError):
    """An asset could not be taken in. Nothing of it is left behind. `cause` says which kind of end it was."""

    code = "ingest_failed"

    def __init__(self, message: str, path: str = "", value: Any = None, cause: IngestCause = "refused") -> None:
        super().__init__(message, path, value)
        self.cause: IngestCause = cause

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self.message, self.path, self.value, self.cause))


def _no_licence() -> LicenceRecord:
    return LicenceRecord("NOASSERTION")


@dataclass(frozen=True, slots=True)
class IngestOptions:
    """What is known about a model beside its file.

    Attributes
    ----------
    id, title, asset_class, tags, licence
        As in the manifest.
    source_kind, source_name
        Where the file comes from; without a name the file's own. The files of an "upload" are kept as blobs.
    unit_m
        Metres of one unit of the file; None: as the file says, or as the class makes plausible.
    length_m
        Length along the forward axis [m] to which the model is scaled, in place of any unit.
    up_axis, forward_axis
        Axes of the file that become +z and +x; None: as the file or its format says, or as parts and proportions show.
    member
        Which file of an archive is the model; needed where it holds several.
    variants
        {name of a variant set, or "/prim/path{name}": choice} for USD.
    subdivide
        Levels, 0 to 2, by which subdivision surfaces are refined; None leaves the control mesh and asks.
    max_texture_px
        Longest side of a texture that is kept [pixels]; larger ones are made smaller.
    level_ratios
        Triangles of the coarser levels over those of the finest, falling.
    min_level_triangles
        A coarser level must have at least so many.
    crease_deg
        Made normals are smooth over edges that bend less.
    """

    id: str
    asset_class: str = "other"
    title: str = ""
    tags: tuple[str, ...] = ()
    licence: LicenceRecord = field(default_factory=_no_licence)
    source_kind: Literal["upload", "package"] = "upload"
    source_name: str = ""
    unit_m: float | None = None
    length_m: float | None = None
    up_axis: UpAxis | None = None
    forward_axis: ForwardAxis | None = None
    member: str = ""
    variants: Mapping[str, str] = field(default_factory=dict)
    subdivide: int | None = None
    max_texture_px: int = 2048
    level_ratios: tuple[float, ...] = (0.25, 0.0625)
    min_level_triangles: int = 200
    crease_deg: float = 40.0

    def __post_init__(self) -> None:
        check_asset_id(self.id)
        asset_class(self.asset_class)
        object.__setattr__(self, "tags", check_tags(self.tags))
        for name in ("unit_m", "length_m"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise FieldError(f"{name} is {value}; must be > 0 m.", path=name, value=value)
        if self.unit_m is not None and self.length_m is not None:
            raise FieldError("unit_m and length_m are both given; give one of them.", path="length_m", value=self.length_m)
        _check_choice("up_axis", self.up_axis, AXES)
        _check_choice("forward_axis", self.forward_axis, FORWARD_AXES)
        if self.forward_axis is not None and self.forward_axis[-1] == self.up_axis:
            raise FieldError(
                f"forward_axis is {self.forward_axis!r}, along up_axis {self.up_axis!r}; give another one.",
                path="forward_axis",
                value=self.forward_axis,
            )
        _check_range("subdivide", self.subdivide or 0, 0, MAX_SUBDIVISION)
        _check_range("max_texture_px", self.max_texture_px, 1, 16384)
        _check_range("min_level_triangles", self.min_level_triangles, 4, 1_000_000)
        _check_range("crease_deg", self.crease_deg, 0.0, 180.0)
        if not all(0 < low < high for high, low in zip((1.0, *self.level_ratios), self.level_ratios, strict=False)):
            raise FieldError(
                f"level_ratios is {list(self.level_ratios)}; must fall from below 1 and stay above 0.", path="level_ratios"
            )

    def document(self) -> dict[str, Any]:
        """Return plain data, which `from_document` reads."""
        plain: dict[str, Any] = asdict(self)
        return plain

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> IngestOptions:
        """Return the options of plain data; FieldError where a value is illegal."""
        plain = dict(document)
        try:
            plain["licence"] = LicenceRecord(**plain.get("licence", {"spdx": "NOASSERTION"}))
            for name in ("tags", "level_ratios"):
                plain[name] = tuple(plain.get(name, getattr(cls, name, ())))
            return cls(**plain)
        except (TypeError, ValueError) as error:
            raise FieldError(f"the options of ingestion are damaged: {error}.", path="options") from error

    def with_changes(self, **changes: Any) -> IngestOptions:
        """Return other options."""
        return replace(self, **changes)


def _check_choice(name: str, value: str | None, choices: tuple[str, ...]) -> None:
    if value is not None and value not in choices:
        raise FieldError(f"{name} is {value!r}; must be one of {', '.join(choices)}.", path=name, value=value)


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise FieldError(f"{name} is {value}; must be {low:g} to {high:g}.", path=name, value=value)


@dataclass(frozen=True, slots=True)
class IngestLimits:
    """What taking in one asset may cost.

    Attributes
    ----------
    memory_bytes
        That the child process may allocate.
    cpu_s, wall_s
        Processor time and time by the clock for one asset.
    input_bytes, input_files
        Size and number of the files that are read, archives unpacked.
    archive_ratio
        Unpacked size over packed size of one entry of an archive.
    output_bytes
        Size of one file that is written: a level, a texture.
    triangles
        Of the model as read.
    max_assets
        Assets after which a new process takes in the next one.
    """

    memory_bytes: int = 3 << 30
    cpu_s: float = 120.0
    wall_s: float = 180.0
    input_bytes: int = 1 << 30
    input_files: int = 2000
    archive_ratio: float = 200.0
    output_bytes: int = 1 << 30
    triangles: int = 5_000_000
    max_assets: int = 200

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not (math.isfinite(value) and value > 0):
                raise FieldError(f"{name} is {value}; must be > 0.", path=name, value=value)

    def document(self) -> dict[str, Any]:
        """Return plain data: the arguments of this class."""
        plain: dict[str, Any] = asdict(self)
        return plain
