"""driving.json agrees with the labels, the camera and the facts that it is made of."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fullwell.dataset.encode import encode_json
from fullwell.labels import Labels, driving_document, labels_document, make_labels
from fullwell.radiometry import Spectrum
from fullwell.render import query_surfaces
from fullwell.scene import Camera, Cube, Diffuse, Film, Lens, Part, SceneDescription, SceneObject, look_at
from fullwell.scene.motion import (
    DrivingFacts,
    EgoFacts,
    GroundRegion,
    LaneFacts,
    RoadUser,
    SignalFacts,
    SignalLinkFacts,
)

GREY = Diffuse(Spectrum.constant(0.5))
CAR_M = (4.0, 2.0, 1.5)
POLE_M = (0.4, 0.4, 3.0)
HEIGHT_M = 1.5
ROWS, COLS, FOCAL_PX = 48, 64, 50.0


def forward_camera(yaw_rad: float = 0.0) -> Camera:
    lens = Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0))
    origin = np.array([0.0, 0.0, HEIGHT_M])
    ahead = np.array([math.cos(yaw_rad), math.sin(yaw_rad), 0.0])
    return Camera("front", look_at(origin, origin + ahead, np.array([0.0, 0.0, 1.0])), lens, Film(ROWS, COLS, 5e-3 / FOCAL_PX))


def pose(x: float, y: float, z: float, yaw_rad: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:2, :2] = [[math.cos(yaw_rad), -math.sin(yaw_rad)], [math.sin(yaw_rad), math.cos(yaw_rad)]]
    matrix[:3, 3] = [x, y, z]
    return matrix


def user(name: str, x: float, y: float, yaw_rad: float, speed_m_s: float, **more: Any) -> RoadUser:
    ahead = np.array([math.cos(yaw_rad), math.sin(yaw_rad), 0.0])
    known = {"role": "mover", "kind": "car", "sumo_id": name, "lane": "main_0"} | more
    return RoadUser(
        object_id=name,
        position_m=np.array([x, y, 0.0]),
        yaw_rad=yaw_rad,
        size_m=CAR_M,
        velocity_m_s=speed_m_s * ahead,
        speed_m_s=speed_m_s,
        **known,
    )


USERS = (
    user("ahead", 15.0, 0.0, 0.0, 8.0, brake=True, acceleration_m_s2=-2.0, yaw_rate_rad_s=0.1),
    user("hidden", 40.0, 0.0, 0.0, 9.0),
    user("crossing", 25.0, 6.0, -math.pi / 2, 5.0, left=True),
    user("behind", -20.0, 0.0, 0.0, 10.0),
    user("kerb", 12.0, -4.0, 0.0, 0.0, role="parked", sumo_id="", lane=""),
)
EGO = user("ego", 0.0, 0.0, 0.0, 10.0, yaw_rate_rad_s=0.2)
LINE = np.array([[-50.0, 0.0, 0.0], [200.0, 0.0, 0.0]])
AWAY = np.array([[-50.0, 0.0, 0.0], [-200.0, 0.0, 0.0]])


def lane(name: str, line: np.ndarray) -> LaneFacts:
    side = np.array([0.0, 1.6, 0.0])
    return LaneFacts(name, "drive", "High Street", 3.2, 13.9, line, line + side, line - side)


FACTS = DrivingFacts(
    time_s=30.0,
    users=USERS,
    ego=EgoFacts(EGO, ("front",)),
    lanes=(lane("main_0", LINE), lane("away_0", AWAY)),
    drivable=(
        GroundRegion(
            np.array([[5.0, 3.0, 0.0], [5.0, -3.0, 0.0], [60.0, -3.0, 0.0], [60.0, 3.0, 0.0]]),
            (np.array([[20.0, 1.0, 0.0], [20.0, -1.0, 0.0], [30.0, -1.0, 0.0], [30.0, 1.0, 0.0]]),),
        ),
        GroundRegion(np.array([[-5.0, 3.0, 0.0], [-5.0, -3.0, 0.0], [-60.0, -3.0, 0.0]])),
    ),
    crossings=(),
    signals=(
        SignalFacts("light", "junction", "g", ("green",), (SignalLinkFacts("main_0", "out_0", "g"),)),
        SignalFacts("light behind", "junction", "r", ("red",), ()),
    ),
)


def scene() -> SceneDescription:
    boxes = {item.object_id: (CAR_M, item.position_m, item.yaw_rad) for item in USERS}
    boxes["light"] = (POLE_M, np.array([20.0, -5.0, 0.0]), math.pi)
    objects = [
        SceneObject(name, "thing", (Part(Cube(size), GREY),), pose(float(at[0]), float(at[1]), size[2] / 2, yaw))
        for name, (size, at, yaw) in boxes.items()
    ]
    return SceneDescription(tuple(objects), semantic_classes=("thing",))


def labels_of(camera: Camera) -> Labels:
    return make_labels(scene(), camera, query_surfaces(scene(), camera))


@pytest.fixture(scope="module")
def labels() -> Labels:
    return labels_of(forward_camera())


@pytest.fixture(scope="module")
def document(labels: Labels) -> dict[str, Any]:
    return driving_document(labels, forward_camera(), FACTS)


def objects(document: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {item["id"]: item for item in document["objects"]}


def test_road_users_in_view_are_listed_hidden_or_not(document: dict[str, Any]) -> None:
    assert set(objects(document)) == {"ahead", "hidden", "crossing", "kerb"}
    assert objects(document)["hidden"]["visible_px"] == 0
    assert objects(document)["hidden"]["bbox_visible_px"] is None


def test_visibility_and_instances_are_those_of_the_labels(document: dict[str, Any], labels: Labels) -> None:
    table = dict(labels.instance_table)
    of_labels = {item.id: item for item in labels.objects}
    for name, item in objects(document).items():
        assert item["instance"] == table[name]
        assert item["visible_px"] == np.count_nonzero(labels.instances == table[name])
        assert item["visible_fraction"] == pytest.approx(of_labels[name].visible_fraction, abs=1e-6)


def test_boxes_velocities_and_lights_are_those_of_the_street(document: dict[str, Any]) -> None:
    for item in USERS:
        if item.object_id == "behind":
            continue
        told = objects(document)[item.object_id]
        box = told["box3d"]
        assert box["size_m"] == pytest.approx(CAR_M)
        assert box["center_world_m"] == pytest.approx([*item.position_m[:2], CAR_M[2] / 2])
        assert box["yaw_world_rad"] == pytest.approx(item.yaw_rad)
        assert told["velocity"]["world_m_s"] == pytest.approx(item.velocity_m_s)
        assert told["lights"]["brake"] is item.brake
        assert told["lights"]["left"] is item.left
        assert told["speed_m_s"] == item.speed_m_s
    assert objects(document)["ahead"]["acceleration_m_s2"] == -2.0
    assert objects(document)["ahead"]["yaw_rate_rad_s"] == 0.1
    assert objects(document)["crossing"]["yaw_rate_rad_s"] is None


def test_the_camera_frame_is_opencvs(document: dict[str, Any]) -> None:
    """The camera looks along +x: x of the camera is -y of the world, z is +x."""
    ahead, crossing = objects(document)["ahead"], objects(document)["crossing"]
    assert ahead["box3d"]["center_camera_m"] == pytest.approx([0.0, HEIGHT_M - CAR_M[2] / 2, 15.0])
    assert ahead["velocity"]["camera_m_s"] == pytest.approx([0.0, 0.0, 8.0])
    assert crossing["velocity"]["camera_m_s"] == pytest.approx([5.0, 0.0, 0.0])
    assert ahead["box3d"]["yaw_camera_rad"] == pytest.approx(-math.pi / 2), "KITTI: -90 degrees drives away"
    assert crossing["box3d"]["yaw_camera_rad"] == pytest.approx(0.0), "KITTI: 0 drives to the right"


def test_distances_are_to_the_middle_and_to_the_nearest_point(document: dict[str, Any]) -> None:
    ahead, kerb = objects(document)["ahead"], objects(document)["kerb"]
    assert ahead["nearest_distance_m"] == pytest.approx(13.0)
    assert ahead["distance_m"] == pytest.approx(math.hypot(15.0, HEIGHT_M - CAR_M[2] / 2))
    assert kerb["nearest_distance_m"] == pytest.approx(math.hypot(10.0, 3.0))


def test_tracks_are_sumos_ids_and_parked_cars_have_their_own(document: dict[str, Any]) -> None:
    told = objects(document)
    assert (told["ahead"]["track"], told["ahead"]["sumo_id"], told["ahead"]["lane"]) == ("ahead", "ahead", "main_0")
    assert (told["kerb"]["track"], told["kerb"]["sumo_id"], told["kerb"]["lane"]) == ("kerb", None, None)


def test_yaw_in_the_camera_turns_with_it() -> None:
    camera = forward_camera(yaw_rad=0.3)
    told = objects(driving_document(labels_of(camera), camera, FACTS))
    assert told["ahead"]["box3d"]["yaw_world_rad"] == pytest.approx(0.0, abs=1e-6)
    # The camera turns left, so what drives straight ahead now drives to the right of its axis.
    assert told["ahead"]["box3d"]["yaw_camera_rad"] == pytest.approx(-math.pi / 2 + 0.3)


def test_lanes_in_view_are_drawn_to_the_edge_of_the_picture(document: dict[str, Any]) -> None:
    (told,) = document["lanes"]
    assert told["id"] == "main_0"
    assert told["is_ego_lane"]
    assert told["centre_m"] == LINE.tolist()
    (piece,) = told["centre_px"]
    assert piece[0] == pytest.approx([COLS / 2, ROWS])
    assert piece[1] == pytest.approx([COLS / 2, ROWS / 2 + FOCAL_PX * HEIGHT_M / 200.0])
    (left,) = told["left_px"]
    assert left[1][0] == pytest.approx(COLS / 2 - FOCAL_PX * 1.6 / 200.0, abs=1e-4)


def test_drivable_regions_keep_their_holes(document: dict[str, Any]) -> None:
    (region,) = document["drivable"]
    assert len(region["holes_px"]) == 1
    assert region["holes_px"][0][0] == pytest.approx([COLS / 2 - FOCAL_PX / 20, ROWS / 2 + FOCAL_PX * HEIGHT_M / 20])
    assert document["crossings"] == []


def test_signals_have_their_state_and_place(document: dict[str, Any], labels: Labels) -> None:
    (light,) = document["signals"]
    assert (light["id"], light["state"], light["shown"], light["controller"]) == ("light", "g", ["green"], "junction")
    assert light["faces_camera"]
    assert light["controls_ego_lane"]
    assert light["links"] == [{"from_lane": "main_0", "to_lane": "out_0", "state": "g"}]
    rows, cols = np.nonzero(labels.instances == light["instance"])
    assert light["bbox_visible_px"] == [cols.min(), rows.min(), cols.max() + 1, rows.max() + 1]


def test_the_ego_carries_its_camera_and_turns_it(document: dict[str, Any], labels: Labels) -> None:
    assert document["ego"]["carries_camera"]
    assert document["ego"]["lane"] == "main_0"
    assert document["ego"]["velocity"]["world_m_s"] == pytest.approx([10.0, 0.0, 0.0])
    assert document["camera_velocity"]["camera_m_s"] == pytest.approx([0.0, 0.0, 10.0])
    standing = replace(FACTS, ego=EgoFacts(EGO, ()))
    assert driving_document(labels, forward_camera(), standing)["camera_velocity"]["world_m_s"] == [0.0, 0.0, 0.0]
    assert driving_document(labels, forward_camera(), replace(FACTS, ego=None))["ego"] is None


def test_a_camera_beside_the_pivot_of_a_turning_ego_moves_sideways_too(labels: Labels) -> None:
    away = replace(EGO, position_m=np.array([-2.0, 0.0, 0.0]))
    told = driving_document(labels, forward_camera(), replace(FACTS, ego=EgoFacts(away, ("front",))))
    assert told["camera_velocity"]["world_m_s"] == pytest.approx([10.0, 2.0 * 0.2, 0.0])


def test_the_document_is_plain_json(document: dict[str, Any]) -> None:
    assert json.loads(encode_json(document)) == document


def test_labels_of_streets_have_the_velocities_too(labels: Labels, document: dict[str, Any]) -> None:
    camera = forward_camera()
    plain = labels_document(labels, camera.intrinsics_px, camera.camera_to_world)
    assert not any("velocity" in item for item in plain["objects"])
    told = labels_document(labels, camera.intrinsics_px, camera.camera_to_world, FACTS.motions())
    velocities = {item["id"]: item["velocity"] for item in told["objects"]}
    for name, item in objects(document).items():
        assert velocities[name] == item["velocity"]
    assert velocities["light"] == {"world_m_s": [0.0, 0.0, 0.0], "camera_m_s": [0.0, 0.0, 0.0]}
