"""What a render process runs instead of the pipeline; the frame's prefix says what happens."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fullwell.core import CancelledError, FieldError, RenderError, StorageError
from fullwell.storage import ObjectStore

__all__ = ["Standin"]

MIB = 1 << 20


@dataclass(frozen=True)
class _At:
    stage: str
    fraction: float


class _UnportableError(Exception):
    """An error that cannot be made again from its arguments."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(f"{first} {second}")


class Standin:
    """Publishes a line for each frame, or does what the prefix's last word says."""

    def __init__(self) -> None:
        self.frames = 0
        self.kept: list[Any] = []

    def __call__(
        self,
        document: Any,
        index: int,
        store: ObjectStore,
        prefix: str,
        *,
        base_dir: Path | None,
        progress: Callable[[Any], None],
        should_cancel: Callable[[], bool],
    ) -> Any:
        self.frames += 1
        progress(_At("render", 0.25))
        getattr(self, prefix.rpartition("/")[2], lambda _: None)(should_cancel)
        store.put(f"{prefix}/manifest.json", b"{}")
        progress(_At("done", 1.0))
        return {"name": document.name, "index": index, "pid": os.getpid(), "frames": self.frames, "base_dir": str(base_dir)}

    def segfault(self, _: Callable[[], bool]) -> None:
        print("LLVM ERROR: something is wrong", file=sys.stderr, flush=True)
        ctypes.string_at(0)

    def killed(self, _: Callable[[], bool]) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    def exits(self, _: Callable[[], bool]) -> None:
        os._exit(3)

    def grows(self, _: Callable[[], bool]) -> None:
        while True:
            self.kept.append(bytearray(b"x") * (8 * MIB))
            time.sleep(0.005)

    def asks_for_too_much(self, _: Callable[[], bool]) -> None:
        self.kept.append(bytearray(b"x") * (1 << 45))

    def wraps_a_shortage(self, _: Callable[[], bool]) -> None:
        try:
            self.asks_for_too_much(_)
        except MemoryError as error:
            raise RenderError("the renderer failed") from error

    def keeps_much(self, _: Callable[[], bool]) -> None:
        self.kept.append(bytearray(b"x") * (256 * MIB))

    def sleeps(self, _: Callable[[], bool]) -> None:
        time.sleep(600)

    def waits(self, should_cancel: Callable[[], bool]) -> None:
        while not should_cancel():
            time.sleep(0.01)
        raise CancelledError("the frame was cancelled; nothing was published")

    def wrong_field(self, _: Callable[[], bool]) -> None:
        raise FieldError("f_number is -1; must be > 0.", path="cameras[0].lens.f_number", value=-1)

    def wrong_recipe(self, _: Callable[[], bool]) -> None:
        from fullwell.schema import Problem, RecipeError

        raise RecipeError.of((Problem("a", "a is wrong.", 1), Problem("b", "b is wrong.", 2)))

    def no_storage(self, _: Callable[[], bool]) -> None:
        raise StorageError("the store is away")

    def mistake(self, _: Callable[[], bool]) -> None:
        raise ZeroDivisionError("by a stage")

    def unportable(self, _: Callable[[], bool]) -> None:
        raise _UnportableError("not", "portable")
