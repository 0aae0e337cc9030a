"""Areas to parts of a pixel, seen and hidden, against outlines whose area is known."""

from __future__ import annotations

import numpy as np
import pytest
from test_surfaces import GREY, camera, look_at_plane, placed

from fullwell.core.errors import FieldError
from fullwell.render import choose_variant, query_surfaces
from fullwell.render.subpixel import sample_offsets
from fullwell.render.surfaces import query_depth
from fullwell.scene import Cube, Cylinder, Disk, Mesh, Part, Rectangle, SceneDescription, SceneObject, Sphere

pytestmark = pytest.mark.skipif(not choose_variant().variant.startswith("llvm"), reason="needs the compiled renderer")

POINTS = 17
"""Sample points per pixel at the default of 16 further rays."""

UPRIGHT_EDGE_PX = 0.5 / POINTS
"""An upright or level edge is seen to half the distance of its samples."""

SLANTED_AREA = 2e-3
"""Relative error of an outline that meets the samples in all ways: their errors cancel."""

POLYGON_PX = 4
"""Pixel centres by which a circle and its 128 chords may differ at the sizes of these tests."""


def facing(name, geometry, x=0.0, y=0.0, z=0.0) -> SceneObject:
    """Return the geometry with its xy plane towards the camera."""
    to_world = look_at_plane()
    to_world[:3, 3] = [x, y, z]
    return SceneObject(name, "thing", (Part(geometry, GREY),), to_world)


def pixel_m(view) -> float:
    """Return the size of a pixel in the plane 10 m ahead."""
    return 10.0 * view.tangent_pitch


WALL = placed("wall", Cube((100, 0.1, 100)), y=5.0)


def test_area_of_a_disk_is_that_of_its_circle() -> None:
    view = camera(rows=96, cols=128)
    radius_px = 20.3
    for background in ((), (WALL,)):
        hits = query_surfaces(SceneDescription((facing("disk", Disk(radius_px * pixel_m(view))), *background)), view)
        assert hits.visible_area_px[0] == pytest.approx(np.pi * radius_px**2, rel=SLANTED_AREA)
        assert hits.amodal_area_px[0] == pytest.approx(np.pi * radius_px**2, rel=SLANTED_AREA)


def test_area_of_a_sphere_is_that_of_the_ellipse_it_projects_to() -> None:
    view = camera(rows=96, cols=128)
    hits = query_surfaces(SceneDescription((placed("ball", Sphere(1.0)),)), view)
    radius_px = np.tan(np.arcsin(1.0 / 10.0)) / view.tangent_pitch
    assert hits.visible_area_px[0] == pytest.approx(np.pi * radius_px**2, rel=SLANTED_AREA)
    assert hits.amodal_area_px[0] == pytest.approx(hits.visible_area_px[0], rel=SLANTED_AREA)


@pytest.mark.parametrize("shift_px", [0.0, 0.12, 0.31, 0.5, 0.77])
@pytest.mark.parametrize("size_px", [(10.4, 7.7), (3.1, 0.8)])
def test_rectangle_keeps_its_area_wherever_it_lies_among_the_pixels(shift_px: float, size_px: tuple[float, float]) -> None:
    view = camera(rows=96, cols=128)
    size = pixel_m(view)
    card = facing("card", Rectangle((size_px[0] * size, size_px[1] * size)), x=shift_px * size, z=0.6 * shift_px * size)
    hits = query_surfaces(SceneDescription((card, WALL)), view)
    tolerance = 2 * UPRIGHT_EDGE_PX * sum(size_px)
    assert hits.visible_area_px[0] == pytest.approx(size_px[0] * size_px[1], abs=tolerance)
    assert hits.amodal_area_px[0] == pytest.approx(hits.visible_area_px[0], abs=1e-9)
    assert hits.visible_area_px.sum() == pytest.approx(96 * 128, abs=1e-6)


