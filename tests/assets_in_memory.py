"""Assets for tests that need no store: small, made on the spot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fullwell.assets.ingest.canonical import write_level
from fullwell.assets.model import LoadedPart
from fullwell.assets.query import AssetQuery, ReviewState
from fullwell.assets.records import (
    AssetManifest,
    LevelRecord,
    LicenceRecord,
    MaterialChoice,
    PartRecord,
    PreparedAsset,
    SourceRecord,
)
from fullwell.assets.starter.shapes import Shape, box
from fullwell.core import NotFoundError
from fullwell.core.hashing import sha256_hex

__all__ = ["MemoryAssets", "box_asset", "small_car", "street_boxes"]


def small_car(
    name: str,
    *,
    tags: tuple[str, ...] = ("modern", "sedan"),
    length_m: float = 4.5,
    paint: str = "paint/blue",
    licence: str = "CC0-1.0",
) -> PreparedAsset:
    """Return a box of a car: a body, a lamp facing backwards, a bumper without a catalogued material."""
    body = box((length_m, 1.8, 1.2), centre_m=(0, 0, 0.8))
    lamp = box((0.02, 0.3, 0.1), centre_m=(-length_m / 2 - 0.01, 0.6, 0.8))
    bumper = box((0.1, 1.7, 0.2), centre_m=(length_m / 2, 0, 0.3))
    shapes = {"body": (body, paint), "taillight_left": (lamp, "lamp/tail"), "bumper": (bumper, "")}
    loaded = [_loaded(part, shape) for part, (shape, _) in shapes.items()]
    content = write_level(loaded)
    parts = tuple(
        PartRecord(part, len(shape.faces), 1.0, MaterialChoice("rule" if material else "upsampled", material, (0.2, 0.3, 0.4)))
        for part, (shape, material) in shapes.items()
    )
    points = np.concatenate([part.vertices_m for part in loaded])
    length, width, height = (points.max(axis=0) - points.min(axis=0)).tolist()
    level = LevelRecord(sum(part.triangles for part in parts), sha256_hex(content), len(content))
    manifest = AssetManifest(
        id=name,
        title=name.title(),
        asset_class="car",
        tags=tags,
        size_m=(length, width, height),
        levels=(level,),
        parts=parts,
        licence=LicenceRecord(licence, "The testers"),
        source=SourceRecord("generator", "test"),
    )
    return PreparedAsset(manifest, {level.sha256: content})


def box_asset(name: str, asset_class: str, size_m: tuple[float, float, float], *, tags: tuple[str, ...] = ()) -> PreparedAsset:
    """Return a box of that size on the ground, with the lamps that its class has as thin plates before it."""
    body = box(size_m, centre_m=(0, 0, size_m[2] / 2))
    shapes = {"body": (body, "paint/grey")}
    for lamp, material in _LAMPS.get(asset_class, {}).items():
        plate = box((0.02, 0.3, 0.1), centre_m=(size_m[0] / 2 - 0.02, 0, 0.6 * size_m[2]))
        shapes[lamp] = (plate, material)
    loaded = [_loaded(part, shape) for part, (shape, _) in shapes.items()]
    content = write_level(loaded)
    level = LevelRecord(sum(len(part.faces) for part in loaded), sha256_hex(content), len(content))
    parts = tuple(
        PartRecord(part, len(shape.faces), 1.0, MaterialChoice("generator", material), paintable=part == "body")
        for part, (shape, material) in shapes.items()
    )
    manifest = AssetManifest(
        id=name,
        title=name,
        asset_class=asset_class,
        tags=tags,
        size_m=size_m,
        levels=(level,),
        parts=parts,
        licence=LicenceRecord("CC0-1.0", "The testers"),
        source=SourceRecord("generator", "test"),
    )
    return PreparedAsset(manifest, {level.sha256: content})


_LAMPS = {
    "car": {"headlight_left": "lamp/headlight_led", "taillight_left": "lamp/tail", "brakelight_left": "lamp/brake"},
    "traffic_light": {"light_red": "lamp/traffic_red", "light_green": "lamp/traffic_green"},
    "street_light": {"lamp": "lamp/street_led"},
    "building": {"lit_windows_warm": "lamp/window_warm"},
}


def street_boxes() -> list[PreparedAsset]:
    """Return a box for every class that streets are made of."""
    return [
        box_asset("sedan-box", "car", (4.7, 1.8, 1.4)),
        box_asset("van-box", "van", (5.2, 2.0, 2.2)),
        box_asset("bus-box", "bus", (11.9, 2.5, 3.0)),
        box_asset("lorry-box", "lorry", (8.5, 2.5, 3.5)),
        box_asset("cyclist-box", "cyclist", (1.8, 0.6, 1.7)),
        box_asset("walker-box", "pedestrian", (0.4, 0.5, 1.7), tags=("adult",)),
        box_asset("tree-box", "tree", (3.0, 3.0, 6.0)),
        box_asset("bush-box", "bush", (1.0, 1.0, 1.0)),
        box_asset("grass-box", "grass", (1.0, 1.0, 0.3)),
        box_asset("house-box", "building", (10.0, 12.0, 9.0), tags=("city", "suburb")),
        box_asset("light-box", "street_light", (2.0, 0.3, 8.0)),
        box_asset("signal-box", "traffic_light", (0.4, 0.4, 3.2)),
        box_asset("bin-box", "bin", (0.5, 0.5, 1.0)),
    ]


def _loaded(name: str, shape: Shape) -> LoadedPart:
    return LoadedPart(
        name=name,
        vertices_m=shape.vertices_m,
        faces=shape.faces.astype(np.uint32),
        normals=None,
        uv=None,
        base_color_srgb=(0.2, 0.3, 0.4),
        base_color_texture=None,
        roughness=0.5,
        metallic=0.0,
        emissive_srgb=None,
        double_sided=True,
    )


class MemoryAssets:
    """A catalogue of prepared assets, all in one review state."""

    def __init__(self, *prepared: PreparedAsset, folder: Path, state: ReviewState = "approved") -> None:
        self.folder, self.state = folder, state
        self.prepared = {item.manifest.digest: item for item in prepared}
        self.searches = 0

    def candidates(self, query: AssetQuery) -> Sequence[tuple[str, str]]:
        self.searches += 1
        found = (
            (item.manifest.id, digest) for digest, item in self.prepared.items() if query.matches(item.manifest, self.state)
        )
        return sorted(found)

    def manifest(self, digest: str) -> AssetManifest:
        if digest not in self.prepared:
            raise NotFoundError(f"there is no asset with the digest {digest}")
        return self.prepared[digest].manifest

    def level_file(self, manifest: AssetManifest, level: int) -> Path:
        record = manifest.levels[level]
        file = self.folder / f"{record.sha256}.glb"
        file.write_bytes(self.prepared[manifest.digest].blobs[record.sha256])
        return file
