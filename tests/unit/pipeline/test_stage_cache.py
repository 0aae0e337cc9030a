"""A second run, worker, sensor or exposure renders nothing and gives the same bytes; trouble with the cache fails no frame."""

from __future__ import annotations

import copy
import datetime
import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pytest

import fullwell.pipeline.frame as frame_module
from fullwell.core.errors import ConflictError, FieldError, RenderError, StorageError
from fullwell.core.settings import load_settings
from fullwell.dataset import encode
from fullwell.pipeline import RadianceCache, StageStore, plan_frame, render_frame, with_cache_steps
from fullwell.pipeline import cache as cache_module
from fullwell.pipeline.cache import decode_radiance, encode_radiance, obtain_radiance, stored_radiance_key
from fullwell.radiometry import RadianceImage, WavelengthGrid
from fullwell.render import RenderStatistics
from fullwell.schema import build_frame, load_recipe
from fullwell.storage import LocalStore, ObjectInfo, ObjectStore, store_from_url
from servers import S3Server

LIMIT = 1 << 30
STATISTICS = RenderStatistics(8, 2, 1, 1.25, 2.5, "llvm_ad_spectral")
KEY = "ab" * 32


@pytest.fixture
def renders(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One item per rendering."""
    calls: list[int] = []
    original = frame_module.render_radiance

    def counted(*args: Any, **options: Any) -> Any:
        calls.append(1)
        return original(*args, **options)

    monkeypatch.setattr(frame_module, "render_radiance", counted)
    return calls


@pytest.fixture(params=["local", pytest.param("s3", marks=pytest.mark.service)])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> ObjectStore:
    if request.param == "local":
        return LocalStore(tmp_path / "store")
    server: S3Server = request.getfixturevalue("s3_server")
    return store_from_url(server.url())


def make(recipe: dict[str, Any], store: ObjectStore, prefix: str, *, index: int = 0, cached: bool = True) -> dict[str, Any]:
    """Make a frame as a new process would: nothing in memory."""
    stages = StageStore(store, max_bytes=LIMIT) if cached else None
    frame = build_frame(load_recipe(recipe), index)
    return render_frame(frame, store, prefix, cache=RadianceCache(), stages=stages)


def results(manifest: dict[str, Any]) -> list[tuple[str, str]]:
    return [(entry["result"], entry["source"]) for entry in manifest["run"]["cache"]]


def small_image(rows: int = 3, cols: int = 4, *, error: bool = True) -> RadianceImage:
    rng = np.random.default_rng(1)
    grid = WavelengthGrid(400.0, 700.0, 100.0)
    photons = rng.random((rows, cols, grid.count), dtype=np.float32) * np.float32(1e17)
    return RadianceImage(photons, grid, 1.3e-4, rng.random((rows, cols), dtype=np.float32) if error else None)


# The encoding --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("error", [True, False])
def test_encoding_is_exact(error: bool) -> None:
    image = small_image(error=error)
    image.photons[0, 0] = [0.0, np.float32(1e-45), np.finfo(np.float32).max, 1 / 3]
    back, statistics = decode_radiance(b"".join(encode_radiance(image, STATISTICS)))
    assert back.photons.tobytes() == image.photons.tobytes()
    assert back.photons.dtype == np.float32
    assert back.photons.flags.c_contiguous
    assert back.photons.flags.writeable
    assert (back.grid, back.tangent_pitch, statistics) == (image.grid, image.tangent_pitch, STATISTICS)
    if image.standard_error is None:
        assert back.standard_error is None
    else:
        assert back.standard_error is not None
        assert back.standard_error.tobytes() == image.standard_error.tobytes()


def test_image_with_strides_is_encoded_in_order() -> None:
    image = small_image()
    turned = RadianceImage(image.photons[::-1], image.grid, image.tangent_pitch)
    back, _ = decode_radiance(b"".join(encode_radiance(turned, STATISTICS)))
    np.testing.assert_array_equal(back.photons, turned.photons)


def test_no_beginning_of_an_encoding_is_taken_for_an_image() -> None:
    whole = b"".join(encode_radiance(small_image(), STATISTICS))
    for length in range(len(whole)):
        with pytest.raises(Exception):  # noqa: B017, PT011 - whatever is raised, the caller takes the entry for absent
            decode_radiance(whole[:length])


# A hit is as good as a miss ------------------------------------------------------------------------------------------


def test_hit_gives_the_same_bytes_of_all_products_as_a_miss_and_as_no_cache(
    recipe: dict[str, Any], store: ObjectStore, renders: list[int]
) -> None:
    recipe["cameras"][0]["sensors"].append(recipe["cameras"][0]["sensors"][0] | {"name": "small", "rows": 8, "cols": 12})
    without = make(recipe, store, "without", cached=False)
    miss = make(recipe, store, "miss")
    assert len(renders) == 2
    hit = make(recipe, store, "hit")
    assert len(renders) == 2
    assert (results(without), results(miss), results(hit)) == ([("miss", "render")], [("miss", "render")], [("hit", "store")])
    assert len(miss["products"]) == 18  # ten kinds, eight of them for each sensor
    assert without["products"] == miss["products"] == hit["products"]
    for manifest in (without, miss, hit):
        del manifest["run"]
    assert without == miss == hit


def test_manifest_says_what_a_hit_saved_and_where_it_lay(recipe: dict[str, Any], tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    make(recipe, store, "a")
    (entry,) = make(recipe, store, "b")["run"]["cache"]
    assert entry["camera"] == "main"
    assert entry["saved_wall_s"] > 0
    assert entry["waited_s"] == 0
    assert store.exists(entry["object"])
    assert store.stat(entry["object"]).size == pytest.approx(entry["bytes"], rel=0.05)


def change_sensor(camera: dict[str, Any]) -> None:
    camera["sensors"].append(camera["sensors"][0] | {"name": "second", "model": "imx363", "rows": 8, "cols": 12})


def change_exposure(camera: dict[str, Any]) -> None:
    camera["sensors"][0]["exposure"] = {"time_s": 0.02}


def change_lens_blur(camera: dict[str, Any]) -> None:
    camera["lens"]["psf"] = {"gaussian_sigma_m": 4e-6}


def change_isp(camera: dict[str, Any]) -> None:
    camera["sensors"][0]["isp"] = {"tone": {"exposure_ev": 1.0}}


@pytest.mark.parametrize("change", [change_sensor, change_exposure, change_lens_blur, change_isp])
def test_change_behind_the_radiance_renders_nothing(
    recipe: dict[str, Any], tmp_path: Path, renders: list[int], change: Callable[[dict[str, Any]], None]
) -> None:
    store = LocalStore(tmp_path)
    recipe["outputs"] = ["raw.npz", "image.png"]
    make(recipe, store, "before")
    changed = copy.deepcopy(recipe)
    change(changed["cameras"][0])
    after = make(changed, store, "after")
    assert len(renders) == 1
    assert after["products"] == make(changed, LocalStore(tmp_path / "other"), "after")["products"]


def test_repeated_frames_have_other_noise_and_one_rendering(recipe: dict[str, Any], tmp_path: Path, renders: list[int]) -> None:
    store = LocalStore(tmp_path)
    recipe |= {"outputs": ["raw.npz", "radiance.exr"], "vary": {"repeat": 3}}
    manifests = [make(recipe, store, f"f/{index}", index=index) for index in range(3)]
    assert len(renders) == 1
    assert [results(manifest)[0][0] for manifest in manifests] == ["miss", "hit", "hit"]
    raws = [encode.decode_raw_npz(store.get(f"f/{index}/raw.npz")).dn for index in range(3)]
    assert not np.array_equal(raws[0], raws[1])
    assert not np.array_equal(raws[1], raws[2])


def test_another_seed_or_scene_renders_anew(recipe: dict[str, Any], tmp_path: Path, renders: list[int]) -> None:
    store = LocalStore(tmp_path)
    make(recipe, store, "a")
    make(recipe | {"seed": 4}, store, "b")
    recipe["scene"]["lights"][0]["luminance_cd_m2"] = 900
    make(recipe, store, "c")
    assert len(renders) == 3


def test_other_rendering_code_has_entries_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    before = stored_radiance_key(KEY)
    assert before == stored_radiance_key(KEY)
    maker = cache_module._maker()
    for name, other in (("code", "0" * 64), ("llvm", "1.0"), ("instruction_sets", []), ("versions", {"mitsuba": "0"})):
        monkeypatch.setattr(cache_module, "_maker", lambda name=name, other=other: maker | {name: other})
        assert stored_radiance_key(KEY) != before


def test_plan_tells_what_is_kept(recipe: dict[str, Any], tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    frame, stages = build_frame(load_recipe(recipe)), StageStore(store, max_bytes=LIMIT)
    before = with_cache_steps(plan_frame(frame), frame, stages).steps[-1]
    manifest = make(recipe, store, "a")
    after = with_cache_steps(plan_frame(frame), frame, stages).steps[-1]
    assert (before.decision, after.decision) == ("run", "skip")
    assert manifest["run"]["cache"][0]["object"] in after.why


# Trouble -------------------------------------------------------------------------------------------------------------


class FaultyStore:
    """A local store whose cache fails at some of its methods; the products' store does not."""

    def __init__(self, root: Path, failing: set[str], error: Exception) -> None:
        self._store = LocalStore(root)
        self._failing, self._error = failing, error
        self.failures = 0

    def _fail(self, name: str, key: str) -> None:
        if name in self._failing and key.startswith("cache/"):
            self.failures += 1
            raise self._error

    def put(
        self, key: str, content: bytes | BinaryIO, content_type: str | None = None, *, if_absent: bool = False
    ) -> ObjectInfo:
        self._fail("put", key)
        return self._store.put(key, content, content_type, if_absent=if_absent)

    def get(self, key: str) -> bytes:
        self._fail("get", key)
        return self._store.get(key)

    def list(self, prefix: str = "") -> Iterator[ObjectInfo]:
        self._fail("list", prefix)
        return self._store.list(prefix)

    def delete(self, key: str) -> None:
        self._fail("delete", key)
        self._store.delete(key)

    def exists(self, key: str) -> bool:
        return self._store.exists(key)


TROUBLE = [StorageError("the disk is full"), ConflictError("a file is in the way"), OSError("gone"), RuntimeError("a bug")]


@pytest.mark.parametrize("error", TROUBLE, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize(
    "failing", [("get",), ("put",), ("list",), ("delete",), ("get", "put", "list", "delete")], ids="+".join
)
def test_trouble_with_the_cache_fails_no_frame(
    recipe: dict[str, Any], tmp_path: Path, failing: tuple[str, ...], error: Exception
) -> None:
    recipe["outputs"] = ["raw.npz"]
    good = make(recipe, LocalStore(tmp_path / "good"), "f", cached=False)
    faulty: Any = FaultyStore(tmp_path / "faulty", set(failing), error)
    for prefix in ("f", "g"):
        assert make(recipe, faulty, prefix)["products"] == good["products"]
    assert faulty.failures > 0


def test_store_that_failed_is_left_alone_for_a_while(tmp_path: Path) -> None:
    faulty: Any = FaultyStore(tmp_path, {"get"}, StorageError("away"))
    stages = StageStore(faulty, max_bytes=LIMIT)
    for _ in range(5):
        assert stages.get("radiance", KEY) is None
        assert not stages.put("radiance", KEY, b"x")
    assert faulty.failures == 1


@pytest.mark.parametrize(
    "damage", [lambda b: b[:-7], lambda b: b[:-7] + b"7654321", lambda b: b""], ids=["cut", "wrong", "empty"]
)
def test_damaged_entry_is_rendered_again_and_replaced(
    recipe: dict[str, Any], tmp_path: Path, renders: list[int], damage: Callable[[bytes], bytes]
) -> None:
    store = LocalStore(tmp_path)
    first = make(recipe, store, "a")
    address = first["run"]["cache"][0]["object"]
    whole = store.get(address)
    store.put(address, damage(whole))
    second = make(recipe, store, "b")
    third = make(recipe, store, "c")
    assert len(renders) == 2
    assert first["products"] == second["products"] == third["products"]
    assert [results(manifest)[0][0] for manifest in (second, third)] == ["miss", "hit"]


def test_entry_that_holds_another_shape_is_discarded(tmp_path: Path) -> None:
    stages = StageStore(LocalStore(tmp_path), max_bytes=LIMIT)
    stages.put("radiance", stored_radiance_key(KEY), *encode_radiance(small_image(5, 5), STATISTICS))
    found = obtain_radiance(
        KEY, lambda: (small_image(3, 4), STATISTICS), shape=(3, 4, 4), memory=RadianceCache(), stages=stages
    )
    assert found.source == "render"
    content = stages.get("radiance", stored_radiance_key(KEY))
    assert content is not None
    assert decode_radiance(content)[0].rows == 3


def test_rendering_that_fails_is_not_kept_and_holds_nobody_up(tmp_path: Path) -> None:
    def fail() -> Any:
        raise RenderError("too many invalid samples")

    store = LocalStore(tmp_path)
    for _ in range(2):
        with pytest.raises(RenderError):
            obtain_radiance(KEY, fail, shape=(3, 4, 4), memory=RadianceCache(), stages=StageStore(store, max_bytes=LIMIT))
    assert list(store.list()) == []


def test_image_larger_than_the_cache_is_not_waited_for(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    stages = StageStore(store, max_bytes=100)
    found = obtain_radiance(KEY, lambda: (small_image(), STATISTICS), shape=(3, 4, 4), memory=RadianceCache(), stages=stages)
    assert (found.source, found.stored_as) == ("render", None)
    assert list(store.list()) == []


# Eviction ------------------------------------------------------------------------------------------------------------


def test_least_recently_used_entries_go_first(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    writer = StageStore(store, max_bytes=LIMIT)
    keys = [hashlib.sha256(bytes([number])).hexdigest() for number in range(5)]
    now = datetime.datetime.now(tz=datetime.UTC).timestamp()
    for age, key in enumerate(keys):
        writer.put("radiance", key, bytes(1000))
        written = now - 10_000 + age  # the first is the oldest
        os.utime(tmp_path / writer.address("radiance", key), (written, written))
    reader = StageStore(store, max_bytes=4000)
    assert reader.get("radiance", keys[0]) is not None  # used now, by a process that has not noted it yet
    assert reader.sweep() > 0
    kept = [reader.has("radiance", key) for key in keys]
    assert kept == [True, False, False, True, True]


def test_sweep_below_the_limit_deletes_nothing_but_old_traces(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    stages = StageStore(store, max_bytes=LIMIT)
    stages.put("radiance", KEY, b"x")
    stranger = stages.address("radiance", "cd" * 32)
    for suffix in (".used", ".lease"):
        store.put(stranger + suffix, b"")
        os.utime(tmp_path / (stranger + suffix), (0, 0))
    assert stages.sweep() == 0
    assert [info.key for info in store.list()] == [stages.address("radiance", KEY)]


def test_image_used_from_memory_counts_as_used(tmp_path: Path) -> None:
    store, memory = LocalStore(tmp_path), RadianceCache()
    options: dict[str, Any] = {"shape": (3, 4, 4), "memory": memory}
    obtain_radiance(KEY, lambda: (small_image(), STATISTICS), stages=StageStore(store, max_bytes=LIMIT), **options)
    later = StageStore(store, max_bytes=LIMIT)  # as if an hour had passed: it remembers no touch
    assert obtain_radiance(KEY, lambda: (small_image(), STATISTICS), stages=later, **options).source == "memory"
    assert store.exists(later.address("radiance", stored_radiance_key(KEY)) + ".used")


# Workers at once -----------------------------------------------------------------------------------------------------


def test_threads_that_need_one_image_render_it_once(tmp_path: Path) -> None:
    store, made = LocalStore(tmp_path), []

    def render() -> tuple[RadianceImage, RenderStatistics]:
        made.append(1)
        return small_image(), STATISTICS

    def obtain(_: int) -> bytes:
        stages = StageStore(store, max_bytes=LIMIT)
        found = obtain_radiance(KEY, render, shape=(3, 4, 4), memory=RadianceCache(), stages=stages)
        return found.image.photons.tobytes()

    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(obtain, range(8))) == {small_image().photons.tobytes()}
    assert len(made) == 1


PRODUCE = """
import sys, json
from fullwell.pipeline import StageStore, run_frame
from fullwell.schema import load_recipe
from fullwell.storage import LocalStore
store = LocalStore(sys.argv[1])
document, stages = load_recipe(json.loads(sys.stdin.read())), StageStore(store, max_bytes=1 << 30)
manifest = run_frame(document, 0, store, sys.argv[2], stages=stages)
print(json.dumps([manifest["run"]["cache"][0]["result"], manifest["products"]]))
"""


def test_processes_that_need_one_image_render_it_once(recipe: dict[str, Any], tmp_path: Path) -> None:
    commands = [[sys.executable, "-c", PRODUCE, str(tmp_path), f"f/{number}"] for number in range(3)]
    running = [subprocess.Popen(command, stdin=-1, stdout=-1, text=True) for command in commands]
    for process in running:
        assert process.stdin is not None
        process.stdin.write(json.dumps(recipe))
        process.stdin.close()
        process.stdin = None
    told = [json.loads(process.communicate(timeout=200)[0].splitlines()[-1]) for process in running]
    assert sorted(result for result, _ in told) == ["hit", "hit", "miss"]
    assert told[0][1] == told[1][1] == told[2][1]


KILLED = """
import os, sys
from fullwell.pipeline import StageStore
from fullwell.storage import LocalStore
with StageStore(LocalStore(sys.argv[1]), max_bytes=1000).turn("radiance", sys.argv[2]) as turn:
    assert turn.ours
    os._exit(9)
"""


def test_worker_that_was_killed_on_this_machine_is_succeeded_at_once(tmp_path: Path) -> None:
    key = stored_radiance_key(KEY)
    assert subprocess.run([sys.executable, "-c", KILLED, str(tmp_path), key], check=False).returncode == 9
    stages = StageStore(LocalStore(tmp_path), max_bytes=LIMIT, lease_s=1000.0, wait_s=1000.0)
    assert LocalStore(tmp_path).exists(stages.address("radiance", key) + ".lease")
    found = obtain_radiance(KEY, lambda: (small_image(), STATISTICS), shape=(3, 4, 4), memory=RadianceCache(), stages=stages)
    assert found.source == "render"
    assert stages.has("radiance", key)
    assert not LocalStore(tmp_path).exists(stages.address("radiance", key) + ".lease")


# Who uses it ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("setting", "limit"), [("0", None), ("123456", 123456), (None, 8 << 30)])
def test_worker_keeps_images_in_the_products_store_within_the_setting(
    recipe: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, setting: str | None, limit: int | None
) -> None:
    import fullwell.pipeline
    from fullwell_worker.execution import PipelineRunner

    if setting is None:
        monkeypatch.delenv("FULLWELL_CACHE_BYTES", raising=False)
    else:
        monkeypatch.setenv("FULLWELL_CACHE_BYTES", setting)
    seen: list[StageStore | None] = []
    monkeypatch.setattr(fullwell.pipeline, "run_frame", lambda *_, stages, **__: seen.append(stages))
    runner, store, document = PipelineRunner(), LocalStore(tmp_path), load_recipe(recipe)
    for index in range(2):
        runner(document, index, store, "f", base_dir=None, progress=None, should_cancel=None)
    assert seen[0] is seen[1]
    if limit is None:
        assert seen[0] is None
    else:
        assert seen[0] is not None
        assert (seen[0].store, seen[0].max_bytes) == (store, limit)


def test_negative_cache_size_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FULLWELL_CACHE_BYTES", "-1")
    with pytest.raises(FieldError, match="FULLWELL_CACHE_BYTES"):
        load_settings()


def test_render_command_keeps_images_between_runs_unless_told_not_to(recipe: dict[str, Any], tmp_path: Path) -> None:
    file = tmp_path / "ball.json"
    file.write_text(json.dumps(recipe | {"outputs": ["raw.npz"]}))
    environment = {name: value for name, value in os.environ.items() if not name.startswith("FULLWELL_")}

    def sources(folder: str, *words: str, **extra: str) -> list[str]:
        code = "import sys; from fullwell.cli.main import main; sys.exit(main())"
        command = [sys.executable, "-c", code, "render", str(file), "-o", str(tmp_path / folder), "--json", *words]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment | extra)
        return [entry["source"] for frame in json.loads(done.stdout)["frames"] for entry in frame["cache"]]

    kept = ("--cache", str(tmp_path / "kept"))
    assert sources("a", *kept) == ["render"]
    assert sources("b", *kept) == ["store"]
    assert sources("c", *kept, FULLWELL_CACHE_BYTES="0") == ["render"]
    assert sources("d", "--no-cache", FULLWELL_HOME=str(tmp_path / "kept")) == ["render"]
    assert sources("e", FULLWELL_HOME=str(tmp_path / "kept")) == ["store"]
    (tmp_path / "file").write_text("no folder")
    assert sources("f", "--cache", str(tmp_path / "file")) == ["render"]
