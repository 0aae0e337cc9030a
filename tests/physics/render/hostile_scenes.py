"""Scenes that break renderers, each with what must come of it: one clear refusal, a closed form, or a benign twin's image.

`python hostile_scenes.py ID...` runs cases one after the other; tests do so in a child process where one may kill the process.
`python hostile_scenes.py --page` writes the tables of docs/validation/stability.md anew.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from test_analytic_scenes import ANALYTIC_TOLERANCE, ONE, camera, radiance_w, thing

from fullwell.core.errors import FieldError, FullwellError
from fullwell.radiometry import Spectrum, WavelengthGrid, illuminant, scale_to_luminance
from fullwell.radiometry.glasses import glass
from fullwell.scene import (
    Camera,
    Conductor,
    ConstantEnvironment,
    Cube,
    Cylinder,
    Dielectric,
    Diffuse,
    DirectionalLight,
    Disk,
    Emission,
    Film,
    Fog,
    Geometry,
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
from fullwell.scene.tessellate import mesh_of

SPLIT_TOLERANCE = 1e-2
"""Four standard errors of the difference of two images whose lamps are sampled by different random numbers."""

SLOPE_TOLERANCE = 3e-3
"""Rays start 7 mm off a slope of 10 km, whose corners have large coordinates along its normal: so much of the shadow of a box
of 10 cm is lost."""

PAGE = Path(__file__).resolve().parents[3] / "docs" / "validation" / "stability.md"

constant = Spectrum.constant
GREY, WHITE, BLACK = Diffuse(constant(0.5)), Diffuse(constant(1.0)), Diffuse(constant(0.0))
DOME = (ConstantEnvironment(ONE),)
SUN = (DirectionalLight((-1.0, -0.5, -1.0), ONE),)
QUAD = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
QUAD_FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)
DAYLIGHT = scale_to_luminance(illuminant("D65"), 1000.0)
ONE_BAND = WavelengthGrid(550.0, 550.0, 10.0)


@dataclass(frozen=True, eq=False)
class Shot:
    """A scene, a camera and what the renderer is asked for."""

    objects: tuple[SceneObject, ...] = ()
    lights: tuple[Light, ...] = ()
    view: Camera | None = None
    spp: int = 64
    depth: int = 8
    grid: WavelengthGrid = ONE_BAND
    fog: Fog | None = None

    def scene(self) -> SceneDescription:
        """Return what is before the camera."""
        return SceneDescription(self.objects, self.lights, fog=self.fog)

    def image(self) -> np.ndarray:
        """Return the band radiances [W sr^-1 m^-2 nm^-1]."""
        view = self.view or camera(rows=12, cols=16, hfov_deg=5)
        return radiance_w(self.scene(), view, spp=self.spp, depth=self.depth, grid=self.grid)


@dataclass(frozen=True, eq=False)
class Hostile:
    """A case: exactly one of `refused` (words of the error), `level` (mean radiance), `most` (bound) and `twin` is given, the
    last with words for what it is."""

    id: str
    shot: Callable[[], Shot]
    refused: tuple[str, ...] = ()
    level: float | None = None
    most: float | None = None
    twin: Callable[[], Shot] | None = None
    like: str = ""
    tolerance: float = ANALYTIC_TOLERANCE
    may_kill: bool = False


def check(case: Hostile) -> None:
    """Raise AssertionError where the case does not end as it must."""
    if case.refused:
        with pytest.raises(FieldError) as refusal:
            case.shot().image()
        error = refusal.value
        assert error.path, error.message
        for word in case.refused:
            assert word in error.message, error.message
        return
    image = case.shot().image()
    assert np.all(np.isfinite(image))
    assert image.min() >= 0.0
    if case.twin is not None:
        benign = case.twin().image()
        assert benign.mean() > 0
        assert image.mean() == pytest.approx(benign.mean(), rel=case.tolerance)
    elif case.most is not None:
        assert image.mean() <= case.most * (1 + case.tolerance)
    else:
        assert case.level is not None
        assert image.mean() == pytest.approx(case.level, rel=case.tolerance)


# Pieces --------------------------------------------------------------------------------------------------------------


def shifted(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    """Return the transform that moves."""
    to_world = np.eye(4)
    to_world[:3, 3] = [x, y, z]
    return to_world


def turned(angle_deg: float) -> np.ndarray:
    """Return the transform that turns about x."""
    sine, cosine = np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg))
    to_world = np.eye(4)
    to_world[1:3, 1:3] = [[cosine, -sine], [sine, cosine]]
    return to_world


def made(geometry: Geometry, material: Material = GREY, to_world: np.ndarray | None = None, name: str = "thing") -> SceneObject:
    """Return an object of one part."""
    return SceneObject(name, "", (Part(geometry, material),), np.eye(4) if to_world is None else to_world)


def quad(vertices=QUAD, faces=QUAD_FACES, **per_vertex) -> Mesh:
    """Return a mesh, by default a square of 2 m."""
    return Mesh(np.asarray(vertices, dtype=float), np.asarray(faces), **per_vertex)


def with_vertex(value: float) -> Mesh:
    """Return the square with one coordinate of its third vertex replaced."""
    vertices = QUAD.copy()
    vertices[2, 1] = value
    return quad(vertices)


def ground(material: Material = GREY) -> SceneObject:
    """Return a plane of 100 m."""
    return made(Rectangle((100.0, 100.0)), material, name="ground")


def lamp(geometry: Geometry, radiance: Spectrum = ONE, *, height_m: float = 2.0) -> SceneObject:
    """Return a lamp that shines down from `height_m`."""
    part = Part(geometry, BLACK, np.diag([1.0, -1.0, -1.0, 1.0]), Emission(radiance))
    return SceneObject("lamp", "", (part,), shifted(z=height_m))


SIDE = camera(origin=(3, 0, 1), target=(0.5, 0, 0), rows=12, cols=16, hfov_deg=5)
"""A view of the ground beside a lamp."""

POINT = camera(origin=(1e-3, 0, 5), target=(1e-3, 0, 0), rows=1, cols=1, hfov_deg=1e-3)
"""A view of the ground's origin."""


def under(geometry: Geometry, **more) -> Shot:
    """Return a grey shape under the dome."""
    return Shot((made(geometry, **more),), DOME)


