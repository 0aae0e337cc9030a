"""Streets for tests: assets that are only sizes, since nothing is drawn."""

from __future__ import annotations

from fullwell.assets.records import (
    AssetManifest,
    LevelRecord,
    LicenceRecord,
    MaterialChoice,
    PartRecord,
    SourceRecord,
)
from fullwell.traffic.placement import AssetShelf

SIZES = {
    "car": [("sedan-01", 4.76, 1.9, 1.44), ("suv-01", 4.6, 2.0, 1.7), ("hatchback-01", 3.9, 1.8, 1.5)],
    "van": [("van-01", 5.3, 2.1, 2.3)],
    "bus": [("bus-01", 12.0, 2.6, 3.1)],
    "lorry": [("lorry-01", 9.0, 2.6, 3.6)],
    "motorcycle": [("motorcycle-01", 2.1, 0.8, 1.2)],
    "cyclist": [("cyclist-01", 1.8, 0.6, 1.75)],
    "pedestrian": [("woman-01", 0.5, 0.5, 1.68), ("man-01", 0.55, 0.6, 1.8)],
    "tree": [("oak-01", 9.0, 9.0, 11.0), ("young-tree-01", 2.4, 2.4, 5.0)],
    "bush": [("bush-01", 1.5, 1.5, 1.4)],
    "grass": [("grass-01", 2.0, 2.0, 0.5)],
    "building": [("block-01", 14.0, 20.0, 22.0), ("block-02", 12.0, 12.0, 16.0), ("house-01", 10.0, 11.0, 9.0)],
    "street_light": [("street-light-01", 2.0, 0.3, 8.0)],
    "traffic_light": [("traffic-light-01", 0.5, 0.5, 3.4)],
    "bin": [("bin-01", 0.5, 0.5, 1.1)],
    "bench": [("bench-01", 0.7, 1.8, 0.9)],
    "bus_stop": [("bus-stop-01", 1.6, 4.0, 2.6)],
}
LAMPS = {
    "car": ["headlight_left", "taillight_left", "brakelight_left", "indicator_front_left", "indicator_rear_right", "drl_left"],
    "traffic_light": ["light_red", "light_amber", "light_green"],
    "street_light": ["lamp"],
    "building": ["lit_windows_warm"],
}


def manifest(name: str, asset_class: str, size_m: tuple[float, float, float]) -> AssetManifest:
    """Return the manifest of a thing of that size, with the lamps of its class."""
    tags = ("city",) if name.startswith("block") else (("suburb",) if name.startswith("house") else ())
    parts = [PartRecord("body", 12, 1.0, MaterialChoice("generator", "paint/white"), paintable=True)]
    parts += [PartRecord(lamp, 2, 0.1, MaterialChoice("generator", "lamp/tail")) for lamp in LAMPS.get(asset_class, [])]
    return AssetManifest(
        id=name,
        title=name,
        asset_class=asset_class,
        tags=tags,
        size_m=size_m,
        levels=(LevelRecord(12, "0" * 64, 1),),
        parts=tuple(parts),
        licence=LicenceRecord("CC0-1.0"),
        source=SourceRecord("generator", "test"),
        attributes={"column_offset_x_m": -size_m[0] / 2 + 0.15} if asset_class == "street_light" else {},
    )


def make_shelf() -> AssetShelf:
    """Return a fresh shelf: it remembers what it drew last."""
    return AssetShelf(
        {kind: [manifest(name, kind, (x, y, z)) for name, x, y, z in sorted(entries)] for kind, entries in SIZES.items()}
    )
