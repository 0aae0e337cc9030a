"""Diffraction at the aperture: the optical transfer function of an aberration-free circular pupil, applied per band."""

from __future__ import annotations

import math

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from fullwell.core.constants import NM_PER_M
from fullwell.optics.nonnegative import without_negative_light

__all__ = ["airy_radius_m", "cutoff_cycles_per_m", "diffract_band", "diffraction_otf", "nyquist_contrast_loss"]

_FIRST_ZERO_OF_J1_OVER_PI = 1.2196698912665045


def cutoff_cycles_per_m(wavelength_nm: ArrayLike, f_number: float) -> NDArray[np.float64]:
    """Return the highest spatial frequency that reaches the film, 1 / (wavelength f_number) [cycles/m], same shape.

    `f_number` is the working one, N (1 + |m|). Paraxial: the sine of the cone's half angle is taken as its tangent.
    """
    return np.asarray(NM_PER_M / (np.asarray(wavelength_nm, dtype=np.float64) * f_number))


def airy_radius_m(wavelength_nm: float, f_number: float) -> float:
    """Return the radius of the first dark ring of the point image [m], 1.2197 wavelength f_number."""
    return _FIRST_ZERO_OF_J1_OVER_PI * wavelength_nm / NM_PER_M * f_number


def diffraction_otf(frequency_cycles_per_m: ArrayLike, *, wavelength_nm: float, f_number: float) -> NDArray[np.float64]:
    """Return the incoherent OTF of a circular pupil at radial spatial frequencies, same shape, in [0, 1].

    (2/pi) (arccos v - v sqrt(1 - v^2)), v = frequency / cut-off; 0 from the cut-off on. Real: the point image is even.

    References
    ----------
    goodman2005, section 6.3.
    """
    cutoff = float(cutoff_cycles_per_m(wavelength_nm, f_number))
    v = np.minimum(np.asarray(frequency_cycles_per_m, dtype=np.float64) / cutoff, 1.0)
    return np.asarray((2.0 / np.pi) * (np.arccos(v) - v * np.sqrt(1.0 - v * v)))


def nyquist_contrast_loss(*, wavelength_nm: float, f_number: float, pitch_m: float) -> float:
    """Return 1 - OTF at the Nyquist frequency of the sampling: the largest loss of contrast along a row or column."""
    return 1.0 - float(diffraction_otf(0.5 / pitch_m, wavelength_nm=wavelength_nm, f_number=f_number))


def diffract_band(
    band: NDArray[np.float64], *, wavelength_nm: float, f_number: float, pitch_m: float, workers: int = 1
) -> NDArray[np.float64]:
    """Return one band of the image blurred by diffraction, (rows, cols), in the unit it came in.

    The image continues beyond its border as its own mirror image, so that borders neither darken nor receive light from the
    opposite side; the whole tail of the point image takes part. The sum is conserved. The picture cells' own box is not
    applied again: only the OTF is.

    Parameters
    ----------
    band
        (rows, cols), finite, >= 0.
    f_number
        The working f-number.
    workers
        Threads of the transform; the result does not depend on it.

    References
    ----------
    martucci1994: multiplication of DCT-II coefficients is convolution of the mirrored image.
    """
    rows, cols = band.shape
    # A DCT-II of n samples has its coefficients at k / (2 n) cycles per sample.
    frequency_y = np.arange(rows) / (2.0 * rows * pitch_m)
    frequency_x = np.arange(cols) / (2.0 * cols * pitch_m)
    radial = np.sqrt(frequency_y[:, None] ** 2 + frequency_x[None, :] ** 2)
    spectrum = scipy.fft.dctn(band, type=2, workers=workers)
    spectrum *= diffraction_otf(radial, wavelength_nm=wavelength_nm, f_number=f_number)
    blurred = scipy.fft.idctn(spectrum, type=2, workers=workers, overwrite_x=True)
    total = math.fsum(np.sum(band, axis=1))
    return without_negative_light(blurred, total=total)
