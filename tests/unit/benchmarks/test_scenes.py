"""The benchmark scenes: sound meshes, the numbers of things they promise, the same bytes every time."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))  # benchmarks/ is no part of the distribution

from benchmarks.scenes import build_frame, meshes, write_recipe  # noqa: E402
from benchmarks.scenes.vehicles import BODIES, car_parts  # noqa: E402

SIZE = (32, 24)
CHORD_TOLERANCE = 0.02
"""Relative volume that chords of 48 segments cut off a ball: 1 - (sin(x) / x) in three directions, x = pi / 24."""


def _volume_m3(mesh: meshes.Triangles) -> float:
    corners = mesh.vertices_m[mesh.faces]
    return float(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6)


def test_a_box_has_its_volume_and_flat_normals() -> None:
    box = meshes.block((2, 3, 4), (5, 6, 7))
    assert _volume_m3(box) == pytest.approx(24, rel=1e-9)
    assert len(box.vertices_m) == 24
    assert sorted(np.abs(box.normals).max(axis=1)) == pytest.approx([1.0] * 24)


def test_the_sides_of_a_box_face_outwards() -> None:
    assert _volume_m3(meshes.quads(meshes.box_quads((1, 2, 3), (2, 4, 6)))) == pytest.approx(6, rel=1e-9)


def test_an_ellipsoid_has_its_volume_and_smooth_normals_outwards() -> None:
    ball = meshes.ellipsoid((1, 2, 3), segments=48)
    assert _volume_m3(ball) == pytest.approx(4 / 3 * math.pi * 6, rel=CHORD_TOLERANCE)
    assert np.all(np.einsum("ij,ij->i", ball.normals, ball.vertices_m) > 0)


def test_a_tube_is_closed_and_turns_its_outside_out() -> None:
    tube = meshes.tube([(0, 0, 0), (1, 1, 1), (2, 2, 2)], (0.1, 0.1, 0.1), segments=64)
    length = 2 * 3**0.5
    assert _volume_m3(tube) == pytest.approx(math.pi * 0.01 * length, rel=CHORD_TOLERANCE)


@pytest.mark.parametrize("body", sorted(BODIES))
def test_a_car_keeps_to_its_measures(body: str) -> None:
    parts, plan = car_parts(BODIES[body]), BODIES[body]
    for mesh in parts.values():
        assert np.all(np.isfinite(mesh.vertices_m))
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
    extent = np.ptp(parts["paint"].vertices_m, axis=0)
    assert extent[0] == pytest.approx(plan.length_m, rel=0.01)
    assert extent[2] < plan.height_m
    assert parts["tyre"].vertices_m[:, 2].min() == pytest.approx(0.0, abs=2e-3)


def _counts(frame: Any) -> tuple[int, dict[str, int], dict[str, int]]:
    triangles, lamps, classes = 0, {}, {}
    for item in frame.scene.objects:
        classes[item.semantic_class] = classes.get(item.semantic_class, 0) + 1
        for part in item.parts:
            triangles += len(getattr(part.geometry, "faces", ()))
            if part.emission is not None:
                lamps[part.emission.group] = lamps.get(part.emission.group, 0) + 1
    return triangles, lamps, classes


@pytest.mark.slow
def test_the_street_by_day_has_its_traffic_and_trees(tmp_path: Path) -> None:
    triangles, lamps, classes = _counts(build_frame("street_day", tmp_path, size=SIZE))
    assert 200_000 <= triangles <= 510_000
    assert not lamps
    assert (classes["car"], classes["tree"], classes["person"]) == (27, 30, 16)


@pytest.mark.slow
def test_the_street_by_night_has_its_lamps(tmp_path: Path) -> None:
    _, lamps, classes = _counts(build_frame("street_night", tmp_path, size=SIZE))
    assert lamps["streetlights"] == 40
    assert lamps["windows"] >= 60
    assert lamps["headlights"] == 44
    assert classes["building"] >= 10


@pytest.mark.slow
def test_the_car_park_has_its_lamps_and_cars(tmp_path: Path) -> None:
    _, lamps, classes = _counts(build_frame("car_park", tmp_path, size=SIZE))
    assert lamps["lamps"] == 60
    assert classes["car"] == 40


@pytest.mark.parametrize(
    "name", ["cornell_box", "colorchecker", "tabletop_glass", pytest.param("street_night", marks=pytest.mark.slow)]
)
def test_a_scene_is_the_same_every_time(name: str, tmp_path: Path) -> None:
    for folder in ("a", "b"):
        write_recipe(name, tmp_path / folder, size=SIZE)
    first, second = (sorted((tmp_path / folder).iterdir()) for folder in ("a", "b"))
    assert [path.name for path in first] == [path.name for path in second]
    assert all(one.read_bytes() == other.read_bytes() for one, other in zip(first, second, strict=True))
