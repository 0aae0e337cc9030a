"""Trees: a trunk that divides, and clusters of single leaves at its ends; the origin at the foot."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes.meshes import Triangles, join, tube

__all__ = ["tree_parts"]


def tree_parts(
    rng: np.random.Generator, *, leaves: int = 4000, height_m: float = 6.5, slender: float = 1.0
) -> dict[str, Triangles]:
    """Return the meshes of one tree, "wood" and "leaves" (two triangles each)."""
    tree = _Tree(rng)
    lean = rng.normal(0, 0.06, 2)
    top = np.array([lean[0], lean[1], 0.36 * height_m])
    trunk = np.array([(0, 0, -0.1), (0, 0, 0.25), top / 2, top])
    tree.wood.append(tube(trunk, (0.20, 0.145, 0.125, 0.11), segments=10))
    boughs = int(rng.integers(5, 8))
    for number in range(boughs):
        azimuth = 2 * math.pi * (number + 0.3 * rng.random()) / boughs
        steepness = rng.uniform(0.35, 1.25) if number else 1.5
        tree.grow(_Branch(top, azimuth, steepness, 0.33 * height_m * slender, 0.07), forks=2)
    return {"wood": join(tree.wood), "leaves": _leaves(rng, np.array(tree.ends), leaves)}


@dataclass(frozen=True, slots=True, eq=False)
class _Branch:
    """Where a branch starts, its direction (angles in radians), its length and thickness."""

    start_m: NDArray[np.float64]
    azimuth: float
    steepness: float
    length_m: float
    radius_m: float

    @property
    def way_m(self) -> NDArray[np.float64]:
        """From its start to its end, were it straight."""
        flat = math.cos(self.steepness)
        way = [math.cos(self.azimuth) * flat, math.sin(self.azimuth) * flat, math.sin(self.steepness)]
        return self.length_m * np.array(way)


class _Tree:
    """The wood so far, and the places where leaves hang."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.wood: list[Triangles] = []
        self.ends: list[NDArray[np.float64]] = []

    def grow(self, branch: _Branch, *, forks: int) -> None:
        """Add a branch, and what springs from it `forks` times over."""
        rng, radius_m = self._rng, branch.radius_m
        bend = rng.normal(0, 0.12, 3) * branch.length_m
        middle, end = branch.start_m + (branch.way_m + bend) / 2, branch.start_m + branch.way_m + 0.3 * bend
        line = np.array([branch.start_m, middle, end])
        self.wood.append(tube(line, (radius_m, 0.75 * radius_m, 0.5 * radius_m), segments=4 + forks, capped=False))
        self.ends += [middle, end] if forks < 2 else [end]
        for _ in range(int(rng.integers(3, 5)) if forks else 0):
            start_m = branch.start_m + (end - branch.start_m) * rng.uniform(0.55, 1)
            azimuth, steepness = branch.azimuth + rng.normal(0, 0.75), branch.steepness + rng.normal(0.05, 0.45)
            self.grow(
                _Branch(start_m, azimuth, steepness, branch.length_m * rng.uniform(0.5, 0.7), radius_m / 2), forks=forks - 1
            )


def _leaves(rng: np.random.Generator, ends: NDArray[np.float64], count: int) -> Triangles:
    """Return leaves as folded diamonds about the ends of the branches, their normals mostly up and outwards."""
    middle = ends.mean(axis=0) - [0, 0, 0.6]
    places = ends[rng.integers(0, len(ends), count)] + rng.normal(0, 0.26, (count, 3)) * [1, 1, 0.8]
    outwards = places - middle
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    normal = outwards + [0, 0, 0.6] + rng.normal(0, 0.55, (count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.cross(normal, rng.normal(0, 1, (count, 3)))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(normal, along)
    length = rng.uniform(0.14, 0.25, (count, 1))
    tip, stem = places + along * length * 0.55, places - along * length * 0.45
    fold = normal * length * 0.10
    left, right = places + across * length * 0.32 + fold, places - across * length * 0.32 + fold
    # Left and right half of a leaf: counter-clockwise seen from the side of the normal.
    corners = np.stack([stem, tip, left, stem, right, tip], axis=1).reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    sides = corners.reshape(-1, 3, 3)
    flat = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    return Triangles(corners, faces, np.repeat(flat, 3, axis=0))
