"""The camera equation: from the radiance of the scene to the irradiance on the axis."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError
from fullwell.radiometry.grid import WavelengthGrid
from fullwell.scene.camera import Lens

__all__ = ["on_axis_factor_sr", "projected_solid_angle_sr", "working_f_number"]


def working_f_number(f_number: float, magnification: float) -> float:
    """Return N (1 + |m|), the f-number of the cone that reaches the film; equal to N when focused at infinity."""
    return f_number * (1.0 + abs(magnification))


def projected_solid_angle_sr(f_number: float, magnification: float) -> float:
    """Return the projected solid angle of the pupil seen from the axis of the film [sr], pi / (1 + 4 N^2 (1 + |m|)^2).

    This is pi sin^2 of the half angle of the cone; the tangent of that angle is 1 / (2 N (1 + |m|)). Derived in
    docs/physics/camera-equation.md.

    References
    ----------
    smith2008, chapter 8; farrell2012.
    """
    return math.pi / (1.0 + 4.0 * working_f_number(f_number, magnification) ** 2)


def on_axis_factor_sr(lens: Lens, grid: WavelengthGrid) -> NDArray[np.float64]:
    """Return the on-axis irradiance per radiance, transmittance included: (bands,) [sr].

    Raises
    ------
    FieldError
        The f-number is not positive or the transmittance leaves [0, 1].
    """
    if not 0 < lens.f_number < math.inf:
        raise FieldError(
            f"f_number is {lens.f_number}; must be > 0 and finite. Set lens.f_number.", path="f_number", value=lens.f_number
        )
    if not 0 < lens.focal_length_m < lens.focus_distance_m:
        raise FieldError(
            f"focus_distance_m is {lens.focus_distance_m}; must be greater than focal_length_m = {lens.focal_length_m} > 0, or "
            "no real image forms. Set lens.focus_distance_m.",
            path="focus_distance_m",
            value=lens.focus_distance_m,
        )
    transmittance = lens.transmittance.band_average(grid)
    # The table itself is checked rather than its band means, which may leave the range by rounding.
    worst = float(lens.transmittance.values[np.argmax(np.abs(lens.transmittance.values - 0.5))])
    if not 0 <= worst <= 1:
        raise FieldError(
            f"transmittance holds {worst}; must be in [0, 1]. Set lens.transmittance.", path="transmittance", value=worst
        )
    return projected_solid_angle_sr(lens.f_number, lens.magnification) * transmittance
