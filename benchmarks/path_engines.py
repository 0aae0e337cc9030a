"""This project's own engines under test, all through `plan_light` and `render_light`, as a frame is rendered."""

from __future__ import annotations

import functools
import gc
import hashlib
import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import fullwell.render
from benchmarks.engines import Budget, Engine, Result, Stopwatch
from benchmarks.stages import LOADING, stage_times
from fullwell.pipeline.lighting import LightPlan, plan_light
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import RenderedLight, activate, render_light
from fullwell.schema.frame import FrameDescription

__all__ = [
    "ENGINES",
    "Denoised",
    "OwnPath",
    "ReferencePath",
    "channels_of_bands",
    "denoiser_found",
    "path_version",
    "rendered",
    "uncollected",
    "with_budget",
]

_MOST_SAMPLES = 1 << 20
"""Cap of adaptive runs under test: they stop at their target, not at a number of samples."""


@functools.cache
def path_version() -> str:
    """Return eight digits that change with the code of the path loop, so that nothing made by another one is taken for it."""
    folder = Path(fullwell.render.__file__).parent
    files = sorted([*(folder / "transport").glob("*.py"), folder / "rays.py"])
    return hashlib.sha256(b"".join(file.name.encode() + file.read_bytes() for file in files)).hexdigest()[:8]


def with_budget(frame: FrameDescription, budget: Budget) -> FrameDescription:
    """Return the frame with the quality that a budget asks for."""
    quality = replace(
        frame.quality,
        noise_ratio=budget.noise_ratio,
        samples_per_pixel=budget.samples_per_pixel if budget.noise_ratio is None else None,
        max_samples_per_pixel=_MOST_SAMPLES if budget.noise_ratio is not None else frame.quality.max_samples_per_pixel,
        max_depth=budget.max_depth or frame.quality.max_depth,
    )
    return replace(frame, quality=quality)


def channels_of_bands(
    photons: NDArray[np.floating], grid: WavelengthGrid, responses: tuple[Spectrum, ...]
) -> NDArray[np.float64]:
    """Return (responses, rows, cols) [e- s^-1 m^-2 sr^-1] of (rows, cols, bands) of photon radiance.

    The responses are averaged over each band: under lamps with lines this differs from counting channels directly.
    """
    weights = np.stack([response.band_average(grid) for response in responses]) * grid.step_nm
    return np.moveaxis(np.asarray(photons, dtype=np.float64) @ weights.T, -1, 0)


@dataclass(eq=False)
class OwnPath:
    """The path loop with equal samples or samples that follow the noise, with and without the planner's skips.

    `adaptive` engines take the budget's `noise_ratio`, the others its samples. Without `skip` the bands are kept too.
    """

    label: str
    skip: bool
    adaptive: bool

    @property
    def name(self) -> str:
        """Name and version."""
        return f"fullwell {self.label} path-{path_version()} {activate().variant()}"

    def render(self, frame: FrameDescription, budget: Budget) -> Result:
        """Return what a frame's first camera sees. Planning and set-up are in the time; loading triangles is set-up."""
        if self.adaptive != (budget.noise_ratio is not None):
            raise ValueError(f"{self.label} takes {'a noise ratio' if self.adaptive else 'samples'}, not {budget.label}")
        gc.collect()
        watch = Stopwatch()
        with stage_times() as times:
            planned, light = rendered(with_budget(frame, budget), skip=self.skip, seed=budget.seed)
        weights = dict(frame.group_weights)
        (_, sensors), *_ = planned.request.targets
        channels = sensors.channels(light.channels(weights))
        cpu_s, wall_s = watch.read()
        # A scene without what is out of view is loaded in every call; the other engines keep theirs.
        load_cpu_s, load_wall_s = (sum(spent.get(stage, 0.0) for stage in LOADING) for spent in (times.cpu_s, times.wall_s))
        if light.bands is None:
            kind, image = "channels", np.moveaxis(channels, 0, -1).astype(np.float32)
        else:
            kind, image = "bands", light.radiance(weights).photons
        statistics = light.statistics
        return Result(
            kind,
            image,
            cpu_s - load_cpu_s,
            wall_s - load_wall_s,
            statistics.samples_per_pixel,
            load_cpu_s,
            channels=channels,
            replicas=sensors.channels(np.tensordot(light.replicas.astype(np.float64), light.weights(weights), axes=(1, 0))),
            unmet_tiles=statistics.unmet_tiles,
        )


