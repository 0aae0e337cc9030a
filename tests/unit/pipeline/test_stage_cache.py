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
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pytest

import fullwell.pipeline.frame as frame_module
from commands import fullwell
from fullwell.core.errors import ConflictError, FieldError, RenderError, StorageError
from fullwell.core.settings import load_settings
from fullwell.dataset import encode
from fullwell.pipeline import LightCache, StageStore, plan_frame, render_frame, with_cache_steps
from fullwell.pipeline import cache as cache_module
from fullwell.pipeline import run as run_module
from fullwell.pipeline.cache import decode_light, encode_light, obtain_light, stored_light_key
from fullwell.radiometry import WavelengthGrid
from fullwell.render import RenderedLight, RenderStatistics
from fullwell.schema import build_frame, load_recipe
from fullwell.storage import LocalStore, ObjectInfo, ObjectStore, store_from_url
from servers import S3Server

LIMIT = 1 << 30
STATISTICS = RenderStatistics(
    8.5,
    2,
    1,
    1.25,
    2.5,
    "llvm_ad_spectral",
    samples_min=4,
    samples_max=16,
    noise_ratio_rms=0.1,
    unmet_tiles=1,
    stopped_by="time",
)
KEY = "ab" * 32
KIND = cache_module.KIND
SHAPES = (4, 2, 3, 3, 4), (2, 3, 4, 4)
"""Of `small_light()`: (replicas, groups, channels, rows, cols) and (groups, rows, cols, bands)."""


