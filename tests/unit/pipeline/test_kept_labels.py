"""Labels are made once for all frames that see the same, in whichever process."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fullwell.labels import Box3D, Labels, ObjectLabel
from fullwell.pipeline import LightCache, StageStore, kept_labels, render_frame
from fullwell.pipeline import frame as frame_module
from fullwell.pipeline.kept_labels import KIND, decode_labels, encode_labels
from fullwell.pipeline.packing import packed, unpacked
from fullwell.schema import build_frame, load_recipe
from fullwell.storage import LocalStore

LIMIT = 1 << 30


@pytest.fixture(autouse=True)
def everything_is_worth_keeping(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_labels, "_WORTH_KEEPING_S", 0.0)


@pytest.fixture
def queries(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One item for each time that rays look for surfaces."""
    calls: list[int] = []
    original = frame_module.query_surfaces

    def counted(*args: Any, **options: Any) -> Any:
        calls.append(1)
        return original(*args, **options)

    monkeypatch.setattr(frame_module, "query_surfaces", counted)
    return calls


def make(recipe: dict[str, Any], store: LocalStore, prefix: str, *, stages: bool = True) -> dict[str, Any]:
    """Make a frame as a new process would: nothing in memory."""
    kept_labels._last.clear()
    shared = StageStore(store, max_bytes=LIMIT) if stages else None
    return render_frame(build_frame(load_recipe(recipe), 0), store, prefix, cache=LightCache(), stages=shared)


def small_labels() -> Labels:
    rng = np.random.default_rng(4)
    box = Box3D(np.array([-0.0, 1 / 3, 1e-300]), np.array([1.0, 2.0, np.inf]), np.eye(3))
    label = ObjectLabel("car", 1, "car", 2, None, (-0.0, 1 / 3, 1e9, 7.5), 0, 3, 0.1, 0.3, 1 / 3, 0.25, box)
    seen = ObjectLabel("ball", 2, "", 0, (1, 0, 3, 2), None, 4, 4, 3.9, 4.1, 0.95, 0.0, box)
    return Labels(
        instances=rng.integers(0, 1 << 32, (3, 4), dtype=np.uint32),
        semantic=rng.integers(0, 1 << 16, (3, 4), dtype=np.uint16),
        depth_z_m=np.where(rng.random((3, 4)) < 0.5, np.inf, 7.1).astype(np.float32),
        depth_range_m=rng.random((3, 4), dtype=np.float32),
        normals_camera=rng.random((3, 4, 3), dtype=np.float32),
        coverage=rng.random((3, 4), dtype=np.float32),
        objects=(label, seen),
        instance_table=(("car", 1), ("ball", 2), ("hidden", 3)),
        semantic_classes=("ball", "car"),
    )


def test_encoding_is_exact() -> None:
    labels = small_labels()
    back = decode_labels(b"".join(encode_labels(labels)))
    for name in ("instances", "semantic", "depth_z_m", "depth_range_m", "normals_camera", "coverage"):
        one, other = getattr(back, name), getattr(labels, name)
        assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    assert (back.instance_table, back.semantic_classes) == (labels.instance_table, labels.semantic_classes)
    for one, other in zip(back.objects, labels.objects, strict=True):
        for name in ("center_m", "size_m", "rotation"):
            assert getattr(one.box3d, name).tobytes() == getattr(other.box3d, name).tobytes()
        for name in (name for name in ObjectLabel.__slots__ if name != "box3d"):
            assert repr(getattr(one, name)) == repr(getattr(other, name))  # which tells -0.0 from 0.0


def test_no_beginning_of_an_encoding_is_taken_for_labels() -> None:
    whole = b"".join(encode_labels(small_labels()))
    for length in range(len(whole)):
        with pytest.raises(Exception):  # noqa: B017, PT011 - whatever is raised, the caller takes the entry for absent
            decode_labels(whole[:length])


def test_maps_of_different_sizes_are_refused() -> None:
    document, arrays = unpacked(b"".join(encode_labels(small_labels())))
    with pytest.raises(ValueError, match="coverage has the shape"):
        decode_labels(b"".join(packed(document, arrays | {"coverage": arrays["coverage"][:2]})))


def test_another_process_finds_them_and_makes_the_same_products(
    recipe: dict[str, Any], tmp_path: Path, queries: list[int]
) -> None:
    store = LocalStore(tmp_path)
    first = make(recipe, store, "first")
    assert len(queries) == 1
    again = make(recipe, store, "again")
    assert len(queries) == 1
    assert again["products"] == first["products"]
    assert "main/phone: labels reused from the stage cache" in again["run"]["notes"]
    for name in ("instances", "classes", "cameras"):
        assert again[name] == first[name]


def test_another_exposure_finds_them_and_another_view_does_not(
    recipe: dict[str, Any], tmp_path: Path, queries: list[int]
) -> None:
    store = LocalStore(tmp_path)
    make(recipe, store, "first")
    longer = copy.deepcopy(recipe)
    longer["cameras"][0]["sensors"][0]["exposure"] = {"time_s": 0.01}
    make(longer, store, "longer")
    assert len(queries) == 1
    for number, change in enumerate(("pose", "object", "class", "film")):
        other = copy.deepcopy(recipe)
        if change == "pose":
            other["cameras"][0]["pose"]["origin_m"] = [4, -4, 2.1]
        elif change == "object":
            other["scene"]["objects"][1]["transform"]["translate_m"] = [0.1, 0, 0.5]
        elif change == "class":
            other["scene"]["objects"][1]["class"] = "toy"
        else:
            other["cameras"][0]["sensors"][0]["cols"] = 23
        make(other, store, change)
        assert len(queries) == number + 2, change


def test_a_useless_entry_is_made_again(recipe: dict[str, Any], tmp_path: Path, queries: list[int]) -> None:
    store = LocalStore(tmp_path)
    first = make(recipe, store, "first")
    (entry,) = (info.key for info in store.list(f"cache/{KIND}/") if info.key.count(".") == 0)
    StageStore(store, max_bytes=LIMIT).discard(KIND, entry.rpartition("/")[2])
    StageStore(store, max_bytes=LIMIT).put(KIND, entry.rpartition("/")[2], *packed({"objects": []}, {}))
    again = make(recipe, store, "again")
    assert len(queries) == 2
    assert again["products"] == first["products"]
    make(recipe, store, "third")
    assert len(queries) == 2


def test_labels_that_cost_little_are_not_kept_elsewhere(
    recipe: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kept_labels, "_WORTH_KEEPING_S", 1e9)
    store = LocalStore(tmp_path)
    make(recipe, store, "first")
    assert list(store.list(f"cache/{KIND}/")) == []
