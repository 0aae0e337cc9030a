"""USD stages into triangles: references, payloads, default variants, instances, subsets, preview surfaces."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.model import ModelSource, PartDraft, SurfaceDraft, UpAxis, VariantSet, linear_to_srgb
from fullwell.assets.preflight import confined_path
from fullwell.assets.subdivision import Creases, PolygonMesh, refined
from fullwell.assets.surfaces import mean_srgb, pixels_of, tinted
from fullwell.assets.usd_probe import first_line, layer_references, needs_probe, probe, remember_survivor
from fullwell.core.errors import unknown_name_message

__all__ = ["UsdStage", "default_root", "read_usd"]

_CLIMB = 4
_LAYER_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


@dataclass(frozen=True, slots=True, eq=False)
class UsdStage:
    """What a stage holds, in its own unit and axes."""

    parts: tuple[PartDraft, ...]
    unit_m: float
    up_axis: UpAxis
    warnings: tuple[str, ...]
    references: tuple[Path, ...]
    states_unit: bool
    states_up_axis: bool
    variants: tuple[VariantSet, ...]
    subdivision_meshes: int


@dataclass(slots=True, eq=False)
class _Reading:
    """State of one reading: where from, what was noticed, which materials are known already."""

    source: ModelSource
    root: Path
    wanted: Mapping[str, str] = field(default_factory=dict)
    subdivide: int = 0
    subdivision_meshes: int = 0
    warnings: list[str] = field(default_factory=list)
    surfaces: dict[str, SurfaceDraft] = field(default_factory=dict)
    references: set[Path] = field(default_factory=set)
    triangles: int = 0

    def count(self, triangles: int) -> None:
        """Add triangles; raise the error of too many."""
        self.allow(triangles)
        self.triangles += triangles

    def allow(self, triangles: int) -> None:
        """Raise the error of too many where so many more would be."""
        if self.triangles + triangles > self.source.max_triangles:
            raise self.source.error(
                f"holds more than {self.source.max_triangles} triangles", "Simplify the model, or raise max_triangles"
            )

    def warn(self, sentence: str) -> None:
        self.warnings.append(f"{self.source.file.name}: {sentence}")


def default_root(file: Path) -> Path:
    """Return the folder that a USD layer's references must stay within where the caller names none.

    Kits of USD layers share folders for materials and textures above the layer's own, so relative references may climb at
    most four levels, and never to the top of the file system or to a folder right below it.
    """
    folder = file.resolve().parent
    for _ in range(_CLIMB):
        if len(folder.parent.parts) < 3:
            break
        folder = folder.parent
    return folder


def read_usd(source: ModelSource, *, variants: Mapping[str, str] | None = None, subdivide: int = 0) -> UsdStage:
    """Return all visible meshes of a stage at its default time, with all payloads and instances.

    Purposes "default" and "render" are read; "proxy" and "guide" are not.

    Parameters
    ----------
    variants
        {name of a variant set, or "/prim/path{name}": choice} in place of the stage's own choices.
    subdivide
        Levels by which subdivision surfaces are refined; with 0 they are drawn as their control mesh.

    Raises
    ------
    ModelError
        Damaged layers, missing references, references outside the root, variants that the stage does not have.
    """
    try:
        from pxr import Tf, UsdUtils  # noqa: PLC0415  (an extra)
    except ImportError as missing:
        raise source.error("needs the package usd-core to be read", "Install fullwell[render]") from missing
    # USD writes what it finds wrong to the terminal; the delegate collects it instead.
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    root = default_root(source.file) if source.root is None else source.root
    reading = _Reading(source, root, wanted=variants or {}, subdivide=subdivide)
    try:
        # NaN and overflow in a file are found by the checks afterwards, not by warnings on the way.
        with np.errstate(all="ignore"):
            return _read_stage(reading)
    except (Tf.ErrorException, RuntimeError, ValueError, TypeError) as error:
        # Besides its own errors: text that is not UTF-8, attributes of another type than their name promises.
        raise source.error(f"is damaged ({first_line(error)})", "Check it with usdchecker, or export it again") from error
    finally:
        delegate.TakeUncoalescedDiagnostics()
        del delegate


def _check_crate(source: ModelSource) -> None:
    """Binary layers ("crates") begin with a table of contents whose sections must lie in the file.

    The reader maps the file into memory and trusts these numbers: checking them here keeps most damage away from it.
    """
    size = source.file.stat().st_size
    with source.file.open("rb") as stream:
        head = stream.read(24)
        if head[:8] != b"PXR-USDC":
            return
        problem = "is a damaged USD crate: its table of contents lies outside the file"
        where = struct.unpack("<q", head[16:24])[0] if len(head) == 24 else -1
        if not 88 <= where <= size - 8:
            raise source.error(problem, "Copy or export it again")
        stream.seek(where)
        count = struct.unpack("<Q", stream.read(8))[0]
        if not 1 <= count <= 64 or where + 8 + 32 * count > size:
            raise source.error(problem, "Copy or export it again")
        for _ in range(count):
            _, start, length = struct.unpack("<16sqq", stream.read(32))
            if start < 0 or length < 0 or start + length > size:
                raise source.error(problem, "Copy or export it again")


def _read_stage(reading: _Reading) -> UsdStage:
    from pxr import Sdf, Usd, UsdGeom  # noqa: PLC0415

    file = str(reading.source.file.resolve())
    _check_crate(reading.source)
    for reference in layer_references(reading.source.file):
        confined_path(reading.source, reference, base=reading.source.file.resolve().parent, root=reading.root)
    if not reading.source.isolated and needs_probe(reading.source.file):
        probe(reading.source)
    layer = Sdf.Layer.FindOrOpen(file)
    if layer is None:
        raise reading.source.error("is damaged or not a USD layer", "Check it with usdchecker, or export it again")
    # A layer may be cached from an earlier reading of a file that has changed since.
    layer.Reload()
    _check_references(reading, file)
    stage = Usd.Stage.Open(layer, Usd.Stage.LoadAll)
    variants = _choose_variants(reading, stage)
    for error in stage.GetCompositionErrors():
        # A connection to a prim outside its reference loses a material input; anything else loses geometry.
        if "target path" not in str(error):
            raise reading.source.error(f"cannot be composed ({first_line(error)})", "Repair its references")
        reading.warn(first_line(error))
    unit_m = float(UsdGeom.GetStageMetersPerUnit(stage))
    states_unit = bool(stage.HasAuthoredMetadata(UsdGeom.Tokens.metersPerUnit))
    if not states_unit:
        reading.warn(f"the layer states no metersPerUnit; USD's default of {unit_m:g} m is taken. Set unit_m.")
    if not (np.isfinite(unit_m) and unit_m > 0):
        raise reading.source.error(f"states metersPerUnit = {unit_m}; must be > 0", "Set unit_m")
    parts = tuple(_parts_of(reading, stage))
    remember_survivor(reading.source.file, reading.references)
    up_axis: UpAxis = "z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y"
    return UsdStage(
        parts,
        unit_m,
        up_axis,
        tuple(reading.warnings),
        tuple(reading.references),
        states_unit,
        bool(stage.HasAuthoredMetadata(UsdGeom.Tokens.upAxis)),
        variants,
        reading.subdivision_meshes,
    )


_MAX_VARIANT_PASSES = 8
"""A choice may bring further variant sets to light; deeper nesting than this is not followed."""


def _choose_variants(reading: _Reading, stage: Any) -> tuple[VariantSet, ...]:
    """Make the wanted choices in the session layer, and return every variant set of the stage as it is then."""
    from pxr import Usd  # noqa: PLC0415

    stage.SetEditTarget(Usd.EditTarget(stage.GetSessionLayer()))
    used: set[str] = set()
    for _ in range(_MAX_VARIANT_PASSES):
        found = _variant_sets(stage)
        changes = 0
        for entry in found:
            key = next((key for key in (f"{entry.prim}{{{entry.name}}}", entry.name) if key in reading.wanted), None)
            if key is None:
                continue
            used.add(key)
            choice = reading.wanted[key]
            if choice not in entry.choices:
                message = unknown_name_message(f"the variant of {entry.name!r}", choice, entry.choices)
                raise reading.source.error(f"cannot be read as asked: {message.rstrip('?.')}", "Choose one that it has")
            if choice != entry.selected:
                stage.GetPrimAtPath(entry.prim).GetVariantSet(entry.name).SetVariantSelection(choice)
                changes += 1
        if not changes:
            break
    unknown = sorted(set(reading.wanted) - used)
    if unknown:
        message = unknown_name_message("variant set", unknown[0], {entry.name for entry in found})
        raise reading.source.error(f"cannot be read as asked: {message.rstrip('?.')}", "Choose one that it has")
    return found


def _variant_sets(stage: Any) -> tuple[VariantSet, ...]:
    found = []
    for prim in stage.TraverseAll():
        sets = prim.GetVariantSets()
        for name in sets.GetNames():
            chosen = sets.GetVariantSet(name)
            choices = tuple(sorted(map(str, chosen.GetVariantNames())))
            found.append(VariantSet(str(prim.GetPath()), str(name), choices, str(chosen.GetVariantSelection())))
    return tuple(found)


def _check_references(reading: _Reading, file: str) -> None:
    """Every layer and texture, in all variants, must lie within the root; layers must exist."""
    from pxr import UsdUtils  # noqa: PLC0415

    layers, assets, unresolved = UsdUtils.ComputeAllDependencies(file)
    source = reading.source
    base = source.file.resolve().parent
    for path in [layer.realPath for layer in layers if layer.realPath] + [str(asset) for asset in assets]:
        outer = path.split("[", 1)[0]  # kit.usdz[texture.png] lies in kit.usdz
        reading.references.add(confined_path(source, _relative(outer, base), base=base, root=reading.root))
    reading.references.discard(source.file.resolve())
    for path in unresolved:
        name = str(path)
        confined_path(source, _relative(name, base), base=base, root=reading.root)
        if name.lower().endswith(_LAYER_SUFFIXES):
            raise source.error(f"refers to {_relative(name, base)!r}, which is missing", "Copy it to its place in the kit")
        reading.warn(f"{_relative(name, base)!r} is missing; the constant colour is used.")


def _relative(path: str, base: Path) -> str:
    """The path as seen from `base`; addresses and what is relative already stay as they are."""
    if "://" in path or not Path(path).is_absolute():
        return path
    real = Path(path).resolve()
    climbs = 0
    folder = base
    while not real.is_relative_to(folder):
        folder, climbs = folder.parent, climbs + 1
    return "../" * climbs + real.relative_to(folder).as_posix()


# Geometry ------------------------------------------------------------------------------------------------------------


def _parts_of(reading: _Reading, stage: Any) -> Iterator[PartDraft]:
    from pxr import Usd, UsdGeom  # noqa: PLC0415

    transforms = UsdGeom.XformCache(Usd.TimeCode.Default())
    skipped: set[str] = set()
    walk = iter(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for prim in walk:
        imageable = UsdGeom.Imageable(prim)
        if imageable:
            hidden = imageable.ComputeVisibility() == UsdGeom.Tokens.invisible
            if hidden or imageable.ComputePurpose() in (UsdGeom.Tokens.proxy, UsdGeom.Tokens.guide):
                walk.PruneChildren()
                continue
        if prim.IsA(UsdGeom.PointInstancer):
            walk.PruneChildren()
            matrix = np.array(transforms.GetLocalToWorldTransform(prim), dtype=np.float64)
            yield from _instanced_parts(reading, UsdGeom.PointInstancer(prim), matrix, skipped)
        elif prim.IsA(UsdGeom.Gprim):
            matrix = np.array(transforms.GetLocalToWorldTransform(prim), dtype=np.float64)
            yield from _gprim_parts(reading, prim, matrix, skipped)
    if skipped:
        reading.warn(f"prims of type {', '.join(sorted(skipped))} are not read; convert them to meshes.")


def _gprim_parts(reading: _Reading, prim: Any, matrix: NDArray[np.float64], skipped: set[str]) -> Iterator[PartDraft]:
    from pxr import UsdGeom  # noqa: PLC0415

    if prim.IsA(UsdGeom.Mesh):
        yield from _mesh_parts(reading, UsdGeom.Mesh(prim), matrix)
        return
    shape = _solid(prim)
    if shape is None:
        skipped.add(str(prim.GetTypeName()))
        return
    points, faces = shape
    vertices, _, mirrored = _placed(points, None, matrix)
    reading.count(len(faces))
    surface = _surface_of(reading, UsdGeom.Gprim(prim), prim)
    yield PartDraft(str(prim.GetPath()), vertices, faces[:, ::-1] if mirrored else faces, None, None, surface)


_SIDES = 32


def _solid(prim: Any) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    """Points and triangles of a cube, sphere, cylinder, cone or capsule, centred as USD has them; None for anything else."""
    import trimesh  # noqa: PLC0415  (an extra)
    from pxr import UsdGeom  # noqa: PLC0415

    def number(name: str) -> float:
        value = float(prim.GetAttribute(name).Get())
        return value if np.isfinite(value) and value > 0 else 0.0

    axis = "Z"
    if prim.IsA(UsdGeom.Cube):
        solid = trimesh.creation.box(extents=[number("size")] * 3)
    elif prim.IsA(UsdGeom.Sphere):
        solid = trimesh.creation.icosphere(subdivisions=3, radius=number("radius"))
    elif prim.IsA(UsdGeom.Cylinder):
        solid, axis = (
            trimesh.creation.cylinder(number("radius"), number("height"), sections=_SIDES),
            prim.GetAttribute("axis").Get(),
        )
    elif prim.IsA(UsdGeom.Cone):
        solid, axis = (
            trimesh.creation.cone(number("radius"), number("height"), sections=_SIDES),
            prim.GetAttribute("axis").Get(),
        )
    elif prim.IsA(UsdGeom.Capsule):
        solid = trimesh.creation.capsule(number("height"), number("radius"), count=[_SIDES, _SIDES])
        axis = prim.GetAttribute("axis").Get()
    else:
        return None
    points = np.asarray(solid.vertices, dtype=np.float64) - np.asarray(solid.bounds).mean(axis=0)
    # A cyclic change of axes keeps faces outward.
    order = {"X": [2, 0, 1], "Y": [1, 2, 0]}.get(str(axis), [0, 1, 2])
    return points[:, order], np.asarray(solid.faces, dtype=np.int64)


def _instanced_parts(reading: _Reading, instancer: Any, matrix: NDArray[np.float64], skipped: set[str]) -> Iterator[PartDraft]:
    """Every prototype's parts, all their instances joined."""
    from pxr import Usd, UsdGeom  # noqa: PLC0415

    now = Usd.TimeCode.Default()
    which = _array(instancer.GetProtoIndicesAttr().Get(), np.int64, 1).reshape(-1)
    kind = UsdGeom.PointInstancer
    every = instancer.ComputeInstanceTransformsAtTime(now, now, kind.IncludeProtoXform, kind.IgnoreMask)
    placed = np.array(every, dtype=np.float64).reshape(-1, 4, 4)
    if len(which) != len(placed):
        raise reading.source.error(f"has damaged instances in {instancer.GetPath()}", "Export it again")
    shown = np.array(instancer.ComputeMaskAtTime(now), dtype=bool)
    if len(shown) == len(which):
        which = np.where(shown, which, -1)
    cache = UsdGeom.XformCache(now)
    stage = instancer.GetPrim().GetStage()
    for number, target in enumerate(instancer.GetPrototypesRel().GetForwardedTargets()):
        prototype = stage.GetPrimAtPath(target)
        copies = placed[which == number]
        if not prototype or not len(copies):
            continue
        for prim in Usd.PrimRange(prototype, Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)):
            if not prim.IsA(UsdGeom.Gprim) or UsdGeom.Imageable(prim).ComputePurpose() in (
                UsdGeom.Tokens.proxy,
                UsdGeom.Tokens.guide,
            ):
                continue
            own = np.eye(4)
            if prim != prototype:
                own = np.array(cache.ComputeRelativeTransform(prim, prototype)[0], dtype=np.float64)
            for draft in _gprim_parts(reading, prim, np.eye(4), skipped):
                yield _copied(reading, draft, [own @ copy @ matrix for copy in copies])