def of(material: Material, **more) -> Shot:
    """Return a ball of a material in a white furnace."""
    return Shot(
        (made(Sphere(1.0), material),), DOME, camera(rows=12, cols=16, hfov_deg=15), **({"depth": 64, "spp": 256} | more)
    )


def lit(*lights: Light, view: Camera = POINT, **more) -> Shot:
    """Return the grey ground under lights."""
    return Shot((ground(),), lights, view, **more)


def lit_by(*lamps: SceneObject, **more) -> Shot:
    """Return the grey ground beside lamps with a surface."""
    return Shot((ground(), *lamps), (), SIDE, **more)


def seen(radiance: Spectrum, **more) -> Shot:
    """Return a lamp that fills the view."""
    return Shot((thing(Rectangle((10, 10)), 0.0, emission=Emission(radiance)),), **more)


def box(reflectance: float, depth: int, spp: int = 256) -> Shot:
    """Return the inside of a closed box of radiance 1."""
    outward = mesh_of(Cube((4, 4, 4)))
    inward = thing(Mesh(outward.vertices_m, outward.faces[:, ::-1]), reflectance, emission=Emission(ONE))
    return Shot((inward,), (), camera(origin=(0, 0.2, 0), target=(1, 0, 0.3), rows=12, cols=16), spp=spp, depth=depth)


def furnished_box() -> Shot:
    """Return a closed grey furnace that holds what takes no light."""
    outward = mesh_of(Cube((4, 4, 4)))
    inward = thing(Mesh(outward.vertices_m, outward.faces[:, ::-1]), 0.5, emission=Emission(ONE))
    lossless = (WHITE, Mirror(constant(1.0)), Dielectric(1.5, 1.0))
    balls = [made(Sphere(0.5), kind, shifted(1.2, y), f"ball{y}") for kind, y in zip(lossless, (-1.0, 0.0, 1.0), strict=True)]
    view = camera(origin=(-1, 0.2, 0), target=(1, 0, 0), rows=24, cols=32, hfov_deg=70)
    return Shot((inward, *balls), (), view, spp=1024, depth=128)


LAMPS = {"square": Rectangle((10.0, 10.0)), "disk": Disk(5.0), "ball": Sphere(5.0), "cylinder": Cylinder(5.0, 10.0)}


def low_lamp(kind: str, distance_m: float) -> Shot:
    """Return the ground 0.3 m beside a lamp of 10 m that hangs 1 m above it, seen from afar."""
    above_m = 1.0 if kind in {"square", "disk"} else 6.0
    turn = np.eye(4) if kind != "cylinder" else turned(90)
    shines = replace(lamp(LAMPS[kind], height_m=above_m), to_world=shifted(z=above_m) @ turn)
    view = camera(
        origin=(5.3 + 0.1 * distance_m, 0, distance_m),
        target=(5.3, 0, 0),
        rows=12,
        cols=16,
        hfov_deg=np.degrees(0.5 / distance_m),
    )
    return Shot((ground(), shines), (), view, spp=4096)


def covered(kind: str, height_m: float, gap_m: float) -> Shot:
    """Return the ground below a lamp with a black sheet close before it."""
    radius_m = 0.0 if kind in {"square", "disk"} else 5.0
    turn = np.eye(4) if kind != "cylinder" else turned(90)
    shines = replace(lamp(LAMPS[kind]), to_world=shifted(z=height_m + radius_m) @ turn)
    sheet = made(Rectangle((400.0, 400.0)), BLACK, shifted(z=height_m - gap_m), "sheet")
    return Shot((ground(), shines, sheet), (), SIDE, spp=256)


def small_lamp(size_m: float) -> SceneObject:
    """Return a square lamp of 1 W sr^-1 nm^-1 straight down, whatever its size."""
    return lamp(Rectangle((size_m, size_m)), constant(size_m**-2))


def scaled(size: float, shape: Geometry | None = None) -> Shot:
    """Return a box, its ground, a lamp and the camera, all `size` times as large."""
    objects = (
        made(shape or Cube((size, size, size))),
        made(Rectangle((20 * size, 20 * size)), to_world=shifted(z=-0.5 * size), name="ground"),
    )
    light = PointLight((size, 2 * size, 3 * size), constant(size**2))
    origin = (2 * size, size, 3 * size)
    return Shot(objects, (light,), camera(origin=origin, rows=12, cols=16, hfov_deg=30), spp=256)


def environment(pixels: np.ndarray) -> Shot:
    """Return the grey ground under an image."""
    return lit(ImageEnvironment(np.asarray(pixels, dtype=np.float32), DAYLIGHT), spp=1024)


def behind(*glass: SceneObject) -> Shot:
    """Return a chequer of grey and light seen through glass."""
    back = made(Rectangle((1.0, 40.0)), BLACK, shifted(z=-3.0), "bar")
    wall = SceneObject("wall", "", (Part(Rectangle((40.0, 40.0)), BLACK, emission=Emission(ONE)),), shifted(z=-4.0))
    return Shot((wall, back, *glass), (), camera(rows=12, cols=16, hfov_deg=20), spp=256, depth=32)


def pane(thickness_m: float, distance_m: float = 5.0, tilt_deg: float = 0.0) -> Shot:
    """Return light seen through a pane of 10 times its distance from the camera."""
    tilted = turned(tilt_deg)
    size = 10 * distance_m
    back = Part(Rectangle((10 * size, 10 * size)), BLACK, emission=Emission(ONE))
    wall = SceneObject("wall", "", (back,), shifted(z=-2 * size))
    glass = made(Cube((size, size, thickness_m)), Dielectric(1.5, 1.0), tilted)
    view = camera(origin=(0, 0, distance_m), rows=12, cols=16, hfov_deg=0.5)
    return Shot((wall, glass), (), view, spp=1024, depth=64)


def water() -> Shot:
    """Return light that water of one surface with the least of waves, and a white bottom, send back whole."""
    waves = Mesh(30 * QUAD + [[0, 0, 1e-4], [0, 0, 0], [0, 0, -1e-4], [0, 0, 0]], QUAD_FACES)
    objects = (made(waves, Dielectric(1.33, 1.0)), made(Rectangle((60, 60)), WHITE, shifted(z=-0.5), "bottom"))
    return Shot(objects, DOME, camera(origin=(0, 0, 100), rows=12, cols=16, hfov_deg=5), spp=1024, depth=512)


