"""Labels of streets and of motion, from the recipe to the published product."""

from __future__ import annotations

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
    cars = {"rate_per_s": 0.3, "density_per_km": 15}
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
