"""The lens of a recipe beyond an ideal one."""

from __future__ import annotations

from fullwell.optics import (
    Aperture,
    OpticsOptions,
    PointSpread,
    Wavefront,
    defocus_coefficient_m,
    gaussian_psf,
    pillbox_psf,
    read_psf,
)
from fullwell.scene import Lens
from fullwell.schema.conversion.context import Context, located
from fullwell.schema.v1.cameras import LensDocument
from fullwell.schema.v1.optics import ApertureDocument, PsfDocument, WavefrontDocument

__all__ = ["optics_options"]

_DEFOCUS_INDEX = 4


def optics_options(document: LensDocument, lens: Lens, path: str, context: Context) -> OpticsOptions:
    """Return the effects that the recipe asks for beyond an ideal lens. Raises RecipeError."""
    with located(path):
        return OpticsOptions(
            wavefront=None if document.wavefront is None else _wavefront(document.wavefront, lens, f"{path}.wavefront"),
            aperture=None if document.aperture is None else _aperture(document.aperture, f"{path}.aperture"),
            psf=None if document.psf is None else _psf(document.psf, f"{path}.psf", context),
        )


def _wavefront(document: WavefrontDocument, lens: Lens, path: str) -> Wavefront:
    coefficients_m = {term.index: term.rms_m for term in document.zernike}
    if document.defocus_dioptre:
        pupil_m = document.pupil_diameter_m or lens.pupil_diameter_m
        added_m = defocus_coefficient_m(document.defocus_dioptre, pupil_m)
        coefficients_m[_DEFOCUS_INDEX] = coefficients_m.get(_DEFOCUS_INDEX, 0.0) + added_m
    chromatic = tuple((entry.wavelength_nm, entry.defocus_dioptre) for entry in document.chromatic_defocus)
    with located(path):
        return Wavefront(tuple(sorted(coefficients_m.items())), document.pupil_diameter_m, chromatic)


def _aperture(document: ApertureDocument, path: str) -> Aperture:
    with located(path):
        return Aperture(**document.model_dump())


def _psf(document: PsfDocument, path: str, context: Context) -> PointSpread:
    with located(path):
        if document.gaussian_sigma_m is not None:
            return gaussian_psf(document.gaussian_sigma_m)
        if document.disc_diameter_m is not None:
            return pillbox_psf(document.disc_diameter_m)
    reference = document.file or ""
    file, digest = context.files.find(reference, f"{path}.file")
    context.used_files[reference] = digest
    with located(f"{path}.file"):
        return read_psf(file)
