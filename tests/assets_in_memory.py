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

__all__ = ["MemoryAssets", "small_car"]


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
