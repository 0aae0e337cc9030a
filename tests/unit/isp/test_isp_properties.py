"""Whatever the sensor delivers, pictures stay within their range and raw files hold the numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fullwell.isp import ColourMatrixFit, IspSettings, ToneCurve, calibrate, develop
from fullwell.radiometry import WavelengthGrid, illuminant
from fullwell.scene.images import RawImage
from fullwell.sensor import sensor

CHANNELS = sensor("imx363").cfa.channels


def raw_of(dn: np.ndarray, black: float, white: float) -> RawImage:
    bits = max(1, int(dn.max(initial=1)).bit_length())
    return RawImage(dn, (("R", "G"), ("G", "B")), CHANNELS, WavelengthGrid(), black, white, 0.01, "test", bits, 0.0)


@st.composite
def raws(draw: Any) -> RawImage:
    bits = draw(st.integers(1, 24))
    shape = draw(st.tuples(st.integers(1, 9), st.integers(1, 9)))
    seed = draw(st.integers(0, 2**32 - 1))
    white = float(2**bits - 1)
    dn = np.random.default_rng(seed).integers(0, 2**bits, shape).astype(np.uint16 if bits <= 16 else np.uint32)
    return raw_of(dn, draw(st.floats(0, 0.9)) * white, white)


SETTINGS = st.builds(
    IspSettings,
    illuminant=st.sampled_from([None, illuminant("A"), illuminant("D65"), illuminant("FL11")]),
    white_balance=st.sampled_from(["illuminant", "gray_world", "white_patch", "none"]),
    demosaic=st.sampled_from(["bilinear", "malvar2004", "menon2007"]),
    white_patch_percentile=st.floats(1, 100),
    colour_matrix=st.builds(
        ColourMatrixFit, method=st.sampled_from(["least_squares", "noise_aware"]), noise_fraction=st.floats(0, 1)
    ),
    tone=st.builds(
        ToneCurve,
        curve=st.sampled_from(["srgb", "linear", "gamma", "filmic", "s_curve"]),
        exposure_ev=st.floats(-20, 20),
        black_point=st.floats(0, 0.99),
        gamma=st.floats(0.1, 10),
        contrast=st.floats(0.1, 10),
        pivot=st.floats(0.001, 0.999),
    ),
)


@settings(max_examples=150, deadline=None)
@given(raw=raws(), isp=SETTINGS)
def test_any_raw_image_becomes_a_picture_with_finite_gains(raw: RawImage, isp: IspSettings) -> None:
    before = raw.dn.copy()
    with np.errstate(all="raise", under="ignore"):
        picture = develop(raw, isp)
    np.testing.assert_array_equal(raw.dn, before)
    assert picture.rgb.shape == (*raw.dn.shape, 3)
    assert np.all(np.isfinite(picture.channel_gain_ratio))
    assert np.all(picture.channel_gain_ratio >= 1.0)
    assert picture.colour_matrix is not None
    assert np.all(np.isfinite(picture.colour_matrix))


@pytest.mark.parametrize("level", [0, 64, 65, 1023])
@pytest.mark.parametrize("white_balance", ["illuminant", "gray_world", "white_patch", "none"])
def test_even_pictures_have_finite_gains_at_both_ends_of_the_scale(level: int, white_balance: Any) -> None:
    raw = raw_of(np.full((6, 6), level, np.uint16), 64.0, 1023.0)
    gains = calibrate(raw, IspSettings(illuminant("A"), white_balance)).channel_gain_ratio
    assert all(math.isfinite(value) and value >= 1.0 for value in gains)
