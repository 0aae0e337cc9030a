"""Ingestion in a child process: the same result, and whatever a file does ends that process alone, leaving nothing behind."""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import Image

from fullwell.assets.ingest import IngestError, IngestLimits, IngestOptions, IngestProcess, prepare_file, prepare_in_child
from fullwell.assets.ingest import process as process_module

ROOT = Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT))  # benchmarks/ is no part of the distribution

from benchmarks.ingestion import damaged_outcomes  # noqa: E402
from benchmarks.mutations import KINDS, mutated  # noqa: E402

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("pxr")

OPTIONS = IngestOptions(id="thing")

LONGEST_S = 60.0
"""A file that takes this long hangs; alone, one takes well under 2 s."""

SEED = 20240229


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for all temporary files, to look into afterwards."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def process(temporary: Path) -> Iterator[IngestProcess]:
    with IngestProcess() as made:
        yield made
    assert list(temporary.iterdir()) == [], "the process's folder must be gone"


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    folder = tmp_path / "upload"
    folder.mkdir()
    trimesh.Scene(trimesh.creation.icosphere(3)).export(folder / "ball.glb")
    return folder


def test_the_child_gives_the_same_asset_and_tells_how_far_it_is(process: IngestProcess, ball: Path) -> None:
    seen: list[tuple[float, str]] = []
    made = process.prepare(ball, "ball.glb", OPTIONS, progress=lambda share, stage: seen.append((share, stage)))
    here = prepare_file(ball, "ball.glb", OPTIONS)
    assert made.manifest == here.manifest
    assert dict(made.blobs) == dict(here.blobs)
    assert seen[0] == (0.0, "read")
    assert seen[-1][0] == 1.0


def test_one_call_needs_no_process_to_be_kept(temporary: Path, ball: Path) -> None:
    assert prepare_in_child(ball, "ball.glb", OPTIONS).manifest.levels[0].triangles == 1280
    assert list(temporary.iterdir()) == []


def test_a_refusal_keeps_the_process_and_leaves_nothing(process: IngestProcess, ball: Path, temporary: Path) -> None:
    process.prepare(ball, "ball.glb", OPTIONS)
    first = process.pid
    (ball / "broken.glb").write_bytes((ball / "ball.glb").read_bytes()[:5000])
    with pytest.raises(IngestError, match="truncated") as caught:
        process.prepare(ball, "broken.glb", OPTIONS)
    assert (caught.value.cause, caught.value.path) == ("refused", "file")
    assert process.pid == first
    (folder,) = temporary.iterdir()
    assert {file.name for file in folder.iterdir()} == {"lock", "scratch", "said"}
    assert list((folder / "scratch").iterdir()) == []


def test_a_process_that_dies_of_a_file_is_told_and_replaced(process: IngestProcess, ball: Path) -> None:
    process.start()
    victim = process.pid

    def kill(share: float, stage: str) -> None:
        assert victim is not None
        os.kill(victim, signal.SIGSEGV)

    with pytest.raises(IngestError, match="SIGSEGV") as caught:
        process.prepare(ball, "ball.glb", OPTIONS, progress=kill)
    assert caught.value.cause == "died"
    assert process.prepare(ball, "ball.glb", OPTIONS).manifest.levels
    assert process.pid != victim


def test_a_process_that_died_while_idle_is_replaced_without_a_word(process: IngestProcess, ball: Path) -> None:
    process.prepare(ball, "ball.glb", OPTIONS)
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    assert process.prepare(ball, "ball.glb", OPTIONS).manifest.levels


@pytest.mark.slow
def test_a_file_that_needs_too_much_memory_is_told_so(temporary: Path, tmp_path: Path) -> None:
    folder = tmp_path / "large"
    folder.mkdir()
    # A few kilobytes in the file, 432 MB as pixels.
    Image.new("1", (12_000, 12_000)).save(folder / "t.png")
    (folder / "m.mtl").write_text("newmtl a\nmap_Kd t.png\n")
    triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n"
    (folder / "large.obj").write_text("mtllib m.mtl\n" + triangle)
    with IngestProcess(IngestLimits(memory_bytes=500 << 20)) as process:
        with pytest.raises(IngestError, match="500 MiB of memory") as caught:
            process.prepare(folder, "large.obj", OPTIONS)
        assert caught.value.cause == "memory"
        trimesh.creation.box().export(folder / "small.stl")
        assert process.prepare(folder, "small.stl", OPTIONS).manifest.levels
    assert list(temporary.iterdir()) == []


def test_a_damaged_crate_that_asks_for_all_memory_ends_its_process_alone(process: IngestProcess, tmp_path: Path) -> None:
    """Bits of a binary USD layer flipped; the reader trusts its counts. Each is refused or read, or its process dies of it."""
    from pxr import Usd, UsdGeom

    folder = tmp_path / "crates"
    folder.mkdir()
    stage = Usd.Stage.CreateNew(str(folder / "whole.usdc"))
    UsdGeom.Cube.Define(stage, "/Cube")
    stage.GetRootLayer().Save()
    whole = (folder / "whole.usdc").read_bytes()
    rng = random.Random(SEED)
    for number in range(12):
        name = f"{number}.usdc"
        (folder / name).write_bytes(mutated(whole, "bits flipped" if number % 2 else "numbers changed", rng))
        try:
            process.prepare(folder, name, OPTIONS)
        except IngestError as error:
            assert error.cause in ("refused", "died", "memory", "time")  # noqa: PT017
    assert process.prepare(folder, "whole.usdc", OPTIONS).manifest.levels