def split_lamp(columns: int, rows: int) -> tuple[SceneObject, ...]:
    """Return a lamp of 1 m cut into tiles, each an object."""
    x, y = (np.arange(columns) + 0.5) / columns - 0.5, (np.arange(rows) + 0.5) / rows - 0.5
    tile = Rectangle((1 / columns, 1 / rows))
    part = Part(tile, BLACK, np.diag([1.0, -1.0, -1.0, 1.0]), Emission(ONE))
    return tuple(SceneObject(f"lamp{i}-{j}", "", (part,), shifted(a, b, 2.0)) for i, a in enumerate(x) for j, b in enumerate(y))


def posed(view: Camera, value: float) -> Camera:
    """Return the camera with one coordinate of its position replaced."""
    pose = view.camera_to_world.copy()
    pose[0, 3] = value
    return replace(view, camera_to_world=pose)


def thin_line(width_nm: float) -> Spectrum:
    """Return a triangular line."""
    return Spectrum([550 - width_nm / 2, 550, 550 + width_nm / 2], [0.0, 4.0, 0.0], outside="zero")


def line_band_nm(width_nm: float) -> float:
    """Return the width of the band about a line."""
    return max(1.0, 2 * width_nm)


def line(width_nm: float) -> Shot:
    """Return a lamp with one triangular line of peak 4, in a band twice as wide but no narrower than recipes allow."""
    band = WavelengthGrid(550.0, 550.0, line_band_nm(width_nm))
    return seen(thin_line(width_nm), view=camera(rows=48, cols=64, hfov_deg=5), spp=256, grid=band)


def step(width_nm: float) -> Shot:
    """Return a lamp whose radiance falls from 1 to 0 within `width_nm`."""
    return seen(Spectrum([300.0, 550.0, 550.0 + width_nm, 900.0], [1.0, 1.0, 0.0, 0.0]), spp=1024)


def lambert(intensity: float, distance_m: float) -> float:
    """Return the radiance of the grey ground right below a point light."""
    return 0.5 / np.pi * intensity / distance_m**2


FLATTENED = np.diag([1.0, 0.0, 1.0, 1.0])
PROJECTIVE = np.eye(4)
PROJECTIVE[3, 0] = 0.5
MIRRORED = np.diag([-1.0, 1.0, 1.0, 1.0])
DEGENERATE = np.vstack([QUAD_FACES, [[0, 1, 1], [2, 2, 2]]]).astype(np.uint32)
TEXEL = np.full((1, 1, 3), 255, dtype=np.uint8)
THING = "object 'thing', part 0"


# Refused -------------------------------------------------------------------------------------------------------------

_NEGATIVE = quad(faces=QUAD_FACES.astype(np.int64) - 1)
_BOTH_WAYS = quad(faces=np.vstack([QUAD_FACES, QUAD_FACES[:, ::-1]]))
_SHAPES = [
    Hostile("NaN vertex", lambda: under(with_vertex(np.nan)), (THING, "vertices_m", "[2]", "finite")),
    Hostile("infinite vertex", lambda: under(with_vertex(np.inf)), (THING, "vertices_m", "finite")),
    Hostile("vertex index too large", lambda: under(quad(QUAD[:3])), (THING, "vertex 3", "[0, 2]"), may_kill=True),
    Hostile("negative vertex index", lambda: under(_NEGATIVE), (THING, "vertex -1"), may_kill=True),
    Hostile("vertex indices that are not whole", lambda: under(quad(faces=QUAD_FACES * 1.0)), (THING, "whole")),
    Hostile("mesh without triangles", lambda: under(quad(faces=QUAD_FACES[:0])), (THING, "empty"), may_kill=True),
    Hostile("mesh of degenerate triangles", lambda: under(quad(faces=DEGENERATE[2:])), (THING, "no triangle with an area")),
    Hostile("NaN normals", lambda: under(quad(normals=np.full((4, 3), np.nan))), (THING, "normals", "finite")),
    Hostile("too few normals", lambda: under(quad(normals=np.ones((2, 3)))), (THING, "one per vertex"), may_kill=True),
    Hostile("infinite texture coordinates", lambda: under(quad(uv=np.full((4, 2), np.inf))), (THING, "uv", "finite")),
    Hostile("sphere of radius 0", lambda: under(Sphere(0.0)), (THING, "radius_m is 0.0", "> 0")),
    Hostile("sphere of radius NaN", lambda: under(Sphere(np.nan)), (THING, "radius_m", "finite")),
    Hostile("rectangle of negative width", lambda: under(Rectangle((-1.0, 1.0))), (THING, "size_m is -1.0")),
    Hostile("infinite cylinder", lambda: under(Cylinder(1.0, np.inf)), (THING, "height_m", "finite")),
    Hostile("singular transform", lambda: under(Rectangle(), to_world=FLATTENED), (THING, "singular")),
    Hostile("singular transform of a sphere", lambda: under(Sphere(), to_world=np.zeros((4, 4)) + FLATTENED), ("singular",)),
    Hostile("NaN transform", lambda: under(Cube(), to_world=np.eye(4) * np.nan), ("object 'thing'", "to_world", "finite")),
    Hostile("projective transform", lambda: under(Cube(), to_world=PROJECTIVE), ("to_world", "[0, 0, 0, 1]")),
    Hostile("3 x 3 transform", lambda: under(Cube(), to_world=np.eye(3)), ("to_world", "(4, 4)")),
    Hostile("object at 1e9 m", lambda: under(Cube(), to_world=shifted(1e9)), ("to_world", "Check the unit")),
    Hostile("shape of 1e12 m", lambda: under(Sphere(1e12)), (THING, "Check the unit")),
    Hostile("object without parts", lambda: Shot((SceneObject("thing", "", ()),), DOME), ("object 'thing'", "at least one")),
    Hostile("lamp that faces both ways", lambda: lit_by(lamp(_BOTH_WAYS)), ("object 'lamp', part 0", "faces[0]", "other way")),
    Hostile("lamp of no area", lambda: lit_by(lamp(quad(faces=DEGENERATE[2:]))), ("object 'lamp', part 0", "area")),
    Hostile(
        "millimetre lamp 100 km away",
        lambda: lit_by(replace(lamp(Cube((2e-3,) * 3)), to_world=shifted(3e4, 0, 1e5))),
        ("object 'lamp', part 0", "single precision"),
    ),
    Hostile(
        "glass pane of 5 micrometres, 4 m away",
        lambda: behind(made(Cube((30, 30, 5e-6)), Dielectric(1.5, 1.0), shifted(z=1))),
        (THING, "glass", "must be >= 7.5e-06 m"),
    ),
    Hostile("scene of 10 nm", lambda: scaled(1e-8), ("must reach", "Scale")),
]

