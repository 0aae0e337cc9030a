"""Adaptive sampling against an image whose error is known: it stops where it should, and says what it did not reach."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from fullwell.render.adaptive import TILE, SamplingGoal, SamplingOutcome, sample_until, tile_errors

REPLICAS = 4
LIGHT = 100.0
ONE_VIEW = np.array([1.0])

LEAST_SAMPLES = 4 * REPLICAS
"""Taken everywhere before anything is decided."""


class GaussianImage:
    """Replicas whose means have the standard deviation of their tile over the root of their samples. One group, `responses`."""

    def __init__(self, deviation_by_tile: NDArray[np.float64], *, seed: int = 0, responses: int = 1, crop: int = 0) -> None:
        pixels = np.kron(deviation_by_tile, np.ones((TILE, TILE)))
        self._deviation = pixels[: len(pixels) - crop, : pixels.shape[1] - crop]
        self.rows, self.cols = self._deviation.shape
        self.counts = np.zeros(self.rows * self.cols, dtype=np.int64)
        self._sums = np.zeros((REPLICAS, 1, responses, self.rows * self.cols))
        self._rng = np.random.default_rng(seed)
        self.rounds = 0
        self.clamps: list[NDArray[np.float64]] = []

    def add(self, pixels: NDArray[np.int64], counts: NDArray[np.int64], report: Callable[[float], None]) -> None:
        assert np.all(counts >= 0)
        spread = self._deviation.ravel()[pixels] * np.sqrt(counts)
        noise = self._rng.standard_normal((*self._sums.shape[:3], len(pixels)))
        self._sums[..., pixels] += LIGHT * counts + noise * spread
        self.counts[pixels] += counts
        self.rounds += 1
        report(1.0)

    def replicas(self) -> NDArray[np.float32]:
        means = self._sums / np.maximum(self.counts, 1)
        return means.reshape(*means.shape[:3], self.rows, self.cols).astype(np.float32)

    def restart(self, clamp: NDArray[np.float64]) -> None:
        self.clamps.append(clamp)
        self.counts[:] = 0
        self._sums[:] = 0.0


class EvenNoise:
    """Sensors whose noise is the same everywhere: unit variance of light, times `factor`."""

    key = "all channels"

    def __init__(self, factor: float = 1.0, saturation: float = np.inf) -> None:
        self._factor, self._saturation = factor, saturation

    def channels(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        return light

    def __call__(self, channels: NDArray[np.float64], sure: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        return np.full(channels.shape, self._factor)

    def saturation(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.full(len(light), self._saturation)


def run(image: GaussianImage, goal: SamplingGoal, *targets: EvenNoise, reports: list[float] | None = None) -> SamplingOutcome:
    views = [(ONE_VIEW, target) for target in targets]
    report = (lambda _: None) if reports is None else reports.append
    return sample_until(image, goal, views, report=report, replicas=REPLICAS)


def tiles_of(samples: NDArray[np.int64]) -> NDArray[np.int64]:
    return samples[::TILE, ::TILE]


ESTIMATE_ERROR = 1.2
"""The error is estimated from 4 replicas of 64 pixels, to 1/sqrt(2 * 3 * 64) = 5.1 %: four times that."""


ESTIMATE_ERROR_OF_MANY = 1.27
"""The same for the worst of some hundred tiles, which is judged several times."""

BLOCK = 9
"""Tiles of equal deviation side by side: those in the middle have surroundings like themselves."""


def middles(tiles: NDArray[np.int64]) -> NDArray[np.int64]:
    return tiles[BLOCK // 2 :: BLOCK, BLOCK // 2 :: BLOCK]


@pytest.mark.parametrize("seed", range(4))
def test_every_tile_gets_the_samples_that_its_variance_asks_for_and_little_more(seed: int) -> None:
    deviation = np.array([[1.0, 4.0, 8.0], [16.0, 24.0, 0.0]])
    image = GaussianImage(np.kron(deviation, np.ones((BLOCK, BLOCK))), seed=seed)
    wanted = 0.5
    outcome = run(image, SamplingGoal(noise_ratio=wanted, max_samples_per_pixel=1 << 20), EvenNoise())
    assert (outcome.stopped_by, outcome.unmet_tiles, outcome.tiles) == ("target", 0, 6 * BLOCK**2)
    assert np.all(outcome.ratio <= wanted)
    true_ratio = np.kron(deviation, np.ones((BLOCK, BLOCK))) / np.sqrt(tiles_of(outcome.samples))
    assert np.all(true_ratio <= wanted * ESTIMATE_ERROR_OF_MANY)
    samples = middles(tiles_of(outcome.samples))
    needed = (deviation / wanted) ** 2
    # 5 % of safety and steps of at most half a power of two above what was there; the first round cannot be less.
    assert np.all(samples <= np.maximum(1.6 * needed, LEAST_SAMPLES))
    assert samples[1, 2] == LEAST_SAMPLES


def test_predicted_error_is_the_true_one() -> None:
    deviation = np.full((6, 6), 3.0)
    image = GaussianImage(deviation)
    outcome = run(image, SamplingGoal(noise_ratio=None, samples_per_pixel=64), EvenNoise())
    true_ratio = 3.0 / np.sqrt(64)
    # 36 tiles of 64 pixels, 4 replicas each: 0.85 % of statistical error, four of them.
    assert outcome.rms_ratio == pytest.approx(true_ratio, rel=0.034)
    assert outcome.ratio.max() < 1.2 * true_ratio


def test_number_of_rounds_stays_small() -> None:
    image = GaussianImage(np.full((2, 2), 40.0))
    outcome = run(image, SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=1 << 20), EvenNoise())
    assert outcome.stopped_by == "target"
    assert outcome.rounds == image.rounds
    assert outcome.rounds <= 8  # a factor of four a round from 16 to 6400 samples, and what the estimates add


def test_cap_is_kept_and_tiles_that_miss_the_target_are_counted() -> None:
    deviation = np.kron(np.array([[1.0, 100.0], [100.0, 1.0]]), np.ones((BLOCK, BLOCK)))
    image = GaussianImage(deviation)
    outcome = run(image, SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=256), EvenNoise())
    assert (outcome.stopped_by, outcome.unmet_tiles, outcome.tiles) == ("samples", 2 * BLOCK**2, 4 * BLOCK**2)
    np.testing.assert_array_equal(middles(tiles_of(outcome.samples)), [[LEAST_SAMPLES, 256], [256, LEAST_SAMPLES]])
    np.testing.assert_array_equal(tiles_of(outcome.samples)[deviation == 100.0], 256)
    assert outcome.ratio[BLOCK // 2, BLOCK + BLOCK // 2] == pytest.approx(100.0 / 16.0, rel=ESTIMATE_ERROR - 1)


def test_tile_that_has_met_no_rare_path_is_not_believed_beside_one_that_has() -> None:
    """A tile that looks exact after the first samples gets more where its surroundings are noisy, but not as many as they."""
    deviation = np.full((5, 5), 40.0)
    deviation[2, 2] = 0.0
    outcome = run(GaussianImage(deviation), SamplingGoal(noise_ratio=1.0, max_samples_per_pixel=1 << 16), EvenNoise())
    lucky, noisy = tiles_of(outcome.samples)[2, 2], tiles_of(outcome.samples)[0, 0]
    assert 4 * LEAST_SAMPLES <= lucky < noisy / 2


class FireflyImage(GaussianImage):
    """One replica of the first pixel meets a path of `light` among its first samples, and never again."""

    def __init__(self, deviation_by_tile: NDArray[np.float64], light: float) -> None:
        super().__init__(deviation_by_tile)
        self._sums[0, 0, 0, 0] = light


class FullWell(EvenNoise):
    """Unit noise, and an allowance of a tenth of the light from `FULL` on."""

    FULL = 10 * LIGHT

    def __call__(self, channels: NDArray[np.float64], sure: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        told = channels if sure is None else sure
        return np.where(told > self.FULL, (0.1 * told) ** 2, 1.0)


def test_one_bright_sample_does_not_make_a_dark_pixel_a_saturated_one() -> None:
    """Its error is twice the light above the full well, not a few times the tenth that would do for a saturated pixel."""
    firefly = 40_000.0 * LEAST_SAMPLES  # lifts the mean of the pixel to 40 times the full well
    image = FireflyImage(np.ones((1, 1)), firefly)
    outcome = run(image, SamplingGoal(noise_ratio=None, samples_per_pixel=LEAST_SAMPLES), FullWell())
    assert image.replicas().mean(axis=0)[0, 0, 0, 0] > 40 * FullWell.FULL
    # One of four replicas has it all, so the standard error is the mean itself; over the noise of 64 pixels.
    assert outcome.ratio[0, 0] == pytest.approx(40_000.0 / 8, rel=0.01)


def test_tile_with_a_firefly_is_sampled_until_the_firefly_does_not_matter() -> None:
    image = FireflyImage(np.ones((1, 1)), 400_000.0)
    outcome = run(image, SamplingGoal(noise_ratio=4.0, max_samples_per_pixel=1 << 20), FullWell())
    assert outcome.unmet_tiles == 0
    # Error 400 000 / samples in one of 64 pixels of unit noise.
    assert 400_000.0 / (4.0 * 8) <= outcome.samples[0, 0] * 1.01 < 2 * 400_000.0 / (4.0 * 8)


def test_pixel_that_every_replica_sees_saturated_is_a_saturated_one() -> None:
    light = np.full((REPLICAS, 1, 1, TILE, TILE), 100 * FullWell.FULL)
    light[0] *= 1.2
    ratio = tile_errors(light, [(ONE_VIEW, FullWell())]).ratio[0, 0]
    # Replicas at 1.2, 1, 1, 1: a mean of 1.05, a standard error of 0.05, an allowance of a tenth of what is surely there.
    assert ratio == pytest.approx(0.05 / 0.09, rel=1e-6)


def test_three_bright_replicas_of_four_do_not_make_a_pixel_saturated_either() -> None:
    """A lamp that fills a ten thousandth of a pixel: some replicas meet it, and their number is luck."""
    light = np.full((REPLICAS, 1, 1, TILE, TILE), LIGHT)
    light[:, 0, 0, 0, 0] = np.array([2.0, 2.0, 3.0, 0.5]) * FullWell.FULL
    ratio = tile_errors(light, [(ONE_VIEW, FullWell())]).ratio[0, 0]
    # Their standard error is 0.515 of the full well: over the unit noise of 64 pixels.
    assert ratio == pytest.approx(0.515 * FullWell.FULL / 8, rel=0.01)


@pytest.mark.parametrize("cap", [4, 8, 16, 100])
def test_cap_below_the_first_round_is_kept_too(cap: int) -> None:
    outcome = run(GaussianImage(np.full((1, 2), 50.0)), SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=cap), EvenNoise())
    # One sample in each replica is the least that says anything of the error.
    assert outcome.samples.max() <= max(cap, REPLICAS)
    assert outcome.stopped_by == "samples"
    assert outcome.unmet_tiles == 2


def test_time_limit_ends_the_sampling_after_the_round_at_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(1000))
    monkeypatch.setattr("fullwell.render.adaptive.time.perf_counter", lambda: float(next(clock)))
    image = GaussianImage(np.full((2, 2), 100.0))
    goal = SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=1 << 20, time_limit_s=1.5)
    outcome = run(image, goal, EvenNoise())
    assert (outcome.stopped_by, outcome.unmet_tiles) == ("time", 4)
    assert outcome.rounds == 2


def test_time_limit_is_no_reason_where_the_target_is_met(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(1000))
    monkeypatch.setattr("fullwell.render.adaptive.time.perf_counter", lambda: float(next(clock)))
    outcome = run(GaussianImage(np.full((2, 2), 1.0)), SamplingGoal(noise_ratio=0.5, time_limit_s=0.5), EvenNoise())
    assert (outcome.stopped_by, outcome.unmet_tiles) == ("target", 0)


def test_strictest_view_decides() -> None:
    goal = SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=1 << 20)
    alone = run(GaussianImage(np.full((2, 2), 8.0)), goal, EvenNoise(0.25))
    both = run(GaussianImage(np.full((2, 2), 8.0)), goal, EvenNoise(100.0), EvenNoise(0.25))
    np.testing.assert_array_equal(alone.samples, both.samples)


def test_worst_channel_decides() -> None:
    class SecondChannelIsStrict(EvenNoise):
        def __call__(self, channels: NDArray[np.float64], sure: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
            return np.array([100.0, 0.25])[:, None, None] * np.ones(channels.shape)

    goal = SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=1 << 20)
    outcome = run(GaussianImage(np.full((2, 2), 8.0), responses=2), goal, SecondChannelIsStrict())
    assert np.all(tiles_of(outcome.samples) >= (8.0 / 0.25) ** 2 / ESTIMATE_ERROR**2)


def test_weights_of_light_groups_scale_the_error() -> None:
    rng = np.random.default_rng(3)
    replicas = rng.standard_normal((REPLICAS, 2, 1, 16, 16))
    one = tile_errors(replicas, [(np.array([1.0, 0.0]), EvenNoise())])
    double = tile_errors(replicas, [(np.array([2.0, 0.0]), EvenNoise())])
    both = tile_errors(replicas, [(np.array([1.0, 0.0]), EvenNoise()), (np.array([2.0, 0.0]), EvenNoise())])
    np.testing.assert_allclose(double.ratio, 2 * one.ratio)
    np.testing.assert_array_equal(both.ratio, double.ratio)


def test_errors_need_a_view() -> None:
    with pytest.raises(ValueError, match="no view"):
        tile_errors(np.zeros((REPLICAS, 1, 1, 8, 8)), [])


def test_noise_of_zero_is_met_by_an_error_of_zero_only() -> None:
    dark = tile_errors(np.zeros((REPLICAS, 1, 1, 8, 8)), [(ONE_VIEW, EvenNoise(0.0))])
    assert dark.rms == 0.0
    noisy = tile_errors(np.random.default_rng(0).random((REPLICAS, 1, 1, 8, 8)), [(ONE_VIEW, EvenNoise(0.0))])
    assert noisy.ratio[0, 0] == np.inf


def test_tiles_at_the_edges_may_be_smaller() -> None:
    image = GaussianImage(np.array([[1.0, 1.0], [1.0, 40.0]]), crop=TILE - 1)  # the last tile is one pixel
    outcome = run(image, SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=1 << 20), EvenNoise())
    assert outcome.samples.shape == (TILE + 1, TILE + 1)
    assert outcome.ratio.shape == (2, 2)
    assert outcome.samples[-1, -1] > 10 * outcome.samples[0, 0]


@pytest.mark.parametrize("views", [(), (EvenNoise(),)])
def test_equal_samples_are_equal_and_no_target_is_claimed(views: tuple[EvenNoise, ...]) -> None:
    image = GaussianImage(np.array([[1.0, 50.0]]))
    outcome = run(image, SamplingGoal(noise_ratio=None, samples_per_pixel=30), *views)
    assert np.all(outcome.samples == 32)  # a multiple of the replicas
    assert (outcome.stopped_by, outcome.unmet_tiles, outcome.rounds) == ("samples", 0, 1)
    assert bool(outcome.ratio.any()) == bool(views)


def test_without_sensors_samples_are_equal_whatever_the_ratio() -> None:
    image = GaussianImage(np.array([[1.0, 50.0]]))
    outcome = run(image, SamplingGoal(noise_ratio=0.5, samples_per_pixel=16))
    assert np.all(outcome.samples == 16)


def test_clamp_is_set_from_a_first_look_whose_samples_are_forgotten() -> None:
    image = GaussianImage(np.full((1, 1), 1.0))
    goal = SamplingGoal(noise_ratio=None, samples_per_pixel=16, clamp_saturation=3.0)
    outcome = run(image, goal, EvenNoise(saturation=200.0), EvenNoise(saturation=500.0))
    assert [clamp.tolist() for clamp in image.clamps] == [[1500.0]]  # the view that saturates last
    assert np.all(outcome.samples == 16)


def test_progress_never_goes_back_or_beyond_the_end() -> None:
    reports: list[float] = []
    run(
        GaussianImage(np.full((2, 2), 40.0)),
        SamplingGoal(noise_ratio=0.5, max_samples_per_pixel=1 << 20),
        EvenNoise(),
        reports=reports,
    )
    assert reports[0] == 0.0
    assert reports == sorted(reports)
    assert reports[-1] <= 1.0
