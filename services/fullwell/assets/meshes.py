"""Model files into checked triangles: GLB, glTF, OBJ, PLY and STL here, USD in `usd`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.model import (
    AXES,
    LoadedModel,
    LoadedPart,
    ModelError,
    ModelSource,
    PartDraft,
    SurfaceDraft,
    UpAxis,
    finish_model,
    linear_to_srgb,
)
from fullwell.assets.preflight import PREFLIGHT, ConfinedFiles
from fullwell.assets.surfaces import TextureMemo, surface_of
from fullwell.core.errors import FieldError, unknown_name_message

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = ["MODEL_SUFFIXES", "LoadedModel", "LoadedPart", "ModelError", "UpAxis", "load_model"]

_UP_BY_SUFFIX: dict[str, UpAxis] = {".glb": "y", ".gltf": "y", ".obj": "y", ".ply": "z", ".stl": "z"}
_USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")

MODEL_SUFFIXES: tuple[str, ...] = (*_UP_BY_SUFFIX, *_USD_SUFFIXES)
"""File name endings that `load_model` reads, lower case."""

MAX_SUBDIVISION = 2

_MAX_SOLID_COLOURS = 64
"""Vertex colours are kept by splitting a part into one-coloured ones up to this number; beyond it their mean is used."""


def load_model(
    file: Path,
    *,
    unit_m: float | None = None,
    up_axis: UpAxis | None = None,
    field_path: str = "",
    root: Path | None = None,
    max_triangles: int = 20_000_000,
    max_bytes: int = 2_000_000_000,
    by_object: bool = False,
    variants: Mapping[str, str] | None = None,
    subdivide: int = 0,
    isolated: bool = False,
) -> LoadedModel:
    """Return the triangles and materials of a model file, checked, in metres, z up.

    Units and axes come from the file where its format states them (glTF: metres, y up; USD: metersPerUnit, upAxis).
    OBJ, PLY and STL state neither: 1 m per unit is taken, y up for OBJ, z up for PLY and STL, and a warning says so.
    Cameras, lights, animation, skins and transparency of the file are left out.

    Parameters
    ----------
    unit_m
        Metres that one unit of the file stands for; overrides the file.
    up_axis
        Axis of the file that points up; overrides the file.
    field_path
        Path of the recipe field that names the file, for messages.
    root
        Folder that the file and everything it refers to must stay within. Default: the folder of the file; USD layers,
        which are made to share folders, may also climb with relative paths (see `usd.default_root`).
    max_triangles, max_bytes
        Refused above.
    by_object
        Name parts after the nodes of a glTF file instead of its meshes ("wheel/rubber" where a node has several materials), and
        split an OBJ file by its objects (or groups, where it has no objects) as well as by material ("wheel_rubber").
    variants
        {name of a variant set, or "/prim/path{name}" for one prim's: choice} in place of a USD stage's own choices.
    subdivide
        Levels, 0 to 2, by which USD subdivision surfaces are refined; 0 draws their control meshes.
    isolated
        The caller's process is one that may die: damaged binary USD layers are read without trying them in another first.

    Raises
    ------
    ModelError
        The file is missing, damaged, empty, too large, of another format, or refers to files outside `root` or on the network.
    FieldError
        unit_m, up_axis or subdivide is outside its range.
    """
    if not 0 <= subdivide <= MAX_SUBDIVISION:
        raise FieldError(f"subdivide is {subdivide}; must be 0 to {MAX_SUBDIVISION} levels.", path="subdivide", value=subdivide)
    _check_overrides(unit_m=unit_m, up_axis=up_axis, field_path=field_path)
    source = ModelSource(file, field_path, max_triangles, max_bytes, root, isolated)
    suffix = _checked_suffix(source)
    if suffix in _USD_SUFFIXES:
        from fullwell.assets.usd import read_usd  # noqa: PLC0415  (usd-core is an extra and slow to import)

        stage = read_usd(source, variants=variants or {}, subdivide=subdivide)
        model = finish_model(
            source,
            stage.parts,
            unit_m=stage.unit_m if unit_m is None else unit_m,
            up_axis=stage.up_axis if up_axis is None else up_axis,
            warnings=stage.warnings,
            references=stage.references,
        )
        return replace(
            model,
            states_unit=stage.states_unit,
            states_up_axis=stage.states_up_axis,
            variants=stage.variants,
            subdivision_meshes=stage.subdivision_meshes,
        )
    warnings: list[str] = []
    files = ConfinedFiles(source, warnings)
    # NaN and overflow in a file are found by the checks afterwards, not by warnings on the way.
    with np.errstate(all="ignore"):
        drafts = _read_with_trimesh(source, suffix, files, warnings, by_object=by_object)
    chosen_up = _UP_BY_SUFFIX[suffix] if up_axis is None else up_axis
    if suffix not in (".glb", ".gltf"):
        assumed = ["1 m per unit"] * (unit_m is None) + [f"{chosen_up} up"] * (up_axis is None)
        if assumed:
            warnings.append(
                f"{file.name}: the format states neither unit nor up axis; {' and '.join(assumed)} assumed. "
                "Set unit_m and up_axis."
            )
    model = finish_model(
        source,
        drafts,
        unit_m=1.0 if unit_m is None else unit_m,
        up_axis=chosen_up,
        warnings=warnings,
        references=files.read_files,
    )
    stated = suffix in (".glb", ".gltf")
    return replace(model, states_unit=stated, states_up_axis=stated)


def _check_overrides(*, unit_m: float | None, up_axis: str | None, field_path: str) -> None:
    prefix = f"{field_path}." if field_path else ""
    if unit_m is not None and not (math.isfinite(unit_m) and unit_m > 0):
        raise FieldError(
            f"unit_m is {unit_m}; must be > 0. Set {prefix}unit_m to the metres of one unit.", f"{prefix}unit_m", unit_m
        )
    if up_axis is not None and up_axis not in AXES:
        raise FieldError(f"up_axis is {up_axis!r}; must be x, y or z. Set {prefix}up_axis.", f"{prefix}up_axis", up_axis)


def _checked_suffix(source: ModelSource) -> str:
    file = source.file
    suffix = file.suffix.lower()
    if suffix not in MODEL_SUFFIXES:
        known = ", ".join(MODEL_SUFFIXES)
        raise source.error(f"is not of a known model format; known are {known}", "Convert the model, best to .glb")
    if not file.is_file():
        raise source.error(_missing_problem(file), "Give the path of an existing file, relative to the recipe")
    size = file.stat().st_size
    if size == 0:
        raise source.error("is empty (0 bytes)", "Copy or export the file again")
    if size > source.max_bytes:
        raise source.error(
            f"has {size} bytes; at most {source.max_bytes} are allowed", "Simplify the model, or raise max_bytes"
        )
    if source.root is not None and not file.resolve().is_relative_to(source.root.resolve()):
        raise source.error(f"lies outside {source.root}", "Move it there")
    return suffix


def _missing_problem(file: Path) -> str:
    if file.is_dir():
        return "is a folder, not a file"
    if not file.parent.is_dir():
        return f"does not exist: there is no folder {file.parent}"
    siblings = [entry.name for entry in sorted(file.parent.iterdir()) if entry.suffix.lower() in MODEL_SUFFIXES]
    hint = " (" + unknown_name_message("model file", file.name, siblings).rstrip("?.") + ")" if siblings else ""
    return f"does not exist in {file.parent}{hint}"


@dataclass(slots=True, eq=False)
class _Placed:
    """A mesh with its transform into the file's world, and the names of the things it belongs to."""

    name: str
    mesh: Trimesh
    transform: NDArray[np.float64]


@dataclass(slots=True, eq=False)
class _Surfaces:
    """What reading materials needs: where warnings go, and the textures that are decoded already."""

    source: ModelSource
    warnings: list[str]
    textures: TextureMemo = field(default_factory=dict)


def _read_with_trimesh(
    source: ModelSource, suffix: str, files: ConfinedFiles, warnings: list[str], *, by_object: bool
) -> list[PartDraft]:
    content = source.file.read_bytes()
    # Cheap checks of headers first: a damaged count must not make the parser reserve memory for it.
    check: Callable[[ModelSource, bytes, ConfinedFiles], bytes] = PREFLIGHT[suffix]
    content = check(source, content, files)
    placed = _trimesh_meshes(source, suffix, content, files, by_object=by_object)
    if files.refusal is not None:
        raise files.refusal
    drafts: list[PartDraft] = []
    triangles = 0
    surfaces = _Surfaces(source, warnings)
    for item in placed:
        triangles += len(item.mesh.faces)
        if triangles > source.max_triangles:
            raise source.error(
                f"holds more than {source.max_triangles} triangles", "Simplify the model, or raise max_triangles"
            )
        drafts.extend(_drafts_of(surfaces, item))
    return drafts


def _trimesh_meshes(
    source: ModelSource, suffix: str, content: bytes, files: ConfinedFiles, *, by_object: bool
) -> list[_Placed]:
    """Every placed mesh with its transform into the file's world; points and lines are left out."""
    import io  # noqa: PLC0415

    try:
        import trimesh  # noqa: PLC0415  (an extra)
    except ImportError as missing:
        raise source.error("needs the package trimesh to be read", "Install fullwell[render]") from missing

    options: dict[str, Any] = {"merge_primitives": False} if suffix in (".glb", ".gltf") else {}
    if suffix == ".obj" and by_object:
        options = _obj_splits(content)
    try:
        scene: Any = trimesh.load_scene(
            io.BytesIO(content), file_type=suffix[1:], resolver=files.resolver(), process=False, **options
        )
        placed = []
        for node in sorted(scene.graph.nodes_geometry, key=lambda name: _node_order(scene, name)):
            transform, geometry_name = scene.graph[node]
            mesh = scene.geometry[geometry_name]
            if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
                name = _object_name(scene, node, geometry_name, mesh) if by_object else geometry_name
                placed.append(_Placed(name, mesh, np.asarray(transform, dtype=np.float64)))
        return placed
    except ModelError:
        raise
    except MemoryError as error:
        raise source.error("needs more memory than there is", "Simplify the model") from error
    except Exception as error:
        # The parser is fed damaged files here and answers with whatever its arithmetic raised.
        said = (f"{type(error).__name__}: {error}".strip().splitlines() or [""])[0][:200]
        raise source.error(
            f"is damaged or not really {suffix} ({said})", "Open it in another program, or export it again"
        ) from error


def _stated_node(scene: Any, node: str) -> str:
    """The node that the file states: of several primitives each has a node below it, with six random characters."""
    parent = scene.graph.transforms.parents.get(node)
    return str(parent) if parent is not None and _made_node(node, str(parent)) else node


def _made_node(node: str, parent: str) -> bool:
    return node.startswith(parent + "_") and len(node) == len(parent) + 7


def _node_order(scene: Any, node: str) -> tuple[str, str]:
    """Order of nodes that does not depend on the random names that some are given."""
    geometry_name = scene.graph[node][1]
    return _stated_node(scene, node), geometry_name


def _object_name(scene: Any, node: str, geometry_name: str, mesh: Trimesh) -> str:
    """Name by object: a node's, with the material behind it where the node has several; else the mesh's."""
    stated = _stated_node(scene, node)
    if stated == node and (node.isdigit() or node == geometry_name):
        return geometry_name
    material = str(getattr(getattr(mesh.visual, "material", None), "name", None) or "")
    if stated == node:
        return node
    base = geometry_name if stated.isdigit() else stated
    return f"{base}/{material}" if material else base


_OBJ_OBJECT = re.compile(rb"^o[ \t]+(\S[^\r\n]*)", re.MULTILINE)
_OBJ_GROUP = re.compile(rb"^g[ \t]+(\S[^\r\n]*)", re.MULTILINE)
_MAX_OBJ_OBJECTS = 500


def _obj_splits(content: bytes) -> dict[str, Any]:
    """Options for trimesh: split by objects where there are several, else by groups where there are several."""
    objects = set(_OBJ_OBJECT.findall(content))
    if objects:
        return {"split_objects": 1 < len(objects) <= _MAX_OBJ_OBJECTS}
    return {"split_groups": 1 < len(set(_OBJ_GROUP.findall(content))) <= _MAX_OBJ_OBJECTS}


def _drafts_of(surfaces: _Surfaces, placed: _Placed) -> list[PartDraft]:
    mesh, transform = placed.mesh, placed.transform
    vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    linear = transform[:3, :3]
    normals = _file_normals(mesh)
    if not np.allclose(transform, np.eye(4)):
        vertices = vertices @ linear.T + transform[:3, 3]
        mirrored = np.linalg.det(linear) < 0
        if mirrored:
            faces = faces[:, ::-1]
        if normals is not None:
            # Cofactors are the inverse transpose times the determinant, and exist for flattened nodes too.
            cofactors = np.array(
                [np.cross(linear[1], linear[2]), np.cross(linear[2], linear[0]), np.cross(linear[0], linear[1])]
            )
            normals = normals @ cofactors.T * (-1.0 if mirrored else 1.0)
    surface, uv = surface_of(surfaces.source, placed.name, mesh, surfaces.warnings, surfaces.textures)
    draft = PartDraft(placed.name, vertices, faces, normals, uv, surface)
    colours = _vertex_colours(mesh)
    return [draft] if colours is None else _split_by_colour(surfaces.source, draft, colours, surfaces.warnings)


def _file_normals(mesh: Trimesh) -> NDArray[np.float64] | None:
    """Vertex normals that the file states; trimesh would otherwise make up smooth ones, which round every box."""
    cached = getattr(mesh, "_cache", None)
    stated = None if cached is None else cached.cache.get("vertex_normals")
    return None if stated is None else np.asarray(stated, dtype=np.float64)


def _vertex_colours(mesh: Trimesh) -> NDArray[np.float64] | None:
    visual: Any = mesh.visual
    if visual.kind not in ("vertex", "face") or not visual.defined:
        return None
    per_face: NDArray[np.uint8] = np.asarray(visual.face_colors)[:, :3]
    return per_face.astype(np.float64) / 255.0


def _split_by_colour(
    source: ModelSource, draft: PartDraft, face_colours_srgb: NDArray[np.float64], warnings: list[str]
) -> list[PartDraft]:
    """One draft per colour where there are few; otherwise the draft in its mean colour."""
    unique, which = np.unique(face_colours_srgb, axis=0, return_inverse=True)
    which = which.reshape(-1)
    if len(unique) > _MAX_SOLID_COLOURS or len(face_colours_srgb) != len(draft.faces):
        linear = ((face_colours_srgb + 0.055) / 1.055) ** 2.4
        red, green, blue = linear_to_srgb(linear.mean(axis=0)).tolist()
        draft.surface.base_color_srgb = (red, green, blue)
        warnings.append(
            f"{source.file.name}: part {draft.name!r} has {len(unique)} vertex colours; their mean is used. "
            "Bake them into a texture."
        )
        return [draft]
    pieces = []
    for index, colour in enumerate(unique.tolist()):
        surface = SurfaceDraft(base_color_srgb=(colour[0], colour[1], colour[2]))
        name = draft.name if len(unique) == 1 else f"{draft.name}_{index}"
        pieces.append(PartDraft(name, draft.vertices, draft.faces[which == index], draft.normals, draft.uv, surface))
    return pieces
