"""Samples where they are needed: tile by tile, until the error of the light is small against the noise the sensor adds."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

__all__ = ["NoiseTarget", "Sampler", "SamplingGoal", "SamplingOutcome", "TileErrors", "Views", "sample_until", "tile_errors"]

TILE = 8
"""Side of a tile in film samples: 64 pixels tell the error to a few per cent, and are small enough to follow shadows."""

_FIRST_SAMPLES = 4
"""Samples of each replica before anything is decided."""

_GROWTH = 4.0
"""At most this many times the samples so far in one round: the error they tell is itself uncertain."""

_SAFETY = 1.05
"""More samples than the error at hand asks for, so that one round is mostly enough."""


_AROUND = 5
"""Side of a tile's surroundings, in tiles."""

_PRIOR_SAMPLES = 64
"""Samples per pixel at which a tile's own variance counts as much as that of its surroundings."""


_SURE = 3.0
"""Standard errors below the mean at which light is surely there; of four replicas none can be lower than that."""


class NoiseTarget(Protocol):
    """What error of the light the sensors would not notice."""

    @property
    def key(self) -> Hashable:
        """What `channels` depends on: equal keys, equal channels of the same light."""
        ...

    def channels(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (..., channels, rows, cols): what the sensors' channels count of (..., responses, rows, cols) of light."""
        ...

    def __call__(self, channels: NDArray[np.float64], sure: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Return the noise variance of the sensors, expressed as light, for (channels, rows, cols) of light so far.

        `sure` is the light that is surely there, of the same shape, by which saturation is told: no single sample makes it.
        Without it that is `channels`.
        """
        ...

    def saturation(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (responses,) the light that saturates a pixel on the axis; inf where no sensor has the response."""
        ...


Views = Sequence[tuple[NDArray[np.float64], NoiseTarget]]
"""(groups,) weights of the light groups, and the sensors that look at the light so weighted."""


class Sampler(Protocol):
    """An image that takes more samples: a `ProgressiveImage`."""

    rows: int
    cols: int
    counts: NDArray[np.int64]

    def add(self, pixels: NDArray[np.int64], counts: NDArray[np.int64], report: Callable[[float], None]) -> None:
        """Take more samples in each replica of the pixels."""
        ...

    def replicas(self) -> NDArray[np.float32]:
        """Return the replicas' means, (replicas, groups, channels, rows, cols)."""
        ...

    def restart(self, clamp: NDArray[np.float64]) -> None:
        """Forget all samples; from now on clamp each to `clamp`, (channels,) of light."""
        ...


@dataclass(frozen=True, slots=True)
class SamplingGoal:
    """When to stop.

    Attributes
    ----------
    noise_ratio
        Standard error of the light over the sensor's noise that is to be reached in every tile; None for equal samples.
    samples_per_pixel
        Equal samples where there is no `noise_ratio`.
    max_samples_per_pixel
        Cap of an adaptive run.
    time_limit_s
        Wall time after which no further round begins; None for none. With it, results depend on the machine.
    clamp_saturation
        Clamp of single samples, in lights that saturate a pixel; None for none.
    """

    noise_ratio: float | None = 0.5
    samples_per_pixel: int = 64
    max_samples_per_pixel: int = 4096
    time_limit_s: float | None = None
    clamp_saturation: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class TileErrors:
    """Error over noise by tile: `ratio` (tile rows, tile cols), of the worst view and channel; `rms` over tiles."""

    ratio: NDArray[np.float64]
    rms: float


@dataclass(frozen=True, slots=True, eq=False)
class SamplingOutcome:
    """What a run came to.

    Attributes
    ----------
    samples
        (rows, cols) samples per pixel.
    ratio
        (tile rows, tile cols) predicted error over noise; zeros where no target was given.
    rms_ratio
        Root of the mean square of `ratio`.
    unmet_tiles, tiles
        Tiles above the target, and all.
    stopped_by
        "target", "samples" (the cap, or equal samples) or "time".
    rounds
        Passes over (parts of) the image.
    """

    samples: NDArray[np.int64]
    ratio: NDArray[np.float64]
    rms_ratio: float
    unmet_tiles: int
    tiles: int
    stopped_by: str
    rounds: int


def tile_errors(replicas: NDArray[np.floating], views: Views) -> TileErrors:
    """Return the error of the light over the sensors' noise, by tile, of the worst view and channel.

    Parameters
    ----------
    replicas
        (replicas, groups, responses, rows, cols): independent estimates of the light.
    """
    worst: NDArray[np.float64] | None = None
    seen: dict[Hashable, tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]] = {}
    for weights, target in views:
        key = (weights.tobytes(), target.key)
        if key not in seen:  # views that differ in exposure only look at the same means and errors
            seen[key] = _means_and_errors(target.channels(np.tensordot(replicas.astype(np.float64), weights, axes=(1, 0))))
        square = _tile_squares(*seen[key], target)
        worst = square if worst is None else np.maximum(worst, square)
    if worst is None:
        raise ValueError("there is no view to judge the error by")
    return TileErrors(np.sqrt(worst), float(np.sqrt(worst.mean())))


def _means_and_errors(
    light: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return (channels, rows, cols) means of (replicas, ...) of light, what is sure of it, and the means' variances over tiles.

    Sure is what lies three standard errors below the mean. One bright sample lifts the mean of its pixel, and as much the
    error: a pixel that it lifts over the full well is no saturated one.
    """
    count = len(light)
    mean = light.mean(axis=0)
    variance = ((light - mean) ** 2).sum(axis=0) / (count * (count - 1))
    return mean, np.maximum(mean - _SURE * np.sqrt(variance), 0.0), _tile_sums(variance)


def _tile_squares(
    mean: NDArray[np.float64], sure: NDArray[np.float64], error: NDArray[np.float64], target: NoiseTarget
) -> NDArray[np.float64]:
    """Return (tile rows, tile cols) variance of the error over that of the noise, of the worst channel."""
    # Averages over a tile of the error and of the noise, not of their ratio: one pixel that happens to be dark is no outlier.
    noise = _tile_sums(target(mean, sure))
    square = np.divide(error, noise, out=np.zeros_like(error), where=noise > 0)
    square[(noise <= 0) & (error > 0)] = np.inf
    return np.asarray(square.max(axis=0))


def sample_until(
    image: Sampler,
    goal: SamplingGoal,
    views: Views,
    *,
    report: Callable[[float], None],
    replicas: int,
) -> SamplingOutcome:
    """Take samples until the goal is reached in every view, and say how far it was; without views, equal samples."""
    started = time.perf_counter()
    everything = np.arange(image.rows * image.cols, dtype=np.int64)
    tiles_shape = (-(-image.rows // TILE), -(-image.cols // TILE))
    report(0.0)
    if goal.clamp_saturation is not None and views:
        _set_clamp(image, goal.clamp_saturation, views, everything)
    if goal.noise_ratio is None or not views:
        count = -(-goal.samples_per_pixel // replicas)
        image.add(everything, np.full(len(everything), count), report)
        errors = tile_errors(image.replicas(), views) if views else None
        return _outcome(image, errors, tiles_shape, replicas=replicas, unmet=0, stopped_by="samples", rounds=1)
    cap = max(1, goal.max_samples_per_pixel // replicas)
    image.add(everything, np.full(len(everything), min(_FIRST_SAMPLES, cap)), lambda f: report(0.1 * f))
    rounds, done = 1, 0.1
    while True:
        errors = tile_errors(image.replicas(), views)
        so_far = image.counts.reshape(image.rows, image.cols)[::TILE, ::TILE]
        more = _more_samples(_cautious(errors.ratio, so_far * replicas), so_far, goal.noise_ratio, cap)
        late = goal.time_limit_s is not None and time.perf_counter() - started > goal.time_limit_s
        if late or not more.any():
            unmet = int(np.count_nonzero(errors.ratio > goal.noise_ratio))
            stopped_by = "target" if unmet == 0 else ("time" if late else "samples")
            return _outcome(image, errors, tiles_shape, replicas=replicas, unmet=unmet, stopped_by=stopped_by, rounds=rounds)
        by_pixel = np.repeat(np.repeat(more, TILE, axis=0), TILE, axis=1)[: image.rows, : image.cols].ravel()
        base, share = done, (1.0 - done) * 0.6
        image.add(everything, by_pixel, lambda f, base=base, share=share: report(base + share * f))  # type: ignore[misc]
        done, rounds = base + share, rounds + 1


def _set_clamp(image: Sampler, saturation: float, views: Views, everything: NDArray[np.int64]) -> None:
    """Look at the light once, find from it what saturates a pixel, and begin anew with samples clamped to that."""
    image.add(everything, np.full(len(everything), 1), lambda _: None)
    mean = image.replicas().astype(np.float64).mean(axis=0)
    limits = [target.saturation(np.tensordot(weights, mean, axes=(0, 0))) for weights, target in views]
    image.restart(saturation * np.max(limits, axis=0))


def _cautious(ratio: NDArray[np.float64], samples: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the error over noise by which tiles are judged: their own, or with few samples that of their surroundings too.

    Where rare paths are bright, a tile that has met none yet looks exact. Variances for one sample, in units of the sensor's
    noise, are averaged with those of the tiles around, half and half at `_PRIOR_SAMPLES`; from four
    times that on a tile stands for itself, however bright its neighbour.
    """
    for_one = np.where(np.isfinite(ratio), ratio, 0.0) ** 2 * samples
    # Running sums may fall below zero by rounding.
    around = np.maximum(uniform_filter(for_one, size=_AROUND, mode="nearest"), 0.0)
    own = np.where(samples < 4 * _PRIOR_SAMPLES, samples**2 / (samples**2 + _PRIOR_SAMPLES**2), 1.0)
    together = (own * for_one + (1.0 - own) * around) / np.maximum(samples, 1)
    return np.asarray(np.maximum(ratio, np.sqrt(together)))


def _more_samples(ratio: NDArray[np.float64], so_far: NDArray[np.int64], wanted: float, cap: int) -> NDArray[np.int64]:
    """Return (tile rows, tile cols) further samples of each replica; the error falls as one over the root of their number."""
    needed = so_far * np.minimum(_SAFETY * (ratio / wanted) ** 2, _GROWTH)
    # Stratification is best when the number is a multiple of a power of two near it.
    step = 2 ** np.floor(np.log2(np.maximum(so_far, 2) / 2)).astype(np.int64)
    more = np.ceil(np.maximum(needed - so_far, 0) / step).astype(np.int64) * step
    more = np.where(ratio > wanted, np.maximum(more, step), 0)
    return np.minimum(more, np.maximum(cap - so_far, 0))


def _outcome(
    image: Sampler,
    errors: TileErrors | None,
    tiles_shape: tuple[int, int],
    *,
    replicas: int,
    unmet: int,
    stopped_by: str,
    rounds: int,
) -> SamplingOutcome:
    ratio = np.zeros(tiles_shape) if errors is None else errors.ratio
    return SamplingOutcome(
        samples=(image.counts * replicas).reshape(image.rows, image.cols),
        ratio=ratio,
        rms_ratio=0.0 if errors is None else errors.rms,
        unmet_tiles=unmet,
        tiles=ratio.size,
        stopped_by=stopped_by,
        rounds=rounds,
    )


def _tile_sums(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (..., tile rows, tile cols) sums over tiles; those at the right and bottom edges may be smaller."""
    rows, cols = values.shape[-2:]
    down = np.add.reduceat(values, np.arange(0, rows, TILE), axis=-2)
    return np.add.reduceat(down, np.arange(0, cols, TILE), axis=-1)
