"""Where a frame's time goes, and what was compiled: looked at from outside, for benchmarks only."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

__all__ = ["LOADING", "Kernels", "StageTimes", "kernel_misses", "launch_recordings", "stage_times"]


LOADING = ("collect surfaces", "acceleration")
"""Stages that a scene costs once, as long as it is kept."""


@dataclass(slots=True)
class StageTimes:
    """CPU-seconds and seconds by stage; a stage within another counts for itself only."""

    cpu_s: dict[str, float] = field(default_factory=dict)
    wall_s: dict[str, float] = field(default_factory=dict)
    calls: dict[str, int] = field(default_factory=dict)
    first_cpu_s: dict[str, float] = field(default_factory=dict)
    _running: list[tuple[float, float]] = field(default_factory=list)

    def timed(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return `function` with its time added to the stage `name`."""

        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            self._running.append((0.0, 0.0))
            cpu, wall = time.process_time(), time.perf_counter()
            try:
                return function(*arguments, **named)
            finally:
                cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
                inner_cpu, inner_wall = self._running.pop()
                if self._running:
                    outer_cpu, outer_wall = self._running[-1]
                    self._running[-1] = outer_cpu + cpu, outer_wall + wall
                self.cpu_s[name] = self.cpu_s.get(name, 0.0) + cpu - inner_cpu
                self.wall_s[name] = self.wall_s.get(name, 0.0) + wall - inner_wall
                self.calls[name] = self.calls.get(name, 0) + 1
                self.first_cpu_s.setdefault(name, cpu - inner_cpu)

        return call


@contextmanager
def stage_times() -> Iterator[StageTimes]:
    """Time the stages of rendering within the block: planning, surfaces, acceleration, materials, lights, launches."""
    from fullwell.pipeline import frame as frames  # noqa: PLC0415 - loaded with the renderer
    from fullwell.render import adaptive, light  # noqa: PLC0415
    from fullwell.render.transport import loading, progressive  # noqa: PLC0415

    places: list[tuple[Any, str, str]] = [
        (frames, "plan_frame", "plan"),
        (loading, "collect_surfaces", "collect surfaces"),
        (loading, "Geometry", "acceleration"),
        (progressive, "collect_surfaces", "collect surfaces"),
        (progressive, "Geometry", "acceleration"),
        (progressive, "MaterialTable", "materials"),
        (progressive, "LightSet", "lights"),
        (light, "ProgressiveImage", "other set-up"),
        (progressive.ProgressiveImage, "_launch", "launches"),
        (adaptive, "tile_errors", "error estimates"),
    ]
    times = StageTimes()
    before = [getattr(owner, name) for owner, name, _ in places]
    try:
        for (owner, name, stage), function in zip(places, before, strict=True):
            setattr(owner, name, times.timed(stage, function))
        yield times
    finally:
        for (owner, name, _), function in zip(places, before, strict=True):
            setattr(owner, name, function)


@dataclass(slots=True)
class Kernels:
    """Kernels launched within a block, those of them that were compiled, and those that came from the cache on disk."""

    launched: int = 0
    compiled: int = 0
    from_disk: int = 0


@contextmanager
def kernel_misses() -> Iterator[Kernels]:
    """Count the kernels of the block; the numbers are there when it ends."""
    from fullwell.render import activate  # noqa: PLC0415

    activate()
    import drjit as dr  # noqa: PLC0415 - loaded with the renderer

    counted = Kernels()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        try:
            yield counted
        finally:
            history = dr.kernel_history([dr.KernelType.JIT])
            counted.launched = len(history)
            counted.compiled = sum(not entry["cache_hit"] for entry in history)
            counted.from_disk = sum(bool(entry["cache_hit"] and entry.get("cache_disk")) for entry in history)


def launch_recordings() -> int:
    """Return how many recordings of launches this process has made; each costs some tenths of a second of tracing Python."""
    from fullwell.render.transport import replay  # noqa: PLC0415 - loaded with the renderer

    return sum(frozen.n_recordings for frozen, *_ in replay._recordings.values())
