"""GGX microfacets with separable Smith masking, in a frame whose +z is the mean surface and whose directions point outwards.

Separable masking is what Mitsuba's rough materials have, so that pictures of the two agree where nothing is compensated.
"""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["POLISHED_BELOW", "density", "masking", "masking_per_cosine", "visible_normal"]

POLISHED_BELOW = 1e-3
"""Roughness alpha below which a surface is polished: single precision could not tell its lobe from a delta distribution."""

_TINY = 1e-20


def density(dr: Any, normal: Any, alpha: Any) -> Any:
    """Return the density of microfacet normals per projected area [sr^-1].

    References
    ----------
    walter2007, eq. 33.
    """
    scaled = dr.square(normal.x / alpha) + dr.square(normal.y / alpha) + dr.square(normal.z)
    value = 1.0 / (np.pi * dr.square(alpha * scaled))
    return dr.select(value * normal.z > _TINY, value, 0.0)


def masking_per_cosine(dr: Any, direction: Any, alpha: Any) -> Any:
    """Return Smith's masking of a direction divided by its cosine, which stays finite at grazing incidence.

    References
    ----------
    walter2007, eq. 34.
    """
    spread = dr.square(alpha) * (dr.square(direction.x) + dr.square(direction.y))
    cosine = dr.abs(direction.z)
    return 2.0 / dr.maximum(cosine + dr.sqrt(dr.square(cosine) + spread), _TINY)


def masking(dr: Any, direction: Any, alpha: Any) -> Any:
    """Return the share of microfacets that is visible from a direction, facing ones only (Smith's G1)."""
    return masking_per_cosine(dr, direction, alpha) * dr.abs(direction.z)


def visible_normal(mi: Any, dr: Any, direction: Any, alpha: Any, u: Any) -> Any:
    """Return a microfacet normal drawn from those that `direction` (z >= 0) sees.

    Its density is masking(direction) x (direction . normal) x density(normal) / direction.z.

    References
    ----------
    dupuy2023, listing 3.
    """
    stretched = dr.normalize(mi.Vector3f(alpha * direction.x, alpha * direction.y, direction.z))
    sine, cosine = dr.sincos(2.0 * np.pi * u.x)
    z = dr.fma(1.0 - u.y, 1.0 + stretched.z, -stretched.z)
    radius = dr.safe_sqrt(u.y * (1.0 + stretched.z) * (1.0 + z))
    return dr.normalize(
        mi.Vector3f(
            alpha * (radius * cosine + stretched.x),
            alpha * (radius * sine + stretched.y),
            dr.maximum((1.0 - u.y) * (1.0 + stretched.z), 1e-12),
        )
    )
