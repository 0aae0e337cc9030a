"""CPU time of a street-like scene in motion over that of the same scene standing still, in paired runs.

    python -m benchmarks.motion_cost [--repeats 5]

The rays are the same in number; what differs is the scenes of the moments, and the launches.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import LightRequest, MotionRequest, SamplingGoal, render_light
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
    Cube,
    Diffuse,
    Film,
    Lens,
    Mesh,
    Part,
    Rectangle,
    SceneDescription,
    SceneObject,
    look_at,
)
from fullwell.scene.motion import AT_REST, Motion
from fullwell.scene.tessellate import mesh_of

ROWS, COLS, SAMPLES = 240, 320, 64
GRID = WavelengthGrid(400.0, 700.0, 100.0)
SUBDIVISIONS = 5
"""Of each triangle of a box into four: 12 288 triangles a box."""


def _fine_box() -> Mesh:
    mesh = mesh_of(Cube((1.0, 1.0, 1.0)))
    vertices, faces = mesh.vertices_m, mesh.faces.astype(np.int64)
    for _ in range(SUBDIVISIONS):
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        corners = [a, b, c, (a + b) / 2, (b + c) / 2, (c + a) / 2]
        order = [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
        vertices = np.concatenate([np.stack([corners[i] for i in way], axis=1).reshape(-1, 3) for way in order])
        faces = np.arange(len(vertices)).reshape(-1, 3)
    return Mesh(vertices, faces.astype(np.uint32))


def scene_of(boxes: int) -> SceneDescription:
    """Return boxes on a plane under an even sky."""
    ground = SceneObject("ground", "", (Part(Rectangle((100.0, 100.0)), Diffuse(Spectrum.constant(0.3))),))
    part = Part(_fine_box(), Diffuse(Spectrum.constant(0.6)))
    objects = [ground]
    for number in range(boxes):
        to_world = np.eye(4)
        to_world[:3, 3] = [1.7 * (number % 8) - 6.0, 2.0 * (number // 8), 0.5]
        objects.append(SceneObject(f"box{number}", "", (part,), to_world))
    return SceneDescription(tuple(objects), (ConstantEnvironment(Spectrum.constant(1.0)),))


def seconds(scene: SceneDescription, moments: int, moving: int, camera_motion: Motion) -> tuple[float, float]:
    """Return (CPU, wall) seconds of a rendering with so many moments, `moving` of the boxes moving; 1 moment is none."""
    pose = look_at(np.array([0.0, -9.0, 3.0]), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    lens = Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0))
    camera = Camera("main", pose, lens, Film(ROWS, COLS, 5e-3 / 300))
    motion = Motion(np.array([5.0, 0.0, 0.0]))
    goal = SamplingGoal(noise_ratio=None, samples_per_pixel=SAMPLES)
    request = LightRequest(GRID, (Spectrum.constant(1.0),) * 3, keep_bands=False, max_depth=5, goal=goal, seed=1)
    if moments > 1:
        motions = {f"box{number}": motion for number in range(moving)}
        asked = MotionRequest(motions, camera_motion, np.zeros(ROWS), 0.02, {}, lambda _: float(moments), 0.25, moments)
        request = LightRequest(GRID, request.responses, keep_bands=False, max_depth=5, goal=goal, seed=1, motion=asked)
    wall, cpu = time.perf_counter(), time.process_time()
    render_light(scene, camera, request)
    return time.process_time() - cpu, time.perf_counter() - wall


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    scene, still = scene_of(32), (1, 0, AT_REST)
    along = Motion(np.array([5.0, 0.0, 0.0]))
    cases = {"still": still}
    cases |= {f"camera, {count} moments": (count, 0, along) for count in (4, 16, 64)}
    cases |= {f"8 of 32 boxes, {count} moments": (count, 8, AT_REST) for count in (4, 16, 64)}
    for name, case in cases.items():
        seconds(scene, *case)  # compiles and records
        pairs = [(seconds(scene, *case)[0], seconds(scene, *still)[0]) for _ in range(repeats)]
        ratios = np.array([moved / plain for moved, plain in pairs])
        extra = np.median([moved - plain for moved, plain in pairs])
        print(f"{name}: {np.median(ratios):.2f} ({ratios.min():.2f} to {ratios.max():.2f}) x, {extra:+.2f} CPU-s", flush=True)


if __name__ == "__main__":
    main()
