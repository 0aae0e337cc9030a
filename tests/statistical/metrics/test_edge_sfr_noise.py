"""Noise spreads the edge response but hardly shifts it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erf

from fullwell.core import stream
from fullwell.metrics import edge_sfr

REPEATS = 60
Z_LIMIT = 4.0
"""Standard errors; a fair test fails once in 16 000."""


@pytest.mark.slow
@pytest.mark.parametrize("step_over_noise", [20.0, 8.0])
def test_mtf50_of_noisy_edges_scatters_about_the_true_one(step_over_noise: float) -> None:
    row, col = np.mgrid[:100, :80]
    across = (col - 39.3 - 0.09 * (row - 50)) / np.hypot(1, 0.09)
    clean = 0.5 * (1 + erf(across / np.sqrt(2)))
    true = np.sqrt(np.log(2) / 2) / np.pi
    found = np.array(
        [
            edge_sfr(clean + stream(1, "edge", k).normal(0, 1 / step_over_noise, clean.shape)).mtf50_cycles_per_px
            for k in range(REPEATS)
        ],
        dtype=float,
    )
    scatter = found.std(ddof=1)
    # |spectrum| of noise is not 0 in the mean: a bias of second order, allowed as a fifth of the scatter.
    assert abs(found.mean() - true) < Z_LIMIT * scatter / np.sqrt(REPEATS) + 0.2 * scatter
    expected_scatter = 0.035 / (step_over_noise / 20.0)
    assert scatter < expected_scatter * true * 2


def test_the_residual_is_the_noise_of_the_pixels() -> None:
    row, col = np.mgrid[:100, :80]
    clean = 50 * (1 + erf((col - 40 - 0.09 * (row - 50)) / np.sqrt(2)))
    noise = 2.0
    residual = edge_sfr(clean + stream(2, "edge").normal(0, noise, clean.shape)).residual
    assert residual == pytest.approx(noise, rel=0.05)  # 8000 pixels: 0.8 %, and the interpolation between bins
