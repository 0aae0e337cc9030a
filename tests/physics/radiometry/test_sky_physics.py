"""The clear sky against closed forms, conservation of energy, a Monte Carlo of photons, and published figures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from fullwell.radiometry import (
    SkyRadiance,
    Spectrum,
    WavelengthGrid,
    chromaticity,
    clear_sky,
    correlated_colour_temperature_k,
    illuminance_lux,
    luminance_cd_m2,
)
from fullwell.radiometry.atmosphere import (
    AEROSOL_LOBES,
    Atmosphere,
    aerosol_phase,
    air_mass,
    clear_atmosphere,
    ozone_air_mass,
    rayleigh_phase,
)
from fullwell.radiometry.scattering import (
    STREAMS,
    _legendre,
    _moments,
    _phase,
    light_from_below,
    light_from_sun,
    single_scattering,
)

Array = NDArray[np.float64]

SERIES = 1e-5
"""What the geometric tail of the orders of scattering leaves out; measured 2e-6 at turbidity 10, 2e-8 at 3."""

SIGMAS = 4.0
"""Nine figures are compared: chance goes beyond 4 standard errors once in 1700 runs, and the seed is fixed."""


def _sky(elevation_deg: float, *, turbidity: float = 3.0, albedo: float = 0.2) -> SkyRadiance:
    elevation = math.radians(elevation_deg)
    return clear_sky((math.cos(elevation), 0.0, math.sin(elevation)), turbidity=turbidity, ground_albedo=albedo)


def _spectrum(sky: SkyRadiance, values: Array) -> Spectrum:
    return Spectrum(sky.wavelength_nm, values, outside="zero")


def _row(sky: SkyRadiance, wavelength_nm: float) -> int:
    return int(np.flatnonzero(sky.wavelength_nm == wavelength_nm)[0])


def _band_irradiance(sky: SkyRadiance, values: Array, low_nm: float, high_nm: float) -> float:
    middle_nm, width_nm = (low_nm + high_nm) / 2, high_nm - low_nm
    return float(_spectrum(sky, values).band_average(WavelengthGrid(middle_nm, middle_nm, width_nm))[0]) * width_nm


# Closed forms --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("elevation_deg", [0.0, 20.0, 70.0])
def test_light_taken_once_from_the_beam_is_the_closed_form(elevation_deg: float) -> None:
    sun_mass = float(air_mass(math.sin(math.radians(elevation_deg))))
    mass = air_mass([1.0, 0.5, 0.02])[:, None]
    atmosphere = clear_atmosphere(3.0)
    air, aerosol = single_scattering(3.0, sun_mass=sun_mass, view_masses=mass[:, 0])
    depth = atmosphere.depth.sum(axis=1)
    expected = mass / (sun_mass - mass) * (np.exp(-mass * depth) - np.exp(-sun_mass * depth)) / (4 * np.pi)
    scattered_and_absorbed = air.sum(axis=2) + aerosol.sum(axis=2) / atmosphere.aerosol_albedo
    assert scattered_and_absorbed == pytest.approx(expected, rel=1e-9)


def test_the_phase_function_is_the_sum_of_its_azimuthal_parts() -> None:
    rng = np.random.default_rng(1)
    to, since, azimuth = rng.uniform(-1, 1, 20), rng.uniform(-1, 1, 30), rng.uniform(0, 2 * np.pi, 1)[0]
    air, _ = _moments()
    parts = _phase(air, _legendre(to), _legendre(since))
    modes = np.arange(2 * STREAMS)
    found = np.tensordot(np.where(modes == 0, 1.0, 2.0) * np.cos(modes * azimuth), parts, axes=1)
    sines = np.sqrt(1 - to**2)[:, None] * np.sqrt(1 - since**2)
    assert found == pytest.approx(rayleigh_phase(to[:, None] * since + sines * np.cos(azimuth)), rel=1e-12)


def test_the_direct_beam_is_the_product_of_the_published_transmittances() -> None:
    sky = _sky(30.0)
    at = _row(sky, 500.0)
    mass, ozone_mass = float(air_mass(0.5)), ozone_air_mass(0.5)
    rayleigh = 1 / (0.5**4 * (115.6406 - 1.335 / 0.5**2))
    aerosol = (0.04608365822050 * 3 - 0.04586025928522) * 0.5**-1.3
    expected = 1.909 * math.exp(-mass * (rayleigh + aerosol)) * math.exp(-0.03 * 0.344 * ozone_mass)
    assert sky.sun_irradiance()[at] == pytest.approx(expected, rel=1e-9)


# Conservation --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turbidity", [1.0, 3.0, 10.0])
@pytest.mark.parametrize("elevation_deg", [0.0, 2.0, 10.0, 45.0, 90.0])
def test_what_comes_in_goes_down_goes_up_or_is_absorbed(turbidity: float, elevation_deg: float) -> None:
    sine = math.sin(math.radians(elevation_deg))
    light = light_from_sun(turbidity, sine_of_elevation=sine, view_sines=(1.0,))
    intercepted = 1.0 / float(air_mass(sine))
    direct = clear_atmosphere(turbidity).scattering_transmittance(1.0 / intercepted) * intercepted
    total = direct + light.irradiance + light.lost_upwards + light.absorbed
    assert total == pytest.approx(np.full_like(total, intercepted), rel=SERIES)
    assert np.all(light.absorbed >= 0)


@pytest.mark.parametrize("albedo", [0.0, 0.5, 1.0])
def test_no_more_light_reaches_the_ground_than_interreflection_can_give(albedo: float) -> None:
    sky = _sky(60.0, albedo=albedo)
    outside = clear_atmosphere(3.0).extraterrestrial_irradiance * math.sin(math.radians(60.0))
    kept = (1.0 - albedo) * (sky.sun_irradiance() * sky.sun_direction[2] + sky.sky_irradiance())
    assert np.all(kept < outside)
    sent_back = light_from_below(3.0, (1.0,)).albedo
    assert np.all((sent_back > 0) & (sent_back < 0.5))


# A Monte Carlo of photons --------------------------------------------------------------------------------------------


def _turned(cosine: Array, scattering_cosine: Array, azimuth: Array) -> Array:
    """Return the cosine from the vertical after a turn by an angle about a photon's direction."""
    sines = np.sqrt(np.maximum(0.0, 1 - cosine**2)) * np.sqrt(np.maximum(0.0, 1 - scattering_cosine**2))
    return np.clip(cosine * scattering_cosine + sines * np.cos(azimuth), -1, 1)


