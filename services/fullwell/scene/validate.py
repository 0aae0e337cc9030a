"""Scenes and cameras checked before a renderer sees them: what is wrong, where, what is legal and what to do next.

Renderers drop what they cannot use without a word (NaN vertices, singular transforms), count it twice (repeated triangles of a
lamp) or die of it (an environment image without pixels). The checks here hold for any scene, whoever made it.
"""

from __future__ import annotations

import math
import weakref
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError
from fullwell.radiometry.spectrum import Spectrum
from fullwell.scene.camera import Camera
from fullwell.scene.description import (
    BeamPattern,
    Conductor,
    ConstantEnvironment,
    Cube,
    Cylinder,
    Dielectric,
    Diffuse,
    DirectionalLight,
    Disk,
    Fog,
    Geometry,
    GoniometricLight,
    ImageEnvironment,
    Light,
    Material,
    Mesh,
    Mirror,
    Part,
    PointLight,
    Principled,
    Rectangle,
    RoughPlastic,
    SceneDescription,
    SceneObject,
    Sphere,
    SpotLight,
    SunSky,
    Texture,
    Translucent,
)
from fullwell.scene.extents import box_of

__all__ = ["check_camera", "check_scene", "may_repeat_faces"]

_FARTHEST_M = 1e8
"""Coordinates beyond this are a slip of units; squares of distances stay far within single precision."""

_LARGEST_RADIANCE = 1e15
"""In W m^-2 sr^-1 nm^-1 (W sr^-1 nm^-1 of points): 10^10 times the sun's, and its photons still fit single precision."""

_LINE_TOLERANCE = 1e-3
"""What the product promises on analytic scenes."""

_ROUNDING = 1e-6
"""By how much a share may leave [0, 1]: single precision cannot tell."""

_SMALLEST_STRETCH = 1e-9
_MOST_UNEQUAL_STRETCH = 1e-7
"""Ratio of the smallest to the largest stretch below which single precision sees a plane."""

_DEGENERATE_RELATIVE_AREA = 1e-12
_FACES_AT_ONCE = 1 << 16

_INDEX_RANGE = (0.1, 10.0)

_STEEPEST_PHASE = 0.99
"""Mean cosine of scattering beyond which a phase function is a delta to single precision."""

_NARROWEST_CONE_DEG = 0.2
"""The cosine of a smaller angle is 1 to single precision within a few per cent of the angle."""

_FINEST_PIXEL = 1e-6
"""Tangent of the angle of a film sample. Vertices are rounded to 6e-8 of their distance: a sixteenth of this."""

_MOST_SAMPLES = 100_000_000
_RIGID_TOLERANCE = 1e-6


def check_scene(scene: SceneDescription) -> None:
    """Raise FieldError at the first thing in `scene` that no renderer can show as it is meant.

    Checked are shapes, transforms, materials, spectra and lights, with the object's id, the part and the field in the
    message. Each mesh and each material is looked at once, however many objects share it.
    """
    seen: set[int] = set()
    placed_well = _are_placed_well(scene.objects)
    for index, item in enumerate(scene.objects):
        where = _Place(f"scene.objects[{index}]", f"object {item.id!r}")
        if not item.parts:
            where.fail("parts", "is empty; an object needs at least one part. Leave the object out instead.")
        to_world = None if placed_well else _affine(item.to_world, where, "to_world")
        for number, part in enumerate(item.parts):
            if placed_well and _is_known(part, seen):
                continue
            named = f" ({part.name!r})" if part.name else ""
            _part(part, to_world, _Place(f"{where.path}.parts[{number}]", f"{where.name}, part {number}{named}"), seen)
    for index, light in enumerate(scene.lights):
        _light(light, _Place(f"scene.lights[{index}]", f"light {index} ({type(light).__name__})"))
    if scene.fog is not None:
        _fog(scene.fog, _Place("scene.fog", "the fog"))


def _fog(fog: Fog, where: _Place) -> None:
    _positive(fog.extinction_per_m, where, "extinction_per_m")
    _between(fog.albedo, 0.0, 1.0, where, "albedo")
    _between(fog.asymmetry, -_STEEPEST_PHASE, _STEEPEST_PHASE, where, "asymmetry")
    if not -_FARTHEST_M <= fog.bottom_m < fog.top_m <= _FARTHEST_M:
        where.fail("top_m", f"is {fog.top_m:g}; must be above bottom_m, {fog.bottom_m:g}, and both within {_FARTHEST_M:g} m.")


