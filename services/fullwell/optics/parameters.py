"""What the optics may be asked for beyond an ideal lens."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.optics.blur import MAX_SKIPPED_CONTRAST_LOSS
from fullwell.optics.flare import Aperture
from fullwell.optics.psf import PointSpread
from fullwell.optics.wavefront import Wavefront

__all__ = ["OpticsOptions"]


@dataclass(frozen=True, slots=True, eq=False)
class OpticsOptions:
    """Optional effects; each is left out where its field is None.

    Attributes
    ----------
    wavefront
        Aberrations of the pupil; with them comes diffraction.
    aperture
        Shape, scratches and dust of the stop, whose flare covers the picture; with it comes diffraction. It may be combined
        with a wavefront, at the price of one large transform per band.
    psf
        The point images of the whole lens, diffraction included, in place of the two above.
    depth_z_m
        (rows, cols) depth along the axis of each sample of the radiance [m], for defocus of a picture rendered through a
        pinhole.
    max_skipped_contrast_loss
        Bands whose filter takes no more than this from the contrast at Nyquist are left as they are; 0 filters all.
    """

    wavefront: Wavefront | None = None
    aperture: Aperture | None = None
    psf: PointSpread | None = None
    depth_z_m: NDArray[Any] | None = None
    max_skipped_contrast_loss: float = MAX_SKIPPED_CONTRAST_LOSS

    def __post_init__(self) -> None:
        if self.psf is not None and (self.wavefront is not None or self.aperture is not None):
            raise FieldError(
                "psf is the image of a point through the whole lens and cannot be combined with wavefront or aperture. "
                "Remove one.",
                path="psf",
            )
