"""The benchmark of error against time: errors against closed forms, costs at equal error, results that outlive a run."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))  # benchmarks/ is no part of the distribution

from benchmarks import calibration, error_against_time, scaling  # noqa: E402
from benchmarks.engines import Budget, Result  # noqa: E402
from benchmarks.noise_error import NoiseJudge, Truth, tile_sums, truth_of  # noqa: E402
from benchmarks.path_engines import ENGINES, _denoised, channels_of_bands, with_budget  # noqa: E402
from benchmarks.references import Reference  # noqa: E402
from benchmarks.results import ResultStore, cost_at_error, fill_page, markdown_table, number  # noqa: E402
from benchmarks.scenes import build_frame  # noqa: E402
from benchmarks.stages import StageTimes  # noqa: E402

from fullwell.radiometry import Spectrum, WavelengthGrid  # noqa: E402

EXACT = 1e-9


@pytest.fixture(scope="module")
def frame(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return build_frame("cornell_box", tmp_path_factory.mktemp("scene"), size=(32, 24))


def _reference(halves: np.ndarray, passes: int) -> Reference:
    return Reference(halves.astype(np.float32), passes, 64.0, 1.0, "engine", "digest")


# Errors --------------------------------------------------------------------------------------------------------------


def test_constant_light_counts_as_the_integral_of_the_response() -> None:
    grid = WavelengthGrid(405.0, 695.0, 10.0)
    channels = channels_of_bands(np.full((2, 3, grid.count), 5.0), grid, (Spectrum.constant(0.4),))
    np.testing.assert_allclose(channels, 5.0 * 0.4 * 300.0, rtol=EXACT)


def test_tiles_at_the_edges_may_be_smaller() -> None:
    sums = tile_sums(np.ones((2, 10, 17)))
    np.testing.assert_array_equal(sums[1], [[64, 64, 8], [16, 16, 2]])


def test_an_error_that_is_predicted_is_measured_and_the_references_own_is_taken_off(frame: Any) -> None:
    rng = np.random.Generator(np.random.Philox(3))
    level, own, error = 1e16, 1e14, 4e14
    halves = level + 2**0.5 * own * rng.normal(0, 1, (2, 3, 24, 32))
    judge = NoiseJudge(frame, Truth((halves[0], halves[1]), np.zeros((24, 32, 1))))
    replicas = level + 2 * error * rng.normal(0, 1, (4, 3, 24, 32))
    found = judge.judge(replicas.mean(axis=0))
    predicted = judge.predicted_square(replicas)
    ratio = calibration.mean_ratio(found.square, predicted)
    tolerance = 5 / (2 * 3 * 24 * 32) ** 0.5 * 1.5  # five standard errors of a standard deviation, of two that are compared
    assert ratio == pytest.approx(1, abs=tolerance)
    assert found.reference_rms / found.raw_rms == pytest.approx(own / (own**2 + error**2) ** 0.5, rel=0.15)
    assert abs(found.bias) < 5 * found.raw_rms / (24 * 32) ** 0.5


def test_a_shift_of_one_noise_is_a_bias_of_one(frame: Any) -> None:
    level = np.full((3, 24, 32), 1e16)
    judge = NoiseJudge(frame, Truth((level, level), np.zeros((24, 32, 1))))
    noise = np.sqrt(judge._noise / tile_sums(np.ones((1, 24, 32))))  # (channels, tile rows, tile cols)
    by_pixel = np.repeat(np.repeat(noise, 8, axis=1), 8, axis=2)
    found = judge.judge(level + by_pixel)
    assert found.summary()["rms"] == pytest.approx(1, rel=EXACT)
    assert found.summary()["worst"] == pytest.approx(1, rel=EXACT)
    assert found.bias == pytest.approx(1, rel=0.01)


def test_a_reference_with_an_odd_number_of_passes_is_refused(frame: Any) -> None:
    with pytest.raises(ValueError, match="must be even"):
        truth_of(frame, _reference(np.zeros((2, 24, 32, frame.grid.count)), 3), direct=False)


def test_a_reference_is_the_mean_of_its_halves(frame: Any) -> None:
    halves = np.stack([np.full((24, 32, frame.grid.count + 3), value) for value in (1.0, 3.0)])
    truth = truth_of(frame, _reference(halves, 2), direct=True)
    np.testing.assert_allclose(truth.channels, 2.0)
    np.testing.assert_allclose(truth.variance, 1.0)
    np.testing.assert_allclose(truth.bands, 2.0)


# Engines -------------------------------------------------------------------------------------------------------------


def test_a_budget_becomes_the_frames_quality(frame: Any) -> None:
    assert with_budget(frame, Budget(12)).quality.samples_per_pixel == 12
    adaptive = with_budget(frame, Budget(12, noise_ratio=0.7)).quality
    assert (adaptive.noise_ratio, adaptive.samples_per_pixel) == (0.7, None)


def test_an_engine_refuses_the_other_kind_of_budget(frame: Any) -> None:
    with pytest.raises(ValueError, match="noise ratio"):
        ENGINES["adaptive"]().render(frame, Budget(16))


@pytest.mark.parametrize("name", ["uniform", "uniform-channels", "adaptive-no-skip", "adaptive"])
def test_all_engines_count_the_same_channels(name: str, frame: Any) -> None:
    budget = Budget(16, noise_ratio=4.0) if name.startswith("adaptive") else Budget(64)
    result: Result = ENGINES[name]().render(frame, budget)
    assert result.channels is not None
    assert result.replicas is not None
    assert (result.kind == "bands") == (name in {"uniform", "adaptive-no-skip"})
    np.testing.assert_allclose(result.replicas.mean(axis=0), result.channels, rtol=1e-4)
    if result.kind == "bands":
        judge = NoiseJudge(frame, Truth((result.channels, result.channels), result.image))
        by_bands = judge.channels(Result("bands", result.image, 0, 0, 1))
        # Sums of the same paths: only the averaging of responses over bands, and of bands over samples, tells them apart.
        np.testing.assert_allclose(by_bands.mean(axis=(1, 2)), result.channels.mean(axis=(1, 2)), rtol=0.02)


def test_four_channels_are_denoised_by_threes() -> None:
    image = np.random.Generator(np.random.Philox(1)).uniform(1, 2, (4, 5, 4)).astype(np.float32)
    np.testing.assert_allclose(_denoised(image, lambda part: part), image, rtol=1e-6)


# Costs at equal error ------------------------------------------------------------------------------------------------


def test_costs_between_runs_follow_the_inverse_square() -> None:
    errors = [4.0, 2.0, 1.0]
    costs = [1.0, 4.0, 16.0]
    assert cost_at_error(costs, errors, 3.0) == pytest.approx(16 / 9, rel=EXACT)
    assert cost_at_error(costs, errors, 0.7) == pytest.approx(16 / 0.49, rel=EXACT)
    assert cost_at_error(costs, errors, 0.1) is None
    assert cost_at_error(costs, errors, 100.0) is None
    assert cost_at_error([], [], 1.0) is None


def test_a_costlier_run_that_happens_to_be_worse_takes_the_cheaper_ones_luck_away() -> None:
    assert cost_at_error([1.0, 2.0, 8.0], [1.0, 2.0, 1.0], 1.9) == pytest.approx(cost_at_error([2.0, 8.0], [2.0, 1.0], 1.9))


def test_ratios_are_made_of_the_same_seeds_at_the_smallest_error_that_both_reach() -> None:
    def curve(slowness: list[float], ratios: bool) -> list[dict[str, Any]]:
        return [
            {
                "seed": seed,
                "cpu_s": slow / error**2,
                "tile_squares": [[error**2, error**2 / 4], [0.0, error**2 / 2]],
                "noise_ratio": error if ratios else None,
                "samples": error**-2,
            }
            for seed, slow in enumerate(slowness)
            for error in (1.0, 2.0, 4.0)
        ]

    found = error_against_time.paired_ratio(curve([3.0, 8.0, 5.0], False), curve([1.0, 2.0, 1.0], True), "worst")
    assert found == pytest.approx((1.0, 4.0, 11 / 3, 13 / 3), rel=EXACT)


def test_the_worst_tile_is_that_of_the_expectation_not_of_a_run() -> None:
    runs = [
        {"seed": 0, "cpu_s": 1.0, "noise_ratio": None, "samples": 16, "tile_squares": [[100.0, 1.0], [1.0, 1.0]]},
        {"seed": 1, "cpu_s": 3.0, "noise_ratio": None, "samples": 16, "tile_squares": [[0.0, 1.0], [1.0, 1.0]]},
    ]
    assert error_against_time.pooled(runs, [0, 1]) == [
        (2.0, {"rms": pytest.approx((51 / 2) ** 0.5), "p95": pytest.approx(1 + 0.95 * (50**0.5 - 1)), "worst": 50**0.5})
    ]
    assert error_against_time.pooled(runs, [0, 1, 2]) == []


# What outlives a run -------------------------------------------------------------------------------------------------


def test_results_are_found_again_by_their_keys(tmp_path: Path) -> None:
    ResultStore(tmp_path).put({"scene": "a", "seed": 1}, {"cpu_s": 2.0})
    store = ResultStore(tmp_path)
    assert store.get({"seed": 1, "scene": "a"}) == {"cpu_s": 2.0}
    assert store.get({"seed": 2, "scene": "a"}) is None
    assert store.all() == [({"scene": "a", "seed": 1}, {"cpu_s": 2.0})]


def test_a_page_is_filled_between_its_marks(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- results -->\nold\n<!-- /results -->\nafter\n")
    for content in ("new", "newer"):
        fill_page(page, "results", content)
    assert page.read_text() == "before\n<!-- results -->\nnewer\n<!-- /results -->\nafter\n"
    with pytest.raises(ValueError, match="must have one"):
        fill_page(page, "other", "text")


@pytest.mark.parametrize("page", ["error_against_time.md", "calibration.md", "scaling.md"])
def test_every_page_has_a_place_for_results(page: str) -> None:
    text = (ROOT / "docs" / "benchmarks" / page).read_text(encoding="utf-8")
    assert text.count("<!-- results -->") == text.count("<!-- /results -->") == 1


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "-"), (float("nan"), "-"), (0.0, "0"), (0.01234, "0.0123"), (1.5, "1.50"), (123.4, "123"), (12345.6, "12 346")],
)
def test_numbers_have_three_digits(value: float | None, text: str) -> None:
    assert number(value) == text


def test_a_table_has_a_rule_under_its_header() -> None:
    assert markdown_table(["a", "b"], [["x", "1"]]).splitlines() == ["| a | b |", "| --- | ---: |", "| x | 1 |"]


def test_stages_count_for_themselves_only() -> None:
    times = StageTimes()
    inner = times.timed("inner", lambda: sum(range(4_000_000)))
    outer = times.timed("outer", lambda: [inner() for _ in range(5)])
    outer()
    assert times.calls == {"inner": 5, "outer": 1}
    assert times.cpu_s["outer"] < times.cpu_s["inner"]


# Scaling -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(scaling.SECTIONS))
def test_a_section_that_is_not_measured_says_so(name: str, tmp_path: Path) -> None:
    section = scaling.SECTIONS[name]
    assert "Not measured yet" in scaling.section_report(name, section, ResultStore(tmp_path))
    assert 0 < section.quick <= len(section.cases)


def test_a_failed_case_is_a_row_of_the_table(tmp_path: Path) -> None:
    store, section = ResultStore(tmp_path), scaling.SECTIONS["lights"]
    store.put(scaling._key("lights", section.cases[0]), {"warm": 1.0, "stage: lights": 0.25})
    store.put(scaling._key("lights", section.cases[1]), {"failed": "exit code -6"})
    text = scaling.section_report("lights", section, store)
    assert "| 1 lights | 1.00 | 0.250 |" in text
    assert "| 10 lights | exit code -6 |" in text


def test_things_in_a_grid_have_nearly_the_same_triangles_together(tmp_path: Path) -> None:
    from benchmarks.fields import thing_grid

    from fullwell.schema import RecipeBuilder, load_recipe

    for count in (50, 200):
        folder = tmp_path / str(count)
        folder.mkdir()
        (folder / "recipe.json").write_text(json.dumps(thing_grid((8, 8), folder, count=count, triangles=50_000)))
        scene = RecipeBuilder(load_recipe(folder / "recipe.json")).frame(0).scene
        found = sum(len(getattr(part.geometry, "faces", ())) for item in scene.objects for part in item.parts)
        assert found == pytest.approx(50_000, rel=0.15)
        assert len(scene.objects) == count + 1
