"""Paths are as long as the surfaces' reflectance demands, and no longer than the recipe allows."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.pipeline.path_depth import choose_depth, largest_reflectance, tail_bound
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.scene import (
    Conductor,
    Dielectric,
    Diffuse,
    Fog,
    Material,
    Mirror,
    Part,
    Principled,
    RoughPlastic,
    SceneDescription,
    SceneObject,
    Sphere,
    Texture,
)

GRID = WavelengthGrid(400.0, 700.0, 10.0)


def scene_of(*materials: Material, fog: Fog | None = None, spread_m: float = 1.0) -> SceneDescription:
    objects = []
    for number, material in enumerate(materials):
        to_world = np.eye(4)
        to_world[0, 3] = number * spread_m
        objects.append(SceneObject(f"object_{number}", "", (Part(Sphere(), material),), to_world))
    return SceneDescription(tuple(objects), fog=fog)


def matte(value: float) -> Diffuse:
    return Diffuse(Spectrum.constant(value))


@pytest.mark.parametrize(("reflectance", "depth"), [(0.0, 2), (0.05, 4), (0.2, 6), (0.25, 7)])
def test_dark_scenes_need_short_paths(reflectance: float, depth: int) -> None:
    found, step = choose_depth(scene_of(matte(reflectance), matte(0.0)), GRID, 8, camera_name="main")
    assert found == depth
    assert step.decision == "skip"
    assert tail_bound(reflectance, found) <= 1e-3
    assert found == 2 or tail_bound(reflectance, found - 1) > 1e-3


def test_a_tail_is_the_sum_of_all_longer_paths() -> None:
    powers = 0.6 ** np.arange(200)  # of direct light, two segments, and on
    assert tail_bound(0.6, 5) == pytest.approx(powers[4:].sum(), rel=1e-9)
    assert tail_bound(1.0, 5) == np.inf


def test_bright_scenes_keep_the_depth_of_the_recipe_and_say_what_it_cuts_off() -> None:
    found, step = choose_depth(scene_of(matte(0.5)), GRID, 8, camera_name="main")
    assert found == 8
    assert step.decision == "run"
    assert "0.016" in step.error_bound


def test_a_recipe_may_ask_for_less() -> None:
    for asked in (1, 2, 3):
        assert choose_depth(scene_of(matte(0.1)), GRID, asked, camera_name="main")[0] == asked


def test_nothing_is_cut_off_where_nothing_may_be_skipped() -> None:
    assert choose_depth(scene_of(matte(0.1)), GRID, 8, camera_name="main", skip=False)[0] == 8


@pytest.mark.parametrize(
    "material",
    [
        Mirror(Spectrum.constant(0.1)),
        Dielectric(),
        Conductor(Spectrum.constant(1.0), Spectrum.constant(0.1)),
        RoughPlastic(Spectrum.constant(0.0), 0.5),
        Principled(Spectrum.constant(0.0)),
    ],
    ids=lambda material: type(material).__name__,
)
def test_what_is_not_matte_may_return_all_light(material: Material) -> None:
    found, step = choose_depth(scene_of(matte(0.1), material), GRID, 8, camera_name="main")
    assert found == 8
    assert "'object_1' is not matte" in step.why
    assert "not bounded" in step.error_bound


def test_a_peak_between_bands_counts_and_one_outside_does_not() -> None:
    peak = Spectrum(np.array([400.0, 551.0, 553.0, 555.0, 700.0]), np.array([0.1, 0.1, 0.8, 0.1, 0.1]))
    infrared = Spectrum(np.array([400.0, 800.0, 900.0]), np.array([0.1, 0.1, 0.9]))
    assert largest_reflectance(scene_of(Diffuse(peak)), GRID).value == pytest.approx(0.8)
    assert largest_reflectance(scene_of(Diffuse(infrared)), GRID).value == pytest.approx(0.1)


def test_a_texture_counts_with_its_brightest_colour() -> None:
    pixels = np.zeros((4, 4, 3), dtype=np.uint8)
    pixels[1, 2, 0] = 188
    value = largest_reflectance(scene_of(Diffuse(Texture(pixels))), GRID).value
    assert value == pytest.approx(0.503, abs=1e-3)  # sRGB 188


def test_fog_keeps_the_depth_and_asks_for_more_where_it_is_thick() -> None:
    thin = scene_of(matte(0.1), matte(0.1), fog=Fog(0.001), spread_m=100.0)
    thick = scene_of(matte(0.1), matte(0.1), fog=Fog(0.1), spread_m=100.0)
    assert choose_depth(thin, GRID, 8, camera_name="main")[0] == 8
    assert "max_depth" not in choose_depth(thin, GRID, 8, camera_name="main")[1].why
    found, step = choose_depth(thick, GRID, 8, camera_name="main")
    assert found == 8
    assert "quality.max_depth to 32" in step.why
    assert "quality.max_depth" not in choose_depth(thick, GRID, 32, camera_name="main")[1].why
