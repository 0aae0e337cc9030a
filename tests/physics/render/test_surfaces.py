"""Depth, identity and hidden extents against geometry that can be worked out by hand."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fullwell.core.errors import FieldError
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import query_surfaces, render_radiance
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
    Cube,
    Diffuse,
    Film,
    Lens,
    Part,
    Rectangle,
    SceneDescription,
    SceneObject,
    Sphere,
    look_at,
)

GREY = Diffuse(Spectrum.constant(0.5))


def camera(rows=48, cols=64) -> Camera:
    pitch = 2 * 5e-3 * np.tan(np.radians(20)) / cols
    lens = Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0))
    pose = look_at(np.array([0.0, -10.0, 0.0]), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    return Camera("main", pose, lens, Film(rows, cols, pitch))


def placed(name, geometry, x=0.0, y=0.0, z=0.0) -> SceneObject:
    to_world = np.eye(4)
    to_world[:3, 3] = [x, y, z]
    return SceneObject(name, "thing", (Part(geometry, GREY),), to_world)


def test_sphere_depth_is_the_distance_to_its_surface() -> None:
    hits = query_surfaces(SceneDescription((placed("ball", Sphere(1.0)),)), camera(rows=49, cols=65))
    assert hits.object_index[24, 32] == 0
    assert hits.range_m[24, 32] == pytest.approx(9.0, rel=1e-6)
    assert hits.object_index[0, 0] == -1
    assert np.isinf(hits.range_m[0, 0])
    assert hits.normal_camera[24, 32] == pytest.approx([0, 0, -1], abs=1e-5)


def test_right_in_the_world_is_right_in_the_image_and_up_is_up() -> None:
    scene = SceneDescription((placed("right", Sphere(0.3), x=2.0), placed("up", Sphere(0.3), z=1.5)))
    hits = query_surfaces(scene, camera())
    rows, cols = np.nonzero(hits.object_index == 0)
    assert cols.mean() > 40
    assert rows.mean() == pytest.approx(23.5, abs=0.5)
    rows, _ = np.nonzero(hits.object_index == 1)
    assert rows.mean() < 20


def test_hidden_pixels_count_for_the_hidden_object() -> None:
    front, back = placed("front", Cube((1, 0.1, 1)), y=-2.0), placed("back", Cube((4, 0.1, 3)), y=2.0)
    both = query_surfaces(SceneDescription((front, back)), camera())
    alone = query_surfaces(SceneDescription((back,)), camera())
    assert both.amodal_px[1] == alone.amodal_px[0] == np.count_nonzero(alone.object_index == 0)
    assert np.count_nonzero(both.object_index == 1) == both.amodal_px[1] - np.count_nonzero(both.object_index == 0)


def test_projected_size_agrees_with_the_pinhole_formula() -> None:
    view = camera(rows=480, cols=640)
    square = SceneObject("s", "", (Part(Rectangle((2.0, 2.0)), GREY),), look_at_plane())
    hits = query_surfaces(SceneDescription((square,)), view)
    side = 2.0 / 10.0 / view.tangent_pitch
    assert hits.amodal_px[0] == pytest.approx(side**2, rel=0.02)


def look_at_plane() -> np.ndarray:
    turned = np.eye(4)
    turned[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    return turned


QUERY = """
import sys; sys.path.insert(0, sys.argv[1])
import numpy as np
import test_surfaces as t
scene = t.SceneDescription((t.placed("a", t.Sphere(1.0)), t.placed("b", t.Cube((4, 0.1, 3)), y=2.0)))
hits = t.query_surfaces(scene, t.camera())
print((hits.object_index + 1).sum(), hits.amodal_px.tolist(), round(float(hits.range_m[np.isfinite(hits.range_m)].sum()), 1))
"""


@pytest.mark.slow
def test_scalar_and_compiled_queries_agree() -> None:
    def run(**variables: str) -> str:
        command = [sys.executable, "-c", QUERY, str(Path(__file__).parent)]
        return subprocess.run(command, env={**os.environ, **variables}, check=True, capture_output=True, text=True).stdout

    assert run(FULLWELL_VARIANT="scalar_spectral") == run()


@pytest.mark.parametrize("scale", [0.0, 2.0, float("nan")])
def test_camera_that_is_no_camera_is_refused_before_it_makes_a_wrong_picture(scale: float) -> None:
    good = camera()
    pose = good.camera_to_world.copy()
    pose[:3, :3] *= scale
    bad = Camera(good.name, pose, good.lens, good.film)
    scene = SceneDescription((placed("ball", Sphere(1.0)),), (ConstantEnvironment(Spectrum.constant(1.0)),))
    with pytest.raises(FieldError, match="camera_to_world"):
        query_surfaces(scene, bad)
    with pytest.raises(FieldError, match="camera_to_world"):
        render_radiance(scene, bad, WavelengthGrid(), samples_per_pixel=1, max_depth=2, seed=0)
