"""One gain per channel."""

from __future__ import annotations

import numpy as np

from fullwell.isp.white_balance import apply_gains, gains_for_gray_world, gains_for_white

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
