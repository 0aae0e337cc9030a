"""Ingestion in a child process under limits: whatever a hostile file does ends that process, not this one."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any, Final, get_args

from fullwell.assets.ingest.options import IngestCause, IngestError, IngestLimits, IngestOptions
from fullwell.assets.ingest.prepare import IngestProgress
from fullwell.assets.records import AssetManifest, PreparedAsset
from fullwell.core.errors import FieldError
from fullwell.core.hashing import sha256_hex

__all__ = ["IngestProcess", "prepare_in_child"]

_LOOK_S: Final = 0.1
_END_PATIENCE_S: Final = 2.0
_FOLDER_PREFIX: Final = "fullwell-ingest-"
_STALE_AFTER_S: Final = 60.0
_MAX_LINE: Final = 1 << 16
_MIB: Final = 1 << 20
_KEPT_VARIABLES: Final = ("PATH", "HOME", "LANG", "TZ", "VIRTUAL_ENV")
_KEPT_PREFIXES: Final = ("PYTHON", "LC_", "LD_")


def prepare_in_child(
    files_dir: Path,
    main: str,
    options: IngestOptions,
    *,
    limits: IngestLimits | None = None,
    progress: IngestProgress | None = None,
    should_cancel: Callable[[], bool] | None = None,
) -> PreparedAsset:
    """Return what `prepare_file` returns, made in a process of its own that ends afterwards.

    For several assets, `IngestProcess` starts Python and its libraries once. Raises IngestError; see `IngestProcess.prepare`.
    """
    with IngestProcess(limits) as process:
        return process.prepare(files_dir, main, options, progress=progress, should_cancel=should_cancel)


class IngestProcess:
    """A child process that takes in one asset after the other, replaced when it dies, passes a limit or has done its share.

    Usable from several threads, which wait for each other. To be closed, or used as a context manager.
    """

    def __init__(self, limits: IngestLimits | None = None) -> None:
        self._limits = limits or IngestLimits()
        self._lock = threading.Lock()
        self._child: _Child | None = None
        self._serial = 0

    def __enter__(self) -> IngestProcess:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """The child, None when there is none at the moment."""
        return None if self._child is None else self._child.pid

    def start(self) -> None:
        """Start the child now, so that the first asset need not wait for it."""
        with self._lock:
            self._living_child()

    def close(self) -> None:
        """End the child, if there is one, and remove its folder."""
        with self._lock:
            self._drop()

    def prepare(
        self,
        files_dir: Path,
        main: str,
        options: IngestOptions,
        *,
        progress: IngestProgress | None = None,
        should_cancel: Callable[[], bool] | None = None,
    ) -> PreparedAsset:
        """Return a model file as an asset; see `prepare_file`.

        Raises
        ------
        IngestError
            With `cause`: "refused", the file is not acceptable; "memory", "time", "size", it passed a limit; "died", it ended
            the process; "cancelled", `should_cancel` returned true; "unforeseen", a fault of this program. The temporary folder
            is removed in each case.
        """
        with self._lock:
            try:
                return self._prepared(files_dir, main, options, progress, should_cancel)
            except _NotTakenError:
                # It had died while idle, which shows only now: of a new process every end is this asset's.
                return self._prepared(files_dir, main, options, progress, should_cancel)

    def _prepared(
        self,
        files_dir: Path,
        main: str,
        options: IngestOptions,
        progress: IngestProgress | None,
        should_cancel: Callable[[], bool] | None,
    ) -> PreparedAsset:
        child = self._living_child()
        self._serial += 1
        folder = child.folder / f"result-{self._serial}"
        folder.mkdir()
        order = {
            "serial": self._serial,
            "files_dir": str(files_dir.resolve()),
            "main": main,
            "options": options.document(),
            "folder": str(folder),
        }
        kept = False
        try:
            child.make(order, _Watch(self._limits, main, progress, should_cancel))
            prepared = _read_result(folder, self._limits, main)
            kept = child.assets < self._limits.max_assets
            return prepared
        except IngestError as error:
            # After a refusal all is in order; after anything else the process may have suffered.
            kept = error.cause == "refused" and child.assets < self._limits.max_assets
            raise
        finally:
            shutil.rmtree(folder, ignore_errors=True)
            if not kept:
                self._drop()

    def _living_child(self) -> _Child:
        if self._child is not None and self._child.has_ended():
            self._drop()
        if self._child is None:
            _sweep()
            self._child = _Child(self._limits)
        return self._child

    def _drop(self) -> None:
        child, self._child = self._child, None
        if child is not None:
            child.end()


class _NotTakenError(Exception):
    """The process ended before it had the order: the asset was not the reason."""


class _Watch:
    """What may end an asset before it is done."""

    def __init__(
        self, limits: IngestLimits, main: str, progress: IngestProgress | None, should_cancel: Callable[[], bool] | None
    ) -> None:
        self.limits = limits
        self.main = main
        self.stage = "start"
        self._progress = progress
        self._should_cancel = should_cancel
        self._time_is_up = time.monotonic() + limits.wall_s

    def report(self, share: float, stage: str) -> None:
        self.stage = stage
        if self._progress is not None:
            self._progress(share, stage)

    def check(self) -> None:
        """Raise the IngestError of a limit that is passed."""
        if self._should_cancel is not None and self._should_cancel():
            raise IngestError(f"taking in {self.main} was cancelled; nothing is kept.", "file", self.main, "cancelled")
        if time.monotonic() > self._time_is_up:
            raise self.error("time", f"took longer than {self.limits.wall_s:g} s")

    def error(self, cause: IngestCause, what: str) -> IngestError:
        """Return the error of an asset that ended its process; `what` it did."""
        step = {
            "memory": "Simplify the model, or raise the memory limit of ingestion.",
            "time": "Simplify the model, or raise the time limit of ingestion.",
            "size": "Simplify the model, or make its textures smaller.",
            "unforeseen": "This is a fault of Fullwell: please report it with the file.",
        }.get(cause, "The file is damaged or made to do harm: check where it comes from, or export it again.")
        return IngestError(f"{self.main} {what} (in stage {self.stage!r}). {step}", "file", self.main, cause)


class _Child:
    """One child process, its private folder, and the two pipes to it."""

    def __init__(self, limits: IngestLimits) -> None:
        self.assets = 0
        self.folder = Path(tempfile.mkdtemp(prefix=_FOLDER_PREFIX)).resolve()
        lock = (self.folder / "lock").open("wb")
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        scratch = self.folder / "scratch"
        scratch.mkdir()
        answers, theirs = os.pipe()
        try:
            with (self.folder / "said").open("ab") as said:
                process = subprocess.Popen(
                    [sys.executable, "-P", "-m", "fullwell.assets.ingest.child", str(theirs), json.dumps(limits.document())],
                    stdin=subprocess.PIPE,
                    stdout=said,
                    stderr=said,
                    cwd=scratch,
                    env=_environment(scratch),
                    pass_fds=(theirs,),
                    start_new_session=True,
                )
        except BaseException:
            os.close(answers)
            lock.close()
            shutil.rmtree(self.folder, ignore_errors=True)
            raise
        finally:
            os.close(theirs)
        self._process = process
        self._answers = answers
        self._buffer = b""
        # Also when nobody closes: the child ends with the pipe, but its folder would stay.
        self._finalizer = weakref.finalize(self, _finish, process, answers, lock, self.folder)

    @property
    def pid(self) -> int:
        return self._process.pid

    def has_ended(self) -> bool:
        return self._process.poll() is not None

    def make(self, order: dict[str, Any], watch: _Watch) -> None:
        """Have an order carried out; raise how it failed."""
        self.assets += 1
        taken = False
        with contextlib.suppress(OSError):
            os.truncate(self.folder / "said", 0)
        try:
            assert self._process.stdin is not None
            self._process.stdin.write(json.dumps(order).encode() + b"\n")
            self._process.stdin.flush()
            while True:
                answer = self._next_answer(watch)
                if "taken" in answer:
                    taken = True
                elif "progress" in answer:
                    watch.report(float(answer["progress"]), str(answer["stage"])[:40])
                elif "error" in answer:
                    raise _told_error(answer["error"], watch)
                elif "done" in answer:
                    return
        except (EOFError, OSError):
            if not taken and self.assets > 1:
                raise _NotTakenError from None
            raise self._cause_of_death(watch) from None
        except (ValueError, KeyError, TypeError) as error:
            raise watch.error("died", f"made its process answer nonsense ({type(error).__name__})") from error

    def _next_answer(self, watch: _Watch) -> dict[str, Any]:
        while b"\n" not in self._buffer:
            if len(self._buffer) > _MAX_LINE:
                raise ValueError("an answer is too long")
            watch.check()
            ready, _, _ = select.select([self._answers], [], [], _LOOK_S)
            if ready:
                piece = os.read(self._answers, _MAX_LINE)
                if not piece:
                    raise EOFError
                self._buffer += piece
        line, _, self._buffer = self._buffer.partition(b"\n")
        answer = json.loads(line)
        if not isinstance(answer, dict):
            raise TypeError("an answer is no object")
        return answer

    def _cause_of_death(self, watch: _Watch) -> IngestError:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_PATIENCE_S)
        code = self._process.poll()
        said = self._last_words()
        if code is None:
            return watch.error("died", "made its process close its answers")
        if code == -signal.SIGXCPU:
            return watch.error("time", f"took more than {watch.limits.cpu_s:g} s of processor time")
        if "bad_alloc" in said or "MemoryError" in said or "Cannot allocate memory" in said or "out of memory" in said.lower():
            return watch.error("memory", f"needed more than {watch.limits.memory_bytes // _MIB} MiB of memory")
        if code >= 0:
            return watch.error("died", f"made its reader end with exit code {code}")
        name = signal.Signals(-code).name if -code in signal.valid_signals() else f"signal {-code}"
        return watch.error("died", f"made its reader die by {name}")

    def _last_words(self) -> str:
        with contextlib.suppress(OSError), (self.folder / "said").open("rb") as stream:
            stream.seek(0, os.SEEK_END)
            stream.seek(max(stream.tell() - 20_000, 0))
            return stream.read().decode("utf-8", "replace")
        return ""

    def end(self) -> None:
        """End the process at once and remove its folder: an idle one has nothing to lose."""
        self._finalizer()


def _finish(process: subprocess.Popen[bytes], answers: int, lock: IO[bytes], folder: Path) -> None:
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    if process.stdin is not None:
        with contextlib.suppress(OSError):
            process.stdin.close()
    with contextlib.suppress(OSError):
        os.close(answers)
    shutil.rmtree(folder, ignore_errors=True)
    lock.close()


def _environment(scratch: Path) -> dict[str, str]:
    """What the child may know: not the keys and addresses of the service, which a file that takes it over would read."""
    kept = {name: value for name, value in os.environ.items() if name in _KEPT_VARIABLES or name.startswith(_KEPT_PREFIXES)}
    # One thread: the pools of a dozen libraries would cost start-up time and address space, and assets are small.
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "PXR_WORK_THREAD_LIMIT"), "1")
    return {**kept, **threads, "TMPDIR": str(scratch)}


def _sweep() -> None:
    """Remove what processes that were killed left behind: folders whose lock nobody holds."""
    for folder in Path(tempfile.gettempdir()).glob(f"{_FOLDER_PREFIX}*"):
        with contextlib.suppress(OSError):
            lock = folder / "lock"
            if folder.is_symlink() or time.time() - folder.stat().st_mtime < _STALE_AFTER_S:
                continue
            with lock.open("rb") as stream:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)


def _told_error(told: dict[str, Any], watch: _Watch) -> IngestError:
    cause, message = told["cause"], str(told["message"])
    if cause not in get_args(IngestCause):
        raise ValueError(f"unknown cause {cause!r}")
    if cause == "refused":
        return IngestError(message, str(told["path"]), told["value"], "refused")
    what = {
        "memory": f"needed more than {watch.limits.memory_bytes // _MIB} MiB of memory",
        "size": f"became a file of more than {watch.limits.output_bytes} bytes",
    }.get(cause, f"could not be taken in ({message[:300]})")
    return watch.error(cause, what)


def _read_result(folder: Path, limits: IngestLimits, main: str) -> PreparedAsset:
    """The child's answer, believed in nothing that can be checked."""
    try:
        manifest = AssetManifest.from_document(json.loads(_content(folder / "manifest.json", limits)))
        blobs = {digest: _content(folder / digest, limits) for digest in sorted(manifest.blobs())}
    except (OSError, ValueError, AttributeError, KeyError, TypeError, FieldError) as error:
        raise IngestError(f"{main} made its process answer nonsense ({error}).", "file", main, "died") from error
    for digest, content in blobs.items():
        if sha256_hex(content) != digest:
            raise IngestError(f"{main} made its process answer with damaged content.", "file", main, "died")
    return PreparedAsset(manifest, blobs)


def _content(file: Path, limits: IngestLimits) -> bytes:
    if file.parent != file.resolve().parent or file.stat().st_size > max(limits.output_bytes, limits.input_bytes):
        raise ValueError(f"{file.name[:80]} is not acceptable")
    return file.read_bytes()