def _drawn_cosine(phase: object, rng: np.random.Generator, count: int) -> Array:
    cosine = np.linspace(-1, 1, 20001)
    density = phase(cosine)  # type: ignore[operator]
    below = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2)])
    return np.asarray(np.interp(rng.random(count) * below[-1], below, cosine))


def _photons(atmosphere: Atmosphere, at: int, *, sine: float, count: int, rng: np.random.Generator) -> Array:
    """Return the fates of photons (downward scattered, upward scattered, absorbed) as their share of what comes in, (3,)."""
    edges = np.concatenate([[0.0], np.cumsum(atmosphere.depth[at])])
    share_of_air = atmosphere.rayleigh_depth[at] / atmosphere.depth[at]
    depth, cosine = np.zeros(count), np.full(count, -sine)
    fate = np.zeros(3)
    unscattered = True
    while len(depth):
        depth = depth - cosine * rng.exponential(size=len(depth))
        down, up = depth >= edges[-1], depth <= 0
        fate += [0 if unscattered else down.sum(), up.sum(), 0]
        depth, cosine = depth[~(down | up)], cosine[~(down | up)]
        unscattered = False
        layer = np.clip(np.searchsorted(edges, depth) - 1, 0, len(share_of_air) - 1)
        by_air = rng.random(len(depth)) < share_of_air[layer]
        kept = by_air | (rng.random(len(depth)) < atmosphere.aerosol_albedo[at])
        fate[2] += np.sum(~kept)
        depth, cosine, by_air = depth[kept], cosine[kept], by_air[kept]
        turn = np.where(by_air, *(_drawn_cosine(phase, rng, len(depth)) for phase in (rayleigh_phase, aerosol_phase)))
        cosine = _turned(cosine, turn, rng.uniform(0, 2 * np.pi, len(depth)))
    return fate / count


@pytest.mark.parametrize(("turbidity", "wavelength_nm", "sine"), [(1.0, 400.0, 0.5), (5.0, 400.0, 0.8), (5.0, 860.0, 0.9)])
def test_successive_orders_agree_with_photons_traced_one_by_one(turbidity: float, wavelength_nm: float, sine: float) -> None:
    atmosphere = clear_atmosphere(turbidity)
    at = int(np.flatnonzero(atmosphere.wavelength_nm == wavelength_nm)[0])
    count = 200_000
    # The air mass formula is not exactly 1 / sine; photons fly along the angle that has the formula's air mass.
    mass = float(air_mass(sine))
    found = _photons(atmosphere, at, sine=1 / mass, count=count, rng=np.random.default_rng(7))
    light = light_from_sun(turbidity, sine_of_elevation=sine, view_sines=(1.0,))
    expected = np.array([light.irradiance[at], light.lost_upwards[at], light.absorbed[at]]) * mass
    standard_error = np.sqrt(expected * (1 - expected) / count)
    assert np.all(np.abs(found - expected) < SIGMAS * standard_error)