@pytest.fixture
def renders(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One item per rendering."""
    calls: list[int] = []
    original = frame_module.render_light

    def counted(*args: Any, **options: Any) -> Any:
        calls.append(1)
        return original(*args, **options)

    monkeypatch.setattr(frame_module, "render_light", counted)
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
    return render_frame(frame, store, prefix, cache=LightCache(), stages=stages)


def results(manifest: dict[str, Any]) -> list[tuple[str, str]]:
    return [(entry["result"], entry["source"]) for entry in manifest["run"]["cache"]]


def small_light(rows: int = 3, cols: int = 4, *, bands: bool = True) -> RenderedLight:
    rng = np.random.default_rng(1)
    grid = WavelengthGrid(400.0, 700.0, 100.0)
    return RenderedLight(
        replicas=rng.random((4, 2, 3, rows, cols), dtype=np.float32) * np.float32(1e18),
        bands=rng.random((2, rows, cols, grid.count), dtype=np.float32) * np.float32(1e17) if bands else None,
        groups=("lamp", "sky"),
        grid=grid,
        tangent_pitch=1.3e-4,
        statistics=STATISTICS,
    )


def same_bytes(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and one.dtype == other.dtype and one.tobytes() == other.tobytes()


# The encoding --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bands", [True, False])
def test_encoding_is_exact(bands: bool) -> None:
    light = small_light(bands=bands)
    odd = [0.0, np.float32(1e-45), np.finfo(np.float32).max, 1 / 3]
    light.replicas[0, 0, 0, 0] = odd
    if light.bands is not None:
        light.bands[0, 0, 0] = odd
    back = decode_light(b"".join(encode_light(light)))
    for array, original in ((back.replicas, light.replicas), (back.bands, light.bands)):
        if original is None:
            assert array is None
        else:
            assert array is not None
            assert same_bytes(array, original)
            assert array.flags.c_contiguous
            assert array.flags.writeable
    assert (back.groups, back.grid, back.tangent_pitch) == (light.groups, light.grid, light.tangent_pitch)
    assert back.statistics == STATISTICS


def test_light_with_strides_is_encoded_in_order() -> None:
    light = small_light()
    assert light.bands is not None
    turned = replace(light, replicas=light.replicas[:, :, :, ::-1], bands=light.bands[:, ::-1])
    back = decode_light(b"".join(encode_light(turned)))
    assert back.bands is not None
    np.testing.assert_array_equal(back.replicas, turned.replicas)
    np.testing.assert_array_equal(back.bands, turned.bands)


def test_light_of_another_precision_is_not_encoded() -> None:
    light = small_light()
    with pytest.raises(TypeError, match="float64"):
        encode_light(replace(light, replicas=light.replicas.astype(np.float64)))


@pytest.mark.parametrize("bands", [True, False])
def test_no_beginning_of_an_encoding_is_taken_for_light(bands: bool) -> None:
    whole = b"".join(encode_light(small_light(bands=bands)))
    for length in range(len(whole)):
        with pytest.raises(Exception):  # noqa: B017, PT011 - whatever is raised, the caller takes the entry for absent
            decode_light(whole[:length])


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


def change_aperture_blades(camera: dict[str, Any]) -> None:
    camera["lens"]["aperture"] = {"blades": 6, "scratches": 50}


def change_isp(camera: dict[str, Any]) -> None:
    camera["sensors"][0]["isp"] = {"tone": {"exposure_ev": 1.0}}


@pytest.mark.parametrize("change", [change_sensor, change_exposure, change_isp])
def test_change_behind_the_light_renders_nothing(
    recipe: dict[str, Any], tmp_path: Path, renders: list[int], change: Callable[[dict[str, Any]], None]
) -> None:
    check_that_change_renders_nothing(recipe, tmp_path, renders, change, ["raw.npz", "image.png"])


def test_lens_blur_renders_nothing_where_the_spectrum_is_kept(
    recipe: dict[str, Any], tmp_path: Path, renders: list[int]
) -> None:
    check_that_change_renders_nothing(recipe, tmp_path, renders, change_lens_blur, ["raw.npz", "image.png", "radiance.exr"])


@pytest.mark.slow
def test_lenses_that_need_the_spectrum_share_one_rendering(recipe: dict[str, Any], tmp_path: Path, renders: list[int]) -> None:
    change_lens_blur(recipe["cameras"][0])

    def other_blur(camera: dict[str, Any]) -> None:
        del camera["lens"]["psf"]
        change_aperture_blades(camera)

    check_that_change_renders_nothing(recipe, tmp_path, renders, other_blur, ["raw.npz", "image.png"])


def check_that_change_renders_nothing(
    recipe: dict[str, Any], tmp_path: Path, renders: list[int], change: Callable[[dict[str, Any]], None], outputs: list[str]
) -> None:
    store = LocalStore(tmp_path)
    recipe["outputs"] = outputs
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
    before = stored_light_key(KEY)
    assert before == stored_light_key(KEY)
    maker = cache_module.maker(("core",))
    for name, other in (("code", "0" * 64), ("llvm", "1.0"), ("instruction_sets", []), ("versions", {"mitsuba": "0"})):
        monkeypatch.setattr(cache_module, "maker", lambda _, name=name, other=other: maker | {name: other})
        assert stored_light_key(KEY) != before


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


@pytest.mark.slow
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
        assert stages.get(KIND, KEY) is None
        assert not stages.put(KIND, KEY, b"x")
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


@pytest.mark.parametrize("other", [small_light(5, 5), small_light(bands=False)], ids=["size", "no bands"])
def test_entry_that_holds_another_shape_is_discarded(tmp_path: Path, other: RenderedLight) -> None:
    stages = StageStore(LocalStore(tmp_path), max_bytes=LIMIT)
    stages.put(KIND, stored_light_key(KEY), *encode_light(other))
    found = obtain_light(KEY, small_light, shapes=SHAPES, memory=LightCache(), stages=stages)
    assert found.source == "render"
    content = stages.get(KIND, stored_light_key(KEY))
    assert content is not None
    assert same_bytes(decode_light(content).replicas, small_light().replicas)


def test_rendering_that_fails_is_not_kept_and_holds_nobody_up(tmp_path: Path) -> None:
    def fail() -> Any:
        raise RenderError("too many invalid samples")

    store = LocalStore(tmp_path)
    for _ in range(2):
        with pytest.raises(RenderError):
            obtain_light(KEY, fail, shapes=SHAPES, memory=LightCache(), stages=StageStore(store, max_bytes=LIMIT))
    assert list(store.list()) == []


def test_light_larger_than_the_cache_is_not_waited_for(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    stages = StageStore(store, max_bytes=100)
    found = obtain_light(KEY, small_light, shapes=SHAPES, memory=LightCache(), stages=stages)
    assert (found.source, found.stored_as) == ("render", None)
    assert list(store.list()) == []


# Eviction ------------------------------------------------------------------------------------------------------------


def test_least_recently_used_entries_go_first(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    writer = StageStore(store, max_bytes=LIMIT)
    keys = [hashlib.sha256(bytes([number])).hexdigest() for number in range(5)]
    now = datetime.datetime.now(tz=datetime.UTC).timestamp()
    for age, key in enumerate(keys):
        writer.put(KIND, key, bytes(1000))
        written = now - 10_000 + age  # the first is the oldest
        os.utime(tmp_path / writer.address(KIND, key), (written, written))
    reader = StageStore(store, max_bytes=4000)
    assert reader.get(KIND, keys[0]) is not None  # used now, by a process that has not noted it yet
    assert reader.sweep() > 0
    kept = [reader.has(KIND, key) for key in keys]
    assert kept == [True, False, False, True, True]


def test_sweep_below_the_limit_deletes_nothing_but_old_traces(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    stages = StageStore(store, max_bytes=LIMIT)
    stages.put(KIND, KEY, b"x")
    stranger = stages.address(KIND, "cd" * 32)
    for suffix in (".used", ".lease"):
        store.put(stranger + suffix, b"")
        os.utime(tmp_path / (stranger + suffix), (0, 0))
    assert stages.sweep() == 0
    assert [info.key for info in store.list()] == [stages.address(KIND, KEY)]


def test_light_used_from_memory_counts_as_used(tmp_path: Path) -> None:
    store, memory = LocalStore(tmp_path), LightCache()
    options: dict[str, Any] = {"shapes": SHAPES, "memory": memory}
    obtain_light(KEY, small_light, stages=StageStore(store, max_bytes=LIMIT), **options)
    later = StageStore(store, max_bytes=LIMIT)  # as if an hour had passed: it remembers no touch
    assert obtain_light(KEY, small_light, stages=later, **options).source == "memory"
    assert store.exists(later.address(KIND, stored_light_key(KEY)) + ".used")


# Workers at once -----------------------------------------------------------------------------------------------------


def test_threads_that_need_the_same_light_render_it_once(tmp_path: Path) -> None:
    store, made = LocalStore(tmp_path), []

    def render() -> RenderedLight:
        made.append(1)
        return small_light()

    def obtain(_: int) -> bytes:
        stages = StageStore(store, max_bytes=LIMIT)
        found = obtain_light(KEY, render, shapes=SHAPES, memory=LightCache(), stages=stages)
        return found.light.replicas.tobytes()

    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(obtain, range(8))) == {small_light().replicas.tobytes()}
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


@pytest.mark.slow
def test_processes_that_need_the_same_light_render_it_once(recipe: dict[str, Any], tmp_path: Path) -> None:
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
with StageStore(LocalStore(sys.argv[1]), max_bytes=1000).turn("light", sys.argv[2]) as turn:
    assert turn.ours
    os._exit(9)
"""


def test_worker_that_was_killed_on_this_machine_is_succeeded_at_once(tmp_path: Path) -> None:
    key = stored_light_key(KEY)
    assert subprocess.run([sys.executable, "-c", KILLED, str(tmp_path), key], check=False).returncode == 9
    stages = StageStore(LocalStore(tmp_path), max_bytes=LIMIT, lease_s=1000.0, wait_s=1000.0)
    assert LocalStore(tmp_path).exists(stages.address(KIND, key) + ".lease")
    found = obtain_light(KEY, small_light, shapes=SHAPES, memory=LightCache(), stages=stages)
    assert found.source == "render"
    assert stages.has(KIND, key)
    assert not LocalStore(tmp_path).exists(stages.address(KIND, key) + ".lease")


# Who uses it ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("setting", "limit"), [("0", None), ("123456", 123456), (None, 8 << 30)])
def test_worker_keeps_light_in_the_products_store_within_the_setting(
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


def test_render_command_keeps_light_between_runs_unless_told_not_to(
    recipe: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "ball.json"
    file.write_text(json.dumps(recipe | {"outputs": ["raw.npz"]}))

    def sources(folder: str, *words: str, **extra: str) -> list[str]:
        with monkeypatch.context() as patch:
            patch.setattr(run_module, "_process_cache", LightCache())  # as in a process of its own
            for name in [name for name in os.environ if name.startswith("FULLWELL_")]:
                patch.delenv(name)
            for name, value in extra.items():
                patch.setenv(name, value)
            done = fullwell("render", file, "-o", tmp_path / folder, "--json", *words)
        assert done.returncode == 0, done.stderr
        return [entry["source"] for frame in json.loads(done.stdout)["frames"] for entry in frame["cache"]]

    kept = ("--cache", str(tmp_path / "kept"))
    assert sources("a", *kept) == ["render"]
    assert sources("b", *kept) == ["store"]
    assert sources("c", *kept, FULLWELL_CACHE_BYTES="0") == ["render"]
    assert sources("d", "--no-cache", FULLWELL_HOME=str(tmp_path / "kept")) == ["render"]
    assert sources("e", FULLWELL_HOME=str(tmp_path / "kept")) == ["store"]
    (tmp_path / "file").write_text("no folder")
    assert sources("f", "--cache", str(tmp_path / "file")) == ["render"]