def _copied(reading: _Reading, draft: PartDraft, matrices: list[NDArray[np.float64]]) -> PartDraft:
    """One part out of several copies of another."""
    reading.count(len(draft.faces) * (len(matrices) - 1))
    vertices, normals, faces = [], [], []
    for number, matrix in enumerate(matrices):
        points, turned, mirrored = _placed(draft.vertices, draft.normals, matrix)
        vertices.append(points)
        faces.append((draft.faces[:, ::-1] if mirrored else draft.faces) + number * len(draft.vertices))
        if turned is not None:
            normals.append(turned)
    return replace(
        draft,
        vertices=np.concatenate(vertices),
        faces=np.concatenate(faces),
        normals=np.concatenate(normals) if normals else None,
        uv=None if draft.uv is None else np.tile(draft.uv, (len(matrices), 1)),
    )


def _mesh_parts(reading: _Reading, mesh: Any, matrix: NDArray[np.float64]) -> Iterator[PartDraft]:
    path = str(mesh.GetPath())
    points = _array(mesh.GetPointsAttr().Get(), np.float64, 3)
    counts = _array(mesh.GetFaceVertexCountsAttr().Get(), np.int64, 1).reshape(-1)
    indices = _array(mesh.GetFaceVertexIndicesAttr().Get(), np.int64, 1).reshape(-1)
    if not len(points) or not len(counts):
        return
    if counts.min() < 0 or counts.sum() != len(indices):
        raise reading.source.error(
            f"has {len(indices)} indices for {int(counts.sum())} face corners in {path}", "Export the mesh again"
        )
    if len(indices) and (indices.min() < 0 or indices.max() >= len(points)):
        raise reading.source.error(
            f"uses vertex {int(indices.max())} in {path}, which has {len(points)} points", "Export the mesh again"
        )
    uv = _uv(mesh, counts, indices)
    normals = _normals(mesh, counts, indices)
    face_count = len(counts)
    parent: NDArray[np.int64] | None = None
    if _is_subdivision(mesh, has_normals=normals is not None):
        reading.subdivision_meshes += 1
        if reading.subdivide:
            fine = _refined(reading, mesh, PolygonMesh(points, counts, indices, uv, np.arange(face_count)))
            points, counts, indices, uv, parent, normals = fine.points, fine.counts, fine.indices, fine.uv, fine.parent, None
    corners, face_of = _fan(counts)
    face_of = face_of if parent is None else parent[face_of]
    reading.count(len(corners))
    hole = mesh.GetHoleIndicesAttr().Get()
    if hole is not None and len(hole):
        keep = ~np.isin(face_of, np.asarray(hole, dtype=np.int64))
        corners, face_of = corners[keep], face_of[keep]
    vertices, normals, flip = _placed(points, normals, matrix)
    if (mesh.GetOrientationAttr().Get() == "leftHanded") != flip:
        corners = corners[:, ::-1]
    for name, prim, faces in _subsets(mesh, face_count):
        chosen = corners[faces[face_of]]
        if len(chosen):
            surface = _surface_of(reading, mesh, prim)
            yield _draft(f"{path}{name}", surface, _Corners(vertices, indices, normals, uv), chosen)


