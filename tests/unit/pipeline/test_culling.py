"""Objects out of view are left out where nothing they do can be seen, and only there."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from fullwell.pipeline.culling import Bounds, leave_out, object_bounds, out_of_view
from fullwell.pipeline.steps import PlanStep
from fullwell.radiometry import Spectrum, WavelengthGrid
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
    Lens,
    Light,
    Material,
    Mesh,
    Mirror,
    Part,
    PointLight,
    Rectangle,
    RoughPlastic,
    SceneDescription,
    SceneObject,
    Sphere,
    SunSky,
    look_at,
)

GRID = WavelengthGrid(400.0, 700.0, 10.0)
DARK, GREY = 0.1, 0.3
SKY = ConstantEnvironment(Spectrum.constant(1.0))
BUDGET = 2e-3
"""As the planner's own."""


def matte(reflectance: float = DARK) -> Diffuse:
    return Diffuse(Spectrum.constant(reflectance))


def thing(
    name: str,
    place: tuple[float, float, float],
    geometry: Geometry | None = None,
    material: Material | None = None,
    emission: Emission | None = None,
) -> SceneObject:
    to_world = np.eye(4)
    to_world[:3, 3] = place
    part = Part(geometry or Sphere(0.5), material or matte(), emission=emission)
    return SceneObject(name, "", (part,), to_world)


def camera(kind: str = "pinhole", f_number: float = 2.0, focal_length_m: float = 0.05, focus_m: float = 10.0) -> Camera:
    """It stands at the origin and looks along +y; its field of view is 53 degrees wide."""
    lens = Lens(kind, focal_length_m, f_number, focus_m, Spectrum.constant(1.0))  # type: ignore[arg-type]
    return Camera("main", look_at(np.zeros(3), np.array([0, 1, 0]), np.array([0, 0, 1])), lens, Film(48, 64, 0.05 / 64))


STAGE = (thing("wall", (0, 12, 0), Cube((8, 1, 8))), thing("ball", (0, 10, 0)))
"""What the picture shows."""


def cull(
    *more: SceneObject, lights: Iterable[Light] = (SKY,), fog: Fog | None = None, weighted: bool = False
) -> tuple[set[str], PlanStep]:
    """Return the names of what is left out, and why."""
    scene = SceneDescription((*STAGE, *more), tuple(lights), fog=fog)
    kept, step = leave_out(scene, camera(), GRID, weighted=weighted)
    gone = {item.id for item in scene.objects} - {item.id for item in kept.objects}
    assert (step.decision == "skip") == bool(gone)
    assert [item.id for item in kept.objects] == [item.id for item in scene.objects if item.id not in gone]
    return gone, step


def error_of(step: PlanStep) -> float:
    return float(step.error_bound.split()[0])


# What goes -----------------------------------------------------------------------------------------------------------


def test_a_small_dark_thing_far_behind_the_camera_goes() -> None:
    gone, step = cull(thing("far", (0, -200, 0)))
    assert gone == {"far"}
    assert "1 of 3 objects" in step.why


def test_the_bound_is_the_chance_that_a_walk_enters_the_ball() -> None:
    box = Cube((0.4, 0.2, 0.4))
    _, step = cull(thing("far", (0, -200, 0), box))
    distance_m = 200 + 9.5  # to the ball's box, the nearest thing that is seen
    expected = (0.3 / distance_m) ** (2 * (1 - DARK))
    assert error_of(step) == pytest.approx(expected, rel=0.01)  # two digits are printed


def test_walks_that_near_things_as_fast_as_any_scene_allows_reach_the_bound() -> None:
    """Of directions by the cosine law, at most (t / s)^2 end within t of a point at distance s: here just as many do."""
    rng = np.random.default_rng(2)
    distance, radius, reflectance, walks = 30.0, 1.0, 0.4, 400_000
    log_distance, weight, reached = np.full(walks, np.log(distance / radius)), np.ones(walks), 0.0
    for _ in range(60):
        log_distance += 0.5 * np.log1p(-rng.random(len(log_distance)))
        reached += weight[log_distance < 0].sum()
        log_distance, weight = log_distance[log_distance >= 0], reflectance * weight[log_distance >= 0]
    expected = (radius / distance) ** (2 * (1 - reflectance))
    assert reached / walks == pytest.approx(expected, rel=0.02)  # 5 standard errors


def test_bounds_of_all_that_goes_add_up_to_less_than_the_budget() -> None:
    crowd = [thing(f"far_{n}", (3.0 * n, -150.0, 0)) for n in range(60)]
    gone, step = cull(*crowd)
    assert 0 < len(gone) < len(crowd)
    alone = error_of(cull(crowd[0])[1])
    assert error_of(step) <= BUDGET
    assert error_of(step) == pytest.approx(alone * len(gone), rel=0.35)
    assert "far_59" in gone, "the farthest go first"


