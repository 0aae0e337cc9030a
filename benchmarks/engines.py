"""What is compared: an engine turns a frame and a budget into a picture and the CPU time that it took."""

from __future__ import annotations

import resource
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fullwell.schema.frame import FrameDescription

__all__ = ["Budget", "Engine", "Paired", "Result", "Stopwatch", "paired"]


@dataclass(frozen=True, slots=True)
class Budget:
    """What an engine may do: camera rays per pixel, path length and seed.

    With a `noise_ratio`, an engine that can takes samples until its error is that share of the sensor's noise, at most
    `samples_per_pixel` of them; the others know only numbers of samples.
    """

    samples_per_pixel: int
    max_depth: int | None = None
    """None takes the recipe's."""
    seed: int = 1
    noise_ratio: float | None = None

    @property
    def label(self) -> str:
        """For tables and keys: "64 spp" or "noise ratio 0.5"."""
        return f"{self.samples_per_pixel} spp" if self.noise_ratio is None else f"noise ratio {self.noise_ratio:g}"


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """A picture and its price.

    Attributes
    ----------
    kind
        "bands": photon radiance as `RadianceImage` has it; "channels": of each sensor channel; "luminance": (rows, cols, 1),
        relative.
    image
        (rows, cols, bands or channels) float32.
    cpu_s, wall_s
        CPU-seconds of all threads, and seconds, of rendering with everything compiled and loaded.
    samples
        Camera rays per pixel that were traced, on average.
    setup_cpu_s
        CPU-seconds of loading the scene, and of the first kernels, where the engine knows them apart.
    channels
        (sensor channels, rows, cols) [e- s^-1 m^-2 sr^-1] where the engine counts them directly, beside or instead of bands.
    replicas
        (replicas, sensor channels, rows, cols): independent estimates of the same, where there are.
    unmet_tiles
        Tiles that stayed above the noise ratio that was asked for.
    """

    kind: str
    image: NDArray[np.float32]
    cpu_s: float
    wall_s: float
    samples: float
    setup_cpu_s: float = 0.0
    channels: NDArray[np.float64] | None = None
    replicas: NDArray[np.float64] | None = None
    unmet_tiles: int = 0


class Engine(Protocol):
    """A renderer under test. It may keep the scene of the last frame, so that a second call costs no loading."""

    @property
    def name(self) -> str:
        """Name and version, for tables and for the keys of references."""
        ...

    def render(self, frame: FrameDescription, budget: Budget) -> Result:
        """Return the picture of the frame's first camera."""
        ...


class Stopwatch:
    """CPU-seconds of this process (all threads) and of ended children, and seconds, since it was made."""

    def __init__(self) -> None:
        self._cpu, self._wall = _cpu_s(), time.perf_counter()

    def read(self) -> tuple[float, float]:
        """Return (CPU-seconds, seconds)."""
        return _cpu_s() - self._cpu, time.perf_counter() - self._wall


def _cpu_s() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


@dataclass(frozen=True, slots=True)
class Paired:
    """Two ways of doing a thing, run in turns: medians of their CPU-seconds, and median and extremes of the ratio A / B."""

    first_cpu_s: float
    second_cpu_s: float
    ratio: float
    ratio_range: tuple[float, float]


def paired(first: Callable[[], Result], second: Callable[[], Result], *, repeats: int = 5) -> Paired:
    """Run A B, B A, A B, ... after one unmeasured run of each, and return the median of the ratios of each pair.

    A machine that slows down hits both halves of a pair, and the turn of the order takes away what the first leaves behind.
    """
    first(), second()
    pairs = []
    for number in range(repeats):
        if number % 2:
            later = second().cpu_s
            pairs.append((first().cpu_s, later))
        else:
            pairs.append((first().cpu_s, second().cpu_s))
    ratios = [a / b for a, b in pairs]
    firsts, seconds = zip(*pairs, strict=True)
    return Paired(statistics.median(firsts), statistics.median(seconds), statistics.median(ratios), (min(ratios), max(ratios)))
