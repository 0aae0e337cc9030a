"""The lamps of a street: which lamp is in a headlamp or a luminaire, and how bright it is by what standards ask of its kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from fullwell.core.rng import stream
from fullwell.radiometry import Spectrum, scale_to_luminance
from fullwell.scene import Emission, GoniometricLight
from fullwell.schema.conversion.assets import DrawnAsset, lamp_of
from fullwell.schema.v1.traffic import TrafficDocument

if TYPE_CHECKING:
    from fullwell.assets.model import LoadedPart
    from fullwell.traffic.placement import PlacedAsset

__all__ = ["INTENSITY_CD", "bright_as_its_kind", "headlamp_beams", "lamp_material"]

Array = NDArray[np.float64]

INTENSITY_CD: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {
        "headlight": (125.0, 300.0),
        "drl": (400.0, 1200.0),
        "taillight": (4.0, 17.0),
        "brakelight": (60.0, 260.0),
        "indicator_front": (175.0, 1000.0),
        "indicator": (50.0, 500.0),
        "reverselight": (80.0, 300.0),
        "light_": (100.0, 1000.0),
    }
)
"""Least and most luminous intensity on the axis [cd], by how a part's name begins; the first that fits holds.

UN Regulation 148 for lamps of vehicles; EN 12368 for signals, from the least of its first level to the most of its second;
for headlamps what may go above the cut-off (UN Regulation 149: at most 350 cd towards oncoming eyes): the lens sends it to all
sides, and the beam comes on top. See docs/physics/street-lighting.md.
"""

_HALOGEN_SHARE: Final = 0.4
"""Of cars and vans; the others have LED headlamps."""

_STREET_LAMPS: Final[Mapping[str, str]] = MappingProxyType(
    {"led": "street_led", "sodium": "street_hps", "mercury": "street_mercury", "metal_halide": "street_mh"}
)
_OUTPUT_RATIO: Final = 0.75
"""Share of a discharge lamp's flux that leaves its luminaire; fluxes of LED luminaires are what leaves them."""

_LARGEST_CHANGE: Final = 8.0
"""By which a part's luminance is at most corrected: lenses that are seen edge on from ahead stay believable from aside."""


def lamp_material(name: str, item: PlacedAsset, document: TrafficDocument, seed: int) -> str:
    """Return the catalogue's material for a part of an asset: its own, but for what a street decides about its lamps.

    Headlamps of cars and vans are LED or halogen by the seed; street lights have the lamps that `street_lamps` names.
    """
    if name.startswith("lamp/headlight_") and item.asset.asset_class in ("car", "van"):
        halogen = stream(seed, "headlamps", item.id).random() < _HALOGEN_SHARE
        return "lamp/headlight_halogen" if halogen else "lamp/headlight_led"
    if name.startswith("lamp/street_") and document.street_lamps != "asset":
        return f"lamp/{_STREET_LAMPS[document.street_lamps]}"
    return name


def bright_as_its_kind(emission: Emission, lamp: str, part: LoadedPart, item: PlacedAsset) -> Emission:
    """Return a part's light with the intensity that its kind has at least and at most, or the flux that its asset states.

    Street lights send theirs along the road and over it (`traffic.luminaires`).

    The same for all levels of detail: it is the lamp's, and not that of a mesh's area.
    """
    from fullwell.assets.materials.catalogue import asset_material  # noqa: PLC0415 - its tables are read when they are needed
    from fullwell.traffic.luminaires import luminaire_pattern  # noqa: PLC0415 - SUMO is an extra

    entry = asset_material(lamp).lamp
    if entry is None:
        return emission
    corners = part.vertices_m[part.faces.astype(np.int64)]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    luminance = entry.luminance_cd_m2
    if item.role == "light" and "luminous_flux_lm" in item.asset.attributes:
        flux = float(item.asset.attributes["luminous_flux_lm"]) * (1.0 if lamp == "lamp/street_led" else _OUTPUT_RATIO)
        given = flux / (np.pi * float(np.linalg.norm(areas, axis=1).sum()))
    else:
        limits = next((limits for start, limits in INTENSITY_CD.items() if part.name.startswith(start)), None)
        ahead = max(float(np.maximum(areas[:, 0], 0).sum()), float(np.maximum(-areas[:, 0], 0).sum()))
        if limits is None or not ahead > 0:
            return emission
        given = float(np.clip(luminance * ahead, *limits)) / ahead
    change = float(np.clip(given / luminance, 1 / _LARGEST_CHANGE, _LARGEST_CHANGE))
    pattern = luminaire_pattern(corners) if lamp.startswith("lamp/street_") and item.role == "light" else None
    return Emission(emission.radiance.scaled(change), emission.group, pattern)


def headlamp_beams(document: TrafficDocument, item: PlacedAsset, asset: DrawnAsset, seed: int) -> Iterator[GoniometricLight]:
    """Yield the beams of a vehicle's headlamps, from just before the middle of each."""
    from fullwell.traffic.headlamps import beam_patterns  # noqa: PLC0415 - SUMO is an extra

    if "headlight*" not in item.lit:
        return
    to_world = item.to_world()
    forward, up = (_three(to_world[:3, axis]) for axis in (0, 2))
    for part in asset.model.parts:
        material = asset.record(part, "scene.traffic").material.name
        if not part.name.startswith("headlight") or not material.startswith("lamp/headlight"):
            continue
        lamp = lamp_material(material, item, document, seed)
        kind = "halogen" if lamp.endswith("halogen") else "led"
        if item.mover is not None and item.mover.kind == "cyclist":
            kind = "bicycle"
        low, high = part.vertices_m.min(axis=0), part.vertices_m.max(axis=0)
        place = (to_world @ np.array([high[0] + _BEFORE_LENS_M, *((low + high) / 2)[1:], 1.0]))[:3]
        for pattern in beam_patterns(kind, document.headlamps, drives_on=document.drives_on):
            yield GoniometricLight(_three(place), forward, up, pattern, _one_candela(lamp), "headlights", carrier=item.id)


_BEFORE_LENS_M: Final = 0.05


@cache
def _one_candela(lamp: str) -> Spectrum:
    # Luminous intensity is to radiant intensity what luminance is to radiance.
    return scale_to_luminance(lamp_of(lamp), 1.0)


def _three(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
