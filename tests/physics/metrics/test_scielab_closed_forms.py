"""S-CIELAB keeps uniform colours, forgets detail that the eye does not see, and reads noise as the eye does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.core.errors import FieldError, ShapeError
from fullwell.metrics import delta_e_2000, s_cielab, s_cielab_difference, samples_per_degree, visual_snr, xyz_to_lab
from fullwell.metrics.scielab import FILTERS, OPPONENT_FROM_XYZ

WHITE = np.array([95.047, 100.0, 108.883])
GREY = 0.4 * WHITE
ROUNDING = 1e-9


def test_a_uniform_field_keeps_its_cielab() -> None:
    field = np.broadcast_to([41.0, 37.0, 20.0], (40, 50, 3))
    found = s_cielab(field, WHITE, samples_per_degree=60)
    np.testing.assert_allclose(found, np.broadcast_to(xyz_to_lab(field[0, 0], WHITE), found.shape), atol=ROUNDING)


def test_large_uniform_areas_differ_as_ciede2000_says() -> None:
    one, two = (np.broadcast_to(colour, (30, 30, 3)) for colour in ([40.0, 42.0, 45.0], [42.0, 41.0, 47.0]))
    expected = delta_e_2000(xyz_to_lab(one[0, 0], WHITE), xyz_to_lab(two[0, 0], WHITE))
    np.testing.assert_allclose(s_cielab_difference(one, two, WHITE, samples_per_degree=40), expected, rtol=ROUNDING)


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_a_grating_in_one_opponent_colour_is_damped_by_the_transform_of_its_gaussians(channel: int) -> None:
    """exp(-r^2 / s^2) has the transform exp(-(pi s f)^2). The widest Gaussian meets the mirrored border: a period fits it."""
    per_degree, period_px, size = 64.0, 16, 128
    wave = np.cos(2 * np.pi * (np.arange(size) + 0.5) / period_px)
    opponent = np.broadcast_to(OPPONENT_FROM_XYZ @ GREY, (size, size, 3)).copy()
    opponent[..., channel] += 0.5 * wave
    xyz = opponent @ np.linalg.inv(OPPONENT_FROM_XYZ).T
    blurred = _xyz_of_lab(s_cielab(xyz, WHITE, samples_per_degree=per_degree)) @ OPPONENT_FROM_XYZ.T
    frequency = per_degree / period_px
    total = sum(weight for weight, _ in FILTERS[channel])
    expected = sum(weight / total * math.exp(-((math.pi * spread * frequency) ** 2)) for weight, spread in FILTERS[channel])
    found = 2 * np.mean(blurred[..., channel] * wave) / 0.5
    sampling_and_ends = 2e-3  # Gaussians sampled at the pixels and ended at 4 sigma
    assert found == pytest.approx(expected, abs=sampling_and_ends)


def test_red_green_detail_is_seen_less_than_light_and_dark() -> None:
    size = 96
    wave = np.cos(2 * np.pi * np.arange(size) / 6)
    damping = []
    for channel in (0, 1):
        opponent = np.broadcast_to(OPPONENT_FROM_XYZ @ GREY, (size, size, 3)).copy()
        opponent[..., channel] += 0.5 * wave
        xyz = opponent @ np.linalg.inv(OPPONENT_FROM_XYZ).T
        flat = np.broadcast_to(GREY, xyz.shape)
        eye = s_cielab_difference(xyz, flat, WHITE, samples_per_degree=60)
        point = delta_e_2000(xyz_to_lab(xyz, WHITE), xyz_to_lab(flat, WHITE))
        damping.append(float(np.mean(eye) / np.mean(point)))
    assert damping[1] < damping[0] < 1


def test_noise_is_seen_less_from_farther_away() -> None:
    noisy = GREY * (1 + 0.05 * np.random.default_rng(2).normal(size=(100, 100, 1)))
    near, far = (visual_snr(noisy, WHITE, samples_per_degree=per_degree) for per_degree in (20, 80))
    assert far > 1.5 * near


def test_visual_snr_falls_as_the_noise_grows_and_is_infinite_without() -> None:
    noise = np.random.default_rng(5).normal(size=(80, 80, 1))
    weak, strong = (visual_snr(GREY * (1 + level * noise), WHITE, samples_per_degree=40) for level in (0.01, 0.02))
    second_order = 0.02  # the cube root bends
    assert weak / strong == pytest.approx(2.0, rel=second_order)
    assert visual_snr(np.broadcast_to(GREY, (20, 20, 3)), WHITE, samples_per_degree=40) > 1e9


def test_samples_per_degree_follow_from_pitch_and_distance() -> None:
    assert samples_per_degree(pitch_m=math.tan(math.radians(0.01)), distance_m=1.0) == pytest.approx(100.0)
    with pytest.raises(FieldError, match="distance_m"):
        samples_per_degree(pitch_m=1e-4, distance_m=0.0)


def test_negative_light_and_wrong_shapes_are_refused() -> None:
    with pytest.raises(FieldError, match="negative"):
        s_cielab(np.full((4, 4, 3), -1.0), WHITE, samples_per_degree=40)
    with pytest.raises(ShapeError, match="rows, cols, 3"):
        s_cielab(np.ones((4, 4)), WHITE, samples_per_degree=40)
    with pytest.raises(ShapeError, match="the same"):
        s_cielab_difference(np.ones((4, 4, 3)), np.ones((4, 5, 3)), WHITE, samples_per_degree=40)
    with pytest.raises(FieldError, match="samples_per_degree"):
        s_cielab(np.ones((4, 4, 3)), WHITE, samples_per_degree=0)


def _xyz_of_lab(lab: np.ndarray) -> np.ndarray:
    """Invert CIELAB above its linear part."""
    y = (lab[..., 0] + 16) / 116
    root = np.stack([y + lab[..., 1] / 500, y, y - lab[..., 2] / 200], axis=-1)
    return np.asarray(WHITE * root**3)