def check_camera(camera: Camera) -> None:
    """Raise FieldError where `camera` cannot make rays: its pose, lens or film is not one.

    Film samples finer than single precision can tell apart are refused too: vertices are rounded to 6e-8 of their distance.
    """
    where = _Place(f"cameras.{camera.name}", f"camera {camera.name!r}")
    pose = _affine(camera.camera_to_world, where, "camera_to_world")
    rotation = pose[:3, :3]
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > _RIGID_TOLERANCE or np.linalg.det(rotation) < 0:
        where.fail("camera_to_world", "is not a rotation and a translation; make it with look_at.")
    lens, film = camera.lens, camera.film
    for name, value in (("focal_length_m", lens.focal_length_m), ("f_number", lens.f_number)):
        _positive(value, where, f"lens.{name}")
    if not lens.focus_distance_m > lens.focal_length_m:
        where.fail("lens.focus_distance_m", f"is {lens.focus_distance_m}; must be > focal_length_m = {lens.focal_length_m}.")
    for name, count in (("rows", film.rows), ("cols", film.cols)):
        if int(count) != count or count < 1:
            where.fail(f"film.{name}", f"is {count}; must be a whole number >= 1.")
    _positive(film.pitch_m, where, "film.pitch_m")
    if film.rows * film.cols > _MOST_SAMPLES:
        where.fail("film", f"has {film.rows} x {film.cols} samples; must be <= {_MOST_SAMPLES} together. Render it in pieces.")
    if camera.tangent_pitch < _FINEST_PIXEL:
        where.fail(
            "film.pitch_m",
            f"makes film samples of {camera.tangent_pitch:.2g} rad; must be >= {_FINEST_PIXEL:g} rad, below which single "
            "precision moves edges by visible parts of a sample. Shorten the lens or move the camera nearer.",
        )


class _Place:
    """Where in the scene a check is: the path of the field and the name a person knows."""

    def __init__(self, path: str, name: str) -> None:
        self.path = path
        self.name = name

    def fail(self, field: str, sentence: str, value: Any = None) -> NoReturn:
        """Raise the FieldError "<name>: <field> <sentence>"."""
        raise FieldError(f"{self.name}: {field} {sentence}", f"{self.path}.{field}", value)


def _positive(value: float, where: _Place, field: str) -> None:
    if not 0 < value < math.inf:
        where.fail(field, f"is {value}; must be > 0 and finite.", float(value))


def _between(value: float, low: float, high: float, where: _Place, field: str) -> None:
    if not low <= value <= high:
        where.fail(field, f"is {value}; must be in [{low:g}, {high:g}].", float(value))


# Transforms and shapes -----------------------------------------------------------------------------------------------


def _affine(matrix: ArrayLike, where: _Place, field: str) -> NDArray[np.float64]:
    given = np.asarray(matrix, dtype=np.float64)
    if given.shape != (4, 4):
        where.fail(field, f"has shape {given.shape}; must be (4, 4).")
    if not np.all(np.isfinite(given)):
        where.fail(field, "holds NaN or Inf; every element must be finite.")
    if np.abs(given[3] - [0, 0, 0, 1]).max() > _RIGID_TOLERANCE:
        where.fail(field, f"has the last row {given[3].tolist()}; must be [0, 0, 0, 1].")
    if np.abs(given[:3, 3]).max() > _FARTHEST_M:
        where.fail(field, f"moves by {np.abs(given[:3, 3]).max():g} m; must be <= {_FARTHEST_M:g} m. Check the unit.")
    return given


def _are_placed_well(objects: tuple[SceneObject, ...]) -> bool:
    """Return whether all transforms are certain to pass the checks of single parts, worked out for all at once.

    False says nothing: then each part is looked at, which names the first that is wrong.
    """
    halves: dict[int, NDArray[np.float64]] = {}
    parts = [(item, part) for item in objects for part in item.parts]
    try:
        to_world = np.array([item.to_world for item, _ in parts], dtype=np.float64)
        to_object = np.array([part.to_object for _, part in parts], dtype=np.float64)
        for _, part in parts:
            if id(part.geometry) not in halves:
                halves[id(part.geometry)] = _half_extent(part.geometry)
        half = np.array([halves[id(part.geometry)] for _, part in parts], dtype=np.float64)
    except (TypeError, ValueError, IndexError):  # arrays of odd shapes or types
        return False
    if any(given.shape[1:] != (4, 4) or not np.isfinite(given).all() for given in (to_world, to_object)):
        return False
    with np.errstate(all="ignore"):  # what is too large becomes infinite, and is left to the other checks
        placed = to_world @ to_object
        if half.shape[1:] != (3,) or not np.isfinite(placed).all():
            return False
        stretches = np.linalg.svd(placed[:, :3, :3], compute_uv=False)
        reach = np.einsum("nij,nj->ni", np.abs(placed[:, :3, :3]), half) + np.abs(placed[:, :3, 3])
    return bool(
        all(np.all(np.abs(given[:, :3, 3]) <= _FARTHEST_M) for given in (to_world, to_object))
        and all(np.all(np.abs(given[:, 3] - [0, 0, 0, 1]) <= _RIGID_TOLERANCE) for given in (to_world, to_object))
        and np.all(stretches[:, -1] >= np.maximum(_SMALLEST_STRETCH, _MOST_UNEQUAL_STRETCH * stretches[:, 0]))
        and np.all(reach <= _FARTHEST_M)
    )


