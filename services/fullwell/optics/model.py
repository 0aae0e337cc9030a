"""The optics stage: the order of its effects, nothing else."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.optics.camera_equation import on_axis_factor_sr, working_f_number
from fullwell.optics.diffraction import DiffractionFilter, airy_radius_m, nyquist_contrast_loss
from fullwell.optics.relative_illumination import relative_illumination
from fullwell.radiometry.images import RadianceImage
from fullwell.scene.camera import Lens
from fullwell.scene.images import OpticalImage

__all__ = ["MAX_SKIPPED_CONTRAST_LOSS", "OPTICS_TERMS", "OpticsTerm", "compute_irradiance"]

OpticsTerm: TypeAlias = Literal["relative_illumination", "diffraction"]
OPTICS_TERMS: Final[tuple[OpticsTerm, ...]] = get_args(OpticsTerm)

MAX_SKIPPED_CONTRAST_LOSS: Final = 0.005
"""Diffraction is left out where it would take less than this from the contrast at the image's Nyquist frequency."""

_BRIGHTEST = 1e38
"""Photons s^-1 m^-2 sr^-1 nm^-1; times the solid angle of the fastest lens this still fits single precision."""

_BANDS_AT_A_TIME = 8
"""Bands copied out of the (rows, cols, bands) cube together: one cache line of float32 is then read about twice."""


def compute_irradiance(
    radiance: RadianceImage, lens: Lens, *, terms: Collection[OpticsTerm] = OPTICS_TERMS, workers: int = 1
) -> OpticalImage:
    """Form the optical image: camera equation, then relative illumination, then diffraction.

    Parameters
    ----------
    radiance
        Photon radiance, finite and >= 0. It is not modified.
    lens
        Its `diffraction` switch and its f-number hold for the pinhole too.
    terms
        Effects to include; the camera equation is always included.
    workers
        Threads of the transforms; the result does not depend on it.

    Returns
    -------
    The image on the sensor plane, on the same samples; `notes` says what was left out and why. No distortion, aberration,
    flare or vignetting by barrels; defocus is the renderer's.

    Raises
    ------
    FieldError
        NaN, Inf or negative radiance; unknown term; a lens that forms no image.
    """
    _check_radiance(radiance)
    for term in terms:
        if term not in OPTICS_TERMS:
            raise FieldError(unknown_name_message("optics term", term, OPTICS_TERMS), path="terms", value=term)
    sample_pitch_m = radiance.tangent_pitch * lens.image_distance_m
    on_axis = on_axis_factor_sr(lens, radiance.grid)
    falloff, notes = np.ones((radiance.rows, 1)), []
    if "relative_illumination" in terms:
        falloff = relative_illumination(rows=radiance.rows, cols=radiance.cols, tangent_pitch=radiance.tangent_pitch, lens=lens)
    else:
        notes.append("relative_illumination: left out on request.")
    blurred_bands, why = _bands_to_diffract(radiance, lens, terms=terms, pitch_m=sample_pitch_m)
    if why:
        notes.append(why)
    photons = _form_image(
        radiance, lens, on_axis=on_axis, falloff=falloff, blurred_bands=blurred_bands, pitch_m=sample_pitch_m, workers=workers
    )
    return OpticalImage(photons=photons, grid=radiance.grid, sample_pitch_m=sample_pitch_m, notes=tuple(notes))


def _check_radiance(radiance: RadianceImage) -> None:
    if not 0 < radiance.tangent_pitch < float("inf"):
        raise FieldError(
            f"tangent_pitch is {radiance.tangent_pitch}; must be > 0 and finite.",
            path="tangent_pitch",
            value=radiance.tangent_pitch,
        )
    # A NaN anywhere makes both extremes NaN, and every comparison with NaN is false.
    low, high = float(np.min(radiance.photons)), float(np.max(radiance.photons))
    if not (low >= 0 and high < _BRIGHTEST):
        raise FieldError(
            f"radiance ranges from {low} to {high}; must be finite and >= 0 (below {_BRIGHTEST:g}). Look for the fault in the "
            "rendering stage.",
            path="radiance",
            value=low,
        )


def _bands_to_diffract(
    radiance: RadianceImage, lens: Lens, *, terms: Collection[OpticsTerm], pitch_m: float
) -> tuple[frozenset[int], str]:
    """Return the indices of the bands that diffraction changes visibly, and the note on the others."""
    if "diffraction" not in terms:
        return frozenset(), "diffraction: left out on request."
    if not lens.diffraction:
        return frozenset(), "diffraction: switched off in the lens."
    f_number = working_f_number(lens.f_number, lens.magnification)
    wavelengths = [float(w) for w in radiance.grid.centres_nm]
    losses = [nyquist_contrast_loss(wavelength_nm=w, f_number=f_number, pitch_m=pitch_m) for w in wavelengths]
    kept = frozenset(k for k, loss in enumerate(losses) if loss > MAX_SKIPPED_CONTRAST_LOSS)
    skipped = [k for k in range(len(losses)) if k not in kept]
    if not skipped:
        return kept, ""
    radius_m = max(airy_radius_m(wavelengths[k], f_number) for k in skipped)
    worst = max(losses[k] for k in skipped)
    return kept, (
        f"diffraction: left out in {len(skipped)} of {len(losses)} bands; the Airy radius is at most {radius_m:.3g} m against "
        f"a sample pitch of {pitch_m:.3g} m; contrast at Nyquist is too high by at most {worst:.2g}."
    )


def _form_image(
    radiance: RadianceImage,
    lens: Lens,
    *,
    on_axis: NDArray[np.float64],
    falloff: NDArray[np.float64],
    blurred_bands: frozenset[int],
    pitch_m: float,
    workers: int,
) -> NDArray[np.float32]:
    photons = np.empty(radiance.photons.shape, dtype=np.float32)
    wavelengths = radiance.grid.centres_nm
    f_number = working_f_number(lens.f_number, lens.magnification)
    blur = DiffractionFilter(radiance.rows, radiance.cols, pitch_m=pitch_m, workers=workers)
    # Transforms run in double precision: a headlight is 1e7 times brighter than the road beside it, and the rounding
    # of a single-precision transform is a fraction of the brightest sample everywhere.
    buffer = np.empty((min(_BANDS_AT_A_TIME, radiance.grid.count), radiance.rows, radiance.cols))
    for first in range(0, radiance.grid.count, _BANDS_AT_A_TIME):
        bands = range(first, min(first + _BANDS_AT_A_TIME, radiance.grid.count))
        block = buffer[: len(bands)]
        # Row by row, both sides of the transposition stay in the processor's cache: a third faster than at once.
        for row in range(radiance.rows):
            np.multiply(radiance.photons[row, :, bands.start : bands.stop].T, falloff[row], out=block[:, row])
            block[:, row] *= on_axis[bands.start : bands.stop, None]
        for k, band in zip(bands, block, strict=True):
            if k in blurred_bands:
                band[:] = blur.apply(band, wavelength_nm=float(wavelengths[k]), f_number=f_number)
        for row in range(radiance.rows):
            photons[row, :, bands.start : bands.stop] = block[:, row].T
    return photons
