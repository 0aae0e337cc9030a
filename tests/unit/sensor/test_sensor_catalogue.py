"""The sensors that have names."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError, digest_of
from fullwell.radiometry import DEFAULT_GRID, WavelengthGrid, band_photons, colour_matching_functions, illuminant
from fullwell.sensor import sensor, sensor_names
from fullwell.sensor.quantum_efficiency import band_quantum_efficiency

LUTHER_TOLERANCE = 1e-4
"""Relative; band means of a product against the product of band means, over 1 nm."""


@pytest.mark.parametrize("name", sensor_names())
def test_every_sensor_can_be_made_and_has_a_digest(name: str) -> None:
    model = sensor(name)
    assert model.name == name
    assert len(digest_of(model)) == 64
    efficiency = band_quantum_efficiency(model.cfa, DEFAULT_GRID)
    assert np.all((efficiency >= 0) & (efficiency <= 1))
    assert np.all(np.max(efficiency, axis=0) > 0.2)


def test_case_does_not_matter() -> None:
    assert sensor("IMX363") is sensor("imx363")


def test_an_unknown_sensor_is_answered_with_the_nearest() -> None:
    with pytest.raises(FieldError, match="did you mean 'imx363'") as caught:
        sensor("imx636", path="cameras[0].sensors[0].model")
    assert caught.value.path == "cameras[0].sensors[0].model"


def test_the_imx363_has_its_published_figures() -> None:
    model = sensor("imx363")
    assert (model.rows, model.cols, model.pixel_pitch_m, model.adc_bits) == (3024, 4032, 1.4e-6, 10)
    assert model.well_capacity_e * model.conversion_gain_v_per_e == pytest.approx(0.459)
    assert model.read_noise_e * model.conversion_gain_v_per_e == pytest.approx(5e-3)
    assert (model.prnu_fraction, model.dsnu_v, model.dark_current_e_per_s) == (0.019, 0.64e-3, 0.0)


def test_the_ideal_colour_sensor_sees_as_the_standard_observer() -> None:
    """Its electrons are proportional to X, Y, Z of any light."""
    grid = WavelengthGrid(380.0, 780.0, 1.0)
    efficiency = band_quantum_efficiency(sensor("ideal-rgb").cfa, grid)
    observer = np.stack([curve.band_average(grid) for curve in colour_matching_functions()], axis=1)
    ratios = []
    for name in ("A", "D65", "E", "FL2"):
        light = illuminant(name)
        ratios.append((band_photons(light, grid) @ efficiency) / (light.band_average(grid) @ observer))
    np.testing.assert_allclose(ratios / ratios[0], 1.0, rtol=LUTHER_TOLERANCE)