def test_brighter_surfaces_pass_light_on_and_weaken_the_bound() -> None:
    dark = error_of(cull(thing("far", (0, -1500, 0)))[1])
    grey = error_of(cull(thing("far", (0, -1500, 0), material=matte(GREY)))[1])
    assert grey > 2 * dark


def test_an_empty_picture_needs_no_objects() -> None:
    scene = SceneDescription((thing("behind", (0, -2, 0)),), (SKY,))
    kept, step = leave_out(scene, camera(), GRID)
    assert kept.objects == ()
    assert error_of(step) == 0.0


# What stays ----------------------------------------------------------------------------------------------------------


def test_a_thing_near_what_is_seen_stays() -> None:
    gone, step = cull(thing("near", (0, -5, 0)))
    assert not gone
    assert "near or bright" in step.why


def test_a_thing_in_view_stays_however_small_and_far() -> None:
    gone, step = cull(thing("speck", (0, 5000, 0), Sphere(0.01)))
    assert not gone
    assert "may see all" in step.why


def test_the_room_around_the_camera_stays() -> None:
    room = thing("room", (0, 0, 0), Cube((60, 60, 60)))
    assert not cull(room, lights=(SKY,))[0]


SUN_BEHIND = DirectionalLight((0.0, 1.0, -0.05), Spectrum.constant(10.0))
SUN_ASIDE = DirectionalLight((1.0, 0.0, -0.4), Spectrum.constant(10.0))


def test_a_wall_behind_the_camera_that_shades_what_it_sees_stays() -> None:
    wall = thing("shade", (0, -230, 12))
    assert cull(wall, lights=(SKY,))[0] == {"shade"}
    assert cull(wall, lights=(SKY, SUN_ASIDE))[0] == {"shade"}
    assert not cull(wall, lights=(SKY, SUN_BEHIND))[0]


def test_a_low_sun_throws_shadows_that_reach_far() -> None:
    post = thing("post", (0, -300, 3))
    high = SunSky((0.0, -0.2, 1.0))
    low = SunSky((0.0, -1.0, 0.01))
    ground = thing("ground", (0, 0, -4.1), Cube((2000, 2000, 0.1)))
    assert cull(ground, thing("post", (0, -900, -3.5)), lights=(high,))[0] == {"post"}
    assert not cull(ground, post, lights=(low,))[0]


@pytest.mark.parametrize(
    "material",
    [
        Mirror(Spectrum.constant(0.9)),
        Conductor(Spectrum.constant(0.2), Spectrum.constant(3.0), 0.2),
        Dielectric(),
        RoughPlastic(Spectrum.constant(DARK), 0.1),
    ],
    ids=lambda material: type(material).__name__,
)
@pytest.mark.parametrize("place", [(2, 9, 0), (0, -3, 0)], ids=["seen", "unseen"])
def test_where_something_mirrors_all_stays(material: Material, place: tuple[float, float, float]) -> None:
    gone, step = cull(thing("far", (0, -200, 0)), thing("shiny", place, material=material))
    assert not gone
    assert "'shiny' is not matte" in step.why


def test_a_lamp_out_of_view_stays_unless_it_is_weak() -> None:
    def lamp(radiance: float) -> SceneObject:
        return thing("lamp", (0, -200, 0), emission=Emission(Spectrum.constant(radiance)))

    assert cull(lamp(1.0))[0] == {"lamp"}
    assert not cull(lamp(1e3))[0]


def test_without_light_from_outside_all_stays() -> None:
    lamp = thing("lamp", (0, 10, 5), emission=Emission(Spectrum.constant(100.0)))
    assert not cull(lamp, thing("far", (0, -200, 0)), lights=())[0]


@pytest.mark.parametrize(
    "lights",
    [
        (SKY, PointLight((0, 5, 0), Spectrum.constant(1.0))),
        (ConstantEnvironment(Spectrum.constant(0.0)),),
    ],
    ids=["point light", "dark"],
)
def test_where_light_has_no_bound_all_stays(lights: tuple[Light, ...]) -> None:
    assert not cull(thing("far", (0, -200, 0)), lights=lights)[0]


def test_in_fog_and_with_weighted_groups_all_stays() -> None:
    assert not cull(thing("far", (0, -200, 0)), fog=Fog(0.01))[0]
    assert not cull(thing("far", (0, -200, 0)), weighted=True)[0]


def test_surfaces_that_return_all_light_bound_nothing() -> None:
    gone, step = cull(thing("far", (0, -200, 0)), thing("white", (1, 9, 0), material=matte(1.0)))
    assert not gone
    assert "'white' returns all light" in step.why


