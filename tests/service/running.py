"""A real service for tests: an API process and worker processes on a broker and an object store."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

from fullwell.client import FullwellClient
from fullwell.core import FullwellError
from servers import free_port

__all__ = ["RunningService", "children_of", "running_service", "wait_for"]

START_SECONDS = 60.0


def wait_for(condition: Callable[[], bool], *, seconds: float = 60.0, what: str = "it") -> None:
    """Return when the condition holds; fail the test when it does not in time."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"{what} did not happen within {seconds:g} s")
        time.sleep(0.05)


def children_of(pid: int) -> list[int]:
    """Return the process ids of a process's children."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            if int(stat.read_text().rpartition(")")[2].split()[1]) == pid:
                found.append(int(stat.parent.name))
    return found


class RunningService:
    """API and workers of one test, with short leases."""

    def __init__(self, folder: Path, *, broker_url: str, store_url: str) -> None:
        self.folder = folder
        port = free_port()
        self.environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith("FULLWELL_")},
            "FULLWELL_HOME": str(folder / "home"),
            "FULLWELL_BROKER_URL": broker_url,
            "FULLWELL_STORE_URL": store_url,
            "FULLWELL_PORT": str(port),
            "FULLWELL_QUEUE": f"test-{uuid.uuid4().hex[:12]}",
            "FULLWELL_LEASE_S": "3",
            "FULLWELL_REAP_INTERVAL_S": "0.3",
            "FULLWELL_RETRY_DELAY_S": "0.1",
            "FULLWELL_SOFT_SHUTDOWN_S": "2",
        }
        self.client = FullwellClient(f"http://127.0.0.1:{port}", patience_s=30.0)
        self.processes: list[subprocess.Popen[bytes]] = []

    def start(self, module: str, log: str) -> subprocess.Popen[bytes]:
        """Start one of the two kinds of process."""
        with (self.folder / f"{log}.log").open("ab") as sink:
            process = subprocess.Popen(
                [sys.executable, "-m", module], stdin=subprocess.DEVNULL, stdout=sink, stderr=sink, env=self.environment
            )
        self.processes.append(process)
        return process

    def start_api(self) -> subprocess.Popen[bytes]:
        """Start the API and wait until it is ready."""
        process = self.start("fullwell_api", "api")

        def ready() -> bool:
            assert process.poll() is None, (self.folder / "api.log").read_text()
            with contextlib.suppress(FullwellError):
                return self.client.workers() >= 0
            return False

        wait_for(ready, seconds=START_SECONDS, what="the start of the API")
        return process

    def start_worker(self) -> subprocess.Popen[bytes]:
        """Start a worker; it takes frames when it is up."""
        return self.start("fullwell_worker", "worker")

    def stop(self) -> None:
        """End every process."""
        self.client.close()
        for process in reversed(self.processes):
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
        for process in reversed(self.processes):
            try:
                process.wait(15)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait(15)


@contextlib.contextmanager
def running_service(folder: Path, *, broker_url: str, store_url: str) -> Iterator[RunningService]:
    """Run an API without workers until the block ends."""
    service = RunningService(folder, broker_url=broker_url, store_url=store_url)
    try:
        service.start_api()
        yield service
    finally:
        service.stop()
