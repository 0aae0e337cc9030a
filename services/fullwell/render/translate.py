"""A SceneDescription becomes a Mitsuba scene, re-centred on the camera, with each shape traceable to its object."""

from __future__ import annotations

import gc
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, FullwellError, RenderError
from fullwell.radiometry.glasses import index_of_line
from fullwell.radiometry.grid import WavelengthGrid
from fullwell.radiometry.spectrum import Spectrum
from fullwell.render.conditioning import (
    check_glass_thickness,
    check_reach,
    naming,
    power_kept,
    with_whole_normals,
    without_repeated_faces,
)
from fullwell.scene import (
    Conductor,
    ConstantEnvironment,
    Cylinder,
    Dielectric,
    Diffuse,
    DirectionalLight,
    Disk,
    GoniometricLight,
    ImageEnvironment,
    Light,
    Material,
    Mesh,
    Mirror,
    Part,
    PointLight,
    Principled,
    RoughPlastic,
    SceneDescription,
    Sphere,
    SpotLight,
    SunSky,
    Texture,
    Translucent,
)
from fullwell.scene.tessellate import is_similarity, mesh_of, transform_mesh
from fullwell.scene.validate import check_scene, may_repeat_faces

__all__ = ["TranslatedScene", "check_sky_range", "translate"]

_TABLE_LOW_NM = 300.0
_TABLE_HIGH_NM = 1100.0
"""Tables that hold their end values are written out over this range, which contains every wavelength a grid may ask for;
the renderer's own spectra are 0 outside their tables."""

_BLACK = 1e-35
"""Spectra below this are black: single precision would make the renderer's tables zero, which it refuses."""


@dataclass(frozen=True, slots=True, eq=False)
class TranslatedScene:
    """A loaded Mitsuba scene.

    `object_of_shape` maps the renderer's shape ids to indices into ``SceneDescription.objects``; `centre_m` is the world
    point at the renderer's origin (coordinates of 10^6 m would otherwise lose float32 precision).
    """

    scene: Any
    object_of_shape: dict[str, int]
    centre_m: NDArray[np.float64]


_kept: list[tuple[SceneDescription, TranslatedScene]] = []
"""The scene that was loaded last, so that the label pass does not load what the picture has just used."""


def translate(mi: Any, scene: SceneDescription, centre_m: NDArray[np.float64]) -> TranslatedScene:
    """Load `scene` into the active Mitsuba variant with its origin moved to `centre_m` [m].

    The scene that was loaded last is kept and returned again for the same object and centre.

    Raises
    ------
    FieldError
        The scene holds what no renderer can show as it is meant.
    RenderError
        The renderer refused the scene, in its own words.
    """
    for kept_scene, translated in _kept:
        if kept_scene is scene and np.array_equal(translated.centre_m, centre_m):
            return translated
    # The renderer's kernels depend on how many objects are alive: the old scene goes before the new one comes.
    _kept.clear()
    gc.collect()
    loaded = _load(mi, scene, centre_m)
    _kept.append((scene, loaded))
    return loaded


def check_sky_range(scene: SceneDescription, grid: WavelengthGrid) -> None:
    """Raise FieldError where the bands of a scene with a sky go on where the renderer's own sky is black."""
    last_nm = float(grid.edges_nm[-1])
    if last_nm > _SKY_ENDS_NM and any(isinstance(light, SunSky) for light in scene.lights):
        raise FieldError(
            f"the bands go to {last_nm:g} nm, but without LLVM the sky ends at {_SKY_ENDS_NM:g} nm; shorten "
            "spectral.last_nm, or install libLLVM.",
            path="spectral.last_nm",
            value=last_nm,
        )


