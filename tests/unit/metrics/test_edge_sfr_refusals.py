"""What is no edge is refused with a reason; what is one keeps its figures under changes that do not matter."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import erf

from fullwell.core.errors import FieldError, ShapeError
from fullwell.metrics import edge_sfr, mosaic_edge_sfr


def _edge(
    rows: int = 60, cols: int = 50, *, slope: float = 0.1, sigma_px: float = 0.8, shift: float = 0.0
) -> NDArray[np.float64]:
    row, col = np.mgrid[:rows, :cols]
    across = (col - cols / 2 - shift - slope * (row - rows / 2)) / np.hypot(1, slope)
    return np.asarray(1 + erf(across / sigma_px / np.sqrt(2)))


@pytest.mark.parametrize("value", [0.0, 7.5])
def test_a_flat_region_is_refused(value: float) -> None:
    with pytest.raises(FieldError, match="every pixel has the same value"):
        edge_sfr(np.full((40, 40), value))


@pytest.mark.parametrize("seed", range(5))
def test_noise_is_refused(seed: int) -> None:
    with pytest.raises(FieldError, match="region"):
        edge_sfr(np.random.default_rng(seed).normal(100, 10, (60, 60)))


def test_a_shading_without_plateaus_is_refused() -> None:
    row, col = np.mgrid[:60, :60]
    with pytest.raises(FieldError, match="plateau"):
        edge_sfr(10.0 * col + row)


def test_a_checkerboard_is_refused() -> None:
    row, col = np.mgrid[:64, :64]
    with pytest.raises(FieldError, match="edge"):
        edge_sfr(((row // 8 + col // 8) % 2).astype(float))


def test_an_edge_along_the_grid_is_refused_with_what_to_do() -> None:
    with pytest.raises(FieldError, match="Tilt the edge by 2 to 10"):
        edge_sfr(_edge(slope=0.0))


def test_an_edge_that_leaves_the_region_is_refused() -> None:
    with pytest.raises(FieldError, match="from side to side"):
        edge_sfr(_edge(rows=80, cols=40, slope=0.6, shift=24.0))


def test_nan_is_refused() -> None:
    region = _edge()
    region[3, 4] = np.nan
    with pytest.raises(FieldError, match="NaN"):
        edge_sfr(region)


@pytest.mark.parametrize("shape", [(9, 40), (40, 9), (40,), (4, 40, 40)])
def test_a_region_too_small_or_of_the_wrong_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ShapeError, match="at least 10 x 10"):
        edge_sfr(np.zeros(shape))


def test_an_unknown_window_is_answered_with_the_known_ones() -> None:
    with pytest.raises(FieldError, match="hamming"):
        edge_sfr(_edge(), window="haming")  # type: ignore[arg-type]


def test_an_unknown_channel_is_answered_with_the_known_ones() -> None:
    with pytest.raises(FieldError, match="channel 'X' is not known"):
        mosaic_edge_sfr(_edge(), pattern=(("R", "G"), ("G", "B")), channel="X")


def test_a_level_outside_0_to_1_is_refused() -> None:
    with pytest.raises(FieldError, match="must be between 0 and 1"):
        edge_sfr(_edge()).frequency_at(1.5)


def test_level_and_contrast_do_not_change_the_response() -> None:
    plain, scaled = edge_sfr(_edge()), edge_sfr(5000.0 - 321.0 * _edge())
    rounding = 1e-9
    np.testing.assert_allclose(scaled.mtf, plain.mtf, atol=rounding)
    assert scaled.edge_step == pytest.approx(321.0 * plain.edge_step)


def test_the_profile_rises_by_the_step_and_keeps_the_images_levels() -> None:
    response = edge_sfr(10.0 + 20.0 * _edge())
    assert response.profile[0] == pytest.approx(10.0, abs=1e-3)
    assert response.profile[-1] == pytest.approx(50.0, abs=1e-3)
    assert response.edge_step == pytest.approx(40.0, abs=1e-3)


def test_the_angle_is_that_of_the_edge() -> None:
    response = edge_sfr(_edge(slope=0.12))
    assert response.edge_angle_deg == pytest.approx(np.degrees(np.arctan(0.12)), abs=0.02)


def test_the_input_is_not_modified() -> None:
    region = _edge()
    before = region.copy()
    edge_sfr(region)
    np.testing.assert_array_equal(region, before)


def test_where_the_mtf_stays_above_the_level_there_is_no_frequency() -> None:
    """Four samples per blur: up to one cycle per pixel the response does not fall to 1 %."""
    response = edge_sfr(_edge(rows=120, cols=100, sigma_px=0.15))
    assert response.frequency_at(0.01) is None
