"""The clear sky's interface: geometry of the map, limits, errors, and what its light must be whatever the air."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.radiometry import SkyRadiance, clear_sky
from fullwell.radiometry.atmosphere import aerosol_phase, air_mass, clear_atmosphere, ozone_air_mass, rayleigh_phase

ROUNDING = 1e-12
SINGLE = 1e-4
"""Coefficients are single precision and the brightest of them cancel a little."""

QUADRATURE = 0.03
"""A map of 64 rows against Gauss points: at 1000 nm, the horizon's last degree is too steep for rows of 2.8 degrees."""


def _sun(elevation_deg: float, azimuth_deg: float = 30.0) -> tuple[float, float, float]:
    elevation, azimuth = math.radians(elevation_deg), math.radians(azimuth_deg)
    return math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)


def _sky(elevation_deg: float = 40.0, azimuth_deg: float = 30.0, *, turbidity: float = 3.0, albedo: float = 0.2) -> SkyRadiance:
    return clear_sky(_sun(elevation_deg, azimuth_deg), turbidity=turbidity, ground_albedo=albedo)


def test_the_shapes_are_those_that_are_promised() -> None:
    sky = clear_sky(_sun(40), turbidity=3, ground_albedo=0.2, rows=20, cols=36)
    components, count = sky.basis.shape
    assert sky.coefficients.shape == (20, 36, components)
    assert sky.coefficients.dtype == np.float32
    assert sky.wavelength_nm.shape == sky.sun_radiance.shape == sky.ground_radiance.shape == (count,)
    assert sky.radiance().shape == (20, 36, count)
    assert np.linalg.norm(sky.sun_direction) == pytest.approx(1.0, rel=ROUNDING)


def test_the_table_covers_every_grid_of_a_recipe() -> None:
    wavelength_nm = _sky().wavelength_nm
    assert np.all(np.diff(wavelength_nm) > 0)
    assert wavelength_nm[0] <= 360
    assert wavelength_nm[-1] >= 1000


@pytest.mark.parametrize("azimuth_deg", [0.0, 47.0, 180.0, 271.0])
def test_the_sky_is_brightest_in_the_pixel_that_holds_the_sun(azimuth_deg: float) -> None:
    bright = _sky(40, azimuth_deg).radiance()[..., 20]
    row, col = np.unravel_index(np.argmax(bright), bright.shape)
    assert abs((row + 0.5) * 180 / 64 - 50) <= 180 / 64
    assert abs(((col + 0.5) * 360 / 128 - azimuth_deg + 180) % 360 - 180) <= 360 / 128


def test_a_sun_turned_by_a_column_turns_the_map_by_a_column() -> None:
    here, there = _sky(25, 30.0).radiance(), _sky(25, 30.0 + 5 * 360 / 128).radiance()
    np.testing.assert_allclose(np.roll(here, 5, axis=1), there, rtol=SINGLE)


def test_the_map_is_a_mirror_about_the_sun() -> None:
    sky = _sky(25, 0.0).radiance()
    np.testing.assert_allclose(sky, sky[:, ::-1], rtol=SINGLE)


def test_a_sun_at_the_zenith_lights_all_azimuths_alike() -> None:
    sky = _sky(90).radiance()[:32]
    np.testing.assert_allclose(sky, np.broadcast_to(sky[:, :1], sky.shape), rtol=SINGLE)


def test_there_is_no_sky_below_the_horizon() -> None:
    assert np.all(_sky().coefficients[32:] == 0)


@pytest.mark.parametrize("turbidity", [1.0, 3.0, 10.0])
@pytest.mark.parametrize("elevation_deg", [0.0, 5.0, 90.0])
@pytest.mark.parametrize("albedo", [0.0, 1.0])
def test_radiance_is_finite_and_positive_everywhere(turbidity: float, elevation_deg: float, albedo: float) -> None:
    sky = _sky(elevation_deg, turbidity=turbidity, albedo=albedo)
    upper = sky.radiance()[:32]
    assert np.all(np.isfinite(upper))
    assert np.all(upper > 0)
    assert np.all(sky.sun_radiance >= 0)
    assert np.all(sky.ground_radiance >= 0)


def test_the_basis_keeps_almost_all_of_the_radiance(monkeypatch: pytest.MonkeyPatch) -> None:
    from fullwell.radiometry import sky as module

    coarse = _sky(2.0).radiance()[:32]
    monkeypatch.setattr(module, "_COMPONENTS", 54)
    fine = _sky(2.0).radiance()[:32]
    error = coarse / fine - 1
    assert np.sqrt(np.mean(error**2)) < 1e-3
    assert np.abs(error[..., 3:]).max() < 0.06  # from 380 nm, where recipes begin


def test_two_calls_give_the_same_bytes() -> None:
    assert _sky().coefficients.tobytes() == _sky().coefficients.tobytes()
    assert _sky().basis.tobytes() == _sky().basis.tobytes()


