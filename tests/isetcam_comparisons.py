"""Every reference file of ISETCam against the compatibility mode: how many values, and the largest difference.

Used by the golden tests and by docs/validation/isetcam_golden.py, which writes the table.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import erf

from fullwell import metrics
from fullwell.core import stream
from fullwell.isp.isetcam import demosaic, process_mosaic
from fullwell.metrics import isetcam as isetcam_metrics
from fullwell.optics.isetcam import (
    IsetcamLens,
    compute_irradiance,
    diffraction_psf,
    gaussian_otf_table,
    off_axis_map,
    radiance_to_irradiance_sr,
    transfer_function,
    wavefront_lens,
    wavefront_psf,
)
from fullwell.radiometry import isetcam as radiometry
from fullwell.scene.isetcam import IsetcamOpticalImage, IsetcamScene, with_illuminant
from fullwell.scene.isetcam_charts import (
    frequency_orientation_scene,
    harmonic_scene,
    macbeth_scene,
    point_array_scene,
    slanted_bar_scene,
    sweep_scene,
    uniform_scene,
)
from fullwell.sensor.isetcam import (
    BAYER_ORDERS,
    IsetcamSensor,
    auto_exposure_time_s,
    bayer_sensor,
    capture_volts,
    cfa_auto_exposure_times_s,
    imx363_sensor,
    monochrome_sensor,
    mt9v024_sensor,
    read_out_volts,
    sensor_a,
    sensor_b,
)

Reader = Callable[[str], Any]

GOLDEN_TOLERANCE = 1e-9
"""Relative, of every deterministic value: the promise for ISETCam's numbers."""

STANDARD_ERRORS = 4.0
"""Of every statistic of random values: the reference's own rule."""

DARK_FLOOR = 1e-6
"""Values below this share of their array's maximum are compared relative to it: a Fourier transform in double precision
rounds to a share of the maximum, and some values of the files are the rounding of a 0."""

SEED = 20210605


@dataclass
class Comparison:
    """What comparing one file gave.

    Attributes
    ----------
    values
        Deterministic values compared.
    largest
        Their largest relative difference.
    statistics
        Statistics of random values compared.
    most_errors
        Their largest difference in standard errors of the difference.
    """

    values: int = 0
    largest: float = 0.0
    statistics: int = 0
    most_errors: float = 0.0
    worst: str = field(default="", repr=False)
    worst_statistic: str = field(default="", repr=False)

    def same(self, found: ArrayLike, expected: ArrayLike, name: str = "") -> None:
        """Compare deterministic values; "nan" in the file must be NaN here."""
        ours, theirs = np.asarray(found, dtype=np.float64), np.asarray(expected, dtype=np.float64)
        theirs = theirs.reshape(ours.shape)
        finite = np.isfinite(theirs)
        assert np.array_equal(finite, np.isfinite(ours)), name
        ours, theirs = ours[finite], theirs[finite]
        scale = np.maximum(np.abs(theirs), DARK_FLOOR * np.max(np.abs(theirs), initial=0.0))
        difference = np.divide(np.abs(ours - theirs), scale, out=np.where(ours == theirs, 0.0, np.inf), where=scale > 0)
        self.values += theirs.size
        largest = float(np.max(difference, initial=0.0))
        if largest > self.largest:
            self.largest, self.worst = largest, name

    def alike(self, found: float, expected: float, *, standard_error: float, name: str = "") -> None:
        """Compare a statistic; `standard_error` is that of the difference, both sides' sampling included."""
        self.statistics += 1
        errors = abs(found - expected) / standard_error
        if errors > self.most_errors:
            self.most_errors, self.worst_statistic = errors, name


def _rng(*names: str | int) -> np.random.Generator:
    return stream(SEED, "isetcam", *names)


# Scene -------------------------------------------------------------------------------------------------------------------


def spectra(read: Reader) -> Comparison:
    data, result = read("isetcam/spectra.json"), Comparison()
    wave = np.array(data["wave_nm"], dtype=np.float64)
    xyz = radiometry.observer_xyz(wave)
    result.same(xyz, data["xyz_cmf_energy"], "observer")
    result.same(xyz[:, 1], data["V_lambda"], "V")
    result.same(radiometry.photons_to_energy(xyz.T, wave).T, data["xyz_cmf_quanta"], "observer for photons")
    names = {"illuminantA": "A", "equalEnergy": "equal energy", "equalPhotons": "equal photons"}
    for key, values in data.items():
        if key.startswith("illuminant_relative_energy_") and not key.endswith("illuminantC"):
            name = key.removeprefix("illuminant_relative_energy_")
            light = radiometry.photons_to_energy(radiometry.illuminant_photons(names.get(name, name), wave), wave)
            # Only the shape counts: every scene is scaled to its luminance.
            result.same(light / light[16], np.array(values) / values[16], name)
    down_columns = [6 * row + col for col in range(6) for row in range(4)]
    result.same(radiometry.macbeth_reflectances(wave)[down_columns], data["macbeth_reflectance_24xW"], "macbeth")
    result.same(radiometry.display_primaries(wave).T, data["display_lcdExample_rgb_spd"], "display")
    for sensor, key in (
        ("default", "filters_RGB_transmittance"),
        ("imx363", "imx363_spectral_qe"),
        ("mt9v024", "mt9v024_spectral_qe"),
    ):
        result.same(radiometry.sensor_curves(sensor)[1].T, data[key], key)
    ends = radiometry.illuminant_photons("D65", data["interp_check"]["wave_nm"])
    found = radiometry.photons_to_energy(ends, data["interp_check"]["wave_nm"])
    middle = radiometry.photons_to_energy(radiometry.illuminant_photons("D65", wave), wave)[16]
    result.same(
        found / middle, np.array(data["interp_check"]["D65"]) / data["illuminant_relative_energy_D65"][16], "D65 between"
    )
    result.same(radiometry.observer_xyz(data["interp_check"]["wave_nm"])[:, 1], data["interp_check"]["V_lambda"], "V between")
    constants = data["constants"]
    for name, value in (
        ("h_J_s", radiometry.PLANCK_1973_J_S),
        ("c_m_s", radiometry.SPEED_OF_LIGHT_M_PER_S),
        ("q_C", radiometry.ELEMENTARY_CHARGE_1986_C),
        ("luminous_efficacy_lm_W", radiometry.LUMINOUS_EFFICACY_LM_PER_W),
    ):
        result.same(value, constants[name], name)
    return result


