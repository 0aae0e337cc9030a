"""Recordings of the path loop: shared by scenes of a kind, the same bytes as tracing anew, and nothing compiled twice."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render.transport import progressive
from fullwell.render.transport.progressive import ProgressiveImage, Work
from fullwell.render.variant import activate
from fullwell.scene import (
    Camera,
    Cube,
    Diffuse,
    Emission,
    Film,
    Lens,
    Part,
    Rectangle,
    RoughPlastic,
    SceneDescription,
    SceneObject,
    Sphere,
    look_at,
)

GRID = WavelengthGrid(450.0, 650.0, 100.0)


def block(number: int, size_m: float, reflectance: float) -> SceneObject:
    to_world = np.eye(4)
    to_world[:3, 3] = [number - 2.0, 0.3 * number, size_m / 2]
    material = RoughPlastic(Spectrum.constant(reflectance), 0.2) if number % 2 else Diffuse(Spectrum.constant(reflectance))
    shape = Cube((size_m,) * 3) if number else Sphere(size_m / 2)
    return SceneObject(f"block{number}", "", (Part(shape, material),), to_world)


def scene(objects: int, radiance: float) -> SceneDescription:
    """Return blocks on the ground under a lamp: other numbers, sizes and spectra make another scene of the same kind."""
    down = np.diag([1.0, -1.0, -1.0, 1.0])
    down[2, 3] = 4.0
    lamp = Part(Rectangle((1, 1)), Diffuse(Spectrum.constant(0.0)), emission=Emission(Spectrum.constant(radiance)))
    ground = SceneObject("ground", "", (Part(Rectangle((20, 20)), Diffuse(Spectrum.constant(0.4))),))
    blocks = tuple(block(number, 0.3 + 0.05 * number, 0.1 * (1 + number)) for number in range(objects))
    return SceneDescription((ground, *blocks, SceneObject("lamp", "", (lamp,), down)))


def camera(rows: int, cols: int) -> Camera:
    pose = look_at(np.array([3.0, -4.0, 2.5]), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    return Camera("main", pose, Lens("pinhole", 0.05, 4.0, np.inf, Spectrum.constant(1.0)), Film(rows, cols, 5e-4))


def rendered(mi: Any, objects: int, radiance: float, film: tuple[int, int]) -> np.ndarray:
    work = Work(scene(objects, radiance), camera(*film), GRID, (Spectrum.constant(1.0),), True, False, max_depth=5, seed=3)
    image = ProgressiveImage(mi, work)
    for count, share in ((2, 1), (1, 1), (4, 3), (2, 9)):  # fewer and fewer pixels, as in adaptive sampling
        pixels = np.arange(0, image.pixels, share)
        image.add(pixels, np.full(len(pixels), count), lambda _: None)
    bands = image.bands()
    assert bands is not None
    return np.concatenate([image.replicas().ravel(), bands.ravel()])


@pytest.fixture(scope="module")
def mi() -> Any:
    module = activate()
    if not module.variant().startswith("llvm"):
        pytest.skip("the path loop needs LLVM")
    return module


LOOP_OPERATIONS = 1000
"""The path loop has more, everything else fewer."""

CASES = [(3, 5.0, (9, 12)), (6, 1.0, (12, 16)), (2, 700.0, (9, 12)), (5, 0.01, (7, 31))]


def test_a_recording_gives_the_bytes_of_tracing_anew(mi: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    replayed = [rendered(mi, *case) for case in CASES]
    monkeypatch.setattr(progressive, "replayed", lambda _kind, function, scene, _arrays, *lanes: function(scene, *lanes))
    for case, found in zip(CASES, replayed, strict=True):
        np.testing.assert_array_equal(found, rendered(mi, *case))


def test_another_scene_of_a_kind_compiles_nothing(mi: Any) -> None:
    import drjit as dr

    rendered(mi, *CASES[0])
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        for case in CASES:
            rendered(mi, *case)
        launched = [kernel for kernel in dr.kernel_history() if kernel["type"] == dr.KernelType.JIT]
    assert len(launched) >= 3 * len(CASES)
    assert all(kernel["cache_hit"] for kernel in launched)
    # From the cache on disk it would be a hit as well: one code for all scenes and all numbers of lanes.
    assert len({kernel["hash"] for kernel in launched if kernel["operation_count"] > LOOP_OPERATIONS}) == 1
