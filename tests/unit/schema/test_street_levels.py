"""Street assets at the level of detail that their cameras need."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_in_memory import small_car
from fullwell.assets.records import LevelRecord
from fullwell.schema.conversion.traffic import Viewpoint, _level
from fullwell.traffic.placement import PlacedAsset

AHEAD = Viewpoint((0.0, 0.0, 1.5), 1e-3, (1.0, 0.0, 0.0), math.radians(30))


def car_at(x_m: float, y_m: float = 0.0) -> PlacedAsset:
    manifest = small_car("sedan-a").manifest
    levels = tuple(LevelRecord(1000 - 100 * n, "0" * 64, 1, error_m) for n, error_m in enumerate((0.0, 0.008, 0.03, 0.2)))
    return PlacedAsset("c", replace(manifest, levels=levels), "mover", np.array([x_m, y_m, 0.0]), 0.0)


@pytest.mark.parametrize(
    ("place", "level"),
    [
        ((8, 0), 0),  # 0.7 px of 1 mrad at 8 m are 5.6 mm
        ((20, 0), 1),  # 14 mm
        ((60, 0), 2),  # 42 mm
        ((400, 0), 3),
        ((-8, 0), 1),  # out of view four times as much: 22 mm
        ((-20, 0), 2),  # 56 mm
        ((-60, 0), 2),  # 168 mm
        ((-80, 0), 3),
    ],
)
def test_the_coarsest_level_is_taken_whose_error_cannot_be_seen(place: tuple[float, float], level: int) -> None:
    item = car_at(*place)
    assert _level(item, [math.hypot(*place)], [AHEAD]) == level


def test_the_camera_that_sees_it_decides() -> None:
    back = replace(AHEAD, forward=(-1.0, 0.0, 0.0))
    assert _level(car_at(-20), [20.0, 20.0], [AHEAD, back]) == 1
    finer = replace(back, pixel_rad=1e-4)
    assert _level(car_at(-20), [20.0, 20.0], [AHEAD, finer]) == 0


@pytest.mark.parametrize(
    ("centre", "seen"),
    [
        ((10.0, 0.0, 1.5), True),
        ((-10.0, 0.0, 1.5), False),
        ((-1.0, 0.0, 1.5), True),  # it stands in it
        ((10.0 * math.cos(math.radians(45)), 10.0 * math.sin(math.radians(45)), 1.5), True),  # 30 + 5 + 11.5 degrees
        ((10.0 * math.cos(math.radians(48)), 10.0 * math.sin(math.radians(48)), 1.5), False),
    ],
)
def test_what_may_be_in_the_picture(centre: tuple[float, float, float], *, seen: bool) -> None:
    assert AHEAD.may_see(np.array(centre), 2.0) is seen


def test_cameras_say_where_they_look(recipe: dict[str, Any], tmp_path: Path) -> None:
    from fullwell.schema import build_frame, load_recipe
    from fullwell.schema.building import _viewpoints

    frame = build_frame(load_recipe(recipe))
    (view,) = _viewpoints(frame.cameras)
    camera = frame.cameras[0].camera
    rays = (
        camera.camera_to_world[:3, :3]
        @ np.array(
            [
                [x * camera.film.cols / 2 * camera.tangent_pitch, y * camera.film.rows / 2 * camera.tangent_pitch, 1.0]
                for x in (-1, 1)
                for y in (-1, 1)
            ]
        ).T
    )
    angles = np.arccos(np.array(view.forward) @ (rays / np.linalg.norm(rays, axis=0)))
    np.testing.assert_allclose(angles, view.half_angle_rad, rtol=1e-9)
