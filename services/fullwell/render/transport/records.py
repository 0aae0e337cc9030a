"""Scene materials as the numbers that the device gathers: one record each, whatever the material is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fullwell.radiometry.glasses import index_of_line
from fullwell.radiometry.spectrum import Spectrum
from fullwell.render.transport.albedo import (
    NODE_COUNT,
    coat_transmittance,
    entering,
    glass_albedo,
    hemisphere_mean,
    metal_albedo,
    mitsuba_internal,
)
from fullwell.render.transport.fresnel import conductor_mean
from fullwell.render.transport.microfacet import POLISHED_BELOW
from fullwell.render.transport.textures import TextureAtlas
from fullwell.render.transport.wavelengths import SpectraTable, cell_means
from fullwell.scene import Conductor, Dielectric, Diffuse, Material, Mirror, Principled, RoughPlastic, Texture, Translucent

__all__ = ["DISPERSIVE", "GLASS", "NUMBERS", "ROWS", "TEXTURED", "TINTED", "MaterialRecords"]

TINTED, GLASS, TEXTURED, DISPERSIVE = 1, 2, 4, 8

_INDEX_STEP = 1e-3
"""Relative step of the index below which rough glass is polished: it bends light by less than single precision can follow."""

_WIDE_FROM_ALPHA = (0.02, 0.1)
"""Light that a metal's facets scatter repeatedly stays in the lobe of smoother metals, and goes everywhere from rougher ones:
smooth ones lose light at grazing incidence only, and a wide lobe that holds it would be a rare bright one."""

_GLASS_RANGE_NM = (380.0, 1000.0)
"""Between its indices at these, the albedo of dispersive rough glass is taken as linear in the index."""


@dataclass(slots=True)
class _Record:
    """One material's numbers, as the device gathers them: `NUMBERS` in single precision, `ROWS` as whole numbers."""

    alpha: float = 1.0
    metallic: float = 0.0
    coat_index: float = 1.0
    inner_reflectance: float = 0.0
    coat_mean: float = 1.0
    metal_mean: float = 1.0
    metal_wide: float = 1.0
    glass_index: float = 1.0
    exterior_index: float = 1.0
    low_index: float = 0.0
    high_index: float = 1.0
    flags: int = 0
    colour: int = SpectraTable.BLACK
    eta: int = SpectraTable.BLACK
    k: int = SpectraTable.BLACK
    index: int = SpectraTable.BLACK
    transmitted: int = SpectraTable.BLACK
    coat_row: int = 0
    metal_row: int = 0
    glass_row: int = 0
    inside_row: int = 0
    high_row: int = 0
    high_inside_row: int = 0
    texture_offset: int = 0
    texture_rows: int = 1
    texture_cols: int = 1


NUMBERS = (
    "alpha",
    "metallic",
    "coat_index",
    "inner_reflectance",
    "coat_mean",
    "metal_mean",
    "metal_wide",
    "glass_index",
    "exterior_index",
    "low_index",
    "high_index",
)
ROWS = (
    "flags",
    "colour",
    "eta",
    "k",
    "index",
    "transmitted",
    "coat_row",
    "metal_row",
    "glass_row",
    "inside_row",
    "high_row",
    "high_inside_row",
    "texture_offset",
    "texture_rows",
    "texture_cols",
)


class _AlbedoRows:
    """Collects albedo rows; row 0 is 1 everywhere, which compensates nothing."""

    def __init__(self) -> None:
        self._rows = [np.ones(NODE_COUNT)]
        self._known: dict[tuple[Any, ...], int] = {}

    def add(self, make: Callable[..., NDArray[np.float64]], *parameters: float) -> int:
        key = (make, *parameters)
        if key not in self._known:
            self._known[key] = len(self._rows)
            self._rows.append(make(*parameters))
        return self._known[key]

    def mean(self, number: int) -> float:
        return hemisphere_mean(self._rows[number])

    def values(self) -> NDArray[np.float32]:
        return np.concatenate(self._rows).astype(np.float32)