def test_a_bright_spot_in_an_image_of_the_sky_weakens_the_bound() -> None:
    pixels = np.ones((16, 32, 3), dtype=np.float32)
    even = ImageEnvironment(pixels, Spectrum.constant(1.0))
    sunny = ImageEnvironment(np.where(np.arange(512).reshape(16, 32, 1) == 100, 3000.0, pixels), Spectrum.constant(1.0))
    assert cull(thing("far", (0, -200, 0)), lights=(even,))[0] == {"far"}
    assert not cull(thing("far", (0, -200, 0)), lights=(sunny,))[0]


# Geometry ------------------------------------------------------------------------------------------------------------


def test_a_thin_lens_sees_wider_than_a_pinhole() -> None:
    edge = np.array([[4.1, 6.0, 0.0]])
    bounds = Bounds(edge - 0.2, edge + 0.2)
    assert out_of_view(bounds, camera())[0]
    assert not out_of_view(bounds, camera("thin_lens", f_number=0.05, focus_m=10.0))[0]


@pytest.mark.parametrize("focus_m", [0.5, 10.0, np.inf])
def test_no_camera_ray_meets_the_ball_of_a_thing_that_is_out_of_view(focus_m: float) -> None:
    rng = np.random.default_rng(5)
    eye = camera("thin_lens", f_number=0.05, focus_m=focus_m)
    middles = rng.uniform(-20, 20, (400, 3))
    bounds = Bounds(middles - 0.3, middles + 0.3)
    hidden = out_of_view(bounds, eye)
    assert 0 < hidden.sum() < 400
    pupil_m = eye.lens.pupil_diameter_m / 2
    angle, radius = rng.uniform(0, 2 * np.pi, 20000), pupil_m * np.sqrt(rng.random(20000))
    origins = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(20000)], axis=1)
    half = np.array([eye.film.cols, eye.film.rows]) / 2 * eye.tangent_pitch
    tangents = np.concatenate([rng.uniform(-1, 1, (20000, 2)) * half, np.ones((20000, 1))], axis=1)
    directions = tangents if np.isinf(focus_m) else tangents - origins / focus_m
    rotation = eye.camera_to_world[:3, :3]
    origins, directions = origins @ rotation.T, directions @ rotation.T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for middle, radius_m in zip(middles[hidden], bounds.radius_m[hidden], strict=True):
        along = np.maximum(np.sum((middle - origins) * directions, axis=1), 0.0)
        nearest = np.linalg.norm(origins + along[:, None] * directions - middle, axis=1)
        assert nearest.min() > radius_m


def test_boxes_hold_every_shape_however_it_is_turned() -> None:
    turned = np.eye(4)
    turned[:3, :3] = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]) @ np.diag([2.0, 1.0, 0.5])
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 3.0]]), np.array([[0, 1, 2]], dtype=np.uint32))
    shapes: list[Geometry] = [Sphere(1), Cube((1, 2, 3)), Disk(1), Cylinder(1, 4), Rectangle((2, 2)), mesh]
    for shape in shapes:
        item = replace(thing("x", (1, 2, 3), shape), to_world=turned)
        bounds = object_bounds(SceneDescription((item,)))
        from fullwell.scene.tessellate import mesh_of, transform_points

        points = transform_points(turned, mesh_of(shape).vertices_m)
        assert np.all(points >= bounds.low_m - 1e-9)
        assert np.all(points <= bounds.high_m + 1e-9)
        assert np.all(np.linalg.norm(points - bounds.centre_m, axis=1) <= bounds.radius_m + 1e-9)


def test_a_scene_without_objects_is_left_alone() -> None:
    scene = SceneDescription((), (SKY,))
    assert leave_out(scene, camera(), GRID)[0] is scene


def test_a_mesh_without_vertices_is_left_for_the_renderer_to_refuse() -> None:
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint32))
    assert not cull(thing("empty", (0, 5, 0), nothing))[0]


@pytest.mark.slow
def test_planning_two_thousand_objects_takes_little_time() -> None:
    rng = np.random.default_rng(1)
    shapes = [Mesh(rng.normal(size=(3000, 3)), rng.integers(0, 3000, (6000, 3), dtype=np.uint32)) for _ in range(20)]
    crowd = [thing(f"o_{n}", tuple(rng.uniform(-800, 800, 3)), shapes[n % 20]) for n in range(2000)]
    scene = SceneDescription((*STAGE, *crowd), (SKY, SUN_ASIDE))
    started = time.process_time()
    leave_out(scene, camera(), GRID)
    assert time.process_time() - started < 0.4  # 0.1 s where nothing else runs
