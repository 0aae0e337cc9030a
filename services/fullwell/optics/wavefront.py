"""Wavefront optics: Zernike aberrations of the pupil and the point images they make."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from fullwell.core.constants import NM_PER_M
from fullwell.core.errors import FieldError
from fullwell.optics.psf import PointImage

__all__ = [
    "DEFOCUS_INDEX",
    "Wavefront",
    "defocus_coefficient_m",
    "defocus_dioptres",
    "oversampling_for",
    "pupil_grid",
    "pupil_point_image",
    "strehl_ratio",
    "wavefront_error_m",
    "wavefront_point_image",
    "zernike",
    "zernike_order",
]

DEFOCUS_INDEX: Final = 4

_ROUNDING = 1e-9
"""Relative slack for lengths that are equal but were computed in different ways."""

_FEWEST_SAMPLES, _MOST_SAMPLES = 256, 2048
"""Samples across the pupil: from an accuracy of the OTF of 5e-4 (tested) to what memory holds."""


@dataclass(frozen=True, slots=True)
class Wavefront:
    """Aberrations of a lens as Zernike coefficients.

    Attributes
    ----------
    coefficients_m
        Pairs (OSA/ANSI single index, root-mean-square wavefront error [m]). An index may appear once. A positive tilt
        moves the image right (index 2) or up (index 1) in the upright picture. Errors are lengths, equal at all wavelengths:
        their phase is 2 pi error / wavelength.
    pupil_diameter_m
        Diameter of the pupil on whose unit circle the coefficients are defined; None is the lens's own. A smaller pupil
        uses the middle of the wavefront; a larger one is refused, as polynomials grow without bound outside.
    chromatic_defocus
        Pairs (wavelength_nm, additional defocus [dioptre]) with increasing wavelengths; linear between, held beyond.
    """

    coefficients_m: tuple[tuple[int, float], ...] = ()
    pupil_diameter_m: float | None = None
    chromatic_defocus: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        indices = [index for index, _ in self.coefficients_m]
        for index, value in self.coefficients_m:
            zernike_order(index)
            if not math.isfinite(value):
                raise FieldError(
                    f"coefficients_m[{index}] is {value}; must be finite. Set wavefront.coefficients_m.",
                    path="coefficients_m",
                    value=value,
                )
        if len(set(indices)) != len(indices):
            raise FieldError("coefficients_m has an index twice; add the two up.", path="coefficients_m", value=str(indices))
        if self.pupil_diameter_m is not None and not 0 < self.pupil_diameter_m < math.inf:
            raise FieldError(
                f"pupil_diameter_m is {self.pupil_diameter_m}; must be > 0 and finite. Set wavefront.pupil_diameter_m.",
                path="pupil_diameter_m",
                value=self.pupil_diameter_m,
            )
        table = np.asarray(self.chromatic_defocus, dtype=np.float64).reshape(-1, 2)
        if not np.all(np.isfinite(table)) or np.any(np.diff(table[:, 0]) <= 0):
            raise FieldError(
                "chromatic_defocus must hold finite pairs (wavelength_nm, dioptre) with increasing wavelengths.",
                path="chromatic_defocus",
            )

    def defocus_at(self, wavelength_nm: float) -> float:
        """Return the additional defocus at a wavelength [dioptre]."""
        if not self.chromatic_defocus:
            return 0.0
        waves, dioptres = np.asarray(self.chromatic_defocus, dtype=np.float64).T
        return float(np.interp(wavelength_nm, waves, dioptres))


def zernike_order(index: int) -> tuple[int, int]:
    """Return (n, m) of an OSA/ANSI single index j = (n (n + 2) + m) / 2: radial order and signed azimuthal frequency.

    Raises
    ------
    FieldError
        The index is negative or beyond 230 (order 20), where the radial sums lose digits.

    References
    ----------
    thibos2002.
    """
    if not 0 <= index <= 230 or index != int(index):
        raise FieldError(
            f"Zernike index {index} must be a whole number from 0 to 230 (OSA/ANSI numbering; defocus is 4).",
            path="coefficients_m",
            value=index,
        )
    n = math.ceil((math.sqrt(9 + 8 * index) - 3) / 2)
    return n, 2 * index - n * (n + 2)


def zernike(index: int, rho: ArrayLike, theta: ArrayLike) -> NDArray[np.float64]:
    """Return the OSA/ANSI Zernike polynomial at radius `rho` of the unit disc and angle `theta` [rad], same shape.

    Normalised to a root mean square of 1 over the disc; cosines for m >= 0, sines for m < 0; theta counter-clockwise from
    the right.

    References
    ----------
    thibos2002, equations 1 to 3.
    """
    n, m = zernike_order(index)
    radius, k = np.asarray(rho, dtype=np.float64), abs(m)
    radial = np.zeros_like(radius)
    for s in range((n - k) // 2 + 1):
        sign = -1.0 if s % 2 else 1.0
        weight = math.factorial(n - s) / (
            math.factorial(s) * math.factorial((n + k) // 2 - s) * math.factorial((n - k) // 2 - s)
        )
        radial = radial + sign * weight * radius ** (n - 2 * s)
    norm = math.sqrt((n + 1) * (1 if m == 0 else 2))
    angle = np.asarray(theta, dtype=np.float64)
    return np.asarray(norm * radial * (np.cos(k * angle) if m >= 0 else np.sin(k * angle)))


def defocus_coefficient_m(dioptres: float, pupil_diameter_m: float) -> float:
    """Return the Zernike coefficient 4 [m] of a defocus in dioptre: D r^2 / (4 sqrt 3), r the pupil's radius.

    A vergence error D bends the wavefront by D rho^2 r^2 / 2; Z4 = sqrt 3 (2 rho^2 - 1).
    """
    return dioptres * (0.5 * pupil_diameter_m) ** 2 / (4.0 * math.sqrt(3.0))


def defocus_dioptres(coefficient_m: float, pupil_diameter_m: float) -> float:
    """Return the defocus [dioptre] of a Zernike coefficient 4 [m]: the inverse of `defocus_coefficient_m`."""
    return coefficient_m * 4.0 * math.sqrt(3.0) / (0.5 * pupil_diameter_m) ** 2


def wavefront_error_m(
    wavefront: Wavefront, rho: NDArray[np.float64], theta: NDArray[np.float64], *, wavelength_nm: float, pupil_diameter_m: float
) -> NDArray[np.float64]:
    """Return the wavefront error [m] at points of the lens's pupil (`rho` 1 at its rim), same shape.

    Raises
    ------
    FieldError
        The lens's pupil is wider than the one the coefficients are defined on.
    """
    defined_m = wavefront.pupil_diameter_m or pupil_diameter_m
    shrink = pupil_diameter_m / defined_m
    if shrink > 1 + _ROUNDING:
        raise FieldError(
            f"pupil_diameter_m is {defined_m} but the lens's pupil measures {pupil_diameter_m} m; Zernike polynomials must not "
            "be extrapolated. Give coefficients for the wider pupil or raise lens.f_number.",
            path="pupil_diameter_m",
            value=defined_m,
        )
    error = np.zeros_like(rho)
    for index, value in wavefront.coefficients_m:
        if value:
            error = error + value * zernike(index, rho * shrink, theta)
    dioptres = wavefront.defocus_at(wavelength_nm)
    if dioptres:
        error = error + defocus_coefficient_m(dioptres, pupil_diameter_m) * zernike(DEFOCUS_INDEX, rho, theta)
    return error


def wavefront_point_image(
    wavefront: Wavefront, *, wavelength_nm: float, f_number: float, pupil_diameter_m: float, pitch_m: float | None = None
) -> PointImage:
    """Return the image of a point through the aberrated circular pupil, with diffraction; the weights sum to 1 within 1e-9.

    Parameters
    ----------
    f_number
        The working f-number.
    pupil_diameter_m
        Of the lens [m].
    pitch_m
        Of the film: the point image comes on a spacing of at most this. None: wavelength f_number / 2.

    Notes
    -----
    |FFT of the pupil function|^2. The pupil is sampled so finely that the point image fits into the transform's window with
    twice its geometric size to spare; its OTF is then exact at the window's frequencies but for the pupil's pixelated rim.

    References
    ----------
    goodman2005, section 6.4.
    """
    samples = _samples_across(wavefront, wavelength_nm, pupil_diameter_m)
    rho, theta, amplitude = pupil_grid(samples)
    error_m = wavefront_error_m(wavefront, rho, theta, wavelength_nm=wavelength_nm, pupil_diameter_m=pupil_diameter_m)
    return pupil_point_image(
        amplitude,
        error_m,
        wavelength_nm=wavelength_nm,
        f_number=f_number,
        oversampling=oversampling_for(wavelength_nm, f_number, pitch_m),
    )


def pupil_point_image(
    amplitude: NDArray[np.float64],
    error_m: NDArray[np.float64],
    *,
    wavelength_nm: float,
    f_number: float,
    oversampling: int = 2,
) -> PointImage:
    """Return the point image of a pupil given on a square grid that just encloses it.

    Parameters
    ----------
    amplitude, error_m
        (samples, samples) amplitude transmittance >= 0 and wavefront error [m]; row 0 is the top.
    oversampling
        Samples per wavelength f_number of the point image, >= 2.
    """
    samples = len(amplitude)
    size = oversampling * samples
    pupil = amplitude * np.exp(2j * np.pi * NM_PER_M / wavelength_nm * error_m)
    # Row 0 of the pupil is its top, as in the picture, so the transform's signs agree along both axes.
    field = scipy.fft.fft2(pupil, s=(size, size), overwrite_x=True)
    power = np.fft.fftshift(field.real**2 + field.imag**2)
    # fftshift puts zero frequency at size // 2; dropping row and column 0 of an even size makes it the middle.
    middle = power[1 - size % 2 :, 1 - size % 2 :]
    return PointImage(middle / math.fsum(np.sum(middle, axis=1)), wavelength_nm / NM_PER_M * f_number / oversampling)


def strehl_ratio(wavefront: Wavefront, *, wavelength_nm: float, pupil_diameter_m: float) -> float:
    """Return the irradiance on the chief ray over that without aberrations, |mean of exp(2 pi i W / wavelength)|^2."""
    rho, theta, amplitude = pupil_grid(_samples_across(wavefront, wavelength_nm, pupil_diameter_m))
    error_m = wavefront_error_m(wavefront, rho, theta, wavelength_nm=wavelength_nm, pupil_diameter_m=pupil_diameter_m)
    field = np.sum(amplitude * np.exp(2j * np.pi * NM_PER_M / wavelength_nm * error_m)) / np.sum(amplitude)
    return float(abs(field) ** 2)


def pupil_grid(samples: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return (rho, theta, amplitude) of a clear circular pupil on (samples, samples) cells that just enclose it.

    A cell is open where its middle lies inside: partly open rim cells would count less in the light (amplitude squared) than in
    the overlaps that make the OTF. Row 0 is the top: theta counts counter-clockwise from the right.
    """
    x = (np.arange(samples) + 0.5 - samples / 2) / (samples / 2)
    rho = np.hypot(x[:, None], x)
    return rho, np.arctan2(-x[:, None], x), (rho <= 1.0).astype(np.float64)