def _is_subdivision(mesh: Any, *, has_normals: bool) -> bool:
    """Whether a mesh is a control mesh: it says so, or says nothing (USD's default) and has no normals of its own."""
    attribute = mesh.GetSubdivisionSchemeAttr()
    scheme = str(attribute.Get())
    return scheme != "none" and (bool(attribute.HasAuthoredValue()) or not has_normals)


def _refined(reading: _Reading, mesh: Any, control: PolygonMesh) -> PolygonMesh:
    scheme = str(mesh.GetSubdivisionSchemeAttr().Get())
    if scheme == "loop":
        reading.warn(f"{mesh.GetPath()} is subdivided by Loop's scheme, which is not read; its control mesh is drawn.")
        return control
    # Four faces out of each corner at each level, two triangles each.
    reading.allow(2 * len(control.indices) * 4 ** (reading.subdivide - 1))
    keep = control.counts >= 3
    if not keep.all():
        corner = np.repeat(keep, control.counts)
        uv = None if control.uv is None else control.uv[corner]
        control = PolygonMesh(control.points, control.counts[keep], control.indices[corner], uv, control.parent[keep])
    return refined(control, reading.subdivide, creases=_creases(mesh, len(control.points)), smooth=scheme == "catmullClark")


def _creases(mesh: Any, points: int) -> Creases:
    """Creases as pairs of points: USD lists them as chains, with a sharpness for each chain or each edge."""
    chains = _array(mesh.GetCreaseIndicesAttr().Get(), np.int64, 1).reshape(-1)
    lengths = _array(mesh.GetCreaseLengthsAttr().Get(), np.int64, 1).reshape(-1)
    stated = _array(mesh.GetCreaseSharpnessesAttr().Get(), np.float64, 1).reshape(-1)
    corners = _array(mesh.GetCornerIndicesAttr().Get(), np.int64, 1).reshape(-1)
    edge_counts = lengths - 1
    if len(lengths) == 0 or lengths.min() < 2 or lengths.sum() != len(chains) or chains.min() < 0 or chains.max() >= points:
        return replace(Creases.none(), corners=corners)
    last = np.cumsum(lengths) - 1
    starts = np.ones(len(chains), dtype=bool)
    starts[last] = False
    first = np.flatnonzero(starts)
    if len(stated) == len(lengths):
        stated = np.repeat(stated, edge_counts)
    if len(stated) != len(first):
        stated = np.full(len(first), 10.0)  # USD's "infinitely sharp"
    return Creases(np.stack([chains[first], chains[first + 1]], axis=1), np.nan_to_num(stated, nan=0.0), corners)


