"""Optical flow of motions whose pictures can be worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.labels import Labels, make_labels, optical_flow
from fullwell.radiometry import Spectrum
from fullwell.render import query_surfaces
from fullwell.scene import Camera, Cube, Diffuse, Film, Lens, Part, SceneDescription, SceneObject, look_at
from fullwell.scene.motion import Motion

ROWS, COLS, FOCAL_PX = 36, 48, 40.0
STEP_S = 0.1
RELATIVE = 1e-5
"""Depth is float32 (6e-8 relative), and so is the flow."""
X = np.arange(COLS) + 0.5 - COLS / 2
Y = (np.arange(ROWS) + 0.5 - ROWS / 2)[:, None]


def forward_camera(rows: int = ROWS) -> Camera:
    """Looks along +x from the origin: right in the picture is -y of the world, down is -z."""
    lens = Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0))
    pose = look_at(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    return Camera("main", pose, lens, Film(rows, COLS, 5e-3 / FOCAL_PX))


def wall(distance_m: float, rows: int = ROWS) -> Labels:
    """Labels of a wall across the view, which fills it: object `wall`, instance 1."""
    shape = (rows, COLS)
    depth = np.full(shape, distance_m, dtype=np.float32)
    ones, zeros = np.ones(shape, dtype=np.uint32), np.zeros(shape, dtype=np.float32)
    normals = np.zeros((*shape, 3), np.float32)
    return Labels(ones, ones.astype(np.uint16), depth, depth, normals, zeros + 1, (), (("wall", 1),), ("wall",))


def moving(x: float, y: float, z: float) -> Motion:
    return Motion(np.array([x, y, z]))


def flow_of(labels: Labels, motions: dict[str, Motion], camera: Camera | None = None, **more: object) -> np.ndarray:
    return optical_flow(labels, camera or forward_camera(), motions, interval_s=STEP_S, **more)  # type: ignore[arg-type]


def test_a_wall_that_moves_sideways_flows_by_f_v_t_over_z_everywhere() -> None:
    speed, distance = 3.0, 8.0
    flow = flow_of(wall(distance), {"wall": moving(0.0, -speed, 0.0)})
    assert flow[..., 0] == pytest.approx(np.full((ROWS, COLS), FOCAL_PX * speed * STEP_S / distance), rel=RELATIVE)
    assert np.all(flow[..., 1] == 0)


def test_a_wall_that_falls_flows_down() -> None:
    flow = flow_of(wall(8.0), {"wall": moving(0.0, 0.0, -2.0)})
    assert flow[..., 1] == pytest.approx(np.full((ROWS, COLS), FOCAL_PX * 0.2 / 8.0), rel=RELATIVE)


def test_an_approaching_wall_flows_outwards_from_the_middle() -> None:
    """A point at x pixels from the middle goes to x z / (z - v t)."""
    flow = flow_of(wall(10.0), {"wall": moving(-20.0, 0.0, 0.0)})
    growth = 10.0 / 8.0 - 1.0
    assert flow[..., 0] == pytest.approx(np.broadcast_to(growth * X, (ROWS, COLS)), rel=RELATIVE)
    assert flow[..., 1] == pytest.approx(np.broadcast_to(growth * Y, (ROWS, COLS)), rel=RELATIVE)


def test_a_camera_that_drives_forward_has_its_focus_of_expansion_in_the_middle() -> None:
    flow = flow_of(wall(10.0), {}, camera_motion=moving(20.0, 0.0, 0.0))
    assert flow == pytest.approx(flow_of(wall(10.0), {"wall": moving(-20.0, 0.0, 0.0)}), rel=RELATIVE)
    across = flow[..., 0] * Y - flow[..., 1] * X
    assert np.abs(across).max() < 1e-4, "every arrow points away from the middle"
    assert np.all(flow[..., 0] * X > 0)


def test_an_object_that_moves_with_the_camera_does_not_flow_at_all() -> None:
    motion = moving(13.7, 0.3, -0.1)
    assert np.all(flow_of(wall(7.3), {"wall": motion}, camera_motion=motion) == 0)
    turning = Motion(np.array([10.0, 1.0, 0.0]), 0.5, np.array([-3.0, 1.0, 0.0]))
    assert np.abs(flow_of(wall(7.3), {"wall": turning}, camera_motion=turning)).max() < 1e-6


def test_nothing_moves_where_nothing_moves() -> None:
    assert np.all(flow_of(wall(5.0), {"another": moving(1.0, 1.0, 1.0)}) == 0)


def test_what_will_be_behind_the_camera_has_no_flow() -> None:
    assert np.all(np.isnan(flow_of(wall(1.5), {"wall": moving(-20.0, 0.0, 0.0)})))


def sky() -> Labels:
    shape = (ROWS, COLS)
    depth = np.full(shape, np.inf, dtype=np.float32)
    nothing = np.zeros(shape, dtype=np.uint32)
    normals = np.zeros((*shape, 3), np.float32)
    return Labels(nothing, nothing.astype(np.uint16), depth, depth, normals, normals[..., 0] + 1, (), (), ())


def test_the_sky_stands_still_for_a_camera_that_only_drives() -> None:
    assert np.all(flow_of(sky(), {}, camera_motion=moving(30.0, 5.0, 0.0)) == 0)


def test_the_sky_turns_against_the_camera() -> None:
    """A camera that turns to the left sees a point at angle a from its axis at a + turn, further to the right."""
    rate = 0.8
    flow = flow_of(sky(), {}, camera_motion=Motion(np.zeros(3), rate, np.zeros(3)))
    expected = FOCAL_PX * np.tan(np.arctan(X / FOCAL_PX) + rate * STEP_S) - X
    # On the horizon, between the two middle rows; there is no row on it, so the nearest is taken.
    assert flow[ROWS // 2, :, 0] == pytest.approx(expected, abs=2e-3)


def test_without_a_sky_nothing_has_no_flow() -> None:
    assert np.all(np.isnan(flow_of(sky(), {}, has_sky=False)))


def test_a_turning_object_turns_about_its_pivot() -> None:
    """Of a wall that turns about the point straight ahead, that point stays and the two sides flow in depth only, at first."""
    pivot = np.array([10.0, 0.0, 0.0])
    rate = 0.5
    flow = flow_of(wall(10.0), {"wall": Motion(np.zeros(3), rate, pivot)})
    angle = rate * STEP_S
    # Right of the middle by r = 10 x / f: turning to the left takes it to (10 + r sin, r cos) ahead and to the right.
    right = 10.0 * X / FOCAL_PX
    expected = FOCAL_PX * right * np.cos(angle) / (10.0 + right * np.sin(angle)) - X
    assert flow[..., 0] == pytest.approx(np.broadcast_to(expected, (ROWS, COLS)), abs=1e-5)


def test_rows_are_worked_on_in_parts_without_a_seam() -> None:
    rows = 600
    flow = flow_of(wall(10.0, rows), {"wall": moving(-20.0, 0.0, 0.0)}, forward_camera(rows))
    assert flow.shape == (rows, COLS, 2)
    assert np.diff(flow[..., 1], axis=0) == pytest.approx(np.full((rows - 1, COLS), 0.25), abs=1e-4)


@pytest.mark.parametrize("interval_s", [0.0, -0.1, math.nan])
def test_an_interval_that_is_not_positive_is_refused(interval_s: float) -> None:
    with pytest.raises(FieldError, match=r"interval_s is .*; must be > 0"):
        optical_flow(wall(5.0), forward_camera(), {}, interval_s=interval_s)


# Against the labels of the scene a moment later --------------------------------------------------------------------------


def scene_at(time_s: float, motions: dict[str, Motion]) -> SceneDescription:
    places = {"ground": ((400.0, 400.0, 0.1), (0.0, 0.0, -1.5)), "car": ((4.0, 2.0, 1.5), (10.0, 1.0, -0.7))}
    objects = []
    for name, (size, place) in places.items():
        motion, pose = motions.get(name, Motion(np.zeros(3))), np.eye(4)
        at = np.array(place)
        pose[:3, 3] = at + motion.shift_m(at, time_s)
        pose[:3, :3] = motion.turn(time_s)
        objects.append(SceneObject(name, name, (Part(Cube(size), Diffuse(Spectrum.constant(0.5))),), pose))
    return SceneDescription(tuple(objects), semantic_classes=("car", "ground"))


def labels_at(time_s: float, motions: dict[str, Motion], camera_motion: Motion) -> tuple[Labels, Camera]:
    start = forward_camera()
    pose = start.camera_to_world.copy()
    pose[:3, 3] += camera_motion.shift_m(pose[:3, 3], time_s)
    pose[:3, :3] = camera_motion.turn(time_s) @ pose[:3, :3]
    camera = Camera("main", pose, start.lens, start.film)
    scene = scene_at(time_s, motions)
    return make_labels(scene, camera, query_surfaces(scene, camera)), camera


def test_flow_leads_to_the_same_surface_in_the_picture_a_moment_later() -> None:
    """Ego and car turn and drive: the later picture shows, where the flow leads, the surface point that the flow began at."""
    motions = {"car": Motion(np.array([6.0, -4.0, 0.0]), 1.2, np.array([10.0, 1.0, -1.45]))}
    ego = Motion(np.array([9.0, 1.0, 0.0]), 0.4, np.array([-1.5, 0.0, 0.0]))
    (before, camera), (after, later) = labels_at(0.0, motions, ego), labels_at(STEP_S, motions, ego)
    flow = flow_of(before, motions, camera, camera_motion=ego)
    table = {number: name for name, number in before.instance_table}
    rows, cols = np.mgrid[0:ROWS, 0:COLS]
    lands = np.floor(np.stack([cols, rows], axis=-1) + 0.5 + np.nan_to_num(flow, nan=-1e6)).astype(int)
    inside = (lands[..., 0] >= 0) & (lands[..., 0] < COLS) & (lands[..., 1] >= 0) & (lands[..., 1] < ROWS)
    checked = {"car": 0, "ground": 0}
    for row, col in np.argwhere(inside & (before.instances > 0)):
        x, y = lands[row, col]
        near = after.instances[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        if not np.all(near == before.instances[row, col]):  # at an edge, or hidden by then
            continue
        name = table[int(before.instances[row, col])]
        motion = motions.get(name, Motion(np.zeros(3)))
        point = _world(before, camera, row + 0.5, col + 0.5, float(before.depth_z_m[row, col]))
        point = point + motion.shift_m(point, STEP_S)
        seen = later.world_to_camera[:3, :3] @ point + later.world_to_camera[:3, 3]
        place = seen[:2] / seen[2] * FOCAL_PX + [COLS / 2, ROWS / 2]
        assert [col + 0.5 + flow[row, col, 0], row + 0.5 + flow[row, col, 1]] == pytest.approx(place, abs=1e-3)
        spread = np.ptp(after.depth_z_m[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2])
        assert abs(after.depth_z_m[y, x] - seen[2]) <= spread + 1e-3
        checked[name] += 1
    assert checked["car"] > 20
    assert checked["ground"] > 200


def _world(labels: Labels, camera: Camera, row: float, col: float, depth_m: float) -> np.ndarray:
    ray = np.array([(col - COLS / 2) / FOCAL_PX, (row - ROWS / 2) / FOCAL_PX, 1.0])
    return camera.camera_to_world[:3, :3] @ (depth_m * ray) + camera.camera_to_world[:3, 3]
