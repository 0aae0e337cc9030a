"""Draw figures/float32_distance.png: how far single precision moves a vertex, against its distance from the camera.

Run: python docs/validation/float32_distance.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

from fullwell.radiometry import Spectrum
from fullwell.render import query_surfaces
from fullwell.scene import (
    Camera,
    Diffuse,
    Film,
    Lens,
    Mesh,
    Part,
    SceneDescription,
    SceneObject,
    look_at,
)

FIGURE = Path(__file__).parent / "figures" / "float32_distance.png"
GREY = Diffuse(Spectrum.constant(0.5))
DISTANCES_M = np.logspace(-2, 7, 73)
RNG = np.random.default_rng(1)


def vertex_error_m(distance_m: float) -> float:
    """Return the largest rounding [m] of 10,000 vertices at a distance."""
    direction = RNG.normal(size=(10_000, 3))
    vertices = distance_m * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return float(np.linalg.norm(vertices.astype(np.float32) - vertices, axis=1).max())


def range_error_m(distance_m: float) -> float:
    """Return the largest error [m] of the range that the renderer measures to a wall at a distance."""
    size = 4 * distance_m
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * size - [0, 0, distance_m]
    wall = SceneObject("wall", "", (Part(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)), GREY),))
    lens = Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0))
    pose = look_at(np.zeros(3), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
    view = Camera("main", pose, lens, Film(32, 32, 1e-4))
    hits = query_surfaces(SceneDescription((wall,)), view)
    tangent = (np.mgrid[0:32, 0:32] + 0.5 - 16) * view.tangent_pitch
    exact = distance_m * np.sqrt(1 + (tangent**2).sum(axis=0))
    return float(np.abs(hits.range_m - exact).max())


def main() -> None:
    """Draw the figure."""
    figure, axes = plt.subplots(figsize=(7, 4.2), layout="constrained")
    axes.loglog(DISTANCES_M, [vertex_error_m(d) for d in DISTANCES_M], label="vertex, largest of 10,000")
    measured = DISTANCES_M[::4]
    axes.loglog(measured, [range_error_m(d) for d in measured], "o", ms=4, label="range to a wall, as rendered")
    axes.loglog(DISTANCES_M, 9e-5 * (1 + DISTANCES_M), "--", label="start of rays off a surface, 9e-5 (1 + distance)")
    axes.loglog(DISTANCES_M, 1e-6 * DISTANCES_M, ":", label="finest film sample allowed, 1e-6 of the distance")
    axes.set(xlabel="distance from the camera [m]", ylabel="error of position [m]")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    FIGURE.parent.mkdir(exist_ok=True)
    figure.savefig(FIGURE, dpi=120, metadata={"Software": None})


if __name__ == "__main__":
    main()