def _array(value: Any, dtype: Any, width: int) -> NDArray[Any]:
    return np.zeros((0, width), dtype) if value is None else np.array(value, dtype=dtype).reshape(-1, width)


def _fan(counts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(t, 3) corner numbers of a triangle fan per polygon, and (t,) the polygon each belongs to."""
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    triangles = np.maximum(counts - 2, 0)
    face_of = np.repeat(np.arange(len(counts)), triangles)
    step = np.arange(len(face_of)) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    first = starts[face_of]
    return np.stack([first, first + step + 1, first + step + 2], axis=1), face_of


@dataclass(frozen=True, slots=True, eq=False)
class _Corners:
    """Values of a mesh: vertices by point, normals and uv by face corner."""

    vertices: NDArray[np.float64]
    indices: NDArray[np.int64]
    normals: NDArray[np.float64] | None
    uv: NDArray[np.float64] | None


def _placed(
    points: NDArray[np.float64], normals: NDArray[np.float64] | None, matrix: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None, bool]:
    """Points and normals in the stage's world (USD matrices act on row vectors), and whether the transform mirrors."""
    linear = matrix[:3, :3]
    mirrored = bool(np.linalg.det(linear) < 0)
    vertices = points @ linear + matrix[3, :3]
    if normals is not None:
        cofactors = np.array([np.cross(linear[1], linear[2]), np.cross(linear[2], linear[0]), np.cross(linear[0], linear[1])])
        normals = normals @ cofactors * (-1.0 if mirrored else 1.0)
    return vertices, normals, mirrored


def _by_corner(
    values: NDArray[np.float64], interpolation: str, counts: NDArray[np.int64], indices: NDArray[np.int64]
) -> NDArray[np.float64] | None:
    """Values of a primvar, one per face corner, or None where their number does not fit."""
    if interpolation == "faceVarying" and len(values) == len(indices):
        return values
    if interpolation in ("vertex", "varying") and len(indices) and len(values) > indices.max():
        return values[indices]
    if interpolation == "uniform" and len(values) == len(counts):
        return np.repeat(values, counts, axis=0)
    if interpolation == "constant" and len(values) == 1:
        return np.repeat(values, len(indices), axis=0)
    return None


def _uv(mesh: Any, counts: NDArray[np.int64], indices: NDArray[np.int64]) -> NDArray[np.float64] | None:
    """Texture coordinates: the primvar st, or else the first one of a two-component type."""
    from pxr import UsdGeom  # noqa: PLC0415

    primvars = {pv.GetPrimvarName(): pv for pv in UsdGeom.PrimvarsAPI(mesh).FindPrimvarsWithInheritance() if pv.HasValue()}
    flat = [name for name, pv in primvars.items() if str(pv.GetTypeName()) in ("texCoord2f[]", "float2[]", "texCoord2d[]")]
    for name in sorted(flat, key=lambda candidate: (candidate not in ("st", "st0", "UVMap", "uv"), candidate)):
        values = primvars[name].ComputeFlattened()
        if values is not None:
            return _by_corner(_array(values, np.float64, 2), str(primvars[name].GetInterpolation()), counts, indices)
    return None


def _normals(mesh: Any, counts: NDArray[np.int64], indices: NDArray[np.int64]) -> NDArray[np.float64] | None:
    from pxr import UsdGeom  # noqa: PLC0415

    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    if primvar and primvar.HasValue():
        return _by_corner(_array(primvar.ComputeFlattened(), np.float64, 3), str(primvar.GetInterpolation()), counts, indices)
    stated = mesh.GetNormalsAttr().Get()
    if stated is None:
        return None
    return _by_corner(_array(stated, np.float64, 3), str(mesh.GetNormalsInterpolation()), counts, indices)


def _subsets(mesh: Any, face_count: int) -> Iterator[tuple[str, Any, NDArray[np.bool_]]]:
    """(name, prim that the material is bound to, faces) of every material subset, then the faces in none of them."""
    from pxr import UsdGeom, UsdShade  # noqa: PLC0415

    rest = np.ones(face_count, dtype=bool)
    # Files in the wild leave the family name of their material subsets away, so every face subset with a binding counts.
    for subset in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(mesh.GetPrim())):
        if subset.GetElementTypeAttr().Get() != UsdGeom.Tokens.face:
            continue
        if not UsdShade.MaterialBindingAPI(subset.GetPrim()).GetDirectBinding().GetMaterialPath():
            continue
        chosen = _array(subset.GetIndicesAttr().Get(), np.int64, 1).reshape(-1)
        faces = np.zeros(face_count, dtype=bool)
        faces[chosen[(chosen >= 0) & (chosen < face_count)]] = True
        yield f"/{subset.GetPrim().GetName()}", subset.GetPrim(), faces & rest
        rest &= ~faces
    yield "", mesh.GetPrim(), rest


