"""Diffraction at the aperture: the optical transfer function of an aberration-free circular pupil, applied per band."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from fullwell.core.constants import NM_PER_M
from fullwell.optics.ringing import texture, without_negative_light, without_ringing

__all__ = [
    "DiffractionFilter",
    "airy_radius_m",
    "cutoff_cycles_per_m",
    "diffract_band",
    "diffraction_otf",
    "nyquist_contrast_loss",
    "ringing_slack",
]

_FIRST_ZERO_OF_J1_OVER_PI = 1.2196698912665045

_UNIFORM, _TEXTURED = 0.05, 0.3
"""How far the result may depart from the smooth image, as a share of that, where the image about it is uniform and where it is
not: light that has been spilled there from afar has no fine structure of its own. With these, straight edges up to a contrast
of 10 : 1 stay untouched and the MTF of edges in total darkness within 0.01 (tested)."""

_COARSE, _FINE = 1.25, 2.0
"""wavelength f-number / pitch. From _FINE on, the film samples the whole OTF and its point image is never negative; below
_COARSE the bound holds in full; between the two it opens continuously."""

_SINGLE_SUFFICES = 1e-4
"""Of the image's root mean square. The rounding of a single-precision transform is about 1e-6 of that (measured), so a
smooth image above this everywhere is known to 1 %; as a bound of 5 % and more it needs no more."""


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
    share = np.asarray(np.asarray(frequency_cycles_per_m, dtype=np.float64) / cutoff)
    return _otf_of_share(share, np.empty_like(share), np.empty_like(share))


def nyquist_contrast_loss(*, wavelength_nm: float, f_number: float, pitch_m: float) -> float:
    """Return 1 - OTF at the Nyquist frequency of the sampling: the largest loss of contrast along a row or column."""
    return 1.0 - float(diffraction_otf(0.5 / pitch_m, wavelength_nm=wavelength_nm, f_number=f_number))


def ringing_slack(*, wavelength_nm: float, f_number: float, pitch_m: float) -> float:
    """Return how many times wider the bounds against ringing are than for coarse samples; inf where there are none.

    Continuous in every argument: 1 for coarse samples, growing to infinity where the pitch is wavelength f_number / 2.
    """
    fineness = wavelength_nm / NM_PER_M * f_number / pitch_m
    coarse = min(1.0, (_FINE - fineness) / (_FINE - _COARSE))
    return 1.0 / coarse if coarse > 0 else math.inf


def _root_mean_square(band: NDArray[np.float64]) -> float:
    """Return the root mean square, by a sum whose order does not depend on threads as a BLAS product's does."""
    return math.sqrt(float(np.einsum("ij,ij->", band, band)) / band.size)


