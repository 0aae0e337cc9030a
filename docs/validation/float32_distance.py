"""Draw figures/float32_distance.png: what single precision does to positions, against their distance from the camera.

Left: how far a vertex moves, how far off the labels' range is, and how far off a slope rays start. Right: the share of film
samples that are wrong on a slope under a dome, which shadows itself if rays start too near; the axis is where they start, in
units of where they do.

Run: python docs/validation/float32_distance.py
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

mpl.use("Agg")
import matplotlib.pyplot as plt
from scipy.spatial.transform import Rotation

from fullwell.core.constants import PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import query_surfaces, render_radiance
from fullwell.render.transport import geometry, progressive
from fullwell.render.transport.collect import RAY_OFFSET
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
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

FIGURE = Path(__file__).parent / "figures" / "float32_distance.png"
GREY = Diffuse(Spectrum.constant(0.5))
DISTANCES_M = np.logspace(-2, 7, 73)
RNG = np.random.default_rng(1)
BAND = WavelengthGrid(550.0, 550.0, 10.0)
SLOPES = 8
"""Planes at each distance, turned by chance, of 1 to 1000 times their distance."""

WRONG = 1e-3
"""Relative error beyond which a film sample counts as wrong: a plane under a dome has no noise."""


def camera(pixel_rad: float) -> Camera:
    """Return a camera of 32 x 32 film samples that looks down from the origin."""
    lens = Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0))
    pose = look_at(np.zeros(3), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
    return Camera("main", pose, lens, Film(32, 32, pixel_rad * lens.focal_length_m))


def vertex_error_m(distance_m: float) -> float:
    """Return the largest rounding [m] of 10,000 vertices at a distance."""
    direction = RNG.normal(size=(10_000, 3))
    vertices = distance_m * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return float(np.linalg.norm(vertices.astype(np.float32) - vertices, axis=1).max())


def range_error_m(distance_m: float) -> float:
    """Return the largest error [m] of the range that the labels have of a wall at a distance."""
    size = 4 * distance_m
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * size - [0, 0, distance_m]
    wall = SceneObject("wall", "", (Part(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)), GREY),))
    view = camera(0.02)
    hits = query_surfaces(SceneDescription((wall,)), view)
    tangent = (np.mgrid[0:32, 0:32] + 0.5 - 16) * view.tangent_pitch
    exact = distance_m * np.sqrt(1 + (tangent**2).sum(axis=0))
    return float(np.abs(hits.range_m - exact).max())


def slopes(distance_m: float) -> Iterator[tuple[SceneObject, float]]:
    """Yield planes through the point straight ahead, and how far off them rays start [m]."""
    rng = np.random.default_rng(7)
    for _ in range(SLOPES):
        size_m = min(distance_m * 10 ** rng.uniform(0, 3), 5e7)
        to_world = np.eye(4)
        angles = [rng.uniform(-80, 80), rng.uniform(-40, 40), rng.uniform(0, 360)]
        to_world[:3, :3] = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
        to_world[:3, 3] = to_world[:3, :3] @ [*rng.uniform(-0.4, 0.4, 2) * size_m, 0.0] - [0.0, 0.0, distance_m]
        half = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * size_m / 2
        reach = np.abs(half @ to_world[:3, :3].T + to_world[:3, 3]).max(axis=0)
        start_m = RAY_OFFSET * float(np.abs(to_world[:3, 2]) @ reach)
        yield SceneObject("slope", "", (Part(Rectangle((size_m, size_m)), GREY),), to_world), start_m


@contextmanager
def rays_start(factor: float) -> Iterator[None]:
    """Let rays start so many times as far off surfaces as they do; kernels recorded before know nothing of it."""

    def traced(_kind: object, function, scene, _arrays, *lanes):  # type: ignore[no-untyped-def]
        return function(scene, *lanes)

    with (
        mock.patch.object(geometry, "RAY_OFFSET", float(factor) * RAY_OFFSET),
        mock.patch.object(progressive, "replayed", traced),
    ):
        yield


def wrong_share(distance_m: float) -> float:
    """Return the share of film samples of slopes under a dome whose radiance is wrong."""
    dome = (ConstantEnvironment(Spectrum.constant(1.0, unit="W sr^-1 m^-2 nm^-1")),)
    wrong: list[NDArray[np.bool_]] = []
    for slope, _ in slopes(distance_m):
        scene = SceneDescription((slope,), dome)
        image, _ = render_radiance(scene, camera(1e-3), BAND, samples_per_pixel=64, max_depth=3, seed=1)
        radiance = image.photons * PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S / 550e-9
        wrong.append(np.abs(radiance - 0.5) > 0.5 * WRONG)
    return float(np.mean(wrong))


def main() -> None:
    """Draw the figure."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
    left.loglog(DISTANCES_M, [vertex_error_m(d) for d in DISTANCES_M], label="vertex, largest of 10,000")
    measured = DISTANCES_M[::4]
    left.loglog(measured, [range_error_m(d) for d in measured], "o", ms=4, label="range to a wall, as labelled")
    starts = np.array([[start_m for _, start_m in slopes(d)] for d in DISTANCES_M])
    left.fill_between(DISTANCES_M, starts.min(axis=1), starts.max(axis=1), alpha=0.25, color="C2")
    left.loglog(DISTANCES_M, np.median(starts, axis=1), "C2--", label="start of rays off slopes of 1 to 1000 distances")
    left.loglog(DISTANCES_M, 1e-6 * DISTANCES_M, "C3:", label="finest film sample allowed, 1e-6 of the distance")
    left.set(xlabel="distance from the camera [m]", ylabel="error of position, or offset [m]")
    factors = np.array([1 / 64, 1 / 32, 1 / 24, 1 / 16, 1 / 12, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0])
    for number, exponent in enumerate((-2, 0, 2, 4, 7)):
        shares = []
        for factor in factors:
            with rays_start(factor):
                shares.append(wrong_share(10.0**exponent))
        print(f"1e{exponent} m:", dict(zip(factors.round(4).tolist(), shares, strict=True)))
        right.plot(factors, shares, "-" + "osv^D"[number], ms=4, label=f"$10^{{{exponent}}}$ m")
    right.axvline(1.0, color="0.4", lw=1, ls="--")
    right.annotate("as rendered", (1.0, 0.5), rotation=90, xytext=(3, 0), textcoords="offset points", fontsize=8, color="0.3")
    right.set_xscale("log", base=2)
    right.set(xlabel="where rays start off a surface / where they do", ylabel="share of film samples that shadow themselves")
    right.legend(title="distance of a slope", fontsize=8, title_fontsize=8)
    left.legend(fontsize=8)
    for axes in (left, right):
        axes.grid(alpha=0.3)
    FIGURE.parent.mkdir(exist_ok=True)
    figure.savefig(FIGURE, dpi=120, metadata={"Software": None})


if __name__ == "__main__":
    main()