def _draft(name: str, surface: SurfaceDraft, corners: _Corners, chosen: NDArray[np.int64]) -> PartDraft:
    """One part; corners that agree in point, normal and texture coordinate become one vertex."""
    point = corners.indices[chosen]
    if corners.normals is None and corners.uv is None:
        return PartDraft(name, corners.vertices, point, None, None, surface)
    columns = [corners.indices[:, None].astype(np.float64)]
    columns += [extra for extra in (corners.normals, corners.uv) if extra is not None]
    used, local = np.unique(chosen, return_inverse=True)
    _, first, inverse = np.unique(np.hstack(columns)[used], axis=0, return_index=True, return_inverse=True)
    keep = used[first]
    return PartDraft(
        name,
        corners.vertices[corners.indices[keep]],
        inverse.reshape(-1)[local.reshape(-1)].reshape(chosen.shape).astype(np.int64),
        None if corners.normals is None else corners.normals[keep],
        None if corners.uv is None else corners.uv[keep],
        surface,
    )


# Materials -----------------------------------------------------------------------------------------------------------


def _surface_of(reading: _Reading, mesh: Any, prim: Any) -> SurfaceDraft:
    """UsdPreviewSurface of the bound material; without one, displayColor."""
    from pxr import UsdShade  # noqa: PLC0415

    double_sided = bool(mesh.GetDoubleSidedAttr().Get())
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    if not material:
        surface = SurfaceDraft(double_sided=double_sided)
        colours = _array(mesh.GetDisplayColorPrimvar().ComputeFlattened(), np.float64, 3)
        if len(colours) and np.all(np.isfinite(colours)):
            surface.base_color_srgb = _encoded(colours.mean(axis=0))
        return surface
    key = str(material.GetPath())
    if key not in reading.surfaces:
        reading.surfaces[key] = _preview_surface(reading, material)
        reading.surfaces[key].name = str(material.GetPath().name)
    return replace(reading.surfaces[key], double_sided=double_sided)


