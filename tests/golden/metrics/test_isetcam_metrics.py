"""ISETCam's metrics on explicit inputs, by `fullwell.metrics.isetcam` and, where the definitions agree, by the default."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.special import erf

from fullwell import metrics
from fullwell.metrics import isetcam

GOLDEN_TOLERANCE = 1e-9
"""Relative; the promise for ISETCam's numbers."""

DARK_TIME_S = 0.01
"""The exposure of the dynamic range cases (the file does not say; both figures follow from it to the last digit)."""


def test_lab_and_the_three_colour_differences_are_isetcams(reference: Callable[[str], Any]) -> None:
    data = reference("isetcam/metrics_color.json")
    one, two = (isetcam.xyz_to_lab(data[name], data["white"]) for name in ("xyz1", "xyz2"))
    np.testing.assert_allclose(one, data["lab1_old"], rtol=GOLDEN_TOLERANCE, atol=1e-12)
    np.testing.assert_allclose(metrics.delta_e_1976(one, two), data["deltaE1976"], rtol=GOLDEN_TOLERANCE)
    np.testing.assert_allclose(metrics.delta_e_1994(one, two), data["deltaE1994"], rtol=GOLDEN_TOLERANCE)
    np.testing.assert_allclose(metrics.delta_e_2000(one, two), data["deltaE2000"], rtol=GOLDEN_TOLERANCE)


def test_exact_lab_differs_from_isetcams_only_by_its_rounded_constants(reference: Callable[[str], Any]) -> None:
    data = reference("isetcam/metrics_color.json")
    ours = metrics.xyz_to_lab(data["xyz1"], data["white"])
    bright = np.array(data["xyz1"])[:, 1] > 1  # above the linear part the constants do not enter
    np.testing.assert_allclose(ours[bright, 0], np.array(data["lab1_makecform"])[bright, 0], rtol=GOLDEN_TOLERANCE)
    rounded_constants = 2e-4  # 7.787 for 841/108 and 0.008856 for 216/24389, times 500
    np.testing.assert_allclose(ours, data["lab1_makecform"], rtol=0, atol=rounded_constants)


def test_the_sensors_snr_is_isetcams(reference: Callable[[str], Any]) -> None:
    case = reference("isetcam/metrics_color.json")["sensor_snr"]
    gain = case["conv_gain"]
    parameters = {"read_noise_v": case["read_V"], "dsnu_v": case["dsnu_V"], "prnu_fraction": case["prnu_percent"] / 100}
    found = isetcam.sensor_snr_db(case["volts"], conversion_gain_v_per_e=gain, **parameters)
    np.testing.assert_allclose(found, case["snr_dB"], rtol=GOLDEN_TOLERANCE)
    ours = metrics.snr_ratio(
        np.array(case["volts"]) / gain, read_noise_e=case["read_V"] / gain, dsnu_e=case["dsnu_V"] / gain, prnu_fraction=0.01
    )
    np.testing.assert_allclose([metrics.decibels(ratio) for ratio in ours], case["snr_dB"], rtol=GOLDEN_TOLERANCE)
    for name, term in (("shot", {}), ("read", {"read_noise_e": 10.0}), ("dsnu", {"dsnu_e": 10.0}), ("prnu", {})):
        electrons = np.array(case["volts"]) / gain
        noise = {"shot": np.sqrt(electrons), "prnu": 0.01 * electrons}.get(name, np.array(list(term.values()) or [1.0]))
        np.testing.assert_allclose(20 * np.log10(electrons / noise), case[name], rtol=GOLDEN_TOLERANCE)


def test_the_dynamic_ranges_are_isetcams(reference: Callable[[str], Any]) -> None:
    data = reference("isetcam/metrics_color.json")
    dark = {"voltage_swing_v": 1.0, "dark_voltage_v_per_s": 1e-3, "exposure_time_s": DARK_TIME_S, "read_noise_v": 1e-3}
    sensor = isetcam.sensor_dynamic_range_db(**dark, conversion_gain_v_per_e=1e-4, dsnu_v=1e-3)
    assert sensor == pytest.approx(data["sensor_dr_dB"], rel=GOLDEN_TOLERANCE)
    assert isetcam.pixel_dynamic_range_db(**dark) == pytest.approx(data["pixel_dr_dB"], rel=GOLDEN_TOLERANCE)


