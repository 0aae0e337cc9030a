"""Which filter each band of the image passes: diffraction alone, or the point images of a real lens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from fullwell.core.constants import NM_PER_M
from fullwell.optics.diffraction import DiffractionFilter, airy_radius_m, nyquist_contrast_loss
from fullwell.optics.flare import Aperture, aperture_mask, flare_point_image, flare_samples
from fullwell.optics.psf import PointImage, PointSpreadFilter
from fullwell.optics.wavefront import Wavefront, oversampling_for, strehl_ratio, wavefront_point_image

__all__ = [
    "MAX_SKIPPED_CONTRAST_LOSS",
    "Blur",
    "DiffractionBlur",
    "NoBlur",
    "PointImageBlur",
    "flare_images",
    "wavefront_images",
]

MAX_SKIPPED_CONTRAST_LOSS: Final = 0.005
"""A band is left as it is where its filter would take less than this from the contrast at the image's Nyquist frequency."""


class Blur(Protocol):
    """A filter for the bands of one image."""

    def apply(self, band: NDArray[np.float64], wavelength_nm: float) -> NDArray[np.float64]:
        """Return the filtered band, (rows, cols), >= 0, in the unit it came in."""
        ...

    def notes(self) -> tuple[str, ...]:
        """Return what was done and left out, once all bands are through."""
        ...


class NoBlur:
    """Leaves every band as it is, and says why."""

    def __init__(self, why: str) -> None:
        self._why = why

    def apply(self, band: NDArray[np.float64], wavelength_nm: float) -> NDArray[np.float64]:
        """Return the band itself."""
        del wavelength_nm
        return band

    def notes(self) -> tuple[str, ...]:
        """Return the reason."""
        return (self._why,)


class DiffractionBlur:
    """Diffraction at a clear circular pupil, in the bands where it can be seen."""

    def __init__(
        self,
        planes: NDArray[Any],
        *,
        f_number: float,
        pitch_m: float,
        workers: int,
        max_loss: float = MAX_SKIPPED_CONTRAST_LOSS,
    ) -> None:
        """Prepare for the bands of the image whose texture is that of `planes`, (rows, cols, planes)."""
        self._max_loss = max_loss
        self._filter = DiffractionFilter(planes, pitch_m=pitch_m, workers=workers)
        self._f_number, self._pitch_m = f_number, pitch_m
        self._bands = 0
        self._skipped: list[tuple[float, float]] = []

    def apply(self, band: NDArray[np.float64], wavelength_nm: float) -> NDArray[np.float64]:
        """Return the diffracted band; the band itself where that would hardly change it."""
        self._bands += 1
        loss = nyquist_contrast_loss(wavelength_nm=wavelength_nm, f_number=self._f_number, pitch_m=self._pitch_m)
        if loss <= self._max_loss:
            self._skipped.append((loss, wavelength_nm))
            return band
        return self._filter.apply(band, wavelength_nm=wavelength_nm, f_number=self._f_number)

    def notes(self) -> tuple[str, ...]:
        """Return what was left out, with its bound."""
        if not self._skipped:
            return ()
        radius_m = airy_radius_m(max(w for _, w in self._skipped), self._f_number)
        return (
            f"diffraction: left out in {len(self._skipped)} of {self._bands} bands; the Airy radius is at most "
            f"{radius_m:.3g} m against a sample pitch of {self._pitch_m:.3g} m; contrast at Nyquist is too high by at most "
            f"{max(self._skipped)[0]:.2g}.",
        )


class PointImageBlur:
    """The point images of a lens, one for each band."""

    def __init__(
        self,
        name: str,
        image_at: Callable[[float], PointImage],
        *,
        pitch_m: float,
        workers: int,
        remark: str = "",
        max_loss: float = MAX_SKIPPED_CONTRAST_LOSS,
    ) -> None:
        self._max_loss = max_loss
        self._name, self._image_at, self._remark = name, image_at, remark
        self._pitch_m, self._workers = pitch_m, workers
        self._bands = 0
        self._skipped: list[float] = []
        self._reach = 0

    def apply(self, band: NDArray[np.float64], wavelength_nm: float) -> NDArray[np.float64]:
        """Return the filtered band; the band itself where that would hardly change it."""
        self._bands += 1
        spread = PointSpreadFilter(self._image_at(wavelength_nm), pitch_m=self._pitch_m)
        if spread.contrast_loss <= self._max_loss:
            self._skipped.append(spread.contrast_loss)
            return band
        self._reach = max(self._reach, spread.reach)
        return spread.apply(band, workers=self._workers)

    def notes(self) -> tuple[str, ...]:
        """Return how far the kernels reached and what was left out, with its bound."""
        applied = self._bands - len(self._skipped)
        notes = []
        if applied:
            notes.append(
                f"{self._name}: {applied} bands through kernels that reach {self._reach} samples, diffraction included."
                f"{self._remark}"
            )
        if self._skipped:
            notes.append(
                f"{self._name}: left out in {len(self._skipped)} of {self._bands} bands; contrast up to Nyquist changes by at "
                f"most {max(self._skipped):.2g}."
            )
        return tuple(notes)


def wavefront_images(
    wavefront: Wavefront, *, f_number: float, pupil_diameter_m: float, pitch_m: float, wavelength_nm: float
) -> tuple[Callable[[float], PointImage], str]:
    """Return the point images of an aberrated pupil by wavelength, and a remark with its Strehl ratio at `wavelength_nm`."""

    def image_at(wave_nm: float) -> PointImage:
        return wavefront_point_image(
            wavefront, wavelength_nm=wave_nm, f_number=f_number, pupil_diameter_m=pupil_diameter_m, pitch_m=pitch_m
        )

    strehl = strehl_ratio(wavefront, wavelength_nm=wavelength_nm, pupil_diameter_m=pupil_diameter_m)
    return image_at, f" The Strehl ratio is {strehl:.3g} at {wavelength_nm:g} nm."


def flare_images(
    aperture: Aperture,
    wavefront: Wavefront | None,
    *,
    f_number: float,
    pupil_diameter_m: float,
    pitch_m: float,
    reach_m: float,
    shortest_nm: float,
) -> tuple[Callable[[float], PointImage], str]:
    """Return the point images of a stop by wavelength, and a remark on how far they reach.

    Without wavefront error one transform serves all wavelengths: the point image only grows with the wavelength.
    """
    samples = flare_samples(wavelength_nm=shortest_nm, f_number=f_number, reach_m=reach_m)
    mask = aperture_mask(aperture, samples)
    window_m = 0.5 * samples * shortest_nm / NM_PER_M * f_number
    remark = f" Flare reaches {min(window_m, reach_m):.3g} m on every side; what goes farther is folded back into that."
    oversampling = oversampling_for(shortest_nm, f_number, pitch_m)
    if wavefront is not None:

        def aberrated_at(wave_nm: float) -> PointImage:
            return flare_point_image(
                mask,
                wavelength_nm=wave_nm,
                f_number=f_number,
                oversampling=oversampling_for(wave_nm, f_number, pitch_m),
                wavefront=wavefront,
                pupil_diameter_m=pupil_diameter_m,
            )

        return aberrated_at, remark
    first = flare_point_image(mask, wavelength_nm=shortest_nm, f_number=f_number, oversampling=oversampling)

    def image_at(wave_nm: float) -> PointImage:
        return PointImage(first.weights, first.spacing_m * wave_nm / shortest_nm)

    return image_at, remark
