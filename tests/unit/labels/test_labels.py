"""Labels of scenes whose geometry can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core.errors import ShapeError
from fullwell.labels import Labels, labels_document, make_labels
from fullwell.radiometry import Spectrum
from fullwell.render import query_surfaces
from fullwell.scene import Camera, Cube, Diffuse, Film, Lens, Mesh, Part, SceneDescription, SceneObject, Sphere, look_at

GREY = Diffuse(Spectrum.constant(0.5))


def camera(rows=48, cols=64, hfov_deg=40.0) -> Camera:
    pitch = 2 * 5e-3 * np.tan(np.radians(hfov_deg) / 2) / cols
    lens = Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0))
    pose = look_at(np.array([0.0, -10.0, 0.0]), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    return Camera("main", pose, lens, Film(rows, cols, pitch))


def placed(name, geometry, x=0.0, y=0.0, z=0.0, *, semantic_class="thing", turn_deg=0.0, scale=(1, 1, 1)) -> SceneObject:
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    to_world = np.eye(4)
    to_world[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.diag(scale)
    to_world[:3, 3] = [x, y, z]
    return SceneObject(name, semantic_class, (Part(geometry, GREY),), to_world)


def labels_of(*objects: SceneObject, view: Camera | None = None, classes=("car", "thing")) -> Labels:
    scene = SceneDescription(objects, semantic_classes=classes)
    view = view or camera()
    return make_labels(scene, view, query_surfaces(scene, view))


def test_box_of_a_cube_is_where_its_front_face_projects() -> None:
    labels = labels_of(placed("cube", Cube((2, 2, 2))))
    (label,) = labels.objects
    half = 1.0 / 9.0 / camera().tangent_pitch
    assert label.bbox_amodal_px == pytest.approx((32 - half, 24 - half, 32 + half, 24 + half), abs=1e-9)
    assert label.bbox_visible_px == pytest.approx(label.bbox_amodal_px, abs=1.0)
    assert label.visible_fraction == 1.0
    assert label.truncated_fraction == 0.0
    assert label.visible_px == label.amodal_px == np.count_nonzero(labels.instances == label.instance)


def test_depth_z_of_a_facing_plane_is_constant_and_range_grows_outwards() -> None:
    labels = labels_of(placed("wall", Cube((50, 1, 50)), y=0.5))
    assert labels.depth_z_m == pytest.approx(np.full((48, 64), 10.0), rel=1e-6)
    assert labels.depth_range_m[0, 0] > labels.depth_range_m[24, 32] > 10.0 - 1e-5


def test_nothing_has_infinite_depth_and_id_zero() -> None:
    labels = labels_of(placed("ball", Sphere(0.5)))
    assert labels.instances[0, 0] == labels.semantic[0, 0] == 0
    assert np.isinf(labels.depth_z_m[0, 0])
    assert np.isinf(labels.depth_range_m[0, 0])


def test_semantic_ids_follow_the_class_table_and_unknown_classes_are_zero() -> None:
    labels = labels_of(placed("a", Sphere(0.5), x=-1.5), placed("b", Sphere(0.5), x=1.5, semantic_class=""))
    assert labels.semantic[24, 15:30].max() == 2
    assert labels.semantic[:, 35:].max() == 0
    assert labels.instances[:, 35:].max() == 2


def test_half_hidden_object_is_half_visible() -> None:
    labels = labels_of(placed("screen", Cube((4, 0.1, 8)), x=-2.0, y=-1.0), placed("wall", Cube((2, 0.1, 2)), y=1.0))
    wall = labels.objects[1]
    assert wall.visible_fraction == pytest.approx(0.5, abs=0.06)
    assert wall.bbox_amodal_px is not None
    assert wall.bbox_visible_px is not None
    assert wall.bbox_visible_px[0] > wall.bbox_amodal_px[0] + 2


def test_object_beyond_the_border_is_truncated() -> None:
    view = camera()
    edge_m = 10.0 * 32 * view.tangent_pitch
    (label,) = labels_of(placed("cube", Cube((2, 1e-6, 2)), x=edge_m)).objects
    assert label.truncated_fraction == pytest.approx(0.5, abs=1e-6)
    assert label.bbox_amodal_px is not None
    assert label.bbox_amodal_px[2] > 64


def test_hidden_object_is_listed_and_one_behind_the_camera_is_not() -> None:
    labels = labels_of(
        placed("wall", Cube((50, 0.1, 50))), placed("hidden", Sphere(0.5), y=3.0), placed("behind", Sphere(0.5), y=-20)
    )
    assert [label.id for label in labels.objects] == ["wall", "hidden"]
    hidden = labels.objects[1]
    assert hidden.bbox_visible_px is None
    assert hidden.visible_fraction == 0.0
    assert hidden.amodal_px > 0
    assert dict(labels.instance_table)["behind"] == 3


def test_ground_that_passes_under_the_camera_is_cut_at_the_near_plane() -> None:
    labels = labels_of(placed("ground", Cube((100, 100, 0.1)), z=-1.0))
    (ground,) = labels.objects
    assert ground.bbox_amodal_px is not None
    assert np.all(np.isfinite(ground.bbox_amodal_px))
    assert ground.visible_px > 0


@pytest.mark.parametrize("turn_deg", [0.0, 30.0, 90.0, -135.0])
def test_box3d_follows_the_object(turn_deg: float) -> None:
    (label,) = labels_of(placed("car", Cube((4, 2, 1.5)), x=1.0, turn_deg=turn_deg)).objects
    box = label.box3d
    assert box.size_m == pytest.approx([4, 2, 1.5])
    assert box.center_m == pytest.approx([1.0, 0.0, 10.0])
    assert np.linalg.det(box.rotation) == pytest.approx(1.0)
    forward_world = [np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg)), 0]
    assert box.rotation[:, 0] == pytest.approx(camera().world_to_camera[:3, :3] @ forward_world)


def test_mirrored_and_scaled_object_keeps_a_proper_box() -> None:
    (label,) = labels_of(placed("car", Cube((1, 1, 1)), turn_deg=20.0, scale=(-4, 2, 1))).objects
    assert np.linalg.det(label.box3d.rotation) == pytest.approx(1.0)
    assert sorted(label.box3d.size_m) == pytest.approx([1, 2, 4])


def test_pole_thinner_than_a_pixel_is_listed_by_its_area() -> None:
    pixel_m = 10.0 * camera().tangent_pitch
    pole = placed("pole", Cube((0.3 * pixel_m, 1e-4, 20 * pixel_m)))
    labels = labels_of(pole, placed("wall", Cube((50, 0.1, 50)), y=5.0))
    label = labels.objects[0]
    assert (label.visible_px, label.amodal_px, label.bbox_visible_px) == (0, 0, None)
    assert label.visible_area_px == pytest.approx(0.3 * 20, abs=20 / 17)
    assert label.visible_fraction == pytest.approx(1.0, abs=1e-6)
    assert labels.coverage[24, 31:33] == pytest.approx([0.85, 0.85], abs=0.05)


def test_half_hidden_fraction_is_exact_to_parts_of_a_pixel() -> None:
    labels = labels_of(placed("screen", Cube((4, 0.01, 8)), x=-2.0, y=-0.01), placed("card", Cube((1.37, 1e-4, 1.1))))
    assert labels.objects[1].visible_fraction == pytest.approx(0.5, abs=0.01)


def test_mesh_that_many_objects_share_and_vertices_that_no_face_uses() -> None:
    corners = np.array([[-1.0, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1], [90, 90, 90]])
    mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32))
    left, right = labels_of(placed("a", mesh, x=-1.5), placed("b", mesh, x=1.5)).objects
    assert left.box3d.size_m == pytest.approx([2, 0, 2])
    pitch = camera().tangent_pitch
    assert right.bbox_amodal_px == pytest.approx((32 + 0.05 / pitch, 24 - 0.1 / pitch, 32 + 0.25 / pitch, 24 + 0.1 / pitch))


def test_document_is_plain_data_with_the_image_size() -> None:
    view = camera()
    document = labels_document(labels_of(placed("ball", Sphere(1.0))), view.intrinsics_px, view.camera_to_world)
    assert document["image_size_px"] == [64, 48]
    assert document["objects"][0]["id"] == "ball"
    assert document["objects"][0]["amodal_area_px"] == pytest.approx(document["objects"][0]["visible_area_px"], rel=1e-3)
    assert document["classes"] == [{"id": 1, "name": "car"}, {"id": 2, "name": "thing"}]
    assert document["intrinsics_px"][0][2] == 32


def test_hits_of_another_film_are_refused() -> None:
    scene = SceneDescription((placed("ball", Sphere(1.0)),))
    hits = query_surfaces(scene, camera())
    with pytest.raises(ShapeError, match="film"):
        make_labels(scene, camera(rows=10), hits)