def scene_uniform(read: Reader) -> Comparison:
    result = Comparison()
    lights = {"d65": "D65", "ee": "equal energy", "ephoton": "equal photons", "bb": "blackbody:3200"}
    for case in read("isetcam/scene_uniform.json")["cases"]:
        scene = uniform_scene(case["args"][0], illuminant=lights[case["type"].split()[1]])
        result.same(scene.photons[3, 5], case["radiance_photons_per_band"], case["type"])
        result.same(radiometry.photons_to_energy(scene.photons[0, 0], scene.wavelength_nm), case["radiance_energy_per_band"])
        result.same(scene.illuminant_photons, case["illuminant_photons"])
        result.same(radiometry.photons_to_energy(scene.illuminant_photons, scene.wavelength_nm), case["illuminant_energy"])
        result.same(scene.xyz[0, 0], case["xyz"])
        geometry = [scene.mean_luminance_cd_m2, scene.width_m, scene.height_m, scene.vfov_deg]
        names = ("mean_luminance_cd_m2", "width_m", "height_m", "vfov_deg")
        result.same(geometry, [case[name] for name in names], "geometry")
        result.same(radiometry.bin_width_nm(scene.wavelength_nm), case["bin_width_nm"])
    return result


def scene_macbeth(read: Reader) -> Comparison:
    data, result = read("isetcam/scene_macbeth.json"), Comparison()
    for case, light in zip(data["cases"], ("D65", "Tungsten"), strict=True):
        scene = macbeth_scene(case["patch_px"], illuminant=light)
        middle = slice(case["patch_px"] // 2, None, case["patch_px"])
        result.same(scene.photons[middle, middle].reshape(24, -1), case["patch_photons_24xW"], "patches")
        result.same(scene.xyz[middle, middle].reshape(24, 3), case["patch_xyz"], "xyz")
        result.same(scene.luminance_cd_m2[middle, middle].ravel(), case["patch_luminance_cd_m2"], "luminance")
        result.same(scene.illuminant_photons, case["illuminant_photons"])
        result.same(radiometry.photons_to_energy(scene.illuminant_photons, scene.wavelength_nm), case["illuminant_energy"])
        result.same(scene.photons[0, 0] / scene.illuminant_photons, case["reflectance_recovered_patch1"], "reflectance")
        result.same([scene.mean_luminance_cd_m2, scene.vfov_deg], [case["mean_luminance_cd_m2"], case["vfov_deg"]])
    swap = data["illuminant_swap"]
    scene = macbeth_scene()
    scene = with_illuminant(scene, radiometry.illuminant_photons("Tungsten", scene.wavelength_nm))
    result.same(scene.illuminant_photons, swap["illuminant_photons"], "swap")
    found = [scene.mean_luminance_cd_m2, scene.luminance_cd_m2[-1, 0], scene.luminance_cd_m2[0, 0]]
    result.same(found, [swap["mean_luminance"], swap["patch_luminance_r4c1_white"], swap["patch_luminance_r1c1"]], "swap")
    return result


def scene_targets(read: Reader) -> Comparison:
    data, result = read("isetcam/scene_targets.json"), Comparison()
    case, scene = data["slanted_bar"], slanted_bar_scene(32)
    luminance = scene.luminance_cd_m2
    white = luminance > 1
    result.same(np.sum(white, axis=1), case["n_white_per_row"], "bar")
    result.same(np.where(np.any(white, axis=0), np.argmax(white, axis=0) + 1, 0), case["first_white_row_1based_per_col"], "bar")
    found = [luminance.max(), luminance.min(), scene.hfov_deg, scene.mean_luminance_cd_m2]
    result.same(found, [case[name] for name in ("lum_white", "lum_black", "hfov", "mean_luminance")], "bar")
    case, scene = data["point_array"], point_array_scene(32, 8)
    luminance = scene.luminance_cd_m2
    points = np.argwhere(luminance.T > 0)[:, ::-1] + 1
    result.same(points, case["points_row_col_1based"], "points")
    result.same([luminance.max(), luminance.min(), scene.hfov_deg], [case[name] for name in ("lum_point", "lum_bg", "hfov")])
    case, luminance = data["freq_orient"], frequency_orientation_scene().luminance_cd_m2
    result.same(luminance[4], case["row_5_luminance"], "frequencies")
    result.same(luminance[:, 4], case["col_5_luminance"], "orientations")
    result.same([luminance.mean(), luminance.min(), luminance.max()], [case[name] for name in ("mean_lum", "min", "max")])
    case, luminance = data["sweep"], sweep_scene(data["sweep"]["args"]).luminance_cd_m2
    result.same(luminance[0], case["row_first"], "sweep")
    result.same(luminance[15], case["row_mid"], "sweep")
    case, given = data["harmonic"], data["harmonic"]["params"]
    luminance = harmonic_scene(
        frequencies=given["freq"],
        contrasts=given["contrast"],
        phases_rad=given["ph"],
        angles_rad=given["ang"],
        rows=given["row"],
        cols=given["col"],
    ).luminance_cd_m2
    result.same(luminance[7], case["row_8"], "harmonic")
    result.same(luminance[:, 7], case["col_8"], "harmonic")
    result.same(luminance.mean(), case["mean"])
    return result


# Optics ------------------------------------------------------------------------------------------------------------------


def oi_diffraction(read: Reader) -> Comparison:
    result = Comparison()
    for case in read("isetcam/oi_diffraction.json")["cases"]:
        scene = uniform_scene(
            tuple(case["scene_rows_cols"]),
            hfov_deg=case["hfov_deg_scene"],
            distance_m=case["distance_m"],
            luminance_cd_m2=case["luminance_cd_m2"],
        )
        lens = IsetcamLens(f_number=case["f_number"], focal_length_m=case["focal_length_m"])
        image = compute_irradiance(scene, lens)
        magnification = lens.magnification(scene.distance_m)
        factor = radiance_to_irradiance_sr(lens.f_number, magnification)
        result.same(scene.photons[0, 0], case["scene_photons"])
        on_axis = scene.photons[0, 0] * factor
        result.same(on_axis, case["irradiance_photons_on_axis_before_cos4_and_otf"], "camera equation")
        result.same([magnification, image.image_distance_m, factor], [
            case[name] for name in ("magnification", "image_distance_m", "radiance_to_irradiance_factor")
        ])  # fmt: skip
        falloff = off_axis_map(
            rows=scene.rows,
            cols=scene.cols,
            hfov_deg=scene.hfov_deg,
            image_distance_m=lens.focal_length_m,
            f_number=lens.f_number,
            magnification=magnification,
        )
        result.same(falloff, case["cos4_map"], "cos4")
        row, col = (index - 1 for index in case["center_rc_1based"])
        corner_row, corner_col = (index - 1 for index in case["corner_in_scene_rc_1based"])
        result.same(image.photons[row, col], case["photons_center"], "centre")
        result.same(image.photons[corner_row, corner_col], case["photons_corner_in_scene"], "corner")
        result.same(image.photons[0, 0], case["photons_pad_corner_1_1"], "border")
        result.same(image.photons[row, :, 15], case["photons_550nm_center_row"], "row")
        illuminance = image.illuminance_lux
        result.same(illuminance[row], case["illuminance_center_row"], "lux")
        found = [illuminance[row, col], illuminance[corner_row, corner_col], illuminance.mean(), illuminance.max()]
        names = ("illuminance_lux_center", "illuminance_lux_corner_in_scene", "illuminance_mean_lux", "illuminance_max_lux")
        result.same(found, [case[name] for name in names], "lux")
        names = ("oi_hfov_deg", "oi_width_m", "oi_height_m")
        result.same([image.hfov_deg, image.width_m, image.height_m], [case[name] for name in names])
        result.same([image.sample_pitch_m] * 2, case["oi_sample_spacing_m"])
        result.same([image.rows, image.cols], case["oi_rows_cols"])
        result.same(1e-9 * np.max(falloff) * np.max(on_axis), case["pad_value_photons"], "border level")
    return result


def optics_otf_psf(read: Reader) -> Comparison:
    data, result = read("isetcam/optics_otf_psf.json"), Comparison()
    for case in data["cases"]:
        frequency = np.array(case["freq_cyc_per_mm"]) * 1e3
        found = [transfer_function(frequency, wavelength_nm=w, f_number=case["f_number"]) for w in case["wave_nm"]]
        result.same(found, case["otf"], "otf")
        result.same([1e6 / (w * case["f_number"]) for w in case["wave_nm"]], case["cutoff_cyc_per_mm"])
        position_m, psf = diffraction_psf(wavelength_nm=550.0, f_number=case["f_number"])
        result.same(psf[psf.shape[0] // 2], case["psf550_row_through_peak"], "psf")
        result.same(position_m * 1e6, case["psf550_x_um"], "psf")
        result.same([psf.sum(), psf.max()], [case["psf550_sum"], case["psf550_peak"]], "psf")
        result.same(1.22 * 0.55 * case["f_number"], case["airy_first_zero_radius_um_550"])
    case = data["blur_isolated"]
    y, x = np.mgrid[1:17, 1:25]
    radiance = 1e15 * (
        1 + 0.5 * np.cos(2 * np.pi * x / 6) * np.cos(2 * np.pi * y / 4) + 5.0 * ((x == 12) & (y == 8)) + 0.7 * (x > 18)
    )
    scene = IsetcamScene(radiance[:, :, None], np.array([550.0]), case["hfov_deg"], case["distance_m"], np.array([1e15]))
    lens = IsetcamLens(f_number=case["f_number"], focal_length_m=case["focal_length_m"], off_axis="skip")
    factor = radiance_to_irradiance_sr(lens.f_number, lens.magnification(scene.distance_m))
    result.same(radiance * factor, case["irradiance_before_otf"])
    image = compute_irradiance(scene, lens)
    result.same(image.photons[:, :, 0], case["oi_photons_after_otf_padded"], "blur")
    pitch_m = image.sample_pitch_m * lens.focal_length_m / image.image_distance_m
    result.same(pitch_m, case["sample_spacing_used_for_otf_m"])
    return result


def optics_shift_invariant(read: Reader) -> Comparison:
    data, result = read("isetcam/optics_shift_invariant.json"), Comparison()
    case = data["si_gaussian"]
    table = gaussian_otf_table(case["wave_nm"], samples=case["nsamples"], pitch_m=case["dx_um"] * 1e-6)
    middle = case["nsamples"] // 2
    result.same(np.abs(table.otf[15, middle, middle:]), case["otf_550_fx_line_first64"], "otf")
    result.same(np.array(case["wave_nm"]) / 400.0, case["psf_sigma_um"])
    scene = point_array_scene(32, 16, hfov_deg=0.5)
    image = compute_irradiance(scene, IsetcamLens(f_number=case["fnumber"], blur="shift_invariant", otf=table))
    result.same(image.photons[19, :, 15], case["point_array_row20_550"], "points")
    result.same(image.sample_pitch_m, case["spacing_m"])
    for name in ("wvf_defocus_00", "wvf_defocus_02"):
        case = data[name]
        zernike_um = (0.0, 0.0, 0.0, 0.0, case["defocus_um"])
        position_m, psf = wavefront_psf(zernike_um, pupil_mm=case["pupil_mm"])
        part = slice(80, 121)
        result.same(psf[100, part], case["psf_center_row"], name)
        result.same(position_m[part] * 1e6, case["x_um"], name)
        result.same([psf.max(), psf.sum()], [case["psf_peak"], case["psf_sum"]], name)
        result.same(wavefront_lens(zernike_um, wavelength_nm=[550.0]).f_number, case["fnumber_via_oi"])
    return result


# Sensor ------------------------------------------------------------------------------------------------------------------


@cache
def _macbeth_image(illuminant: str) -> IsetcamOpticalImage:
    return compute_irradiance(macbeth_scene(illuminant=illuminant), IsetcamLens())


def sensor_of(case: dict[str, Any]) -> IsetcamSensor:
    """Return the stock sensor that a case names, in its size and order."""
    rows, cols = case["rows_cols"]
    stock = {"IMX363": imx363_sensor, "MTV9V024-RGB": mt9v024_sensor, "monochrome-0": monochrome_sensor}
    if case["name"] in ("Sensor A", "Sensor B"):
        return sensor_a() if case["name"] == "Sensor A" else sensor_b()
    if case["name"] in stock:
        return stock[case["name"]](rows=rows, cols=cols)
    pattern = tuple(tuple(index - 1 for index in row) for row in case["cfa_pattern"])
    (order,) = (name for name, known in BAYER_ORDERS.items() if known == pattern)
    return bayer_sensor(order, rows=rows, cols=cols)


def _same_parameters(result: Comparison, sensor: IsetcamSensor, case: dict[str, Any]) -> None:
    found = {
        "rows_cols": [sensor.rows, sensor.cols],
        "cfa_pattern": np.array(sensor.pattern) + 1,
        "pixel_pitch_m": [sensor.pixel_height_m, sensor.pixel_width_m],
        "fill_factor": sensor.fill_factor,
        "conversion_gain_V_per_e": sensor.conversion_gain_v_per_e,
        "voltage_swing_V": sensor.voltage_swing_v,
        "well_capacity_e": sensor.voltage_swing_v / sensor.conversion_gain_v_per_e,
        "read_noise_V": sensor.read_noise_v,
        "dark_voltage_V_per_s": sensor.dark_voltage_v_per_s,
        "dsnu_sigma_V": sensor.dsnu_v,
        "prnu_percent": 100 * sensor.prnu_fraction,
        "analog_gain": sensor.gain_divisor,
        "analog_offset_V": sensor.analog_offset_v,
    }
    for name, value in found.items():
        result.same(value, case[name], f"{case['name']} {name}")
    assert sensor.adc_bits == (case["n_bits"] or None)


def sensor_noise_free(read: Reader) -> Comparison:
    data, result = read("isetcam/sensor_noise_free.json"), Comparison()
    image = compute_irradiance(uniform_scene(32), IsetcamLens())
    result.same(image.photons[20, 20], data["oi_center_photons"])
    result.same([image.sample_pitch_m] * 2, data["oi_spacing_m"])
    for case in data["cases"]:
        sensor = sensor_of(case)
        _same_parameters(result, sensor, case)
        taken = capture_volts(image, sensor, case["exposure_time_s"], rng=_rng(), noise_flag=0)
        row, col = (index - 1 for index in case["center_block_origin_rc_1based"])
        block = (slice(row, row + 2), slice(col, col + 2))
        result.same(taken.volts[block], case["center_block_volts_2x2"], case["name"])
        result.same(taken.electrons[block], case["center_block_electrons_2x2_unrounded"], case["name"])
        result.same(taken.volts[:2, :2], case["corner_block_volts_2x2"], case["name"])
        found = [taken.volts.max(), taken.volts.min(), taken.volts.mean()]
        result.same(found, [case["max_volts"], case["min_volts"], case["mean_volts"]], case["name"])
        if taken.digital_numbers is not None:
            result.same(taken.digital_numbers[block], case["center_block_dv_2x2"], case["name"])
        if "spectral_qe_filters_x_wave" in case:
            efficiency = [np.interp(case["wave_nm"], sensor.wavelength_nm, curve) for curve in sensor.quantum_efficiency.T]
            result.same(np.squeeze(efficiency), case["spectral_qe_filters_x_wave"], case["name"])
    return result


def sensor_macbeth(read: Reader) -> Comparison:
    result = Comparison()
    for case in read("isetcam/sensor_macbeth.json")["cases"]:
        sensor = sensor_of(case)
        _same_parameters(result, sensor, case)
        image = _macbeth_image("D65" if "d65" in case["scene"] else "Tungsten")
        volts = capture_volts(image, sensor, case["exposure_time_s"], rng=_rng(), noise_flag=0).volts
        unit = np.array(sensor.pattern)
        index = unit[np.arange(sensor.rows)[:, None] % unit.shape[0], np.arange(sensor.cols) % unit.shape[1]]
        reach, filters = case["half_window_px"], sensor.quantum_efficiency.shape[1]
        means = np.empty((24, filters))
        for patch, (row, col) in enumerate(case["patch_center_rc_1based"]):
            window = (slice(row - 1 - reach, row + reach), slice(col - 1 - reach, col + reach))
            means[patch] = [volts[window][index[window] == f].mean() for f in range(filters)]
        result.same(means, case["patch_mean_volts_24xfilters"], case["name"])
        result.same(volts.mean(), case["mean_volts"], case["name"])
    return result


def sensor_regrid(read: Reader) -> Comparison:
    result = Comparison()
    for case in read("isetcam/sensor_regrid.json")["cases"]:
        rows, cols = case["oi_rows_cols"]
        r, c, k = np.meshgrid(np.arange(1, rows + 1), np.arange(1, cols + 1), np.arange(1, 4), indexing="ij")
        irradiance = 1e16 * (1 + 0.4 * np.sin(0.9 * c * k / 2 + 0.3 * r) + 0.2 * np.mod(r * c, k + 2) / 3)
        image = IsetcamOpticalImage(irradiance, case["wave_nm"], case["oi_spacing_m"][0], 1.0)
        pitch_m = case["pixel_pitch_m"]
        sensor = bayer_sensor(case["cfa"], rows=case["sensor_rows_cols"][0], cols=case["sensor_rows_cols"][1])
        sensor = replace(sensor, pixel_height_m=pitch_m, pixel_width_m=pitch_m, fill_factor=case["fill_factor"])
        taken = capture_volts(image, sensor, case["exposure_time_s"], rng=_rng(), noise_flag=-1)
        result.same(taken.volts, case["volts"], str(case["kernel_rows_cols"]))
        taps = math.ceil(pitch_m / case["oi_spacing_m"][0])
        result.same([taps, taps, taps / 4], [*case["kernel_rows_cols"], case["kernel_sigma_samples"]])
    return result


def sensor_clipping_quantisation(read: Reader) -> Comparison:
    result = Comparison()
    for case in read("isetcam/sensor_clipping_quantisation.json")["cases"]:
        bits = None if case["quantization"] == "analog" else int(case["quantization"].split()[0])
        volts = np.array([case["input_volts_fraction_of_swing"]]) * case["voltage_swing_V"]
        sensor = replace(
            monochrome_sensor(rows=1, cols=volts.size),
            gain_divisor=case["analog_gain"],
            analog_offset_v=case["analog_offset_V"],
            voltage_swing_v=case["voltage_swing_V"],
            adc_bits=bits,
        )
        output, numbers = read_out_volts(volts, sensor, exposure_time_s=1.0, noise_flag=0, rng=_rng())
        result.same(output[0], case["output_volts"], case["quantization"])
        result.same(np.full(volts.size, np.nan) if numbers is None else numbers[0], case["output_dv"], case["quantization"])
    return result


def _shot_noise(result: Comparison, data: dict[str, Any]) -> None:
    sensor = monochrome_sensor(rows=256, cols=256)
    for number, case in enumerate(data["cases"]):
        mean, count = case["mean_electrons_in"], case["n_samples"]
        volts = np.full((count // 256, 256), mean * sensor.conversion_gain_v_per_e)
        noisy, _ = read_out_volts(volts, sensor, exposure_time_s=1.0, noise_flag=-2, rng=_rng("shot", number))
        electrons = noisy.ravel() / sensor.conversion_gain_v_per_e
        assert np.max(np.abs(electrons - np.rint(electrons))) < 1e-9
        whole, name = np.rint(electrons), f"{mean:.1f} e-"
        both = math.sqrt(2 / count)
        fourth = 2 + (1 / mean if case["distribution"] == "Poisson" else 0)
        result.alike(whole.mean(), case["out_mean"], standard_error=math.sqrt(mean) * both, name=name)
        result.alike(whole.var(), case["out_var"], standard_error=mean * math.sqrt(fourth) * both, name=name)
        for key, share in (("frac_zero", np.mean(whole == 0)), ("frac_odd", np.mean(whole % 2 == 1))):
            spread = math.sqrt(max(case[key] * (1 - case[key]), 1 / count))
            result.alike(float(share), case[key], standard_error=spread * both, name=f"{name} {key}")
        if mean >= 5:
            skewness = float(np.mean((whole - whole.mean()) ** 3) / whole.std() ** 3)
            result.alike(skewness, case["skewness"], standard_error=math.sqrt(6) * both * 1.2, name=f"{name} skewness")
        if "hist" in case:
            theirs = np.array(case["hist"])
            ours = np.bincount(whole.astype(np.int64), minlength=theirs.size)[: theirs.size]
            used = ours + theirs >= 25
            freedom = int(np.count_nonzero(used)) - 1
            chi_squared = float(np.sum((ours - theirs)[used] ** 2 / (ours + theirs)[used]))
            result.alike(chi_squared, freedom, standard_error=math.sqrt(2 * max(freedom, 1)), name=f"{name} histogram")


def _noise_sources(result: Comparison, data: dict[str, Any]) -> None:
    flags = {"noise flag 0": 0, "shot only (flag 1)": 1, "flag 1 with PRNU 5% and DSNU 50 mV set (both ignored)": 1}
    for number, case in enumerate(data["cases"]):
        given, name = case["params"], case["name"]
        sensor = replace(
            monochrome_sensor(rows=256, cols=256),
            voltage_swing_v=10.0,
            read_noise_v=given.get("read_noise_V", 0.0),
            dsnu_v=given.get("dsnu_V", 0.0),
            prnu_fraction=given.get("prnu_percent", 0.0) / 100,
            dark_voltage_v_per_s=given.get("dark_V_per_s", 0.0),
            column_offset_sd_v=given.get("col_offset_V", 0.0),
            column_gain_sd=given.get("col_gain", 0.0),
            correlated_double_sampling="CDS" in name,
        )
        light_v = 0.0 if "zero light" in name else 800 * data["conversion_gain_V_per_e"]
        mean_v, rng, reps = np.full((256, 256), light_v), _rng("sources", number), case["reps"]
        planes = np.stack([
            read_out_volts(mean_v, sensor, exposure_time_s=given["exp_s"], noise_flag=flags.get(name, 2), rng=rng)[0]
            for _ in range(reps)
        ])  # fmt: skip
        if name == "noise flag 0":
            result.same([planes.mean(), planes.min(), planes.max()], [case["mean_V"], case["min_V"], case["max_V"]], name)
            continue
        independent = 256 * reps if "column" in name else case["n"]
        variance = case["var_V2"]
        both = math.sqrt(2 / independent)
        result.alike(planes.mean(), case["mean_V"], standard_error=math.sqrt(variance) * both, name=f"{name} mean")
        result.alike(planes.var(), variance, standard_error=variance * math.sqrt(2) * both, name=f"{name} variance")
        averaged = case["var_of_pixel_time_average_V2"]
        both = math.sqrt(2 / (256 if "column" in name else 65536))
        found = planes.mean(axis=0).var()
        result.alike(found, averaged, standard_error=averaged * math.sqrt(2) * both, name=f"{name} averaged")
        columns = case["col_mean_var_V2"]
        found = planes.mean(axis=(0, 1)).var(ddof=1)
        result.alike(found, columns, standard_error=columns * math.sqrt(2) * math.sqrt(2 / 255), name=f"{name} columns")


def sensor_noise_stats(read: Reader) -> Comparison:
    data, result = read("isetcam/sensor_noise_stats.json"), Comparison()
    _shot_noise(result, data["shot_noise"])
    _noise_sources(result, data["sources"])
    return result


def exposure(read: Reader) -> Comparison:
    data, result = read("isetcam/exposure.json"), Comparison()
    image = _macbeth_image("D65")
    auto = data["auto"]
    rows, cols = auto["sensor_rows_cols"]
    sensor = bayer_sensor("rggb", rows=rows, cols=cols)
    rectangle = tuple(auto["center_rect_colmin_rowmin_w_h_on_oi"])
    for name, expected in auto["times_s"].items():
        if name == "cfa":
            result.same(cfa_auto_exposure_times_s(image, sensor, level=auto["level"]), expected, name)
            continue
        method = "luminance" if name == "default" else name
        found = auto_exposure_time_s(image, sensor, method=method, level=auto["level"], rectangle=rectangle)
        result.same(found, expected, name)
    illuminance = image.illuminance_lux
    result.same([illuminance.max(), illuminance.mean()], [auto["oi_illuminance_max"], data["mean_illuminance"]])
    lux_s = metrics.photometric_exposure_lux_s(float(illuminance.mean()), exposure_time_s=0.01)
    result.same(lux_s, data["photometric_exposure_lux_s"])
    case = data["exposure_value"]
    found = [metrics.exposure_value(f_number=f, exposure_time_s=t) for f, t in zip(case["f"], case["t"], strict=True)]
    result.same([*found, metrics.exposure_value(f_number=4.0, exposure_time_s=0.01)], [*case["EV"], data["EV_code"]])
    _several_exposures(result, data, image, sensor)
    return result


def _several_exposures(result: Comparison, data: dict[str, Any], image: IsetcamOpticalImage, sensor: IsetcamSensor) -> None:
    row, col = (index - 1 for index in data["bracketed"]["block_rows_cols_1based"])
    block = (slice(row, row + 4), slice(col, col + 4))
    for mode in ("bracketed", "cfa", "burst"):
        case = data[mode]
        taken = capture_volts(image, sensor, case["times_s"], rng=_rng(), noise_flag=0, burst=mode == "burst")
        assert taken.mode == mode
        result.same(taken.volts.shape, case["size"])
        for key, expected in case.items():
            if "plane" in key and key[-1].isdigit():
                result.same(taken.volts[block][:, :, int(key[-1]) - 1], expected, f"{mode} {key}")
            elif key == "block_volts_last":
                result.same(taken.volts[block][:, :, -1], expected, f"{mode} {key}")
            elif key in ("combined_block", "merged_block"):
                result.same(taken.combined()[block], expected, f"{mode} {key}")
            elif key == "combined_max":
                result.same(taken.combined().max(), expected, f"{mode} {key}")


def edge_cases(read: Reader) -> Comparison:
    """The cases that are numbers; those that are NaN, Inf or an error there are refused here and tested beside this."""
    data, result = read("isetcam/edge_cases.json"), Comparison()
    result.same(compute_irradiance(uniform_scene(2), IsetcamLens()).photons[:, :, 15], data["two_pixel_scene"]["photons_550"])
    case = data["one_wavelength"]
    scene = uniform_scene(16, wavelength_nm=[case["wave"]])
    image = compute_irradiance(scene, IsetcamLens())
    sensor = monochrome_sensor(rows=40, cols=48)
    volts = capture_volts(image, sensor, case["exp_s"], rng=_rng(), noise_flag=0).volts
    width = radiometry.bin_width_nm(scene.wavelength_nm)
    found = {
        "scene_bin_width": width,
        "oi_bin_width": width,
        "scene_photons": scene.photons[0, 0, 0],
        "mean_luminance": scene.mean_luminance_cd_m2,
        "oi_photons_center": image.photons[8, 8, 0],
        "illuminance_center": image.illuminance_lux[8, 8],
        "monochrome_sensor_volts_center": volts[20, 24],
    }
    for name, value in found.items():
        result.same(value, case[name], name)
    _flat_irradiances(result, data)
    _automatic_by_zero(result, data["zero_exposure_time"])
    dark = IsetcamScene(np.zeros((4, 4, 31)), np.arange(400.0, 701.0, 10.0), 10.0, 1.2, np.ones(31))
    result.same(dark.mean_luminance_cd_m2, data["zero_luminance"]["mean_luminance"])
    return result


def _automatic_by_zero(result: Comparison, case: dict[str, Any]) -> None:
    """Exposure 0 in a flat field: the file's time carries the read noise of the metered pixels, ours does not."""
    wave = np.array(radiometry.DEFAULT_WAVELENGTH_NM, dtype=np.float64)
    flat = IsetcamOpticalImage(np.full((64, 64, wave.size), 1e16), wave, 1e-5, 3.9e-3)
    taken = capture_volts(flat, bayer_sensor(), 0.0, rng=_rng(), noise_flag=0)
    found_v_per_s = 0.95 / float(taken.exposure_times_s)
    result.alike(found_v_per_s, 0.95 / case["resulting_exp_s"], standard_error=1e-3, name="exposure 0")
    result.alike(taken.volts.max(), case["max_V"], standard_error=1e-3 * 0.95 / found_v_per_s, name="exposure 0")


def _flat_irradiances(result: Comparison, data: dict[str, Any]) -> None:
    sensor = replace(bayer_sensor(rows=72, cols=88), adc_bits=10)
    wave = np.array(radiometry.DEFAULT_WAVELENGTH_NM, dtype=np.float64)
    for name, case in data.items():
        if not name.startswith("flat_irradiance"):
            continue
        flat = IsetcamOpticalImage(np.full((64, 64, wave.size), case["irradiance"]), wave, 1e-5, 3.9e-3)
        taken = capture_volts(flat, sensor, 0.01, rng=_rng(name), noise_flag=case["noise_flag"])
        assert np.all(np.isfinite(taken.volts))
        assert taken.digital_numbers is not None
        if case["noise_flag"] < 2 or case["irradiance"] > 1e20:
            inner = taken.volts[taken.volts > 0] if case["min_V"] > 0 else taken.volts
            result.same(
                [inner.min(), inner.max(), taken.digital_numbers.max()], [case["min_V"], case["max_V"], case["max_dv"]], name
            )
        else:
            # Read noise of 1 mV clipped at 0; how many pixels the file's mean is of is not said: at least a few hundred.
            result.alike(taken.volts.mean(), case["mean_V"], standard_error=1e-3 * math.sqrt(2 / 256), name=name)


# Image processing --------------------------------------------------------------------------------------------------------


def ip_demosaic(read: Reader) -> Comparison:
    result = Comparison()
    keys = {"bilinear": "bilinear_rgb", "nearest": "nearest_neighbor", "laplacian": "laplacian"}
    keys["adaptive_laplacian"] = "adaptive_laplacian"
    for case in read("isetcam/ip_demosaic.json")["cases"]:
        pattern = tuple(tuple(index - 1 for index in row) for row in case["pattern_1R2G3B"])
        for method, key in keys.items():
            if key in case:
                result.same(demosaic(case["mosaic"], pattern, method=method), case[key], f"{case['cfa']} {method}")
    return result


def ip_color_pipeline(read: Reader) -> Comparison:
    result = Comparison()
    for case in read("isetcam/ip_color_pipeline.json")["cases"]:
        rows, cols = case["sensor_rows_cols"]
        bayer = case["sensor"].startswith("bayer")
        sensor = bayer_sensor("rggb", rows=rows, cols=cols) if bayer else imx363_sensor(rows=rows, cols=cols)
        image = _macbeth_image("D65" if "d65" in case["scene"] else "Tungsten")
        taken = capture_volts(image, sensor, case["exp_s"], rng=_rng(), noise_flag=0)
        largest = 1.0 if taken.digital_numbers is not None else float(taken.volts.max() / sensor.voltage_swing_v)
        picture = process_mosaic(
            taken.volts if taken.digital_numbers is None else taken.digital_numbers,
            sensor.pattern,
            wavelength_nm=sensor.wavelength_nm,
            quantum_efficiency=sensor.quantum_efficiency,
            illuminant_correction=case["illuminant_correction"].replace(" ", "_"),
            largest=largest,
        )
        name = f"{case['scene']} {case['sensor']} {case['illuminant_correction']}"
        samples = np.ix_(np.array(case["sample_rows"]) - 1, np.array(case["sample_cols"]) - 1)
        result.same(largest, case["volts2maxratio"], name)
        result.same(picture.sensor_to_xyz, case["T_sensor_conversion"], f"{name} sensor")
        result.same(picture.correction, case["T_illuminant"], f"{name} illuminant")
        result.same(picture.xyz_to_display, case["T_ics2display"], f"{name} display")
        result.same(picture.demosaicked[samples], case["demosaiced_samples"], f"{name} demosaic")
        result.same(picture.rgb[samples], case["result_samples"], f"{name} result")
        result.same(picture.rgb.mean(axis=(0, 1)), case["result_mean"], f"{name} mean")
        result.same(picture.rgb.max(), case["result_max"], f"{name} max")
    return result


# Metrics -----------------------------------------------------------------------------------------------------------------


def mtf_slanted_edge(read: Reader) -> Comparison:
    result, images = Comparison(), {}
    for case in read("isetcam/mtf_slanted_edge.json")["cases"]:
        key = (case["f_number"], case["hfov_deg"])
        if key not in images:
            images = {key: compute_irradiance(slanted_bar_scene(384, hfov_deg=key[1]), IsetcamLens(f_number=key[0]))}
        image = images[key]
        result.same(image.sample_pitch_m, case["oi_spacing_m"])
        rows, cols = case["sensor_rows_cols"]
        colour = case["sensor"].startswith("bayer")
        sensor = bayer_sensor("rggb", rows=rows, cols=cols) if colour else monochrome_sensor(rows=rows, cols=cols)
        pitch_m = case["pixel_pitch_m"]
        sensor = replace(sensor, pixel_height_m=pitch_m, pixel_width_m=pitch_m, fill_factor=case["fill_factor"])
        volts = capture_volts(image, sensor, 0.01, rng=_rng(), noise_flag=-1).volts
        picture = demosaic(volts, sensor.pattern) if colour else volts
        first_col, first_row, width, height = case["roi_colmin_rowmin_w_h"]
        region = picture[first_row - 1 : first_row + height, first_col - 1 : first_col + width]
        edge = isetcam_metrics.iso12233(region, pixel_pitch_mm=pitch_m * 1e3)
        chosen = np.isclose(edge.frequency_cycles_per_mm[:, None], case["freq_cyc_mm"], rtol=GOLDEN_TOLERANCE).any(axis=1)
        result.same(edge.frequency_cycles_per_mm[chosen], case["freq_cyc_mm"])
        result.same(edge.mtf[chosen], case["mtf_lum"], "mtf")
        result.same([edge.mtf50_cycles_per_mm, edge.nyquist_cycles_per_mm], [case["mtf50_cyc_mm"], case["nyquist"]], "mtf50")
        below = edge.frequency_cycles_per_mm <= edge.nyquist_cycles_per_mm
        curve = edge.mtf[below]
        last = int(np.argmax(curve < 0.5))
        frequency = edge.frequency_cycles_per_mm[below]
        crossing = np.interp(0.5, curve[[last, last - 1]], frequency[[last, last - 1]])
        result.same(crossing, case["mtf50_interp_cyc_mm"], "mtf50 between")
    return result


def metrics_color(read: Reader) -> Comparison:
    data, result = read("isetcam/metrics_color.json"), Comparison()
    one, two = (isetcam_metrics.xyz_to_lab(data[name], data["white"]) for name in ("xyz1", "xyz2"))
    result.same(one, data["lab1_old"], "lab")
    result.same(metrics.delta_e_1976(one, two), data["deltaE1976"], "dE76")
    result.same(metrics.delta_e_1994(one, two), data["deltaE1994"], "dE94")
    result.same(metrics.delta_e_2000(one, two), data["deltaE2000"], "dE2000")
    linear = isetcam_metrics.xyz_to_linear_srgb(np.array(data["xyz1"]) / 100.0)
    result.same(linear, data["lrgb"], "lrgb")
    result.same(isetcam_metrics.encode_srgb(linear), data["srgb_of_xyz1_over100"], "srgb")
    values, encoded = np.array(data["lrgb2srgb"]).T
    result.same(isetcam_metrics.encode_srgb(values), encoded, "lrgb2srgb")
    case = data["sensor_snr"]
    found = isetcam_metrics.sensor_snr_db(
        case["volts"],
        conversion_gain_v_per_e=case["conv_gain"],
        read_noise_v=case["read_V"],
        dsnu_v=case["dsnu_V"],
        prnu_fraction=case["prnu_percent"] / 100,
    )
    result.same(found, case["snr_dB"], "snr")
    dark = {"voltage_swing_v": 1.0, "dark_voltage_v_per_s": 1e-3, "exposure_time_s": 0.01, "read_noise_v": 1e-3}
    sensor = isetcam_metrics.sensor_dynamic_range_db(**dark, conversion_gain_v_per_e=1e-4, dsnu_v=1e-3)
    result.same([sensor, isetcam_metrics.pixel_dynamic_range_db(**dark)], [data["sensor_dr_dB"], data["pixel_dr_dB"]])
    return result


def metrics_iso12233_synthetic(read: Reader) -> Comparison:
    result = Comparison()
    for case in read("isetcam/metrics_iso12233_synthetic.json")["cases"]:
        rows, cols = case["rows_cols"]
        row, col = np.mgrid[:rows, :cols]
        across = (col - (cols - 1) / 2) - case["slope_dx_per_dy"] * (row - (rows - 1) / 2)
        picture = 0.1 + 0.8 * 0.5 * (1 + erf(across / (case["sigma_px"] * np.sqrt(2))))
        edge = isetcam_metrics.iso12233(picture, pixel_pitch_mm=case["delta_x_mm"])
        result.same(edge.frequency_cycles_per_mm, case["freq_cyc_mm"])
        result.same(edge.mtf, case["mtf_lum"], "mtf")
        found = [edge.nyquist_cycles_per_mm, edge.mtf50_cycles_per_mm, edge.aliasing_percent]
        result.same(found, [case[name] for name in ("nyquist", "mtf50", "aliasing_percent")])
    return result


def metrics_scielab(read: Reader) -> Comparison:
    data, result = read("isetcam/metrics_scielab.json"), Comparison()
    per_degree = isetcam_metrics.samples_per_degree(dots_per_inch=data["dpi"], distance_m=data["dist_m"])
    result.same(per_degree, data["samp_per_deg"])
    kernels = isetcam_metrics.s_cielab_filters(samples_per_degree=per_degree, filter_size=data["filter_size"])
    for number, kernel in enumerate(kernels, 1):
        result.same(kernel[kernel.shape[0] // 2], data[f"filter{number}_center_row"], "filter")
    row, col, plane = np.mgrid[1 : data["n"] + 1, 1 : data["n"] + 1, 1:4]
    wave, base = 1 + 0.3 * np.sin(2 * np.pi * col / 6), np.array([40.0, 42.0, 45.0])
    one, two = base * wave, base * (wave + 0.05 * np.cos(2 * np.pi * row / 8) * (plane - 2))
    found = isetcam_metrics.s_cielab_difference(one, two, data["white"], samples_per_degree=per_degree, observer=2)
    result.same(found[22], data["map_center_row"], "map")
    labs = [isetcam_metrics.xyz_to_lab(picture, data["white"]) for picture in (one, two)]
    result.same(
        [found.mean(), metrics.delta_e_2000(*labs).mean()], [data["mean_scielab_dE2000"], data["mean_pointwise_dE2000"]], "mean"
    )
    return result


VSNR_REPEATS = 8
VSNR_SIDE_PX = 122
"""Five degrees behind the default lens at 2.8 um, in whole blocks."""


def metrics_vsnr(read: Reader) -> Comparison:
    data, result = read("isetcam/metrics_vsnr.json"), Comparison()
    per_degree = isetcam_metrics.samples_per_degree(dots_per_inch=data["dpi"], distance_m=data["dist_m"])
    sensor = bayer_sensor(rows=VSNR_SIDE_PX, cols=VSNR_SIDE_PX)
    wave = np.array(radiometry.DEFAULT_WAVELENGTH_NM, dtype=np.float64)
    display = (
        radiometry.LUMINOUS_EFFICACY_LM_PER_W * 10.0 * radiometry.display_primaries(wave).T @ radiometry.observer_xyz(wave)
    )
    white = display.sum(axis=0)
    border = round(0.1 * VSNR_SIDE_PX)
    part = slice(border - 1, VSNR_SIDE_PX - border)
    for column, level in enumerate(data["light_levels_cd_m2"]):
        image = compute_irradiance(uniform_scene(32, hfov_deg=5.0, luminance_cd_m2=level), IsetcamLens())
        found = []
        for repeat in range(VSNR_REPEATS):
            volts = capture_volts(image, sensor, data["exposure_s"], rng=_rng("vsnr", column, repeat)).volts
            rgb = process_mosaic(volts, sensor.pattern, wavelength_nm=wave, quantum_efficiency=sensor.quantum_efficiency).rgb
            shown = (rgb @ display)[part, part]
            found.append(isetcam_metrics.visual_snr(shown, white, samples_per_degree=per_degree))
        theirs = np.array(data["vsnr_reps"])[:, column]
        error = float(np.std(found, ddof=1)) * math.sqrt(1 / len(found) + 1 / len(theirs))
        result.alike(float(np.mean(found)), float(theirs.mean()), standard_error=error, name=f"{level} cd/m2")
    return result


COMPARISONS: dict[str, Callable[[Reader], Comparison]] = {
    function.__name__: function
    for function in (
        spectra, scene_uniform, scene_macbeth, scene_targets, oi_diffraction, optics_otf_psf, optics_shift_invariant,
        sensor_noise_free, sensor_macbeth, sensor_regrid, sensor_noise_stats, sensor_clipping_quantisation, exposure,
        ip_demosaic, ip_color_pipeline, metrics_color, metrics_scielab, metrics_iso12233_synthetic, mtf_slanted_edge,
        metrics_vsnr, edge_cases,
    )
}  # fmt: skip
"""One for each file of the reference, by the file's name."""
