"""A spectrum: values at wavelengths, linear between them, with exact band averages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.radiometry.grid import WavelengthGrid

__all__ = ["Spectrum"]

_PRODUCT_TOLERANCE = 3e-7
_MOST_PARTS = 256
_NEGLIGIBLE_BEND = 1e-8


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
        Raises ShapeError where the edges are not one-dimensional and strictly increasing.
        """
        edges = _increasing(edges_nm)
        knots = self._knots_with(edges)
        left, right = self._limits(knots)
        return _sum_between(edges, knots, 0.5 * (left + right) * np.diff(knots))

    def integral_of_product(self, other: Spectrum, edges_nm: ArrayLike) -> NDArray[np.float64]:
        """Return the exact integrals of this spectrum times another between successive edges, (n - 1,).

        The product of two piecewise linear curves is piecewise quadratic, and Simpson's rule is exact for it.
        """
        edges = _increasing(edges_nm)
        knots = np.union1d(self._knots_with(edges), other._knots_with(edges))
        (left, right), (other_left, other_right) = self._limits(knots), other._limits(knots)
        middle = (left + right) * (other_left + other_right)
        return _sum_between(edges, knots, (left * other_left + middle + right * other_right) * np.diff(knots) / 6.0)

    def _limits(self, knots: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the limits from inside of each interval between knots: the step at a table's end has two values."""
        heights = np.interp(knots, self.wavelength_nm, self.values)
        if self.outside == "hold":
            return heights[:-1], heights[1:]
        middle = 0.5 * (knots[:-1] + knots[1:])
        inside = (middle > self.wavelength_nm[0]) & (middle < self.wavelength_nm[-1])
        return np.where(inside, heights[:-1], 0.0), np.where(inside, heights[1:], 0.0)

    def _knots_with(self, edges: NDArray[np.float64]) -> NDArray[np.float64]:
        within = self.wavelength_nm[(self.wavelength_nm > edges[0]) & (self.wavelength_nm < edges[-1])]
        return np.union1d(edges, within)

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
        """Return the product as a piecewise linear curve whose integrals are those of the exact product.

        Over every interval between two wavelengths of either table the integral is exact (to rounding). Where an interval
        is steep in both factors, knots are added inside it so that a band that cuts through the interval is right to about
        1e-6 of the interval's mean as well. Values at the tables' own wavelengths are exact; added knots are shifted by
        what keeps the integral.
        """
        outside: Literal["zero", "hold"] = "zero" if "zero" in (self.outside, other.outside) else "hold"
        knots = np.union1d(self.wavelength_nm, other.wavelength_nm)
        for part in (self, other):
            if part.outside == "zero":
                knots = knots[(knots >= part.wavelength_nm[0]) & (knots <= part.wavelength_nm[-1])]
        if knots.size == 0:  # the two tables do not overlap: the product is zero everywhere
            knots, heights = self.wavelength_nm, np.zeros_like(self.values)
        else:
            knots, heights = _product_knots(knots, self.at(knots), other.at(knots))
        return Spectrum(
            knots,
            heights,
            outside=outside,
            unit=self.unit if unit is None else unit,
            source=f"{self.source} x {other.source}",
            upsampled=self.upsampled or other.upsampled,
        )


def _increasing(edges_nm: ArrayLike) -> NDArray[np.float64]:
    edges = np.asarray(edges_nm, dtype=np.float64)
    if edges.ndim != 1 or edges.size == 0 or not np.all(np.isfinite(edges)) or np.any(np.diff(edges) <= 0):
        raise ShapeError(f"edges_nm has shape {edges.shape}; must be (n,), finite and strictly increasing.")
    return edges


def _sum_between(edges: NDArray[np.float64], knots: NDArray[np.float64], pieces: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum the integrals of the intervals between knots into those between edges; every edge is a knot."""
    if edges.size < 2:
        return np.zeros(0)
    # Sums per band, not differences of one running sum: a dim band beside a bright one keeps its digits.
    return np.asarray(np.add.reduceat(pieces, np.searchsorted(knots, edges[:-1])))


def _product_knots(
    knots: NDArray[np.float64], first: NDArray[np.float64], second: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the knots and heights of a piecewise linear curve with the integrals of the product of two linear ones.

    In an interval of width h the product bends by the constant b = (rise of first)(rise of second). Linear pieces between
    m + 1 exact heights enclose b h / 6 m^2 too much. Lowering the m - 1 inner heights by b / 6 m^2, the outermost two of
    them by half as much again, takes exactly that away; what is left within the interval falls with m^3.
    """
    bend = np.diff(first) * np.diff(second)
    ends = first * second
    mean = np.abs(0.5 * (ends[:-1] + ends[1:]) - bend / 6.0)
    floor = 1e-3 * float(np.max(np.abs(ends))) if ends.size else 0.0
    ratio = np.abs(bend) / np.maximum(np.maximum(mean, floor), np.finfo(np.float64).tiny)
    # At least 3, because the two outermost inner knots must be two; the error left in a cut is about ratio / 24 parts^3.
    parts = np.clip(np.ceil(np.cbrt(ratio / _PRODUCT_TOLERANCE)), 3, _MOST_PARTS).astype(np.int64)
    parts[ratio < _NEGLIGIBLE_BEND] = 1
    start = np.repeat(np.arange(parts.size), parts)
    index = np.arange(start.size) - np.repeat(np.cumsum(parts) - parts, parts)
    count = parts[start].astype(np.float64)
    share = index / count
    heights = (first[start] + share * np.diff(first)[start]) * (second[start] + share * np.diff(second)[start])
    weight = np.where(index == 0, 0.0, np.where((index == 1) | (index == parts[start] - 1), 1.5, 1.0))
    heights = heights - weight * bend[start] / (6.0 * count**2)
    positions = knots[start] + share * np.diff(knots)[start]
    return np.append(positions, knots[-1]), np.append(heights, ends[-1])
