"""One render process as its worker sees it: started, given frames, watched, ended."""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection, Pipe
from typing import IO, Final

from fullwell.core import CancelledError, RenderMemoryError, RenderProcessError, RenderTimeError
from fullwell_worker.limits import GIB, RenderLimits, resident_bytes
from fullwell_worker.messages import Answer, CancelOrder, FrameFailed, FrameFinished, FrameOrder, Order, OrderTaken, StageReport
from fullwell_worker.runners import Progress

__all__ = ["OrderNotTakenError", "RenderProcess", "memory_error"]

LOOK_S: Final = 0.1
"""Pause between two looks at size, time and cancellation. A process fills a few hundred MB in it."""
END_PATIENCE_S: Final = 5.0


class OrderNotTakenError(Exception):
    """The process ended before it had the order: the frame was not the reason, and can be given to another process."""


class RenderProcess:
    """One render process and the socket to it."""

    def __init__(self, limits: RenderLimits, runner: str, environment: Mapping[str, str]) -> None:
        self._limits = limits
        self._at: StageReport | None = None
        self.frames = 0
        self._connection: Connection[Order, Answer]
        self._connection, theirs = Pipe(duplex=True)
        descriptor = theirs.fileno()
        arguments = [str(descriptor), str(os.getpid()), str(limits.ceiling_bytes), runner]
        with theirs:
            # In a session of its own: Ctrl-C reaches the worker alone, and the group can be ended as a whole.
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "fullwell_worker.render_child", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env={**os.environ, **environment},
                pass_fds=(descriptor,),
                start_new_session=True,
            )
        self._words = _LastWords(self._process.stdout)

    @property
    def pid(self) -> int:
        return self._process.pid

    def make(
        self,
        order: FrameOrder,
        progress: Callable[[Progress], None] | None,
        should_cancel: Callable[[], bool] | None,
    ) -> FrameFinished | FrameFailed:
        """Return how the frame ended; raise what ended the process instead.

        Raises `OrderNotTakenError` where the process had made frames before and ended while it had none: that may show only
        now, since a process that is being ended answers to nothing for a while and is no zombie yet.
        """
        self.frames += 1
        self._at = StageReport("start", 0.0)
        self._words.clear()
        frame, taken = _FrameWatch(self._limits, self.frames - 1), False
        try:
            self._connection.send(order)
            while True:
                if self._connection.poll(LOOK_S):
                    answer = self._connection.recv()
                    taken = True
                    if isinstance(answer, OrderTaken):
                        continue
                    if not isinstance(answer, StageReport):
                        self._at = None
                        return answer
                    self._at = answer
                    if progress is not None:
                        progress(answer)
                frame.check(resident_bytes(self.pid))
                if should_cancel is not None and should_cancel() and frame.cancel():
                    self._connection.send(CancelOrder(order.serial))
        except (EOFError, OSError, pickle.UnpicklingError):
            cause = self.cause_of_death()
            if not taken and self.frames > 1:
                raise OrderNotTakenError(cause) from None
            raise RenderProcessError(cause) from None

    def has_ended(self) -> bool:
        """Return whether the process has ended. Leaves it a zombie: its number stays its own until `kill`."""
        if self._process.returncode is not None:
            return True
        return os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is not None

    def cause_of_death(self) -> str:
        """Return a sentence on how the process ended; end it, should it live without a socket."""
        deadline = time.monotonic() + END_PATIENCE_S
        while not self.has_ended() and time.monotonic() < deadline:
            time.sleep(0.01)
        self.kill()
        words = self._words.last()
        where = f" in stage {self._at.stage!r} ({self._at.fraction:.0%})" if self._at else ""
        return f"the render process {_ending(self._process.returncode)}{where}{f': {words}' if words else ''}"

    def end(self) -> None:
        """Let the idle process end by itself; kill it where it does not."""
        self._connection.close()
        deadline = time.monotonic() + END_PATIENCE_S
        while not self.has_ended() and time.monotonic() < deadline:
            time.sleep(0.005)
        self.kill()

    def kill(self) -> None:
        """End the process, and what it has started, at once."""
        if self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, signal.SIGKILL)
            self._process.wait()
        self._connection.close()
        self._words.close()


class _FrameWatch:
    """The limits of one frame."""

    def __init__(self, limits: RenderLimits, earlier_frames: int) -> None:
        self._limits = limits
        self._earlier_frames = earlier_frames
        self._time_is_up = time.monotonic() + limits.time_s
        self._patience_ends = math.inf

    def check(self, size: int) -> None:
        """Raise the error of a limit that is passed; `size` is the process's resident size [bytes]."""
        now = time.monotonic()
        if size > self._limits.memory_bytes:
            raise memory_error(self._limits, f"used {size / GIB:.2f} GiB", self._earlier_frames)
        if now > self._patience_ends:
            raise CancelledError(
                f"the frame was cancelled, did not stop within {self._limits.cancel_patience_s:g} s, and its process was ended"
            )
        if now > self._time_is_up:
            raise RenderTimeError(
                f"the frame took longer than {self._limits.time_s:g} s and its process was ended. Ask for fewer pixels or "
                "samples, or raise FULLWELL_FRAME_TIME_LIMIT_S."
            )

    def cancel(self) -> bool:
        """Start the patience with a cancelled frame; return whether it had not been cancelled before."""
        if self._patience_ends < math.inf:
            return False
        self._patience_ends = time.monotonic() + self._limits.cancel_patience_s
        return True


class _LastWords:
    """Passes what a process prints on to this one's log, and remembers the end of it."""

    def __init__(self, stream: IO[bytes] | None) -> None:
        self._stream = stream
        self._lines: deque[bytes] = deque(maxlen=100)
        self._thread = threading.Thread(target=self._pass_on, name="render-log", daemon=True)
        self._thread.start()

    def clear(self) -> None:
        self._lines.clear()

    def last(self) -> str:
        """Return the last line that is neither an event of the log nor part of the trace that a fatal signal leaves."""
        self._thread.join(timeout=1.0)
        said = ""
        for line in (line.decode(errors="replace").strip() for line in tuple(self._lines)):
            if line.startswith("Fatal Python error"):
                break
            said = line if line and not line.startswith("{") else said
        return said[:300]

    def close(self) -> None:
        self._thread.join(timeout=1.0)

    def _pass_on(self) -> None:
        if self._stream is None:
            return
        with contextlib.suppress(OSError, ValueError), self._stream:
            while line := self._stream.readline(1 << 16):
                self._lines.append(line)
                with contextlib.suppress(OSError):
                    os.write(2, line)


def memory_error(limits: RenderLimits, what: str, earlier_frames: int) -> RenderMemoryError:
    """Return the error of a frame that needs too much; `what` its process did, after how many other frames."""
    before = f" after {earlier_frames} other frames" if earlier_frames else ""
    return RenderMemoryError(
        f"the frame needed more than {limits.memory_bytes / GIB:.2f} GiB of memory; its process {what}{before} and was ended. "
        "Ask for fewer pixels, bands or models, or raise FULLWELL_RENDER_MEMORY_BYTES."
    )


def _ending(code: int) -> str:
    if code >= 0:
        return f"ended with exit code {code}"
    number = -code
    try:
        name = signal.Signals(number).name
    except ValueError:
        return f"died by signal {number}"
    hint = ", as the kernel does when memory runs out," if number == signal.SIGKILL else ""
    return f"died by {name} (signal {number}){hint}"