_MATERIALS = [
    Hostile("reflectance 1.5", lambda: of(Diffuse(constant(1.5))), (THING, "reflectance is 1.5", "[0, 1]")),
    Hostile("negative reflectance", lambda: of(Diffuse(constant(-0.5))), (THING, "reflectance is -0.5", "[0, 1]")),
    Hostile(
        "transmittance -0.1", lambda: of(Translucent(constant(0.5), constant(-0.1))), (THING, "transmittance is -0.1", "[0, 1]")
    ),
    Hostile(
        "sheet that makes light",
        lambda: of(Translucent(constant(0.6), constant(0.5))),
        (THING, "material.transmittance and material.reflectance sum to 1.1", "[0, 1]"),
    ),
    Hostile("mirror of reflectance 2", lambda: of(Mirror(constant(2.0))), (THING, "reflectance is 2")),
    Hostile("base colour 1.01", lambda: of(Principled(constant(1.01))), (THING, "base_color is 1.01")),
    Hostile("roughness 2", lambda: of(RoughPlastic(constant(0.5), 2.0)), (THING, "roughness is 2.0", "[0, 1]")),
    Hostile("roughness NaN", lambda: of(Dielectric(roughness=np.nan)), (THING, "roughness is nan")),
    Hostile("index 0", lambda: of(Dielectric(0.0)), (THING, "interior_index is 0.0"), may_kill=True),
    Hostile("index NaN", lambda: of(Dielectric(1.5, np.nan)), (THING, "exterior_index is nan")),
    Hostile("negative extinction", lambda: of(Conductor(constant(1.0), constant(-1.0))), (THING, "k is -1.0")),
    Hostile("texture without pixels", lambda: of(Diffuse(Texture(TEXEL[:0]))), (THING, "texture", "empty"), may_kill=True),
    Hostile("texture of floats", lambda: of(Diffuse(Texture(TEXEL / 255.0))), (THING, "uint8")),  # type: ignore[arg-type]
]

_LIGHTS = [
    Hostile("negative radiance", lambda: seen(constant(-1.0)), (THING, "emission.radiance is -1")),
    Hostile("radiance 1e20", lambda: seen(constant(1e20)), (THING, "emission.radiance is 1e+20", "Check its unit")),
    Hostile("line of 1e-5 nm", lambda: seen(thin_line(1e-5)), (THING, "too narrow", "0.1 nm")),
    Hostile("point light at NaN", lambda: lit(PointLight((0, np.nan, 2), ONE)), ("light 0 (PointLight)", "position_m")),
    Hostile("spot light with no direction", lambda: lit(SpotLight((0, 0, 2), (0, 0, 0), ONE, 5, 9)), ("light 0", "all zero")),
    Hostile("spot beam wider than its cone", lambda: lit(SpotLight((0, 0, 2), (0, 0, -1), ONE, 9, 5)), ("light 0", "beam_deg")),
    Hostile(
        "spot cone of 0.01 degrees", lambda: lit(SpotLight((0, 0, 2), (0, 0, -1), ONE, 5e-3, 1e-2)), ("cutoff_deg >= 0.2",)
    ),
    Hostile("sun lamp without direction", lambda: lit(DirectionalLight((np.nan, 0, -1), ONE)), ("light 0", "direction")),
    Hostile("environment without pixels", lambda: environment(np.ones((0, 4, 3))), ("light 0", "pixels"), may_kill=True),
    Hostile("environment of one channel", lambda: environment(np.ones((4, 8, 1))), ("light 0", "(rows, cols, 3)")),
    Hostile("environment with NaN", lambda: environment(np.full((4, 8, 3), np.nan)), ("light 0", "finite")),
    Hostile("environment with negative pixels", lambda: environment(-np.ones((4, 8, 3))), ("light 0", ">= 0")),
    Hostile("sun below the horizon", lambda: lit(SunSky((1.0, 0.0, -0.1))), ("light 0", "sun sets")),
    Hostile("turbidity 0", lambda: lit(SunSky((0.0, 0.6, 0.8), turbidity=0.0)), ("light 0", "turbidity is 0.0", "[1, 10]")),
    Hostile("camera at NaN", lambda: lit(*DOME, view=posed(POINT, np.nan)), ("camera", "finite")),
    Hostile("camera at 1e12 m", lambda: lit(*DOME, view=posed(POINT, 1e12)), ("camera", "1e+08")),
]

# Scenes of several things --------------------------------------------------------------------------------------------


def camera_in_glass() -> Shot:
    """Return the view from the middle of a glass ball: in a medium of index n the radiance of the dome is n^2."""
    ball = made(Sphere(), Dielectric(1.5, 1.0), shifted(z=5))
    return Shot((ball,), DOME, camera(rows=12, cols=16, hfov_deg=60), spp=256, depth=64)


def nested_glass() -> Shot:
    """Return glass around water around air in a white furnace."""
    shells = (Dielectric(1.5, 1.0), Dielectric(1.33, 1.5), Dielectric(1.0, 1.33))
    balls = tuple(made(Sphere(r), glass, name=f"r{r}") for r, glass in zip((1.0, 0.8, 0.5), shells, strict=True))
    return Shot(balls, DOME, camera(rows=12, cols=16, hfov_deg=15), spp=4096, depth=256)


def silver(roughness: float) -> Conductor:
    """Return a metal."""
    return Conductor(constant(0.2), constant(3.0), roughness)


def metal_plane(eta: float, k: float) -> Shot:
    """Return a metal at normal incidence."""
    return Shot((ground(Conductor(constant(eta), constant(k))),), DOME, camera(rows=12, cols=16, hfov_deg=0.5), spp=256)


def textured(size: tuple[int, int]) -> Shot:
    """Return a plane with one colour, written as an image."""
    return Shot((ground(Diffuse(Texture(np.full((*size, 3), 120, dtype=np.uint8)))),), DOME)


def narrow_spot() -> Shot:
    """Return the middle of the narrowest beam."""
    view = camera(origin=(1e-4, 0, 5), target=(1e-4, 0, 0), rows=1, cols=1, hfov_deg=1e-3)
    return lit(SpotLight((1e-4, 0, 2.0), (0, 0, -1.0), constant(5.0), 0.1, 0.2), view=view, spp=256)


