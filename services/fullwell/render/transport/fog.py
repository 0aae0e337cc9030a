"""A layer of fog on the device: how far a ray gets in it, and where it goes on."""

from __future__ import annotations

from typing import Any

from fullwell.scene import Fog

__all__ = ["FogLayer"]

_LEVEL = 1e-6
"""Vertical component of a direction below which a ray stays in the layer, or out of it."""


class FogLayer:
    """Fog about a camera at the origin. Grey: a ray's chance of passing is the same at all its wavelengths."""

    def __init__(self, mi: Any, fog: Fog, camera_height_m: float) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        self._extinction_per_m = dr.opaque(mi.Float, float(fog.extinction_per_m))
        self.albedo = dr.opaque(mi.Float, float(fog.albedo))
        self._asymmetry = dr.opaque(mi.Float, float(fog.asymmetry))
        self._bottom_m = dr.opaque(mi.Float, float(fog.bottom_m - camera_height_m))
        self._top_m = dr.opaque(mi.Float, float(fog.top_m - camera_height_m))

    def _within(self, origin: Any, direction: Any, length_m: Any) -> tuple[Any, Any]:
        """Return (start, end) [m] of the part of a ray that lies in the layer; end <= start where none does."""
        dr = self._dr
        level = dr.abs(direction.z) < _LEVEL
        slope = dr.rcp(dr.select(level, 1.0, direction.z))
        to_bottom, to_top = (self._bottom_m - origin.z) * slope, (self._top_m - origin.z) * slope
        inside = (origin.z > self._bottom_m) & (origin.z < self._top_m)
        start = dr.select(level, dr.select(inside, 0.0, dr.inf), dr.maximum(dr.minimum(to_bottom, to_top), 0.0))
        end = dr.minimum(dr.select(level, dr.inf, dr.maximum(to_bottom, to_top)), length_m)
        return start, end

    def transmittance(self, origin: Any, direction: Any, length_m: Any) -> Any:
        """Return the share of light that passes along `length_m` (infinite for rays without end)."""
        dr = self._dr
        start, end = self._within(origin, direction, length_m)
        return dr.select(end > start, dr.exp(-self._extinction_per_m * (end - start)), 1.0)

    def collision(self, origin: Any, direction: Any, length_m: Any, u: Any) -> tuple[Any, Any]:
        """Return (whether a ray meets a droplet before `length_m`, the distance to it [m])."""
        dr = self._dr
        start, end = self._within(origin, direction, length_m)
        distance = start - dr.log(1.0 - u) / self._extinction_per_m
        return (end > start) & (distance < end), distance

    def phase(self, cosine: Any) -> Any:
        """Return the phase function, which is its own density [sr^-1], by the cosine between old and new direction."""
        dr, g = self._dr, self._asymmetry
        under = dr.maximum(1.0 + g * g - 2.0 * g * cosine, 1e-12)
        return (1.0 - g * g) * dr.rcp(under * dr.sqrt(under)) * (0.25 / dr.pi)

    def scatter(self, direction: Any, u: Any) -> tuple[Any, Any]:
        """Return (new direction, its density [sr^-1])."""
        mi, dr, g = self._mi, self._dr, self._asymmetry
        ratio = (1.0 - g * g) / (1.0 - g + 2.0 * g * u.x)
        skew = (1.0 + g * g - ratio * ratio) / (2.0 * dr.select(dr.abs(g) < 1e-3, 1.0, g))
        cosine = dr.clip(dr.select(dr.abs(g) < 1e-3, 2.0 * u.x - 1.0, skew), -1.0, 1.0)
        sine = dr.safe_sqrt(1.0 - cosine * cosine)
        azimuth_sine, azimuth_cosine = dr.sincos(2.0 * dr.pi * u.y)
        frame = mi.Frame3f(direction)
        onward = frame.to_world(mi.Vector3f(sine * azimuth_cosine, sine * azimuth_sine, cosine))
        return onward, self.phase(cosine)
