"""ISETCam's camera visual SNR: a uniform D65 field through its default camera, by statistics.

The field's mean volts, the sensor's noise and the colour transforms are those of the reference files, so that nothing but
drawing noise, demosaicing and the metric is left to be done here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve

from fullwell.core import stream
from fullwell.metrics import isetcam

STANDARD_ERRORS = 4.0
"""The reference's own rule for random files."""

REPEATS = 16
SIDE_PX = 122
"""Five degrees behind the default lens (3.875 mm) at 2.8 um, whole filter blocks."""

VOLTS_PER_E, READ_NOISE_V, DARK_V_PER_S, SWING_V = 1e-4, 1e-3, 1e-3, 1.0
GRBG = np.array([["G", "R"], ["B", "G"]])


def test_the_visual_snr_of_the_default_camera_is_isetcams(reference: Callable[[str], Any]) -> None:
    case = reference("isetcam/metrics_vsnr.json")
    camera = _Camera(reference)
    per_degree = isetcam.samples_per_degree(dots_per_inch=case["dpi"], distance_m=case["dist_m"])
    for level, mean, repeats in zip(case["light_levels_cd_m2"], case["vsnr_mean"], np.array(case["vsnr_reps"]).T, strict=True):
        found = [
            isetcam.visual_snr(
                camera.picture_xyz(level, case["exposure_s"], stream(11, "vsnr", str(level), k)),
                camera.white_xyz,
                samples_per_degree=per_degree,
            )
            for k in range(REPEATS)
        ]
        # The scatter of four numbers says little about itself; ours comes from more.
        error = np.std(found, ddof=1) * np.sqrt(1 / REPEATS + 1 / len(repeats))
        assert abs(np.mean(found) - mean) < STANDARD_ERRORS * error


class _Camera:
    """ISETCam's default camera after the lens."""

    def __init__(self, reference: Callable[[str], Any]) -> None:
        spectra, colour = reference("isetcam/spectra.json"), reference("isetcam/ip_color_pipeline.json")["cases"][0]
        self.white_xyz = np.array(spectra["display_white_xyz"])
        self._to_xyz = np.array(colour["T_sensor_conversion"])
        self._to_display = np.array(colour["T_ics2display"])
        display = np.array(spectra["display_lcdExample_rgb_spd"]) @ np.array(spectra["xyz_cmf_energy"])
        self._display_xyz = display * (self.white_xyz / display.sum(axis=0))
        field = reference("isetcam/sensor_noise_free.json")
        (bayer,) = [
            item
            for item in field["cases"]
            if item["name"] == "bayer-0" and item["cfa_pattern"] == [[2, 1], [3, 2]] and item["exposure_time_s"] == 0.01
        ]
        (green, red), (blue, _) = bayer["center_block_volts_2x2"]
        self._volts_per_s = {"R": red / 0.01, "G": green / 0.01, "B": blue / 0.01}
        self._luminance = field["luminance_cd_m2"]

    def picture_xyz(self, luminance: float, time_s: float, rng: np.random.Generator) -> NDArray[np.float64]:
        """Return the XYZ of the displayed picture without its outer tenth."""
        names = np.tile(GRBG, (SIDE_PX // 2, SIDE_PX // 2))
        mean_v = np.select([names == name for name in "RGB"], [self._volts_per_s[name] for name in "RGB"])
        electrons = (mean_v * luminance / self._luminance + DARK_V_PER_S) * time_s / VOLTS_PER_E
        gaussian = np.rint(electrons + np.sqrt(electrons) * rng.standard_normal(electrons.shape))
        shot = np.where(electrons >= 25, gaussian, rng.poisson(electrons))
        volts = np.clip(shot * VOLTS_PER_E + READ_NOISE_V * rng.standard_normal(electrons.shape), 0, SWING_V)
        xyz = np.clip(_demosaic(volts, names) @ self._to_xyz, 0, None)
        shown = (xyz / xyz.max()) @ self._to_display
        border = round(0.1 * SIDE_PX)
        part = slice(border - 1, SIDE_PX - border)
        return np.asarray((shown / shown.max() @ self._display_xyz)[part, part])


def _demosaic(volts: NDArray[np.float64], names: NDArray[np.str_]) -> NDArray[np.float64]:
    corner = np.outer([0.5, 1, 0.5], [0.5, 1, 0.5])
    kernels = {"R": corner, "G": np.array([[0, 1, 0], [1, 4, 1], [0, 1, 0]]) / 4, "B": corner}
    planes = [convolve(np.where(names == name, volts, 0.0), kernel, mode="mirror") for name, kernel in kernels.items()]
    return np.stack(planes, axis=-1)