@pytest.mark.parametrize("background", [(), (WALL,)])
def test_pole_between_the_pixel_centres_has_an_area_and_no_pixel(background: tuple[SceneObject, ...]) -> None:
    view = camera(rows=96, cols=128)
    width_px, height_px = 0.3, 60.0
    pole = facing("pole", Rectangle((width_px * pixel_m(view), height_px * pixel_m(view))), x=0.02 * pixel_m(view))
    hits = query_surfaces(SceneDescription((pole, *background)), view)
    assert hits.amodal_px[0] == np.count_nonzero(hits.object_index == 0) == 0
    assert hits.visible_area_px[0] == pytest.approx(width_px * height_px, abs=2 * UPRIGHT_EDGE_PX * height_px)
    assert hits.coverage[48, 64] == pytest.approx(1 - hits.visible_area_px[0] / height_px / 2, abs=0.1)


@pytest.mark.parametrize("slope", [0.0, 0.02, 0.1, 1.0])
def test_leaning_pole_is_followed_through_the_rows_that_it_crosses_between_centres(slope: float) -> None:
    view = camera(rows=96, cols=128)
    width_px, height_px = 0.3, 80.0
    size = pixel_m(view)
    corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]) * [width_px, height_px, 1]
    corners[:, 0] += corners[:, 1] * slope + 0.4
    pole = facing("pole", Mesh(corners * size, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)))
    hits = query_surfaces(SceneDescription((pole, WALL)), view)
    assert hits.visible_area_px[0] == pytest.approx(width_px * height_px, rel=0.5 / POINTS / width_px if slope == 0 else 0.03)
    assert hits.visible_area_px[0] == pytest.approx(hits.amodal_area_px[0], rel=0.03)


def test_coverage_is_the_share_of_the_pixel_that_shows_what_its_centre_shows() -> None:
    view = camera(rows=48, cols=64)
    edge_px = 0.3
    screen = facing("screen", Rectangle((200.0, 200.0)), x=100.0 + edge_px * pixel_m(view))
    hits = query_surfaces(SceneDescription((screen, WALL)), view)
    assert np.all(np.delete(hits.coverage, 32, axis=1) == 1.0)
    assert hits.object_index[24, 32] == 0
    assert hits.coverage[:, 32] == pytest.approx(1 - edge_px, abs=UPRIGHT_EDGE_PX)


def test_hidden_half_counts_to_parts_of_a_pixel() -> None:
    view = camera(rows=96, cols=128)
    size = pixel_m(view)
    card = facing("card", Rectangle((20.4 * size, 11.0 * size)))
    screen = facing("screen", Rectangle((40.0 * size, 40.0 * size)), x=-20.0 * size + 3.3 * size, y=-1e-3)
    hits = query_surfaces(SceneDescription((card, screen, WALL)), view)
    assert hits.amodal_area_px[0] == pytest.approx(20.4 * 11.0, abs=2 * UPRIGHT_EDGE_PX * 31.4)
    assert hits.visible_area_px[0] == pytest.approx((10.2 - 3.3) * 11.0, abs=2 * UPRIGHT_EDGE_PX * 18)


def random_objects(rng: np.random.Generator) -> list[SceneObject]:
    made = []
    for number in range(24):
        size = float(rng.uniform(0.3, 1.2))
        triangles = Mesh(rng.normal(size=(9, 3)) * size, rng.permutation(9).reshape(3, 3).astype(np.uint32))
        geometry = (Sphere(size), Disk(size), Cylinder(size / 2, 2 * size), Cube((size, size, size)), triangles)[number % 5]
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        item = placed(str(number), geometry, *rng.uniform([-4, -11, -3], [4, 8, 3]))
        item.to_world[:3, :3] = turn * np.linalg.det(turn)
        made.append(item)
    return made


