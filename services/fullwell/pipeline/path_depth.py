"""How long paths need to be: what the surfaces give back bounds the light of longer ones. See docs/physics/skips.md."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fullwell.pipeline.steps import PlanStep
from fullwell.radiometry import Spectrum, WavelengthGrid, srgb_to_linear
from fullwell.scene import Diffuse, Fog, Material, SceneDescription, Texture, Translucent

__all__ = ["LargestReflectance", "choose_depth", "largest_reflectance", "tail_bound"]

_TAIL_BOUND = 1e-3
"""Light of the paths that are left out, in parts of the brightest directly lit surface."""

_SHORTEST = 2
"""Segments that show what a lamp lights: the bound is on what comes after it."""

_DEPTH_IN_FOG = 32
"""Segments that a path should have where it meets more than one droplet on its way through the scene."""

_LONGER = "paths that are longer, not bounded"


@dataclass(frozen=True, slots=True)
class LargestReflectance:
    """The largest share of light that any surface gives back, and what is to blame: the object, or its glossy material."""

    value: float
    object_id: str
    matte: bool


def largest_reflectance(scene: SceneDescription, grid: WavelengthGrid) -> LargestReflectance:
    """Return the largest reflectance of a scene at any wavelength of the grid; 1 where a surface is not matte.

    Glass and mirrors return all light for some direction, and so does every smooth coat at grazing incidence.
    """
    known: dict[int, float | None] = {}
    largest = LargestReflectance(0.0, "", matte=True)
    for item in scene.objects:
        for part in item.parts:
            key = id(part.material)
            if key not in known:
                known[key] = _reflectance(part.material, grid)
            value = known[key]
            if value is None:
                return LargestReflectance(1.0, item.id, matte=False)
            if value > largest.value:
                largest = LargestReflectance(value, item.id, matte=True)
    return largest


def _reflectance(material: Material, grid: WavelengthGrid) -> float | None:
    """Return the largest reflectance of a matte material, or None."""
    if isinstance(material, Translucent):
        return min(1.0, _largest_value(material.reflectance, grid) + _largest_value(material.transmittance, grid))
    if not isinstance(material, Diffuse):
        return None
    if isinstance(material.reflectance, Texture):
        # The curve of a colour is a mean of three that lie in [0, 1], weighted by its linear values.
        return float(srgb_to_linear(int(material.reflectance.pixels.max()) / 255.0))
    return _largest_value(material.reflectance, grid)


def _largest_value(spectrum: Spectrum, grid: WavelengthGrid) -> float:
    """Return the largest value of a piecewise linear curve within the bands: it lies at a knot or at an end."""
    low, high = grid.edges_nm[0], grid.edges_nm[-1]
    knots = spectrum.wavelength_nm
    inside = spectrum.values[(knots >= low) & (knots <= high)]
    return float(max(np.max(inside, initial=0.0), np.max(spectrum.at([low, high]))))


def tail_bound(reflectance: float, depth: int) -> float:
    """Return a bound on the light of paths with more than `depth` segments.

    Relative to the brightest radiance of a surface in direct light: every further segment leaves at most `reflectance` of the
    largest radiance before it, so the sum is reflectance^(depth - 1) / (1 - reflectance).
    """
    return reflectance ** (depth - 1) / (1.0 - reflectance) if reflectance < 1.0 else math.inf


def choose_depth(
    scene: SceneDescription, grid: WavelengthGrid, max_depth: int, *, camera_name: str, skip: bool = True
) -> tuple[int, PlanStep]:
    """Return how many segments paths have, at most `max_depth`, and the decision."""
    what = f"{camera_name}: paths"
    if scene.fog is not None:
        return max_depth, PlanStep(
            what, "run", f"up to {max_depth} segments: {_about_fog(scene, scene.fog, max_depth)}", _LONGER
        )
    largest = largest_reflectance(scene, grid)
    if not largest.matte:
        why = f"up to {max_depth} segments: {largest.object_id!r} is not matte and may return all light"
        return max_depth, PlanStep(what, "run", why, _LONGER)
    enough = _shortest(largest.value, max_depth) if skip else max_depth
    bound = tail_bound(largest.value, enough)
    error = f"{bound:.2g} of the brightest direct light" if bound < 1.0 else _LONGER
    brightest = f"no surface returns more than {largest.value:.2g}"
    if enough < max_depth:
        return enough, PlanStep(what, "skip", f"{enough} of {max_depth} segments suffice: {brightest}", error)
    return max_depth, PlanStep(what, "run", f"up to {max_depth} segments: {brightest}", error)


def _shortest(reflectance: float, max_depth: int) -> int:
    lengths = range(min(_SHORTEST, max_depth), max_depth)
    return next((depth for depth in lengths if tail_bound(reflectance, depth) <= _TAIL_BOUND), max_depth)


def _about_fog(scene: SceneDescription, fog: Fog, max_depth: int) -> str:
    places = np.array([item.to_world[:3, 3] for item in scene.objects]).reshape(-1, 3)
    size_m = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
    if fog.extinction_per_m * size_m > 1.0 and max_depth < _DEPTH_IN_FOG:
        return f"the fog is thick, set quality.max_depth to {_DEPTH_IN_FOG} or more"
    return "fog scatters again and again"