class MaterialRecords:
    """The records of a scene's materials, with the albedo rows and textures they name; spectra go to `spectra`.

    Attributes
    ----------
    features
        See `materials.MaterialTable`.
    atlas
        The textures.
    """

    def __init__(self, spectra: SpectraTable, materials: Sequence[Material], *, compensate: bool) -> None:
        self.atlas = TextureAtlas()
        self._spectra, self._albedos, self._compensate = spectra, _AlbedoRows(), compensate
        self._found: set[str] = set()
        self._records = [self._record(material) for material in materials] or [_Record()]
        self.features = frozenset(self._found)

    def numbers(self) -> NDArray[np.float32]:
        """Return the `NUMBERS` of all records, one after the other."""
        return np.array([getattr(record, name) for record in self._records for name in NUMBERS], dtype=np.float32)

    def rows(self) -> NDArray[np.uint32]:
        """Return the `ROWS` of all records, one after the other."""
        return np.array([getattr(record, name) for record in self._records for name in ROWS], dtype=np.uint32)

    def albedos(self) -> NDArray[np.float32]:
        """Return the albedo rows, one after the other."""
        return self._albedos.values()

    def _record(self, material: Material) -> _Record:
        record = _Record()
        match material:
            case Diffuse(reflectance=reflectance):
                self._colour(record, reflectance)
            case Translucent():
                self._colour(record, material.reflectance)
                record.transmitted = self._spectra.add(material.transmittance)
                self._found.add("translucent")
            case RoughPlastic():
                self._colour(record, material.reflectance)
                self._coat(record, material.roughness, material.interior_index)
            case Principled():
                self._principled(record, material)
            case Conductor():
                self._conductor(record, material)
            case Mirror(reflectance=reflectance):
                self._colour(record, reflectance)
                record.flags |= TINTED
                self._metal(record, 0.0, 1.0)
            case Dielectric():
                self._glass(record, material)
        return record

    def _colour(self, record: _Record, colour: Spectrum | Texture) -> None:
        if isinstance(colour, Spectrum):
            record.colour = self._spectra.add(colour)
            return
        placed = self.atlas.add(colour)
        record.flags |= TEXTURED
        record.texture_offset, record.texture_rows, record.texture_cols = placed.offset, placed.rows, placed.cols
        self._found.add("texture")

    def _coat(self, record: _Record, roughness: float, index: float) -> None:
        alpha, index = float(roughness), float(index)
        record.alpha, record.coat_index = alpha, index
        if index == 1.0:
            return
        record.coat_row = self._albedos.add(coat_transmittance if self._compensate else entering, alpha, index)
        record.coat_mean = self._albedos.mean(record.coat_row)
        # Reciprocity: what a surface lets out of diffuse light from below is what it lets in from above over index^2.
        record.inner_reflectance = 1.0 - record.coat_mean / index**2
        if not self._compensate:
            record.inner_reflectance = mitsuba_internal(max(alpha, POLISHED_BELOW), index)
        self._found.add("plastic")

    def _metal(self, record: _Record, roughness: float, share: float) -> None:
        record.alpha, record.metallic = float(roughness), float(share)
        if self._compensate and record.alpha >= POLISHED_BELOW:
            record.metal_row = self._albedos.add(metal_albedo, record.alpha)
            record.metal_mean = self._albedos.mean(record.metal_row)
            low, high = _WIDE_FROM_ALPHA
            record.metal_wide = min(1.0, max(0.0, (record.alpha - low) / (high - low)))
        self._found.add("metal")

    def _principled(self, record: _Record, material: Principled) -> None:
        self._colour(record, material.base_color)
        alpha, metallic = float(material.roughness) ** 2, min(1.0, max(0.0, float(material.metallic)))
        if metallic < 1.0:
            # specular 0.5 is the 4 % of an index of 1.5: F0 = 0.08 * specular.
            amplitude = np.sqrt(0.08 * float(material.specular))
            self._coat(record, alpha, max(1.001, (1.0 + amplitude) / (1.0 - amplitude)))
        if metallic > 0.0:
            record.flags |= TINTED
            self._metal(record, alpha, metallic)

    def _conductor(self, record: _Record, material: Conductor) -> None:
        record.eta, record.k = self._spectra.add(material.eta), self._spectra.add(material.k)
        eta, k = (cell_means(spectrum).astype(np.float64) for spectrum in (material.eta, material.k))
        # The colour of a metal is its mean reflectance: what repeated scattering sees, and how the lobes are chosen.
        record.colour = self._spectra.add_cells(conductor_mean(eta, k).astype(np.float32))
        self._metal(record, material.roughness, 1.0)

    def _glass(self, record: _Record, material: Dielectric) -> None:
        record.flags |= GLASS
        self._found.add("glass")
        inside, record.exterior_index = material.interior_index, float(material.exterior_index)
        extremes: list[float] = []
        if isinstance(inside, Spectrum):
            if np.ptp(cell_means(inside)) > 0.0:
                record.flags |= DISPERSIVE
                record.index = self._spectra.add(inside)
                self._found.add("dispersion")
                extremes = sorted(inside.at(_GLASS_RANGE_NM) / record.exterior_index)
            inside = index_of_line(inside)
        record.glass_index = float(inside) / record.exterior_index
        record.alpha = float(material.roughness)
        if abs(record.glass_index - 1.0) < _INDEX_STEP:
            record.alpha = 0.0
        if record.alpha >= POLISHED_BELOW:
            self._found.add("rough_glass")
            self._rough_glass(record, extremes or [record.glass_index])

    def _rough_glass(self, record: _Record, indices: list[float]) -> None:
        """Add the albedos at one index, or at the two between which others are interpolated."""
        if not self._compensate:
            return
        record.low_index, record.high_index = indices[0], indices[-1] + (1.0 if len(indices) == 1 else 0.0)
        rows = [[self._albedos.add(glass_albedo, record.alpha, n) for n in (index, 1.0 / index)] for index in indices]
        (record.glass_row, record.inside_row), (record.high_row, record.high_inside_row) = rows[0], rows[-1]
