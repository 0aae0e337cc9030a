"""The wavelength grid of a recipe: equal bands, each the mean over its width."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fullwell.core.errors import FieldError

__all__ = ["DEFAULT_GRID", "MAX_WAVELENGTH_NM", "MIN_WAVELENGTH_NM", "WavelengthGrid"]

MIN_WAVELENGTH_NM = 380.0
MAX_WAVELENGTH_NM = 1000.0
MIN_STEP_NM = 0.1
"""Keeps a mistyped step from asking for millions of bands."""


@dataclass(frozen=True, slots=True)
class WavelengthGrid:
    """Equally spaced bands. Band k covers [centre - step/2, centre + step/2] and holds the *mean* over it.

    A sum over bands times `step_nm` is therefore the integral over the covered range. `first_nm` and `last_nm` are band
    centres, both within [380, 1000] nm.
    """

    first_nm: float = 400.0
    last_nm: float = 700.0
    step_nm: float = 10.0

    def __post_init__(self) -> None:
        if not MIN_STEP_NM <= self.step_nm <= MAX_WAVELENGTH_NM - MIN_WAVELENGTH_NM:
            raise FieldError(
                f"step_nm is {self.step_nm}; must be within {MIN_STEP_NM:g} to {MAX_WAVELENGTH_NM - MIN_WAVELENGTH_NM:g} nm.",
                path="step_nm",
                value=self.step_nm,
            )
        low, high = MIN_WAVELENGTH_NM, MAX_WAVELENGTH_NM
        for name in ("first_nm", "last_nm"):
            value = getattr(self, name)
            if not low <= value <= high:
                raise FieldError(f"{name} is {value}; must be within {low:g} to {high:g} nm.", path=name, value=value)
        if self.last_nm < self.first_nm:
            raise FieldError(
                f"last_nm is {self.last_nm}; must be at least first_nm = {self.first_nm}.",
                path="last_nm",
                value=self.last_nm,
            )
        steps = (self.last_nm - self.first_nm) / self.step_nm
        if abs(steps - round(steps)) > 1e-6:
            raise FieldError(
                f"last_nm - first_nm is {self.last_nm - self.first_nm} nm; must be a whole number of step_nm = "
                f"{self.step_nm} nm.",
                path="step_nm",
                value=self.step_nm,
            )

    @property
    def count(self) -> int:
        """Number of bands."""
        return round((self.last_nm - self.first_nm) / self.step_nm) + 1

    @property
    def centres_nm(self) -> NDArray[np.float64]:
        """(bands,) band centres [nm]."""
        return self.first_nm + self.step_nm * np.arange(self.count, dtype=np.float64)

    @property
    def edges_nm(self) -> NDArray[np.float64]:
        """(bands + 1,) band edges [nm]."""
        return self.first_nm + self.step_nm * (np.arange(self.count + 1, dtype=np.float64) - 0.5)


DEFAULT_GRID = WavelengthGrid()