def test_a_file_that_takes_too_long_is_ended(temporary: Path, ball: Path) -> None:
    with IngestProcess(IngestLimits(wall_s=0.001)) as process:
        process.start()
        with pytest.raises(IngestError, match=r"longer than 0\.001 s") as caught:
            process.prepare(ball, "ball.glb", OPTIONS)
        assert caught.value.cause == "time"
        assert process.pid is None
    assert list(temporary.iterdir()) == []


@pytest.mark.slow
def test_too_much_processor_time_ends_it_too(temporary: Path, tmp_path: Path) -> None:
    folder = tmp_path / "long"
    folder.mkdir()
    trimesh.Scene(trimesh.creation.icosphere(7)).export(folder / "ball.obj")
    with IngestProcess(IngestLimits(cpu_s=0.01)) as process:
        with pytest.raises(IngestError, match="processor time") as caught:
            process.prepare(folder, "ball.obj", OPTIONS)
        assert caught.value.cause == "time"
    assert list(temporary.iterdir()) == []


def test_a_result_that_is_too_large_is_refused(temporary: Path, ball: Path) -> None:
    with IngestProcess(IngestLimits(output_bytes=4096)) as process, pytest.raises(IngestError, match="4096 bytes") as caught:
        process.prepare(ball, "ball.glb", OPTIONS)
    assert caught.value.cause == "size"
    assert list(temporary.iterdir()) == []


def test_cancelling_ends_it(process: IngestProcess, ball: Path) -> None:
    with pytest.raises(IngestError, match="cancelled") as caught:
        process.prepare(ball, "ball.glb", OPTIONS, should_cancel=lambda: True)
    assert caught.value.cause == "cancelled"


@pytest.mark.slow
def test_after_its_share_the_process_is_replaced(temporary: Path, ball: Path) -> None:
    with IngestProcess(IngestLimits(max_assets=2)) as process:
        pids = []
        for _ in range(3):
            process.start()
            pids.append(process.pid)
            process.prepare(ball, "ball.glb", OPTIONS)
        assert pids[0] == pids[1] != pids[2]


def test_threads_take_turns(process: IngestProcess, ball: Path) -> None:
    made: list[int] = []
    threads = [
        threading.Thread(target=lambda: made.append(process.prepare(ball, "ball.glb", OPTIONS).manifest.levels[0].triangles))
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(LONGEST_S)
    assert made == [1280] * 3


def test_what_a_killed_parent_left_is_swept_but_not_what_another_uses(temporary: Path, ball: Path) -> None:
    stale = temporary / "fullwell-ingest-stale"
    (stale / "scratch").mkdir(parents=True)
    (stale / "lock").write_bytes(b"")
    old = time.time() - 3600
    os.utime(stale, (old, old))
    with IngestProcess() as other:
        other.start()
        (used,) = (folder for folder in temporary.iterdir() if folder != stale)
        os.utime(used, (old, old))
        process_module._sweep()
        assert used.is_dir()
    assert not stale.exists()


def test_the_child_knows_no_keys(process: IngestProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
    monkeypatch.setenv("FULLWELL_DATABASE_URL", "postgresql://user:secret@host/db")
    process.start()
    time.sleep(0.1)
    environment = Path(f"/proc/{process.pid}/environ").read_bytes()
    assert b"secret" not in environment
    assert b"TMPDIR" in environment


def test_the_child_ends_with_its_orders(temporary: Path, ball: Path) -> None:
    """What happens when the parent is killed: its end of the pipe closes."""
    process = IngestProcess()
    process.prepare(ball, "ball.glb", OPTIONS)
    child = process._child
    assert child is not None
    assert child._process.stdin is not None
    child._process.stdin.close()
    assert child._process.wait(LONGEST_S) == 0
    process.close()


def test_every_kind_of_damage_changes_a_file() -> None:
    content = bytes(range(256)) * 40 + b" 12 34.5 "
    rng = random.Random(SEED)
    for kind in KINDS:
        assert any(mutated(content, kind, rng) != content for _ in range(3)), kind


def taken_or_refused(samples: Path, count: int, seed: int) -> None:
    with IngestProcess(IngestLimits(wall_s=LONGEST_S, cpu_s=LONGEST_S)) as process:
        outcomes = list(damaged_outcomes(samples, count, seed, process))
    assert len(outcomes) == count
    assert [o for o in outcomes if o.result == "unforeseen"] == []
    assert [o for o in outcomes if o.seconds > LONGEST_S] == []
    assert {o.result for o in outcomes} <= {"refused", "ingested", "died", "memory"}
    assert sum(o.result == "refused" for o in outcomes) > count / 3
    assert any(o.result == "ingested" for o in outcomes)


@pytest.mark.slow
def test_forty_damaged_samples_are_taken_in_or_refused(samples: Path, temporary: Path) -> None:
    taken_or_refused(samples, 40, SEED)
    assert list(temporary.iterdir()) == []


@pytest.mark.slow
def test_three_hundred_damaged_samples_are_taken_in_or_refused(samples: Path, temporary: Path) -> None:
    taken_or_refused(samples, 300, SEED + 1)
    assert list(temporary.iterdir()) == []