class DiffractionFilter:
    """Diffraction for images of one shape and pitch; what does not depend on the wavelength is kept between bands.

    The image continues beyond its border as its own mirror image, so that borders neither darken nor receive light from the
    opposite side; the whole tail of the point image takes part. The sum is conserved. The picture cells' own box is not
    applied again: only the OTF is. Derived in docs/physics/diffraction.md.

    References
    ----------
    martucci1994: multiplication of DCT-II coefficients is convolution of the mirrored image.
    """

    def __init__(self, planes: NDArray[Any], *, pitch_m: float, workers: int = 1) -> None:
        """Prepare for images like `planes`, (rows, cols, planes): where they are uniform, so are all bands taken to be."""
        self._pitch_m, self._workers = pitch_m, workers
        self._planes = planes
        self._bound: NDArray[np.float64] | None = None
        rows, cols = planes.shape[:2]
        # A DCT-II of n samples has its coefficients at k / (2 n) cycles per sample.
        across, down = np.arange(cols) / (2.0 * cols), np.arange(rows)[:, None] / (2.0 * rows)
        self._radius = np.hypot(down, across) / pitch_m
        self._periodic_radius = np.hypot(np.sin(np.pi * down), np.sin(np.pi * across)) / (np.pi * pitch_m)
        self._periodic_radius_single = self._periodic_radius.astype(np.float32)
        self._buffers = {
            precision.itemsize: tuple(np.empty((rows, cols), dtype=precision) for _ in range(3))
            for precision in (np.dtype(np.float32), np.dtype(np.float64))
        }

    def apply(self, band: NDArray[np.float64], *, wavelength_nm: float, f_number: float) -> NDArray[np.float64]:
        """Return the blurred band, (rows, cols), >= 0, in the unit it came in. See `diffract_band`."""
        spectrum = scipy.fft.dctn(band, type=2, workers=self._workers)
        total = math.fsum(np.sum(band, axis=1))
        cutoff = float(cutoff_cycles_per_m(wavelength_nm, f_number))
        slack = ringing_slack(wavelength_nm=wavelength_nm, f_number=f_number, pitch_m=self._pitch_m)
        if math.isinf(slack):
            return without_negative_light(self._filtered(spectrum, self._radius, cutoff), total=total)
        smooth = self._smooth(spectrum, cutoff, rms=_root_mean_square(band))
        exact = self._filtered(spectrum, self._radius, cutoff)
        return without_ringing(exact, smooth, bound=slack * self._bounds(), total=total)

    def _bounds(self) -> NDArray[np.float64]:
        """Return the bounds against ringing for coarse samples, made when first needed."""
        if self._bound is None:
            self._bound = _UNIFORM + (_TEXTURED - _UNIFORM) * texture(self._planes)
        return self._bound

    def _smooth(self, spectrum: NDArray[np.float64], cutoff: float, *, rms: float) -> NDArray[Any]:
        """Return the image through the filter without negative weights, in single precision where that serves as a bound."""
        if rms == 0:
            return np.zeros_like(spectrum)
        single = np.multiply(spectrum, 1.0 / rms, out=np.empty(spectrum.shape, dtype=np.float32), casting="same_kind")
        smooth = self._filtered(single, self._periodic_radius_single, cutoff)
        if float(np.min(smooth)) > _SINGLE_SUFFICES:
            smooth *= np.float32(rms)
            return smooth
        return self._filtered(spectrum.copy(), self._periodic_radius, cutoff)

    def _filtered(self, spectrum: NDArray[Any], radius: NDArray[Any], cutoff: float) -> NDArray[Any]:
        """Return the image of `spectrum`, which is overwritten, times the OTF at `radius`; in the precision of both."""
        share, otf, spare = self._buffers[radius.dtype.itemsize]
        np.multiply(radius, 1.0 / cutoff, out=share)
        spectrum *= _otf_of_share(share, otf, spare)
        return np.asarray(scipy.fft.idctn(spectrum, type=2, workers=self._workers, overwrite_x=True))


def diffract_band(
    band: NDArray[np.float64], *, wavelength_nm: float, f_number: float, pitch_m: float, workers: int = 1
) -> NDArray[np.float64]:
    """Return one band of the image blurred by diffraction, (rows, cols), in the unit it came in.

    Exact below the Nyquist frequency, never negative, without ringing; the sum is conserved (see `DiffractionFilter`).

    Parameters
    ----------
    band
        (rows, cols), finite, >= 0.
    f_number
        The working f-number.
    workers
        Threads of the transform; the result does not depend on it.
    """
    blur = DiffractionFilter(band[:, :, None], pitch_m=pitch_m, workers=workers)
    return blur.apply(band, wavelength_nm=wavelength_nm, f_number=f_number)


def _otf_of_share(share: NDArray[Any], otf: NDArray[Any], spare: NDArray[Any]) -> NDArray[Any]:
    """Fill and return `otf` with the OTF at `share` of the cut-off; overwrites all three: temporaries would cost six times
    the arithmetic."""
    np.minimum(share, 1.0, out=share)
    np.arccos(share, out=otf)
    np.multiply(share, share, out=spare)
    np.subtract(1.0, spare, out=spare)
    np.sqrt(spare, out=spare)
    np.multiply(spare, share, out=spare)
    np.subtract(otf, spare, out=otf)
    np.multiply(otf, 2.0 / np.pi, out=otf)
    return otf