def test_every_object_reaches_as_far_as_it_is_seen_when_it_stands_alone() -> None:
    view = camera(rows=96, cols=128)
    objects = random_objects(np.random.default_rng(5))
    together = query_surfaces(SceneDescription(tuple(objects)), view)
    assert np.count_nonzero(together.amodal_px) > 15
    for index, item in enumerate(objects):
        alone = query_surfaces(SceneDescription((item,)), view)
        seen = np.count_nonzero(alone.object_index == 0)
        assert together.amodal_px[index] == pytest.approx(seen, abs=POLYGON_PX), item.parts[0].geometry
        assert together.amodal_area_px[index] == pytest.approx(alone.visible_area_px[0], abs=POLYGON_PX)


def test_ground_goes_on_under_a_box_that_stands_on_it() -> None:
    view = camera(rows=96, cols=128)
    corners = np.array([[-20.0, -30, -1], [20, -30, -1], [20, 30, -1], [-20, 30, -1]])
    ground = SceneObject("ground", "", (Part(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)), GREY),))
    alone = query_surfaces(SceneDescription((ground,)), view)
    box = placed("box", Cube((1.5, 1.5, 1.5)), z=-0.25)
    both = query_surfaces(SceneDescription((ground, box)), view)
    assert both.amodal_px[0] == alone.amodal_px[0] == np.count_nonzero(alone.object_index == 0)


def test_triangles_that_meet_at_pixel_centres_leave_no_cracks() -> None:
    view = camera(rows=48, cols=64)
    size = pixel_m(view)
    lines = np.arange(-40, 41) + 0.5
    x, y = np.meshgrid(lines, lines)
    corners = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1) * size
    first = (np.arange(80)[:, None] * 81 + np.arange(80)).ravel()
    faces = np.concatenate([np.stack([first, first + 1, first + 82], 1), np.stack([first, first + 82, first + 81], 1)])
    net = facing("net", Mesh(corners, faces.astype(np.uint32)))
    hits = query_surfaces(SceneDescription((facing("screen", Rectangle((99.0, 99.0)), y=-1.0), net)), view)
    assert hits.amodal_area_px[1] == pytest.approx(48 * 64, abs=1e-9)


def test_view_from_within_a_sphere_and_from_within_a_crowd_of_triangles() -> None:
    view = camera()
    around = placed("around", Sphere(3.0), y=-10.0)
    crossing = placed("crossing", Cube((0.21, 30.0, 0.2)), x=0.017, z=-0.4)
    hits = query_surfaces(SceneDescription((around, crossing)), view)
    assert hits.amodal_px[0] == 48 * 64
    alone = query_surfaces(SceneDescription((crossing,)), view)
    assert hits.amodal_px[1] == np.count_nonzero(alone.object_index == 0) > 0


def test_another_scene_of_the_same_kinds_compiles_nothing() -> None:
    import drjit as dr

    def run(seed: int) -> list[bool]:
        rng = np.random.default_rng(seed)
        scene = SceneDescription((*random_objects(rng), WALL)[: 10 + 3 * seed])
        dr.set_flag(dr.JitFlag.KernelHistory, True)
        try:
            dr.kernel_history_clear()
            query_surfaces(scene, camera(rows=40 + seed, cols=50 + 3 * seed))
            return [bool(entry["cache_hit"]) for entry in dr.kernel_history([dr.KernelType.JIT])]
        finally:
            dr.set_flag(dr.JitFlag.KernelHistory, False)

    run(0)
    for seed in range(1, 5):
        assert all(run(seed))


def test_scene_is_loaded_once_for_picture_and_labels(monkeypatch: pytest.MonkeyPatch) -> None:
    from fullwell.radiometry import WavelengthGrid
    from fullwell.render import render_radiance
    from fullwell.render.transport import loading

    loads = []
    collect = loading.collect_surfaces
    monkeypatch.setattr(loading, "collect_surfaces", lambda *arguments: loads.append(1) or collect(*arguments))
    scene = SceneDescription((placed("ball", Sphere(1.0)),))
    render_radiance(scene, camera(), WavelengthGrid(), samples_per_pixel=4, max_depth=2, seed=0)
    query_surfaces(scene, camera(rows=20))
    query_depth(scene, camera())
    assert len(loads) == 1
    query_surfaces(SceneDescription(scene.objects), camera())
    assert len(loads) == 2