def _is_known(part: Part, seen: set[int]) -> bool:
    """Return whether shape and material were looked at before and the part is no lamp."""
    return part.emission is None and id(part.geometry) in seen and id(part.material) in seen


def _part(part: Part, to_world: NDArray[np.float64] | None, where: _Place, seen: set[int]) -> None:
    """Check a part; without `to_world` its place was found well."""
    if to_world is not None:
        _placed_part(part, to_world, where)
    if id(part.geometry) not in seen:
        _geometry(part.geometry, where)
        seen.add(id(part.geometry))
    if to_world is not None:
        _within_reach(part, to_world, where)
    if id(part.material) not in seen:
        _material(part.material, where)
        seen.add(id(part.material))
    _emission(part, where)


def _placed_part(part: Part, to_world: NDArray[np.float64], where: _Place) -> None:
    placed = to_world @ _affine(part.to_object, where, "to_object")
    stretches = np.linalg.svd(placed[:3, :3], compute_uv=False)
    if stretches[-1] < _SMALLEST_STRETCH or stretches[-1] < _MOST_UNEQUAL_STRETCH * stretches[0]:
        where.fail(
            "to_object",
            f"and the object's to_world are together singular or nearly so: they stretch by {stretches[0]:.3g} one way and "
            f"{stretches[-1]:.3g} another; the ratio must be >= {_MOST_UNEQUAL_STRETCH:g}. Make the shape itself thin instead.",
        )


def _within_reach(part: Part, to_world: NDArray[np.float64], where: _Place) -> None:
    placed = to_world @ part.to_object
    reach = np.abs(placed[:3, :3]) @ _half_extent(part.geometry) + np.abs(placed[:3, 3])
    if reach.max() > _FARTHEST_M:
        where.fail("geometry", f"reaches {reach.max():.3g} m from the origin; must be <= {_FARTHEST_M:g} m. Check the unit.")


def _emission(part: Part, where: _Place) -> None:
    if part.emission is not None:
        _power(part.emission.radiance, where, "emission.radiance")
        if part.emission.pattern is not None:
            _pattern(part.emission.pattern, where)
            largest = max(1.0, float(part.emission.pattern.shares.max()))
            _power(part.emission.radiance.scaled(largest), where, "emission.radiance (times the largest share)")
        if isinstance(part.geometry, Mesh) and may_repeat_faces(part.geometry):
            _one_sided(part.geometry, where)


def _half_extent(geometry: Geometry) -> NDArray[np.float64]:
    """Return the largest |x|, |y|, |z| of the shape in its own coordinates [m]."""
    match geometry:
        case Sphere(radius_m=radius):
            return np.full(3, radius)
        case Rectangle(size_m=(width, height)):
            return np.array([width / 2, height / 2, 0.0])
        case Disk(radius_m=radius):
            return np.array([radius, radius, 0.0])
        case Cube(size_m=size):
            return np.asarray(size, dtype=np.float64) / 2
        case Cylinder(radius_m=radius, height_m=height):
            return np.array([radius, radius, height / 2])
        case Mesh():
            middle, half = box_of(geometry)
            return np.asarray(np.abs(middle) + half)


_sound: weakref.WeakSet[Mesh] = weakref.WeakSet()
"""Meshes that were looked at: those that move are in a scene for each moment of the exposure."""