def _preview_surface(reading: _Reading, material: Any) -> SurfaceDraft:
    """UsdPreviewSurface 2.6: linear constants, roughness 0.5, metallic 0, diffuse colour 0.18 by default."""
    surface = SurfaceDraft(base_color_srgb=_encoded(np.full(3, 0.18)), roughness=0.5, metallic=0.0)
    shader = material.ComputeSurfaceSource()[0]
    if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
        reading.warn(f"material {material.GetPath().name!r} is no UsdPreviewSurface; a plain grey is used.")
        return surface
    surface.roughness = _number(reading, shader, "roughness", 0.5)
    surface.metallic = _number(reading, shader, "metallic", 0.0)
    if _number(reading, shader, "opacity", 1.0) < 1.0:
        reading.warn(f"material {material.GetPath().name!r} is transparent; it is drawn opaque.")
    pixels, colour = _colour(reading, shader, "diffuseColor")
    if pixels is not None:
        if np.all(pixels == pixels[:1, :1]):
            # A swatch: one colour in every pixel needs no coordinates.
            surface.base_color_srgb = mean_srgb(pixels)
        else:
            surface.base_color_texture, surface.base_color_srgb = pixels, mean_srgb(pixels)
    elif colour is not None:
        surface.base_color_srgb = _encoded(colour)
    emission_pixels, emission = _colour(reading, shader, "emissiveColor")
    if emission_pixels is not None:
        surface.emissive_srgb = mean_srgb(emission_pixels)
    elif emission is not None and emission.any():
        surface.emissive_srgb = _encoded(emission)
    return surface


