"""A model file, or a generated thing, becomes an asset: canonical pose, levels of detail, materials, and a report."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.classes import size_problems
from fullwell.assets.ingest.archives import check_package, model_in, unpack
from fullwell.assets.ingest.canonical import write_level
from fullwell.assets.ingest.levels import CoarserLevel, Simplifier, crowd_distance_m
from fullwell.assets.ingest.mending import Mended, mend_part, part_area_m2
from fullwell.assets.ingest.options import IngestError, IngestLimits, IngestOptions
from fullwell.assets.ingest.pose import find_pose, posed_part
from fullwell.assets.ingest.report import file_checks, mending_checks, watertight_check
from fullwell.assets.ingest.textures import bounded_texture
from fullwell.assets.meshes import load_model
from fullwell.assets.model import LoadedModel, LoadedPart, ModelError
from fullwell.assets.records import (
    AssetManifest,
    Check,
    LevelRecord,
    LicenceRecord,
    MaterialChoice,
    PartRecord,
    PreparedAsset,
    SourceRecord,
)
from fullwell.assets.starter.building import BuiltAsset, BuiltLevel, BuiltPart
from fullwell.core.errors import FieldError
from fullwell.core.hashing import sha256_hex

__all__ = ["IngestProgress", "prepare_built", "prepare_file"]

IngestProgress = Callable[[float, str], None]
"""Takes the share that is done, 0 to 1, and what is going on."""

_MAX_LEVEL_ERROR: Final = 0.03
"""Of the asset's diagonal: coarser levels move no part's surface farther."""

_LEAST_LEVEL_GAIN: Final = 0.75
"""A level must have at most this share of the triangles of the one before."""


def prepare_file(
    files_dir: Path,
    main: str,
    options: IngestOptions,
    *,
    limits: IngestLimits | None = None,
    progress: IngestProgress | None = None,
    isolated: bool = False,
) -> PreparedAsset:
    """Return a model file as an asset: its manifest with the report of ingestion, and the blobs that it names.

    In this process: for files of unknown origin use `IngestProcess` or `prepare_in_child`, since some parsers are native code.

    Parameters
    ----------
    files_dir
        Folder that the model and everything it refers to must lie in.
    main
        The model, relative to that: GLB, glTF, OBJ, PLY, STL, USD, USDA, USDC, USDZ; or a .zip archive that holds one.
    options
        What is known beside the file. `options.id` and `options.licence` go into the manifest.
    isolated
        This process may die of a damaged file: nothing is tried in another one first.

    Raises
    ------
    IngestError
        The file is missing, damaged, refers to places outside, passes a limit, or has nothing to draw.
    """
    limits = limits or IngestLimits()
    say = progress or (lambda share, stage: None)
    say(0.0, "read")
    source: _Source | None = None
    try:
        with _model_files(files_dir, main, options, limits) as source:
            model = _loaded(source, options, limits, isolated=isolated)
            files = _source_files(source, model, limits) if options.source_kind == "upload" else {}
    except IngestError:
        raise
    except FieldError as error:
        # Where the files happen to lie is nobody's business: uploads are in a temporary folder.
        place = str(files_dir.resolve() if source is None else source.root)
        message = error.message.replace(f"{place}/", "").replace(place, "the folder of the files")
        value = error.value.replace(f"{place}/", "") if isinstance(error.value, str) else error.value
        raise IngestError(message, error.path or "file", value) from error
    except MemoryError as error:
        raise IngestError(f"{main} needs more memory than there is. Simplify the model.", "file", main, "memory") from error
    return _assembled(model, source, files, options, say)


# Reading -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Source:
    """A model file below a root, and the archive that it came in."""

    root: Path
    file: Path
    archive: str = ""

    @property
    def name(self) -> str:
        return self.file.relative_to(self.root).as_posix()


@contextlib.contextmanager
def _model_files(files_dir: Path, main: str, options: IngestOptions, limits: IngestLimits) -> Iterator[_Source]:
    root = files_dir.resolve()
    file = (root / main).resolve()
    if not file.is_relative_to(root) or file == root:
        raise IngestError(f"{main!r} lies outside the folder of the files. Give a path below it.", path="file", value=main)
    if file.suffix.lower() != ".zip":
        yield _Source(root, file)
        return
    if not file.is_file():
        raise IngestError(f"{main} does not exist. Give the path of an existing file.", path="file", value=main)
    with tempfile.TemporaryDirectory(prefix="fullwell-unpacked-") as name:
        folder = Path(name).resolve()
        members = unpack(file, folder, limits)
        yield _Source(folder, folder / model_in(members, options.member, archive=file.name), file.name)


def _loaded(source: _Source, options: IngestOptions, limits: IngestLimits, *, isolated: bool) -> LoadedModel:
    if source.file.suffix.lower() == ".usdz" and source.file.is_file():
        check_package(source.file, limits)
    try:
        return load_model(
            source.file,
            root=source.root,
            max_triangles=limits.triangles,
            max_bytes=limits.input_bytes,
            by_object=True,
            variants=options.variants,
            subdivide=options.subdivide or 0,
            isolated=isolated,
        )
    except ModelError:
        raise
    except (RecursionError, OSError, ValueError, ArithmeticError, LookupError, TypeError) as error:
        # Readers are fed damaged files here and answer with whatever their arithmetic raised.
        said = f"{type(error).__name__}: {error}".splitlines()[0][:200]
        raise IngestError(
            f"{source.file.name} is damaged ({said}). Open it in another program, or export it again.", "file", source.name
        ) from error


def _source_files(source: _Source, model: LoadedModel, limits: IngestLimits) -> dict[str, bytes]:
    """Content of all files that were read, by their path below the root."""
    paths = [source.file, *(path for path in model.references if path.is_file() and path.is_relative_to(source.root))]
    total = sum(path.stat().st_size for path in paths)
    if len(paths) > limits.input_files or total > limits.input_bytes:
        raise IngestError(
            f"{source.file.name} and what it refers to are {len(paths)} files of {total} bytes; at most {limits.input_files} "
            f"files of {limits.input_bytes} bytes are allowed. Make the model smaller.",
            path="file",
            value=source.name,
        )
    return {path.relative_to(source.root).as_posix(): path.read_bytes() for path in paths}


# Assembling ----------------------------------------------------------------------------------------------------------


def _assembled(
    model: LoadedModel, source: _Source, files: Mapping[str, bytes], options: IngestOptions, say: IngestProgress
) -> PreparedAsset:
    say(0.3, "pose")
    pose = find_pose(model, options, suffix=source.file.suffix.lower())
    say(0.4, "mend")
    mended = _mended([posed_part(part, pose) for part in model.parts], options.crease_deg, make_normals=True)
    if not mended:
        raise IngestError(f"{source.file.name} holds no triangles with an area. Export it again.", "file", source.name)
    parts, texture_check = _bounded([entry.part for entry in mended], options.max_texture_px)
    chosen, material_check = _chosen_materials(parts, options.asset_class)
    digests = {path: sha256_hex(content) for path, content in files.items()}
    record = SourceRecord(
        kind=options.source_kind,
        name=options.source_name or source.name,
        files=digests,
        parameters={"main": source.name, **({"archive": source.archive} if source.archive else {})},
        unit_m=pose.unit_m,
        up_axis=pose.up_axis,
        forward_axis=pose.forward_axis,
    )
    checks = (
        *file_checks(model, options, kept=len(parts)),
        *pose.checks,
        *mending_checks(mended, removed_on_reading=model.removed_triangles),
        watertight_check(parts),
        texture_check,
        material_check,
    )
    draft = _Draft(
        id=options.id,
        title=options.title or options.id,
        asset_class=options.asset_class,
        tags=options.tags,
        licence=options.licence,
        source=record,
        checks=checks,
        blobs={digests[path]: content for path, content in files.items()},
    )
    return _finished(draft, chosen, options, say)


@dataclass(frozen=True, slots=True, eq=False)
class _ChosenPart:
    part: LoadedPart
    choice: MaterialChoice
    paintable: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Draft:
    """What a manifest holds beside its parts and levels."""

    id: str
    title: str
    asset_class: str
    tags: tuple[str, ...]
    licence: LicenceRecord
    source: SourceRecord
    checks: tuple[Check, ...]
    blobs: Mapping[str, bytes]
    attributes: Mapping[str, float | str] = field(default_factory=dict)
    coarser: tuple[CoarserLevel, ...] = ()


def _finished(draft: _Draft, chosen: Sequence[_ChosenPart], options: IngestOptions, say: IngestProgress) -> PreparedAsset:
    parts = [entry.part for entry in chosen]
    attribution = draft.licence.attribution or draft.licence.spdx
    levels, contents, level_check = _levels(parts, draft.coarser, attribution, options, say)
    low = np.min([part.vertices_m.min(axis=0) for part in parts], axis=0)
    high = np.max([part.vertices_m.max(axis=0) for part in parts], axis=0)
    length, width, height = (float(side) for side in high - low)
    manifest = AssetManifest(
        id=draft.id,
        title=draft.title,
        asset_class=draft.asset_class,
        tags=draft.tags,
        size_m=(length, width, height),
        levels=levels,
        parts=tuple(
            PartRecord(entry.part.name, len(entry.part.faces), part_area_m2(entry.part), entry.choice, entry.paintable)
            for entry in chosen
        ),
        licence=draft.licence,
        source=draft.source,
        attributes=draft.attributes,
        checks=(*draft.checks, level_check),
    )
    say(1.0, "done")
    return PreparedAsset(manifest, {**draft.blobs, **contents})


def _mended(parts: Sequence[LoadedPart], crease_deg: float, *, make_normals: bool) -> list[Mended]:
    entries = (mend_part(part, crease_deg=crease_deg, make_normals=make_normals) for part in parts)
    return [entry for entry in entries if entry is not None]


def _bounded(parts: Sequence[LoadedPart], max_px: int) -> tuple[list[LoadedPart], Check]:
    small: dict[int, Any] = {}
    sides: dict[int, int] = {}
    bounded = []
    for part in parts:
        texture = part.base_color_texture
        if texture is None:
            bounded.append(part)
            continue
        if id(texture) not in small:
            small[id(texture)] = bounded_texture(texture, max_px)
            sides[id(texture)] = max(texture.shape[:2])
        bounded.append(replace(part, base_color_texture=small[id(texture)]))
    reduced = sum(side > max_px for side in sides.values())
    numbers = {"textures": float(len(sides)), "reduced": float(reduced), "largest_px": float(max(sides.values(), default=0))}
    if not sides:
        return bounded, Check("textures", "ok", "It has no textures.", numbers)
    if reduced:
        return bounded, Check(
            "textures", "mended", f"{reduced} of {len(sides)} textures were reduced to {max_px} pixels.", numbers
        )
    return bounded, Check("textures", "ok", f"{len(sides)} textures, at most {max(sides.values())} pixels a side.", numbers)


def _chosen_materials(parts: Sequence[LoadedPart], asset_class: str) -> tuple[list[_ChosenPart], Check]:
    # Late: the rules draw in the whole catalogue, which generated assets need less of.
    from fullwell.assets.materials.rules import choose_material, is_paintable  # noqa: PLC0415

    chosen = []
    for part in parts:
        choice = choose_material(part.name, asset_class, part)
        chosen.append(_ChosenPart(_in_colours_of(part, choice), choice, is_paintable(part.name, asset_class, choice)))
    fallback = [entry.part.name for entry in chosen if entry.choice.origin in ("upsampled", "texture")]
    numbers = {"parts": float(len(chosen)), "fallback": float(len(fallback))}
    if not fallback:
        return chosen, Check("materials", "ok", "Every part has a material of the catalogue.", numbers)
    message = (
        f"{len(fallback)} of {len(chosen)} parts got spectra made up from their colours ({_some(fallback)}). "
        "Choose materials of the catalogue for them."
    )
    return chosen, Check("materials", "warning", message, numbers)


def _in_colours_of(part: LoadedPart, choice: MaterialChoice) -> LoadedPart:
    return replace(part, base_color_srgb=choice.base_color_srgb, roughness=choice.roughness, metallic=choice.metallic)


def _some(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names[:4])) + (", ..." if len(names) > 4 else "")


def _levels(
    parts: Sequence[LoadedPart],
    coarser: Sequence[CoarserLevel],
    attribution: str,
    options: IngestOptions,
    say: IngestProgress,
) -> tuple[tuple[LevelRecord, ...], dict[str, bytes], Check]:
    records: list[LevelRecord] = []
    blobs: dict[str, bytes] = {}

    def keep(level: Sequence[LoadedPart], error_m: float) -> None:
        content = write_level(level, attribution=attribution)
        digest = sha256_hex(content)
        blobs[digest] = content
        records.append(LevelRecord(sum(len(part.faces) for part in level), digest, len(content), round(error_m, 6)))

    say(0.5, "level 0")
    keep(parts, 0.0)
    for level in coarser:
        keep(level.parts, level.error_m)
    notes = ["made by its generator"] if coarser else _simplified(parts, records, keep, options, say)
    counts = " / ".join(str(record.triangles) for record in records)
    note = f" ({'; '.join(notes)})" if notes else ""
    numbers = {f"error_{index}_m": record.error_m for index, record in enumerate(records) if index}
    message = f"{len(records)} level{'s' if len(records) > 1 else ''} of {counts} triangles{note}."
    return tuple(records), blobs, Check("levels", "ok", message, numbers)


def _simplified(
    parts: Sequence[LoadedPart],
    records: Sequence[LevelRecord],
    keep: Callable[[Sequence[LoadedPart], float], None],
    options: IngestOptions,
    say: IngestProgress,
) -> list[str]:
    """Keep the levels that simplifying gives; return why there are not more."""
    total = records[0].triangles
    diagonal_m = float(
        np.linalg.norm(
            np.max([p.vertices_m.max(axis=0) for p in parts], axis=0)
            - np.min([p.vertices_m.min(axis=0) for p in parts], axis=0)
        )
    )
    simplifier = Simplifier(parts, max_error_m=_MAX_LEVEL_ERROR * diagonal_m, crease_deg=options.crease_deg)
    notes: list[str] = []
    for number, ratio in enumerate(options.level_ratios, start=1):
        if total * ratio < options.min_level_triangles:
            notes.append(f"1/{1 / ratio:.0f} would be too few")
            break
        say(0.5 + 0.4 * number / (len(options.level_ratios) + 1), f"level {number}")
        level = simplifier.level(ratio)
        if level.triangles <= _LEAST_LEVEL_GAIN * records[-1].triangles:
            keep(level.parts, level.error_m)
        else:
            limit = _MAX_LEVEL_ERROR * diagonal_m
            notes.append(f"1/{1 / ratio:.0f} would move the surface by more than {limit:.2g} m")
    return notes


# Generated things ----------------------------------------------------------------------------------------------------


def prepare_built(
    built: BuiltAsset,
    *,
    id: str,  # noqa: A002 - as in the manifest
    title: str,
    licence: LicenceRecord,
    source: SourceRecord,
    options: IngestOptions | None = None,
) -> PreparedAsset:
    """Return a generated thing as an asset: centred, with levels, in the materials that its generator named.

    `options` gives levels and texture bounds only. Parts without normals stay so: they are shaded flat.
    Raises FieldError for an unknown material, IngestError where nothing has an area.
    """
    options = options or IngestOptions(id=id)
    parts = [_built_part(part) for part in built.parts]
    low = np.min([part.vertices_m.min(axis=0) for part in parts], axis=0)
    high = np.max([part.vertices_m.max(axis=0) for part in parts], axis=0)
    shift = -np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    mended = _mended(_moved(parts, shift), options.crease_deg, make_normals=False)
    if not mended:
        raise IngestError("the generated thing holds no triangles with an area.", path="parts", value=id)
    finished = [entry.part for entry in mended]
    recipe = {part.name: part for part in built.parts}
    chosen = [_ChosenPart(part, _built_choice(part), recipe[part.name].paintable) for part in finished]
    size = tuple(float(side) for side in high - low)
    problems = size_problems(built.asset_class, tuple(built.tags), (size[0], size[1], size[2]))
    size_numbers = dict(zip(("length_m", "width_m", "height_m"), size, strict=True))
    size_check = (
        Check("size", "decide", "; ".join(problems) + ".", size_numbers)
        if problems
        else Check("size", "ok", f"Plausible for a {built.asset_class}.", size_numbers)
    )
    draft = _Draft(
        id=id,
        title=title,
        asset_class=built.asset_class,
        tags=built.tags,
        licence=licence,
        source=source,
        checks=(size_check, *mending_checks(mended, removed_on_reading=0), watertight_check(finished)),
        blobs={},
        attributes=dict(built.attributes),
        coarser=tuple(_built_level(level, shift, finished, options) for level in built.coarser),
    )
    return _finished(draft, chosen, options, lambda share, stage: None)


def _moved(parts: Sequence[LoadedPart], shift_m: NDArray[np.float64]) -> list[LoadedPart]:
    return [replace(part, vertices_m=part.vertices_m + shift_m) for part in parts]


def _built_level(
    level: BuiltLevel, shift_m: NDArray[np.float64], finest: Sequence[LoadedPart], options: IngestOptions
) -> CoarserLevel:
    """Return a coarser level that the generator made; its error is how far it is from the finest, or its grain."""
    mended = _mended(_moved([_built_part(part) for part in level.parts], shift_m), options.crease_deg, make_normals=False)
    parts = tuple(entry.part for entry in mended)
    return CoarserLevel(parts, max(crowd_distance_m(finest, parts), level.grain_m))


def _built_part(part: BuiltPart) -> LoadedPart:
    from fullwell.assets.materials.catalogue import asset_material  # noqa: PLC0415  (slow to import)
    from fullwell.assets.materials.colours import display_srgb, emission_srgb  # noqa: PLC0415

    material = asset_material(part.material, path=f"parts[{part.name!r}].material")
    return LoadedPart(
        name=part.name,
        vertices_m=np.asarray(part.shape.vertices_m, dtype=np.float64),
        faces=np.asarray(part.shape.faces).astype(np.uint32),
        normals=part.shape.normals,
        uv=part.shape.uv,
        base_color_srgb=display_srgb(material),
        base_color_texture=None,
        roughness=1.0 if material.kind == "diffuse" else float(np.sqrt(material.roughness)),
        metallic=1.0 if material.kind in ("metal", "mirror") else 0.0,
        emissive_srgb=emission_srgb(material),
        double_sided=True,
        material_name=material.name,
    )


def _built_choice(part: LoadedPart) -> MaterialChoice:
    return MaterialChoice("generator", part.material_name, part.base_color_srgb, part.roughness, part.metallic)
