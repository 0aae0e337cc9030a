"""Named patterns, named channels, and filters before them."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.sensor import PATTERN_NAMES, cfa_pattern
from fullwell.sensor.channel_sets import CHANNEL_SET_NAMES, cfa_of, channel_set
from fullwell.sensor.filters import infrared_cut, with_filters
from fullwell.sensor.quantum_efficiency import band_quantum_efficiency

FILTER_TOLERANCE = 1e-5
"""Absolute; products of piecewise linear curves against a fine sum."""

WIDE = WavelengthGrid(400.0, 1000.0, 10.0)


@pytest.mark.parametrize("name", PATTERN_NAMES)
def test_every_named_pattern_can_be_made_of_the_representative_channels(name: str) -> None:
    array = cfa_of(cfa_pattern(name), channel_set("representative"))
    assert {channel for row in array.pattern for channel in row} == set(array.channel_names)


def test_the_four_bayer_orders_are_what_they_say() -> None:
    for name in ("rggb", "grbg", "gbrg", "bggr"):
        assert "".join(channel for row in cfa_pattern(name) for channel in row).lower() == name


def test_a_quad_pattern_repeats_each_channel_two_by_two() -> None:
    quad, single = cfa_pattern("quad-rggb"), cfa_pattern("rggb")
    assert all(quad[r][c] == single[r // 2][c // 2] for r in range(4) for c in range(4))


def test_an_unknown_pattern_or_channel_is_answered_with_the_nearest() -> None:
    with pytest.raises(FieldError, match="did you mean 'rccc'"):
        cfa_pattern("rcccc")
    with pytest.raises(FieldError, match="did you mean 'imx363'"):
        channel_set("imx36")
    with pytest.raises(FieldError, match="did you mean 'NIR'"):
        cfa_of((("NI",),), channel_set("representative"))


@pytest.mark.parametrize("name", CHANNEL_SET_NAMES)
def test_every_channel_is_an_efficiency(name: str) -> None:
    for curve in channel_set(name).values():
        assert np.all((curve.values >= 0) & (curve.values <= 1))
        assert curve.source


def test_no_colour_sees_more_than_clear() -> None:
    channels = channel_set("representative")
    wavelength_nm = np.arange(380.0, 1100.0, 5.0)
    for name in ("R", "G", "B", "Y", "Cy", "NIR"):
        assert np.all(channels[name].at(wavelength_nm) <= channels["C"].at(wavelength_nm) + 1e-12)


def test_silicon_absorbs_by_beers_law() -> None:
    """At 850 nm k = 3.4605e-3: 4 pi k / wavelength x 5 um = 0.2558, so 1 - exp(-0.2558) = 0.2257 of 0.68 is absorbed."""
    assert channel_set("representative")["W"].at(850.0) == pytest.approx(0.68 * 0.2257, abs=1e-4)


def test_an_infrared_cut_is_half_at_its_wavelength_and_as_wide_as_asked() -> None:
    cut = infrared_cut(650.0, width_nm=20.0)
    np.testing.assert_allclose(cut.at([640.0, 650.0, 660.0]), [0.9, 0.5, 0.1], atol=1e-3)


def test_filters_multiply_every_channel() -> None:
    array = cfa_of(cfa_pattern("rgb-nir"), channel_set("representative"))
    cut, grey = infrared_cut(700.0), Spectrum.constant(0.5)
    found = band_quantum_efficiency(with_filters(array, cut, grey), WIDE)
    nm = 395.05 + 0.1 * np.arange(6100)
    for k, (_, curve) in enumerate(array.channels):
        wanted = (curve.at(nm) * cut.at(nm) * 0.5).reshape(61, 100).mean(axis=1)
        np.testing.assert_allclose(found[:, k], wanted, atol=FILTER_TOLERANCE)
