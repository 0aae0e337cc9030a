"""Levels of a mosaic, patches of a chart seen at an angle, falloff of a flat field."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core.errors import FieldError, ShapeError
from fullwell.metrics import PixelRegion, channel_levels, channel_mask, patch_means, relative_illumination
from fullwell.radiometry import DEFAULT_GRID, Spectrum
from fullwell.scene.images import RawImage

GREY = Spectrum.constant(0.5)


def _raw(dn: np.ndarray) -> RawImage:
    return RawImage(
        dn=dn.astype(np.uint16),
        pattern=(("R", "G"), ("G", "B")),
        channels=(("R", GREY), ("G", GREY), ("B", GREY)),
        grid=DEFAULT_GRID,
        black_level_dn=64.0,
        white_level_dn=1000.4,
        exposure_time_s=0.01,
        sensor_name="test",
        adc_bits=10,
        saturated_fraction=0.0,
    )


def test_each_channel_has_its_own_levels() -> None:
    raw = _raw(np.tile([[100, 200], [300, 1000]], (3, 4)))
    red, green, blue = channel_levels(raw)
    assert (red.channel, red.pixels, red.mean_dn, red.standard_deviation_dn, red.snr_ratio) == ("R", 12, 100.0, 0.0, 0.0)
    assert (green.pixels, green.mean_dn, green.min_dn, green.max_dn) == (24, 250.0, 200, 300)
    assert green.snr_ratio == pytest.approx(186 / green.standard_deviation_dn)
    assert (blue.saturated_fraction, green.saturated_fraction) == (1.0, 0.0)


def test_a_region_is_measured_alone_and_channels_outside_it_are_left_out() -> None:
    raw = _raw(np.arange(64).reshape(8, 8))
    (only,) = channel_levels(raw, PixelRegion(3, 2, 4, 3))
    assert (only.channel, only.pixels, only.mean_dn) == ("G", 1, 19.0)


@pytest.mark.parametrize("corners", [(0, 0, 9, 4), (-1, 0, 4, 4), (4, 4, 4, 8), (5, 0, 4, 8)])
def test_a_region_outside_or_empty_is_refused_with_the_legal_range(corners: tuple[int, int, int, int]) -> None:
    with pytest.raises(FieldError, match="x1 <= 8"):
        channel_levels(_raw(np.zeros((8, 8))), PixelRegion(*corners))


def test_an_unknown_channel_is_refused() -> None:
    with pytest.raises(FieldError, match="it has B, G, R"):
        channel_mask(_raw(np.zeros((4, 4))), "W")


def test_patches_of_an_upright_chart_are_read_row_by_row() -> None:
    chart = np.kron(np.arange(24.0).reshape(4, 6), np.ones((20, 20)))[..., None] * [1.0, 2.0, 3.0]
    found = patch_means(chart, [[0, 0], [120, 0], [120, 80], [0, 80]], rows=4, cols=6)
    np.testing.assert_allclose(found, np.arange(24.0)[:, None] * [1, 2, 3], atol=1e-12)


def test_the_first_corner_says_how_the_chart_lies() -> None:
    chart = np.kron(np.arange(24.0).reshape(4, 6), np.ones((20, 20)))[::-1, ::-1, None]
    found = patch_means(chart, [[120, 80], [0, 80], [0, 0], [120, 0]], rows=4, cols=6)
    np.testing.assert_allclose(found[:, 0], np.arange(24.0), atol=1e-12)


def test_a_chart_in_perspective_is_read_where_its_patches_are() -> None:
    """Chart coordinates painted through a known perspective: u = x / (1 - 0.002 y) about the middle line."""
    row, col = np.mgrid[:200, :300] + 0.5
    depth = 1 + 0.002 * row
    u, v = (col - 150) * depth / 240 + 0.5, row * depth / 280
    chart = np.where((u > 0) & (u < 1) & (v > 0) & (v < 1), np.floor(np.clip(v, 0, 0.999) * 4) * 6 + np.floor(u * 6), -50.0)
    rows_at = [0.0, (-1 + np.sqrt(1 + 4 * 0.002 * 280)) / (2 * 0.002)]
    halves = [120 / (1 + 0.002 * y) for y in rows_at]
    corners = [
        [150 - halves[0], rows_at[0]],
        [150 + halves[0], rows_at[0]],
        [150 + halves[1], rows_at[1]],
        [150 - halves[1], rows_at[1]],
    ]
    found = patch_means(chart[..., None], corners, rows=4, cols=6)
    np.testing.assert_allclose(found[:, 0], np.arange(24.0), atol=1e-9)


def test_corners_outside_crossed_or_too_close_are_refused() -> None:
    picture = np.zeros((80, 120, 3))
    with pytest.raises(FieldError, match="outside the picture"):
        patch_means(picture, [[0, 0], [121, 0], [120, 80], [0, 80]], rows=4, cols=6)
    with pytest.raises(FieldError, match="go round"):
        patch_means(picture, [[0, 0], [120, 80], [120, 0], [0, 80]], rows=4, cols=6)
    with pytest.raises(FieldError, match="at least 4"):
        patch_means(picture, [[0, 0], [20, 0], [20, 80], [0, 80]], rows=4, cols=6)
    with pytest.raises(ShapeError, match="corners_px"):
        patch_means(picture, [[0, 0], [20, 0]], rows=4, cols=6)


def test_a_cos_fourth_field_has_its_falloff() -> None:
    row, col = np.mgrid[:120, :160] + 0.5
    radius = np.hypot(col - 80, row - 60)
    field = 5000 * (1 + (radius / 120) ** 2) ** -2
    found = relative_illumination(field)
    one_per_mille = 1e-3
    assert found.corner_ratio == pytest.approx((1 + (found.corner_radius_px / 120) ** 2) ** -2, abs=one_per_mille)
    np.testing.assert_allclose(found.ratio[2:], ((1 + (found.radius_px / 120) ** 2) ** -2)[2:], atol=3 * one_per_mille)
    assert found.axis_value == pytest.approx(5000, rel=one_per_mille)


def test_an_axis_off_the_middle_and_missing_pixels_are_respected() -> None:
    row, col = np.mgrid[:100, :100] + 0.5
    field = 100 * (1 + (np.hypot(col - 30, row - 40) / 150) ** 2) ** -2
    field[::2, ::2] = np.nan
    found = relative_illumination(field, axis_px=(30.0, 40.0))
    assert found.corner_ratio == pytest.approx((1 + (found.corner_radius_px / 150) ** 2) ** -2, abs=1e-3)


def test_noise_spreads_the_rings_by_their_standard_error() -> None:
    field = np.random.default_rng(4).normal(100, 5, (200, 200))
    found = relative_illumination(field)
    z = (found.ratio - 1) / found.standard_error
    assert np.max(np.abs(z)) < 4.5, "20 rings at 4 standard errors, and the error of the axis' value"


def test_a_dark_or_damaged_field_is_refused() -> None:
    with pytest.raises(FieldError, match="on the axis"):
        relative_illumination(np.zeros((20, 20)))
    with pytest.raises(FieldError, match="Inf"):
        relative_illumination(np.full((20, 20), np.inf))
    with pytest.raises(ShapeError, match="valid pixels"):
        relative_illumination(np.full((20, 20), np.nan))
    with pytest.raises(FieldError, match="ring_count"):
        relative_illumination(np.ones((20, 20)), ring_count=0)
