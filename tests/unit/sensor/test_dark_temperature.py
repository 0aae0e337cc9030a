"""Dark current follows the temperature."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from fullwell.core import FieldError
from fullwell.sensor import ArrheniusLaw, DoublingLaw, sensor, thermal_reset_noise_e
from fullwell.sensor.dark_current import temperature_ratio
from fullwell.sensor.hot_pixels import mean_dark_current

ROUNDING = 1e-12
"""Relative; a few operations in double precision."""


def test_the_dark_current_doubles_with_the_doubling_temperature() -> None:
    camera = replace(sensor("ideal-mono"), dark_current_e_per_s=3.0, dark_reference_temperature_k=300.0)
    for steps in (-3, 0, 1, 4):
        warm = replace(camera, temperature_k=300.0 + 6.0 * steps, dark_current_law=DoublingLaw(6.0))
        assert mean_dark_current(warm) == pytest.approx(3.0 * 2.0**steps, rel=ROUNDING)


def test_arrhenius_halves_the_band_gap_to_a_doubling_within_nine_kelvin() -> None:
    """d ln I / dT = E / k T^2, so at 300 K and 0.56 eV the current doubles within ln 2 x 8.617e-5 x 300^2 / 0.56 = 9.6 K."""
    law = ArrheniusLaw(0.56)
    small_k = 1e-3
    ratio = temperature_ratio(law, temperature_k=300.0 + small_k, reference_temperature_k=300.0)
    assert math.log(2) / (math.log(ratio) / small_k) == pytest.approx(9.6, abs=0.01)
    assert temperature_ratio(law, temperature_k=310.0, reference_temperature_k=310.0) == 1.0


def test_reset_noise_is_the_root_of_ktc() -> None:
    """50 uV/e- is 3.204 fF; k T C at 300 K is 1.3272e-35 C^2, whose root is 22.74 e-."""
    assert thermal_reset_noise_e(conversion_gain_v_per_e=50e-6, temperature_k=300.0) == pytest.approx(22.74, abs=0.01)


@pytest.mark.parametrize("make", [lambda: DoublingLaw(0.0), lambda: ArrheniusLaw(-1.0), lambda: DoublingLaw(math.nan)])
def test_an_impossible_law_is_refused(make: object) -> None:
    with pytest.raises(FieldError):
        make()  # type: ignore[operator]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("temperature_k", 0.0),
        ("dcnu_fraction", -0.1),
        ("hot_pixel_fraction", 1.5),
        ("row_noise_v", math.inf),
        ("line_time_s", -1e-6),
        ("readout_sampling", "double"),
        ("combination", "best"),
        ("array_rows", -1),
    ],
)
def test_an_impossible_number_names_its_field(field: str, value: object) -> None:
    with pytest.raises(FieldError) as caught:
        replace(sensor("ideal-mono"), **{field: value})
    assert caught.value.path == field
