"""Frames rendered in a process of their own, under limits: whatever ends that process fails one frame, not the worker."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import structlog

from fullwell.core import FullwellError, RenderError
from fullwell_worker.limits import RenderLimits, resident_bytes
from fullwell_worker.messages import FrameFailed, FrameFinished, FrameOrder
from fullwell_worker.render_process import OrderNotTakenError, RenderProcess, memory_error
from fullwell_worker.runners import Progress

if TYPE_CHECKING:
    from fullwell.schema import RecipeDocument
    from fullwell.storage import ObjectStore

__all__ = ["IsolatedRunner"]

RUNNER: Final = "fullwell_worker.runners:PipelineRunner"

log = structlog.get_logger("fullwell.worker")


class IsolatedRunner:
    """A frame runner that hands each frame to a render process, made at the first frame and kept for the next ones.

    To be called from the process's main thread: the kernel ends the render process with the thread that started it.

    Parameters
    ----------
    store_url
        Address of the store in which the frames are published; the render process opens it itself.
    runner
        module:class of what renders there; tests put a stand-in.
    environment
        Variables that the render process gets beside this one's.
    """

    def __init__(
        self,
        store_url: str,
        limits: RenderLimits,
        *,
        runner: str = RUNNER,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._store_url = store_url
        self._limits = limits
        self._runner = runner
        self._environment = dict(environment or {})
        self._child: RenderProcess | None = None
        self._document: RecipeDocument | None = None
        self._serial = 0

    @property
    def pid(self) -> int | None:
        """The render process, None when there is none at the moment."""
        return None if self._child is None else self._child.pid

    def __call__(
        self,
        document: RecipeDocument,
        index: int,
        store: ObjectStore,
        prefix: str,
        *,
        base_dir: Path | None,
        progress: Callable[[Progress], None] | None,
        should_cancel: Callable[[], bool] | None,
    ) -> Any:
        """Return the manifest of the published frame.

        Raises
        ------
        RenderProcessError
            The process died, by a signal for example.
        RenderMemoryError, RenderTimeError
            It was ended because the frame passed a limit.
        CancelledError
            `should_cancel` returned true, and the frame stopped or was ended.
        Exception
            What the runner raised in the render process, as the same class.
        """
        order = FrameOrder(
            serial=0,
            document=document,
            index=index,
            store_url=self._store_url,
            prefix=prefix,
            base_dir=base_dir,
            log_fields=structlog.contextvars.get_contextvars(),
        )
        try:
            answer, child = self._made(order, progress, should_cancel)
        except OrderNotTakenError as idle:
            log.warning("render process died while idle", cause=str(idle))
            answer, child = self._made(order, progress, should_cancel)  # of a new process every end is the frame's
        self._document = document
        return self._taken(answer, child)

    def _made(
        self,
        order: FrameOrder,
        progress: Callable[[Progress], None] | None,
        should_cancel: Callable[[], bool] | None,
    ) -> tuple[FrameFinished | FrameFailed, RenderProcess]:
        child = self._living_child()
        self._serial += 1
        kept = self._document is not None and self._document is order.document
        order = replace(order, serial=self._serial, document=None if kept else order.document)
        try:
            answer = child.make(order, progress, should_cancel)
        except BaseException:
            self._forget_child()  # it is dead, or must not go on with a frame that nobody waits for
            child.kill()
            raise
        return answer, child

    def close(self) -> None:
        """End the render process, if there is one."""
        child = self._child
        self._forget_child()
        if child is not None:
            child.end()

    def _taken(self, answer: FrameFinished | FrameFailed, child: RenderProcess) -> Any:
        size = resident_bytes(child.pid)
        error = answer.error if isinstance(answer, FrameFailed) else None
        if child.frames >= self._limits.max_frames or size > self._limits.recycle_bytes or _leaves_doubts(error):
            log.info("render process recycled", frames=child.frames, mib=size >> 20)
            self.close()
        if isinstance(answer, FrameFinished):
            return answer.manifest
        if isinstance(answer.error, MemoryError):
            what = f"was refused more ({str(answer.error)[:100] or 'no more was there'})"
            raise memory_error(self._limits, what, child.frames - 1) from None
        if not isinstance(answer.error, FullwellError):
            answer.error.add_note(answer.trace)
        raise answer.error

    def _living_child(self) -> RenderProcess:
        if self._child is not None and self._child.has_ended():
            log.warning("render process died while idle", cause=self._child.cause_of_death())
            self.close()
        if self._child is None:
            self._child = RenderProcess(self._limits, self._runner, self._environment)
        return self._child

    def _forget_child(self) -> None:
        self._child, self._document = None, None


def _leaves_doubts(error: Exception | None) -> bool:
    """Return whether the renderer's state may have suffered: its own errors, lack of memory, and what nobody foresaw."""
    return error is not None and (not isinstance(error, FullwellError) or isinstance(error, RenderError))
