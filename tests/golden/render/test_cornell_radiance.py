"""Absolute spectral radiance of a Cornell box against the numbers another renderer (pbrt-v4) made for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fullwell.core.constants import PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.radiometry import Spectrum, WavelengthGrid, planck_radiance
from fullwell.render import choose_variant, render_radiance
from fullwell.scene import Camera, Cube, Diffuse, Emission, Film, Lens, Mesh, Part, SceneDescription, SceneObject, look_at

MEAN_TOLERANCE = 2e-3
"""Of the mean over blocks and bands: five times the standard error that both renderers together have at these samples."""

OUTLIER_SIGMA = 5.0
"""Standard errors allowed in the worst of 1116 block bands; their own estimate is uncertain by 40 %."""

OURS_RELATIVE = 0.012
"""Our relative standard error per block and band at these samples, measured between seeds."""

Z_UP = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
QUAD = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)


def cornell_scene(numbers: dict[str, Any]) -> SceneDescription:
    materials = {name: Diffuse(Spectrum(*entry["reflectance"])) for name, entry in numbers["materials"].items()}
    objects = [
        SceneObject(f"{name}{i}", "", (Part(Mesh(np.array(quad, float), QUAD), materials[name]),), Z_UP)
        for name, quads in numbers["quads"].items()
        for i, quad in enumerate(quads)
    ]
    for i, box in enumerate(numbers["boxes"]):
        c, s = np.cos(np.radians(box["rotation_about_y_deg"])), np.sin(np.radians(box["rotation_about_y_deg"]))
        place = np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1.0]])
        place[:3, 3] = box["center"]
        size = tuple(2 * half for half in box["half_extent"])
        objects.append(SceneObject(f"box{i}", "", (Part(Cube(size), materials[box["material"]]),), Z_UP @ place))
    half = 0.25
    lamp = np.array(
        [[-half, 0.99, 0.01 - half], [half, 0.99, 0.01 - half], [half, 0.99, 0.01 + half], [-half, 0.99, 0.01 + half]]
    )
    table_nm = np.arange(360.0, 831.0, 5.0)
    radiance = 0.02 * planck_radiance(table_nm, 3000.0) / planck_radiance(np.array([560.0]), 3000.0)
    emission = Emission(Spectrum(table_nm, radiance, outside="zero"))
    black = Diffuse(Spectrum.constant(0.0))
    objects.append(SceneObject("lamp", "", (Part(Mesh(lamp, QUAD), black, emission=emission),), Z_UP))
    return SceneDescription(tuple(objects))


def test_cornell_box_agrees_with_another_renderer(reference: Callable[[str], Any]) -> None:
    if choose_variant().variant != "llvm_ad_spectral":
        pytest.skip("the scalar fallback would need minutes for this error")
    numbers = reference("render/cornell_scene.json")
    blocks = reference("render/cornell_3000K_blocks.json")
    expected, expected_error = np.array(blocks["block_mean"]), np.array(blocks["block_standard_error"])
    focal_m, size = 5e-3, 96
    pitch_m = 2 * focal_m * np.tan(np.radians(39.3 / 2)) / size
    pose = look_at(np.array([0, -3.9, 0]), np.zeros(3), np.array([0, 0, 1.0]))
    lens = Lens("pinhole", focal_m, 4.0, np.inf, Spectrum.constant(1.0))
    camera = Camera("main", pose, lens, Film(size, size, pitch_m))
    grid = WavelengthGrid(400, 700, 10)
    image, _ = render_radiance(cornell_scene(numbers), camera, grid, samples_per_pixel=512, max_depth=8, seed=7)
    watts = image.photons.astype(float) * PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S / (grid.centres_nm * 1e-9)
    ours = watts.reshape(6, 16, 6, 16, grid.count).mean(axis=(1, 3))
    relative = ours / expected - 1
    assert abs(relative.mean()) < MEAN_TOLERANCE
    assert np.abs(relative.mean(axis=(0, 1))).max() < 4 * MEAN_TOLERANCE
    sigma = np.hypot(OURS_RELATIVE, expected_error / expected)
    assert np.abs(relative / sigma).max() < OUTLIER_SIGMA
