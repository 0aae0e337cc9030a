"""Labels of streets and of motion, from the recipe to the published product."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_in_memory import MemoryAssets, small_car
from fullwell.dataset import encode
from fullwell.pipeline import render_frame
from fullwell.schema import build_frame, load_recipe
from fullwell.storage import LocalStore

ROWS, COLS = 36, 48


def street_recipe() -> dict[str, Any]:
    sensor = {"name": "s", "model": "imx363", "rows": ROWS, "cols": COLS, "exposure": {"time_s": 0.001}}
    lens = {"kind": "pinhole", "hfov_deg": 70, "f_number": 4}
    cars = {"rate_per_s": 0.6, "density_per_km": 30}
    traffic = {"network": {"layout": "cross", "length_m": 160}, "demand": {"car": cars}, "time_s": 30, "ego": {"kind": "car"}}
    sky = {"name": "sky", "kind": "constant_environment", "luminance_cd_m2": 3000, "spd": "D65"}
    return {
        "schema": "fullwell/recipe/v1",
        "name": "street",
        "seed": 3,
        "scene": {"traffic": traffic, "lights": [sky]},
        "cameras": [
            {"name": "front", "pose": {"mount": {"at": "windscreen"}}, "lens": lens, "sensors": [sensor]},
            {"name": "pole", "pose": {"origin_m": [100, 100, 12], "target_m": [80, 80, 0]}, "lens": lens, "sensors": [sensor]},
        ],
        "outputs": ["labels.json", "driving.json", "instances.png"],
    }


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], LocalStore]:
    folder = tmp_path_factory.mktemp("street")
    assets = MemoryAssets(small_car("sedan-01"), small_car("estate-01", paint="paint/white"), folder=folder)
    store = LocalStore(folder / "out")
    return render_frame(build_frame(load_recipe(street_recipe()), assets=assets), store, "f"), store


def test_every_camera_has_driving_labels_that_name_instances_of_the_manifest(
    street: tuple[dict[str, Any], LocalStore],
) -> None:
    manifest, store = street
    table = {entry["id"]: entry["instance"] for entry in manifest["instances"]}
    users = 0
    for camera in ("front", "pole"):
        document = encode.decode_json(store.get(f"f/{camera}/driving.json"))
        instances = encode.decode_ids_png(store.get(f"f/{camera}/instances.png"))
        assert document["lanes"]
        assert document["drivable"]
        assert document["ego"]["carries_camera"] is (camera == "front")
        for item in (*document["objects"], *document["signals"]):
            assert item["instance"] == table[item["id"]]
            assert item["visible_px"] == np.count_nonzero(instances == item["instance"])
        users += len(document["objects"])
    assert users > 3


def test_the_drivable_ring_is_where_the_road_is_seen(street: tuple[dict[str, Any], LocalStore]) -> None:
    """From above nothing but cars hides the road: its pixels and the cars' are the ring's."""
    shapely = pytest.importorskip("shapely")
    manifest, store = street
    instances = encode.decode_ids_png(store.get("f/pole/instances.png"))
    names = {entry["instance"]: entry["id"] for entry in manifest["instances"]}
    document = encode.decode_json(store.get("f/pole/driving.json"))
    regions = [shapely.make_valid(shapely.Polygon(item["outer_px"], item["holes_px"])) for item in document["drivable"]]
    rows, cols = np.mgrid[0:ROWS, 0:COLS]
    inside = shapely.contains_xy(shapely.union_all(regions), cols + 0.5, rows + 0.5)
    is_road = np.vectorize(lambda number: names.get(number, "").startswith(("street/road", "street/marking")))(instances)
    assert np.mean(inside[is_road]) > 0.97, "pixels of the edge may differ"
    is_walk = np.vectorize(lambda number: names.get(number, "").startswith(("street/sidewalk", "street/terrain")))(instances)
    assert np.mean(inside[is_walk]) < 0.03


def test_mounted_cameras_see_the_street_flow_and_fixed_ones_only_the_traffic(tmp_path: Path) -> None:
    assets = MemoryAssets(small_car("sedan-01"), folder=tmp_path)
    recipe = street_recipe() | {"outputs": ["flow.exr", "instances.png"], "labels": {"flow_interval_s": 0.05}}
    recipe["scene"]["traffic"]["ego"]["min_speed_m_s"] = 1
    frame = build_frame(load_recipe(recipe), assets=assets)
    assert frame.driving is not None
    moving = frame.driving.motions()
    store = LocalStore(tmp_path / "out")
    names = {entry["instance"]: entry["id"] for entry in render_frame(frame, store, "f")["instances"]}
    for camera in ("front", "pole"):
        image = encode.decode_flow_exr(store.get(f"f/{camera}/flow.exr"))
        instances = encode.decode_ids_png(store.get(f"f/{camera}/instances.png"))
        assert image.interval_s == 0.05
        flows = np.any(image.flow_px != 0, axis=2)
        ids = np.vectorize(lambda number: names.get(number, ""))(instances)
        is_mover = np.isin(ids, list(moving))
        if camera == "pole":
            assert np.array_equal(flows, is_mover)
        else:
            assert np.all(flows[(ids != "") & ~is_mover])
            assert not flows[ids == ""].any()


def two_boxes() -> dict[str, Any]:
    """A near and a far box under a sky, without traffic, 48 x 36 pixels."""
    boxes = [
        {
            "id": name,
            "class": "box",
            "geometry": {"kind": "cube", "size_m": [1, 1, 1]},
            "transform": {"translate_m": [6, y, 0]},
            "material": {"kind": "diffuse", "reflectance": 0.4},
        }
        for name, y in (("left", 1.2), ("right", -1.2))
    ]
    recipe = street_recipe()
    recipe["scene"] = {"objects": boxes, "lights": recipe["scene"]["lights"]}
    camera = recipe["cameras"][1] | {"pose": {"origin_m": [0, 0, 0], "target_m": [1, 0, 0]}}
    return recipe | {"cameras": [camera], "outputs": ["flow.exr", "image.png"], "quality": {"samples_per_pixel": 2}}


def test_without_traffic_nothing_flows_and_the_interval_is_a_tenth_of_a_second(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    manifest = render_frame(build_frame(load_recipe(two_boxes())), store, "f")
    assert [product["name"] for product in manifest["products"]] == ["flow.exr", "image.png"]
    image = encode.decode_flow_exr(store.get("f/flow.exr"))
    assert image.flow_px.shape == (ROWS, COLS, 2)
    assert np.all(image.flow_px == 0)
    assert image.interval_s == 0.1


def test_without_a_sky_there_is_flow_on_surfaces_only(tmp_path: Path) -> None:
    recipe = two_boxes() | {"outputs": ["flow.exr", "instances.png"]}
    lamp = {"name": "lamp", "kind": "point", "position_m": [0, 0, 3], "luminous_intensity_cd": 500, "spd": "D65"}
    recipe["scene"]["lights"] = [lamp]
    store = LocalStore(tmp_path)
    render_frame(build_frame(load_recipe(recipe)), store, "f")
    instances = encode.decode_ids_png(store.get("f/instances.png"))
    flow = encode.decode_flow_exr(store.get("f/flow.exr")).flow_px
    assert np.array_equal(np.isnan(flow[..., 0]), instances == 0)
    assert 0 < np.count_nonzero(instances) < instances.size