def _input(shader: Any, name: str) -> Any:
    """The attribute that an input's value comes from: its own, or what it is connected to (through interfaces)."""
    stated = shader.GetInput(name)
    sources = stated.GetValueProducingAttributes() if stated else []
    return sources[0] if sources else None


def _number(reading: _Reading, shader: Any, name: str, otherwise: float) -> float:
    attribute = _input(shader, name)
    value = None if attribute is None else attribute.Get()
    if isinstance(value, int | float):
        return float(value)
    if attribute is not None and value is None:
        pixels = _texture(reading, attribute)
        if pixels is not None:
            channel = {"r": 0, "g": 1, "b": 2}.get(attribute.GetName().rsplit(":", 1)[-1], 0)
            reading.warn(f"the mean of the texture of {name} is used.")
            return float(pixels[..., channel].mean() / 255.0)
    return otherwise


def _colour(reading: _Reading, shader: Any, name: str) -> tuple[NDArray[np.uint8] | None, NDArray[np.float64] | None]:
    attribute = _input(shader, name)
    if attribute is None:
        return None, None
    value = attribute.Get()
    if value is not None:
        colour = np.asarray(value, dtype=np.float64).reshape(-1)
        return None, colour if colour.shape == (3,) and np.all(np.isfinite(colour)) else None
    pixels = _texture(reading, attribute)
    if pixels is not None:
        return pixels, None
    from pxr import UsdShade  # noqa: PLC0415

    fallback = UsdShade.Shader(attribute.GetPrim()).GetInput("fallback")
    constant = fallback.Get() if fallback else None
    return None, None if constant is None else np.asarray(constant, dtype=np.float64)[:3]