def _load(mi: Any, scene: SceneDescription, centre_m: NDArray[np.float64]) -> TranslatedScene:
    check_scene(scene)
    check_reach(scene, centre_m)
    recentre = np.eye(4)
    recentre[:3, 3] = -np.asarray(centre_m, dtype=np.float64)
    contents: dict[str, Any] = {"type": "scene"}
    object_of_shape: dict[str, int] = {}
    try:
        materials = _Materials(mi)
        groups = _Groups(mi, materials, scene, contents) if mi.variant().startswith("scalar") else None
        for index, scene_object in enumerate(scene.objects):
            for number, part in enumerate(scene_object.parts):
                shape_id = f"o{index}_{number}"
                to_world = recentre @ scene_object.to_world @ part.to_object
                with naming(scene_object.id, index, number):
                    instance = None if groups is None else groups.instance(part, to_world)
                    contents[shape_id] = instance or _shape(mi, materials, shape_id, part, to_world)
                object_of_shape[shape_id] = index
        for number, light in enumerate(scene.lights):
            if not _is_black(light):
                contents[f"l{number}"] = _emitter(mi, light, recentre)
        loaded = mi.load_dict(contents, optimize=False)
    except FullwellError:
        raise
    except Exception as error:
        cause = error.__cause__ or error
        raise RenderError(f"the renderer refused the scene: {cause}") from error
    return TranslatedScene(loaded, object_of_shape, np.asarray(centre_m, dtype=np.float64))


# Spectra -------------------------------------------------------------------------------------------------------------


def _spectrum(spectrum: Spectrum) -> dict[str, Any]:
    """Write a table out as the renderer's `regular` (equal steps) or `irregular` spectrum, nothing resampled."""
    wavelength_nm, values = spectrum.wavelength_nm, spectrum.values
    if not np.any(values > _BLACK):  # the renderer's tables refuse a legal black
        return {"type": "uniform", "value": 0.0}
    if spectrum.outside == "hold":
        low, high = _TABLE_LOW_NM, _TABLE_HIGH_NM
        if wavelength_nm[0] > low:
            wavelength_nm, values = np.append(low, wavelength_nm), np.append(values[0], values)
        if wavelength_nm[-1] < high:
            wavelength_nm, values = np.append(wavelength_nm, high), np.append(values, values[-1])
    if wavelength_nm.size == 1:  # a line of no width has no energy, but the renderer wants two points
        wavelength_nm, values = np.append(wavelength_nm, wavelength_nm[0] + 1.0), np.zeros(2)
    wavelength_nm, values = _single_precision_table(wavelength_nm, values)
    return {
        "type": "irregular",
        "wavelengths": ", ".join(repr(float(w)) for w in wavelength_nm),
        "values": ", ".join(repr(float(v)) for v in values),
    }


