"""Scattering at one hit: evaluation, density and sampling of the one surface that all opaque materials are, and of glass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fullwell.render.transport import fresnel
from fullwell.render.transport.albedo import NODE_COUNT
from fullwell.render.transport.microfacet import (
    POLISHED_BELOW,
    density,
    masking,
    masking_per_cosine,
    visible_normal,
)
from fullwell.render.transport.records import GLASS, NUMBERS, ROWS, TINTED

__all__ = ["BsdfSample", "Gathered", "Surface"]


class Gathered:
    """The records of the materials that were hit."""

    def __init__(self, mi: Any, numbers: Any, rows: Any, material: Any, active: Any) -> None:
        self._mi, self._numbers, self._rows, self._material = mi, numbers, rows, material
        self.active = active
        self._flags = self.row("flags")

    def number(self, name: str) -> Any:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        return dr.gather(self._mi.Float, self._numbers, self._material * len(NUMBERS) + NUMBERS.index(name), self.active)

    def row(self, name: str) -> Any:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        return dr.gather(self._mi.UInt32, self._rows, self._material * len(ROWS) + ROWS.index(name), self.active)

    def flag(self, bit: int) -> Any:
        return (self._flags & bit) != 0


@dataclass(slots=True)
class BsdfSample:
    """A direction drawn from a surface.

    Attributes
    ----------
    wo
        The direction, in the local frame.
    weight
        Scattering function x |cosine| / density, per wavelength; holds (n_i / n_t)^2 where light is refracted.
    pdf
        Density of the lobes that have one [sr^-1]; 0 where the direction comes from a delta distribution.
    delta
        Whether it does.
    transmitted
        Whether the direction lies on the other side.
    single_wavelength
        True where dispersion kept only wavelength 0: the weight is then (W w, 0, ..., 0), or (w, 0, ..., 0) where the path had
        come with a single wavelength already.
    eta
        Index behind over index before where the light was refracted, else 1: for Russian roulette.
    """

    wo: Any
    weight: Any
    pdf: Any
    delta: Any
    transmitted: Any
    single_wavelength: Any
    eta: Any


class Surface:
    """The material of one hit: lives within one step of a path."""

    colour: Any
    eta: Any
    k: Any

    def __init__(self, mi: Any, features: frozenset[str], albedo: Any, hit: Gathered, count: int) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi: Any = mi
        self._dr: Any = dr
        self._albedo, self._count = albedo, count
        self._plastic, self._metal, self._glass = (name in features for name in ("plastic", "metal", "glass"))
        self._rough_glass = "rough_glass" in features
        self._transmitted: Any = None
        self._lobes = self._plastic or self._metal
        alpha = hit.number("alpha") if self._lobes or self._glass else mi.Float(1.0)
        self.polished = alpha < POLISHED_BELOW
        self._alpha = dr.maximum(alpha, POLISHED_BELOW)
        self.is_glass = hit.flag(GLASS) if self._glass else mi.Bool(False)
        if self._plastic:
            self._coat_index, self._inner, self._coat_mean = (
                hit.number(name) for name in ("coat_index", "inner_reflectance", "coat_mean")
            )
            self._coat_row = hit.row("coat_row") * NODE_COUNT
        if self._metal:
            self._metallic, self._metal_mean, self._metal_wide = (
                hit.number(name) for name in ("metallic", "metal_mean", "metal_wide")
            )
            self._metal_row = hit.row("metal_row") * NODE_COUNT
            self._tinted = hit.flag(TINTED)
        if self._glass:
            self._glass_index: Any = hit.number("glass_index")
            self._dispersive: Any = None
        if self._rough_glass:
            self._glass_rows = [hit.row(name) * NODE_COUNT for name in ("glass_row", "inside_row")]
            if "dispersion" in features:
                self._high_rows = [hit.row(name) * NODE_COUNT for name in ("high_row", "high_inside_row")]
                self._low_index, self._high_index = hit.number("low_index"), hit.number("high_index")

    def disperse(self, dispersive: Any, indices: Any, single: Any) -> None:
        """Give glass that is `dispersive` an index for each wavelength; `single` as in `MaterialTable.at`."""
        mi, dr = self._mi, self._dr
        self._dispersive = self.is_glass & dispersive
        self._glass_index = dr.select(self._dispersive, indices, self._glass_index)
        alone = mi.Float(self._count) if single is None else dr.select(single, 1.0, float(self._count))
        self._first_only = dr.llvm.ad.ArrayXf([alone] + [mi.Float(0.0)] * (self._count - 1))

    def transmit(self, transmitted: Any) -> None:
        """Let a sheet scatter the share `transmitted` of the light, per wavelength, on its other side."""
        dr = self._dr
        self._transmitted = transmitted
        through = self._mean(transmitted)
        self._through_share = through / dr.maximum(through + self._mean(self.colour), 1e-20)

    @property
    def lit_behind(self) -> Any:
        """Whether light from behind the surface can leave it in front."""
        return self.is_glass if self._transmitted is None else self.is_glass | (self._through_share > 0)

    @property
    def has_smooth(self) -> Any:
        """Whether `evaluate` can be other than zero: there is more than delta distributions."""
        only_delta = self._mi.Bool(False)
        if self._metal:
            only_delta |= self._metallic >= 1.0
        if self._glass:
            only_delta |= self.is_glass
        return ~(only_delta & self.polished)

    def evaluate(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """Return the scattering function x |cosine|, per wavelength, and the density [sr^-1]: of all but delta lobes."""
        wi_up, wo_up = self._upright(wi, wi), self._upright(wo, wi)
        value, pdf, _ = self._opaque(wi_up, wo_up)
        if self._transmitted is not None:
            value, pdf = self._with_sheet(value, pdf, wo_up)
        if self._glass:
            value, pdf = self._dr.select(self.is_glass, 0.0, value), self._dr.select(self.is_glass, 0.0, pdf)
        if self._rough_glass:
            rough = self.is_glass & ~self.polished
            glass_value, glass_pdf = self._evaluate_glass(wi_up, wo_up, wi.z > 0)
            value = self._dr.select(rough, glass_value, value)
            pdf = self._dr.select(rough, glass_pdf, pdf)
        return value, pdf

    def sample(self, wi: Any, u_lobe: Any, u: Any) -> BsdfSample:
        """Return a direction for the light that leaves along `wi`."""
        mi, dr = self._mi, self._dr
        up = self._upright(wi, wi)
        wo = mi.warp.square_to_cosine_hemisphere(u)
        normal = delta = None
        if self._lobes or self._rough_glass:
            normal = visible_normal(mi, dr, up, self._alpha, u)
        if self._lobes:
            share = self._facet_share(up.z)
            at_facet = u_lobe < share
            delta = at_facet & self.polished
            facet = dr.select(self.polished, mi.Vector3f(0, 0, 1), normal)
            wo = dr.select(at_facet, 2.0 * dr.dot(up, facet) * facet - up, wo)
        weight, pdf, reflectance = self._opaque(up, wo)
        through = mi.Bool(False)
        if self._transmitted is not None:
            through = u_lobe < self._through_share
            wo = mi.Vector3f(wo.x, wo.y, dr.select(through, -wo.z, wo.z))
            weight, pdf = self._with_sheet(weight, pdf, wo)
        weight = dr.select(pdf > 0, weight / dr.maximum(pdf, 1e-30), 0.0)
        if self._lobes:
            weight = dr.select(delta, reflectance / dr.maximum(share, 1e-30), weight)
            pdf = dr.select(delta, 0.0, pdf)
        drawn = BsdfSample(wo, weight, pdf, mi.Bool(False) if delta is None else delta, through, mi.Bool(False), mi.Float(1.0))
        if self._glass:
            drawn = self._with_glass(drawn, up, wi.z > 0, u_lobe=u_lobe, normal=normal)
        drawn.wo = self._upright(drawn.wo, wi)
        return drawn

    def _upright(self, direction: Any, wi: Any) -> Any:
        """Return the direction mirrored so that `wi` is above the surface: it is its own inverse."""
        return self._mi.Vector3f(direction.x, direction.y, self._dr.mulsign(direction.z, wi.z))

    # Opaque surfaces -------------------------------------------------------------------------------------------------

    def _opaque(self, wi: Any, wo: Any) -> tuple[Any, Any, Any]:
        """Return the scattering function x cosine, the density, and the reflectance of the facets between the directions."""
        dr = self._dr
        above = (wi.z > 0) & (wo.z > 0)
        cosine = dr.maximum(wo.z, 0.0) / np.pi
        value, pdf, reflectance = self._base(wi.z, wo.z) * cosine, cosine, None
        if self._lobes:
            total = wi + wo
            half = dr.normalize(self._mi.Vector3f(total.x, total.y, dr.maximum(total.z, 1e-12)))
            facets = 0.25 * density(dr, half, self._alpha) * masking_per_cosine(dr, wi, self._alpha)
            facets = dr.select(self.polished, 0.0, facets)
            share = self._facet_share(wi.z)
            reflectance = self._facet_reflectance(dr.minimum(dr.dot(wi, half), 1.0), wi.z)
            value = value + reflectance * (facets * masking(dr, wo, self._alpha))
            pdf = dr.lerp(pdf, facets, share)
        return dr.select(above, value, 0.0), dr.select(above, pdf, 0.0), reflectance

    def _with_sheet(self, value: Any, pdf: Any, wo: Any) -> tuple[Any, Any]:
        """Return value and density of an opaque surface with what a sheet sends below; equal where nothing is transmitted."""
        dr = self._dr
        below = wo.z < 0
        cosine = dr.maximum(-wo.z, 0.0) / np.pi
        value = dr.select(below, self._transmitted * cosine, value)
        return value, dr.select(below, self._through_share * cosine, (1.0 - self._through_share) * pdf)

    def _base(self, mu_i: Any, mu_o: Any) -> Any:
        """Return pi times the scattering function of all that scatters widely."""
        base = self._body()
        if self._plastic:
            base = base * (self._coat(mu_i) * self._coat(mu_o) / self._dr.square(self._coat_index))
        if self._metal:
            scale = (1.0 - self._albedo_at(self._metal_row, mu_i)) * (1.0 - self._albedo_at(self._metal_row, mu_o))
            scale = scale * self._metal_wide / self._dr.maximum(1.0 - self._metal_mean, 1e-7)
            repeated = self.colour * self._repeated() * scale
            base = self._dr.lerp(base, repeated, self._metallic)
        return base

    def _mean(self, spectral: Any) -> Any:
        """Return the mean over a path's wavelengths. Dr.Jit's own along an axis writes the number of lanes into the code."""
        return self._dr.sum(spectral) * (1.0 / self._count)

    def _body(self) -> Any:
        """Return the light a coated body sends up again inside, of the light that has entered."""
        return self.colour / (1.0 - self.colour * self._inner) if self._plastic else self.colour

    def _repeated(self) -> Any:
        """Return what remains of a metal's light when its facets scatter it more than once, not only once (kulla2017)."""
        return self.colour * self._metal_mean / (1.0 - self.colour * (1.0 - self._metal_mean))

    def _facet_reflectance(self, cosine: Any, mu_i: Any) -> Any:
        """Return the reflectance of facets at an incidence `cosine`, with the light from `mu_i` that stays in their lobe."""
        dr = self._dr
        reflectance: Any = dr.llvm.ad.ArrayXf([self._mi.Float(0.0)] * self._count)
        if self._plastic:
            reflectance = reflectance + fresnel.dielectric(dr, cosine, self._coat_index)[0]
        if self._metal:
            metal = dr.select(self._tinted, self.colour, fresnel.conductor(dr, cosine, self.eta, self.k))
            albedo = dr.maximum(self._albedo_at(self._metal_row, mu_i), 1e-3)
            metal = metal * (1.0 + self._repeated() * ((1.0 - self._metal_wide) * (1.0 - albedo) / albedo))
            reflectance = dr.lerp(reflectance, metal, self._metallic)
        return reflectance

    def _facet_share(self, mu: Any) -> Any:
        """Return the probability of the microfacet lobe: its share of the albedo, by the mean over the wavelengths."""
        dr = self._dr
        wide = self._mean(self._body())
        narrow: Any = self._mi.Float(0.0)
        if self._plastic:
            entering = self._coat(mu)
            wide = wide * (entering * self._coat_mean / dr.square(self._coat_index))
            narrow = 1.0 - entering
        if self._metal:
            albedo = self._albedo_at(self._metal_row, mu)
            repeated = (1.0 - albedo) * self._mean(self.colour * self._repeated())
            once = albedo * self._mean(self.colour)
            wide = dr.lerp(wide, repeated * self._metal_wide, self._metallic)
            narrow = dr.lerp(narrow, once + repeated * (1.0 - self._metal_wide), self._metallic)
        return dr.select(narrow > 0, narrow / dr.maximum(narrow + wide, 1e-20), 0.0)

    def _coat(self, mu: Any) -> Any:
        return self._albedo_at(self._coat_row, mu)

    def _albedo_at(self, start: Any, mu: Any) -> Any:
        mi, dr = self._mi, self._dr
        x = dr.sqrt(dr.clip(mu, 0.0, 1.0)) * (NODE_COUNT - 1)
        index = dr.minimum(mi.UInt32(x), NODE_COUNT - 2)
        low, high = (dr.gather(mi.Float, self._albedo, start + index + i) for i in (0, 1))
        return dr.lerp(low, high, x - mi.Float(index))

    # Glass -----------------------------------------------------------------------------------------------------------

    def _indices(self, outside: Any) -> tuple[Any, Any]:
        """Return the index of the far side relative to this one: of the first wavelength, and of all that differ from it."""
        dr = self._dr
        index = dr.select(outside, self._glass_index, dr.rcp(self._glass_index))
        return (index, None) if self._dispersive is None else (index[0], index)

    def _regained(self, mu: Any, outside: Any) -> Any:
        """Return one over the light that rough glass sends on at once: what makes up for the rest."""
        dr = self._dr
        albedo = self._albedo_at(dr.select(outside, *self._glass_rows), mu)
        if self._dispersive is not None:
            high = self._albedo_at(dr.select(outside, *self._high_rows), mu)
            position = (self._glass_index - self._low_index) / dr.maximum(self._high_index - self._low_index, 1e-6)
            albedo = dr.lerp(albedo, high, dr.clip(position, 0.0, 1.0))
        return dr.rcp(dr.maximum(albedo, 1e-4))

    def _per_wavelength(self, cosine: Any, reflectance: Any, indices: Any, reflected: Any) -> Any:
        """Return what a lobe of the first wavelength weighs at each: other indices reflect another share, and refract away."""
        if indices is None:
            return 1.0
        dr = self._dr
        shares = fresnel.dielectric(dr, cosine, indices)[0] / dr.maximum(reflectance, 1e-20)
        return dr.select(self._dispersive, dr.select(reflected, shares, self._first_only), 1.0)

    def _with_glass(self, opaque: BsdfSample, wi: Any, outside: Any, *, u_lobe: Any, normal: Any) -> BsdfSample:
        """Return the sample with that of glass where the material is glass."""
        mi, dr = self._mi, self._dr
        facet = mi.Vector3f(0, 0, 1)
        if self._rough_glass:
            facet = dr.select(self.polished, facet, normal)
        index, indices = self._indices(outside)
        cosine = dr.clip(dr.dot(wi, facet), 0.0, 1.0)
        reflectance, refracted = fresnel.dielectric(dr, cosine, index)
        reflected = u_lobe < reflectance
        straight = 2.0 * cosine * facet - wi
        bent = (cosine / index - refracted) * facet - wi / index
        wo = dr.select(reflected, straight, bent)
        weight: Any = dr.select(reflected, 1.0, dr.rcp(dr.square(index)))
        pdf: Any = mi.Float(0.0)
        if self._rough_glass:
            kept = masking(dr, wo, self._alpha) * self._regained(wi.z, outside)
            right_side = (wo.z > 0) == reflected
            weight = weight * dr.select(self.polished, 1.0, dr.select(right_side, kept, 0.0))
            pdf = self._evaluate_glass(wi, wo, outside)[1]
            pdf = dr.select(self.polished | ~right_side, 0.0, pdf)
        weight = weight * self._per_wavelength(cosine, reflectance, indices, reflected)
        glass, through = self.is_glass, self.is_glass & ~reflected
        return BsdfSample(
            wo=dr.select(glass, wo, opaque.wo),
            weight=dr.select(glass, weight, opaque.weight),
            pdf=dr.select(glass, pdf, opaque.pdf),
            delta=dr.select(glass, self.polished, opaque.delta),
            transmitted=dr.select(glass, through, opaque.transmitted),
            single_wavelength=mi.Bool(False) if self._dispersive is None else through & self._dispersive,
            eta=dr.select(through, index, 1.0),
        )

    def _evaluate_glass(self, wi: Any, wo: Any, outside: Any) -> tuple[Any, Any]:
        dr = self._dr
        index, indices = self._indices(outside)
        reflected = wo.z > 0
        half = dr.normalize(wi + dr.select(reflected, 1.0, index) * wo)
        half = dr.mulsign(half, half.z)
        inward, outward = dr.dot(wi, half), dr.dot(wo, half)
        cosine = dr.clip(inward, 0.0, 1.0)
        valid = (wi.z > 0) & (inward > 0) & (outward * wo.z > 0)
        reflectance = fresnel.dielectric(dr, cosine, index)[0]
        facets = density(dr, half, self._alpha) * masking_per_cosine(dr, wi, self._alpha)
        stretch = dr.square(index) * dr.abs(outward) * inward / dr.maximum(dr.square(inward + index * outward), 1e-20)
        pdf = facets * dr.select(reflected, 0.25 * reflectance, (1.0 - reflectance) * stretch)
        pdf = dr.select(valid, pdf, 0.0)
        value = pdf * masking(dr, wo, self._alpha) * self._regained(wi.z, outside)
        value = value * dr.select(reflected, 1.0, dr.rcp(dr.square(index)))
        value = value * self._per_wavelength(cosine, reflectance, indices, reflected)
        return dr.llvm.ad.ArrayXf([value] * self._count) if indices is None else value, pdf
