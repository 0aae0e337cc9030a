"""Shot noise is Poisson at every level."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from fullwell.core import stream
from fullwell.sensor.shot_noise import LARGEST_MEAN_E, poisson_electrons

SAMPLES = 400_000
LEVELS = (0.01, 0.1, 1.0, 5.0, 9.9, 10.1, 24.9, 25.1, 100.0, 1e4, 1e6, 1e9)

Z_LIMIT = 4.0
"""Standard errors; with 24 tests the chance of a false alarm is 0.15 %."""

P_LIMIT = 1e-4
"""Chance of a false alarm of one goodness-of-fit test."""


@pytest.mark.parametrize("mean", LEVELS)
def test_mean_and_variance_are_both_the_mean_number_of_electrons(mean: float) -> None:
    drawn = poisson_electrons(np.full(SAMPLES, mean), rng=stream(0, "test", "shot", str(mean)))
    assert np.all(drawn == np.rint(drawn))
    assert abs(np.mean(drawn) - mean) < Z_LIMIT * math.sqrt(mean / SAMPLES)
    # The variance of a sample variance is (fourth central moment - variance^2) / n = (mean + 2 mean^2) / n.
    assert abs(np.var(drawn - mean) - mean) < Z_LIMIT * math.sqrt((mean + 2 * mean**2) / SAMPLES)


@pytest.mark.parametrize("mean", [0.1, 3.0, 12.0, 24.9, 25.1, 60.0])
def test_the_whole_distribution_is_poisson(mean: float) -> None:
    drawn = poisson_electrons(np.full(SAMPLES, mean), rng=stream(0, "test", "histogram", str(mean))).astype(int)
    count = np.bincount(drawn)
    expected = SAMPLES * stats.poisson.pmf(np.arange(count.size), mean)
    common = expected > 10
    observed = np.append(count[common], count[~common].sum())
    wanted = np.append(expected[common], SAMPLES - expected[common].sum())
    chi_squared = np.sum((observed - wanted) ** 2 / np.maximum(wanted, 1.0))
    assert stats.chi2.sf(chi_squared, df=observed.size - 1) > P_LIMIT


def test_no_light_gives_no_electrons() -> None:
    assert not np.any(poisson_electrons(np.zeros((4, 5)), rng=stream(0, "test")))


def test_light_beyond_any_sensor_neither_fails_nor_overflows() -> None:
    drawn = poisson_electrons(np.array([1e13, 1e19, 1e38, 1e300]), rng=stream(0, "test"))
    assert np.all(np.abs(drawn / LARGEST_MEAN_E - 1) < 1e-5)
