"""A render process may crash, grow, hang or be left alone: each ends one frame with its cause, and the next one is made."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from recipes import tiny_recipe

from fullwell.core import (
    CancelledError,
    FieldError,
    FullwellError,
    RenderMemoryError,
    RenderProcessError,
    RenderTimeError,
    StorageError,
)
from fullwell.core.settings import Settings, load_settings
from fullwell.schema import RecipeError, load_recipe
from fullwell.storage import LocalStore
from fullwell_worker.execution import PERMANENT, PipelineRunner, runner_of
from fullwell_worker.isolation import IsolatedRunner
from fullwell_worker.limits import RenderLimits, limits_of, resident_bytes
from fullwell_worker.render_process import RenderProcess

MIB = 1 << 20
ROOMY = RenderLimits(memory_bytes=4096 * MIB, recycle_bytes=2048 * MIB, time_s=60.0, max_frames=50)
FOLDER = Path(__file__).resolve().parent

Make = Callable[..., Any]


class Isolated:
    """A runner with the stand-in in its render process."""

    def __init__(self, folder: Path, limits: RenderLimits) -> None:
        self.store = LocalStore(folder)
        self.document: Any = SimpleNamespace(name="first")  # a recipe's package would take a second to load, in each process
        self.seen: list[tuple[str, float]] = []
        self.runner = IsolatedRunner(
            folder.as_uri(), limits, runner="render_standins:Standin", environment={"PYTHONPATH": str(FOLDER)}
        )

    def make(self, what: str = "fine", index: int = 0, *, should_cancel: Callable[[], bool] | None = None) -> dict[str, Any]:
        manifest: dict[str, Any] = self.runner(
            self.document,
            index,
            self.store,
            f"f/{what}",
            base_dir=None,
            progress=lambda at: self.seen.append((at.stage, at.fraction)),
            should_cancel=should_cancel,
        )
        return manifest


@pytest.fixture
def isolated(tmp_path: Path) -> Iterator[Callable[..., Isolated]]:
    with contextlib.ExitStack() as stack:

        def made(**limits: Any) -> Isolated:
            isolated = Isolated(tmp_path, replace(ROOMY, **limits))
            stack.callback(isolated.runner.close)
            return isolated

        yield made


def is_alive(pid: int | None) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def wait_until(condition: Callable[[], bool], seconds: float = 20.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_frames_are_made_in_one_other_process_that_stays_warm(isolated: Callable[..., Isolated]) -> None:
    one = isolated()
    first, second = one.make("a", 1), one.make("b", 2)
    assert first["pid"] == second["pid"] == one.runner.pid != os.getpid()
    assert [first["index"], second["index"], second["frames"]] == [1, 2, 2]
    assert first["name"] == "first"
    assert one.seen == [("render", 0.25), ("done", 1.0)] * 2
    assert one.store.exists("f/b/manifest.json")


def test_another_document_replaces_the_one_that_the_process_keeps(isolated: Callable[..., Isolated]) -> None:
    one = isolated()
    one.make()
    one.document = SimpleNamespace(name="another")
    assert one.make()["name"] == "another"
    assert one.make()["name"] == "another"


def test_a_crash_fails_its_frame_with_the_cause_and_the_next_one_is_made(
    isolated: Callable[..., Isolated], capfd: pytest.CaptureFixture[str]
) -> None:
    one = isolated()
    first = one.make()
    with pytest.raises(RenderProcessError, match=r"died by SIGSEGV \(signal 11\) in stage 'render' \(25%\)") as caught:
        one.make("segfault")
    assert caught.value.message.endswith(": LLVM ERROR: something is wrong")
    assert caught.value.code == "render_process_died"
    assert not isinstance(caught.value, PERMANENT)
    assert not one.store.exists("f/segfault/manifest.json")
    again = one.make()
    assert (again["frames"], again["pid"] != first["pid"], is_alive(first["pid"])) == (1, True, False)
    # What the process said, and where it was, is in this one's log.
    said = capfd.readouterr().err
    assert "LLVM ERROR: something is wrong" in said
    assert "in segfault" in said


@pytest.mark.parametrize(("what", "cause"), [("killed", "SIGKILL.*memory runs out"), ("exits", "ended with exit code 3")])
def test_other_ends_have_their_cause_too(isolated: Callable[..., Isolated], what: str, cause: str) -> None:
    with pytest.raises(RenderProcessError, match=cause):
        isolated().make(what)


def test_a_process_that_dies_while_idle_fails_nothing(isolated: Callable[..., Isolated]) -> None:
    one = isolated()
    pid = one.make()["pid"]
    os.kill(pid, signal.SIGKILL)
    wait_until(lambda: not is_alive(pid))
    assert one.make()["frames"] == 1


def test_a_death_that_shows_only_when_the_frame_is_sent_fails_nothing(
    isolated: Callable[..., Isolated], monkeypatch: pytest.MonkeyPatch
) -> None:
    # A process that is being ended is no zombie yet: the look before the frame finds it alive.
    one = isolated()
    pid = one.make()["pid"]
    with monkeypatch.context() as patch:
        patch.setattr(IsolatedRunner, "_living_child", lambda self: self._child or RenderProcess(*living_arguments(self)))
        os.kill(pid, signal.SIGKILL)
        wait_until(lambda: not is_alive(pid))
        again = one.make()
    assert (again["frames"], again["pid"] != pid, again["name"]) == (1, True, "first")


def living_arguments(runner: Any) -> tuple[Any, ...]:
    return runner._limits, runner._runner, runner._environment


def test_a_frame_that_grows_beyond_the_limit_is_ended(isolated: Callable[..., Isolated]) -> None:
    one = isolated(memory_bytes=640 * MIB)
    with pytest.raises(RenderMemoryError, match=r"needed more than 0\.62 GiB.*FULLWELL_RENDER_MEMORY_BYTES") as caught:
        one.make("grows")
    assert caught.value.code == "out_of_memory"
    assert one.make()["frames"] == 1


@pytest.mark.parametrize("what", ["asks_for_too_much", "wraps_a_shortage"])
def test_one_huge_allocation_is_refused_before_it_takes_the_machine_with_it(
    isolated: Callable[..., Isolated], what: str
) -> None:
    one = isolated()
    with pytest.raises(RenderMemoryError, match=r"needed more than 4\.00 GiB.*was refused more"):
        one.make(what)
    assert one.make()["frames"] == 1


def test_a_frame_that_takes_too_long_is_ended(isolated: Callable[..., Isolated]) -> None:
    one = isolated(time_s=2.0)
    with pytest.raises(RenderTimeError, match=r"longer than 2 s.*FULLWELL_FRAME_TIME_LIMIT_S") as caught:
        one.make("sleeps")
    assert caught.value.code == "time_limit"
    assert one.make()["frames"] == 1


def test_a_cancelled_frame_stops_by_itself_and_its_process_stays(isolated: Callable[..., Isolated]) -> None:
    one = isolated()
    pid = one.make()["pid"]
    with pytest.raises(CancelledError, match="nothing was published"):
        one.make("waits", should_cancel=lambda: True)
    after = one.make()  # the order to stop was for the frame before
    assert (after["pid"], after["frames"]) == (pid, 3)


def test_a_cancelled_frame_that_does_not_stop_is_ended(isolated: Callable[..., Isolated]) -> None:
    one = isolated(cancel_patience_s=0.3)
    with pytest.raises(CancelledError, match=r"did not stop within 0\.3 s"):
        one.make("sleeps", should_cancel=lambda: bool(one.seen))
    assert one.make()["frames"] == 1


def test_a_process_is_replaced_after_its_last_frame(isolated: Callable[..., Isolated]) -> None:
    one = isolated(max_frames=2)
    pids = [one.make("a", index)["pid"] for index in range(3)]
    assert pids[0] == pids[1] != pids[2]
    assert not is_alive(pids[0])


def test_a_process_that_has_grown_is_replaced_after_its_frame(isolated: Callable[..., Isolated]) -> None:
    one = isolated(recycle_bytes=256 * MIB)
    pid = one.make("keeps_much")["pid"]
    assert (one.runner.pid, is_alive(pid)) == (None, False)
    assert one.make()["frames"] == 1


def test_errors_arrive_as_what_they_are(isolated: Callable[..., Isolated]) -> None:
    one = isolated()
    with pytest.raises(FieldError) as field:
        one.make("wrong_field")
    assert (type(field.value), field.value.path, field.value.value) == (FieldError, "cameras[0].lens.f_number", -1)
    assert isinstance(field.value, PERMANENT)
    with pytest.raises(RecipeError) as recipe:
        one.make("wrong_recipe")
    assert [problem.path for problem in recipe.value.errors] == ["a", "b"]
    with pytest.raises(StorageError, match="the store is away"):
        one.make("no_storage")
    assert one.make()["frames"] == 4  # a refused recipe costs no warm process


def test_errors_that_nobody_foresaw_arrive_with_their_trace_and_end_the_process(isolated: Callable[..., Isolated]) -> None:
    one = isolated()
    with pytest.raises(ZeroDivisionError, match="by a stage") as mistake:
        one.make("mistake")
    assert any("in mistake" in note for note in mistake.value.__notes__)
    assert one.runner.pid is None
    with pytest.raises(RuntimeError, match="_UnportableError: not portable"):
        one.make("unportable")


PARENT = """
import sys
from pathlib import Path
from types import SimpleNamespace
from fullwell_worker.isolation import IsolatedRunner
from fullwell_worker.render_process import RenderProcess
from fullwell_worker.limits import RenderLimits
runner = IsolatedRunner(Path(sys.argv[2]).as_uri(), RenderLimits(1 << 32, 1 << 31, 60.0, 50), runner="render_standins:Standin",
                        environment={"PYTHONPATH": sys.argv[1]})
