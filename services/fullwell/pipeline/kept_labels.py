"""Labels kept between frames: in this process's memory, and behind that in the object store that workers share."""

from __future__ import annotations

import time
import weakref
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, Final, Literal

import numpy as np

from fullwell.core.hashing import digest_of
from fullwell.labels import Box3D, Labels, ObjectLabel
from fullwell.pipeline.maker import maker
from fullwell.pipeline.packing import packed, unpacked
from fullwell.pipeline.stage_store import StageStore
from fullwell.scene import Camera, SceneDescription

__all__ = ["KeptLabels", "decode_labels", "encode_labels", "labels_of"]

KIND: Final = "labels"
_ENTRY_VERSION: Final = 1
_MAPS: Final = ("instances", "semantic", "depth_z_m", "depth_range_m", "normals_camera", "coverage")
_MAKERS: Final = ("core", "scene", "render", "labels")
_MOST_KEPT: Final = 4
_WORTH_KEEPING_S: Final = 0.5
"""Labels that took less are not put into the object store: reading them would take as long as making them."""


@dataclass(frozen=True, slots=True, eq=False)
class KeptLabels:
    """Labels, where they came from, and by product those files of them that were encoded before, to be added to."""

    labels: Labels
    source: Literal["memory", "store", "made"]
    files: dict[str, bytes] = field(default_factory=dict)


_last: OrderedDict[str, tuple[weakref.ref[SceneDescription], KeptLabels]] = OrderedDict()
"""Of the last views of a scene: frames that vary only noise, exposure or picture have the same."""


def labels_of(
    scene: SceneDescription, view: Camera, make: Callable[[], Labels], *, stages: StageStore | None = None
) -> KeptLabels:
    """Return the labels of what a view shows of a scene: from memory, from the object store, or from `make`.

    Scenes are never changed: the same object is the same scene. In the store labels are found by the scene's content.
    """
    look = digest_of([view.camera_to_world, view.tangent_pitch, view.film.rows, view.film.cols, view.lens.kind])
    found = _last.pop(look, None)
    if found is not None and found[0]() is scene:
        kept = KeptLabels(found[1].labels, "memory", found[1].files)
    else:
        kept = _from_store(scene, look, make, stages)
    _last[look] = weakref.ref(scene), kept
    while len(_last) > _MOST_KEPT:
        _last.popitem(last=False)
    return kept


def _from_store(scene: SceneDescription, look: str, make: Callable[[], Labels], stages: StageStore | None) -> KeptLabels:
    key = ""
    if stages is not None:
        key = _key(scene, look)
        found = _read(stages, key, len(scene.objects))
        if found is not None:
            return KeptLabels(found, "store")
    started = time.perf_counter()
    labels = make()
    if stages is not None and time.perf_counter() - started > _WORTH_KEEPING_S:
        stages.put(KIND, key, *encode_labels(labels))
    return KeptLabels(labels, "made")


def _key(scene: SceneDescription, look: str) -> str:
    seen = {"objects": scene.objects, "classes": scene.semantic_classes, "look": look}
    return digest_of({"stage": KIND, "entry_version": _ENTRY_VERSION, **seen, "maker": maker(_MAKERS)})


def _read(stages: StageStore, key: str, objects: int) -> Labels | None:
    def decode(content: memoryview) -> Labels:
        labels = decode_labels(content)
        if len(labels.instance_table) != objects:
            raise ValueError(f"it lists {len(labels.instance_table)} objects, not {objects}")
        return labels

    return stages.read(KIND, key, decode)


def encode_labels(labels: Labels) -> tuple[bytes | memoryview, ...]:
    """Return an exact encoding, in parts to be joined."""
    document = {
        "objects": [_object_document(label) for label in labels.objects],
        "instance_table": [list(entry) for entry in labels.instance_table],
        "semantic_classes": list(labels.semantic_classes),
    }
    return packed(document, {name: getattr(labels, name) for name in _MAPS})


def _object_document(label: ObjectLabel) -> dict[str, Any]:
    box = label.box3d
    plain = asdict(label)
    plain["box3d"] = [box.center_m.tolist(), box.size_m.tolist(), box.rotation.tolist()]
    return plain


def decode_labels(content: bytes | memoryview) -> Labels:
    """Return what was encoded, bit for bit. Raises an error of any kind for other content."""
    document, arrays = unpacked(content)
    maps = {name: arrays[name] for name in _MAPS}
    shape = maps["instances"].shape
    for name, array in maps.items():
        if array.shape != (*shape, *((3,) if name == "normals_camera" else ())):
            raise ValueError(f"{name} has the shape {array.shape}, instances {shape}")
    return Labels(
        **maps,
        objects=tuple(_object_label(plain) for plain in document["objects"]),
        instance_table=tuple((str(name), int(number)) for name, number in document["instance_table"]),
        semantic_classes=tuple(document["semantic_classes"]),
    )


def _object_label(plain: dict[str, Any]) -> ObjectLabel:
    center, size, rotation = (np.array(values, dtype=np.float64) for values in plain["box3d"])
    boxes = {name: None if plain[name] is None else tuple(plain[name]) for name in ("bbox_visible_px", "bbox_amodal_px")}
    return ObjectLabel(**{**plain, **boxes, "box3d": Box3D(center, size, rotation)})
