"""Scenes that Mitsuba's own path integrator renders too: one for each kind of surface, light and lens."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.radiometry import Spectrum, WavelengthGrid, illuminant, metal, planck_radiance, scale_to_luminance
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
    Geometry,
    ImageEnvironment,
    Lens,
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
    Texture,
    look_at,
)

__all__ = ["SCENES", "Comparison", "box", "ceiling_lamp"]

ROWS, COLS = 48, 64
GRID = WavelengthGrid(420.0, 690.0, 30.0)
RED = Spectrum([400.0, 550.0, 620.0, 720.0], [0.05, 0.08, 0.6, 0.7])
GREEN = Spectrum([400.0, 480.0, 540.0, 600.0, 720.0], [0.1, 0.15, 0.5, 0.2, 0.15])
WHITE = Spectrum.constant(0.75)
BLACK = Diffuse(Spectrum.constant(0.0))
_NM = np.arange(380.0, 741.0, 5.0)
WARM = Spectrum(_NM, planck_radiance(_NM, 3000.0) / planck_radiance(np.array([560.0]), 3000.0), outside="zero")
COOL = Spectrum(_NM, planck_radiance(_NM, 9000.0) / planck_radiance(np.array([560.0]), 9000.0), outside="zero")


@dataclass(frozen=True)
class Comparison:
    """A scene, how it is looked at, and samples per pixel; `reference` is given to Mitsuba where it must be put otherwise."""

    scene: SceneDescription
    camera: Camera
    grid: WavelengthGrid = GRID
    depth: int = 6
    samples: int = 64
    compensate: bool = True
    reference: SceneDescription | None = None


def camera(
    origin: tuple[float, float, float] = (0.0, -3.4, 1.0), target: tuple[float, float, float] = (0.0, 0.0, 0.95)
) -> Camera:
    return Camera("main", _pose(origin, target), Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0)), _film(34.0))


def _pose(origin: tuple[float, float, float], target: tuple[float, float, float]) -> NDArray[np.float64]:
    return look_at(np.array(origin), np.array(target), np.array([0.0, 0.0, 1.0]))


def _film(hfov_deg: float, focal_length_m: float = 5e-3) -> Film:
    return Film(ROWS, COLS, 2 * focal_length_m * np.tan(np.radians(hfov_deg) / 2) / COLS)


def placed(
    centre: tuple[float, float, float], x: tuple[float, float, float] = (1, 0, 0), y: tuple[float, float, float] = (0, 1, 0)
) -> NDArray[np.float64]:
    """A pose by its centre and the directions of its own x and y axes."""
    to_world = np.eye(4)
    to_world[:3, 0], to_world[:3, 1], to_world[:3, 2] = x, y, np.cross(x, y)
    to_world[:3, 3] = centre
    return to_world


def thing(
    name: str,
    geometry: Geometry,
    material: Material,
    to_world: NDArray[np.float64] | None = None,
    *,
    emission: Spectrum | None = None,
) -> SceneObject:
    shines = None if emission is None else Emission(emission)
    return SceneObject(name, "", (Part(geometry, material, emission=shines),), np.eye(4) if to_world is None else to_world)


def scaled(spectrum: Spectrum, factor: float) -> Spectrum:
    return Spectrum(spectrum.wavelength_nm, spectrum.values * factor, outside=spectrum.outside)


def box() -> tuple[SceneObject, ...]:
    """Five walls of 2 m that open towards -y."""
    return (
        thing("floor", Rectangle((2, 2)), Diffuse(WHITE)),
        thing("ceiling", Rectangle((2, 2)), Diffuse(WHITE), placed((0, 0, 2), (1, 0, 0), (0, -1, 0))),
        thing("back", Rectangle((2, 2)), Diffuse(WHITE), placed((0, 1, 1), (1, 0, 0), (0, 0, 1))),
        thing("left", Rectangle((2, 2)), Diffuse(RED), placed((-1, 0, 1), (0, 1, 0), (0, 0, 1))),
        thing("right", Rectangle((2, 2)), Diffuse(GREEN), placed((1, 0, 1), (0, -1, 0), (0, 0, 1))),
    )


def ceiling_lamp(size: float = 0.6, brightness: float = 5.0) -> SceneObject:
    return thing(
        "lamp",
        Rectangle((size, size)),
        BLACK,
        placed((0, 0, 1.98), (1, 0, 0), (0, -1, 0)),
        emission=scaled(WARM, brightness),
    )


def ball(material: Material, radius: float = 0.5, centre: tuple[float, float, float] = (0.1, 0.0, 0.52)) -> SceneObject:
    return thing("ball", Sphere(radius), material, placed(centre))


def block() -> SceneObject:
    turned = placed((-0.4, 0.3, 0.4), (0.8, 0.6, 0), (-0.6, 0.8, 0))
    return thing("block", Cube((0.5, 0.5, 0.8)), Diffuse(WHITE), turned)


def in_a_box(*objects: SceneObject, lights: tuple[Light, ...] = (), lamp: bool = True) -> SceneDescription:
    return SceneDescription((*box(), *((ceiling_lamp(),) if lamp else ()), *objects), lights)


def on_a_floor(*objects: SceneObject, lights: tuple[Light, ...]) -> SceneDescription:
    return SceneDescription((thing("floor", Rectangle((6, 6)), Diffuse(WHITE)), *objects), lights)


# One for each --------------------------------------------------------------------------------------------------------


def diffuse_box() -> Comparison:
    return Comparison(in_a_box(block()), camera())


def mirror_ball() -> Comparison:
    return Comparison(
        in_a_box(block(), ball(Mirror(Spectrum([400.0, 700.0], [0.7, 0.95])), centre=(0.4, -0.1, 0.52))), camera(), samples=100
    )


def glass_ball() -> Comparison:
    """A caustic under a lamp that is wide enough to be met by chance."""
    scene = SceneDescription((*box(), ceiling_lamp(1.4, 1.0), ball(Dielectric(1.5, 1.0))))
    return Comparison(scene, camera(), depth=8, samples=144)


def gold_block() -> Comparison:
    eta, k = metal("gold")
    turned = placed((0.3, 0.2, 0.45), (0.8, 0.6, 0), (-0.6, 0.8, 0))
    return Comparison(in_a_box(thing("gold", Cube((0.6, 0.6, 0.9)), Conductor(eta, k), turned)), camera())


def rough_copper() -> Comparison:
    eta, k = metal("copper")
    return Comparison(in_a_box(ball(Conductor(eta, k, 0.1))), camera(), compensate=False)


def plastic() -> Comparison:
    return Comparison(in_a_box(ball(RoughPlastic(GREEN, 0.2)), block()), camera(), compensate=False)


def principled() -> Comparison:
    half_metal = ball(Principled(RED, 0.5, metallic=0.5), 0.4, (0.45, -0.1, 0.42))
    coated = ball(Principled(GREEN, 0.4), 0.4, (-0.45, 0.1, 0.42))
    return Comparison(in_a_box(half_metal, coated), camera(), compensate=False)


def frosted_glass() -> Comparison:
    scene = SceneDescription((*box(), ceiling_lamp(1.4, 1.0), ball(Dielectric(1.5, 1.0, 0.3))))
    return Comparison(scene, camera(), depth=8, samples=144, compensate=False)


def sphere_lamp() -> Comparison:
    lamp = thing("bulb", Sphere(0.2), BLACK, placed((0.3, -0.2, 1.2)), emission=scaled(WARM, 6.0))
    return Comparison(in_a_box(block(), lamp, lamp=False), camera())


def disk_and_cylinder_lamps() -> Comparison:
    disk = thing("disk", Disk(0.25), BLACK, placed((-0.5, 0, 1.9), (1, 0, 0), (0, -1, 0)), emission=scaled(WARM, 5.0))
    tube = thing("tube", Cylinder(0.05, 0.9), BLACK, placed((0.7, 0, 1.0), (0, 0, 1), (1, 0, 0)), emission=scaled(COOL, 4.0))
    return Comparison(in_a_box(block(), disk, tube, lamp=False), camera())


def point_and_spot() -> Comparison:
    lights = (
        PointLight((-0.6, -0.4, 1.6), scaled(WARM, 0.5)),
        SpotLight((0.5, -0.5, 1.9), (-0.2, 0.4, -1.0), scaled(COOL, 3.0), beam_deg=15.0, cutoff_deg=35.0),
    )
    return Comparison(in_a_box(block(), lights=lights, lamp=False), camera())


def directional() -> Comparison:
    lights = (DirectionalLight((0.3, 0.5, -0.8), scaled(WARM, 2.0)),)
    objects = (block(), ball(Diffuse(RED), centre=(0.6, 0.2, 0.5)))
    return Comparison(on_a_floor(*objects, lights=lights), camera((0, -3.4, 2.4), (0, 0, 0.4)))


def constant_environment() -> Comparison:
    objects = (block(), ball(Diffuse(RED), centre=(0.6, 0.2, 0.5)))
    scene = on_a_floor(*objects, lights=(ConstantEnvironment(COOL),))
    return Comparison(scene, camera((0, -3.4, 2.4), (0, 0, 0.4)))


def image_environment() -> Comparison:
    """Grey pixels of uneven brightness. Mitsuba's rows are centred on the poles, ours half a row away: it gets the picture at
    twice the rows, on which the same bilinear function has its corners."""
    rows, cols = 8, 16
    brightness = 0.1 + 2.0 * np.random.default_rng(7).random((rows, cols)) ** 4
    finer = np.array([np.interp(r, np.arange(rows) * 2 + 1, np.arange(rows)) for r in range(2 * rows + 1)])
    low = np.minimum(finer.astype(int), rows - 2)
    share = (finer - low)[:, None]
    resampled = (1 - share) * brightness[low] + share * brightness[low + 1]
    daylight = scale_to_luminance(illuminant("D65"), 100.0)
    objects = (block(), ball(Diffuse(RED), centre=(0.6, 0.2, 0.5)))

    def lit(pixels: NDArray[np.float64]) -> SceneDescription:
        picture = np.repeat(pixels[..., None], 3, axis=2).astype(np.float32)
        return on_a_floor(*objects, lights=(ImageEnvironment(picture, daylight, 30.0),))

    return Comparison(lit(brightness), camera((0, -3.4, 2.4), (0, 0, 0.4)), reference=lit(resampled))


def many_lamps() -> Comparison:
    rng = np.random.default_rng(3)
    lamps = []
    for number in range(60):
        x, y = rng.uniform(-0.9, 0.9, 2)
        brightness = float(np.exp(rng.normal())) * 4.0
        pose = placed((x, y, rng.uniform(1.5, 1.9)), (1, 0, 0), (0, -1, 0))
        spectrum = scaled(WARM if number % 2 else COOL, brightness)
        lamps.append(thing(f"lamp{number}", Rectangle((0.06, 0.06)), BLACK, pose, emission=spectrum))
    return Comparison(in_a_box(block(), *lamps, lamp=False), camera())


def textured_floor() -> Comparison:
    pixels = np.random.default_rng(5).integers(20, 240, (8, 8, 3)).astype(np.uint8)
    carpet = thing("carpet", Rectangle((1.8, 1.8)), Diffuse(Texture(pixels)), placed((0, 0, 0.01)))
    return Comparison(in_a_box(carpet, block()), camera())


def thin_lens() -> Comparison:
    lens = Lens("thin_lens", 0.2, 1.0, 3.0, Spectrum.constant(1.0))
    # The image lies behind the focal point: the field of view is that of the tangents' pitch.
    film = Film(ROWS, COLS, 2 * lens.image_distance_m * np.tan(np.radians(17.0)) / COLS)
    view = Camera("main", _pose((0.0, -3.4, 1.0), (0.0, 0.0, 0.95)), lens, film)
    return Comparison(in_a_box(block(), ball(Diffuse(RED), 0.25, (0.5, -0.7, 0.25))), view)


def smooth_normals() -> Comparison:
    """An icosahedron that says it is a ball."""
    g = (1 + 5**0.5) / 2
    corners = np.array([[s * a, t * b, 0.0] for s in (1, -1) for t in (1, -1) for a, b in ((1.0, g),)])
    corners = np.concatenate([corners, np.roll(corners, 1, axis=1), np.roll(corners, 2, axis=1)]) / np.hypot(1, g)
    distances = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    near = np.isclose(distances, distances[distances > 1e-6].min())
    faces = [
        (i, j, k) if np.linalg.det(corners[[i, j, k]]) > 0 else (i, k, j)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    mesh = Mesh(0.5 * corners, np.array(faces, dtype=np.uint32), normals=corners)
    return Comparison(in_a_box(thing("gem", mesh, Diffuse(RED), placed((0.2, 0, 0.55)))), camera())


def ball_by_a_bulb() -> Comparison:
    """Both curved and 3 m from the camera: where rays start and end matters most."""
    bulb = thing("bulb", Sphere(0.15), BLACK, placed((0, -0.5, 0.6)), emission=scaled(WARM, 3.0))
    objects = (block(), ball(Diffuse(RED), centre=(0.6, 0.2, 0.5)), bulb)
    return Comparison(on_a_floor(*objects, lights=()), camera((0, -3.4, 2.4), (0, 0, 0.4)))


def all_kinds_of_light() -> Comparison:
    bulb = ball_by_a_bulb()
    lights = (
        PointLight((-0.6, -0.4, 1.6), scaled(WARM, 0.5)),
        DirectionalLight((0.3, 0.5, -0.8), scaled(WARM, 1.0)),
        ConstantEnvironment(scaled(COOL, 0.3)),
    )
    return Comparison(SceneDescription(bulb.scene.objects, lights), bulb.camera)


def curved_textures() -> Comparison:
    cloth = Diffuse(Texture(np.random.default_rng(5).integers(20, 240, (6, 9, 3)).astype(np.uint8)))
    objects = (
        thing("globe", Sphere(0.4), cloth, placed((-0.5, -0.2, 0.45), (0.8, 0.6, 0), (0, 0, 1))),
        thing("tube", Cylinder(0.25, 0.8), cloth, placed((0.5, -0.2, 0.5), (0.8, 0.6, 0), (-0.6, 0.8, 0))),
        thing("disk", Disk(0.3), cloth, placed((0, 0.9, 1.3), (0.8, 0, 0.6), (-0.6, 0, 0.8))),
        thing("chest", Cube((0.4, 0.3, 0.3)), cloth, placed((0, -0.4, 0.16), (0.8, 0.6, 0), (-0.6, 0.8, 0))),
    )
    return Comparison(in_a_box(*objects), camera())


def bulb_in_glass() -> Comparison:
    bulb = thing("bulb", Sphere(0.2), BLACK, placed((0.2, 0, 0.8)), emission=scaled(WARM, 6.0))
    glass = ball(Dielectric(1.5, 1.0), 0.35, (0.2, 0, 0.8))
    return Comparison(in_a_box(block(), bulb, glass, lamp=False), camera(), depth=10, samples=100)


SCENES: dict[str, Callable[[], Comparison]] = {
    function.__name__: function
    for function in (
        diffuse_box,
        mirror_ball,
        glass_ball,
        gold_block,
        rough_copper,
        plastic,
        principled,
        frosted_glass,
        sphere_lamp,
        disk_and_cylinder_lamps,
        point_and_spot,
        directional,
        constant_environment,
        image_environment,
        many_lamps,
        textured_floor,
        thin_lens,
        smooth_normals,
        ball_by_a_bulb,
        all_kinds_of_light,
        curved_textures,
        bulb_in_glass,
    )
}
