"""The optics stage: the order of its effects, nothing else."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError, unknown_name_message
from fullwell.optics.blur import (
    MAX_SKIPPED_CONTRAST_LOSS,
    Blur,
    DiffractionBlur,
    NoBlur,
    PointImageBlur,
    flare_images,
    wavefront_images,
)
from fullwell.optics.camera_equation import on_axis_factor_sr, working_f_number
from fullwell.optics.defocus import defocus
from fullwell.optics.parameters import OpticsOptions
from fullwell.optics.relative_illumination import relative_illumination
from fullwell.radiometry.images import RadianceImage
from fullwell.scene.camera import Lens
from fullwell.scene.images import OpticalImage

__all__ = ["IDEAL_LENS", "MAX_SKIPPED_CONTRAST_LOSS", "OPTICS_TERMS", "OpticsTerm", "compute_irradiance"]

OpticsTerm: TypeAlias = Literal["defocus", "relative_illumination", "psf", "flare", "aberrations", "diffraction"]
OPTICS_TERMS: Final[tuple[OpticsTerm, ...]] = get_args(OpticsTerm)

IDEAL_LENS: Final = OpticsOptions()
"""Diffraction and falloff only."""

_BRIGHTEST = 1e38
"""Photons s^-1 m^-2 sr^-1 nm^-1; times the solid angle of the fastest lens this still fits single precision."""

_TEXTURE_BANDS = 3
"""Bands in which texture is looked for: the middles of the blue, green and red thirds."""

_BANDS_AT_A_TIME = 8
"""Bands copied out of the (rows, cols, bands) cube together: one cache line of float32 is then read about twice."""


def compute_irradiance(
    radiance: RadianceImage,
    lens: Lens,
    options: OpticsOptions = IDEAL_LENS,
    *,
    terms: Collection[OpticsTerm] = OPTICS_TERMS,
    workers: int = 1,
) -> OpticalImage:
    """Form the optical image: defocus, camera equation, relative illumination, then the blur of the lens.

    The blur is that of `options.psf`, of the aperture's flare, of the wavefront's aberrations (with flare where both are
    given), or diffraction alone.

    Parameters
    ----------
    radiance
        Photon radiance, finite and >= 0. It is not modified.
    options
        Effects beyond an ideal lens.
    lens
        Its `diffraction` switch and its f-number hold for the pinhole too.
    terms
        Effects to include; the camera equation is always included, and what `options` does not ask for is not.
    workers
        Threads of the transforms; the result does not depend on it.

    Returns
    -------
    The image on the sensor plane, on the same samples; `notes` says what was done and left out, why, and with what bound. No
    distortion, no vignetting by barrels, no change of the blur over the field.

    Raises
    ------
    FieldError
        NaN, Inf or negative radiance; unknown term; a lens that forms no image; depths for a picture that has its depth of
        field already.
    """
    _check_radiance(radiance)
    for term in terms:
        if term not in OPTICS_TERMS:
            raise FieldError(unknown_name_message("optics term", term, OPTICS_TERMS), path="terms", value=term)
    sample_pitch_m = radiance.tangent_pitch * lens.image_distance_m
    on_axis = on_axis_factor_sr(lens, radiance.grid)
    falloff, notes = np.ones((radiance.rows, 1)), []
    if options.depth_z_m is not None and "defocus" in terms:
        _check_pinhole(lens)
        radiance, note = defocus(radiance, options.depth_z_m, lens, workers=workers)
        notes.append(note)
    if "relative_illumination" in terms:
        # A picture whose depth of field comes from layers is that of a thin lens, though it was rendered through a pinhole.
        pupil = lens if options.depth_z_m is None else replace(lens, kind="thin_lens")
        falloff = relative_illumination(
            rows=radiance.rows, cols=radiance.cols, tangent_pitch=radiance.tangent_pitch, lens=pupil
        )
    else:
        notes.append("relative_illumination: left out on request.")
    blur = _choose_blur(radiance, lens, options, terms=terms, pitch_m=sample_pitch_m, workers=workers)
    photons = _form_image(radiance, on_axis=on_axis, falloff=falloff, blur=blur)
    return OpticalImage(photons=photons, grid=radiance.grid, sample_pitch_m=sample_pitch_m, notes=(*notes, *blur.notes()))


def _check_pinhole(lens: Lens) -> None:
    if lens.kind != "pinhole":
        raise FieldError(
            f"lens.kind is {lens.kind!r}, whose depth of field is in the radiance already; defocus by depth layers needs a "
            "picture rendered through a 'pinhole'. Set lens.kind.",
            path="kind",
            value=lens.kind,
        )


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


def _choose_blur(
    radiance: RadianceImage, lens: Lens, options: OpticsOptions, *, terms: Collection[OpticsTerm], pitch_m: float, workers: int
) -> Blur:
    """Return the filter of the bands: the most complete of the point images asked for, else diffraction."""
    f_number = working_f_number(lens.f_number, lens.magnification)
    wavelengths = radiance.grid.centres_nm
    max_loss = options.max_skipped_contrast_loss
    wavefront = options.wavefront if "aberrations" in terms else None
    if options.psf is not None and "psf" in terms:
        return PointImageBlur("psf", options.psf.at, pitch_m=pitch_m, workers=workers, max_loss=max_loss)
    if options.aperture is not None and "flare" in terms:
        images, remark = flare_images(
            options.aperture,
            wavefront,
            f_number=f_number,
            pupil_diameter_m=lens.pupil_diameter_m,
            pitch_m=pitch_m,
            reach_m=max(radiance.rows, radiance.cols) * pitch_m,
            shortest_nm=float(wavelengths[0]),
        )
        return PointImageBlur("flare", images, pitch_m=pitch_m, workers=workers, remark=remark, max_loss=max_loss)
    if wavefront is not None:
        images, remark = wavefront_images(
            wavefront,
            f_number=f_number,
            pupil_diameter_m=lens.pupil_diameter_m,
            pitch_m=pitch_m,
            wavelength_nm=float(wavelengths[len(wavelengths) // 2]),
        )
        return PointImageBlur("aberrations", images, pitch_m=pitch_m, workers=workers, remark=remark, max_loss=max_loss)
    if "diffraction" not in terms:
        return NoBlur("diffraction: left out on request.")
    if not lens.diffraction:
        return NoBlur("diffraction: switched off in the lens.")
    # Bands of different colours, so that an edge between colours of equal brightness counts as one.
    bands = {(2 * part + 1) * radiance.grid.count // (2 * _TEXTURE_BANDS) for part in range(_TEXTURE_BANDS)}
    planes = radiance.photons[:, :, sorted(bands)]
    return DiffractionBlur(planes, f_number=f_number, pitch_m=pitch_m, workers=workers, max_loss=max_loss)


def _form_image(
    radiance: RadianceImage,
    *,
    on_axis: NDArray[np.float64],
    falloff: NDArray[np.float64],
    blur: Blur,
) -> NDArray[np.float32]:
    photons = np.empty(radiance.photons.shape, dtype=np.float32)
    wavelengths = radiance.grid.centres_nm
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
            blurred = blur.apply(band, float(wavelengths[k]))
            if blurred is not band:
                band[:] = blurred
        for row in range(radiance.rows):
            photons[row, :, bands.start : bands.stop] = block[:, row].T
    return photons