def low_sun(elevation: float) -> Shot:
    """Return the ground under a sun at the sine `elevation`."""
    return lit(SunSky((1.0, 0.0, elevation)), spp=256)


def grazing(angle_deg: float) -> Shot:
    """Return the ground under a light almost parallel to it."""
    angle = np.radians(angle_deg)
    return lit(DirectionalLight((float(np.cos(angle)), 0.0, float(-np.sin(angle))), ONE), spp=256)


def far_box(offset_m: float) -> Shot:
    """Return a box and its camera, both far from the world's origin."""
    view = camera(origin=(2 + offset_m, 1, 3), target=(offset_m, 0, 0), rows=12, cols=16)
    return Shot((made(Cube(), to_world=shifted(offset_m)),), DOME, view)


def distant_ball(distance_m: float) -> Shot:
    """Return a ball that looks the same from any distance."""
    ball = made(Sphere(1e-3 * distance_m), to_world=shifted(z=-distance_m))
    view = camera(origin=(0, 0, 0), target=(0, 0, -1), rows=12, cols=16, hfov_deg=0.2)
    return Shot((ball,), DOME, view, spp=256)


def film(rows: int, cols: int) -> Shot:
    """Return the ground on a film of one row or column."""
    view = camera(rows=rows, cols=cols, hfov_deg=20)
    pitch = view.film.pitch_m * cols / max(rows, cols)
    return Shot((ground(),), DOME, replace(view, film=Film(rows, cols, pitch)), spp=16)


def point_lights(count: int) -> Shot:
    """Return one lamp, split into many in the same place."""
    return lit(*[PointLight((0.0, 0.0, 2.0), constant(3.0 / count))] * count, spp=256)


def point_lights_each(intensities: Sequence[float], **more) -> Shot:
    """Return the ground below point lights of these intensities, all in one place."""
    return lit(*[PointLight((0.0, 0.0, 2.0), constant(value)) for value in intensities], spp=1024, **more)


def faint_above_a_bright_one() -> Shot:
    """Return the ground between 2000 faint lamps and one of 1e12 W that it hides."""
    faint = [PointLight((0.0, 0.0, 2.0), constant(1e-9 / (4 * np.pi)))] * 2000
    return lit(*faint, PointLight((0.0, 0.0, -2.0), constant(1e12 / (4 * np.pi))), spp=256)


def standing_lamp(height_m: float) -> Shot:
    """Return the ground beside a glowing cube that stands on it, or almost."""
    cube = SceneObject("lamp", "", (Part(Cube(), BLACK, emission=Emission(ONE)),), shifted(z=0.5 + height_m))
    return Shot((ground(), cube), (), camera(origin=(3, 0, 1), target=(0.8, 0, 0), rows=12, cols=16, hfov_deg=5), spp=4096)


def two_in_one_place(front: Material, back: Material) -> Shot:
    """Return two coincident squares above a lamp, lit by the dome."""
    glow = thing(Rectangle((10, 10)), 0.0, emission=Emission(constant(100.0)), to_world=shifted(z=-1.0), name="below")
    squares = made(quad(4 * QUAD), front, name="one"), made(quad(4 * QUAD), back, name="other")
    return Shot((*squares, glow), DOME)


def needles(aspect: float) -> Mesh:
    """Return a square of 2 m whose middle is cut into 200 strips of this aspect."""
    x = np.concatenate([[-1], 2 / aspect * np.arange(-100, 101), [1]])
    vertices = np.stack([np.repeat(x, 2), np.tile([-1.0, 1.0], len(x)), np.zeros(2 * len(x))], axis=1)
    first = 2 * np.arange(len(x) - 1)[:, None]
    return quad(vertices, (first + [[0, 2, 3, 0, 3, 1]]).reshape(-1, 3))


def on_needles(geometry: Geometry) -> Shot:
    """Return the strips' middle, askew to all axes, under a light askew to it."""
    askew = turned(50) @ turned(-20)[[1, 2, 0, 3]][:, [1, 2, 0, 3]]
    view = camera(origin=(1.0, 1.5, 2.0), rows=12, cols=16, hfov_deg=0.05)
    return Shot((made(geometry, to_world=askew),), (DirectionalLight((-0.2, -0.5, -1.0), ONE),), view, spp=256)


