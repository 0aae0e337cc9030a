"""Colour difference: published pairs, an independent library, limits."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core.errors import FieldError, ShapeError
from fullwell.metrics import delta_e_1976, delta_e_1994, delta_e_2000, xyz_to_lab

SHARMA_2005 = np.array(
    [
        [50.0000, 2.6772, -79.7751, 50.0000, 0.0000, -82.7485, 2.0425],
        [50.0000, 3.1571, -77.2803, 50.0000, 0.0000, -82.7485, 2.8615],
        [50.0000, 2.8361, -74.0200, 50.0000, 0.0000, -82.7485, 3.4412],
        [50.0000, -1.3802, -84.2814, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -1.1848, -84.8006, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -0.9009, -85.5211, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, 0.0000, 0.0000, 50.0000, -1.0000, 2.0000, 2.3669],
        [50.0000, -1.0000, 2.0000, 50.0000, 0.0000, 0.0000, 2.3669],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0009, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0010, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0011, 7.2195],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0012, 7.2195],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0009, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0010, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0011, -2.4900, 4.7461],
        [50.0000, 2.5000, 0.0000, 50.0000, 0.0000, -2.5000, 4.3065],
        [50.0000, 2.5000, 0.0000, 73.0000, 25.0000, -18.0000, 27.1492],
        [50.0000, 2.5000, 0.0000, 61.0000, -5.0000, 29.0000, 22.8977],
        [50.0000, 2.5000, 0.0000, 56.0000, -27.0000, -3.0000, 31.9030],
        [50.0000, 2.5000, 0.0000, 58.0000, 24.0000, 15.0000, 19.4535],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.1736, 0.5854, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2972, 0.0000, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 1.8634, 0.5757, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2592, 0.3350, 1.0000],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630],
        [61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731],
        [35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645],
        [22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373],
        [36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146],
        [90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441],
        [90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381],
        [6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ]
)
"""Table 1 of sharma2005: L*, a*, b* of both colours and the difference, printed to four places."""

PRINTED_PLACES = 5.1e-5
LIBRARY_TOLERANCE = 1e-10


def test_the_published_pairs_of_ciede2000_come_out_both_ways_round() -> None:
    one, two, expected = SHARMA_2005[:, :3], SHARMA_2005[:, 3:6], SHARMA_2005[:, 6]
    np.testing.assert_allclose(delta_e_2000(one, two), expected, atol=PRINTED_PLACES)
    np.testing.assert_allclose(delta_e_2000(two, one), expected, atol=PRINTED_PLACES)


def test_random_colours_agree_with_an_independent_library() -> None:
    from colour.difference import delta_E_CIE1976, delta_E_CIE1994, delta_E_CIE2000

    rng = np.random.default_rng(3)
    one, two = (rng.uniform([0, -100, -100], [100, 100, 100], (5000, 3)) for _ in range(2))
    np.testing.assert_allclose(delta_e_1976(one, two), delta_E_CIE1976(one, two), rtol=LIBRARY_TOLERANCE)
    np.testing.assert_allclose(delta_e_1994(one, two), delta_E_CIE1994(one, two), rtol=LIBRARY_TOLERANCE)
    np.testing.assert_allclose(delta_e_2000(one, two), delta_E_CIE2000(one, two), rtol=LIBRARY_TOLERANCE)


def test_lab_of_white_is_100_0_0_and_of_black_0_0_0() -> None:
    white = np.array([95.047, 100.0, 108.883])
    np.testing.assert_allclose(xyz_to_lab(white, white), [100, 0, 0], atol=1e-12)
    np.testing.assert_allclose(xyz_to_lab([0.0, 0.0, 0.0], white), [0, 0, 0], atol=1e-12)


def test_lab_has_no_step_where_the_line_meets_the_cube_root() -> None:
    limit = (6 / 29) ** 3
    below, above = (xyz_to_lab([limit * factor] * 3, [1.0, 1.0, 1.0])[0] for factor in (1 - 1e-12, 1 + 1e-12))
    assert above == pytest.approx(below, abs=1e-9)


def test_equal_colours_do_not_differ() -> None:
    lab = np.random.default_rng(1).uniform(-60, 60, (50, 3))
    for difference in (delta_e_1976, delta_e_1994, delta_e_2000):
        assert np.all(difference(lab, lab) == 0)


def test_images_broadcast_against_one_colour() -> None:
    assert delta_e_2000(np.zeros((4, 5, 3)), [50.0, 0.0, 0.0]).shape == (4, 5)


def test_wrong_shapes_nan_and_a_black_white_are_refused() -> None:
    with pytest.raises(ShapeError, match="must be"):
        delta_e_2000(np.zeros((3, 2)), np.zeros((3, 2)))
    with pytest.raises(ShapeError, match="broadcast"):
        delta_e_1976(np.zeros((3, 3)), np.zeros((2, 3)))
    with pytest.raises(FieldError, match="NaN"):
        delta_e_1994([np.nan, 0, 0], [0, 0, 0])
    with pytest.raises(FieldError, match="white_xyz"):
        xyz_to_lab([1.0, 1.0, 1.0], [1.0, 0.0, 1.0])
