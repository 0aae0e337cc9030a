"""Photon transfer on numbers drawn here, and its refusals."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core.errors import FieldError, ShapeError
from fullwell.metrics import ExposedStack, photon_transfer


def _stack(mean_e: float, time_s: float, *, seed: int, e_per_dn: float = 2.0, flicker: float = 0.0) -> ExposedStack:
    rng = np.random.default_rng(seed)
    light = mean_e * (1 + flicker * np.arange(4)[:, None, None])
    electrons = rng.poisson(np.broadcast_to(light, (4, 120, 120))) + rng.normal(0, 6, (4, 120, 120))
    return ExposedStack(np.rint(electrons / e_per_dn) + 200, time_s)


def _flats(**options: float) -> list[ExposedStack]:
    return [_stack(1e5 * time_s, time_s, seed=k, **options) for k, time_s in enumerate((0.01, 0.02, 0.03, 0.04, 0.05))]


def test_a_common_flicker_of_the_light_does_not_count_as_noise() -> None:
    darks = [_stack(0.0, 0.01, seed=99)]
    steady, flickering = photon_transfer(_flats(), darks), photon_transfer(_flats(flicker=0.03), darks)
    ten_percent = 0.1  # 3 % per frame, counted as noise, would raise the variance at 5000 e- fivefold
    assert flickering.conversion_gain_e_per_dn == pytest.approx(steady.conversion_gain_e_per_dn, rel=ten_percent)


def test_hidden_dark_noise_and_clipped_dark_pixels_are_noted() -> None:
    coarse = [_stack(1e5 * t, t, seed=k, e_per_dn=50.0) for k, t in enumerate((0.01, 0.02, 0.03, 0.04))]
    dark = _stack(0.0, 0.01, seed=9, e_per_dn=50.0)
    notes = photon_transfer(coarse, [dark]).notes
    assert any("steps hide" in note for note in notes)
    clipped = ExposedStack(
        np.maximum(dark.dn.astype(float) * 0 + np.random.default_rng(0).normal(0, 3, dark.dn.shape), 0), 0.01
    )
    assert any("0 DN" in note for note in photon_transfer(_flats(), [clipped]).notes)


def test_too_few_levels_are_refused() -> None:
    with pytest.raises(FieldError, match="at least 3"):
        photon_transfer(_flats()[:2], [_stack(0.0, 0.01, seed=9)])


def test_no_dark_stack_is_refused() -> None:
    with pytest.raises(FieldError, match="at least 1"):
        photon_transfer(_flats(), [])


def test_stacks_of_different_pixels_are_refused() -> None:
    with pytest.raises(FieldError, match="the same ones"):
        photon_transfer(_flats(), [ExposedStack(np.zeros((2, 10, 10)), 0.01)])


def test_pictures_without_shot_noise_are_refused() -> None:
    flat = [ExposedStack(np.full((2, 20, 20), 100.0 * k), 0.01 * k) for k in (1, 2, 3, 4)]
    with pytest.raises(FieldError, match="no shot noise"):
        photon_transfer(flat, [ExposedStack(np.random.default_rng(0).normal(0, 2, (2, 20, 20)), 0.01)])


@pytest.mark.parametrize("shape", [(1, 4, 4), (4, 4), (2, 1, 1)])
def test_a_stack_needs_two_frames_of_pixels(shape: tuple[int, ...]) -> None:
    with pytest.raises(ShapeError, match="at least 2 frames"):
        ExposedStack(np.zeros(shape), 0.01)


def test_a_time_that_is_not_positive_is_refused() -> None:
    with pytest.raises(FieldError, match="exposure_time_s is 0"):
        ExposedStack(np.zeros((2, 4, 4)), 0.0)
