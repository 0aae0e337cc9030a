"""Triangles put in order: what is removed, what is turned over, what is left alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fullwell.assets.ingest.mending import Mended, edges_of, mend_part, part_area_m2
from fullwell.assets.model import LoadedPart
from ingest_models import grid_part, part

trimesh = pytest.importorskip("trimesh")


def mended(given: LoadedPart, *, make_normals: bool = False) -> Mended:
    found = mend_part(given, crease_deg=40, make_normals=make_normals)
    assert found is not None
    return found


def of_mesh(mesh: object, **changes: object) -> LoadedPart:
    return part(np.asarray(mesh.vertices), np.asarray(mesh.faces), **changes)  # type: ignore[attr-defined]


def volume_m3(given: LoadedPart) -> float:
    a, b, c = (given.vertices_m[given.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_a_sound_mesh_is_left_alone() -> None:
    ball = of_mesh(trimesh.creation.icosphere(2))
    found = mended(ball)
    assert (found.slivers, found.doubles, found.turned, found.bodies_turned, found.normals_made) == (0, 0, 0, 0, False)
    assert len(found.part.faces) == len(ball.faces)


def test_slivers_and_doubles_are_removed_and_counted() -> None:
    faces = np.array([[0, 1, 2], [2, 0, 1], [0, 1, 3], [0, 0, 1], [1, 2, 4]])
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0], [1, 1, 0]])
    found = mended(part(vertices, faces))
    assert (found.slivers, found.doubles, found.one_sided) == (2, 1, 0)
    assert part_area_m2(found.part) == pytest.approx(1.0)


def test_back_to_back_triangles_become_one_two_sided_one() -> None:
    found = mended(part(np.eye(3), np.array([[0, 1, 2], [0, 2, 1]])))
    assert (found.doubles, found.one_sided) == (1, 1)
    assert found.part.double_sided


def test_a_part_without_an_area_is_none() -> None:
    assert mend_part(part(np.zeros((3, 3)), np.array([[0, 1, 2]])), crease_deg=40, make_normals=True) is None


@pytest.mark.parametrize("share", [0.1, 0.45])
def test_neighbours_wound_against_each_other_are_turned_to_the_majority(share: float) -> None:
    ball = trimesh.creation.icosphere(3)
    faces = np.asarray(ball.faces).copy()
    wrong = np.random.default_rng(5).random(len(faces)) < share
    faces[wrong] = faces[wrong][:, ::-1]
    found = mended(part(np.asarray(ball.vertices), faces))
    assert found.turned == np.count_nonzero(wrong)
    assert volume_m3(found.part) == pytest.approx(ball.volume)


def test_a_closed_body_that_is_inside_out_is_turned() -> None:
    ball = trimesh.creation.icosphere(2)
    found = mended(part(np.asarray(ball.vertices), np.asarray(ball.faces)[:, ::-1]))
    assert found.bodies_turned == 1
    assert volume_m3(found.part) == pytest.approx(ball.volume)


def test_a_cavity_stays_a_cavity() -> None:
    outer, inner = trimesh.creation.icosphere(2), trimesh.creation.icosphere(2, radius=0.5)
    vertices = np.concatenate([outer.vertices, inner.vertices])
    faces = np.concatenate([outer.faces, np.asarray(inner.faces)[:, ::-1] + len(outer.vertices)])
    found = mended(part(vertices, faces))
    assert found.bodies_turned == 0
    assert volume_m3(found.part) == pytest.approx(outer.volume - inner.volume)


def test_open_surfaces_keep_their_side() -> None:
    grid = grid_part(3, 3)
    assert mended(grid).turned == 0
    assert mended(part(grid.vertices_m, grid.faces[:, ::-1])).turned == 0


def test_a_moebius_strip_has_no_winding_to_give_and_is_left_alone() -> None:
    around = np.linspace(0, 2 * np.pi, 41)[:-1]
    rows = []
    for side in (-0.3, 0.3):
        radius = 1 + side * np.cos(around / 2)
        rows.append(np.column_stack([radius * np.cos(around), radius * np.sin(around), side * np.sin(around / 2)]))
    here = np.arange(40)
    quads = [(i, i + 1, 40 + i + 1, 40 + i) if i < 39 else (i, 40, 0, 40 + i) for i in here]
    faces = np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))])
    assert mended(part(np.concatenate(rows), faces)).turned == 0


def test_missing_normals_are_made_when_asked_and_turned_parts_get_new_ones() -> None:
    box = of_mesh(trimesh.creation.box())
    assert mended(box).part.normals is None
    made = mended(box, make_normals=True)
    assert made.normals_made
    assert len(made.part.vertices_m) == 24
    ball = trimesh.creation.icosphere(2)
    stated = part(np.asarray(ball.vertices), np.asarray(ball.faces)[:, ::-1], normals=-np.asarray(ball.vertices))
    turned = mended(stated)
    assert turned.part.normals is not None
    assert np.all((turned.part.normals * turned.part.vertices_m).sum(axis=1) > 0.9)


def test_stated_normals_and_coordinates_survive() -> None:
    grid = grid_part(2, 2, normals=np.tile([0.6, 0.0, 0.8], (9, 1)))
    found = mended(grid).part
    assert found.normals is not None
    assert_allclose(found.normals, np.tile([0.6, 0.0, 0.8], (9, 1)), atol=1e-7)
    assert found.uv is not None
    assert_allclose(found.uv, found.vertices_m[:, :2], atol=1e-7)


def test_open_edges_are_counted_over_parts_together() -> None:
    ball = trimesh.creation.icosphere(2)
    half = np.asarray(ball.triangles_center)[:, 2] > 0
    top = part(np.asarray(ball.vertices), np.asarray(ball.faces)[half])
    rest = part(np.asarray(ball.vertices), np.asarray(ball.faces)[~half])
    assert not edges_of([top]).closed
    assert edges_of([top]).open == edges_of([rest]).open > 0
    assert edges_of([top, rest]).closed


def test_vertices_are_rounded_to_what_level_files_hold() -> None:
    found = mended(part(np.array([[0, 0, 0], [1 / 3, 0, 0], [0, 0.1, 0]]), np.array([[0, 1, 2]])))
    assert np.array_equal(found.part.vertices_m, found.part.vertices_m.astype(np.float32))
