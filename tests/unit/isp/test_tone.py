"""Black level and sRGB encoding."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.isp.black_level import linear_signal
from fullwell.isp.parameters import ToneCurve
from fullwell.isp.tone import apply_tone, encode_srgb, encode_tone
from fullwell.radiometry import Spectrum, WavelengthGrid, linear_to_srgb
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


CURVES = [
    ToneCurve("srgb"),
    ToneCurve("linear"),
    ToneCurve("gamma", gamma=1.8),
    ToneCurve("filmic", exposure_ev=3.0),
    ToneCurve("filmic", exposure_ev=-1.0),
    ToneCurve("s_curve", contrast=2.0, pivot=0.4),
    ToneCurve("s_curve", contrast=0.5),
    ToneCurve("srgb", exposure_ev=2.0, black_point=0.05),
]


@pytest.mark.parametrize("tone", CURVES, ids=lambda tone: f"{tone.curve} {tone.exposure_ev:g} EV")
def test_every_curve_is_finite_within_0_to_1_and_grows_with_light(tone: ToneCurve) -> None:
    values = apply_tone(np.concatenate([[-1e6, -0.1], np.linspace(0, 1, 1001), [5.0, 1e6]]), tone)
    assert np.all(np.isfinite(values))
    assert values[0] == values[1] == 0.0
    assert np.max(values) <= 1.0
    assert np.all(np.diff(values) >= 0)


@pytest.mark.parametrize("tone", [tone for tone in CURVES if tone.exposure_ev >= 0], ids=lambda tone: tone.curve)
def test_the_saturation_level_is_display_white(tone: ToneCurve) -> None:
    assert encode_tone(np.array([1.0]), tone).tolist() == [255]


def test_gamma_and_linear_are_powers_of_the_light() -> None:
    light = np.array([0.01, 0.2, 0.7])
    np.testing.assert_allclose(apply_tone(light, ToneCurve("linear")), light, rtol=1e-15)
    np.testing.assert_allclose(apply_tone(light, ToneCurve("gamma", gamma=2.0)), np.sqrt(light), rtol=1e-15)


def test_exposure_doubles_the_light_and_the_black_point_becomes_black() -> None:
    light = np.array([0.1, 0.2])
    np.testing.assert_allclose(apply_tone(light, ToneCurve(exposure_ev=1.0)), apply_tone(2 * light, ToneCurve()), rtol=1e-12)
    assert apply_tone(np.array([0.1]), ToneCurve(black_point=0.1)).tolist() == [0.0]


def test_the_filmic_curve_brightens_shadows_by_its_exposure_and_keeps_highlights_apart() -> None:
    tone = ToneCurve("filmic", exposure_ev=3.0)
    np.testing.assert_allclose(apply_tone(np.array([1e-5]), tone), apply_tone(np.array([8e-5]), ToneCurve()), rtol=1e-3)
    bright = apply_tone(np.array([0.6, 0.8, 1.0]), tone)
    assert np.all(np.diff(bright) > 0.01)
    assert np.ptp(apply_tone(np.array([0.6, 0.8, 1.0]), ToneCurve(exposure_ev=3.0))) == 0.0


def test_the_s_curve_is_steepest_at_its_pivot_and_passes_through_it() -> None:
    tone = ToneCurve("s_curve", contrast=2.0, pivot=0.4)
    step = 1e-4
    encoded = np.array([0.0, 0.4 - step, 0.4, 0.4 + step, 1.0])
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    found = apply_tone(light, tone)
    np.testing.assert_allclose(found[[0, 2, 4]], [0.0, 0.4, 1.0], atol=1e-12)
    assert (found[3] - found[1]) / (2 * step) == pytest.approx(2.0, rel=1e-3)
    np.testing.assert_allclose(apply_tone(light, ToneCurve("s_curve", contrast=1.0)), linear_to_srgb(light), atol=1e-12)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"curve": "s-curve"}, "s_curve"),
        ({"gamma": 0.0}, "gamma"),
        ({"gamma": float("nan")}, "gamma"),
        ({"black_point": 1.0}, "black_point"),
        ({"contrast": -1.0}, "contrast"),
        ({"pivot": 0.0}, "pivot"),
        ({"exposure_ev": 100.0}, "exposure_ev"),
    ],
)
def test_an_impossible_curve_is_refused_by_name(change: dict[str, float], field: str) -> None:
    with pytest.raises(FieldError, match=field):
        ToneCurve(**change)  # type: ignore[arg-type]
