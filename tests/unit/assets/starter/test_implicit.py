"""Implicit surfaces: volumes of known solids, closed and outward meshes, blends, cuts."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.assets.starter.implicit import Clipped, Cut, Limb, ball, blob, mesh, ruffled
from fullwell.assets.starter.shapes import Shape

X = np.array([1.0, 0.0, 0.0])
Z = np.array([0.0, 0.0, 1.0])


def volume_m3(shape: Shape) -> float:
    a, b, c = np.moveaxis(shape.vertices_m[shape.faces], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def is_closed(shape: Shape) -> bool:
    edges = np.concatenate([shape.faces[:, [0, 1]], shape.faces[:, [1, 2]], shape.faces[:, [2, 0]]])
    pairs = {tuple(edge) for edge in edges.tolist()}
    return len(pairs) == len(edges) and all((b, a) in pairs for a, b in pairs)


def rod(**changes: object) -> Limb:
    bone = Limb(np.zeros(3), 0.5 * Z, X, (0.0, 1.0), (0.1, 0.1), (0.05, 0.05), flat_start=True, flat_end=True)
    return Limb(**{name: getattr(bone, name) for name in bone.__slots__} | changes)  # type: ignore[arg-type]


def test_a_ball_has_its_volume_and_faces_outwards() -> None:
    shape = mesh([[ball([0.2, -0.1, 0.3], 0.15)]], cell_m=0.01, blend_m=0.0)
    assert volume_m3(shape) == pytest.approx(4 / 3 * np.pi * 0.15**3, rel=0.02)
    assert is_closed(shape)
    assert shape.normals is not None
    away = shape.vertices_m - [0.2, -0.1, 0.3]
    assert ((shape.normals * away).sum(axis=1) / np.linalg.norm(away, axis=1)).min() > 0.97


def test_an_ellipsoid_reaches_as_far_as_its_axes() -> None:
    shape = mesh([[blob(np.zeros(3), [0.3, 0.1, 0.2])]], cell_m=0.01, blend_m=0.0)
    assert np.allclose(np.abs(shape.vertices_m).max(axis=0), [0.3, 0.1, 0.2], atol=0.004)


def test_a_limb_is_an_elliptic_cylinder_cut_square() -> None:
    shape = mesh([[rod()]], cell_m=0.008, blend_m=0.0)
    assert volume_m3(shape) == pytest.approx(np.pi * 0.1 * 0.05 * 0.5, rel=0.03)
    # Across the front lies the width, along it the depth.
    assert np.ptp(shape.vertices_m[:, 1]) == pytest.approx(0.2, abs=0.006)
    assert np.ptp(shape.vertices_m[:, 0]) == pytest.approx(0.1, abs=0.006)


def test_a_grown_limb_is_thicker_by_the_length_told() -> None:
    shape = mesh([[rod().grown(0.03)]], cell_m=0.008, blend_m=0.0)
    assert np.ptp(shape.vertices_m[:, 1]) == pytest.approx(0.26, abs=0.006)


def test_a_stretch_of_a_limb_lies_on_the_limb() -> None:
    part = rod().upto(0.6, start=0.2, flat_start=True)
    shape = mesh([[part]], cell_m=0.008, blend_m=0.0)
    assert shape.vertices_m[:, 2].min() == pytest.approx(0.1, abs=0.005)
    assert shape.vertices_m[:, 2].max() == pytest.approx(0.3, abs=0.005)
    assert np.ptp(shape.vertices_m[:, 1]) == pytest.approx(0.2, abs=0.006)


def test_blending_fills_the_fold_within_a_group_but_not_between_groups() -> None:
    pair = [ball([0.0, 0, 0], 0.1), ball([0.17, 0, 0], 0.1)]
    melted = mesh([pair], cell_m=0.01, blend_m=0.08)
    apart = mesh([[pair[0]], [pair[1]]], cell_m=0.01, blend_m=0.08)
    assert volume_m3(melted) > 1.01 * volume_m3(apart)
    assert is_closed(melted)


def test_a_cut_through_the_middle_halves_a_ball_and_closes_it() -> None:
    half = mesh([[ball(np.zeros(3), 0.15)]], cell_m=0.01, blend_m=0.0, cuts=[Cut(np.zeros(3), Z)])
    assert volume_m3(half) == pytest.approx(2 / 3 * np.pi * 0.15**3, rel=0.03)
    assert half.vertices_m[:, 2].max() < 0.003
    assert is_closed(half)
    clipped = mesh([[Clipped(ball(np.zeros(3), 0.15), (Cut(np.zeros(3), Z),))]], cell_m=0.01, blend_m=0.0)
    assert volume_m3(clipped) == pytest.approx(volume_m3(half), rel=0.01)


def test_carving_takes_the_overlap_away() -> None:
    whole, bite = ball(np.zeros(3), 0.15), ball([0.15, 0, 0], 0.08)
    carved = mesh([[whole]], cell_m=0.008, blend_m=0.0, carved=[bite])
    assert volume_m3(carved) < 0.97 * volume_m3(mesh([[whole]], cell_m=0.008, blend_m=0.0))
    assert np.linalg.norm(carved.vertices_m - [0.15, 0, 0], axis=1).min() > 0.07


def test_searching_only_where_the_cuts_leave_something_changes_nothing() -> None:
    cuts = [Cut(0.03 * Z, Z), Cut(-0.03 * Z, -Z)]
    near = np.array([[-0.2, -0.2, -0.03], [0.2, 0.2, 0.03]])
    whole = mesh([[ball(np.zeros(3), 0.15)]], cell_m=0.01, blend_m=0.0, cuts=cuts)
    short = mesh([[ball(np.zeros(3), 0.15)]], cell_m=0.01, blend_m=0.0, cuts=cuts, within_m=near)
    assert volume_m3(short) == pytest.approx(volume_m3(whole), rel=0.02)
    assert is_closed(short)


def test_ruffles_move_vertices_along_their_normals() -> None:
    shape = mesh([[ball(np.zeros(3), 0.15)]], cell_m=0.01, blend_m=0.0)
    grown = ruffled(shape, np.full(len(shape.vertices_m), 0.01))
    assert np.allclose(np.linalg.norm(grown.vertices_m, axis=1).mean(), 0.16, atol=0.001)
    with pytest.raises(ValueError, match="normals"):
        ruffled(shape.flat(), np.zeros(len(shape.vertices_m)))
