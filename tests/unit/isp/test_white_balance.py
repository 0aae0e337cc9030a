"""One gain per channel."""

from __future__ import annotations

import numpy as np

from fullwell.isp.white_balance import (
    apply_gains,
    balance_mosaic,
    gains_for_gray_world,
    gains_for_white,
    gains_for_white_patch,
    unsaturated_cells,
)

RGGB = (("R", "G"), ("G", "B"))

ROUNDING = 1e-12
"""Relative; a few operations in double precision."""


def test_white_becomes_neutral_and_no_gain_is_below_one() -> None:
    white = np.array([0.3, 0.9, 0.45])
    gains = gains_for_white(white)
    np.testing.assert_allclose(gains * white, 0.9, rtol=ROUNDING)
    assert np.min(gains) == 1.0


def test_gray_world_makes_the_mean_neutral() -> None:
    picture = np.random.default_rng(0).random((8, 9, 3)) * [0.1, 0.5, 0.3]
    balanced = (picture * gains_for_gray_world(picture)).mean(axis=(0, 1))
    np.testing.assert_allclose(balanced, balanced[0], rtol=ROUNDING)


def test_a_black_picture_is_left_as_it_is() -> None:
    np.testing.assert_array_equal(gains_for_gray_world(np.zeros((4, 4, 3))), np.ones(3))


def test_saturated_highlights_stay_white() -> None:
    np.testing.assert_array_equal(apply_gains(np.ones((1, 1, 3)), np.array([2.1, 1.0, 1.6])), np.ones((1, 1, 3)))


def test_the_brightest_patch_becomes_neutral_whatever_the_colours_around_it() -> None:
    picture = np.random.default_rng(1).random((20, 30, 3)) * [0.4, 0.05, 0.1]
    picture[:5, :5] = [0.9, 0.6, 0.45]
    gains = gains_for_white_patch(picture, percentile=98.0)
    np.testing.assert_allclose(gains * [0.9, 0.6, 0.45], 0.9, rtol=ROUNDING)


def test_a_channel_without_response_keeps_its_gain() -> None:
    np.testing.assert_array_equal(gains_for_white(np.array([0.5, 0.0, 0.25])), [1.0, 1.0, 2.0])


def test_cells_with_a_saturated_pixel_tell_nothing_about_the_light() -> None:
    mosaic = np.tile(np.array([[0.2, 0.4], [0.6, 0.8]]), (3, 4))
    mosaic[2, 3] = 1.0
    cells = unsaturated_cells(mosaic, RGGB, ("R", "G", "B", "W"))
    assert cells.shape == (11, 4)
    np.testing.assert_allclose(cells, np.broadcast_to([0.2, 0.5, 0.8, 0.0], (11, 4)), rtol=ROUNDING)


def test_a_picture_that_is_saturated_or_tiny_gives_finite_gains() -> None:
    for mosaic in (np.ones((4, 4)), np.full((1, 1), 0.5)):
        cells = unsaturated_cells(mosaic, RGGB, ("R", "G", "B"))
        np.testing.assert_array_equal(gains_for_gray_world(cells), np.ones(3))
        np.testing.assert_array_equal(gains_for_white_patch(cells, percentile=99.0), np.ones(3))


def test_each_pixel_of_a_mosaic_gets_the_gain_of_its_channel() -> None:
    balanced = balance_mosaic(np.full((3, 3), 0.3), RGGB, ("G", "R", "B"), np.array([1.0, 2.0, 4.0]))
    np.testing.assert_allclose(balanced, [[0.6, 0.3, 0.6], [0.3, 1.0, 0.3], [0.6, 0.3, 0.6]], rtol=ROUNDING)