def test_slanted_edges_of_a_formula_have_isetcams_mtf(reference: Callable[[str], Any]) -> None:
    for case in reference("isetcam/metrics_iso12233_synthetic.json")["cases"]:
        found = isetcam.iso12233(_formula_edge(case), pixel_pitch_mm=case["delta_x_mm"])
        np.testing.assert_allclose(found.frequency_cycles_per_mm, case["freq_cyc_mm"], rtol=GOLDEN_TOLERANCE)
        np.testing.assert_allclose(found.mtf, case["mtf_lum"], rtol=GOLDEN_TOLERANCE)
        assert found.nyquist_cycles_per_mm == pytest.approx(case["nyquist"], rel=GOLDEN_TOLERANCE)
        assert found.mtf50_cycles_per_mm == pytest.approx(case["mtf50"], rel=GOLDEN_TOLERANCE)
        assert found.aliasing_percent == pytest.approx(case["aliasing_percent"], rel=GOLDEN_TOLERANCE)


def test_the_default_edge_response_finds_the_analytic_mtf50_that_isetcam_misses(reference: Callable[[str], Any]) -> None:
    for case in reference("isetcam/metrics_iso12233_synthetic.json")["cases"]:
        # The formula's sigma lies along the row; along the edge's normal the blur is narrower by the cosine.
        response = metrics.edge_sfr(_formula_edge(case))
        analytic = case["analytic_mtf50_no_correction_cyc_mm"] * np.hypot(1, case["slope_dx_per_dy"])
        ours = (response.mtf50_cycles_per_px or np.nan) / case["delta_x_mm"]
        assert ours == pytest.approx(analytic, rel=0.005), "half a per cent of frequency: 0.005 of MTF"
        assert abs(ours - analytic) < abs(case["mtf50"] - analytic)


def test_s_cielab_filters_and_differences_are_isetcams(reference: Callable[[str], Any]) -> None:
    data = reference("isetcam/metrics_scielab.json")
    per_degree = isetcam.samples_per_degree(dots_per_inch=data["dpi"], distance_m=data["dist_m"])
    assert per_degree == data["samp_per_deg"]
    kernels = isetcam.s_cielab_filters(samples_per_degree=per_degree, filter_size=data["filter_size"])
    for number, kernel in enumerate(kernels, 1):
        np.testing.assert_allclose(kernel[kernel.shape[0] // 2], data[f"filter{number}_center_row"], rtol=GOLDEN_TOLERANCE)
    one, two = _formula_pictures(data["n"])
    found = isetcam.s_cielab_difference(one, two, data["white"], samples_per_degree=per_degree, observer=2)
    middle_row = 22
    np.testing.assert_allclose(found[middle_row], data["map_center_row"], rtol=GOLDEN_TOLERANCE)
    assert found.mean() == pytest.approx(data["mean_scielab_dE2000"], rel=GOLDEN_TOLERANCE)
    labs = [isetcam.xyz_to_lab(picture, data["white"]) for picture in (one, two)]
    assert metrics.delta_e_2000(*labs).mean() == pytest.approx(data["mean_pointwise_dE2000"], rel=GOLDEN_TOLERANCE)


def test_exposure_values_and_photometric_exposure_are_isetcams(reference: Callable[[str], Any]) -> None:
    data = reference("isetcam/exposure.json")
    case = data["exposure_value"]
    found = [metrics.exposure_value(f_number=f, exposure_time_s=t) for f, t in zip(case["f"], case["t"], strict=True)]
    np.testing.assert_allclose(found, case["EV"], rtol=GOLDEN_TOLERANCE)
    own = metrics.exposure_value(f_number=4.0, exposure_time_s=0.01)
    assert own == pytest.approx(data["EV_code"], rel=GOLDEN_TOLERANCE)
    lux_s = metrics.photometric_exposure_lux_s(data["mean_illuminance"], exposure_time_s=0.01)
    assert lux_s == pytest.approx(data["photometric_exposure_lux_s"], rel=GOLDEN_TOLERANCE)


def _formula_edge(case: dict[str, Any]) -> np.ndarray:
    rows, cols = case["rows_cols"]
    row, col = np.mgrid[:rows, :cols]
    across = (col - (cols - 1) / 2) - case["slope_dx_per_dy"] * (row - (rows - 1) / 2)
    return np.asarray(0.1 + 0.8 * 0.5 * (1 + erf(across / (case["sigma_px"] * np.sqrt(2)))))


def _formula_pictures(size: int) -> tuple[np.ndarray, np.ndarray]:
    row, col, plane = np.mgrid[1 : size + 1, 1 : size + 1, 1:4]
    base = np.array([40.0, 42.0, 45.0])
    wave = 1 + 0.3 * np.sin(2 * np.pi * col / 6)
    return base * wave, base * (wave + 0.05 * np.cos(2 * np.pi * row / 8) * (plane - 2))
