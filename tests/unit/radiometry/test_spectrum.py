"""Spectra integrate exactly, with steps, spikes and holes where they are."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fullwell.core import FieldError, ShapeError
from fullwell.radiometry import Spectrum, WavelengthGrid, illuminant, reflectance

EXACT = 1e-12
"""Relative: closed forms, so only rounding is left."""
PRODUCT = 1e-6
"""Relative to the band, or to 1/1000 of the brightest band where that is more: what `times` promises."""


def test_the_band_average_of_a_ramp_is_its_value_at_the_centre() -> None:
    ramp = Spectrum(np.array([300.0, 1100.0]), np.array([0.0, 8.0]))
    grid = WavelengthGrid(380.0, 1000.0, 10.0)
    assert ramp.band_average(grid) == pytest.approx((grid.centres_nm - 300.0) / 100.0, rel=EXACT)


def test_a_triangle_within_one_band_is_not_lost() -> None:
    line = Spectrum(np.array([541.0, 542.0, 543.0]), np.array([0.0, 30.0, 0.0]), outside="zero")
    grid = WavelengthGrid(400.0, 700.0, 10.0)
    average = line.band_average(grid)
    assert average[14] == pytest.approx(3.0, rel=EXACT)
    assert np.count_nonzero(average) == 1


def test_a_triangle_across_an_edge_is_shared() -> None:
    line = Spectrum(np.array([543.0, 545.0, 547.0]), np.array([0.0, 10.0, 0.0]), outside="zero")
    shares = line.integral([535.0, 545.0, 546.0, 555.0])
    assert shares == pytest.approx([10.0, 7.5, 2.5], rel=EXACT)


def test_the_step_at_a_tables_end_counts_to_the_last_nanometre() -> None:
    box = Spectrum(np.array([500.0, 600.0]), np.array([2.0, 4.0]), outside="zero")
    assert box.integral([400.0, 500.0, 550.0, 600.0, 700.0]) == pytest.approx([0.0, 125.0, 175.0, 0.0], rel=EXACT)
    assert box.integral([490.0, 510.0, 595.0, 605.0]) == pytest.approx([21.0, 259.25, 19.75], rel=EXACT)
    assert box.integral([0.0, 2000.0]) == pytest.approx([300.0], rel=EXACT)


def test_held_ends_go_on() -> None:
    curve = Spectrum(np.array([500.0, 600.0]), np.array([2.0, 4.0]))
    assert curve.integral([400.0, 500.0, 600.0, 700.0]) == pytest.approx([200.0, 300.0, 400.0], rel=EXACT)
    assert Spectrum.constant(0.18).band_average(WavelengthGrid()) == pytest.approx(np.full(31, 0.18), rel=EXACT)


def test_a_dim_band_beside_a_bright_one_keeps_its_digits() -> None:
    steep = Spectrum(np.array([400.0, 410.0, 411.0, 500.0]), np.array([1e12, 1e12, 1e-6, 1e-6]))
    assert steep.integral([400.0, 410.0, 411.0, 420.0])[2] == pytest.approx(9e-6, rel=EXACT)


def test_integrals_need_increasing_edges() -> None:
    for edges in ([500.0, 400.0], [400.0, 400.0], [[400.0, 500.0]], [np.nan, 500.0], []):
        with pytest.raises(ShapeError, match="increasing"):
            Spectrum.constant(1.0).integral(edges)
    assert Spectrum.constant(1.0).integral([500.0]).shape == (0,)


curves = st.builds(
    lambda start, steps, values, outside: Spectrum(
        start + np.cumsum(steps[: len(values)]), np.array(values[: len(steps)]), outside=outside
    ),
    st.floats(350, 500),
    st.lists(st.floats(0.5, 60), min_size=8, max_size=8),
    st.lists(st.floats(0, 1), min_size=1, max_size=8),
    st.sampled_from(["zero", "hold"]),
)


@given(curves, curves)
@settings(max_examples=200, deadline=None)
def test_integrals_of_products_agree_with_a_fine_midpoint_sum(first: Spectrum, second: Spectrum) -> None:
    edges = np.array([380.0, 431.0, 555.0, 560.0, 900.0])
    cuts = np.unique(np.concatenate([edges, first.wavelength_nm, second.wavelength_nm]))
    cuts = cuts[(cuts >= edges[0]) & (cuts <= edges[-1])]
    # 64 midpoints in every smooth interval: the midpoint rule is wrong by h^3 f'' / 24 there.
    fine = np.concatenate([np.linspace(low, high, 65)[:-1] for low, high in itertools.pairwise(cuts)] + [edges[-1:]])
    middle = 0.5 * (fine[:-1] + fine[1:])
    pieces = first.at(middle) * second.at(middle) * np.diff(fine)
    expected = [pieces[(middle > low) & (middle < high)].sum() for low, high in itertools.pairwise(edges)]
    assert first.integral_of_product(second, edges) == pytest.approx(expected, rel=1e-3, abs=5e-3)
    assert first.integral_of_product(second, edges) == pytest.approx(second.integral_of_product(first, edges), rel=EXACT)
    whole = first.times(second).integral([300.0, 1200.0])
    assert whole == pytest.approx(first.integral_of_product(second, [300.0, 1200.0]), rel=1e-11, abs=1e-12)


def test_the_integral_of_a_product_of_ramps_is_a_third() -> None:
    up = Spectrum(np.array([0.0, 1.0]), np.array([0.0, 1.0]), outside="zero")
    down = Spectrum(np.array([0.0, 1.0]), np.array([1.0, 0.0]), outside="zero")
    assert up.integral_of_product(up, [-1.0, 2.0]) == pytest.approx([1 / 3], rel=EXACT)
    assert up.integral_of_product(down, [0.0, 0.5, 1.0]) == pytest.approx([1 / 12, 1 / 12], rel=EXACT)
    assert up.times(up).integral([0.0, 1.0]) == pytest.approx([1 / 3], rel=EXACT)
    assert up.times(down).integral([0.0, 1.0]) == pytest.approx([1 / 6], rel=EXACT)


@pytest.mark.parametrize("lamp", ["FL2", "FL11", "FL3.12", "HP1", "HP5", "LED-RGB1", "D65"])
@pytest.mark.parametrize("surface", ["colorchecker:blue", "cornell:red", "zigzag"])
@pytest.mark.parametrize("step_nm", [1.0, 3.7, 5.0, 10.0])
def test_products_with_spiky_lamps_are_right_in_every_band(lamp: str, surface: str, step_nm: float) -> None:
    source = illuminant(lamp)
    knots = np.arange(370.0, 800.0, 13.7)
    zigzag = Spectrum(knots, np.where(np.arange(knots.size) % 2, 0.9, 0.02))
    paint = zigzag if surface == "zigzag" else reflectance(surface)
    edges = np.arange(382.3, 778.0, step_nm)
    exact = source.integral_of_product(paint, edges)
    product = source.times(paint)
    scale = np.maximum(exact, 1e-3 * exact.max())
    assert np.max(np.abs(product.integral(edges) - exact) / scale) < PRODUCT
    assert product.values.min() >= 0.0
    assert product.wavelength_nm.size < 10_000  # the zigzag is as bad as it gets; measured paints need some 2000


def test_a_product_is_zero_where_the_tables_do_not_overlap() -> None:
    low = Spectrum(np.array([400.0, 500.0]), np.ones(2), outside="zero")
    high = Spectrum(np.array([600.0, 700.0]), np.ones(2), outside="zero")
    assert low.times(high).integral([300.0, 800.0]) == [0.0]
    assert low.times(high).outside == "zero"


def test_a_product_ends_where_a_source_ends_and_keeps_what_is_made_up() -> None:
    source = Spectrum(np.array([400.0, 500.0]), np.array([1.0, 3.0]), outside="zero", unit="W", source="lamp")
    paint = Spectrum(np.array([450.0, 480.0]), np.array([0.5, 0.5]), source="paint", upsampled=True)
    product = source.times(paint)
    assert product.integral([300.0, 600.0]) == pytest.approx([100.0], rel=EXACT)
    assert (product.unit, product.outside, product.upsampled) == ("W", "zero", True)
    assert product.source == "lamp x paint"


@pytest.mark.parametrize(
    ("wavelength_nm", "values", "error"),
    [
        ([], [], ShapeError),
        ([400.0, 500.0], [1.0], ShapeError),
        ([[400.0]], [[1.0]], ShapeError),
        ([500.0, 400.0], [1.0, 1.0], FieldError),
        ([400.0, 400.0], [1.0, 1.0], FieldError),
        ([400.0, np.inf], [1.0, 1.0], FieldError),
        ([400.0, 500.0], [1.0, np.nan], FieldError),
    ],
)
def test_tables_that_are_no_function_are_refused(wavelength_nm: object, values: object, error: type[Exception]) -> None:
    with pytest.raises(error):
        Spectrum(np.array(wavelength_nm), np.array(values))


def test_a_spectrum_cannot_be_changed_through_its_arrays() -> None:
    values = np.array([1.0, 2.0])
    spectrum = Spectrum(np.array([400.0, 500.0]), values)
    values[0] = 9.0
    assert spectrum.values[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        spectrum.values[0] = 9.0


def test_a_spectrum_can_be_sent_to_another_process() -> None:
    copied = pickle.loads(pickle.dumps(illuminant("FL11")))
    assert np.array_equal(copied.values, illuminant("FL11").values)
    assert copied.source == illuminant("FL11").source


@pytest.mark.parametrize(
    ("first", "last", "step", "field"),
    [
        (300.0, 700.0, 10.0, "first_nm"),
        (400.0, 1100.0, 10.0, "last_nm"),
        (700.0, 400.0, 10.0, "last_nm"),
        (400.0, 700.0, 0.0, "step_nm"),
        (400.0, 700.0, float("nan"), "step_nm"),
        (400.0, 400.0, float("inf"), "step_nm"),
        (400.0, 700.0, 1e-6, "step_nm"),
        (400.0, 700.0, 7.0, "step_nm"),
        (float("nan"), 700.0, 7.0, "first_nm"),
    ],
)
def test_grids_that_cannot_be_are_refused_by_field(first: float, last: float, step: float, field: str) -> None:
    with pytest.raises(FieldError) as caught:
        WavelengthGrid(first, last, step)
    assert caught.value.path == field


def test_a_grid_counts_its_bands_and_covers_them() -> None:
    grid = WavelengthGrid(400.0, 700.0, 10.0)
    assert grid.count == 31
    assert grid.centres_nm[[0, -1]].tolist() == [400.0, 700.0]
    assert grid.edges_nm[[0, -1]].tolist() == [395.0, 705.0]
    assert WavelengthGrid(550.0, 550.0, 10.0).count == 1