def rendered(frame: FrameDescription, *, skip: bool, seed: int) -> tuple[LightPlan, RenderedLight]:
    """Return the plan of the frame's first camera, and its light."""
    planned = plan_light(frame, frame.cameras[0], 0, skip=skip)
    with uncollected():
        return planned, render_light(planned.scene, frame.cameras[0].camera, replace(planned.request, seed=seed))


@contextmanager
def uncollected() -> Iterator[None]:
    """Leave garbage alone within the block: freeing device memory while a launch is recorded aborts the whole process."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


@dataclass(eq=False)
class ReferencePath:
    """Equal samples, everything kept: an image of all bands, with the channels counted directly behind them."""

    @property
    def name(self) -> str:
        """Name and version."""
        return f"fullwell reference path-{path_version()} {activate().variant()}"

    def render(self, frame: FrameDescription, budget: Budget) -> Result:
        """Return (rows, cols, bands + sensor channels)."""
        result = OwnPath("reference", skip=False, adaptive=False).render(frame, budget)
        assert result.channels is not None
        both = np.concatenate([result.image, np.moveaxis(result.channels, 0, -1).astype(np.float32)], axis=-1)
        return replace(result, kind="bands and channels", image=both, replicas=None)


# Denoised ------------------------------------------------------------------------------------------------------------


def denoiser_found() -> bool:
    """Return whether Open Image Denoise can be loaded (`pip install mitsuba-oidn`)."""
    try:
        importlib.import_module("mitsuba_oidn")
    except ImportError:
        return False
    return True


@dataclass(eq=False)
class Denoised:
    """Equal samples of the channels alone, then Open Image Denoise on three channels at a time. Biased: for comparison only."""

    label: str = "denoised (biased)"
    adaptive = False

    @property
    def name(self) -> str:
        """Name and version."""
        return f"fullwell {self.label} path-{path_version()} {activate().variant()}"

    def render(self, frame: FrameDescription, budget: Budget) -> Result:
        """Return the denoised channels."""
        import mitsuba_oidn  # noqa: PLC0415 - optional

        result = OwnPath("uniform-channels", skip=True, adaptive=False).render(frame, budget)
        watch = Stopwatch()
        clean = _denoised(result.image, lambda part: mitsuba_oidn.denoise(part, hdr=True))
        cpu_s, wall_s = watch.read()
        channels = np.moveaxis(clean.astype(np.float64), -1, 0)
        return replace(
            result,
            image=clean,
            channels=channels,
            replicas=None,
            cpu_s=result.cpu_s + cpu_s,
            wall_s=result.wall_s + wall_s,
        )


def _denoised(image: NDArray[np.float32], denoise: Callable[[NDArray[np.float32]], Any]) -> NDArray[np.float32]:
    """Return the channels denoised by threes; the last are repeated to make three."""
    clean = np.empty_like(image)
    count = image.shape[-1]
    for first in range(0, count, 3):
        places = [min(first + k, count - 1) for k in range(3)]
        part = np.ascontiguousarray(image[..., places])
        scale = float(part.mean()) or 1.0
        found = np.asarray(denoise(part / np.float32(scale))) * np.float32(scale)
        clean[..., places] = found
    return clean


ENGINES: dict[str, Callable[[], Engine]] = {
    "uniform": lambda: OwnPath("uniform", skip=False, adaptive=False),
    "uniform-channels": lambda: OwnPath("uniform-channels", skip=True, adaptive=False),
    "adaptive-no-skip": lambda: OwnPath("adaptive-no-skip", skip=False, adaptive=True),
    "adaptive": lambda: OwnPath("adaptive", skip=True, adaptive=True),
    "denoised": Denoised,
}
"""This project's engines by their short names."""
