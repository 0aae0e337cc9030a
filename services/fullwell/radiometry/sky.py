"""Radiance of the sun and of the clear sky, 350 to 1040 nm, from the scattering of air and aerosol (docs/physics/sky.md)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError
from fullwell.radiometry.atmosphere import (
    SUN_RADIUS_RAD,
    TURBIDITY_RANGE,
    Atmosphere,
    aerosol_phase,
    air_mass,
    clear_atmosphere,
    ozone_air_mass,
    rayleigh_phase,
)
from fullwell.radiometry.scattering import (
    DiffuseLight,
    light_from_below,
    light_from_sun,
    single_scattering,
    stream_sines,
    stream_weights,
)

__all__ = ["SkyRadiance", "clear_sky"]

Array = NDArray[np.float64]

_COMPONENTS: Final = 10
"""Spectral basis curves: 0.06 % of a direction's radiance is lost (rms), 5 % at worst, deep in a band near sunset."""

_MASS_OF_REFLECTED_LIGHT: Final = 1.8
"""Air masses that light passes on its way from the ground up and back (bird1984, eq. 3-8)."""


@dataclass(frozen=True, slots=True, eq=False)
class SkyRadiance:
    """Sun and clear sky above one place, x east, y north, z up.

    Attributes
    ----------
    wavelength_nm
        (n,), 350 to 1040 nm, not evenly spaced; linear in between.
    basis
        (components, n) [W m^-2 sr^-1 nm^-1]. The radiance of a direction is its coefficients times the basis; curves after the
        first have negative parts, the sum has none.
    coefficients
        (rows, cols, components). Row r is centred pi (r + 0.5) / rows from the zenith; column c is centred
        2 pi (c + 0.5) / cols counter-clockwise from +x seen from above, in the world and not from the sun. 0 below the horizon,
        the lower half of the rows. The sun's disk is left out, its aureole is in.
    sun_direction
        Unit vector towards the sun.
    sun_radius_rad
        Angular radius of the disk.
    sun_radiance
        (n,) [W m^-2 sr^-1 nm^-1], mean over the disk, below the atmosphere. No limb darkening.
    ground_radiance
        (n,) [W m^-2 sr^-1 nm^-1], of a flat Lambertian ground of `ground_albedo` in that light; its light in the sky is in
        `coefficients`, itself it is not.
    """

    wavelength_nm: Array
    basis: Array
    coefficients: NDArray[np.float32]
    sun_direction: tuple[float, float, float]
    sun_radius_rad: float
    sun_radiance: Array
    ground_radiance: Array

    def radiance(self) -> Array:
        """Return the radiance of the whole sphere (rows, cols, n) [W m^-2 sr^-1 nm^-1], the sun's disk left out."""
        return np.asarray(self.coefficients.astype(np.float64) @ self.basis)

    def sky_irradiance(self) -> Array:
        """Return the sky's irradiance on horizontal ground (n,) [W m^-2 nm^-1], each pixel its centre's radiance."""
        rows, cols = self.coefficients.shape[:2]
        edges = np.linspace(0.0, np.pi, rows + 1)[: rows // 2 + 1]
        projected_sr = np.diff(np.sin(edges) ** 2) / 2.0 * (2.0 * np.pi / cols)
        upper = self.coefficients[: rows // 2].astype(np.float64).sum(axis=1)
        return np.asarray((projected_sr @ upper) @ self.basis)

    def sun_irradiance(self) -> Array:
        """Return the sun's irradiance on a card that faces it (n,) [W m^-2 nm^-1]."""
        return np.asarray(self.sun_radiance * np.pi * math.sin(self.sun_radius_rad) ** 2)


def clear_sky(
    sun_direction: ArrayLike, *, turbidity: float, ground_albedo: float, rows: int = 64, cols: int = 128
) -> SkyRadiance:
    """Return the radiance of the sun and of the clear sky for a sun between the horizon and the zenith.

    Parameters
    ----------
    sun_direction
        (3,), towards the sun, of any length; z >= 0.
    turbidity
        1 (air alone) to 10 (haze); 2 to 3 is a clear day. As in preetham1999.
    ground_albedo
        Reflectance of the ground all around, in [0, 1], the same at all wavelengths.
    rows, cols
        Size of the map of the whole sphere; rows must be even, so that the horizon falls between two of them.

    Returns
    -------
    Sea level, 0.344 atm-cm of ozone, 1.42 cm of water, mean distance of the sun. Polarisation, refraction, clouds and the glow
    of twilight are left out.

    Raises
    ------
    FieldError
        An argument is not finite or out of range.
    """
    direction = _checked_direction(sun_direction)
    _check_range("turbidity", turbidity, *TURBIDITY_RANGE)
    _check_range("ground_albedo", ground_albedo, 0.0, 1.0)
    _check_size(rows, cols)
    turbidity, sine = float(turbidity), float(direction[2])
    atmosphere = clear_atmosphere(turbidity)
    view_sines = tuple(np.cos((np.arange(rows // 2) + 0.5) * np.pi / rows).tolist())
    light = light_from_sun(turbidity, sine_of_elevation=sine, view_sines=view_sines)
    outside = atmosphere.extraterrestrial_irradiance * atmosphere.ozone_transmittance(ozone_air_mass(sine))
    direct = outside * _direct_transmittance(atmosphere, sine)
    diffuse = outside * _diffuse_irradiance(light, _scattered_once(turbidity, sine, stream_sines()))
    below = light_from_below(turbidity, view_sines)
    back = _gases_of_reflected_light(atmosphere, sine)
    ground = ground_albedo / np.pi * (sine * direct + diffuse) / (1.0 - ground_albedo * below.albedo * back)
    once = _scattered_once(turbidity, sine, view_sines)
    upper = outside * _sky_of_the_sun(once, light.multiple, direction=direction, view_sines=view_sines, cols=cols)
    upper += (ground * back * below.radiance)[:, None, :]
    basis, coefficients = _factorised(upper)
    return SkyRadiance(
        wavelength_nm=atmosphere.wavelength_nm,
        basis=basis,
        coefficients=np.concatenate([coefficients, np.zeros_like(coefficients)]),
        sun_direction=(float(direction[0]), float(direction[1]), sine),
        sun_radius_rad=SUN_RADIUS_RAD,
        sun_radiance=direct / (np.pi * math.sin(SUN_RADIUS_RAD) ** 2),
        ground_radiance=ground,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _ScatteredOnce:
    """Light scattered once towards each view (views, n) [sr^-1], per unit of the sun's irradiance and of the phase function.

    `gases` (views, n): what absorbing gases leave of it, already taken off `air` and `aerosol`.
    """

    air: Array
    aerosol: Array
    gases: Array


def _scattered_once(turbidity: float, sine: float, view_sines: tuple[float, ...]) -> _ScatteredOnce:
    atmosphere = clear_atmosphere(turbidity)
    sun_mass, masses = float(air_mass(sine)), air_mass(view_sines)
    air, aerosol = single_scattering(turbidity, sun_mass=sun_mass, view_masses=masses)
    paths = [sun_mass * above + masses[:, None] * (1.0 - above) for above in (atmosphere.water_above, atmosphere.air_above)]
    passed = np.moveaxis(atmosphere.gas_transmittance(paths[0][..., None], paths[1][..., None]), 2, 1)
    kept = np.sum((air + aerosol) * passed, axis=2)
    return _ScatteredOnce(
        air=np.sum(air * passed, axis=2),
        aerosol=np.sum(aerosol * passed, axis=2),
        gases=kept / np.sum(air + aerosol, axis=2),
    )


def _direct_transmittance(atmosphere: Atmosphere, sine: float) -> Array:
    mass = float(air_mass(sine))
    return atmosphere.scattering_transmittance(mass) * atmosphere.gas_transmittance(mass, mass)


def _gases_of_reflected_light(atmosphere: Atmosphere, sine: float) -> Array:
    """Return what gases leave of light on its way from the ground up and back, after the way from the sun, (n,)."""
    mass = float(air_mass(sine))
    longer = mass + _MASS_OF_REFLECTED_LIGHT
    return np.asarray(atmosphere.gas_transmittance(longer, longer) / atmosphere.gas_transmittance(mass, mass))


def _diffuse_irradiance(light: DiffuseLight, once: _ScatteredOnce) -> Array:
    return np.asarray(2.0 * np.pi * stream_weights() @ (light.stream_radiance * once.gases))


def _sky_of_the_sun(
    once: _ScatteredOnce, multiple: Array, *, direction: Array, view_sines: tuple[float, ...], cols: int
) -> Array:
    """Return the radiance of the upper rows (views, cols, n) [sr^-1] per unit irradiance of the sun, above black ground."""
    azimuth = (np.arange(cols) + 0.5) * 2.0 * np.pi / cols
    from_sun = azimuth - math.atan2(direction[1], direction[0])
    up = np.array(view_sines)[:, None]
    cosine = up * direction[2] + np.sqrt(1.0 - up**2) * math.hypot(direction[0], direction[1]) * np.cos(from_sun)
    radiance = np.tensordot(np.cos(from_sun[:, None] * np.arange(len(multiple))), multiple, axes=1)
    radiance = np.moveaxis(radiance, 0, 1) * once.gases[:, None, :]
    radiance += rayleigh_phase(cosine)[..., None] * once.air[:, None, :]
    radiance += aerosol_phase(cosine)[..., None] * once.aerosol[:, None, :]
    # A cut series of cosines could ripple below 0 where there is next to no light; it does not in the range that is tested.
    return np.asarray(np.maximum(radiance, 0.0))


def _factorised(radiance: Array) -> tuple[Array, NDArray[np.float32]]:
    """Return basis (components, n) and coefficients (rows, cols, components) of a positive radiance (rows, cols, n).

    Each direction and each wavelength is first divided by its mean, so that what is left out is small relative to every value.
    """
    rows, cols, count = radiance.shape
    flat = radiance.reshape(-1, count)
    spectrum = flat.mean(axis=0)
    brightness = np.mean(flat / spectrum, axis=1)
    relative = flat / spectrum / brightness[:, None]
    _, vectors = np.linalg.eigh(relative.T @ relative)
    vectors = vectors[:, ::-1][:, :_COMPONENTS]
    vectors = vectors * np.where(vectors.sum(axis=0) < 0, -1.0, 1.0)  # an eigenvector's sign is not defined
    coefficients = (relative @ vectors) * brightness[:, None]
    basis = vectors.T * spectrum
    return basis, coefficients.reshape(rows, cols, -1).astype(np.float32)


def _checked_direction(sun_direction: ArrayLike) -> Array:
    direction = np.asarray(sun_direction, dtype=np.float64)
    if direction.shape != (3,) or not np.all(np.isfinite(direction)) or not np.linalg.norm(direction) > 0:
        raise FieldError(
            f"sun_direction is {direction.tolist()}; must be three finite numbers, not all 0.", path="sun_direction"
        )
    if direction[2] < 0:
        raise FieldError(
            f"sun_direction is {direction.tolist()}; its z must be >= 0. The model ends where the sun sets.",
            path="sun_direction",
        )
    return np.asarray(direction / np.linalg.norm(direction))


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise FieldError(f"{name} is {value}; must be within {low:g} to {high:g}.", path=name, value=value)


def _check_size(rows: int, cols: int) -> None:
    if rows < 2 or rows % 2:
        raise FieldError(f"rows is {rows}; must be even and >= 2, so that the horizon is an edge.", path="rows", value=rows)
    if cols < 1:
        raise FieldError(f"cols is {cols}; must be >= 1.", path="cols", value=cols)
