"""Dirt of a street: which surfaces are covered how far, and their materials under it."""

from __future__ import annotations

import math
from collections.abc import Iterator, MutableMapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.materials.dirt import MOST_COAT, dirty_coat, dirty_reflectance, dust, grime
from fullwell.core.rng import stream
from fullwell.radiometry import Spectrum
from fullwell.scene import Conductor, Diffuse, Emission, Material, Mesh, Principled, RoughPlastic, Texture

__all__ = ["ROAD_DIRT", "by_height", "dirt_of_vehicle", "soiled"]

ROAD_DIRT: Final = {"road": 0.35, "marking": 0.45, "kerb": 0.55, "sidewalk": 0.25}
"""Share that is covered at dirt 1, by the class of a surface: traffic sweeps the carriageway, gutters collect."""

_SPRAY_M: Final = 0.45
"""Height at which the mud that wheels throw has fallen to 1/e."""
_DUST: Final = 0.18
"""Of a vehicle's dirt: settled dust, at all heights; the rest is spray."""
_CLEANEST: Final = 0.35
"""Of the dirtiest vehicle's dirt: what the cleanest of a street has."""
_VEHICLE_STEPS: Final = 6
"""Vehicles of one kind, paint and step of dirt share their triangles."""
_BAND_M: Final = (0.18, 0.34, 0.5, 0.68, 0.9, 1.2)
"""Heights at which vehicles are cut into bands of even dirt."""
_STEPS: Final = 24
"""Coverage is rounded to this share, so that vehicles of one paint share materials."""
_PANES: Final = 0.3
"""Of what lies beside them: panes and lamps are wiped."""


def dirt_of_vehicle(level: float, seed: int, item_id: str) -> float:
    """Return how dirty one vehicle is in [0, 1], seeded by its id and growing with the street's level; 0 where that is 0."""
    if level <= 0:
        return 0.0
    step = int(stream(seed, "dirt", item_id).integers(_VEHICLE_STEPS))
    return level * (_CLEANEST + (1.0 - _CLEANEST) * step / (_VEHICLE_STEPS - 1))


def by_height(mesh: Mesh, dirt: float) -> Iterator[tuple[Mesh, float]]:
    """Yield the mesh of a vehicle's part cut into bands of height, lowest first, each with the share that dirt covers.

    Cut exactly at the heights, with normals and texture coordinates between those of the corners; no area is lost.
    """
    rest: Mesh | None = mesh
    below = -math.inf
    for height in (*_BAND_M, math.inf):
        if rest is None:
            return
        band, rest = _cut(rest, height)
        if band is not None:
            low, high = float(band.vertices_m[:, 2].min()), float(band.vertices_m[:, 2].max())
            middle = 0.5 * (max(low, below) + high)
            yield band, _covered(middle, dirt)
        below = height


def _covered(height_m: float, dirt: float) -> float:
    spray = math.exp(-((max(height_m, 0.0) / _SPRAY_M) ** 2))
    return dirt * (_DUST + (1.0 - _DUST) * spray)


_Kept = MutableMapping[str, tuple[Material, Emission | None]]


def soiled(name: str, clean: Material, coverage: float, kept: _Kept, *, road: bool = False) -> Material:
    """Return a material of which dirt hides a share; `name` tells one material of the scene from others.

    `kept` holds the scene's materials by their text, so that equal ones are one.
    Bodies of clear glass, mirrors, textured parts and people stay clean.
    """
    if name.startswith(("skin/", "hair/")):
        return clean
    wiped = name.startswith(("glass/", "lamp/"))
    step = round(coverage * (_PANES if wiped else 1.0) * _STEPS)
    if step == 0:
        return clean
    key = f"dirty {name} {step} {road}"
    if key not in kept:
        kept[key] = (_under(clean, grime() if road else dust(), step / _STEPS), None)
    return kept[key][0]