def _geometry(geometry: Geometry, where: _Place) -> None:
    match geometry:
        case Sphere(radius_m=radius) | Disk(radius_m=radius):
            _positive(radius, where, "geometry.radius_m")
        case Rectangle(size_m=size) | Cube(size_m=size):
            for edge in size:
                _positive(edge, where, "geometry.size_m")
        case Cylinder(radius_m=radius, height_m=height):
            _positive(radius, where, "geometry.radius_m")
            _positive(height, where, "geometry.height_m")
        case Mesh() if geometry not in _sound:
            _mesh(geometry, where)
            _sound.add(geometry)


def _mesh(mesh: Mesh, where: _Place) -> None:
    vertices, faces = mesh.vertices_m, mesh.faces
    _rows_of(vertices, 3, where, "geometry.vertices_m")
    if faces.ndim != 2 or faces.shape[1] != 3 or not np.issubdtype(faces.dtype, np.integer):
        where.fail("geometry.faces", f"has shape {faces.shape} of {faces.dtype}; must be (n, 3) whole numbers.")
    if len(faces) == 0:
        where.fail("geometry.faces", "is empty; a mesh needs at least one triangle. Leave the part out instead.")
    low, high = int(faces.min()), int(faces.max())
    if low < 0 or high >= len(vertices):
        wrong = low if low < 0 else high
        where.fail("geometry.faces", f"names vertex {wrong}; must be in [0, {len(vertices) - 1}].", wrong)
    for name, per_vertex, width in (("normals", mesh.normals, 3), ("uv", mesh.uv, 2)):
        if per_vertex is not None:
            _rows_of(per_vertex, width, where, f"geometry.{name}")
            if len(per_vertex) != len(vertices):
                where.fail(f"geometry.{name}", f"has {len(per_vertex)} rows; must be one per vertex, {len(vertices)}.")
    # A few triangles without area are common in files and do no harm; the first slice nearly always has one with area.
    starts = range(0, len(faces), _FACES_AT_ONCE)
    if not any(np.any(_have_area(vertices, faces[start : start + _FACES_AT_ONCE])) for start in starts):
        where.fail("geometry.faces", "has no triangle with an area: corners coincide or lie on one line. Move the vertices.")


def _rows_of(array: NDArray[Any], width: int, where: _Place, field: str) -> None:
    if array.ndim != 2 or array.shape[1] != width:
        where.fail(field, f"has shape {array.shape}; must be (n, {width}).")
    finite = np.isfinite(array)
    if not finite.all():
        row = int(np.flatnonzero(~finite.all(axis=1))[0])
        where.fail(field, f"[{row}] is {array[row].tolist()}; every number must be finite. Repair the mesh.")


def _have_area(vertices: NDArray[np.float64], faces: NDArray[Any]) -> NDArray[np.bool_]:
    corners = np.asarray(vertices, dtype=np.float64)[faces]
    edges = corners[:, [1, 2, 0]] - corners
    doubled = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return np.asarray(doubled > _DEGENERATE_RELATIVE_AREA * (edges**2).sum(axis=2).max(axis=1))


_COINCIDENCE = 1e-12
_MARK = np.array([0.6180339887498949, 0.4142135623730951, 0.7320508075688772])
"""A direction along which the corners of different triangles of made things do not add up to the same."""


def may_repeat_faces(mesh: Mesh) -> bool:
    """Return whether two triangles may have the same three corners: False is certain, True wants a closer look.

    Cheap, because lamps with many triangles come in rows of hundreds.
    """
    marks = np.asarray(mesh.vertices_m, dtype=np.float64) @ _MARK
    sums = np.sort(marks[mesh.faces].sum(axis=1))
    return bool(np.any(np.diff(sums) <= _COINCIDENCE * np.abs(marks).max()))


def _one_sided(mesh: Mesh, where: _Place) -> None:
    """Refuse a lamp with two coincident triangles that face opposite ways: which of them a ray meets is chance."""
    _, corner = np.unique(mesh.vertices_m, axis=0, return_inverse=True)
    named = corner.reshape(-1)[mesh.faces]
    count = len(named)
    _, group = np.unique(np.concatenate([_smallest_first(named), _smallest_first(named[:, ::-1])]), axis=0, return_inverse=True)
    group = group.reshape(-1)
    whole = (named[:, 0] != named[:, 1]) & (named[:, 1] != named[:, 2]) & (named[:, 2] != named[:, 0])
    facing_away = np.flatnonzero(whole & np.isin(group[:count], group[count:]))
    if facing_away.size:
        where.fail(
            f"geometry.faces[{int(facing_away[0])}]",
            "of a lamp coincides with a triangle that faces the other way; only one can be seen. Move them apart.",
        )


