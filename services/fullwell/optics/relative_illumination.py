"""Relative illumination: how irradiance falls from the axis to the corner because the pupil is seen obliquely."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.optics.camera_equation import working_f_number
from fullwell.scene.camera import Lens

__all__ = ["cos_fourth", "disc_falloff", "relative_illumination"]


def cos_fourth(tan_field: ArrayLike) -> NDArray[np.float64]:
    """Return cos^4 of the field angle, same shape; the falloff of a vanishingly small pupil."""
    return np.asarray((1.0 + np.asarray(tan_field, dtype=np.float64) ** 2) ** -2)


def disc_falloff(tan_field: ArrayLike, *, tan_pupil: float) -> NDArray[np.float64]:
    """Return the irradiance from a uniform Lambertian disc at field angle, divided by that on the axis; same shape.

    Exact for the flat circular pupil of a thin lens. `tan_pupil` is the pupil's radius over the image distance. Tends to
    cos^4 for a small pupil and is larger for a large one. The form used here has no cancellation for small pupils; it is
    derived in docs/physics/relative-illumination.md.

    References
    ----------
    foote1915; gardner1947.
    """
    field_squared = np.asarray(tan_field, dtype=np.float64) ** 2
    pupil_squared = tan_pupil**2
    near = 1.0 + field_squared - pupil_squared
    root = np.sqrt((1.0 + field_squared + pupil_squared) ** 2 - 4.0 * field_squared * pupil_squared)
    return np.asarray(2.0 * (1.0 + pupil_squared) / (root * (root + near)))


def relative_illumination(*, rows: int, cols: int, tangent_pitch: float, lens: Lens) -> NDArray[np.float64]:
    """Return the irradiance relative to the axis at the sample centres, (rows, cols), in (0, 1].

    A pinhole has the cos^4 law, a thin lens the exact law of its disc-shaped pupil. No vignetting by lens barrels.
    """
    x = (np.arange(cols) + 0.5 - cols / 2) * tangent_pitch
    y = (np.arange(rows) + 0.5 - rows / 2) * tangent_pitch
    tan_field = np.hypot(y[:, None], x[None, :])
    if lens.kind == "pinhole":
        return cos_fourth(tan_field)
    return disc_falloff(tan_field, tan_pupil=0.5 / working_f_number(lens.f_number, lens.magnification))
