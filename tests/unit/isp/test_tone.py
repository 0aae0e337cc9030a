"""Black level and sRGB encoding."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.isp.black_level import linear_signal
from fullwell.isp.tone import encode_srgb
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.scene.images import RawImage


def raw(dn: np.ndarray) -> RawImage:
    return RawImage(
        dn=dn.astype(np.uint16),
        pattern=(("W",),),
        channels=(("W", Spectrum.constant(1.0)),),
        grid=WavelengthGrid(),
        black_level_dn=64.0,
        white_level_dn=1023.0,
        exposure_time_s=0.01,
        sensor_name="test",
        adc_bits=10,
        saturated_fraction=0.0,
    )


def test_black_becomes_0_white_1_and_noise_below_black_stays_negative() -> None:
    np.testing.assert_allclose(linear_signal(raw(np.array([[64, 1023, 0]]))), [[0.0, 1.0, -64 / 959]])


@pytest.mark.parametrize(
    ("linear", "encoded"),
    [(0.0, 0), (1.0, 255), (0.0031308, 10), (0.18, 118), (0.5, 188), (-0.2, 0), (3.0, 255)],
)
def test_linear_values_get_their_srgb_code(linear: float, encoded: int) -> None:
    assert encode_srgb(np.array([linear])).tolist() == [encoded]


def test_every_code_can_be_reached_and_codes_grow_with_light() -> None:
    codes = encode_srgb(np.linspace(0, 1, 100_001))
    assert np.array_equal(np.unique(codes), np.arange(256))
    assert np.all(np.diff(codes.astype(int)) >= 0)