def _single_precision_table(
    wavelength_nm: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the table with wavelengths that still increase in single precision, which rounds them to 6e-5 nm.

    Of knots that become one, the first and the last stay, neighbours: a step stays a step.
    """
    rounded = wavelength_nm.astype(np.float32)
    if np.all(np.diff(rounded) > 0):
        return rounded.astype(np.float64), values
    knots, first, count = np.unique(rounded, return_index=True, return_counts=True)
    following = np.append(knots[1:], np.float32(np.inf))
    step = (count > 1) & (np.nextafter(knots, following) < following)
    positions = np.concatenate([knots, np.nextafter(knots, following)[step]])
    heights = np.concatenate([values[first], values[first + count - 1][step]])
    order = np.argsort(positions, kind="stable")
    return positions[order].astype(np.float64), heights[order]


def _colour(mi: Any, colour: Spectrum | Texture) -> dict[str, Any]:
    if isinstance(colour, Texture):
        pixels = np.ascontiguousarray(colour.pixels[::-1])  # the renderer has row 0 at v = 0
        return {"type": "bitmap", "bitmap": mi.Bitmap(pixels), "raw": False}
    return _spectrum(colour)


# Materials -----------------------------------------------------------------------------------------------------------


class _Materials:
    """Makes each material object once: parts that share a material share the renderer's BSDF."""

    def __init__(self, mi: Any) -> None:
        self._mi = mi
        self._made: dict[int, tuple[Material, Any]] = {}

    def get(self, material: Material) -> Any:
        known = self._made.get(id(material))
        if known is None:
            known = (material, self._mi.load_dict(_bsdf(self._mi, material)))
            self._made[id(material)] = known
        return known[1]


def _two_sided(bsdf: dict[str, Any]) -> dict[str, Any]:
    return {"type": "twosided", "inner": bsdf}


def _bsdf(mi: Any, material: Material) -> dict[str, Any]:
    match material:
        case Diffuse(reflectance=reflectance) | Translucent(reflectance=reflectance):  # see ScalarImage
            return _two_sided({"type": "diffuse", "reflectance": _colour(mi, reflectance)})
        case RoughPlastic():
            return _two_sided(
                {
                    "type": "roughplastic",
                    "diffuse_reflectance": _colour(mi, material.reflectance),
                    "alpha": max(_MIN_ALPHA, float(material.roughness)),
                    "int_ior": float(material.interior_index),
                    "distribution": "ggx",
                    "nonlinear": True,
                }
            )
        case Principled():
            return _two_sided(_principled(mi, material))
        case Conductor():
            bsdf: dict[str, Any] = {"type": "conductor", "eta": _spectrum(material.eta), "k": _spectrum(material.k)}
            if material.roughness >= _MIN_ALPHA:
                bsdf |= {"type": "roughconductor", "alpha": float(material.roughness), "distribution": "ggx"}
            return _two_sided(bsdf)
        case Mirror():
            return _two_sided(
                {"type": "conductor", "material": "none", "specular_reflectance": _spectrum(material.reflectance)}
            )
        case Dielectric(interior_index=inside):
            interior_index = index_of_line(inside) if isinstance(inside, Spectrum) else inside
            glass: dict[str, Any] = {
                "type": "dielectric",
                "int_ior": interior_index,
                "ext_ior": material.exterior_index,
            }
            # Without a step of the index there is nothing to scatter at, and the renderer's rough model refuses it.
            if material.roughness >= _MIN_ALPHA and interior_index != material.exterior_index:
                glass |= {"type": "roughdielectric", "alpha": float(material.roughness), "distribution": "ggx"}
            return glass


_MIN_ALPHA = 1e-3
"""Roughness below which the renderer's microfacet distribution loses precision; it looks polished."""


def _principled(mi: Any, material: Principled) -> dict[str, Any]:
    """Return metallic-roughness as a coated diffuse base and a tinted metal, mixed by `metallic`.

    The renderer's own `principled` reflects up to 5 % more light than it receives (white furnace); these two do not.
    """
    alpha = max(_MIN_ALPHA, float(material.roughness) ** 2)
    # specular 0.5 is the 4 % of an index of 1.5: F0 = 0.08 * specular.
    f0 = np.sqrt(0.08 * float(material.specular))
    base: dict[str, Any] = {
        "type": "roughplastic",
        "diffuse_reflectance": _colour(mi, material.base_color),
        "alpha": alpha,
        "int_ior": float(max(1.001, (1 + f0) / (1 - f0))),
        "ext_ior": 1.0,
        "distribution": "ggx",
        "nonlinear": True,
    }
    metal: dict[str, Any] = {
        "type": "roughconductor",
        "material": "none",
        "specular_reflectance": _colour(mi, material.base_color),
        "alpha": alpha,
        "distribution": "ggx",
    }
    if material.metallic <= 0:
        return base
    if material.metallic >= 1:
        return metal
    return {"type": "blendbsdf", "weight": float(material.metallic), "base": base, "metal": metal}


# Shapes --------------------------------------------------------------------------------------------------------------


def _shape(mi: Any, materials: _Materials, shape_id: str, part: Part, to_world: NDArray[np.float64]) -> Any:
    bsdf = materials.get(part.material)
    emission = None
    if part.emission is not None and np.any(part.emission.radiance.values > _BLACK):
        if part.emission.pattern is not None:
            raise _no_patterns()
        emission = {"type": "area", "radiance": _spectrum(part.emission.radiance)}
    native = _native_shape(mi, part, to_world)
    if native is None:
        local = mesh_of(part.geometry)
        if part.emission is not None and may_repeat_faces(local):
            local = without_repeated_faces(local)
        mesh = with_whole_normals(transform_mesh(to_world, local))
        if emission is not None and part.emission is not None:
            emission["radiance"] = _spectrum(power_kept(mesh, part.emission.radiance))
        if isinstance(part.material, Dielectric):
            check_glass_thickness(mesh)
        return _mesh_shape(mi, shape_id, mesh, bsdf, emission)
    native["bsdf"] = bsdf
    if emission is not None:
        native["emitter"] = emission
    return native


def _native_shape(mi: Any, part: Part, to_world: NDArray[np.float64]) -> dict[str, Any] | None:
    """Return the curved primitives as the renderer's exact ones; None where triangles must do (planes, odd scales)."""
    if not is_similarity(to_world):
        return None
    match part.geometry:
        case Sphere(radius_m=radius):
            placed = to_world @ np.diag([radius, radius, radius, 1.0])
            return {"type": "sphere", "to_world": _transform(mi, placed)}
        case Disk(radius_m=radius):
            placed = to_world @ np.diag([radius, radius, radius, 1.0])
            return {"type": "disk", "to_world": _transform(mi, placed)}
        case Cylinder(radius_m=radius, height_m=height):
            return {
                "type": "cylinder",
                "p0": [0.0, 0.0, -height / 2],
                "p1": [0.0, 0.0, height / 2],
                "radius": float(radius),
                "to_world": _transform(mi, to_world),
            }
        case _:
            return None


def _transform(mi: Any, matrix: NDArray[np.float64]) -> Any:
    return mi.ScalarTransform4f(matrix)


def _mesh_shape(mi: Any, shape_id: str, mesh: Mesh, bsdf: Any, emission: dict[str, Any] | None) -> Any:
    properties = mi.Properties()
    properties["bsdf"] = bsdf
    if emission is not None:
        properties["emitter"] = mi.load_dict(emission)
    shape = mi.Mesh(shape_id, len(mesh.vertices_m), len(mesh.faces), properties, mesh.normals is not None, mesh.uv is not None)
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = np.ascontiguousarray(mesh.vertices_m, dtype=np.float32).ravel()
    parameters["faces"] = np.ascontiguousarray(mesh.faces, dtype=np.uint32).ravel()
    if mesh.normals is not None:
        parameters["vertex_normals"] = np.ascontiguousarray(mesh.normals, dtype=np.float32).ravel()
    if mesh.uv is not None:
        parameters["vertex_texcoords"] = np.ascontiguousarray(mesh.uv, dtype=np.float32).ravel()
    parameters.update()
    return shape


# Instances -----------------------------------------------------------------------------------------------------------

_WORTH_SHARING = 20_000
"""Triangles that copies of a mesh would add before it is loaded once and placed by transforms.

Measured with the scalar renderer: 64 copies of 20,480 triangles load in 0.2 s instead of 3.0 s and trace as fast; with 20,000
triangles in all there is no difference."""


class _Groups:
    """Meshes that many parts share, loaded once: for the scalar renderer, which traces instances as fast as copies."""

    def __init__(self, mi: Any, materials: _Materials, scene: SceneDescription, contents: dict[str, Any]) -> None:
        """Prepare for a scene; the shared meshes go to `contents`, before the instances that refer to them."""
        self._mi, self._materials, self._contents = mi, materials, contents
        self._uses: Counter[tuple[int, int]] = Counter(
            _group_key(part) for item in scene.objects for part in item.parts if isinstance(part.geometry, Mesh)
        )
        self._made: dict[tuple[int, int], str] = {}

    def instance(self, part: Part, to_world: NDArray[np.float64]) -> dict[str, Any] | None:
        """Return the part as an instance of its mesh; None where a copy serves better, and for lamps and glass."""
        if not isinstance(part.geometry, Mesh) or part.emission is not None or isinstance(part.material, Dielectric):
            return None
        key = _group_key(part)
        if (self._uses[key] - 1) * len(part.geometry.faces) < _WORTH_SHARING:
            return None
        if key not in self._made:
            mesh = with_whole_normals(part.geometry)
            name = f"group{len(self._made)}"
            shape = _mesh_shape(self._mi, f"mesh_of_{name}", mesh, self._materials.get(part.material), None)
            self._contents[name] = {"type": "shapegroup", "shape": shape}
            self._made[key] = name
        return {
            "type": "instance",
            "to_world": _transform(self._mi, to_world),
            "group": {"type": "ref", "id": self._made[key]},
        }


def _group_key(part: Part) -> tuple[int, int]:
    return id(part.geometry), id(part.material)


# Lights --------------------------------------------------------------------------------------------------------------


_SKY_ENDS_NM = 720.0

_LOWEST_SUN_SINE = 1e-5
"""The renderer's sky is black for a sun exactly on the horizon; here it is 2 arc seconds above."""


def _is_black(light: Light) -> bool:
    """Return whether the light is an image without light, which the renderer cannot sample."""
    return isinstance(light, ImageEnvironment) and not np.any(light.pixels * np.max(light.radiance.values) > _BLACK)


def _emitter(mi: Any, light: Light, recentre: NDArray[np.float64]) -> dict[str, Any]:
    match light:
        case PointLight():
            position = (recentre @ np.append(light.position_m, 1.0))[:3]
            return {"type": "point", "position": position.tolist(), "intensity": _spectrum(light.intensity)}
        case SpotLight():
            position = (recentre @ np.append(light.position_m, 1.0))[:3]
            return {
                "type": "spot",
                "to_world": _transform(mi, _frame_along(position, np.asarray(light.direction))),
                "intensity": _spectrum(light.intensity),
                "cutoff_angle": float(light.cutoff_deg),
                "beam_width": float(light.beam_deg),
            }
        case GoniometricLight():
            raise _no_patterns()
        case DirectionalLight():
            return {
                "type": "directional",
                "direction": [float(x) for x in light.direction],
                "irradiance": _spectrum(light.irradiance),
            }
        case ConstantEnvironment():
            return {"type": "constant", "radiance": _spectrum(light.radiance)}
        case ImageEnvironment():
            return _image_environment(mi, light)
        case SunSky():
            x, y, z = np.asarray(light.sun_direction, dtype=np.float64) / np.linalg.norm(light.sun_direction)
            return {
                "type": "sunsky",
                "sun_direction": [float(x), float(y), max(_LOWEST_SUN_SINE, float(z))],
                "turbidity": float(light.turbidity),
                "albedo": float(light.ground_albedo),
                "sun_scale": float(light.sun_weight),
                "sky_scale": float(light.sky_weight),
            }


def _no_patterns() -> FieldError:
    return FieldError(
        "lamps with a beam pattern, as headlamps and street lights have, need the compiled renderer; leave them out "
        "(lamps: day) or install libLLVM.",
        path="scene.lights",
    )


def _frame_along(position_m: NDArray[np.float64], direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rigid transform that takes +z at the origin to `direction` at `position_m`."""
    axis = direction / np.linalg.norm(direction)
    helper = np.array([1.0, 0, 0]) if abs(axis[0]) < 0.9 else np.array([0, 1.0, 0])
    side = np.cross(helper, axis)
    side /= np.linalg.norm(side)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2], frame[:3, 3] = side, np.cross(axis, side), axis, position_m
    return frame


_D65_TABLE_MEAN = 98.99741751876255
"""The renderer divides its D65 table (100 at 560 nm) by this."""

_D65_TOLERANCE = 0.01
"""Relative departure from D65's shape that an image environment's spectrum may have."""


def _image_environment(mi: Any, light: ImageEnvironment) -> dict[str, Any]:
    """Return the renderer's environment map: pixel colours are upsampled as reflectances under D65."""
    from fullwell.radiometry.illuminants import illuminant  # noqa: PLC0415

    probe_nm = np.linspace(400.0, 700.0, 31)
    wanted, d65 = light.radiance.at(probe_nm), illuminant("D65").at(probe_nm)
    scale = float(light.radiance.at(560.0)) / 100.0
    if np.max(np.abs(wanted - scale * d65)) > _D65_TOLERANCE * scale * 100.0:
        raise FieldError(
            "the spectrum of an image environment differs from D65; the renderer colours environment images under D65 only. "
            "Give its luminance and leave the spectrum out.",
            path="scene.lights",
        )
    upright = mi.ScalarTransform4f().rotate([0, 0, 1], 90.0 + float(light.azimuth_deg)).rotate([1, 0, 0], 90.0)
    return {
        "type": "envmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(light.pixels, dtype=np.float32)),
        "scale": scale * _D65_TABLE_MEAN,
        "to_world": upright,
    }