def oversampling_for(wavelength_nm: float, f_number: float, pitch_m: float | None) -> int:
    """Return the samples per wavelength f_number that put the point image on a spacing of at most `pitch_m`; at least 2."""
    if pitch_m is None:
        return 2
    return max(2, math.ceil(wavelength_nm / NM_PER_M * f_number / pitch_m - _ROUNDING))


def _samples_across(wavefront: Wavefront, wavelength_nm: float, pupil_diameter_m: float) -> int:
    """Return the samples across the pupil that the steepest part of the wavefront needs."""
    rho, theta, amplitude = pupil_grid(_FEWEST_SAMPLES)
    error_m = wavefront_error_m(wavefront, rho, theta, wavelength_nm=wavelength_nm, pupil_diameter_m=pupil_diameter_m)
    inside = amplitude > 0
    steps = [np.diff(error_m, axis=axis)[np.take(inside, range(1, _FEWEST_SAMPLES), axis)] for axis in (0, 1)]
    waves_across = max(float(np.max(np.abs(s), initial=0.0)) for s in steps) * NM_PER_M / wavelength_nm * _FEWEST_SAMPLES
    # The point image reaches `waves_across` wavelengths times f-number from its middle; the window is `samples` of them wide.
    samples = _FEWEST_SAMPLES + 4 * math.ceil(waves_across)
    if samples > _MOST_SAMPLES:
        raise FieldError(
            f"the wavefront is inclined by {waves_across:.3g} waves across the pupil at {wavelength_nm:g} nm; this model holds "
            f"up to {(_MOST_SAMPLES - _FEWEST_SAMPLES) // 4}. Lower the coefficients or use defocus by depth layers.",
            path="coefficients_m",
            value=waves_across,
        )
    return samples