def _texture(reading: _Reading, output: Any) -> NDArray[np.uint8] | None:
    """Pixels of the UsdUVTexture that an output belongs to, with its scale; None where it cannot be read."""
    from PIL import Image  # noqa: PLC0415
    from pxr import Ar, UsdShade  # noqa: PLC0415

    shader = UsdShade.Shader(output.GetPrim())
    if shader.GetIdAttr().Get() != "UsdUVTexture":
        reading.warn(f"shader {output.GetPrim().GetName()!r} is not read; a constant is used.")
        return None
    attribute = _input(shader, "file")
    asset = None if attribute is None else attribute.Get()
    if asset is None or not asset.resolvedPath:
        return None
    opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(asset.resolvedPath))
    if opened is None:
        return None
    try:
        image = Image.open(io.BytesIO(bytes(opened.GetBuffer())))
    except (OSError, ValueError, Image.DecompressionBombError) as error:
        name = Path(str(asset.path)).name
        raise reading.source.error(f"has a damaged texture {name!r} ({error})", "Export the texture again") from error
    scale = _input(shader, "scale")
    factor = np.ones(3) if scale is None or scale.Get() is None else np.asarray(scale.Get(), dtype=np.float64)[:3]
    return tinted(pixels_of(reading.source, image), factor)


def _encoded(linear: NDArray[np.float64]) -> tuple[float, float, float]:
    red, green, blue = linear_to_srgb(np.asarray(linear, dtype=np.float64)).tolist()
    return red, green, blue
