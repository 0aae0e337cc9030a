"""What rules of adaptive sampling come to, from recorded samples: errors and numbers of rays, no times.

Run: python -m benchmarks.replay [--scene street_night] [--size 80x60] [--batches 1024] [--seeds 4] [--noise-ratios 8 4]

Each pixel's samples are recorded once, in batches of 4 of each replica (kept in FULLWELL_BENCH_CACHE). A run under a rule then
draws batches with replacement, so the mean of all is the exact truth and a run of any length costs no rendering. What is lost:
stratification beyond 4 samples, which makes both sides noisier where pixels are smooth, and what no recorded sample has met.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from benchmarks.engines import Budget
from benchmarks.noise_error import tile_sums
from benchmarks.path_engines import path_version, uncollected, with_budget
from benchmarks.references import reference_folder
from benchmarks.results import markdown_table, number
from benchmarks.scenes import SCENES, build_frame
from fullwell.core.files import write_atomically
from fullwell.core.hashing import digest_of
from fullwell.pipeline.lighting import LightPlan, plan_light
from fullwell.render import REPLICAS, NoiseTarget, SamplingGoal, adaptive, light, render_light
from fullwell.schema.frame import FrameDescription

_BATCH = 4
_CAP = 20_000
_DRAWS = 4_000_000
"""Numbers that are drawn at once."""


class _Recorded(BaseException):
    """Ends a render whose samples are all that is wanted."""


def _plan(frame: FrameDescription) -> LightPlan:
    return plan_light(with_budget(frame, Budget(_BATCH, noise_ratio=1.0)), frame.cameras[0], 0, skip=True)


def _target(frame: FrameDescription) -> NoiseTarget:
    """Return the noise of the sensors, whose exposure is not chosen yet."""
    ((_, target),) = _plan(frame).request.targets
    return target


def recorded(frame: FrameDescription, batches: int, seed: int = 4242) -> NDArray[np.float32]:
    """Return (pixels, draws, responses): means of `_BATCH` samples, from all replicas; rendered where they are not kept yet."""
    path = reference_folder() / f"pool-{digest_of([frame.recipe_json, path_version(), batches, seed])[:24]}.npy"
    if path.is_file():
        return np.asarray(np.load(path))
    found: list[NDArray[np.float32]] = []

    def record(image: Any, *_: Any, **__: Any) -> None:
        everything, before = np.arange(image.rows * image.cols), 0.0
        for number_so_far in range(1, batches + 1):
            image.add(everything, np.full(len(everything), _BATCH), lambda _: None)
            sums = image.replicas().astype(np.float64).sum(axis=1).reshape(REPLICAS, -1, len(everything)) * number_so_far
            found.append((sums - before).astype(np.float32))
            before = sums
        raise _Recorded

    plan = _plan(frame)
    with patch.object(light, "sample_until", record), uncollected(), suppress(_Recorded):
        render_light(plan.scene, frame.cameras[0].camera, replace(plan.request, seed=seed))
    pool = np.ascontiguousarray(np.concatenate(found).transpose(2, 0, 1))
    with write_atomically(path) as partial, partial.open("wb") as stream:
        np.save(stream, pool)
    return pool


class ReplayImage:
    """A sampler that draws from recorded batches."""

    def __init__(self, pool: NDArray[np.float32], shape: tuple[int, int], seed: int) -> None:
        self._pool, (self.rows, self.cols) = pool, shape
        self.counts = np.zeros(len(pool), dtype=np.int64)
        self._sums = np.zeros((REPLICAS, pool.shape[2], len(pool)))
        self._rng = np.random.Generator(np.random.Philox(seed))

    def add(self, pixels: NDArray[np.int64], counts: NDArray[np.int64], report: Callable[[float], None]) -> None:
        """Draw whole batches: the numbers of samples are rounded up to their multiple."""
        draws = -(-counts // _BATCH)
        for many in np.unique(draws[draws > 0]):
            chosen = pixels[draws == many]
            at_once = max(1, int(_DRAWS // (many * REPLICAS)))
            for first in range(0, len(chosen), at_once):
                part = chosen[first : first + at_once]
                which = self._rng.integers(0, self._pool.shape[1], (len(part), REPLICAS, many))
                sums = self._pool[part[:, None, None], which].sum(axis=2, dtype=np.float64)
                self._sums[:, :, part] += sums.transpose(1, 2, 0) * _BATCH
            self.counts[chosen] += _BATCH * many
        report(1.0)

    def replicas(self) -> NDArray[np.float32]:
        """Return (replicas, 1, responses, rows, cols) means."""
        means = self._sums / np.maximum(self.counts, 1)
        return means.reshape(REPLICAS, 1, -1, self.rows, self.cols).astype(np.float32)

    def restart(self, clamp: NDArray[np.float64]) -> None:
        """Not needed here."""
        raise NotImplementedError("replayed samples are not clamped")


class ByMean:
    """A target to which the mean tells what is saturated, however it came about."""

    def __init__(self, target: NoiseTarget) -> None:
        self._target, self.key = target, target.key
        self.channels, self.saturation = target.channels, target.saturation

    def __call__(self, channels: NDArray[np.float64], sure: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        return self._target(channels)


RULES: dict[str, tuple[Callable[[NoiseTarget], NoiseTarget], int]] = {
    "as it is": (lambda target: target, 64),
    "saturation told by the mean": (ByMean, 64),
    "surroundings count until 1024 rays": (lambda target: target, 256),
}
"""By name: what is made of the target, and the samples at which surroundings count half."""


def measured(
    frame: FrameDescription, pool: NDArray[np.float32], run: Callable[[ReplayImage], None], seeds: int
) -> tuple[float, float, float, float]:
    """Return (rays per pixel, rms, 95th percentile tile, worst tile) with squared errors of tiles averaged over seeds."""
    film = frame.cameras[0].camera.film
    target = _target(frame)
    truth = target.channels(pool.mean(axis=1, dtype=np.float64).T.reshape(-1, film.rows, film.cols))
    noise = tile_sums(target(truth))
    squares, rays = [], []
    for seed in range(seeds):
        image = ReplayImage(pool, (film.rows, film.cols), seed)
        run(image)
        found = target.channels(image.replicas()[:, 0].mean(axis=0, dtype=np.float64))
        squares.append(tile_sums((found - truth) ** 2) / noise)
        rays.append(REPLICAS * float(image.counts.mean()))
    square = np.mean(squares, axis=0).max(axis=0)
    return float(np.mean(rays)), float(np.sqrt(square.mean())), *_tiles(np.sqrt(square))


def _tiles(error: NDArray[np.float64]) -> tuple[float, float]:
    return float(np.percentile(error, 95)), float(error.max())


def table(
    frame: FrameDescription, pool: NDArray[np.float32], samples: Sequence[int], ratios: Sequence[float], seeds: int
) -> str:
    """Return the errors of equal samples, and of each rule at each ratio."""
    everything = np.arange(len(pool))
    rows = []
    for count in samples:
        each = np.full(len(pool), count // REPLICAS)
        values = measured(frame, pool, lambda image, each=each: image.add(everything, each, lambda _: None), seeds)  # type: ignore[misc]
        rows.append(["equal samples", str(count), *(number(value) for value in values)])
    for name, (made, prior) in RULES.items():
        for ratio in ratios:
            goal = SamplingGoal(noise_ratio=ratio, max_samples_per_pixel=_CAP)

            def run(image: ReplayImage, goal: SamplingGoal = goal, made: Any = made) -> None:
                views = [(np.ones(1), made(_target(frame)))]
                adaptive.sample_until(image, goal, views, report=lambda _: None, replicas=REPLICAS)

            with patch.object(adaptive, "_PRIOR_SAMPLES", prior):
                values = measured(frame, pool, run, seeds)
            rows.append([name, f"ratio {ratio:g}", *(number(value) for value in values)])
            print(rows[-1], flush=True)
    header = ["Rule", "asked", "rays per pixel", "rms", "95 % tile", "worst tile"]
    return markdown_table(header, rows, left=2)


def main() -> None:
    """Record, replay, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", choices=sorted(SCENES), default="street_night")
    parser.add_argument("--size", default="80x60")
    parser.add_argument("--batches", type=int, default=1024, help="of 4 samples of each replica")
    parser.add_argument("--samples", type=int, nargs="+", default=[256, 1024, 4096])
    parser.add_argument("--noise-ratios", type=float, nargs="+", default=[16.0, 8.0, 4.0])
    parser.add_argument("--seeds", type=int, default=4)
    arguments = parser.parse_args()
    cols, rows = (int(text) for text in arguments.size.split("x"))
    with tempfile.TemporaryDirectory() as folder:
        frame = build_frame(arguments.scene, Path(folder), size=(cols, rows))
        pool = recorded(frame, arguments.batches)
        print(table(frame, pool, arguments.samples, arguments.noise_ratios, arguments.seeds))


if __name__ == "__main__":
    main()