def _smallest_first(faces: NDArray[Any]) -> NDArray[Any]:
    """Turn each triangle, without mirroring it, so that its smallest number stands first."""
    order = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    return np.asarray(np.take_along_axis(faces, order, axis=1))


# Materials and spectra -----------------------------------------------------------------------------------------------


def _material(material: Material, where: _Place) -> None:
    match material:
        case Diffuse() | Mirror():
            _reflectance(material.reflectance, where, "material.reflectance")
        case Translucent():
            _reflectance(material.reflectance, where, "material.reflectance")
            _reflectance(material.transmittance, where, "material.transmittance")
            _sheet(material, where)
        case RoughPlastic():
            _reflectance(material.reflectance, where, "material.reflectance")
            _between(material.roughness, 0, 1, where, "material.roughness")
            _between(material.interior_index, 1, _INDEX_RANGE[1], where, "material.interior_index")
        case Principled():
            _reflectance(material.base_color, where, "material.base_color")
            for name in ("roughness", "metallic", "specular"):
                _between(getattr(material, name), 0, 1, where, f"material.{name}")
        case Conductor():
            for name, table in (("eta", material.eta), ("k", material.k)):
                _between(float(table.values.min()), 0, math.inf, where, f"material.{name}")
            _between(material.roughness, 0, 1, where, "material.roughness")
        case Dielectric():
            inside = material.interior_index
            for value in (inside.values.min(), inside.values.max()) if isinstance(inside, Spectrum) else (inside,):
                _between(value, *_INDEX_RANGE, where, "material.interior_index")
            _between(material.exterior_index, *_INDEX_RANGE, where, "material.exterior_index")
            _between(material.roughness, 0, 1, where, "material.roughness")


def _reflectance(colour: Spectrum | Texture, where: _Place, field: str) -> None:
    if isinstance(colour, Texture):
        shape, dtype = colour.pixels.shape, colour.pixels.dtype
        if len(shape) != 3 or shape[2] != 3 or 0 in shape or dtype != np.uint8:
            where.fail(field, f"is a texture of shape {shape} and type {dtype}; must be (rows, cols, 3) uint8, not empty.")
        return
    low, high = float(colour.values.min()), float(colour.values.max())
    if low < 0 or high > 1 + _ROUNDING:
        wrong = low if low < 0 else high
        where.fail(field, f"is {wrong:g} at some wavelength; must be in [0, 1]. Light would be made from nothing.", wrong)


def _sheet(material: Translucent, where: _Place) -> None:
    """Refuse a sheet that gives more light than it receives: the sum is greatest at a knot of either table."""
    reflectance, transmittance = material.reflectance, material.transmittance
    knots_nm = np.union1d(reflectance.wavelength_nm, transmittance.wavelength_nm)
    total = reflectance.at(knots_nm) + transmittance.at(knots_nm)
    highest = int(np.argmax(total))
    if total[highest] > 1 + _ROUNDING:
        where.fail(
            "material.transmittance",
            f"and material.reflectance sum to {total[highest]:g} at {knots_nm[highest]:g} nm; must be in [0, 1]. "
            "Light would be made from nothing.",
            float(total[highest]),
        )


def _power(spectrum: Spectrum, where: _Place, field: str) -> None:
    low, high = float(spectrum.values.min()), float(spectrum.values.max())
    if low < 0 or high > _LARGEST_RADIANCE:
        wrong = low if low < 0 else high
        where.fail(field, f"is {wrong:g} at some wavelength; must be in [0, {_LARGEST_RADIANCE:g}]. Check its unit.", wrong)
    energy = float(np.trapezoid(spectrum.values, spectrum.wavelength_nm))
    rounded = spectrum.wavelength_nm.astype(np.float32).astype(np.float64)
    if abs(float(np.trapezoid(spectrum.values, rounded)) - energy) > _LINE_TOLERANCE * energy:
        where.fail(
            field,
            "has a line too narrow for single precision, which rounds wavelengths to 6e-5 nm and would change its energy by "
            f"more than {_LINE_TOLERANCE:g}. Make it at least 0.1 nm wide, of the same area.",
        )


# Lights --------------------------------------------------------------------------------------------------------------


