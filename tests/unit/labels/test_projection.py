"""Lines and rings in the picture: where they are seen, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from fullwell.labels.projection import line_px, ring_px
from fullwell.radiometry import Spectrum
from fullwell.scene import Camera, Film, Lens, look_at

ROWS, COLS, FOCAL_PX = 48, 64, 50.0
HEIGHT_M = 1.5


def forward_camera() -> Camera:
    """Looks along +x, 1.5 m above the ground: the horizon is at row 24, y is to the left."""
    lens = Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0))
    pose = look_at(np.array([0.0, 0.0, HEIGHT_M]), np.array([1.0, 0.0, HEIGHT_M]), np.array([0.0, 0.0, 1.0]))
    return Camera("main", pose, lens, Film(ROWS, COLS, 5e-3 / FOCAL_PX))


def seen_at(x: float, y: float) -> tuple[float, float]:
    """Where a point on the ground is seen, by hand."""
    return COLS / 2 - FOCAL_PX * y / x, ROWS / 2 + FOCAL_PX * HEIGHT_M / x


def test_corners_of_a_line_in_view_are_where_they_project() -> None:
    line = np.array([[10.0, 1.0, 0.0], [20.0, -2.0, 0.0], [30.0, 0.0, 0.0]])
    (piece,) = line_px(line, forward_camera())
    assert piece == pytest.approx(np.array([seen_at(10, 1), seen_at(20, -2), seen_at(30, 0)]))


def test_a_lane_that_passes_under_the_camera_begins_at_the_edge_of_the_picture() -> None:
    (piece,) = line_px(np.array([[-50.0, 0.0, 0.0], [100.0, 0.0, 0.0]]), forward_camera())
    assert piece[0] == pytest.approx([COLS / 2, ROWS])
    assert piece[1] == pytest.approx(seen_at(100, 0))


def test_a_line_that_leaves_and_returns_has_two_parts() -> None:
    line = np.array([[20.0, 0.0, 0.0], [20.0, 40.0, 0.0], [30.0, 40.0, 0.0], [30.0, 0.0, 0.0]])
    first, second = line_px(line, forward_camera())
    assert first[0] == pytest.approx(seen_at(20, 0))
    assert first[-1, 0] == pytest.approx(0.0, abs=1e-9)
    assert second[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert second[-1] == pytest.approx(seen_at(30, 0))


def test_what_is_behind_the_camera_is_not_seen() -> None:
    behind = np.array([[-10.0, -1.0, 0.0], [-20.0, 1.0, 0.0], [-30.0, 0.0, 0.0]])
    assert line_px(behind, forward_camera()) == []
    assert ring_px(behind, forward_camera()) is None


def test_a_rectangle_on_the_ground_becomes_a_trapezium() -> None:
    corners = [(10.0, 1.0), (10.0, -1.0), (20.0, -1.0), (20.0, 1.0)]
    ring = ring_px(np.array([[x, y, 0.0] for x, y in corners]), forward_camera())
    assert ring == pytest.approx(np.array([seen_at(x, y) for x, y in corners]))


def test_ground_without_end_fills_the_picture_below_the_horizon() -> None:
    far = 1e6
    ring = ring_px(np.array([[-far, -far, 0.0], [far, -far, 0.0], [far, far, 0.0], [-far, far, 0.0]]), forward_camera())
    assert ring is not None
    assert shapely.Polygon(ring).area == pytest.approx(COLS * ROWS / 2, rel=1e-3)
    assert ring.min() >= -1e-9
    assert ring[:, 0].max() <= COLS + 1e-9
    assert ring[:, 1].max() <= ROWS + 1e-9


def test_a_ring_covers_the_pixels_whose_rays_meet_it() -> None:
    """Of any polygon on the ground, also one that the picture's edge cuts in two."""
    rng = np.random.default_rng(5)
    camera = forward_camera()
    rows, cols = np.mgrid[ROWS // 2 + 1 : ROWS, 0:COLS]
    x = FOCAL_PX * HEIGHT_M / (rows + 0.5 - ROWS / 2)
    y = -(cols + 0.5 - COLS / 2) * x / FOCAL_PX
    for _ in range(20):
        angles = np.sort(rng.uniform(0, 2 * np.pi, 9))
        radii = rng.uniform(1.0, 12.0, 9)
        flat = np.stack([6 + radii * np.cos(angles), radii * np.sin(angles)], axis=1)
        ring = ring_px(np.column_stack([flat, np.zeros(9)]), camera)
        meets = shapely.contains_xy(shapely.Polygon(flat).buffer(0), x, y)
        covers = np.zeros_like(meets) if ring is None else shapely.contains_xy(_filled(ring), cols + 0.5, rows + 0.5)
        assert np.array_equal(meets, covers)


def _filled(ring: np.ndarray) -> shapely.Geometry:
    """The even-odd interior of a ring whose parts are joined along an edge."""
    return shapely.make_valid(shapely.Polygon(ring))
