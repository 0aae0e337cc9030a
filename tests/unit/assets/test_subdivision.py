"""Subdivision surfaces: limit positions known in closed form, borders, creases, and what is carried along."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fullwell.assets.subdivision import Creases, PolygonMesh, refined

CUBE_POINTS = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=float)
CUBE_FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])


def cube() -> PolygonMesh:
    return PolygonMesh(CUBE_POINTS, np.full(6, 4), CUBE_FACES.reshape(-1), None, np.arange(6))


def square(uv: np.ndarray | None = None) -> PolygonMesh:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    return PolygonMesh(points, np.array([4]), np.arange(4), uv, np.array([0]))


def test_a_cubes_corners_move_as_the_rules_say() -> None:
    """Three faces and three edges meet: (mean of face points + 2 mean of edge middles) / 3 = 5/9 of the corner."""
    once = refined(cube(), 1)
    assert len(once.counts) == 24
    assert_allclose(once.points[:8], CUBE_POINTS * 5 / 9)


def test_a_cube_comes_near_the_known_limit_of_its_face_middles() -> None:
    """A regular point converges to (16 v + 4 sum of edge neighbours + sum of diagonal neighbours) / 36."""
    once = refined(cube(), 1)
    middle = once.points[8 + 12]
    axis = int(np.abs(middle).argmax())
    edges = np.array([p for p in once.points[8:20] if p[axis] * middle[axis] > 0])
    corners = np.array([p for p in once.points[:8] if p[axis] * middle[axis] > 0])
    limit = (16 * middle + 4 * edges.sum(axis=0) + corners.sum(axis=0)) / 36
    deep = refined(cube(), 6)
    nearest = np.linalg.norm(deep.points - limit, axis=1).min()
    assert nearest < 1e-3


def test_a_flat_square_keeps_its_corners_and_its_border() -> None:
    fine = refined(square(), 3)
    assert len(fine.counts) == 64
    assert_allclose(fine.points[:4], square().points)
    assert_allclose([fine.points.min(axis=0), fine.points.max(axis=0)], [[0, 0, 0], [1, 1, 0]])


def test_wholly_creased_cubes_stay_cubes() -> None:
    edges = np.array([[0, 1], [1, 3], [3, 2], [2, 0], [4, 5], [5, 7], [7, 6], [6, 4], [0, 4], [1, 5], [2, 6], [3, 7]])
    fine = refined(cube(), 2, creases=Creases(edges, np.full(12, 10.0), np.zeros(0, dtype=np.int64)))
    assert_allclose(np.abs(fine.points).max(axis=1), 1.0)


def test_a_crease_of_sharpness_one_lasts_one_level() -> None:
    """One level keeps a closed ring of creases flat at the top; after that it rounds as any other."""
    ring = Creases(np.array([[4, 5], [5, 7], [7, 6], [6, 4]]), np.ones(4), np.zeros(0, dtype=np.int64))
    one, two = refined(cube(), 1, creases=ring), refined(cube(), 2, creases=ring)
    assert_allclose(one.points[4:8, 2], 1.0)
    assert np.all(two.points[4:8, 2] < 1.0)


def test_half_a_crease_lies_half_way() -> None:
    ring = np.array([[4, 5], [5, 7], [7, 6], [6, 4]])
    heights = [
        refined(cube(), 1, creases=Creases(ring, np.full(4, sharp), np.zeros(0, dtype=np.int64))).points[4, 2]
        for sharp in (0.0, 0.5, 1.0)
    ]
    assert heights[1] == pytest.approx((heights[0] + heights[2]) / 2)


def test_a_sharp_corner_stays() -> None:
    fine = refined(cube(), 1, creases=Creases(np.zeros((0, 2), dtype=np.int64), np.zeros(0), np.array([7])))
    assert_allclose(fine.points[7], CUBE_POINTS[7])
    assert_allclose(fine.points[0], CUBE_POINTS[0] * 5 / 9)


def test_texture_coordinates_are_interpolated_and_faces_know_their_parent() -> None:
    uv = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    fine = refined(square(uv), 2)
    assert fine.uv is not None
    assert_allclose(fine.uv, fine.points[fine.indices][:, :2])
    assert set(fine.parent.tolist()) == {0}


def test_bilinear_meshes_keep_their_shape() -> None:
    fine = refined(cube(), 1, smooth=False)
    assert_allclose(fine.points[:8], CUBE_POINTS)
    assert_allclose(np.abs(fine.points).max(axis=1), 1.0)
