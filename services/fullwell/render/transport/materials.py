"""Materials as tables: one scattering function for all, whose parameters each hit gathers by its material's number.

Every opaque material is the same surface: a diffuse base under a clear coat, and a metal, mixed by `metallic`; both share one
microfacet lobe, and all that scatters widely is sampled as one cosine lobe. A diffuse surface is a coat of index 1. Glass is
the other kind. What light single scattering at the microfacets loses is given back; see docs/physics/materials.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fullwell.render.transport.records import DISPERSIVE, TEXTURED, MaterialRecords
from fullwell.render.transport.scattering import BsdfSample, Gathered, Surface
from fullwell.render.transport.textures import sigmoid, texel_of
from fullwell.render.transport.upload import upload
from fullwell.render.transport.wavelengths import SpectraTable, look_up
from fullwell.scene import Material

__all__ = ["BsdfSample", "MaterialTable", "Surface"]


class MaterialTable:
    """The materials of a scene on the device.

    Attributes
    ----------
    features
        Which code the materials need, of "texture", "translucent", "plastic", "metal", "glass", "rough_glass" and "dispersion".
        Kernels of equal features are the same, whatever the materials.
    """

    features: frozenset[str]

    def __init__(self, mi: Any, spectra: SpectraTable, materials: Sequence[Material], *, compensate: bool = True) -> None:
        """Add the materials' spectra to `spectra` and upload the rest.

        `compensate=False` leaves the light lost that single scattering loses, as Mitsuba's rough materials do.
        """
        records = MaterialRecords(spectra, materials, compensate=compensate)
        self._mi, self.features = mi, records.features
        self._numbers, self._rows = upload(mi.Float, records.numbers()), upload(mi.UInt32, records.rows())
        self._albedo = upload(mi.Float, records.albedos())
        if "texture" in self.features:
            self._texels, self._palette = records.atlas.finish(mi)

    def at(  # noqa: PLR0917 - one hit in one call
        self,
        spectra_device: Any,
        material: Any,
        uv: Any,
        cells: list[Any],
        wavelengths_nm: list[Any],
        u_texture: Any,
        active: Any,
        single: Any = None,
    ) -> Surface:
        """Return the surface at hits with the `material` numbers (UInt32).

        Parameters
        ----------
        spectra_device
            The finished table of spectra.
        uv
            Texture coordinates.
        cells, wavelengths_nm
            The path's wavelengths, W of each.
        u_texture
            Uniform in [0, 1): which of four texels is taken.
        single
            Whether dispersion has left the path with wavelength 0 alone (see `BsdfSample.single_wavelength`); None: nowhere.
        """
        hit = Gathered(self._mi, self._numbers, self._rows, material, active)
        surface = Surface(self._mi, self.features, self._albedo, hit, len(cells))
        surface.colour = look_up(self._mi, spectra_device, hit.row("colour"), cells)
        if "texture" in self.features:
            surface.colour = self._textured(hit, surface.colour, uv, wavelengths_nm, u_texture)
        if "translucent" in self.features:
            surface.transmit(look_up(self._mi, spectra_device, hit.row("transmitted"), cells))
        if "metal" in self.features:
            surface.eta = look_up(self._mi, spectra_device, hit.row("eta"), cells)
            surface.k = look_up(self._mi, spectra_device, hit.row("k"), cells)
        if "dispersion" in self.features:
            indices = look_up(self._mi, spectra_device, hit.row("index"), cells)
            surface.disperse(hit.flag(DISPERSIVE), indices / hit.number("exterior_index"), single)
        return surface

    def _textured(self, hit: Gathered, plain: Any, uv: Any, wavelengths_nm: list[Any], u: Any) -> Any:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        mi = self._mi
        has = hit.flag(TEXTURED) & hit.active
        texel = hit.row("texture_offset") + texel_of(mi, dr, uv, u, rows=hit.row("texture_rows"), cols=hit.row("texture_cols"))
        start = dr.gather(mi.UInt32, self._texels, texel, has) * 3
        coefficients = mi.Vector3f(*(dr.gather(mi.Float, self._palette, start + i, has) for i in range(3)))
        return dr.select(has, sigmoid(dr, coefficients, wavelengths_nm), plain)
