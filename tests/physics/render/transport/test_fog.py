"""Fog against closed forms: what passes, what a furnace returns, what single scattering adds, and Mitsuba's volpath."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import choose_variant, render_radiance
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
    Diffuse,
    Emission,
    Film,
    Fog,
    Lens,
    Light,
    Part,
    PointLight,
    Rectangle,
    SceneDescription,
    SceneObject,
    look_at,
)

pytestmark = pytest.mark.skipif(not choose_variant().variant.startswith("llvm"), reason="fog needs the path loop")
GRID = WavelengthGrid(550.0, 550.0, 100.0)
BLACK = Diffuse(Spectrum.constant(0.0))
PHOTONS = 550.0 / (6.62607015e-34 * 299792458.0 * 1e9)


def camera(rows: int = 16, cols: int = 16, hfov: float = 0.02) -> Camera:
    """Return a narrow camera at the origin that looks along +y."""
    pose = look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    lens = Lens("pinhole", 0.05, 4.0, np.inf, Spectrum.constant(1.0))
    return Camera("main", pose, lens, Film(rows, cols, 0.05 * hfov / cols))


def wall(distance_m: float, radiance: float) -> SceneObject:
    """Return a large wall that faces the camera; it shines where `radiance` is not 0."""
    to_world = np.array([[1, 0, 0, 0], [0, 0, -1, distance_m], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    emission = Emission(Spectrum.constant(radiance)) if radiance else None
    return SceneObject("wall", "", (Part(Rectangle((400, 400)), BLACK, emission=emission),), to_world)


def seen(objects: tuple[SceneObject, ...], lights: tuple[Light, ...], fog: Fog, *, depth: int, samples: int) -> NDArray:
    """Return the radiance image [W m^-2 sr^-1 nm^-1]."""
    scene = SceneDescription(objects, lights, fog=fog)
    image, _ = render_radiance(scene, camera(), GRID, samples_per_pixel=samples, max_depth=depth, seed=5)
    return image.photons[:, :, 0] / PHOTONS


def test_light_that_passes_falls_exponentially() -> None:
    image = seen((wall(50.0, 2.0),), (), Fog(0.02, albedo=0.0), depth=8, samples=1024)
    assert image.mean() == pytest.approx(2.0 * np.exp(-1.0), rel=3e-3)


def test_layer_ends_at_its_top() -> None:
    image = seen((wall(50.0, 2.0),), (), Fog(0.02, albedo=0.0, top_m=-1.0), depth=8, samples=64)
    assert image.mean() == pytest.approx(2.0, rel=1e-3)


def test_fog_without_absorption_returns_the_furnace() -> None:
    dome = ConstantEnvironment(Spectrum.constant(3.0))
    image = seen((), (dome,), Fog(0.05, albedo=1.0, asymmetry=0.6, bottom_m=-20.0, top_m=20.0), depth=400, samples=1024)
    assert image.mean() == pytest.approx(3.0, rel=3e-3)


def test_contrast_of_a_black_wall_follows_koschmieder() -> None:
    """Airlight between camera and wall is that of the furnace less what the wall takes away: L (1 - exp(-tau)) at least, L
    at most; with strong forward scattering nearly all light that misses comes from the wall's direction."""
    dome = ConstantEnvironment(Spectrum.constant(1.0))
    fog = Fog(0.02, albedo=1.0, asymmetry=0.0, bottom_m=-30.0, top_m=30.0)
    near = seen((wall(20.0, 0.0),), (dome,), fog, depth=200, samples=256).mean()
    far = seen((wall(120.0, 0.0),), (dome,), fog, depth=200, samples=256).mean()
    assert 0.05 < near < far < 1.0


@pytest.mark.parametrize("asymmetry", [0.0, 0.5, -0.4])
def test_single_scattering_of_a_point_light_is_the_airlight_integral(asymmetry: float) -> None:
    extinction, albedo = 0.01, 0.8
    lamp = np.array([6.0, 40.0, 0.0])
    image = seen(
        (wall(100.0, 0.0),),
        (PointLight(tuple(lamp), Spectrum.constant(100.0)),),
        Fog(extinction, albedo=albedo, asymmetry=asymmetry),
        depth=2,
        samples=4096,
    )
    along = np.linspace(0.0, 100.0, 200_001)
    offset = lamp[None, :] - np.stack([0 * along, along, 0 * along], axis=1)
    distance = np.linalg.norm(offset, axis=1)
    cosine = offset[:, 1] / distance
    phase = (1 - asymmetry**2) / (4 * np.pi * (1 + asymmetry**2 - 2 * asymmetry * cosine) ** 1.5)
    integrand = albedo * extinction * phase * 100.0 / distance**2 * np.exp(-extinction * (along + distance))
    assert image.mean() == pytest.approx(np.trapezoid(integrand, along), rel=0.01)
