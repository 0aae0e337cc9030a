"""Every channel at every pixel."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.isp.demosaic import demosaic_bilinear

ROUNDING = 1e-12
"""Relative; weighted means in double precision."""

BAYER_ORDERS = ("RGGB", "BGGR", "GRBG", "GBRG")
PATTERNS = [((a, b), (c, d)) for a, b, c, d in BAYER_ORDERS] + [
    (("R", "C"), ("C", "C")),
    (tuple("RRGG"), tuple("RRGG"), tuple("GGBB"), tuple("GGBB")),
    (tuple("RGB"),),
    (("R",), ("G",), ("B",)),
]


def names(pattern: tuple[tuple[str, ...], ...]) -> tuple[str, ...]:
    return tuple(sorted({name for row in pattern for name in row}))


def mosaic_of(planes: dict[str, np.ndarray], pattern: tuple[tuple[str, ...], ...]) -> np.ndarray:
    rows, cols = next(iter(planes.values())).shape
    out = np.empty((rows, cols))
    for r in range(rows):
        for c in range(cols):
            out[r, c] = planes[pattern[r % len(pattern)][c % len(pattern[0])]][r, c]
    return out


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("shape", [(12, 16), (9, 11), (5, 4)])
def test_a_constant_stays_constant_to_the_border(pattern: tuple[tuple[str, ...], ...], shape: tuple[int, int]) -> None:
    wanted = names(pattern)
    level = {name: 1.0 + k for k, name in enumerate(wanted)}
    found = demosaic_bilinear(mosaic_of({n: np.full(shape, v) for n, v in level.items()}, pattern), pattern, wanted)
    np.testing.assert_allclose(found, np.broadcast_to([level[n] for n in wanted], (*shape, len(wanted))), rtol=ROUNDING)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_measured_values_stay_as_they_are(pattern: tuple[tuple[str, ...], ...]) -> None:
    mosaic = np.random.default_rng(1).random((12, 15))
    wanted = names(pattern)
    found = demosaic_bilinear(mosaic, pattern, wanted)
    for r in range(12):
        for c in range(15):
            assert found[r, c, wanted.index(pattern[r % len(pattern)][c % len(pattern[0])])] == mosaic[r, c]


@pytest.mark.parametrize("pattern", PATTERNS[:4])
def test_a_plane_is_recovered_inside_a_bayer_mosaic(pattern: tuple[tuple[str, ...], ...]) -> None:
    y, x = np.mgrid[0:10, 0:14].astype(float)
    planes = {"R": 1 + 0.1 * x + 0.02 * y, "G": 2 - 0.05 * x + 0.1 * y, "B": 3 + 0.01 * x - 0.07 * y}
    found = demosaic_bilinear(mosaic_of(planes, pattern), pattern, ("R", "G", "B"))
    expected = np.stack([planes[n] for n in "RGB"], axis=2)
    np.testing.assert_allclose(found[1:-1, 1:-1], expected[1:-1, 1:-1], rtol=ROUNDING)


def test_green_between_four_neighbours_is_their_mean() -> None:
    mosaic = np.zeros((5, 5))
    mosaic[1, 2], mosaic[2, 1], mosaic[2, 3], mosaic[3, 2] = 1.0, 2.0, 3.0, 6.0
    found = demosaic_bilinear(mosaic, (("R", "G"), ("G", "B")), ("R", "G", "B"))
    assert found[2, 2, 1] == pytest.approx(3.0, rel=ROUNDING)


def test_a_sensor_without_filters_is_copied() -> None:
    mosaic = np.random.default_rng(2).random((3, 4))
    np.testing.assert_array_equal(demosaic_bilinear(mosaic, (("W",),), ("W",))[:, :, 0], mosaic)


def test_a_picture_smaller_than_the_pattern_has_no_nan() -> None:
    found = demosaic_bilinear(np.ones((1, 1)), (("R", "G"), ("G", "B")), ("R", "G", "B"))
    assert np.all(np.isfinite(found))
