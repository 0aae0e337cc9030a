"""Made normals: smooth over spheres, sharp on boxes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fullwell.assets.ingest.normals import corner_normals, face_normals, join_corners, places, same_rows

trimesh = pytest.importorskip("trimesh")


def test_boxes_keep_flat_faces() -> None:
    box = trimesh.creation.box()
    faces = np.asarray(box.faces, dtype=np.int64)
    normals = corner_normals(np.asarray(box.vertices), faces, crease_deg=40)
    expected = face_normals(np.asarray(box.vertices), faces)[0]
    assert_allclose(normals, np.repeat(expected[:, None], 3, axis=1), atol=1e-12)


def test_a_wide_crease_angle_rounds_a_box() -> None:
    """Three right angles meet at each corner, so the normal points along the diagonal, however the faces are cut."""
    box = trimesh.creation.box()
    faces = np.asarray(box.faces, dtype=np.int64)
    normals = corner_normals(np.asarray(box.vertices), faces, crease_deg=95)
    assert_allclose(np.abs(normals), 1 / np.sqrt(3), atol=1e-12)


def test_spheres_have_radial_normals_also_where_vertices_are_split() -> None:
    ball = trimesh.creation.icosphere(3)
    corners = np.asarray(ball.vertices)[np.asarray(ball.faces)].reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    normals = corner_normals(corners, faces, crease_deg=40)
    assert np.all((normals.reshape(-1, 3) * corners).sum(axis=1) > 0.999)


def test_places_with_very_many_corners_are_shaded_flat_and_quickly() -> None:
    """A fan of 20000 triangles meets in one place: 400 million pairs, which nobody looks at."""
    angle = np.linspace(0, np.pi, 20_001)
    rim = np.column_stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(9 * angle)])
    vertices = np.concatenate([np.zeros((1, 3)), rim])
    index = np.arange(1, 20_001)
    faces = np.stack([np.zeros_like(index), index, index + 1], axis=1)
    normals = corner_normals(vertices, faces, crease_deg=180)
    assert_allclose(normals[:, 0], face_normals(vertices, faces)[0])


def test_joining_corners_changes_nothing_but_the_number_of_vertices() -> None:
    box = trimesh.creation.box()
    faces = np.asarray(box.faces, dtype=np.int64)
    normals = corner_normals(np.asarray(box.vertices), faces, crease_deg=40)
    uv = np.random.default_rng(1).integers(0, 4, (len(faces), 3, 2)) / 4
    vertices, joined, by_vertex, uv_by_vertex = join_corners(np.asarray(box.vertices), faces, normals, uv)
    assert by_vertex is not None
    assert uv_by_vertex is not None
    assert_allclose(vertices[joined], np.asarray(box.vertices)[faces])
    assert_allclose(by_vertex[joined], normals, atol=1e-7)
    assert_allclose(uv_by_vertex[joined], uv)
    plain = join_corners(np.asarray(box.vertices), faces, normals, None)
    assert len(plain[0]) == 24


def test_places_are_equal_for_equal_coordinates_only() -> None:
    vertices = np.array([[0.0, 1, 2], [-0.0, 1, 2], [0, 1, np.nextafter(2, 3)], [0, 1, 2]])
    found = places(vertices)
    assert found[0] == found[1] == found[3] != found[2]


def test_equal_rows_are_found_among_many() -> None:
    values = np.random.default_rng(3).integers(0, 30, (5000, 3)).astype(float)
    first, which = same_rows(values)
    expected = np.unique(values, axis=0)
    assert len(first) == len(expected)
    assert np.array_equal(values[first][which], values)
