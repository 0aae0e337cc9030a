"""What a lens is beyond an ideal one: aberrations, the shape of its stop, a measured point image."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from fullwell.schema.v1.common import Document, Positive, Range, Text, exactly_one, refuse

__all__ = ["ApertureDocument", "PsfDocument", "WavefrontDocument", "ZernikeDocument"]

_MOST_MARKS = 10_000


class ZernikeDocument(Document):
    """One aberration: its OSA/ANSI single index and its root-mean-square wavefront error [m]."""

    index: Annotated[int, Range(ge=0, le=230, whole=True)]
    rms_m: Annotated[float, Range(ge=-1e-3, le=1e-3)]


class ChromaticDefocusDocument(Document):
    """Additional defocus at one wavelength."""

    wavelength_nm: Annotated[float, Range(ge=300, le=1100)]
    defocus_dioptre: Annotated[float, Range(ge=-1e4, le=1e4)]


class WavefrontDocument(Document):
    """Aberrations of the pupil. `defocus_dioptre` adds to the coefficient of index 4."""

    zernike: list[ZernikeDocument] = Field(default_factory=list, max_length=231)
    defocus_dioptre: Annotated[float, Range(ge=-1e4, le=1e4)] = 0.0
    pupil_diameter_m: Positive | None = None
    chromatic_defocus: list[ChromaticDefocusDocument] = Field(default_factory=list, max_length=1000)

    @model_validator(mode="after")
    def _ordered(self) -> WavefrontDocument:
        seen: set[int] = set()
        for position, term in enumerate(self.zernike):
            if term.index in seen:
                refuse(
                    f"is {term.index}, which is given twice; add the two up.", "zernike", position, "index", value=term.index
                )
            seen.add(term.index)
        waves = [entry.wavelength_nm for entry in self.chromatic_defocus]
        for position in range(1, len(waves)):
            if not waves[position] > waves[position - 1]:
                sentence = f"is {waves[position]:g}; wavelengths must increase."
                refuse(sentence, "chromatic_defocus", position, "wavelength_nm", value=waves[position])
        return self


class ApertureDocument(Document):
    """Shape and cleanliness of the stop, whose flare covers the picture."""

    blades: Annotated[int, Range(ge=0, le=64, whole=True)] = 0
    rotation_deg: Annotated[float, Range(ge=-360, le=360)] = 0.0
    scratches: Annotated[int, Range(ge=0, le=_MOST_MARKS, whole=True)] = 0
    scratch_width: Annotated[float, Range(ge=1e-5, le=0.5)] = 0.004
    dust_grains: Annotated[int, Range(ge=0, le=_MOST_MARKS, whole=True)] = 0
    dust_diameter: Annotated[float, Range(ge=1e-5, le=0.5)] = 0.02
    opacity: Annotated[float, Range(ge=0, le=1)] = 1.0
    seed: Annotated[int, Range(ge=0, le=2**53, whole=True)] = 0

    @model_validator(mode="after")
    def _polygon(self) -> ApertureDocument:
        if self.blades in (1, 2):
            refuse(f"is {self.blades}; must be 0 (a circle) or 3 to 64.", "blades", value=self.blades)
        return self


class PsfDocument(Document):
    """The image of a point through the whole lens: exactly one of a file, a Gaussian, a disc."""

    file: Text | None = None
    gaussian_sigma_m: Positive | None = None
    disc_diameter_m: Positive | None = None

    @model_validator(mode="after")
    def _one(self) -> PsfDocument:
        exactly_one(self, "file", "gaussian_sigma_m", "disc_diameter_m")
        return self