def _under(clean: Material, dirt: Spectrum, share: float) -> Material:
    match clean:
        case Diffuse(Spectrum() as reflectance):
            return Diffuse(dirty_reflectance(reflectance, dirt, share))
        case RoughPlastic(Spectrum() as body, roughness, index):
            if share > MOST_COAT:
                return Diffuse(dirt)
            coat = dirty_coat(body, roughness, index, dirt, share)
            return RoughPlastic(coat.body, coat.roughness, coat.interior_index)
        case Conductor(eta, k, roughness):
            # No metal under a mixture: its mirror reflectance as the colour of a surface that is metallic where it is bare.
            bare = _normal_reflectance(eta, k)
            return Principled(dirty_reflectance(bare, dirt, share), _rougher(max(roughness, 0.01), share), 1.0 - share)
        case Principled(base, roughness, metallic, specular) if not isinstance(base, Texture):
            bare_share = 1.0 - share
            return Principled(
                dirty_reflectance(base, dirt, share), _rougher(roughness, share), bare_share * metallic, bare_share * specular
            )
    return clean


def _rougher(roughness: float, share: float) -> float:
    return math.sqrt((1.0 - share) * roughness**2 + share)


def _normal_reflectance(eta: Spectrum, k: Spectrum) -> Spectrum:
    wavelength_nm = np.union1d(eta.wavelength_nm, k.wavelength_nm)
    n, absorption = eta.at(wavelength_nm), k.at(wavelength_nm)
    values = ((n - 1) ** 2 + absorption**2) / ((n + 1) ** 2 + absorption**2)
    return Spectrum(wavelength_nm, values, outside="hold", source=eta.source)


# Cutting -------------------------------------------------------------------------------------------------------------


def _cut(mesh: Mesh, height_m: float) -> tuple[Mesh | None, Mesh | None]:
    """Return what is below a height and what is above it, None for nothing."""
    z = np.asarray(mesh.vertices_m, dtype=np.float64)[:, 2]
    corners = mesh.faces.astype(np.int64)
    high = z[corners] > height_m
    count = high.sum(axis=1)
    if (count == 0).all():
        return mesh, None
    if (count == 3).all():
        return None, mesh
    table = _Corners(mesh)
    below, above = [corners[count == 0]], [corners[count == 3]]
    for single, is_high in ((1, True), (2, False)):
        # The corner that is alone on its side comes first; the triangle falls into one at it and two beyond.
        some = corners[count == single]
        if not len(some):
            continue
        alone = (high[count == single] == is_high).argmax(axis=1)
        a, b, c = (some[np.arange(len(some)), (alone + turn) % 3] for turn in range(3))
        ab, ac = table.between(a, b, height_m), table.between(a, c, height_m)
        tip = np.stack([a, ab, ac], axis=1)
        base = np.concatenate([np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)])
        (above if is_high else below).append(tip)
        (below if is_high else above).append(base)
    return table.mesh(np.concatenate(below)), table.mesh(np.concatenate(above))


class _Corners:
    """Vertices of a mesh with their normals and texture coordinates, and new ones on edges."""

    def __init__(self, mesh: Mesh) -> None:
        columns = [np.asarray(mesh.vertices_m, dtype=np.float64)]
        columns += [np.asarray(more, dtype=np.float64) for more in (mesh.normals, mesh.uv) if more is not None]
        self._rows = np.concatenate(columns, axis=1)
        self._normals, self._uv = mesh.normals is not None, mesh.uv is not None

    def between(self, first: NDArray[np.int64], second: NDArray[np.int64], height_m: float) -> NDArray[np.int64]:
        """Add the points of edges at a height; return their numbers."""
        # From the lower number to the higher: triangles that share an edge get the same point.
        a, b = self._rows[np.minimum(first, second)], self._rows[np.maximum(first, second)]
        share = np.clip((height_m - a[:, 2]) / (b[:, 2] - a[:, 2]), 0.0, 1.0)[:, None]
        made = a + share * (b - a)
        made[:, 2] = height_m
        numbers = len(self._rows) + np.arange(len(made))
        self._rows = np.concatenate([self._rows, made])
        return numbers

    def mesh(self, faces: NDArray[np.int64]) -> Mesh | None:
        """Return the triangles that have an area, with the vertices that they use."""
        corners = self._rows[faces, :3]
        doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        faces = faces[doubled > 0]
        if not len(faces):
            return None
        used, where = np.unique(faces, return_inverse=True)
        rows = self._rows[used]
        normals = rows[:, 3:6] if self._normals else None
        if normals is not None:
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            normals = normals / np.where(length > 0, length, 1.0)
        uv = rows[:, -2:] if self._uv else None
        return Mesh(rows[:, :3], where.reshape(-1, 3).astype(np.uint32), normals, uv)
