"""A model file as the renderer may see it: checked triangles in metres, z up, with plain metallic-roughness materials."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import AssetError, FieldError

__all__ = [
    "AXES",
    "LoadedModel",
    "LoadedPart",
    "ModelError",
    "ModelSource",
    "PartDraft",
    "SurfaceDraft",
    "UpAxis",
    "VariantSet",
    "finish_model",
    "linear_to_srgb",
    "srgb_to_linear",
    "turn_up",
]

UpAxis = Literal["x", "y", "z"]
AXES: tuple[UpAxis, ...] = ("x", "y", "z")

MAX_COORDINATE_M = 1e6
"""A model larger than this is a broken file or a wrong unit: float32, which the renderer uses, is 6 cm coarse there."""

UNUSUAL_EXTENT_M = (0.005, 200.0)
"""Largest extents outside this range are legal, but are most often a wrong unit; they give a warning."""

_MAX_NAME = 200

_DEGENERATE_RELATIVE_AREA = 1e-12
"""Twice the area over the squared longest edge: below it a triangle has no usable normal in float32."""


class ModelError(AssetError, FieldError):
    """A model file cannot be used; carries the path of the field that named it."""


@dataclass(frozen=True, slots=True)
class ModelSource:
    """Which file is read, for which field, and within which limits.

    `root` bounds what the file may refer to. `isolated`: the process is a child with limits already, so that a reader which may
    die needs no further one.
    """

    file: Path
    field_path: str
    max_triangles: int
    max_bytes: int
    root: Path | None = None
    isolated: bool = False

    def error(self, problem: str, next_step: str) -> ModelError:
        """Return the error that says what is wrong with the file and what to do about it."""
        where = f"{self.field_path}: " if self.field_path else ""
        return ModelError(f"{where}{self.file.name} {problem}. {next_step}", path=self.field_path, value=str(self.file))


@dataclass(frozen=True, slots=True, eq=False)
class LoadedPart:
    """Triangles with one material.

    Attributes
    ----------
    name
        From the file; unique in the model.
    vertices_m, faces
        (n, 3) float64 [m], z up, all finite and all used; (m, 3) uint32, counter-clockwise seen from the front, none
        degenerate.
    normals, uv
        (n, 3) unit vectors and (n, 2) with v = 0 at the bottom row of the texture, per vertex, or None.
    base_color_srgb, base_color_texture
        sRGB-encoded colour, 0..1; (rows, cols, 3) uint8 sRGB with row 0 at v = 1, or None. Where there is a texture it
        already holds the colour factor, and `base_color_srgb` is its mean.
    roughness, metallic
        0..1, of the metallic-roughness model (GGX alpha = roughness squared).
    emissive_srgb
        sRGB-encoded relative emission, or None. Model files carry no usable absolute unit; the recipe sets the radiance.
    double_sided
        Whether the back is meant to be seen.
    material_name
        What the file calls the material; empty where it does not.
    """

    name: str
    vertices_m: NDArray[np.float64]
    faces: NDArray[np.uint32]
    normals: NDArray[np.float64] | None
    uv: NDArray[np.float64] | None
    base_color_srgb: tuple[float, float, float]
    base_color_texture: NDArray[np.uint8] | None
    roughness: float
    metallic: float
    emissive_srgb: tuple[float, float, float] | None
    double_sided: bool
    material_name: str = ""


@dataclass(frozen=True, slots=True)
class VariantSet:
    """A choice that a USD stage leaves open: at which prim, of which names, and which one was read ("" for none)."""

    prim: str
    name: str
    choices: tuple[str, ...]
    selected: str


@dataclass(frozen=True, slots=True, eq=False)
class LoadedModel:
    """What a model file holds.

    Attributes
    ----------
    parts
        At least one.
    bounds_m
        (2, 3) lower and upper corner over all parts [m].
    unit_m, up_axis
        What was applied to the file's own coordinates: metres per unit, and the axis that became +z.
    warnings
        Sentences for the manifest: assumptions, repairs, features that are not drawn.
    references
        The other files that were read or are referred to (layers, materials, textures, buffers), sorted: the model is the
        same as long as the file and these are.
    states_unit, states_up_axis
        Whether the file or its format says them; where not, they were given or assumed.
    removed_triangles
        Triangles without an area that were left out.
    variants
        What a USD stage could also look like.
    subdivision_meshes
        Meshes that are control meshes of subdivision surfaces; as many levels as were asked for have been applied.
    """

    parts: tuple[LoadedPart, ...]
    bounds_m: NDArray[np.float64]
    unit_m: float
    up_axis: UpAxis
    warnings: tuple[str, ...]
    references: tuple[Path, ...] = ()
    states_unit: bool = True
    states_up_axis: bool = True
    removed_triangles: int = 0
    variants: tuple[VariantSet, ...] = ()
    subdivision_meshes: int = 0

    @property
    def triangle_count(self) -> int:
        """Number of triangles of all parts."""
        return sum(len(part.faces) for part in self.parts)


@dataclass(slots=True, eq=False)
class SurfaceDraft:
    """A material as read; see LoadedPart for the meaning of the fields."""

    base_color_srgb: tuple[float, float, float] = (0.735, 0.735, 0.735)
    base_color_texture: NDArray[np.uint8] | None = None
    roughness: float = 0.5
    metallic: float = 0.0
    emissive_srgb: tuple[float, float, float] | None = None
    double_sided: bool = True
    name: str = ""


@dataclass(slots=True, eq=False)
class PartDraft:
    """A part as read, in the file's unit and axes, before any check."""

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    normals: NDArray[np.float64] | None = None
    uv: NDArray[np.float64] | None = None
    surface: SurfaceDraft = field(default_factory=SurfaceDraft)