# Published figures ---------------------------------------------------------------------------------------------------

G173_DIRECT_W_M2 = {
    (400, 500): 115.7,
    (500, 600): 134.4,
    (600, 700): 126.5,
    (700, 800): 104.0,
    (800, 900): 88.1,
    (900, 1000): 53.1,
}
"""Direct normal irradiance of astmg173, air mass 1.5, integrated over bands of its table."""

G173_TURBIDITY = 1.7356
"""Aerosol of optical depth 0.084 at 500 nm, that of the standard."""

G173_TOLERANCE = 0.06
"""The absorption bands are tabulated in 10 nm steps; measured 4.7 % in the water bands, 3 % elsewhere at most."""


@pytest.mark.parametrize("band_nm", list(G173_DIRECT_W_M2))
def test_the_sun_at_air_mass_1_5_is_that_of_the_standard(band_nm: tuple[int, int]) -> None:
    sky = _sky(41.81, turbidity=G173_TURBIDITY)
    assert _band_irradiance(sky, sky.sun_irradiance(), *band_nm) == pytest.approx(G173_DIRECT_W_M2[band_nm], rel=G173_TOLERANCE)


def test_the_sun_at_air_mass_1_5_has_619_watts_per_square_metre_between_400_and_1000_nm() -> None:
    sky = _sky(41.81, turbidity=G173_TURBIDITY)
    assert _band_irradiance(sky, sky.sun_irradiance(), 400, 1000) == pytest.approx(618.7, rel=0.02)


def _diffuse_of_bird_and_riordan(turbidity: float, sine: float, albedo: float) -> Array:
    """Return the diffuse horizontal irradiance of bird1984, eqs. 3-1 to 3-17, (n,) [W m^-2 nm^-1]."""
    atmosphere = clear_atmosphere(turbidity)
    mass = float(air_mass(sine))
    rayleigh, aerosol = atmosphere.rayleigh_depth.sum(axis=1), atmosphere.aerosol_depth.sum(axis=1)
    omega, wavelength_nm = atmosphere.aerosol_albedo, atmosphere.wavelength_nm
    log = math.log(1 - sum(weight * g for weight, g in AEROSOL_LOBES))
    first = log * (1.459 + log * (0.1595 + log * 0.4129))
    second = log * (0.0783 + log * (-0.3824 - log * 0.5874))
    forward, forward_18 = (1 - 0.5 * math.exp((first + second * c) * c) for c in (sine, 1 / 1.8))
    reflected = (
        atmosphere.gas_transmittance(1.8, 1.8)
        * np.exp(-(1 - omega) * aerosol * 1.8)
        * (0.5 * (1 - np.exp(-1.8 * rayleigh)) + (1 - forward_18) * np.exp(-1.8 * rayleigh) * -np.expm1(-omega * aerosol * 1.8))
    )
    gases = atmosphere.gas_transmittance(mass, mass) * atmosphere.ozone_transmittance(ozone_air_mass(sine))
    common = atmosphere.extraterrestrial_irradiance * sine * gases * np.exp(-(1 - omega) * aerosol * mass)
    by_air = common * (1 - np.exp(-0.95 * rayleigh * mass)) * 0.5
    by_aerosol = common * np.exp(-1.5 * rayleigh * mass) * -np.expm1(-omega * aerosol * mass) * forward
    direct = common * np.exp(-mass * (rayleigh + omega * aerosol))
    by_ground = (direct + by_air + by_aerosol) * reflected * albedo / (1 - reflected * albedo)
    correction = np.where(wavelength_nm <= 450, ((wavelength_nm + 550) / 1000) ** 1.8, 1.0)
    return np.asarray((by_air + by_aerosol + by_ground) * correction)


