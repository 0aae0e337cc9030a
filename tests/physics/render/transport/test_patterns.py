"""Lamps with a beam pattern against what the pattern says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from light_scenes import NO_NORMAL, UP, Lit, lamps, rectangle
from test_analytic_scenes import camera, radiance_w

from fullwell.core.errors import FieldError
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import choose_variant
from fullwell.render.transport.patterns import pattern_bounds
from fullwell.render.variant import activate
from fullwell.scene import (
    BeamPattern,
    Diffuse,
    Emission,
    GoniometricLight,
    Mesh,
    Part,
    PointLight,
    Principled,
    Rectangle,
    SceneDescription,
    SceneObject,
)
from fullwell.scene.validate import check_scene

CLOSED_FORM = 1e-3
"""What the product promises on analytic scenes."""

needs_llvm = pytest.mark.skipif(
    choose_variant().variant != "llvm_ad_spectral",
    reason="the path loop needs a usable LLVM; the fallback has no lights of its own",
)

AXES = ((0.6, -0.3, -0.2), (0.1, 0.2, 1.0))


@pytest.fixture(scope="module")
def mi():
    return activate()


def hilly(rows: int = 13, cols: int = 21, azimuth_deg=(-40.0, 30.0), elevation_deg=(-20.0, 15.0)) -> BeamPattern:
    shares = np.random.default_rng(4).uniform(0.1, 1.0, (rows, cols)).astype(np.float32)
    return BeamPattern(shares, azimuth_deg, elevation_deg)


def lamp(pattern: BeamPattern, value: float = 5.0, *, forward=AXES[0], up=AXES[1], place=(1.0, 2.0, 3.0)) -> GoniometricLight:
    return GoniometricLight(place, forward, up, pattern, Spectrum.constant(value))


def towards(light: GoniometricLight, azimuth_deg: float, elevation_deg: float) -> np.ndarray:
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    flat = np.cos(elevation)
    return light.frame() @ [flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)]


@needs_llvm
@pytest.mark.parametrize("distance_m", [0.1, 40.0])
@pytest.mark.parametrize("angles", [(-33.3, -11.0), (0.0, 0.0), (12.7, 3.1), (29.9, 14.9), (-39.9, -19.9)])
def test_intensity_in_a_direction_is_that_of_the_table(mi, angles, distance_m: float) -> None:
    light = lamp(hilly())
    point = np.array(light.position_m) + distance_m * towards(light, *angles)
    expected = 5.0 * float(light.pattern.share(*angles)) / distance_m**2
    assert Lit.of(mi, lamps(), [light]).irradiance(point, NO_NORMAL, lanes=64) == pytest.approx(expected, rel=CLOSED_FORM)


@needs_llvm
@pytest.mark.parametrize("angles", [(-41.0, 0.0), (31.0, 0.0), (0.0, 16.0), (0.0, -21.0), (180.0, 0.0)])
def test_nothing_is_sent_outside_the_table(mi, angles) -> None:
    light = lamp(hilly())
    point = np.array(light.position_m) + towards(light, *angles)
    assert Lit.of(mi, lamps(), [light]).irradiance(point, NO_NORMAL, lanes=64) == 0.0


@needs_llvm
def test_a_table_of_ones_over_the_sphere_is_a_point_light(mi) -> None:
    """Without a gap where its first column meets its last, or at its poles."""
    whole = BeamPattern(np.ones((7, 9), np.float32), (-180.0, 180.0), (-90.0, 90.0))
    assert whole.solid_angle_sr() == pytest.approx(4 * np.pi, rel=1e-6)
    place = (0.0, 0.0, 2.0)
    lit, same = (
        Lit.of(mi, lamps(), [light])
        for light in (lamp(whole, place=place, forward=(1, 0, 0), up=(0, 0, 1)), PointLight(place, Spectrum.constant(5.0)))
    )
    rng = np.random.default_rng(1)
    points = rng.normal(size=(4096, 3)) * [2.0, 1.0, 1.0] + [0, 0, 2.0]
    points[:32, 1], points[32:40, :2] = 0.0, 0.0
    values = lit.contributions(points, NO_NORMAL, lanes=4096)
    assert values == pytest.approx(same.contributions(points, NO_NORMAL, lanes=4096), rel=1e-5)


@needs_llvm
def test_flux_through_a_sphere_is_intensity_times_the_solid_angle_of_the_pattern(mi) -> None:
    light = lamp(hilly(60, 90), place=(0.0, 0.0, 0.0))
    count = 2**20
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    sphere = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    flux = Lit.of(mi, lamps(), [light]).contributions(sphere, NO_NORMAL, lanes=count).mean() * 4 * np.pi
    assert flux == pytest.approx(5.0 * light.pattern.solid_angle_sr(), rel=2e-3)


@needs_llvm
def test_many_lamps_of_two_patterns_add_up_with_others(mi) -> None:
    """By the tree: wherever a beam goes, it is found, and nothing is counted twice."""
    rng = np.random.default_rng(2)
    patterns = [hilly(), hilly(5, 4, (-170.0, 180.0), (-90.0, -5.0))]
    lights = [
        lamp(patterns[k % 2], rng.uniform(1, 9), forward=rng.normal(size=3), place=tuple(rng.uniform(-4, 4, 3) + [0, 0, 5]))
        for k in range(12)
    ]
    lights.append(PointLight((0.5, 0.0, 1.0), Spectrum.constant(2.0)))
    surfaces = lamps(rectangle(0.3, 4.0))
    lit = Lit.of(mi, surfaces, lights)
    assert {"tree", "point", "pattern"} <= lit.lights.features
    alone = [Lit.of(mi, surfaces)] + [Lit.of(mi, lamps(), [light]) for light in lights]
    for point in ((0.0, 0.0, 0.0), (3.0, -2.0, 0.5), (-3.0, 1.0, 3.0)):
        parts = [part.irradiance(point, UP, lanes=2**14) for part in alone]
        assert lit.irradiance(point, UP, lanes=2**19) == pytest.approx(sum(parts), rel=5e-3)


def test_bounds_hold_the_whole_beam() -> None:
    for pattern in (hilly(), hilly(9, 5, (-180.0, 180.0), (-90.0, -30.0))):
        bounds = pattern_bounds(pattern)
        fine = BeamPattern(np.ones((100, 100), np.float32), pattern.azimuth_deg, pattern.elevation_deg)
        angle = np.arccos(np.clip(fine.directions() @ bounds.axis, -1, 1))
        assert angle.max() <= bounds.bright_rad + bounds.end_rad + 1e-9
        assert 0 < bounds.end_rad < np.pi / 2  # the tree knows no light behind a cone's right angle


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"up": (6.0, -3.0, -2.0)}, "along forward"),
        ({"forward": (0.0, 0.0, 0.0)}, "forward"),
        ({"pattern": hilly(azimuth_deg=(10.0, -10.0))}, "must go up"),
        ({"pattern": hilly(elevation_deg=(-91.0, 0.0))}, "-90 to 90"),
        ({"pattern": BeamPattern(np.zeros((3, 3), np.float32), (0.0, 1.0), (0.0, 1.0))}, "only zeros"),
        ({"pattern": BeamPattern(np.ones((1, 3), np.float32), (0.0, 1.0), (0.0, 1.0))}, "at least 2"),
        ({"intensity": Spectrum.constant(-1.0)}, "intensity"),
    ],
)
def test_patterns_that_cannot_be_are_refused(change, said: str) -> None:
    with pytest.raises(FieldError, match=said):
        check_scene(SceneDescription((), (replace(lamp(hilly()), **change),)))


# Surfaces ------------------------------------------------------------------------------------------------------------


def even_ground() -> SceneObject:
    return SceneObject("ground", "", (Part(Rectangle((60.0, 60.0)), Diffuse(Spectrum.constant(0.5))),))


def panel(pattern: BeamPattern | None, *, half_m: float = 0.05, height_m: float = 4.0) -> SceneObject:
    """A square lamp that looks down, its own x axis forward and its z axis up; the mesh's front is below."""
    a = half_m
    corners = np.array([[-a, -a, 0], [-a, a, 0], [a, a, 0], [a, -a, 0]], dtype=float)
    mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32))
    to_world = np.eye(4)
    to_world[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    to_world[2, 3] = height_m
    emission = Emission(Spectrum.constant(7.0), pattern=pattern)
    return SceneObject("lamp", "", (Part(mesh, Diffuse(Spectrum.constant(0.0)), emission=emission),), to_world)


def seen(scene: SceneDescription, view, *, spp: int = 64, depth: int = 2) -> np.ndarray:
    return radiance_w(scene, view, spp=spp, depth=depth, grid=WavelengthGrid(500.0, 600.0, 50.0))


@needs_llvm
def test_a_lamp_with_a_pattern_looks_as_bright_as_its_share_that_way() -> None:
    pattern = hilly(azimuth_deg=(-180.0, 180.0), elevation_deg=(-90.0, 0.0))
    lamp_up = panel(pattern, half_m=0.5)
    for azimuth_deg, elevation_deg in ((0.0, -60.0), (70.0, -45.0), (-130.0, -80.0), (170.0, -30.0)):
        azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
        own = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
        eye = lamp_up.to_world[:3, 3] + 30.0 * (lamp_up.to_world[:3, :3] @ own)
        view = camera(origin=tuple(eye), target=tuple(lamp_up.to_world[:3, 3]), rows=4, cols=4, hfov_deg=0.002)
        image = seen(SceneDescription((lamp_up,)), view, spp=4, depth=1)
        assert image.mean() == pytest.approx(7.0 * float(pattern.share(azimuth_deg, elevation_deg)), rel=CLOSED_FORM)


@needs_llvm
def test_a_small_lamp_with_a_pattern_lights_the_ground_by_it() -> None:
    """Area, radiance, share, both cosines, distance: the form of a point for a panel of 10 cm at 4 m."""
    pattern = hilly(40, 60, (-180.0, 180.0), (-90.0, 0.0))
    waves = np.sin(3 * pattern.azimuths_rad())[None] * np.cos(pattern.elevations_rad())[:, None] ** 2
    smooth = BeamPattern((1.0 + 0.8 * waves).astype(np.float32), pattern.azimuth_deg, pattern.elevation_deg)
    lamp_up = panel(smooth)
    for x, y in ((0.5, 3.0), (-4.0, 1.0), (2.0, -2.5)):
        view = camera(origin=(x, y, 3.0), target=(x, y, 0.0), rows=4, cols=4, hfov_deg=1.0)
        image = seen(SceneDescription((even_ground(), lamp_up)), view, spp=4096)
        way = np.array([x, y, -4.0])
        own = lamp_up.to_world[:3, :3].T @ (way / np.linalg.norm(way))
        share = smooth.share(np.degrees(np.arctan2(own[1], own[0])), np.degrees(np.arcsin(own[2])))
        cosine = 4.0 / np.linalg.norm(way)
        expected = 0.5 / np.pi * 7.0 * float(share) * 0.01 * cosine**2 / (way @ way)
        assert image.mean() == pytest.approx(expected, rel=3e-3)


@needs_llvm
def test_rays_that_meet_a_wide_patterned_lamp_and_lamps_that_are_looked_for_agree() -> None:
    """A glossy floor close under a wide lamp: both ways matter, and the same lamp in 2 and in 200 triangles gives one image."""
    pattern = hilly(20, 30, (-180.0, 180.0), (-90.0, 0.0))
    floor = SceneObject("floor", "", (Part(Rectangle((4.0, 4.0)), Principled(Spectrum.constant(0.5), 0.3)),))
    lamp_up = panel(pattern, half_m=1.0, height_m=1.0)
    cells = 10
    edge = np.linspace(-1.0, 1.0, cells + 1)
    x, y = np.meshgrid(edge, edge, indexing="ij")
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (corner[i : i + cells, j : j + cells].ravel() for i, j in ((0, 0), (0, 1), (1, 1), (1, 0)))
    fine = Mesh(
        np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1),
        np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.uint32),
    )
    (part,) = lamp_up.parts
    many = replace(lamp_up, parts=(replace(part, geometry=fine),))
    view = camera(origin=(0.0, -3.0, 0.8), target=(0.0, 0.0, 0.0), rows=6, cols=8, hfov_deg=20.0)
    few, split = (seen(SceneDescription((floor, item)), view, spp=4096) for item in (lamp_up, many))
    assert split.mean() == pytest.approx(few.mean(), rel=4e-3)