def srgb_to_linear(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return linear values of sRGB-encoded ones, 0..1 (IEC 61966-2-1:1999, eq. 5 and 6)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((np.maximum(encoded, 0.0) + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sRGB-encoded values of linear ones, clipped to 0..1 (IEC 61966-2-1:1999, eq. 8 to 10)."""
    clipped = np.clip(linear, 0.0, 1.0)
    return np.where(clipped <= 0.0031308, clipped * 12.92, 1.055 * clipped ** (1 / 2.4) - 0.055)


def finish_model(
    source: ModelSource,
    drafts: Sequence[PartDraft],
    *,
    unit_m: float,
    up_axis: UpAxis,
    warnings: Sequence[str],
    references: Iterable[Path] = (),
) -> LoadedModel:
    """Return the drafts as a checked model in metres with z up.

    Degenerate triangles and unused vertices are removed (and counted in the warnings); unusable normals and texture
    coordinates are dropped. Raises ModelError where nothing is left, or where a used vertex is not finite or an index
    points nowhere.
    """
    notes = list(warnings)
    total = sum(len(draft.faces) for draft in drafts)
    if total > source.max_triangles:
        raise source.error(
            f"holds {total} triangles; at most {source.max_triangles} are allowed", "Simplify the model, or raise max_triangles"
        )
    with np.errstate(all="ignore"):
        parts, removed = _finished_parts(source, drafts, to_world=unit_m * turn_up(up_axis), notes=notes)
    if removed:
        notes.append(f"{source.file.name}: {removed} of {total} triangles have no area and were removed.")
    if not parts:
        raise source.error(
            "holds no triangles with an area" if total else "holds no triangles",
            "Export the model as a triangle or polygon mesh; points, lines, curves and lights alone cannot be rendered",
        )
    bounds_m = np.array(
        [np.min([p.vertices_m.min(axis=0) for p in parts], axis=0), np.max([p.vertices_m.max(axis=0) for p in parts], axis=0)]
    )
    notes.extend(_size_warnings(source, bounds_m, unit_m=unit_m))
    others = tuple(sorted(set(references)))
    return LoadedModel(tuple(parts), bounds_m, unit_m, up_axis, tuple(dict.fromkeys(notes)), others, removed_triangles=removed)


def turn_up(up_axis: UpAxis) -> NDArray[np.float64]:
    """(3, 3) rotation that turns the file's up axis to +z: y up maps (x, y, z) to (x, -z, y), x up maps it to (-z, y, x)."""
    if up_axis == "y":
        return np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    if up_axis == "x":
        return np.array([[0, 0, -1.0], [0, 1.0, 0], [1.0, 0, 0]])
    return np.eye(3)


def _finished_parts(
    source: ModelSource, drafts: Sequence[PartDraft], *, to_world: NDArray[np.float64], notes: list[str]
) -> tuple[list[LoadedPart], int]:
    parts: list[LoadedPart] = []
    names: set[str] = set()
    removed = 0
    for draft in drafts:
        faces, degenerate = _usable_faces(source, draft)
        removed += degenerate
        if not len(faces):
            continue
        used, compact = np.unique(faces, return_inverse=True)
        vertices_m = draft.vertices[used] @ to_world.T
        farthest_m = float(np.abs(vertices_m).max())
        if not farthest_m <= MAX_COORDINATE_M:
            raise source.error(
                f"reaches {farthest_m:.3g} m from its origin (part {draft.name!r}); at most {MAX_COORDINATE_M:g} m",
                "Set unit_m to the metres that one unit of the file stands for, or move the model to its origin",
            )
        parts.append(
            LoadedPart(
                name=_unique(_clean(draft.name) or "part", names),
                vertices_m=vertices_m,
                faces=compact.reshape(faces.shape).astype(np.uint32),
                normals=_usable_normals(source, draft, used, turn=to_world / np.linalg.norm(to_world[0]), notes=notes),
                uv=_usable_uv(source, draft, used, notes=notes),
                base_color_srgb=_colour(draft.surface.base_color_srgb),
                base_color_texture=draft.surface.base_color_texture,
                roughness=_fraction(draft.surface.roughness, 0.5),
                metallic=_fraction(draft.surface.metallic, 0.0),
                emissive_srgb=None if draft.surface.emissive_srgb is None else _colour(draft.surface.emissive_srgb),
                double_sided=draft.surface.double_sided,
                material_name=_clean(draft.surface.name),
            )
        )
    return parts, removed


def _usable_faces(source: ModelSource, draft: PartDraft) -> tuple[NDArray[np.int64], int]:
    faces = np.asarray(draft.faces, dtype=np.int64).reshape(-1, 3)
    if not len(faces):
        return faces, 0
    if draft.vertices.ndim != 2 or draft.vertices.shape[1] != 3:
        raise source.error(f"has vertices of shape {draft.vertices.shape} in part {draft.name!r}", "Export the model again")
    count = len(draft.vertices)
    if faces.min() < 0 or faces.max() >= count:
        wrong = int(faces.max()) if faces.max() >= count else int(faces.min())
        raise source.error(
            f"uses vertex {wrong} in part {draft.name!r}, which has {count} vertices", "The file is damaged; export it again"
        )
    corners = draft.vertices[faces]
    if not np.all(np.isfinite(corners)):
        bad = np.unique(faces[~np.isfinite(corners).all(axis=2)])
        raise source.error(
            f"has {len(bad)} vertices that are NaN or Inf in part {draft.name!r} (the first is vertex {int(bad[0])})",
            "Repair the mesh in a modelling program and export it again",
        )
    # Scaled by the largest coordinate, so that the products below cannot overflow.
    corners = corners / max(float(np.abs(corners).max()), np.finfo(np.float64).tiny)
    edges = corners[:, [1, 2, 0]] - corners
    longest = (edges**2).sum(axis=2).max(axis=1)
    doubled_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    keep = doubled_area > _DEGENERATE_RELATIVE_AREA * longest
    return faces[keep], int(np.count_nonzero(~keep))


def _usable_normals(
    source: ModelSource, draft: PartDraft, used: NDArray[np.int64], *, turn: NDArray[np.float64], notes: list[str]
) -> NDArray[np.float64] | None:
    if draft.normals is None:
        return None
    if draft.normals.shape == draft.vertices.shape:
        normals = draft.normals[used] @ turn.T
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        if np.all(np.isfinite(length)) and np.all(length > 1e-6):
            return np.asarray(normals / length)
    notes.append(f"{source.file.name}: the normals of part {draft.name!r} are unusable; it is shaded flat.")
    return None


def _usable_uv(
    source: ModelSource, draft: PartDraft, used: NDArray[np.int64], *, notes: list[str]
) -> NDArray[np.float64] | None:
    textured = draft.surface.base_color_texture is not None
    if draft.uv is None:
        if textured:
            notes.append(f"{source.file.name}: part {draft.name!r} has a texture but no coordinates; its mean colour is used.")
            draft.surface.base_color_texture = None
        return None
    if draft.uv.shape == (len(draft.vertices), 2) and np.all(np.isfinite(draft.uv[used])):
        return np.asarray(draft.uv[used], dtype=np.float64)
    notes.append(f"{source.file.name}: the texture coordinates of part {draft.name!r} are unusable; its mean colour is used.")
    draft.surface.base_color_texture = None
    return None


def _clean(name: str) -> str:
    """Return a name that every document and file can hold: no control characters, no half surrogates, not endless."""
    text = name.encode("utf-8", "replace").decode()
    return "".join(character for character in text if character.isprintable()).strip()[:_MAX_NAME]


def _unique(name: str, names: set[str]) -> str:
    candidate, number = name, 2
    while candidate in names:
        candidate, number = f"{name}_{number}", number + 1
    names.add(candidate)
    return candidate


def _colour(values: tuple[float, float, float]) -> tuple[float, float, float]:
    red, green, blue = (_fraction(value, 0.5) for value in values)
    return red, green, blue


def _fraction(value: float, otherwise: float) -> float:
    return min(max(float(value), 0.0), 1.0) if math.isfinite(value) else otherwise


def _size_warnings(source: ModelSource, bounds_m: NDArray[np.float64], *, unit_m: float) -> list[str]:
    extent_m = bounds_m[1] - bounds_m[0]
    low, high = UNUSUAL_EXTENT_M
    if low <= extent_m.max() <= high:
        return []
    size = " x ".join(f"{side:.4g}" for side in extent_m)
    return [f"{source.file.name}: the model is {size} m at {unit_m:g} m per unit; if that is not meant, set unit_m."]
