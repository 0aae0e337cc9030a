"""The render process: takes orders from its worker, renders one frame after the other, and ends when the worker does.

``python -m fullwell_worker.render_child SOCKET PARENT CEILING RUNNER``, started by `fullwell_worker.isolation` only. Kernels,
models and radiance images stay warm in it from frame to frame.
"""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import logging
import os
import pickle
import resource
import sys
import threading
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Final

import structlog

from fullwell.jobs.children import die_with_parent
from fullwell.jobs.logs import configure_logs
from fullwell.storage import store_from_url
from fullwell_worker.messages import Answer, CancelOrder, FrameFailed, FrameFinished, FrameOrder, OrderTaken, StageReport

if TYPE_CHECKING:
    from fullwell.schema import RecipeDocument
    from fullwell.storage import ObjectStore
    from fullwell_worker.runners import FrameRunner

__all__ = ["main"]

OOM_SCORE_ADJUSTMENT: Final = 500
"""When memory runs out all the same, the kernel shall choose this process, whose end fails one frame, not the worker."""


def main(arguments: list[str]) -> None:
    """Serve the worker at the other end of the socket; does not return."""
    descriptor, parent, ceiling = (int(argument) for argument in arguments[:3])
    die_with_parent(parent)
    faulthandler.enable()  # where it was when a signal killed it, in the worker's log
    _limit(ceiling)
    os.set_inheritable(descriptor, False)  # programs started from here must not keep the socket open
    configure_logs(level=logging.INFO)
    desk = _Desk(Connection(descriptor))
    threading.Thread(target=desk.listen, name="orders", daemon=True).start()
    module, _, name = arguments[3].partition(":")
    kitchen = _Kitchen(getattr(importlib.import_module(module), name)(), desk)
    while True:
        kitchen.serve(desk.next_order())


class _Desk:
    """Speaks with the worker: one thread listens, the main thread answers."""

    def __init__(self, connection: Connection[Answer, Any]) -> None:
        self._connection = connection
        self._orders: SimpleQueue[FrameOrder] = SimpleQueue()
        self._cancelled = -1

    def listen(self) -> None:
        """Take orders until the worker closes the socket; then end the process.

        At once and without clean-up: a frame that runs on for nobody would only hold the processors, and unloading the
        renderer's libraries in their own order is not worth its risks.
        """
        code = 1
        try:
            while True:
                order = self._connection.recv()
                if isinstance(order, CancelOrder):
                    self._cancelled = order.serial
                else:
                    self._orders.put(order)
        except (EOFError, OSError):
            code = 0  # the worker has ended, or wants this process to
        except BaseException:  # an order that cannot be read
            traceback.print_exc()
        finally:
            os._exit(code)

    def next_order(self) -> FrameOrder:
        return self._orders.get()

    def is_cancelled(self, serial: int) -> bool:
        return self._cancelled == serial

    def answer(self, answer: Answer) -> None:
        self._connection.send(answer)


class _Kitchen:
    """Makes frames; keeps document and store of the last one."""

    def __init__(self, runner: FrameRunner, desk: _Desk) -> None:
        self._runner = runner
        self._desk = desk
        self._document: RecipeDocument | None = None
        self._store_url = ""
        self._store: ObjectStore | None = None

    def serve(self, order: FrameOrder) -> None:
        with structlog.contextvars.bound_contextvars(**order.log_fields):
            self._desk.answer(OrderTaken(order.serial))
            self._desk.answer(self._made(order))

    def _made(self, order: FrameOrder) -> Answer:
        try:
            if order.document is not None:
                self._document = order.document
            if self._document is None:
                raise RuntimeError("the first order names no document")
            manifest = self._runner(
                self._document,
                order.index,
                self._opened(order.store_url),
                order.prefix,
                base_dir=order.base_dir,
                progress=lambda at: self._desk.answer(StageReport(at.stage, at.fraction)),
                should_cancel=lambda: self._desk.is_cancelled(order.serial),
            )
        except Exception as error:
            return FrameFailed(_shortage(error) or _portable(error), traceback.format_exc())
        return FrameFinished(manifest)

    def _opened(self, url: str) -> ObjectStore:
        if self._store is None or self._store_url != url:
            self._store, self._store_url = store_from_url(url), url
        return self._store


def _shortage(error: BaseException | None) -> MemoryError | None:
    """Return the lack of memory behind an error, or None: a stage may have wrapped it in an error of its own."""
    while error is not None and not isinstance(error, MemoryError):
        error = error.__cause__ or error.__context__
    return None if error is None else MemoryError(str(error))


def _portable(error: Exception) -> Exception:
    """Return the error where it survives pickling, else one that says the same."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


def _limit(ceiling: int) -> None:
    """Refuse allocations that go far beyond the limit at once: the worker's look at the resident size comes too late for them.

    RLIMIT_DATA counts what is allocated and writable. RLIMIT_AS would count what is merely reserved or mapped as well.
    """
    for kind, limit in ((resource.RLIMIT_DATA, ceiling), (resource.RLIMIT_CORE, 0)):
        with contextlib.suppress(OSError, ValueError):
            _, hard = resource.getrlimit(kind)
            allowed = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
            resource.setrlimit(kind, (allowed, hard))
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(str(OOM_SCORE_ADJUSTMENT))


if __name__ == "__main__":
    main(sys.argv[1:])