def test_depth_alone_is_the_depth_of_the_full_query() -> None:
    view = camera(rows=40, cols=56)
    scene = SceneDescription((placed("ball", Sphere(1.0)), placed("cube", Cube((1, 1, 1)), x=1.2)))
    depth = query_depth(scene, view)
    hits = query_surfaces(scene, view)
    assert depth[20, 28] == pytest.approx(9.0, rel=1e-3)
    assert np.array_equal(np.isinf(depth), np.isinf(hits.range_m))
    assert np.all(depth <= hits.range_m)


def test_empty_scene_shows_nothing() -> None:
    hits = query_surfaces(SceneDescription(()), camera())
    assert np.all(hits.object_index == -1)
    assert np.all(hits.coverage == 1.0)
    assert len(hits.amodal_area_px) == 0


@pytest.mark.parametrize("count", [2, 4, 16, 36])
def test_samples_of_a_pixel_stand_apart_and_evenly(count: int) -> None:
    points = np.append(sample_offsets(count), [[0.0, 0.0]], axis=0)
    assert points.mean(axis=0) == pytest.approx([0, 0], abs=1e-12)
    for axis in points.T:
        assert np.diff(np.sort(axis)) == pytest.approx(np.full(count, 1 / (count + 1)))


@pytest.mark.parametrize("count", [0, 1, 7, -2])
def test_odd_numbers_of_further_rays_are_refused(count: int) -> None:
    with pytest.raises(FieldError, match="subsamples"):
        query_surfaces(SceneDescription(()), camera(), subsamples=count)


def many_triangles(rows: int, x: float, y: float, name: str) -> SceneObject:
    """Return a sheet of 2 (rows - 1)^2 triangles."""
    side = np.linspace(-1.0, 1.0, rows)
    vertices = np.stack([*np.meshgrid(side, side), np.zeros((rows, rows))], axis=-1).reshape(-1, 3)
    corner = np.arange(rows * rows).reshape(rows, rows)[:-1, :-1].ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + rows], 1), np.stack([corner + 1, corner + rows + 1, corner + rows], 1)]
    )
    return facing(name, Mesh(vertices, faces), x=x, y=y)


def test_what_is_out_of_view_of_a_large_scene_changes_nothing() -> None:
    near, half_hidden = facing("near", Disk(0.5), x=0.3), facing("far", Rectangle((2.0, 1.0)), y=3.0)
    behind = many_triangles(400, 0.0, -60.0, "behind")
    assert 2 * 399**2 > 1 << 18
    small = query_surfaces(SceneDescription((near, half_hidden, WALL)), camera())
    large = query_surfaces(SceneDescription((behind, near, behind, half_hidden, WALL)), camera())
    assert np.array_equal(large.object_index, np.array([1, 3, 4, -1])[small.object_index])
    for name in ("range_m", "normal_camera", "coverage"):
        assert np.array_equal(getattr(large, name), getattr(small, name))
    for name in ("amodal_px", "visible_area_px", "amodal_area_px"):
        assert np.array_equal(getattr(large, name)[[1, 3, 4]], getattr(small, name))
        assert np.all(getattr(large, name)[[0, 2]] == 0)


def test_error_in_a_large_scene_names_the_object_where_it_stands() -> None:
    broken = facing("broken", Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]])))
    scene = SceneDescription((many_triangles(400, 0.0, -60.0, "behind"), broken))
    with pytest.raises(FieldError, match="broken") as refused:
        query_surfaces(scene, camera())
    assert refused.value.path.startswith("scene.objects[1]")
