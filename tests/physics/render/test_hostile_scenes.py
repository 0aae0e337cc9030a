"""Every hostile scene ends in a correct image or in one clear error, and none takes the process with it."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hostile_scenes import HOSTILE, PAGE, POINT, Hostile, check, row, under, with_vertex
from test_analytic_scenes import camera, pytestmark  # noqa: F401

from fullwell.core.errors import FieldError
from fullwell.render import query_surfaces
from fullwell.scene import Camera, Film, Lens, SceneDescription
from fullwell.scene.validate import check_camera

HERE = Path(__file__).parent


SLOW = (
    "frosted glass of roughness 1",
    "fog of 1 m that only scatters, in a furnace",
    "flint glass in water",
    "principled metal of roughness 1",
    "closed furnace with glass, mirror and white",
)
"""Take more than two seconds."""


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=case.id, marks=pytest.mark.slow if case.id in SLOW else ())
        for case in HOSTILE
        if not case.may_kill
    ],
)
def test_hostile_scene_ends_in_a_correct_image_or_one_clear_error(case: Hostile) -> None:
    check(case)


def survives(*cases: Hostile) -> None:
    """Check cases in a process of their own, one after the other."""
    command = [sys.executable, str(HERE / "hostile_scenes.py"), *(case.id for case in cases)]
    ended = subprocess.run(command, env=dict(os.environ), check=False, capture_output=True, text=True)
    assert ended.stdout.splitlines() == [case.id for case in cases], "the last one that is named here ended the process"
    assert ended.returncode == 0, f"exit code {ended.returncode}: {ended.stderr[-2000:]}"


@pytest.mark.slow
@pytest.mark.parametrize("case", [pytest.param(case, id=case.id) for case in HOSTILE if case.may_kill and not case.refused])
def test_scene_that_might_kill_the_process_does_not(case: Hostile) -> None:
    survives(case)


def test_scenes_that_are_refused_lest_they_kill_the_process_do_not() -> None:
    survives(*(case for case in HOSTILE if case.may_kill and case.refused))


def test_surface_query_refuses_what_the_picture_refuses() -> None:
    shot = under(with_vertex(np.nan))
    with pytest.raises(FieldError, match=r"object 'thing', part 0: geometry\.vertices_m") as refusal:
        query_surfaces(SceneDescription(shot.objects, shot.lights), POINT)
    copy = pickle.loads(pickle.dumps(refusal.value))
    assert (copy.message, copy.path) == (refusal.value.message, "scene.objects[0].parts[0].geometry.vertices_m")


def bad_pose(change) -> Camera:
    pose = camera().camera_to_world.copy()
    change(pose)
    return replace(camera(), camera_to_world=pose)


def bad_lens(**changes) -> Camera:
    lens = camera().lens
    kept = {name: getattr(lens, name) for name in ("kind", "focal_length_m", "f_number", "focus_distance_m", "transmittance")}
    return replace(camera(), lens=Lens(**(kept | changes)))


@pytest.mark.parametrize(
    ("view", "words"),
    [
        (bad_pose(lambda pose: pose.fill(np.nan)), "finite"),
        (bad_pose(lambda pose: pose[:3, :3].fill(0.0)), "look_at"),
        (bad_pose(lambda pose: pose.__setitem__((slice(3), 0), -pose[:3, 0])), "look_at"),
        (bad_pose(lambda pose: pose.__setitem__((slice(3), slice(3)), 2 * pose[:3, :3])), "look_at"),
        (bad_lens(f_number=0.0), "f_number is 0.0"),
        (bad_lens(focal_length_m=np.nan), "focal_length_m is nan"),
        (bad_lens(focus_distance_m=1e-3), "focus_distance_m"),
        (replace(camera(), film=Film(0, 4, 1e-6)), "rows is 0"),
        (replace(camera(), film=Film(4, 4, 0.0)), "pitch_m is 0.0"),
        (replace(camera(), film=Film(100_000, 100_000, 1e-6)), "in pieces"),
        (replace(camera(), film=Film(4, 4, 1e-9)), "single precision"),
    ],
    ids=["NaN", "zero", "mirrored", "stretched", "f/0", "NaN focus", "near", "no rows", "no pitch", "huge", "too fine"],
)
def test_camera_that_makes_no_rays_is_refused(view: Camera, words: str) -> None:
    with pytest.raises(FieldError, match=words):
        check_camera(view)


def test_usual_cameras_are_not_refused() -> None:
    for view in (camera(), POINT):
        check_camera(view)


def test_page_lists_every_hostile_scene() -> None:
    page = PAGE.read_text().splitlines()
    assert [line for line in map(row, HOSTILE) if line not in page] == [], "run hostile_scenes.py --page"
    assert f"{len(HOSTILE)} scenes" in "\n".join(page)
    assert len({case.id for case in HOSTILE}) == len(HOSTILE) >= 60