call = lambda what: runner(SimpleNamespace(name="x"), 0, None, "f/" + what, base_dir=None, progress=None, should_cancel=None)
print(call("fine")["pid"], flush=True)
call("sleeps")
"""


def test_the_process_ends_with_its_parent_even_in_the_middle_of_a_frame(tmp_path: Path) -> None:
    command = [sys.executable, "-c", PARENT, str(FOLDER), str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        time.sleep(0.3)
        assert is_alive(child)
        parent.kill()
    wait_until(lambda: not is_alive(child), seconds=5.0)


def test_the_pipeline_makes_the_same_frame_in_a_render_process(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba")
    document = load_recipe(tiny_recipe())
    manifests = []
    for name in ("inside", "outside"):
        folder = tmp_path / name
        settings = Settings(home=tmp_path, store_url=folder.as_uri(), isolate=name == "inside")
        runner = runner_of(settings)
        assert isinstance(runner, IsolatedRunner if settings.isolate else PipelineRunner)
        manifest = runner(
            document, 0, LocalStore(folder), "f", base_dir=None, progress=lambda _: None, should_cancel=lambda: False
        )
        manifests.append({product["name"]: product["sha256"] for product in manifest["products"]})
        assert LocalStore(folder).exists("f/manifest.json")
        if isinstance(runner, IsolatedRunner):
            assert runner.pid is not None
            assert 100 * MIB < resident_bytes(runner.pid) < limits_of(settings).memory_bytes
            runner.close()
    assert manifests[0] == manifests[1]
    assert "image.png" in manifests[0]


def test_limits_follow_the_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = Settings(render_memory_bytes=1024 * MIB, frame_time_limit_s=7.0, render_max_frames=3)
    assert limits_of(settings) == RenderLimits(1024 * MIB, 512 * MIB, 7.0, 3)
    whole = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    assert 0 < limits_of(Settings()).memory_bytes < whole
    monkeypatch.setenv("FULLWELL_RENDER_MEMORY_BYTES", str(100 * MIB))
    with pytest.raises(FullwellError, match=r"FULLWELL_RENDER_MEMORY_BYTES.*512 MiB"):
        load_settings()
