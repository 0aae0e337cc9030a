"""A spectrum: values at wavelengths, linear between them, with exact band averages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.radiometry.grid import WavelengthGrid

__all__ = ["Spectrum"]


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """A piecewise linear function of wavelength.

    Attributes
    ----------
    wavelength_nm
        (n,) strictly increasing [nm].
    values
        (n,) in `unit`, finite.
    outside
        What holds beyond the table: "zero" (sources, quantum efficiencies) or "hold" the end value (reflectances).
    unit
        For people and manifests, for example "W sr^-1 m^-2 nm^-1"; "1" for reflectance.
    source
        Where the numbers come from (a citation, or "recipe").
    upsampled
        True where the curve was made up from an RGB colour: a plausible spectrum, not a measured one.
    """

    wavelength_nm: NDArray[np.float64]
    values: NDArray[np.float64]
    outside: Literal["zero", "hold"] = "hold"
    unit: str = "1"
    source: str = ""
    upsampled: bool = False

    def __post_init__(self) -> None:
        wavelength_nm = np.array(self.wavelength_nm, dtype=np.float64)
        values = np.array(self.values, dtype=np.float64)
        if wavelength_nm.ndim != 1 or wavelength_nm.shape != values.shape or wavelength_nm.size == 0:
            raise ShapeError(
                f"wavelength_nm has shape {wavelength_nm.shape} and values {values.shape}; both must be (n,), n >= 1."
            )
        if not np.all(np.isfinite(wavelength_nm)) or not np.all(np.isfinite(values)):
            raise FieldError("the spectrum holds NaN or Inf; every wavelength and value must be finite.")
        if np.any(np.diff(wavelength_nm) <= 0):
            raise FieldError("wavelengths must increase strictly; sort the table and remove repeated wavelengths.")
        wavelength_nm.setflags(write=False)
        values.setflags(write=False)
        object.__setattr__(self, "wavelength_nm", wavelength_nm)
        object.__setattr__(self, "values", values)

    @classmethod
    def constant(cls, value: float, *, unit: str = "1", source: str = "constant") -> Spectrum:
        """Return the spectrum that is `value` at every wavelength."""
        return cls(np.array([550.0]), np.array([float(value)]), outside="hold", unit=unit, source=source)

    def at(self, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
        """Return the values at the given wavelengths [nm], same shape."""
        edge = None if self.outside == "hold" else 0.0
        wanted = np.asarray(wavelength_nm, dtype=np.float64)
        return np.asarray(np.interp(wanted, self.wavelength_nm, self.values, left=edge, right=edge))

    def integral(self, edges_nm: ArrayLike) -> NDArray[np.float64]:
        """Return the exact integrals between successive edges, (n - 1,) for (n,) edges [unit x nm].

        The piecewise linear curve is integrated in closed form; narrow lines between band centres are not lost.
        """
        edges = np.asarray(edges_nm, dtype=np.float64)
        knots = self._knots_with(edges)
        heights = self.at(knots)
        if self.outside == "zero":
            # The step at either end of the table has two values; take the inner one inside, 0 outside.
            middle = 0.5 * (knots[:-1] + knots[1:])
            inside = (middle > self.wavelength_nm[0]) & (middle < self.wavelength_nm[-1])
            inner = np.interp(knots, self.wavelength_nm, self.values)
            pieces = np.where(inside, 0.5 * (inner[:-1] + inner[1:]) * np.diff(knots), 0.0)
        else:
            pieces = 0.5 * (heights[:-1] + heights[1:]) * np.diff(knots)
        cumulative = np.concatenate([[0.0], np.cumsum(pieces)])
        return np.asarray(np.diff(cumulative[np.searchsorted(knots, edges)]))

    def _knots_with(self, edges: NDArray[np.float64]) -> NDArray[np.float64]:
        within = self.wavelength_nm[(self.wavelength_nm > edges.min()) & (self.wavelength_nm < edges.max())]
        return np.unique(np.concatenate([edges, within]))

    def band_average(self, grid: WavelengthGrid) -> NDArray[np.float64]:
        """Return (bands,) exact means over the grid's bands, in the spectrum's unit."""
        return self.integral(grid.edges_nm) / grid.step_nm

    def scaled(self, factor: float, *, unit: str | None = None) -> Spectrum:
        """Return the spectrum times `factor`, with another unit where one is given."""
        return Spectrum(
            self.wavelength_nm,
            self.values * float(factor),
            outside=self.outside,
            unit=self.unit if unit is None else unit,
            source=self.source,
            upsampled=self.upsampled,
        )

    def times(self, other: Spectrum, *, unit: str | None = None) -> Spectrum:
        """Return the product, on the union of both tables' wavelengths (exact at the knots, linear between them)."""
        outside: Literal["zero", "hold"] = "zero" if "zero" in (self.outside, other.outside) else "hold"
        knots = np.union1d(self.wavelength_nm, other.wavelength_nm)
        for part in (self, other):
            if part.outside == "zero":
                knots = knots[(knots >= part.wavelength_nm[0]) & (knots <= part.wavelength_nm[-1])]
        if knots.size == 0:
            return Spectrum(self.wavelength_nm, np.zeros_like(self.values), outside="zero", unit=unit or self.unit)
        return Spectrum(
            knots,
            self.at(knots) * other.at(knots),
            outside=outside,
            unit=self.unit if unit is None else unit,
            source=f"{self.source} x {other.source}",
            upsampled=self.upsampled or other.upsampled,
        )