@pytest.mark.parametrize("turbidity", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("elevation_deg", [30.0, 60.0, 90.0])
def test_the_skys_irradiance_is_near_that_of_bird_and_riordan(turbidity: float, elevation_deg: float) -> None:
    # Theirs was fitted to rigorous codes to about a tenth; the worst measured here is 20 %, at 400 nm and 30 deg.
    sky = _sky(elevation_deg, turbidity=turbidity)
    theirs = _diffuse_of_bird_and_riordan(turbidity, sky.sun_direction[2], 0.2)
    assert sky.sky_irradiance()[5:-4] == pytest.approx(theirs[5:-4], rel=0.22)
    ours, total = (_band_irradiance(sky, values, 400, 1000) for values in (sky.sky_irradiance(), theirs))
    assert ours == pytest.approx(total, rel=0.09)


def _usno_illuminance_lux(elevation_deg: float) -> float:
    """Return clear daylight on horizontal ground (janiczek1987), sun at 5 to 90 deg."""
    x = elevation_deg / 90
    high, low = (3.74, 3.97, -4.07, 1.47), (3.05, 13.28, -45.98, 64.33)
    return 10 ** sum(c * x**k for k, c in enumerate(high if elevation_deg >= 20 else low))


@pytest.mark.parametrize("elevation_deg", [5.0, 10.0, 20.0, 40.0, 60.0, 90.0])
def test_daylight_on_the_ground_is_that_of_the_almanac(elevation_deg: float) -> None:
    # A mean clear day of no stated turbidity; measured +20 % at 20 deg, -6 % at 90 deg.
    sky = _sky(elevation_deg)
    total = illuminance_lux(_spectrum(sky, sky.sky_irradiance() + sky.sun_irradiance() * sky.sun_direction[2]))
    assert total == pytest.approx(_usno_illuminance_lux(elevation_deg), rel=0.25)


@pytest.mark.parametrize("elevation_deg", [20.0, 40.0, 60.0])
def test_a_clear_sky_alone_gives_ten_to_twenty_kilolux(elevation_deg: float) -> None:
    sky = _sky(elevation_deg, turbidity=2.0)
    published = 800 + 15_500 * math.sqrt(sky.sun_direction[2])  # ies1984
    assert illuminance_lux(_spectrum(sky, sky.sky_irradiance())) == pytest.approx(published, rel=0.2)


# What one sees -------------------------------------------------------------------------------------------------------


def test_the_zenith_is_blue_and_the_low_sun_is_red() -> None:
    sky = _sky(30.0)
    zenith = _spectrum(sky, sky.radiance()[0].mean(axis=0))
    assert correlated_colour_temperature_k(zenith) > 12_000
    x, y = chromaticity(zenith)
    assert x < 0.28
    assert y < 0.29
    assert 1_000 < correlated_colour_temperature_k(_spectrum(_sky(4.0), _sky(4.0).sun_radiance)) < 3_500
    assert 4_800 < correlated_colour_temperature_k(_spectrum(_sky(60.0), _sky(60.0).sun_radiance)) < 5_800


def test_the_sky_is_bright_about_the_sun_and_at_the_horizon() -> None:
    sky = _sky(40.0)
    upper = sky.radiance()[:32]
    luminance = {row: [luminance_cd_m2(_spectrum(sky, upper[row, col])) for col in (0, 64)] for row in (1, 14, 17, 31)}
    assert luminance[17][0] > 5 * luminance[1][0]  # row 17 holds the sun
    assert luminance[31][1] > 3 * luminance[14][1]


def test_nothing_breaks_at_720_nm() -> None:
    sky = _sky(30.0)
    near = (sky.wavelength_nm >= 660) & (sky.wavelength_nm <= 760)
    for values in (sky.sky_irradiance(), sky.sun_radiance, sky.radiance()[5, 40]):
        assert np.all(values[near] > 0)
        # The steepest that is left is the water band at 724 nm, a fifth deep.
        assert np.abs(np.diff(np.log(values[near]))).max() < 0.25


def test_the_near_infrared_sky_is_dark_and_contrasty() -> None:
    sky = _sky(40.0)
    relative = sky.radiance()[:32] / clear_atmosphere(3.0).extraterrestrial_irradiance
    blue, infrared = relative[..., _row(sky, 450.0)], relative[..., _row(sky, 860.0)]
    assert infrared[0].mean() < 0.25 * blue[0].mean()
    assert infrared.max() / infrared.min() > 2 * blue.max() / blue.min()


# Another model -------------------------------------------------------------------------------------------------------

HOSEK_WILKIE_LUX = {(2.0, 30.0): 12_956, (2.0, 45.0): 14_408, (2.0, 60.0): 15_209, (3.0, 45.0): 16_689}
"""Illuminance of horizontal ground by the sky of hosek2012, turbidity and elevation given, albedo 0.2, as Mitsuba 3 has it."""


@pytest.mark.parametrize(("turbidity", "elevation_deg"), list(HOSEK_WILKIE_LUX))
def test_the_sky_agrees_with_hosek_and_wilkie_within_tens_of_per_cent(turbidity: float, elevation_deg: float) -> None:
    # Measured ratios 1.03, 1.06, 1.08 and 1.32: at one turbidity, ours scatters more when the sun is high.
    sky = _sky(elevation_deg, turbidity=turbidity)
    theirs = HOSEK_WILKIE_LUX[turbidity, elevation_deg]
    assert 0.95 < illuminance_lux(_spectrum(sky, sky.sky_irradiance())) / theirs < 1.35
