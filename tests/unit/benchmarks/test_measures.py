"""The benchmarks' error measures against closed forms, and references that grow."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))  # benchmarks/ is no part of the distribution

from benchmarks import measures  # noqa: E402
from benchmarks.engines import Budget, Result, paired  # noqa: E402

EXACT = 1e-12
"""Relative tolerance of closed forms in double precision."""


def test_a_constant_relative_error_is_its_square_in_every_band() -> None:
    truth = np.linspace(1.0, 9.0, 4 * 5 * 3).reshape(4, 5, 3)
    found = measures.band_relative_mse(truth * 1.1, truth, floor=0.0)
    np.testing.assert_allclose(found, 0.01, rtol=1e-9)


def test_a_black_pixel_counts_by_the_mean_of_its_band() -> None:
    truth = np.array([[[0.0], [2.0]]])
    found = measures.band_relative_mse(truth + [[[0.3], [0.0]]], truth, floor=0.5)
    assert found[0] == pytest.approx(0.5 * 0.3**2 / 0.5**2, rel=EXACT)  # the band's mean is 1, its floor 0.5


def test_a_black_band_has_no_relative_error() -> None:
    assert measures.mean_relative_mse(np.zeros((2, 2, 1)), np.zeros((2, 2, 1))) == 0.0


def test_luminance_error_does_not_depend_on_the_unit() -> None:
    rng = np.random.Generator(np.random.Philox(3))
    truth, measured = rng.uniform(1, 2, (2, 20, 30))
    error = measures.luminance_relative_mse(measured, truth)
    assert error > 0
    assert measures.luminance_relative_mse(7.5 * measured, 7.5 * truth) == pytest.approx(error, rel=EXACT)


def test_trimming_leaves_out_the_largest_errors_and_clipping_the_brightest_pixels() -> None:
    truth = np.ones((10, 10))
    measured = truth + 0.1
    measured[3, 4] = 1000.0
    usual = 0.01 / (1 + measures.RELATIVE_FLOOR**2)
    assert measures.luminance_relative_mse(measured, truth, trimmed_fraction=0.01) == pytest.approx(usual, rel=1e-9)
    truth[3, 4] = 900.0
    assert measures.luminance_relative_mse(measured, truth, clip_percentile=99.0) == pytest.approx(usual, rel=1e-9)


def test_the_noise_is_shot_and_dark_noise_added_in_squares() -> None:
    np.testing.assert_allclose(measures.noise_std_e(np.array([0.0, 91.0]), dark_noise_e=3.0), [3.0, 10.0], rtol=EXACT)


def test_an_error_of_one_noise_has_the_rms_one() -> None:
    truth = np.full((16, 24, 3), 91.0)
    found = measures.sensor_error(truth + 10.0, truth, dark_noise_e=3.0)
    assert (found.rms, found.worst_tile, found.mean) == pytest.approx((1.0, 1.0, 1.0), rel=EXACT)


def test_the_worst_tile_is_found_and_is_the_rms_over_its_pixels_and_channels() -> None:
    truth = np.full((20, 20, 3), 100.0)
    measured = truth.copy()
    measured[17, 18, 1] += 10.0  # the corner tile has 4 x 4 pixels of 3 channels; noise is 10
    found = measures.sensor_error(measured, truth, dark_noise_e=0.0, tile_px=8)
    assert found.worst_tile == pytest.approx((1 / (4 * 4 * 3)) ** 0.5, rel=EXACT)
    assert found.worst_tile_row_col == (16, 16)
    assert found.rms == pytest.approx((1 / (20 * 20 * 3)) ** 0.5, rel=EXACT)


def test_what_is_saturated_anyhow_has_no_error() -> None:
    truth = np.full((8, 8, 1), 5000.0)
    assert measures.sensor_error(2 * truth, truth, dark_noise_e=1.0, well_capacity_e=4000.0).rms == 0.0


def test_gaussian_errors_of_the_noise_are_found_as_one() -> None:
    rng = np.random.Generator(np.random.Philox(5))
    truth = rng.uniform(10, 1000, (200, 200, 3))
    measured = truth + rng.normal(0, 1, truth.shape) * measures.noise_std_e(truth, dark_noise_e=5.0)
    found = measures.sensor_error(measured, truth, dark_noise_e=5.0)
    samples = truth.size
    assert abs(found.rms - 1) < 5 / (2 * samples) ** 0.5  # five standard errors of a standard deviation
    assert abs(found.mean) < 5 / samples**0.5


def test_pairs_are_compared_by_the_median_of_their_ratios() -> None:
    speeds = iter([1.0, 2.0, 3.0])

    def timed(seconds: float) -> Result:
        return Result("bands", np.zeros((1, 1, 1), np.float32), seconds, seconds, 1)

    slow = {"factor": 1.0}

    def first() -> Result:
        slow["factor"] = next(speeds, 4.0)
        return timed(2.0 * slow["factor"])

    found = paired(first, lambda: timed(1.0 * slow["factor"]), repeats=1)
    assert found.ratio == pytest.approx(2.0, rel=EXACT)
    assert found.ratio_range == pytest.approx((2.0, 2.0), rel=EXACT)


class _NoisyEngine:
    """One plus normal noise, by seed."""

    name = "noise"

    def render(self, frame: Any, budget: Budget) -> Result:
        rng = np.random.Generator(np.random.Philox(budget.seed))
        image = (1 + 0.1 * rng.normal(0, 1, (24, 32, 2))).astype(np.float32)
        return Result("bands", image, 0.5, 0.5, budget.samples_per_pixel)


class _Frame:
    recipe_name, recipe_json, index, seed = "noise", "{}", 0, 7


def test_a_reference_grows_the_same_in_one_go_and_in_several(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from benchmarks import references

    engine, frame = _NoisyEngine(), _Frame()
    monkeypatch.setenv("FULLWELL_BENCH_CACHE", str(tmp_path / "several"))
    for _ in range(6):
        grown = references.extend_reference(frame, engine, seconds=0.0, samples_per_pass=4)  # type: ignore[arg-type]
    assert (grown.passes, grown.samples, grown.cpu_s) == (6, 24, 3.0)
    whole = None
    for _ in range(6):
        whole = references._with_pass(whole, frame, engine, 4)  # type: ignore[arg-type]
    assert whole is not None
    np.testing.assert_array_equal(grown.image, whole.image)
    again = references.load_reference(frame, engine, 4)  # type: ignore[arg-type]
    assert again is not None
    np.testing.assert_array_equal(again.halves, grown.halves)
    assert references.load_reference(frame, engine, 8) is None  # type: ignore[arg-type]
    # The noise is 0.1, the means of 3 passes have 0.1^2 / 3 each: a quarter of twice that is the error of all 6.
    assert grown.own_relative_mse() == pytest.approx(0.01 / 6, rel=0.25)
