"""Scenes whose radiance is known in closed form, to 1e-3."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core.constants import PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import choose_variant, render_radiance
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
    Cube,
    Diffuse,
    DirectionalLight,
    Emission,
    Film,
    Lens,
    Mesh,
    Part,
    PointLight,
    Rectangle,
    SceneDescription,
    SceneObject,
    Sphere,
    SpotLight,
    look_at,
)
from fullwell.scene.tessellate import mesh_of

ANALYTIC_TOLERANCE = 1e-3
"""What the product promises on analytic scenes; the Monte-Carlo error of the image means used here is a third of it."""

LINE_TOLERANCE = 1e-2
"""Four standard errors of 160,000 samples within a line of 4 nm."""

pytestmark = pytest.mark.skipif(
    choose_variant().variant != "llvm_ad_spectral",
    reason="the scalar fallback chooses wavelengths by chance; test_scalar_fallback.py holds it to its noise",
)

GRID = WavelengthGrid(400.0, 700.0, 10.0)
ONE = Spectrum.constant(1.0, unit="W sr^-1 m^-2 nm^-1")


def camera(origin=(0, 0, 5), target=(0, 0, 0), *, rows=24, cols=32, hfov_deg=20.0) -> Camera:
    focal = 5e-3
    pitch = 2 * focal * np.tan(np.radians(hfov_deg) / 2) / cols
    lens = Lens("pinhole", focal, 4.0, np.inf, Spectrum.constant(1.0))
    pose = look_at(np.array(origin, float), np.array(target, float), np.array([0.0, 1.0, 0.0]))
    return Camera("main", pose, lens, Film(rows, cols, pitch))


def thing(geometry, reflectance=0.5, *, emission=None, to_world=None, name="thing") -> SceneObject:
    part = Part(geometry, Diffuse(Spectrum.constant(reflectance)), emission=emission)
    return SceneObject(name, "", (part,), np.eye(4) if to_world is None else to_world)


def radiance_w(scene: SceneDescription, view: Camera, *, spp=64, depth=8, grid=GRID) -> np.ndarray:
    """Band radiances [W sr^-1 m^-2 nm^-1] through the mean photon energy of the band centre."""
    image, _ = render_radiance(scene, view, grid, samples_per_pixel=spp, max_depth=depth, seed=1)
    return image.photons.astype(float) * PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S / (grid.centres_nm * 1e-9)


def test_uniform_emitter_is_seen_at_its_own_radiance() -> None:
    scene = SceneDescription((thing(Rectangle((10, 10)), 0.0, emission=Emission(ONE)),))
    image = radiance_w(scene, camera())
    assert image.mean(axis=(0, 1)) == pytest.approx(np.ones(GRID.count), rel=ANALYTIC_TOLERANCE)
    assert image.min() > 0.95


def test_emitter_shines_on_the_side_of_its_normal_only() -> None:
    scene = SceneDescription((thing(Rectangle((10, 10)), 0.0, emission=Emission(ONE)),))
    assert radiance_w(scene, camera(origin=(0, 0, -5)), spp=4).max() == 0.0


def test_lambertian_plane_under_a_uniform_dome_has_reflectance_times_the_dome() -> None:
    scene = SceneDescription((thing(Rectangle((100, 100)), 0.37),), (ConstantEnvironment(ONE),))
    image = radiance_w(scene, camera(), spp=256)
    assert image.mean() == pytest.approx(0.37, rel=ANALYTIC_TOLERANCE)


@pytest.mark.parametrize("distance_m", [0.5, 2.0, 8.0])
def test_point_light_falls_with_the_inverse_square(distance_m: float) -> None:
    light = PointLight((0.0, 0.0, distance_m), Spectrum.constant(3.0))
    scene = SceneDescription((thing(Rectangle((100, 100)), 0.5),), (light,))
    view = camera(origin=(0.05, 0, 5), rows=1, cols=1, hfov_deg=0.05, target=(0, 0, 0))
    expected = 0.5 / np.pi * 3.0 / distance_m**2
    assert radiance_w(scene, view, spp=256).mean() == pytest.approx(expected, rel=ANALYTIC_TOLERANCE)


def test_directional_light_gives_cosine_times_irradiance() -> None:
    direction = np.array([0.0, np.sin(np.radians(60)), -np.cos(np.radians(60))])
    light = DirectionalLight(tuple(direction), Spectrum.constant(2.0))
    scene = SceneDescription((thing(Rectangle((100, 100)), 0.8),), (light,))
    expected = 0.8 / np.pi * 2.0 * 0.5
    assert radiance_w(scene, camera(), spp=64).mean() == pytest.approx(expected, rel=ANALYTIC_TOLERANCE)


def test_spot_light_has_its_intensity_on_axis_and_none_outside() -> None:
    light = SpotLight((0, 0, 2.0), (0, 0, -1.0), Spectrum.constant(5.0), beam_deg=20.0, cutoff_deg=30.0)
    scene = SceneDescription((thing(Rectangle((100, 100)), 0.5),), (light,))
    on_axis = camera(origin=(0.02, 0, 5), rows=1, cols=1, hfov_deg=0.05)
    outside = camera(origin=(3, 0, 5), target=(3, 0, 0), rows=1, cols=1, hfov_deg=0.05)
    expected = 0.5 / np.pi * 5.0 / 4.0
    assert radiance_w(scene, on_axis, spp=256).mean() == pytest.approx(expected, rel=ANALYTIC_TOLERANCE)
    assert radiance_w(scene, outside, spp=4).max() == 0.0


def test_white_furnace_returns_the_furnace() -> None:
    scene = SceneDescription((thing(Sphere(1.0), 1.0),), (ConstantEnvironment(ONE),))
    image = radiance_w(scene, camera(hfov_deg=15.0), spp=256, depth=64)
    assert image.mean() == pytest.approx(1.0, rel=ANALYTIC_TOLERANCE)


def test_closed_grey_furnace_reaches_the_geometric_sum() -> None:
    """Inside a closed box of emission 1 and reflectance r the radiance is 1 / (1 - r)."""
    outward = mesh_of(Cube((4, 4, 4)))
    inward = Mesh(outward.vertices_m, outward.faces[:, ::-1])
    scene = SceneDescription((thing(inward, 0.5, emission=Emission(ONE)),))
    image = radiance_w(scene, camera(origin=(0, 0.2, 0), target=(1, 0, 0.3)), spp=256, depth=64)
    assert image.mean() == pytest.approx(2.0, rel=ANALYTIC_TOLERANCE)


def test_near_infrared_bands_carry_the_same_radiance() -> None:
    grid = WavelengthGrid(380.0, 1000.0, 20.0)
    scene = SceneDescription((thing(Rectangle((10, 10)), 0.0, emission=Emission(ONE)),))
    image = radiance_w(scene, camera(), grid=grid)
    assert image.mean(axis=(0, 1)) == pytest.approx(np.ones(grid.count), rel=ANALYTIC_TOLERANCE)


def test_a_line_between_band_centres_is_not_lost() -> None:
    line = Spectrum([544.0, 546.0, 548.0], [0.0, 5.0, 0.0], outside="zero")
    scene = SceneDescription((thing(Rectangle((10, 10)), 0.0, emission=Emission(line)),))
    image = radiance_w(scene, camera(rows=96, cols=128), spp=256)
    in_band = image.mean(axis=(0, 1))
    expected = line.band_average(GRID) * 546.0 / GRID.centres_nm  # photons of the line, at the band centre's energy
    assert in_band.sum() == pytest.approx(expected.sum(), rel=LINE_TOLERANCE)


def test_one_band_and_few_samples_stay_unbiased() -> None:
    scene = SceneDescription((thing(Rectangle((10, 10)), 0.0, emission=Emission(ONE)),))
    single = radiance_w(scene, camera(), spp=1, grid=WavelengthGrid(550.0, 550.0, 10.0))
    assert single.mean() == pytest.approx(1.0, rel=ANALYTIC_TOLERANCE)
    sparse = radiance_w(scene, camera(rows=96, cols=128), spp=1)
    assert sparse.mean() == pytest.approx(1.0, rel=3e-3)


def test_far_from_the_origin_nothing_changes() -> None:
    offset = np.array([1.0e6, -2.0e6, 500.0])
    to_world = np.eye(4)
    to_world[:3, 3] = offset
    near = SceneDescription((thing(Cube((1, 1, 1)), 0.5),), (ConstantEnvironment(ONE),))
    far = SceneDescription((thing(Cube((1, 1, 1)), 0.5, to_world=to_world),), (ConstantEnvironment(ONE),))
    here = radiance_w(near, camera(origin=(2, 1, 3)), spp=64)
    there = radiance_w(far, camera(origin=tuple(offset + [2, 1, 3]), target=tuple(offset)), spp=64)
    assert there == pytest.approx(here, rel=1e-3, abs=1e-3)
