"""Levels of detail: shape, texture coordinates and error bounds."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.assets.ingest.levels import Simplifier, surface_distance_m
from fullwell.assets.ingest.mending import edges_of, part_area_m2
from fullwell.assets.model import LoadedPart
from ingest_models import grid_part, part

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("fast_simplification")


NEARLY_NOTHING = 1e-3
"""Of the size: distances are bounds from triangles near at hand, and long slivers may escape these."""


def ball_part(**changes: object) -> LoadedPart:
    ball = trimesh.creation.icosphere(4)
    return part(np.asarray(ball.vertices), np.asarray(ball.faces), **changes)


def test_a_ball_with_a_quarter_of_its_triangles_is_still_a_ball() -> None:
    ball = ball_part()
    level = Simplifier([ball], max_error_m=0.05, crease_deg=40).level(0.25)
    assert level.triangles <= 1.1 * len(ball.faces) / 4
    radius = np.linalg.norm(level.parts[0].vertices_m, axis=1)
    assert np.all(np.abs(radius - 1) < 0.02)
    assert edges_of(level.parts).closed
    assert part_area_m2(level.parts[0]) == pytest.approx(4 * np.pi, rel=0.02)


def test_the_stated_error_bounds_what_independent_points_see() -> None:
    ball = ball_part()
    level = Simplifier([ball], max_error_m=0.2, crease_deg=40).level(0.02)
    points, _ = trimesh.sample.sample_surface(
        trimesh.Trimesh(level.parts[0].vertices_m, level.parts[0].faces, process=False), 5000, seed=3
    )
    seen = np.abs(np.linalg.norm(points, axis=1) - 1).max()
    assert 0.7 * seen <= level.error_m <= 2 * seen


def test_flat_grids_are_simplified_without_error_and_keep_their_border() -> None:
    grid = grid_part(20, 20)
    level = Simplifier([grid], max_error_m=1e-3, crease_deg=40).level(0.25)
    assert level.triangles < 0.6 * len(grid.faces)
    assert level.error_m < NEARLY_NOTHING
    assert part_area_m2(level.parts[0]) == pytest.approx(1.0, abs=1e-5)


def test_texture_coordinates_follow_the_surface() -> None:
    grid = grid_part(20, 20)
    coarse = Simplifier([grid], max_error_m=1e-3, crease_deg=40).level(0.25).parts[0]
    assert coarse.uv is not None
    np.testing.assert_allclose(coarse.uv, coarse.vertices_m[:, :2], atol=1e-4)


def test_charts_do_not_bleed_into_each_other() -> None:
    """Each half of a ball takes its colour from one point of a palette; no triangle may lie between the two."""
    ball = ball_part()
    corners = ball.vertices_m[ball.faces].reshape(-1, 3)
    upper = np.repeat(corners.reshape(-1, 3, 3).mean(axis=1)[:, 2] > 0, 3)
    uv = np.where(upper[:, None], [0.25, 0.5], [0.75, 0.5])
    painted = part(corners, np.arange(len(corners)).reshape(-1, 3), uv=uv)
    coarse = Simplifier([painted], max_error_m=0.1, crease_deg=40).level(0.25).parts[0]
    assert coarse.uv is not None
    assert len(coarse.faces) < 0.5 * len(painted.faces)
    by_face = coarse.uv[coarse.faces][:, :, 0]
    assert np.allclose(by_face, by_face[:, :1])
    assert set(np.round(by_face, 6).ravel()) == {0.25, 0.75}
    height = coarse.vertices_m[coarse.faces].mean(axis=1)[:, 2]
    assert np.all(by_face[height > 0.15, 0] == 0.25)


def test_parts_that_would_change_too_much_stay_as_they_are() -> None:
    ball, plate = ball_part(name="ball"), grid_part(1, 1, name="plate")
    level = Simplifier([ball, plate], max_error_m=1e-6, crease_deg=40).level(0.25)
    assert [p.name for p in level.parts] == ["ball", "plate"]
    assert level.parts[0] is ball
    assert level.error_m == 0.0


def test_smooth_parts_stay_smooth_and_flat_ones_flat() -> None:
    smooth = ball_part(normals=np.asarray(trimesh.creation.icosphere(4).vertices))
    level = Simplifier([smooth, ball_part()], max_error_m=0.1, crease_deg=40).level(0.25)
    normals = level.parts[0].normals
    assert normals is not None
    assert np.all((normals * level.parts[0].vertices_m).sum(axis=1) > 0.95)
    assert level.parts[1].normals is None


def test_the_distance_to_a_plane_is_the_height_above_it() -> None:
    heights = np.array([0.25, 0.5])
    points = np.column_stack([[0.3, 0.71], [0.9, 0.12], heights])
    assert surface_distance_m(grid_part(1, 1), points) == pytest.approx(0.5)


def test_levels_are_the_same_each_time() -> None:
    first, second = (Simplifier([ball_part()], max_error_m=0.1, crease_deg=40).level(0.1) for _ in range(2))
    assert np.array_equal(first.parts[0].vertices_m, second.parts[0].vertices_m)
    assert np.array_equal(first.parts[0].faces, second.parts[0].faces)
