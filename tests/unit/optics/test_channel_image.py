"""Light that channels have counted passes the same optics as the spectrum: the same electrons at a tenth of the work."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.optics import (
    IDEAL_LENS,
    Aperture,
    OpticsOptions,
    Wavefront,
    channels_suffice,
    compute_irradiance,
    diffraction_otf,
    form_channel_image,
    gaussian_psf,
    working_f_number,
)
from fullwell.radiometry import ChannelRadiance, RadianceImage, Spectrum, WavelengthGrid
from fullwell.scene import Lens
from fullwell.sensor import ColorFilterArray, channel_currents, sensor
from fullwell.sensor.quantum_efficiency import band_quantum_efficiency

GRID = WavelengthGrid(400.0, 700.0, 10.0)
FLOAT32_ROUNDING = 3e-7
"""Relative; spectral irradiance is stored in single precision."""

TRANSMITTANCE = Spectrum(np.array([400.0, 700.0]), np.array([0.6, 0.95]))
LENS = Lens("thin_lens", 4e-3, 2.8, 0.5, TRANSMITTANCE)
CFA: ColorFilterArray = sensor("imx363").cfa
PITCH = 1.4e-6 / LENS.image_distance_m


def cube(*, tint_per_nm: float = 0.0, rows: int = 40, cols: int = 56) -> RadianceImage:
    """Return random texture; each sample's spectrum has a slope of its own, up to `tint_per_nm` either way."""
    rng = np.random.default_rng(7)
    texture = rng.random((rows, cols, 1)) ** 2 * 1e17
    slope = rng.uniform(-tint_per_nm, tint_per_nm, (rows, cols, 1))
    photons = texture * np.exp(slope * (GRID.centres_nm - 550.0))
    return RadianceImage(photons.astype(np.float32), GRID, PITCH)


def counted(radiance: RadianceImage, parts: int = 1, *, light: np.ndarray | None = None) -> ChannelRadiance:
    """Return what the channels count of a spectral picture, each in `parts` ranges of bands."""
    efficiency = band_quantum_efficiency(CFA, GRID) * TRANSMITTANCE.band_average(GRID)[:, None] * GRID.step_nm
    seen = np.ones(GRID.count) if light is None else light
    electrons, means, channels = [], [], []
    for channel in range(efficiency.shape[1]):
        for part in np.array_split(np.arange(GRID.count), parts):
            weights = efficiency[part, channel]
            electrons.append(radiance.photons[..., part].astype(np.float64) @ weights)
            means.append(np.average(GRID.centres_nm[part], weights=weights * seen[part]))
            channels.append(channel)
    return ChannelRadiance(np.stack(electrons), np.array(means), np.array(channels), radiance.tangent_pitch)


def by_bands(radiance: RadianceImage, lens: Lens) -> np.ndarray:
    return channel_currents(compute_irradiance(radiance, lens), CFA).electrons


@pytest.mark.parametrize("kind", ["pinhole", "thin_lens"])
@pytest.mark.parametrize("parts", [1, 3])
def test_without_diffraction_channels_and_bands_agree_to_rounding(kind: Any, parts: int) -> None:
    lens = replace(LENS, kind=kind, diffraction=False)
    radiance = cube(tint_per_nm=0.01)
    image = form_channel_image(counted(radiance, parts), lens, IDEAL_LENS)
    spectral = compute_irradiance(radiance, lens)
    np.testing.assert_allclose(image.electrons, by_bands(radiance, lens), rtol=FLOAT32_ROUNDING)
    assert image.sample_pitch_m == spectral.sample_pitch_m
    assert image.notes == spectral.notes


def spread_of(radiance: RadianceImage, lens: Lens, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (channels,) rms difference between the two ways, and rms contrast of the picture before diffraction."""
    direct = form_channel_image(counted(radiance, parts), lens, IDEAL_LENS).electrons
    spectral = by_bands(radiance, lens)
    assert direct.mean(axis=(1, 2)) == pytest.approx(spectral.mean(axis=(1, 2)), rel=1e-3)  # no light is lost
    return np.sqrt(((direct - spectral) ** 2).mean(axis=(1, 2))), by_bands(radiance, replace(lens, diffraction=False)).std(
        axis=(1, 2)
    )


SECOND_ORDER = 2e-3
"""Of the contrast: what the curvature of the contrast in wavelength leaves over a channel of 100 nm."""


def test_a_grey_scene_is_diffracted_right_to_second_order_by_one_wavelength_a_channel() -> None:
    difference, contrast = spread_of(cube(), LENS, 1)
    assert np.all(difference < SECOND_ORDER * contrast)


@pytest.mark.parametrize("parts", [1, 2, 4])
@pytest.mark.parametrize("f_number", [1.4, 2.8, 4.0, 8.0])
def test_strong_colours_are_diffracted_within_the_bound_by_contrast(f_number: float, parts: int) -> None:
    lens = replace(LENS, f_number=f_number)
    tint_per_nm = 0.01
    difference, contrast = spread_of(cube(tint_per_nm=tint_per_nm), lens, parts)
    bound, working = 0.0, working_f_number(f_number, lens.magnification)
    frequencies = np.linspace(0.0, 0.5 / 1.4e-6, 100)
    ones = cube(rows=1, cols=1)
    plain = counted(ones, parts).wavelength_nm
    for slope in (-tint_per_nm, tint_per_nm):
        tinted = counted(ones, parts, light=np.exp(slope * (GRID.centres_nm - 550.0))).wavelength_nm
        for pair in zip(plain, tinted, strict=True):
            one, other = (diffraction_otf(frequencies, wavelength_nm=float(nm), f_number=working) for nm in pair)
            bound = max(bound, float(np.abs(one - other).max()))
    assert np.all(difference < (bound + SECOND_ORDER) * contrast)


def test_cutting_channels_brings_them_closer() -> None:
    radiance, lens = cube(tint_per_nm=0.01), replace(LENS, f_number=4.0)
    worst = [float((difference / contrast).max()) for difference, contrast in (spread_of(radiance, lens, n) for n in (1, 2, 4))]
    assert worst[0] > 1.7 * worst[1] > 1.7**2 * worst[2]


def test_light_stays_zero_or_more_and_is_not_modified() -> None:
    light = counted(cube())
    light.electrons[:, 10, 10] = 1e25
    before = light.electrons.copy()
    image = form_channel_image(light, LENS, IDEAL_LENS)
    np.testing.assert_array_equal(light.electrons, before)
    assert np.all(np.isfinite(image.electrons))
    assert image.electrons.min() >= 0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -1.0])
def test_light_that_is_no_light_is_refused(bad: float) -> None:
    light = counted(cube())
    light.electrons[1, 2, 3] = bad
    with pytest.raises(FieldError, match="must be finite and >= 0"):
        form_channel_image(light, LENS, IDEAL_LENS)


NEED_SPECTRA = [
    OpticsOptions(psf=gaussian_psf(4e-6)),
    OpticsOptions(wavefront=Wavefront(((4, 1e-7),))),
    OpticsOptions(aperture=Aperture(blades=6)),
    OpticsOptions(depth_z_m=np.ones((40, 56), np.float32)),
]


@pytest.mark.parametrize("options", NEED_SPECTRA, ids=["psf", "wavefront", "aperture", "layers"])
def test_lens_whose_point_image_depends_on_the_wavelength_is_refused(options: OpticsOptions) -> None:
    assert channels_suffice(IDEAL_LENS)
    assert not channels_suffice(options)
    with pytest.raises(FieldError, match="render spectral bands"):
        form_channel_image(counted(cube()), LENS, options)