def _light(light: Light, where: _Place) -> None:
    match light:
        case PointLight():
            _position(light.position_m, where)
            _power(light.intensity, where, "intensity")
        case SpotLight():
            _position(light.position_m, where)
            _direction(light.direction, where, "direction")
            _power(light.intensity, where, "intensity")
            if not 0 < light.beam_deg < light.cutoff_deg < 90 or light.cutoff_deg < _NARROWEST_CONE_DEG:
                where.fail(
                    "cutoff_deg",
                    f"is {light.cutoff_deg} and beam_deg {light.beam_deg}; must be 0 < beam_deg < cutoff_deg < 90 and "
                    f"cutoff_deg >= {_NARROWEST_CONE_DEG}. Use a directional light for narrower beams.",
                )
        case GoniometricLight():
            _position(light.position_m, where)
            _goniometric(light, where)
        case DirectionalLight():
            _direction(light.direction, where, "direction")
            _power(light.irradiance, where, "irradiance")
        case ConstantEnvironment():
            _power(light.radiance, where, "radiance")
        case ImageEnvironment():
            _environment_image(light, where)
        case SunSky():
            _sun(light, where)


def _goniometric(light: GoniometricLight, where: _Place) -> None:
    forward = _direction(light.forward, where, "forward")
    up = _direction(light.up, where, "up")
    if np.linalg.norm(np.cross(up / np.linalg.norm(up), forward / np.linalg.norm(forward))) < _LEAST_SINE_OF_UP:
        where.fail("up", f"is {up.tolist()}, along forward, {forward.tolist()}; must not be. Turn one of them.")
    _pattern(light.pattern, where)
    _power(light.intensity.scaled(max(1.0, float(light.pattern.shares.max()))), where, "intensity (times the largest share)")


def _pattern(pattern: BeamPattern, where: _Place) -> None:
    if pattern.shares.ndim != 2 or min(pattern.shares.shape) < 2:
        where.fail("pattern", f"has shape {pattern.shares.shape}; must be (rows, cols), at least 2 each.")
    if not np.all(np.isfinite(pattern.shares)) or pattern.shares.min() < 0 or not pattern.shares.max() > 0:
        where.fail("pattern", "holds NaN, Inf or negative values, or only zeros; each must be >= 0 and finite, one > 0.")
    for name, (first, last), limit in (
        ("azimuth_deg", pattern.azimuth_deg, 180.0),
        ("elevation_deg", pattern.elevation_deg, 90.0),
    ):
        if not -limit <= first < last <= limit:
            where.fail(f"pattern.{name}", f"is {first:g} to {last:g}; must go up, within -{limit:g} to {limit:g}.")


_LEAST_SINE_OF_UP = 1e-3
"""Between forward and up of a lamp with a pattern."""


def _position(position_m: ArrayLike, where: _Place) -> None:
    given = np.asarray(position_m, dtype=np.float64)
    if given.shape != (3,) or not np.all(np.abs(given) <= _FARTHEST_M):
        where.fail("position_m", f"is {given.tolist()}; must be three numbers within {_FARTHEST_M:g} m of the origin.")


def _direction(direction: ArrayLike, where: _Place, field: str) -> NDArray[np.float64]:
    given = np.asarray(direction, dtype=np.float64)
    if given.shape != (3,) or not np.all(np.isfinite(given)) or not 1e-100 < np.linalg.norm(given) < math.inf:
        where.fail(field, f"is {given.tolist()}; must be three finite numbers, not all zero.")
    return given


def _environment_image(light: ImageEnvironment, where: _Place) -> None:
    pixels = light.pixels
    if pixels.ndim != 3 or pixels.shape[2] != 3 or 0 in pixels.shape:
        where.fail("pixels", f"has shape {pixels.shape}; must be (rows, cols, 3), not empty.")
    if not np.all(np.isfinite(pixels)) or pixels.min() < 0:
        where.fail("pixels", "holds NaN, Inf or negative values; each must be >= 0 and finite. Repair the image.")
    if not math.isfinite(light.azimuth_deg):
        where.fail("azimuth_deg", f"is {light.azimuth_deg}; must be finite.")
    brightest = float(pixels.max())
    _power(light.radiance.scaled(max(1.0, brightest)), where, "radiance (times the brightest pixel)")


def _sun(light: SunSky, where: _Place) -> None:
    direction = _direction(light.sun_direction, where, "sun_direction")
    if direction[2] < 0:
        where.fail("sun_direction", f"is {direction.tolist()}; its z must be >= 0. The model ends where the sun sets.")
    _between(light.turbidity, 1, 10, where, "turbidity")
    _between(light.ground_albedo, 0, 1, where, "ground_albedo")
    for name in ("sun_weight", "sky_weight"):
        _between(getattr(light, name), 0, _LARGEST_RADIANCE, where, name)
