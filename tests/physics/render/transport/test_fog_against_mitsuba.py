"""Fog against Mitsuba's volpath: a lamp and a ball in a homogeneous medium, block by block within the noise of both."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import choose_variant, render_radiance
from fullwell.render.variant import activate
from fullwell.scene import (
    Camera,
    Diffuse,
    Emission,
    Film,
    Fog,
    Lens,
    Part,
    Rectangle,
    SceneDescription,
    SceneObject,
    Sphere,
    look_at,
)

pytestmark = pytest.mark.skipif(not choose_variant().variant.startswith("llvm"), reason="fog needs the path loop")
GRID = WavelengthGrid(550.0, 550.0, 100.0)
PHOTONS = 550.0 / (6.62607015e-34 * 299792458.0 * 1e9)
EXTINCTION, ALBEDO, ASYMMETRY = 0.15, 0.9, 0.5
SEGMENTS = 12
RUNS = 6
ROWS, COLS, PITCH = 24, 32, 0.02
HALF_M = 60.0
"""Of Mitsuba's cube of fog: nine optical depths, beyond which nothing comes back."""


def ours(seed: int) -> NDArray[np.float64]:
    ball_at, lamp_at = np.eye(4), np.diag([1.0, -1.0, -1.0, 1.0])
    ball_at[:3, 3], lamp_at[:3, 3] = [0.0, 6.0, 0.0], [0.0, 6.0, 4.0]
    ball = SceneObject("ball", "", (Part(Sphere(1.5), Diffuse(Spectrum.constant(0.6))),), ball_at)
    shining = Part(Rectangle((2, 2)), Diffuse(Spectrum.constant(0.0)), emission=Emission(Spectrum.constant(10.0)))
    fog = Fog(EXTINCTION, ALBEDO, ASYMMETRY, -HALF_M, HALF_M)
    scene = SceneDescription((ball, SceneObject("lamp", "", (shining,), lamp_at)), fog=fog)
    pose = look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    camera = Camera("main", pose, Lens("pinhole", 0.05, 4.0, np.inf, Spectrum.constant(1.0)), Film(ROWS, COLS, 0.05 * PITCH))
    image, _ = render_radiance(scene, camera, GRID, samples_per_pixel=128, max_depth=SEGMENTS, seed=seed)
    return np.asarray(image.photons[:, :, 0], dtype=np.float64) / PHOTONS


def theirs(mi: Any, seed: int) -> NDArray[np.float64]:
    def even(value: float) -> dict[str, Any]:
        return {"type": "uniform", "value": value}

    medium = {
        "type": "homogeneous",
        "sigma_t": EXTINCTION,
        "albedo": ALBEDO,
        "phase": {"type": "hg", "g": ASYMMETRY},
        "has_spectral_extinction": False,
    }
    transform = mi.ScalarTransform4f
    scene = mi.load_dict(
        {
            "type": "scene",
            "fog": medium | {"id": "fog"},
            "cube": {
                "type": "cube",
                "to_world": transform().scale(HALF_M),
                "bsdf": {"type": "null"},
                "interior": {"type": "ref", "id": "fog"},
            },
            "ball": {
                "type": "sphere",
                "center": [0, 6, 0],
                "radius": 1.5,
                "bsdf": {"type": "diffuse", "reflectance": even(0.6)},
                "exterior": {"type": "ref", "id": "fog"},
            },
            "lamp": {
                "type": "rectangle",
                "to_world": transform().translate([0, 6, 4]) @ transform().rotate([1, 0, 0], 180),
                "bsdf": {"type": "diffuse", "reflectance": even(0.0)},
                "emitter": {"type": "area", "radiance": even(10.0)},
                "exterior": {"type": "ref", "id": "fog"},
                "interior": {"type": "ref", "id": "fog"},
            },
            "sensor": {
                "type": "perspective",
                "fov": float(np.degrees(2 * np.arctan(COLS * PITCH / 2))),
                "fov_axis": "x",
                "near_clip": 1e-3,
                "to_world": transform().look_at(origin=[0, 0, 0], target=[0, 1, 0], up=[0, 0, 1]),
                "medium": {"type": "ref", "id": "fog"},
                "film": {
                    "type": "specfilm",
                    "width": COLS,
                    "height": ROWS,
                    "rfilter": {"type": "box"},
                    "band": {"type": "regular", "wavelength_min": 500.0, "wavelength_max": 600.0, "values": "0.01, 0.01"},
                },
                "sampler": {"type": "independent", "sample_count": 256},
            },
        }
    )
    integrator = mi.load_dict({"type": "volpath", "max_depth": SEGMENTS, "rr_depth": 100})
    return np.array(mi.render(scene, integrator=integrator, seed=seed), dtype=np.float64).reshape(ROWS, COLS)


def blocks(images: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return (runs, 12) means over blocks of 8 x 8 pixels."""
    return np.stack(images).reshape(len(images), ROWS // 8, 8, COLS // 8, 8).mean(axis=(2, 4)).reshape(len(images), -1)


@pytest.mark.slow
def test_fog_agrees_with_volpath_within_the_noise_of_both() -> None:
    mi = activate()
    mine, other = blocks([ours(seed) for seed in range(RUNS)]), blocks([theirs(mi, seed) for seed in range(RUNS)])
    error = np.sqrt(mine.var(axis=0, ddof=1) / RUNS + other.var(axis=0, ddof=1) / RUNS)
    scores = (mine.mean(axis=0) - other.mean(axis=0)) / error
    # 12 scores of about 8 degrees of freedom: their root mean square is 1.15 by chance, the largest below 5.5.
    assert np.abs(scores).max() < 5.5
    assert np.sqrt(np.mean(scores**2)) < 1.9
    assert mine.mean() == pytest.approx(other.mean(), rel=0.02)