def test_the_length_of_the_direction_does_not_matter() -> None:
    short, long = _sky(), clear_sky(5 * np.array(_sun(40)), turbidity=3, ground_albedo=0.2)
    assert long.sky_irradiance() == pytest.approx(short.sky_irradiance(), rel=1e-9)


def test_the_ground_reflects_its_albedo_of_what_it_gets() -> None:
    sky = _sky(albedo=0.7)
    arriving = sky.sun_irradiance() * sky.sun_direction[2] + sky.sky_irradiance()
    assert np.pi * sky.ground_radiance == pytest.approx(0.7 * arriving, rel=QUADRATURE)
    assert np.all(_sky(albedo=0.0).ground_radiance == 0)


def test_a_brighter_ground_brightens_the_whole_sky_and_not_the_sun() -> None:
    dark, bright = _sky(albedo=0.0), _sky(albedo=0.8)
    assert np.all(bright.radiance()[:32] > dark.radiance()[:32])
    assert bright.sun_radiance == pytest.approx(dark.sun_radiance, rel=ROUNDING)


def test_haze_takes_from_the_sun_and_gives_to_the_sky() -> None:
    skies = [_sky(45, turbidity=turbidity) for turbidity in (1, 2, 4, 8)]
    assert np.all(np.diff([sky.sun_radiance for sky in skies], axis=0) < 0)
    assert np.all(np.diff([sky.sky_irradiance()[15:] for sky in skies], axis=0) > 0)


@pytest.mark.slow
def test_light_is_smooth_in_the_suns_elevation() -> None:
    elevations_deg = np.arange(0.0, 90.1, 2.0)
    irradiance = np.log([_sky(elevation_deg).sky_irradiance()[[5, 20, 40]] for elevation_deg in elevations_deg])
    step = np.diff(irradiance, axis=0)
    assert np.all(step[:30] > 0)
    # A kink of some per cent in two degrees would show in the second difference; near the horizon light turns as fast itself.
    assert np.abs(np.diff(step[6:], axis=0)).max() < 0.03
    near, far = (_sky(elevation_deg).radiance()[:32] for elevation_deg in (20.0, 20.001))
    np.testing.assert_allclose(far, near, rtol=2e-3)


def test_the_air_mass_is_one_at_the_zenith_and_38_at_the_horizon() -> None:
    assert air_mass(1.0) == pytest.approx(1.0, abs=1e-3)
    assert air_mass(0.5) == pytest.approx(1.994, abs=1e-3)
    assert air_mass(0.0) == pytest.approx(38.0, abs=0.2)
    assert ozone_air_mass(1.0) == pytest.approx(1.0, abs=1e-4)
    assert ozone_air_mass(0.0) == pytest.approx(12.1, abs=0.1)


def test_phase_functions_have_mean_one() -> None:
    points, weights = np.polynomial.legendre.leggauss(200)
    assert 0.5 * weights @ rayleigh_phase(points) == pytest.approx(1.0, rel=ROUNDING)
    assert 0.5 * weights @ aerosol_phase(points) == pytest.approx(1.0, rel=1e-9)
    assert 0.5 * weights @ (points * aerosol_phase(points)) == pytest.approx(0.65, rel=1e-9)


def test_the_layers_add_up_to_the_atmosphere() -> None:
    atmosphere = clear_atmosphere(3.0)
    at_550 = int(np.flatnonzero(atmosphere.wavelength_nm == 550.0)[0])
    assert atmosphere.rayleigh_depth[at_550].sum() == pytest.approx(0.0987, abs=5e-4)
    beta = 0.04608365822050 * 3.0 - 0.04586025928522
    assert atmosphere.aerosol_depth[at_550].sum() == pytest.approx(beta * 0.55**-1.3, rel=1e-9)


def test_turbidity_one_is_air_alone() -> None:
    assert clear_atmosphere(1.0).aerosol_depth.sum(axis=1).max() < 1e-3


@pytest.mark.parametrize(
    ("field", "change"),
    [
        ("sun_direction", {"sun_direction": (0.0, 1.0, -0.1)}),
        ("sun_direction", {"sun_direction": (0.0, 0.0, 0.0)}),
        ("sun_direction", {"sun_direction": (0.0, math.nan, 1.0)}),
        ("sun_direction", {"sun_direction": (0.0, 1.0)}),
        ("turbidity", {"turbidity": 0.9}),
        ("turbidity", {"turbidity": math.nan}),
        ("ground_albedo", {"ground_albedo": 1.1}),
        ("rows", {"rows": 7}),
        ("cols", {"cols": 0}),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(field: str, change: dict[str, object]) -> None:
    arguments = {"sun_direction": (0.0, 0.0, 1.0), "turbidity": 3.0, "ground_albedo": 0.2} | change
    with pytest.raises(FieldError) as caught:
        clear_sky(**arguments)  # type: ignore[arg-type]
    assert caught.value.path == field
    assert field in str(caught.value)
