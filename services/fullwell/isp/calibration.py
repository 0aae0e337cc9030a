"""What a sensor's channels mean: gains for white and the matrix to colour, under one light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.isp.black_level import linear_signal
from fullwell.isp.colour_matrix import adapted_srgb_targets, channel_responses, fit_colour_matrix, noise_amplification
from fullwell.isp.parameters import IspSettings
from fullwell.isp.white_balance import gains_for_gray_world, gains_for_white, gains_for_white_patch, unsaturated_cells
from fullwell.radiometry import Spectrum, WavelengthGrid, chromaticity, illuminant, luminance_cd_m2
from fullwell.scene.images import RawImage

__all__ = ["ColourCalibration", "calibrate", "used_channels"]

_VISIBLE_END_NM = 780.0
"""A picture of longer wavelengths only has no colours (CIE 15:2018, tables end at 780 nm)."""


@dataclass(frozen=True, slots=True, eq=False)
class ColourCalibration:
    """How the channels of a raw image become colours.

    Attributes
    ----------
    channel_names
        The channels of the pattern, in the sensor's order.
    illuminant
        The light that the calibration is for.
    channel_gain_ratio
        (channels,) gains of the white balance, the smallest 1.
    white_response
        (channels,) relative electrons of a perfect white under the light.
    colour_matrix
        (3, channels) from balanced channels to linear sRGB; None where there are no colours: one channel, or no visible band.
    """

    channel_names: tuple[str, ...]
    illuminant: Spectrum
    channel_gain_ratio: NDArray[np.float64]
    white_response: NDArray[np.float64]
    colour_matrix: NDArray[np.float64] | None

    @property
    def illuminant_xy(self) -> tuple[float, float] | None:
        """CIE 1931 chromaticity (x, y) of the illuminant; None where it cannot be seen."""
        return chromaticity(self.illuminant) if luminance_cd_m2(self.illuminant) > 0 else None

    @property
    def noise_amplification(self) -> float | None:
        """Noise of linear sRGB over the noise of the raw channels in the dark; None without a matrix."""
        return None if self.colour_matrix is None else noise_amplification(self.colour_matrix, self.channel_gain_ratio)


def used_channels(raw: RawImage) -> tuple[tuple[str, Spectrum], ...]:
    """Return (name, quantum efficiency) of the channels that the pattern uses, in the sensor's order."""
    used = {name for row in raw.pattern for name in row}
    return tuple((name, curve) for name, curve in raw.channels if name in used)


def calibrate(raw: RawImage, settings: IspSettings, *, scene_light: Spectrum | None = None) -> ColourCalibration:
    """Return the gains and the matrix for a raw image.

    `scene_light` is the relative power of the scene's light, used where the settings name no illuminant. Where the eye or the
    sensor sees nothing of it, and where it is None, D65 takes its place, and equal energy where the sensor does not see that.
    A channel that sees nothing of the light keeps a gain of 1 and takes no part in colours.

    Raises
    ------
    FieldError
        The settings' illuminant is invisible to the eye or to every channel.
    """
    names, curves = zip(*used_channels(raw), strict=True)
    light = settings.illuminant or _usable_light(scene_light, curves, raw.grid)
    responses = channel_responses(curves, light, raw.grid)
    gains = _gains(raw, settings, names, responses[0])
    matrix = None
    if len(names) > 1 and raw.grid.edges_nm[0] < _VISIBLE_END_NM:
        matrix = _matrix(responses, light, settings, gains)
    return ColourCalibration(names, light, gains, responses[0], matrix)


def _usable_light(scene_light: Spectrum | None, curves: tuple[Spectrum, ...], grid: WavelengthGrid) -> Spectrum:
    colours = grid.edges_nm[0] < _VISIBLE_END_NM
    for light in (scene_light, illuminant("D65")):
        if light is not None and (not colours or luminance_cd_m2(light) > 0):
            seen = [np.sum(curve.band_average(grid) * light.band_average(grid)) > 0 for curve in curves]
            if any(seen):
                return light
    return illuminant("E")


def _gains(
    raw: RawImage, settings: IspSettings, names: tuple[str, ...], white_response: NDArray[np.float64]
) -> NDArray[np.float64]:
    if len(names) == 1:
        return np.ones(1)
    if settings.white_balance in ("illuminant", "none"):
        return gains_for_white(white_response)
    cells = unsaturated_cells(linear_signal(raw), raw.pattern, names)
    if settings.white_balance == "gray_world":
        return gains_for_gray_world(cells)
    return gains_for_white_patch(cells, percentile=settings.white_patch_percentile)


def _matrix(
    responses: NDArray[np.float64], light: Spectrum, settings: IspSettings, gains: NDArray[np.float64]
) -> NDArray[np.float64]:
    targets = adapted_srgb_targets(light, adapt_white=settings.white_balance != "none")
    seen = responses[0] > 0
    fit = settings.colour_matrix
    noise = fit.noise_fraction * gains[seen] if fit.method == "noise_aware" else None
    matrix = np.zeros((3, seen.size))
    matrix[:, seen] = fit_colour_matrix(responses[:, seen] / responses[0, seen], targets, channel_noise=noise)
    return matrix