def pole(sides: int) -> Shot:
    """Return a pole of 10 m and 2 cm, 30 m away, under the dome; 1 % of it is seen."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([0.01 * np.cos(angle), 0.01 * np.sin(angle)], axis=1)
    vertices = np.vstack([np.column_stack([ring, np.full(sides, z)]) for z in (-5.0, 5.0)])
    low, after = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = np.vstack([np.stack([low, after, after + sides], 1), np.stack([low, after + sides, low + sides], 1)])
    view = camera(origin=(18.0, 24.0, 0.3), target=(0, 0, 0.3), rows=8, cols=8, hfov_deg=0.02)
    return Shot((made(quad(vertices, faces)),), DOME, view, spp=256)


def contact(size_m: float, tilt_deg: float = 0.0, lights: tuple[Light, ...] = DOME) -> Shot:
    """Return a box of 10 cm on a plane, seen from 1.5 m above."""
    tilted = turned(tilt_deg)
    objects = (
        made(Rectangle((size_m, size_m)), GREY, tilted, "ground"),
        made(Cube((0.1,) * 3), GREY, tilted @ shifted(z=0.05)),
    )
    eye, target = tilted @ [1.5, 1.5, 1.5, 1.0], tilted @ [0.0, 0.0, 0.02, 1.0]
    return Shot(objects, lights, camera(origin=eye[:3], target=target[:3], rows=24, cols=32, hfov_deg=8), spp=256)


def dispersive_in_water() -> Shot:
    """Return flint glass in water in a white furnace."""
    shells = made(Sphere(1.0), Dielectric(1.333, 1.0), name="water"), made(Sphere(0.6), Dielectric(glass("N-SF11"), 1.333))
    return Shot(shells, DOME, camera(rows=12, cols=16, hfov_deg=15), spp=16384, depth=256)


def foggy(visibility_m: float, albedo: float, distance_m: float, **more) -> Shot:
    """Return a lamp that fills the view through fog."""
    wall = thing(Rectangle((200, 200)), 0.0, emission=Emission(ONE))
    fog = Fog(-np.log(0.05) / visibility_m, albedo)
    return Shot((wall,), (), camera(origin=(0, 0, distance_m), rows=12, cols=16, hfov_deg=5), fog=fog, **more)


def fog_furnace(visibility_m: float) -> Shot:
    """Return fog that absorbs nothing, in a furnace."""
    fog = Fog(-np.log(0.05) / visibility_m, 1.0, 0.85, -1.0, 6.0)
    return Shot((), DOME, camera(rows=12, cols=16, hfov_deg=5), spp=4096, depth=4096, fog=fog)


def behind_walls() -> Shot:
    """Return the inside of a closed grey box with all kinds of light outside."""
    inward = mesh_of(Cube((4, 4, 4)))
    room = made(Mesh(inward.vertices_m, inward.faces[:, ::-1]), GREY, name="room")
    lights = (
        PointLight((0, 0, 3), ONE),
        SpotLight((0, 3, 0), (0, -1, 0), ONE, 20, 30),
        DirectionalLight((1, 1, -1), ONE),
        *DOME,
    )
    view = camera(origin=(0, 0.2, 0), target=(1, 0, 0.3), rows=24, cols=32, hfov_deg=90)
    return Shot((room, lamp(Rectangle(), height_m=2.001), lamp(Sphere(), height_m=5)), lights, view, spp=256)


def one_band(centre_nm: float) -> Shot:
    """Return the ground in a dome, in one band of 1 nm."""
    return Shot((ground(),), DOME, grid=WavelengthGrid(centre_nm, centre_nm, 1.0))


# Images --------------------------------------------------------------------------------------------------------------

_REPEATED = quad(faces=np.vstack([QUAD_FACES] * 3))
_LAMP_WITH_FLAT_TRIANGLES = quad(faces=DEGENERATE)
_IMAGES = [
    Hostile("empty scene", Shot, level=0.0),
    Hostile("empty scene under a dome", lambda: Shot((), DOME), level=1.0),
    Hostile("no light", lambda: Shot((ground(),)), level=0.0),
    Hostile(
        "lamps of zero power", lambda: lit(PointLight((0, 0, 2), constant(0.0)), ConstantEnvironment(constant(0.0))), level=0
    ),
    Hostile("lamp with an all-zero spectrum", lambda: seen(constant(0.0)), level=0.0),
    Hostile("lamp below single precision", lambda: seen(constant(1e-44)), level=0.0),
    Hostile("lamp of 1e-30", lambda: seen(constant(1e-30), spp=256), level=1e-30),
    Hostile("lamp of 1e15", lambda: seen(constant(1e15), spp=256), level=1e15),
    Hostile("point light of 1e12 W", lambda: lit(PointLight((0, 0, 2), constant(2.65e8)), spp=256), level=lambert(2.65e8, 2)),
    Hostile("line of 1 nm", lambda: line(1.0), level=2 * 1.0 / line_band_nm(1.0)),
    Hostile("line of 0.1 nm", lambda: line(0.1), level=2 * 0.1 / line_band_nm(0.1)),
    Hostile("step within 1e-9 nm", lambda: step(1e-9), twin=lambda: step(1e-3), like="a step within 1e-3 nm"),
    Hostile("reflectance 0", lambda: Shot((ground(BLACK),), DOME), level=0.0),
    Hostile("reflectance 1", lambda: Shot((ground(WHITE),), DOME, spp=1024), level=1.0),
    Hostile("closed box of reflectance 1, cut at 8 segments", lambda: box(1.0, 8), level=8.0),
    Hostile("closed box of reflectance 0", lambda: box(0.0, 8), level=1.0),
    Hostile("closed furnace with glass, mirror and white", furnished_box, level=2.0),
    Hostile("camera inside an opaque ball", lambda: Shot((made(Sphere(), to_world=shifted(z=5)),), DOME), level=0.0),
    Hostile("camera inside glass", camera_in_glass, level=2.25),
    Hostile("nested glass", nested_glass, level=1.0),
    Hostile(
        "glass of index 1",
        lambda: behind(made(Sphere(), Dielectric(1.0, 1.0))),
        twin=behind,
        like="the same view without the ball",
    ),
    Hostile(
        "glass of equal indices",
        lambda: behind(made(Sphere(), Dielectric(1.5, 1.5))),
        twin=behind,
        like="the same view without the ball",
    ),
    Hostile(
        "frosted glass of equal indices",
        lambda: behind(made(Sphere(), Dielectric(1.5, 1.5, 0.2))),
        twin=behind,
        like="the same view without the ball",
    ),
    Hostile("glass pane of 0.01 mm, 4 m away", lambda: pane(1e-5, 4), twin=lambda: pane(1e-1, 4), like="a pane of 10 cm"),
    Hostile("glass pane of 2 micrometres, 1 m away", lambda: pane(2e-6, 1), twin=lambda: pane(1e-1, 1), like="a pane of 10 cm"),
    Hostile("glass pane of 0.2 mm, 100 m away", lambda: pane(2e-4, 100), twin=lambda: pane(1, 100), like="a pane of 1 m"),
    Hostile(
        "tilted glass pane of 2 mm, 100 m away",
        lambda: pane(2e-3, 100, 50),
        twin=lambda: pane(1, 100, 50),
        like="a pane of 1 m",
    ),
    Hostile("water surface 100 m away", water, level=1.0),
    Hostile("bubble in glass", lambda: of(Dielectric(1.0, 1.5)), level=1.0),
    Hostile(
        "glass of roughness 1e-6",
        lambda: of(Dielectric(1.5, 1.0, 1e-6)),
        twin=lambda: of(Dielectric(1.5, 1.0)),
        like="polished glass",
    ),
    Hostile("metal of roughness 1e-6", lambda: of(silver(1e-6)), twin=lambda: of(silver(0.0)), like="polished metal"),
    Hostile("metal without extinction", lambda: metal_plane(1.5, 0.0), level=0.04),
    Hostile("metal of index 0", lambda: metal_plane(0.0, 3.0), level=1.0),
    Hostile("white diffuse furnace", lambda: of(WHITE, spp=1024), level=1.0),
    Hostile("white mirror furnace", lambda: of(Mirror(constant(1.0))), level=1.0),
    Hostile("diamond furnace", lambda: of(Dielectric(2.4, 1.0)), level=1.0),
    Hostile("plastic of roughness 1e-9", lambda: of(RoughPlastic(constant(1.0), 1e-9), spp=4096), level=1.0),
    Hostile("plastic of roughness 1", lambda: of(RoughPlastic(constant(1.0), 1.0), spp=4096), level=1.0),
    Hostile("plastic of index 1", lambda: of(RoughPlastic(constant(1.0), 0.3, 1.0), spp=4096), level=1.0),
    Hostile("principled of roughness 0", lambda: of(Principled(constant(1.0), 0.0), spp=4096), level=1.0),
    Hostile("principled metal of roughness 1", lambda: of(Principled(constant(1.0), 1.0, 1.0), spp=16384), level=1.0),
    Hostile("frosted glass of roughness 1", lambda: of(Dielectric(1.5, 1.0, 1.0), spp=32768), level=1.0),
    Hostile(
        "frosted glass of roughness 1 and index 1.0001",
        lambda: behind(made(Sphere(), Dielectric(1.0001, 1.0, 1.0))),
        twin=behind,
        like="the same view without the ball",
    ),
    Hostile("flint glass in water", dispersive_in_water, level=1.0),
    Hostile("texture of one pixel", lambda: textured((1, 1)), twin=lambda: textured((8, 8)), like="the colour as 8 x 8 pixels"),
    Hostile("texture of one row", lambda: textured((1, 7)), twin=lambda: textured((8, 8)), like="the colour as 8 x 8 pixels"),
    Hostile("black environment image", lambda: environment(np.zeros((4, 8, 3))), level=0.0),
    Hostile(
        "environment of one pixel",
        lambda: environment(np.ones((1, 1, 3))),
        twin=lambda: environment(np.ones((16, 32, 3))),
        like="the colour as 16 x 32 pixels",
    ),
    Hostile(
        "environment of two pixels",
        lambda: environment(np.ones((1, 2, 3))),
        twin=lambda: environment(np.ones((16, 32, 3))),
        like="the colour as 16 x 32 pixels",
    ),
    Hostile("spot cone of 0.2 degrees", narrow_spot, level=lambert(5.0, 2.0)),
    Hostile("sun on the horizon", lambda: low_sun(0.0), twin=lambda: low_sun(1e-5), like="the sun 2 arc seconds higher"),
    Hostile("light parallel to the ground", lambda: lit(DirectionalLight((1, 0, 0), ONE)), level=0.0),
    Hostile("light from below the ground", lambda: lit(PointLight((0, 0, -2), ONE)), level=0.0),
    Hostile("light at 0.01 degrees", lambda: grazing(1e-2), level=0.5 / np.pi * np.sin(np.radians(1e-2))),
    Hostile(
        "repeated triangles in a lamp",
        lambda: lit_by(lamp(_REPEATED)),
        twin=lambda: lit_by(lamp(quad())),
        like="each triangle once",
    ),
    Hostile(
        "lamp of a micrometre",
        lambda: lit_by(small_lamp(1e-6)),
        twin=lambda: lit_by(small_lamp(1e-3)),
        like="a lamp of a millimetre and the same power",
    ),
    *(
        Hostile(
            f"{kind} lamp 1 m off the ground, 300 m away",
            partial(low_lamp, kind, 300.0),
            twin=partial(low_lamp, kind, 10.0),
            like="from 10 m",
        )
        for kind in LAMPS
    ),
    *(
        Hostile(f"{kind} lamp 100 m away, covered 1 mm before it", partial(covered, kind, 100.0, 1e-3), level=0.0)
        for kind in LAMPS
    ),
    Hostile(
        "flat triangles in a lamp",
        lambda: lit_by(lamp(_LAMP_WITH_FLAT_TRIANGLES)),
        twin=lambda: lit_by(lamp(quad())),
        like="the lamp without them",
    ),
    Hostile(
        "lamp that stands on the ground",
        lambda: standing_lamp(0.0),
        twin=lambda: standing_lamp(1e-5),
        like="10 micrometres higher",
    ),
    Hostile("two squares in one place before a lamp", lambda: two_in_one_place(GREY, GREY), level=0.5),
    Hostile("black and white square in one place", lambda: two_in_one_place(BLACK, WHITE), most=1.0),
    Hostile("needles of aspect 1e3", lambda: on_needles(needles(1e3)), twin=lambda: on_needles(quad()), like="a square"),
    Hostile("needles of aspect 1e5", lambda: on_needles(needles(1e5)), twin=lambda: on_needles(quad()), like="a square"),
    Hostile("pole of 5 mm facets 10 m long, 30 m away", lambda: pole(12), level=0.5),
    Hostile("contact on 10 km of ground", lambda: contact(1e4), twin=lambda: contact(20.0), like="on 20 m of ground"),
    Hostile(
        "contact on 10 km of ground in the sun",
        lambda: contact(1e4, lights=SUN),
        twin=lambda: contact(20.0, lights=SUN),
        like="on 20 m of ground",
    ),
    Hostile("contact on 1 km of slope", lambda: contact(1e3, 30), twin=lambda: contact(20.0, 30), like="on 20 m of slope"),
    Hostile(
        "contact on 10 km of slope",
        lambda: contact(1e4, 30),
        twin=lambda: contact(20.0, 30),
        like="on 20 m of slope",
        tolerance=SLOPE_TOLERANCE,
    ),
    Hostile(
        "flat triangles in a mesh",
        lambda: under(quad(faces=DEGENERATE)),
        twin=lambda: under(quad()),
        like="the mesh without them",
    ),
    Hostile("repeated triangles in a mesh", lambda: under(_REPEATED), twin=lambda: under(quad()), like="each triangle once"),
    Hostile(
        "zero normals",
        lambda: under(quad(normals=np.zeros((4, 3)))),
        twin=lambda: under(quad()),
        like="the mesh without normals",
    ),
    Hostile(
        "one shape twice in one place",
        lambda: Shot((made(quad()), made(quad())), DOME),
        twin=lambda: under(quad()),
        like="the shape once",
    ),
    Hostile(
        "mirroring transform",
        lambda: under(Cube(), to_world=MIRRORED),
        twin=lambda: under(Cube()),
        like="the box, which is its own mirror image",
    ),
    Hostile(
        "plate of a micrometre", lambda: under(Cube((2, 2, 1e-6))), twin=lambda: under(Rectangle((2, 2))), like="a rectangle"
    ),
    Hostile("scene of 0.1 micrometres", lambda: scaled(1e-7), twin=lambda: scaled(1.0), like="the scene in metres"),
    Hostile("micrometre scene", lambda: scaled(1e-6), twin=lambda: scaled(1.0), like="the scene in metres"),
    Hostile(
        "micrometre scene with a ball",
        lambda: scaled(1e-6, Sphere(1e-6)),
        twin=lambda: scaled(1.0, Sphere(1.0)),
        like="the scene in metres",
    ),
    Hostile("millimetre scene", lambda: scaled(1e-3), twin=lambda: scaled(1.0), like="the scene in metres"),
    Hostile("kilometre scene", lambda: scaled(1e3), twin=lambda: scaled(1.0), like="the scene in metres"),
    Hostile("scene of 100 km", lambda: scaled(1e5), twin=lambda: scaled(1.0), like="the scene in metres"),
    Hostile(
        "scene of 100 km with a ball",
        lambda: scaled(1e5, Sphere(1e5)),
        twin=lambda: scaled(1.0, Sphere(1.0)),
        like="the scene in metres",
    ),
    Hostile("box 2000 km from the origin", lambda: far_box(2e6), twin=lambda: far_box(0.0), like="the box at the origin"),
    Hostile(
        "ball of 1 km, 1000 km away",
        lambda: distant_ball(1e6),
        twin=lambda: distant_ball(10.0),
        like="a ball of 1 cm, 10 m away",
    ),
    Hostile("one film sample", lambda: Shot((ground(),), DOME, POINT, spp=4096), level=0.5),
    Hostile("film of 1 x 20000", lambda: film(1, 20_000), level=0.5, may_kill=True),
    Hostile("film of 20000 x 1", lambda: film(20_000, 1), level=0.5, may_kill=True),
    Hostile("2000 point lights", lambda: point_lights(2000), level=lambert(3.0, 2.0), may_kill=True),
    Hostile("10,000 point lights", lambda: point_lights(10_000), level=lambert(3.0, 2.0), may_kill=True),
    Hostile(
        "2000 lamps of 1e-9 W beside one of 1e12 W",
        lambda: point_lights_each([1e-9 / (4 * np.pi)] * 2000 + [1e12 / (4 * np.pi)]),
        level=lambert(1e12 / (4 * np.pi), 2.0),
    ),
    Hostile(
        "2000 lamps of 1e-9 W above one of 1e12 W", faint_above_a_bright_one, level=lambert(2000 * 1e-9 / (4 * np.pi), 2.0)
    ),
    Hostile("all lights behind walls", behind_walls, level=0.0),
    Hostile(
        "dome of no light and a lamp",
        lambda: lit(ConstantEnvironment(constant(0.0)), PointLight((0, 0, 2), ONE), spp=256),
        level=lambert(1.0, 2.0),
    ),
    Hostile("one band of 1 nm at 380 nm", lambda: one_band(380.0), level=0.5),
    Hostile("one band of 1 nm at 1000 nm", lambda: one_band(1000.0), level=0.5),
    Hostile("paths of one segment", lambda: Shot((ground(),), DOME, depth=1), level=0.0),
    Hostile("paths of 1000 segments", lambda: box(0.5, 1000, spp=4096), level=2.0),
    Hostile("fog of 1 m that absorbs", lambda: foggy(1.0, 0.0, 0.2, spp=32768), level=0.05**0.2),
    Hostile("fog of 1 m that only scatters, in a furnace", lambda: fog_furnace(1.0), level=1.0),
    Hostile("fog of 1000 km", lambda: foggy(1e6, 0.999, 5.0), level=1.0),
    Hostile(
        "2000 lamps with a surface",
        lambda: lit_by(*split_lamp(50, 40), spp=256),
        twin=lambda: lit_by(*split_lamp(1, 1), spp=256),
        tolerance=SPLIT_TOLERANCE,
        may_kill=True,
        like="the same lamp in one piece",
    ),
    Hostile(
        "10,000 lamps with a surface",
        lambda: lit_by(*split_lamp(100, 100), spp=256),
        twin=lambda: lit_by(*split_lamp(1, 1), spp=256),
        tolerance=SPLIT_TOLERANCE,
        may_kill=True,
        like="the same lamp in one piece",
    ),
]

SECTIONS = {"Shapes and transforms": _SHAPES, "Materials": _MATERIALS, "Lights and cameras": _LIGHTS, "Images": _IMAGES}
"""Cases by the section of docs/validation/stability.md that lists them."""

HOSTILE = tuple(case for section in SECTIONS.values() for case in section)


def row(case: Hostile) -> str:
    """Return the page's line for a case."""
    if case.refused:
        try:
            case.shot().image()
        except FieldError as refusal:
            return f'| {case.id} | refused: "{refusal.message}" |'
        raise AssertionError(f"{case.id} is not refused")
    if case.twin is not None:
        outcome = f"as {case.like}"
    elif case.most is not None:
        outcome = f"radiance at most {case.most:.4g}"
    else:
        outcome = f"radiance {case.level:.4g}"
    exact = case.level == 0.0
    return f"| {case.id} | {outcome} exactly |" if exact else f"| {case.id} | {outcome}, within {case.tolerance:g} |"


def tables() -> str:
    """Return the sections of the page that list the cases."""
    head = "| Scene | What happens |\n| --- | --- |\n"
    return "\n".join(f"## {name}\n\n{head}" + "".join(row(case) + "\n" for case in cases) for name, cases in SECTIONS.items())


def rewrite(page: Path) -> None:
    """Put the tables into the page, and the number of cases before them."""
    text = page.read_text()
    first, after = text.index(f"## {next(iter(SECTIONS))}"), text.index("## Found and mended")
    intro = re.sub(r"^\d+ scenes", f"{len(HOSTILE)} scenes", text[:first], flags=re.MULTILINE)
    page.write_text(intro + tables() + "\n" + text[after:])


if __name__ == "__main__":
    if sys.argv[1] == "--page":
        rewrite(PAGE)
        sys.exit()
    try:
        for name in sys.argv[1:]:
            print(name, flush=True)
            check({case.id: case for case in HOSTILE}[name])
    except (AssertionError, FullwellError) as failure:
        sys.exit(f"{type(failure).__name__}: {failure}")
