"""Errors as adaptive sampling defines them: by tile, of the worst channel, in units of the sensor's own noise.

`benchmarks.measures.sensor_error` looks at single pixels of electrons; this looks at what the sampler promises to bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.engines import Budget, Result
from benchmarks.path_engines import channels_of_bands, with_budget
from benchmarks.references import Reference
from fullwell.pipeline.lighting import LightPlan, plan_light
from fullwell.schema.frame import FrameDescription

__all__ = ["NoiseError", "NoiseJudge", "Truth", "tile_sums", "truth_of"]

TILE_PX = 8
"""Side of the sampler's tiles."""


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """A reference: the two halves of its passes, whose mean it is, as sensor channels, (channels, rows, cols) of light.

    `bands` is (rows, cols, bands) of photon radiance.
    """

    halves: tuple[NDArray[np.float64], NDArray[np.float64]]
    bands: NDArray[np.float64]

    @property
    def channels(self) -> NDArray[np.float64]:
        """(channels, rows, cols), the mean."""
        return np.asarray((self.halves[0] + self.halves[1]) / 2)

    @property
    def variance(self) -> NDArray[np.float64]:
        """(channels, rows, cols) squared error of the mean: uncertain by pixel, good by tile."""
        return np.asarray((self.halves[0] - self.halves[1]) ** 2 / 4)


@dataclass(frozen=True, slots=True, eq=False)
class NoiseError:
    """Measured errors over noise.

    Attributes
    ----------
    square
        (channels, tile rows, tile cols) mean squared error over mean noise variance, the reference's own error subtracted;
        may be negative where nothing but that is left.
    raw_rms
        Of the whole picture with the reference's own error in it.
    reference_rms
        The reference's own error alone.
    bias
        Mean error over mean noise, signed, of the channel with the largest.
    """

    square: NDArray[np.float64]
    raw_rms: float
    reference_rms: float
    bias: float

    @property
    def tiles(self) -> NDArray[np.float64]:
        """(tile rows, tile cols) error over noise of the worst channel."""
        return np.asarray(np.sqrt(np.maximum(self.square.max(axis=0), 0.0)))

    def summary(self) -> dict[str, float]:
        """Return rms, 95th percentile and maximum over tiles, and what is needed to judge them."""
        tiles = self.tiles
        return {
            "rms": float(np.sqrt(max(0.0, float(self.square.max(axis=0).mean())))),
            "p95": float(np.percentile(tiles, 95)),
            "worst": float(tiles.max()),
            "raw_rms": self.raw_rms,
            "reference_rms": self.reference_rms,
            "bias": self.bias,
        }


def truth_of(frame: FrameDescription, reference: Reference, *, direct: bool) -> Truth:
    """Return a reference as channels: counted directly where it holds them and `direct` is true, else from its bands.

    Raises ValueError where it has an odd number of passes: its halves would weigh differently.
    """
    if reference.passes < 2 or reference.passes % 2:
        raise ValueError(f"the reference of {frame.recipe_name} has {reference.passes} passes; must be even and at least 2")
    plan, count = _plan(frame), frame.grid.count
    halves = reference.halves.astype(np.float64)
    if direct and halves.shape[-1] > count:
        first, second = (np.moveaxis(half[..., count:], -1, 0) for half in halves)
    else:
        first, second = (_channels(plan, frame, half[..., :count]) for half in halves)
    return Truth((first, second), halves[..., :count].mean(axis=0))


def _plan(frame: FrameDescription) -> LightPlan:
    """Return a plan whose whole responses and noise serve as the judge's.

    Raises ValueError where no sensor looks, or several views would have to be judged.
    """
    plan = plan_light(with_budget(frame, Budget(4, noise_ratio=1.0)), frame.cameras[0], 0, skip=False)
    if len(plan.request.targets) != 1:
        raise ValueError(f"{frame.recipe_name} has {len(plan.request.targets)} views with sensors; exactly one can be judged")
    return plan


def _channels(plan: LightPlan, frame: FrameDescription, photons: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the sensor channels, (channels, rows, cols), of (rows, cols, bands) of photon radiance."""
    (_, sensors), *_ = plan.request.targets
    return sensors.channels(channels_of_bands(photons, frame.grid, plan.request.responses))


class NoiseJudge:
    """Judges pictures of a frame by the noise of its sensors, at the exposure that they choose for the reference."""

    def __init__(self, frame: FrameDescription, truth: Truth) -> None:
        """Prepare for pictures of `frame`, whose first camera `truth` shows."""
        self._plan, self._frame, self.truth = _plan(frame), frame, truth
        (_, sensors), *_ = self._plan.request.targets
        self._light = truth.channels
        self._noise = tile_sums(sensors(self._light))
        self._own = tile_sums(truth.variance)

    def channels(self, result: Result) -> NDArray[np.float64]:
        """Return the sensor channels, (channels, rows, cols) of light, of an engine's result."""
        if result.channels is not None:
            return result.channels
        if result.kind != "bands":
            raise ValueError(f"there are no sensor channels in {result.kind}")
        return _channels(self._plan, self._frame, result.image)

    def judge(self, channels: NDArray[np.float64]) -> NoiseError:
        """Return the error of (channels, rows, cols) of light."""
        difference = channels - self._light
        raw = tile_sums(difference**2)
        mean = difference.sum(axis=(1, 2)) / np.sqrt(self._noise.sum(axis=(1, 2)) * difference[0].size)
        return NoiseError(
            square=(raw - self._own) / self._noise,
            raw_rms=_rms(raw / self._noise),
            reference_rms=_rms(self._own / self._noise),
            bias=float(mean[np.abs(mean).argmax()]),
        )

    def predicted_square(self, replicas: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the squared error over the reference's noise, (channels, tile rows, tile cols), that replicas predict.

        (replicas, channels, rows, cols) of light; the error is that of their mean.
        """
        count = len(replicas)
        variance = ((replicas - replicas.mean(axis=0)) ** 2).sum(axis=0) / (count * (count - 1))
        return np.asarray(tile_sums(variance) / self._noise)


def _rms(square: NDArray[np.float64]) -> float:
    """Return the root mean square over tiles of the worst channel."""
    return float(np.sqrt(square.max(axis=0).mean()))


def tile_sums(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (..., tile rows, tile cols) sums; tiles at the right and lower edges may be smaller."""
    rows, cols = values.shape[-2:]
    down = np.add.reduceat(values, np.arange(0, rows, TILE_PX), axis=-2)
    return np.asarray(np.add.reduceat(down, np.arange(0, cols, TILE_PX), axis=-1))
