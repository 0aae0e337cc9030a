"""ISETCam's numbers for the parts of the sensor where its model and the physical one coincide."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.sensor import ColorFilterArray, OpticalImage, sensor
from fullwell.sensor.adc import quantise
from fullwell.sensor.amplifier import amplify
from fullwell.sensor.cfa import mosaic
from fullwell.sensor.quantum_efficiency import integrate_bands
from fullwell.sensor.sampling import pixel_sampling
from fullwell.sensor.tables import read_table

GOLDEN_TOLERANCE = 1e-9
"""Relative; the promise for ISETCam's numbers. Sums run in another order there."""

TABLE_TOLERANCE = 1e-10
"""Relative; the table beside the catalogue has 12 digits."""


def test_coinciding_grids_give_isetcams_volts_per_pixel(reference: Callable[[str], Any]) -> None:
    """Spectral integration, colour filter array, fill factor, area, time and conversion gain, with the noise left out."""
    case = reference("isetcam/sensor_regrid.json")["cases"][0]
    assert case["kernel_rows_cols"] == [1, 1]
    rows, cols = case["oi_rows_cols"]
    r, c, k = np.meshgrid(np.arange(rows) + 1, np.arange(cols) + 1, np.arange(3) + 1, indexing="ij")
    irradiance = 1e16 * (1 + 0.4 * np.sin(0.9 * c * k / 2 + 0.3 * r) + 0.2 * np.mod(r * c, k + 2) / 3)
    efficiency = np.array(case["qe_at_wave"])
    efficiency = efficiency.T if efficiency.shape[0] == 3 else efficiency
    half = Spectrum.constant(0.5)
    cfa = ColorFilterArray((("R", "G"), ("G", "B")), (("R", half), ("G", half), ("B", half)))
    optical = OpticalImage(np.zeros((rows, cols, 3), np.float32), WavelengthGrid(450, 650, 100), case["oi_spacing_m"][0])
    sampling = pixel_sampling(
        optical,
        rows=case["sensor_rows_cols"][0],
        cols=case["sensor_rows_cols"][1],
        pixel_pitch_m=case["pixel_pitch_m"],
        fill_factor=case["fill_factor"],
    )
    currents = integrate_bands(irradiance, efficiency, bandwidth_nm=case["bin_width_nm"])
    electrons = mosaic(currents, cfa, sampling) * case["pixel_pitch_m"] ** 2 * case["fill_factor"] * case["exposure_time_s"]
    np.testing.assert_allclose(electrons * case["conversion_gain_V_per_e"], case["volts"], rtol=GOLDEN_TOLERANCE)


def test_a_uniform_scene_gives_isetcams_volts_at_the_centre(reference: Callable[[str], Any]) -> None:
    data = reference("isetcam/sensor_noise_free.json")
    irradiance, wave = np.array(data["oi_center_photons"]), np.array(data["wave_nm"])
    checked = 0
    for case in data["cases"]:
        if "spectral_qe_filters_x_wave" not in case or case["center_block_volts_2x2"][0][0] >= 0.999 * case["voltage_swing_V"]:
            continue
        efficiency = np.atleast_2d(np.array(case["spectral_qe_filters_x_wave"]))
        light = np.interp(case["wave_nm"], wave, irradiance, left=0.0, right=0.0)
        area_m2 = case["pixel_pitch_m"][0] * case["pixel_pitch_m"][1]
        electrons = efficiency @ light * 10.0 * area_m2 * case["fill_factor"] * case["exposure_time_s"]
        volts = amplify(
            electrons * case["conversion_gain_V_per_e"],
            analog_gain_ratio=1 / case["analog_gain"],
            analog_offset_v=case["analog_offset_V"] / case["analog_gain"],
        )
        expected = np.array(case["center_block_volts_2x2"])
        pattern = np.array(case["cfa_pattern"]).reshape(-1, 2) if np.ndim(case["cfa_pattern"]) else np.full((2, 2), 1)
        origin = np.array(case["center_block_origin_rc_1based"]) - 1
        shifted = np.roll(pattern, -(origin % 2), axis=(0, 1))
        np.testing.assert_allclose(np.minimum(volts, case["voltage_swing_V"])[shifted - 1], expected, rtol=GOLDEN_TOLERANCE)
        checked += 1
    assert checked == 9


def test_gain_offset_and_clipping_give_isetcams_volts(reference: Callable[[str], Any]) -> None:
    """ISETCam divides by its gain after adding the offset: our ratio is its reciprocal, our offset its offset over it."""
    for case in reference("isetcam/sensor_clipping_quantisation.json")["cases"]:
        swing = case["voltage_swing_V"]
        pixel_v = np.array(case["input_volts_fraction_of_swing"]) * swing
        gain = case["analog_gain"]
        found = amplify(pixel_v, analog_gain_ratio=1 / gain, analog_offset_v=case["analog_offset_V"] / gain)
        np.testing.assert_allclose(np.clip(found, 0, swing), case["output_volts"], rtol=GOLDEN_TOLERANCE, atol=1e-15)


def test_the_imx363_table_is_the_published_one(reference: Callable[[str], Any]) -> None:
    spectra = reference("isetcam/spectra.json")
    wavelength_nm, columns = read_table("imx363.csv")
    np.testing.assert_array_equal(wavelength_nm, spectra["imx363_wave_nm"])
    np.testing.assert_allclose(columns[:, :3].T, spectra["imx363_filter_spectra"], rtol=TABLE_TOLERANCE)
    np.testing.assert_allclose(columns[:, 3], spectra["imx363_ir_filter"], rtol=TABLE_TOLERANCE)
    vendor = np.array(spectra["imx363_spectral_qe"])
    correction = np.array([[0.56, 0.08, 0.01], [0.0, 0.59, 0.0], [0.0, 0.25, 0.71]])
    inside = slice(1, -1)  # ISETCam's own photodetector curve ends within 390-710 nm, so it has 0 at the two ends
    for k, (_, efficiency) in enumerate(sensor("imx363").cfa.channels):
        expected = correction[:, k] @ vendor
        np.testing.assert_allclose(efficiency.values[inside], expected[inside], rtol=GOLDEN_TOLERANCE)


def test_our_full_scale_lies_one_code_below_isetcams(reference: Callable[[str], Any]) -> None:
    cases = [
        case
        for case in reference("isetcam/sensor_clipping_quantisation.json")["cases"]
        if case["quantization"][0].isdigit() and max(case["output_volts"]) == case["voltage_swing_V"]
    ]
    assert cases
    for case in cases:
        bits = int(case["quantization"].split()[0])
        ours = quantise(np.array(case["output_volts"]), voltage_swing_v=case["voltage_swing_V"], adc_bits=bits)
        assert (max(ours), max(case["output_dv"])) == (2**bits - 1, 2**bits)
